# SPDX-License-Identifier: MIT
"""A run directory: NAME_000000.hdf ..., NAME.hdf.series, NAME_history.csv, NAME_probes.csv."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from .table import Table, read_table

if TYPE_CHECKING:
    import pyvista as pv

FRAME_NAME = re.compile(r"^(?P<name>.+)_(?P<number>\d{6,})\.hdf$")


class NoRun(ValueError):
    """The directory holds nothing to report on."""


class Frame:
    """One VTKHDF file; fields are read when they are asked for. Particles without a finite
    position, as a run that failed may leave them, are left out."""

    def __init__(self, path: Path, time: float | None = None):
        self.path = path
        with h5py.File(path, "r") as file:
            self.count = int(file["VTKHDF/Points"].shape[0])
            self.attributes = {key: np.squeeze(value) for key, value in file.attrs.items()}
            self.fields = list(file.get("VTKHDF/PointData", {}))
        names = np.atleast_1d(self.attributes.get("body_names", [])).tolist()
        self.body_names = [n.decode(errors="replace") if isinstance(n, bytes) else str(n) for n in names]
        self.step = int(self.attributes.get("step", -1))
        self.time = float(self.attributes.get("time", np.nan)) if time is None else float(time)
        self._finite: np.ndarray | None = None

    def bodies(self) -> np.ndarray:
        """Numbers of the bodies of the particles, from 0."""
        body = self.field("body")
        return np.zeros(len(self.points()), dtype=int) if body is None else body.astype(int) - 1

    def points(self) -> np.ndarray:
        """Positions (n, 3) [m]."""
        with h5py.File(self.path, "r") as file:
            points = file["VTKHDF/Points"][...].astype(np.float64).reshape(-1, 3)
        self._finite = np.isfinite(points).all(axis=1)
        return points[self._finite]

    def field(self, name: str) -> np.ndarray | None:
        """A field of the particles in SI units, or None if the frame has none of this name."""
        if name not in self.fields:
            return None
        if self._finite is None:
            self.points()
        with h5py.File(self.path, "r") as file:
            return file["VTKHDF/PointData"][name][...][self._finite]


class Run:
    """All there is in a run directory; frames are in the order of time."""

    def __init__(self, directory: Path):
        self.directory = Path(directory)
        if not self.directory.is_dir():
            raise NoRun(f"{directory}: no such directory")
        self.name = run_name(self.directory)
        self.frames = list_frames(self.directory, self.name)
        self.history: Table | None = read_table(self.directory / f"{self.name}_history.csv")
        self.probes: Table | None = read_table(self.directory / f"{self.name}_probes.csv")
        if not self.frames and self.history is None:
            raise NoRun(
                f"{directory}: no run here (no {self.name}_000000.hdf, no {self.name}_history.csv)"
            )
        self.summary: dict | None = read_summary(self.directory / f"{self.name}_summary.json")
        self.input_text = read_input_text(self.frames)
        self.resolved_text = read_resolved(self.directory / f"{self.name}_input.nml") or self.input_text
        self.spacing = particle_spacing(self.frames[0]) if self.frames else np.nan
        self.cell = (
            float(np.max(self.frames[0].attributes.get("cell", np.nan))) if self.frames else np.nan
        )

    def spacing_of(self, body: int) -> float:
        """Edge of the particles of a body, whose number is from 0 [m]."""
        given = np.atleast_1d(self.frames[0].attributes.get("spacing", np.nan)).astype(float)
        value = given[body] if body < len(given) else np.nan
        return float(value) if np.isfinite(value) and value > 0 else self.spacing

    def tools(self, frame: Frame) -> pv.PolyData | None:
        """The surfaces of all tools at the time of a frame, with azimuth [rad], velocity [m/s] and the number of the
        tool; None if there are none, or their file cannot be read."""
        found = FRAME_NAME.match(frame.path.name)
        path = frame.path.with_name(f"{found['name']}_tools_{found['number']}.hdf") if found else None
        if path is None or not path.is_file():
            return None
        import pyvista as pv

        try:
            with h5py.File(path, "r") as file:
                group = file["VTKHDF"]
                mesh = pv.PolyData.from_regular_faces(group["Points"][...], group["Connectivity"][...].reshape(-1, 3))
                for name, values in group["PointData"].items():
                    mesh.point_data[name] = values[...]
        except (OSError, KeyError, ValueError):  # still being written, or cut short
            return None
        return mesh

    @property
    def title(self) -> str:
        """TITLE of &RUN, '' without one."""
        found = re.search(r"(?ims)^\s*&RUN\b[^/]*?\bTITLE\s*=\s*'((?:[^']|'')*)'", self.input_text)
        return found[1].replace("''", "'").strip() if found else ""

    def setting(self, group: str, key: str) -> float | None:
        """A number of the first group of this name in the input, None if it is not given."""
        for text in re.findall(rf"(?ims)^\s*&{group}\b(.*?)^\s*/", self.input_text + "\n/"):
            found = re.search(rf"(?im)\b{key}\s*=\s*([-+.\d]+(?:[ed][-+]?\d+)?)", text)
            return float(re.sub("[dD]", "e", found[1])) if found else None
        return None


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


def list_frames(directory: Path, name: str) -> list[Frame]:
    """The frames of the series, or else the files by number. Unreadable files are left out."""
    series = directory / f"{name}.hdf.series"
    listed: list[tuple[Path, float | None]] = []
    try:
        listed = [
            (directory / entry["name"], float(entry["time"]))
            for entry in json.loads(series.read_text())["files"]
        ]
    except (OSError, ValueError, KeyError, TypeError):
        pass
    listed = [(path, time) for path, time in listed if path.is_file()]
    if not listed:
        numbered = [(FRAME_NAME.match(path.name), path) for path in directory.glob("*.hdf")]
        listed = [
            (path, None)
            for _, path in sorted(
                (int(match["number"]), path)
                for match, path in numbered
                if match and match["name"] == name
            )
        ]
    frames = []
    for path, time in listed:
        try:
            frame = Frame(path, time)
        except (OSError, KeyError):  # still being written, or cut short
            continue
        if frame.count > 0:
            frames.append(frame)
    return sorted(frames, key=lambda frame: frame.time)


def read_summary(path: Path) -> dict | None:
    """What a run says of itself when it ends; None without that."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def read_resolved(path: Path) -> str:
    """The input as it was run, with its defaults as comments; '' if the run has not left it."""
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def read_input_text(frames: list[Frame]) -> str:
    for frame in frames:
        with h5py.File(frame.path, "r") as file:
            if "stirpoint/input" not in file:
                continue
            lines = np.atleast_1d(file["stirpoint/input"][()])
            return "\n".join(
                line.decode(errors="replace").rstrip() if isinstance(line, bytes) else str(line)
                for line in lines
            ).strip("\0")
    return ""


def particle_spacing(frame: Frame, samples: int = 48) -> float:
    """Edge of a particle [m]: the attribute `spacing` (the largest of the bodies), else the median
    distance of some particles to their nearest neighbours."""
    given = np.atleast_1d(frame.attributes.get("spacing", np.nan)).astype(float)
    given = given[np.isfinite(given) & (given > 0)]
    if given.size:
        return float(given.max())
    points = frame.points()
    nearest = []
    for k in np.linspace(0, len(points) - 1, min(samples, len(points))).astype(int):
        squares = ((points - points[k]) ** 2).sum(axis=1)
        apart = squares[squares > 0]
        if apart.size:
            nearest.append(np.sqrt(apart.min()))
    return float(np.median(nearest)) if nearest else 1e-3
