# SPDX-License-Identifier: MIT
"""Search for the values of keys with which runs of an input agree with measurements: a design of runs, then least squares."""

from __future__ import annotations

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
    """Differences of a run from the measurements, for values of the keys scaled to their ranges (0 to 1)."""

    scaled: np.ndarray
    residuals: list[np.ndarray] | None  # of each curve and target, in its unit; None: the run broke down
    left: np.ndarray  # the same over uncertainties and roots of numbers of readings, one after the other
    run: Run | None

    @property
    def total(self) -> float:
        """Sum of the mean squares of all curves and targets."""
        return float(self.left @ self.left)


@dataclass
class Fitting:
    """Scaled values of the keys with which the runs agree best with the measurements."""

    keys: list[Key]
    wanted: list[Curve | Target]
    coarse: Trials
    fine: Trials
    rows: list[dict] = field(default_factory=list)
    seen: dict = field(default_factory=dict)
    added: list[np.ndarray] | None = None  # fine less coarse
    first: Outcome | None = None
    best: Outcome | None = None  # of the coarse runs, or of the fine ones
    slopes: np.ndarray | None = None  # of `left` over the scaled values, at the end of the search
    ends: list[Outcome] = field(default_factory=list)  # of the searches from several starts
    spent: bool = False

    def outcome(self, trials: Trials, scaled: np.ndarray) -> Outcome:
        scaled = np.clip(scaled, 0.0, 1.0)
        key = (trials is self.fine, *np.round(scaled, 12))
        if key in self.seen:
            return self.seen[key]
        values = {each.name: each.value(place) for each, place in zip(self.keys, scaled)}
        run, residuals, said = None, None, "broke down"
        try:
            run = trials.run(values)
            residuals = [each.residuals(run) for each in self.wanted]
        except Broken:
            pass
        found = self.seen[key] = self.weighted(scaled, residuals, run)
        row = {"grid": "fine" if trials is self.fine else "coarse"} | values
        if residuals is not None:
            said = f"{found.total:.5g}"
            row |= {"sum of squares": found.total}
            row |= {f"rms {w.label} [{w.unit}]": np.sqrt(np.mean(each**2)) for w, each in zip(self.wanted, residuals)}
        self.rows.append(row)
        print(f"{len(self.rows)} {row['grid']}: {self.words(scaled)}: {said}", flush=True)
        return found

    def weighted(self, scaled: np.ndarray, residuals: list[np.ndarray] | None, run: Run | None) -> Outcome:
        if residuals is None:
            return Outcome(scaled, None, np.full(sum(len(each.time) for each in self.wanted), np.inf), None)
        left = np.concatenate([each / (w.scale * np.sqrt(len(each))) for each, w in zip(residuals, self.wanted)])
        return Outcome(scaled, residuals, left, run)

    def model(self, scaled: np.ndarray) -> Outcome:
        """The coarse run and the correction by fine ones."""
        there = self.outcome(self.coarse, scaled)
        if self.added is None or there.residuals is None:
            return there
        return self.weighted(there.scaled, [a + b for a, b in zip(there.residuals, self.added)], there.run)

    def words(self, scaled: np.ndarray) -> str:
        return ", ".join(f"{key.name} = {key.value(place):.5g}" for key, place in zip(self.keys, scaled))

    def solve(self, design: int, starts: int, seed: int) -> None:
        """Runs of the design, searches from the best of them that are far enough apart, then fine runs."""
        chosen: list[Outcome] = []
        for there in self.explore(design, seed):
            if all(np.abs(there.scaled - other.scaled).max() > APART for other in chosen):
                chosen.append(there)
        searches = [self.least(there.scaled) for there in chosen[:starts]]
        self.ends = [end for end, _ in searches]
        self.best, self.slopes = min(searches, key=lambda search: search[0].total)
        if self.fine.most > 0:
            self.refine()

    def explore(self, design: int, seed: int) -> list[Outcome]:
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
        good = sorted((there for there in found if there.residuals is not None), key=lambda there: there.total)
        if not good:
            raise ValueError("all runs of the design broke down" if found else "no run was allowed; give more --runs")
        self.first = found[0] if found[0].residuals is not None else None
        return good

    def least(self, start: np.ndarray) -> tuple[Outcome, np.ndarray | None]:
        """The smallest sum of squares of the model found from a start, and the derivatives there."""
        from scipy.optimize import least_squares

        best, tangent, before = self.model(start), None, None

        def left(scaled):
            nonlocal best
            there = self.model(scaled)
            best = min(best, there, key=lambda each: each.total)
            return there.left

        def slopes(scaled):
            nonlocal tangent, before
            there, known = left(scaled), False
            if tangent is not None:  # a long step that came as the slopes foretold corrects them
                step, change = scaled - before[0], there - before[1]
                missed = change - tangent @ step
                known = np.linalg.norm(step) > LONG and np.linalg.norm(missed) < GOOD * np.linalg.norm(change)
            tangent = tangent + np.outer(missed, step) / (step @ step) if known else self.differences(scaled)
            before = scaled.copy(), there
            return tangent

        try:
            least_squares(left, start, jac=slopes, bounds=(0.0, 1.0), xtol=CLOSE, ftol=CLOSE**2)
        except Spent:
            self.spent = True
        return best, tangent

    def differences(self, scaled: np.ndarray) -> np.ndarray:
        """Derivatives of the residuals `left` with respect to the scaled values, by a run for each key; 0 where no neighbouring run can be computed."""
        there, columns = self.model(scaled), []
        for k, place in enumerate(scaled):
            for step in (STEP, -STEP) if place + STEP <= 1.0 else (-STEP, STEP):
                moved = self.model(np.clip(scaled + step * np.eye(len(scaled))[k], 0.0, 1.0))
                if moved.residuals is not None:
                    columns.append((moved.left - there.left) / (moved.scaled[k] - place))
                    break
            else:
                columns.append(np.zeros(len(there.left)))
        return np.column_stack(columns)

    def refine(self) -> None:
        """Fine runs, each of which corrects the coarse ones for another search."""
        found, scaled = [], self.best.scaled
        try:
            while True:
                fine = self.outcome(self.fine, scaled)
                if fine.residuals is None:
                    raise ValueError(f"the fine run with {self.words(scaled)} broke down")
                found.append(fine)
                self.added = self.correction(fine)
                end, self.slopes = self.least(scaled)
                if (np.abs(end.scaled - scaled) <= CLOSE).all():
                    break
                scaled = end.scaled
        except Spent:
            pass
        self.best = min(found, key=lambda each: each.total)
        self.added = self.correction(self.best)

    def correction(self, fine: Outcome) -> list[np.ndarray]:
        return [a - b for a, b in zip(fine.residuals, self.outcome(self.coarse, fine.scaled).residuals)]

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
