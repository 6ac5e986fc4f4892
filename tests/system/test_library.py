# SPDX-License-Identifier: MIT
"""Materials from a library: FROM = 'library' and entries by name, own values, own libraries, restarts."""

import pathlib
import re
import shutil
import subprocess
import sys

import driver
import numpy as np
import pytest

sys.path.insert(0, str(driver.ROOT / "docs"))
import flow_laws  # noqa: E402

WRITTEN = re.compile(r"&MATERIAL.*?/\n", re.DOTALL)
LIBRARY = """! my alloys
&MATERIAL NAME = 'mine', DENSITY = 8960, YOUNGS_MODULUS = 124e9, POISSON_RATIO = 0.34
  LAW = 'johnson-cook', JC_A = 90e6, JC_B = 292e6, JC_N = 0.31, JC_C = 0.025, JC_M = 1.09
  SPECIFIC_HEAT = 386, CONDUCTIVITY = 1e5, T_MELT = 1356 /
&REFERENCE MATERIAL = 'mine', KEYS = 'JC_A JC_B', TEXT = 'our own compression tests' /
"""


def block(tmp_path, material):
    """The block that yields as it vibrates, with another &MATERIAL."""
    text = (driver.INPUTS / "block.nml").read_text(encoding="utf-8")
    assert len(WRITTEN.findall(text)) == 1
    text = WRITTEN.sub(f"&MATERIAL {material} /\n", text).replace("END = 7e-5", "END = 7e-6")
    (tmp_path / "block.nml").write_text(text, encoding="utf-8")
    return tmp_path / "block.nml"


def test_taken_values_act_as_if_written(run, tmp_path):
    """A library gives what the input wrote: bitwise the same state. What is given beside FROM wins; the log
    names each value and its source."""
    (tmp_path / "alloys.nml").write_text(LIBRARY, encoding="utf-8")
    one = run(block(tmp_path, "NAME = 'copper', FROM = 'mine', LIBRARY = 'alloys.nml'"))
    state = one.results("block").checkpoint()
    (tmp_path / "written").mkdir()
    other = run("block", directory=tmp_path / "written", sets={"TIME.END": 7e-6})
    assert np.array_equal(state.tau, other.results("block").checkpoint().tau)
    assert np.array_equal(state.temp, other.results("block").checkpoint().temp)
    assert "JC_A = 90e6, JC_B = 292e6: our own compression tests" in one.out
    weaker = run(
        block(tmp_path, "NAME = 'copper', FROM = 'mine', LIBRARY = 'alloys.nml', JC_A = 45e6"),
        "--overwrite",
    )
    assert "  JC_B = 292e6: our own compression tests" in weaker.out
    assert not np.array_equal(state.tau, weaker.results("block").checkpoint().tau)


def test_sources_say_whether_they_were_seen():
    """Each source of the literature in the program's library ends with a mark; what follows from other values has none."""
    text = (driver.ROOT / "share/stirpoint/materials.nml").read_text(encoding="utf-8")
    sources = re.findall(r"TEXT = '([^']*)'", text)
    assert len(sources) > 25
    for source in sources:
        derived = source.startswith(("mean from", "a choice of this library", "this two-phase law", "as those of"))
        assert len(source) < 1000
        assert derived or re.search(r" \[(seen: .+|not seen.*|taken over with the model, not compared again)\]$", source), source


def test_first_lines(run, tmp_path):
    """What a run says first are values and sources, each whole, with a letter for how the source was read; the notes themselves
    are those of --materials and of the resolved input, unabridged."""
    (tmp_path / "pin.nml").write_text(run(None, "--new", "pin").out, encoding="utf-8")
    out = run("pin.nml", sets={"TIME.MAX_STEPS": 1}).out
    said = [line for line in out.split("\n")[:6] if line.startswith("  ")]
    assert said and all(re.search(r"( \[[smt]\]|as those of [\w-]+)$", line) for line in said), said
    notes = re.findall(r"TEXT = '([^']*)'", (driver.ROOT / "share/stirpoint/materials.nml").read_text(encoding="utf-8"))
    resolved = (tmp_path / "pin.out/pin_input.nml").read_text(encoding="utf-8")
    assert any(note in resolved and "[not seen" in note for note in notes)


