#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Convergence of heat alone in space and time, as tables: errors against exact answers and their orders.

    python3 benchmarks/heat/convergence.py [--program PROGRAM] [--fine [--keep]]

Space: centre of a slab with films on both faces (Bi = 1, Fo = 1), steps by a small tolerance. Time: the same
centre by fixed steps on cells of 1 mm, against the finest of them. Plates: peaks of the probes by the default
integrator, and the largest difference of a peak and of the whole record from the two finest cells extrapolated with
order 2; with --fine it fails where a peak is more than 1 K off at 1 mm or 0.4 K at 0.5 mm. Orders are between a line
and the next; of the records, by their mean squares. --keep puts the errors into convergence.json, of which docs/heat.md
has its tables."""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))
import kept  # noqa: E402

PROGRAM = str(ROOT / "build/release/stirpoint")
KEPT = ROOT / "benchmarks/heat/convergence.json"
SLAB = ROOT / "tests/system/inputs/heat_slab.nml"
PLATES = ("copper_plain", "copper_cavity1", "copper_cavity2", "copper_cavity3", "aa5005")
CELLS = (4.0, 2.0, 1.0, 0.5)    # of the slab [mm]
COUNTS = {"rkl2": (8, 16, 32, 64), "tr-bdf2": (8, 16, 32, 64), "backward-euler": (8, 16, 32, 64)}    # steps in DURATION
DURATION = 2.56    # of the slab [s]
CENTRE = 353.38594     # Robin slab, Bi = 1, Fo = 1: sum 4 sin z/(2 z + sin 2 z) exp(-z^2), z tan z = 1
MOST = {1.0: 1.0, 0.5: 0.4}    # error of a peak by the cell [K], [mm]


def solve(program, path, sets):
    """Rows of the probes of a run, without the time, and its summary."""
    with tempfile.TemporaryDirectory() as work:
        command = [program, str(path), "--quiet", "--output", work, "--set", "OUTPUT.FRAME_INTERVAL=0"]
        command += [word for key, value in sets.items() for word in ("--set", f"{key}={value}")]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        text = next(pathlib.Path(work).glob("*_probes.csv")).read_text().splitlines()
        summary = json.loads(next(pathlib.Path(work).glob("*_summary.json")).read_text())
    lines = [line for line in text if line and not line.startswith(("#", "time"))]
    return np.array([[float(v) for v in line.split(",")[1:]] for line in lines]), summary


def slab(program):
    """Errors [K] at the centre by 'cell, mm' and by 'integrator, s'."""
    sets = {"TIME.END": DURATION, "OUTPUT.HISTORY_INTERVAL": DURATION}

    def centre(more):
        return solve(program, SLAB, sets | more)[0][-1][0]

    found = {f"cell, {c:g}": abs(centre({"GRID.CELL": c * 1e-3, "HEAT.TOLERANCE": 2e-5}) - CENTRE) for c in CELLS}
    fixed = {"HEAT.TOLERANCE": 1e-6, "HEAT.SOLVER": "cg"}
    finest = centre(fixed | {"HEAT.INTEGRATOR": "tr-bdf2", "HEAT.STEP": DURATION / 2048})
    for method, counts in COUNTS.items():
        found |= {f"{method}, {DURATION / n:g}": abs(centre(fixed | {"HEAT.INTEGRATOR": method, "HEAT.STEP": DURATION / n})
                                                     - finest) for n in counts}
    return found


def record(program, plate, cell):
    """Probes of a plate, and the summary of the run."""
    sets = {"HEAT.TOLERANCE": 1.0, "OUTPUT.HISTORY_INTERVAL": 0.2, "GRID.CELL": cell * 1e-3}
    return solve(program, ROOT / f"input/heat_{plate}.nml", sets)


def of_plate(program, plate, cells):
    """Peaks, their errors and those at any time [K], steps, evaluations and processor time by cell; what they tend to."""
    runs = [record(program, plate, cell) for cell in cells]
    found, values = [rows for rows, _ in runs], {}
    best = found[-1] + (found[-1] - found[-2]) * cells[-1]**2 / (cells[-2]**2 - cells[-1]**2)
    for cell, (rows, summary) in zip(cells, runs):
        values |= peaks(f"{plate}, {cell:g}", rows)
        values |= {f"{plate}, {cell:g}, peak": float(np.abs(rows.max(axis=0) - best.max(axis=0)).max()),
                   f"{plate}, {cell:g}, any": float(np.abs(rows - best).max())}
        values |= {f"{plate}, {cell:g}, {key}": summary[key] for key in ("cells", "steps", "evaluations", "cpu_seconds")}
    values |= peaks(f"{plate}, extrapolated", best)
    for a, b, c in zip(found, found[1:], found[2:]):
        values[f"{plate}, order"] = math.log2(np.linalg.norm(a - b) / np.linalg.norm(b - c))
    return values


def peaks(name, rows):
    return {f"{name}, T{k + 1}": float(peak) for k, peak in enumerate(rows.max(axis=0))}


def show_slab(title, sizes, errors):
    print(f"| {title} | error [K] | order |\n|---|---|---|")
    for i, (size, error) in enumerate(zip(sizes, errors)):
        order = math.log(errors[i - 1] / error) / math.log(sizes[i - 1] / size) if i else None
        print(f"| {size:g} | {error:.6f} | " + ("" if order is None else f"{order:.2f}") + " |")
    print()


def show_plate(plate, cells, values):
    print(f"| {plate}, cell [mm] | T1 | T2 | T3 | error of a peak [K] | at any time |\n" + "|---" * 6 + "|")
    for cell in (*(f"{c:g}" for c in cells), "extrapolated"):
        row = [values.get(f"{plate}, {cell}, {key}") for key in ("T1", "T2", "T3", "peak", "any")]
        print(f"| {cell} | " + " | ".join("" if v is None else f"{v:.2f}" for v in row) + " |")
    print(f"order {values[f'{plate}, order']:.2f}\n" if f"{plate}, order" in values else "", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=PROGRAM)
    parser.add_argument("--fine", action="store_true", help="the plates at 0.5 mm too")
    parser.add_argument("--keep", action="store_true", help=f"with --fine: into {KEPT.name}")
    options = parser.parse_args()
    if options.keep and not options.fine:
        parser.error("--keep needs --fine")
    values = slab(options.program)
    show_slab("slab, cell [mm]", CELLS, [values[f"cell, {c:g}"] for c in CELLS])
    for method, counts in COUNTS.items():
        steps = [DURATION / n for n in counts]
        show_slab(f"{method}, step [s]", steps, [values[f"{method}, {s:g}"] for s in steps])
    cells = (2.0, 1.0) + ((0.5,) if options.fine else ())
    for plate in PLATES:
        found = of_plate(options.program, plate, cells)
        show_plate(plate, cells, found)
        values |= found
    wrong = [plate for plate in PLATES if any(values[f"{plate}, {c:g}, peak"] > MOST.get(c, math.inf) for c in cells)]
    if options.keep:
        version = subprocess.run([options.program, "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
        KEPT.write_text(json.dumps({"command": "benchmarks/heat/convergence.py --fine --keep", "version": version,
                                    "machine": kept.machine(), "values": {k: float(f"{v:.8g}") for k, v in values.items()}},
                                   indent=1) + "\n", encoding="utf-8")
    if options.fine and wrong:
        print("more than asked: " + ", ".join(wrong), file=sys.stderr)
    return 1 if options.fine and wrong else 0


if __name__ == "__main__":
    sys.exit(main())
