# SPDX-License-Identifier: MIT
"""Explicit conduction of the particles at its default step: stable at corners, wherever the grid lies."""

import numpy as np
import pytest

OFFSETS = [(0, 0, 0), (0.13, 0.29, 0.41), (0.5, 0.5, 0.5), (0.45, 0.05, 0.25)]


@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
@pytest.mark.parametrize("offset", OFFSETS)
def test_hot_corner_evens_out(run, shape, offset):
    """Of a corner 100 K hotter the mean remains after 270 conduction steps, everywhere to 0.01 K (exact: the
    slowest mode has decayed to 1e-23), and the heat content stays to rounding."""
    lower = [-3e-3 - 1e-3*a for a in offset]
    sets = {"METHOD.SHAPE": shape, "GRID.LOWER": ",".join(map(str, lower)),
            "GRID.UPPER": ",".join(str(a + 13e-3) for a in lower)}
    results = run("hot_corner", "--quiet", sets=sets).results("hot_corner")
    heat = results.history()["heat_content[J]"]
    assert abs(heat[-1] / heat[0] - 1.0) < 1e-9
    temp = results.checkpoint().temp
    print(temp.min(), temp.max())
    assert np.abs(temp - (300.0 + 100.0 * (2.0 / 5.0)**3)).max() < 0.01
