#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What a simulated second of a plate costs by each integrator and cell size, and where they cross.

    python3 benchmarks/heat/crossing.py [--cells 1 0.5 0.25] [--methods NAME ...] [--time S] [--input FILE] [--keep]

One rank, from the start of the source, outputs at the end alone. The error of a run is the largest difference of
a probe at the end from rkl2 with a tenth of its default tolerance. Euler steps all cost the same: fewer of them
are run. A crossing is where two lines through the measured points meet, in millimetres. --keep adds the results to
crossing.json, of which docs/heat.md has its tables."""

import argparse
import itertools
import json
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))
import kept  # noqa: E402

KEPT = ROOT / "benchmarks/heat/crossing.json"
PROGRAM = str(ROOT / "build/release/stirpoint")
KEYS = ("input", "cell_mm", "method", "time")  # of a result
PLAIN = str(ROOT / "input/heat_copper_plain.nml")
METHODS = {  # integrator, solver, tolerance [K]: about the same error, but of the first and the last
    "reference": ("rkl2", "auto", 0.2),
    "rkl2": ("rkl2", "auto", 15.0),
    "explicit": ("explicit", "auto", 2.0),
    "tr-bdf2, fftw": ("tr-bdf2", "fftw", 2.0),
    "tr-bdf2, petsc": ("tr-bdf2", "petsc", 2.0),
    "tr-bdf2, cg": ("tr-bdf2", "cg", 2.0),
    "backward-euler, fftw": ("backward-euler", "fftw", 0.5),
}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=PROGRAM)
    parser.add_argument("--input", default=PLAIN)
    parser.add_argument("--cells", type=float, nargs="*", default=[1.0, 0.5], metavar="MM")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS), metavar="NAME",
                        help=", ".join(METHODS))
    parser.add_argument("--time", type=float, default=2.0, help="simulated time [s]")
    parser.add_argument("--keep", action="store_true", help=f"add the results to those of {KEPT.name}")
    parser.add_argument("--picture", type=pathlib.Path, help="with --keep and no --cells: of what is kept")
    return parser.parse_args()


def measure(program, path, cell, method, time):
    """One run: processor seconds a simulated second, steps, probes at the end."""
    integrator, solver, tolerance = METHODS[method]
    end = time * (min(1.0, 0.08 * cell**2) if integrator == "explicit" else 1.0)
    sets = {"TIME.END": end, "GRID.CELL": cell * 1e-3, "OUTPUT.FRAME_INTERVAL": 0, "OUTPUT.HISTORY_INTERVAL": end,
            "HEAT.INTEGRATOR": integrator, "HEAT.SOLVER": solver, "HEAT.TOLERANCE": tolerance}
    with tempfile.TemporaryDirectory() as work:
        command = [program, path, "--quiet", "--output", work]
        command += [word for key, value in sets.items() for word in ("--set", f"{key}={value}")]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        summary = json.loads(next(pathlib.Path(work).glob("*_summary.json")).read_text())
        probes = next(pathlib.Path(work).glob("*_probes.csv")).read_text().split()[-1]
    return {"input": pathlib.Path(path).stem, "cell_mm": cell, "method": method, "time": time, "tolerance": tolerance,
            "simulated": end, "cells": summary["cells"], "cpu_per_second": summary["cpu_seconds"] / end,
            "steps": summary["steps"], "evaluations": summary["evaluations"], "solves": summary["linear_solves"],
            "iterations": summary["linear_iterations"], "probes": [float(v) for v in probes.split(",")[1:]]}


def error(results, row):
    """Largest difference of a probe from the reference of the same input, cell and time [K]; None without one."""
    same = ("input", "cell_mm", "simulated")
    for other in results:
        if other["method"] == "reference" and all(other[key] == row[key] for key in same):
            return max(abs(a - b) for a, b in zip(row["probes"], other["probes"]))
    return None


def crossings(results):
    """Pairs of methods whose costs change order between two cell sizes, and the size where [mm]."""
    cost = {(r["method"], r["cell_mm"]): r["cpu_per_second"] for r in results}
    found = []
    for one, two in itertools.combinations([m for m in METHODS if m != "reference"], 2):
        cells = sorted((c for m, c in cost if m == one and (two, c) in cost), reverse=True)
        for coarse, fine in zip(cells, cells[1:]):
            a, b = (math.log(cost[one, c] / cost[two, c]) for c in (coarse, fine))
            if a * b < 0:
                at = coarse * (fine / coarse) ** (a / (a - b))
                found.append({"cheaper_above": one if a < 0 else two, "cheaper_below": two if a < 0 else one,
                              "cell_mm": round(at, 3)})
    return found


def draw(results, path):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import matplotlib.ticker

    figure, axes = plt.subplots(figsize=(5.5, 4))
    for method in METHODS:
        points = sorted((r["cell_mm"], r["cpu_per_second"]) for r in results if r["method"] == method)
        if points and method != "reference":
            axes.loglog(*zip(*points), marker="o", label=method)
    axes.set(xlabel="cell [mm]", ylabel="processor seconds a simulated second")
    sizes = sorted({r["cell_mm"] for r in results})
    axes.set_xticks(sizes, [f"{size:g}" for size in sizes])
    axes.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    axes.invert_xaxis()
    axes.legend()
    axes.grid(True, which="both", alpha=0.3)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main():
    options = arguments()
    version = subprocess.run([options.program, "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    results = json.loads(KEPT.read_text())["runs"] if options.keep and KEPT.exists() else []
    for cell in options.cells:
        for method in options.methods:
            row = measure(options.program, options.input, cell, method, options.time) | {"version": version}
            results = [r for r in results if any(r[key] != row[key] for key in KEYS)] + [row]
            print(f"{cell:5} mm  {method:22} {row['cpu_per_second']:9.2f} s/s  {row['steps']} steps", file=sys.stderr)
            if options.keep:
                KEPT.write_text(json.dumps({"machine": kept.machine(), "runs": results}, indent=1) + "\n")
    results = [r for r in results if (r["input"], r["time"]) == (pathlib.Path(options.input).stem, options.time)]
    sizes = sorted({r["cell_mm"] for r in results}, reverse=True)
    print("| | " + " | ".join(f"{c} mm" for c in sizes) + " |\n|---|" + "---|" * len(sizes))
    for method in METHODS:
        cells = []
        for size in sizes:
            row = next((r for r in results if (r["cell_mm"], r["method"]) == (size, method)), None)
            off = error(results, row) if row else None
            cells.append("" if row is None else f"{row['cpu_per_second']:.2f}" + ("" if off is None else f" ({off:.3f} K)"))
        print(f"| {method} | " + " | ".join(cells) + " |")
    for c in crossings(results):
        print(f"below {c['cell_mm']} mm {c['cheaper_below']} is cheaper than {c['cheaper_above']}")
    if options.picture:
        draw(results, options.picture)


if __name__ == "__main__":
    main()
