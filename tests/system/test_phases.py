# SPDX-License-Identifier: MIT
"""Phases of a tool that end at a load or a temperature, and limits of the machine."""

import re

import driver
import numpy as np
import pytest

SCENE = "phased"
COLUMNS = ("disc_z[m]", "disc_force_z[N]", "disc_torque[Nm]", "disc_phase", "temperature_max[K]")


def ends(done):
    """Times at which phases ended, as the run said."""
    return [float(t) for t in re.findall(r"t = (\S+) s: phase", done.out)]


def test_plunge_dwell_travel_retract(run):
    """A disc plunges until it feels 20 kN, dwells under that force until the metal has 306 K, travels under it, and is drawn out. Own
    measure: 20 kN at the end of the plunge within 5 % (it grows by 15 kN a millisecond; rows before and after it), the temperature
    within that of one conduction step, and in travel the force within 1 %."""
    done = run(SCENE)
    history = done.results(SCENE).history()
    time, force, phase, x = (history[name] for name in ("time[s]", "disc_force_z[N]", "disc_phase", "disc_x[m]"))
    plunged, warm = ends(done)
    assert "phase 1 of tool 'disc' ends: UNTIL_FORCE" in done.out and "phase 2 of tool 'disc' ends: UNTIL_TEMPERATURE" in done.out
    after = np.searchsorted(time, plunged)
    print(plunged, warm, force[after - 2:after + 2])
    ended = np.interp(plunged, time, force)
    assert ended == pytest.approx(20e3, rel=0.05) and np.all(force[:after - 2] < 20e3)
    assert history["temperature_max[K]"][np.searchsorted(time, warm) + np.array([-1, 0])] == pytest.approx(306.0, abs=1.0)
    assert list(np.unique(phase)) == [1, 2, 3, 4]
    travel = (phase == 3) & (time > warm + 1e-3)
    assert travel.sum() > 10 and force[travel] == pytest.approx(20e3, rel=0.01)
    assert np.ptp(x[phase <= 2]) == 0.0 and x[-1] - x[0] == pytest.approx(1.8e-3 * 6e-3, rel=0.02)
    assert np.all(force[phase == 4][1:] == 0.0) and history["disc_z[m]"][-1] > 12.4e-3


@pytest.mark.parametrize("sets, words, probe", [
    ({"MOTION(1).UNTIL_FORCE": 1e9}, "phase 1 of tool 'disc' ends: its DURATION is over", False),
    ({"MOTION(1).UNTIL_FORCE": 1e9, "MOTION(1).UNTIL_TORQUE": 10}, "phase 1 of tool 'disc' ends: UNTIL_TORQUE", False),
    ({"MOTION(2).UNTIL_PROBE": "near", "MOTION(2).UNTIL_TEMPERATURE": 299}, "phase 2 of tool 'disc' ends: UNTIL_TEMPERATURE; 299", True)])
def test_what_ends_a_phase(run, sets, words, probe):
    """The run says what ended a phase: its longest time, a torque, the temperature of a probe."""
    done = run(SCENE, "--quiet", sets=sets if probe else sets | {"TIME.END": 11e-3})
    assert words in done.out
    if probe:
        table = done.results(SCENE).probes()
        assert np.interp(ends(done)[1], table["time[s]"], table["near[K]"]) == pytest.approx(299.0, abs=0.2)


@pytest.mark.parametrize("ranks, cuts", [(1, (6e-3, 12e-3)), (2, (12e-3,))])
def test_restart_is_bitwise(run, tmp_path, ranks, cuts):
    """Exact: stopped after phases that ended early, in a third that ends by its time, the state and the history are those of one go."""
    whole = run(SCENE, "--quiet", directory=tmp_path, ranks=ranks).results(SCENE)
    state, history = whole.checkpoint(), whole.history()
    for cut in cuts:
        run(SCENE, "--quiet", "--overwrite", directory=tmp_path, ranks=ranks, sets={"OUTPUT.CHECKPOINT_INTERVAL": cut, "TIME.END": 1.3 * cut})
        run(None, "--quiet", "--restart", whole.path("_checkpoint_previous.h5"), directory=tmp_path, ranks=ranks,
            sets={"TIME.END": 24e-3})
        assert np.array_equal(state.x, whole.checkpoint().x) and np.array_equal(state.v, whole.checkpoint().v)
        for name in COLUMNS:
            assert np.array_equal(history[name], whole.history()[name])


