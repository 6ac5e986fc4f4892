# SPDX-License-Identifier: MIT
"""Meshes of triangles: cut by planes, normals, edges."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pyvista as pv


@dataclass(eq=False)
class Mesh:
    """Triangles `corners` (m, 3) between `points` (n, 3) [m], and `data` (n, ...) at the points by name."""

    points: np.ndarray
    corners: np.ndarray
    data: dict[str, np.ndarray] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.data[name]

    @property
    def bounds(self) -> np.ndarray:
        """Lowest and highest corner (2, 3)."""
        return np.array([self.points.min(axis=0), self.points.max(axis=0)])

    def at(self, points: np.ndarray) -> Mesh:
        """The mesh with its points at other places; the data is shared."""
        return Mesh(points, self.corners, dict(self.data))

    def to_pyvista(self) -> pv.PolyData:
        import pyvista as pv

        mesh = pv.PolyData.from_regular_faces(self.points, self.corners)
        for name, values in self.data.items():
            mesh.point_data[name] = values
        return mesh


def merged(parts: list[Mesh]) -> Mesh:
    """All parts as one mesh; their points stay apart."""
    if len(parts) == 1:
        return parts[0]
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    return Mesh(np.concatenate([part.points for part in parts]), np.concatenate([p.corners + n for p, n in zip(parts, first)]),
                {name: np.concatenate([part.data[name] for part in parts]) for name in parts[0].data})


def welded(mesh: Mesh) -> tuple[Mesh, np.ndarray]:
    """The mesh with one point for all at the same place, and which of its triangles are left."""
    points, same = np.unique(np.round(mesh.points, 9), axis=0, return_inverse=True)
    corners = same.reshape(-1)[mesh.corners]
    left = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    return Mesh(points, corners[left]), left


def crossing(corners: np.ndarray, distance: np.ndarray, count: int) -> tuple[np.ndarray, ...]:
    """Triangles with `count` corners (1 or 2) at distances <= 0, turned so that the corner that is alone on its side comes first, and
    the share of the edge from it at which the next edge and the one after cross the plane."""
    below = distance[corners] <= 0.0
    chosen = below.sum(axis=1) == count
    alone = (below[chosen] == (count == 1)).argmax(axis=1)
    turned = corners[chosen][np.arange(len(alone))[:, None], (alone[:, None] + np.arange(3)) % 3]
    d = distance[turned]
    return turned, d[:, 0] / (d[:, 0] - d[:, 1]), d[:, 0] / (d[:, 0] - d[:, 2])


def half(mesh: Mesh, axis: int, at: float, sign: float) -> Mesh:
    """The part where `sign` times coordinate `axis` is at most `sign` times `at`, with the data interpolated; open at the cut."""
    distance = sign * (mesh.points[:, axis] - at)
    one, p, q = crossing(mesh.corners, distance, 1)
    two, r, s = crossing(mesh.corners, distance, 2)
    start, end = np.concatenate([one[:, [0, 1]], one[:, [0, 2]], two[:, [0, 1]], two[:, [0, 2]]]).T
    share = np.concatenate([p, q, r, s])

    def cut(values: np.ndarray) -> np.ndarray:
        part = share.reshape(-1, *[1] * (values.ndim - 1))
        return np.concatenate([values, ((1.0 - part) * values[start] + part * values[end]).astype(values.dtype)])

    n, k, m = len(mesh.points), len(one), len(two)
    a, b = n + np.arange(k), n + k + np.arange(k)
    c, d = n + 2 * k + np.arange(m), n + 2 * k + m + np.arange(m)
    corners = np.concatenate([mesh.corners[(distance[mesh.corners] <= 0.0).all(axis=1)], np.stack([one[:, 0], a, b], axis=1),
                              np.stack([c, two[:, 1], two[:, 2]], axis=1), np.stack([c, two[:, 2], d], axis=1)])
    used, corners = np.unique(corners, return_inverse=True)
    return Mesh(cut(mesh.points)[used], corners.reshape(-1, 3), {name: cut(values)[used] for name, values in mesh.data.items()})


def loops(mesh: Mesh, axis: int, at: float) -> list[np.ndarray]:
    """Where the plane `axis` = `at` cuts the surface: lines (n, 2) of the other two coordinates, closed where the surface is."""
    distance = mesh.points[:, axis] - at
    edges, places = [], []
    for count in (1, 2):  # the line of a triangle goes from one of its edges to another, with the inside always on the same hand
        turned, p, q = crossing(mesh.corners, distance, count)
        pairs = [(turned[:, [0, 1]], p), (turned[:, [0, 2]], q)][::1 if count == 1 else -1]
        edges.append(np.stack([np.sort(ends, axis=1) for ends, _ in pairs], axis=1))
        places.append(np.stack([(1.0 - s)[:, None] * mesh.points[e[:, 0]] + s[:, None] * mesh.points[e[:, 1]] for e, s in pairs], axis=1))
    edge, place = np.concatenate(edges).reshape(-1, 2), np.concatenate(places).reshape(-1, 3)
    if not len(edge):
        return []
    _, first, node = np.unique(edge[:, 0] * len(mesh.points) + edge[:, 1], return_index=True, return_inverse=True)
    where = place[first][:, [k for k in range(3) if k != axis]]
    return [where[line] for line in chains(node.reshape(-1, 2))]


def chains(steps: np.ndarray) -> list[list[int]]:
    """Lines of numbers that steps (n, 2) from one to the next make: first those with a beginning, then the closed ones."""
    after: dict[int, list[int]] = {}
    for start, end in steps.tolist():
        after.setdefault(start, []).append(end)
    ends = set(steps[:, 1].tolist())
    found = []
    for start in sorted(after, key=lambda node: node in ends):
        while after[start]:
            line = [start]
            while after.get(line[-1]):
                line.append(after[line[-1]].pop())
            found.append(line)
    return found


def face_normals(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    a, b, c = (points[corners[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)


def point_normals(mesh: Mesh) -> np.ndarray:
    """Normals (n, 3) of the points: means over their triangles by area."""
    a, b, c = (mesh.points[mesh.corners[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    total = np.stack([np.bincount(mesh.corners.ravel(), np.repeat(normal[:, k], 3), len(mesh.points)) for k in range(3)], axis=1)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)


def corner_normals(mesh: Mesh, angle: float) -> np.ndarray:
    """Normals (m, 3, 3) of the corners: means over the triangles around the point whose normals are within `angle` [degrees]."""
    normals = face_normals(mesh.points, mesh.corners)
    point = mesh.corners.ravel()
    order = np.argsort(point, kind="stable")
    counts = np.bincount(point, minlength=len(mesh.points))
    begins = np.cumsum(counts) - counts
    repeats = counts[point]
    one = np.repeat(np.arange(len(point)), repeats)
    other = order[np.repeat(begins[point], repeats) + np.arange(len(one)) - np.repeat(np.cumsum(repeats) - repeats, repeats)]
    like = (normals[one // 3] * normals[other // 3]).sum(axis=1) > np.cos(np.radians(angle))
    total = np.stack([np.bincount(one[like], normals[other[like] // 3, k], len(point)) for k in range(3)], axis=1)
    return (total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)).reshape(-1, 3, 3)


def sharp_edges(mesh: Mesh, angle: float) -> np.ndarray:
    """Ends (n, 2, 3) of edges of one triangle alone, or between two whose normals differ by more than `angle` [degrees]."""
    normals = face_normals(mesh.points, mesh.corners)
    ends = np.sort(np.stack([mesh.corners, np.roll(mesh.corners, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edge, first, number, count = np.unique(ends, axis=0, return_index=True, return_inverse=True, return_counts=True)
    last = np.zeros(len(edge), dtype=int)
    last[number.reshape(-1)] = np.arange(len(ends))
    same = (normals[first // 3] * normals[last // 3]).sum(axis=1)
    return mesh.points[edge[(count == 1) | (same < np.cos(np.radians(angle)))]]
