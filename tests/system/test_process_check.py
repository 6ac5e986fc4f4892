# SPDX-License-Identifier: MIT
"""--check of the process: depth, path and clearances of each phase, and settings that make no sense."""

import math
import re

import driver
import pytest

QUICK = driver.ROOT / "input" / "fsp_copper_quick.nml"
SIN = 0.05233595624294383  # of 3 degrees

# Changes of the quick start, and the error (exit status 2) or warning (0) about them.
CASES = {
    "as it is": ({}, None, None),
    "radius in mm": ({"TOOL.RADIUS": 7}, "error", "RADIUS = 7: is far larger than the grid of 112 mm: lengths are in m"),
    "position in mm": ({"TOOL.POSITION": "28, 20, 12.6"}, "error", "POSITION .*outside the grid throughout the run"),
    "put away": ({"TOOL.POSITION": "0.2, 20e-3, 12.6e-3"}, "warning", "POSITION .*outside the grid throughout the run"),
    "pin through the plate": ({"TOOL.PIN_RADIUS": 3e-3, "TOOL.PIN_LENGTH": 11.5e-3}, "error",
                              r"MOTION VELOCITY .*comes out below the bottom of the plate of 12 mm at t = 0\.[0-9]+ s"),
    "pin longer than the plate": ({"TOOL.PIN_RADIUS": 3e-3, "TOOL.PIN_LENGTH": 14e-3}, "error", "TOOL POSITION .*at t = 0 s"),
    "tool plunges through": ({"MOTION(1).VELOCITY": "0, 0, -30e-3"}, "error", "comes out below the bottom"),
    "pin without a radius": ({"TOOL.PIN_LENGTH": 3e-3}, "error", "PIN_LENGTH = 0.003: makes no pin without PIN_RADIUS"),
    "pin without a length": ({"TOOL.PIN_RADIUS": 3e-3}, "error", "PIN_RADIUS = 0.003: makes no pin without PIN_LENGTH"),
    "travel too long": ({"MOTION(2).VELOCITY": "50e-3, 0, 0"}, "warning", "travels 209.* mm and is off the plate of 100 mm x 40 mm from t = 2.5"),
    "never touches": ({"TOOL.POSITION": "28e-3, 20e-3, 15e-3"}, "warning", "never touches a body"),
    "goes up": ({"MOTION(1).VELOCITY": "0, 0, 1.5e-3"}, "warning", "never touches a body"),
    "starts inside": ({"TOOL.POSITION": "28e-3, 20e-3, 11e-3"}, "warning", "starts 1.* mm inside the material"),
    "wider than the plate": ({"TOOL.RADIUS": 60e-3, "TIME.MASS_SCALING": 1e5, "TOOL.TILT_DEG": 0}, "warning", "120 mm across is wider than the bodies, 100 mm"),
    "ramp too long": ({"MOTION(1).RAMP": 1}, "warning", "RAMP = 1: is longer than the DURATION"),
    "no time": ({"TIME.END": 0}, "warning", "never touches a body until &TIME END = 0 s"),
    "no room for flash": ({"GRID.UPPER": "104e-3,48e-3,12e-3"}, "warning", "GRID UPPER .*ends 0 mm above the plate"),
    "density in g/cm3": ({"MATERIAL.DENSITY": 8.96}, "warning", "DENSITY = 8.96: is that of no metal, 500 to 23000 kg/m3"),
    "force in kN": ({"MOTION(2).FORCE": 12}, "warning", "FORCE = 12: moves the tool by .* at most against its DAMPING: is it in kN"),
    "force in N": ({"MOTION(2).FORCE": 12e3}, None, None),
    "phase that never comes": ({"MOTION(1).DURATION": 0}, "error", "is never reached"),
}


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    """--check of every case, at cells of 4 mm and for 5 s."""
    grid = {"TIME.END": 5, "GRID.CELL": 4e-3, "GRID.LOWER": "-8e-3,-8e-3,0", "GRID.UPPER": "104e-3,48e-3,24e-3"}
    cases = {name: ((QUICK, "--check=scene"), {"sets": grid | sets}) for name, (sets, *_) in CASES.items()}
    cases["run"] = ((QUICK, "--quiet"), {"sets": grid | CASES["never touches"][0] | {"TIME.MAX_STEPS": 1}})
    return driver.run_all(cases, tmp_path_factory.mktemp("process"))


