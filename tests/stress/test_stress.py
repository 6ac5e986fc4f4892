# SPDX-License-Identifier: MIT
"""The short versions of the stress tests: python3 tests/stress/stress.py --quick as pytest."""

import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import rows

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
