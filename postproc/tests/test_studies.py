# SPDX-License-Identifier: MIT
import sys
from pathlib import Path

import pandas as pd
import pytest
import synthetic

from stirpost import cli
from stirpost.cli import sweep

STAND_IN = """#!{python}
# A solver that makes a run whose torque is the friction times 100.
import sys, shutil, pathlib, json
sys.path[:0] = [{tests!r}, {package!r}]
import synthetic
words = sys.argv[1:]
place = pathlib.Path(words[words.index("--output") + 1])
friction = float([w for w in words if w.startswith("TOOL.FRICTION=")][0].split("=")[1])
if friction > 0.9:
    sys.exit("input.nml:3: error: FRICTION is too much")
shutil.rmtree(place, ignore_errors=True)
synthetic.make_run(place, spacing=0.008, frames=2, rows=30)
name = place.name[:-4]
path = place / f"{{name}}_history.csv"
lines = path.read_text().splitlines()
column = lines[2].split(",").index("pin_torque[Nm]")
rows = [line.split(",") for line in lines[3:]]
for row in rows:
    row[column] = str(100.0 * friction)
path.write_text("\\n".join(lines[:3] + [",".join(row) for row in rows]) + "\\n")
synthetic.write_summary(place)
with open(place.parent / "calls", "a") as file:
    print(friction, file=file)
"""


@pytest.fixture
def solver(tmp_path, monkeypatch):
    path = tmp_path / "solver.py"
    tests = Path(__file__).parent
    path.write_text(STAND_IN.format(python=sys.executable, tests=str(tests), package=str(tests.parent)))
    path.chmod(0o755)
    (tmp_path / "input.nml").write_text("&RUN /\n")
    monkeypatch.chdir(tmp_path)
    return path


def test_a_study_is_run_drawn_and_goes_on(solver, tmp_path):
    """Torque over friction; what is there is not computed again unless the input has changed."""
    words = ["sweep", "input.nml", "--program", str(solver), "--set", "TOOL.FRICTION=.1,.2", "--set", "TOOL.TILT_DEG=1,2", "-o", "study"]
    assert cli.main(words) == 0
    table = pd.read_csv("study/sweep.csv")
    assert len(table) == 4 and table["TOOL.FRICTION"].tolist() == [0.1, 0.1, 0.2, 0.2]
    assert table["torque, mean [N m]"].tolist() == pytest.approx([10.0, 10.0, 20.0, 20.0])
    assert (tmp_path / "study/sweep.png").stat().st_size > 5000
    calls = (tmp_path / "study/calls").read_text()
    assert cli.main([*words[:5], "TOOL.FRICTION=.1,.2,.3", *words[6:]]) == 0
    more = (tmp_path / "study/calls").read_text()[len(calls):]
    assert more.split() == ["0.3", "0.3"]
    (tmp_path / "input.nml").write_text("&RUN TITLE = 'other' /\n")
    assert cli.main(words) == 0
    assert len((tmp_path / "study/calls").read_text().split()) == 10


def test_a_run_that_fails_ends_the_study_with_its_words(solver, capsys):
    assert cli.main(["sweep", "input.nml", "--program", str(solver), "--set", "TOOL.FRICTION=.95"]) == 2
    assert "FRICTION is too much" in capsys.readouterr().err
    for text in ("TOOL.FRICTION", "FRICTION=1", "TOOL.FRICTION=1,,2"):
        with pytest.raises(ValueError, match="expected GROUP.KEY"):
            sweep.axis_of(text)


def test_two_runs_are_compared(tmp_path, capsys, monkeypatch):
    """The same run twice differs by nothing; with twice the torque by 100 %."""
    one = synthetic.make_run(tmp_path / "one.out", spacing=0.004, frames=2, rows=30)
    other = synthetic.make_run(tmp_path / "other.out", spacing=0.004, frames=2, rows=30)
    path = other / "other_history.csv"
    lines = path.read_text().splitlines()
    column = lines[2].split(",").index("pin_torque[Nm]")
    rows = [line.split(",") for line in lines[3:]]
    for row in rows:
        row[column] = str(2.0 * float(row[column]))
    path.write_text("\n".join(lines[:3] + [",".join(row) for row in rows]) + "\n")
    assert cli.main(["compare", str(one), str(other), "-o", str(tmp_path / "both")]) == 0
    table = pd.read_csv(tmp_path / "both/compare.csv", index_col=0)
    assert table.loc["torque, mean [N m]", "difference [%]"] == pytest.approx(100.0)
    assert table.loc["axial force, mean [N]", "difference"] == pytest.approx(0.0, abs=1e-9)
    assert {p.name for p in (tmp_path / "both").iterdir()} == {"compare.csv", "loads.png", "thermocouples.png", "sections.png"}
