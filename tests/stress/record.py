# SPDX-License-Identifier: MIT
"""Results of the stress tests: a line of JSON a case, runs of different times merged, and a page of them."""

import functools
import json
import math
import os
import pathlib
import platform
import shutil
import subprocess

import rows

HERE = pathlib.Path(__file__).resolve().parent
LINES, PAGE = HERE / "results.jsonl", HERE / "results.md"


@functools.cache
def machine():
    """Number of cores and kind of processor."""
    text = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    names = [line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")]
    return f"{os.cpu_count()} x {names[0] if names else platform.machine()}"


@functools.cache
def version():
    """Last commit that changed the program; the results themselves are part of later ones. Unknown without git."""
    if not shutil.which("git"):
        return "unknown"
    words = ["git", "-C", str(HERE), "log", "-1", "--format=%h", "--", "../../modules", "../../src", "../../CMakeLists.txt"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def note(path, row, label, ranks, seconds, checks, problem):
    """Append a case to a file of JSON lines."""
    line = {"row": row, "case": label, "ranks": ranks, "seconds": round(seconds, 1), "version": version(),
            "machine": machine(), "checks": [[c.what, figure(c.measured), c.passes, c.ok] for c in checks]}
    if problem:
        line["broken"] = problem
    with open(path, "a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


def figure(value):
    """Four digits; infinities and NaN as text, which JSON does not have."""
    return float(f"{value:.4g}") if math.isfinite(value) else str(float(value))


def merged(path):
    """The last run of every case that there still is, in the order of the rows; the file keeps no others."""
    last = {}
    for text in pathlib.Path(path).read_text(encoding="utf-8").splitlines():
        line = json.loads(text)
        last[line["row"], line["case"], line["ranks"]] = line
    order = {(name, label): k for k, (name, label) in
             enumerate((name, label) for name, row in rows.ALL.items() for label in row.cases(False))}
    lines = [line for line in last.values() if (line["row"], line["case"]) in order]
    lines.sort(key=lambda line: (order[line["row"], line["case"]], line["ranks"]))
    pathlib.Path(path).write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
    return lines


def failures(lines):
    """(line, what, measured, pass figure) of every check that failed and every run that broke."""
    for line in lines:
        if "broken" in line:
            yield line, "run", "broken: " + line["broken"].splitlines()[-1], ""
        yield from ((line, what, measured, passes) for what, measured, passes, ok in line["checks"] if not ok)


def lacking(lines):
    """Rows with cases that were not run, on one rank and on two."""
    have = {(line["row"], line["case"], line["ranks"]) for line in lines}
    for name, row in rows.ALL.items():
        for ranks in (1,) if row.alone else (1, 2):
            absent = [label for label in row.cases(False) if (name, label, ranks) not in have]
            if absent:
                yield f"{name} on {ranks} ({len(absent)} of {len(row.cases(False))} cases)"


def page(source, target):
    """Write the page of a file: rows, what was not run, failures case by case."""
    lines = merged(source)
    machines = ", ".join(dict.fromkeys(line["machine"] for line in lines))
    text = ["# Results of the stress tests", "", "Made by", "",
            "    python3 tests/stress/stress.py --ranks 1 2 --record", "",
            f"on {machines}. A run of some rows or cases renews these alone. Versions are commits of the program.", "",
            "| row | ranks | cases | checks | failed | versions | what it is |", "|---|---|---|---|---|---|---|"]
    for name, row in rows.ALL.items():
        for ranks in sorted({line["ranks"] for line in lines if line["row"] == name}):
            mine = [line for line in lines if line["row"] == name and line["ranks"] == ranks]
            versions = ", ".join(dict.fromkeys(line["version"] for line in mine))
            checks, failed = sum(len(line["checks"]) for line in mine), len(list(failures(mine)))
            what = row.text.replace("|", "\\|")
            text.append(f"| {name} | {ranks} | {len(mine)} of {len(row.cases(False))} | {checks} | {failed} | {versions} "
                        f"| {what} |")
    absent = list(lacking(lines))
    text += ["", f"Not run: {'; '.join(absent)}." if absent else "All cases were run on one rank and on two."]
    table = [f"| {line['row']} | {line['case']} | {line['ranks']} | {what} | {measured} | {passes} |"
              for line, what, measured, passes in failures(lines)]
    head = ["| row | case | ranks | what | measured | pass figure |", "|---|---|---|---|---|---|"]
    text += ["", "## Failed", "", *(head + table if table else ["None."])]
    pathlib.Path(target).write_text("\n".join(text) + "\n", encoding="utf-8")