def test_ranks(run, tmp_path):
    """Results on one rank and on two are the same to rounding."""
    found = []
    for ranks in (1, 2):
        (tmp_path / str(ranks)).mkdir()
        done = run(SCENE, "--quiet", directory=tmp_path / str(ranks), ranks=ranks)
        found.append(ends(done) + list(done.results(SCENE).history()["disc_force_z[N]"]))
    assert found[0] == pytest.approx(found[1], rel=1e-5, abs=1.0)


@pytest.mark.parametrize("action, sets", [("end", {}), ("stop-feed", {}), ("stop", {"TOOL.MAX_FORCE": 1e9, "TOOL.MAX_TORQUE": 12})])
def test_limits(run, action, sets):
    """Beyond a limit the run ends, or the tool turns on where it is, or stands still. Continued, it stays stopped."""
    sets = {"MOTION(1).UNTIL_FORCE": 1e9, "TOOL.MAX_FORCE": 15e3, "TOOL.AT_LIMIT": action, "TIME.END": 6e-3,
            "OUTPUT.CHECKPOINT_INTERVAL": 4e-3} | sets
    done = run(SCENE, "--quiet", sets=sets)
    assert "is beyond its limit" in done.out
    history = done.results(SCENE).history()
    time, z, angle = (history[name] for name in ("time[s]", "disc_z[m]", "disc_angle[rad]"))
    when = float(re.search(r"warning: t = (\S+) s: tool", done.out)[1])
    assert 1e-3 < when < 3e-3
    if action == "end":
        assert time[-1] == pytest.approx(when, rel=1e-4)
        return
    assert time[-1] == pytest.approx(6e-3) and np.ptp(z[time > when * (1.0 + 1e-5)]) == 0.0
    turned = np.ptp(angle[time > 4e-3])
    assert turned > 0.1 if action == "stop-feed" else turned == 0.0
    results = done.results(SCENE)
    run(None, "--quiet", "--restart", results.path("_checkpoint_previous.h5"))
    assert np.array_equal(results.history()["disc_angle[rad]"], angle) and np.array_equal(results.history()["disc_force_z[N]"],
                                                                                       history["disc_force_z[N]"])


def test_table_of_forces(run, tmp_path):
    """A disc follows a force over time, within 10 % while that changes by a quarter in a millisecond, of which the disc needs some
    tenths to follow, and within 2 % where it has been constant for a millisecond."""
    times, forces = np.array([0.0, 4e-3, 6e-3, 10e-3]), np.array([20e3, 10e3, 10e3, 25e3])
    table = ", ".join(f"{t},{f}" for t, f in zip(times, forces))
    text = (driver.INPUTS / "phased.nml").read_text()
    path = tmp_path / "phased.nml"
    path.write_text(text.replace("FORCE = 20e3, UNTIL_TEMPERATURE = 306", f"FORCE_TABLE = {table}"))
    done = run(path, "--quiet", sets={"TIME.END": 12.5e-3})
    history = done.results(SCENE).history()
    middle = history["time[s]"] - 1.25e-4 - ends(done)[0]
    there = (middle > 2e-3) & (middle < 9.5e-3)
    found, asked = history["disc_force_z[N]"], np.interp(middle, times, forces)
    print(found[there] / asked[there])
    assert there.sum() > 25 and found[there] == pytest.approx(asked[there], rel=0.1)
    steady = (middle > 5e-3) & (middle < 5.9e-3)
    assert steady.sum() >= 3 and found[steady] == pytest.approx(asked[steady], rel=0.02)


