# SPDX-License-Identifier: MIT
"""Pictures of meshes in parallel projection, by a depth buffer: nothing but numpy, and no display."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

UP = np.array([0.0, 0.0, 1.0])
LIGHTS = (((-0.5, -0.8, 1.6), 0.8), ((0.9, 0.4, 0.7), 0.3))  # from where, how strong
SAMPLES = 2  # along a pixel: their mean is its colour


@dataclass
class Eye:
    """A direction to look along; places become lengths to the right and up [m], and depth."""

    towards: tuple[float, float, float]

    def __post_init__(self) -> None:
        back = np.array(self.towards) / np.linalg.norm(self.towards)
        right = np.cross(UP, back)
        right /= np.linalg.norm(right)
        self.axes = np.stack([right, np.cross(back, right), back])

    def sees(self, points: np.ndarray) -> np.ndarray:
        """Coordinates to the right and up (n, 2)."""
        return np.asarray(points) @ self.axes[:2].T


class Canvas:
    """The pixels of a box (2, 2) of what an eye sees [m], `fine` of them a metre, on white."""

    def __init__(self, eye: Eye, box: np.ndarray, fine: float):
        columns, rows = np.maximum(8, np.round((box[1] - box[0]) * fine)).astype(int) * SAMPLES
        self.eye, self.corner = eye, np.array([box[0, 0], box[1, 1]])
        self.scale = np.array([columns, -rows]) / (box[1] - box[0])
        self.shape = rows, columns
        self.depth = np.full(rows * columns, -np.inf)
        self.colour = np.full((rows * columns, 3), 255, dtype=np.uint8)

    def pixels(self) -> np.ndarray:
        """Rows of colours, the uppermost first."""
        rows, columns = self.shape
        samples = self.colour.reshape(rows, columns, 3).astype(np.uint16)
        total = sum(samples[i::SAMPLES, j::SAMPLES] for i in range(SAMPLES) for j in range(SAMPLES))
        return ((total + SAMPLES**2 // 2) // SAMPLES**2).astype(np.uint8)

    def projected(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates to the right and down in samples, and depth towards the eye [m]."""
        return (self.eye.sees(points) - self.corner) * self.scale, points @ self.eye.axes[2]

    def draw(self, points: np.ndarray, corners: np.ndarray, colours: np.ndarray, cull: bool = False) -> None:
        """Triangles with colours at their corners (m, 3, 3), of which `cull` leaves out those that are seen from behind."""
        self.paint(self.cover(points, corners, cull), colours)

    def paint(self, covered: tuple[np.ndarray, ...], colours: np.ndarray) -> None:
        """Triangles found by `cover`, with colours at the corners of its triangles (m, 3, 3)."""
        sample, weights, triangle = covered
        self.colour[sample] = np.clip(sum(weights[:, k, None] * colours[triangle, k] for k in range(3)), 0, 255)

    def cover(self, points: np.ndarray, corners: np.ndarray, cull: bool = False,
              solid: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None) -> tuple[np.ndarray, ...]:
        """Samples where these triangles are nearest to the eye from now on: their numbers, weights (n, 3) of the corners, triangles.
        `solid` says where they are not to be seen through, by weights and triangles."""
        rows, columns = self.shape
        place, depth = self.projected(points)
        p = place[corners]
        (ax, ay), (bx, by) = (p[:, 1] - p[:, 0]).T, (p[:, 2] - p[:, 0]).T
        area = ax * by - ay * bx
        top = np.ceil(p[:, :, 1].min(axis=1) - 0.5).clip(0, rows).astype(int)
        end = (np.floor(p[:, :, 1].max(axis=1) - 0.5) + 1).clip(0, rows).astype(int)
        triangle, row = spread(np.where((area < -1e-12) | ((area > 1e-12) & (not cull)), np.maximum(end - top, 0), 0), top)
        left, right = spans(p, triangle, row + 0.5, columns)
        line, column = spread(np.maximum(right - left, 0), left)
        triangle, row = triangle[line], row[line]
        sample = row * columns + column
        size = np.where(area == 0.0, 1.0, area)  # a weight is linear: at x = y = 0, its slopes along x and y
        x, y = p[:, 0, 0] - 0.5, p[:, 0, 1] - 0.5
        u = np.stack([(ay * x - ax * y) / size, -ay / size, ax / size])  # of the third corner
        v = np.stack([(bx * y - by * x) / size, by / size, -bx / size])  # of the second
        plane = (depth[corners] * np.stack([np.zeros(len(p)), v[0], u[0]], axis=1)).sum(axis=1) + depth[corners[:, 0]] * (1 - u[0] - v[0])
        along = [((depth[corners[:, 1]] - depth[corners[:, 0]]) * v[k] + (depth[corners[:, 2]] - depth[corners[:, 0]]) * u[k]) for k in (1, 2)]
        z = plane[triangle] + along[0][triangle] * column + along[1][triangle] * row
        chosen = np.flatnonzero(z >= self.depth[sample])
        if solid is not None:
            chosen = chosen[solid(weights_of(u, v, triangle[chosen], column[chosen], row[chosen]), triangle[chosen])]
        np.maximum.at(self.depth, sample[chosen], z[chosen])
        chosen = chosen[z[chosen] == self.depth[sample[chosen]]]
        return sample[chosen], weights_of(u, v, triangle[chosen], column[chosen], row[chosen]), triangle[chosen]

    def lit(self, normals: np.ndarray, colours: np.ndarray, ambient: float, diffuse: float) -> np.ndarray:
        """Colours of places with normals; both sides of a face are lit as the one that is seen."""
        facing = np.where(normals @ self.eye.axes[2] < 0.0, -1.0, 1.0)[..., None] * normals
        light = sum(strength * np.maximum(facing @ np.array(place) / np.linalg.norm(place), 0.0) for place, strength in LIGHTS)
        return (colours * (ambient + diffuse * light)[..., None]).astype(np.float32)

    def sheet(self, corners: np.ndarray, picture: np.ndarray) -> None:
        """A picture with opacities (rows, columns, 4) on a rectangle, whose corners (4, 3) begin at the start of its last row."""
        halves = np.array([[0, 1, 2], [0, 2, 3]])
        ends = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)[halves]
        rows, columns = picture.shape[:2]

        def value(weights: np.ndarray, triangle: np.ndarray) -> np.ndarray:
            u, v = np.einsum("nk,nkc->cn", weights, ends[triangle])
            return picture[((1.0 - v) * rows).astype(int).clip(0, rows - 1), (u * columns).astype(int).clip(0, columns - 1)]

        sample, weights, triangle = self.cover(corners, halves, solid=lambda *there: value(*there)[:, 3] > 127)
        self.colour[sample] = value(weights, triangle)[:, :3]

    def lines(self, ends: np.ndarray, colour: tuple[int, int, int], near: float) -> None:
        """Segments (n, 2, 3), a pixel wide, where they are less than `near` behind what is seen [m]."""
        place, depth = (x.reshape(-1, 2, *x.shape[1:]) for x in self.projected(ends.reshape(-1, 3)))
        number, step = spread(np.ceil(2.0 * np.abs(place[:, 1] - place[:, 0]).max(axis=1)).astype(int) + 1, 0)
        part = step / np.maximum(np.bincount(number)[number] - 1, 1)
        at = place[number, 0] + part[:, None] * (place[number, 1] - place[number, 0])
        z = depth[number, 0] + part * (depth[number, 1] - depth[number, 0]) + near
        rows, columns = self.shape
        for right in range(SAMPLES):
            for down in range(SAMPLES):
                x, y = np.floor(at + np.array([right, down]) - 0.5 * (SAMPLES - 1)).astype(int).T
                inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
                sample = y[inside] * columns + x[inside]
                self.colour[sample[z[inside] >= self.depth[sample]]] = colour


