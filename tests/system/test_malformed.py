# SPDX-License-Identifier: MIT
"""Malformed inputs end with a message: tests/robustness/malformed.py in its short form, and inputs that once were not."""

import re
import subprocess
import sys

import driver
import pytest

SCRIPT = driver.ROOT / "tests/robustness/malformed.py"


def test_malformed_inputs():
    """One of each kind of mutation: no crash, no hang, nothing silent."""
    done = subprocess.run([sys.executable, SCRIPT, "--quick", "--executable", driver.EXECUTABLE], capture_output=True, text=True,
                          timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"cases .*: 0 failed", done.stdout)


def spoiled(tmp_path, name, *changes):
    text = (driver.INPUTS / f"{name}.nml").read_text()
    for pattern, new in changes:
        text, n = re.subn(pattern, new, text)
        assert n, pattern
    (tmp_path / "case.nml").write_text(text)
    return "case.nml"


@pytest.mark.parametrize("group", ["GRID", "TIME", "MATERIAL", "BODY", "SHAPE"])
@pytest.mark.parametrize("name", ["small", "heat_slab"])
def test_missing_group(run, tmp_path, name, group):
    """A required group under another name is missed, and nothing else is done."""
    done = run(spoiled(tmp_path, name, (f"&{group} ", f"&{group[:-1]}Q ")), "--check=scene", expect=driver.BAD_INPUT)
    assert f"there is no &{group} (required)" in done.err
    assert all(": error: " in line for line in done.err.splitlines())


def test_one_name_of_many(run, tmp_path):
    """A name that a thousand groups share is said once for each of them, not for each pair."""
    text = (driver.INPUTS / "small.nml").read_text()
    material = re.search(r"&MATERIAL[^/]*/", text).group()
    (tmp_path / "case.nml").write_text(text + ("\n" + material) * 1000)
    done = run("case.nml", "--check=scene", expect=driver.BAD_INPUT)
    assert "is the name of another &MATERIAL" in done.err
    assert "and 500 more" in done.err


def test_table_without_values(run):
    """LAW = 'table' without its values is missed by name."""
    done = run("bar", "--check=scene", sets={"MATERIAL.LAW": "table"}, expect=driver.BAD_INPUT)
    assert "has no TABLE_STRAIN" in done.err and "has no TABLE_STRESS" in done.err


def test_long_override(run, tmp_path):
    """All of a --set counts: a table of 28 pairs gives the specific heat at 400 K of its middle, not of its first part."""
    pairs = ",".join(f"{300 + 5 * k}.000000000000,{1000 + k}.000000000000" for k in range(28))
    assert len(pairs) > 700
    done = run("heat_slab", sets={"TIME.MAX_STEPS": 1, "MATERIAL.SPECIFIC_HEAT_TABLE": pairs, "BODY.TEMPERATURE": 400})
    content = done.results("heat_slab").history()["heat_content[J]"][0]
    mass = 32e-3 * 4e-3 * 4e-3 * 1000
    assert "SPECIFIC_HEAT_TABLE" in "".join(open(p, "rb").read().decode("latin-1") for p in done.directory.glob("*.out/*.hdf"))
    assert content > mass * 1000 * 90


# Scenes of heat with no heat: what is set, and what the message must say.
NO_HEAT = {
    "no spin": (", SPIN_RPM = 970", "", "error: .*SPIN_RPM.*does not turn"),
    "no pressure": (", SPIN_RPM = 970", ", SPIN_RPM = 970, CONTACT = 'sliding', FRICTION = 0.3", "error: .*PRESSURE.*is 0"),
    "no friction": (", SPIN_RPM = 970", ", SPIN_RPM = 970, CONTACT = 'limited', PRESSURE = 1e7", "error: .*FRICTION.*is 0"),
    "above": ("POSITION = 0, 20e-3, 12e-3", "POSITION = 0, 20e-3, 20e-3", "error: .*never touches"),
    "beside": ("POSITION = 0, 20e-3, 12e-3", "POSITION = 0, 90e-3, 12e-3", "error: .*never touches"),
    "nothing conducts": ("CONDUCTIVITY = 391", "CONDUCTIVITY = 0", "error: .*CONDUCTIVITY.*above 0"),
    "no power": ("KIND = 'stir'", "POWER = 0", "error: .*POWER.*gives no heat"),
}


@pytest.mark.parametrize("case", NO_HEAT)
def test_scene_of_heat_without_heat(run, tmp_path, case):
    """A scene in which nothing would get warm says so, with its line."""
    pattern, new, words = NO_HEAT[case]
    text, n = re.subn(pattern, new, (driver.ROOT / "input/heat_copper_plain.nml").read_text())
    assert n
    (tmp_path / "case.nml").write_text(text)
    done = run("case.nml", "--check=scene", sets={"GRID.CELL": 4e-3}, expect=None)
    assert re.search(rf"case\.nml:\d+: {words}", done.err + done.out), done.err + done.out
    assert done.status == (driver.WELL if "warning" in words else driver.BAD_INPUT)
