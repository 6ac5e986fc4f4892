# SPDX-License-Identifier: MIT
"""Problems with other parameters than those of the shipped inputs: seeded draws of each on a coarse grid, one in
every run of the tests, two more in the long ones. LONG, of which test_problems runs the shipped parameters, are drawn in the
long ones alone."""

import numpy as np
import problems
import pytest

# Problem: resolution, largest error there, range of each parameter.
DRAWS = {
    "waves2d": (16, 0.03, {"amplitude": (0.02, 0.1)}),
    "standing_wave": (16, 0.12, {"amplitude": (1e-5, 1e-3)}),
    "bar_mode": (13, 0.01, {"length": (5.0, 50.0)}),
    "bar_impact": (50, 0.05, {"length": (0.02, 0.1), "speed": (0.3, 3.0), "young": (3e8, 3e9), "density": (500.0, 5000.0)}),
    "bar_gravity": (12, 0.05, {"gravity": (1e3, 8e3), "young": (5e8, 2e9), "density": (800.0, 2000.0)}),
    "friction_block": (1, 0.01, {"friction": (0.1, 0.9), "push": (10.0, 40.0), "press": (20.0, 60.0)}),
    "incline_block": (4, 0.02, {"angle": (15.0, 45.0), "friction": (0.1, 0.8)}),
    "incline_cylinder": (16, 0.04, {"angle": (15.0, 45.0), "friction": (0.1, 0.8)}),
    "heat_step": (20, 0.01, {"time": (0.05, 0.2), "cells_flown": (0.0, 3.0)}),
    "heat_robin": (8, 0.01, {"biot": (0.3, 3.0), "fourier": (0.3, 1.5)}),
    "heat_mode": (8, 0.01, {"fourier": (0.05, 0.2)}),
    "heat_insulated": (16, 2e-3, {"fourier": (0.05, 0.2), "number": (0.08, 0.2)}),
    "heat_fixed": (16, 2e-3, {"fourier": (0.05, 0.2), "number": (0.08, 0.2)}),
    "heat_friction": (16, 0.06, {"friction": (0.1, 0.6), "pressure": (5e6, 2e7), "speed": (0.5, 2.0)}),
    "jc_element": (2, 0.02, {"m": (0.7, 1.3), "squeeze": (0.3, 0.6)}),
    "punch_plane": (4, 0.05, {"speed": (0.2, 0.5), "friction": (0.0, 0.3), "width": (5.0, 7.0)}),
    "punch_elastic": (2, 0.06, {"poisson": (0.1, 0.4), "depth": (0.015, 0.025)}),
    "hertz_line": (40, 0.08, {"press": (0.015, 0.03)}),
    "couette": (8, 0.03, {"k": (3e5, 1e6), "rpm": (700.0, 1000.0)}),
    "tube": (8, 0.05, {"poisson": (0.1, 0.49), "pressure": (0.5, 2.0)}),
    "tool_torque": (6, 0.04, {"friction": (0.1, 0.6)}),
    "cantilever": (3, 0.02, {"load": (4e3, 14e3)}),
    "source_plate": (1, 0.02, {"speed": (5e-4, 2e-3), "power": (800.0, 2000.0)}),
    "waves3d": (8, 0.15, {"amplitude": (0.02, 0.1)}),
    "vortex": (48, 0.05, {"amplitude": (0.1, 0.3)}),
    "ring": (16, 0.05, {"amplitude": (0.03, 0.12)}),
    "column": (8, 0.05, {"height": (20.0, 80.0), "young": (7e5, 3e6), "density": (50.0, 120.0), "gravity": (5.0, 15.0)}),
    "friction_push": (2, 0.01, {"friction": (0.1, 0.9), "push": (20.0, 50.0), "press": (20.0, 60.0), "time": (1e-3, 2e-3)}),
    "incline_sphere": (8, 0.05, {"angle": (15.0, 45.0), "friction": (0.1, 0.8)}),
    "hertz_sphere": (12, 0.08, {"press": (0.03, 0.05)}),
    "punch_circle": (3, 0.05, {"speed": (0.3, 0.6)}),
    "tube_limit": (8, 0.05, {"yield_stress": (7e5, 1.5e6), "rise": (0.5, 0.8)}),
    "discs_nairn": (5, 0.04, {"speed": (3.0, 8.0)}),
}
# Without a draw: taylor, whose exact figures are those of one shot; discs, whose draw is discs_anyhow (test_problems);
# hertz_impact, whose contact is a cell wide where a run is cheap.

LONG = {"hertz_line", "incline_sphere", "cantilever", "couette", "incline_cylinder"}


@pytest.mark.parametrize(
    "name, seed",
    [pytest.param(name, k, marks=[pytest.mark.long] if k or name in LONG else []) for name in DRAWS for k in range(2 if name in LONG else 3)],
)
def test_draw(name, seed, tmp_path):
    """Exact: see the problem; what its shipped parameters keep at this resolution holds for any."""
    n, most, ranges = DRAWS[name]
    draw, problem = np.random.default_rng(seed), problems.ALL[name]
    parameters = problem.parameters | {key: float(draw.uniform(*limits)) for key, limits in ranges.items()}
    error, figures, seconds = problem.solve(n, parameters, tmp_path)
    print(f"{name} n = {n}: error {error:.4%} of {most:.2%}, {seconds:.1f} core-seconds, {parameters}, {figures}")
    assert error <= most
