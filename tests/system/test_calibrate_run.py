# SPDX-License-Identifier: MIT
"""stirpost calibrate run: values that made a record are found again, within the errors it states.

Most tests have a stand-in for the program, which writes histories from formulas whose valley and minima are known."""

import json
import os
import re
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
    flow = subprocess.run([sys.executable, "-m", "stirpost", "flow", "truth.out", "--json"], cwd=directory, env=driver.POSTPROC,
                          capture_output=True, text=True, check=True)
    groove = json.loads(flow.stdout)["volumes"]["groove[m3]"]
    calibrate(directory, "--runs", "16", "-o", "one", "--profile", "1", "--target", f"groove[mm3]={1e9 * groove},{0.1e9 * groove}")
    assert all(os.stat(path).st_mtime_ns == then for path, then in began.items())
    result = json.loads((directory / "one/calibration.json").read_text())
    for name, value in truth.items():
        found = result["keys"][name]
        assert abs(found["value"] - value) < 3 * found["standard_error"], (name, value, found)
        assert found["standard_error"] < 0.06 * value, (name, found)
    assert result["curves"]["near"]["rms"] < 0.4 and result["curves"]["tool_torque"]["rms"] < 0.03 * 20
    assert abs(result["targets"]["groove"]["mean"]) < 0.03 * groove
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
                        (["--until", "1e-9", "--uncertainty", "T9=1"], "three are needed")):
        assert told in calibrate(directory, *words, "-o", "three", expect=2).stderr


# Temperature depends on SHEAR_FACTOR over the fifth root of COEFFICIENT alone, the torque on the first, the force up and down
# on it. The run breaks down beyond BREAKS; the program is stopped once the file `stop` is there.
STAND_IN = """#!{python}
import math, pathlib, re, sys
words = sys.argv[1:]
if "--version" in words:
    sys.exit(print("stand-in 1"))
text = pathlib.Path(words[0]).read_text()
sets = dict(words[k + 1].split("=") for k, word in enumerate(words) if word == "--set")
value = lambda key: float(sets.get(key) or re.search(key.split(".")[1] + r" *= *([-+.e0-9]+)", text)[1])
m, film = value("TOOL.SHEAR_FACTOR"), value("SURFACE.COEFFICIENT")
if "TIME.MAX_STEPS" not in sets:
    if pathlib.Path("stop").exists() and len(list(pathlib.Path(words[words.index("--output") + 1]).parent.parent.glob("*/*.out"))) > 2:
        sys.exit(75)
    if m > value("RUN.BREAKS"):
        sys.exit(3)
place = pathlib.Path(words[words.index("--output") + 1])
place.mkdir(parents=True)
hot, torque, force = 1500 * m / (film / 1e4)**0.2, 100 * m, 1e3 * (2 + math.cos(9 * m) + m)
rows = ["time[s],tool_torque[Nm],tool_force_z[N],tool_power[W],tool_x[m],tool_y[m],tool_z[m],tool_angle[rad]"]
probes = ["time[s],T1[K]"]
for k in range(41):
    t = 0.25 * k
    rows.append(f"{{t}},{{torque}},{{force}},{{100 * torque}},{{1e-3 * t}},0.02,0.01,{{-100 * t}}")
    probes.append(f"{{t}},{{300 + hot * math.sin(0.1 * math.pi * t)**2}}")
for name, lines in (("history", rows), ("probes", probes), ("summary", ['{{"steps": 1}}'])):
    (place / f"model_{{name}}.{{'json' if name == 'summary' else 'csv'}}").write_text("\\n".join(lines) + "\\n")
"""
TRUE = {"TOOL.SHEAR_FACTOR": 0.65, "SURFACE.COEFFICIENT": 2e4}
BOTH = ["--vary", "TOOL.SHEAR_FACTOR", "--vary", "SURFACE.COEFFICIENT"]


