#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Work and precision: error against core-seconds of option sets, as JSON lines, pictures and tables.

    benchmarks/work_precision/run.sh                 everything anew: points, pictures, results.md
    benchmarks/work_precision/run.sh --smallest      trial of it: coarsest resolutions, once, into build/work_precision
    benchmarks/work_precision/work_precision.py [CASE...] [options]

Without CASE all are measured, one run after the other on one core. A line holds the medians of a point;
core_seconds is the step loop with its output, process_seconds the whole process. Points of option sets that no case
has any more are left out of pictures and tables.
"""

import argparse
import json
import os
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import cases as case_list  # noqa: E402
import measuring  # noqa: E402
import pictures  # noqa: E402
import table  # noqa: E402

RESULTS = HERE / "results.jsonl"
PAGE = HERE / "results.md"
DRAWN = measuring.ROOT / "docs/pictures"
TRIAL = measuring.ROOT / "build" / "work_precision"  # results, page and pictures of --smallest
TABLES = "<!-- tables of benchmarks/work_precision -->", "<!-- end of the tables -->"
PICTURES = "<!-- pictures of benchmarks/work_precision -->", "<!-- end of the pictures -->"


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="*", help="names (see --list); not given: all")
    parser.add_argument("--list", action="store_true", help="cases and their option sets")
    parser.add_argument("--repeats", type=int, default=5, help="runs of a point (fewer after "
                        f"{measuring.ENOUGH:.0f} core-seconds)")
    parser.add_argument("--quick", action="store_true", help="smoke test: few points, seconds")
    parser.add_argument("--smallest", action="store_true", help="each case's coarsest resolution alone, one run a point")
    parser.add_argument("--estimate", action="store_true", help="print how long all takes by the times in the file")
    parser.add_argument("--resolution", type=int, nargs="+", metavar="N", help="only these of each case's own")
    parser.add_argument("--only", metavar="TEXT", help="only option sets whose label holds this")
    parser.add_argument("--json", metavar="FILE", type=pathlib.Path,
                        help=f"add lines to this file; with --table, --pictures: read it ({RESULTS.name})")
    parser.add_argument("--table", action="store_true", help="print the tables of the file and measure nothing")
    parser.add_argument("--pictures", metavar="DIR", type=pathlib.Path,
                        help="draw the pictures of the file and measure nothing")
    parser.add_argument("--page", action="store_true", help="pictures and tables of docs anew from the file")
    parser.add_argument("--all", action="store_true", help=f"measure all into {RESULTS.name}, then --page")
    parser.add_argument("--executable", help="the program; not given: $STIRPOINT_EXECUTABLE or build/release")
    return parser.parse_args()


def read(path):
    """Points of a file whose option set there still is; of a point that is there twice, the later."""
    lines = path.read_text(encoding="utf-8").splitlines()
    points = [json.loads(line) for line in lines if line.strip()]
    there_are = {(case.name, label) for case in case_list.CASES.values() for label in case.option_sets}
    return list({(p["problem"], p["option_set"], p["resolution"]): p for p in points
                 if (p["problem"], p["option_set"]) in there_are}.values())


def chosen(options):
    """The cases to measure; those whose problem tests/verification does not have are named and left out."""
    wanted = case_list.quick() if options.quick else case_list.CASES
    unknown = [name for name in options.case if name not in wanted]
    if unknown:
        sys.exit(f"work_precision.py: no case {', '.join(unknown)}; see --list")
    result = [wanted[name] for name in options.case or wanted]
    for case in result:
        if case.problem not in measuring.problems.ALL:
            print(f"work_precision.py: no problem {case.problem} in tests/verification; left out", file=sys.stderr)
    return [case for case in result if case.problem in measuring.problems.ALL]


def points_wanted(options):
    """(case, option set, resolution) of every point to measure."""
    for case in chosen(options):
        sizes = [n for n in case.resolutions if not options.resolution or n in options.resolution]
        for label in case.option_sets:
            if not options.only or options.only in label:
                yield from ((case, label, n) for n in (sizes[:1] if options.smallest else sizes))


def measure(options, path):
    """Print points as they come and add them to a file."""
    repeats = 1 if options.quick or options.smallest else options.repeats
    for case, label, n in points_wanted(options):
        line = json.dumps(measuring.point(case, label, n, repeats))
        print(line, flush=True)
        if path:
            with open(path, "a", encoding="utf-8") as file:
                file.write(line + "\n")


def estimate(options, points):
    """Print the processor time of all points by case, as the file has them, and how many it has not."""
    known = {(p["problem"], p["option_set"], p["resolution"]): p.get("process_seconds", 0.0) for p in points}
    total, absent = {}, {}
    for case, label, n in points_wanted(options):
        once = known.get((case.name, label, n))
        total[case.name] = total.get(case.name, 0.0) + measuring.all_runs(once or 0.0, options.repeats)
        absent[case.name] = absent.get(case.name, 0) + (once is None)
    total["all"], absent["all"] = sum(total.values()), sum(absent.values())
    for name in total:
        lacking = f"  without {absent[name]} points" if absent.get(name) else ""
        print(f"{name:16} {total[name]:7.0f} s{lacking}")


def between(text, marks, new):
    """`text` with `new` between two marks."""
    head, rest = text.split(marks[0])
    return f"{head}{marks[0]}\n{new}{marks[1]}{rest.split(marks[1])[1]}"


def renew_page(points, page, directory):
    """Pictures in `directory`, and in `page` links to them and new tables between the marks of PAGE."""
    drawn = pictures.all_pictures(case_list.CASES, points, directory)
    here = os.path.relpath(directory, page.parent)
    origins = dict.fromkeys((p["version"], p["machine"]) for p in points)
    measured = "; ".join(f"{version} on {machine}" for version, machine in origins)
    text = between(PAGE.read_text(encoding="utf-8"), PICTURES,
                   "".join(f"![{name}]({here}/precision_{name}.png)\n" for name in drawn))
    text = between(text, TABLES, f"Measured with {measured}, one core.\n\n{table.markdown(points)}")
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(text, encoding="utf-8")


def main():
    options = arguments()
    if options.executable:
        measuring.driver.EXECUTABLE = str(pathlib.Path(options.executable).resolve())
    if options.list:
        for case in case_list.CASES.values():
            print(f"{case.name} ({case.problem}), n = {', '.join(map(str, case.resolutions))}")
            print("    " + "; ".join(case.option_sets))
        return
    stored = options.json or (TRIAL / RESULTS.name if options.smallest else RESULTS)
    page = TRIAL / PAGE.name if options.smallest else PAGE
    if options.estimate:
        estimate(options, read(stored))
        return
    if options.table:
        print(table.markdown(read(stored)), end="")
    if options.pictures:
        pictures.all_pictures(case_list.CASES, read(stored), options.pictures)
    if not (options.table or options.pictures or options.page):
        measuring.version()  # kept from now on: the results are part of the tree that it describes
        stored.parent.mkdir(parents=True, exist_ok=True)
        if options.all and not options.case:
            stored.unlink(missing_ok=True)
        measure(options, stored if options.all else options.json)
    if options.page or options.all:
        renew_page(read(stored), page, TRIAL / "pictures" if options.smallest else DRAWN)


if __name__ == "__main__":
    main()
