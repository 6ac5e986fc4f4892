# SPDX-License-Identifier: MIT
"""Measured numbers, besides curves, with which a run is compared: loads, stir zone, groove, filling, flash, peaks."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..analysis import summary
from ..analysis.cooling import ABOVE_KELVIN, LOADS
from ..io.frames import NoRun
from ..run import Run
from .trials import table_of

# Name: unit, meaning, and where summary.measures or flow.measures has it.
MEASURES = {
    "axial_force": ("N", "force along z on the tool, mean over the travel", "axial force, mean [N]"),
    "axial_force_peak": ("N", "its largest magnitude in the run", "axial force, peak [N]"),
    "torque": ("Nm", "torque of the tool, mean over the travel", "torque, mean [N m]"),
    "torque_peak": ("Nm", "its largest magnitude in the run", "torque, peak [N m]"),
    "power": ("W", "power of the tool, mean over the travel", "power, mean [W]"),
    "temperature_max": ("K", "highest temperature in the run", "highest temperature [K]"),
    "groove": ("m3", "volume missing below the first top face", ("volumes", "groove[m3]")),
    "groove_depth": ("m", "mean depth of the groove", ("volumes", "groove_mean_depth[m]")),
    "fill": ("1", "part of the cavity's volume that is filled", ("cavity", "filled")),
    "covered": ("1", "part of the cavity's area that metal covers, from above", ("cavity", "covered")),
    "void_area": ("m2", "metal missing in the largest section of a void behind the tool", ("voids", "area_max[m2]")),
    "void_volume": ("m3", "metal missing in voids behind the tool", ("voids", "volume[m3]")),
    "loose_area": ("m2", "the part of a section of a void that is missing in loose metal, outside of holes: the largest", ("voids", "loose_max[m2]")),
    "flash_volume_advancing": ("m3", "flash above the first top face, advancing side", ("volumes", "above_advancing[m3]")),
    "flash_volume_retreating": ("m3", "flash above the first top face, retreating side", ("volumes", "above_retreating[m3]")),
    "flash_advancing": ("m", "height of the flash on the advancing side", ("flash", "height_advancing[m]")),
    "flash_retreating": ("m", "height of the flash on the retreating side", ("flash", "height_retreating[m]")),
}
AT = {  # of a cross-section: stir_depth@25e-3
    "stir_depth": ("m", "depth of the stir zone (strain above 1) at a place along the travel [m]", "depth[m]"),
    "stir_width": ("m", "width of the stir zone there", "width[m]"),
}
OTHERS = (("NAME_peak", "K", "highest temperature of the probe NAME"),
          ("COLUMN@FROM:UNTIL", "of COLUMN", "mean of a column of the history or the probes over a time [s]"))
UNITS = {"m": ("m", 1.0), "mm": ("m", 1e-3), "um": ("m", 1e-6), "m2": ("m2", 1.0), "mm2": ("m2", 1e-6), "m3": ("m3", 1.0), "mm3": ("m3", 1e-9), "1": ("1", 1.0),
         "%": ("1", 0.01)} | LOADS
FORM = re.compile(r"(?P<name>\w+)(?:@(?P<at>[^@\[=]+))?\s*(?:\[(?P<unit>[^\]]*)\])?=(?P<value>[^,]+),(?P<error>[^,]+)")


@dataclass
class Target:
    """A measured number with its standard uncertainty, and the corresponding quantity of a run."""

    name: str
    at: tuple[float, ...]  # the place of a section, or the span of a mean; else empty
    unit: str
    value: float
    scale: float
    known: bool = True

    @property
    def time(self) -> tuple[float]:
        return (np.nan,)

    @property
    def label(self) -> str:
        return self.name + ("@" + ":".join(f"{at:g}" for at in self.at) if self.at else "")

    def of(self, run: Run) -> float:
        """The value of this quantity in a run."""
        try:
            if len(self.at) == 2:
                return mean_of(run, self.name, *self.at)
            if self.name in AT:
                return float(shape_of(run, self.at)["stir_zone"][0][AT[self.name][2]])
            where = MEASURES[self.name][2] if self.name in MEASURES else f"{self.name.removesuffix('_peak')}, peak [K]"
            found = summary.measures(run)[where] if isinstance(where, str) else shape_of(run, ())[where[0]][where[1]]
        except (KeyError, NoRun) as problem:
            raise ValueError(f"{run.directory}: the run has no {self.label} ({problem})") from None
        if found is None:
            raise ValueError(f"{run.directory}: the run has no {self.label}")
        return float(found)

    def residuals(self, run: Run) -> np.ndarray:
        return np.array([self.of(run) - self.value])


@lru_cache(maxsize=8)
def shape_of(run: Run, sections: tuple[float, ...]) -> dict:
    return run.flow().measures(list(sections) or None)


def mean_of(run: Run, name: str, start: float, end: float) -> float:
    """Mean of a column over a time, of the polygon through its rows."""
    table = table_of(run, name)
    good = np.isfinite(table[name])
    time, values = table["time"][good], table[name][good]
    if not time[0] <= start < end <= time[-1] * (1 + 1e-9):
        raise NoRun(f"it has rows from {time[0]:g} to {time[-1]:g} s")
    at = np.unique(np.concatenate([[start, end], time[(time > start) & (time < end)]]))
    there = np.interp(at, time, values)
    return float((0.5 * (there[1:] + there[:-1]) * np.diff(at)).sum() / (end - start))


def read(text: str, known: Run) -> Target:
    """A target NAME[@AT][UNIT]=VALUE,UNCERTAINTY; what is wrong with it is a ValueError."""
    wrong = f"--target {text}: "
    found = FORM.fullmatch(text.strip())
    try:
        if found is None:
            raise ValueError
        value, error = float(found["value"]), float(found["error"])
        at = tuple(float(x) for x in (found["at"] or "").split(":") if x)
    except ValueError:
        raise ValueError(f"{wrong}expected NAME[@AT][UNIT]=VALUE,UNCERTAINTY") from None
    name = found["name"]
    columns = {c.name: c.unit for t in (known.history, known.probes) for c in t.columns}
    unit = columns.get(name) if len(at) == 2 else "K" if not at and columns.get(name.removesuffix("_peak")) == "K" else \
        {name: row[0] for name, row in (AT if len(at) == 1 else MEASURES if not at else {}).items()}.get(name)
    if unit is None:
        raise ValueError(f"{wrong}no such measure; --targets prints those there are")
    given = re.sub(r"[\s·*.]", "", found["unit"] or unit)
    if unit == "K" and given.lower() in ABOVE_KELVIN:
        value += ABOVE_KELVIN[given.lower()]
    elif given != unit:
        own, factor = UNITS.get(given, UNITS.get(given.lower(), (None, 1.0)))
        if own != unit:
            raise ValueError(f"{wrong}[{given}] is no unit of {name}, which is in {unit}")
        value, error = value * factor, error * factor
    if not (np.isfinite(value) and 0.0 < error < np.inf):
        raise ValueError(f"{wrong}the uncertainty has to be above 0")
    return Target(name, at, unit, value, error)


def table() -> str:
    """The measures as text."""
    rows = [(name, unit, words) for name, (unit, words, _) in MEASURES.items()]
    rows += [(f"{name}@X", unit, words) for name, (unit, words, _) in AT.items()] + list(OTHERS)
    return "\n".join(f"{name:24} {unit:10} {words}" for name, unit, words in rows)