@pytest.mark.parametrize("name", CASES)
def test_process(outcome, name):
    """Exact: one error or one warning about the process, with the place in the input; none about a sound one."""
    done, (_, word, text) = outcome[name], CASES[name]
    print(done.out, done.err)
    said = [line for line in (done.err + done.out).splitlines() if "error:" in line or "warning:" in line]
    said = [line for line in said if "&SHAPE" not in line]   # of the cavity, as it says
    assert done.status == (driver.BAD_INPUT if word == "error" else driver.WELL)
    assert len(said) == (0 if word is None else 1), said
    if word:
        assert re.match(rf"(--set .*|.*fsp_copper_quick.nml:\d+): {word}: &(TOOL|MOTION|GRID|MATERIAL) .*", said[0]), said
        assert re.search(text, said[0]), said


PIN = (driver.ROOT / "share/stirpoint/new/pin.nml").read_text()
CLAMP = "&CLAMP LOWER = -1e-3, -1e-3, -0.1e-3, UPPER = 61e-3, 4.1e-3, 8.1e-3 /"

# What is put for what in the weld of --new, and what is said of it: one error or warning.
PIN_CASES = {
    "held by nothing": (r"&(WALL|CLAMP)\b.*", "", "warning: &TOOL NAME = 'tool': pushes and turns bodies that nothing holds"),
    "clamp under the tool": (re.escape(CLAMP), CLAMP.replace("4.1e-3", "16e-3"), "warning: &CLAMP holds metal under tool"),
    "clamp of another plate": (re.escape(CLAMP), CLAMP.replace("-1e-3, -0.1e-3", "-9e-3, -0.1e-3").replace("4.1e-3", "-5e-3"), "warning: &CLAMP holds nothing"),
    "no such metal": ("'AA6061-T6-weld'", "'AA6061'", "error: &MATERIAL FROM = 'AA6061': the library has no 'AA6061'"),
    "grid in mm": ("CELL = 2e-3", "CELL = 2", "error: &GRID UPPER .*at least one cell above LOWER"),
}


@pytest.mark.parametrize("name", PIN_CASES)
def test_one_mistake_in_a_weld(run, tmp_path, name):
    """Exact: one mistake in the weld of --new has one message, and none about its consequences."""
    old, new, said = PIN_CASES[name]
    text, count = re.subn(old, new, PIN)
    assert count
    (tmp_path / "weld.nml").write_text(text)
    done = run("weld.nml", "--check=scene", expect=None)
    found = [line for line in (done.err + done.out).splitlines() if re.match(r"weld\.nml:\d+: ", line)]
    assert len(found) == 1 and re.search(said, found[0]), found
    assert done.status == (driver.BAD_INPUT if "error" in said else driver.WELL)


def test_lengths_in_mm(tmp_path):
    """Each length of the plate, the tool and the probes of the weld of --new, given in mm, has a message with its line."""
    wanted = r"\b(UPPER|RADIUS|PIN_RADIUS|PIN_TIP_RADIUS|PIN_LENGTH|POSITION) = ([-+.\de]+(?:, [-+.\de]+)*)"
    places = [m for m in re.finditer(wanted, PIN) if not re.search(r"&(GRID|CLAMP)[^&]*$", PIN[:m.start()]) and "!" not in PIN[:m.start()].splitlines()[-1]]
    assert len(places) == 8
    cases = {}
    for m in places:
        mm = ", ".join(f"{1e3 * float(x):g}" for x in m[2].split(","))
        cases[f"{m[1]} {m.start()}"] = (("weld.nml", "--check=scene"), {"text": PIN[:m.start(2)] + mm + PIN[m.end(2):]})
    for name, done in driver.run_all(cases, tmp_path).items():
        assert done.status == driver.BAD_INPUT and re.match(r"weld\.nml:\d+: error: ", done.err), (name, done)


