# SPDX-License-Identifier: MIT
"""Metal keeps its room: particles are neither packed nor apart where a sticking pin has stirred them."""

import driver
import numpy as np
import pytest
from scipy.ndimage import label
from scipy.spatial import cKDTree

SHEAR, THICK = 30e6 / np.sqrt(3), 1e-3
STEP = 1e-4                                                    # of the probes [m]
GRADED = {"GRID.LOWER": "0, 0, 0", "GRID.UPPER": "24e-3, 18e-3, 1e-3", "GRID.GRADED": "'xy'", "GRID.GROWTH": 1.3,
          "GRID.FINE": "4e-3, 20e-3, 4e-3, 14e-3", "GRID.LARGEST_CELL": 1.4e-3}
NORTON = {"MATERIAL.LAW": "'norton'", "MATERIAL.NORTON_K": 20e6, "MATERIAL.NORTON_N": 0.1}


def largest_hole(points, pin, radius, spacing, sides=(24e-3, 18e-3)):
    """The largest connected hole of the middle plane [mm2] outside the pin: places farther than 0.95 spacings from any
    particle."""
    x, y = (np.arange(1e-3, side - 1e-3, STEP) for side in sides)
    x, y = np.meshgrid(x, y)
    probes = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.5 * THICK)], axis=1)
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
    own = ({}, GRADED, {"GRID.CELL": "1e-3, 1e-3, 0.8e-3", "GRID.UPPER": "27e-3, 21e-3, 0.8e-3", "SHAPE(1).UPPER": "24e-3, 18e-3, 0.8e-3"},
           {"BODY.PARTICLES_PER_CELL": 3}, NORTON)[seed % 5]
    return radius, own | {
        "SHAPE(2).CENTRE": f"{x:.6g}, {y:.6g}, 0.5e-3", "TOOL.POSITION": f"{x:.6g}, {y:.6g}, -3e-3", "SHAPE(2).RADIUS": radius,
        "TOOL.RADIUS": radius, "MOTION(1).SPIN_RPM": 400 * sense, "MOTION(2).SPIN_RPM": 400 * sense, "MOTION(2).VELOCITY": velocity}


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 10))])
def test_closed_box(seed, tmp_path):
    """A pin that turns and travels in a box that it and the metal fill leaves no slot (disorder alone makes holes of 0.3
    to 0.6 mm2; without the correction 1.6 mm2 after 3.6 mm of way), and its torque is 2 pi r2 k L."""
    radius, sets = drawn(seed)
    driver.run(driver.INPUTS / "closed_box.nml", "--quiet", directory=tmp_path, sets=sets)
    made = driver.Results(tmp_path / "closed_box.out", "closed_box")
    history = made.history()
    points = driver.read_frame(made.path("_000001.hdf"))[0]["x"]
    spacing = 1e-3 / sets.get("BODY.PARTICLES_PER_CELL", 2)
    hole = largest_hole(points, (history["pin_x[m]"][-1], history["pin_y[m]"][-1]), radius, spacing)
    thick = 0.8e-3 if "SHAPE(1).UPPER" in sets else THICK
    torque = np.abs(history["pin_torque[Nm]"][history["time[s]"] > 0.7]).mean() / (2 * np.pi * radius**2 * SHEAR * thick)
    print(f"largest hole {hole:.2f} mm2, torque {torque:.3f} of the exact one")
    assert hole < (0.6 if seed < 10 else 0.75)
    if "MATERIAL.LAW" not in sets:        # a pin of 2.5 to 3.5 cells: its corners differ with its place on the lattice
        assert abs(torque - 1.0) < (0.05 if seed == 0 else 0.1)
    assert abs(history["audit_error[%]"][-1]) < 0.1


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 6))])
def test_hole_pressed_shut(seed, tmp_path):
    """A piston shuts a hole in metal that fills a box. When some 2.5 % of its area are left, no more is open than what is left and
    what the metal is compressed by, within 0.7 mm2; when a seventh of it too much has been pressed in, the pressure is K dV/V within
    15 % (without the bound of the pressure around voids 1.6 times). Drawn holes are notched by the lattice: 1.5 mm2 and 25 %."""
    draw = np.random.default_rng(seed)
    radius, (x, y) = (3e-3, (18e-3, 12e-3)) if seed == 0 else (draw.uniform(2.5e-3, 3.2e-3), draw.uniform((16e-3, 11e-3), (20e-3, 13e-3)))
    wide, long, thick, modulus, spacing = 24e-3, 36e-3, 1e-3, 70e9 / 3 / (1 - 0.66), 0.5e-3
    times = [part * np.pi * radius**2 / wide / 2e-3 + 0.025 for part in (0.975, 1.146)]
    driver.run(driver.INPUTS / "hole_pressed_shut.nml", "--quiet", directory=tmp_path, sets={
        "TIME.END": times[1], "OUTPUT.FRAME_INTERVAL": times[0], "SHAPE(2).RADIUS": radius,
        "SHAPE(2).CENTRE": f"{x:.6g}, {y:.6g}, 0.5e-3"})
    made = driver.Results(tmp_path / "hole_pressed_shut.out", "hole_pressed_shut")
    points = driver.read_frame(made.path("_000001.hdf"))[0]["x"]
    history = made.history()
    metal = len(points) * spacing**3 / thick                  # its area without pressure [m2]
    pressures = np.abs(history["piston_force_x[N]"]) / (wide * thick)
    then = np.argmin(np.abs(history["time[s]"] - times[0]))
    left = wide * history["piston_x[m]"][then] - metal * (1.0 - pressures[then] / modulus)
    found = largest_hole(points, (0, 0), 0, spacing, (long, wide))
    exact = modulus * (1.0 - wide * history["piston_x[m]"][-1] / metal)
    print(f"{found:.2f} of {left * 1e6:.2f} mm2 open under {pressures[then] / 1e6:.0f} MPa; {pressures[-1] / 1e6:.0f} for {exact / 1e6:.0f} MPa")
    assert found < left * 1e6 + (0.7 if seed == 0 else 1.5)
    assert abs(pressures[-1] / exact - 1.0) < (0.15 if seed == 0 else 0.25)
    assert abs(history["audit_error[%]"][-1]) < 0.1


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 4))])
def test_metal_between_a_tip_and_a_wall_stays(seed, tmp_path):
    """Metal that a tip stirs a tenth of a cell or so above a wall stays in front of all walls."""
    draw = np.random.default_rng(seed)
    gap, sense = draw.uniform(0.03e-3, 0.15e-3), draw.choice([-1, 1])
    sets = {"MOTION(1).VELOCITY": f"0, 0, {-(1.75e-3 - gap) / 0.3:.6g}", "MOTION(1).SPIN_RPM": 600 * sense, "MOTION(2).SPIN_RPM": 600 * sense}
    driver.run(driver.INPUTS / "pin_tip.nml", "--quiet", directory=tmp_path, sets=sets)
    made = driver.Results(tmp_path / "pin_tip.out", "pin_tip")
    first, last = (driver.read_frame(path)[0] for path in (made.path("_000000.hdf"), made.path("_000007.hdf")))
    assert made.history()["debris_mass[kg]"][-1] == 0.0 and len(last["x"]) == len(first["x"])
    assert last["x"].min() > 0.0 and last["x"][:, :2].max() < 10e-3
    assert last["plastic_strain"].max() > 10.0


