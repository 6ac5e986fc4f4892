# SPDX-License-Identifier: MIT
"""Implicit conduction beside mechanics: steps of given length, every so many mechanical ones, by their error."""

import pathlib

import driver
import numpy as np
import pytest


def last(results, name):
    return results.probes()[f"{name}[K]"][-1]


def test_implicit_beside_mechanics(run, tmp_path):
    """The moving line of test_sources with steps of backward Euler of 0.02 s, about twice the explicit ones: probes
    within 1 K of the exact ones, the source's heat exact, and what is in the body is what was given."""
    from test_sources import under_line

    sets = {"HEAT.INTEGRATOR": "backward-euler", "HEAT.STEP": 0.02}
    results = {}
    for ranks in (1, 3):
        (tmp_path / str(ranks)).mkdir()
        results[ranks] = run("line", "--quiet", sets=sets, ranks=ranks, directory=tmp_path / str(ranks)).results("line")
    history = results[1].history()
    for name, x, y in (("side", 10e-3, 10e-3), ("behind", 0.0, 10e-3), ("ahead", 30e-3, 6e-3)):
        rise, exact = last(results[1], name) - 300.0, under_line(x, y, 2.0, 10e-3, 2e-3)
        print(name, rise, exact)
        assert rise == pytest.approx(exact, abs=1.0)
    content = history["heat_content[J]"]
    assert content[-1] - content[0] == pytest.approx(history["source_heat[J]"][-1], rel=1e-6)  # of printed digits
    apart = driver.distance(results[1].checkpoint(), results[3].checkpoint(), ["temp"])
    assert apart["temp"] < 1e-9


BESIDE = {"every": {"TIME.DT": 0.004, "HEAT.EVERY": 5}, "adaptive": {"HEAT.TOLERANCE": 0.5}, "coarse": {"HEAT.TOLERANCE": 20}}


def test_implicit_steps_beside_mechanics(run, tmp_path):
    """The moving line with a conduction step every 5 mechanical ones, and on steps that follow their error: at the end
    the probes of the explicit run within 1 K (of 130), the heat of the source in the body, conduction steps that
    make no heat."""
    found = {}
    for name, more in {"explicit": {}, **BESIDE}.items():
        (tmp_path / name).mkdir()
        sets = {} if name == "explicit" else {"HEAT.INTEGRATOR": "backward-euler"}
        found[name] = run("line", "--quiet", sets=sets | more, directory=tmp_path / name).results("line")
        history = found[name].history()
        content = history["heat_content[J]"]
        assert content[-1] - content[0] == pytest.approx(history["source_heat[J]"][-1], rel=1e-6)  # printed digits
        assert np.abs(history["conduction_error[%]"]).max() < 1e-9
        apart = np.abs(found[name].probes().rows[-1] - found["explicit"].probes().rows[-1]).max()
        print(name, apart, history["conduction_error[%]"][-1])
        assert apart < (5.0 if name == "coarse" else 1.0)


HALF = {"TIME.END": 0.5, "OUTPUT.CHECKPOINT_INTERVAL": 0.5}
ALIKE = {"fixed": ("line", HALF | {"HEAT.STEP": 0.05}), "adaptive": ("line", HALF),
         "walls": ("wall_heat", HALF | {"TIME.MASS_SCALING": 9e11, "HEAT.STEP": 0.05, "BODY.TEMPERATURE": 400}),
         "stir": ("stir", {"TIME.END": 0.08, "HEAT.STEP": 0.02, "OUTPUT.CHECKPOINT_INTERVAL": 0.08}),
         "film": (driver.ROOT / "tests/verification/inputs/heat_robin.nml",
                  {"TIME.END": 0.4, "HEAT.STEP": 0.05, "OUTPUT.CHECKPOINT_INTERVAL": 0.4})}


@pytest.mark.parametrize("case", ALIKE)
def test_petsc_beside_mechanics(run, tmp_path, case):
    """The conduction steps of PETSc on 1, 2 and 3 ranks are those of the program's own conjugate gradients (1e-7 of the
    temperature: both stop at a residual of 1e-8), and keep the heat of the particles."""
    if driver.lacks("petsc", tmp_path):
        pytest.skip("this build has no petsc")
    scene, sets = ALIKE[case]
    sets = {"HEAT.INTEGRATOR": "backward-euler"} | sets
    found = {}
    for solver, ranks in (("cg", 1), ("petsc", 1), ("petsc", 2), ("petsc", 3)):
        place = tmp_path / f"{solver}{ranks}"
        place.mkdir()
        results = run(scene, "--quiet", sets=sets | {"HEAT.SOLVER": solver}, ranks=ranks, directory=place)
        found[solver, ranks] = results.results(pathlib.Path(scene).stem)
        assert np.abs(found[solver, ranks].history()["conduction_error[%]"]).max() < 1e-9
    own = found.pop(("cg", 1)).checkpoint()
    for name, results in found.items():
        apart = driver.distance(own, results.checkpoint(), ["temp"])
        print(case, name, apart)
        assert apart["temp"] < 1e-7


