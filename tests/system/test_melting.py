# SPDX-License-Identifier: MIT
"""No strength is left above T_MELT with any law, nothing thermal has a default, and molten metal is reported."""

import json
import re

import driver
import pytest

LAWS = {
    "two-phase": "TP_SIGMA0 = 5e6, TP_BURGERS = 2.56e-10, TP_WALLS = 1e13, TP_INTERIOR = 1e12, TP_SIZE = 10, TP_BETA = 0.0018\n"
                 "  TP_K0 = 4.6, TP_STAR_FIT = 600, 885.6, -0.3, TP_STAR_RANGE = 298, 1100, TP_STAR_ENDS = 0.216, 0.002",
    "johnson-cook": "JC_A = 90e6, JC_B = 292e6, JC_N = 0.31, JC_C = 0.025, JC_M = 1.09",
    "norton": "NORTON_K = 40e6, NORTON_N = 0.2",
    "zerilli-armstrong": "ZA_C0 = 65e6, ZA_C2 = 890e6, ZA_C3 = 0.0028, ZA_C4 = 0.000115, ZA_C5 = 30e6, ZA_N = 0.3",
    "sellars-tegart": "ST_ALPHA = 1.5e-8, ST_N = 5, ST_LN_A = 30, ST_Q = 260e3",
    "table": "TABLE_STRAIN = 0, 1, TABLE_T = 300, 1100, TABLE_STRESS = 100e6, 300e6, 40e6, 80e6",
}
MELT = 1200.0
TEMPERATURES = [1000, 1139, 1170, 1199.9, 1200, 2000]


def material(law, more=f", T_MELT = {MELT}"):
    return (f"&MATERIAL NAME = 'm', DENSITY = 8960, YOUNGS_MODULUS = 124e9, POISSON_RATIO = 0.34\n"
            f"  LAW = '{law}', {LAWS[law]}{more} /\n")


def strengths(run, tmp_path, law, more):
    """Stress at a strain of 0.5 at each temperature."""
    paths = "".join(f"&PATH NAME = 't{k}', MATERIAL = 'm', TEMPERATURE = {t}, STRAIN = 0.5, ROWS = 1, STEP = 0.1 /\n"
                    for k, t in enumerate(TEMPERATURES))
    (tmp_path / "melt.nml").write_text(material(law, more) + paths)
    run(tmp_path / "melt.nml", "--material", "--quiet")
    result = []
    for k in range(len(TEMPERATURES)):
        rows = [r for r in (tmp_path / f"melt.out/t{k}.csv").read_text().splitlines() if r and r[0] != "#"]
        head = next(i for i, r in enumerate(rows) if r.startswith("time"))
        result.append(float(rows[-1].split(",")[rows[head].split(",").index("stress[Pa]")]))
    return result


@pytest.mark.parametrize("law", LAWS)
def test_no_strength_above_melting(run, tmp_path, law):
    """Exact: 0 Pa from T_MELT on; below 0.95 T_MELT what the law says without T_MELT; between them less and less."""
    with_melting = strengths(run, tmp_path, law, f", T_MELT = {MELT}")
    assert with_melting[4:] == [0.0, 0.0]
    assert with_melting[1] > with_melting[2] > with_melting[3] >= 0.0
    assert with_melting[3] < 0.01 * with_melting[1]
    if law != "johnson-cook":   # which cannot do without
        without = strengths(run, tmp_path, law, "")
        assert with_melting[:2] == without[:2]
        assert with_melting[2] == pytest.approx(0.5 * without[2], rel=1e-9)


def test_table_above_melting(run, tmp_path):
    """A table of flow stress that reaches above T_MELT contradicts it."""
    text = material("table").replace("TABLE_T = 300, 1100", "TABLE_T = 300, 1300")
    (tmp_path / "melt.nml").write_text(text + "&PATH NAME = 'p', MATERIAL = 'm' /\n")
    done = run(tmp_path / "melt.nml", "--material", expect=driver.BAD_INPUT)
    assert re.search(r"melt\.nml:2: error: .*TABLE_T.*reaches above T_MELT", done.err)