@pytest.mark.parametrize("side", ["xmax", *(pytest.param(side, marks=pytest.mark.long) for side in ("xmin", "ymin", "ymax"))])
def test_metal_between_a_pin_and_a_wall_stays(side, tmp_path):
    """Metal that a pin stirs beside a wall, a twentieth of a cell away, stays in front of it."""
    axis, faces_up = "xy".index(side[0]), side.endswith("min")
    place, wall = [9e-3, 9e-3], 0.0 if faces_up else (24e-3, 18e-3)[axis]
    place[axis] = wall + (3.05e-3 if faces_up else -3.05e-3)
    x, y = (f"{value:.6g}" for value in place)
    sets = {"SHAPE(2).CENTRE": f"{x}, {y}, 0.5e-3", "TOOL.POSITION": f"{x}, {y}, -3e-3", "MOTION(2).VELOCITY": "0, 0, 0", "TIME.END": 0.7}
    driver.run(driver.INPUTS / "closed_box.nml", "--quiet", directory=tmp_path, sets=sets)
    last = driver.read_frame(driver.Results(tmp_path / "closed_box.out", "closed_box").path("_000001.hdf"))[0]
    before = (last["x"][:, axis] - wall) * (1.0 if faces_up else -1.0)
    assert before.min() > 0.0 and last["plastic_strain"].max() > 10.0
