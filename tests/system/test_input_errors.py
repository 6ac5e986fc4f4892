# SPDX-License-Identifier: MIT
"""Bad input: `file:line: error: message`, all messages at once, exit status 2, nothing written."""

import re

import driver
import pytest

LINES = (driver.INPUTS / "small.nml").read_text().splitlines()


def spoil(*changes):
    """The text of small.nml with `old` replaced by `new`, and the number of the line of each change."""
    lines, numbers = list(LINES), []
    for old, new in changes:
        places = [k for k, line in enumerate(lines) if old in line]
        assert places, old
        numbers.append(places[0] + 1)
        lines[places[0]] = lines[places[0]].replace(old, new, 1)
    return "\n".join(lines) + "\n", numbers


def messages_of(done, files):
    """The messages of a run that must have ended with status 2 and written nothing."""
    print(done.err)
    assert done.status == driver.BAD_INPUT
    assert done.out == ""
    assert done.files == files, "something was written"
    return done.err.splitlines()


# What is spoiled, and what the message must say.
MISTAKES = {
    "unknown group": [("&METHOD SHAPE = 'ugimp'", "&METHID SHAPE = 'ugimp'"), r"&METHID; did you mean METHOD\?"],
    "unknown key": [("END = 2e-6", "END = 2e-6, GRAWITY = 0, 0, 0"), r"&TIME .*GRAWITY; did you mean GRAVITY\?"],
    "key of another group": [("END = 2e-6", "END = 2e-6, RADIUS = 1"), r"&TIME has no key RADIUS"],
    "text for a number": [("END = 2e-6", "END = 'soon'"), r"&TIME END = 'soon': expected a real number \[s\]"],
    "number for a text": [("MATERIAL = 'copper', T", "MATERIAL = 3, T"), r"MATERIAL = 3: .*quotes"],
    "text without quotes": [("MATERIAL = 'copper', T", "MATERIAL = copper, T"), r"MATERIAL = copper: .*quotes"],
    "broken number": [("DENSITY = 8960", "DENSITY = 89x60"), r"DENSITY = 89x60: expected a real number"],
    "real for an integer": [("MATERIAL = 'copper', T", "PARTICLES_PER_CELL = 2.5, MATERIAL = 'copper', T"),
                            r"PARTICLES_PER_CELL = 2.5: expected up to 3 integers"],
    "number for a logical": [("RADIUS = 2e-3", "RADIUS = 2e-3, SHEAR_LIMIT = 7"), r"SHEAR_LIMIT = 7: .*\.true\."],
    "friction law without its coefficient": [("RADIUS = 2e-3", "RADIUS = 2e-3, FRICTION_LAW = 'wanheim-bay'"),
                                             r"FRICTION_LAW.*needs SHEAR_FACTOR"],
    "coefficient of another friction law": [("RADIUS = 2e-3", "RADIUS = 2e-3, STICK_FRACTION = 0.3"),
                                            r"STICK_FRACTION.*FRICTION_LAW = schmidt-hattel"],
    "no such friction law": [("RADIUS = 2e-3", "RADIUS = 2e-3, FRICTION_LAW = 'shear-faktor'"), r"did you mean shear-factor\?"],
    "friction of what has no strength": [("RADIUS = 2e-3", "RADIUS = 2e-3, FRICTION_LAW = 'shear-factor', SHEAR_FACTOR = 1"),
                                         r"FRICTION_LAW.*'block' is elastic"],
    "infinite": [("END = 2e-6", "END = inf"), r"END = inf: expected a real number"],
    "not a number": [("END = 2e-6", "END = nan"), r"END = nan: expected a real number"],
    "decimal comma": [("END = 2e-6", "END = 2,5"), r"END = 2,5: .*found 2 values"],
    "two of three": [("LOWER = 0, 0, 0, UPPER = 8e-3", "LOWER = 0, 0, UPPER = 8e-3"), r"LOWER .*3 real numbers.*found 2"],
    "four of three": [("UPPER = 8e-3, 8e-3, 8e-3", "UPPER = 8e-3, 8e-3, 8e-3, 1"), r"UPPER .*3 real numbers.*found 4"],
    "no value": [("END = 2e-6", "END ="), r"END has no value"],
    "repeated key": [("END = 2e-6", "END = 2e-6, END = 3e-6"), r"&TIME END is given twice"],
    "repeated group": [("&METHOD SHAPE = 'ugimp' /", "&TIME END = 1 /"), r"&TIME may be given only once"],
    "too small": [("DENSITY = 8960", "DENSITY = 0"), r"DENSITY = 0: must be > 0 \[kg/m3\]"],
    "too large": [("POISSON_RATIO = 0.34", "POISSON_RATIO = 0.5"), r"POISSON_RATIO = 0.5: must be > -1 and < 0.5"],
    "no such choice": [("SHAPE = 'ugimp'", "SHAPE = 'ugipm'"), r"SHAPE = 'ugipm': must be one of .*; did you mean ugimp\?"],
    "missing key": [("END = 2e-6", "CFL = 0.3"), r"&TIME has no END \(required\)"],
    "key that a choice requires": [("RADIUS = 2e-3, ", ""), r"&TOOL has no RADIUS \(required if KIND = "],
    "missing material": [("MATERIAL = 'copper', T", "MATERIAL = 'coper', T"), r"'coper'.*no &MATERIAL of this name.*copper"],
    "missing body of a shape": [("&SHAPE BODY = 'block'", "&SHAPE BODY = 'blok'"), r"'blok'.*no &BODY of this name.*block"],
    "missing body of a load": [("&LOAD BODY = 'block'", "&LOAD BODY = 'blok'"), r"&LOAD BODY = 'blok'.*no &BODY"],
    "missing body of a surface": [("&SURFACE BODY = 'block'", "&SURFACE BODY = 'blok'"), r"&SURFACE BODY = 'blok'.*no &BODY"],
    "unknown tool": [("&MOTION TOOL = 'punch'", "&MOTION TOOL = 'pinch'"), r"&MOTION TOOL = 'pinch'.*no &TOOL of this name.*punch"],
    "two bodies of one name": [("&BODY NAME = 'lid'", "&BODY NAME = 'block'"), r"&BODY NAME = 'block': is the name of another &BODY"],
    "geometry outside the grid": [("UPPER = 6e-3, 6e-3, 7e-3", "UPPER = 6e-3, 6e-3, 9e-3"), r"&SHAPE reaches outside the grid: z to (0\.009|9e-3) m \(grid to (0\.00|)8(e-3|) m\)"],
    "shape without volume": [("UPPER = 6e-3, 6e-3, 7e-3", "UPPER = 6e-3, 6e-3, 5e-3"), r"&SHAPE UPPER .*above LOWER"],
    "shape without a particle": [("UPPER = 6e-3, 6e-3, 7e-3", "UPPER = 6e-3, 6e-3, 5.1e-3"), r"&BODY NAME = 'lid': holds no particle"],
    "grid upside down": [("UPPER = 8e-3, 8e-3, 8e-3", "UPPER = -8e-3, 8e-3, 8e-3"), r"&GRID UPPER .*above LOWER"],
    "too many cells": [("CELL = 1e-3", "CELL = 1e-9"), r"&GRID CELL = 1e-9: .*cells"],
    "probe outside the grid": [("POSITION = 4e-3, 4e-3, 3.6e-3", "POSITION = 4e-3, 4e-3, 3.6"), r"&PROBE POSITION .*outside the grid"],
    "letters of a clamp": [("'xy'", "'xq'"), r"COMPONENTS = 'xq': only the characters xyz"],
    "contact with nobody": [("&HEAT", "&CONTACT BODY = 'block', OTHER = 'led' /\n&HEAT"), r"&CONTACT OTHER = 'led'.*no &BODY of this name.*lid"],
    "contact with itself": [("&HEAT", "&CONTACT BODY = 'lid', OTHER = 'lid' /\n&HEAT"), r"&CONTACT OTHER = 'lid': must be another body"],
    "rigid body with a velocity": [("NAME = 'lid', MATERIAL = 'copper',", "NAME = 'lid', MATERIAL = 'copper', RIGID = T, VELOCITY = 1, 0, 0,"),
                                   r"&BODY VELOCITY .*&MOTION"],
    "rigid body with a load": [("&LOAD BODY = 'block'", "&BODY NAME = 'ram', MATERIAL = 'copper', RIGID = T / &SHAPE BODY = 'ram', UPPER = "
                                "1e-3, 1e-3, 1e-3, LOWER = 0, 0, 0 / &LOAD BODY = 'ram'"), r"&LOAD BODY = 'ram': a rigid"],
    "unclosed group": [("FORCE = 0, 0, -1 /", "FORCE = 0, 0, -1"), r"&LOAD is not closed with /"],
    "unclosed quotes": [("TITLE = 'Small' /", "TITLE = 'Small /"), r"quotes is not closed"],
    "text outside a group": [("&HEAT AMBIENT = 298 /", "&HEAT AMBIENT = 298 / more"), r"text outside a group: \"more\""],
    "value without a key": [("&HEAT AMBIENT = 298 /", "&HEAT 298 /"), r"a value without a key: \"298\""],
}


