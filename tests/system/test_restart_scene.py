# SPDX-License-Identifier: MIT
"""A restart knows its scene: what may change goes on, all else is refused by key, old and new value."""

import re

import driver
import numpy as np
import pytest

SHORT = {"TIME.MAX_STEPS": 6, "OUTPUT.FRAME_INTERVAL": 0, "TIME.MASS_SCALING": 1e8}


@pytest.fixture(scope="module")
def stir(tmp_path_factory):
    """A checkpoint of stir.nml after 6 steps, at about 5 ms, written on 2 ranks."""
    directory = tmp_path_factory.mktemp("stir")
    return driver.run("stir", "--quiet", directory=directory, ranks=2, sets=SHORT).results("stir").path("_checkpoint.h5")


# Overrides, and what the message must have: key, old and new value.
REFUSED = [
    ("GRID.CELL", "2e-3", r"&GRID CELL = 2e-3: .* from 4e-3 to 2e-3"),
    ("GRID.CELL", "5e-3", r"&GRID CELL = 5e-3: .* from 4e-3 to 5e-3"),
    ("GRID.LOWER", "-20e-3,-20e-3,0", r"&GRID LOWER = .* from -8e-3, -8e-3, 0 to -20e-3, -20e-3, 0"),
    ("METHOD.TRANSFER", "apic", r"&METHOD TRANSFER = 'apic': .* from 'flip' to 'apic'"),
    ("METHOD.SHAPE", "cpgimp", r"&METHOD SHAPE = 'cpgimp': .* from 'auto' to 'cpgimp'"),
    ("METHOD.PIC_FRACTION", "0.1", r"&METHOD PIC_FRACTION = 0.1: .* from 0 to 0.1"),
    ("MATERIAL.LAW", "elastic", r"&MATERIAL LAW = 'elastic': .* from 'johnson-cook' to 'elastic'"),
    ("MATERIAL.JC_A", "91e6", r"&MATERIAL JC_A = 91e6: .* from 90e6 to 91e6"),
    ("MATERIAL.DENSITY", "8961", r"&MATERIAL DENSITY = 8961: .* from 8960 to 8961"),
    ("MATERIAL.PLASTIC_HEAT", "0.8", r"&MATERIAL PLASTIC_HEAT = 0.8: .* from 0.9 to 0.8"),
    ("BODY.TEMPERATURE", "300", r"&BODY TEMPERATURE = 300: .* from 298 to 300"),
    ("BODY.PARTICLES_PER_CELL", "3", r"&BODY PARTICLES_PER_CELL = 3: .* from 2 to 3"),
    ("SHAPE.UPPER", "48e-3,36e-3,12e-3", r"&SHAPE UPPER = .* from 48e-3, 40e-3, 12e-3 to 48e-3, 36e-3, 12e-3"),
    ("TOOL.RADIUS", "9e-3", r"&TOOL RADIUS = 9e-3: .* from 10e-3 to 9e-3"),
    ("TOOL.FRICTION", "0.3", r"&TOOL FRICTION = 0.3: .* from 0.2 to 0.3"),
    ("MOTION(1).SPIN_RPM", "900", r"&MOTION of tool: a restart at t = .* s cannot change what was before"),
    ("MOTION(1).DURATION", "1e-3", r"&MOTION of tool: a restart at t = .* s cannot change what was before"),
    ("WALL.KIND", "sliding", r"&WALL KIND = 'sliding': .* from 'fixed' to 'sliding'"),
    ("SURFACE.COEFFICIENT", "701", r"&SURFACE COEFFICIENT = 701: .* from 700 to 701"),
    ("HEAT.AMBIENT", "299", r"&HEAT AMBIENT = 299: .* from 298 to 299"),
    ("PROBE(1).NAME", "T9", r"&PROBE NAME = 'T9': .* from 'T1' to 'T9'"),
    ("PROBE(2).POSITION", "30e-3,20e-3,6e-3", r"&PROBE POSITION = .* from 30e-3, 20e-3, 5e-3 to 30e-3, 20e-3, 6e-3"),
]

