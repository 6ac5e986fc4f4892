# SPDX-License-Identifier: MIT
"""Position and phase of the pass of each tool, from the history."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..io.table import Column, Table

if TYPE_CHECKING:
    from ..run import Run

SLOW = 0.02  # of the tool's largest speed: below, it stands
MOST_PHASES = 12
LOADS = ("torque", "force_x", "force_y", "force_z", "power")


@dataclass
class Phase:
    """Rows first..last of a history, whose values are means since the row before."""

    kind: str
    first: int
    last: int


class Tool:
    """One tool of a history; rigid bodies are tools."""

    def __init__(self, history: Table, name: str):
        self.history, self.name = history, name

    def column(self, quantity: str) -> Column | None:
        """A column of the tool that holds a number."""
        return self.history.column(f"{self.name}_{quantity}")

    def loads(self, pattern: str) -> list[Column]:
        return self.history.matching(re.escape(self.name) + "_" + pattern)

    def values(self, quantity: str) -> np.ndarray:
        """Those of a column, NaN without it."""
        column = self.column(quantity)
        return np.full(len(self.history), np.nan) if column is None else column.values

    @property
    def pose(self) -> np.ndarray:
        """Its reference point in each row (n, 3) [m]; NaN where the history does not have it."""
        return np.column_stack([self.values(axis) for axis in "xyz"])

    @property
    def has_pose(self) -> bool:
        return bool(np.isfinite(self.pose).any(axis=0).all())

    def place(self, time: float) -> np.ndarray:
        """Its reference point at a time [m]; the tool needs a pose."""
        there = np.isfinite(self.pose)
        return np.array([np.interp(time, self.history["time"][k], values[k]) for k, values in zip(there.T, self.pose.T)])

    def work(self) -> float:
        """Its work over the history [J]."""
        return float(np.nansum(np.abs(self.values("power")) * lengths(self.history)))

    def presses(self) -> np.ndarray:
        """Rows in which it has a load."""
        touched = np.zeros(len(self.history), dtype=bool)
        for column in self.loads("(torque|force_[xyz])"):
            values = np.abs(np.nan_to_num(column.values))
            touched |= values > 1e-6 * max(values.max(), 1e-300)
        return touched

    def phases(self) -> list[Phase]:
        """Phases of the tool, consecutive rows put together: approach, plunge, dwell, travel, lift, rest, away. Empty without a pose, or if it
        moves back and forth."""
        if not self.has_pose or len(self.history) < 2:
            return []
        span = np.diff(self.history["time"])
        moved = np.diff(self.pose.T) / np.maximum(span, 1e-300)
        along, down = np.hypot(moved[0], moved[1]), moved[2]
        speed = np.hypot(along, down)
        stands = speed <= SLOW * max(speed.max(), 1e-300)
        angle = self.column("angle")
        spins = np.abs(np.diff(angle.values)) > 0 if angle is not None else np.ones(len(span), dtype=bool)
        kinds = np.full(len(span), "travel", dtype=object)
        kinds[down > along] = "lift"
        kinds[-down > along] = "plunge"
        kinds[stands & spins] = "dwell"
        kinds[stands & ~spins] = "rest"
        touched = self.presses()[1:]
        if touched.any():
            kinds[: touched.argmax()] = "approach"
            kinds[len(kinds) - touched[::-1].argmax() :] = "away"
        else:
            kinds[:] = "away"
        starts = np.append(0, np.flatnonzero(kinds[1:] != kinds[:-1]) + 1)
        ends = np.append(starts[1:], len(kinds))
        phases = [Phase(str(kinds[a]), int(a) + 1, int(b)) for a, b in zip(starts, ends)]
        return phases if len(phases) <= MOST_PHASES else []

    def mean(self, column: Column, phase: Phase) -> float:
        """Mean over a phase of a column whose rows are means since the row before."""
        rows = slice(phase.first, phase.last + 1)
        weights, values = lengths(self.history)[rows], column.values[rows]
        there = np.isfinite(values)
        total = weights[there].sum()
        return float((weights * np.where(there, values, 0.0)).sum() / total) if total > 0 else float("nan")

    def rubs(self) -> np.ndarray:
        """Rows in which it rubs."""
        return self.values("friction_power") != 0.0

    def friction_share(self, phase: Phase) -> float:
        """Its friction over all friction and plastic work in a phase [%], NaN where there is none."""
        power = self.column("friction_power")
        parts = [self.history[name] for name in ("friction_heat", "plastic_work") if name in self.history]
        if power is None or len(parts) < 2:
            return float("nan")
        rows = slice(phase.first, phase.last + 1)
        heat = np.nansum(power.values[rows] * lengths(self.history)[rows])
        total = sum(part[phase.last] - part[phase.first - 1] for part in parts)
        return float(100.0 * heat / total) if total > 0 else float("nan")


def lengths(history: Table) -> np.ndarray:
    """Time from the row before to each row [s]; 0 of the first."""
    return np.diff(history["time"], prepend=history["time"][0])


def tools_of(history: Table) -> list[Tool]:
    """The tools of a history, the one with the most work first."""
    names = [c.name[: -len("_torque")] for c in history.columns if c.name.endswith("_torque") and c.unit == "Nm"]
    return sorted((Tool(history, name) for name in names), key=lambda tool: -tool.work())


def rigid(history: Table) -> frozenset[str]:
    """Names of bodies that are tools."""
    return frozenset(tool.name for tool in tools_of(history))


def main_tool(history: Table) -> Tool | None:
    """The tool that does the most work, among those whose position is known."""
    return next((tool for tool in tools_of(history) if tool.has_pose), None)


def face_radius(run: Run, tool: Tool) -> float:
    """Radius of the face of a tool [m]: RADIUS, or, of a surface of any shape, the largest distance from its axis of what comes down to the metal or
    a cell above it, of the whole surface if nothing does; NaN without a surface."""
    given = run.scene.radius(tool.name)
    names = [str(group.get("name", "tool")) for group in run.scene.groups("tool")]
    if given > 0.0 or not run.frames or not tool.has_pose or tool.name not in names:
        return given
    lowest = min(run.frames, key=lambda frame: tool.place(frame.time)[2])
    mesh = run.tool_mesh(lowest)
    points = np.empty((0, 3)) if mesh is None else mesh.points[mesh["tool"] == names.index(tool.name) + 1]
    if not len(points):
        return np.nan
    away = np.linalg.norm((points - tool.place(lowest.time))[:, :2], axis=1)
    low = points[:, 2] < run.frames[0].points()[:, 2].max() + run.cell
    return float(away[low if low.any() else slice(None)].max())


def supports(history: Table) -> list[Column]:
    """Forces of walls and clamps."""
    tools = {f"{tool.name}_force_{axis}" for tool in tools_of(history) for axis in "xyz"}
    return [c for c in history.matching(r".+_force_[xyz]") if c.unit == "N" and c.name not in tools]
