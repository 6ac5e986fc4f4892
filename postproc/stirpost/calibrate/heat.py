# SPDX-License-Identifier: MIT
"""Inputs of the thermal model from measurements.

film     the film coefficient of a backing plate from a cooling record, by differences (thesis eq. 4.10)
         and by an exponential
share    the part of the heat that enters the plate, from properties (eq. 2.11)
fit      any inputs so that a run follows a measured record (scipy.optimize.least_squares), with standard errors

A record is a table as text: time[s], then thermocouples with their unit, T1[K] or T1[C]; values parted by commas,
semicolons or tabs. An empty value is no reading. What cannot be understood is refused with the numbers of its lines.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from ..analysis import cooling
from ..io import program


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    options.action(options)
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="stirpost calibrate heat", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    actions = parser.add_subparsers(required=True)

    film = actions.add_parser("film")
    add_record(film)
    film.add_argument("--from", dest="start", type=float, default=65.0, help="cooling begins [s] (default 65)")
    film.add_argument("--room", type=float, default=298.0, help="room temperature [K] (default 298)")
    film.add_argument("--density", type=float, required=True)
    film.add_argument("--specific-heat", type=float, required=True)
    film.add_argument("--volume", type=float, required=True, help="of the plate [m3]")
    film.add_argument("--area", type=float, required=True, help="contact area on the backing plate [m2]")
    film.set_defaults(action=show_film)

    share = actions.add_parser("share")
    for name in ("plate", "tool"):
        share.add_argument(f"--{name}", nargs=3, type=float, required=True, metavar=("K", "RHO", "C"))
    share.set_defaults(action=show_share)

    fit = actions.add_parser("fit")
    fit.add_argument("input", type=Path)
    add_record(fit)
    fit.add_argument("--vary", action="append", required=True, metavar="GROUP.KEY=START,LOW,HIGH")
    fit.add_argument("--set", action="append", default=[], metavar="GROUP.KEY=VALUE")
    fit.add_argument("--program", help="path of stirpoint, if it is not found by itself")
    fit.set_defaults(action=show_fit)
    return parser.parse_args(arguments)


def add_record(action: argparse.ArgumentParser) -> None:
    action.add_argument("record", help="table: time[s], then thermocouples [K] or [C]")
    action.add_argument("--unit", choices=("K", "C"), help="of thermocouples whose heading has none; K: believe "
                                                          f"readings below {cooling.COLDEST:g} K")


def show_film(options: argparse.Namespace) -> None:
    if not options.room >= cooling.COLDEST and options.unit != "K":
        raise ValueError(f"--room {options.room:g} is in kelvin; degrees Celsius + 273.15")
    record = cooling.Record.read(options.record, options.unit).after(options.start, options.record)
    for name, t in zip(record.names, record.values.T):
        if np.isfinite(t).sum() < 3:
            raise ValueError(f"{name} has fewer than 3 readings after {options.start:g} s")
        if not np.nanmean(t) > options.room:
            raise ValueError(f"{name} is {np.nanmean(t):g} K on average: not above the room, --room {options.room:g} K")
    body = (options.density, options.specific_heat, options.volume, options.area)
    for name, rates in (
        ("differences (4.10, 4.18)", cooling.rate_by_differences(record, options.room)),
        ("exponential to the room", cooling.rate_by_exponential(record, options.room)),
        ("exponential, free end (6.16)", cooling.rate_by_exponential(record)),
    ):
        each = "  ".join(f"{n} {f'{r:.5f}' if np.isfinite(r) else 'no fit'}" for n, r in zip(record.names, rates))
        found = rates[np.isfinite(rates)]
        mean = (f"mean {found.mean():.5f} 1/s  h = {cooling.film_coefficient(found.mean(), *body):.1f} W/(m2 K)"
                if found.size else "the record does not determine it")
        print(f"{name:30s} {each}  {mean}")


def show_share(options: argparse.Namespace) -> None:
    print(f"{cooling.heat_share(tuple(options.plate), tuple(options.tool)):.4f}")


def probes_of(path: str | Path) -> cooling.Record:
    path = Path(path)
    if path.is_dir():
        found = sorted(path.glob("*_probes.csv"))
        if len(found) != 1:
            raise ValueError(f"{path}: no single NAME_probes.csv")
        path = found[0]
    return cooling.Record.read(path)


def readings(residuals: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Residuals of each thermocouple where it has readings."""
    found = {name: values[np.isfinite(values)] for name, values in residuals.items() if name != "time"}
    found = {name: values for name, values in found.items() if values.size}
    if not found:
        raise ValueError("no reading in the time of the run")
    return found


def show_fit(options: argparse.Namespace) -> None:
    measured = cooling.Record.read(options.record, options.unit)
    names, start, low, high = cooling.varied(options.vary)

    def residuals(values: np.ndarray) -> list[np.ndarray]:
        model = run_model(options, dict(zip(names, values)))
        return list(readings(cooling.residuals(model, measured)).values())

    result = cooling.fit(residuals, start, low, high)
    for name, value, error, lower, upper in zip(names, result.values, result.errors, low, high):
        held = min(value - lower, upper - value) <= 1e-6 * (upper - lower)
        print(f"{name} = {value:.6g}" + (f" +- {error:.2g}" if np.isfinite(error) else
                                         "  (at a bound: no standard error)" if held else "  (not determined)"))
    left = np.concatenate(result.residuals)
    print(f"rms {np.sqrt(np.mean(left**2)):.3f} K after {result.trials} trials")


def run_model(options: argparse.Namespace, values: dict[str, float]) -> cooling.Record:
    with tempfile.TemporaryDirectory() as place:
        words = [options.input, "--quiet", "--output", place]
        for text in options.set + ["OUTPUT.FRAME_INTERVAL=0"] + [f"{k}={v:.12g}" for k, v in values.items()]:
            words += ["--set", text]
        program.compute(words, options.program)
        return probes_of(place)