# Changes of the text of stir.nml: what goes, what comes, and the message.
REWRITTEN = [
    (r"&HEAT AMBIENT = 298 /\n&SURFACE.*\n", "", r"&HEAT is missing: the scene of the checkpoint has"),
    (r"&SURFACE.*\n", "", r"&SURFACE is missing: the scene of the checkpoint has"),
    (r"&PROBE NAME = 'T2'.*\n", "", r"&PROBE is missing: the scene of the checkpoint has 2 of them"),
    (r"(&WALL SIDE = 'zmin'.*\n)", r"\1&WALL SIDE = 'xmin', POSITION = 0 /\n", r":\d+: error: &WALL was added"),
    (r"(&SHAPE .*\n)", r"\1&BODY NAME = 'b', MATERIAL = 'copper' /\n&SHAPE BODY = 'b', "
     r"LOWER = 40e-3, 0, 12e-3, UPPER = 48e-3, 4e-3, 16e-3 /\n", r":\d+: error: &BODY was added"),
    (r"&MOTION TOOL = 'tool', DURATION.*\n&MOTION.*\n", "", r"&MOTION of tool: "),
]


def error_lines(done):
    return [line for line in done.err.splitlines() if "error:" in line]


@pytest.fixture(scope="module")
def refused(tmp_path_factory, stir):
    """Every refused change with and without the input, on 1, 2 and 3 ranks in turn."""
    cases = {}
    for k, (key, value, _) in enumerate(REFUSED):
        name = "stir" if k % 2 else None
        cases[key, value] = ((name, "--restart", stir), {"sets": {**(SHORT if name else {}), key: value},
                                                         "ranks": (None, 2, 3)[k % 3]})
    text = (driver.INPUTS / "stir.nml").read_text(encoding="utf-8")
    for k, (old, new, _) in enumerate(REWRITTEN):
        changed, count = re.subn(old, new, text)
        assert count == 1
        cases[old] = (("stir.nml", "--restart", stir), {"sets": SHORT, "text": changed, "ranks": (3, None, 2)[k % 3]})
    return driver.run_all(cases, tmp_path_factory.mktemp("refused"))


@pytest.mark.parametrize("key, value, message", REFUSED)
def test_other_scene_is_refused(refused, key, value, message):
    """Exact: status 2, one message with key, old and new value, nothing written."""
    done = refused[key, value]
    print(done.err)
    assert done.status == driver.BAD_INPUT and done.files == []
    assert len(error_lines(done)) == 1 and re.search(message, error_lines(done)[0])


@pytest.mark.parametrize("old, new, message", REWRITTEN)
def test_added_and_removed_groups_are_refused(refused, old, new, message):
    """Exact: status 2 and a message that names the group, for groups that went or came."""
    done = refused[old]
    print(done.err)
    assert done.status == driver.BAD_INPUT and done.files == ["stir.nml"]
    assert re.search(message, done.err)


def test_all_differences_at_once(run, stir, tmp_path):
    """Exact: three differences, three messages."""
    done = run("stir", "--restart", stir, expect=driver.BAD_INPUT,
               sets=SHORT | {"MATERIAL.DENSITY": 8961, "GRID.CELL": 5e-3, "PROBE(2).NAME": "x"})
    assert len(error_lines(done)) == 3


def test_another_input_is_refused(run, stir, tmp_path):
    """Exact: quite another scene, on 3 ranks, and heat alone: status 2 and no crash."""
    for name in ("block", "heat_slab"):
        done = run(name, "--restart", stir, ranks=3, expect=driver.BAD_INPUT)
        assert len(error_lines(done)) > 5
    assert list(tmp_path.iterdir()) == []


def test_the_same_in_other_words_goes_on(run, stir, tmp_path):
    """Exact: 0.004 is 4e-3, and capitals of a choice do not matter."""
    run("stir", "--quiet", "--restart", stir,
        sets=SHORT | {"GRID.CELL": "0.004", "WALL.KIND": "FIXED", "TIME.MAX_STEPS": 7})


