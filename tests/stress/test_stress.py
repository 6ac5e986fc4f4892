# SPDX-License-Identifier: MIT
"""The short versions of the stress tests: python3 tests/stress/stress.py --quick as pytest."""

import json
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import record
import rows
from rows.base import Check

CASES = [(name, label, parameters) for name, row in rows.ALL.items() if not row.long
         for label, parameters in row.cases(True).items()]


@pytest.mark.parametrize("name, label, parameters", CASES, ids=[f"{name}: {label}" for name, label, _ in CASES])
def test_row(tmp_path, name, label, parameters):
    """Exact: every figure of the row keeps the bounds that its text and theory give."""
    checks = rows.ALL[name].measure(tmp_path, 1, **parameters)
    for check in checks:
        print(f"{check.what}: {check.measured:.4g}, {check.passes}")
    assert checks and all(check.ok for check in checks)


def test_two_ranks(tmp_path):
    """Exact: the bracket and a contact keep their bounds on 2 ranks too."""
    for name in ("cfl", "early_tool"):
        label, parameters = next(iter(rows.ALL[name].cases(True).items()))
        place = tmp_path / name
        place.mkdir()
        checks = rows.ALL[name].measure(place, 2, **parameters)
        assert checks and all(check.ok for check in checks), (name, label, checks)


def test_record_merges_runs_of_different_times(tmp_path):
    """Exact: of a case that was run twice the later result is kept, cases that no row has are removed, and the page counts
    failures and lists cases that were not run."""
    lines, page = tmp_path / "lines.jsonl", tmp_path / "page.md"
    good, bad = Check("gap", 1.0, at_most=2.0), Check("gap", 3.0, at_most=2.0)
    for label, ranks, check in (("flight", 2, good), ("flight", 1, bad), ("gone", 1, bad), ("flight", 1, good)):
        record.note(lines, "refused", label, ranks, 1.0, [check], "")
    record.note(lines, "sliding", "ugimp", 1, 1.0, [bad], "")
    record.note(lines, "sliding", "bspline", 1, 1.0, [], "no end\nout of time")
    record.page(lines, page)
    kept = [json.loads(line) for line in lines.read_text(encoding="utf-8").splitlines()]
    assert [(line["row"], line["case"], line["ranks"]) for line in kept] == [
        ("refused", "flight", 1), ("refused", "flight", 2), ("sliding", "ugimp", 1), ("sliding", "bspline", 1)]
    text = page.read_text(encoding="utf-8")
    assert "| refused | 1 | 1 of 1 | 1 | 0 |" in text and "| sliding | 1 | 2 of 3 | 1 | 2 |" in text
    assert "| sliding | ugimp | 1 | gap | 3.0 | <= 2 |" in text and "| broken: out of time |" in text
    assert "sliding on 1 (1 of 3 cases); sliding on 2 (3 of 3 cases)" in text and "refused on" not in text
