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
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import units
from ..analysis.tracks import Tracks, polydata
from ..io.scene import Cavity, cavity_of
from ..plots import look
from ..run import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure

COLOURS = {"origin": "origin", "time": "time [s]", "temperature": "temperature [K]"}
# Title, axis to the right, axis upwards.
VIEWS = (("from the top", 0, 1), ("from the side", 0, 2), ("along x", 2, 1))
SAMPLES = 400  # along each axis, for the outline of a cavity


def main(arguments: list[str] | None = None) -> int:
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


def picture(run: Run, tracks: Tracks, colour: str) -> Figure:
    """The three views; lines in the order of their numbers."""
    import matplotlib
    from matplotlib.collections import LineCollection

    x = tracks.positions * units.MM
    low, high = bounds(run, x)
    cavity = cavity_of(run.scene, run.frames[0].body_names if run.frames else [])
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
        if cavity:
            outline(panel, cavity, across, up)
        panel.set_aspect("equal")
        panel.margins(0.02)
        panel.autoscale_view()
        panel.set_title(title)
        panel.set_xlabel(f"{'xyz'[across]} [mm]")
        panel.set_ylabel(f"{'xyz'[up]} [mm]")
    if colour == "origin" and len(tracks.groups) > 1:
        handles = [matplotlib.lines.Line2D([], [], color=shown(norm(k)), label=units.words(name)) for k, name in enumerate(tracks.groups)]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    else:
        label = "y at the start [mm]" if colour == "origin" else COLOURS[colour]
        figure.colorbar(lines, ax=list(panels.values()), label=label)
    return figure


def coloured(tracks: Tracks, colour: str) -> tuple[np.ndarray, Normalize, Colormap]:
    """Value of each row, norm and map."""
    import matplotlib

    if colour == "origin" and len(tracks.groups) > 1:
        number = tracks.frame["group"].map({name: k for k, name in enumerate(tracks.groups)}).to_numpy(dtype=float)
        shown = matplotlib.colors.ListedColormap(look.line_colours(len(tracks.groups)))
        return number, matplotlib.colors.Normalize(-0.5, len(tracks.groups) - 0.5), shown
    values = tracks.spread(tracks.frame["y"].to_numpy()[tracks.begins]) * units.MM if colour == "origin" else tracks.frame[colour].to_numpy()
    shown = {"origin": look.STRAIN, "time": matplotlib.colormaps["viridis"], "temperature": look.TEMPERATURE}[colour]
    low, high = float(values.min()), float(values.max())
    return values, matplotlib.colors.Normalize(low, high if high > low else low + 1.0), shown


def bounds(run: Run, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners [mm] of the metal at the start, or of the tracers without frames."""
    if not run.frames:
        return x.min(axis=0), x.max(axis=0)
    half = 0.5 * run.spacing
    points = run.frames[0].points()
    return (points.min(axis=0) - half) * units.MM, (points.max(axis=0) + half) * units.MM


def outline(panel: Axes, cavity: Cavity, across: int, up: int) -> None:
    """Draw the outline of a cavity, projected along the third axis."""
    third = 3 - across - up
    axes = [np.linspace(a - 1e-4, b + 1e-4, SAMPLES) for a, b in zip(cavity.low, cavity.high)]
    mesh = np.meshgrid(axes[across], axes[up], indexing="ij")
    shadow = np.zeros(mesh[0].size, dtype=bool)
    for part in (np.arange(24) + 0.5) / 24:
        x = np.empty((mesh[0].size, 3))
        x[:, across], x[:, up] = mesh[0].ravel(), mesh[1].ravel()
        x[:, third] = cavity.low[third] + part * (cavity.high[third] - cavity.low[third])
        shadow |= cavity.holds(x)
    panel.contour(axes[across] * units.MM, axes[up] * units.MM, shadow.reshape(mesh[0].shape).T.astype(float), [0.5],
                  colors="#8a96a3", linestyles="dashed", linewidths=0.8)
