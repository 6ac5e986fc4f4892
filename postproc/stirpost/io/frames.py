# SPDX-License-Identifier: MIT
"""The files of a run directory: NAME_000000.hdf ..., NAME.hdf.series, tools, summary, input."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .files import hdf5, message_of, text_of
from .mesh import Mesh
from .table import more

if TYPE_CHECKING:
    import pyvista as pv

FRAME_NAME = re.compile(r"^(?P<name>.+)_(?P<number>\d{6,})\.hdf$")


LONGEST = 1e4  # of what a run may have of a length [m]: what is farther away is damage


class NoRun(ValueError):
    """The directory has no results of a run."""


class Frame:
    """One VTKHDF file; fields are read when they are asked for. Particles without a position,
    as a run that failed or damage may leave them, are left out. A file that cannot be read is a ValueError that names it."""

    def __init__(self, path: Path, time: float | None = None):
        self.path = path
        with hdf5(path) as file:
            self.count = int(file["VTKHDF/Points"].shape[0])
            self.attributes = {key: np.squeeze(value) for key, value in file.attrs.items()}
            data = file.get("VTKHDF/PointData", {})
            self.fields = [name for name in data if data[name].shape[:1] == (self.count,) and data[name].dtype.kind in "fiu"]
            self.units = {name: text_in(data[name].attrs.get("units", "")) for name in self.fields}
            self.odd = sorted(set(data) - set(self.fields))  # of another length, or no numbers
            self.step = int(self.attributes.get("step", -1))
            self.time = float(self.attributes.get("time", np.nan)) if time is None else float(time)
            if not np.isfinite(self.time):
                raise ValueError("no time")
        names = np.atleast_1d(self.attributes.get("body_names", [])).tolist()
        self.body_names = [text_in(name) for name in names]
        self._finite: np.ndarray | None = None

    def attribute(self, name: str) -> np.ndarray:
        """The lengths [m] in an attribute, invalid ones as NaN; [NaN] without it."""
        values = np.atleast_1d(self.attributes.get(name, np.nan))
        values = values.astype(float) if values.dtype.kind in "fiu" else np.full(1, np.nan)
        return np.where((values > 0) & (values <= LONGEST), values, np.nan)

    def bodies(self) -> np.ndarray:
        """Numbers of the bodies of the particles, from 0."""
        body = self.field("body")
        return np.zeros(len(self.points()), dtype=int) if body is None else np.maximum(body.astype(int) - 1, 0)

    def points(self) -> np.ndarray:
        """Positions (n, 3) [m]."""
        with hdf5(self.path) as file:
            points = file["VTKHDF/Points"][...].astype(np.float64).reshape(-1, 3)
            self._finite = (np.abs(points) <= LONGEST).all(axis=1)
            if not self._finite.any():
                raise ValueError("no particle has a position")
        return points[self._finite]

    def field(self, name: str) -> np.ndarray | None:
        """A field of the particles in SI units, or None if the frame has none of this name."""
        if name not in self.fields:
            return None
        if self._finite is None:
            self.points()
        with hdf5(self.path) as file:
            return file["VTKHDF/PointData"][name][...][self._finite]

    def need(self, name: str) -> np.ndarray:
        """A field of the particles in SI units; NoRun without it."""
        values = self.field(name)
        if values is None:
            raise NoRun(f"{self.path}: no field {name}")
        return values

    def mesh(self) -> pv.PolyData:
        """The particles as points with all fields in SI units, whose names are in `units`."""
        import pyvista as pv

        mesh = pv.PolyData(self.points())
        for name in self.fields:
            mesh.point_data[name] = self.field(name)
        return mesh


def text_in(value: object) -> str:
    """Text of an HDF5 file, which may come as bytes."""
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def run_name(directory: Path) -> str:
    """The stem of the directory if files carry it, else of the first series, frame or history; NoRun if there are two runs."""
    stem = re.sub(r"\.out$", "", directory.resolve().name)
    names = sorted(path.name for path in directory.iterdir())
    if any(name.startswith((f"{stem}_", f"{stem}.")) for name in names):
        return stem
    runs = sorted({match[1] for name in names for match in [re.match(r"^(.+?)(?:\.hdf\.series|_history\.csv)$", name)] if match})
    runs = [name for name in runs if name.removesuffix("_tools") == name or name.removesuffix("_tools") not in runs]
    if len(runs) > 1:
        raise NoRun(f"{directory}: holds more than one run ({', '.join(runs)}): give each a directory of its own")
    for pattern in (r"^(.+)\.hdf\.series$", r"^(.+)_\d{6,}\.hdf$", r"^(.+)_history\.csv$"):
        found = [match[1] for match in (re.match(pattern, name) for name in names) if match]
        if found:
            return found[0]
    return stem


def tool_surface(path: Path) -> Mesh:
    with hdf5(path) as file:
        group = file["VTKHDF"]
        points, corners = group["Points"][...], group["Connectivity"][...].reshape(-1, 3)
        if corners.min() < 0 or corners.max() >= len(points) or not (np.abs(points) <= LONGEST).all():
            raise ValueError("corners without a place")
        return Mesh(points.astype(float), corners.astype(np.int64), {name: group["PointData"][name][...] for name in ("azimuth", "tool")})


def list_frames(directory: Path, name: str, faults: list[str]) -> list[Frame]:
    """The frames of the series, or else the files by number. Unreadable files are left out."""
    series = directory / f"{name}.hdf.series"
    listed: list[tuple[Path, float | None]] = []
    if series.exists():
        try:
            listed = [(directory / entry["name"], float(entry["time"])) for entry in json.loads(text_of(series))["files"]]
        except (OSError, ValueError, KeyError, TypeError) as problem:
            faults.append(f"{series}: not understood, frames are taken by their numbers ({message_of(problem)})")
    gone = [path for path, _ in listed if not path.is_file()]
    if gone:
        faults.append(f"{gone[0]}: no such file" + more(gone, "frame"))
    listed = [(path, time) for path, time in listed if path.is_file()]
    if not listed:
        numbered = [(FRAME_NAME.match(path.name), path) for path in directory.glob("*.hdf")]
        listed = [(path, None) for _, path in sorted((int(match["number"]), path) for match, path in numbered if match and match["name"] == name)]
    frames = []
    for path, time in listed:
        try:
            frame = Frame(path, time)
        except ValueError as problem:
            faults.append(f"a frame left out: {problem}")
            continue
        if frame.odd:
            faults.append(f"{path}: field {frame.odd[0]} is not {frame.count} numbers" + more(frame.odd, "field"))
        if frame.count > 0:
            frames.append(frame)
    return sorted(frames, key=lambda frame: frame.time)


def read_summary(path: Path, faults: list[str]) -> dict | None:
    """Summary that a run writes at its end; None without one."""
    if not path.exists():
        return None
    try:
        return dict(json.loads(text_of(path)))
    except (OSError, ValueError, TypeError) as problem:
        faults.append(f"{path}: not understood ({message_of(problem)})")
        return {}


def read_resolved(path: Path, faults: list[str]) -> str:
    """The input as it was run, with its defaults as comments; '' if the run has not left it."""
    try:
        return text_of(path) if path.exists() else ""
    except OSError as problem:
        faults.append(message_of(problem))
        return ""


def read_input_text(frames: list[Frame]) -> str:
    for frame in frames:
        with hdf5(frame.path) as file:
            if "stirpoint/input" not in file:
                continue
            lines = np.atleast_1d(file["stirpoint/input"][()])
            return "\n".join(text_in(line).rstrip() for line in lines).strip("\0")
    return ""


def particle_spacing(frame: Frame, samples: int = 48) -> float:
    """Edge of a particle [m]: the attribute `spacing` (the largest of the bodies), else the median
    distance of some particles to their nearest neighbours."""
    given = frame.attribute("spacing")
    if np.isfinite(given).any():
        return float(np.nanmax(given))
    points = frame.points()
    nearest = []
    for k in np.linspace(0, len(points) - 1, min(samples, len(points))).astype(int):
        squares = ((points - points[k]) ** 2).sum(axis=1)
        distances = squares[squares > 0]
        if distances.size:
            nearest.append(np.sqrt(distances.min()))
    return float(np.median(nearest)) if nearest else 1e-3
