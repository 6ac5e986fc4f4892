# SPDX-License-Identifier: MIT
"""A step of conduction that is not solved for ends the run with status 3 and says so."""

import driver
import pytest

BESIDE = {"METHOD.MECHANICS": "T", "HEAT.STEP": 0, "HEAT.EVERY": 1, "MATERIAL.SPECIFIC_HEAT": 1, "MATERIAL.CONDUCTIVITY": 1e5,
          "TIME.END": 10}


@pytest.mark.parametrize("method", ["backward-euler", "tr-bdf2"])
@pytest.mark.parametrize("ranks", [None, 2])
def test_fixed_step_of_heat_alone(run, ranks, method):
    """Exact: a step that 2000 iterations do not solve for leaves no row; the state before it is a checkpoint, from
    which shorter steps go on."""
    done = run("long_bar", "--quiet", ranks=ranks, sets={"HEAT.INTEGRATOR": method}, expect=driver.BROKEN)
    assert done.err.count("conduction: a step of 1e6 s did not converge: shorten &HEAT STEP (step 0, t = 0 s)") == 1
    results = done.results("long_bar")
    assert len(results.history().rows) == 1
    run(None, "--quiet", "--restart", results.path("_checkpoint.h5"), ranks=ranks, sets={"HEAT.STEP": 1, "TIME.END": 2})
    assert results.history()["step"][-1] == 2 and results.history()["temperature_max[K]"][-1] < 500


def test_step_beside_mechanics(run):
    """Exact: the same beside mechanics; the temperatures that were not solved for are no checkpoint."""
    done = run("long_bar", "--quiet", sets=BESIDE, expect=driver.BROKEN)
    assert "conduction: a step of " in done.err and " did not converge: shorten &HEAT STEP or EVERY" in done.err
    results = done.results("long_bar")
    assert results.path("_broken.h5").exists() and not results.path("_checkpoint.h5").exists()


def test_tolerance_that_no_step_meets(run):
    """Exact: with steps by their error a run does not try shorter ones for ever."""
    sets = {"HEAT.STEP": 0, "HEAT.TOLERANCE": 1e-6, "BODY.TEMPERATURE": 1e5, "SURFACE.COEFFICIENT": 1e9, "TIME.END": 1e3}
    done = run("long_bar", "--quiet", sets=sets, expect=driver.BROKEN)
    assert "conduction: no time step satisfies &HEAT TOLERANCE, not even one of " in done.err
