# SPDX-License-Identifier: MIT
"""Keys of an input from measurements."""
