# SPDX-License-Identifier: MIT
"""stirpoint --material: flow laws along paths of a material point."""

import json
import os
import pathlib
import re
import subprocess
import sys

import driver
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
POINTS = ROOT / "tests/system/points/points.nml"   # no input of a run

# Stress [MPa] and grain size [um] at plastic strains of 0.5, 1, 4, 30; rate 1/s, isothermal.
STRAINS = (0.5, 1.0, 4.0, 30.0)
REFERENCE = {
    "cu298": ((295.30, 0.2823), (362.32, 0.2327), (561.22, 0.1521), (583.86, 0.1463)),
    "cu773": ((119.27, 0.6518), (144.98, 0.5380), (223.84, 0.3479), (232.77, 0.3343)),
    "cu1123": ((21.32, 2.530), (25.18, 2.067), (36.99, 1.296), (38.32, 1.242)),
    "aa293": ((188.53, 0.9102), (243.58, 0.6976), (391.35, 0.4292), (409.59, 0.4095)),
    "aa723": ((32.93, 9.079), (36.01, 7.014), (44.39, 4.138), (45.41, 3.933)),
}
# Rounding of the references: half of the last digit.
STRESS_DIGIT, SIZE_DIGITS = 0.005e6, {"cu1123": 5e-10, "aa723": 5e-10}


@pytest.fixture(scope="module")
def curves(tmp_path_factory):
    """All curves of points.nml."""
    directory = tmp_path_factory.mktemp("points")
    driver.run(POINTS, "--material", "--quiet", directory=directory)
    return {path.stem: driver.Table(path) for path in (directory / "points.out").glob("*.csv")}


def at_strain(table, strain):
    """Row of the table at a plastic strain."""
    (row,) = np.flatnonzero(np.abs(table["plastic_strain[1]"] - strain) < 1e-9)
    return row


@pytest.mark.parametrize("name", REFERENCE)
def test_reference(curves, name):
    """Independent solutions of the same equations: 0.02 % beside their rounding."""
    table = curves[name]
    for strain, (stress, size) in zip(STRAINS, REFERENCE[name]):
        row = at_strain(table, strain)
        print(name, strain, table["stress[Pa]"][row] / (stress * 1e6) - 1, table["grain_size[m]"][row] / (size * 1e-6) - 1)
        assert table["stress[Pa]"][row] == pytest.approx(stress * 1e6, abs=STRESS_DIGIT + 2e-6 * stress * 1e6)
        digit = SIZE_DIGITS.get(name, 5e-11)
        assert table["grain_size[m]"][row] == pytest.approx(size * 1e-6, abs=digit + 2e-5 * size * 1e-6)


def test_adiabatic(curves):
    """Copper from 298 K at 1/s, both laws: stress [MPa] and temperature [K] to the digits of the references."""
    table = curves["warm"]
    for strain, stress, temperature in ((0.5, 284.23, None), (1.0, 326.07, None), (4.0, 307.68, 633.0), (30.0, 35.96, 1232.6)):
        row = at_strain(table, strain)
        assert table["stress[Pa]"][row] * 1e-6 == pytest.approx(stress, abs=0.006)
        if temperature is not None:
            assert table["temperature[K]"][row] == pytest.approx(temperature, abs=0.1)
    table = curves["jcwarm"]
    for strain, stress, temperature in ((0.1, 232.309, 303.18), (1.0, 359.388, 377.09), (4.0, 364.468, 673.71)):
        row = at_strain(table, strain)
        assert table["stress[Pa]"][row] * 1e-6 == pytest.approx(stress, abs=0.002)
        assert table["temperature[K]"][row] == pytest.approx(temperature, abs=0.01)


def test_johnson_cook(curves):
    """Isothermal references, with the rate factor below the reference rate."""
    assert curves["jc773"]["stress[Pa]"][-1] == pytest.approx(240.32e6, abs=5e3)
    assert curves["jc1000"]["stress[Pa]"][-1] == pytest.approx(148.81e6, abs=5e3)
    assert curves["creep"]["stress[Pa]"][-1] == pytest.approx(256.03e6, abs=5e3)


