# SPDX-License-Identifier: MIT
"""Inputs of the thermal model from cooling records and properties (thesis chapters 4, 6)."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..io.files import text_of

HEADING = re.compile(r"\s*(?P<name>[^\[(]*?)\s*(?:[\[(]\s*(?P<unit>[^\])]*?)\s*[\])])?\s*")
SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
ABOVE_KELVIN = {"k": 0.0, "kelvin": 0.0, "c": 273.15, "°c": 273.15, "degc": 273.15, "celsius": 273.15}
LOADS = {"n": ("N", 1.0), "kn": ("N", 1e3), "nm": ("Nm", 1.0), "knm": ("Nm", 1e3), "w": ("W", 1.0), "kw": ("W", 1e3)}
COLDEST = 200.0  # [K] below which a reading is taken for degrees Celsius
MOST_COMPLAINTS = 20


@dataclass
class Record:
    """Temperatures over time, a column a thermocouple (and loads, where asked for); NaN where it has no reading."""

    time: np.ndarray
    names: list[str]
    values: np.ndarray
    units: list[str] = field(default_factory=list)  # empty: K of all
    others: list[str] = field(default_factory=list)  # headings of columns that were not read

    @classmethod
    def read(cls, path: Path | str, unit: str | None = None, loads: bool = False, mark: str | None = None,
             columns: dict[str, str] | None = None, units: dict[str, str] | None = None, faults: list[str] | None = None) -> Record:
        """A table as text: time first, then thermocouples, units in brackets: time[s], T1[K], T2[C]; with `loads` also
        forces, torques and powers, tool_force_z[kN], in N, Nm and W. Columns of other units, as the places of a run's
        NAME_probes.csv, and lines with # are left out. Values are parted by `mark`, else by commas,
        semicolons or tabs; but with commas, numbers may have decimal commas. An empty value is no reading.
        `unit` is that of thermocouples without one, `units` those of columns by name. `columns` gives other names: the new name
        and the heading, which may have a - before it for the opposite sign. All that is wrong is one ValueError, with the numbers of
        lines; with `faults` what is wrong with rows goes there, and what is not a number is no reading."""
        lines = [(k, line) for k, line in enumerate(text_of(path).replace("\0", "?").splitlines(), 1)
                 if line.strip() and not line.lstrip().startswith("#")]
        if len(lines) < 2:
            raise ValueError(f"{path}: no rows")
        (first, heading), *lines = lines
        mark = mark or next((c for c in ";\t" if c in heading), ",")
        wrong: list[str] = []
        headings = next(csv.reader([heading], delimiter=mark))
        found, others = read_header(headings, unit, wrong, loads, columns or {}, units or {}, faults is not None)
        wrong = [f"{path}:{first}: {text}" for text in wrong]
        rows = wrong if faults is None else []
        table = np.full((len(lines), len(found)), np.nan)
        last = -np.inf
        for row, (k, line) in enumerate(lines):
            table[row] = read_row(next(csv.reader([line], delimiter=mark)), len(headings), found, mark, f"{path}:{k}", rows)
            if table[row, 0] <= last:
                rows.append(f"{path}:{k}: time does not rise")
                table[row, 0] = np.nan
            last = np.fmax(last, table[row, 0])
        for c, column in enumerate(found[1:], 1):
            cold = np.flatnonzero(table[:, c] < COLDEST)
            if cold.size and column.unit == "K" and column.zero == 0.0 and unit != "K":
                wrong.append(f"{path}:{lines[cold[0]][0]}: {column.name} is {table[cold[0], c]:g} K: if that is degrees Celsius, "
                             f"its heading is {column.name}[C]; if not, give --unit K")
            if not wrong and not np.isfinite(table[:, c]).any():
                wrong.append(f"{path}: {column.name} has no reading")
        if wrong:
            raise ValueError("\n".join(first_of(wrong)))
        if faults is not None:
            faults += first_of(rows)
        table = table[np.isfinite(table[:, 0])]
        return cls(table[:, 0], [column.name for column in found[1:]], table[:, 1:], [column.unit for column in found[1:]], others)

    def after(self, start: float, path: Path | str) -> Record:
        """The rows from `start` on [s]; `path` is the file that a message names."""
        kept = self.time >= start
        if kept.sum() < 3:
            raise ValueError(f"{path}: fewer than 3 rows after {start} s")
        return Record(self.time[kept], self.names, self.values[kept], self.units)

    def curves(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Times and readings of each thermocouple."""
        for t in self.values.T:
            yield self.time[np.isfinite(t)], t[np.isfinite(t)]


class Read(NamedTuple):
    """A column that is read: its number, its name, and offset and factor that convert it to its unit."""

    place: int
    name: str
    zero: float
    factor: float
    unit: str


def first_of(complaints: list[str]) -> list[str]:
    more = len(complaints) - MOST_COMPLAINTS
    return complaints[:MOST_COMPLAINTS] + [f"and {more} more"] * (more > 0)


