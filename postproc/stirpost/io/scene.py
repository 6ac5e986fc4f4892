# SPDX-License-Identifier: MIT
"""An input: its groups, which can be changed, checked and run, the solids of its bodies and the cavities cut into them."""

from __future__ import annotations

import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import program
from .files import text_of, write

AXES = "xyz"
ADDRESS = re.compile(r"(?P<group>\w+)(?:\((?P<which>.+)\))?\.(?P<key>\w+)")
FILES = ("file", "library")  # keys that name a file beside the input


@dataclass
class Answer:
    """Output of `stirpoint --check` for a scene: errors, warnings, and the lines of its
    report by their names ("time step", "memory")."""

    errors: list[str]
    warnings: list[str]
    report: dict[str, str]


class Scene:
    """An input. Groups and keys may be written in capitals or small letters; values have the units of docs/input.md."""

    def __init__(self, text: str):
        import f90nml

        try:
            self.all = f90nml.reads(text + "\n") if "&" in text else f90nml.Namelist()
        except Exception:  # also a RecursionError: whatever a text that is no input leads f90nml to
            raise ValueError("it cannot be read") from None

    @classmethod
    def read(cls, path: Path | str) -> Scene:
        """The input in a file. Paths in it are relative to this file, wherever the scene is written."""
        scene = cls(text_of(path))
        for name in scene.all:
            for group in scene.groups("".join(name)):
                for key in (key for key in FILES if key in group):
                    group[key] = str((Path(path).parent / group[key]).resolve())
        return scene

    def groups(self, name: str) -> list[dict[str, Any]]:
        """The groups of a name in their order; a change of one is a change of the scene."""
        found = self.all.get(name.lower(), [])
        return [found] if isinstance(found, dict) else list(found)

    def of(self, group: str, name: str) -> dict[str, Any]:
        """The group of this NAME, empty if there is none."""
        return next((g for g in self.groups(group) if str(g.get("name", "")).lower() == name.lower()), {})

    def addressed(self, address: str) -> tuple[list[dict[str, Any]], str]:
        """The groups and the key addressed as GROUP.KEY (all of them), GROUP(2).KEY or GROUP(name).KEY, as in --set."""
        found = ADDRESS.fullmatch(address)
        if found is None:
            raise ValueError(f"{address}: expected GROUP.KEY, GROUP(2).KEY or GROUP(name).KEY")
        groups, which = self.groups(found["group"]), found["which"]
        if which is not None:
            groups = groups[int(which) - 1 : int(which)] if which.isdigit() else [self.of(found["group"], which)]
        return [group for group in groups if group], found["key"]

    def get(self, address: str, default: Any = None) -> Any:
        """The value of GROUP.KEY, GROUP(2).KEY or GROUP(name).KEY in the first of these groups."""
        groups, key = self.addressed(address)
        return groups[0].get(key.lower(), default) if groups else default

    def set(self, address: str, value: Any) -> None:
        """Change a value, in all groups that are addressed."""
        groups, key = self.addressed(address)
        if not groups:
            raise ValueError(f"{address}: there is no such group")
        for group in groups:
            group[key] = np.asarray(value).tolist()

    def add(self, group: str, **keys: Any) -> None:
        """One more group."""
        self.all.add_cogroup(group.lower(), {key: np.asarray(value).tolist() for key, value in keys.items()})

    def write(self, path: Path | str) -> Path:
        """The input as a file, without comments."""
        return write(Path(path), f"{self.all}\n")

    def check(self, cost: bool = False, named: str | None = None) -> Answer:
        """Check the scene by the program and measure its cost in some steps. `named` is the path of the program, if it is not found by itself."""
        with tempfile.TemporaryDirectory() as folder:
            done = program.run([self.write(Path(folder) / "scene.nml"), "--check" if cost else "--check=scene"], named)
            lines = (done.stdout + done.stderr).replace(f"{folder}/", "").splitlines()
        if done.returncode not in (0, 2):
            raise RuntimeError(done.stderr.strip() or f"stirpoint ended with status {done.returncode}")
        report: dict[str, str] = {}
        for name, text in ((line[:13].strip(), line[13:]) for line in lines if line[12:13] == " " != line[:1]):
            report[name] = f"{report[name]}\n{text}" if name in report else text
        return Answer([x for x in lines if ": error: " in x], [x for x in lines if ": warning: " in x], report)

    def solids(self, body: str) -> list[Solid]:
        """The &SHAPE of a body in their order."""
        return [Solid(shape) for shape in self.groups("shape") if str(shape.get("body", "")).lower() == body.lower()]

    def radius(self, tool: str) -> float:
        """Radius of the face of a tool [m]; NaN if it has none."""
        return float(self.of("tool", tool).get("radius") or np.nan)