# In one run what goes together: a key that may not change would be named by a message.
ALLOWED = [
    {"TIME.END": 0.3, "TIME.CFL": 0.2, "TIME.MASS_SCALING": 1e7, "TIME.GRAVITY": "0,0,-9.81", "METHOD.SLEEPING": "off",
     "METHOD.SORT_INTERVAL": 3, "METHOD.REBALANCE": 2, "HEAT.FOURIER": 0.1, "RUN.TITLE": "other", "RUN.NAME": "other"},
    {"TIME.MASS_SCALING": 1e6, "TIME.MASS_SCALING_RANGE": "1e6,1e7", "METHOD.SLEEPING": "on", "METHOD.SLEEP_DISTANCE": 3e-3, "MOTION(1).DURATION": 0.05},
    {"METHOD.SELECTIVE_SCALING": "off", "OUTPUT.FRAME_INTERVAL": 1e-3, "OUTPUT.HISTORY_INTERVAL": 1e-3,
     "OUTPUT.CHECKPOINT_INTERVAL": 2e-3, "MOTION(2).VELOCITY": "0,10e-3,0", "MOTION(2).RAMP": 0},
]


@pytest.mark.parametrize("ranks, sets", list(zip((2, None, 3), ALLOWED)))
def test_what_may_change_goes_on(run, stir, ranks, sets):
    """Exact: three more steps, status 0, no message but notes, on the same and other ranks."""
    done = run("stir", "--quiet", "--restart", stir, sets=SHORT | {"TIME.MAX_STEPS": 9} | sets, ranks=ranks)
    print(done.out, done.err)
    assert done.err == ""
    state = done.results(sets.get("RUN.NAME", "stir")).checkpoint()
    assert state.step == 9 and np.isfinite(state.v).all()


@pytest.mark.parametrize("before, after", [("off", "on"), ("on", "off")])
def test_sleeping_changes_at_a_restart(run, tmp_path, before, after):
    """Exact: sleeping may be switched on and off: 20 more steps, and energies that stay finite."""
    sets = {"OUTPUT.FRAME_INTERVAL": 0, "TIME.MAX_STEPS": 20, "METHOD.SLEEPING": before}
    results = run("stir", "--quiet", sets=sets).results("stir")
    path = results.path("_checkpoint.h5")
    run("stir", "--quiet", "--restart", path, sets=sets | {"TIME.MAX_STEPS": 40, "METHOD.SLEEPING": after})
    state = results.checkpoint()
    assert state.step == 40 and np.abs(state.v).max() < 10.0


def test_motions_still_to_come(run, tmp_path):
    """Exact: the second phase begins at 4e-3 s; after a stop at 2e-3 s it may be another one, and the end is
    that of a run which had it from the start, bit for bit; after a stop in it it may not."""
    phases = {"TIME.MASS_SCALING": 1e8, "OUTPUT.FRAME_INTERVAL": 0, "TIME.DT": 5e-4, "MOTION(1).DURATION": 4e-3}
    other = {"MOTION(2).VELOCITY": "0,20e-3,0"}
    places = [tmp_path / name for name in ("whole", "part")]
    for place in places:
        place.mkdir()
    whole = run("stir", "--quiet", directory=places[0], sets=phases | other | {"TIME.MAX_STEPS": 12}).results("stir")
    part = run("stir", "--quiet", directory=places[1], sets=phases | {"TIME.MAX_STEPS": 4}).results("stir")
    path = part.path("_checkpoint.h5")
    run("stir", "--quiet", "--restart", path, directory=places[1], sets=phases | other | {"TIME.MAX_STEPS": 12})
    one, two = whole.checkpoint(), part.checkpoint()
    for name in ("x", "v", "temp", "plastic"):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name
    done = run("stir", "--quiet", "--restart", path, directory=places[1], sets=phases, expect=driver.BAD_INPUT)
    assert "cannot change what was before" in done.err


