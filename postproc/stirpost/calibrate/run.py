# SPDX-License-Identifier: MIT
"""Keys of any input from measurements: thermocouples, forces, torques, powers, stir zone, groove, filling of a cavity.

usage: stirpost calibrate run INPUT [RECORD.csv ...] --vary TOOL.FRICTION [--vary SURFACE.COEFFICIENT=700,100,1e5 ...]
                              [--target 'stir_depth@25e-3[mm]=3.5,0.5' ...] [--uncertainty T1=5 ...] [--starts 3] [--runs 40]
       stirpost calibrate run --limits | --targets

--vary names a key with its START, LOW and HIGH. Without these it starts from the input and lies between the limits that
physics sets, which --limits prints; films and conductances are sought in powers (",log" behind HIGH for other keys).

A record is a table as text: time[s], then columns named as those of the run, with a unit: T1[K] or T1[C] of its
probes, tool_force_z[kN], tool_torque[Nm], tool_power[W] of its history. --uncertainty has the standard uncertainty of a
curve, in the unit of the run; without it a twentieth of its range counts. A --target is a number with its standard
uncertainty (--targets prints which there are). All curves and targets count the same, however many readings they have.

First come the start and a Latin hypercube of --design runs, then least squares (scipy.optimize.least_squares) from the best
--starts of these that lie apart, with at most --runs new runs in all. With --coarse these have the keys named there (a coarse
grid, a larger ELASTIC_SCALING); then at most --fine-runs runs without them follow: what a fine run differs from the coarse
one by is added to the coarse ones, which are fitted again with the runs that are left. Each run is kept in DIR/runs:
what was stopped or ended goes on where it was. Values whose run breaks down are left aside.

Where the search has come to its end, runs at --profile points to each side of the best values go along the direction that the
measurements determine least, and tell from where to where the keys meet them as well.

Written to DIR (default INPUT's stem_calibration): calibration.json (values, standard errors, what is left of each
curve and target, the direction that is least determined), trials.csv (a row a run), valley.csv (runs along that direction),
calibration.png, valley.png. A standard error says how well the measurements determine a value within the model, readings that
follow each other closely taken for one; nothing of whether the model is right. A search that --runs ended has none.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import units
from ..io.files import write
from ..io.scene import Scene
from ..plots import look
from . import limits, targets, valley
from .fitting import Fitting
from .trials import Curve, Trials, measured, table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Show(argparse.Action):
    """Prints a table and ends."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(self.const())
        parser.exit()


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    if not options.input.is_file():
        raise ValueError(f"{options.input}: no such input")
    output = options.output or Path(f"{options.input.stem}_calibration")
    output.mkdir(parents=True, exist_ok=True)
    sets = {"OUTPUT.FRAME_INTERVAL": "0"} | pairs(options.set, "--set")
    common = dict(path=options.input, folder=output / "runs", named=options.program, ranks=options.ranks)
    coarse = Trials(sets=sets | pairs(options.coarse, "--coarse"), most=options.runs, **common)
    fine = Trials(sets=sets, most=options.fine_runs if options.coarse else 0, **common)
    errors = {name: float(value) for name, value in pairs(options.uncertainty, "--uncertainty").items()}
    keys = limits.varied(options.vary, Scene.read(options.input), lambda: coarse.first_step({}).scene)
    known = coarse.first_step({key.name: key.start for key in keys})
    wanted: list[Curve | targets.Target] = [*measured(options.records, options.unit, known, options.start, options.end, errors),
                                            *(targets.read(text, known) for text in options.target)]
    print(*keys, sep="\n")
    fit = Fitting(keys, wanted, coarse, fine)
    way = None
    import pandas as pd

    try:
        fit.solve(2 * len(keys) if options.design is None else options.design, options.starts, options.seed)
        if options.profile and not fit.spent:
            coarse.most = coarse.done + 2 * valley.MORE * (1 + valley.BACK) * options.profile
            way = valley.walk(fit, options.profile)
            if way is not None and not fine.most:
                fit.best = min(way.computed(), key=lambda there: there.total)
    finally:
        if fit.rows:
            write(output / "trials.csv", pd.DataFrame(fit.rows).to_csv(index=False))
    result = report(fit) | ({"least_determined": way.result()} if way else {})
    write(output / "calibration.json", json.dumps(result, indent=1) + "\n")
    files = ["calibration.json", "trials.csv"]
    with look.style():
        if any(isinstance(w, Curve) for w in wanted):
            look.save(picture(fit), output / "calibration.png")
            files.append("calibration.png")
        if way:
            write(output / "valley.csv", pd.DataFrame(way.rows()).to_csv(index=False))
            look.save(valley.picture(way), output / "valley.png")
            files += ["valley.csv", "valley.png"]
    print(*lines(result), *(way.lines() if way else []), f"{output}: {', '.join(files)}", sep="\n")
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="stirpost calibrate run", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", type=Path)
    parser.add_argument("records", type=Path, nargs="*", help="tables: time[s], then columns of the run")
    parser.add_argument("--vary", action="append", required=True, metavar="GROUP.KEY[=START[,LOW,HIGH[,log]]]")
    parser.add_argument("--limits", action=Show, nargs=0, const=limits.table, help="print the limits of keys, and end")
    parser.add_argument("--target", action="append", default=[], metavar="NAME[@AT][UNIT]=VALUE,UNCERTAINTY")
    parser.add_argument("--targets", action=Show, nargs=0, const=targets.table, help="print the names of targets, and end")
    parser.add_argument("--set", action="append", default=[], metavar="GROUP.KEY=VALUE", help="of all runs")
    parser.add_argument("--coarse", action="append", default=[], metavar="GROUP.KEY=VALUE", help="of the coarse runs")
    parser.add_argument("--design", type=int, help="runs of the Latin hypercube (default: two a key)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the Latin hypercube (default 1)")
    parser.add_argument("--starts", type=int, default=1, help="searches from the best runs of the design (default 1)")
    parser.add_argument("--runs", type=int, default=20, help="new runs at most, without those of --profile (default 20)")
    parser.add_argument("--fine-runs", type=int, default=4, help="new fine runs at most (default 4), with --coarse")
    parser.add_argument("--profile", type=int, default=2, help="points to each side along the least determined direction, of "
                        "one to three runs each (default 2; 0: none)")
    parser.add_argument("--uncertainty", action="append", default=[], metavar="NAME=VALUE",
                        help="standard uncertainty of a curve")
    parser.add_argument("--from", dest="start", type=float, help="readings count from this time on [s]")
    parser.add_argument("--until", dest="end", type=float, help="and to this one [s]")
    parser.add_argument("--unit", choices=("K", "C"), help="unit of thermocouples without one in the heading")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--program", help="path of stirpoint, if it is not found by itself")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    if min(options.runs, options.fine_runs, options.starts) < 1 or options.profile < 0 or (options.design or 0) < 0:
        parser.error("--runs, --fine-runs and --starts are at least 1, --design and --profile at least 0")
    if not options.records and not options.target:
        parser.error("a RECORD.csv or a --target is needed")
    return options


