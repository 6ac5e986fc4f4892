# SPDX-License-Identifier: MIT
"""The quick form of flips.py: no flipped bit of a checkpoint goes unnoticed, no hostile number of a sealed one harms."""

import flips
import pytest


@pytest.mark.parametrize("kind", flips.KINDS)
def test_no_flipped_bit_is_silent(kind):
    """Exact: 6 bits at random places of each kind of checkpoint: refused, or without any effect."""
    assert flips.study(kind, 6, seed=2) == []


@pytest.mark.parametrize("kind", flips.KINDS)
def test_hostile_numbers(kind):
    """Exact: 4 numbers of each kind of checkpoint, changed under a right seal, on two numbers of ranks: refused, or the run ends
    with finite results or says why it broke down."""
    assert flips.study(kind, 4, seed=2, spoil=flips.change) == []
