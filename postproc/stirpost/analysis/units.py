# SPDX-License-Identifier: MIT
"""Readable names and units."""

from __future__ import annotations

import re

import numpy as np

MM = 1e3  # metres to millimetres
CELSIUS = 273.15
PREFIX = {"N", "W", "J", "Nm", "Pa"}
SMALL = {"m": (1e3, "mm"), "m2": (1e6, "mm\N{SUPERSCRIPT TWO}"), "m3": (1e9, "mm\N{SUPERSCRIPT THREE}"), "kg": (1e6, "mg")}
UNIT_NAMES = {"Nm": "N m", "": "1"}


def words(name: str) -> str:
    """plastic_work -> plastic work; a repeated word is written once: tool_tool_velocity -> tool velocity"""
    return re.sub(r"\b(\w+)( \1\b)+", r"\1", name.replace("_", " "))


def scaled(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit that bring a value to a handy size: 12000 N -> 12 kN."""
    shown = UNIT_NAMES.get(unit, unit)
    if unit in SMALL and 0.0 < abs(largest) < 0.5:
        return SMALL[unit]
    if unit not in PREFIX or not np.isfinite(largest):
        return 1.0, shown
    for factor, prefix in ((1e-9, "G"), (1e-6, "M"), (1e-3, "k")):
        if abs(largest) * factor >= 2:
            return factor, prefix + shown
    return 1.0, shown


def seconds(time: float) -> str:
    """A time with enough digits to distinguish frames."""
    if abs(time) >= 1 or time == 0:
        return f"{time:.2f} s"
    return f"{time * 1e3:.3g} ms"


def mm(value: float | None, power: int = 1, digits: int = 4) -> str:
    unit = {1: "mm", 2: "mm\N{SUPERSCRIPT TWO}", 3: "mm\N{SUPERSCRIPT THREE}"}[power]
    return "-" if value is None else f"{value * MM**power:.{digits}g} {unit}"
