# SPDX-License-Identifier: MIT
"""The deformed plate with its flash: particles drawn as spheres into a depth picture, which is
smoothed and lit (slope, and shade in hollows), coloured by temperature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure

from . import look, raster
from .run import Frame, Run

SHARPEN = 2  # rendered finer by this and averaged
WIDE = 1150  # pixels of the finished picture
LIGHT = np.array([-0.45, 0.62, 0.64])


@dataclass
class Camera:
    """Parallel projection: `right` and `up` span the picture, `toward` points at the viewer."""

    azimuth: float = -62.0
    elevation: float = 33.0

    def axes(self) -> np.ndarray:
        """Rows right, up, toward."""
        a, e = np.radians([self.azimuth, self.elevation])
        toward = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return np.array([right, np.cross(toward, right), toward])

    def project(self, points: np.ndarray) -> np.ndarray:
        return points @ self.axes().T


def plate_picture(
    run: Run,
    frame: Frame,
    norm: Normalize,
    colours: Colormap = look.TEMPERATURE,
    camera: Camera = Camera(),
) -> Figure:
    """The lit plate at one time with scales in mm and a colour bar."""
    points = frame.points()
    low, high = raster.common_box([points], 0.5 * run.spacing)
    near = np.flatnonzero(
        ((points > low - run.spacing) & (points < high + run.spacing)).all(axis=1)
    )
    seen = camera.project(points[near])
    corners = camera.project(
        np.array(
            [
                [x, y, z]
                for x in (low[0], high[0])
                for y in (low[1], high[1])
                for z in (low[2], high[2])
            ]
        )
    )
    margin = 2 * run.spacing
    left, below = corners[:, :2].min(axis=0) - margin
    reach, above = corners[:, :2].max(axis=0) + margin
    grid = raster.Grid.over((left, below), (reach, above), (reach - left) / (WIDE * SHARPEN))
    index, depth = nearest_particles(seen, run.spacing, grid)
    light = shade(depth, grid.pixel, run.spacing)
    cell = max(1, int(round(run.spacing / grid.pixel)))
    values = blur(raster.values_on(index, frame.field("temperature")[near]), cell // 2)
    picture = np.ones((*index.shape, 3))
    filled = index != raster.EMPTY
    filled &= box_mean(filled.astype(float), cell // 2) > 0.5  # takes the scallops off the outline
    picture[filled] = lit(colours(norm(values[filled]))[:, :3], light[filled])
    picture = average_blocks(picture, SHARPEN)

    width = 10.8
    figure = look.new_figure(width, (width - 1.6) * (above - below) / (reach - left) + 0.75)
    axis = figure.add_subplot()
    axis.imshow(picture, origin="lower", extent=grid.extent(look.MM), interpolation="antialiased")
    axis.set_axis_off()
    axis.set_title(f"t = {look.seconds(frame.time)}", loc="left", pad=3)
    draw_scales(axis, camera, low, high)
    figure.colorbar(
        ScalarMappable(norm, colours),
        ax=axis,
        label="temperature [K]",
        fraction=0.035,
        pad=0.01,
        aspect=24,
        shrink=0.85,
    )
    return figure


def nearest_particles(
    seen: np.ndarray, spacing: float, grid: raster.Grid
) -> tuple[np.ndarray, np.ndarray]:
    """Particle numbers and depth [m] of the surface the viewer sees."""
    front = near_the_front(seen, spacing)
    u, v, toward = seen[front].T
    radius = 0.85 * spacing  # spheres overlap: the surface is closed
    back = toward.min()
    span = toward.max() + radius - back

    def score(du, dv):
        squares = radius**2 - du**2 - dv**2
        return np.where(squares > 0, (toward - back + np.sqrt(np.maximum(squares, 0))) / span, -1.0)

    local = raster.close_gaps(raster.splat(u, v, radius, grid, score), 2)
    filled = local != raster.EMPTY
    rows, columns = np.nonzero(filled)
    hit = local[filled]
    du = grid.left + (columns + 0.5) * grid.pixel - u[hit]
    dv = grid.bottom + (rows + 0.5) * grid.pixel - v[hit]
    depth = np.full(local.shape, np.nan)
    depth[filled] = toward[hit] + np.sqrt(np.maximum(radius**2 - du**2 - dv**2, 0))
    index = np.full(local.shape, raster.EMPTY)
    index[filled] = front[hit]
    return index, depth


def near_the_front(seen: np.ndarray, spacing: float) -> np.ndarray:
    """Numbers of the particles within a few spacings of the foremost one in their cell."""
    cell = np.floor((seen[:, :2] - seen[:, :2].min(axis=0)) / spacing).astype(np.int64)
    flat = cell[:, 1] * (cell[:, 0].max() + 1) + cell[:, 0]
    foremost = np.full(flat.max() + 1, -np.inf)
    np.maximum.at(foremost, flat, seen[:, 2])
    return np.flatnonzero(seen[:, 2] > foremost[flat] - 3.5 * spacing)


def shade(depth: np.ndarray, pixel: float, spacing: float) -> np.ndarray:
    """Brightness from the slope against the light, darker in hollows."""
    cell = max(1, int(round(spacing / pixel)))
    smooth = depth
    for _ in range(3):
        smooth = blur(smooth, max(1, cell // 2))
    along_v, along_u = (np.nan_to_num(part) for part in np.gradient(smooth, pixel))
    light = LIGHT / np.linalg.norm(LIGHT)
    slope = (light[2] - along_u * light[0] - along_v * light[1]) / np.sqrt(
        along_u**2 + along_v**2 + 1.0
    )
    brightness = 0.46 + 0.70 * np.clip(slope, 0, 1)
    return brightness * np.exp(-0.85 * hollowness(smooth, cell, pixel))


def hollowness(depth: np.ndarray, cell: int, pixel: float) -> np.ndarray:
    """How far a place lies below the middle of two places on opposite sides, over their distance:
    0 on any slope. Summed over directions and distances."""
    total = np.zeros_like(depth)
    reaches = (2 * cell, 4 * cell)
    for reach in reaches:
        slanted = int(round(0.7 * reach))
        for across, along in ((0, reach), (reach, 0), (slanted, slanted), (slanted, -slanted)):
            middle = 0.5 * (
                np.roll(depth, (along, across), axis=(0, 1))
                + np.roll(depth, (-along, -across), axis=(0, 1))
            )
            total += np.nan_to_num(np.clip((middle - depth) / (reach * pixel), 0, 0.6))
    return total / (2 * len(reaches))


def lit(colours: np.ndarray, brightness: np.ndarray) -> np.ndarray:
    """Colours darkened by the shade; above 1 they go towards white."""
    dark = colours * np.minimum(brightness, 1.0)[:, None]
    return np.clip(dark + 0.6 * np.maximum(brightness - 1.0, 0)[:, None], 0, 1)


def blur(picture: np.ndarray, reach: int) -> np.ndarray:
    """Mean over a square of 2 * reach + 1 pixels, of the pixels that are there."""
    there = np.isfinite(picture)
    share = box_mean(there.astype(float), reach)
    return np.where(
        there, box_mean(np.where(there, picture, 0.0), reach) / np.maximum(share, 1e-9), np.nan
    )


def box_mean(picture: np.ndarray, reach: int) -> np.ndarray:
    """Mean over a square of 2 * reach + 1 pixels, with zeros around the picture."""
    for axis in (0, 1):
        padding = [(0, 0), (0, 0)]
        padding[axis] = (reach + 1, reach)
        sums = np.cumsum(np.pad(picture, padding), axis=axis)
        count, width = picture.shape[axis], 2 * reach + 1
        upper, lower = (
            (sums[:, width : width + count], sums[:, :count])
            if axis
            else (sums[width : width + count], sums[:count])
        )
        picture = (upper - lower) / width
    return picture


def average_blocks(picture: np.ndarray, size: int) -> np.ndarray:
    rows, columns = (n // size * size for n in picture.shape[:2])
    blocks = picture[:rows, :columns].reshape(rows // size, size, columns // size, size, 3)
    return blocks.mean(axis=(1, 3))


def draw_scales(axis, camera: Camera, low: np.ndarray, high: np.ndarray) -> None:
    """Rulers in mm along the three lower edges nearest to the viewer."""
    corner = np.array([high[0], low[1], low[2]])
    size = high - low
    out = 0.02 * size.max()
    rulers = (  # direction, start, outwards
        (0, np.array([low[0], low[1], low[2]]), np.array([0.0, -1.0, 0.0])),
        (1, corner, np.array([1.0, 0.0, 0.0])),
        (2, np.array([low[0], low[1], low[2]]), np.array([-1.0, 0.0, 0.0])),
    )
    for direction, start, outwards in rulers:
        end = start.copy()
        end[direction] = high[direction]
        line = camera.project(np.array([start, end]) + out * outwards) * look.MM
        axis.plot(line[:, 0], line[:, 1], color="#8a96a3", linewidth=0.8)
        for tick in ruler_ticks(low[direction], high[direction]):
            place = start.copy()
            place[direction] = tick
            stroke = (
                camera.project(np.array([place + out * outwards, place + 1.6 * out * outwards]))
                * look.MM
            )
            axis.plot(stroke[:, 0], stroke[:, 1], color="#8a96a3", linewidth=0.8)
            text = camera.project((place + 2.8 * out * outwards)[None])[0] * look.MM
            axis.text(
                text[0],
                text[1],
                f"{tick * look.MM + 0.0:.4g}",
                fontsize=8,
                ha="center",
                va="center",
            )
        name = camera.project((0.5 * (start + end) + 5.2 * out * outwards)[None])[0] * look.MM
        axis.text(
            name[0], name[1], f"{'xyz'[direction]} [mm]", fontsize=9, ha="center", va="center"
        )
    axis.autoscale(tight=False)
    axis.margins(0.01)


def ruler_ticks(low: float, high: float) -> np.ndarray:
    """Round numbers of mm between two positions [m], at most seven."""
    length = (high - low) * look.MM
    step = next(
        (s for s in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500) if length / s <= 6), length
    )
    first = np.ceil(low * look.MM / step - 1e-3) * step
    return np.round(np.arange(first, high * look.MM + 1e-3 * step, step), 6) / look.MM + 0.0
