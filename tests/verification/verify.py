#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Run verification problems: a table of errors against exact answers, orders and cost.

    python3 tests/verification/verify.py [PROBLEM...] [options]

Without PROBLEM all are run. Every run starts the program on an input of tests/verification/inputs with
--set for the resolution and the parameters of the problem.
"""

import argparse
import json
import math
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import problems  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problem", nargs="*", help="names (see --list); not given: all")
    parser.add_argument("--list", action="store_true", help="problems, their parameters and pass figures")
    parser.add_argument("--fine", action="store_true", help="also the finest resolutions")
    parser.add_argument("--resolution", type=float, nargs="+", metavar="N",
                        help="these instead of the problem's own")
    parser.add_argument("--with", dest="parameters", action="append", default=[], metavar="NAME=VALUE",
                        help="a parameter of the problem, as angle=30")
    parser.add_argument("--set", dest="sets", action="append", default=[], metavar="GROUP.KEY=VALUE",
                        help="a key of every input, as METHOD.SHAPE=bspline")
    parser.add_argument("--shift", action="store_true",
                        help="on a grid moved by (0.13, 0.29, 0.41) cells, where neither walls on its sides nor periods forbid")
    parser.add_argument("--edges", type=lambda text: [float(edge) for edge in text.split(",")], metavar="X,Y,Z",
                        help="edges of the cells over those of the problem's cubes, as 1,1,0.25")
    parser.add_argument("--graded", type=grading, metavar="AXIS,RATIO,BEGIN,END",
                        help="cells graded along an axis: RATIO of the problem's from the part BEGIN of the grid's length to "
                             "END, growing from there to the problem's, as z,0.25,0,0.1")
    parser.add_argument("--ranks", type=int, help="MPI ranks; not given: no mpirun")
    parser.add_argument("--json", metavar="FILE", help="append one JSON object a run to this file")
    parser.add_argument("--keep", metavar="DIR", help="keep the runs there")
    return parser.parse_args()


def grading(text):
    """What --graded gives."""
    axis, *numbers = text.split(",")
    ratio, begin, end = (float(number) for number in numbers)
    if axis not in ("x", "y", "z"):
        raise ValueError(text)
    return axis, ratio, begin, end


def show_list():
    for problem in problems.ALL.values():
        extra = f", order >= {problem.least_order}" if problem.least_order else ""
        extra += "".join(f", bound {most:.0%} at {n}" for n, most in problem.bounds.items())
        print(f"{problem.name:20} {problem.section:5} {problem.norm}; pass <= {problem.passes:.2%}{extra}")
        print(f"{'':26} n = {', '.join(map(str, problem.resolutions))} | {', '.join(map(str, problem.fine))}"
              f" {problem.cells}")
        if problem.parameters:
            print(f"{'':26} parameters: {', '.join(f'{k}={v}' for k, v in problem.parameters.items())}")


def pairs(words):
    """NAME=VALUE words as a dictionary."""
    for word in words:
        if "=" not in word:
            sys.exit(f"verify.py: {word}: expected NAME=VALUE")
    return dict(word.split("=", 1) for word in words)


def with_parameters(problem, given):
    """The problem's parameters with those given, in the type of their default."""
    mine = dict(problem.parameters)
    for name, value in given.items():
        if name not in mine:
            sys.exit(f"verify.py: {problem.name} has no parameter {name}; it has {', '.join(mine) or 'none'}")
        mine[name] = type(mine[name])(value)
    return mine


def resolutions_of(problem, options):
    if options.resolution:
        return [int(n) if n == int(n) else n for n in options.resolution]
    return list(problem.resolutions) + (list(problem.fine) if options.fine else [])


def order(rows):
    """Observed order between the last two rows (n, error)."""
    if len(rows) < 2 or not 0.0 < min(rows[-2][1], rows[-1][1]) < math.inf:
        return math.nan
    return (math.log(rows[-2][1]) - math.log(rows[-1][1])) / math.log(rows[-1][0] / rows[-2][0])


def verdict(problem, rows, is_last, at):
    """'pass', 'FAIL', 'bound' for what the documents say why it is not reached, or '' for a resolution that is not judged."""
    if not is_last:
        return ""
    n = rows[-1][0]
    if problem.passes < at <= problem.limit(n):
        return f"bound {problem.limit(n):.0%}, asked {problem.passes:.0%}"
    good = at <= problem.passes
    if problem.least_order is not None and len(rows) > 1:
        good = good and order(rows) >= problem.least_order
    return "pass" if good else "FAIL"


def show(row):
    number = "" if math.isnan(row["order"]) else f"{row['order']:5.2f}"
    error = "   broken" if math.isnan(row["error"]) else f"{row['error']:9.3%}"
    print(f"{row['problem']:20} {row['resolution']:>10} {error:>10} {number:>6} "
          f"{row['core_seconds']:12.1f}  {row['pass']}", flush=True)
    text = ", ".join(f"{k} {v:.5g}" if isinstance(v, float) else f"{k} {v}" for k, v in row["figures"].items())
    if text:
        print(f"{'':20} {text}", flush=True)


def run_problem(problem, options, directory):
    """Run and print all resolutions of a problem; its rows."""
    parameters = with_parameters(problem, pairs(options.parameters))
    wanted = resolutions_of(problem, options)
    done, out = [], []
    for n in wanted:
        try:
            error, figures, seconds = problem.solve(
                n, parameters, directory, pairs(options.sets), options.ranks, shift=options.shift, edges=options.edges,
                grading=options.graded)
        except AssertionError as problem_of_run:
            error, figures, seconds = math.nan, {"message": str(problem_of_run).strip()[-300:]}, 0.0
        done.append((n, error))
        out.append({"problem": problem.name, "resolution": n, "error": error, "order": order(done),
                    "core_seconds": seconds, "pass": verdict(problem, done, n == wanted[-1], error),
                    "figures": figures, "parameters": parameters, "sets": pairs(options.sets),
                    "ranks": options.ranks or 1, "shifted": options.shift, "edges": options.edges,
                    "graded": options.graded})
        show(out[-1])
        if options.json:
            with open(options.json, "a", encoding="utf-8") as file:
                file.write(json.dumps(out[-1]) + "\n")
    return out


def main():
    options = arguments()
    if options.list:
        show_list()
        return 0
    unknown = [name for name in options.problem if name not in problems.ALL]
    if unknown:
        sys.exit(f"verify.py: no problem {', '.join(unknown)}; see --list")
    chosen = [problems.ALL[name] for name in options.problem or problems.ALL]
    print(f"{'problem':20} {'resolution':>10} {'error':>10} {'order':>6} {'core-seconds':>12}  pass")
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        if options.keep:
            pathlib.Path(options.keep).mkdir(parents=True, exist_ok=True)
        for problem in chosen:
            rows += run_problem(problem, options, options.keep or scratch)
    return 1 if any(row["pass"] == "FAIL" for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
