# SPDX-License-Identifier: MIT
"""Materials and pairs of surfaces from libraries: FROM and entries by name, own values, own libraries, restarts."""

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
    assert any(note in resolved and "seen: " in note for note in notes)


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
        ("NAME = 'copper', FROM = 'coper'", "error: &MATERIAL FROM = 'coper': the library has no 'coper'; did you mean copper?"),
        ("NAME = 'copper', FROM = 'AA6061-T6', T_MELT = 582", "T_MELT = 582: is in degrees Celsius that of the library, 855 K"),
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
    """--materials lists what FROM may name, first how the source of its law was read, as the document does."""
    out = run(None, "--materials").out
    page = (driver.ROOT / "docs/materials.md").read_text(encoding="utf-8")
    listed = re.findall(r"^(\S+)  \([\w-]+, source (seen|from memory|taken over); melts at (\d+) K\)$", out, re.MULTILINE)
    assert len(listed) > 15
    assert sorted(listed) == sorted(re.findall(r"^\| `([^`]+)` \| [^|]+ \| ([^|]+) \| (\d+) \|", page, re.MULTILINE))
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


PAIRS = """
&PAIR NAME = 'seizing', FRICTION_LAW = 'shear-factor', SHEAR_FACTOR = 0.9, FRICTION = 0.7, COEFFICIENT = 900, PRESSURE_FACTOR = 50 /
&PAIR NAME = 'sliding', FRICTION = 0.3, FRICTION_TABLE_OF = 'temperature', FRICTION_AT = 300, 900, FRICTION_MU = 0.4, 0.2
  TABLE_OF = 'pressure', TABLE_AT = 0, 1e6, TABLE_COEFFICIENT = 500, 2000 /
&PAIR NAME = 'bad', FRICTION = -1 /
&REFERENCE PAIR = 'seizing', KEYS = 'SHEAR_FACTOR FRICTION', RANGE = 0.5, 1, TEXT = 'ring tests [seen: report 3]' /
"""


def pressed(tmp_path, tool="", wall="", surface=""):
    """A pass of the program's own scene whose tool, anvil and film are those of pairs of surfaces, beside their own keys."""
    (tmp_path / "pairs.nml").write_text(PAIRS, encoding="utf-8")
    text = subprocess.run([driver.EXECUTABLE, "--new", "pin"], capture_output=True, text=True, check=True).stdout
    for old, new in ((", FRICTION_LAW = 'shear-factor', SHEAR_FACTOR = 1", tool), ("'zmin', FRICTION = 0.4", "'zmin'" + wall),
                     (", COEFFICIENT = 1000, PRESSURE_FACTOR = 1800", surface)):
        assert text.count(old) == 1
        text = text.replace(old, re.sub("(?=FROM = '(seizing|sliding|bad)')", "LIBRARY = 'pairs.nml', ", new))
    (tmp_path / "pin.nml").write_text(text, encoding="utf-8")
    return tmp_path / "pin.nml"


def taken(out):
    """Keys and values that the log says were taken, by tool, wall and surface."""
    found = {}
    for line in out.split("scene")[0].splitlines():
        if (head := re.match(r"(tool|wall|surface)\b.* from the library", line)):
            found[head[1]] = own = {}
        elif line.startswith("material"):
            own = {}
        elif line.startswith("  "):
            own |= dict(re.findall(r"(\w+) = ((?:'[^']*'|[\d.e+-]+)(?:, [\d.e+-]+)*)", line.split(": ")[0]))
    return found


@pytest.mark.parametrize(
    "tool, surface, friction, film",
    [
        ("FROM = 'seizing'", "FROM = 'seizing'", {"FRICTION_LAW": "'shear-factor'", "SHEAR_FACTOR": "0.9"},
         {"COEFFICIENT": "900", "PRESSURE_FACTOR": "50"}),
        ("FROM = 'seizing', SHEAR_FACTOR = 0.6", "FROM = 'seizing', COEFFICIENT = 10", {"FRICTION_LAW": "'shear-factor'"},
         {"PRESSURE_FACTOR": "50"}),
        ("FROM = 'seizing', FRICTION = 0.5", "FROM = 'sliding', COEFFICIENT = 10", None, None),
        ("FROM = 'seizing', FRICTION_LAW = 'coulomb'", "FROM = 'sliding'", {"FRICTION": "0.7"},
         {"TABLE_OF": "'pressure'", "TABLE_AT": "0, 1e6", "TABLE_COEFFICIENT": "500, 2000"}),
        ("FROM = 'sliding'", "FROM = 'sliding', TABLE_OF = 'none', COEFFICIENT = 10",
         {"FRICTION": "0.3", "FRICTION_TABLE_OF": "'temperature'", "FRICTION_AT": "300, 900", "FRICTION_MU": "0.4, 0.2"}, None),
        ("FROM = 'sliding', FRICTION = 0.1", "FROM = 'seizing', PRESSURE_FACTOR = 0", None, {"COEFFICIENT": "900"}),
        ("FROM = 'sliding', FRICTION_LAW = 'shear-factor', SHEAR_FACTOR = 1", "FROM = 'seizing'", None,
         {"COEFFICIENT": "900", "PRESSURE_FACTOR": "50"}),
    ],
)
def test_pair_gives_what_a_group_does_not(run, tmp_path, tool, surface, friction, film):
    """A pair gives the friction and the film that a group does not give itself: what is written beside FROM stands, also where a
    law or table of the pair would leave it without effect."""
    path = pressed(tmp_path, ", " + tool, ", FROM = 'seizing'", ", " + surface)
    found = taken(run(path, "--check=scene").out)
    assert found.get("tool") == friction
    assert found.get("surface") == film
    assert found["wall"] == {"FRICTION": "0.7"}


