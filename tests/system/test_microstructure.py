# SPDX-License-Identifier: MIT
"""The two-phase law in runs: restart, ranks, frames, histories, books, alarms, annealing."""

import json
import os
import pathlib
import signal
import subprocess
import sys

import driver
import numpy as np
import pytest
from test_restart import assert_same_run, stop_in_the_middle

ROOT = pathlib.Path(__file__).resolve().parents[2]
LAW = {
    "MATERIAL.LAW": "two-phase", "MATERIAL.TP_BURGERS": 2.56e-10, "MATERIAL.TP_WALLS": 1e13,
    "MATERIAL.TP_INTERIOR": 1e12, "MATERIAL.TP_SIZE": 10, "MATERIAL.TP_BETA": 0.0018, "MATERIAL.TP_K0": 4.6,
    "MATERIAL.TP_STAR_FIT": "600,885.6,-0.3", "MATERIAL.TP_STAR_RANGE": "298,1100",
    "MATERIAL.TP_STAR_ENDS": "0.216,0.002", "MATERIAL.TP_CALIBRATED": "298,1123",
    "MATERIAL.T_MELT": 1356,
}
ANNEALING = {
    "MATERIAL.RECOVERY": "8e-22,117e3", "MATERIAL.RECOVERY_EXPONENT": 3, "MATERIAL.GROWTH": "2.3e-6,104e3",
    "MATERIAL.RECRYSTALLISATION": "9.3e-5,104e3", "MATERIAL.NUCLEATION_DENSITY": 1e13,
    "MATERIAL.NUCLEUS_SPACING": 2e-6,
}


@pytest.fixture(scope="module")
def stirred(tmp_path_factory):
    """stir.nml with the law and annealing in one go, on one rank."""
    directory = tmp_path_factory.mktemp("stirred")
    return driver.run("stir", "--quiet", directory=directory, ranks=1, sets=LAW | ANNEALING)


def test_restart(stirred, tmp_path):
    """Exact: stopped in contact and continued is the same run, bit for bit, internal variables included."""
    other = stop_in_the_middle(tmp_path, 1, signal.SIGUSR1, sets=LAW | ANNEALING)
    driver.run("stir", "--quiet", "--restart", other.path("_checkpoint.h5"), directory=tmp_path, ranks=1,
               sets=LAW | ANNEALING)
    assert_same_run(stirred.results("stir"), other)


def test_frames_and_history(stirred):
    """Exact relations: d = 10/sqrt(rho) where nothing is recrystallised, rho from its parts, f by eq. 6.11; the books
    close to 1 % in every row; the means of the history are those of the frame."""
    results = stirred.results("stir")
    data, units, _ = driver.read_frame(sorted(results.directory.glob("stir_0*.hdf"))[-1])
    assert units["grain_size"] == "m" and units["dislocation_density"] == "1/m2"
    f, walls, interior = data["wall_fraction"], data["wall_density"], data["interior_density"]
    assert data["dislocation_density"] == pytest.approx(f * walls + (1 - f) * interior, rel=1e-5)
    assert f == pytest.approx(0.06 + 0.19 * np.exp(-3.06 * data["plastic_strain"] / 3.2), rel=1e-4)
    old = data["recrystallised"] == 0.0
    assert old.any() and data["recrystallised"].max() > 0.0
    assert data["grain_size"][old] == pytest.approx(10.0 / np.sqrt(data["dislocation_density"][old]), rel=1e-5)
    assert data["dislocation_density"].max() > 5.0 * data["dislocation_density"].min()
    history = results.history()
    assert np.abs(history["audit_error[%]"]).max() < 1.0
    assert history["grain_size_min[m]"][-1] == pytest.approx(data["grain_size"].min(), rel=1e-5)
    hard = data["plastic_strain"] > 1.0
    if hard.any():
        assert history["grain_size[m]"][-1] == pytest.approx(data["grain_size"][hard].mean(), rel=1e-4)
    else:
        assert history["stirred_mass[kg]"][-1] == 0.0


def test_ranks(stirred, tmp_path):
    """Three ranks give the same histories to rounding that grows with time: 0.5 % until 0.05 s."""
    sets = LAW | ANNEALING | {"TIME.END": 0.05}
    other = driver.run("stir", "--quiet", directory=tmp_path, ranks=3, sets=sets).results("stir").history()
    history = stirred.results("stir").history()
    n = len(other["time[s]"]) - 1
    for name in ("plastic_work[J]", "grain_size_min[m]", "temperature_max[K]"):
        assert other[name][:n] == pytest.approx(history[name][:n], rel=5e-3), name


