# SPDX-License-Identifier: MIT
"""Grids graded along one, two and three axes: patch tests, order, heat, tools, ranks, restart, output, input."""

import re

import driver
import numpy as np
import pytest

AXES = "xyz"


def graded(axes, edges, fine, growth, largest):
    """Sets of a grid of so large cells, graded along axes, with the ends of the fine part on each or on all of them."""
    fine = fine if len(fine) == 2 * len(axes) else fine * len(axes)
    return {"METHOD.SHAPE": "bspline", "GRID.CELL": ",".join(map(str, edges)), "GRID.GRADED": axes,
            "GRID.FINE": ",".join(map(str, fine)), "GRID.GROWTH": growth, "GRID.LARGEST_CELL": largest}


@pytest.mark.parametrize("axes", [*AXES, "xy", "yz", "xyz"])
@pytest.mark.parametrize("per_cell", [2, 3])
def test_uniform_stress(run, axes, per_cell):
    """Exact: a block that starts stretched between walls on all sides stays at rest, whatever its cells: its particles
    have the mass of the block, and no node feels a force (1e-11 m/s)."""
    edges = [0.25e-3 if axis in axes else edge for axis, edge in zip(AXES, (0.4e-3, 0.5e-3, 0.8e-3))]
    sets = graded(axes, edges, (1e-3, 1.5e-3), 1.25, 0.7e-3) | {"BODY.PARTICLES_PER_CELL": per_cell, "TIME.END": 2e-4}
    state = run("stretched", "--quiet", sets=sets).results("stretched").checkpoint()
    stress = state.tau.std(axis=0) / np.abs(state.tau).max()
    print(axes, per_cell, len(state.x), np.abs(state.v).max(), stress.max(), np.unique(state.mass.round(12)).size)
    assert np.abs(state.v).max() < 1e-11 and stress.max() < 1e-10
    assert state.mass.sum() == pytest.approx(64e-9 * 1000 / (1.3 * 0.8 * 1.1), rel=1e-12)
    assert state.mass.max() > 2 ** len(axes) * state.mass.min()


SLAB = """&RUN TITLE = 'Slab between two walls' /
&GRID CELL = 1e-3, LOWER = 0, 0, 0, UPPER = {upper} /
&TIME END = 0.3, MASS_SCALING = 1e10 /
&MATERIAL NAME = 'copper', DENSITY = 8960, YOUNGS_MODULUS = 124e9, POISSON_RATIO = 0.34
  SPECIFIC_HEAT = 386, CONDUCTIVITY = 391 /
&BODY NAME = 'slab', MATERIAL = 'copper', TEMPERATURE = 350 /
&SHAPE BODY = 'slab', LOWER = 0, 0, 0, UPPER = {upper} /
{walls}&HEAT AMBIENT = 298 /
&PROBE NAME = 'inside', POSITION = {inside} /
&OUTPUT CHECKPOINT_INTERVAL = 0.3 /
"""


