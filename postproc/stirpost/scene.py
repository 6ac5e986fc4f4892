# SPDX-License-Identifier: MIT
"""What the input of a run says: its groups, the solids of its bodies and the cavities cut into them."""

from __future__ import annotations

from dataclasses import dataclass

import f90nml
import numpy as np

AXES = "xyz"


class Scene:
    """The groups of an input by name, as dictionaries with small letters."""

    def __init__(self, text: str):
        try:
            found = f90nml.reads(text + "\n") if "&" in text else {}
        except (ValueError, AssertionError, IndexError, StopIteration):
            raise ValueError("the input of the run cannot be read") from None
        self.all: dict[str, list[dict]] = {}
        for name, group in found.items():  # repeated groups come one by one
            for one in group if isinstance(group, list) else [group]:
                self.all.setdefault("".join(name), []).append(one)

    def groups(self, name: str) -> list[dict]:
        return self.all.get(name, [])

    def of(self, group: str, name: str) -> dict:
        """The group of this NAME, empty if there is none."""
        return next((g for g in self.groups(group) if str(g.get("name", "")).lower() == name.lower()), {})

    def solids(self, body: str) -> list["Solid"]:
        return [Solid(shape) for shape in self.groups("shape") if str(shape.get("body", "")).lower() == body.lower()]

    def radius(self, tool: str) -> float | None:
        """Radius of the face of a tool [m]; None if it has none."""
        value = self.of("tool", tool).get("radius")
        return float(value) if value else None


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
        """Which of the points (n, 3) lie in it."""
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
    """What is cut out of a body."""

    solids: list[Solid]
    low: np.ndarray
    high: np.ndarray

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


def cavity_of(scene: Scene, bodies: list[str]) -> Cavity | None:
    """What is cut out of the bodies; None if nothing is."""
    solids = [solid for body in bodies for solid in scene.solids(body)]
    cuts = [s for s in solids if not s.adds]
    if not cuts:
        return None
    low, high = np.min([s.low for s in cuts], axis=0), np.max([s.high for s in cuts], axis=0)
    adds = [s for s in solids if s.adds]
    low = np.maximum(low, np.min([s.low for s in adds], axis=0))
    high = np.minimum(high, np.max([s.high for s in adds], axis=0))
    return Cavity(solids, low, high) if (high > low).all() else None
