# SPDX-License-Identifier: MIT
"""One point: error and core time of a problem with an option set at a resolution."""

import functools
import json
import math
import pathlib
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "verification"))

import problems  # noqa: E402
from problems.base import INPUTS, driver  # noqa: E402

ENOUGH = 3.0  # core-seconds of a point after which it is not repeated any more


def children_seconds():
    """Processor time of all finished child processes."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


@functools.cache
def machine():
    """Processor and number of cores."""
    for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "unknown"


@functools.cache
def version():
    """Commit of the working tree, '+' if it has changes; without git the program's version."""
    words = ["git", "-C", str(ROOT), "describe", "--always", "--dirty=+", "--exclude=*"]
    if shutil.which(words[0]):
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            return done.stdout.strip()
    return subprocess.run([driver.EXECUTABLE, "--version"], capture_output=True, text=True,
                          check=True).stdout.splitlines()[0]


def default_cfl(problem, sets, directory):
    """The CFL number that the program takes by itself for these keys."""
    stem = problem.input or problem.name
    done = driver.run(INPUTS / f"{stem}.nml", "--check", directory=directory, sets=sets)
    return float(re.search(r"CFL ([0-9.E+-]+)", done.out).group(1))


def solve(problem, n, parameters, sets):
    """One run; its figures as a dictionary."""
    with tempfile.TemporaryDirectory() as directory:
        before = children_seconds()
        error, _, seconds = problem.solve(n, parameters, directory, sets)
        process = children_seconds() - before
        summaries = [json.loads(path.read_text(encoding="utf-8"))
                     for path in pathlib.Path(directory).rglob("*_summary.json")]
    return {"error": error, "core_seconds": seconds, "process_seconds": process,
            "particles": max(s["particles"] for s in summaries), "steps": sum(s["steps"] for s in summaries),
            "work": sum(s["particles"] * s["steps"] for s in summaries)}


def another(done, seconds, repeats):
    """True if a point of `done` runs that took `seconds` is run once more."""
    return done < repeats and seconds < ENOUGH


def all_runs(once, repeats):
    """Processor time of a point whose run takes `once` [s]."""
    done = 0
    while another(done, done * once, repeats):
        done += 1
    return done * once


def point(case, label, n, repeats):
    """Median of runs as one JSON line; the error is None where the run breaks."""
    problem, options = problems.ALL[case.problem], case.option_sets[label]
    parameters = problem.parameters | case.parameters | options.parameters
    result = {"problem": case.name, "option_set": label, "resolution": n}
    origin = {"machine": machine(), "version": version()}
    try:
        sets = dict(options.keys)
        if options.step != 1.0:
            with tempfile.TemporaryDirectory() as directory:
                own = default_cfl(problem, problem.runs(n, parameters)[0] | sets, directory)
            sets["TIME.CFL"] = options.step * own
        runs = []
        while another(len(runs), sum(run["process_seconds"] for run in runs), repeats):
            runs.append(solve(problem, n, parameters, sets))
    except (AssertionError, ValueError, IndexError, subprocess.TimeoutExpired) as broken:
        reason = (str(broken).strip().splitlines() or [type(broken).__name__])[-1][:120]
        return result | {"error": None, "broken": reason} | origin
    first = runs[0]
    if not math.isfinite(first["error"]):
        return result | {"error": None, "broken": "no finite error"} | origin
    core = statistics.median(run["core_seconds"] for run in runs)
    process = statistics.median(run["process_seconds"] for run in runs)
    return result | {
        "particles": first["particles"], "steps": first["steps"], "error": float(f"{first['error']:.4g}"),
        "core_seconds": float(f"{core:.4g}"), "process_seconds": float(f"{process:.4g}"),
        "particle_steps_per_core_second": round(first["work"] / core), "runs": len(runs)} | origin
