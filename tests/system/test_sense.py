# SPDX-License-Identifier: MIT
"""Valid input that makes no sense: `file:line: error` before the run, or a warning at its start."""

import re

import driver
import pytest

SMALL = (driver.INPUTS / "small.nml").read_text().replace("CONDUCTIVITY = 0", "CONDUCTIVITY = 391, T_MELT = 1356")
HEAT = (driver.ROOT / "input" / "heat_copper_plain.nml").read_text()

JC = "JC_A = 9e7, JC_B = 3e8, JC_N = 0.3, JC_C = 0.02, JC_M = 1"
BODY = "&BODY NAME = 'block', MATERIAL = 'copper', TEMPERATURE = 300 /"
TOOL = "&TOOL NAME = 'punch', KIND = 'sphere', RADIUS = 2e-3, POSITION = 4e-3, 4e-3, 8.999e-3 /"
SURFACE = "&SURFACE BODY = 'block', FACE = 'xmin', COEFFICIENT = 700 /"
WALL = "&WALL SIDE = 'zmin', KIND = 'sliding', POSITION = 2e-3 /"
CLAMP = "&CLAMP LOWER = 0, 0, 0, UPPER = 1e-3, 1e-3, 1e-3, COMPONENTS = 'xy' /"
LOAD = "&LOAD BODY = 'block', FORCE = 0, 0, -1 /"
END = "END = 2e-6 /"

# What is put for what in small.nml, and the error, on the line of the change.
ERRORS = {
    "key of another kind of tool": (TOOL, TOOL.replace("RADIUS", "PIN_RADIUS = 1e-3, RADIUS"),
                                    r"&TOOL PIN_RADIUS = 1e-3: .*KIND = sphere, only with KIND = shoulder"),
    "key of a box": (TOOL, TOOL.replace("RADIUS", "SIZE = 1, 1, 1, RADIUS"), r"&TOOL SIZE .*only with KIND = box"),
    "key of another law": ("POISSON_RATIO = 0.34", f"POISSON_RATIO = 0.34, LAW = 'norton', NORTON_K = 4e7, NORTON_N = 0.2, {JC}",
                           r"&MATERIAL JC_A = 9e7: .*LAW = norton, only with LAW = johnson-cook"),
    "optional key of another law": ("POISSON_RATIO = 0.34", "POISSON_RATIO = 0.34, TP_GAMMA = 3",
                                    r"&MATERIAL TP_GAMMA = 3: .*only with LAW = two-phase"),
    "key of another shape": ("&SHAPE BODY = 'lid', LOWER", "&SHAPE BODY = 'lid', RADIUS = 1e-3, LOWER",
                             r"&SHAPE RADIUS = 1e-3: .*KIND = box, only with KIND = cylinder or sphere"),
    "key of another transfer": ("SHAPE = 'ugimp'", "SHAPE = 'ugimp', ORDER = 3", r"&METHOD ORDER = 3: .*TRANSFER = flip"),
    "table of friction that is none": (TOOL, TOOL.replace("RADIUS", "FRICTION_MU = 0.1, RADIUS"),
                                       r"&TOOL FRICTION_MU = 0.1: .*FRICTION_TABLE_OF = none"),
    "table of heat alone": ("DENSITY = 8960", "YIELD_TABLE = 300, 3e8, 900, 1e8, DENSITY = 8960",
                            r"&MATERIAL YIELD_TABLE .*only with MECHANICS = F"),
    "overlapping bodies": ("&BODY NAME = 'lid', MATERIAL = 'copper', TEMPERATURE = 400 /\n&SHAPE BODY = 'lid', LOWER = 2e-3, 2e-3, 5e-3",
                           "&BODY NAME = 'lid', MATERIAL = 'copper', TEMPERATURE = 400 /\n&SHAPE BODY = 'lid', LOWER = 2e-3, 2e-3, 4.5e-3", r"overlaps the body block by 8 mm3"),
    "name that is a formula": ("&OUTPUT", "&PROBE NAME = '=1', POSITION = 3e-3, 3e-3, 3e-3 /\n&OUTPUT", r"&PROBE NAME = '=1': must be"),
    "name of another probe": ("&OUTPUT", "&PROBE NAME = 'p', POSITION = 3e-3, 3e-3, 3e-3 /\n&PROBE NAME = 'p', POSITION = 4e-3, 4e-3, 3e-3 /\n&OUTPUT",
                              r"&PROBE NAME = 'p': is the name of another &PROBE"),
    "wall twice": (WALL, f"{WALL}\n{WALL.replace('sliding', 'fixed')}", r"&WALL SIDE = 'zmin': there is a wall in this place, on line (\d+)"),
    "clamp twice": (CLAMP, f"{CLAMP}\n{CLAMP.replace('xy', 'yz')}", r"&CLAMP holds the nodes of another, on line (\d+)"),
    "surface twice": (SURFACE, f"{SURFACE}\n{SURFACE}", r"&SURFACE .*takes the place of another, on line (\d+)"),
    "surface with another film": (SURFACE, f"{SURFACE}\n{SURFACE.replace('700', '15')}", r"&SURFACE .*takes the place of another, on line (\d+)"),
    "surface of all after one": (SURFACE, f"{SURFACE}\n{SURFACE.replace('xmin', 'all')}", r"&SURFACE .*takes the place of another, on line (\d+)"),
    "probe in the air": ("POSITION = 4e-3, 4e-3, 6.2e-3", "POSITION = 4e-3, 4e-3, 7.3e-3", r"&PROBE POSITION .*outside the bodies"),
    "disc above": ("&SURFACE", "&SOURCE POWER = 10, RADIUS = 1e-3, POSITION = 4e-3, 4e-3, 8.5e-3 /\n&SURFACE", r"&SOURCE .*never touches"),
    "disc beside": ("&SURFACE", "&SOURCE POWER = 10, RADIUS = 1e-3, POSITION = 0.5e-3, 4e-3, 7e-3 /\n&SURFACE", r"&SOURCE .*never touches"),
    "grid in mm": ("UPPER = 8e-3, 8e-3, 8e-3", "UPPER = 8, 8e-3, 8e-3", r"&GRID UPPER = .*: is 8 m from LOWER, for bodies of 0.005 m and less: is it in mm"),
    "ball outside": ("&SURFACE", "&SOURCE KIND = 'ball', POWER = 10, RADIUS = 1e-3, POSITION = 0, 0, 0 /\n&SURFACE", r"&SOURCE .*never touches"),
}

