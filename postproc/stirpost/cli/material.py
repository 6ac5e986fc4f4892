# SPDX-License-Identifier: MIT
"""Pictures of the curves of stirpoint --material: stirpost material DIRECTORY [-o DIR]

Curves whose names agree up to the first '-' share a picture, NAME.png: stress over plastic strain (or --over time,
a logarithmic axis), below it the temperature where one changes, and the grain size where a law has one.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..io.table import Table, read_table
from ..plots import look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STRESS, STRAIN, WARMTH, SIZE = "stress", "plastic_strain", "temperature", "grain_size"
TIME = "time"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost material", description="Pictures of the curves of stirpoint --material")
    parser.add_argument("directory", type=Path, help="where stirpoint --material wrote its curves")
    parser.add_argument("-o", "--output", type=Path, help="where to draw (default: beside the curves)")
    parser.add_argument("--over", choices=("strain", "time"), default="strain")
    options = parser.parse_args(arguments)
    groups: dict[str, dict[str, Table]] = {}
    faults: list[str] = []
    for path in sorted(options.directory.glob("*.csv")):
        group, _, label = path.stem.partition("-")
        table = read_table(path, faults, (TIME, STRESS, STRAIN, WARMTH))
        if table:
            groups.setdefault(group, {})[label or group] = table
    if not groups:
        raise ValueError("; ".join([*faults, f"{options.directory}: no curves here"]))
    for text in faults:
        print(f"warning: {text}", file=sys.stderr)
    output = options.output or options.directory
    output.mkdir(parents=True, exist_ok=True)
    with look.style():
        for group, curves in groups.items():
            look.save(draw(group, curves, options.over), output / f"{group}.png")
    print(f"{len(groups)} pictures in {output}")
    return 0


def draw(group: str, curves: dict[str, Table], over: str) -> Figure:
    """One picture of some curves."""
    rows = [(STRESS, 1e-6, "stress [MPa]")]
    if any(np.ptp(table[WARMTH]) > 1.0 for table in curves.values()):
        rows.append((WARMTH, 1.0, "temperature [K]"))
    if any(SIZE in table for table in curves.values()):
        rows.append((SIZE, 1e6, "grain size [µm]"))
    figure = look.new_figure(6.4, 1.2 + 2.1 * len(rows))
    axes = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    for (label, table), colour in zip(curves.items(), look.line_colours(len(curves)), strict=True):
        for axis, (name, scale, _) in zip(axes, rows, strict=True):
            if name in table:
                axis.plot(table[TIME if over == "time" else STRAIN], table[name] * scale, color=colour, label=label)
    for axis, (name, _, title) in zip(axes, rows, strict=True):
        axis.set_ylabel(title)
        axis.grid(True)
        if name == SIZE:
            axis.set_yscale("log")
        else:
            axis.set_ylim(bottom=0.0 if name == STRESS else None)
    axes[-1].set_xlabel("time [s]" if over == "time" else "plastic strain")
    if over == "time":
        axes[-1].set_xscale("log")
    axes[0].set_title(group)
    axes[0].legend(loc="best", fontsize="small", ncols=2)
    return figure

