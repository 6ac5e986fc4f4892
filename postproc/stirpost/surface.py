# SPDX-License-Identifier: MIT
"""The free surface of the metal by pysplashsurf, and pictures of it by VTK without a display."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import lru_cache

import numpy as np
import pysplashsurf
import pyvista as pv
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull, cKDTree
from vtkmodules.vtkCommonCore import vtkLogger

from . import look
from .run import Frame, Run

# The smallest kernel that does not show single particles. Other numbers move a face by a fifth of a particle at most:
# tests/test_surface.py.
SMOOTHING = 2.0  # smoothing length over the radius of a particle, which is half its edge
CUBE = 0.8  # edge of a marching cube over that radius
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


def reconstruct(points: np.ndarray, spacing: float, fields: dict[str, np.ndarray] | None = None) -> pv.PolyData:
    """The closed surface around particles `spacing` apart (n, 3) [m], with normals and the fields (n) of the
    particles near it."""
    found = pysplashsurf.reconstruction_pipeline(
        np.ascontiguousarray(points, dtype=np.float64),
        attributes_to_interpolate={k: np.ascontiguousarray(v, dtype=np.float64) for k, v in (fields or {}).items()},
        particle_radius=0.5 * spacing,
        smoothing_length=SMOOTHING,
        cube_size=CUBE,
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


def metal(run: Run, frame: Frame, names: list[str]) -> pv.PolyData:
    """The surfaces of all bodies of a frame, each by itself, with the fields `names`."""
    points, body = frame.points(), frame.bodies()
    fields = {name: frame.field(name) for name in names}
    parts = []
    for number in np.unique(body):
        own = body == number
        own_fields = {name: values[own] for name, values in fields.items()}
        part = reconstruct(points[own], run.spacing_of(number), own_fields)
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


def plotter(width: int, height: int) -> pv.Plotter:
    scene = pv.Plotter(off_screen=True, window_size=(width, height), lighting="none")
    for position, strength in (((-0.5, -0.8, 1.6), 0.85), ((0.9, 0.4, 0.7), 0.3)):
        scene.add_light(pv.Light(position=position, focal_point=(0, 0, 0), light_type="scenelight", intensity=strength))
    scene.enable_anti_aliasing("ssaa")
    return scene


def add_metal(scene: pv.Plotter, mesh: pv.PolyData, name: str, norm: Normalize, colours: Colormap) -> None:
    """Coloured by matplotlib, so that pictures of all kinds share their scales."""
    mesh.point_data["colour"] = (colours(norm(mesh.point_data[name]))[:, :3] * 255).astype(np.uint8)
    scene.add_mesh(mesh, scalars="colour", rgb=True, smooth_shading=True, ambient=0.28, diffuse=0.85, specular=0.06,
                   show_scalar_bar=False)


def add_tool(scene: pv.Plotter, tool: pv.PolyData | None, opacity: float) -> None:
    """Grey, with stripes that show how it has turned."""
    if tool is not None:
        stripes = np.floor(tool["azimuth"] / (np.pi / 6)).astype(int) % 2
        tool.point_data["grey"] = np.where(stripes[:, None] == 0, 158, 108).repeat(3, axis=1).astype(np.uint8)
        scene.add_mesh(tool, scalars="grey", rgb=True, opacity=opacity, ambient=0.35, diffuse=0.7, show_scalar_bar=False)


def silhouette(tool: pv.PolyData) -> list[np.ndarray]:
    """Outlines of the tools seen from above: closed lines (n, 2) [m]."""
    found = []
    for number in np.unique(tool["tool"]):
        places = tool.points[tool["tool"] == number][:, :2]
        hull = places[ConvexHull(places).vertices]
        found.append(np.vstack([hull, hull[:1]]))
    return found


def from_above(mesh: pv.PolyData, name: str, norm: Normalize, colours: Colormap, low, high, width: int = 1000) -> np.ndarray:
    """Rows of colours of the box low..high seen from above, x to the right, the first row at the largest y."""
    size = np.asarray(high) - np.asarray(low)
    height = max(8, int(round(width * size[1] / size[0])))
    scene = plotter(width, height)
    add_metal(scene, mesh, name, norm, colours)
    middle = 0.5 * (np.asarray(low) + np.asarray(high))
    scene.camera_position = [middle + [0, 0, size.max()], middle, (0, 1, 0)]
    scene.camera.parallel_projection = True
    scene.camera.parallel_scale = 0.5 * size[1]
    return picture_of(scene)


def picture_of(scene: pv.Plotter) -> np.ndarray:
    image = scene.screenshot(None, return_img=True)
    scene.close()
    return image


def plate_picture(frame: Frame, mesh: pv.PolyData, tool: pv.PolyData | None, name: str, label: str, norm: Normalize,
                  colours: Colormap) -> Figure:
    """The lit plate at one time from the front left, with scales in mm and a colour bar."""
    scene = plotter(1400, 800)
    add_metal(scene, mesh, name, norm, colours)
    add_tool(scene, tool, 0.45)
    shown = mesh.bounds
    middle = np.array([0.5 * (shown[2 * k] + shown[2 * k + 1]) for k in range(3)])
    reach = np.ptp(np.reshape(shown, (3, 2)), axis=1)
    scene.show_bounds(bounds=[x * 1.0 for x in shown], axes_ranges=[x * look.MM for x in shown], xtitle="x [mm]",
                      ytitle="y [mm]", ztitle="z [mm]", font_size=11, color="#44525f", location="outer", ticks="outside",
                      n_zlabels=2, n_ylabels=3, n_xlabels=6, fmt="%.0f", minor_ticks=False)
    scene.camera_position = [middle + reach.max() * np.array([-0.55, -1.2, 0.95]), middle, (0, 0, 1)]
    scene.camera.view_angle = 24
    scene.reset_camera()
    scene.camera.zoom(1.1)
    image = picture_of(scene)
    figure = look.new_figure(10.8, 10.8 * 0.88 * image.shape[0] / image.shape[1] + 0.3)
    axis = figure.add_subplot()
    axis.imshow(image)
    axis.set_axis_off()
    axis.set_title(f"t = {look.seconds(frame.time)}", loc="left", pad=3)
    figure.colorbar(ScalarMappable(norm, colours), ax=axis, label=label, fraction=0.03, pad=0.01, aspect=26, shrink=0.8)
    return figure