# These leave a body without shape, shapes outside the grid, or a probe in the air.
WITH_CONSEQUENCES = ("shape without a particle", "missing body of a shape", "two bodies of one name", "grid upside down", "too many cells",
                     "friction law without its coefficient")


FORM = ["unknown group", "unknown key", "broken number", "too large", "number for a logical",
        "unclosed group", "two of three"]
SENSE = ["missing material", "missing body of a load", "missing body of a surface", "unknown tool",
         "geometry outside the grid", "probe outside the grid"]
SEVERAL = {"form": FORM, "sense": SENSE, "both": ["missing material", "too large", "unknown tool"]}


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    """All runs with a spoiled small.nml."""
    cases = {name: spoil(change)[0] for name, (change, _) in MISTAKES.items()}
    cases |= {name: spoil(*(MISTAKES[m][0] for m in many))[0] for name, many in SEVERAL.items()}
    cases = {name: (("small.nml",), {"text": text}) for name, text in cases.items()}
    for option in ("--check", "--quiet"):
        cases[option] = (("small.nml", option), {"text": spoil(MISTAKES["too small"][0])[0]})
    return driver.run_all(cases, tmp_path_factory.mktemp("mistakes"))


@pytest.mark.parametrize("mistake", MISTAKES)
def test_one_mistake(outcome, mistake):
    """Exact: one mistake in small.nml gives one message with the line it stands on."""
    change, words = MISTAKES[mistake]
    (line,) = spoil(change)[1]
    if mistake == "shape without a particle":
        line -= 1   # the message is about the body, one line above its shape
    messages = messages_of(outcome[mistake], ["small.nml"])
    assert any(re.match(rf"small\.nml:{line}: error: .*{words}", m) for m in messages), messages
    if mistake not in WITH_CONSEQUENCES:
        assert len(messages) == 1, messages


