# SPDX-License-Identifier: MIT
"""Top views and sections of a field at several times on one colour scale."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from . import look, raster
from .run import Frame, Run


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


AXES = {"top": ("x [mm]", "y [mm]"), "cross": ("y [mm]", "z [mm]"), "along": ("x [mm]", "z [mm]")}


def choose_frames(frames: list[Frame], most: int = 4) -> list[Frame]:
    """The first, the last and some evenly between."""
    picks = np.unique(np.linspace(0, len(frames) - 1, min(most, len(frames))).round().astype(int))
    return [frames[k] for k in picks]


def build_scene(run: Run, frames: list[Frame]) -> Scene:
    """Rasters of all views of the frames; sections across follow the tool."""
    clouds = [frame.points() for frame in frames]
    low, high = raster.common_box(clouds, 2 * run.spacing)
    middle = 0.5 * (clouds[0][:, 1].min() + clouds[0][:, 1].max())
    scene = Scene()
    for frame, points, place in zip(frames, clouds, tool_places(run, frames, clouds)):
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


def tool_places(run: Run, frames: list[Frame], clouds: list[np.ndarray]) -> list[float]:
    """x of the section across at each frame [m]: the tool's, if the history tells it, else the
    hottest place; where all is equally warm, the place of the next frame, in the end the middle of
    the plate.
    """
    places = []
    for frame, points in zip(frames, clouds):
        place = tool_from_history(run, frame.time)
        temperature = frame.field("temperature")
        if place is None and temperature is not None and np.isfinite(temperature).any():
            place = hottest_place(points[:, 0], temperature)
        places.append(place)
    middle = 0.5 * (clouds[0][:, 0].min() + clouds[0][:, 0].max())
    following = middle
    known = [place for place in places if place is not None]
    if known:
        following = known[-1]
    for k in reversed(range(len(places))):
        if places[k] is None:
            places[k] = following
        following = places[k]
    return [
        float(np.clip(place, points[:, 0].min(), points[:, 0].max()))
        for place, points in zip(places, clouds)
    ]


def tool_from_history(run: Run, time: float) -> float | None:
    if run.history is None or "time" not in run.history:
        return None
    tools = [c.name[: -len("_torque")] for c in run.history.matching(r".+_torque")]
    for name in (f"{tool}_x" for tool in tools):
        if name in run.history and run.history.unit(name) == "m":
            return float(np.interp(time, run.history["time"], run.history[name]))
    return None


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
