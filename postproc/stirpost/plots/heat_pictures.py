# SPDX-License-Identifier: MIT
"""Pictures of the thermal model of a pass: thermocouples, temperature below the surface, two runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..analysis import units
from ..analysis.cooling import Record
from ..io.frames import Frame
from . import look
from .curves import beside, finish


def thermocouples(record: Record, speed: float, radius: float, length: float, path: Path) -> Path:
    """Thermocouples with the times at which the tool's front and rear pass the ends (figure 4.6)."""
    figure = look.new_figure(9.6, 4.3)
    axis = figure.add_subplot()
    for name, values, colour in zip(record.names, record.values.T, look.line_colours(len(record.names))):
        axis.plot(record.time, values, color=colour, label=name)
    marks = (("front leaves", (length - radius) / speed), ("rear leaves", (length + radius) / speed))
    for text, time in marks:
        if time < record.time[-1]:
            axis.axvline(time, color=look.INK, linewidth=0.8, linestyle="--")
            axis.annotate(text, (time, 1.0), xycoords=("data", "axes fraction"), fontsize=8, rotation=90,
                          va="top", ha="right")
    finish(axis, "temperature [K]")
    axis.set_xlabel("time [s]")
    beside(axis, len(record.names), offset=1.01)
    return look.save(figure, path)


def layer(frame: Frame, depth: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y of the cells and temperature (x, y) at a depth below the top, between two layers of cells; NaN where
    there is no material."""
    points, t = np.asarray(frame.points(), dtype=float), np.asarray(frame.need("temperature"), dtype=float)
    x, y, z = (np.unique(np.round(points[:, a], 8)) for a in range(3))
    field = np.full((len(x), len(y), len(z)), np.nan)
    field[tuple(np.searchsorted(c, np.round(points[:, a], 8)) for a, c in enumerate((x, y, z)))] = t
    top = z[-1] + 0.5 * (z[-1] - z[-2])
    place = top - depth
    k = int(np.clip(np.searchsorted(z, place) - 1, 0, len(z) - 2))
    f = (place - z[k]) / (z[k + 1] - z[k])
    return x, y, (1 - f) * field[:, :, k] + f * field[:, :, k + 1]


def below_surface(frames: list[Frame], times: list[float], depth: float, middle: float, radius: float,
                  position: Callable[[float], float], path: Path) -> Path:
    """The field at a depth at some times, and along the middle and the tool's edges (figure 4.8)."""
    figure = look.new_figure(11.0, 2.9 * len(times))
    axes = figure.subplots(len(times), 2, squeeze=False)
    chosen = [min(frames, key=lambda frame: abs(frame.time - time)) for time in times]
    fields = [layer(frame, depth) for frame in chosen]
    low, high = 298.0, max(np.nanmax(t) for _, _, t in fields)
    for (left, right), frame, (x, y, t) in zip(axes, chosen, fields):
        shown = left.pcolormesh(x * units.MM, y * units.MM, t.T, cmap=look.TEMPERATURE, vmin=low, vmax=high,
                                shading="nearest")
        left.set_aspect("equal")
        left.set_title(f"t = {units.seconds(frame.time)}", loc="left")
        left.set_ylabel("y [mm]")
        for name, place in (("advancing", middle + radius), ("centre", middle), ("retreating", middle - radius)):
            line = np.array([np.interp(place, y, row) for row in t])
            right.plot(x * units.MM, line, label=name)
        for edge in (position(frame.time) - radius, position(frame.time) + radius):
            for axis in (left, right):
                axis.axvline(edge * units.MM, color=look.INK, linewidth=0.8, linestyle="--")
        left.set_xlim(x[0] * units.MM, x[-1] * units.MM)
        right.set_xlim(x[0] * units.MM, x[-1] * units.MM)
        right.set_ylim(low, high + 20)
        finish(right, "temperature [K]")
    axes[0, 1].legend(fontsize=8)
    for axis in axes[-1]:
        axis.set_xlabel("x [mm]")
    figure.colorbar(shown, ax=axes[:, 0], label=f"temperature {depth * units.MM:g} mm below the top [K]", shrink=0.7)
    return look.save(figure, path)


def two_runs(one: Record, other: Record, labels: tuple[str, str], path: Path) -> Path:
    """Thermocouples of two runs and their difference (figure 4.9)."""
    figure = look.new_figure(9.6, 6.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    for k, (name, colour) in enumerate(zip(one.names, look.line_colours(len(one.names)))):
        there = np.interp(one.time, other.time, other.values[:, k])
        upper.plot(one.time, one.values[:, k], color=colour, label=f"{name} {labels[0]}")
        upper.plot(one.time, there, "--", color=colour, label=f"{name} {labels[1]}")
        lower.plot(one.time, there - one.values[:, k], color=colour)
    finish(upper, "temperature [K]")
    finish(lower, "difference [K]")
    lower.set_xlabel("time [s]")
    beside(upper, 2 * len(one.names), offset=1.01)
    return look.save(figure, path)
