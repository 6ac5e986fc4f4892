# SPDX-License-Identifier: MIT
"""Parameters that measurements do not determine: runs along the direction in which a calibration changes the misfit least."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import units
from ..plots import look
from .fitting import HELD, STEP, Computed, Fitting, Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WITHIN = 2.0  # standard uncertainties: values whose runs are no farther off meet the measurements as well
FARTHEST = 3.0  # standard uncertainties to which runs go, or to a bound
SHORTEST = 1e-3  # of the ranges: a step that is none
MORE = 2  # times the points that were asked for, until a bound is reached or a run does not meet the measurements
BACK = 2  # runs to come back to the floor of the valley, at most, for each point
NARROW = 0.25  # of the ranges: values up to a bound that are determined nevertheless


@dataclass
class Valley:
    """The direction of the smallest singular value of the slopes, and runs along it to both sides."""

    fit: Fitting
    centre: Computed  # the best one of the search
    direction: np.ndarray  # of all keys, in parts of their ranges
    error: float  # step along it that changes the measurements by a standard uncertainty; infinite where none does
    condition: float  # largest over smallest singular value
    unit: float  # what a standard uncertainty adds to the sum of squares; more where the best run is farther off
    sides: list[list[Outcome]] = field(default_factory=lambda: [[], []])  # against the direction, along it

    @property
    def limit(self) -> float:
        """Sum of squares up to which values meet the measurements as well as the best ones."""
        return self.centre.total + WITHIN**2 * self.unit

    def distance(self, there: Outcome) -> float:
        return float((there.scaled - self.centre.scaled) @ self.direction)

    def path(self) -> list[Outcome]:
        """All runs, from one end to the other."""
        return [*reversed(self.sides[0]), self.centre, *self.sides[1]]

    def computed(self) -> list[Computed]:
        """Those that did not break down."""
        return [there for there in self.path() if isinstance(there, Computed)]

    def end(self, side: int) -> tuple[np.ndarray, bool]:
        """The last values on a side that meet the measurements as well, and whether beyond them a run does not."""
        last: Outcome = self.centre
        for there in self.sides[side]:
            if not there.total <= self.limit:
                rise = [np.sqrt(max(each.total - self.centre.total, 0.0)) for each in (last, there)]
                goal = WITHIN * np.sqrt(self.unit)
                part = (goal - rise[0]) / (rise[1] - rise[0]) if np.isfinite(rise[1]) else 0.0
                return last.scaled + part * (there.scaled - last.scaled), True
            last = there
        return last.scaled, False

    @property
    def determined(self) -> bool:
        """Whether runs beyond both ends do not meet the measurements, or a bound beside the best values ends them."""
        (low, one), (high, other) = self.end(0), self.end(1)
        ends = [end for end, closed in ((low, one), (high, other)) if not closed]
        return not ends or (at_a_bound(ends) and float(np.abs(high - low).max()) < NARROW)

    def result(self) -> dict:
        low, high = self.end(0)[0], self.end(1)[0]
        keys = self.fit.keys
        return {"direction": {key.name: float(part) for key, part in zip(keys, self.direction)},
                "step_of_an_uncertainty": self.error if np.isfinite(self.error) else None,
                "condition": self.condition if np.isfinite(self.condition) else None, "sum_of_squares_within": self.limit,
                "from": {key.name: key.value(place) for key, place in zip(keys, low)},
                "to": {key.name: key.value(place) for key, place in zip(keys, high)}, "determined": self.determined}

    def lines(self) -> list[str]:
        """The valley as text."""
        (low, one), (high, other) = self.end(0), self.end(1)
        moved = [k for k, part in enumerate(self.direction) if abs(part) > 0.05]
        keys = self.fit.keys
        ways = " with ".join(f"{keys[k].name} = {keys[k].value(low[k]):.4g} to {keys[k].value(high[k]):.4g}" for k in moved)
        ends = [end for end, closed in ((low, one), (high, other)) if not closed]
        up_to = f", {'up to a bound' if at_a_bound(ends) else 'as far as runs went'}{' on both sides' * (len(ends) == 2)}" if ends else ""
        text = f"{ways} meet the measurements within {WITHIN:g} standard uncertainties{up_to}"
        if self.determined:
            return [f"least determined: {text}; runs beyond do not"]
        return [f"NOT DETERMINED: {text}",
                "the measurements do not tell these values apart: fix one of the keys, or add a measurement that changes "
                "from one end to the other"]

    def rows(self) -> list[dict]:
        found: list[dict] = []
        for there in self.path():
            row = {"distance": self.distance(there)} | {key.name: key.value(place) for key, place in zip(self.fit.keys, there.scaled)}
            if isinstance(there, Computed):
                row |= {"sum of squares": there.total, "predicted": self.predicted(self.distance(there)), "within": there.total <= self.limit}
                row |= {f"mean {w.label} [{w.unit}]": float(each.mean()) for w, each in zip(self.fit.wanted, there.residuals)}
            found.append(row)
        return found

    def predicted(self, way: np.ndarray | float) -> np.ndarray | float:
        """Sum of squares at a distance from the best values, for constant derivatives."""
        return self.centre.total + (self.unit * (way / self.error)**2 if self.error > 0.0 else 0.0 * way)


def at_a_bound(ends: list[np.ndarray]) -> bool:
    return all(np.minimum(end, 1.0 - end).min() < HELD for end in ends)


def walk(fit: Fitting, count: int) -> Valley | None:
    """Runs at `count` points on each side, or more where the valley is curved; None without derivatives or if all keys are at a bound."""
    free = fit.free
    if fit.slopes is None or not free.any():
        return None
    slopes = fit.slopes * free
    _, sizes, turned = np.linalg.svd(slopes[:, free], full_matrices=False)
    direction = np.zeros(len(free))
    direction[free] = turned[-1] * np.sign(turned[-1][np.abs(turned[-1]).argmax()])
    unit = max(1.0, fit.best.total / len(fit.wanted))
    error = float(np.sqrt(unit) / sizes[-1]) if sizes[-1] > 1e-9 * max(sizes[0], 1e-300) else np.inf
    valley = Valley(fit, fit.best, direction, error, float(sizes[0] / sizes[-1]) if np.isfinite(error) else np.inf, unit)
    others = np.zeros((len(free), free.sum() - 1))
    others[free] = turned[:-1].T
    for side, sign in enumerate((-1.0, 1.0)):
        valley.sides[side] = along(fit, sign * direction, valley, slopes, others, count)
    return valley


def along(fit: Fitting, heading: np.ndarray, valley: Valley, slopes: np.ndarray, others: np.ndarray, count: int) -> list[Outcome]:
    """Runs from the best values on. A run that is worse than there is brought back to the floor of the valley by
    the slopes across it, which each run corrects (Broyden); the next goes on in the direction of the last two."""
    found: list[Outcome] = []
    at: Outcome = valley.centre
    slopes = slopes.copy()
    reach = min(room(at.scaled, heading), max(FARTHEST * valley.error, count * STEP))

    def to(scaled: np.ndarray, before: Outcome) -> Outcome:
        there = fit.model(scaled)
        moved = there.scaled - before.scaled
        if isinstance(there, Computed) and moved @ moved > 0.0:
            slopes[:] += np.outer(there.left - before.left - slopes @ moved, moved) / (moved @ moved)
        return there

    for _ in range(MORE * count):
        step = min(reach / count, room(at.scaled, heading))
        if step < SHORTEST:
            break
        there = to(at.scaled + step * heading, at)
        for _ in range(BACK if others.size else 0):
            if not valley.centre.total + valley.unit < there.total < np.inf:
                break
            back = np.linalg.lstsq(slopes @ others, there.left - valley.centre.left, rcond=None)[0]
            nearer = to(there.scaled - others @ back, there)
            if not nearer.total < there.total:
                break
            there = nearer
        found.append(there)
        moved = there.scaled - at.scaled
        if not there.total <= valley.limit or moved @ heading < SHORTEST:
            break
        heading, at = moved / np.linalg.norm(moved), there
    return found


def room(scaled: np.ndarray, heading: np.ndarray) -> float:
    """Distance to the nearest bound."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.nanmin(np.where(heading > 0, 1.0 - scaled, scaled) / np.abs(heading)))