def test_shear(curves):
    """Simple shear through elasticity and return: the law's stress at the plastic strain and rate, tau = sigma/sqrt(3)
    in the steady state, and det(Bbar) = 1 within 1e-12 to a strain of 30."""
    shear, strain = curves["shear"], curves["cu773"]
    assert np.abs(shear["det_error[1]"]).max() < 1e-12
    late = shear["plastic_strain[1]"] > 0.9
    want = np.interp(shear["plastic_strain[1]"], strain["plastic_strain[1]"], strain["stress[Pa]"])
    assert shear["stress[Pa]"][-1] == pytest.approx(want[-1], rel=1e-4)
    apart = shear["shear_stress[Pa]"] * np.sqrt(3.0) / shear["stress[Pa]"] - 1.0
    print(apart[late].min(), apart[late].max())
    assert np.abs(apart[late]).max() < 1e-4
    assert np.all(np.abs(shear["temperature[K]"] - 773.0) < 1e-9)


def test_other_laws(curves):
    """Exact: Zerilli-Armstrong, Sellars-Tegart (small, usual and large arguments of asinh) and a table."""
    table = curves["za"]
    strain = table["plastic_strain[1]"] + 1e-9
    want = 65e6 + (40e6 + 890e6 * np.sqrt(strain)) * np.exp((-0.0028 + 0.000115 * np.log(100.0)) * 500.0) + 30e6 * strain**0.3
    assert table["stress[Pa]"] == pytest.approx(want, rel=1e-9)
    for name, rate, temperature in (("st", 3.0, 900.0), ("stcold", 3.0, 300.0), ("sthot", 1e-3, 3000.0)):
        log_w = (np.log(rate) + 260e3 / (8.314462618 * temperature) - 30.0) / 5.0
        want = (np.arcsinh(np.exp(log_w)) if log_w < 300.0 else log_w + np.log(2.0)) / 1.5e-8
        assert curves[name]["stress[Pa]"][-1] == pytest.approx(want, rel=1e-8), name
    # halfway in ln(rate), a quarter of the way in temperature
    mean = 0.75 * np.array([110e6, 320e6, 430e6]) + 0.25 * np.array([45e6, 90e6, 100e6])
    want = np.interp(curves["table"]["plastic_strain[1]"], [0.0, 1.0, 3.0], mean)
    assert curves["table"]["stress[Pa]"] == pytest.approx(want, rel=1e-9)


def test_history(run, tmp_path, curves):
    """A recorded history of constant rate and temperature is the path of that rate; one that cools keeps its
    densities; its own curve can be read again."""
    text = POINTS.read_text()
    text = text[: text.index("&PATH")]
    rows = "".join(f"{t},773,{t}\n" for t in np.linspace(0.0, 4.0, 9))
    (tmp_path / "steady.csv").write_text("# a particle\ntime[s],temperature[K],plastic_strain[1]\n" + rows)
    (tmp_path / "rates.csv").write_text("temperature[K],strain_rate[1/s],time[s]\n773,1,0\n773,1,4\n773,0,4.001\n400,0,6\n")
    for name in ("steady", "rates"):
        text += f"&PATH NAME = '{name}', MATERIAL = 'copper', KIND = 'history', FILE = '{name}.csv' /\n"
    (tmp_path / "history.nml").write_text(text)
    run("history.nml", "--material", "--quiet")
    steady, rates = (driver.Table(tmp_path / "history.out" / f"{name}.csv") for name in ("steady", "rates"))
    row = at_strain(curves["cu773"], 4.0)
    for name in ("stress[Pa]", "grain_size[m]", "wall_fraction[1]"):
        assert steady[name][-1] == pytest.approx(curves["cu773"][name][row], rel=1e-5), name
    assert rates["grain_size[m]"][1] == pytest.approx(steady["grain_size[m]"][-1], rel=1e-5)
    assert rates["grain_size[m]"][3] == rates["grain_size[m]"][2]
    assert rates["temperature[K]"][-1] == pytest.approx(400.0)
    (tmp_path / "again.nml").write_text(text[: text.index("&PATH")] + "&PATH NAME = 'again', MATERIAL = 'copper', "
                                        "KIND = 'history', FILE = 'history.out/steady.csv' /\n")
    run("again.nml", "--material", "--quiet")
    again = driver.Table(tmp_path / "again.out" / "again.csv")
    assert again["stress[Pa]"][-1] == pytest.approx(steady["stress[Pa]"][-1], rel=1e-8)


