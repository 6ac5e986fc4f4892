# SPDX-License-Identifier: MIT
"""Contact between bodies on graded grids: friction, collisions, heat through a gap, ranks, restart."""

import driver
import numpy as np
import pytest
from test_bodies import LOAD, MASS, first_change, mean_velocity
from test_gaps import pair, sets_of, through_gap
from test_grading import graded

FLAT = (5e-3, 5e-3, 1.25e-3)
SLABS = {
    "surfaces in the fine part": graded("z", FLAT, (-2.5e-3, 5e-3), 1.3, 5e-3),
    "surfaces where cells grow": graded("z", FLAT, (2.5e-3, 5e-3), 1.3, 5e-3),
    "into finer cells and out": graded("x", (2.5e-3, 5e-3, 5e-3), (20e-3, 30e-3), 1.2, 5e-3),
    "across": graded("y", (5e-3, 2.5e-3, 5e-3), (0, 10e-3), 1.2, 5e-3),
    "along and across": graded("xyz", (2.5e-3, 2.5e-3, 1.25e-3), (20e-3, 30e-3, 0, 10e-3, -2.5e-3, 5e-3), 1.2, 5e-3),
}


@pytest.mark.parametrize("cells, normal", [*((cells, "gradient") for cells in SLABS), ("into finer cells and out", "regression")])
def test_block_slides_on_a_slab(run, cells, normal):
    """Exact, as in test_bodies: 3 g pushed and pressed by F = N, mu = 0.5, on a slab that deforms: v and the friction heat to
    0.5 %, whichever axis is graded and wherever the surfaces lie."""
    sets = {"BODY(slab).RIGID": False, "CONTACT.NORMAL": normal, "TIME.END": 2e-3, "OUTPUT.CHECKPOINT_INTERVAL": 2e-3}
    results = run("blocks", "--quiet", sets=sets | SLABS[cells]).results("blocks")
    history, v = results.history(), mean_velocity(results.checkpoint(), 1)
    a, tr, t = 0.5 * LOAD / MASS, 1e-4, 2e-3
    heat = 0.5 * LOAD * a * (tr**2 / 8.0 + 0.5 * ((t - 0.5 * tr) ** 2 - 0.25 * tr**2))
    print(cells, v[0] / (a * (t - 0.5 * tr)) - 1, v[1:], history["friction_heat[J]"][-1] / heat - 1)
    assert v[0] == pytest.approx(a * (t - 0.5 * tr), rel=5e-3)
    assert np.abs(v[1:]).max() < 2e-2
    assert history["friction_heat[J]"][-1] == pytest.approx(heat, rel=5e-3)
    assert np.abs(history["numerical_loss[J]"][-1]) < 1e-2 * heat
    assert np.abs(history["audit_error[%]"]).max() < 2.0


@pytest.mark.parametrize("fine, largest, normal", [((0.4, 0.6), 0.025, "gradient"), ((0.4, 0.6), 0.05, "gradient"),
                                                   ((0.1, 0.3), 0.025, "regression")])
def test_discs_keep_their_energy(run, fine, largest, normal):
    """Exact: discs of 16 cells and more, graded along y by 1:2 and 1:4, meet at 1.08579 s (a disc ends where rows of particles
    do: to half a row of the largest cells over the closing speed); kinetic and elastic energy after the rebound are
    what they were, to 2 %, and never 0.1 % more; momentum stays to 1e-12 of a disc's."""
    sets = graded("y", (0.025, 0.0125, 0.025), fine, 1.25, largest) | {
        "METHOD.SCHEME": "usavg", "METHOD.FBAR": "F", "CONTACT.FRICTION": 0, "TIME.CFL": 0, "CONTACT.NORMAL": normal}
    results = run("discs", "--quiet", sets=sets).results("discs")
    history, state = results.history(), results.checkpoint()
    total = (history["kinetic[J]"] + history["elastic[J]"]) / history["kinetic[J]"][0]
    before, after = first_change(history)
    moved = state.momentum()
    masses = [state.mass[state.body == k].sum() for k in (1, 2)]
    at_start = 0.1 * (masses[0] - masses[1])
    late = 0.25 * largest / (0.2 * np.sqrt(2.0))
    print(fine, largest, normal, len(state.x), total.min(), total.max(), total[-1], before, after, moved - at_start)
    assert total[-1] == pytest.approx(1.0, abs=0.02) and total.max() < 1.001
    assert before - late < 1.08579 < after + late
    assert np.abs(moved[:2] - at_start).max() < 1e-12 * 0.1 * masses[0]


@pytest.mark.parametrize("seed, gap, integrator, fine", [
    (3, 0.2, "explicit", (-8, -4)), (5, 1.0, "backward-euler", (-4, 4))])
def test_gap_between_half_spaces(run, seed, gap, integrator, fine):
    """Exact, as in test_gaps: heat that went through the gap within 1 % (any draw: 1.5 %), with the gap in cells of half the edge and where they
    grow to twice the edge, once it has gone 24 cells deep; nothing lost."""
    sets = sets_of(*pair(seed)) | {"HEAT.INTEGRATOR": integrator}
    cell = sets["GRID.CELL"]
    sets |= graded("z", (cell, cell, 0.5 * cell), (fine[0] * cell, fine[1] * cell), 1.2, 2 * cell)
    sets["TIME.DT"] /= 4
    if integrator != "explicit":
        sets["HEAT.EVERY"] = 20
    found = through_gap(run, pair(seed), gap, sets)
    print(seed, gap, integrator, fine, found - 1)
    assert found == pytest.approx(1.0, rel=0.01 if seed < 10 else 0.015)


def test_on_ranks_and_after_a_restart(run, tmp_path):
    """Exact: discs in cells that grow, on 3 ranks as on one to 1e-8; stopped and continued bitwise."""
    sets = graded("y", (0.05, 0.025, 0.05), (0.4, 0.6), 1.25, 0.05) | {"TIME.END": 1.4, "OUTPUT.CHECKPOINT_INTERVAL": 1.4}
    fields, states = ["x", "v", "tau", "jac"], {}
    for name, ranks, more in (("whole", None, {}), ("ranks", 3, {}), ("part", None, {"TIME.MAX_STEPS": 165})):
        (tmp_path / name).mkdir()
        results = run("discs", "--quiet", sets=sets | more, ranks=ranks, directory=tmp_path / name).results("discs")
        states[name] = results.checkpoint()
    assert states["part"].step < states["whole"].step and np.abs(states["whole"].tau).max() > 1.0
    run("discs", "--quiet", "--restart", results.path("_checkpoint.h5"), sets=sets, directory=tmp_path / "part")
    assert max(driver.distance(states["ranks"], states["whole"], fields).values()) < 1e-8
    assert max(driver.distance(results.checkpoint(), states["whole"], fields).values()) == 0.0


def test_rigid_bodies_are_refused(run):
    """A tool of particles has no place in cells that become finer; the reason is given."""
    done = run("blocks", "--check=scene", sets=SLABS["across"], expect=driver.BAD_INPUT)
    assert "cannot be on a graded grid: particles of a tool do not become finer with its cells" in done.err, done.err
