#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Stress tests of numerical stability: a table row | case | measured | pass figure | ok.

    python3 tests/stress/stress.py [ROW...] [--quick] [--list] [--ranks 1 2]
    python3 tests/stress/stress.py [ROW...] --ranks 1 2 --record

Without ROW all are run, those of 1e5 steps last. Every run starts the program on an input with --set. --record keeps
what was measured, case by case, in tests/stress/results.jsonl and renews tests/stress/results.md; what is not run stays.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import record  # noqa: E402
import rows  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("row", nargs="*", help="names (see --list); not given: all")
    parser.add_argument("--quick", action="store_true", help="the short versions that pytest runs")
    parser.add_argument("--list", action="store_true", help="rows and their cases")
    parser.add_argument("--case", metavar="TEXT", help="only cases whose label contains this")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1], help="numbers of MPI ranks to run each case on")
    parser.add_argument("--every", metavar="N", type=int, default=1, help="only every Nth case of rows of more than 40")
    parser.add_argument("--json", metavar="FILE", help="append one JSON object a case to this file")
    parser.add_argument("--record", action="store_true", help="the same to results.jsonl here, then renew results.md")
    parser.add_argument("--page", action="store_true", help="renew results.md and run nothing")
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
    cases = row.cases(options.quick)
    for k, (label, parameters) in enumerate(cases.items()):
        if len(cases) > 40 and k % options.every:
            continue
        if options.case and options.case not in label:
            continue
        for ranks in [1] if row.alone else options.ranks:
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
            for path in {options.json, record.LINES if options.record else None} - {None}:
                record.note(path, row.name, label, ranks, seconds, checks, problem)
    return failed


def main():
    options = arguments()
    unknown = [name for name in options.row if name not in rows.ALL]
    if unknown:
        sys.exit(f"stress.py: no row {', '.join(unknown)}; see --list")
    chosen = [rows.ALL[name] for name in options.row or rows.ALL]
    chosen = [row for row in chosen if not (options.quick and row.long)]
    if options.record and options.quick:
        sys.exit("stress.py: --record is for the full cases, not for --quick")
    if options.page:
        record.page(record.LINES, record.PAGE)
        return 0
    if options.list:
        show_list(chosen, options.quick)
        return 0
    print(f"{'row':14} {'case':34} {'what':26} {'measured':>11} {'pass figure':>18}")
    with tempfile.TemporaryDirectory() as scratch:
        failed = sum(run_row(row, options, options.keep or scratch) for row in chosen)
    print(f"{failed} failed" if failed else "all passed")
    if options.record:
        record.page(record.LINES, record.PAGE)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