def test_on_ranks(run, tmp_path):
    """Several ranks write the same curves."""
    sets = {"PATH(cu298).STRAIN": 0.5}
    texts = []
    for ranks in (1, 3):
        run(POINTS, "--material", "--output", f"on{ranks}", ranks=ranks, sets=sets)
        texts.append([path.read_text() for path in sorted((tmp_path / f"on{ranks}").iterdir())])
    assert texts[0] == texts[1]


# What is replaced in points.nml, and what the message must say.
MISTAKES = {
    "no such material": ("NAME = 'cu298', MATERIAL = 'copper'", "NAME = 'cu298', MATERIAL = 'coper'", "no &MATERIAL of this name"),
    "a name twice": ("NAME = 'cu773'", "NAME = 'cu298'", "is the name of another &PATH"),
    "no history": ("KIND = 'shear', STRAIN = 30", "KIND = 'history', FILE = 'nowhere.csv'", "nowhere.csv cannot be read"),
    "no alpha*": ("TP_STAR_FIT = 46, -139.56, -0.08, ", "", "either by TP_STAR or by TP_STAR_FIT"),
    "a fit without ends": (", TP_STAR_ENDS = 0.22, 0.001", "", "needs TP_STAR_RANGE and TP_STAR_ENDS"),
    "a pole": ("46, -139.56", "46, -300.0", "pole"),
    "a short table": ("100e6, 110e6 /", "100e6 /", "has 11 values, the table has 12"),
    "a table that falls": ("TABLE_T = 300, 700", "TABLE_T = 700, 300", "must rise"),
    "no spacing of nuclei": ("LAW = 'two-phase', TP_SIGMA0", "RECRYSTALLISATION = 1e-6, 1e5, LAW = 'two-phase', TP_SIGMA0",
                             "NUCLEUS_SPACING.*above 0"),
}


def test_mistakes(tmp_path):
    """One mistake gives one message with its line, and nothing is written."""
    good = POINTS.read_text()
    cases = {}
    for name, (old, new, _) in MISTAKES.items():
        assert good.count(old) >= 1, name
        cases[name] = (("wrong.nml", "--material"), {"text": good.replace(old, new, 1)})
    done = driver.run_all(cases, tmp_path)
    for name, (_, _, words) in MISTAKES.items():
        print(name, done[name].err)
        (message,) = done[name].err.splitlines()
        assert re.match(rf"wrong\.nml:\d+: error: .*{words}", message), name
        assert done[name].status == driver.BAD_INPUT and done[name].files == ["wrong.nml"], name


def test_calibration(tmp_path):
    """Numbers with which noisy curves were made come back within four standard errors, and the noise is found."""
    text = POINTS.read_text()
    paths = "".join(f"&PATH NAME = 'm{t}', MATERIAL = 'copper', TEMPERATURE = {t}, ROWS = 40 /\n" for t in (298, 773))
    (tmp_path / "made.nml").write_text(text[: text.index("&PATH")] + paths)
    words = [sys.executable, "-m", "stirpost", "calibrate", "law", "made.nml", "data.csv"]
    environment = driver.POSTPROC | {"STIRPOINT_EXECUTABLE": str(driver.EXECUTABLE), "MPLCONFIGDIR": os.environ.get("MPLCONFIGDIR", str(tmp_path))}
    subprocess.run([*words, "--generate", "--noise", "0.01"], cwd=tmp_path, env=environment, check=True)
    subprocess.run([*words, "--material", "copper", "--fit", "TP_BETA=0.003", "TP_K0=3"], cwd=tmp_path, env=environment, check=True)
    report = json.loads((tmp_path / "calibration/fit.json").read_text())
    print(report)
    for key, true in (("TP_BETA", 0.0018), ("TP_K0", 4.6)):
        assert abs(report["fitted"][key][0] - true) < 4.0 * report["standard_errors"][key][0]
        assert report["standard_errors"][key][0] < 0.05 * true
    assert report["relative_rms"] == pytest.approx(0.01, rel=0.3)
    assert (tmp_path / "calibration/fit.png").stat().st_size > 1000
