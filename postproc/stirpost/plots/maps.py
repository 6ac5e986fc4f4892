# SPDX-License-Identifier: MIT
"""Top views and sections of a field at several times on one colour scale."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from scipy.spatial import cKDTree

from ..analysis import surface, units
from ..analysis.tools import main_tool
from ..io.frames import Frame
from ..io.mesh import Mesh, loops, welded
from . import look
from .views import from_above

if TYPE_CHECKING:
    from ..run import Run

FIELDS = ("temperature", "plastic_strain", "grain_size")
NEIGHBOURS = 16  # particles around a pixel that its value is a mean of
PIXELS = 600  # along the longer side of the plate
REACH = 3.0  # of particles to the plane that they colour, in spacings: those farther off weigh nothing
STRAINS = 0.1, 50.0  # of the logarithmic scale


@dataclass
class View:
    """One picture: of a section the particles around its pixels, from above the surface."""

    frame: Frame
    low: np.ndarray  # of the whole scene (3) [m]
    high: np.ndarray
    title: str
    mesh: Mesh
    axis: int = 2  # normal to the picture; 2: from above
    at: float = 0.0  # where the plane is along it [m]
    shape: tuple[int, int] = (0, 0)
    inside: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))  # pixels in metal (rows, columns)
    near: np.ndarray = field(default_factory=lambda: np.zeros((0, NEIGHBOURS), dtype=int))  # particles around these pixels
    weight: np.ndarray = field(default_factory=lambda: np.zeros((0, NEIGHBOURS)))  # of these in the value of a pixel
    outline: list[np.ndarray] = field(default_factory=list)  # of the metal [m]
    tool: list[np.ndarray] = field(default_factory=list)  # its outline [m]

    @property
    def across(self) -> list[int]:
        return [k for k in range(3) if k != self.axis]

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """left, right, bottom, top [mm], as matplotlib's imshow takes it."""
        i, j = self.across
        return units.MM * self.low[i], units.MM * self.high[i], units.MM * self.low[j], units.MM * self.high[j]

    def values(self, name: str) -> np.ndarray:
        """A field on the pixels of a section, NaN outside of the metal."""
        return self.spread(look.shown(name, self.frame.need(name)))

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Values of the particles on the pixels."""
        picture = np.full(self.shape, np.nan)
        picture[self.inside] = (values[self.near] * self.weight).sum(axis=1)
        return picture


@dataclass
class Scene:
    """The chosen frames seen from above, across the track and along it."""

    top: list[View] = field(default_factory=list)
    cross: list[View] = field(default_factory=list)
    along: list[View] = field(default_factory=list)
    follows: str = ""  # what the sections go through


AXES = {"top": ("x [mm]", "y [mm]"), "cross": ("y [mm]", "z [mm]"), "along": ("x [mm]", "z [mm]")}


def fields_of(frame: Frame) -> list[str]:
    return [name for name in FIELDS if name in frame.fields]


def choose_frames(frames: list[Frame], most: int = 4) -> list[Frame]:
    """The first, the last and some evenly between."""
    picks = np.unique(np.linspace(0, len(frames) - 1, min(most, len(frames))).round().astype(int))
    return [frames[k] for k in picks]


def build_scene(run: Run, frames: list[Frame]) -> Scene:
    """All views of the frames; sections follow the tool."""
    clouds = [frame.points() for frame in frames]
    low, high = common_box(clouds, 2 * run.spacing)
    scene = Scene()
    places, scene.follows = section_positions(run, frames, clouds)
    for frame, points, place in zip(frames, clouds, places):
        mesh = surface.metal(run, frame, fields_of(frame))
        when = f"t = {units.seconds(frame.time)}"
        tool = run.tool_mesh(frame)
        scene.top.append(View(frame, low, high, when, mesh, tool=[] if tool is None else surface.silhouette(tool)))
        for views, axis, name in ((scene.cross, 0, "x"), (scene.along, 1, "y")):
            title = f"{when},  {name} = {place[axis] * units.MM:.1f} mm"
            views.append(section(View(frame, low, high, title, mesh, axis), points, place[axis], run.spacing))
            views[-1].tool = tool_cut(tool, axis, place[axis])
    return scene


def section(view: View, points: np.ndarray, at: float, spacing: float, pixels: int | None = None) -> View:
    """The plane where coordinate `axis` is `at`, z up. The surface says what is metal; values are means of the
    nearest particles, weighted by a Gaussian of three quarters of a particle. The longer side of the plate has `pixels`."""
    view.at = at
    i, j = view.across
    size = view.high - view.low
    pixel = size[:2].max() / (pixels or PIXELS)
    columns, rows = (max(8, int(round(size[k] / pixel))) for k in (i, j))
    view.shape, view.outline = (rows, columns), loops(view.mesh, view.axis, at)
    odd = np.zeros((rows, columns + 1), dtype=np.int64)  # lines crossed from the left
    for line in view.outline:
        count_crossings(odd, (line - view.low[[i, j]]) / (size[[i, j]] / [columns, rows]))
    view.inside = np.cumsum(odd, axis=1)[:, :-1] % 2 == 1
    row, column = np.nonzero(view.inside)
    there = np.empty((len(row), 3))
    there[:, view.axis] = at
    there[:, i] = view.low[i] + (column + 0.5) * size[i] / columns
    there[:, j] = view.low[j] + (row + 0.5) * size[j] / rows
    nearby = np.flatnonzero(np.abs(points[:, view.axis] - at) <= REACH * spacing)
    nearby = nearby if len(nearby) >= NEIGHBOURS else np.arange(len(points))
    near, view.weight = weights(there, points[nearby], spacing)
    view.near = nearby[near]
    return view


def weights(there: np.ndarray, points: np.ndarray, spacing: float, most: int = NEIGHBOURS) -> tuple[np.ndarray, np.ndarray]:
    """The nearest points around places, and their weights: a Gaussian of three quarters of a particle."""
    count = min(most, len(points))
    away, near = cKDTree(points).query(there, k=count)
    away, near = away.reshape(-1, count), near.reshape(-1, count)
    weight = np.exp(-((away**2 - away[:, :1] ** 2) / (0.75 * spacing) ** 2))
    return near, weight / weight.sum(axis=1, keepdims=True)


def count_crossings(odd: np.ndarray, line: np.ndarray) -> None:
    """Count each crossing of a closed line, in pixels, with the middle of a row at the first pixel whose middle is to its right."""
    (u, v), (w, x) = line[:-1].T, line[1:].T
    low, high = np.ceil(np.minimum(v, x) - 0.5).astype(int), np.ceil(np.maximum(v, x) - 0.5).astype(int)
    low, high = low.clip(0, len(odd)), high.clip(0, len(odd))
    segment = np.repeat(np.arange(len(u)), high - low)
    row = np.arange(len(segment)) - np.repeat(np.cumsum(high - low) - (high - low) - low, high - low)
    at = u[segment] + (row + 0.5 - v[segment]) * (w - u)[segment] / (x - v)[segment]
    np.add.at(odd, (row, np.ceil(at - 0.5).astype(int).clip(0, odd.shape[1] - 1)), 1)


def common_box(clouds: list[np.ndarray], margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners that hold all clouds but for a few stray particles."""
    low = np.min([np.percentile(cloud, 0.01, axis=0) for cloud in clouds], axis=0) - margin
    high = np.max([np.percentile(cloud, 99.99, axis=0) for cloud in clouds], axis=0) + margin
    return low, high


