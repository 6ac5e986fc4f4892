# SPDX-License-Identifier: MIT
"""Limits of the time step: the bracket of the frozen lattice, free ends at the default step, refused steps."""

import random

import driver
import modes
import numpy as np

from .base import CULPRIT, SHIFT, Check, Row, box, values, yes

SPEED, CELL, STEPS = 1000.0, 1e-3, 3000

# Sets and half length of a domain [cells] for two particles a cell; keywords of the theory.
METHODS = {
    "uGIMP": ({}, 0.25, {}),
    "uGIMP MUSL": ({"SCHEME": "musl"}, 0.25, {"scheme": "musl"}),
    "uGIMP USAVG": ({"SCHEME": "usavg"}, 0.25, {"scheme": "usavg"}),
    "uGIMP FMPM2": ({"TRANSFER": "fmpm", "ORDER": 2}, 0.25, {"transfer": "fmpm", "order": 2}),
    "uGIMP FMPM4": ({"TRANSFER": "fmpm", "ORDER": 4}, 0.25, {"transfer": "fmpm", "order": 4}),
    "uGIMP XPIC2": ({"TRANSFER": "xpic", "ORDER": 2}, 0.25, {"transfer": "xpic", "order": 2}),
    "uGIMP APIC": ({"TRANSFER": "apic"}, 0.25, {"transfer": "apic"}),
    "cpGIMP": ({"SHAPE": "cpgimp"}, 0.25, {}),
    "B-spline": ({"SHAPE": "bspline"}, 0.5, {}),
    "B-spline APIC": ({"SHAPE": "bspline", "TRANSFER": "apic"}, 0.5, {"transfer": "apic"}),
    "B-spline FMPM2": ({"SHAPE": "bspline", "TRANSFER": "fmpm", "ORDER": 2}, 0.5, {"transfer": "fmpm", "order": 2}),
    "B-spline FMPM4": ({"SHAPE": "bspline", "TRANSFER": "fmpm", "ORDER": 4}, 0.5, {"transfer": "fmpm", "order": 4}),
}


def method_sets(name):
    return {f"METHOD.{key}": value for key, value in METHODS[name][0].items()}


def lattice_sets(offset):
    """The periodic lattice whose first particle is at `offset` spacings, in a moved grid."""
    begin = 0.5 * ((offset - 0.5) % 1.0) * CELL
    return {
        "SHAPE(1).LOWER": values(begin, 0, 0),
        "SHAPE(2).UPPER": values(max(begin, 0.5 * CELL), CELL, CELL),
    }


class Bracket(Row):
    """The step map of the frozen lattice in numpy says where the limit is."""

    name = "cfl"
    text = "periodic lattice, noise of 1e-6 c, 3000 steps at 0.97 and 1.03 of the limit: bounded and growing"
    input = "lattice"

    def cases(self, quick):
        draw = random.Random(1)
        result = {}
        for name in METHODS:
            offsets = [0.5] + ([] if quick else [round(draw.random(), 3) for _ in range(4)])
            for seed, offset in enumerate(offsets, 1):
                result[f"{name} offset {offset}"] = {"method": name, "offset": offset, "seed": seed}
        return result

    def measure(self, place, ranks, method, offset, seed):
        _, half, theory = METHODS[method]
        limit = modes.limit(modes.lattice(16, 2, offset), half, n=16, **theory)
        grown = [self.growth(place / part, ranks, float(part) * limit, method, offset, seed) for part in ("0.97", "1.03")]
        return [Check("kinetic at 0.97", grown[0], at_most=10.0), Check("kinetic at 1.03", grown[1], at_least=1e4)]

    def growth(self, place, ranks, dt, method, offset, seed):
        """Largest over first kinetic energy; infinite if the run broke down."""
        place.mkdir()
        dt *= CELL / SPEED
        sets = method_sets(method) | lattice_sets(offset)
        sets |= {"TIME.DT": dt, "TIME.END": (STEPS + 0.5) * dt, "FIELD.SEED": seed}
        done, results = self.run(place, ranks, sets, "--quiet", expect=None)
        if done.status == driver.BROKEN and CULPRIT.search(done.err):
            return float("inf")
        assert done.status == driver.WELL, done.err
        kinetic = results.history()["kinetic[J]"]
        return kinetic.max() / kinetic[0]


