# SPDX-License-Identifier: MIT
"""Curves over time: thermocouples, loads of the tool, energies and what else the history holds."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import units
from ..analysis.cooling import Record
from ..analysis.tools import Tool, main_tool, supports, tools_of
from ..io.table import Column, Table
from . import look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MANY_ROWS = 400


def thermocouples(probes: Table, measured: Record | None = None) -> Figure | None:
    """One curve for each probe, labelled with its initial position, and dots of a record of the same names."""
    columns = probes.with_unit("K")
    if not columns:
        return None
    figure, (axis,) = look.strips(1, 3.5)
    for column, colour in zip(columns, look.line_colours(len(columns))):
        axis.plot(probes["time"], look.shown("temperature", column.values), color=colour, label=column.name + place(probes, column.name))
        if measured is not None and column.name in measured.names:
            readings = measured.values[:, measured.names.index(column.name)]
            axis.plot(measured.time, look.shown("temperature", readings), ".", markersize=4, color=colour)
    finish(axis, f"temperature [{look.unit_of_temperature()}]")
    axis.set_xlabel("time [s]")
    other_degrees(axis)
    beside(axis, len(columns), offset=1.09)
    make_room(figure, [axis])
    return figure


def differences(probes: Table, measured: Record) -> list[tuple[str, str]]:
    """Differences of each thermocouple from the record: mean, root mean square and peaks."""
    rows = []
    for column in probes.with_unit("K"):
        if column.name not in measured.names:
            continue
        readings = measured.values[:, measured.names.index(column.name)]
        there = np.isfinite(readings) & (measured.time >= probes["time"][0]) & (measured.time <= probes["time"][-1])
        if not there.any():
            continue
        off = np.interp(measured.time[there], probes["time"], column.values) - readings[there]
        rows.append((f"thermocouple {column.name}, computed less measured: mean; rms; of the peaks",
                     f"{off.mean():+.1f} K; {np.sqrt(np.mean(off**2)):.1f} K; "
                     f"{np.nanmax(column.values) - readings[there].max():+.1f} K"))
    if not rows:
        raise ValueError(f"no thermocouple of the record ({', '.join(measured.names)}) has the name of a probe")
    return rows


def place(probes: Table, name: str) -> str:
    """' (50, 12, 6)': the first position in mm."""
    parts = [probes[f"{name}_{axis}"] for axis in "xyz" if f"{name}_{axis}" in probes]
    first = [values[np.isfinite(values)][0] * units.MM for values in parts if np.isfinite(values).any()]
    return f" ({', '.join(f'{value:.4g}' for value in first)}) mm" if len(first) == 3 else ""


def tool_loads(history: Table) -> Figure | None:
    """Torque, force and power of the tools, a panel each, with the phases of the first."""
    tools = tools_of(history)
    panels = [
        ("torque", [c for tool in tools for c in tool.loads("torque")]),
        ("force on the tool", [c for tool in tools for c in tool.loads("force_[xyz]")]),
        ("power", [c for tool in tools for c in tool.loads("(friction_)?power")]),
    ]
    figure, tool = stacked(history, [(title, columns) for title, columns in panels if columns]), main_tool(history)
    if figure is not None and tool is not None:
        mark_phases(figure, tool)
    return figure


def mark_phases(figure: Figure, tool: Tool) -> None:
    """Where a phase of the tool begins, and its name above the first panel unless it is too short for that."""
    time = tool.history["time"]
    for phase in tool.phases():
        start, end = time[phase.first - 1], time[phase.last]
        for axis in figure.axes:
            axis.axvline(start, color="#8a96a3", linewidth=0.7, linestyle=":")
        if end - start > 0.05 * (time[-1] - time[0]):
            figure.axes[0].text(0.5 * (start + end), 1.02, phase.kind, transform=figure.axes[0].get_xaxis_transform(), ha="center", fontsize=8)


def wall_loads(history: Table) -> Figure | None:
    """Forces of walls and clamps on the metal, a panel each."""
    columns = supports(history)
    names = dict.fromkeys(c.name[: -len("_force_x")] for c in columns)
    panels = [(f"force of {units.words(n)}", [c for c in columns if c.name[: -len("_force_x")] == n]) for n in names]
    return stacked(history, panels)


def energies(history: Table) -> Figure | None:
    """All energies that are not zero, large and small ones apart, and the error of their audit. Heat contents are those since the start."""
    sizes = {c.name: float(np.nanmax(np.abs(c.values), initial=0.0)) for c in history.with_unit("J")}
    largest = max((size for name, size in sizes.items() if not name.endswith("heat_content")), default=0.0)
    groups: dict[str, list[Column]] = {"heat stored": [], "energy": [], "small energies": []}
    for column in history.with_unit("J"):
        if column.name.endswith("heat_content"):
            if sizes[column.name] > 0.0:
                groups["heat stored"].append(Column(column.name, column.unit, column.values - column.values[0]))
        elif sizes[column.name] > 0.03 * largest:
            groups["energy"].append(column)
        elif sizes[column.name] > 0.0:
            groups["small energies"].append(column)
    panels = [*groups.items(), ("audit error", history.matching(r"audit_error.*"))]
    return stacked(history, [(title, columns) for title, columns in panels if columns])


def others(history: Table) -> Figure | None:
    """Temperatures, shares and speeds of the history, and every other unit that is in no other picture; what is always 0 is left out."""
    taken = {"time", "step", "dt"}
    patterns = [r".+_torque", r".+_force(_[xyz])?", r"audit_error.*", r".+_[xyz]"]
    patterns += [re.escape(tool.name) + "_((friction_)?power|angle|tilt)" for tool in tools_of(history)]
    for pattern in patterns:
        taken |= {column.name for column in history.matching(pattern)}
    left = [c for c in history.matching(".*") if c.name not in taken and c.unit != "J" and np.nanmax(np.abs(c.values)) > 0.0]
    rubs = {f"{tool.name}_friction_share": tool.rubs() for tool in tools_of(history)}  # where nothing rubs there is no share
    left = [Column(c.name, c.unit, np.where(rubs[c.name], c.values, np.nan)) if c.name in rubs and rubs[c.name].any() else c for c in left]
    titles = {"K": "temperature", "%": "share", "m/s": "speed", "W": "power"}
    panels = []
    for unit in [u for u in dict.fromkeys([*titles, *(column.unit for column in left if column.unit)]) if any(c.unit == u for c in left)]:
        panels.append((titles.get(unit, ""), [column for column in left if column.unit == unit]))
    return stacked(history, panels)


def stacked(history: Table, panels: list[tuple[str, list[Column]]]) -> Figure | None:
    """Panels over one time axis."""
    if not panels:
        return None
    figure, axes = look.strips(len(panels), 2.6 if len(panels) == 1 else 1.85)
    for axis, (title, columns) in zip(axes, panels):
        draw(axis, history["time"], title, columns)
        axis.ticklabel_format(axis="y", scilimits=(-2, 4), useMathText=True)
    axes[-1].set_xlabel("time [s]")
    make_room(figure, axes)
    return figure


def make_room(figure: Figure, axes: list[Axes]) -> None:
    """Widen a figure to its longest legend; the panels stay as they are."""
    legends = [axis.get_legend() for axis in axes if axis.get_legend() is not None]
    wide = figure.get_figwidth()
    needed = max((legend.get_window_extent().x1 / figure.dpi + 0.05 for legend in legends), default=wide)
    if needed > wide:
        figure.set_figwidth(needed)
        for axis in axes:
            left, bottom, width, height = axis.get_position().bounds
            axis.set_position((left * wide / needed, bottom, width * wide / needed, height))


def draw(axis: Axes, time: np.ndarray, title: str, columns: list[Column]) -> None:
    if columns[0].unit == "K":  # where nothing has a temperature yet it is 0
        columns = [Column(c.name, look.unit_of_temperature(), look.shown("temperature", np.where(c.values > 0.0, c.values, np.nan)))
                   for c in columns]
    largest = max(np.nanmax(np.abs(column.values), initial=0.0) for column in columns)
    factor, unit = units.scaled(largest, columns[0].unit)
    names = [units.words(column.name) for column in columns]  # of two that would be the same, the longer one in full
    names = [column.name.replace("_", " ") if names.count(name) > 1 else name for name, column in zip(names, columns)]
    for column, name, kind in zip(columns, names, look.line_kinds(len(columns))):
        values = column.values * factor
        if len(values) > MANY_ROWS and is_rough(values):  # the rattle pale, its running mean on top
            axis.plot(time, values, color=kind["color"], linewidth=0.6, alpha=0.3)
            values = running_mean(values, len(values) // 120)
        axis.plot(time, values, label=name, **kind)
    alone = len(columns) == 1
    finish(axis, f"{units.words(columns[0].name) if alone or not title else title} [{unit}]")
    warm = title == "temperature"
    if warm:
        other_degrees(axis)
    if not alone:
        beside(axis, len(columns), offset=1.12 if warm else 1.01)


def is_rough(values: np.ndarray) -> bool:
    """True if a curve goes up and down much more than from end to end of its range."""
    steps = np.abs(np.diff(values[np.isfinite(values)]))
    return steps.sum() > 8 * max(np.ptp(values[np.isfinite(values)]), 1e-300)


def running_mean(values: np.ndarray, width: int) -> np.ndarray:
    """Mean over 2 * width + 1 rows, fewer at the ends."""
    there = np.isfinite(values)
    window = np.ones(2 * max(1, width) + 1)
    total = np.convolve(np.where(there, values, 0.0), window, mode="same")
    count = np.convolve(there.astype(float), window, mode="same")
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def finish(axis: Axes, label: str) -> None:
    axis.set_ylabel(label)
    axis.grid(True)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    axis.margins(x=0.01)


def other_degrees(axis: Axes) -> None:
    """A second scale at the right, in C for K and in K for C."""
    (unit, zero), = (scale for name, scale in look.SCALES.items() if name != look.degrees)
    shift = look.SCALES[look.degrees][1] - zero
    second = axis.secondary_yaxis("right", functions=(lambda t: t + shift, lambda t: t - shift))
    second.set_ylabel(f"[{unit}]")


def beside(axis: Axes, entries: int, offset: float) -> None:
    """The legend to the right of the curves."""
    axis.legend(loc="upper left", bbox_to_anchor=(offset, 1.02), borderaxespad=0.0, fontsize=8.5, handlelength=1.4, ncols=1 if entries <= 14 else 2)