@pytest.mark.parametrize("sets, words", [
    ({"MOTION(1).DURATION": 0}, ["must be given, the longest time"]),
    ({"MOTION(2).UNTIL_PROBE": "far"}, ["there is no &PROBE of this name"]),
    ({"MOTION(1).UNTIL_PROBE": "near"}, ["has no effect without UNTIL_TEMPERATURE"]),
    ({"MOTION(2).FORCE_TABLE": "0,1e3"}, ["takes the place of FORCE"]),
    ({"MOTION(4).FORCE_TABLE": "0,1e3,0,2e3"}, ["must have rising times"]),
    ({"MOTION(4).FORCE_TABLE": "0,1e3,1"}, ["must be pairs"]),
    ({"TOOL.AT_LIMIT": "stop"}, ["has no effect without MAX_FORCE or MAX_TORQUE"])])
def test_errors(run, sets, words):
    """What cannot be done is refused."""
    done = run(SCENE, "--check=scene", sets=sets, expect=driver.BAD_INPUT)
    for word in words:
        assert word in done.err


def test_check(run):
    """--check counts the longest times and says so; nothing ends while it looks."""
    out = run(SCENE, "--check=scene").out
    assert "as if they took their DURATION" in out and "ends:" not in out


def test_restart_refuses_other_phases(run):
    """Phases that may have come already cannot be changed."""
    results = run(SCENE, "--quiet", sets={"TIME.END": 3.2e-3}).results(SCENE)
    for sets in ({"MOTION(1).UNTIL_FORCE": 15e3}, {"MOTION(3).VELOCITY": "2e-3,0,0"}):
        done = run(None, "--restart", results.path("_checkpoint.h5"), sets=sets | {"TIME.END": 24e-3}, expect=driver.BAD_INPUT)
        assert "a restart cannot change phases" in done.err


@pytest.mark.parametrize("pin, is_alone", [("", False), (", PIN_RADIUS = 1.5e-3, PIN_LENGTH = 2e-3", True)])
def test_pin_alone(run, pin, is_alone, tmp_path):
    """A phase that ends at a force while only the pin is in the metal says so."""
    text = (driver.INPUTS / f"{SCENE}.nml").read_text().replace("UNTIL_FORCE = 20e3", "UNTIL_FORCE = 1e3")
    text = text.replace("20e-3, 12e-3, FRICTION = 0.2", f"20e-3, {14e-3 if pin else 12e-3}, FRICTION = 0.2{pin}")
    path = tmp_path / "pin.nml"
    path.write_text(text.replace("END = 24e-3", "END = 3e-3"))
    done = run(path)
    assert "UNTIL_FORCE" in done.out
    assert ("the pin alone in the metal" in done.out) == is_alone


def test_pressed_throughout(run, tmp_path):
    """A tool above the plate that a force alone brings down: --check tells what its damping carries, c of docs/method.md times the root of
    the mass scaling, and does not say that it never touches; a run that ends with the pin alone in the metal says so."""
    text = (driver.INPUTS / f"{SCENE}.nml").read_text()
    text = re.sub(r"(&MOTION.*\n)+", "&MOTION TOOL = 'disc', FORCE = 1e3, SPIN_RPM = 970 /\n", text)
    text = text.replace("20e-3, 12e-3, FRICTION = 0.2", "20e-3, 14.1e-3, FRICTION = 0.2, DAMPING = 3e3, PIN_RADIUS = 1.5e-3, PIN_LENGTH = 2e-3")
    path = tmp_path / "pressed.nml"
    path.write_text(text.replace("END = 24e-3", "END = 3e-3"))
    done = run(path, "--check=scene")
    assert "comes down by its FORCE" in done.out and "its DAMPING carries 300 N" in done.out and "never touches" not in done.out + done.err
    assert "the pin alone in the metal" in run(path, "--quiet").out
