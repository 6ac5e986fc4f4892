# SPDX-License-Identifier: MIT
"""The quick form of flips.py: no flipped bit of a checkpoint goes unnoticed."""

import flips
import pytest


@pytest.mark.parametrize("kind", flips.KINDS)
def test_no_flipped_bit_is_silent(kind):
    """Exact: 6 bits at random places of each kind of checkpoint: refused, or without any effect."""
    assert flips.study(kind, 6, seed=2) == []