# Inputs that run with a warning, as above.
WARNINGS = {
    "bodies apart": ("&BODY NAME = 'lid', MATERIAL = 'copper', TEMPERATURE = 400 /\n&SHAPE BODY = 'lid', LOWER = 2e-3, 2e-3, 5e-3",
                     "&BODY NAME = 'lid', MATERIAL = 'copper', TEMPERATURE = 400 /\n&SHAPE BODY = 'lid', LOWER = 2e-3, 2e-3, 6e-3",
                     r"&BODY NAME = 'lid': has no &CONTACT with 'block', from which it is apart"),
    "load twice": (LOAD, f"{LOAD}\n&LOAD FORCE = 0.0, 0, -1.0, BODY = 'block' /", r"&LOAD is there twice, first on line (\d+); both act"),
    "two walls of a side": (WALL, f"{WALL}\n{WALL.replace('2e-3', '1e-3')}", r"&WALL .*another wall of this side, on line (\d+)"),
    "shape twice": ("&SHAPE BODY = 'lid', LOWER = 2e-3, 2e-3, 5e-3, UPPER = 6e-3, 6e-3, 7e-3 /",
                    "&SHAPE BODY = 'lid', LOWER = 2e-3, 2e-3, 5e-3, UPPER = 6e-3, 6e-3, 7e-3 /\n" * 2, r"&SHAPE changes nothing of its body"),
    "clamps that tear": (CLAMP, f"{CLAMP}\n&CLAMP LOWER = 0.5e-3, 0, 0, UPPER = 2e-3, 1e-3, 1e-3, VELOCITY = 1, 0, 0 /",
                         r"&CLAMP overlaps another that moves differently, on line (\d+)"),
    "source too late": ("&SURFACE", "&SOURCE POWER = 1, RADIUS = 1e-3, POSITION = 4e-3, 4e-3, 7e-3, BEGIN = 1 /\n&SURFACE", r"&SOURCE BEGIN = 1: .*no heat"),
}

