# SPDX-License-Identifier: MIT
"""Fits numbers of a flow law to measured stress-strain curves, with stirpoint --material as the model.

usage: stirpost calibrate law INPUT DATA.csv --material NAME --fit KEY=START[,START...] ... [-o DIR]
       stirpost calibrate law INPUT DATA.csv --generate [--noise 0.02] [--seed 1]

INPUT has the &MATERIAL with all its keys. DATA.csv has the columns temperature[K], strain_rate[1/s],
plastic_strain[1] and stress[Pa], one row a point; rows of equal temperature and rate are a curve. Each KEY is one
of the &MATERIAL, each number is fitted and must be above 0: logarithms are varied, so the fit needs no scales.
A list is fitted as a whole, such as alpha* at the temperatures TP_STAR_T of INPUT: TP_STAR=0.2,0.1,0.05.
Written to DIR: fit.json (values, standard errors, residuals), fit.txt (lines for the input), fit.png.

--generate writes DATA.csv instead, from the &PATH groups of INPUT, with noise of a standard deviation that is this
part of each stress.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..io import program
from ..io.files import text_of, write
from ..io.table import Table, read_frame, read_table
from ..plots import look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNITS = {"temperature": "K", "strain_rate": "1/s", "plastic_strain": "1", "stress": "Pa"}
PATH_GROUP = re.compile(r"^\s*&PATH\b.*?/\s*?$", re.DOTALL | re.MULTILINE | re.IGNORECASE)
ROWS = 400  # of a model curve, between which it is linear


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    if options.generate:
        generate(options)
    else:
        calibrate(options)
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="stirpost calibrate law", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", type=Path)
    parser.add_argument("data", type=Path)
    parser.add_argument("--material", help="NAME of the &MATERIAL")
    parser.add_argument("--fit", nargs="+", default=[], metavar="KEY=START")
    parser.add_argument("--adiabatic", action="store_true", help="the curves heat themselves")
    parser.add_argument("-o", "--output", type=Path, default=Path("calibration"))
    parser.add_argument("--generate", action="store_true")
    parser.add_argument("--noise", type=float, default=0.02)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    if not options.generate and not (options.material and options.fit):
        parser.error("--material and --fit are needed")
    return options


def run_program(words: Sequence[str | Path], directory: Path, needed: Sequence[str] = (), named: str | None = None) -> dict[str, Table]:
    """Curves that `stirpoint --material` writes for an input, by name; those that are `needed` must be among them."""
    done = program.run(["--material", *words, "--quiet", "--output", directory / "curves"], named)
    if done.returncode != 0:
        raise ValueError(done.stderr.strip() or "stirpoint --material failed")
    faults: list[str] = []
    found = {path.stem: read_table(path, faults, ("time", *UNITS)) for path in (directory / "curves").glob("*.csv")}
    if faults:
        raise ValueError("; ".join(faults))
    for name in needed:
        if not found.get(name):
            raise ValueError(f"stirpoint --material has not written {name}.csv")
    return found


def generate(options: argparse.Namespace) -> None:
    with tempfile.TemporaryDirectory() as directory:
        curves = run_program([options.input], Path(directory))
    random = np.random.default_rng(options.seed)
    lines = [f"# from {options.input.name}, noise {options.noise} of the stress, seed {options.seed}",
             ",".join(f"{name}[{unit}]" for name, unit in UNITS.items())]
    for name in sorted(curves):
        table = curves[name]
        noise = 1.0 + options.noise * random.standard_normal(len(table))
        for k in range(1, len(table)):
            row = [table["temperature"][k], table["strain_rate"][k], table["plastic_strain"][k],
                   table["stress"][k] * noise[k]]
            lines.append(",".join(f"{value:.9g}" for value in row))
    write(options.data, "\n".join(lines) + "\n")
    print(f"{len(curves)} curves in {options.data}")


@dataclass
class Curve:
    """Measured points at one temperature and rate."""

    temperature: float
    rate: float
    strain: np.ndarray
    stress: np.ndarray


def read_data(path: Path) -> list[Curve]:
    faults: list[str] = []
    frame, units = read_frame(path, faults, UNITS)
    faults += [f"{path}: {name} is in [{units[name]}], needed in [{unit}]" for name, unit in UNITS.items() if units[name] != unit]
    if faults:
        raise ValueError("; ".join(faults))
    rows = frame[list(UNITS)].to_numpy()
    if np.any(rows[:, 3] <= 0.0):
        raise ValueError(f"{path}: a stress is not above 0")
    curves = []
    for temperature, rate in np.unique(rows[:, :2], axis=0):
        own = rows[(rows[:, 0] == temperature) & (rows[:, 1] == rate)]
        own = own[np.argsort(own[:, 2])]
        curves.append(Curve(temperature, rate, own[:, 2], own[:, 3]))
    return curves


class Model:
    """Stresses of all curves as a function of the logarithms of the fitted numbers."""

    def __init__(self, options: argparse.Namespace, curves: list[Curve], directory: Path):
        self.keys = [item.partition("=")[0] for item in options.fit]
        try:
            starts = [[float(x) for x in item.partition("=")[2].split(",")] for item in options.fit]
        except ValueError:
            raise ValueError("--fit wants KEY=START or KEY=START,START...") from None
        if any(x <= 0.0 for values in starts for x in values):
            raise ValueError("starting values must be above 0")
        self.sizes = [len(values) for values in starts]
        self.start = np.log(np.concatenate(starts))
        self.material, self.curves, self.directory, self.calls = options.material, curves, directory, 0
        text = PATH_GROUP.sub("", text_of(options.input))
        for k, curve in enumerate(curves):
            text += (f"\n&PATH NAME = 'c{k}', MATERIAL = '{self.material}', TEMPERATURE = {curve.temperature:.9g}, "
                     f"RATE = {curve.rate:.9g}, STRAIN = {max(curve.strain.max(), 1e-6):.9g}, ROWS = {ROWS}"
                     + (", ADIABATIC = T" if options.adiabatic else "") + " /")
        self.input = directory / options.input.name
        write(self.input, text + "\n")

    def named(self, values: np.ndarray) -> dict[str, list[float]]:
        ends = np.cumsum(self.sizes)
        return {key: [float(x) for x in values[end - size:end]]
                for key, size, end in zip(self.keys, self.sizes, ends, strict=True)}

    def stresses(self, logarithms: np.ndarray) -> list[np.ndarray]:
        words: list[str | Path] = [self.input]
        for key, values in self.named(np.exp(logarithms)).items():
            words += ["--set", f"MATERIAL({self.material}).{key}=" + ",".join(f"{x:.15g}" for x in values)]
        names = [f"c{k}" for k in range(len(self.curves))]
        tables = run_program(words, self.directory, names)
        self.calls += 1
        return [np.interp(curve.strain, tables[name]["plastic_strain"], tables[name]["stress"]) for name, curve in zip(names, self.curves)]

    def residuals(self, logarithms: np.ndarray) -> np.ndarray:
        """Relative to the measured stress."""
        pairs = zip(self.stresses(logarithms), self.curves, strict=True)
        return np.concatenate([model / curve.stress - 1.0 for model, curve in pairs])


def calibrate(options: argparse.Namespace) -> None:
    curves = read_data(options.data)
    with tempfile.TemporaryDirectory() as directory:
        model = Model(options, curves, Path(directory))
        from scipy.optimize import least_squares

        found = least_squares(model.residuals, model.start, diff_step=1e-4, xtol=1e-6, ftol=1e-8)
        fitted = model.stresses(found.x)
        begun = model.stresses(model.start)
    freedom = max(len(found.fun) - len(found.x), 1)
    variance = 2.0 * found.cost / freedom
    errors = np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)) * variance)
    values = np.exp(found.x)
    report: dict = {
        "material": options.material,
        "fitted": model.named(values),
        "standard_errors": model.named(values * errors),
        "start": model.named(np.exp(model.start)),
        "relative_rms": float(np.sqrt(np.mean(found.fun**2))),
        "curves": [
            {"temperature[K]": float(c.temperature), "strain_rate[1/s]": float(c.rate), "points": len(c.strain),
             "relative_rms": float(np.sqrt(np.mean((s / c.stress - 1.0) ** 2)))}
            for c, s in zip(curves, fitted, strict=True)],
        "runs": model.calls,
    }
    options.output.mkdir(parents=True, exist_ok=True)
    write(options.output / "fit.json", json.dumps(report, indent=1) + "\n")
    lines = [f"{key} = {', '.join(f'{x:.6g}' for x in numbers)}" for key, numbers in report["fitted"].items()]
    write(options.output / "fit.txt", "\n".join(lines) + "\n")
    with look.style():
        look.save(picture(curves, begun, fitted), options.output / "fit.png")
    for key, numbers in report["fitted"].items():
        for k, x in enumerate(numbers):
            print(f"{key}{f'({k + 1})' if len(numbers) > 1 else '':4s} = {x:.6g} +- "
                  f"{report['standard_errors'][key][k]:.2g}   (start {report['start'][key][k]:.6g})")
    print(f"relative rms {100.0 * report['relative_rms']:.3g} %, {model.calls} runs; {options.output}/fit.png")


def picture(curves: list[Curve], begun: list[np.ndarray], fitted: list[np.ndarray]) -> Figure:
    """Points, the fit, the start dashed."""
    figure = look.new_figure(6.4, 4.4)
    axis = figure.add_subplot()
    for k, colour in enumerate(look.line_colours(len(curves))):
        curve = curves[k]
        axis.plot(curve.strain, curve.stress * 1e-6, ".", color=colour, markersize=3)
        axis.plot(curve.strain, fitted[k] * 1e-6, color=colour,
                  label=f"{curve.temperature:g} K, {curve.rate:g} /s")
        axis.plot(curve.strain, begun[k] * 1e-6, "--", color=colour, linewidth=0.8)
    axis.set_xlabel("plastic strain")
    axis.set_ylabel("stress [MPa]")
    axis.set_ylim(bottom=0.0)
    axis.grid(True)
    axis.legend(loc="best", fontsize="small")
    return figure

