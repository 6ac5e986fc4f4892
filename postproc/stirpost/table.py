# SPDX-License-Identifier: MIT
"""CSV histories as pandas frames: columns are found by name, the unit stands in brackets behind the name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

HEADING = re.compile(r"^\s*(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*$")
BARE_EXPONENT = r"^\s*([+-]?[\d.]+)([+-]\d{3})\s*$"  # Fortran writes 1.0-101 for 1.0E-101


@dataclass
class Column:
    name: str
    unit: str
    values: np.ndarray


class Table:
    """A pandas frame of numbers, `frame`, in the order of the file, and the units of its columns."""

    def __init__(self, columns: list[Column]):
        self.frame = pd.DataFrame({c.name: np.asarray(c.values) for c in columns})
        self.units = {c.name: c.unit for c in columns}

    def __len__(self) -> int:
        return len(self.frame)

    def __contains__(self, name: str) -> bool:
        return name in self.units

    def __getitem__(self, name: str) -> np.ndarray:
        return self.frame[name].to_numpy()

    @property
    def columns(self) -> list[Column]:
        return [Column(name, unit, self[name]) for name, unit in self.units.items()]

    def unit(self, name: str) -> str:
        return self.units[name]

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
    try:
        text = pd.read_csv(path, comment="#", dtype=str, skip_blank_lines=True, encoding_errors="replace",
                           on_bad_lines="skip", index_col=False, keep_default_na=False)
    except pd.errors.EmptyDataError:
        return None
    headings = [parse_heading(name) for name in text.columns]
    text.columns = [name for name, _ in headings]
    text = text[text.iloc[:, -1] != ""]  # a row cut short is left out
    if "time" not in text.columns or text.empty:
        return None
    frame = drop_repeated_times(text.apply(parse_numbers))
    return Table([Column(name, unit, frame[name].to_numpy()) for name, unit in headings])


def parse_heading(text: str) -> tuple[str, str]:
    """'torque[Nm]' is ('torque', 'Nm'); without brackets the unit is ''."""
    found = HEADING.match(text)
    if not found:
        return text.strip(), ""
    return found["name"], (found["unit"] or "").strip()


def parse_numbers(column: pd.Series) -> pd.Series:
    """Numbers as C and Fortran write them; all else is no number."""
    plain = pd.to_numeric(column, errors="coerce")
    odd = plain.isna()
    if odd.any():
        text = column[odd].str.replace(r"[dD]", "E", regex=True).str.replace(BARE_EXPONENT, r"\1E\2", regex=True)
        plain[odd] = pd.to_numeric(text, errors="coerce")
    return plain.astype(float)


def drop_repeated_times(frame: pd.DataFrame) -> pd.DataFrame:
    """A restarted run may repeat times: then the later rows count."""
    time = frame["time"].to_numpy()
    earliest_later = np.fmin.accumulate(time[::-1])[::-1][1:]
    keep = np.append(~(time[:-1] >= earliest_later), True) & np.isfinite(time)
    return frame[keep].reset_index(drop=True)