# Scene, what is taken out of its text, and what the message must say.
MISSING = {
    "johnson-cook": ("block", ", T_MELT = 1356", "has no T_MELT, which it needs: LAW = 'johnson-cook'"),
    "specific heat of plastic work": ("slice", "SPECIFIC_HEAT = 386, ", "has no SPECIFIC_HEAT, .*plastic work heats"),
    "specific heat of conduction": ("heat_bar", r"SPECIFIC_HEAT = [\d.e]+,?", "has no SPECIFIC_HEAT, .*&HEAT"),
    "conductivity": ("heat_bar", r"CONDUCTIVITY = [\d.e]+", "has no CONDUCTIVITY, .*&HEAT"),
    "melting of another law": ("layer", ", T_MELT = 905", "has no T_MELT, .*plastic work"),
    "melting under a source": ("disc", ", T_MELT = 905", "has no T_MELT, .*&SOURCE"),
}


@pytest.mark.parametrize("case", MISSING)
def test_nothing_thermal_has_a_default(run, tmp_path, case):
    """Exact: a property that the scene uses and does not give is an error that names material and reason."""
    name, pattern, words = MISSING[case]
    text, n = re.subn(pattern, "", (driver.INPUTS / f"{name}.nml").read_text())
    assert n > 0
    (tmp_path / "scene.nml").write_text(text)
    done = run("scene.nml", "--check=scene", expect=driver.BAD_INPUT)
    assert re.search(rf"scene\.nml:\d+: error: &MATERIAL '\w+' {words}", done.err), done.err


def test_idle_room_temperature(run):
    """T_ROOM where no law and no expansion heeds it is an error."""
    done = run("bar", "--check=scene", sets={"MATERIAL.T_ROOM": 300}, expect=driver.BAD_INPUT)
    assert "T_ROOM" in done.err and "has no effect" in done.err


@pytest.mark.parametrize("scene, sets", [
    ("block", {"TIME.MAX_STEPS": 3, "MATERIAL.T_MELT": 450, "HEAT.AMBIENT": 298}),
    ("heat_slab", {"TIME.END": 1e-3, "MATERIAL.T_MELT": 310}),
])
def test_molten_metal_is_reported(run, scene, sets):
    """One warning with place, body, temperature and share; the same in the summary. Half of the block is hot."""
    done = run(scene, sets=sets)
    warnings = [line for line in done.out.splitlines() if "above its melting temperature" in line]
    assert len(warnings) == 1, done.out
    assert re.search(r"% of the mass \(.* kg\).*in \w+ at \(.*\) m, has .* K, T_MELT is .* K", warnings[0])
    summary = json.loads(next(done.directory.glob("*.out/*_summary.json")).read_text())
    if scene == "block":
        assert summary["melted_share_max"] == pytest.approx(0.5, abs=0.01)
        assert summary["hottest_over_melting_K"] == pytest.approx(50, abs=5)
    assert summary["melted_share_max"] > 0 and summary["hottest_over_melting_K"] > 0


@pytest.mark.parametrize("scene, sets, ends", [
    ("heat_bar", {"MATERIAL.T_MELT": 390, "OUTPUT.HISTORY_INTERVAL": 0.05}, (0.1, 0.3)),
    ("heat_slab", {"MATERIAL.T_MELT": 390, "OUTPUT.HISTORY_INTERVAL": 0.1}, (0.3, 1.0)),
])
def test_a_restart_keeps_what_was_molten(run, scene, sets, ends):
    """Exact: the summary of a run that was stopped and continued has the molten metal of its first part; it cools all the time."""
    def molten(done):
        summary = done.results(scene).summary()
        return summary["melted_share_max"], summary["hottest_over_melting_K"]

    whole = molten(run(scene, "--quiet", sets=sets | {"TIME.END": ends[1]}))
    part = run(scene, "--quiet", "--overwrite", sets=sets | {"TIME.END": ends[0]})
    path = part.results(scene).path("_checkpoint.h5")
    assert molten(part) == molten(run(None, "--quiet", "--restart", path, sets={"TIME.END": ends[1]})) == whole > (0, 0)


def test_solid_metal_is_not_reported(run):
    """Nothing is said of metal below melting, and the summary says 0."""
    done = run("block", sets={"TIME.MAX_STEPS": 2})
    assert "melting" not in done.out
    summary = json.loads(next(done.directory.glob("*.out/*_summary.json")).read_text())
    assert summary["melted_share_max"] == 0 and summary["hottest_over_melting_K"] == 0
