#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Inputs of the thermal model from measurements.

film     the film coefficient of a backing plate from a cooling record, by differences (thesis eq. 4.10)
         and by an exponential
share    the part of the heat that enters the plate, from properties (eq. 2.11)
compare  thermocouples of a run over a measured record, with residuals
fit      any inputs so that a run follows a measured record (scipy.optimize.least_squares)
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from stirpost import cooling


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    try:
        return options.action(options)
    except (OSError, ValueError, RuntimeError) as problem:
        print(f"calibrate_heat.py: {problem}", file=sys.stderr)
        return 2


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    actions = parser.add_subparsers(required=True)

    film = actions.add_parser("film")
    film.add_argument("record", help="CSV: time[s], then thermocouples in K")
    film.add_argument("--from", dest="start", type=float, default=65.0, help="cooling begins [s] (default 65)")
    film.add_argument("--room", type=float, default=298.0, help="room temperature [K] (default 298)")
    film.add_argument("--density", type=float, required=True)
    film.add_argument("--specific-heat", type=float, required=True)
    film.add_argument("--volume", type=float, required=True, help="of the plate [m3]")
    film.add_argument("--area", type=float, required=True, help="on the backing plate [m2]")
    film.set_defaults(action=show_film)

    share = actions.add_parser("share")
    for name in ("plate", "tool"):
        share.add_argument(f"--{name}", nargs=3, type=float, required=True, metavar=("K", "RHO", "C"))
    share.set_defaults(action=show_share)

    compare = actions.add_parser("compare")
    compare.add_argument("run", help="NAME.out, or its NAME_probes.csv")
    compare.add_argument("record")
    compare.add_argument("-o", "--output", type=Path, default=Path("compare.png"))
    compare.set_defaults(action=show_compare)

    fit = actions.add_parser("fit")
    fit.add_argument("input", type=Path)
    fit.add_argument("record")
    fit.add_argument("--vary", action="append", required=True, metavar="GROUP.KEY=START,LOW,HIGH")
    fit.add_argument("--set", action="append", default=[], metavar="GROUP.KEY=VALUE")
    fit.add_argument("--program", default=str(Path(__file__).resolve().parent.parent / "build/release/stirpoint"))
    fit.set_defaults(action=show_fit)
    return parser.parse_args(arguments)


def show_film(options) -> int:
    record = cooling.Record.read(options.record).after(options.start)
    body = (options.density, options.specific_heat, options.volume, options.area)
    for name, rates in (
        ("differences (4.10, 4.18)", cooling.rate_by_differences(record, options.room)),
        ("exponential to the room", cooling.rate_by_exponential(record, options.room)),
        ("exponential, free end (6.16)", cooling.rate_by_exponential(record)),
    ):
        each = "  ".join(f"{n} {r:.5f}" for n, r in zip(record.names, rates))
        print(f"{name:30s} {each}  mean {rates.mean():.5f} 1/s  "
              f"h = {cooling.film_coefficient(rates.mean(), *body):.1f} W/(m2 K)")
    return 0


def show_share(options) -> int:
    print(f"{cooling.heat_share(tuple(options.plate), tuple(options.tool)):.4f}")
    return 0


def probes_of(path: str | Path) -> cooling.Record:
    path = Path(path)
    if path.is_dir():
        found = sorted(path.glob("*_probes.csv"))
        if len(found) != 1:
            raise ValueError(f"{path}: no single NAME_probes.csv")
        path = found[0]
    return cooling.Record.read(path)


def show_compare(options) -> int:
    model, measured = probes_of(options.run), cooling.Record.read(options.record)
    apart = cooling.residuals(model, measured)
    for name, values in apart.items():
        if name != "time":
            print(f"{name}: mean {values.mean():+.2f} K, rms {np.sqrt(np.mean(values**2)):.2f} K, "
                  f"largest {values[np.abs(values).argmax()]:+.2f} K")
    from stirpost import heat_pictures

    heat_pictures.overlay(model, measured, apart, options.output)
    return 0


def show_fit(options) -> int:
    from scipy.optimize import least_squares

    measured = cooling.Record.read(options.record)
    names, start, low, high = [], [], [], []
    for text in options.vary:
        name, values = text.split("=", 1)
        numbers = [float(value) for value in values.split(",")]
        if len(numbers) != 3 or not numbers[1] < numbers[0] < numbers[2]:
            raise ValueError(f"--vary {text}: expected GROUP.KEY=START,LOW,HIGH with LOW < START < HIGH")
        names.append(name)
        start.append(numbers[0])
        low.append(numbers[1])
        high.append(numbers[2])
    scale = np.array(high) - np.array(low)

    def apart(values) -> np.ndarray:
        model = run_model(options, dict(zip(names, values)))
        found = cooling.residuals(model, measured)
        return np.concatenate([each for name, each in found.items() if name != "time"])

    result = least_squares(apart, start, bounds=(low, high), x_scale=scale, diff_step=1e-2, xtol=1e-5, ftol=1e-7)
    for name, value in zip(names, result.x):
        print(f"{name} = {value:.6g}")
    print(f"rms {np.sqrt(np.mean(result.fun**2)):.3f} K after {result.nfev} trials")
    return 0


def run_model(options, values: dict[str, float]) -> cooling.Record:
    with tempfile.TemporaryDirectory() as place:
        words = [options.program, str(options.input), "--quiet", "--output", place]
        for text in options.set + ["OUTPUT.FRAME_INTERVAL=0"] + [f"{k}={v:.12g}" for k, v in values.items()]:
            words += ["--set", text]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip() or f"{words[0]} failed")
        return probes_of(place)


if __name__ == "__main__":
    sys.exit(main())
