# SPDX-License-Identifier: MIT
"""Particles to pixels. A picture is an array of particle numbers, -1 where there is none, so that
one picture serves every field: values[index]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

EMPTY = -1


@dataclass
class Grid:
    """Square pixels over a rectangle, in the units of the positions."""

    left: float
    bottom: float
    pixel: float
    columns: int
    rows: int

    @classmethod
    def over(cls, low, high, pixel: float) -> "Grid":
        columns, rows = (max(1, int(np.ceil((b - a) / pixel - 1e-6))) for a, b in zip(low, high))
        return cls(float(low[0]), float(low[1]), pixel, columns, rows)

    def extent(self, scale: float = 1.0) -> tuple[float, float, float, float]:
        """left, right, bottom, top, as matplotlib's imshow takes it."""
        return (
            self.left * scale,
            (self.left + self.columns * self.pixel) * scale,
            self.bottom * scale,
            (self.bottom + self.rows * self.pixel) * scale,
        )


def splat(
    u: np.ndarray,
    v: np.ndarray,
    half: float,
    grid: Grid,
    score: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> np.ndarray:
    """Each particle covers the pixels whose centres lie within `half` of it in u and v; of several
    particles on a pixel the one of the highest score wins. score(du, dv) gives one number in [0, 1]
    for every particle, du and dv being pixel centre minus particle."""
    best = np.full(grid.rows * grid.columns, -1, dtype=np.int64)
    number = np.arange(len(u), dtype=np.int64)
    first_column = np.ceil((u - half - grid.left) / grid.pixel - 0.5).astype(np.int64)
    first_row = np.ceil((v - half - grid.bottom) / grid.pixel - 0.5).astype(np.int64)
    width = max(1, int(round(2 * half / grid.pixel)))
    for j in range(width):
        row = first_row + j
        dv = grid.bottom + (row + 0.5) * grid.pixel - v
        for i in range(width):
            column = first_column + i
            du = grid.left + (column + 0.5) * grid.pixel - u
            points = score(du, dv)
            inside = (
                (row >= 0)
                & (row < grid.rows)
                & (column >= 0)
                & (column < grid.columns)
                & (points >= 0)
            )
            key = (np.minimum(points, 1.0) * (2**31 - 1)).astype(np.int64) << 32 | number
            np.maximum.at(best, (row * grid.columns + column)[inside], key[inside])
    index = np.where(best < 0, EMPTY, best & 0xFFFFFFFF)
    return index.reshape(grid.rows, grid.columns)


def close_gaps(index: np.ndarray, reach: int) -> np.ndarray:
    """Fills gaps narrower than 2 * reach pixels from the neighbours and keeps the outline."""
    grown = np.pad(index, reach + 1, constant_values=EMPTY)
    shifts = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)]
    for _ in range(reach):
        before = grown.copy()
        for shift in shifts:
            grown = np.where(grown == EMPTY, np.roll(before, shift, axis=(0, 1)), grown)
    inner = grown != EMPTY
    for _ in range(reach):
        before = inner.copy()
        for shift in shifts:
            inner &= np.roll(before, shift, axis=(0, 1))
    cut = slice(reach + 1, -(reach + 1))
    return np.where((index == EMPTY) & inner[cut, cut], grown[cut, cut], index)


def pixels_per_particle(length: float, spacing: float, wanted: int = 900) -> int:
    """Pixels along the edge of a particle for a picture of this length, about `wanted` wide."""
    return int(np.clip(round(wanted * spacing / length), 2, 12))


def top_view(points: np.ndarray, spacing: float, low, high) -> tuple[np.ndarray, Grid]:
    """From above (x to the right, y up): each pixel shows the highest particle that covers it."""
    per = pixels_per_particle(max(high[0] - low[0], high[1] - low[1]), spacing)
    grid = Grid.over(low[:2], high[:2], spacing / per)
    bottom, top = points[:, 2].min(), points[:, 2].max()
    height = (points[:, 2] - bottom) / max(top - bottom, 1e-30)
    index = splat(points[:, 0], points[:, 1], spacing / 2, grid, lambda du, dv: height)
    return close_gaps(index, (per + 1) // 2), grid


def section(
    points: np.ndarray, spacing: float, axis: int, at: float, low, high
) -> tuple[np.ndarray, Grid]:
    """The plane where coordinate `axis` is `at`, z up: the particles within about a spacing
    of the plane, each pixel showing the one nearest to it in space."""
    across = 1 - axis  # the other horizontal direction
    per = pixels_per_particle(high[across] - low[across], spacing)
    grid = Grid.over((low[across], low[2]), (high[across], high[2]), spacing / per)
    slab = np.flatnonzero(np.abs(points[:, axis] - at) <= 0.9 * spacing)
    away = ((points[slab, axis] - at) / spacing) ** 2
    near = splat(
        points[slab, across],
        points[slab, 2],
        spacing / 2,
        grid,
        lambda du, dv: 1.0 - (away + (du**2 + dv**2) / spacing**2) / 2,
    )
    near = close_gaps(near, (per + 1) // 2)
    index = np.full_like(near, EMPTY)
    index[near != EMPTY] = slab[near[near != EMPTY]]
    return index, grid


def values_on(index: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The picture of a field, NaN where there is no particle."""
    picture = np.full(index.shape, np.nan)
    filled = index != EMPTY
    picture[filled] = values[index[filled]]
    return picture


def highest_nearby(picture: np.ndarray, reach: int) -> np.ndarray:
    """The highest value within `reach` pixels in rows and columns; NaN does not count."""
    for axis in (0, 1):
        before = picture.copy()
        for shift in range(-reach, reach + 1):
            picture = np.fmax(picture, np.roll(before, shift, axis=axis))
    return picture


def common_box(clouds: list[np.ndarray], margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners that hold all clouds but for a few stray particles."""
    low = np.min([np.percentile(cloud, 0.01, axis=0) for cloud in clouds], axis=0) - margin
    high = np.max([np.percentile(cloud, 99.99, axis=0) for cloud in clouds], axis=0) + margin
    return low, high