def pairs(texts: list[str], option: str) -> dict[str, str]:
    found = {}
    for text in texts:
        key, mark, value = text.partition("=")
        if not mark or not key or not value:
            raise ValueError(f"{option} {text}: expected NAME=VALUE")
        found[key.strip()] = value.strip()
    return found


def report(fit: Fitting) -> dict:
    """Content of calibration.json."""
    keys = {key.name: {"value": key.value(place), "standard_error": key.error(place, error) if np.isfinite(error) and not fit.spent else None,
                       "at_a_bound": not loose, "low": key.low, "high": key.high, "search": key.scale}
            for key, place, error, loose in zip(fit.keys, fit.best.scaled, fit.errors(), fit.free.tolist())}
    left: dict[str, dict] = {w.label: {"unit": w.unit, "readings": len(w.time), "uncertainty": w.scale, "uncertainty_given": w.known,
                                   "mean": float(each.mean()), "rms": float(np.sqrt(np.mean(each**2))), "largest": float(each[np.abs(each).argmax()])}
                         for w, each in zip(fit.wanted, fit.best.residuals)}
    return {"keys": keys, "grid": "fine" if fit.fine.most else "coarse", "sum_of_squares": fit.best.total,
            "sum_of_squares_at_the_start": fit.first.total if fit.first else None, "runs_spent": fit.spent,
            "runs": {grid: sum(row["grid"] == grid for row in fit.rows) for grid in ("coarse", "fine")},
            "searches": [{"sum_of_squares": end.total} | {key.name: key.value(place) for key, place in zip(fit.keys, end.scaled)}
                         for end in fit.ends],
            "curves": {name: each for name, each in left.items() if each["readings"] > 1},
            "targets": {name: each for name, each in left.items() if each["readings"] == 1}}


