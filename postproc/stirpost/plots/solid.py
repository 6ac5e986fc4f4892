# SPDX-License-Identifier: MIT
"""The metal and the tools of some frames for the view of the page that turns: three.js, and what it draws."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import Colormap, Normalize

from ..analysis import surface, units
from ..io.frames import Frame
from ..io.mesh import Mesh
from . import look

if TYPE_CHECKING:
    from ..run import Run

MOST_FRAMES = 8
MOST_TRIANGLES = 16000  # a frame; their points are fewer than the 65536 that 16 bits tell apart
THREE = ("jupyter_threejs_sage", "static/r130/three.min.js")  # with its OrbitControls

Field = tuple[str, str, Normalize, Colormap]  # name in the frames, label, scale, colours


def library() -> str:
    """The text of three.js."""
    return files(THREE[0]).joinpath(THREE[1]).read_text(encoding="utf-8")


def pack(run: Run, frames: list[Frame], fields: list[Field]) -> str:
    """Surfaces for the viewer, as JSON."""
    names = [name for name, _, _, _ in fields]
    meshes = coarse_surfaces(run, frames, names)
    tools = [run.tool_mesh(frame) for frame in frames]
    low, high = bounds(mesh for mesh in (*meshes, *tools) if mesh is not None)
    metal = bounds(meshes)
    packed = []
    for frame, mesh, tool in zip(frames, meshes, tools):
        values = {name: text_of(np.clip(np.nan_to_num(np.asarray(norm(look.shown(name, mesh[name])), dtype=float)), 0, 1) * 255, np.uint8)
                  for name, _, norm, _ in fields}
        one = {"time": f"t = {units.seconds(frame.time)}", "metal": geometry(mesh, low, high) | {"values": values}}
        if tool is not None:
            stripes = np.floor(tool["azimuth"] / (np.pi / 6)).astype(int) % 2
            one["tool"] = geometry(tool, low, high) | {"stripe": text_of(stripes, np.uint8)}
        packed.append(one)
    shown = [{"name": name, "label": label, "low": f"{norm.vmin:.4g}", "high": f"{norm.vmax:.4g}",
              "colours": (colours(np.linspace(0, 1, 256))[:, :3] * 255).astype(int).ravel().tolist()}
             for name, label, norm, colours in fields]
    return json.dumps({"low": low.tolist(), "high": high.tolist(), "metal": metal.tolist(), "fields": shown,
                       "frames": packed}, separators=(",", ":"))


def bounds(meshes: Iterable[Mesh]) -> np.ndarray:
    """Lowest and highest corner of all (2, 3)."""
    found = np.array([mesh.bounds for mesh in meshes])
    return np.array([found[:, 0].min(axis=0), found[:, 1].max(axis=0)])


def coarse_surfaces(run: Run, frames: list[Frame], names: list[str]) -> list[Mesh]:
    """Surfaces on cubes so large that they have about half the triangles that the view can have: their number goes as the square."""
    coarser, found = 1.0, list[Mesh]()
    for frame in frames:
        mesh = surface.metal(run, frame, names, coarser)
        if not found and len(mesh.corners) > 0.6 * MOST_TRIANGLES:
            coarser = float(np.sqrt(len(mesh.corners) / (0.6 * MOST_TRIANGLES)))
            mesh = surface.metal(run, frame, names, coarser)
        found.append(thinned(mesh))
    return found


def thinned(mesh: Mesh) -> Mesh:
    """A mesh with fewer triangles, if it has too many: the points in one cube of a lattice are merged."""
    a, b, c = (mesh.points[mesh.corners[:, k]] for k in range(3))
    edge = np.sqrt(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / MOST_TRIANGLES)
    fewer = mesh
    while len(fewer.corners) > MOST_TRIANGLES:
        _, number, count = np.unique(np.floor(mesh.points / edge), axis=0, return_inverse=True, return_counts=True)
        number = number.reshape(-1)
        corners = number[mesh.corners]
        left = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
        mean = {name: np.bincount(number, values) / count for name, values in mesh.data.items()}
        points = np.stack([np.bincount(number, mesh.points[:, k]) / count for k in range(3)], axis=1)
        fewer, edge = Mesh(points, corners[left], mean), 1.1 * edge
    return fewer


def geometry(mesh: Mesh, low: np.ndarray, high: np.ndarray) -> dict[str, str]:
    """Points in 65535ths of the box low..high, and corners of the triangles."""
    places = (mesh.points - low) / np.maximum(high - low, 1e-30) * 65535
    return {"points": text_of(np.round(places).clip(0, 65535), np.uint16), "corners": text_of(mesh.corners, np.uint16)}


def text_of(values: np.ndarray, kind: type[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
