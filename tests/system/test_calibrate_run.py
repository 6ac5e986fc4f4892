# SPDX-License-Identifier: MIT
"""stirpost calibrate run: values that made a record are found again, within the errors it states."""

import json
import os
import shutil
import subprocess
import sys

import driver
import numpy as np
import pandas as pd
import pytest

VARIED = ["--vary", "TOOL.FRICTION=0.3,0.05,0.6", "--vary", "TOOL.HEAT_SHARE=0.6,0.2,1"]
SHORT = {"TIME.END": 0.12, "TIME.ELASTIC_SCALING": 4}
ROOM = 298.0


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """stir.nml with a probe under the tool, and a record of it, with noise, that random values made; the values."""
    directory = tmp_path_factory.mktemp("calibrate")
    shutil.copy(driver.INPUTS / "stir.nml", directory)
    with open(directory / "stir.nml", "a", encoding="utf-8") as file:
        file.write("&PROBE NAME = 'near', POSITION = 21e-3, 24e-3, 10.5e-3 /\n")
    random = np.random.default_rng(11)
    truth = {"TOOL.FRICTION": random.uniform(0.1, 0.2), "TOOL.HEAT_SHARE": random.uniform(0.75, 0.9)}
    results = driver.run(directory / "stir.nml", "--quiet", "--output", "truth.out", directory=directory, sets=SHORT | truth)
    assert results.status == driver.WELL
    made = driver.Results(directory / "truth.out", "stir")
    history, probes = made.history(), made.probes()
    time = np.linspace(0.05, 0.118, 25)
    torque = np.interp(time, history["time[s]"], history["tool_torque[Nm]"]) * (1 + 0.01 * random.normal(size=25))
    near = np.interp(time, probes["time[s]"], probes["near[K]"]) + 0.2 * random.normal(size=25)
    rows = [f"{1e3 * t:.6g};{a / 1e3:.8g};{b - 273.15:.8g}" for t, a, b in zip(time, torque, near)]
    (directory / "record.csv").write_text("time[ms];tool_torque[kNm];near[C]\n" + "\n".join(rows) + "\n")
    return directory, truth


def calibrate(directory, *words, expect=0):
    sets = [word for key, value in SHORT.items() for word in ("--set", f"{key}={value}")]
    done = subprocess.run([sys.executable, "-m", "stirpost", "calibrate", "run", "stir.nml", "record.csv", *VARIED, *sets, *words],
                          cwd=directory, env=driver.POSTPROC | {"STIRPOINT_EXECUTABLE": driver.EXECUTABLE}, capture_output=True,
                          text=True, check=False)
    assert done.returncode == expect, done.stdout + done.stderr
    return done


def test_values_are_found_again_and_the_search_goes_on(scene):
    """Friction and the share of the heat within three standard errors, which are a few per cent; stopped for want of
    runs, it goes on without repeating one; pictures and tables are there."""
    directory, truth = scene
    first = calibrate(directory, "--runs", "4", "-o", "one")
    assert "no more were allowed" in first.stdout and len(list((directory / "one/runs").iterdir())) == 4
    began = {path: os.stat(path).st_mtime_ns for path in (directory / "one/runs").glob("*/*.out/*_history.csv")}
    calibrate(directory, "--runs", "16", "-o", "one")
    assert all(os.stat(path).st_mtime_ns == then for path, then in began.items())
    result = json.loads((directory / "one/calibration.json").read_text())
    for name, value in truth.items():
        found = result["keys"][name]
        assert abs(found["value"] - value) < 3 * found["standard_error"], (name, value, found)
        assert found["standard_error"] < 0.06 * value, (name, found)
    assert result["curves"]["near"]["rms"] < 0.4 and result["curves"]["tool_torque"]["rms"] < 0.03 * 20
    assert (directory / "one/calibration.png").stat().st_size > 10000
    table = pd.read_csv(directory / "one/trials.csv")
    assert len(table) == len(list((directory / "one/runs").iterdir())) == result["runs"]["coarse"]
    assert table["sum of squares"].min() == pytest.approx(result["sum_of_squares"])


def test_coarse_runs_first_and_few_fine_ones(scene):
    """A coarse model that is wrong (metal softer by a tenth, more elastic scaling) still leads to the values of the fine
    one, by few fine runs; fitted alone it would not."""
    directory, truth = scene
    calibrate(directory, "--runs", "25", "--fine-runs", "4", "-o", "two", "--coarse", "TIME.ELASTIC_SCALING=6",
              "--coarse", "MATERIAL.JC_A=80e6")
    result = json.loads((directory / "two/calibration.json").read_text())
    assert result["grid"] == "fine" and 1 <= result["runs"]["fine"] <= 4
    for name, value in truth.items():
        assert result["keys"][name]["value"] == pytest.approx(value, rel=0.05)
    table = pd.read_csv(directory / "two/trials.csv")
    first = table[table["grid"] == "fine"].iloc[0]
    assert abs(first["TOOL.FRICTION"] / truth["TOOL.FRICTION"] - 1) > 2 * abs(
        result["keys"]["TOOL.FRICTION"]["value"] / truth["TOOL.FRICTION"] - 1)


def test_complaints(scene):
    """Status 2, all at once, and nothing is computed but a step."""
    directory, _ = scene
    (directory / "wrong.csv").write_text("time[s],tool_torque[N],nothing[K],T1[K]\n0.01,1,300,300\n0.05,1,300,300\n0.1,2,300,300\n")
    done = subprocess.run([sys.executable, "-m", "stirpost", "calibrate", "run", "stir.nml", "wrong.csv", *VARIED, "-o", "three"],
                          cwd=directory, env=driver.POSTPROC | {"STIRPOINT_EXECUTABLE": driver.EXECUTABLE}, capture_output=True,
                          text=True, check=False)
    assert done.returncode == 2
    for words in ("tool_torque is in N, that of the run in Nm", "nothing is no column of the run: T1, ", "T1 does not change"):
        assert words in done.stderr, done.stderr
    assert not list((directory / "three/runs").iterdir())
    for words, told in ((["--vary", "TOOL.FRICTION=1,2,3"], "LOW < START < HIGH"), (["--vary", "TOOL.FRICTOIN=2,1,3"], "FRICTOIN"),
                        (["--until", "1e-9", "--scale", "T9=1"], "three are needed")):
        assert told in calibrate(directory, *words, "-o", "three", expect=2).stderr