@pytest.mark.parametrize("axis, axes", [*zip(AXES, AXES), ("x", "xz"), ("y", "xyz")])
def test_linear_temperature(run, tmp_path, axis, axes):
    """Exact: between walls of 300 and 500 K across a graded axis the temperature becomes linear at all particles and
    at a probe, to 0.01 K of 200 K: with two particles in a cell a node's mean is 0.3 % off the centre of its function,
    which is 0.1 cells from the node (without that distance 2.1 K). The body gets the heat that the walls give."""
    a = AXES.index(axis)
    edges, upper = ([value if x in axes else 1e-3 for x in AXES] for value in (0.25e-3, 4e-3))
    inside = [2.9e-3 if x == axis else 0.3e-3 for x in AXES]
    walls = "".join(f"&WALL SIDE = '{x}min' /\n&WALL SIDE = '{x}max' /\n" for x in AXES)
    walls = walls.replace(f"'{axis}min'", f"'{axis}min', TEMPERATURE = 300").replace(
        f"'{axis}max'", f"'{axis}max', TEMPERATURE = 500")
    path = tmp_path / "slab.nml"
    words = {"upper": upper, "inside": inside}
    path.write_text(SLAB.format(walls=walls, **{key: ", ".join(map(str, value)) for key, value in words.items()}))
    results = run(str(path), "--quiet", sets=graded(axes, edges, (1e-3, 1.5e-3), 1.25, 0.7e-3)).results("slab")
    state = results.checkpoint()
    exact = 300 + 200 * state.x[:, a] / 4e-3
    probe = results.probes()["inside[K]"][-1]
    history = results.history()
    content, given = history["heat_content[J]"], history["wall_heat[J]"][-1]
    print(axes, len(state.x), np.abs(state.temp - exact).max(), probe)
    assert np.abs(state.temp - exact).max() < 1e-2
    assert probe == pytest.approx(300 + 200 * 2.9 / 4, abs=1e-2)
    assert content[-1] - content[0] == pytest.approx(given, abs=1e-9 * content[-1]) and given > 0.0   # ten digits


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("side", ["min", "max"])
def test_film_of_one_side(run, tmp_path, axis, side):
    """Exact: a film on one face across the graded axis takes h A (T - T_a) t, to the 1e-4 by which the face cools, and cools the
    particles there."""
    a = AXES.index(axis)
    edges, upper, inside = [1e-3] * 3, [1e-3] * 3, [0.3e-3] * 3
    edges[a], upper[a], inside[a] = 0.25e-3, 4e-3, 2.9e-3
    film = f"&SURFACE BODY = 'slab', FACE = '{axis}{side}', COEFFICIENT = 100 /\n"
    path = tmp_path / "slab.nml"
    words = {"upper": upper, "inside": inside}
    path.write_text(SLAB.format(walls=film, **{key: ", ".join(map(str, value)) for key, value in words.items()}))
    sets = graded(axis, edges, (1e-3, 1.5e-3), 1.25, 0.7e-3) | {"TIME.END": 1e-3, "OUTPUT.CHECKPOINT_INTERVAL": 1e-3}
    results = run(str(path), "--quiet", sets=sets).results("slab")
    history, state = results.history(), results.checkpoint()
    assert (state.x[state.temp.argmin(), a] < 2e-3) == (side == "min")
    lost = history["heat_content[J]"][0] - history["heat_content[J]"][-1]
    assert lost == pytest.approx(100 * 1e-6 * 52 * 1e-3, rel=1e-3)


@pytest.mark.parametrize("phase", [0.0, 0.5 * np.pi])
def test_standing_wave(run, tmp_path_factory, phase):
    """Exact: the wave of test_fields in cells of 1 to 4 mm, and all of them half as long: the rms error of the
    displacement falls with order above 1.8 to below 1.5 % of A, that of the velocity with order above 1.8."""
    errors = []
    for half in (1, 2):
        sets = graded("x", (1e-3 / half, 4e-3, 4e-3), (30e-3, 34e-3), 1.2 ** (1 / half), 4e-3 / half)
        sets |= {"FIELD.PHASE": f"{phase},0,0", "TIME.DT": 0.4e-6 / half}
        place = tmp_path_factory.mktemp("mode")
        done = run("mode", "--quiet", sets=sets, directory=place)
        errors.append(driver.Table(done.results("mode").path("_errors.csv")))
    for name in ("bar_displacement_rms[m]", "bar_velocity_rms[m/s]"):
        order = np.log2(errors[0][name].max() / errors[1][name].max())
        print(name, errors[0][name].max(), errors[1][name].max(), order)
        assert order > 1.8
    assert errors[1]["bar_displacement_rms[m]"].max() < 1.5e-2 * 1e-6


@pytest.mark.parametrize("integrator", ["explicit", "backward-euler"])
def test_heat_mode(run, tmp_path_factory, integrator):
    """Exact: the decaying cosine of test_conduction in cells of 0.5 to 2 mm, with explicit and implicit steps, to 0.5 K
    of 50 K, as in cells of 2 mm; explicit ones to 0.25 K and 0.1 K rms (0.13 K with increments at the nodes and not at the
    centres of their functions)."""
    sets = graded("x", (0.5e-3, 2e-3, 2e-3), (10e-3, 12e-3), 1.2, 2e-3) | {"HEAT.INTEGRATOR": integrator}
    if integrator == "backward-euler":
        sets |= {"HEAT.STEP": 5e-3}
    results = run("heat_mode", "--quiet", sets=sets).results("heat_mode")
    table = driver.Table(results.path("_errors.csv"))
    error, rms = (table[f"bar_temperature_{norm}[K]"].max() for norm in ("max", "rms"))
    print(integrator, error, rms)
    assert error < 0.5
    assert integrator == "backward-euler" or (error < 0.25 and rms < 0.1)


