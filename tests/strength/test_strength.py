# SPDX-License-Identifier: MIT
"""Metal without strength takes no heat of friction and transmits no shear, in drawn scenes (drawn_scenes.py)."""

import os
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import drawn_scenes as scenes

FIRST = int(os.environ.get("STIRPOINT_SEED", 1))
GROUP = 3


@pytest.mark.parametrize("group", range(20))
def test_no_heat_without_strength(group, tmp_path):
    """The hottest metal is at most 20 K above its solidus, whatever the scene."""
    for seed, _, wrong, text in scenes.run_scenes(GROUP, FIRST + GROUP * group, tmp_path):
        assert not wrong, (seed, wrong, text)
