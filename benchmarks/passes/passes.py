# SPDX-License-Identifier: MIT
"""The passes of the thesis (T. Fagan, Monash 2015): run, gone on with, measured and drawn.

usage: benchmarks/passes/run.sh [NAME[:KIND] ...] [--particles MM] [--mass-scaling X] [--ranks N] [--draw] [-o DIR]
       benchmarks/passes/run.sh --valley           cavity 1 over friction and film (valley.py)
       benchmarks/passes/run.sh --tables           results/tables.json from results/1mm and 2mm; then figures.py --pages

NAME is a plate and a flow law: cavity1_hot, cavity1_jc, cavity1_tp, ... plain_hot, aa5005_tp (default: all). KIND is 'floor', the
pass with the friction and film of the floor of the valley (default), or an experiment of scenes.EXPERIMENTS: free, cooled, fast, adaptive,
deep06, soft50, soft20, annealing, annealing_water. Each pass has a folder in DIR (default build/passes); what is done is not
repeated, what was stopped goes on from its checkpoint. Its numbers go into results/1mm/NAME_KIND.json, or what --particles is, with the machine.
"""

import argparse
import json
import pathlib
import subprocess
import sys

import calculate
import measure
import scenes
from calculate import HERE, ROOT, driver

RESULTS = HERE / "results"


def main():
    parser = argparse.ArgumentParser(prog="benchmarks/passes/run.sh", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("passes", nargs="*", metavar="NAME[:KIND]")
    parser.add_argument("--particles", type=float, default=1.0, help="distance in copper [mm] (default 1)")
    parser.add_argument("--mass-scaling", type=float, default=1e6, help="(default 1e6; the shipped inputs have 1e5)")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--draw", action="store_true", help="the page, pathlines and flow measures of each run")
    parser.add_argument("--valley", action="store_true")
    parser.add_argument("--tables", action="store_true")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "build/passes")
    options = parser.parse_args()
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
        found.append((name, kind or "floor"))
    return found


def folder_of(options):
    """Folder of the runs with the same numbers."""
    return options.output / f"{options.particles:g}mm_{options.mass_scaling:g}"


def one_pass(options, name, kind):
    keys = calculate.keys_of(name, kind, options.particles, options.mass_scaling)
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


if __name__ == "__main__":
    sys.exit(main())
