# SPDX-License-Identifier: MIT
"""The passes of the thesis (T. Fagan, Monash 2015): run, gone on with, measured and drawn.

usage: benchmarks/passes/run.sh [NAME[:KIND] ...] [--particles MM] [--mass-scaling X] [--elastic-scaling X] [--ranks N]
                                [--draw] [-o DIR]
       benchmarks/passes/run.sh --calibrate        the numbers of cavity 1 (calibrated.json)
       benchmarks/passes/run.sh --mass-scaling-study --particles 3       factors 1e3 to 1e7 on the first 20 s of cavity 1
       benchmarks/passes/run.sh --valley           cavity 1 over friction and film (valley.py)
       benchmarks/passes/run.sh --tables           results/tables.json from results/1mm and 2mm; then figures.py --pages

NAME is a plate and a flow law: cavity1_jc, cavity1_tp, cavity1_hot, ... plain_hot, aa5005_tp (default: all). KIND is 'printed', as the
thesis has it, 'calibrated', with the numbers that were fitted to cavity 1 (default: these two), or an experiment: cells
(halved), coarse (half as large again), steps (shorter ones), stick, half, soft, film, stuck_film, stuck_cool, stuck_fitted, stuck_cold,
held, stuck_held, valley, annealing, water, annealing_water. Each pass has a folder in DIR (default build/passes); what is done is
not repeated, what was stopped goes on from its checkpoint. Its numbers go into results/1mm/NAME_KIND.json, or what --particles is, with the machine.
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys

import calculate
import measure
import scenes
from calculate import HERE, ROOT, driver, kept

RESULTS = HERE / "results"
# Fitted to the thermocouples of cavity 1: key, start, bounds.
FITTED = ("TOOL.FRICTION=0.08,0.03,0.3", "SURFACE.PRESSURE_FACTOR=10,0,100")
GIVEN = {"TOOL.HEAT_SHARE": "0.836"}  # of tool steel (thesis chapter 4)


def main():
    parser = argparse.ArgumentParser(prog="benchmarks/passes/run.sh", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("passes", nargs="*", metavar="NAME[:KIND]")
    parser.add_argument("--particles", type=float, default=1.0, help="distance in copper [mm] (default 1)")
    parser.add_argument("--mass-scaling", type=float, default=1e7, help="(default 1e7; a tenth where metal sticks; the thesis has 1e5)")
    parser.add_argument("--elastic-scaling", type=float, default=1.0, help="(default 1)")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--draw", action="store_true", help="the page, pathlines and flow measures of each run")
    parser.add_argument("--calibrate", action="store_true")
    parser.add_argument("--mass-scaling-study", action="store_true", dest="study")
    parser.add_argument("--valley", action="store_true")
    parser.add_argument("--tables", action="store_true")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "build/passes")
    options = parser.parse_args()
    if options.calibrate:
        return calibrate(options)
    if options.study:
        import mass_scaling

        mass_scaling.write(options, RESULTS / "tables.json")
        return 0
    if options.valley:
        import valley

        valley.write(options)
        return 0
    if options.tables:
        import report

        report.write(RESULTS, folder_of(options))
        return 0
    for name, kind in chosen(parser, options.passes):
        one_pass(options, name, kind)
    return 0


def chosen(parser, words):
    found = []
    for word in words or scenes.SCENES:
        name, _, kind = word.partition(":")
        if name not in scenes.SCENES or (kind and kind not in scenes.KINDS):
            parser.error(f"no pass {word}: names are {', '.join(scenes.SCENES)}, kinds {', '.join(scenes.KINDS)}")
        found += [(name, k) for k in ([kind] if kind else ["printed", "calibrated"])]
    return found


def folder_of(options):
    """Of the runs with the same numbers."""
    return options.output / f"{options.particles:g}mm_{options.mass_scaling:g}"


def one_pass(options, name, kind):
    particles = options.particles * {"cells": 0.5, "coarse": 1.5}.get(kind, 1.0)
    mass = options.mass_scaling / (10 if kind == "steps" or "TOOL.SHEAR_FACTOR" in scenes.variant(kind) else 1)
    keys = calculate.keys_of(name, kind, particles, mass, options.elastic_scaling)
    folder = folder_of(options) / f"{name}_{kind}"
    results = calculate.calculate(folder, name, kind, keys, options.ranks, tell=lambda text: print(text, flush=True))
    made = [json.loads(line) for line in (folder / "machine.jsonl").read_text(encoding="utf-8").splitlines()]
    kept_in = RESULTS / f"{options.particles:g}mm"
    kept_in.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"pass": name, "kind": kind, "keys": keys, "solver": results.summary()["commit"][:7], "made": made, "measures": measure.measures(results)}, indent=1)
    (kept_in / f"{name}_{kind}.json").write_text(text + "\n", encoding="utf-8")
    if options.draw:
        for words in (["report"], ["tracks"], ["flow"]):
            subprocess.run([sys.executable, "-m", "stirpost", *words, str(results.directory)], check=True, env=driver.POSTPROC)


def calibrate(options):
    """Fit to the thermal model of cavity 1, which the thesis fitted to its thermocouples."""
    place = options.output / "calibration"
    place.mkdir(parents=True, exist_ok=True)
    name = "heat_copper_cavity1"
    subprocess.run([driver.EXECUTABLE, str(scenes.INPUT / f"{name}.nml"), "--quiet", "--overwrite", "--output", str(place / f"{name}.out")],
                   check=True, env=driver.ENVIRONMENT)
    probes = driver.Results(place / f"{name}.out", name).probes()
    rows = ["time[s],T1[K],T2[K],T3[K]"]
    for k in range(1, 31):
        at = [float(measure.np.interp(2.0 * k, probes["time[s]"], probes[f"T{i}[K]"])) for i in (1, 2, 3)]
        rows.append(f"{2 * k}," + ",".join(f"{value:.2f}" for value in at))
    (place / "record.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (place / "cavity1_jc.nml").write_text(scenes.text_of("cavity1_jc"), encoding="utf-8")
    sets = scenes.cells("cavity1_jc", options.particles) | GIVEN | {"TIME.MASS_SCALING": f"{options.mass_scaling:g}"}
    coarse = scenes.cells("cavity1_jc", 2.0 * options.particles)["GRID.CELL"]
    words = [sys.executable, "-m", "stirpost", "calibrate", "run", "cavity1_jc.nml", "record.csv", "--runs", "12", "--fine-runs", "3",
             "--coarse", f"GRID.CELL={coarse}", "-o", "fit", "--ranks", str(options.ranks)]
    for key in FITTED:
        words += ["--vary", key]
    for key, value in sets.items():
        words += ["--set", f"{key}={value}"]
    subprocess.run(words, check=True, cwd=place, env=driver.POSTPROC | {"STIRPOINT_EXECUTABLE": driver.EXECUTABLE})
    keep_fit(place / "fit")
    return 0


def keep_fit(place):
    found = json.loads((place / "calibration.json").read_text(encoding="utf-8"))
    keys = GIVEN | {name: f"{key['value']:.4g}" for name, key in found["keys"].items()}
    text = json.dumps({"keys": keys, "fit": found, "machine": kept.machine(), "version": kept.version()}, indent=1)
    scenes.CALIBRATED.write_text(text + "\n", encoding="utf-8")
    shutil.copy(place.parent / "record.csv", HERE / "cavity1_record.csv")


if __name__ == "__main__":
    sys.exit(main())