def test_hot_metal_is_plausible():
    """Flow stress of hot working at 1/s and 100/s within the range that the source of the law names, at 0.7 to 0.8 of T_MELT."""
    metals = [metal for metal in flow_laws.metals() if metal.plausible]
    assert len(metals) >= 8
    found = flow_laws.stresses([(metal.name, "hot-working", rate, metal.plausible[0]) for metal in metals for rate in flow_laws.RATES])
    for metal, stresses in zip(metals, found.reshape(-1, 2)):
        temperature, low, high, low_fast, high_fast = metal.plausible
        print(metal.name, temperature, stresses)
        assert 0.7 < temperature / metal.melts < 0.81
        assert low < stresses[0] < high and low_fast < stresses[1] < high_fast, metal.name


def test_table_of_flow_stress():
    """The document has the table that docs/flow_laws.py makes of this library, and its picture."""
    assert flow_laws.TABLE.search(flow_laws.PAGE.read_text(encoding="utf-8"))[2] == flow_laws.table()
    assert flow_laws.PICTURE.stat().st_size < 200_000


def test_found_without_proc(tmp_path):
    """Where no /proc is mounted the library beside the program is found as well, from any folder, also through a link and a
    path with blanks."""
    if shutil.which("unshare") is None:
        pytest.skip("no unshare")
    (tmp_path / "a b").mkdir()
    (tmp_path / "a b" / "linked").symlink_to(driver.EXECUTABLE)
    hidden = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", 'mount -t tmpfs none /proc && exec "$@"', "sh"]
    if subprocess.run([*hidden, "true"], capture_output=True).returncode != 0:
        pytest.skip("nothing may be mounted here")
    for name in (driver.EXECUTABLE, "a b/linked"):
        done = subprocess.run([*hidden, name, "--materials"], cwd=tmp_path, env=driver.ENVIRONMENT, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert str(pathlib.Path(driver.EXECUTABLE).resolve().parent) in done.stdout.split("\nfrom ")[1]


def test_restart_keeps_what_was_taken(run, tmp_path):
    """The checkpoint has the values: a library that is gone, or has changed, does not matter to it."""
    library = tmp_path / "alloys.nml"
    library.write_text(LIBRARY, encoding="utf-8")
    path = block(tmp_path, "NAME = 'copper', FROM = 'mine', LIBRARY = 'alloys.nml'")
    run(path)
    run(path, sets={"TIME.MAX_STEPS": 40, "RUN.NAME": "half"})
    library.unlink()
    checkpoint = "half.out/half_checkpoint.h5"
    run(None, "--restart", checkpoint, sets={"TIME.MAX_STEPS": 0})
    whole, parts = (driver.Results(tmp_path / f"{n}.out", n).checkpoint() for n in ("block", "half"))
    assert np.array_equal(whole.tau, parts.tau)
    library.write_text(LIBRARY.replace("90e6", "91e6"), encoding="utf-8")
    changed = run(path, "--restart", checkpoint, sets={"TIME.END": 1e-5}, expect=driver.BAD_INPUT)
    assert "JC_A = 91e6: a restart cannot change it from 90e6 to 91e6" in changed.err
    other = run(None, "--restart", checkpoint, sets={"MATERIAL.FROM": "copper"}, expect=driver.BAD_INPUT)
    assert "a restart cannot change materials" in other.err


def test_who_takes_the_tables(run, tmp_path):
    """Heat alone takes tables over temperature; beside mechanics those that were compared with their source are taken,
    and else constants. What the input gives itself stands for either."""
    text = (driver.INPUTS / "heat_slab.nml").read_text(encoding="utf-8")
    text = WRITTEN.sub("&MATERIAL NAME = 'AA6061-T6', FROM = 'library' /\n", text)
    text = re.sub(r"MATERIAL = '[^']*'", "MATERIAL = 'AA6061-T6'", text)
    path = tmp_path / "slab.nml"
    path.write_text(text, encoding="utf-8")
    alone = run(path, "--check=scene", sets={"METHOD.MECHANICS": "F"})
    assert "CONDUCTIVITY_TABLE = 273, 190, 773, 225" in alone.out
    own = run(path, "--check=scene", sets={"METHOD.MECHANICS": "F", "MATERIAL.CONDUCTIVITY": 150})
    assert "CONDUCTIVITY" not in own.out.split("scene")[0]
    beside = run(block(tmp_path, "NAME = 'copper', FROM = 'AA6061-T6'"), "--check=scene")
    assert "CONDUCTIVITY = 211" in beside.out
    assert "_TABLE" not in beside.out
    seen = run(block(tmp_path, "NAME = 'copper', FROM = 'copper', CONDUCTIVITY = 390"), "--check=scene")
    assert "SPECIFIC_HEAT_TABLE = 298, 385" in seen.out
    assert "SPECIFIC_HEAT = " not in seen.out and "CONDUCTIVITY_TABLE" not in seen.out


def test_another_law_keeps_the_rest(run, tmp_path):
    """A law of one's own takes none of the constants of the library's law, but its other values."""
    material = "NAME = 'copper', FROM = 'library', LAW = 'norton', NORTON_K = 100e6, NORTON_N = 0.1"
    done = run(block(tmp_path, material), "--check=scene")
    assert "JC_" not in done.out
    assert "T_MELT = 1356" in done.out


@pytest.mark.parametrize(
    "material, complaint",
    [
        ("NAME = 'copper', FROM = 'coper'", "error: &MATERIAL FROM = 'coper': the library has no 'coper'; it has copper,"),
        ("NAME = 'copper', FROM = 'library', LIBRARY = 'none.nml'", "none.nml cannot be read"),
        ("NAME = 'copper', LIBRARY = 'none.nml'", "has no effect without FROM"),
        ("NAME = 'copper', FROM = 'mine', LIBRARY = 'bad.nml'", "bad.nml:2: error: &MATERIAL DENSITY = -8960: must be > 0"),
    ],
)
def test_what_cannot_be_taken(run, tmp_path, material, complaint):
    """One complaint that names the place; nothing that follows from it."""
    (tmp_path / "bad.nml").write_text(LIBRARY.replace("8960", "-8960"), encoding="utf-8")
    done = run(block(tmp_path, material), expect=driver.BAD_INPUT)
    assert complaint in done.err
    if "FROM" in material:
        assert len(done.err.splitlines()) <= 2, done.err
    assert not (tmp_path / "block.out").exists()


def test_list(run):
    """--materials lists what FROM may name."""
    out = run(None, "--materials").out
    for name in ("copper", "copper-hot", "AA5005", "AA6061-T6", "AA2024-T3", "AA7075-T6", "Ti-6Al-4V", "304L", "AZ31", "H13"):
        assert f"\n{name}  (" in out


def test_hot_copper(run, tmp_path):
    """copper-hot has the two stresses that it is made from, and the published exponent and activation energy."""
    places = {"a": (773.0, 1.0), "b": (773.0, 100.0), "c": (1123.0, 1.0)}
    paths = [f"&PATH NAME = '{name}', MATERIAL = 'm', TEMPERATURE = {temp}, RATE = {rate}, STRAIN = 1 /"
             for name, (temp, rate) in places.items()]
    text = "\n".join(["&MATERIAL NAME = 'm', FROM = 'copper-hot' /", *paths, ""])
    (tmp_path / "hot.nml").write_text(text, encoding="utf-8")
    run(None, "--material", "hot.nml")
    a, b, c = (1e-6 * driver.Table(tmp_path / f"hot.out/{name}.csv")["stress[Pa]"][-1] for name in places)
    assert abs(a / 119.27 - 1.0) < 0.005
    assert abs(b / 166.6 - 1.0) < 0.005
    alpha = 0.0193
    n = np.log(100.0) / np.log(np.sinh(alpha * b) / np.sinh(alpha * a))
    q = n * np.log(np.sinh(alpha * a) / np.sinh(alpha * c)) * 8.314462618 / (1.0 / 773.0 - 1.0 / 1123.0)
    assert abs(n - 5.0) < 0.02
    assert abs(q / 145e3 - 1.0) < 0.005
