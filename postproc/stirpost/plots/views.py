# SPDX-License-Identifier: MIT
"""Pictures of the metal and the tool in space, in parallel projection and to scale, with axes in mm."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import Colormap, Normalize
from matplotlib.ticker import MaxNLocator

from ..analysis import units
from ..io.frames import Frame
from ..io.mesh import Mesh, corner_normals, half, point_normals, sharp_edges, welded
from . import look
from .canvas import Canvas, Eye

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .maps import View

FRONT, SIDE, BEHIND = (-0.55, -1.2, 0.9), (-0.35, -1.2, 0.45), (-1.0, -0.55, 0.6)  # from the metal to who looks at it
METAL, TOOL = (0.3, 0.8), (0.35, 0.65)  # ambient and diffuse light
SHARP = 30.0  # degrees between faces of a tool: an edge is drawn
STEEL, STRIPE, INK, STRIPES = (184, 190, 198), (150, 157, 166), (34, 48, 60), 12
FINE = 130  # pixels an inch
TOP = 90.0  # percent of the points of the surface are below the top of the plate, or not far above it
Face = tuple[np.ndarray, np.ndarray, np.ndarray]  # of a section: its corners (4, 3), a picture with opacities, segments (n, 2, 3) of its outline
ABOVE = Eye((0.0, -1e-6, 1.0))


def stripes_of(tool: Mesh) -> np.ndarray:
    """A shade (n, 3) for each triangle of the tool, a surface of revolution in rows of its profile: stripes show how it has turned."""
    azimuth = tool["azimuth"][tool.corners]
    around = np.unique(np.round(tool["azimuth"] % (2.0 * np.pi), 4))
    step = float(np.median(np.diff(around))) if len(around) > 3 else np.pi / 6
    pairs = np.stack([azimuth, np.roll(azimuth, -1, axis=1)])
    between = np.exp(1j * pairs).sum(axis=0)  # a pair of corners that is a step apart is in the middle of a segment
    difference = np.abs(np.angle(np.exp(1j * (pairs[1] - pairs[0]))))
    middle = np.angle(between[np.arange(len(azimuth)), np.abs(difference - step).argmin(axis=1)]) % (2.0 * np.pi)
    segment, count = np.floor(middle / step).astype(int), max(1, round(2.0 * np.pi / step))
    return np.where((segment * STRIPES // count % 2 == 0)[:, None], STEEL, STRIPE)


def coloured(values: np.ndarray, norm: Normalize, colours: Colormap) -> np.ndarray:
    """The colours of matplotlib, so that pictures of all kinds share their scales."""
    return (colours(norm(values))[:, :3] * 255).astype(np.uint8)


def cut_face(view: View, values: np.ndarray, norm: Normalize, colours: Colormap, eye: Eye) -> Face | None:
    """The plane of a section: its corners, what it shows, and the segments (n, 2, 3) of its outline; None where it meets no metal."""
    if not view.inside.any():
        return None
    i, j = view.across
    picture = (colours(norm(np.nan_to_num(view.spread(values)))) * 255).astype(np.uint8)
    picture[..., 3] = np.where(view.inside, 255, 0)
    corners = np.empty((4, 3))
    corners[:, view.axis] = view.at + 1e-5 * np.sign(eye.axes[2][view.axis])  # before the edge of the metal behind it
    corners[:, i] = view.low[i], view.high[i], view.high[i], view.low[i]
    corners[:, j] = view.low[j], view.low[j], view.high[j], view.high[j]
    outline = np.empty((sum(len(line) - 1 for line in view.outline), 2, 3))
    outline[..., view.axis] = corners[0, view.axis]
    for k, side in enumerate((i, j)):
        outline[..., side] = np.concatenate([np.stack([line[:-1, k], line[1:, k]], axis=1) for line in view.outline])
    return corners, picture[::-1], outline


def image(eye: Eye, box: np.ndarray, fine: float, metal: Mesh, colours: np.ndarray, tool: Mesh | None = None,
          face: Face | None = None) -> np.ndarray:
    """Colours of the pixels of a box (2, 2) of what the eye sees [m], with `fine` pixels a metre."""
    canvas = Canvas(eye, box, fine)
    canvas.draw(metal.points, metal.corners, canvas.lit(point_normals(metal), colours, *METAL)[metal.corners], cull=face is None)
    if face is not None:
        canvas.sheet(*face[:2])
        canvas.lines(face[2], INK, 0.5 / fine)
    if tool is not None:
        whole, left = welded(tool)
        shade = np.broadcast_to(stripes_of(tool)[left][:, None], (len(whole.corners), 3, 3))
        canvas.draw(whole.points, whole.corners, canvas.lit(corner_normals(whole, SHARP), shade, *TOOL))
        canvas.lines(sharp_edges(whole, SHARP), INK, 0.5 / fine)
    return canvas.pixels()


def seen_box(eye: Eye, *meshes: Mesh | None) -> np.ndarray:
    """Bounding box of all points in the plane of the picture (2, 2) [m]."""
    seen = np.vstack([eye.sees(mesh.points) for mesh in meshes if mesh is not None and len(mesh.points)])
    return np.array([seen.min(axis=0), seen.max(axis=0)])


def draw_axes(panel: Axes, eye: Eye, low: np.ndarray, high: np.ndarray, *names: str) -> None:
    """Edges of the box low..high [m] nearest to the eye with whole numbers of mm: x and y along its bottom, z upwards at the left.
    `names` are those of x and y if they have others."""
    near = np.where(eye.axes[2] > 0, high, low)
    bottom = np.array([near[0], near[1], low[2]])
    centre = eye.sees([0.5 * (low + high)])[0]
    for axis, name in enumerate((names or ("x", "y")) + ("z",)):
        start, end = bottom.copy(), bottom.copy()
        if axis == 2:  # at the vertical edge that is leftmost of those that are seen
            corners = [np.array([x, y, low[2]]) for x, y in ((near[0], low[1]), (near[0], high[1]), (low[0], near[1]), (high[0], near[1]))]
            start = min(corners, key=lambda corner: eye.sees([corner])[0][0])
            end = start.copy()
        start[axis], end[axis] = low[axis], high[axis]
        a, b = eye.sees([start, end])
        length = np.linalg.norm(b - a) * units.MM
        count = max(2, int(length * panel.inches / 0.45))
        ticks = MaxNLocator(nbins=count, steps=[1, 2, 5, 10], integer=True, min_n_ticks=1).tick_values(low[axis] * units.MM, high[axis] * units.MM)
        ticks = ticks[(ticks >= low[axis] * units.MM + (0.3 if axis == 2 else -0.3)) & (ticks <= high[axis] * units.MM + 0.3)]
        out = np.array([b[1] - a[1], a[0] - b[0]])
        out *= np.sign(out @ (0.5 * (a + b) - centre)) / np.linalg.norm(out)
        out = np.array([-1.0, 0.0]) if axis == 2 else out
        step, where = out / panel.inches, "right" if out[0] < -0.6 else "left" if out[0] > 0.6 else "center"
        panel.plot(*(np.array([a, b]) * units.MM).T, color=look.INK, linewidth=0.7, clip_on=False)
        for tick in ticks:
            place = start.copy()
            place[axis] = tick / units.MM
            at = eye.sees([place])[0] * units.MM
            panel.plot(*np.array([at, at + 0.05 * step]).T, color=look.INK, linewidth=0.7, clip_on=False)
            panel.text(*(at + (0.13 - 0.05 * (where != "center")) * step), f"{tick:.0f}", ha=where, va="center", fontsize=8)
        there = b * units.MM + [-0.13 / panel.inches, 0.12 / panel.inches] if axis == 2 else 0.5 * (a + b) * units.MM + 0.34 * step
        panel.text(*there, f"{name} [mm]", ha=where, va="center", fontsize=8.5)


def panel_of(figure: Figure, left: float, bottom: float, box: np.ndarray, inches: float) -> Axes:
    """Axes without a frame whose units are mm, `inches` of the picture each; lower left corner in inches."""
    wide, tall = figure.get_size_inches()
    size = (box[1] - box[0]) * units.MM * inches
    panel = figure.add_axes((left / wide, bottom / tall, size[0] / wide, size[1] / tall))
    panel.set(xlim=box[:, 0] * units.MM, ylim=box[:, 1] * units.MM)
    panel.set_axis_off()
    panel.inches = inches
    return panel


def from_above(mesh: Mesh, name: str, norm: Normalize, colours: Colormap, low: np.ndarray, high: np.ndarray, width: int = 640) -> np.ndarray:
    """Rows of colours of the box low..high seen from above, x to the right, the first row at the largest y."""
    canvas, covered, normals = seen_from_above(mesh, (*low[:2], *high[:2]), width)
    colour = canvas.lit(normals, coloured(look.shown(name, mesh[name]), norm, colours), *METAL)
    canvas.paint(covered, colour[mesh.corners])
    return canvas.pixels()


@lru_cache(maxsize=4)
def seen_from_above(mesh: Mesh, box: tuple[float, ...], width: int) -> tuple[Canvas, tuple[np.ndarray, ...], np.ndarray]:
    """Parts common to all fields: canvas, triangles, normals."""
    canvas = Canvas(ABOVE, np.reshape(box, (2, 2)), width / (box[2] - box[0]))
    return canvas, canvas.cover(mesh.points, mesh.corners, cull=True), point_normals(mesh)


def half_behind(mesh: Mesh, axis: int, at: float, eye: Eye) -> Mesh:
    """Part of the scene behind the plane where coordinate `axis` is `at`."""
    return half(mesh, axis, at, np.sign(eye.axes[2][axis]))


def plate_picture(frame: Frame, mesh: Mesh, tool: Mesh | None, name: str, label: str, norm: Normalize, colours: Colormap,
                  view: View | None = None) -> Figure:
    """The plate at one time from the front left, and, with the view of a section along it, cut there."""
    low, high = np.percentile(mesh.points, [0.05, 99.95], axis=0)
    high[2] = np.percentile(mesh.points[:, 2], TOP)  # that of the plate, not of flash and debris
    whole = Eye(FRONT)
    shown: list[tuple[Eye, np.ndarray, Mesh, Face | None, list[np.ndarray]]] = [(whole, seen_box(whole, mesh, tool), mesh, None, [low, high])]
    if view is not None:
        side = Eye(SIDE)
        half = half_behind(mesh, view.axis, view.at, side)
        corners = [low.copy(), high.copy()]
        corners[int(side.axes[2][view.axis] > 0)][view.axis] = view.at
        if tool is not None and tool.points[:, 2].min() < low[2]:  # axes are before and below a tool that comes out of the bottom
            corners[0] = np.minimum(corners[0], tool.points.min(axis=0))
        axes = Mesh(np.array(corners)[np.indices((2, 2, 2)).reshape(3, 8).T, np.arange(3)], np.empty((0, 3)))
        face = cut_face(view, look.shown(name, frame.need(name)), norm, colours, side)
        shown.append((side, seen_box(side, half, tool, axes), half, face, corners))
    sides, below, gap, head = 0.78, 0.5, 0.9, 0.3
    right = look.BAR + 0.18  # half of a label of the last tick is beyond the picture
    lengths = [np.diff(box, axis=0)[0] * units.MM for _, box, *_ in shown]
    wide = look.WIDTH if view is not None else 8.2
    inches = (wide - sides - right - gap * (len(shown) - 1)) / sum(size[0] for size in lengths)
    tall = max(size[1] for size in lengths) * inches + below + head
    figure = look.new_figure(wide, tall)
    figure.set_layout_engine("none")
    left = sides
    for (eye, box, part, face, corners), size in zip(shown, lengths):
        panel = panel_of(figure, left, below, box, inches)
        picture = image(eye, box, FINE * inches * units.MM, part, coloured(look.shown(name, part[name]), norm, colours), tool, face)
        panel.imshow(picture, extent=(*box[:, 0] * units.MM, *box[:, 1] * units.MM), aspect="auto", interpolation="antialiased")
        panel.set(xlim=box[:, 0] * units.MM, ylim=box[:, 1] * units.MM)
        draw_axes(panel, eye, *corners)
        left += size[0] * inches + gap
    figure.text(0.1 / wide, 1.0 - 0.2 / tall, f"t = {units.seconds(frame.time)}", fontsize=10)
    bar = min(2.6, tall - 0.6)
    strip = figure.add_axes(((wide - look.BAR + 0.12) / wide, 0.5 - 0.5 * bar / tall, 0.14 / wide, bar / tall))
    look.colour_bar(figure, norm, colours, strip, label)
    return figure
