# SPDX-License-Identifier: MIT
"""CSV histories: columns are found by name, the unit stands in brackets behind the name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HEADING = re.compile(r"^\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*$")
BARE_EXPONENT = re.compile(r"^([+-]?[\d.]+)([+-]\d{3})$")  # Fortran writes 1.0-101 for 1.0E-101


@dataclass
class Column:
    name: str
    unit: str
    values: np.ndarray


class Table:
    """Columns of equal length in the order of the file."""

    def __init__(self, columns: list[Column]):
        self.columns = columns
        self._by_name = {column.name: column for column in columns}

    def __len__(self) -> int:
        return len(self.columns[0].values) if self.columns else 0

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def __getitem__(self, name: str) -> np.ndarray:
        return self._by_name[name].values

    def unit(self, name: str) -> str:
        return self._by_name[name].unit

    def with_unit(self, unit: str) -> list[Column]:
        """Columns of one unit that hold at least one number."""
        return [c for c in self.columns if c.unit == unit and np.isfinite(c.values).any()]

    def matching(self, pattern: str) -> list[Column]:
        """Columns whose whole name matches a regular expression and that hold a number."""
        wanted = re.compile(pattern)
        return [c for c in self.columns if wanted.fullmatch(c.name) and np.isfinite(c.values).any()]


def read_table(path: Path) -> Table | None:
    """The table of a file, or None if there is no file, no row in it or no column `time`."""
    if not path.is_file():
        return None
    lines = [
        line
        for line in path.read_text(errors="replace").splitlines()
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        return None
    headings = [parse_heading(text) for text in lines[0].split(",")]
    rows = [row for row in (line.split(",") for line in lines[1:]) if len(row) == len(headings)]
    if not rows or "time" not in [name for name, _ in headings]:  # a row cut short is left out
        return None
    values = np.array([[parse_number(text) for text in row] for row in rows])
    columns = [Column(name, unit, values[:, k]) for k, (name, unit) in enumerate(headings)]
    return Table(drop_repeated_times(columns))


def parse_heading(text: str) -> tuple[str, str]:
    """'torque[Nm]' is ('torque', 'Nm'); without brackets the unit is ''."""
    found = HEADING.match(text)
    if not found:
        return text.strip(), ""
    return found["name"], (found["unit"] or "").strip()


def parse_number(text: str) -> float:
    text = text.strip()
    try:
        return float(text.replace("D", "E").replace("d", "e"))
    except ValueError:
        found = BARE_EXPONENT.match(text)
        return float(f"{found[1]}E{found[2]}") if found else float("nan")


def drop_repeated_times(columns: list[Column]) -> list[Column]:
    """A restarted run may repeat times: then the later rows count."""
    time = next(c.values for c in columns if c.name == "time")
    earliest_later = np.fmin.accumulate(time[::-1])[::-1][1:]
    keep = np.append(~(time[:-1] >= earliest_later), True) & np.isfinite(time)
    return [Column(c.name, c.unit, c.values[keep]) for c in columns]
