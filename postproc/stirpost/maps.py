# SPDX-License-Identifier: MIT
"""Top views and sections of a field at several times on one colour scale."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pyvista as pv
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.path import Path as Outline
from scipy.spatial import cKDTree

from . import look, surface
from .run import Frame, Run
from .tools import main_tool

FIELDS = ("temperature", "plastic_strain", "grain_size")
NEIGHBOURS = 16  # particles around a pixel that its value is a mean of
PIXELS = 700  # along a section


@dataclass
class View:
    """One picture: of a section the particles around its pixels, from above the surface."""

    frame: Frame
    low: np.ndarray  # of the whole scene (3) [m]
    high: np.ndarray
    title: str
    mesh: pv.PolyData
    axis: int = 2  # normal to the picture
    shape: tuple[int, int] = (0, 0)
    inside: np.ndarray | None = None  # pixels in metal (rows, columns)
    near: np.ndarray | None = None  # particles around these pixels (m, NEIGHBOURS)
    weight: np.ndarray | None = None
    outline: list[np.ndarray] = field(default_factory=list)  # of the metal [m]
    tool: list[np.ndarray] = field(default_factory=list)  # its outline [m]

    @property
    def across(self) -> list[int]:
        return [k for k in range(3) if k != self.axis]

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """left, right, bottom, top [mm], as matplotlib's imshow takes it."""
        i, j = self.across
        return tuple(look.MM * x for x in (self.low[i], self.high[i], self.low[j], self.high[j]))

    def values(self, name: str) -> np.ndarray:
        """A field on the pixels of a section, NaN outside of the metal."""
        picture = np.full(self.shape, np.nan)
        picture[self.inside] = (self.frame.field(name)[self.near] * self.weight).sum(axis=1)
        return picture


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
    """All views of the frames; sections follow the tool."""
    clouds = [frame.points() for frame in frames]
    low, high = common_box(clouds, 2 * run.spacing)
    scene = Scene()
    places, scene.follows = section_places(run, frames, clouds)
    for frame, points, place in zip(frames, clouds, places):
        mesh = surface.metal(run, frame, [name for name in FIELDS if name in frame.fields])
        when = f"t = {look.seconds(frame.time)}"
        tool = run.tools(frame)
        scene.top.append(View(frame, low, high, when, mesh, tool=[] if tool is None else surface.silhouette(tool)))
        for views, axis, name in ((scene.cross, 0, "x"), (scene.along, 1, "y")):
            title = f"{when},  {name} = {place[axis] * look.MM:.1f} mm"
            views.append(section(View(frame, low, high, title, mesh, axis), points, place[axis], run.spacing))
            views[-1].tool = [] if tool is None else surface.loops(tool.clean(), axis, place[axis])
    return scene


def section(view: View, points: np.ndarray, at: float, spacing: float) -> View:
    """The plane where coordinate `axis` is `at`, z up. The surface says what is metal; values are means of the
    nearest particles, weighted by a Gaussian of three quarters of a particle."""
    i, j = view.across
    size = view.high - view.low
    pixel = size[i] / PIXELS
    columns, rows = PIXELS, max(8, int(round(size[j] / pixel)))
    view.shape, view.outline = (rows, columns), surface.loops(view.mesh, view.axis, at)
    middles = np.empty((rows, columns, 3))
    middles[..., view.axis] = at
    middles[..., i] = view.low[i] + (np.arange(columns) + 0.5) * pixel
    middles[..., j] = (view.low[j] + (np.arange(rows) + 0.5) * size[j] / rows)[:, None]
    flat = middles.reshape(-1, 3)
    odd = np.zeros(len(flat), dtype=bool)  # inside of an odd number of lines
    for line in view.outline:
        odd ^= Outline(line).contains_points(flat[:, [i, j]])
    count = min(NEIGHBOURS, len(points))
    away, near = cKDTree(points).query(flat[odd], k=count)
    away, near = away.reshape(-1, count), near.reshape(-1, count)
    weight = np.exp(-((away**2 - away[:, :1] ** 2) / (0.75 * spacing) ** 2))
    view.inside, view.near = odd.reshape(rows, columns), near
    view.weight = weight / weight.sum(axis=1, keepdims=True)
    return view


def common_box(clouds: list[np.ndarray], margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners that hold all clouds but for a few stray particles."""
    low = np.min([np.percentile(cloud, 0.01, axis=0) for cloud in clouds], axis=0) - margin
    high = np.max([np.percentile(cloud, 99.99, axis=0) for cloud in clouds], axis=0) + margin
    return low, high


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
    colours: Colormap,
    norm: Normalize,
    extend: str = "neither",
) -> Figure:
    """All views of a kind in one figure with one colour bar."""
    left, right, bottom, top = views[0].extent
    aspect = (right - left) / (top - bottom)
    columns = 1 if len(views) == 1 or aspect > 4 else 2
    rows = -(-len(views) // columns)
    panel = 9.3 / columns
    figure = look.new_figure(10.8, rows * (panel / aspect + 0.28) + 0.38)
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axis, view in zip(axes.flat, views):
        draw(axis, view, name, colours, norm)
        axis.set_title(view.title, loc="left", pad=3)
    for axis in list(axes.flat)[len(views) :]:
        axis.set_visible(False)
    for axis in axes[-1, :]:
        axis.set_xlabel(AXES[kind][0])
    for axis in axes[:, 0]:
        axis.set_ylabel(AXES[kind][1])
    figure.colorbar(ScalarMappable(norm, colours), ax=axes, label=label, extend=extend, fraction=0.04, pad=0.012, aspect=26,
                    shrink=0.95)
    return figure


def body_map(view: View, kind: str) -> Figure:
    """Which body is where in a section, with a legend of their names."""
    names = view.frame.body_names
    picture = np.full(view.shape, np.nan)
    picture[view.inside] = view.frame.bodies()[view.near[:, 0]]
    left, right, bottom, top = view.extent
    figure = look.new_figure(10.8, 9.3 * (top - bottom) / (right - left) + 0.9)
    axis = figure.add_subplot()
    colours = look.line_colours(len(names))
    axis.imshow(picture, origin="lower", extent=view.extent, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(names) - 0.5,
                interpolation="nearest", aspect="equal")
    axis.add_collection(LineCollection([line * look.MM for line in view.tool], colors="#14233a", linewidths=1.3))
    axis.set_facecolor(look.PAPER)
    axis.set_xlabel(AXES[kind][0])
    axis.set_ylabel(AXES[kind][1])
    axis.set_title(view.title, loc="left", pad=3)
    axis.legend(handles=[Patch(color=c, label=n.strip()) for c, n in zip(colours, names)], loc="upper right", ncols=4,
                bbox_to_anchor=(1.0, 1.14), borderaxespad=0.0)
    return figure


def draw(axis, view: View, name: str, colours: Colormap, norm: Normalize) -> None:
    if view.inside is None:
        axis.imshow(surface.from_above(view.mesh, name, norm, colours, view.low, view.high), extent=view.extent)
    else:
        axis.imshow(view.values(name), origin="lower", extent=view.extent, cmap=colours, norm=norm,
                    interpolation="antialiased", aspect="equal")
        axis.add_collection(LineCollection([line * look.MM for line in view.outline], colors=look.INK, linewidths=0.5))
    axis.add_collection(LineCollection([line * look.MM for line in view.tool], colors="#14233a", linewidths=1.3))
    axis.set_xlim(view.extent[:2])
    axis.set_ylim(view.extent[2:])
    axis.set_facecolor(look.PAPER)


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
