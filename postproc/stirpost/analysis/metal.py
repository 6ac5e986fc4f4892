# SPDX-License-Identifier: MIT
"""The shape of the metal: what is connected, the flash above the first top face, the groove below it."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..io.frames import Frame

if TYPE_CHECKING:
    from ..run import Run

ROUNDING = 1e-3  # of a particle's edge: frames hold places in single precision
LEAST = 0.01  # of the particles of its body: a piece with fewer is debris
MOST_STRETCH = 1.5  # of a particle along an axis; beyond it neighbours of the start are not taken for such


@dataclass
class Shape:
    """Lengths [m], volumes [m3]; the flash is what lies above the first top face and is connected to its body."""

    flash_height: float
    flash_volume: float
    debris_pieces: int
    debris_particles: int
    debris_volume: float
    groove: float | None


@lru_cache(maxsize=4)
def measure(run: Run, frame: Frame, rigid: frozenset[str]) -> Shape | None:
    """The shape in a frame against the first one; None if nothing has moved or there is no metal. `rigid` names
    bodies that are tools."""
    start = run.frames[0]
    first, last = metal_points(start, rigid), metal_points(frame, rigid)
    if not len(first[0]) or not len(last[0]) or np.array_equal(first[0], last[0]):
        return None
    reach = run.cell if np.isfinite(run.cell) else 2.0 * run.spacing
    whole, pieces = connected(*last, max(reach, 1.01 * run.spacing))
    face = first[0][:, 2].max()
    volume = spacings(start, run)[last[1]] ** 3
    points = last[0]
    edge = volume ** (1.0 / 3.0)
    above = np.clip((points[:, 2] - face - 0.5 * (run.spacing - edge)) / edge, 0.0, 1.0)  # part of each particle
    above[above < ROUNDING] = 0.0
    kept = points[whole]
    return Shape(
        flash_height=max(0.0, float(kept[:, 2].max() - face)) if len(kept) else 0.0,
        flash_volume=float((volume * above)[whole].sum()),
        debris_pieces=pieces,
        debris_particles=int((~whole).sum()),
        debris_volume=float(volume[~whole].sum()),
        groove=groove_depth(first[0], kept, face, run.spacing) if len(kept) else None,
    )


def metal_points(frame: Frame, rigid: Set[str]) -> tuple[np.ndarray, np.ndarray]:
    """Positions of all particles but those of tools, and the numbers of their bodies from 0."""
    keep = metal_mask(frame, rigid)
    return frame.points()[keep], frame.bodies()[keep]


def metal_mask(frame: Frame, rigid: Set[str]) -> np.ndarray:
    """Which particles are of no tool."""
    return ~np.isin(frame.bodies(), [number for number, name in enumerate(frame.body_names) if name in rigid])


def spacings(frame: Frame, run: Run) -> np.ndarray:
    """Edge of the particles of each body [m]."""
    given = frame.attribute("spacing")
    given = np.where(np.isfinite(given), given, run.spacing)
    return np.append(given, np.full(1000, given[-1]))


def connected(points: np.ndarray, body: np.ndarray, reach: float) -> tuple[np.ndarray, int]:
    """Which particles are connected to a body, and the number of pieces of debris. Particles nearer to each other than `reach`, a cell of the grid,
    are connected, since they share nodes."""
    label = pieces_of(points, reach)
    sizes = np.bincount(label)
    own = np.bincount(body)[body]
    whole = sizes[label] >= np.maximum(2, LEAST * own)
    if not whole.any():
        whole = sizes[label] == sizes.max()
    return whole, len(np.unique(label[~whole]))


def pieces_of(points: np.ndarray, reach: float) -> np.ndarray:
    """Number of the piece of each particle. Particles of one cell of edge reach/sqrt(3) are together in any case."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    cell = np.floor((points - points.min(axis=0)) / (reach / np.sqrt(3.0)) * (1.0 - 1e-12)).astype(np.int64)
    size = cell.max(axis=0) + 1
    _, first, node = np.unique((cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2], return_index=True, return_inverse=True)
    node = node.reshape(-1)
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    one, other = node[pairs[:, 0]], node[pairs[:, 1]]
    different = one != other
    graph = coo_array((np.ones(different.sum(), dtype=np.int8), (one[different], other[different])), shape=(len(first),) * 2)
    return connected_components(graph, directed=False)[1][node]


def groove_depth(first: np.ndarray, last: np.ndarray, face: float, spacing: float) -> float | None:
    """How far the surface has sunk where it was at the top face [m]. A gap between particles is no groove: a point counts if all metal within a
    spacing of it is as low."""
    from scipy.ndimage import maximum_filter

    low, high = first.min(axis=0) + 2 * spacing, first.max(axis=0) - 2 * spacing
    if not (high > low + 0.5 * spacing)[:2].all():
        return None
    edges = [low[k] + spacing * np.arange(np.ceil((high[k] - low[k]) / spacing - 1e-6) + 1) for k in (0, 1)]
    heights = [maximum_filter(highest_of(points, edges), size=3, mode="nearest") for points in (first, last)]
    at_top = np.isfinite(heights[0]) & (heights[0] > face - 0.5 * spacing) & np.isfinite(heights[1])
    return max(0.0, float(face - heights[1][at_top].min())) if at_top.any() else None


def highest_of(points: np.ndarray, edges: list[np.ndarray]) -> np.ndarray:
    """Greatest z in each column between the edges in x and y, -inf where there is nothing."""
    cell = [np.searchsorted(edge, points[:, k], side="right") - 1 - (points[:, k] == edge[-1]) for k, edge in enumerate(edges)]
    inside = np.all([(c >= 0) & (c < len(edge) - 1) for c, edge in zip(cell, edges)], axis=0)
    found = np.full([len(edge) - 1 for edge in edges], -np.inf)
    np.maximum.at(found, (cell[0][inside], cell[1][inside]), points[inside, 2])
    return found


def stretches(x0: np.ndarray, x: np.ndarray, edge: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Edges of particles (n, 3) over those of cubes of their volume, from the distances of neighbours along each axis of the initial lattice; 1 where
    these are no longer neighbours."""
    found = np.ones((len(x), 3))
    for number in np.unique(body):
        own = np.flatnonzero(body == number)
        h = edge[own[0]]
        place = np.round((x0[own] - x0[own].min(axis=0)) / h).astype(int) + 1
        lattice = np.full(place.max(axis=0) + 2, -1)
        lattice[tuple(place.T)] = own
        for axis in range(3):
            step = np.eye(3, dtype=int)[axis]
            after, before = (lattice[tuple((place + sign * step).T)] for sign in (1, -1))
            low, high = np.where(before >= 0, before, own), np.where(after >= 0, after, own)
            distance = x0[high, axis] - x0[low, axis]
            there = distance > 0
            found[own[there], axis] = (x[high, axis] - x[low, axis])[there] / distance[there]
    torn = ((found < 1.0 / MOST_STRETCH) | (found > MOST_STRETCH)).any(axis=1)
    found[torn] = 1.0
    return found / np.cbrt(found.prod(axis=1))[:, None]