def picture(valley: Valley) -> Figure:
    """The sum of squares along the valley, and the difference of each curve and target in standard uncertainties."""
    path = valley.computed()
    ways = np.array([valley.distance(there) for there in path])
    figure = look.new_figure(9.0, 6.4)
    above, below = figure.subplots(2, 1, sharex=True)
    fine = np.linspace(ways.min(), ways.max(), 100)
    above.plot(fine, valley.predicted(fine), "--", color="#8a96a3", label="from the slopes at the best values")
    above.plot(ways, [there.total for there in path], "o-", color=look.LINES[0], label="runs")
    above.axhline(valley.limit, color=look.LINES[1], linewidth=0.9, label=f"{WITHIN:g} standard uncertainties")
    above.set_ylabel("sum of squares [1]")
    above.set_ylim(0.0, 1.1 * max(max(there.total for there in path), valley.limit))
    above.legend(fontsize="small")
    for k, (w, colour) in enumerate(zip(valley.fit.wanted, look.line_colours(len(valley.fit.wanted)))):
        below.plot(ways, [there.residuals[k].mean() / w.scale for there in path], "o-", color=colour, label=units.words(w.label))
    below.set_ylabel("mean difference [standard uncertainties]")
    below.legend(fontsize="small")
    below.set_xticks(ways, ["\n".join(f"{key.value(place):.3g}" for key, place in zip(valley.fit.keys, there.scaled)) for there in path])
    below.set_xlabel(", ".join(key.name for key in valley.fit.keys) + " (from above) of each run")
    for axis in (above, below):
        axis.grid(True)
    return figure
