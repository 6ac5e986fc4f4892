# SPDX-License-Identifier: MIT
"""Search for the values of keys with which runs of an input agree with measurements: a design of runs, then least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..analysis import cooling
from ..run import Run
from .limits import Key
from .targets import Target
from .trials import Broken, Curve, Spent, Trials

STEP = 0.04  # of the range of a key, for slopes: above what runs rattle by
CLOSE = 0.01  # of the range of a key: nearer is not sought
LONG, GOOD = 0.1, 0.3  # a step that is longer, of the ranges, and its part that slopes do not foretell: such slopes are kept
HELD = 1e-3  # of the range of a key: nearer to a bound the bound holds it
APART = 0.2  # of the ranges: searches from nearer starts are one


@dataclass
class Outcome:
    """A run with values of the keys scaled to their ranges (0 to 1). Of one that broke down `left` is infinite."""

    scaled: np.ndarray
    left: np.ndarray  # residuals over uncertainties and roots of numbers of readings, one after the other

    @property
    def total(self) -> float:
        """Sum of the mean squares of all curves and targets."""
        return float(self.left @ self.left)


@dataclass
class Computed(Outcome):
    """A run that did not break down."""

    residuals: list[np.ndarray]  # of each curve and target, in its unit
    run: Run


@dataclass
class Fitting:
    """Scaled values of the keys with which the runs agree best with the measurements."""

    keys: list[Key]
    wanted: Sequence[Curve | Target]
    coarse: Trials
    fine: Trials
    rows: list[dict] = field(default_factory=list)
    seen: dict[tuple[float, ...], Outcome] = field(default_factory=dict)
    added: list[np.ndarray] = field(default_factory=list)  # fine less coarse; empty without fine runs
    first: Computed | None = None  # None: the start broke down
    best: Computed = field(init=False)  # of the coarse runs, or of the fine ones
    slopes: np.ndarray | None = None  # of `left` over the scaled values, at the end of the search
    ends: list[Computed] = field(default_factory=list)  # of the searches from several starts
    spent: bool = False

    def outcome(self, trials: Trials, scaled: np.ndarray) -> Outcome:
        scaled = np.clip(scaled, 0.0, 1.0)
        key = (trials is self.fine, *np.round(scaled, 12))
        if key in self.seen:
            return self.seen[key]
        values = {each.name: each.value(place) for each, place in zip(self.keys, scaled)}
        row: dict[str, object] = {"grid": "fine" if trials is self.fine else "coarse", **values}
        found, said = Outcome(scaled, np.full(sum(len(each.time) for each in self.wanted), np.inf)), "broke down"
        try:
            run = trials.run(values)
            residuals = [each.residuals(run) for each in self.wanted]
            found = self.weighted(scaled, residuals, run)
            said = f"sum of squares {found.total:.5g}"
            row |= {"sum of squares": found.total}
            row |= {f"rms {w.label} [{w.unit}]": np.sqrt(np.mean(each**2)) for w, each in zip(self.wanted, residuals)}
        except Broken:
            pass
        self.seen[key] = found
        self.rows.append(row)
        grid = f" {row['grid']}" if self.fine.most else ""
        print(f"{len(self.rows)}{grid}: {self.words(scaled)}: {said}", flush=True)
        return found

    def weighted(self, scaled: np.ndarray, residuals: list[np.ndarray], run: Run) -> Computed:
        left = np.concatenate([each / (w.scale * np.sqrt(len(each))) for each, w in zip(residuals, self.wanted)])
        return Computed(scaled, left, residuals, run)

    def model(self, scaled: np.ndarray) -> Outcome:
        """The coarse run and the correction by fine ones."""
        there = self.outcome(self.coarse, scaled)
        return self.corrected(there) if isinstance(there, Computed) else there

    def corrected(self, there: Computed) -> Computed:
        return self.weighted(there.scaled, [a + b for a, b in zip(there.residuals, self.added)], there.run) if self.added else there

    def computed(self, trials: Trials, scaled: np.ndarray) -> Computed:
        found = self.outcome(trials, scaled)
        if not isinstance(found, Computed):
            raise ValueError(f"the {'fine' if trials is self.fine else 'coarse'} run with {self.words(scaled)} broke down")
        return found

    def words(self, scaled: np.ndarray) -> str:
        return ", ".join(f"{key.name} = {key.value(place):.5g}" for key, place in zip(self.keys, scaled))

    def solve(self, design: int, starts: int, seed: int) -> None:
        """Runs of the design, searches from the best of them that are far enough apart, then fine runs."""
        chosen: list[Computed] = []
        for there in self.explore(design, seed):
            if all(np.abs(there.scaled - other.scaled).max() > APART for other in chosen):
                chosen.append(there)
        searches = [self.least(there) for there in chosen[:starts]]
        self.ends = [end for end, _ in searches]
        self.best, self.slopes = min(searches, key=lambda search: search[0].total)
        if self.spent:  # runs for slopes count too
            self.best = min((there for there in self.seen.values() if isinstance(there, Computed)), key=lambda there: there.total)
        if self.fine.most > 0:
            self.refine()

    def explore(self, design: int, seed: int) -> list[Computed]:
        """The start and a Latin hypercube of runs, best first."""
        from scipy.stats import qmc

        scaled = [np.array([key.scaled(key.start) for key in self.keys])]
        if design > 0:
            scaled += list(qmc.LatinHypercube(len(self.keys), seed=seed).random(design))
        found = []
        try:
            for each in scaled:
                found.append(self.model(each))
        except Spent:
            self.spent = True
        good = sorted((there for there in found if isinstance(there, Computed)), key=lambda there: there.total)
        if not good:
            raise ValueError("all runs of the design broke down" if found else "no run was allowed; give more --runs")
        self.first = found[0] if isinstance(found[0], Computed) else None
        return good

    def least(self, start: Computed) -> tuple[Computed, np.ndarray | None]:
        """The smallest sum of squares of the model found from a start, and the derivatives there."""
        from scipy.optimize import least_squares

        best, before = start, (start.scaled, start.left)
        tangent: np.ndarray | None = None

        def left(scaled: np.ndarray) -> np.ndarray:
            nonlocal best
            there = self.model(scaled)
            if isinstance(there, Computed) and there.total < best.total:
                best = there
            return there.left

        def slopes(scaled: np.ndarray) -> np.ndarray:
            nonlocal tangent, before
            there = left(scaled)
            step, change = scaled - before[0], there - before[1]
            missed = change if tangent is None else change - tangent @ step
            # a long step that came as the slopes foretold corrects them
            if tangent is not None and np.linalg.norm(step) > LONG and np.linalg.norm(missed) < GOOD * np.linalg.norm(change):
                tangent = tangent + np.outer(missed, step) / (step @ step)
            else:
                tangent = self.differences(scaled)
            before = scaled.copy(), there
            return tangent

        try:
            least_squares(left, start.scaled, jac=slopes, bounds=(0.0, 1.0), xtol=CLOSE, ftol=CLOSE**2)
        except Spent:
            self.spent = True
        return best, tangent

    def differences(self, scaled: np.ndarray) -> np.ndarray:
        """Derivatives of the residuals `left` with respect to the scaled values, by a run for each key; 0 where no neighbouring run can be computed."""
        there, columns = self.model(scaled), []
        for k, place in enumerate(scaled):
            for step in (STEP, -STEP) if place + STEP <= 1.0 else (-STEP, STEP):
                moved = self.model(np.clip(scaled + step * np.eye(len(scaled))[k], 0.0, 1.0))
                if isinstance(moved, Computed):
                    columns.append((moved.left - there.left) / (moved.scaled[k] - place))
                    break
            else:
                columns.append(np.zeros(len(there.left)))
        return np.column_stack(columns)

    def refine(self) -> None:
        """Fine runs, each of which corrects the coarse ones for another search."""
        start, found = self.best, list[tuple[Computed, list[np.ndarray]]]()
        try:
            while True:
                fine, coarse = (self.computed(trials, start.scaled) for trials in (self.fine, self.coarse))
                self.added = [a - b for a, b in zip(fine.residuals, coarse.residuals)]
                found.append((fine, self.added))
                end, self.slopes = self.least(self.corrected(coarse))
                if (np.abs(end.scaled - start.scaled) <= CLOSE).all():
                    break
                start = end
        except Spent:
            pass
        self.best, self.added = min(found, key=lambda each: each[0].total)

    # -- how well --------------------------------------------------------------------------------------------------

    @property
    def free(self) -> np.ndarray:
        """Keys that are not at a bound."""
        return (self.best.scaled > HELD) & (self.best.scaled < 1.0 - HELD)

    def variances(self) -> np.ndarray:
        """Of each of `left`: 1 where the standard uncertainty was given, which all readings of a curve share; else of
        what is left of the curve, readings that follow each other closely taken for one. NaN: too few readings."""
        memories = [cooling.memory(each) for each in self.best.residuals]
        points = sum(len(each) / m for each, m in zip(self.best.residuals, memories))
        spare = points - self.free.sum()
        parts = []
        for w, each, m in zip(self.wanted, self.best.residuals, memories):
            own = np.mean((each / w.scale)**2) * m / len(each) * points / spare if spare > 0.0 else np.nan
            parts.append(np.full(len(each), 1.0 if w.known else own))
        return np.concatenate(parts)

    def errors(self) -> np.ndarray:
        """Standard errors of the scaled values; NaN: at a bound, or not determined better than the range."""
        found, free = np.full(len(self.keys), np.nan), self.free
        if self.slopes is None or not free.any():
            return found
        slopes = self.slopes[:, free]
        sizes = np.linalg.norm(slopes, axis=0)
        if (sizes > 0).all() and np.linalg.matrix_rank(slopes / sizes) == free.sum():
            inverse = np.linalg.pinv(slopes)
            found[free] = np.sqrt(np.einsum("ij,j,ij->i", inverse, self.variances(), inverse))
        return np.where(found < 1.0, found, np.nan)