@pytest.fixture
def model(tmp_path):
    """A folder with an input, its stand-in and the record of a thermocouple, with noise, that TRUE made; a call."""
    (tmp_path / "model.nml").write_text("&RUN BREAKS = 9 /\n&TOOL NAME = 'tool', SHEAR_FACTOR = 0.3 /\n&SURFACE COEFFICIENT = 300 /\n")
    program = tmp_path / "stand_in"
    program.write_text(STAND_IN.format(python=sys.executable))
    program.chmod(0o755)
    random = np.random.default_rng(5)
    hot = 1500 * TRUE["TOOL.SHEAR_FACTOR"] / (TRUE["SURFACE.COEFFICIENT"] / 1e4)**0.2
    rows = [f"{t:g},{300 + hot * np.sin(0.1 * np.pi * t)**2 + 2 * random.normal():.4f}" for t in np.linspace(0, 10, 41)]
    (tmp_path / "record.csv").write_text("time[s],T1[K]\n" + "\n".join(rows) + "\n")

    def call(*words, record="record.csv", expect=0):
        done = subprocess.run([sys.executable, "-m", "stirpost", "calibrate", "run", "model.nml", *[record] * bool(record), *words,
                               "--program", "./stand_in", "-o", "out"], cwd=tmp_path, env=driver.POSTPROC, capture_output=True, text=True,
                              check=False)
        assert done.returncode == expect, done.stdout + done.stderr
        result = tmp_path / "out/calibration.json"
        return done, json.loads(result.read_text()) if expect == 0 else None

    call.folder = tmp_path
    return call


def trials(model):
    return pd.read_csv(model.folder / "out/trials.csv")


def test_what_is_not_determined(model):
    """A thermocouple alone leaves a combination of friction and film open: the report follows the known valley up to the
    bounds of both. With a torque both are found within three standard errors, and the report says so."""
    done, result = model(*BOTH, "--runs", "60")
    found = result["least_determined"]
    assert "NOT DETERMINED: TOOL.SHEAR_FACTOR = " in done.stdout and "up to a bound on both sides" in done.stdout
    assert not found["determined"]
    kept = TRUE["TOOL.SHEAR_FACTOR"] / TRUE["SURFACE.COEFFICIENT"]**0.2
    ends = sorted((found[end]["TOOL.SHEAR_FACTOR"], found[end]["SURFACE.COEFFICIENT"]) for end in ("from", "to"))
    assert ends[0][1] < 30 and ends[1][0] > 0.95
    for m, film in ends:
        assert m / film**0.2 == pytest.approx(kept, rel=0.05)
    table = pd.read_csv(model.folder / "out/valley.csv")
    assert table["distance"].is_monotonic_increasing and len(table) >= 5
    assert table["within"].all() and table["sum of squares"].max() < 4
    assert (model.folder / "out/valley.png").stat().st_size > 10000
    done, result = model(*BOTH, "--runs", "60", "--target", "torque[kNm]=0.066,0.002", "--uncertainty", "T1=20")
    found = result["least_determined"]
    assert found["determined"] and "least determined: TOOL.SHEAR_FACTOR" in done.stdout
    for name, value in TRUE.items():
        key = result["keys"][name]
        assert abs(key["value"] - value) < 3 * key["standard_error"], (name, key)
        assert found["from"][name] < key["value"] < found["to"][name]
        assert abs(found["to"][name] / key["value"] - 1) == pytest.approx(2 * key["standard_error"] / key["value"], rel=0.5)
    assert result["keys"]["TOOL.SHEAR_FACTOR"]["standard_error"] == pytest.approx(0.02, rel=0.05)


def test_bounds_hold(model):
    """A torque that asks for more than the shear strength ends at the bound of physics, and no run is beyond it. Other
    bounds are those that are given, and told."""
    done, result = model("--vary", "TOOL.SHEAR_FACTOR", "--target", "torque=130,2", record=None)
    key = result["keys"]["TOOL.SHEAR_FACTOR"]
    assert key["at_a_bound"] and key["value"] == pytest.approx(1.0, abs=1e-3)
    assert trials(model)["TOOL.SHEAR_FACTOR"].between(0, 1).all()
    assert "between 0 and 1: the metal transmits no more than its shear strength" in done.stdout
    done, result = model("--vary", "TOOL.SHEAR_FACTOR=0.5,0.1,2", "--target", "torque=130,2", record=None)
    assert result["keys"]["TOOL.SHEAR_FACTOR"]["value"] == pytest.approx(1.3, abs=0.01)
    assert "wider than 0 to 1" in done.stdout


def test_several_starts_find_the_lowest_of_two_valleys(model):
    """Force and torque agree at 0.9; a search from 0.15 alone ends in the valley of the force beside it."""
    words = ["--vary", "TOOL.SHEAR_FACTOR=0.15", "--target", "axial_force=2655.6,20", "--target", "torque=90,60", "--profile", "0"]
    alone = model(*words, "--design", "0", record=None)[1]
    assert alone["keys"]["TOOL.SHEAR_FACTOR"]["value"] < 0.2
    done, several = model(*words, "--design", "6", "--starts", "3", "--runs", "60", record=None)
    assert several["keys"]["TOOL.SHEAR_FACTOR"]["value"] == pytest.approx(0.9, abs=0.01)
    assert len(several["searches"]) == 3 and "from several starts" in done.stdout
    first = trials(model)["TOOL.SHEAR_FACTOR"]
    model(*words, "--design", "6", "--starts", "3", "--runs", "60", record=None)
    assert trials(model)["TOOL.SHEAR_FACTOR"].equals(first)