def test_solver_beside_mechanics_is_checked(run, tmp_path):
    """PETSc is refused where it was not built in, and where nothing is implicit; FFTW always."""
    for solver, sets, words in (("petsc", {}, "needs an implicit INTEGRATOR"),
                                ("fftw", {"HEAT.INTEGRATOR": "backward-euler"}, "cg or petsc")):
        refused = run("line", "--check=scene", sets=sets | {"HEAT.SOLVER": solver}, expect=driver.BAD_INPUT)
        assert words in refused.err
    lacks = driver.lacks("petsc", tmp_path)
    checked = run("line", "--check=scene", sets={"HEAT.SOLVER": "petsc", "HEAT.INTEGRATOR": "backward-euler"},
                  expect=driver.BAD_INPUT if lacks else driver.WELL)
    assert "was built without PETSc" in checked.err if lacks else "backward Euler, petsc" in checked.out


def test_adaptive_conduction_goes_on_bitwise(run, tmp_path):
    """Exact: stopped and continued, the adaptive conduction steps are those of the run in one piece."""
    sets = {"HEAT.INTEGRATOR": "backward-euler", "TIME.END": 0.5, "OUTPUT.CHECKPOINT_INTERVAL": 0.25}
    for name in ("one", "part"):
        (tmp_path / name).mkdir()
    one = run("line", "--quiet", sets=sets, directory=tmp_path / "one").results("line")
    steps = int(one.history()["step"][-1] * 0.7)
    part = run("line", "--quiet", sets=sets | {"TIME.MAX_STEPS": steps}, directory=tmp_path / "part").results("line")
    run("line", "--quiet", "--restart", part.path("_checkpoint.h5"), sets=sets, directory=tmp_path / "part")
    assert one.probes().text == part.probes().text


def test_implicit_between_walls(run, tmp_path):
    """A hot bar between two cold walls: implicit steps of 0.05 s take its heat to the walls as explicit ones do
    (1 % of what is left), and what the bar loses is what the walls are given."""
    left = {}
    for name, more in (("explicit", {}), ("implicit", {"HEAT.INTEGRATOR": "backward-euler", "HEAT.STEP": 0.05})):
        sets = {"TIME.END": 2, "TIME.MASS_SCALING": 9e11, "BODY.TEMPERATURE": 400, "OUTPUT.CHECKPOINT_INTERVAL": 2}
        (tmp_path / name).mkdir()
        results = run("wall_heat", "--quiet", sets=sets | more, directory=tmp_path / name).results("wall_heat")
        history = results.history()
        content = history["heat_content[J]"]
        assert content[-1] - content[0] == pytest.approx(history["wall_heat[J]"][-1], rel=1e-6)
        left[name] = content[-1] - 0.75 * content[0]      # above 300 K
    print(left)
    assert left["implicit"] == pytest.approx(left["explicit"], rel=0.02)


@pytest.mark.parametrize("floor", [{}, {"WALL.TEMPERATURE": 298}], ids=["insulated", "cold"])
def test_particles_keep_to_their_nodes(run, floor):
    """In flat cells, stirred with friction, no particle is more than 12 K below all that is around and was ever there:
    coarse cells undershoot by 8 K, but a particle at rest that takes what its flowing neighbours give back drifts
    away by 50 K. Heat is what friction gives the plate, plastic work and a floor of 298 K, if it has one, have
    given."""
    sets = {"GRID.CELL": "4e-3,4e-3,1e-3", "GRID.UPPER": "104e-3,48e-3,28e-3", "SHAPE.UPPER": "96e-3,40e-3,12e-3",
            "MOTION(1).VELOCITY": "0,0,-8e-3", "TIME.MASS_SCALING": 1e6, "METHOD.SLEEPING": "off",
            "SURFACE.COEFFICIENT": 0} | floor
    results = run("stir", "--quiet", sets=sets).results("stir")
    history, coldest = results.history(), results.checkpoint().temp.min()
    gained = history["heat_content[J]"][-1] - history["heat_content[J]"][0]
    given = (history["friction_heat_to_bodies[J]"][-1] + 0.9 * history["plastic_work[J]"][-1] + history["wall_heat[J]"][-1])
    print(floor, coldest, gained, given, history["wall_heat[J]"][-1])
    assert coldest > 286.0
    assert gained == pytest.approx(given, rel=1e-5)