class Solid:
    """One &SHAPE: box, cylinder, sphere or trapezoid, added or cut away."""

    def __init__(self, keys: dict):
        self.kind = str(keys.get("kind", "box")).lower()
        self.adds = str(keys.get("operation", "add")).lower() == "add"
        if self.kind in ("box", "trapezoid"):
            self.low, self.high = (np.array(keys[k], dtype=float) for k in ("lower", "upper"))
        else:
            self.centre, self.radius = np.array(keys["centre"], dtype=float), float(keys["radius"])
            self.axis = AXES.index(str(keys.get("axis", "z")).lower())
            half = np.full(3, self.radius)
            if self.kind == "cylinder":
                self.length = float(keys["length"])
                half[self.axis] = 0.5 * self.length
            self.low, self.high = self.centre - half, self.centre + half
        if self.kind == "trapezoid":
            self.along, self.across = (AXES.index(str(keys.get(k, d)).lower()) for k, d in (("along", "x"), ("across", "y")))
            self.widths = float(keys["width_lower"]), float(keys["width_upper"])

    def holds(self, x: np.ndarray) -> np.ndarray:
        """Whether each of the points (n, 3) is inside the shape."""
        if self.kind in ("box", "trapezoid"):
            inside = ((x >= self.low) & (x < self.high)).all(axis=1)
            if self.kind == "trapezoid":
                a, c = self.along, self.across
                part = (x[:, a] - self.low[a]) / (self.high[a] - self.low[a])
                width = self.widths[0] + part * (self.widths[1] - self.widths[0])
                inside &= np.abs(x[:, c] - 0.5 * (self.low[c] + self.high[c])) < 0.5 * width
            return inside
        away = x - self.centre
        square = (away**2).sum(axis=1)
        if self.kind == "sphere":
            return square < self.radius**2
        return (np.abs(away[:, self.axis]) < 0.5 * self.length) & (square - away[:, self.axis] ** 2 < self.radius**2)


def is_metal(solids: list[Solid], x: np.ndarray) -> np.ndarray:
    """Which points lie in the body made of the solids in their order."""
    inside = np.zeros(len(x), dtype=bool)
    for solid in solids:
        inside = np.where(solid.holds(x), solid.adds, inside)
    return inside


@dataclass
class Cavity:
    """Region that is cut out of bodies; false if nothing is."""

    solids: list[Solid]
    low: np.ndarray
    high: np.ndarray

    def __bool__(self) -> bool:
        return bool((self.high > self.low).all())

    def holds(self, x: np.ndarray) -> np.ndarray:
        found = ((x >= self.low) & (x < self.high)).all(axis=1)
        near = x[found]
        found[found] = is_metal([s for s in self.solids if s.adds], near) & ~is_metal(self.solids, near)
        return found

    def volume(self, step: float) -> float:
        """[m3], from samples about `step` apart."""
        counts = np.maximum(1, np.round((self.high - self.low) / step)).astype(int)
        axes = [l + (np.arange(n) + 0.5) * (h - l) / n for l, h, n in zip(self.low, self.high, counts)]
        x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        return float(self.holds(x).mean() * np.prod(self.high - self.low))


def cavity_of(scene: Scene, bodies: list[str]) -> Cavity:
    """Regions that are cut out of the bodies; empty if a surface from a file is among the shapes."""
    if any(str(shape.get("kind", "box")).lower() == "stl" for shape in scene.groups("shape")):
        return Cavity([], np.zeros(3), np.zeros(3))
    solids = [solid for body in bodies for solid in scene.solids(body)]
    (cut_low, cut_high), (low, high) = (box_of([s for s in solids if s.adds == adds]) for adds in (False, True))
    return Cavity(solids, np.maximum(cut_low, low), np.minimum(cut_high, high))


def box_of(solids: list[Solid]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner of all; of none, a box without inside."""
    return np.min([s.low for s in solids], axis=0, initial=np.inf), np.max([s.high for s in solids], axis=0, initial=-np.inf)
