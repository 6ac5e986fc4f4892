# SPDX-License-Identifier: MIT
"""Tests of the work-precision benchmark: the smoke run of one problem, and the logic of the front."""

import json
import math
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import pareto  # noqa: E402
import table  # noqa: E402


def point(label, error, seconds, n=1):
    return {"problem": "p", "option_set": label, "resolution": n, "error": error, "core_seconds": seconds}


#          a 1e-2 in 1 s and b 1e-3 in 4 s are on the front; c is as precise as a in twice the time, and its
#          finer point reaches b's error in 3 times b's time; d breaks; e is too coarse to count.
POINTS = [point("a", 1e-2, 1.0), point("b", 1e-3, 4.0), point("c", 1e-2, 2.0, 1), point("c", 1e-3, 12.0, 2),
          point("d", None, 0.0), point("e", 0.5, 0.1)]


def test_front_is_what_nothing_beats():
    """Worked out by hand."""
    assert [p["option_set"] for p in pareto.front(POINTS)] == ["a", "b"]


def test_front_falls_and_beats_all_others():
    """Definition: no point has at most the error and fewer seconds than one of the front, or less error in as many."""
    points = [point(str(k), 10.0 ** (-1 - (37 * k % 17) / 5.0), 1.0 + (23 * k % 19)) for k in range(60)]
    best = pareto.front(points)
    seconds, errors = [p["core_seconds"] for p in best], [p["error"] for p in best]
    assert seconds == sorted(set(seconds)) and errors == sorted(set(errors), reverse=True)
    beaten = [p for p in points if any(q["error"] <= p["error"] and q["core_seconds"] <= p["core_seconds"]
                                       and (q["error"], q["core_seconds"]) != (p["error"], p["core_seconds"])
                                       for q in points)]
    assert {id(p) for p in best}.isdisjoint({id(p) for p in beaten})
    places = {(p["error"], p["core_seconds"]) for p in points if not any(p is q for q in beaten)}
    assert places == {(p["error"], p["core_seconds"]) for p in best}


def test_factors_at_equal_error():
    """1 on the front; c twice the time at best; infinite without a point that counts."""
    assert pareto.factors(POINTS) == {"a": 1.0, "b": 1.0, "c": 2.0, "d": math.inf, "e": math.inf}


def test_seconds_for_an_error():
    """The cheapest point that is at least so precise."""
    assert pareto.seconds_at(POINTS, 2e-2) == 1.0
    assert pareto.seconds_at(POINTS, 5e-3) == 4.0
    assert pareto.seconds_at(POINTS, 5e-4) == math.inf


def test_tables_name_winners_and_losers():
    text = table.markdown(POINTS)
    assert "| p | a 1: 1.0e-02 in 1; b 1: 1.0e-03 in 4 |" in text
    assert "| c | 2.0 | p |" in text and "| d | x | none |" in text
    assert "| a | 1 |" not in text  # a winner is no loser


def test_smoke_run(tmp_path):
    """--quick on waves in a square: a line a point, errors of order 2 between 8 and 16 cells (at least 1.5),
    work = particles x steps, and the pictures and tables of the file."""
    script, file = [sys.executable, str(HERE / "work_precision.py")], tmp_path / "points.jsonl"
    subprocess.run([*script, "--quick", "waves2d", "--json", str(file)], check=True, capture_output=True)
    points = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    errors = {(p["option_set"], p["resolution"]): p["error"] for p in points}
    assert len(errors) == len(points) == 6
    for label in {p["option_set"] for p in points}:
        assert math.log2(errors[label, 8] / errors[label, 16]) > 1.5
    for p in points:
        assert 0.0 < p["core_seconds"] <= p["process_seconds"]
        work = p["particles"] * p["steps"] / p["particle_steps_per_core_second"]
        assert abs(work / p["core_seconds"] - 1.0) < 1e-2
    done = subprocess.run([*script, "--table", "--pictures", str(tmp_path), "--json", str(file)], check=True,
                          capture_output=True, text=True)
    assert "| waves2d | " in done.stdout
    assert (tmp_path / "precision_waves2d.png").stat().st_size > 10_000
