# SPDX-License-Identifier: MIT
"""Pictures and the page."""
