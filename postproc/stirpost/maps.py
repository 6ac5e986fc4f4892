# SPDX-License-Identifier: MIT
"""Top views and sections of a field at several times on one colour scale."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from . import look, raster
from .run import Frame, Run
from .tools import main_tool


@dataclass
class View:
    """One picture of particle numbers and where it lies."""

    frame: Frame
    index: np.ndarray
    grid: raster.Grid
    title: str


@dataclass
class Scene:
    """The chosen frames seen from above, across the track and along it."""

    top: list[View] = field(default_factory=list)
    cross: list[View] = field(default_factory=list)
    along: list[View] = field(default_factory=list)
    follows: str = ""  # what the sections go through


AXES = {"top": ("x [mm]", "y [mm]"), "cross": ("y [mm]", "z [mm]"), "along": ("x [mm]", "z [mm]")}


def choose_frames(frames: list[Frame], most: int = 4) -> list[Frame]:
    """The first, the last and some evenly between."""
    picks = np.unique(np.linspace(0, len(frames) - 1, min(most, len(frames))).round().astype(int))
    return [frames[k] for k in picks]


def build_scene(run: Run, frames: list[Frame]) -> Scene:
    """Rasters of all views of the frames; sections follow the tool."""
    clouds = [frame.points() for frame in frames]
    low, high = raster.common_box(clouds, 2 * run.spacing)
    scene = Scene()
    places, scene.follows = section_places(run, frames, clouds)
    for frame, points, (place, middle) in zip(frames, clouds, places):
        when = f"t = {look.seconds(frame.time)}"
        scene.top.append(View(frame, *raster.top_view(points, run.spacing, low, high), when))
        scene.cross.append(
            View(
                frame,
                *raster.section(points, run.spacing, 0, place, low, high),
                f"{when},  x = {place * look.MM:.1f} mm",
            )
        )
        scene.along.append(
            View(
                frame,
                *raster.section(points, run.spacing, 1, middle, low, high),
                f"{when},  y = {middle * look.MM:.1f} mm",
            )
        )
    return scene


def section_places(run: Run, frames: list[Frame], clouds: list[np.ndarray]) -> tuple[list, str]:
    """x and y of the sections at each frame [m], and what they go through: the tool at that time if the history
    tells where it is. Else x is that of the hottest place; where all is equally warm, that of the next frame, in the
    end the middle of the plate; and y that of the middle."""
    tool = main_tool(run.history)
    if tool is not None:
        places = [tool.place(frame.time)[:2] for frame in frames]
        follows = f"the axis of {look.words(tool.name)}" if tool.name != "tool" else "the axis of the tool"
    else:
        hottest = []
        for frame, points in zip(frames, clouds):
            temperature = frame.field("temperature")
            warm = temperature is not None and np.isfinite(temperature).any()
            hottest.append(hottest_place(points[:, 0], temperature) if warm else None)
        middle = 0.5 * (clouds[0].min(axis=0) + clouds[0].max(axis=0))
        known = [place for place in hottest if place is not None]
        following = known[-1] if known else middle[0]
        for k in reversed(range(len(hottest))):
            if hottest[k] is None:
                hottest[k] = following
            following = hottest[k]
        places = [np.array([x, middle[1]]) for x in hottest]
        follows = "the hottest place" if known else "the middle"
    return [
        np.clip(place, points[:, :2].min(axis=0), points[:, :2].max(axis=0)) for place, points in zip(places, clouds)
    ], follows


def hottest_place(x: np.ndarray, temperature: np.ndarray) -> float | None:
    """Median x of the hottest thousandth; None if the field is uniform to a kelvin."""
    temperature = np.nan_to_num(temperature, nan=-np.inf)
    if np.ptp(temperature[np.isfinite(temperature)]) < 1.0:
        return None
    count = max(5, len(x) // 1000)
    return float(np.median(x[np.argsort(temperature)[-count:]]))


def field_map(
    views: list[View],
    kind: str,
    name: str,
    label: str,
    colours,
    norm: Normalize,
    extend: str = "neither",
) -> Figure:
    """All views of a kind in one figure with one colour bar."""
    left, right, bottom, top = views[0].grid.extent(look.MM)
    aspect = (right - left) / (top - bottom)
    columns = 1 if len(views) == 1 or aspect > 4 else 2
    rows = -(-len(views) // columns)
    panel = 9.3 / columns
    figure = look.new_figure(10.8, rows * (panel / aspect + 0.28) + 0.38)
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axis, view in zip(axes.flat, views):
        values = view.frame.field(name)
        shown = axis.imshow(
            raster.values_on(view.index, values),
            origin="lower",
            extent=view.grid.extent(look.MM),
            cmap=colours,
            norm=norm,
            interpolation="nearest",
            aspect="equal",
        )
        axis.set_facecolor(look.PAPER)
        axis.set_title(view.title, loc="left", pad=3)
    for axis in list(axes.flat)[len(views) :]:
        axis.set_visible(False)
    for axis in axes[-1, :]:
        axis.set_xlabel(AXES[kind][0])
    for axis in axes[:, 0]:
        axis.set_ylabel(AXES[kind][1])
    figure.colorbar(
        shown, ax=axes, label=label, extend=extend, fraction=0.04, pad=0.012, aspect=26, shrink=0.95
    )
    return figure


def temperature_norm(frames: list[Frame]) -> Normalize:
    low, high = bounds(frames, "temperature", 99.995)
    return Normalize(low, max(high, low + 1.0))


def strain_norm(frames: list[Frame]) -> Normalize:
    """A few particles run away: the scale ends at 99.5 % of what yielded."""
    values = np.concatenate([frame.field("plastic_strain") for frame in frames])
    yielded = values[np.isfinite(values) & (values > 1e-3)]
    return Normalize(0.0, float(np.percentile(yielded, 99.5)) if yielded.size else 1.0)


def size_norm(frames: list[Frame]) -> Normalize:
    """Grain sizes, which are above 0 where a law has them, by their logarithm."""
    values = np.concatenate([frame.field("grain_size") for frame in frames])
    values = values[np.isfinite(values) & (values > 0.0)]
    low, high = (values.min(), values.max()) if values.size else (1e-7, 1e-5)
    return LogNorm(float(low), float(max(high, 1.01 * low)))


def bounds(frames: list[Frame], name: str, percent: float) -> tuple[float, float]:
    lows, highs = [], []
    for frame in frames:
        values = frame.field(name)
        values = values[np.isfinite(values)]
        if values.size:
            lows.append(np.percentile(values, 100 - percent))
            highs.append(np.percentile(values, percent))
    return (float(min(lows)), float(max(highs))) if lows else (0.0, 1.0)
