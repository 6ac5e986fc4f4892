# SPDX-License-Identifier: MIT
"""Base of the rows of the stress tests: cases, runs, checks against bounds."""

import dataclasses
import math
import pathlib
import re
import sys

TESTS = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(TESTS / "system"), str(TESTS / "verification")]

import driver  # noqa: E402  (runs the program and reads its results)
import numpy as np  # noqa: E402

INPUTS = pathlib.Path(__file__).resolve().parents[1] / "inputs"
OTHER_INPUTS = (TESTS / "verification" / "inputs", TESTS / "system" / "inputs")
SHIFT = (0.13, 0.29, 0.41)  # of the grid's origin [cells]

CULPRIT = re.compile(r"particle [0-9]+ (left the grid|runs away|has a [a-z ]+ that is not a finite number)")


@dataclasses.dataclass
class Check:
    """A measured figure and the bounds it must keep; without any it is only shown."""

    what: str
    measured: float
    at_most: float = math.inf
    at_least: float = -math.inf

    @property
    def passes(self):
        """The bounds as text."""
        if math.isinf(self.at_most) and math.isinf(self.at_least):
            return "(not judged)"
        low, high = f">= {self.at_least:.3g}", f"<= {self.at_most:.3g}"
        if math.isinf(self.at_least):
            return high
        return low if math.isinf(self.at_most) else f"{self.at_least:.3g} to {self.at_most:.3g}"

    @property
    def ok(self):
        return bool(self.at_least <= self.measured <= self.at_most)


def yes(what, condition):
    """A check of a condition."""
    return Check(what, float(bool(condition)), at_least=1.0)


def values(*numbers):
    """A list of numbers as --set takes it."""
    return ",".join(repr(float(number)) for number in numbers)


def box(h, lower, upper, offset=(0.0, 0.0, 0.0)):
    """Sets for a grid of cells h from `lower` to `upper` [cells], moved by `offset` [cells]."""
    return {
        "GRID.CELL": h,
        "GRID.LOWER": values(*(h * (a + o) for a, o in zip(lower, offset))),
        "GRID.UPPER": values(*(h * (b + o) for b, o in zip(upper, offset))),
    }


class Row:
    """One row. A case is a label and its parameters; measuring it gives a list of checks."""

    name = ""
    text = ""  # the instability and how it is tested
    input = ""  # stem of the input file
    long = False  # by the command only, even there last
    alone = False  # the number of ranks is its own or does not matter: on one only

    def cases(self, quick):
        """{label: parameters}."""
        raise NotImplementedError

    def measure(self, place, ranks, **parameters):
        """The checks of a case, run in the empty directory `place`."""
        raise NotImplementedError

    def run(self, place, ranks, sets, *options, stem=None, expect=driver.WELL, timeout=7200):
        """Run an input of this row; (what was printed and the exit status, results)."""
        stem = stem or self.input
        path = next(p for folder in (INPUTS, *OTHER_INPUTS) if (p := folder / f"{stem}.nml").exists())
        done = driver.run(path, *options, directory=place, ranks=ranks if ranks > 1 else None, sets=sets,
                          expect=expect, timeout=timeout)
        return done, done.results(stem)


def finite(history):
    """A check that a history has finite numbers only."""
    return yes("finite", np.isfinite(history.rows).all())