def test_warnings_at_the_start_of_a_run(outcome):
    """Exact: a run says them once, too."""
    assert outcome["run"].out.count("never touches a body") == 1


def table(done):
    """The rows of the table of phases: name to numbers, None where there is none."""
    rows = {}
    for line in done.out.splitlines():
        if re.match(r" +(plunge|dwell|travel|retract|rest) ", line):
            words = line.split()
            rows[words[0]] = [None if word == "-" else float(word) for word in words[1:]]
    return rows


def test_table_of_phases(outcome):
    """Exact, to the last digit printed and the 15 degrees between points of the rim: the quick start's tool starts with its
    trailing edge R sin 3 deg below POSITION, plunges 1.5 mm/s for 0.77 s and as much again in half of the ramp of
    0.1 s, then goes 4 mm/s; 10 mm are left beside it (40 mm wide, R = 10 mm); it touches when its edge does."""
    rows = table(outcome["as it is"])
    print(rows)
    start, stop, way, speed, spin, depth, bottom, edge, side = rows["plunge"]
    lowest = 12.5816 - 10 * SIN
    assert (start, stop, way, speed, spin) == (0, 0.77, 1.155, 1.5, 970)
    assert depth == pytest.approx(12 - (lowest - 1.155), abs=2e-3)
    assert depth + bottom == pytest.approx(12, abs=2e-3)
    assert edge == pytest.approx(10, abs=0.1) and side == pytest.approx(bottom, abs=2e-3)
    start, stop, way, speed, spin, depth, bottom, edge, side = rows["travel"]
    assert (start, stop, speed, spin) == (0.77, 5, 4, 970)
    assert way == pytest.approx(4 * (4.23 - 0.05), abs=0.06)
    assert depth == pytest.approx(12 - (lowest - 1.155 - 0.075), abs=2e-3)
    touch = re.search(r"touches at t = ([0-9.e-]+) s", outcome["as it is"].out)
    assert float(touch[1]) == pytest.approx((lowest - 12) / 1.5, abs=2e-3)


def test_table_without_contact(outcome):
    """Exact: a tool that stays 3 mm above the plate has a depth below 0 and says so."""
    done = outcome["never touches"]
    assert "never touches the bodies where they are at t = 0" in done.out
    assert table(done)["plunge"][5] == pytest.approx(-(15 - 10 * SIN - 1.155 - 12), abs=2e-3)


def test_volumes(outcome, run):
    """Exact: a plate of 100 x 40 x 12 mm and the cavity of 20 x (7.5 + 14)/2 x 6 mm cut from it, to 1e-4 of the cavity, with what
    their particles of 8 mm3 make of them, and a warning above 2 %; round bodies by their formulas, to 1e-3."""
    out = outcome["as it is"].out
    print(out)
    filled, asked = map(float, re.search(r"&SHAPE 2: (\S+) mm3 for (\S+) mm3", out).groups())
    assert asked == pytest.approx(-1290, rel=1e-4) and filled % 8 == pytest.approx(0)
    body = re.search(r"volume +plate: (\S+) mm3 for (\S+) mm3 required \((\S+) %\), (\S+) kg", out)
    particles = int(re.search(r"plate: (\d+) particles", out)[1])
    assert float(body[1]) == pytest.approx(8 * particles) and float(body[2]) == pytest.approx(46710, rel=1e-5)
    assert float(body[4]) == pytest.approx(8 * particles * 8960e-9, rel=1e-5)
    percent = 100 * (filled / asked - 1)
    assert abs(percent) > 2 and re.search(rf"warning: &SHAPE cuts .*\(\{percent:+.2f} %\)", out)
    discs = run("discs", "--check=scene").out
    assert float(re.search(r"left: \S+ mm3 for (\S+) mm3 required", discs)[1]) == pytest.approx(math.pi * 200**2 * 50, rel=1e-3)
    ring = run("annulus", "--check=scene").out      # its hole is cut by a cylinder of 1 m, its particles lie on rings
    filled, asked = map(float, re.search(r"ring: (\S+) mm3 for (\S+) mm3 required", ring).groups())
    assert asked == pytest.approx(math.pi * (13**2 - 3**2) * 2, rel=1e-3) and filled == pytest.approx(asked, rel=1e-3)
    assert "warning" not in ring