def read_header(headings: list[str], unit: str | None, wrong: list[str], loads: bool, columns: dict[str, str],
                units: dict[str, str], any_other: bool) -> tuple[list[Read], list[str]]:
    """Time, each thermocouple and each load; and the headings of the other columns."""
    headings = [text.strip() for text in headings]
    matches = [HEADING.fullmatch(text) for text in headings]
    names = [text if match is None else match["name"] for text, match in zip(headings, matches)]
    own = ["?" if match is None else units.get(match["name"], match["unit"]) for match in matches]
    signs = np.ones(len(names))
    for name, heading in columns.items():
        plain = heading if heading in headings + names else heading.removeprefix("-")
        place = next((k for k, text in enumerate(headings) if plain in (text, names[k])), None)
        if place is None:
            wrong.append(f"no column '{plain}'; there are: {', '.join(headings)}")
        else:
            names[place], signs[place] = name, 1.0 if plain == heading else -1.0
            own[place] = units.get(name, own[place])
    first = names.index("time") if "time" in columns and "time" in names else 0
    own = [re.sub(r"[\s·*.]", "", text or "").lower() for text in own]
    factor = SECONDS.get(own[first])
    if not names[first].lower().startswith("t") or factor is None:
        wrong.append(f"the {'column of time' if 'time' in columns else 'first column'} is '{headings[first]}': expected time[s] (or ms, min, h)")
    found, others = [Read(first, "time", 0.0, factor or 1.0, "s")], []
    for k, name in enumerate(names):
        known = own[k] or (unit or "").lower()
        if k == first:
            continue
        if known in ABOVE_KELVIN:
            found.append(Read(k, name, ABOVE_KELVIN[known], 1.0, "K"))
        elif loads and known in LOADS:
            found.append(Read(k, name, 0.0, signs[k] * LOADS[known][1], LOADS[known][0]))
        elif not any_other and (not known or known.strip("°deg") in ("f", "fahrenheit")):
            wrong.append(f"column '{headings[k]}': expected {name or 'NAME'}[K] or {name or 'NAME'}[C], or --unit")
        else:
            others.append(headings[k])
    named = [column.name for column in found]
    wrong += [f"two columns are called {name}" for name in sorted(set(named)) if named.count(name) > 1]
    if len(found) == 1 and not wrong:
        wrong.append("no column of temperatures, as T1[K] or T1[C]" + (", or of loads, as torque[N m]" if loads else ""))
    return found, others


def read_row(items: list[str], count: int, columns: list[Read], mark: str, place: str, wrong: list[str]) -> list[float]:
    """Time and values of a line, in the units of their columns."""
    if len(items) != count:
        hint = " (numbers with decimal commas need ; or tabs between them)" if mark == "," and len(items) > count else ""
        wrong.append(f"{place}: {len(items)} values in a table of {count} columns{hint}")
        return [np.nan] * len(columns)
    row = []
    for number, (k, name, zero, factor, _) in enumerate(columns):
        text = items[k].strip()
        if mark != "," and "." not in text:
            text = text.replace(",", ".")
        try:
            value = float(text) if text or number == 0 else np.nan
        except ValueError:
            wrong.append(f"{place}: '{text}' is no number for {name}")
            value = np.nan
        else:
            if text and not np.isfinite(value):
                wrong.append(f"{place}: {text} for {name}")
                value = np.nan
        row.append((value + zero) * factor)
    return row


def rate_by_differences(record: Record, room: float) -> np.ndarray:
    """Cooling rate [1/s] of each thermocouple: slope through the origin of -dT/dt over T - T_room, from
    differences between rows and their means (eqs. 4.18, 4.19), by least squares; NaN if it cannot be computed."""
    slopes = []
    for time, t in record.curves():
        rate = np.diff(t) / np.diff(time)
        over = 0.5 * (t[1:] + t[:-1]) - room
        slopes.append(-(over @ rate) / (over @ over) if np.any(over) else np.nan)
    return np.array(slopes)


def rate_by_exponential(record: Record, room: float | None = None) -> np.ndarray:
    """Cooling rate [1/s] of each thermocouple from T = T_end + A exp(-a t) fitted to the record (eq. 6.16);
    T_end is `room`, or free. NaN where the fit fails, or the record does not say where the exponential ends."""
    import warnings

    from scipy.optimize import OptimizeWarning, curve_fit

    rates = []
    for time, t in record.curves():
        start, span = time[0], max(np.ptp(time), 1e-9)
        low = t.min() - 0.5 * np.ptp(t) if room is None else room
        guess = [t[0] - low, 1.0 / span] + ([low] if room is None else [])

        def curve(s: np.ndarray, a: float, r: float, e: float | None = room) -> np.ndarray:
            return e + a * np.exp(-r * (s - start))

        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", OptimizeWarning)
                with np.errstate(over="ignore", invalid="ignore"):
                    found, cov = curve_fit(curve, time, t, guess)
            # an exponent below a thousandth over the record is a straight line: any end fits
            determined = np.isfinite(cov).all() and found[1] * span > 1e-3
        except (RuntimeError, TypeError, ValueError, OptimizeWarning):
            determined = False
        rates.append(found[1] if determined else np.nan)
    return np.array(rates)


