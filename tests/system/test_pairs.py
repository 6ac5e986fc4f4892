# SPDX-License-Identifier: MIT
"""Every boundary condition on a face, combined with every grid that changes faces (periodic, symmetric, on ranks, graded): a block whose state varies along z alone
is the same on a periodic grid, as the half of itself at a sliding wall, on three ranks and in other cells along z."""

import driver
import pytest

BLOCK = """
&GRID CELL = 1e-3, LOWER = {lower}, UPPER = {upper}{grid} /
&TIME END = {end}, DT = {dt}, MASS_SCALING = {scaling} /
&METHOD PIC_FRACTION = 0, SHAPE = 'bspline', SLEEPING = 'off' /
&MATERIAL NAME = 'metal', DENSITY = 2700, YOUNGS_MODULUS = 70e9, POISSON_RATIO = 0, SPECIFIC_HEAT = 900, CONDUCTIVITY = 120
  T_MELT = 900 /
&OUTPUT HISTORY_INTERVAL = {end}, CHECKPOINT_INTERVAL = {end} /
{walls}
"""
BODY = "&BODY NAME = '{0}', MATERIAL = 'metal', TEMPERATURE = {1} /\n&SHAPE BODY = '{0}', LOWER = {2}, UPPER = {3} /\n"
HEAT = {"end": 0.2, "dt": 5e-4, "scaling": 1e11}
PRESS = {"end": 2e-6, "dt": 2e-8, "scaling": 1}

# What is tried: times of the run, bodies (name, temperature, from z, to z), groups; {half}: share of the block that there is.
FEATURES = {
    "films": (HEAT, [("block", 600, 0, 8)], """&HEAT AMBIENT = 300 /
&SURFACE BODY = 'block', FACE = 'zmax', COEFFICIENT = 8e3, EMISSIVITY = 1 /
&SURFACE BODY = 'block', FACE = 'zmin', COEFFICIENT = 5e3, AMBIENT = 350 /"""),
    "plate": (HEAT, [("block", 600, 0, 8)], """&HEAT AMBIENT = 300 /
&SURFACE BODY = 'block', FACE = 'zmin', COEFFICIENT = 2e4, BACKING = 'plate', BACKING_CONDUCTIVITY = 30
  BACKING_DENSITY = 7800, BACKING_SPECIFIC_HEAT = 460, BACKING_THICKNESS = 3e-3, BACKING_COOLING = 1e3 /"""),
    "lumped": (HEAT, [("block", 600, 0, 8)], """&HEAT AMBIENT = 300 /
&SURFACE BODY = 'block', FACE = 'zmin', COEFFICIENT = 2e4, BACKING = 'lumped', BACKING_CAPACITY = {half}, BACKING_COOLING = 1e3 /"""),
    "gap": (HEAT, [("hot", 600, 4, 8), ("block", 300, 0, 4)], """&HEAT AMBIENT = 300 /
&CONTACT BODY = 'hot', OTHER = 'block', CONDUCTANCE = 5e3 /"""),
    "wall": (HEAT, [("block", 600, 0, 8)], """&HEAT AMBIENT = 300 /
&WALL SIDE = 'zmin', POSITION = 0, TEMPERATURE = 400 /"""),
    "tool": (HEAT, [("block", 600, 0, 8)], """&HEAT AMBIENT = 300 /
&TOOL NAME = 'tool', KIND = 'plane', NORMAL = 0, 0, -1, POSITION = 0, 0, 8e-3, HEATS = 'lumped', HEAT_CAPACITY = {half}
  CONTACT_CONDUCTANCE = 5e3, COOLING = {half}, TEMPERATURE = 300 /
&WALL SIDE = 'zmin', POSITION = 0 /"""),
    "source": (HEAT, [("block", 300, 0, 8)], """&HEAT AMBIENT = 300 /
&SOURCE KIND = 'disc', POWER = {half}E2, POSITION = 2e-3, 2e-3, 8e-3, RADIUS = 2e-2 /"""),
    "traction": (PRESS, [("block", 300, 0, 8)], """&TRACTION BODY = 'block', FACE = 'zmax', PRESSURE = 1e8, RAMP = 1e-6 /
&WALL SIDE = 'zmin', POSITION = 0 /"""),
    "clamp": (PRESS, [("block", 300, 0, 8)], """&CLAMP LOWER = -1, -1, 7e-3, UPPER = 1, 1, 1, COMPONENTS = 'z', VELOCITY = 0, 0, -5 /
&WALL SIDE = 'zmin', POSITION = 0 /"""),
    "load": (PRESS, [("block", 300, 0, 8)], """&LOAD BODY = 'block', FORCE = 0, 0, -{half}E3, RAMP = 1e-6 /
&WALL SIDE = 'zmin', POSITION = 0 /"""),
    "anvil": (PRESS, [("block", 300, 0, 8)], """&TOOL NAME = 'tool', KIND = 'plane', NORMAL = 0, 0, -1, POSITION = 0, 0, 8e-3 /
&MOTION TOOL = 'tool', VELOCITY = 0, 0, -5 /
&WALL SIDE = 'zmin', POSITION = 0 /"""),
    "bodies": (PRESS, [("hot", 300, 4, 8), ("block", 300, 0, 4)], """&CONTACT BODY = 'hot', OTHER = 'block' /
&TRACTION BODY = 'hot', FACE = 'zmax', PRESSURE = 1e8, RAMP = 1e-6 /
&WALL SIDE = 'zmin', POSITION = 0 /"""),
}
# Share of the block, its box in x and y [mm], grid: lower and upper [mm], further keys, walls; ranks; tolerance.
PLACES = {
    "periodic": (1, (0, 4), (0, 4), ", PERIODIC = 'xy'", "", 1, 5e-3),
    "half": (0.5, (2, 4), (-2, 6), "", "&WALL SIDE = 'xmin', POSITION = 2e-3 /", 1, 1e-6),
    "ranks": (1, (0, 4), (-2, 6), "", "", 3, 1e-9),
    "graded": (1, (0, 4), (-2, 6), ", GRADED = 'z', FINE = 0, 4e-3, LARGEST_CELL = 1.25e-3", "", 1, 0.1),
    "graded on all axes": (1, (0, 4), (-2, 6), ", GRADED = 'xyz', FINE = 0, 4e-3, 1e-3, 3e-3, 0, 4e-3, LARGEST_CELL = 1.25e-3", "", 1, 0.1),
}


