# SPDX-License-Identifier: MIT
"""The free surface of the metal by pysplashsurf, and outlines of the tools."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import pysplashsurf
from scipy.spatial import ConvexHull

from ..io.frames import Frame
from ..io.mesh import Mesh, merged

if TYPE_CHECKING:
    from ..run import Run

# The smallest kernel that does not show single particles. Other numbers move a face by a fifth of a particle at most:
# tests/test_surface.py.
SMOOTHING = 2.0  # smoothing length over the radius of a particle, which is half its edge
CUBE = 1.0  # edge of a marching cube over that radius
LEVEL = 0.6  # of the colour field, which is 1 inside and 0.5 at a flat face
SMOOTHINGS = 10  # of the mesh, weighted so that it does not shrink


def reconstruct(points: np.ndarray, spacing: float, fields: dict[str, np.ndarray] | None = None, coarser: float = 1.0) -> Mesh:
    """The closed surface around particles `spacing` apart (n, 3) [m], with the fields (n) of the
    particles near it, on marching cubes that are `coarser` by a factor."""
    found = pysplashsurf.reconstruction_pipeline(
        np.ascontiguousarray(points, dtype=np.float64),
        attributes_to_interpolate={k: np.ascontiguousarray(v, dtype=np.float64) for k, v in (fields or {}).items()},
        particle_radius=0.5 * spacing,
        smoothing_length=SMOOTHING,
        cube_size=CUBE * coarser,
        iso_surface_threshold=LEVEL,
        mesh_cleanup=True,
        mesh_smoothing_iters=SMOOTHINGS,
    )
    data = found[0] if isinstance(found, tuple) else found
    return Mesh(np.array(data.mesh.vertices), np.asarray(data.mesh.triangles).astype(np.int64),
                {name: np.array(values) for name, values in data.point_attributes.items()})


def metal(run: Run, frame: Frame, names: list[str], coarser: float = 1.0) -> Mesh:
    """The surfaces of the metal of a frame with the fields `names`: one around the bodies that move as one, since a surface around each
    has holes where they are mixed; not to be moved, as others have them too."""
    return kept(run, frame, tuple(names), coarser)


@lru_cache(maxsize=2)
def kept(run: Run, frame: Frame, names: tuple[str, ...], coarser: float) -> Mesh:
    points, body = frame.points(), frame.bodies()
    fields = {name: frame.need(name) for name in names}
    parts = []
    for (spacing, _), numbers in joined(run, frame).items():
        own = np.isin(body, numbers)
        parts.append(reconstruct(points[own], spacing, {name: values[own] for name, values in fields.items()}, coarser))
    return merged(parts)


def joined(run: Run, frame: Frame) -> dict[tuple[float, str], list[int]]:
    """Numbers of the bodies that share a surface, by their spacing of particles and, with a &CONTACT, which keeps a body apart, its name."""
    apart = {str(group.get(key, "")).lower() for group in run.scene.groups("contact") for key in ("body", "other")}
    shared: dict[tuple[float, str], list[int]] = {}
    for number in np.unique(frame.bodies()).tolist():
        name = frame.body_names[number].lower() if number < len(frame.body_names) else ""
        shared.setdefault((run.spacing_of(number), name if name in apart else ""), []).append(number)
    return shared


def silhouette(tool: Mesh) -> list[np.ndarray]:
    """Outlines of the tools seen from above: closed lines (n, 2) [m]."""
    found = []
    for number in np.unique(tool["tool"]):
        places = tool.points[tool["tool"] == number][:, :2]
        hull = places[ConvexHull(places).vertices]
        found.append(np.vstack([hull, hull[:1]]))
    return found
