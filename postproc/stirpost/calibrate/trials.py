# SPDX-License-Identifier: MIT
"""Runs of one input with other values of its keys, each computed once and kept in a folder of its own."""

from __future__ import annotations

import hashlib
import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..analysis.cooling import Record, means
from ..io import program
from ..io.files import text_of, write
from ..io.table import Table
from ..run import Run

ASSUMED = 0.05  # of the range of a curve: its standard uncertainty, where none is given
BREAKS = (2, 3)  # exit statuses of the program that follow from the values


class Spent(Exception):
    """The number of allowed runs is used up."""


class Broken(Exception):
    """The program cannot compute these values: it refused them, or the run failed."""


@dataclass
class Trials:
    """Runs in `folder`, of which at most `most` may be new; a run with the same input, keys and program is not repeated."""

    path: Path
    folder: Path
    sets: dict[str, str]
    most: int
    named: str | None = None  # stirpoint itself
    ranks: int = 1
    done: int = 0

    def __post_init__(self) -> None:
        version = program.run(["--version"], self.named).stdout.splitlines()
        self.made_by = version[0].strip() if version else ""

    def run(self, values: dict[str, float]) -> Run:
        """The run with these values: stored, resumed from its checkpoint, or new."""
        keys = self.sets | {key: f"{value:.12g}" for key, value in values.items()}
        recipe = json.dumps({"program": self.made_by, "keys": keys, "input": text_of(self.path)}, indent=1)
        place = self.folder / hashlib.sha256(recipe.encode()).hexdigest()[:12]
        results, broken = place / f"{self.path.stem}.out", place / "broken.txt"
        if broken.exists():
            raise Broken(text_of(broken))
        if any(results.glob("*_summary.json")):
            return Run(results)
        if self.done >= self.most:
            raise Spent
        self.done += 1
        place.mkdir(parents=True, exist_ok=True)
        write(place / "recipe.json", recipe)
        checkpoint = next(results.glob("*_checkpoint.h5"), None)
        words = ["--restart", checkpoint] if checkpoint else [self.path, "--overwrite"]
        if not checkpoint:
            for key, value in keys.items():
                words += ["--set", f"{key}={value}"]
        given = ", ".join(f"{key} = {value}" for key, value in keys.items())
        try:
            program.compute([*words, "--quiet", "--output", results], self.named, self.ranks, f"the run with {given} failed")
        except program.Failed as problem:
            if problem.status not in BREAKS:
                raise
            write(broken, str(problem))
            raise Broken(str(problem)) from None
        for checkpoint in results.glob("*_checkpoint*.h5"):
            checkpoint.unlink()
        return Run(results)

    def first_step(self, values: dict[str, float]) -> Run:
        """One step, which shows whether the input is right and what its columns are called."""
        self.folder.mkdir(parents=True, exist_ok=True)
        place = self.folder / "first_step.out"
        words = [self.path, "--quiet", "--overwrite", "--output", place, "--set", "TIME.MAX_STEPS=1"]
        for key, value in (self.sets | {key: f"{value:.12g}" for key, value in values.items()}).items():
            words += ["--set", f"{key}={value}"]
        program.compute(words, self.named)
        run = Run(place)
        shutil.rmtree(place)
        return run


@dataclass
class Curve:
    """A measured curve: times, readings and their uncertainty."""

    name: str
    unit: str
    time: np.ndarray
    values: np.ndarray
    scale: float  # standard uncertainty of a reading
    known: bool  # whether it was given

    @property
    def label(self) -> str:
        return self.name

    def residuals(self, run: Run) -> np.ndarray:
        """Model less reading, in the curve's unit. A reading stands for the time half way to its neighbours, over which the model is averaged,
        because rows of a history are means with noise."""
        table = table_of(run, self.name)
        if self.time[-1] > table["time"][-1] * (1 + 1e-9):
            raise ValueError(f"{run.directory}: the run ends at {table['time'][-1]:g} s, before the reading of {self.name} at {self.time[-1]:g} s")
        return means(table["time"], table[self.name], self.time) - self.values


def table_of(run: Run, name: str) -> Table:
    for table in (run.probes, run.history):
        if name in table:
            return table
    raise ValueError(f"{run.directory}: no column {name}")


def measured(paths: list[Path], unit: str | None, known: Run, start: float | None, end: float | None,
             errors: dict[str, float]) -> list[Curve]:
    """The curves of some files, whose names are columns of the run; all mistakes are reported in one error."""
    none = "" if known.probes else f", which has no {known.name}_probes.csv"
    columns = {c.name: c.unit for table in (known.history, known.probes) for c in table.columns if c.unit in ("K", "N", "Nm", "W")}
    found, wrong = [], []
    for path in paths:
        record = Record.read(path, unit, loads=True)
        within = (record.time >= (-np.inf if start is None else start)) & (record.time <= (np.inf if end is None else end))
        for name, own, values in zip(record.names, record.units, record.values.T):
            there = within & np.isfinite(values)
            if name not in columns:
                wrong.append(f"{path}: {name} is no column of the run{none}: {', '.join(sorted(columns))}")
            elif own != columns[name]:
                wrong.append(f"{path}: {name} is in {own}, that of the run in {columns[name]}")
            elif there.sum() < 3:
                wrong.append(f"{path}: {name} has {there.sum()} readings in the time that counts; three are needed")
            else:
                given = name in errors
                error = errors.pop(name, ASSUMED * float(np.ptp(values[there])))
                if not error > 0.0:
                    wrong.append(f"{path}: {name} does not change: give --uncertainty {name}=VALUE")
                found.append(Curve(name, own, record.time[there], values[there], error, given))
    wrong += [f"--uncertainty {name}: no curve of this name" for name in errors]
    if wrong:
        raise ValueError("\n".join(wrong))
    return found