# Inputs without errors or warnings.
SOUND = {
    "as it is": ("", ""),
    "film of one face after all": (SURFACE, f"{SURFACE.replace('xmin', 'all')}\n{SURFACE}"),
    "disc on the surface": ("&SURFACE", "&SOURCE POWER = 10, RADIUS = 1e-3, POSITION = 4e-3, 4e-3, 7e-3 /\n&SURFACE"),
    "disc that comes": ("&SURFACE", "&SOURCE POWER = 10, RADIUS = 1e-3, POSITION = -20e-3, 4e-3, 7e-3, VELOCITY = 1.2e4, 0, 0 /\n&SURFACE"),
    **{f"disc whose edge reaches {side}": ("&SURFACE", f"&SOURCE POWER = 10, RADIUS = 1e-3, POSITION = {x}e-3, {y}e-3, 7e-3 /\n&SURFACE")
       for side, x, y in (("xmin", 1.2, 4), ("xmax", 6.8, 4), ("ymin", 4, 1.2), ("ymax", 4, 6.8))},
    "ball below": ("&SURFACE", "&SOURCE KIND = 'ball', POWER = 10, RADIUS = 1e-3, POSITION = 4e-3, 4e-3, 1.5e-3 /\n&SURFACE"),
    "probe on the surface": ("POSITION = 4e-3, 4e-3, 6.2e-3", "POSITION = 4e-3, 4e-3, 7e-3"),
}


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    """--check of every change of small.nml."""
    cases = {}
    for name, (old, new, *_) in (ERRORS | WARNINGS | SOUND).items():
        assert old in SMALL, name
        cases[name] = (("small.nml", "--check=scene"), {"text": SMALL.replace(old, new, 1)})
    cases["heat"] = (("heat.nml", "--check=scene"), {"text": HEAT.replace("12e-3, VELOCITY", "13e-3, VELOCITY")})
    cases["override"] = (("small.nml", "--check=scene"), {"text": SMALL.replace("KIND = 'sphere'", "KIND = 'box', SIZE = 2e-3, 2e-3, 2e-3", 1)
                         .replace(", RADIUS = 2e-3", ""), "sets": {"TOOL.KIND": "sphere", "TOOL.RADIUS": 1e-3}})
    return driver.run_all(cases, tmp_path_factory.mktemp("sense"))


def lines_of(name, table):
    """First and last line of what was put in."""
    old, new = table[name][:2]
    first = SMALL[: SMALL.index(old)].count("\n") + 1
    return range(first, first + new.count("\n") + 1)


@pytest.mark.parametrize("name", ERRORS)
def test_nonsense_is_refused(outcome, name):
    """Exact: one error (one for each key of another law), on a line of the change, and nothing is written."""
    done = outcome[name]
    print(done.err)
    assert done.status == driver.BAD_INPUT and done.files == ["small.nml"]
    for message in done.err.splitlines():
        said = re.match(r"small\.nml:(\d+): error: ", message)
        assert said and int(said[1]) in lines_of(name, ERRORS), message
    found = re.search(ERRORS[name][2], done.err)
    assert found, done.err
    if found.groups():
        assert int(found[1]) in lines_of(name, ERRORS)
    assert len(done.err.splitlines()) == (5 if name == "key of another law" else 1)


@pytest.mark.parametrize("name", WARNINGS)
def test_doubtful_is_said(outcome, name):
    """Exact: exit status 0 and one warning on a line of the change."""
    done = outcome[name]
    warnings = [line for line in done.out.splitlines() if "warning" in line]
    assert done.status == driver.WELL and done.err == "" and len(warnings) == 1, done.out + done.err
    said = re.match(rf"small\.nml:(\d+): warning: .*{WARNINGS[name][2]}", warnings[0])
    assert said and int(said[1]) in lines_of(name, WARNINGS), warnings


@pytest.mark.parametrize("name", SOUND)
def test_sound_scenes_are_let_be(outcome, name):
    """Exact: neither errors nor warnings."""
    assert outcome[name].status == driver.WELL and outcome[name].err == "" and "warning" not in outcome[name].out, outcome[name]


def test_source_of_heat_alone_above_the_plate(outcome):
    """Exact: a stirring disc a cell above the surface is refused."""
    assert outcome["heat"].status == driver.BAD_INPUT and "the source never touches a body" in outcome["heat"].err


def test_override_of_a_kind(outcome, run, tmp_path):
    """Exact: a key of the file that an override makes idle is a warning, so that studies are possible, and the
    run can be continued."""
    done = outcome["override"]
    assert done.status == driver.WELL and re.search(r"small\.nml:\d+: warning: &TOOL SIZE .*only with KIND = box", done.out), done
    text = SMALL.replace("KIND = 'sphere'", "KIND = 'box', SIZE = 2e-3, 2e-3, 2e-3", 1).replace(", RADIUS = 2e-3", "")
    (tmp_path / "a.nml").write_text(text)
    sets = {"TOOL.KIND": "sphere", "TOOL.RADIUS": 1e-3, "OUTPUT.CHECKPOINT_INTERVAL": 1e-6}
    run(tmp_path / "a.nml", "--quiet", sets=sets)
    assert "warning" not in run(None, "--restart", "a.out/a_checkpoint.h5", "--quiet").out


def test_metal_that_necks(run):
    """Metal that does not harden, without a tool that presses it, is named; metal that hardens is not."""
    for name, has_word in (("layer", True), ("small", False)):
        assert ("does not harden" in run(name, "--check=scene").out) == has_word