def test_extended_run(run, tmp_path):
    """Exact: a run ended at 2e-3 s leaves a checkpoint; with a later END it ends as a run in one go does, bit
    for bit, since DT divides the first END."""
    sets = {"TIME.MASS_SCALING": 1e8, "OUTPUT.FRAME_INTERVAL": 1e-3, "TIME.DT": 5e-4, "OUTPUT.HISTORY_INTERVAL": 1e-3}
    places = [tmp_path / name for name in ("whole", "part")]
    for place in places:
        place.mkdir()
    sets["OUTPUT.CHECKPOINT_INTERVAL"] = 0
    whole = run("stir", "--quiet", directory=places[0], sets=sets | {"TIME.END": 4e-3}).results("stir")
    part = run("stir", "--quiet", directory=places[1], sets=sets | {"TIME.END": 2e-3}).results("stir")
    run(None, "--quiet", "--restart", part.path("_checkpoint.h5"), directory=places[1], sets={"TIME.END": 4e-3})
    one, two = whole.checkpoint(), part.checkpoint()
    assert one.step == two.step == 8 and two.time == pytest.approx(4e-3, rel=1e-12)
    for path, values in one.all.items():
        assert np.array_equal(values, two.all[path]), path
    for table in ("_history.csv", "_probes.csv"):
        assert whole.path(table).read_text() == part.path(table).read_text(), table


def test_stopped_between_rows_and_extended(run, tmp_path):
    """Exact: a run ended by MAX_STEPS where no row and no frame is due, then extended: state, tables and frames
    are those of the run in one go."""
    sets = {"TIME.MASS_SCALING": 1e6, "OUTPUT.FRAME_INTERVAL": 3e-3, "OUTPUT.HISTORY_INTERVAL": 3e-3, "TIME.END": 8e-3}
    places = [tmp_path / name for name in ("whole", "part")]
    for place in places:
        place.mkdir()
    whole = run("stir", "--quiet", directory=places[0], sets=sets).results("stir")
    part = run("stir", "--quiet", directory=places[1], sets=sets | {"TIME.MAX_STEPS": 10}).results("stir")
    assert part.history()["step"][-1] == 10 and 10 not in whole.history()["step"]
    run("stir", "--quiet", "--restart", part.path("_checkpoint.h5"), directory=places[1], sets=sets)
    for path, values in whole.checkpoint().all.items():
        assert path == "scene" or np.array_equal(values, part.checkpoint().all[path]), path
    for table in ("_history.csv", "_probes.csv"):
        assert whole.path(table).read_text() == part.path(table).read_text(), table
    assert whole.series() == part.series()


def test_extended_run_of_heat_alone(run, tmp_path):
    """Exact: the same for heat alone."""
    sets = {"HEAT.STEP": 0.25, "OUTPUT.HISTORY_INTERVAL": 0.5}
    places = [tmp_path / name for name in ("whole", "part")]
    for place in places:
        place.mkdir()
    whole = run("heat_slab", "--quiet", directory=places[0], sets=sets | {"TIME.END": 2}).results("heat_slab")
    part = run("heat_slab", "--quiet", directory=places[1], sets=sets | {"TIME.END": 1}).results("heat_slab")
    path = part.path("_checkpoint.h5")
    run(None, "--quiet", "--restart", path, directory=places[1], sets={"TIME.END": 2})
    for table in ("_history.csv", "_probes.csv"):
        assert whole.path(table).read_text() == part.path(table).read_text(), table
    for key, value in (("MATERIAL.CONDUCTIVITY", 101), ("SURFACE.COEFFICIENT", 6000), ("GRID.CELL", 2e-3)):
        done = run(None, "--restart", path, sets={key: value}, expect=driver.BAD_INPUT)
        assert f"&{key.replace('.', ' ')} = " in done.err and "a restart cannot change it from" in done.err
