# SPDX-License-Identifier: MIT
"""Pathlines of the tracers of a run (&TRACER): pictures from the top, the side and along x, and lines for VTK.

usage: stirpost tracks RUN_DIRECTORY [--group NAME ...] [--colour origin time temperature] [--until T] [-o DIR]

Coloured by origin (the group, or with one group the place it starts from across the travel), by time or by temperature;
a dot is where a tracer is at the end. The outline is that of the metal at the start, dashed that of its cavities.
Written to DIR (default RUN_DIRECTORY/report): tracks_origin.png, tracks_time.png, tracks_temperature.png, and tracks.vtp:
a line a tracer with time[s], temperature[K], plastic_strain at its points, and its group, number, id and place of
origin (origin_x, _y, _z [m]).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from . import look
from .run import NoRun, Run
from .scene import cavity_of
from .table import read_frame

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("time", "group", "tracer", "id", "x", "y", "z", "temperature", "plastic_strain")
COLOURS = {"origin": "origin", "time": "time [s]", "temperature": "temperature [K]"}
# Title, axis to the right, axis upwards.
VIEWS = (("from the top", 0, 1), ("from the side", 0, 2), ("along x", 2, 1))
SAMPLES = 400  # along each axis, for the outline of a cavity


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost tracks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--group", nargs="+", metavar="NAME", help="of these &TRACER only")
    parser.add_argument("--colour", nargs="+", choices=COLOURS, default=list(COLOURS), help="(default: all three)")
    parser.add_argument("--until", type=float, help="[s]")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    run = Run(options.run)
    tracks = run.tracks(options.group, options.until)
    output = options.output or options.run / "report"
    output.mkdir(parents=True, exist_ok=True)
    written = []
    with look.style():
        for colour in options.colour:
            written.append(look.save(picture(run, tracks, colour), output / f"tracks_{colour}.png"))
    polydata(tracks).save(output / "tracks.vtp")
    written.append(output / "tracks.vtp")
    print(f"{len(tracks.ends)} tracers of {', '.join(tracks.groups)}: {', '.join(str(path) for path in written)}")
    return 0


@dataclass
class Tracks:
    """Tracers one after the other, each in the order of time."""

    frame: pd.DataFrame  # columns as the headings of NAME_tracers.csv without units
    begins: np.ndarray  # first row of each tracer
    ends: np.ndarray  # row after its last one
    groups: list[str]

    @classmethod
    def read(cls, run: Run, wanted: list[str] | None = None, until: float | None = None) -> "Tracks":
        path = run.directory / f"{run.name}_tracers.csv"
        if not path.exists():
            raise NoRun(f"{run.directory}: no {path.name}: the input has no &TRACER")
        faults: list[str] = []
        frame = read_frame(path, faults, COLUMNS, words=("group", "body"))[0].dropna()
        for text in faults:
            run.warn(text)
        there = list(dict.fromkeys(frame["group"]))
        missing = [name for name in wanted or [] if name not in there]
        if missing:
            raise NoRun(f"{path}: no group {', '.join(missing)}; there are: {', '.join(there)}")
        frame = frame[frame["group"].isin(wanted or there)]
        if until is not None:
            frame = frame[frame["time"] <= until * (1 + 1e-9)]
        if frame.empty:
            raise NoRun(f"{path}: no rows")
        frame = frame.sort_values(["tracer", "time"], kind="stable").drop_duplicates(["tracer", "time"], keep="last").reset_index(drop=True)
        begins = np.flatnonzero(np.diff(frame["tracer"], prepend=-1) != 0)
        return cls(frame, begins, np.append(begins[1:], len(frame)), [name for name in there if name in set(frame["group"])])

    @property
    def places(self) -> np.ndarray:
        """(n, 3) [m]"""
        return self.frame[["x", "y", "z"]].to_numpy()

    def spread(self, values: np.ndarray) -> np.ndarray:
        """A value a tracer to all its rows."""
        return np.repeat(values, self.ends - self.begins)


def polydata(tracks: Tracks):
    """A line a tracer."""
    import pyvista as pv

    counts = tracks.ends - tracks.begins
    lines = np.concatenate([np.append(n, np.arange(a, a + n)) for a, n in zip(tracks.begins, counts)])
    mesh = pv.PolyData(tracks.places, lines=lines)
    for name in ("time", "temperature", "plastic_strain"):
        mesh.point_data[name] = tracks.frame[name].to_numpy()
    first = tracks.frame.iloc[tracks.begins]
    mesh.cell_data["group"] = [tracks.groups.index(name) for name in first["group"]]
    mesh.cell_data["tracer"], mesh.cell_data["id"] = first["tracer"].to_numpy(), first["id"].to_numpy()
    for axis in "xyz":
        mesh.cell_data[f"origin_{axis}"] = first[axis].to_numpy()
    mesh.field_data["group_names"] = tracks.groups
    return mesh


def picture(run: Run, tracks: Tracks, colour: str):
    """The three views; lines in the order of their numbers."""
    import matplotlib
    from matplotlib.collections import LineCollection

    x = tracks.places * look.MM
    low, high, cavity = bounds(run, x)
    wide, deep, tall = np.maximum(np.ptp(np.vstack([x, low, high]), axis=0), 1.0)
    figure = look.new_figure(10.0, 7.6 * (deep + tall) / (wide + tall) + 1.9)
    panels = figure.subplot_mosaic([["from the top", "along x"], ["from the side", "."]], width_ratios=[wide, tall],
                                   height_ratios=[deep, tall])
    inner = np.setdiff1d(np.arange(len(x) - 1), tracks.ends - 1)
    values, norm, shown = coloured(tracks, colour)
    for title, across, up in VIEWS:
        panel = panels[title]
        segments = np.stack([x[inner][:, [across, up]], x[inner + 1][:, [across, up]]], axis=1)
        lines = LineCollection(segments, array=values[inner], cmap=shown, norm=norm, linewidths=0.8)
        panel.add_collection(lines)
        last = tracks.ends - 1
        panel.plot(x[last, across], x[last, up], ".", color=look.INK, markersize=2.5)
        panel.add_patch(matplotlib.patches.Rectangle((low[across], low[up]), high[across] - low[across], high[up] - low[up],
                                                     fill=False, edgecolor="#8a96a3", linewidth=0.8))
        if cavity is not None:
            outline(panel, cavity, across, up)
        panel.set_aspect("equal")
        panel.margins(0.02)
        panel.autoscale_view()
        panel.set_title(title)
        panel.set_xlabel(f"{'xyz'[across]} [mm]")
        panel.set_ylabel(f"{'xyz'[up]} [mm]")
    if colour == "origin" and len(tracks.groups) > 1:
        handles = [matplotlib.lines.Line2D([], [], color=shown(norm(k)), label=look.words(name)) for k, name in enumerate(tracks.groups)]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    else:
        label = "y at the start [mm]" if colour == "origin" else COLOURS[colour]
        figure.colorbar(lines, ax=list(panels.values()), label=label)
    return figure


def coloured(tracks: Tracks, colour: str):
    """Value of each row, norm and map."""
    import matplotlib

    if colour == "origin" and len(tracks.groups) > 1:
        number = tracks.frame["group"].map({name: k for k, name in enumerate(tracks.groups)}).to_numpy(dtype=float)
        shown = matplotlib.colors.ListedColormap(look.line_colours(len(tracks.groups)))
        return number, matplotlib.colors.Normalize(-0.5, len(tracks.groups) - 0.5), shown
    values = tracks.spread(tracks.frame["y"].to_numpy()[tracks.begins]) * look.MM if colour == "origin" else tracks.frame[colour].to_numpy()
    shown = {"origin": look.STRAIN, "time": matplotlib.colormaps["viridis"], "temperature": look.TEMPERATURE}[colour]
    low, high = float(values.min()), float(values.max())
    return values, matplotlib.colors.Normalize(low, high if high > low else low + 1.0), shown


def bounds(run: Run, x: np.ndarray):
    """Corners [mm] of the metal that is not a tool's at the start, or of the tracers without frames; its cavity."""
    if not run.frames:
        return x.min(axis=0), x.max(axis=0), None
    half = 0.5 * run.spacing
    points = run.frames[0].points()
    cavity = cavity_of(run.scene, run.frames[0].body_names)
    return (points.min(axis=0) - half) * look.MM, (points.max(axis=0) + half) * look.MM, cavity


def outline(panel, cavity, across: int, up: int) -> None:
    """The shadow of a cavity."""
    third = 3 - across - up
    axes = [np.linspace(a - 1e-4, b + 1e-4, SAMPLES) for a, b in zip(cavity.low, cavity.high)]
    mesh = np.meshgrid(axes[across], axes[up], indexing="ij")
    shadow = np.zeros(mesh[0].size, dtype=bool)
    for part in (np.arange(24) + 0.5) / 24:
        x = np.empty((mesh[0].size, 3))
        x[:, across], x[:, up] = mesh[0].ravel(), mesh[1].ravel()
        x[:, third] = cavity.low[third] + part * (cavity.high[third] - cavity.low[third])
        shadow |= cavity.holds(x)
    panel.contour(axes[across] * look.MM, axes[up] * look.MM, shadow.reshape(mesh[0].shape).T.astype(float), [0.5],
                  colors="#8a96a3", linestyles="dashed", linewidths=0.8)
