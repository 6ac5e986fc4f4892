# SPDX-License-Identifier: MIT
"""A run directory: NAME_000000.hdf ..., NAME.hdf.series, NAME_history.csv, NAME_probes.csv."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, TypeVar

import numpy as np

from .files import hdf5, text_of, told
from .mesh import Mesh
from .scene import Scene
from .table import Table, more, read_table

if TYPE_CHECKING:
    import pyvista as pv

    from .alarms import Check
    from .flow import Flow
    from .tracks import Tracks

T = TypeVar("T")
FRAME_NAME = re.compile(r"^(?P<name>.+)_(?P<number>\d{6,})\.hdf$")


LONGEST = 1e4  # of what a run may have of a length [m]: what is farther away is damage


class NoRun(ValueError):
    """The directory holds nothing to report on."""


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
        """Its lengths [m], those that are none as NaN; [NaN] without it."""
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


class Run:
    """All there is in a run directory: `frames` in the order of time, `history` and `probes` (None without them), `scene`,
    which is the input as it was run, `summary`. What cannot be read of it is left out, and is a line in `faults` and on
    standard error."""

    def __init__(self, directory: Path | str):
        self.directory = Path(directory)
        self.faults: list[str] = []
        self._flow: Flow | None = None  # the last one that was asked for
        if not self.directory.is_dir():
            raise NoRun(f"{directory}: no such directory")
        self.name = run_name(self.directory)
        found: list[str] = []
        self.frames = list_frames(self.directory, self.name, found)
        self.history: Table | None = read_table(self.directory / f"{self.name}_history.csv", found)
        self.probes: Table | None = read_table(self.directory / f"{self.name}_probes.csv", found)
        if not self.frames and self.history is None:
            raise NoRun("; ".join(found) or
                        f"{directory}: no run here (no {self.name}_000000.hdf, no {self.name}_history.csv)")
        self.summary: dict | None = read_summary(self.directory / f"{self.name}_summary.json", found)
        self.input_text = self.attempt("the input in the frames", read_input_text, self.frames) or ""
        self.resolved_text = read_resolved(self.directory / f"{self.name}_input.nml", found) or self.input_text
        for text in found:
            self.warn(text)
        self.scene: Scene = self.attempt("the input", Scene, self.resolved_text) or Scene("")
        self.spacing = (self.attempt("the spacing of the particles", particle_spacing, self.frames[0]) or 1e-3) \
            if self.frames else np.nan
        self.cell = float(np.max(self.frames[0].attribute("cell"))) if self.frames else np.nan

    def warn(self, text: str) -> None:
        """Say once that something is left out, and keep it for the page."""
        if text not in self.faults:
            self.faults.append(text)
            print(f"warning: {text}", file=sys.stderr)

    def attempt(self, what: str, function: Callable[..., T], *arguments: Any) -> T | None:
        """What a function gives, or None and a warning: what is damaged does not take along what is not."""
        try:
            return function(*arguments)
        except Exception as problem:  # whatever a damaged file leads to
            self.warn(f"{what} left out: {told(problem)}")
            return None

    def drop_damaged(self, names: list[str]) -> None:
        """Leave out the frames whose places, or fields of these names, cannot be read."""
        def sound(frame: Frame) -> bool:
            for name in names:
                frame.field(name)
            return len(frame.points()) > 0

        self.frames = [frame for frame in self.frames if self.attempt("a frame", sound, frame)]
        if not self.frames and self.history is None:
            raise NoRun("; ".join(self.faults))

    def spacing_of(self, body: int) -> float:
        """Edge of the particles of a body, whose number is from 0 [m]."""
        given = self.frames[0].attribute("spacing")
        return float(given[body]) if body < len(given) and np.isfinite(given[body]) else self.spacing

    def tools(self, frame: Frame) -> pv.PolyData | None:
        """The surfaces of all tools at the time of a frame, with azimuth [rad] and the number of the tool; None if there are none,
        or their file cannot be read."""
        mesh = self.tool_mesh(frame)
        return None if mesh is None else mesh.to_pyvista()

    def tool_mesh(self, frame: Frame) -> Mesh | None:
        """The same as a mesh of arrays."""
        found = FRAME_NAME.match(frame.path.name)
        path = frame.path.with_name(f"{found['name']}_tools_{found['number']}.hdf") if found else None
        return self.attempt("a tool", tool_surface, path) if path is not None and path.is_file() else None

    def at(self, time: float | None = None) -> Frame:
        """The first frame at or after a time [s], the last one without a time."""
        if not self.frames:
            raise NoRun(f"{self.directory}: no frames")
        frames = self.frames[-1:] if time is None else [frame for frame in self.frames if frame.time >= time]
        if not frames:
            raise NoRun(f"no frame at or after {time} s")
        return frames[0]

    def surface(self, frame: Frame, fields: tuple[str, ...] = ("temperature", "plastic_strain")) -> pv.PolyData:
        """The free surface of all bodies of a frame, with some fields."""
        from .surface import metal

        return metal(self, frame, list(fields)).to_pyvista()

    def flow(self, time: float | None = None) -> Flow:
        """What the pass did to the metal until the first frame at or after a time [s], or the last one."""
        from .flow import Flow

        frame = self.at(time)
        if self._flow is None or self._flow.frame is not frame:
            self._flow = Flow(self, frame)
        return self._flow

    def tracks(self, groups: list[str] | None = None, until: float | None = None) -> Tracks:
        """Pathlines of tracers, of these &TRACER and until a time [s]."""
        from .tracks import Tracks

        return Tracks.read(self, groups, until)

    def measures(self) -> dict[str, float]:
        """Highest temperature, loads after the plunge, heat, flash; the keys have the units."""
        from .summary import measures

        return measures(self)

    def checks(self) -> list[Check]:
        """Whether the figures may be trusted, condition by condition, as the report has it."""
        from .alarms import checks

        return checks(self)


def text_in(value) -> str:
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
            faults.append(f"{series}: not understood, frames are taken by their numbers ({told(problem)})")
    gone = [path for path, _ in listed if not path.is_file()]
    if gone:
        faults.append(f"{gone[0]}: no such file" + more(gone, "frame"))
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
        except ValueError as problem:
            faults.append(f"a frame left out: {problem}")
            continue
        if frame.odd:
            faults.append(f"{path}: field {frame.odd[0]} is not {frame.count} numbers" + more(frame.odd, "field"))
        if frame.count > 0:
            frames.append(frame)
    return sorted(frames, key=lambda frame: frame.time)


def read_summary(path: Path, faults: list[str]) -> dict | None:
    """What a run says of itself when it ends; None without that."""
    if not path.exists():
        return None
    try:
        return dict(json.loads(text_of(path)))
    except (OSError, ValueError, TypeError) as problem:
        faults.append(f"{path}: not understood ({told(problem)})")
        return {}


def read_resolved(path: Path, faults: list[str]) -> str:
    """The input as it was run, with its defaults as comments; '' if the run has not left it."""
    try:
        return text_of(path) if path.exists() else ""
    except OSError as problem:
        faults.append(told(problem))
        return ""


def read_input_text(frames: list[Frame]) -> str:
    for frame in frames:
        with hdf5(frame.path) as file:
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
    given = frame.attribute("spacing")
    if np.isfinite(given).any():
        return float(np.nanmax(given))
    points = frame.points()
    nearest = []
    for k in np.linspace(0, len(points) - 1, min(samples, len(points))).astype(int):
        squares = ((points - points[k]) ** 2).sum(axis=1)
        apart = squares[squares > 0]
        if apart.size:
            nearest.append(np.sqrt(apart.min()))
    return float(np.median(nearest)) if nearest else 1e-3
