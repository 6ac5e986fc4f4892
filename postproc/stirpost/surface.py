# SPDX-License-Identifier: MIT
"""The free surface of the metal by pysplashsurf, and whether VTK can draw it here, without a display."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import lru_cache

import numpy as np
import pysplashsurf
import pyvista as pv
from matplotlib.colors import Colormap, Normalize
from scipy.spatial import ConvexHull
from vtkmodules.vtkCommonCore import vtkLogger

from . import look, views
from .run import Frame, Run

# The smallest kernel that does not show single particles. Other numbers move a face by a fifth of a particle at most:
# tests/test_surface.py.
SMOOTHING = 2.0  # smoothing length over the radius of a particle, which is half its edge
CUBE = 1.0  # edge of a marching cube over that radius
LEVEL = 0.6  # of the colour field, which is 1 inside and 0.5 at a flat face
SMOOTHINGS = 10  # of the mesh, weighted so that it does not shrink

PROBE = """
from vtkmodules.vtkRenderingCore import vtkRenderWindow
import vtkmodules.vtkRenderingOpenGL2
window = vtkRenderWindow(); window.SetOffScreenRendering(1); window.SetSize(8, 8); window.Render()
"""
WINDOWS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow", "vtkXOpenGLRenderWindow")  # the last needs a display
CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"  # of VTK
HINT = "no OpenGL here (Debian: libosmesa6 is enough, without a display): the pictures of the surface are left out"


@lru_cache(maxsize=1)
def can_render() -> bool:
    """Choose the first kind of window that works. VTK ends the whole process where it finds no OpenGL, so others try; it warns
    of each kind of window that it cannot open before one that it can, in every picture."""
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    if CHOICE in os.environ:
        return works({})
    for name in WINDOWS:
        if works({CHOICE: name}):
            os.environ[CHOICE] = name
            return True
    return False


def works(more: dict[str, str]) -> bool:
    return subprocess.run([sys.executable, "-c", PROBE], capture_output=True, check=False,
                          env=os.environ | more).returncode == 0


def reconstruct(points: np.ndarray, spacing: float, fields: dict[str, np.ndarray] | None = None, coarser: float = 1.0) -> pv.PolyData:
    """The closed surface around particles `spacing` apart (n, 3) [m], with normals and the fields (n) of the
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
        compute_normals=True,
        normals_smoothing_iters=SMOOTHINGS,
    )
    data = found[0] if isinstance(found, tuple) else found
    mesh = pv.PolyData.from_regular_faces(np.asarray(data.mesh.vertices), np.asarray(data.mesh.triangles).astype(np.int64))
    for name, values in data.point_attributes.items():
        mesh.point_data["Normals" if name == "normals" else name] = np.asarray(values)
    return mesh


def metal(run: Run, frame: Frame, names: list[str], coarser: float = 1.0) -> pv.PolyData:
    """The surfaces of all bodies of a frame, each by itself, with the fields `names`; not to be moved, as others have them too."""
    return kept(run, frame, tuple(names), coarser)


@lru_cache(maxsize=2)
def kept(run: Run, frame: Frame, names: tuple[str, ...], coarser: float) -> pv.PolyData:
    points, body = frame.points(), frame.bodies()
    fields = {name: frame.field(name) for name in names}
    parts = []
    for number in np.unique(body):
        own = body == number
        own_fields = {name: values[own] for name, values in fields.items()}
        part = reconstruct(points[own], run.spacing_of(number), own_fields, coarser)
        part.point_data["body"] = np.full(part.n_points, number + 1)
        parts.append(part)
    return parts[0] if len(parts) == 1 else pv.merge(parts, merge_points=False)


def loops(mesh: pv.PolyData, axis: int, at: float) -> list[np.ndarray]:
    """Where the plane `axis` = `at` cuts a closed surface: closed lines (n, 2) of the other two coordinates."""
    cut = mesh.slice(normal=np.eye(3)[axis], origin=at * np.eye(3)[axis]).strip(join=True, max_length=10**6)
    keep = [k for k in range(3) if k != axis]
    lines, found, k = cut.lines, [], 0
    while k < len(lines):
        found.append(cut.points[lines[k + 1:k + 1 + lines[k]]][:, keep])
        k += 1 + lines[k]
    return found


def silhouette(tool: pv.PolyData) -> list[np.ndarray]:
    """Outlines of the tools seen from above: closed lines (n, 2) [m]."""
    found = []
    for number in np.unique(tool["tool"]):
        places = tool.points[tool["tool"] == number][:, :2]
        hull = places[ConvexHull(places).vertices]
        found.append(np.vstack([hull, hull[:1]]))
    return found


def from_above(mesh: pv.PolyData, name: str, norm: Normalize, colours: Colormap, low, high, width: int = 640) -> np.ndarray:
    """Rows of colours of the box low..high seen from above, x to the right, the first row at the largest y."""
    views.coloured(mesh, look.shown(name, mesh.point_data[name]), norm, colours)
    return views.image(views.ABOVE, np.array([low[:2], high[:2]]), width / (high[0] - low[0]), mesh, None)
