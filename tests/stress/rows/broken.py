# SPDX-License-Identifier: MIT
"""Failures must be detected within a report interval, name a particle, and leave a checkpoint from before."""

import shutil

import driver
import h5py
import numpy as np

from .base import CULPRIT, SHIFT, Check, Row, box, yes

CELL = 1e-3


def finite_state(path):
    """True if a checkpoint has finite numbers only."""
    with h5py.File(path, "r") as file:
        return bool(np.isfinite(file["/particles/state"][:]).all())


def reported(done, folder, stem, status=driver.BROKEN):
    """Checks of a run that broke down."""
    # A restart from a file of its own puts the checkpoints that it did not go on from into previous_1.
    good = min((folder / f"{stem}.out").rglob(f"{stem}_checkpoint.h5"), key=lambda path: len(path.parts))
    return [yes(f"ends with status {status}", done.status == status), yes("names a particle", CULPRIT.search(done.err)),
            yes("one message, no crash", done.err.count("particle ") == 1 and "Backtrace" not in done.err),
            yes("finite checkpoint", finite_state(good))]


class BlowUp(Row):
    """Runs that must fail."""

    name = "blow_up"
    text = "too long a step, overflow, a block that leaves: status 3, a particle named, a finite checkpoint, 500 steps at most"
    input = "free_block"
    variants = {
        "step 1.6 times the limit": {"TIME.DT": 1.2e-6},
        "step of ten cells": {"TIME.DT": 1e-5},
        "leaves the grid": {"BODY.VELOCITY": "300,20,0", "TIME.END": 1e-3},
        "huge noise": {"FIELD.AMPLITUDE": 1e5},
        "stiffness 1e15": {"MATERIAL.YOUNGS_MODULUS": 1e15, "TIME.DT": 1e-6},
    }

    def cases(self, quick):
        names = ("step 1.6 times the limit", "stiffness 1e15") if quick else self.variants
        return {name: {"sets": self.variants[name]} for name in names}

    def measure(self, place, ranks, sets):
        sets = box(CELL, (-4, -4, -4), (8, 8, 8), SHIFT) | {"OUTPUT.CHECKPOINT_INTERVAL": 1e-6} | sets
        done, results = self.run(place, ranks, sets, "--quiet", expect=None)
        return reported(done, place, self.input) + [
            Check("steps until it is caught", results.history()["step"][-1], at_most=500)]


class Poison(Row):
    """A NaN in one particle of a checkpoint."""

    name = "poison"
    text = "one particle of a checkpoint is NaN: the restart is refused, the field named"
    input = "free_block"

    def cases(self, quick):
        fields = ("v",) if quick else ("v", "x", "jac", "tau", "b", "temp")
        return {field: {"field": field} for field in fields}

    def measure(self, place, ranks, field):
        sets = box(CELL, (-4, -4, -4), (8, 8, 8), SHIFT) | {"TIME.MAX_STEPS": 100, "OUTPUT.CHECKPOINT_INTERVAL": 1e-5, "TIME.END": 1e-3}
        _, results = self.run(place, ranks, sets, "--quiet")
        bad = place / "bad.h5"
        shutil.copy(results.path("_checkpoint.h5"), bad)
        first, count = driver.FIELDS[field]
        with h5py.File(bad, "r") as file:
            old = file["/particles/state"][:].reshape(-1, int(file.attrs["fields"]), driver.LANES)
        new = old[:, first : first + count].copy()
        new[0, 0, 5] = np.nan
        driver.rewrite_checkpoint(bad, **{field: lambda x: new if count > 1 else new[:, 0]})
        done, _ = self.run(place, ranks, sets | {"TIME.MAX_STEPS": 400}, "--quiet", "--restart", bad, expect=None)
        return reported(done, place, self.input, driver.BAD_INPUT)


ROWS = (BlowUp(), Poison())
