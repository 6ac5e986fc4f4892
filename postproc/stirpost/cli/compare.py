# SPDX-License-Identifier: MIT
"""Two runs, or a run and the log of a machine, in numbers and pictures.

usage: stirpost compare A.out B.out [-o DIR]
       stirpost compare RUN.out --machine LOG.csv [--delimiter ';'] [--column NAME=HEADING ...] [--unit NAME=UNIT ...]
                        [--shift SECONDS] [-o DIR]

Two runs: written to DIR (default compare_A_B): compare.csv (a row a quantity: A, B, their difference), loads.png (force, torque,
power and highest temperature over time), thermocouples.png, sections.png (temperature in the cross-section of both at
the end).

A log is a table as text with a heading: time, spindle torque or power, forces, thermocouples, each with its unit in
brackets, torque [N m], or by --unit torque='N m': N, kN, N m, kN m, W, kW, K, C, s, ms, min, h. Columns are found by the name of
the run's column, with or without that of the tool (tool_torque, torque, Fz, T1); --column force_z=-F3 takes the column
F3, with the opposite sign. Rows that cannot be read are named with their line and left out. Each reading is compared with the
run's mean over the time half way to its neighbours. Printed, and written to DIR (default compare_RUN_LOG): machine.csv (peak,
mean over the common span, time of the peak: computed, measured, difference; rms of the difference), machine.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import summary, units
from ..analysis.cooling import Record
from ..analysis.tools import main_tool
from ..calibrate.run import pairs as named
from ..io.files import write
from ..plots import curves, look, machine
from ..run import Run

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost compare", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("one", type=Path)
    parser.add_argument("other", type=Path, nargs="?")
    parser.add_argument("--machine", type=Path, metavar="LOG.csv", help="compare with this log instead of a second run")
    parser.add_argument("--delimiter", metavar="MARK", help="delimiter of the log (default: the one of ; tab and , that its heading has)")
    parser.add_argument("--column", action="append", default=[], metavar="NAME=HEADING", help="the column of the log for NAME, which is "
                        "time or a column of the run")
    parser.add_argument("--unit", action="append", default=[], metavar="NAME=UNIT", help="unit of a column of the log that has none in its heading")
    parser.add_argument("--shift", type=float, default=0.0, metavar="SECONDS", help="time of the run at the zero of the log")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    if (options.other is None) == (options.machine is None):
        parser.error("either a second run or --machine LOG.csv")
    if options.machine is not None:
        return with_machine(options)
    runs = [Run(options.one), Run(options.other)]
    for run in runs:
        run.drop_damaged(["temperature"])
    names = [run.name for run in runs] if runs[0].name != runs[1].name else [str(options.one), str(options.other)]
    output = options.output or Path(f"compare_{runs[0].name}_{runs[1].name}")
    output.mkdir(parents=True, exist_ok=True)
    table = difference([summary.measures(run) for run in runs], names)
    write(output / "compare.csv", table.to_csv())
    print(table.to_string(float_format=lambda value: f"{value:.4g}", na_rep="-"))
    with look.style():
        for name, draw in (("loads", loads), ("thermocouples", thermocouples), ("sections", sections)):
            picture = runs[0].attempt(f"the picture {name}", look.drawn, draw, runs, names)
            if picture is not None:
                print(write(output / f"{name}.png", picture))
    return 0


def with_machine(options: argparse.Namespace) -> int:
    run, faults = Run(options.one), list[str]()
    mark = {"tab": "\t", "\\t": "\t"}.get(options.delimiter, options.delimiter)
    if mark is not None and len(mark) != 1:
        raise ValueError(f"--delimiter {mark}: expected one character, or tab")
    log = Record.read(options.machine, None, True, mark, named(options.column, "--column"), named(options.unit, "--unit"), faults)
    for text in faults:
        run.warn(text)
    found = machine.pairs(run, log, options.shift)
    output = options.output or Path(f"compare_{run.name}_{options.machine.stem}")
    output.mkdir(parents=True, exist_ok=True)
    write(output / "machine.csv", machine.table(found).to_csv(index=False))
    with look.style():
        look.save(machine.picture(run, found), output / "machine.png")
    print("\n".join(machine.lines(found)), f"{output}: machine.csv, machine.png", sep="\n")
    return 0


def difference(measures: list[dict[str, float]], names: list[str]) -> pd.DataFrame:
    """Quantities of both, and B less A, also in parts of A."""
    import pandas as pd

    table = pd.DataFrame(dict(zip(names, measures)), dtype=float)
    table["difference"] = table[names[1]] - table[names[0]]
    table["difference [%]"] = 100.0 * table["difference"] / table[names[0]].abs().where(table[names[0]] != 0.0)
    return table


def loads(runs: list[Run], names: list[str]) -> Figure | None:
    tools = [main_tool(run.history) for run in runs]
    wanted = [("force_z", "axial force"), ("force_x", "force along x"), ("torque", "torque"), ("power", "power")]
    panels = [(words, [tool.column(name) if tool else None for tool in tools]) for name, words in wanted]
    hottest = [run.history.column("temperature_max") for run in runs]
    panels.append(("highest temperature", hottest))
    panels = [(words, columns) for words, columns in panels if any(column is not None for column in columns)]
    if not panels:
        return None
    figure = look.new_figure(9.6, 0.5 + 2.0 * len(panels))
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (words, columns) in zip(axes, panels):
        there = [column for column in columns if column is not None]
        factor, unit = units.scaled(max(float(np.nanmax(np.abs(c.values))) for c in there), there[0].unit)
        for run, column, name, colour in zip(runs, columns, names, look.LINES):
            if column is not None:
                axis.plot(run.history["time"], column.values * factor, color=colour, label=name, linewidth=1.0)
        curves.finish(axis, f"{words} [{unit}]")
    axes[0].legend()
    axes[-1].set_xlabel("time [s]")
    return figure


def thermocouples(runs: list[Run], names: list[str]) -> Figure | None:
    shared = [c.name for c in runs[0].probes.with_unit("K") if c.name in runs[1].probes]
    if not shared:
        return None
    figure = look.new_figure(9.6, 4.3)
    axis = figure.add_subplot()
    for name, colour in zip(shared, look.line_colours(len(shared))):
        axis.plot(runs[0].probes["time"], runs[0].probes[name], color=colour, label=name)
        axis.plot(runs[1].probes["time"], runs[1].probes[name], color=colour, linestyle="--")
    curves.finish(axis, "temperature [K]")
    axis.set_title(f"lines: {names[0]}; dashed: {names[1]}", loc="left")
    axis.set_xlabel("time [s]")
    curves.beside(axis, len(shared), offset=1.02)
    return figure


def sections(runs: list[Run], names: list[str]) -> Figure | None:
    """Temperature in the cross-section through the tool at the end of both, on one scale."""
    if not all(run.frames and "temperature" in run.frames[-1].fields for run in runs):
        return None
    from matplotlib.cm import ScalarMappable

    from ..plots import maps

    norm = maps.temperature_norm([run.frames[-1] for run in runs])
    views = [maps.build_scene(run, run.frames[-1:]).cross[0] for run in runs]
    figure = look.new_figure(9.6, 5.2)
    axes = figure.subplots(2, 1)
    for axis, view, name in zip(axes, views, names):
        maps.draw(axis, view, "temperature", look.TEMPERATURE, norm)
        axis.set_title(f"{name}: {view.title}", loc="left")
        axis.set_aspect("equal")
        axis.set_ylabel("z [mm]")
    axes[-1].set_xlabel("y [mm]")
    figure.colorbar(ScalarMappable(norm, look.TEMPERATURE), ax=axes, label=f"temperature [{look.unit_of_temperature()}]", fraction=0.04, pad=0.012)
    return figure