def section_positions(run: Run, frames: list[Frame], clouds: list[np.ndarray]) -> tuple[list[np.ndarray], str]:
    """x and y of the sections at each frame [m], and what they go through: the tool at that time if the history
    tells where it is. Else x is that of the hottest place; where all is equally warm, that of the next frame, in the
    end the middle of the plate; and y that of the middle."""
    tool = main_tool(run.history)
    if tool is not None:
        places = [tool.place(frame.time)[:2] for frame in frames]
        follows = f"the axis of {units.words(tool.name)}" if tool.name != "tool" else "the axis of the tool"
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
    inner = []  # at an end the surface is round, a particle's size
    for place, points in zip(places, clouds):
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        edge = np.minimum(2.0 * run.spacing, 0.25 * (high - low))
        inner.append(np.clip(place, low + edge, high - edge))
    return inner, follows


def hottest_place(x: np.ndarray, temperature: np.ndarray) -> float | None:
    """Median x of the hottest thousandth; None if the field is uniform to a kelvin."""
    temperature = np.nan_to_num(temperature, nan=-np.inf)
    if np.ptp(temperature[np.isfinite(temperature)]) < 1.0:
        return None
    count = max(5, len(x) // 1000)
    return float(np.median(x[np.argsort(temperature)[-count:]]))


def tool_cut(tool: Mesh | None, axis: int, at: float) -> list[np.ndarray]:
    """Outlines of the tools in a section."""
    return [] if tool is None else loops(welded(tool)[0], axis, at)


def field_map(views: list[View], kind: str, name: str, label: str, colours: Colormap, norm: Normalize, extend: str = "neither") -> Figure:
    """All views of one kind in one figure with one colour bar, at one scale for all kinds: sections along the plate fit the page, and two
    across it."""
    figure, axes, strip = panels(views, kind)
    for axis, view in zip(axes, views):
        draw(axis, view, name, colours, norm)
        axis.set_title(view.title, loc="left", pad=3)
    look.colour_bar(figure, norm, colours, strip, label, extend)
    return figure


def panels(views: list[View], kind: str, bar: bool = True, below: float = look.BELOW) -> tuple[Figure, list[Axes], Axes | None]:
    """Figure, axes and the axis of the colour bar; `below`: room under the axes [inches]."""
    left, right, bottom, top = views[0].extent
    length, breadth, _ = (views[0].high - views[0].low) * units.MM
    room = look.WIDTH - look.LEFT - look.BAR
    scale = min(room / length, 0.5 * (room - look.GAP) / breadth) * (1.0 - 1e-9)
    if kind == "top" and len(views) > 1 and length < 4.0 * breadth:
        scale = 0.5 * (room - look.GAP) / length * (1.0 - 1e-9)
    figure, axes, strip = look.panels(len(views), (right - left, top - bottom), scale, bar, below=below)
    for axis in axes:
        axis.set_xlabel(AXES[kind][0] if axis.xaxis.get_tick_params()["labelbottom"] else "")
        axis.set_ylabel(AXES[kind][1] if axis.yaxis.get_tick_params()["labelleft"] else "")
    return figure, axes, strip


def body_map(view: View, kind: str) -> Figure:
    """Which body is where in a section, with a legend of their names."""
    names = view.frame.body_names
    picture = np.full(view.shape, np.nan)
    picture[view.inside] = view.frame.bodies()[view.near[:, 0]]
    figure, (axis,), _ = panels([view], kind, bar=False, below=look.BELOW + 0.3)
    colours = look.line_colours(len(names))
    axis.imshow(picture, origin="lower", extent=view.extent, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(names) - 0.5,
                interpolation="nearest", aspect="auto")
    draw_tool(axis, view.tool)
    axis.set_xlim(view.extent[:2])
    axis.set_ylim(view.extent[2:])
    axis.set_facecolor(look.PAPER)
    axis.set_title(view.title, loc="left", pad=3)
    figure.legend(handles=[Patch(color=c, label=n.strip()) for c, n in zip(colours, names)], loc="lower right", ncols=4, frameon=False, borderaxespad=0.2)
    return figure


def draw(axis: Axes, view: View, name: str, colours: Colormap, norm: Normalize) -> None:
    if view.axis == 2:
        figure = axis.figure
        corners = axis.get_position().transformed(figure.transFigure).get_points()
        left, bottom, right, top = np.round(corners).astype(int).ravel()
        picture = from_above(view.mesh, name, norm, colours, view.low, view.high, right - left)
        figure.figimage(picture[::-1], left, bottom, origin="lower", zorder=-1)  # a pixel for a pixel
        axis.patch.set_visible(False)
    else:
        draw_section(axis, view, view.values(name), colours, norm)
    draw_tool(axis, view.tool)
    axis.set_xlim(view.extent[:2])
    axis.set_ylim(view.extent[2:])


def draw_tool(axis: Axes, outline: list[np.ndarray]) -> None:
    """Dark on light, so that it is seen on metal of any colour."""
    for colour, width in (("#ffffffb0", 2.6), ("#14233a", 1.3)):
        axis.add_collection(LineCollection([line * units.MM for line in outline], colors=colour, linewidths=width))


def draw_section(axis: Axes, view: View, values: np.ndarray, colours: Colormap, norm: Normalize) -> None:
    """Values on the pixels of a section, and the outline of the metal."""
    axis.imshow(values, origin="lower", extent=view.extent, cmap=colours, norm=norm, interpolation="nearest", aspect="auto")
    axis.add_collection(LineCollection([line * units.MM for line in view.outline], colors=look.INK, linewidths=0.5))
    axis.set_xlim(view.extent[:2])
    axis.set_ylim(view.extent[2:])
    axis.set_facecolor(look.PAPER)


def temperature_norm(frames: list[Frame]) -> Normalize:
    low, high = (look.shown("temperature", value) for value in bounds(frames, "temperature", 99.995))
    return Normalize(low, max(high, low + 1.0))


def strain_norm(frames: list[Frame]) -> Normalize:
    """Logarithmic up to 50, or to the largest strain where that is less: the edge of the stir zone is seen, and a layer of a particle
    at the face of the tool, whose strain may be thousands, does not hide it."""
    return strain_norm_of(np.array([np.nanmax(frame.need("plastic_strain"), initial=0.0) for frame in frames]))


def strain_norm_of(strain: np.ndarray) -> Normalize:
    largest = float(np.nanmax(strain, initial=0.0))
    return LogNorm(STRAINS[0], float(np.clip(largest, 10 * STRAINS[0], STRAINS[1])), clip=True)


def size_norm(frames: list[Frame]) -> Normalize:
    """Grain sizes, which are above 0 where a law has them, by their logarithm."""
    values = np.concatenate([frame.need("grain_size") for frame in frames])
    values = values[np.isfinite(values) & (values > 0.0)]
    low, high = (values.min(), values.max()) if values.size else (1e-7, 1e-5)
    return LogNorm(float(low), float(max(high, 1.01 * low)))


def bounds(frames: list[Frame], name: str, percent: float) -> tuple[float, float]:
    lows, highs = [], []
    for frame in frames:
        values = frame.need(name)
        values = values[np.isfinite(values)]
        if values.size:
            lows.append(np.percentile(values, 100 - percent))
            highs.append(np.percentile(values, percent))
    return (float(min(lows)), float(max(highs))) if lows else (0.0, 1.0)
