# SPDX-License-Identifier: MIT
"""What cooling records and properties say of the inputs of the thermal model (thesis chapters 4, 6)."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class Record:
    """Temperatures over time, a column a thermocouple."""

    time: np.ndarray
    names: list[str]
    values: np.ndarray

    @classmethod
    def read(cls, path: Path | str) -> "Record":
        """A CSV: time first, then thermocouples in K; units in brackets, lines with # are left out.
        A table of a run, NAME_probes.csv, is one (its places, in m, are left out)."""
        with open(path, encoding="utf-8") as file:
            rows = list(csv.reader(line for line in file if not line.startswith("#") and line.strip()))
        if len(rows) < 2:
            raise ValueError(f"{path}: no rows")
        keep = [k for k, name in enumerate(rows[0]) if k == 0 or not name.endswith("[m]")]
        table = np.array([[float(row[k]) for k in keep] for row in rows[1:]])
        names = [rows[0][k].split("[")[0].strip() for k in keep[1:]]
        return cls(table[:, 0], names, table[:, 1:])

    def after(self, start: float) -> "Record":
        """The rows from `start` on [s]."""
        kept = self.time >= start
        if kept.sum() < 3:
            raise ValueError(f"fewer than 3 rows after {start} s")
        return Record(self.time[kept], self.names, self.values[kept])


def rate_by_differences(record: Record, room: float) -> np.ndarray:
    """Cooling rate [1/s] of each thermocouple: slope through the origin of -dT/dt over T - T_room, from
    differences between rows and their means (eqs. 4.18, 4.19), by least squares."""
    slopes = []
    for t in record.values.T:
        rate = np.diff(t) / np.diff(record.time)
        over = 0.5 * (t[1:] + t[:-1]) - room
        slopes.append(-(over @ rate) / (over @ over))
    return np.array(slopes)


def rate_by_exponential(record: Record, room: float | None = None) -> np.ndarray:
    """Cooling rate [1/s] of each thermocouple from T = T_end + A exp(-a t) fitted to the record (eq. 6.16);
    T_end is `room`, or free."""
    from scipy.optimize import curve_fit

    rates = []
    start = record.time[0]
    for t in record.values.T:
        low = t.min() - 0.5 * np.ptp(t) if room is None else room
        guess = [t[0] - low, 1.0 / max(np.ptp(record.time), 1e-9)]
        if room is None:
            found = curve_fit(lambda s, a, r, e: e + a * np.exp(-r * (s - start)), record.time, t, [*guess, low])
        else:
            found = curve_fit(lambda s, a, r: room + a * np.exp(-r * (s - start)), record.time, t, guess)
        rates.append(found[0][1])
    return np.array(rates)


def film_coefficient(rate: float, density: float, specific_heat: float, volume: float, area: float) -> float:
    """h = rho c V/S times the cooling rate [W/(m2 K)] (eq. 4.10)."""
    return rate * density * specific_heat * volume / area


def heat_share(plate: tuple[float, float, float], tool: tuple[float, float, float]) -> float:
    """Part of the heat that enters the plate, from (k, rho, c) of both (eqs. 2.11, 4.14)."""
    one, other = (float(np.sqrt(np.prod(material))) for material in (plate, tool))
    return one / (one + other)


def residuals(model: Record, measured: Record) -> dict[str, np.ndarray]:
    """Model minus measurement at the measured times, for the thermocouples of both [K]."""
    common = [name for name in measured.names if name in model.names]
    if not common:
        raise ValueError(f"no thermocouple in common: {measured.names} and {model.names}")
    inside = (measured.time >= model.time[0]) & (measured.time <= model.time[-1])
    result = {"time": measured.time[inside]}
    for name in common:
        there = np.interp(result["time"], model.time, model.values[:, model.names.index(name)])
        result[name] = there - measured.values[inside, measured.names.index(name)]
    return result
