# SPDX-License-Identifier: MIT
"""A run directory and an input, as scripts and commands use them: stirpost.Run and stirpost.Scene."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from .io import program, scene
from .io.files import message_of
from .io.frames import (
    FRAME_NAME,
    Frame,
    NoRun,
    list_frames,
    particle_spacing,
    read_input_text,
    read_resolved,
    read_summary,
    run_name,
    tool_surface,
)
from .io.mesh import Mesh
from .io.table import read_table

if TYPE_CHECKING:
    import pyvista as pv

    from .analysis.alarms import Check
    from .analysis.flow import Flow
    from .analysis.tracks import Tracks

T = TypeVar("T")


class Scene(scene.Scene):
    """An input that can be computed."""

    def run(self, path: Path | str, ranks: int = 1, named: str | None = None) -> Run:
        """Write it to a path, compute it on some MPI ranks, and read the results beside it, in the path with .out."""
        path = self.write(path)
        program.compute([path, "--quiet", "--output", path.with_suffix(".out")], named, ranks)
        return Run(path.with_suffix(".out"))


class Run:
    """The contents of a run directory: `frames` in the order of time, `history` and `probes` (empty without them), `scene`,
    which is the input as it was run, `summary`. What cannot be read is left out, with a line in `faults` and on standard error."""

    def __init__(self, directory: Path | str):
        self.directory = Path(directory)
        self.faults: list[str] = []
        self._flow: Flow | None = None  # the last one that was asked for
        if not self.directory.is_dir():
            raise NoRun(f"{directory}: no such directory")
        self.name = run_name(self.directory)
        found: list[str] = []
        self.frames = list_frames(self.directory, self.name, found)
        self.history = read_table(self.directory / f"{self.name}_history.csv", found)
        self.probes = read_table(self.directory / f"{self.name}_probes.csv", found)
        if not self.frames and not self.history:
            raise NoRun("; ".join(found) or
                        f"{directory}: no run here (no {self.name}_000000.hdf, no {self.name}_history.csv)")
        self.summary: dict | None = read_summary(self.directory / f"{self.name}_summary.json", found)
        self.input_text = self.attempt("the input in the frames", read_input_text, self.frames) or ""
        resolved = read_resolved(self.directory / f"{self.name}_input.nml", found)
        self.resolved_text = resolved or self.input_text
        for text in found:
            self.warn(text)
        self.scene: Scene = self.attempt(f"{self.name}_input.nml" if resolved else "the input in the frames", Scene, self.resolved_text) or Scene("")
        self.spacing = (self.attempt("the spacing of the particles", particle_spacing, self.frames[0]) or 1e-3) \
            if self.frames else np.nan
        self.cell = float(np.max(self.frames[0].attribute("cell"))) if self.frames else np.nan

    def warn(self, text: str) -> None:
        """Print once that something is left out, and store the message for the page."""
        if text not in self.faults:
            self.faults.append(text)
            print(f"warning: {text}", file=sys.stderr)

    def attempt(self, what: str, function: Callable[..., T], *arguments: Any) -> T | None:
        """The result of a function, or None and a warning if its data are damaged, so that the rest of the report is made."""
        try:
            return function(*arguments)
        except Exception as problem:  # whatever a damaged file leads to
            self.warn(f"{what} left out: {message_of(problem)}")
            return None

    def drop_damaged(self, names: list[str]) -> None:
        """Leave out the frames whose positions, or fields of these names, cannot be read."""
        def sound(frame: Frame) -> bool:
            for name in names:
                frame.field(name)
            return len(frame.points()) > 0

        self.frames = [frame for frame in self.frames if self.attempt("a frame", sound, frame)]
        if not self.frames and not self.history:
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
        """The surfaces of the tools as a mesh of arrays."""
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
        from .analysis.surface import metal

        return metal(self, frame, list(fields)).to_pyvista()

    def flow(self, time: float | None = None) -> Flow:
        """Measures of the flow of the metal until the first frame at or after a time [s], or the last one."""
        from .analysis.flow import Flow

        frame = self.at(time)
        if self._flow is None or self._flow.frame is not frame:
            self._flow = Flow(self, frame)
        return self._flow

    def tracks(self, groups: list[str] | None = None, until: float | None = None) -> Tracks:
        """Pathlines of tracers, of these &TRACER and until a time [s]."""
        from .analysis.tracks import Tracks

        return Tracks.read(self, groups, until)

    def measures(self) -> dict[str, float]:
        """Highest temperature, loads after the plunge, heat, flash; the keys have the units."""
        from .analysis.summary import measures

        return measures(self)

    def checks(self) -> list[Check]:
        """Conditions under which the results can be trusted, and whether each is met, as in the report."""
        from .analysis.alarms import checks

        return checks(self)