@pytest.mark.parametrize("several", SEVERAL)
def test_all_mistakes_at_once(outcome, several):
    """Exact: several mistakes give all their messages at once, in the order of the lines: mistakes of form,
    mistakes of sense (names, places), and both together."""
    mistakes = SEVERAL[several]
    lines = spoil(*(MISTAKES[m][0] for m in mistakes))[1]
    messages = messages_of(outcome[several], ["small.nml"])
    for mistake, line in zip(mistakes, lines):
        words = rf"small\.nml:{line}: error: .*{MISTAKES[mistake][1]}"
        assert any(re.match(words, m) for m in messages), (mistake, messages)
    numbers = [int(m.split(":")[1]) for m in messages]
    assert numbers == sorted(numbers)


@pytest.mark.parametrize("option", ["--check", "--quiet"])
def test_messages_with_options(outcome, option):
    """Exact: --check and --quiet give the same message and status as a run."""
    line = spoil(MISTAKES["too small"][0])[1][0]
    messages = messages_of(outcome[option], ["small.nml"])
    assert len(messages) == 1 and messages[0].startswith(f"small.nml:{line}: error: ")


def test_messages_once_on_two_ranks(run, tmp_path):
    """Exact: two mistakes on two ranks: two messages, status 2, nothing written."""
    text, lines = spoil(MISTAKES["missing material"][0], MISTAKES["unknown tool"][0])
    path = tmp_path / "small.nml"
    path.write_text(text)
    done = run("small.nml", ranks=2, expect=driver.BAD_INPUT)
    messages = [m for m in done.err.splitlines() if ": error: " in m]
    assert [m.split(":")[1] for m in messages] == [str(line) for line in lines]
    assert list(tmp_path.iterdir()) == [path]


