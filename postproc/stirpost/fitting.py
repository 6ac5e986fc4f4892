# SPDX-License-Identifier: MIT
"""Search of the keys with which the runs of an input meet what was measured: a design of runs, then least squares."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from . import cooling
from .limits import Key
from .run import Run
from .targets import Target
from .trials import Broken, Curve, Spent, Trials

STEP = 0.04  # of the range of a key, for slopes: above what runs rattle by
CLOSE = 0.01  # of the range of a key: nearer is not sought
LONG, GOOD = 0.1, 0.3  # a step that is longer, of the ranges, and its part that slopes do not foretell: such slopes are kept
HELD = 1e-3  # of the range of a key: nearer to a bound the bound holds it
APART = 0.2  # of the ranges: searches from nearer starts are one


@dataclass
class Outcome:
    """What a run with keys at some places of their ranges (0 to 1) differs from the measurements by."""

    places: np.ndarray
    apart: list[np.ndarray] | None  # of each curve and target, in its unit; None: the run broke down
    left: np.ndarray  # the same over uncertainties and roots of numbers of readings, one after the other
    run: Run | None

    @property
    def total(self) -> float:
        """Sum of the mean squares of all curves and targets."""
        return float(self.left @ self.left)


@dataclass
class Fitting:
    """Places of the keys that bring the runs to the measurements."""

    keys: list[Key]
    wanted: list[Curve | Target]
    coarse: Trials
    fine: Trials
    rows: list[dict] = field(default_factory=list)
    seen: dict = field(default_factory=dict)
    added: list[np.ndarray] | None = None  # fine less coarse
    first: Outcome | None = None
    best: Outcome | None = None  # of the coarse runs, or of the fine ones
    slopes: np.ndarray | None = None  # of `left` over the places, at the end of the search
    ends: list[Outcome] = field(default_factory=list)  # of the searches from several starts
    spent: bool = False

    def outcome(self, trials: Trials, places: np.ndarray) -> Outcome:
        places = np.clip(places, 0.0, 1.0)
        key = (trials is self.fine, *np.round(places, 12))
        if key in self.seen:
            return self.seen[key]
        values = {each.name: each.value(place) for each, place in zip(self.keys, places)}
        run, apart, told = None, None, "broke down"
        try:
            run = trials.run(values)
            apart = [each.apart(run) for each in self.wanted]
        except Broken:
            pass
        found = self.seen[key] = self.weighted(places, apart, run)
        row = {"grid": "fine" if trials is self.fine else "coarse"} | values
        if apart is not None:
            told = f"{found.total:.5g}"
            row |= {"sum of squares": found.total}
            row |= {f"rms {w.label} [{w.unit}]": np.sqrt(np.mean(each**2)) for w, each in zip(self.wanted, apart)}
        self.rows.append(row)
        print(f"{len(self.rows)} {row['grid']}: {self.words(places)}: {told}", flush=True)
        return found

    def weighted(self, places: np.ndarray, apart: list[np.ndarray] | None, run: Run | None) -> Outcome:
        if apart is None:
            return Outcome(places, None, np.full(sum(len(each.time) for each in self.wanted), np.inf), None)
        left = np.concatenate([each / (w.scale * np.sqrt(len(each))) for each, w in zip(apart, self.wanted)])
        return Outcome(places, apart, left, run)

    def model(self, places: np.ndarray) -> Outcome:
        """The coarse run and what fine ones add to it."""
        there = self.outcome(self.coarse, places)
        if self.added is None or there.apart is None:
            return there
        return self.weighted(there.places, [a + b for a, b in zip(there.apart, self.added)], there.run)

    def words(self, places: np.ndarray) -> str:
        return ", ".join(f"{key.name} = {key.value(place):.5g}" for key, place in zip(self.keys, places))

    def solve(self, design: int, starts: int, seed: int) -> None:
        """Runs of the design, searches from the best of them that lie apart, then fine runs."""
        chosen: list[Outcome] = []
        for there in self.explore(design, seed):
            if all(np.abs(there.places - other.places).max() > APART for other in chosen):
                chosen.append(there)
        searches = [self.least(there.places) for there in chosen[:starts]]
        self.ends = [end for end, _ in searches]
        self.best, self.slopes = min(searches, key=lambda search: search[0].total)
        if self.fine.most > 0:
            self.refine()

    def explore(self, design: int, seed: int) -> list[Outcome]:
        """The start and a Latin hypercube of runs, best first."""
        from scipy.stats import qmc

        places = [np.array([key.place(key.start) for key in self.keys])]
        if design > 0:
            places += list(qmc.LatinHypercube(len(self.keys), seed=seed).random(design))
        found = []
        try:
            for each in places:
                found.append(self.model(each))
        except Spent:
            self.spent = True
        good = sorted((there for there in found if there.apart is not None), key=lambda there: there.total)
        if not good:
            raise ValueError("all runs of the design broke down" if found else "no run was allowed; give more --runs")
        self.first = found[0] if found[0].apart is not None else None
        return good

    def least(self, start: np.ndarray) -> tuple[Outcome, np.ndarray | None]:
        """The least sum of squares of the model that is found from a start, and the slopes there."""
        from scipy.optimize import least_squares

        best, tangent, before = self.model(start), None, None

        def left(places):
            nonlocal best
            there = self.model(places)
            best = min(best, there, key=lambda each: each.total)
            return there.left

        def slopes(places):
            nonlocal tangent, before
            there, known = left(places), False
            if tangent is not None:  # a long step that came as the slopes foretold corrects them
                step, change = places - before[0], there - before[1]
                missed = change - tangent @ step
                known = np.linalg.norm(step) > LONG and np.linalg.norm(missed) < GOOD * np.linalg.norm(change)
            tangent = tangent + np.outer(missed, step) / (step @ step) if known else self.differences(places)
            before = places.copy(), there
            return tangent

        try:
            least_squares(left, start, jac=slopes, bounds=(0.0, 1.0), xtol=CLOSE, ftol=CLOSE**2)
        except Spent:
            self.spent = True
        return best, tangent

    def differences(self, places: np.ndarray) -> np.ndarray:
        """Slopes of `left` over the places, by a run for each key; 0 where no run beside them can be computed."""
        there, columns = self.model(places), []
        for k, place in enumerate(places):
            for step in (STEP, -STEP) if place + STEP <= 1.0 else (-STEP, STEP):
                moved = self.model(np.clip(places + step * np.eye(len(places))[k], 0.0, 1.0))
                if moved.apart is not None:
                    columns.append((moved.left - there.left) / (moved.places[k] - place))
                    break
            else:
                columns.append(np.zeros(len(there.left)))
        return np.column_stack(columns)

    def refine(self) -> None:
        """Fine runs, each of which corrects the coarse ones for another search."""
        found, places = [], self.best.places
        try:
            while True:
                fine = self.outcome(self.fine, places)
                if fine.apart is None:
                    raise ValueError(f"the fine run with {self.words(places)} broke down")
                found.append(fine)
                self.added = self.correction(fine)
                end, self.slopes = self.least(places)
                if (np.abs(end.places - places) <= CLOSE).all():
                    break
                places = end.places
        except Spent:
            pass
        self.best = min(found, key=lambda each: each.total)
        self.added = self.correction(self.best)

    def correction(self, fine: Outcome) -> list[np.ndarray]:
        return [a - b for a, b in zip(fine.apart, self.outcome(self.coarse, fine.places).apart)]

    # -- how well --------------------------------------------------------------------------------------------------

    @property
    def free(self) -> np.ndarray:
        """Keys that no bound holds."""
        return (self.best.places > HELD) & (self.best.places < 1.0 - HELD)

    def variances(self) -> np.ndarray:
        """Of each of `left`: 1 where the standard uncertainty was given, which all readings of a curve share; else of
        what is left of the curve, readings that follow each other closely taken for one. NaN: too few readings."""
        memories = [cooling.memory(each) for each in self.best.apart]
        points = sum(len(each) / m for each, m in zip(self.best.apart, memories))
        spare = points - self.free.sum()
        parts = []
        for w, each, m in zip(self.wanted, self.best.apart, memories):
            own = np.mean((each / w.scale)**2) * m / len(each) * points / spare if spare > 0.0 else np.nan
            parts.append(np.full(len(each), 1.0 if w.known else own))
        return np.concatenate(parts)

    def errors(self) -> np.ndarray:
        """Standard errors of the places; NaN: held by a bound, or not determined to better than the range."""
        found, free = np.full(len(self.keys), np.nan), self.free
        if self.slopes is None or not free.any():
            return found
        slopes = self.slopes[:, free]
        sizes = np.linalg.norm(slopes, axis=0)
        if (sizes > 0).all() and np.linalg.matrix_rank(slopes / sizes) == free.sum():
            inverse = np.linalg.pinv(slopes)
            found[free] = np.sqrt(np.einsum("ij,j,ij->i", inverse, self.variances(), inverse))
        return np.where(found < 1.0, found, np.nan)