class FreeBar(Row):
    """Free ends lower the limit; the default step must be below it at any offset."""

    name = "free_bar"
    text = "free bar of 8 cells with noise of 1e-6 c anywhere on the grid, default step, 3000 steps: bounded"
    input = "free_bar"

    def cases(self, quick):
        draw = random.Random(2)
        names = ("uGIMP", "B-spline", "uGIMP FMPM2", "uGIMP FMPM4", "B-spline FMPM4", "uGIMP MUSL", "uGIMP USAVG")
        return {
            f"{name} offset {offset}": {"method": name, "offset": offset, "seed": seed}
            for name in names
            for seed, offset in enumerate([round(draw.random(), 4) for _ in range(1 if quick else 21)], 1)
        }

    def measure(self, place, ranks, method, offset, seed):
        sets = method_sets(method) | box(CELL, (-6, 0, 0), (14, 1, 1))
        sets |= {"SHAPE.LOWER": values(offset * CELL, 0, 0), "SHAPE.UPPER": values((8 + offset) * CELL, CELL, CELL)}
        sets |= {"FIELD.SEED": seed, "TIME.MAX_STEPS": STEPS, "TIME.END": STEPS * 0.8 * CELL / SPEED}
        _, results = self.run(place, ranks, sets, "--quiet")
        kinetic = results.history()["kinetic[J]"]
        return [Check("kinetic", kinetic.max() / kinetic[0], at_most=2.0)]


class FreeBlock(Row):
    """The same in three dimensions."""

    name = "free_block"
    text = "free elastic cube of 4 cells (nu 0.33) with noise of 1e-6 c, default step: bounded"
    input = "free_block"

    def cases(self, quick):
        draw = random.Random(3)
        names = ("uGIMP",) if quick else ("uGIMP", "B-spline", "uGIMP FMPM2", "B-spline FMPM4")
        result = {}
        for name in names:
            for seed in range(1, 2 if quick else 6):
                offset = SHIFT if seed == 1 else tuple(round(draw.random(), 3) for _ in range(3))
                result[f"{name} offset {offset}"] = {"method": name, "offset": offset, "seed": seed, "steps": 600 if quick else STEPS}
        return result

    def measure(self, place, ranks, method, offset, seed, steps):
        sets = method_sets(method) | box(CELL, (-4, -4, -4), (8, 8, 8), [-o for o in offset])
        sets |= {"FIELD.SEED": seed, "TIME.MAX_STEPS": steps, "TIME.END": steps * 0.8 * CELL / SPEED}
        _, results = self.run(place, ranks, sets, "--quiet")
        kinetic = results.history()["kinetic[J]"]
        return [Check("kinetic", kinetic.max() / kinetic[0], at_most=2.0)]


class Refused(Row):
    """A step that would move a node by more than half a cell is taken shorter, and the program says so."""

    name = "refused"
    text = "a cube at 300 m/s with a fixed step of 1.5 cells: shortened, said, and the flight is exact"
    input = "free_block"

    def cases(self, quick):
        return {"flight": {}}

    def measure(self, place, ranks):
        end = 1e-5
        sets = box(CELL, (-4, -4, -4), (8, 8, 8), SHIFT) | {
            "BODY.VELOCITY": values(300, 0, 0), "FIELD.AMPLITUDE": 0, "TIME.DT": 1.5 * CELL / 300.0,
            "TIME.END": end, "OUTPUT.CHECKPOINT_INTERVAL": end}
        done, results = self.run(place, ranks, sets)
        history, state = results.history(), results.checkpoint()
        longest = np.diff(history["time[s]"]).max() if len(history.rows) > 1 else end
        x = state.mass @ state.x / state.mass.sum()
        return [
            yes("said so", "would have moved a node by more than half a cell" in done.out),
            Check("steps", state.step, at_least=end * 300.0 / (0.5 * CELL)),
            Check("longest way/h", longest / (history["step"][1:] - history["step"][:-1]).min() * 300.0 / CELL,
                  at_most=0.5 + 1e-9),
            Check("error of the flight/h", abs(x[0] - 2.0 * CELL - 300.0 * end) / CELL, at_most=1e-9),
        ]


ROWS = (Bracket(), FreeBar(), FreeBlock(), Refused())
