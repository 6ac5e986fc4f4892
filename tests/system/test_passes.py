# SPDX-License-Identifier: MIT
"""benchmarks/passes: its inputs are good, runs are kept and gone on with, measures are what they say."""

import json
import sys

import driver
import numpy as np
import pytest

sys.path.insert(0, str(driver.ROOT / "benchmarks/passes"))
import calculate  # noqa: E402
import measure  # noqa: E402
import report  # noqa: E402
import scenes  # noqa: E402


def test_all_inputs_are_good(tmp_path):
    """Exact: every plate and every kind takes its first step; what --set names is there. Annealing is of the two-phase law."""
    cases = {}
    wanted = [(name, "floor") for name in scenes.SCENES]
    wanted += [("cavity1_tp" if kind.startswith("annealing") else "cavity1_hot", kind) for kind in scenes.KINDS[1:]]
    for name, kind in wanted:
        keys = calculate.keys_of(name, kind, 2.0, 1e6) | {"TIME.MAX_STEPS": 1}
        cases[name, kind] = ([f"{name}.nml", "--quiet"], {"text": scenes.text_of(name, kind), "sets": keys})
    for (name, kind), done in driver.run_all(cases, tmp_path).items():
        assert done.status == driver.WELL, (name, kind, done.err)
        assert ("&SHAPE cuts 1248 mm3 instead of 1289.99 mm3" in done.out + done.err) == name.startswith("cavity")


def test_kept_runs_and_measures(tmp_path):
    """A short pass: computed once, then left alone; with other keys computed again; its measures are numbers."""
    keys = calculate.keys_of("cavity1_tp", "floor", 2.0, 1e6) | {"TIME.END": "6", "OUTPUT.FRAME_INTERVAL": "3"}
    told = []
    results = calculate.calculate(tmp_path / "a", "cavity1_tp", "floor", keys, tell=told.append)
    calculate.calculate(tmp_path / "a", "cavity1_tp", "floor", keys, tell=told.append)
    calculate.calculate(tmp_path / "a", "cavity1_tp", "floor", keys | {"TOOL.SHEAR_FACTOR": "0.1"}, tell=told.append)
    assert ["computed" in told[0], "is there" in told[1], "computed" in told[2]] == [True] * 3
    made = [json.loads(line) for line in (tmp_path / "a/machine.jsonl").read_text().splitlines()]
    assert len(made) == 2 and made[0]["cpu_seconds"] > 0.0 and made[0]["machine"]
    assert float(results.summary()["particles"]) == 5844
    (tmp_path / "a/machine.jsonl").unlink()  # as if it had been stopped: it goes on from the checkpoint
    calculate.calculate(tmp_path / "a", "cavity1_tp", "floor", keys | {"TOOL.SHEAR_FACTOR": "0.1"}, tell=told.append)
    assert "computed" in told[3] and json.loads((tmp_path / "a/machine.jsonl").read_text())["restarted"]


def test_dip():
    """Exact: how far a curve falls between two higher places."""
    time = np.linspace(0.0, 60.0, 601)
    values = 500.0 - 30.0 * np.exp(-((time - 28.0) / 3.0) ** 2) + 2.0 * time
    there = (time >= 18) & (time <= 40)
    brute = max(min(values[there][:k + 1].max(), values[there][k:].max()) - values[there][k] for k in range(there.sum()))
    assert measure.dip(time, values) == pytest.approx(brute, rel=0.12) and brute > 15.0
    values[280] += 60.0
    assert measure.dip(time, values) == pytest.approx(brute, rel=0.12)
    assert measure.dip(time, time) == 0.0


def test_tables_are_of_the_kept_results():
    """Exact: what docs/validation.md shows is what benchmarks/passes/results holds."""
    kept = json.loads(report.TABLES.read_text(encoding="utf-8"))
    for title, rows in report.tables_of(report.TABLES.parent).items():
        assert kept[title]["rows"] == rows, title
    for row in kept["runs"]["rows"][1:]:
        assert row[0] in scenes.SCENES and row[1] in scenes.KINDS