def lines(result: dict) -> list[str]:
    found = []
    for name, key in result["keys"].items():
        error = key["standard_error"]
        open_end = "  (the search has not come to its end: no standard error)" if result["runs_spent"] else "  (not determined)"
        found.append(f"{name} = {key['value']:.6g}" + (f" +- {error:.2g}" if error is not None else
                     "  (at a bound: no standard error)" if key["at_a_bound"] else open_end))
    if len(result["searches"]) > 1:
        sums = ", ".join(f"{end['sum_of_squares']:.4g}" for end in result["searches"])
        found.append(f"least sums of squares from several starts: {sums}")
    for name, left in result["targets"].items():
        found.append(f"{name}: {left['mean']:+.4g} {left['unit']}, of an uncertainty of {left['uncertainty']:.4g}")
    for name, left in result["curves"].items():
        found.append(f"{name}: mean {left['mean']:+.4g}, rms {left['rms']:.4g}, largest {left['largest']:+.4g} {left['unit']}")
    runs = result["runs"]
    counted = f"{runs['coarse']} coarse and {runs['fine']} fine runs" if result["grid"] == "fine" else f"{runs['coarse']} runs"
    found.append(counted + (": no more were allowed; the same command goes on from them, --runs allows more" if result["runs_spent"] else ""))
    return found


def picture(fit: Fitting) -> Figure:
    """Each measured curve with that of the first and of the best run, and what is left below it."""
    wanted = [(k, w) for k, w in enumerate(fit.wanted) if isinstance(w, Curve)]
    shown = [*([(fit.first, "#8a96a3", "at the start")] if fit.first else []), (fit.best, look.LINES[0], "calibrated")]
    count = len(wanted)
    figure = look.new_figure(9.6, 0.4 + 3.0 * count)
    panels = figure.subplots(2 * count, 1, sharex=True, squeeze=False, height_ratios=[3, 1] * count)[:, 0]
    for (k, curve), above, below in zip(wanted, panels[::2], panels[1::2]):
        factor, unit = units.scaled(float(np.abs(curve.values).max()), curve.unit)
        for there, colour, label in shown:
            table = table_of(there.run, curve.name)
            above.plot(table["time"], factor * table[curve.name], color=colour, linewidth=0.5, alpha=0.4)
            above.plot(curve.time, factor * (curve.values + there.residuals[k]), color=colour, label=label)
            below.plot(curve.time, factor * there.residuals[k], color=colour)
        above.plot(curve.time, factor * curve.values, ".", color=look.LINES[1], markersize=4, label="measured")
        above.set_xlim(curve.time[0], curve.time[-1])
        above.set_ylabel(f"{units.words(curve.name)} [{unit}]")
        below.set_ylabel(f"computed less measured [{unit}]")
        below.axhline(0.0, color="#8a96a3", linewidth=0.7)
        for axis in (above, below):
            axis.grid(True)
    panels[0].legend(fontsize="small")
    panels[-1].set_xlabel("time [s]")
    return figure
