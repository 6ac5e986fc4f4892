# SPDX-License-Identifier: MIT
"""Noise in the null space of the mapping to nodes, and noise of particles that cross cells."""

import math

import driver
import numpy as np

from .base import SHIFT, Check, Row, values

FILTERS = {
    "flip": {},
    "pic": {"METHOD.PIC_FRACTION": 1},
    "xpic": {"METHOD.TRANSFER": "xpic"},
    "fmpm 2": {"METHOD.TRANSFER": "fmpm"},
    "fmpm 4": {"METHOD.TRANSFER": "fmpm", "METHOD.ORDER": 4},
    "fmpm 2 every 10": {"METHOD.TRANSFER": "fmpm", "METHOD.EVERY": 10},
    "apic": {"METHOD.TRANSFER": "apic"},
}


class NullSpace(Row):
    """Velocities +-v at quarter points, which are antisymmetric about every node and therefore invisible on the grid."""

    name = "null_space"
    text = "alternating velocities: FLIP keeps them for ever, PIC, XPIC and FMPM remove them in a step"
    input = "lattice"

    def cases(self, quick):
        names = ("flip", "pic", "xpic", "fmpm 2", "fmpm 4")
        return {name: {"method": name} for name in (names[::3] if quick else names)}

    def measure(self, place, ranks, method):
        steps = 1000 if method == "flip" else 1
        sets = FILTERS[method] | {"FIELD.KIND": "alternating", "TIME.MAX_STEPS": steps, "TIME.END": steps * 4e-7}
        _, results = self.run(place, ranks, sets, "--quiet")
        kinetic = results.history()["kinetic[J]"]
        left = math.sqrt(kinetic[-1] / kinetic[0])
        if method == "flip":
            return [Check("left - 1", abs(left - 1.0), at_most=1e-9)]
        return [Check("left", left, at_most=1e-12)]


class Ringing(Row):
    """The same on a wave."""

    name = "ringing"
    text = "standing wave with and without 1 % alternating noise, 10 periods: it does not grow (FLIP), < 0.1 % (filters)"
    input = "ringing"

    def cases(self, quick):
        names = ("flip", "fmpm 2") if quick else FILTERS
        return {f"{shape} {name}": {"shape": shape, "method": name}
                for shape in (("ugimp",) if quick else ("ugimp", "bspline")) for name in names}

    def measure(self, place, ranks, shape, method):
        sets = FILTERS[method] | {"METHOD.SHAPE": shape}
        left = []
        for amplitude in (1e-2, 0.0):
            _, results = self.run(place, ranks, sets | {"FIELD(2).AMPLITUDE": amplitude}, "--quiet")
            v = results.checkpoint().v[:, 0]
            left.append(np.mean(v * (-1.0) ** np.arange(len(v))) / 1e-2)
        return [Check("noise", abs(left[0] - left[1]), at_most=1.0 + 1e-6 if method == "flip" else 1e-3)]


class Crossing(Row):
    """A uniformly squeezed bar must stay uniform while it crosses 20 cells."""

    name = "crossing"
    text = "prestress -0.05 E at 0.1 c over 20 cells of a periodic bar: rms of the stress over its mean, 2 x table"
    input = "crossing"
    # 37 particles on 16 cells: RMS of the table of verification problems.
    table = {"cpgimp": 1e-10, "bspline": 2 * 1.0e-1}

    def cases(self, quick):
        result = {f"{shape} 37 on 16": {"shape": shape, "count": 37} for shape in self.table}
        offsets = [0.13] if quick else [0.0, 0.13, 0.29, 0.41]
        result |= {f"{shape} 32 on 16, offset {offset}": {"shape": shape, "count": 32, "offset": offset}
                   for shape in ("ugimp", "cpgimp") for offset in offsets}
        return result

    def measure(self, place, ranks, shape, count, offset=0.0):
        sets = {"METHOD.SHAPE": shape}
        options = ["--quiet"]
        if count == 37:
            sets |= {"BODY.PARTICLES_PER_CELL": "3,1,1", "SHAPE(1).UPPER": values(37e-3 / 3, 1e-3, 1e-3),
                     "SHAPE(2).UPPER": values(37e-3 / 3, 1e-3, 1e-3)}
            options += ["--restart", self.spread(place, sets)]
        elif offset:
            sets |= {"SHAPE(1).LOWER": values(offset * 0.5e-3, 0, 0), "SHAPE(2).UPPER": values(0.5e-3, 1e-3, 1e-3)}
        _, results = self.run(place, ranks, sets, *options)
        state = results.checkpoint()
        assert len(state.number) == count
        stress = state.tau[:, 0]
        return [Check("rms", float(stress.std() / abs(0.05e9)), at_most=self.table.get(shape, 1e-10))]

    def spread(self, place, sets):
        """A checkpoint at the start whose 37 particles fill 16 cells evenly, their domains too, each in the image
        that it has after a sort (node 16 is node 0)."""
        first = {"TIME.MAX_STEPS": 1, "TIME.DT": 1e-18}
        _, results = self.run(place, 1, sets | first, "--quiet")
        path = results.path("_checkpoint.h5")
        spread = 16.0 / (37.0 / 3.0)

        def places(x):
            along = x[:, 0] * spread
            return np.stack([along - 16e-3 * (along >= 15.5e-3), x[:, 1], x[:, 2]], axis=1)

        fields = {"x": places}
        if sets["METHOD.SHAPE"] == "cpgimp":
            fields["half"] = lambda x: np.full((len(x), x.shape[2]), 8.0 / 37.0)
        driver.rewrite_checkpoint(path, **fields)
        return path.rename(place / "spread.h5")


ROWS = (NullSpace(), Ringing(), Crossing())