def test_alarms(run, tmp_path):
    """A layer sheared at a rate above TP_RATE0 at a temperature outside TP_CALIBRATED says so once each, and where."""
    sets = {name: value for name, value in LAW.items()} | {"MATERIAL.TP_RATE0": 0.5, "BODY.TEMPERATURE": 280}
    text = (driver.INPUTS / "layer.nml").read_text().replace("NORTON_K = 40e6, NORTON_N = 0.2,", "")
    (tmp_path / "fast.nml").write_text(text)
    out = run("fast.nml", "--quiet", sets=sets).out
    print(out)
    assert out.count("deformed faster than TP_RATE0") == 1
    assert out.count("at a temperature outside TP_CALIBRATED") == 1
    assert "negative" not in out and " m, t = " in out and "280 K" in out
    calm = run("fast.nml", "--quiet", "--output", "calm", sets=LAW | {"BODY.TEMPERATURE": 300}).out
    assert "warning" not in calm


def test_annealing_at_rest(run):
    """Exact: undeformed material has nothing to lose; without &HEAT annealing is refused."""
    sets = LAW | {"MATERIAL.RECOVERY": "2e-12,50e3", "MATERIAL.CONDUCTIVITY": 391, "TIME.END": 2e-6}
    sets |= {"MATERIAL.TP_WALLS": 1e14, "MATERIAL.TP_INTERIOR": 1e13, "BODY(block).TEMPERATURE": 500, "BODY(lid).TEMPERATURE": 500,
             "TOOL.POSITION": "4e-3,4e-3,20e-3", "LOAD.FORCE": "0,0,0", "SURFACE.COEFFICIENT": 0}
    done = run("small", "--quiet", sets=sets)
    data, _, _ = driver.read_frame(sorted((done.directory / "small.out").glob("small_0*.hdf"))[-1])
    assert data["interior_density"] == pytest.approx(1e13, rel=1e-6)
    text = (driver.INPUTS / "small.nml").read_text()
    cold = "\n".join(line for line in text.splitlines() if not line.startswith(("&HEAT", "&SURFACE")))
    (done.directory / "cold.nml").write_text(cold)
    failed = run("cold.nml", expect=driver.BAD_INPUT, sets={k: v for k, v in sets.items() if "SURFACE" not in k})
    assert "there is no &HEAT" in failed.err and "Traceback" not in failed.err


def test_section_and_track(stirred, tmp_path):
    """The commands behind a run: lines and stir zone of a section, and a particle's history for --material."""
    environment = driver.POSTPROC | {"MPLCONFIGDIR": os.environ.get("MPLCONFIGDIR", str(tmp_path))}
    directory = stirred.results("stir").directory
    subprocess.run([sys.executable, "-m", "stirpost", "section", directory, "--x", "21e-3", "-o", tmp_path],
                   env=environment, check=True)
    rows = (tmp_path / "section_x21.csv").read_text().splitlines()
    assert {row.split(",")[0] for row in rows[1:]} == {"retreating", "centre", "advancing"}
    heights = [float(row.split(",")[1]) for row in rows[1:] if row.startswith("centre")]
    assert len(heights) == 6 and heights[0] == pytest.approx(1e-3, abs=0.3e-3)
    assert json.loads((tmp_path / "section_x21.json").read_text())["x[m]"] == 0.021
    data, _, _ = driver.read_frame(sorted(directory.glob("stir_0*.hdf"))[-1])
    number = int(data["id"][np.argmax(data["plastic_strain"])])
    subprocess.run([sys.executable, "-m", "stirpost", "track", directory, str(number), tmp_path / "track.csv"],
                   env=environment, check=True)
    text = (ROOT / "tests/system/points/points.nml").read_text()
    (tmp_path / "one.nml").write_text(text[: text.index("&PATH")] + "&PATH NAME = 'one', MATERIAL = 'copper', "
                                      "KIND = 'history', FILE = 'track.csv' /\n")
    driver.run("one.nml", "--material", "--quiet", directory=tmp_path)
    table = driver.Table(tmp_path / "one.out" / "one.csv")
    assert table["plastic_strain[1]"][-1] == pytest.approx(data["plastic_strain"].max(), rel=1e-5)
    assert table["wall_fraction[1]"][-1] == pytest.approx(data["wall_fraction"][data["id"] == number][0], rel=1e-4)