def test_a_search_that_was_stopped_goes_on(model):
    """A run that a signal ends stops the calibration; called again it repeats none of the runs that had ended. Runs
    that break down are left aside, and not repeated either."""
    (model.folder / "model.nml").write_text((model.folder / "model.nml").read_text().replace("BREAKS = 9", "BREAKS = 0.8"))
    words = [*BOTH, "--runs", "60", "--target", "torque=65,2", "--profile", "0"]
    (model.folder / "stop").touch()
    model(*words, expect=2)
    began = {path: path.stat().st_mtime_ns for path in (model.folder / "out/runs").rglob("*") if path.is_file()}
    assert len([path for path in began if path.name == "model_summary.json"]) == 3
    (model.folder / "stop").unlink()
    done, result = model(*words)
    again = {path: path.stat().st_mtime_ns for path in began if path.name != "recipe.json"}
    assert all(began[path] == then for path, then in again.items())
    assert result["keys"]["TOOL.SHEAR_FACTOR"]["value"] == pytest.approx(0.65, abs=0.01)
    table = trials(model)
    assert table["sum of squares"].isna().sum() > 0 and (table["TOOL.SHEAR_FACTOR"][table["sum of squares"].isna()] > 0.8).all()
    assert "broke down" in done.stdout and len(table) == len(list((model.folder / "out/runs").iterdir()))


def test_a_search_that_has_not_ended_has_no_errors(model):
    """Exact: no standard error where --runs ended the search, which is far from its end here, and one where it came to its end."""
    done, result = model("--vary", "SURFACE.COEFFICIENT=300,100,1e5", "--runs", "2", "--design", "0")
    assert "SURFACE.COEFFICIENT = " in done.stdout and "+-" not in done.stdout
    assert "the search has not come to its end: no standard error" in done.stdout
    assert result["runs_spent"] and result["keys"]["SURFACE.COEFFICIENT"]["standard_error"] is None
    table = trials(model)
    assert result["keys"]["SURFACE.COEFFICIENT"]["value"] == pytest.approx(table["SURFACE.COEFFICIENT"][table["sum of squares"].idxmin()])
    assert "2 runs: no more were allowed; the same command goes on from them" in done.stdout
    done, result = model("--vary", "SURFACE.COEFFICIENT=1000,100,1e5", "--runs", "40", "--design", "0")
    assert "+-" in done.stdout and not result["runs_spent"] and result["keys"]["SURFACE.COEFFICIENT"]["standard_error"] > 0


def test_one_group_of_several_is_named(model):
    """Exact: of two &SURFACE one is varied, by its number; without it the call is refused and says which there are."""
    with open(model.folder / "model.nml", "a", encoding="utf-8") as file:
        file.write("&SURFACE COEFFICIENT = 10 /\n")
    done, _ = model("--vary", "SURFACE.COEFFICIENT", expect=2)
    assert "the input has 2 &SURFACE, which would all change: name one: SURFACE(1).COEFFICIENT, SURFACE(2).COEFFICIENT" in done.stderr
    done, result = model("--vary", "SURFACE(1).COEFFICIENT", "--runs", "1", "--design", "0")
    assert list(result["keys"]) == ["SURFACE(1).COEFFICIENT"]


def test_limits_are_those_of_keys():
    """--limits names keys that the program has, and limits that it accepts."""
    words = [sys.executable, "-m", "stirpost", "calibrate", "run", "--limits"]
    table = subprocess.run(words, env=driver.POSTPROC, capture_output=True, text=True, check=True).stdout
    groups = {}
    for line in table.splitlines():
        (group, key), low, high = line.split()[0].split("."), *map(float, line.split()[1:3])
        if group not in groups:
            groups[group] = subprocess.run([driver.EXECUTABLE, f"--keys={group}"], env=driver.ENVIRONMENT, capture_output=True,
                                           text=True, check=True).stdout
        told = re.search(rf"^  {key} .*", groups[group], re.M)[0]
        assert not re.search(r"and <= 1\)", told) or high <= 1.0, told
        assert not re.search(r"\(> 0\)", told) or low > 0.0, told