KEYS = ("GRID.GRADED", "GRID.FINE", "GRID.GROWTH", "GRID.LARGEST_CELL")


CELLS = {"z": ((4e-3, 4e-3, 1e-3), (8e-3, 14e-3)),
         "yz": ((4e-3, 2e-3, 1e-3), (8e-3, 32e-3, 8e-3, 14e-3)),
         "xyz": ((2e-3, 2e-3, 1e-3), (8e-3, 36e-3, 8e-3, 32e-3, 8e-3, 14e-3))}


def stirred(axes="z", **more):
    """Sets of the short stirring in cells of 1 to 4 mm in depth, of 2 to 4 mm along other graded axes."""
    sets = graded(axes, *CELLS[axes], 1.3, 4e-3)
    return sets | {"METHOD.SLEEPING": "off", "TIME.END": 0.04, "OUTPUT.CHECKPOINT_INTERVAL": 0.02,
                   "MOTION(1).VELOCITY": "0,0,-20e-3", "TIME.MASS_SCALING": 1e6} | more


@pytest.mark.parametrize("axes", ["z", "xyz"])
def test_stirring_on_ranks_and_after_a_restart(run, tmp_path_factory, axes):
    """Exact: the graded plate, stirred with heat and friction, is the same on one and two ranks (to 1e-6 of the
    largest), and a run that goes on from a checkpoint has the same doubles."""
    more = {"TIME.END": 0.024, "OUTPUT.CHECKPOINT_INTERVAL": 0.012}
    fields = ["x", "v", "tau", "temp"]
    whole = run("stir", "--quiet", ranks=2, sets=stirred(axes, **more)).results("stir")
    alone = run("stir", "--quiet", sets=stirred(axes, **more), directory=tmp_path_factory.mktemp("one")).results("stir").checkpoint()
    apart = driver.distance(alone, whole.checkpoint(), fields)
    print(apart, whole.history()["tool_force_z[N]"][-1])
    assert max(apart.values()) <= 1e-6, apart
    assert whole.history()["tool_force_z[N]"][-1] > 1000.0
    place = tmp_path_factory.mktemp("parts")
    steps = {"TIME.MAX_STEPS": 3 * whole.checkpoint().step // 4}
    part = run("stir", "--quiet", ranks=2, sets=stirred(axes, **more, **steps), directory=place).results("stir")
    assert part.checkpoint().step < whole.checkpoint().step
    run("stir", "--quiet", "--restart", part.path("_checkpoint.h5"), ranks=2, sets=stirred(axes, **more), directory=place)
    assert max(driver.distance(part.checkpoint(), whole.checkpoint(), fields).values()) == 0.0


@pytest.mark.parametrize("axes, fewer", [("z", 0.75), ("yz", 0.7), ("xyz", 0.6)])
def test_stirring_as_in_equal_cells(run, tmp_path_factory, axes, fewer):
    """Under a tool in the fine part of the grid the plate bears what it bears in cells as fine everywhere:
    force and torque within 1 % in the mean of 40 rows (layers reach the tool a little earlier or later, which is 2 % of a row), the rise
    of the hottest metal too; with fewer particles. Without SELECTIVE_SCALING, which graded cells cannot have."""
    rows, particles, long = [], [], stirred(axes, **{"TIME.END": 0.1, "METHOD.SELECTIVE_SCALING": "off"})
    for sets in (long, {key: long[key] for key in long if key not in KEYS}):
        place = tmp_path_factory.mktemp("stir")
        results = run("stir", "--quiet", sets=sets, directory=place).results("stir")
        rows.append(results.history())
        particles.append(len(results.checkpoint().x))
    print(particles, [[table[name][-1] for name in ("tool_force_z[N]", "tool_torque[Nm]", "temperature_max[K]")]
                      for table in rows])
    assert particles[0] <= fewer * particles[1]
    for name in ("tool_force_z[N]", "tool_torque[Nm]"):
        one, other = (table[name][-40:].mean() for table in rows)
        assert one == pytest.approx(other, rel=1e-2), name
    one, other = (table["temperature_max[K]"][-40:].mean() for table in rows)
    print(one, other)
    assert one == pytest.approx(other, abs=0.01 * (other - 298.0))


def test_restart_in_another_grading_is_refused(run):
    """The grading of a grid cannot change at a restart; the message names the key."""
    sets = stirred() | {"TIME.MAX_STEPS": 5, "OUTPUT.CHECKPOINT_INTERVAL": 0}
    part = run("stir", "--quiet", sets=sets).results("stir")
    done = run("stir", "--restart", part.path("_checkpoint.h5"), sets=sets | {"GRID.GROWTH": 1.25},
               expect=driver.BAD_INPUT)
    assert "GROWTH" in done.out + done.err


def test_check_says_the_cells(run):
    """--check names the shortest and the longest cell; a plate fills its volume wherever between the nodes it ends."""
    sets = {"SHAPE.LOWER": "0,0,1.3e-3", "SHAPE.UPPER": "48e-3,40e-3,11.77e-3"}
    done = run("stir", "--check=scene", sets=stirred() | sets)
    assert re.search(r"cells of 4 x 4 x 1 to 4 along z mm", done.out), done.out
    assert re.search(r"20102.4 mm3 for 20102.4 mm3 required \([+-]0.00 %\)", done.out), done.out


WRONG = [
    ({"GRID.FINE": "8e-3,13.5e-3"}, "whole number of cells"),
    ({"GRID.FINE": "14e-3,8e-3"}, "the lower one first"),
    ({"GRID.GRADED": "yz"}, "two places along each of the axes yz"),
    ({"GRID.FINE": "8e-3,33e-3"}, "the lower one first"),
    ({"GRID.FINE": "1.5e-3,14.5e-3"}, "no cells that grow"),
    ({"GRID.LARGEST_CELL": 1e-3}, "must be more than the edge 1 mm"),
    ({"GRID.PERIODIC": "z"}, "cannot be periodic"),
    ({"METHOD.SHAPE": "ugimp"}, "must be bspline"),
    ({"METHOD.TRANSFER": "apic"}, "cannot be apic"),
    ({"BODY.LATTICE": "round"}, "cannot be round"),
    ({"GRID.GRADED": "none"}, "only with GRADED = x or y or z or xy"),
    ({"GRID.GROWTH": 0.9}, "GROWTH"),
]


@pytest.mark.parametrize("sets, said", WRONG)
def test_wrong_gradings(run, sets, said):
    """What makes no grid, or does not go with a graded one, is refused with its reason."""
    done = run("stir", "--check=scene", sets=stirred() | sets, expect=driver.BAD_INPUT)
    assert said in done.err, done.err


@pytest.mark.parametrize("axis, upper", [("x", 12.0), ("y", 12.0), ("z", 8.0)])
def test_pressure_that_belongs_to_the_stress(run, axis, upper):
    """Exact: the warm block with a bite and a hole of test_tractions in cells of 0.5 to 1 mm, its ends at nodes of the
    graded axis: under the pressure on all its faces nothing moves (1e-9 m/s; without the traction 6 m/s)."""
    a = AXES.index(axis)
    edges, corner = [1e-3] * 3, [12.5e-3, 12e-3, 8e-3]
    edges[a], corner[a] = 0.5e-3, 1e-3 * upper
    sets = graded(axis, edges, (3e-3, 5e-3), 2.0, 1e-3) | {"METHOD.SCHEME": "usavg"}
    sets["SHAPE(1).UPPER"] = ",".join(map(str, corner))
    sets["SHAPE(1).LOWER"] = "3.5e-3,3.5e-3,3.5e-3"
    state = run("pressed", "--quiet", sets=sets).results("pressed").checkpoint()
    print(axis, len(state.x), np.abs(state.v).max())
    assert state.mass.max() > 1.9 * state.mass.min()
    assert np.abs(state.v).max() < 1e-9
    assert state.tau[:, :3] == pytest.approx(-104.84265738194498e6, rel=1e-9)


def test_block_between_nodes_under_pressure(run):
    """The same block with ends between nodes, where rows of particles lie across the edges of spans: what is left of the
    forces moves it by less than 3 % of what the pressure alone would (0.2 of 6 m/s), and not as a whole."""
    sets = graded("z", (1e-3, 1e-3, 0.5e-3), (4e-3, 6e-3), 1.2, 1e-3) | {"METHOD.SCHEME": "usavg"}
    state = run("pressed", "--quiet", sets=sets).results("pressed").checkpoint()
    print(np.abs(state.v).max(), state.momentum() / state.mass.sum())
    assert np.abs(state.v).max() < 0.2
    assert np.abs(state.momentum()).max() < 1e-12 * state.mass.sum()
