# SPDX-License-Identifier: MIT
"""Keys of any input from measured curves: thermocouples, forces, torques, powers.

usage: stirpost calibrate run INPUT RECORD.csv [RECORD.csv ...] --vary TOOL.FRICTION=0.2,0.05,0.6 [--vary ...]
                              [--coarse GRID.CELL=4e-3 ...] [--set GROUP.KEY=VALUE ...] [--runs 20] [--fine-runs 4]

A record is a table as text: time[s], then columns named as those of the run, with a unit: T1[K] or T1[C] of its
probes, tool_force_z[kN], tool_torque[Nm], tool_power[W] of its history. A difference from a curve counts over the
range of this curve (--scale T1=50 says otherwise), and all curves count the same, however many readings they have.

The sum of squares is made least by scipy.optimize.least_squares, with at most --runs runs. With --coarse these have the
keys named there (a coarse grid, a larger ELASTIC_SCALING); then at most --fine-runs runs without them follow: what a
fine run differs from the coarse one by is added to the coarse curves, which are fitted again with the runs that are
left. Each run is kept in DIR/runs: what was stopped or ended goes on where it was.

Written to DIR (default INPUT's stem_calibration): calibration.json (values, standard errors, what is left of each
curve), trials.csv (a row a run), calibration.png. A standard error says how well the readings determine a value within
the model, readings that follow each other closely taken for one; nothing of whether the model is right.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd

from . import cooling, look
from .files import write
from .trials import Curve, Spent, Trials, measured, table_of

STEP = 0.04  # of the range of a value, for slopes: above what runs rattle by
CLOSE = 0.01  # of the range of a value: nearer is not sought


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    if not options.input.is_file():
        raise ValueError(f"{options.input}: no such input")
    output = options.output or Path(f"{options.input.stem}_calibration")
    output.mkdir(parents=True, exist_ok=True)
    names, start, low, high = cooling.varied(options.vary)
    sets = {"OUTPUT.FRAME_INTERVAL": "0"} | pairs(options.set, "--set")
    common = dict(path=options.input, folder=output / "runs", named=options.program, ranks=options.ranks)
    coarse = Trials(sets=sets | pairs(options.coarse, "--coarse"), most=options.runs, **common)
    fine = Trials(sets=sets, most=options.fine_runs if options.coarse else 0, **common)
    scales = {name: float(value) for name, value in pairs(options.scale, "--scale").items()}
    curves = measured(options.records, options.unit, coarse.first_step(dict(zip(names, start))), options.start, options.end, scales)
    fit = Fitting(names, low, high, curves, coarse, fine)
    try:
        fit.solve(start)
    finally:
        if fit.rows:
            write(output / "trials.csv", pd.DataFrame(fit.rows).to_csv(index=False))
    result = fit.result()
    write(output / "calibration.json", json.dumps(result, indent=1) + "\n")
    with matplotlib.rc_context(look.STYLE):
        look.save(picture(fit), output / "calibration.png")
    print("\n".join(lines(result)), f"{output}: calibration.json, trials.csv, calibration.png", sep="\n")
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="stirpost calibrate run", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", type=Path)
    parser.add_argument("records", type=Path, nargs="+", help="tables: time[s], then columns of the run")
    parser.add_argument("--vary", action="append", required=True, metavar="GROUP.KEY=START,LOW,HIGH")
    parser.add_argument("--set", action="append", default=[], metavar="GROUP.KEY=VALUE", help="of all runs")
    parser.add_argument("--coarse", action="append", default=[], metavar="GROUP.KEY=VALUE", help="of the coarse runs")
    parser.add_argument("--runs", type=int, default=20, help="new runs at most (default 20)")
    parser.add_argument("--fine-runs", type=int, default=4, help="new fine runs at most (default 4), with --coarse")
    parser.add_argument("--scale", action="append", default=[], metavar="NAME=VALUE", help="a difference of a curve that counts 1")
    parser.add_argument("--from", dest="start", type=float, help="readings count from this time on [s]")
    parser.add_argument("--until", dest="end", type=float, help="and to this one [s]")
    parser.add_argument("--unit", choices=("K", "C"), help="of thermocouples whose heading has none")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--program", help="stirpoint itself, where it is not found by itself")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    if options.runs < 1 or options.fine_runs < 1:
        parser.error("--runs and --fine-runs are at least 1")
    return options


def pairs(texts: list[str], option: str) -> dict[str, str]:
    found = {}
    for text in texts:
        key, mark, value = text.partition("=")
        if not mark or not key or not value:
            raise ValueError(f"{option} {text}: expected NAME=VALUE")
        found[key.strip()] = value.strip()
    return found


@dataclass
class Fitting:
    """Values between bounds that bring the curves of the runs to the measured ones."""

    names: list[str]
    low: np.ndarray
    high: np.ndarray
    curves: list[Curve]
    coarse: Trials
    fine: Trials
    rows: list[dict] = field(default_factory=list)
    best: tuple | None = None  # sum of squares, values, apart, run: of the coarse runs, then of the fine ones
    first: tuple | None = None
    slopes: np.ndarray | None = None
    spent: bool = False
    seen: dict = field(default_factory=dict)

    def calculate(self, trials: Trials, values: np.ndarray) -> tuple:
        """Sum of squares, values, differences and run."""
        key = (trials is self.fine, tuple(values))
        if key not in self.seen:
            run = trials.run(dict(zip(self.names, values)))
            apart = [curve.apart(run) for curve in self.curves]
            total = float(sum(np.mean((each / curve.scale)**2) for each, curve in zip(apart, self.curves)))
            self.seen[key] = total, np.array(values), apart, run
            row = {"grid": "fine" if trials is self.fine else "coarse"} | dict(zip(self.names, values)) | {"sum of squares": total}
            row |= {f"rms {c.name} [{c.unit}]": np.sqrt(np.mean(each**2)) for c, each in zip(self.curves, apart)}
            self.rows.append(row)
            told = ", ".join(f"{name} = {value:.5g}" for name, value in zip(self.names, values))
            print(f"{len(self.rows)} {row['grid']}: {told}: {total:.5g}", flush=True)
        return self.seen[key]

    def weighted(self, apart: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([each / (curve.scale * np.sqrt(len(each))) for each, curve in zip(apart, self.curves)])

    def least(self, start: np.ndarray, added: list[np.ndarray]) -> np.ndarray:
        """Values for which the coarse curves and what is added to them are nearest to the measured ones."""
        from scipy.optimize import least_squares

        best = None

        def apart(values):
            nonlocal best
            found = self.weighted([a + b for a, b in zip(self.calculate(self.coarse, values)[2], added)])
            if best is None or found @ found < best[0]:
                best = found @ found, np.array(values)
            return found

        def slopes(values):
            there, columns = apart(values), []
            for k, step in enumerate(STEP * (self.high - self.low)):
                other = np.array(values)
                other[k] += step if values[k] + step <= self.high[k] else -step
                columns.append((apart(other) - there) / (other[k] - values[k]))
            self.slopes = np.column_stack(columns)
            return self.slopes

        try:
            least_squares(apart, start, jac=slopes, bounds=(self.low, self.high), x_scale=self.high - self.low, xtol=CLOSE,
                          ftol=CLOSE**2)
        except Spent:
            self.spent = True
            if best is None:
                raise ValueError("no run was allowed; give more --runs") from None
        return best[1]

    def solve(self, start: np.ndarray) -> None:
        nothing = [np.zeros(len(curve.time)) for curve in self.curves]
        values = self.least(start, nothing)
        self.first = self.calculate(self.coarse, start)
        self.best = self.calculate(self.coarse, values)
        if self.fine.most == 0:
            return
        found = []
        try:
            while True:
                found.append(self.calculate(self.fine, values))
                added = [a - b for a, b in zip(found[-1][2], self.calculate(self.coarse, values)[2])]
                new = self.least(values, added)
                if (np.abs(new - values) <= CLOSE * (self.high - self.low)).all():
                    break
                values = new
        except Spent:
            pass
        self.best = min(found, key=lambda each: each[0])

    def result(self) -> dict:
        total, values, apart, _ = self.best
        free = (values - self.low > 1e-6 * (self.high - self.low)) & (self.high - values > 1e-6 * (self.high - self.low))
        errors = np.full(len(values), np.nan)
        if self.slopes is not None:
            errors = cooling.standard_errors(self.slopes, [each / (c.scale * np.sqrt(len(each))) for each, c in zip(apart, self.curves)],
                                             free)
        keys = {name: {"value": float(value), "standard_error": float(error) if np.isfinite(error) else None, "at_a_bound": not loose,
                       "low": float(a), "high": float(b)}
                for name, value, error, loose, a, b in zip(self.names, values, errors, free, self.low, self.high)}
        return {"keys": keys, "grid": "fine" if self.fine.most else "coarse",
                "sum_of_squares": total, "sum_of_squares_at_the_start": self.first[0], "runs_spent": self.spent,
                "runs": {"coarse": sum(r["grid"] == "coarse" for r in self.rows), "fine": sum(r["grid"] == "fine" for r in self.rows)},
                "curves": {c.name: {"unit": c.unit, "readings": len(c.time), "scale": c.scale, "mean": float(each.mean()),
                                    "rms": float(np.sqrt(np.mean(each**2))), "largest": float(each[np.abs(each).argmax()])}
                           for c, each in zip(self.curves, apart)}}


def lines(result: dict) -> list[str]:
    found = []
    for name, key in result["keys"].items():
        error = key["standard_error"]
        found.append(f"{name} = {key['value']:.6g}" + (f" +- {error:.2g}" if error is not None else
                     "  (at a bound: no standard error)" if key["at_a_bound"] else "  (not determined)"))
    for name, left in result["curves"].items():
        found.append(f"{name}: mean {left['mean']:+.4g}, rms {left['rms']:.4g}, largest {left['largest']:+.4g} {left['unit']}")
    runs = result["runs"]
    found.append(f"{runs['coarse']} coarse and {runs['fine']} fine runs" + (": no more were allowed" if result["runs_spent"] else ""))
    return found


def picture(fit: Fitting):
    """Each measured curve with that of the first and of the best run, and what is left below it."""
    count = len(fit.curves)
    figure = look.new_figure(9.6, 0.4 + 3.0 * count)
    panels = figure.subplots(2 * count, 1, sharex=True, squeeze=False, height_ratios=[3, 1] * count)[:, 0]
    for k, curve in enumerate(fit.curves):
        above, below = panels[2 * k], panels[2 * k + 1]
        factor, unit = look.scaled(float(np.abs(curve.values).max()), curve.unit)
        for (_, _, apart, run), colour, label in ((fit.first, "#8a96a3", "at the start"), (fit.best, look.LINES[0], "calibrated")):
            table = table_of(run, curve.name)
            above.plot(table["time"], factor * table[curve.name], color=colour, linewidth=0.5, alpha=0.4)
            above.plot(curve.time, factor * (curve.values + apart[k]), color=colour, label=label)
            below.plot(curve.time, factor * apart[k], color=colour)
        above.plot(curve.time, factor * curve.values, ".", color=look.LINES[1], markersize=4, label="measured")
        above.set_xlim(curve.time[0], curve.time[-1])
        above.set_ylabel(f"{look.words(curve.name)} [{unit}]")
        below.set_ylabel(f"apart [{unit}]")
        below.axhline(0.0, color="#8a96a3", linewidth=0.7)
        for axis in (above, below):
            axis.grid(True)
    panels[0].legend(fontsize="small")
    panels[-1].set_xlabel("time [s]")
    return figure
