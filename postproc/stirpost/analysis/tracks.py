# SPDX-License-Identifier: MIT
"""Pathlines of the tracers of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..io.frames import NoRun
from ..io.table import read_frame

if TYPE_CHECKING:
    import pandas as pd
    import pyvista as pv

    from ..run import Run

COLUMNS = ("time", "group", "tracer", "id", "x", "y", "z", "temperature", "plastic_strain")


@dataclass
class Tracks:
    """Tracers one after the other, each in the order of time."""

    frame: pd.DataFrame  # columns as the headings of NAME_tracers.csv without units
    begins: np.ndarray  # first row of each tracer
    ends: np.ndarray  # row after its last one
    groups: list[str]

    @classmethod
    def read(cls, run: Run, wanted: list[str] | None = None, until: float | None = None) -> Tracks:
        path = run.directory / f"{run.name}_tracers.csv"
        if not path.exists():
            raise NoRun(f"{run.directory}: no {path.name}: the input has no &TRACER")
        faults: list[str] = []
        frame = read_frame(path, faults, COLUMNS, words=("group", "body"))[0].dropna()
        for text in faults:
            run.warn(text)
        there = list(dict.fromkeys(frame["group"]))
        missing = [name for name in wanted or [] if name not in there]
        if missing:
            raise NoRun(f"{path}: no group {', '.join(missing)}; there are: {', '.join(there)}")
        frame = frame[frame["group"].isin(wanted or there)]
        if until is not None:
            frame = frame[frame["time"] <= until * (1 + 1e-9)]
        if frame.empty:
            raise NoRun(f"{path}: no rows")
        frame = frame.sort_values(["tracer", "time"], kind="stable").drop_duplicates(["tracer", "time"], keep="last").reset_index(drop=True)
        begins = np.flatnonzero(np.diff(frame["tracer"], prepend=-1) != 0)
        return cls(frame, begins, np.append(begins[1:], len(frame)), [name for name in there if name in set(frame["group"])])

    @property
    def positions(self) -> np.ndarray:
        """(n, 3) [m]"""
        return self.frame[["x", "y", "z"]].to_numpy()

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Repeat one value per tracer for all its rows."""
        return np.repeat(values, self.ends - self.begins)


def polydata(tracks: Tracks) -> pv.PolyData:
    """One line per tracer."""
    import pyvista as pv

    counts = tracks.ends - tracks.begins
    lines = np.concatenate([np.append(n, np.arange(a, a + n)) for a, n in zip(tracks.begins, counts)])
    mesh = pv.PolyData(tracks.positions, lines=lines)
    for name in ("time", "temperature", "plastic_strain"):
        mesh.point_data[name] = tracks.frame[name].to_numpy()
    first = tracks.frame.iloc[tracks.begins]
    mesh.cell_data["group"] = [tracks.groups.index(name) for name in first["group"]]
    mesh.cell_data["tracer"], mesh.cell_data["id"] = first["tracer"].to_numpy(), first["id"].to_numpy()
    for axis in "xyz":
        mesh.cell_data[f"origin_{axis}"] = first[axis].to_numpy()
    mesh.field_data["group_names"] = tracks.groups
    return mesh