def spans(p: np.ndarray, triangle: np.ndarray, y: np.ndarray, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """The first column inside of each triangle at the height y, and the one after the last."""
    low, high = np.full(len(y), np.inf), np.full(len(y), -np.inf)
    for k in range(3):
        a, b = p[:, k], p[:, (k + 1) % 3]
        rise = b[:, 1] - a[:, 1]
        slope = (b[:, 0] - a[:, 0]) / np.where(rise == 0.0, 1.0, rise)
        x = (a[:, 0] - slope * a[:, 1])[triangle] + slope[triangle] * y
        meets = (np.minimum(a[:, 1], b[:, 1])[triangle] <= y) & (y <= np.maximum(a[:, 1], b[:, 1])[triangle]) & (rise != 0.0)[triangle]
        np.minimum(low, x, out=low, where=meets)
        np.maximum(high, x, out=high, where=meets)
    return tuple(np.ceil(np.where(np.isfinite(x), x, 0.0) - 0.5).clip(0, columns).astype(int) for x in (low, high))


def weights_of(u: np.ndarray, v: np.ndarray, triangle: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Weights (n, 3) of the corners of triangles at samples."""
    third, second = (w[0][triangle] + w[1][triangle] * column + w[2][triangle] * row for w in (u, v))
    return np.stack([1.0 - second - third, second, third], axis=1).astype(np.float32)


def spread(counts: np.ndarray, start: np.ndarray | int) -> tuple[np.ndarray, np.ndarray]:
    """Repeats each index k counts[k] times; returns these indices and consecutive integers from `start` on for each."""
    number = np.repeat(np.arange(len(counts)), counts)
    along = np.arange(len(number)) - np.repeat(np.cumsum(counts) - counts, counts)
    return number, along + (start[number] if isinstance(start, np.ndarray) else start)
