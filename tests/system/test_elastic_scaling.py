# SPDX-License-Identifier: MIT
"""Metal that flows, with softer elastic moduli (TIME.ELASTIC_SCALING)."""

import driver
import numpy as np
import pytest

DISC = driver.ROOT / "benchmarks/disc_on_plate.nml"
HOT = {"GRID.LOWER": "-4e-3,-4e-3,-4e-3", "GRID.UPPER": "40e-3,36e-3,14e-3", "SHAPE.UPPER": "36e-3,32e-3,8e-3",
       "CLAMP(3).LOWER": "-1,32e-3,-1", "CLAMP(5).LOWER": "36e-3,-1,-1", "METHOD.SLEEPING": "on", "BODY.TEMPERATURE": 900,
       "HEAT.AMBIENT": 900, "TOOL.RADIUS": 8e-3, "TOOL.POSITION": "16e-3,16e-3,8e-3", "TOOL.FRICTION_LAW": "shear-factor",
       "TOOL.SHEAR_FACTOR": 1, "MOTION(1).DURATION": 0.05, "MOTION(1).RAMP": 0.05, "MOTION(1).VELOCITY": "0,0,0",
       "MOTION(1).FORCE": 15e3, "MOTION(2).FORCE": 15e3, "TIME.END": 0.3, "OUTPUT.HISTORY_INTERVAL": 4e-3}


def stirred(run, **sets):
    """Means over the second half: force, torque; hottest particle, plastic work, steps."""
    place = f"out{len(sets)}{sum(sets.values())}"
    results = driver.Results(run(DISC, "--quiet", "--output", place, sets=HOT | sets).directory / place, "disc_on_plate")
    history = results.history()
    late = history["time[s]"] > 0.15
    assert np.abs(history["audit_error[%]"][late]).max() < 0.01
    return np.array([history["disc_force_z[N]"][late].mean(), history["disc_torque[Nm]"][late].mean(),
                     history["temperature_max[K]"][-1], history["plastic_work[J]"][-1], results.summary()["steps"]])


def test_stirred_plate(run):
    """A disc that sticks and is pressed by a force into a plate of 900 K. Required by factors of 10 and 25: force and torque within
    3 %; measured 0.1 and 0.7 % in torque. Own: temperature 1 %, plastic work 10 % (6 and 8 measured,
    a third of the heat, the rest is friction); steps fewer by the root of the factor."""
    true = stirred(run)
    for factor in (10, 25):
        soft = stirred(run, **{"TIME.ELASTIC_SCALING": factor})
        print(factor, soft / true - 1.0)
        assert soft[:2] == pytest.approx(true[:2], rel=0.03) and soft[3] == pytest.approx(true[3], rel=0.1)
        assert soft[2] == pytest.approx(true[2], rel=0.01)
        assert true[4] / soft[4] == pytest.approx(np.sqrt(factor), rel=0.05)


@pytest.mark.parametrize("name, sets, slack", [("block_two_phase", {"OUTPUT.CHECKPOINT_INTERVAL": 1.0}, 0.08), ("squeezed", {}, 0.02)])
def test_flow_stress(run, name, sets, slack):
    """The flow stress does not see the moduli, nor does that of a law that is made of the true shear modulus (by a tenth of it 90 %
    less), but for the hardening of the strain that is elastic: 1 and 3 % of strains of 0.25 and 0.1."""
    path, flow = driver.ROOT / f"benchmarks/{name}.nml", []
    for factor in (1, 10):
        done = run(path if path.exists() else name, "--quiet", "--output", f"out{factor}", sets=sets | {"TIME.ELASTIC_SCALING": factor})
        state = driver.Results(done.directory / f"out{factor}", name).checkpoint()
        flow.append(np.average(state.flow, weights=state.mass))
    print(flow)
    assert flow[1] == pytest.approx(flow[0], rel=slack)


def test_work_of_the_press(run):
    """The work of the press less elastic and kinetic energy is plastic work, however soft the metal (1.6, 5 % off with a return
    whose strain counts 3 G tr(b)/3 of stress whatever the sign of the load)."""
    for factor in (1, 3, 10):
        done = run("squeezed", "--quiet", "--output", f"out{factor}", sets={"TIME.ELASTIC_SCALING": factor})
        last = driver.Results(done.directory / f"out{factor}", "squeezed").history()
        work, elastic, kinetic, plastic = (last[f"{name}[J]"][-1] for name in ("tool_work", "elastic", "kinetic", "plastic_work"))
        print(factor, plastic / (work - elastic - kinetic), last["audit_error[%]"][-1])
        assert plastic == pytest.approx(work - elastic - kinetic, rel=2e-3) and abs(last["audit_error[%]"][-1]) < 2e-3


def test_check_proposes(run):
    """--check names a factor of an elastic strain of 2 % at most, what it saves, and warns of one that is far too large."""
    proposal = run(DISC, "--check=scene").out
    assert "ELASTIC_SCALING = 6 would make that 1.85 %, and steps 2.4 times as long" in proposal
    assert "(ELASTIC_SCALING 6)" in run(DISC, "--check=scene", sets={"TIME.ELASTIC_SCALING": 6}).out
    done = run(DISC, "--check=scene", sets={"TIME.ELASTIC_SCALING": 100, "MATERIAL.EXPANSION": 17e-6})
    assert "strains metal elastically by 30.8" in done.out and "100 times too small with ELASTIC_SCALING" in done.out


@pytest.mark.parametrize("name, sets, words", [
    ("driven", {}, "no &MATERIAL can flow"), ("squeezed", {"TIME.ELASTIC_SCALING": 0.5}, "must be >= 1 and <= 1000"),
    ("squeezed", {"METHOD.MECHANICS": "F"}, "has no effect with MECHANICS = F")])
def test_errors(run, name, sets, words):
    """What has no effect or no meaning is refused."""
    assert words in run(name, "--check=scene", sets={"TIME.ELASTIC_SCALING": 10} | sets, expect=driver.BAD_INPUT).err


def test_restart_keeps_it(run):
    """A restart goes on with the moduli that the state belongs to."""
    run("squeezed", "--quiet", sets={"TIME.ELASTIC_SCALING": 10})
    done = run(None, "--restart", "squeezed.out/squeezed_checkpoint.h5", "--set", "TIME.ELASTIC_SCALING=5", "--set", "TIME.END=2e-4",
               expect=driver.BAD_INPUT)
    assert "ELASTIC_SCALING" in done.err