def test_pair_acts_as_if_written(run, tmp_path):
    """Friction and film of a pair of the program act as written ones: bitwise the same state. The log names range and source."""
    path = pressed(tmp_path, ", FROM = 'tool steel on aluminium'", ", FROM = 'sheet on steel anvil'", ", FROM = 'sheet on steel anvil'")
    one = run(path, sets={"TIME.MAX_STEPS": 3})
    assert "tool tool from the library" in one.out and "surface zmin of plate from the library" in one.out
    assert re.search(r"  FRICTION_LAW = 'shear-factor', SHEAR_FACTOR = 1: known from 0.6 to 1; .* \[s\]\n", one.out)
    resolved = (tmp_path / "pin.out/pin_input.nml").read_text(encoding="utf-8")
    assert "SHEAR_FACTOR = 1\n" in resolved and "! Of wall zmin a library gave:" in resolved
    (tmp_path / "written").mkdir()
    other = run(pressed(tmp_path / "written", ", FRICTION_LAW = 'shear-factor', SHEAR_FACTOR = 1", ", FRICTION = 0.4",
                        ", COEFFICIENT = 1000, PRESSURE_FACTOR = 1800"), directory=tmp_path / "written", sets={"TIME.MAX_STEPS": 3})
    states = [done.results("pin").checkpoint() for done in (one, other)]
    assert np.array_equal(states[0].tau, states[1].tau) and np.array_equal(states[0].temp, states[1].temp)
    run("written/pin.nml", "--restart", "pin.out/pin_checkpoint.h5", sets={"TIME.MAX_STEPS": 4})
    again = run(None, "--restart", "pin.out/pin_checkpoint.h5", sets={"TOOL.FROM": "PCBN on steel"}, expect=driver.BAD_INPUT)
    assert "a restart cannot change pairs" in again.err


@pytest.mark.parametrize(
    "keys, complaint",
    [
        ({"tool": ", FROM = 'tool steel on aluminum'"},
         r"pin.nml:\d+: error: &TOOL FROM = 'tool steel on aluminum': .* did you mean tool steel on aluminium\?"),
        ({"wall": ", FROM = 'ice'"}, r"pin.nml:\d+: error: &WALL FROM = 'ice': the library has no 'ice'; it has tool steel on"),
        ({"surface": ", FROM = 'WC on steel'"}, r"pin.nml:\d+: error: &SURFACE FROM = 'WC on steel': has no key of a &SURFACE"),
        ({"tool": ", FROM = 'bad'"}, r"pairs.nml:\d+: error: &PAIR FRICTION = -1: must be >= 0"),
        ({"wall": ", LIBRARY = 'none.nml'"}, "has no effect without FROM"),
    ],
)
def test_pair_that_cannot_be_taken(run, tmp_path, keys, complaint):
    """A pair that is not there, says nothing of this group or has a bad value: one complaint with the place and the nearest name."""
    done = run(pressed(tmp_path, **({"surface": ", COEFFICIENT = 1"} | keys)), "--check=scene", expect=driver.BAD_INPUT)
    assert re.search(complaint, done.err), done.err
    assert done.err.count("error:") == 1


def test_list_of_pairs(run):
    """--pairs lists every pair with values, range and source; each source says how it was read."""
    out = run(None, "--pairs").out
    text = (driver.ROOT / "share/stirpoint/pairs.nml").read_text(encoding="utf-8")
    names = re.findall(r"^&PAIR NAME = '([^']*)'", text, re.MULTILINE)
    assert len(names) > 10 and all(f"\n{name}\n  " in out for name in names)
    page = (driver.ROOT / "docs/materials.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in page for name in names)
    for source in re.findall(r"TEXT = '([^']*)'", text):
        derived = source.startswith(("a choice of this library", "as those of"))
        assert derived or re.search(r" \[(seen: .+|not seen.*|taken over with the model, not compared again)\]$", source), source
        assert source in out and len(source) < 900