# Command line, and what the message must say.
COMMANDS = {
    "no input file": ([], r"stirpoint: error: no input file"),
    "input file that is not there": (["nothing.nml"], r"nothing\.nml: error: cannot be read"),
    "input file that is a directory": (["/tmp"], r"/tmp: error: cannot be read"),
    "unknown option": (["small", "--frobnicate"], r"stirpoint: error: unknown option --frobnicate"),
    "two input files": (["small", "more.nml"], r"stirpoint: error: more than one input file"),
    "--set without value": (["small", "--set"], r"stirpoint: error: --set needs a value"),
    "--restart without value": (["small", "--restart"], r"stirpoint: error: --restart needs a value"),
    "--output without value": (["small", "--output"], r"stirpoint: error: --output needs a value"),
    "--set without form": (["small", "--set", "TIME"], r"--set TIME: error: expected GROUP.KEY=VALUE"),
    "--set of an unknown group": (["small", "--set", "TIMES.END=1"], r"--set TIMES.END=1: error: .*did you mean TIME\?"),
    "--set of an unknown key": (["small", "--set", "TIME.ENDE=1"], r"--set TIME.ENDE=1: error: .*did you mean END\?"),
    "--set of a bad value": (["small", "--set", "TIME.END=x"], r"--set TIME.END=x: error: .*expected a real number"),
    "--set out of range": (["small", "--set", "TIME.CFL=4"], r"--set TIME.CFL=4: error: .*must be >= 0 and <= 3"),
    "--set of no such tool": (["small", "--set", "TOOL(x).RADIUS=1"], r"--set TOOL\(x\).RADIUS=1: error: .*no such &TOOL"),
    "empty --restart": (["small", "--restart", ""], r"stirpoint: error: the value of --restart is empty"),
    "empty --output": (["small", "--output", ""], r"stirpoint: error: the value of --output is empty"),
    "empty --set": (["small", "--set", ""], r"stirpoint: error: the value of --set is empty"),
    "empty argument": (["small", ""], r"stirpoint: error: an argument is empty"),
    "name outside": (["small", "--set", "RUN.NAME=../x"], r"--set RUN.NAME=../x: error: .*letters, digits"),
    "hidden name": (["small", "--set", "RUN.NAME=.x"], r"--set RUN.NAME=.x: error: .*not beginning with"),
    "comma in a name": (["small", "--set", "PROBE.NAME=a,b"], r"--set .*: error: .*at most 32 characters"),
    "quote in a name": (["small", "--set", "PROBE.NAME='a\"b'"], r"--set .*: error: .*at most 32 characters"),
    "long name": (["small", "--set", "PROBE.NAME=" + 33 * "x"], r"--set .*: error: .*at most 32 characters"),
    "newline in a title": (["small", "--set", "RUN.TITLE=a\nb"], r"--set RUN.TITLE=a\?b: error: .*cannot be printed"),
    "tolerance": (["small", "--set", "HEAT.TOLERANCE=1e-300"], r"--set .*: error: .*must be >= 1e-6"),
    "fixed step": (["small", "--set", "TIME.DT=1e-25"], r"--set .*: error: .*makes 2e19 steps"),
    "rows": (["small", "--set", "OUTPUT.HISTORY_INTERVAL=1e-20"], r"--set .*: error: .*times to write"),
    "huge speed": (["small", "--set", "BODY.VELOCITY=0,0,1e200"], r"--set .*: error: .*implausible: at most 100000 \[m/s\]"),
    "huge spin": (["small", "--set", "BODY.TEMPERATURE=1e30"], r"--set .*: error: .*implausible: at most 100000 \[K\]"),
    "no room": (["small", "--set", "GRID.CELL=1.3e-5", "--set", "BODY.PARTICLES_PER_CELL=8"], r"--set GRID.CELL.*: error: .* need .* of memory"),
    "--set of no such number": (["small", "--set", "TOOL(2).RADIUS=1"], r"--set TOOL\(2\).RADIUS=1: error: .*no such &TOOL"),
}


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    """All runs with a bad command line."""
    cases = {name: (words or [None], {}) for name, (words, _) in COMMANDS.items()}
    return driver.run_all(cases, tmp_path_factory.mktemp("commands"))


@pytest.mark.parametrize("case", COMMANDS)
def test_bad_command_line(command, case):
    """Exact: a bad command line gives one message, status 2, and nothing is written."""
    messages = messages_of(command[case], [])
    assert len(messages) == 1 and re.match(COMMANDS[case][1], messages[0]), messages


def test_three_bad_overrides_at_once(run, tmp_path):
    """Exact: three bad --set give three messages in one go."""
    sets = {"TIME.END": "x", "TOOL.RADUS": 1, "WALL.SIDE": "up"}
    done = run("small", sets=sets, expect=driver.BAD_INPUT)
    assert done.err.count(": error: ") == 3 and done.err.count("--set ") == 3
    assert list(tmp_path.iterdir()) == []