def film_coefficient(rate: float, density: float, specific_heat: float, volume: float, area: float) -> float:
    """h = rho c V/S times the cooling rate [W/(m2 K)] (eq. 4.10)."""
    return rate * density * specific_heat * volume / area


def heat_share(plate: tuple[float, float, float], tool: tuple[float, float, float]) -> float:
    """Fraction of the heat that enters the plate, from (k, rho, c) of plate and tool (eqs. 2.11, 4.14)."""
    one, other = (float(np.sqrt(np.prod(material))) for material in (plate, tool))
    return one / (one + other)


def residuals(model: Record, measured: Record) -> dict[str, np.ndarray]:
    """Model minus measurement at the measured times, for the thermocouples of both [K]; NaN without a reading."""
    common = [name for name in measured.names if name in model.names]
    if not common:
        raise ValueError(f"no thermocouple in common: {measured.names} and {model.names}")
    inside = (measured.time >= model.time[0]) & (measured.time <= model.time[-1])
    if not inside.any():
        raise ValueError(f"no time in common: {measured.time[0]:g} to {measured.time[-1]:g} s and "
                         f"{model.time[0]:g} to {model.time[-1]:g} s")
    result = {"time": measured.time[inside]}
    for name in common:
        there = np.interp(result["time"], model.time, model.values[:, model.names.index(name)])
        result[name] = there - measured.values[inside, measured.names.index(name)]
    return result


@dataclass
class Fit:
    """Fitted values, their standard errors, and the residual [K]."""

    values: np.ndarray
    errors: np.ndarray  # NaN: not determined, or held by a bound
    residuals: list[np.ndarray]  # of each thermocouple
    trials: int


def fit(residuals: Callable[[np.ndarray], list[np.ndarray]], start: np.ndarray, low: np.ndarray, high: np.ndarray) -> Fit:
    """Numbers between `low` and `high` that make the curves `residuals` smallest, by least squares."""
    from scipy.optimize import least_squares

    scale = np.array(high, dtype=float) - np.array(low, dtype=float)
    found = least_squares(lambda x: np.concatenate(residuals(x)), start, bounds=(low, high), x_scale=scale, diff_step=1e-2,
                          xtol=1e-5, ftol=1e-7)
    left = residuals(found.x)
    free = (found.x - low > 1e-6 * scale) & (high - found.x > 1e-6 * scale)
    return Fit(found.x, standard_errors(found.jac, left, free), left, found.nfev)


def standard_errors(slopes: np.ndarray, left: list[np.ndarray], free: np.ndarray) -> np.ndarray:
    """Standard errors of the values that are not at a bound (`free`), from the derivatives of the residuals `left`; NaN: at a bound, or not determined."""
    errors, everything = np.full(len(free), np.nan), np.concatenate(left)
    slopes = slopes[:, free]
    points = len(everything) / max(memory(each) for each in left)
    sizes = np.linalg.norm(slopes, axis=0)
    if free.any() and points > free.sum() and (sizes > 0).all() and np.linalg.matrix_rank(slopes / sizes) == free.sum():
        variance = np.mean(everything**2) * points / (points - free.sum())
        repeats = len(everything) / points
        errors[free] = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)) * variance * repeats)
    return errors


def varied(texts: list[str]) -> tuple[list[str], np.ndarray, np.ndarray, np.ndarray]:
    """Names, starts and bounds of GROUP.KEY=START,LOW,HIGH."""
    names, limits = [], []
    for text in texts:
        name, _, values = text.partition("=")
        try:
            numbers = [float(value) for value in values.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) != 3 or not numbers[1] < numbers[0] < numbers[2]:
            raise ValueError(f"--vary {text}: expected GROUP.KEY=START,LOW,HIGH with LOW < START < HIGH")
        names.append(name)
        limits.append(numbers)
    return names, *np.array(limits).T


def memory(residuals: np.ndarray) -> float:
    """Number of consecutive rows that are correlated, at least 1: the sum of the autocorrelation up to where it is lost in noise. What a model misses
    is smooth in time, so that ten rows a second are not ten times the information of one."""
    rest = residuals - residuals.mean()
    power = rest @ rest
    if not power > 0.0:
        return 1.0
    spectrum = np.abs(np.fft.rfft(rest, 2 * len(rest)))**2
    correlation = np.fft.irfft(spectrum)[:len(rest)] / power
    noise = 2.0 / np.sqrt(len(rest))
    lost = np.flatnonzero(correlation < noise)
    return 1.0 + 2.0 * correlation[1:lost[0] if lost.size else None].sum()


def means(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Means of a polygon over the spans around `at` that end half way to the neighbours."""
    good = np.isfinite(values)
    time, values = time[good], values[good]
    middle = 0.5 * (at[1:] + at[:-1])
    low, high = np.append(at[0], middle), np.append(middle, at[-1])
    area = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])

    def upto(t: np.ndarray) -> np.ndarray:
        k = np.clip(np.searchsorted(time, t) - 1, 0, len(time) - 2)
        end = np.interp(t, time, values)
        return area[k] + 0.5 * (values[k] + end) * (t - time[k])

    return (upto(high) - upto(low)) / (high - low)
