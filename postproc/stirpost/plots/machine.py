# SPDX-License-Identifier: MIT
"""The log of a machine beside the curves of a run: torque, power, forces, thermocouples."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import units
from ..analysis.cooling import Record, means
from ..analysis.tools import tools_of
from . import curves, look

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from ..run import Run

ALIASES = {"fx": "force_x", "fy": "force_y", "fz": "force_z", "axial_force": "force_z", "force": "force_z", "mz": "torque",
           "spindle_torque": "torque", "spindle_power": "power"}


@dataclass
class Pair:
    """A measured curve and that of the run averaged to its readings, over the time that both have."""

    name: str
    unit: str
    time: np.ndarray  # of the run [s]
    measured: np.ndarray
    computed: np.ndarray

    def rows(self) -> dict[str, tuple[float, float, float]]:
        """Computed and measured value and their difference, for each quantity."""
        both = self.computed, self.measured
        at = [int(np.abs(values).argmax()) for values in both]
        peak, mean = [values[k] for values, k in zip(both, at)], [over_time(self.time, values) for values in both]
        return {"peak": (*peak, peak[0] - peak[1]), "mean": (*mean, mean[0] - mean[1]),
                "time of peak": (*self.time[at], self.time[at[0]] - self.time[at[1]])}

    def rms(self) -> float:
        return float(np.sqrt(over_time(self.time, (self.computed - self.measured) ** 2)))


def over_time(time: np.ndarray, values: np.ndarray) -> float:
    return float((0.5 * (values[1:] + values[:-1]) * np.diff(time)).sum() / (time[-1] - time[0]))


def pairs(run: Run, log: Record, shift: float) -> list[Pair]:
    """The columns of the log that the run has too. What cannot be compared is a warning; ValueError if nothing can."""
    known = {c.name.lower(): (c, table["time"]) for table in (run.history, run.probes)
             for c in table.columns if c.unit in ("K", "N", "Nm", "W") and np.isfinite(c.values).any()}
    tools = [tool.name.lower() for tool in tools_of(run.history)[:1]]
    found = []
    for name, unit, values in zip(log.names, log.units, log.values.T):
        plain = re.sub(r"\W+", "_", name.strip().lower())
        there = [x for x in (name.lower(), plain, *(f"{tool}_{ALIASES.get(plain, plain)}" for tool in tools)) if x in known]
        if not there:
            run.warn(f"'{name}' of the log is no column of the run, which has {', '.join(c.name for c, _ in known.values())}: "
                     "--column gives the name")
            continue
        column, time = known[there[0]]
        own = np.isfinite(column.values)
        at = log.time + shift
        span = np.isfinite(values) & (at >= time[own][0]) & (at <= time[own][-1])
        if column.unit != unit:
            run.warn(f"'{name}' of the log is in {unit}, {column.name} of the run in {column.unit}")
        elif span.sum() < 2:
            run.warn(f"'{name}' of the log has {span.sum()} readings between {time[own][0]:g} and {time[own][-1]:g} s, the time of the "
                     "run; two are needed (--shift moves the log)")
        else:
            found.append(Pair(column.name, unit, at[span], values[span], means(time, column.values, at[span])))
    if log.others:
        run.warn(f"of the log without a unit that is understood: {', '.join(log.others)} (--unit gives it)")
    if not found:
        raise ValueError("no column of the log can be compared")
    return found


def lines(found: list[Pair]) -> list[str]:
    text = []
    for pair in found:
        factor, unit = units.scaled(float(np.abs(pair.measured).max()), pair.unit)
        text += [f"{units.words(pair.name)}, {pair.time[0]:.4g} to {pair.time[-1]:.4g} s, {len(pair.time)} readings",
                 f"  {'':18}{'computed':>12}{'measured':>12}{'difference':>12}"]
        for name, values in pair.rows().items():
            scale, shown = (1.0, "s") if name.startswith("time") else (factor, unit)
            part = f" ({100 * values[2] / abs(values[1]):+.1f} %)" if shown != "s" and pair.unit != "K" and values[1] else ""
            text.append(f"  {f'{name} [{shown}]':18}" + "".join(f"{scale * x:12.4g}" for x in values) + part)
        text.append(f"  {f'rms [{unit}]':18}{'':24}{factor * pair.rms():12.4g}")
    return text


def table(found: list[Pair]) -> pd.DataFrame:
    """One row per quantity, in SI units."""
    rows = []
    for pair in found:
        row = {"quantity": pair.name, "unit": pair.unit, "from [s]": pair.time[0], "to [s]": pair.time[-1], "readings": len(pair.time)}
        for name, values in pair.rows().items():
            row |= {f"{name}, {kind}": value for kind, value in zip(("computed", "measured", "difference"), values)}
        rows.append(row | {"rms": pair.rms()})
    import pandas as pd

    return pd.DataFrame(rows)


def picture(run: Run, found: list[Pair]) -> Figure:
    """Computed curves, pale in all their rows, and measured ones as dots; all thermocouples share a panel."""
    panels: dict[str, list[Pair]] = {}
    for pair in found:
        panels.setdefault("temperature" if pair.unit == "K" else units.words(pair.name), []).append(pair)
    figure = look.new_figure(9.6, 0.8 + 2.6 * len(panels))
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (title, group) in zip(axes, panels.items()):
        factor, unit = units.scaled(max(float(np.abs(pair.measured).max()) for pair in group), group[0].unit)
        for pair, colour in zip(group, look.line_colours(len(group))):
            whole = next(t for t in (run.history, run.probes) if pair.name in t)
            axis.plot(whole["time"], factor * whole[pair.name], color=colour, linewidth=0.6, alpha=0.35)
            axis.plot(pair.time, factor * pair.computed, color=colour, label=f"{units.words(pair.name)}, computed")
            axis.plot(pair.time, factor * pair.measured, ".", markersize=4, color=colour if len(group) > 1 else look.LINES[1],
                      label="measured")
        curves.finish(axis, f"{title} [{unit}]")
        curves.beside(axis, 2 * len(group), offset=1.01)
    axes[-1].set_xlabel("time of the run [s]")
    return figure
