# SPDX-License-Identifier: MIT
"""What a run shows: figures, without pictures."""
