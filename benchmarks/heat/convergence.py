#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Convergence of heat alone in space and time, as tables: errors against exact answers and their orders.

    python3 benchmarks/heat/convergence.py [--program PROGRAM] [--fine]

Space: centre of a slab with films on both faces (Bi = 1, Fo = 1), steps by a small tolerance. Time: the same
centre by fixed steps on cells of 1 mm, against the finest of them. Plates: peaks of the probes by the default
integrator, and the largest difference of a peak and of the whole record from the two finest cells extrapolated with
order 2; with --fine it fails where a peak is more than 1 K off at 1 mm or 0.4 K at 0.5 mm. Orders are between a line
and the next; of the records, by their mean squares."""

import argparse
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
SLAB = ROOT / "tests/system/inputs/heat_slab.nml"
PLATES = ("copper_plain", "copper_cavity1", "copper_cavity2", "copper_cavity3", "aa5005")
CENTRE = 353.38594     # Robin slab, Bi = 1, Fo = 1: sum 4 sin z/(2 z + sin 2 z) exp(-z^2), z tan z = 1
MOST = {1.0: 1.0, 0.5: 0.4}    # error of a peak by the cell [K], [mm]


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
    parser.add_argument("--fine", action="store_true", help="the plates at 0.5 mm too")
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
    cells = (2.0, 1.0) + ((0.5,) if options.fine else ())
    wrong = [plate for plate in PLATES if not plate_is_well(options.program, plate, cells)]
    if options.fine and wrong:
        print("not as documented: " + ", ".join(wrong), file=sys.stderr)
    return 1 if options.fine and wrong else 0


def plate_is_well(program, plate, cells):
    """Table of one plate; whether its errors are small enough."""
    sets = {"HEAT.TOLERANCE": 1.0, "OUTPUT.HISTORY_INTERVAL": 0.2}
    found = [np.array(rows(program, ROOT / f"input/heat_{plate}.nml", sets | {"GRID.CELL": c * 1e-3})) for c in cells]
    (h, finest), (coarse, before) = (cells[-1], found[-1]), (cells[-2], found[-2])
    best = finest + (finest - before) * h**2 / (coarse**2 - h**2)
    orders = [math.log2(np.linalg.norm(a - b) / np.linalg.norm(b - c)) for a, b, c in zip(found, found[1:], found[2:])]
    print(f"| {plate}, cell [mm] | T1 | T2 | T3 | error of a peak [K] | at any time | order |\n" + "|---" * 7 + "|")
    well = True
    for i, (cell, record) in enumerate(zip(cells, found)):
        peak = np.abs(record.max(axis=0) - best.max(axis=0)).max()
        well = well and peak <= MOST.get(cell, np.inf)
        order = f"{orders[i - 2]:.2f}" if i >= 2 else ""
        print(f"| {cell:g} | " + " | ".join(f"{p:.2f}" for p in record.max(axis=0))
              + f" | {peak:.2f} | {np.abs(record - best).max():.2f} | {order} |")
    print("| extrapolated | " + " | ".join(f"{p:.2f}" for p in best.max(axis=0)) + " | | | |\n")
    return well


if __name__ == "__main__":
    sys.exit(main())
