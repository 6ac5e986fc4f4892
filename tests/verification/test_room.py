# SPDX-License-Identifier: MIT
"""Metal keeps its room: particles are neither packed nor apart where a sticking pin has stirred them."""

import driver
import numpy as np
import pytest
from scipy.ndimage import label
from scipy.spatial import cKDTree

SHEAR, THICK = 30e6 / np.sqrt(3), 2e-3
STEP = 1e-4                                                    # of the probes [m]
GRADED = {"GRID.LOWER": "0, 0, 0", "GRID.UPPER": "24e-3, 18e-3, 2e-3", "GRID.GRADED": "'xy'", "GRID.GROWTH": 1.3,
          "GRID.FINE": "4e-3, 20e-3, 4e-3, 14e-3", "GRID.LARGEST_CELL": 1.4e-3}
NORTON = {"MATERIAL.LAW": "'norton'", "MATERIAL.NORTON_K": 20e6, "MATERIAL.NORTON_N": 0.1}


def largest_hole(points, pin, radius, spacing):
    """The largest connected hole of the middle plane [mm2]: places farther than 0.95 spacings from any particle."""
    x, y = np.meshgrid(np.arange(1e-3, 23e-3, STEP), np.arange(1e-3, 17e-3, STEP))
    probes = np.stack([x.ravel(), y.ravel(), np.full(x.size, 1e-3)], axis=1)
    far = (cKDTree(points).query(probes)[0] > 0.95 * spacing).reshape(x.shape)
    labels, _ = label(far & (np.hypot(x - pin[0], y - pin[1]) > radius + 0.3 * spacing))
    return np.bincount(labels.ravel())[1:].max(initial=0) * (STEP * 1e3) ** 2


def drawn(seed):
    """Radius of the pin, place, speed and direction of its travel, sense of its spin, and one of: the box of the input, graded
    cells, flat cells, three particles along an axis, a law that depends on the rate."""
    draw = np.random.default_rng(seed)
    x, y = 9e-3 + draw.uniform(-0.5e-3, 0.5e-3, 2)
    radius, angle, sense = draw.uniform(2.5e-3, 3.5e-3), draw.uniform(-0.5, 0.5), draw.choice([-1, 1])
    velocity = f"{4e-3 * np.cos(angle):.6g}, {4e-3 * np.sin(angle):.6g}, 0"
    own = ({}, GRADED, {"GRID.CELL": "1e-3, 1e-3, 0.8e-3", "GRID.UPPER": "27e-3, 21e-3, 2.4e-3", "SHAPE(1).UPPER": "24e-3, 18e-3, 2.4e-3"},
           {"BODY.PARTICLES_PER_CELL": 3}, NORTON)[seed % 5]
    return radius, own | {
        "SHAPE(2).CENTRE": f"{x:.6g}, {y:.6g}, 1e-3", "TOOL.POSITION": f"{x:.6g}, {y:.6g}, -3e-3", "SHAPE(2).RADIUS": radius,
        "TOOL.RADIUS": radius, "MOTION(1).SPIN_RPM": 400 * sense, "MOTION(2).SPIN_RPM": 400 * sense, "MOTION(2).VELOCITY": velocity}


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 10))])
def test_closed_box(seed, tmp_path):
    """A pin that turns and travels in a box that it and the metal fill leaves no slot (disorder alone makes holes of 0.3
    to 0.4 mm2; without the correction 1.6 mm2 after 3.6 mm of way), and its torque is 2 pi r2 k L."""
    radius, sets = drawn(seed)
    driver.run(driver.INPUTS / "closed_box.nml", "--quiet", directory=tmp_path, sets=sets)
    made = driver.Results(tmp_path / "closed_box.out", "closed_box")
    history = made.history()
    points = driver.read_frame(made.path("_000001.hdf"))[0]["x"]
    spacing = 1e-3 / sets.get("BODY.PARTICLES_PER_CELL", 2)
    hole = largest_hole(points, (history["pin_x[m]"][-1], history["pin_y[m]"][-1]), radius, spacing)
    thick = 2.4e-3 if "SHAPE(1).UPPER" in sets else THICK
    torque = np.abs(history["pin_torque[Nm]"][history["time[s]"] > 0.7]).mean() / (2 * np.pi * radius**2 * SHEAR * thick)
    print(f"largest hole {hole:.2f} mm2, torque {torque:.3f} of the exact one")
    assert hole < 0.6
    if "MATERIAL.LAW" not in sets:        # a pin of 2.5 to 3.5 cells: its corners differ with its place on the lattice
        assert abs(torque - 1.0) < (0.05 if seed == 0 else 0.1)
    assert abs(history["audit_error[%]"][-1]) < 0.1
