#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Convergence of heat alone in space and time, as tables: errors against exact answers and their orders.

    python3 benchmarks/heat/convergence.py [--program PROGRAM] [--fine]

Space: centre of a slab with films on both faces (Bi = 1, Fo = 1), steps by a small tolerance. Time: the same
centre by fixed steps on cells of 1 mm, against the finest of them. Plate: peaks of the probes of the plain copper
plate by the default integrator. Orders are between a line and the next."""

import argparse
import math
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SLAB = ROOT / "tests/system/inputs/heat_slab.nml"
PLATE = ROOT / "input/heat_copper_plain.nml"
CENTRE = 353.38594     # Robin slab, Bi = 1, Fo = 1: sum 4 sin z/(2 z + sin 2 z) exp(-z^2), z tan z = 1
PEAKS = (749.4, 766.9, 803.9)     # converged solution, h = 700 W/(m2 K)


def rows(program, path, sets):
    """Rows of the probes of a run, without the time."""
    with tempfile.TemporaryDirectory() as work:
        command = [program, str(path), "--quiet", "--output", work, "--set", "OUTPUT.FRAME_INTERVAL=0"]
        command += [word for key, value in sets.items() for word in ("--set", f"{key}={value}")]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        text = next(pathlib.Path(work).glob("*_probes.csv")).read_text().splitlines()
    lines = [line for line in text if line and not line.startswith(("#", "time"))]
    return [[float(v) for v in line.split(",")[1:]] for line in lines]


def table(title, sizes, errors):
    print(f"| {title} | error [K] | order |\n|---|---|---|")
    for i, (size, error) in enumerate(zip(sizes, errors)):
        order = math.log(errors[i - 1] / error) / math.log(sizes[i - 1] / size) if i else None
        print(f"| {size:g} | {error:.6f} | " + ("" if order is None else f"{order:.2f}") + " |")
    print()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(ROOT / "build/release/stirpoint"))
    parser.add_argument("--fine", action="store_true", help="the plate at 0.5 mm too")
    options = parser.parse_args()
    slab = {"TIME.END": 2.56, "OUTPUT.HISTORY_INTERVAL": 2.56}
    cells = (4.0, 2.0, 1.0, 0.5)
    found = [rows(options.program, SLAB, slab | {"GRID.CELL": c * 1e-3, "HEAT.TOLERANCE": 2e-5})[-1][0] for c in cells]
    table("slab, cell [mm]", cells, [abs(v - CENTRE) for v in found])
    for method in ("rkl2", "tr-bdf2", "backward-euler"):
        counts = (8, 16, 32, 64)
        sets = slab | {"HEAT.INTEGRATOR": method, "HEAT.TOLERANCE": 1e-6, "HEAT.SOLVER": "cg"}
        finest = rows(options.program, SLAB, sets | {"HEAT.INTEGRATOR": "tr-bdf2", "HEAT.STEP": 2.56 / 2048})[-1][0]
        found = [rows(options.program, SLAB, sets | {"HEAT.STEP": 2.56 / n})[-1][0] for n in counts]
        table(f"{method}, step [s]", [2.56 / n for n in counts], [abs(v - finest) for v in found])
    cells = (4.0, 2.0, 1.0) + ((0.5,) if options.fine else ())
    found = [[max(column) for column in zip(*rows(options.program, PLATE, {"GRID.CELL": c * 1e-3, "HEAT.TOLERANCE": 0.5}))]
             for c in cells]
    print("| plate, cell [mm] | T1 | T2 | T3 | largest error [K] |\n|---|---|---|---|---|")
    for cell, peaks in zip(cells, found):
        worst = max(abs(a - b) for a, b in zip(peaks, PEAKS))
        print(f"| {cell:g} | " + " | ".join(f"{p:.2f}" for p in peaks) + f" | {worst:.2f} |")


if __name__ == "__main__":
    main()
