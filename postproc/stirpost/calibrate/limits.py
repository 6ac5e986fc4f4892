# SPDX-License-Identifier: MIT
"""Range and scale (linear or logarithmic) in which a key is searched: physical limits, unless the command gives others."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..io.scene import ADDRESS, Scene

SCALES = ("linear", "log")
FILM = "from calm air to metal pressed on metal"
GAP = "from a loose gap to a contact without resistance"
# Key: least and largest value, scale of the search, reason. Films and conductances may differ by powers of ten.
LIMITS = {
    "TOOL.FRICTION": (0.0, 1.0, "linear", "above 0.58 friction reaches the shear strength where the pressure is the flow stress"),
    "TOOL.SHEAR_FACTOR": (0.0, 1.0, "linear", "the metal transmits no more than its shear strength"),
    "TOOL.STICK_FRACTION": (0.0, 1.0, "linear", "a share of the face"),
    "TOOL.HEAT_SHARE": (0.0, 1.0, "linear", "a share of the heat of friction"),
    "TOOL.CONTACT_CONDUCTANCE": (1e2, 1e6, "log", GAP),
    "TOOL.COOLING": (1e-2, 1e2, "log", "from a holder in air to a cooled one"),
    "TOOL.STIFFNESS": (1e6, 1e9, "log", "from an arm of a robot to a rigid machine"),
    "CONTACT.FRICTION": (0.0, 1.0, "linear", "as that of a tool"),
    "CONTACT.CONDUCTANCE": (1e2, 1e6, "log", GAP),
    "SURFACE.COEFFICIENT": (1.0, 1e6, "log", FILM),
    "SURFACE.PRESSURE_FACTOR": (1.0, 1e5, "log", "from smooth and hard to rough and soft faces, at 1 MPa"),
    "SURFACE.PRESSURE_EXPONENT": (0.5, 1.0, "linear", "0.95 for rough faces that conform, less where they do not"),
    "SURFACE.BACKING_COOLING": (1.0, 1e6, "log", FILM),
    "SURFACE.EMISSIVITY": (0.0, 1.0, "linear", "a share of the radiation of a black body"),
    "SOURCE.FRICTION": (0.0, 1.0, "linear", "as that of a tool"),
    "SOURCE.SLIP": (0.0, 1.0, "linear", "a share of the face"),
    "SOURCE.SHARE": (0.0, 1.0, "linear", "a share of the heat of friction"),
    "MATERIAL.PLASTIC_HEAT": (0.0, 1.0, "linear", "a share of the plastic work"),
}
FORM = "expected GROUP.KEY[=START[,LOW,HIGH[,log]]] with LOW < START < HIGH"


@dataclass
class Key:
    """A key that is varied. Its place in the search is 0 at `low` and 1 at `high`."""

    name: str
    start: float
    low: float
    high: float
    scale: str
    reason: str = ""

    def value(self, place: float) -> float:
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** place)
        return float(self.low + place * (self.high - self.low))

    def scaled(self, value: float) -> float:
        if self.scale == "log":
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)

    def error(self, place: float, error: float) -> float:
        """Standard error of the value, to first order, from that of the place."""
        return error * (self.value(place) * np.log(self.high / self.low) if self.scale == "log" else self.high - self.low)

    def __str__(self) -> str:
        how = "" if self.scale == "linear" else ", in powers"
        return f"{self.name} from {self.start:.6g}, between {self.low:.6g} and {self.high:.6g}{how}" + \
            (f": {self.reason}" if self.reason else "")


def varied(texts: list[str], scene: Scene, resolved: Callable[[], Scene] | None = None) -> list[Key]:
    """The keys of --vary. A start that is not given is the value of the input, that which the group takes from a library (the
    `resolved` scene has it), or else the middle."""
    keys = []
    for text in texts:
        name, mark, words = text.partition("=")
        parts = words.split(",") if mark else []
        scale = parts.pop() if parts and parts[-1] in SCALES else None
        try:
            numbers = [float(part) for part in parts]
        except ValueError:
            numbers = [np.nan]
        found = ADDRESS.fullmatch(name)
        group, key_name = (found["group"].upper(), found["key"].upper()) if found else ("", "")
        row = LIMITS.get(f"{group}.{key_name}")
        groups = scene.groups(group) if found and not found["which"] else []
        if len(groups) > 1:
            which = ", ".join(f"{group}({k}).{key_name}" + (f" of {each['name']}" if each.get("name") else "") for k, each in enumerate(groups, 1))
            raise ValueError(f"--vary {text}: the input has {len(groups)} &{group}, which would all change: name one: {which}")
        if len(numbers) not in (0, 1, 3) or not np.isfinite(numbers).all():
            raise ValueError(f"--vary {text}: {FORM}")
        if numbers[1:]:
            low, high = numbers[1:]
        elif row:
            low, high = row[:2]
        else:
            raise ValueError(f"--vary {text}: physics sets no limits of {name} (--limits): give START,LOW,HIGH")
        key = Key(name, np.nan, low, high, scale or (row[2] if row and low > 0.0 else "linear"))
        if key.scale == "log" and not 0.0 < low < high:
            raise ValueError(f"--vary {text}: a search in powers needs 0 < LOW < HIGH")
        if row:
            key.reason = row[3] if numbers[1:] in ([], list(row[:2])) else "" if row[0] <= low and high <= row[1] else \
                f"wider than {row[0]:g} to {row[1]:g}, {row[3]}"
        given = numbers[0] if numbers else scene.get(name)
        if given is None and found and resolved and scene.get(f"{name.rpartition('.')[0]}.FROM"):
            given = resolved().get(name)
        inside = isinstance(given, (int, float)) and low < given < high
        if numbers and not inside:
            raise ValueError(f"--vary {text}: {FORM}" + ("" if numbers[1:] else f"; LOW and HIGH are {low:g} and {high:g}"))
        key.start = float(given) if inside else key.value(0.5)
        keys.append(key)
    names = [re.sub(r"\s", "", key.name).upper() for key in keys]
    if len(set(names)) < len(names):
        raise ValueError("--vary has a key twice")
    return keys


def table() -> str:
    """The limits as text."""
    rows = [(name, f"{low:g}", f"{high:g}", scale, reason) for name, (low, high, scale, reason) in LIMITS.items()]
    widths = [max(len(row[k]) for row in rows) for k in range(4)]
    return "\n".join("  ".join([*(text.ljust(width) for text, width in zip(row, widths)), row[4]]) for row in rows)
