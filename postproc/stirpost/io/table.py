# SPDX-License-Identifier: MIT
"""CSV histories: columns are found by name, the unit is in brackets after the name. pandas is imported where a frame is asked for."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sized
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .files import message_of, text_of

if TYPE_CHECKING:
    import pandas as pd

HEADING = re.compile(r"^\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*$")
BARE_EXPONENT = r"^\s*([+-]?[\d.]+)([+-]\d{3})\s*$"  # Fortran writes 1.0-101 for 1.0E-101


@dataclass
class Column:
    name: str
    unit: str
    values: np.ndarray


class Units(dict):
    """Units by the name of the column. pandas copies attributes deeply whenever it hands out a column: these are shared."""

    def __deepcopy__(self, memo: object) -> Units:
        return self


class Table:
    """Columns of numbers in the order of the file, and their `units`. `table[name]` is a column as an array, `frame` the table in
    pandas, with the units in `frame.attrs["units"]`: what is changed there is changed in the table."""

    def __init__(self, columns: list[Column]):
        self.values = {c.name: np.asarray(c.values) for c in columns}
        self.units = Units({c.name: c.unit for c in columns})

    @cached_property
    def frame(self) -> pd.DataFrame:
        import pandas as pd

        frame = pd.DataFrame(self.values)
        frame.attrs["units"] = self.units
        return frame

    def __len__(self) -> int:
        return len(next(iter(self.values.values()), ()))

    def __contains__(self, name: str) -> bool:
        return name in self.units

    def __getitem__(self, name: str) -> np.ndarray:
        return self.frame[name].to_numpy() if "frame" in self.__dict__ else self.values[name]

    @property
    def columns(self) -> list[Column]:
        return [Column(name, unit, self[name]) for name, unit in self.units.items()]

    def unit(self, name: str) -> str:
        """Unit of a column, '' without one."""
        return self.units[name]

    def with_unit(self, unit: str) -> list[Column]:
        """Columns of one unit that hold at least one number."""
        return self.filled(name for name, own in self.units.items() if own == unit)

    def column(self, name: str) -> Column | None:
        """The column of a name, if it holds a number."""
        return next(iter(self.filled([name] if name in self else [])), None)

    def matching(self, pattern: str) -> list[Column]:
        """Columns whose whole name matches a regular expression and that hold a number."""
        wanted = re.compile(pattern)
        return self.filled(name for name in self.units if wanted.fullmatch(name))

    def filled(self, names: Iterable[str]) -> list[Column]:
        """Those columns that hold a number."""
        found = (Column(name, self.units[name], self[name]) for name in names)
        return [c for c in found if np.isfinite(c.values).any()]


def read_table(path: Path, faults: list[str], needed: Collection[str] = ("time",)) -> Table:
    """The table of a file, with all that is `needed`; empty if there is no file, no row in it or no such column."""
    if not path.exists():
        return Table([])
    try:
        columns, units = read_columns(path, faults, needed)
    except (OSError, ValueError) as problem:
        faults.append(message_of(problem))
        return Table([])
    keep = latest(columns["time"])
    return Table([Column(name, unit, columns[name][keep]) for name, unit in units.items()] if keep.any() else [])


def read_frame(path: Path, faults: list[str], needed: Collection[str], words: Collection[str] = ()) -> tuple[pd.DataFrame, dict[str, str]]:
    """The same as `read_columns` as a frame of pandas."""
    import pandas as pd

    columns, units = read_columns(path, faults, needed, words)
    return pd.DataFrame(columns), units


def read_columns(path: Path, faults: list[str], needed: Collection[str], words: Collection[str] = ()) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Columns of numbers, and of `words`, and their units. ValueError without a row or a column that is `needed`. Rows
    of another number of values are left out, values that are no numbers are NaN: each kind is a line in `faults`. An incomplete last row is left out
    without a warning: it is still being written."""
    lines = [(k, x) for k, x in enumerate(text_of(path).splitlines(), 1) if x.strip() and not x.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{path}: empty")
    headings = [parse_heading(name) for name in lines[0][1].split(",")]
    words = [name for name, _ in headings if name in words]
    names = [name for name, _ in headings]
    wrong = [name for name in needed if name not in names] or [name for name in set(names) if names.count(name) > 1]
    if wrong:
        raise ValueError(f"{path}:{lines[0][0]}: the heading needs one column {wrong[0]}, and has {names.count(wrong[0])}")
    rows = [(k, cells) for k, x in lines[1:] if len(cells := x.split(",")) == len(names)]
    broken = sorted({k for k, _ in lines[1:-1]} - {k for k, _ in rows})
    if broken:
        faults.append(f"{path}:{broken[0]}: not the {len(names)} values that the heading has" + more(broken, "row"))
    if not rows:
        raise ValueError(f"{path}: no rows yet")
    text = {name: [cells[k].strip() for _, cells in rows] for k, name in enumerate(names)}
    columns = {name: np.array(cells, dtype=object) if name in words else parse_numbers(cells) for name, cells in text.items()}
    bad = [(k, name) for name in names if name not in words for k in np.flatnonzero(~np.isfinite(columns[name]))]
    if bad:
        row, name = min(bad, key=lambda place: (place[0], names.index(place[1])))
        faults.append(f"{path}:{rows[row][0]}: column {names.index(name) + 1}, {name}, is '{text[name][row][:40]}', no "
                      "number" + more(bad, "value"))
    return columns, dict(headings)


def more(found: Sized, word: str) -> str:
    return f", and {len(found) - 1} more such {word}{'s' * (len(found) > 2)}" if len(found) > 1 else ""


def parse_heading(text: str) -> tuple[str, str]:
    """'torque[Nm]' is ('torque', 'Nm'); without brackets the unit is ''."""
    found = HEADING.match(text)
    if not found:
        return text.strip(), ""
    return found["name"], (found["unit"] or "").strip()


def parse_numbers(cells: list[str]) -> np.ndarray:
    """A number as C and Fortran write it; NaN for anything else."""
    try:
        return np.array(cells, dtype=float)
    except ValueError:
        return np.array([parse_number(cell) for cell in cells])


def parse_number(cell: str) -> float:
    try:
        return float(re.sub(BARE_EXPONENT, r"\1E\2", re.sub(r"[dD]", "E", cell)).replace("_", "?"))
    except ValueError:
        return np.nan


def latest(time: np.ndarray) -> np.ndarray:
    """Rows that are valid: a restarted run may repeat times, of which the later rows are valid."""
    earliest_later = np.fmin.accumulate(time[::-1])[::-1][1:]
    return np.append(~(time[:-1] >= earliest_later), True) & np.isfinite(time)
