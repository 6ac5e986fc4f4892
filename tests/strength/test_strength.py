# SPDX-License-Identifier: MIT
"""Metal without strength takes no heat of friction, in drawn scenes of thin hot metal and tools (drawn_scenes.py)."""

import os
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import drawn_scenes as scenes

FIRST = int(os.environ.get("STIRPOINT_SEED", 1))


@pytest.mark.parametrize("group", [pytest.param(k, marks=[pytest.mark.long] if k > 0 else []) for k in range(6)])
def test_no_heat_without_strength(group, tmp_path):
    """The hottest metal is at most 20 K above its solidus, whatever the scene."""
    for seed, status, above, said, text in scenes.run_scenes(10, FIRST + 10 * group, tmp_path):
        assert status == scenes.driver.WELL, (seed, said, text)
        assert above <= scenes.MOST, (seed, text)