def numbers(run, directory, feature, place):
    """Temperatures of probes at the end, and energies over the share of the block that there is."""
    times, bodies, groups = FEATURES[feature]
    share, x, side, grid, walls, ranks, _ = PLACES.get(place, (1, (0, 4), (-2, 6), "", "", 1, 0))
    y = (0, 4) if place == "periodic" else (-2, 6)
    text = BLOCK.format(lower=f"{side[0]}e-3, {y[0]}e-3, -3e-3", upper=f"{side[1]}e-3, {y[1]}e-3, 11e-3", grid=grid, walls=walls, **times)
    for name, temperature, low, high in bodies:
        text += BODY.format(name, temperature, f"{x[0]}e-3, 0, {low}e-3", f"{x[1]}e-3, 4e-3, {high}e-3")
    text += "\n".join(f"&PROBE NAME = 'P{z}', POSITION = 2.75e-3, 1.75e-3, {z + 0.75}e-3 /" for z in (0, 3, 4, 7)) + "\n"
    path = directory / f"{place}.nml"
    path.write_text(text + groups.format(half=share) + "\n")
    found = run(path, "--quiet", ranks=ranks, directory=directory).results(place)
    history, probes = found.history(), found.probes()
    energies = {name: history[name][[0, -1]] / share for name in history.names if name.endswith("[J]")}
    return energies, {name: probes[name][-1] for name in probes.names if name.endswith("[K]")}


@pytest.mark.parametrize("feature", FEATURES)
def test_pairs(run, tmp_path, feature):
    """Energies to the tolerance of the place against the largest that changes, temperatures against their largest change."""
    energies, temperatures = numbers(run, tmp_path, feature, "plain")
    size = max(abs(value[1] - value[0]) for value in energies.values())
    rise = max(abs(value - first) for value in temperatures.values() for _, first, *_ in FEATURES[feature][1])
    assert size + rise > 0
    for place, (*_, tolerance) in PLACES.items():
        other, warm = numbers(run, tmp_path, feature, place)
        for name, value in energies.items():
            assert other[name] == pytest.approx(value, rel=1e-9, abs=tolerance * size), (place, name)
        for name, value in temperatures.items():
            assert warm[name] == pytest.approx(value, abs=tolerance * rise), (place, name)
