#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Stress tests of numerical stability: a table row | case | measured | pass figure | ok.

    python3 tests/stress/stress.py [ROW...] [--quick] [--list] [--ranks 1 2]
    python3 tests/stress/stress.py --ranks 1 2 --json results.jsonl --results tests/stress/results.md

Without ROW all are run, those of 1e5 steps last. Every run starts the program on an input with --set.
"""

import argparse
import json
import math
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import rows  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("row", nargs="*", help="names (see --list); not given: all")
    parser.add_argument("--quick", action="store_true", help="the short versions that pytest runs")
    parser.add_argument("--list", action="store_true", help="rows and their cases")
    parser.add_argument("--case", metavar="TEXT", help="only cases whose label contains this")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1], help="numbers of MPI ranks to run each case on")
    parser.add_argument("--json", metavar="FILE", help="append one JSON object a check to this file")
    parser.add_argument("--results", metavar="FILE", help="write a page of what the --json file holds")
    parser.add_argument("--no-run", action="store_true", help="write that page alone")
    parser.add_argument("--keep", metavar="DIR", help="keep the runs there")
    return parser.parse_args()


def show_list(chosen, quick):
    for row in chosen:
        labels = list(row.cases(quick))
        print(f"{row.name:14} {row.text}")
        print(f"{'':14} {len(labels)} cases: {', '.join(labels[:8])}{', ...' if len(labels) > 8 else ''}")


def measure(row, label, parameters, ranks, folder):
    """Checks of one case; a run that does not end as it should is a failed one."""
    place = pathlib.Path(folder) / f"{row.name}_{label.replace(' ', '_').replace('/', '-')}_{ranks}"
    place.mkdir(parents=True)
    try:
        return row.measure(place, ranks, **parameters), ""
    except (AssertionError, IndexError, OSError, ValueError, subprocess.TimeoutExpired) as problem:
        return [], str(problem).strip()[-400:]


def show(row, label, what, measured, passes, ok):
    print(f"{row:14} {label:34} {what:26} {measured:>11} {passes:>18}  {'ok' if ok else 'FAIL'}", flush=True)


def run_row(row, options, folder):
    """Run and print all cases of a row; the failures."""
    failed = 0
    for label, parameters in row.cases(options.quick).items():
        if options.case and options.case not in label:
            continue
        for ranks in options.ranks:
            begun = time.monotonic()
            checks, problem = measure(row, label, parameters, ranks, folder)
            seconds = time.monotonic() - begun
            named = label if ranks == 1 else f"{label} x{ranks}"
            if problem:
                show(row.name, named, "run", "broken", "", False)
                print(f"{'':14} {problem}", flush=True)
            for check in checks:
                show(row.name, named, check.what, f"{check.measured:.4g}", check.passes, check.ok)
            failed += bool(problem) + sum(not check.ok for check in checks)
            note(options.json, row.name, label, ranks, seconds, checks, problem)
    return failed


def note(path, row, label, ranks, seconds, checks, problem):
    """Append the checks of a case to a file of JSON lines."""
    if not path:
        return
    common = {"row": row, "case": label, "ranks": ranks, "seconds": round(seconds, 2)}
    lines = [common | {"what": c.what, "measured": float(c.measured) if math.isfinite(c.measured) else str(c.measured),
                       "pass": c.passes, "ok": c.ok} for c in checks]
    if problem:
        lines.append(common | {"what": "run", "message": problem, "ok": False})
    with open(path, "a", encoding="utf-8") as file:
        file.writelines(json.dumps(line) + "\n" for line in lines)


def main():
    options = arguments()
    unknown = [name for name in options.row if name not in rows.ALL]
    if unknown:
        sys.exit(f"stress.py: no row {', '.join(unknown)}; see --list")
    chosen = [rows.ALL[name] for name in options.row or rows.ALL]
    chosen = [row for row in chosen if not (options.quick and row.long)]
    if options.results and not options.json:
        sys.exit("stress.py: --results needs --json")
    if options.no_run:
        write_page(options.json, options.results)
        return 0
    if options.list:
        show_list(chosen, options.quick)
        return 0
    print(f"{'row':14} {'case':34} {'what':26} {'measured':>11} {'pass figure':>18}")
    with tempfile.TemporaryDirectory() as scratch:
        failed = sum(run_row(row, options, options.keep or scratch) for row in chosen)
    print(f"{failed} failed" if failed else "all passed")
    if options.results:
        write_page(options.json, options.results)
    return 1 if failed else 0


def machine():
    """Kind of the machine, as the page names it."""
    text = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    names = [line.split(":", 1)[1].strip() for line in text.splitlines() if line.startswith("model name")]
    return f"{os.cpu_count()} x {names[0] if names else platform.machine()}"


def write_page(source, target):
    """The last run of every case in a file of JSON lines, as a page; failures case by case, the rest by row."""
    runs = {}
    for text in pathlib.Path(source).read_text(encoding="utf-8").splitlines():
        line = json.loads(text)
        run = runs.setdefault((line["row"], line["case"], line["ranks"]), {})
        if line["what"] in run or "run" in run:  # a later run of the case
            run.clear()
        run[line["what"]] = line
    last = [line for run in runs.values() for line in run.values()]
    lines = ["# Results of the stress tests", "", "Made by", "",
             "    python3 tests/stress/stress.py --ranks 1 2 --json results.jsonl --results tests/stress/results.md", "",
             f"on {machine()}.", "", "| row | ranks | cases | checks | failed | what it is |", "|---|---|---|---|---|---|"]
    for name, row in rows.ALL.items():
        for ranks in sorted({line["ranks"] for line in last if line["row"] == name}):
            mine = [line for line in last if line["row"] == name and line["ranks"] == ranks]
            lines.append(f"| {name} | {ranks} | {len({line['case'] for line in mine})} of {len(row.cases(False))} | {len(mine)} | "
                         f"{sum(not line['ok'] for line in mine)} | {row.text} |")
    absent = [name for name in rows.ALL if not any(line["row"] == name for line in last)]
    lines += ["", f"Not run: {', '.join(absent)}." if absent else "All rows were run.", "", "## Failed", "",
              "| row | case | ranks | what | measured | pass figure |", "|---|---|---|---|---|---|"]
    lines += [f"| {v['row']} | {v['case']} | {v['ranks']} | {v['what']} | "
              f"{v.get('measured', 'broken')} | {v.get('pass', '')} |" for v in last if not v["ok"]]
    pathlib.Path(target).write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
