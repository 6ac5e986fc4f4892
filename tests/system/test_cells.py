# SPDX-License-Identifier: MIT
"""Cells with an edge for each axis: patch tests, ranks, restart, sleep, heat alone, output, input."""

import re

import driver
import h5py
import numpy as np
import pytest

EDGES = ("1e-3,0.5e-3,2e-3", "2e-3,1e-3,0.5e-3", "0.5e-3,2e-3,1e-3")


@pytest.mark.parametrize("edges", EDGES)
@pytest.mark.parametrize("shape", ["ugimp", "cpgimp", "bspline"])
def test_pressure_that_belongs_to_the_stress(run, shape, edges):
    """Exact: the warm block with a bite and a hole under the pressure of its uniform thermal stress stays at rest:
    forces cancel at every node, so that nothing moves (1e-9 m/s; without the traction 6 m/s)."""
    sets = {"METHOD.SHAPE": shape, "METHOD.SCHEME": "usavg", "GRID.CELL": edges, "TIME.END": 1e-5}
    state = run("pressed", "--quiet", sets=sets).results("pressed").checkpoint()
    print(shape, edges, len(state.x), np.abs(state.v).max())
    assert np.abs(state.v).max() < 1e-9
    assert state.tau[:, :3] == pytest.approx(-104.84265738194498e6, rel=1e-9)


@pytest.mark.parametrize("edges", EDGES)
@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
def test_linear_velocity(run, shape, edges):
    """Exact: a block whose particles have the velocities v = A x and their gradient (APIC) gives them to all nodes, and
    after a step all particles have J - 1 = dt tr A, b - 1 = 2 dt dev sym A, to the second order in dt A, 1e-12."""
    gradient = np.array([[3.1, 1.7, -2.3], [0.7, -4.1, 1.3], [2.1, 0.9, 1.1]])
    sets = {"METHOD.SHAPE": shape, "METHOD.TRANSFER": "apic", "GRID.CELL": edges, "BODY.CENTRE": "8e-3,8e-3,5e-3",
            "BODY.VELOCITY_GRADIENT": ",".join(map(str, gradient.ravel())), "BODY.TEMPERATURE": 300,
            "TRACTION.PRESSURE": 1e-9, "TIME.MAX_STEPS": 1, "TIME.DT": 1e-7}
    state = run("pressed", "--quiet", sets=sets).results("pressed").checkpoint()
    strain = np.eye(3) + 1e-7 * (gradient + gradient.T - 2.0 / 3.0 * np.trace(gradient) * np.eye(3))
    exact = strain[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    print(shape, edges, np.abs(state.b - exact).max(), np.abs(state.jac - 1.0 - 1e-7 * np.trace(gradient)).max())
    assert np.abs(state.b - exact).max() < 1e-11
    assert np.abs(state.jac - 1.0 - 1e-7 * np.trace(gradient)).max() < 1e-11


def test_stirring_on_ranks_and_after_a_restart(run, tmp_path_factory):
    """Exact: a plate stirred with heat, friction and sleep in cells of 2 x 2 x 1 mm is the same on one and two ranks (to
    1e-6 of the largest), and a run that goes on from a checkpoint has the same doubles."""
    sets = {"GRID.CELL": "4e-3,4e-3,2e-3", "TIME.END": 0.02, "OUTPUT.CHECKPOINT_INTERVAL": 0.01,
            "MOTION(1).VELOCITY": "0,0,-20e-3", "MOTION(1).DURATION": "0.03"}
    whole = run("stir", "--quiet", ranks=2, sets=sets).results("stir")
    alone = run("stir", "--quiet", sets=sets, directory=tmp_path_factory.mktemp("one")).results("stir").checkpoint()
    apart = driver.distance(alone, whole.checkpoint(), ["x", "v", "tau", "temp"])
    print(apart, whole.history()["tool_force_z[N]"][-1])
    assert max(apart.values()) <= 1e-6, apart
    assert whole.history()["tool_force_z[N]"][-1] > 100.0
    place = tmp_path_factory.mktemp("parts")
    part = run("stir", "--quiet", ranks=2, sets=sets | {"TIME.MAX_STEPS": 3 * whole.checkpoint().step // 4},
               directory=place).results("stir")
    assert part.checkpoint().step < whole.checkpoint().step
    run("stir", "--quiet", "--restart", part.path("_checkpoint.h5"), ranks=2, sets=sets, directory=place)
    assert max(driver.distance(part.checkpoint(), whole.checkpoint(), ["x", "v", "tau", "temp"]).values()) == 0.0


def test_frames_and_check(run, tmp_path):
    """A frame has the edges of the cells, of cubes one; so says --check."""
    sets = {"GRID.CELL": "1e-3,0.5e-3,2e-3", "TIME.END": 1e-7, "OUTPUT.FRAME_INTERVAL": 1e-7}
    frame = run("pressed", "--quiet", sets=sets).results("pressed").path("_000000.hdf")
    with h5py.File(frame) as file:
        assert list(file.attrs["cell"]) == [1e-3, 0.5e-3, 2e-3] and file.attrs["spacing"] == pytest.approx(0.5e-3)
    done = run("pressed", "--check=scene", sets=sets)
    assert re.search(r"16 x 32 x 6 cells of 1 x 0\.5 x 2 mm", done.out), done.out


def test_restart_in_other_cells_is_refused(run):
    """Edges of cells cannot change at a restart; the message names the key."""
    sets = {"TIME.END": 1e-6, "OUTPUT.CHECKPOINT_INTERVAL": 1e-6}
    part = run("pressed", "--quiet", sets=sets | {"GRID.CELL": "1e-3,0.5e-3,2e-3"}).results("pressed")
    done = run("pressed", "--restart", part.path("_checkpoint.h5"), sets=sets | {"GRID.CELL": "1e-3,1e-3,2e-3"},
               expect=driver.BAD_INPUT)
    assert "CELL" in done.out + done.err


@pytest.mark.parametrize("cell, said", [("1e-3,2e-3", "one edge of cubes, or one for each of the three axes"),
                                        ("1e-3,0,1e-3", "CELL"), ("1e-3,1e-3,1e-12", "cells"),
                                        ("1e-3,1e-3,30e-3", "at least one cell above LOWER")])
def test_bad_edges(run, cell, said):
    """Edges that make no grid are refused."""
    done = run("pressed", "--check=scene", sets={"GRID.CELL": cell}, expect=driver.BAD_INPUT)
    assert "error" in done.err and said in done.err, done.err


def test_heat_alone(run):
    """Exact: the heat of a slab goes along x alone: in cells of 2 x 4 x 1 mm its probes read what they do in cubes of
    2 mm, to 0.02 K, twice the error of a step; --check names the mesh."""
    rows = []
    for cell in ("2e-3", "2e-3,4e-3,1e-3"):
        results = run("heat_slab", "--quiet", "--overwrite", sets={"GRID.CELL": cell}).results("heat_slab")
        rows.append(results.probes())
    for name in ("centre[K]", "face[K]"):
        end = [np.interp([2.0, 5.0, 10.0], table["time[s]"], table[name]) for table in rows]
        print(name, end)
        assert end[0] == pytest.approx(end[1], abs=0.02) and end[0][-1] < 390.0
    done = run("heat_slab", "--check=scene", sets={"GRID.CELL": "2e-3,4e-3,1e-3"})
    assert re.search(r"16 x 1 x 4 cells of about 2 x 4 x 1 mm", done.out), done.out