def test_a_pin_in_its_hole_touches(run):
    """Exact: a pin fills the hole of a ring that a rigid ring surrounds: all touch from the start. Not so with a gap of 0.1 cells."""
    scene = driver.ROOT / "tests" / "verification" / "inputs" / "couette.nml"
    done = run(scene, "--check=scene")
    assert "never touches" not in done.out + done.err
    done = run(scene, "--check=scene", sets={"TOOL.PIN_RADIUS": 2.91e-3, "SHAPE(4).RADIUS": 12.1e-3})
    apart = done.out + done.err
    assert "the tool never touches a body" in apart and "the rigid body never touches another" in apart


@pytest.mark.parametrize("speed, passes", [(4e-3, 6.0e9), (8e-3, 1.5e9)])
def test_inertia_above_strength(run, tmp_path, speed, passes):
    """A mass scaling with which pushing the metal aside takes more stress than its strength is refused, from
    stress / (density speed^2) on: a quarter at twice the speed, and more for no stiffer metal."""
    text = re.sub(r"MASS_SCALING_RANGE = \S+ \S+ ", "", run(None, "--new", "pin").out)      # the factor is that of the input
    (tmp_path / "pin.nml").write_text(text, encoding="utf-8")
    sets = {"GRID.CELL": 2e-3, "MOTION(1).DURATION": 2.95, "MOTION(1).VELOCITY": "0,0,-2e-3", "MOTION(3).VELOCITY": f"{speed},0,0"}
    refused = run("pin.nml", "--check=scene", sets=sets | {"TIME.MASS_SCALING": "1e11"}, expect=driver.BAD_INPUT)
    most = float(re.search(r"MASS_SCALING = 1e11: .* At most (\S+)", refused.err)[1])
    assert most == pytest.approx(passes, rel=0.02)
    run("pin.nml", "--check=scene", sets=sets | {"TIME.MASS_SCALING": 1.01 * most}, expect=driver.BAD_INPUT)
    coarse = run("pin.nml", "--check=scene", sets=sets | {"TIME.MASS_SCALING": 0.99 * most})
    fits = float(re.search(r"warning: &TIME MASS_SCALING .* cells in a step: .* At most (\S+) for one cell", coarse.out)[1])
    for factor in (0.99, 1.01):
        assert ("cells in a step" in run("pin.nml", "--check=scene", sets=sets | {"TIME.MASS_SCALING": factor * fits}).out) == (factor > 1)
    for factor, status in ((1.01 * most, driver.BAD_INPUT), (0.99 * most, driver.WELL)):   # of a range its smallest factor
        adapts = {"TIME.MASS_SCALING": 2 * most, "TIME.MASS_SCALING_RANGE": f"{factor},{4 * most}"}
        assert ("MASS_SCALING_RANGE" in run("pin.nml", "--check=scene", sets=sets | adapts, expect=status).err) or status == driver.WELL


def test_depths_of_tools_that_pass_through_or_above(run, tmp_path):
    """A bobbin is through the plate, and no metal is left below it; below a pin that is raised there is the whole sheet."""
    rows = {}
    for name in ("bobbin", "refill"):
        (tmp_path / f"{name}.nml").write_text(run(None, "--new", name).out, encoding="utf-8")
        out = run(f"{name}.nml", "--check=scene").out
        thickness = float(re.search(r"plate .* x (\S+) mm, top", out)[1])
        rows[name] = [line.split() for line in out.splitlines() if re.match(r" {4}\w+ +\d+\.\d+ ", line)]
        for row in rows[name]:
            assert row[7] == "-" or 0 <= float(row[7]) <= thickness, row
    assert all(row[6:8] == ["through", "-"] for row in rows["bobbin"])
    assert any(float(row[6]) < 0 for row in rows["refill"])
