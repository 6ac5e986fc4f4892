# SPDX-License-Identifier: MIT
"""The path of a tool over the plate: its direction, its advancing side, the region that it has passed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..io.frames import NoRun
from ..io.scene import Scene
from .tools import Tool, face_radius, main_tool

if TYPE_CHECKING:
    from ..run import Run

STRAIGHT = 0.1  # of the tool's radius: a path that bends more has no advancing side


@dataclass
class ToolPath:
    """A straight path of a tool: its direction, that of the advancing side (None without spin), places over time."""

    tool: Tool
    radius: float
    time: np.ndarray
    place: np.ndarray  # (n, 2)
    along: np.ndarray
    advancing: np.ndarray | None

    def coordinate(self, x: np.ndarray) -> np.ndarray:
        """Coordinate along the travel: of the axis along which the tool travels, if it is one."""
        axis = int(np.abs(self.along).argmax())
        return x[:, axis] if abs(self.along[axis]) > 1.0 - 1e-9 else x[:, :2] @ self.along

    @property
    def across(self) -> np.ndarray:
        """Direction of the advancing side, to the left without spin."""
        return np.array([-self.along[1], self.along[0]]) if self.advancing is None else self.advancing

    def side(self, x: np.ndarray) -> np.ndarray:
        """Distance from the path, positive on the advancing side."""
        return (x[:, :2] - self.place[0]) @ self.across

    def progress(self, x: np.ndarray) -> np.ndarray:
        """How far along the path from its start."""
        return (x[:, :2] - self.place[0]) @ self.along

    @property
    def length(self) -> float:
        return float(((self.place - self.place[0]) @ self.along).max())

    def passed(self, x: np.ndarray, margin: float = 0.0, beyond: float = 0.0) -> np.ndarray:
        """Where the face has been, up to `margin` radii within its ends, or `beyond` its rim [m]."""
        s, n = self.progress(x), self.side(x)
        past = np.maximum(np.maximum(-s, s - self.length) + margin * self.radius, 0.0)
        if margin > 0:
            return (past == 0.0) & (np.abs(n) < self.radius)
        return past**2 + n**2 < (self.radius + beyond)**2

    def seconds_under(self, x: np.ndarray) -> np.ndarray:
        """Time for which fixed points were under the face [s]; path and time are linear between the rows."""
        total = np.zeros(len(x))
        half = np.sqrt(np.maximum(self.radius**2 - self.side(x) ** 2, 0.0))
        s = self.progress(x)
        at = (self.place - self.place[0]) @ self.along
        for k in range(len(at) - 1):
            a, b, span = at[k], at[k + 1], self.time[k + 1] - self.time[k]
            if abs(b - a) > 1e-12:
                low, high = min(a, b), max(a, b)
                total += span * np.clip(np.minimum(high, s + half) - np.maximum(low, s - half), 0.0, None) / (high - low)
            else:
                total += span * (np.abs(s - a) < half)
        return total


def tool_path_of(run: Run, scene: Scene, until: float) -> ToolPath:
    """The path of the tool with the most work until a time [s], while it touches; NoRun without one that travels."""
    tool = main_tool(run.history)
    if tool is None:
        raise NoRun(f"{run.directory}: no tool whose position the history has")
    radius = face_radius(run, tool)
    if not radius > 0.0:
        raise NoRun(f"{run.directory}: no RADIUS of {tool.name} in the input, and no surface of it")
    time = run.history["time"]
    rows = tool.presses() & (time <= until * (1 + 1e-9))
    place = tool.pose[rows, :2]
    path = place[-1] - place[0] if len(place) else np.zeros(2)
    length = np.linalg.norm(path)
    if length < 1e-3 * radius:
        raise NoRun(f"{run.directory}: {tool.name} does not travel until {until:g} s")
    along = path / length
    off = (place - place[0]) @ np.array([-along[1], along[0]])
    if np.abs(off).max() > STRAIGHT * radius:
        raise ValueError(f"the path of {tool.name} is not straight: it has no advancing side")
    angle = tool.values("angle")[rows]
    turned = float(np.nan_to_num(angle[-1] - angle[0]))
    advancing = None if turned == 0.0 else np.sign(turned) * np.array([-along[1], along[0]])
    return ToolPath(tool, radius, time[rows], place, along, advancing)
