# SPDX-License-Identifier: MIT
"""Contact: it begins at the true gap, slides only above mu N, and never pulls."""

import numpy as np

from .base import SHIFT, Check, Row, box, finite, values

LOAD, MASS, FRICTION, END, RAMP = 35.294, 3e-3, 0.5, 5e-3, 1e-4  # of friction.nml and blocks.nml
LOWER = {"plane": (-2, -1, -1), "slab": (-4, -2, -3)}  # of their grids [cells of 5 mm]


class EarlyTool(Row):
    """A block flies at a plane that stands anywhere between two grid planes."""

    name = "early_tool"
    text = "block at 10 m/s to a plane: true gap at the first impulse within 0.1 h"
    input = "punch"

    def cases(self, quick):
        offsets = (0.41,) if quick else (0.0, *SHIFT, 0.5, 0.77)
        shapes = ("ugimp",) if quick else ("ugimp", "bspline", "cpgimp")
        return {f"{shape} offset {offset}": {"shape": shape, "offset": offset}
                for shape in shapes for offset in offsets}

    def measure(self, place, ranks, shape, offset):
        h, face = 2e-3, 2e-3 * (0.5 + offset)
        sets = {"METHOD.SHAPE": shape, "TOOL.POSITION": values(4e-3, 4e-3, face)}
        _, results = self.run(place, ranks, sets | {"TIME.END": (4e-3 - face) / 10.0 + 1e-5}, "--quiet")
        history = results.history()
        first = np.flatnonzero(history["punch_force_z[N]"])[0]
        gap = (4e-3 - face - 10.0 * history["time[s]"][first - 1 : first + 1]) / h
        return [Check("gap/h", np.abs(gap).max(), at_most=0.1)]


class EarlyBody(Row):
    """The same to another deformable body."""

    name = "early_body"
    text = "block at 10 m/s to a block: true gap when the first elastic energy appears within 0.1 h"
    input = "pair"

    def cases(self, quick):
        offsets = (0.41,) if quick else (0.0, *SHIFT, 0.5, 0.77)
        shapes = ("ugimp",) if quick else ("ugimp", "bspline", "cpgimp")
        return {f"{shape} offset {offset}": {"shape": shape, "offset": offset}
                for shape in shapes for offset in offsets}

    def measure(self, place, ranks, shape, offset):
        sets = {"METHOD.SHAPE": shape} | box(1e-3, (-3, -3, -3), (7, 7, 13), [-offset] * 3)
        _, results = self.run(place, ranks, sets | {"TIME.END": 2.2e-4}, "--quiet")
        history = results.history()
        elastic = history["elastic[J]"]
        first = np.flatnonzero(elastic > 1e-9 * history["kinetic[J]"][0])[0]
        gap = (2e-3 - 10.0 * history["time[s]"][first - 1 : first + 1]) / 1e-3
        return [Check("gap/h", np.abs(gap).max(), at_most=0.1)]


class Stick(Row):
    """Motion if and only if the push is above mu N."""

    name = "stick"
    text = "pressed block pushed with 0.99 and 1.01 mu N (plane, slab of particles): rests, and slides"
    stems = {"plane": "friction", "slab": "blocks"}

    def cases(self, quick):
        kinds = ("plane",) if quick else self.stems
        shapes = ("ugimp",) if quick else ("ugimp", "bspline")
        return {f"{kind} {shape} {push}": {"kind": kind, "shape": shape, "push": push}
                for kind in kinds for shape in shapes for push in (0.99, 1.01)}

    def measure(self, place, ranks, kind, shape, push):
        sets = {"METHOD.SHAPE": shape, "LOAD.FORCE": values(push * FRICTION * LOAD, 0, -LOAD)}
        sets |= box(5e-3, LOWER[kind], (28, 6, 6), [-o for o in SHIFT])
        _, results = self.run(place, ranks, sets, "--quiet", stem=self.stems[kind])
        state = results.checkpoint()
        block = state.body == 1
        speed = state.mass[block] @ state.v[block, 0] / state.mass[block].sum()
        slide = 0.01 * FRICTION * LOAD / MASS * (END - 0.5 * RAMP)  # of 1.01 mu N
        if push < 1.0:
            return [Check("speed/that at 1.01", abs(speed) / slide, at_most=0.05)]
        return [Check("speed/exact", speed / slide, at_least=0.5)]


class PullOff(Row):
    """A load that pulls the block away meets no resistance."""

    name = "pull_off"
    text = "block that touches, pulled away: the contact never pulls, v = F t/m to 0.2 %"
    stems = {"plane": "friction", "slab": "blocks"}

    def cases(self, quick):
        kinds = ("plane",) if quick else self.stems
        shapes = ("ugimp",) if quick else ("ugimp", "bspline", "cpgimp")
        return {f"{kind} {shape}": {"kind": kind, "shape": shape} for kind in kinds for shape in shapes}

    def measure(self, place, ranks, kind, shape):
        sets = {"METHOD.SHAPE": shape, "LOAD.FORCE": values(0, 0, LOAD), "TIME.END": 5e-4,
                "OUTPUT.CHECKPOINT_INTERVAL": 5e-4}
        sets |= box(5e-3, LOWER[kind], (28, 6, 6), [-o for o in SHIFT])
        _, results = self.run(place, ranks, sets, "--quiet", stem=self.stems[kind])
        history, state = results.history(), results.checkpoint()
        block = state.body == 1
        speed = state.mass[block] @ state.v[block, 2] / state.mass[block].sum()
        exact = LOAD / MASS * (5e-4 - 0.5 * RAMP)
        checks = [finite(history), Check("speed off by", abs(speed / exact - 1.0), at_most=2e-3)]
        if kind == "plane":
            checks.append(Check("tension/N", max(0.0, history["plane_force_z[N]"].max() / LOAD), at_most=0.0))
        return checks


class Pressed(Row):
    """Two bodies that stay in contact."""

    name = "pressed"
    text = "block pressed on a block, 1e5 steps: finite, stopped by friction, no energy gained (0.1 %), still in touch"
    input = "pressed_pair"
    long = True

    def cases(self, quick):
        shapes = ("ugimp", "bspline", "cpgimp")
        return {shape: {"shape": shape, "steps": 2000 if quick else 100000} for shape in shapes}

    def measure(self, place, ranks, shape, steps):
        end = steps * 4e-7
        sets = {"METHOD.SHAPE": shape, "TIME.MAX_STEPS": steps, "TIME.END": end, "OUTPUT.CHECKPOINT_INTERVAL": 0.5 * end}
        sets |= box(1e-3, (-2, -2, 0), (10, 6, 8), (-SHIFT[0], -SHIFT[1], -SHIFT[2]))
        _, results = self.run(place, ranks, sets, "--quiet", timeout=36000)
        history, state = results.history(), results.checkpoint()
        upper = state.body == 2
        inner = history["kinetic[J]"] + history["elastic[J]"] - history["body_work[J]"] + history["friction_heat[J]"]
        gap = (state.x[upper, 2].min() - state.x[~upper, 2].max() - 0.5e-3) / 1e-3
        return [finite(history), Check("energy gain", inner.max() / inner[0] - 1.0, at_most=1e-3),
                Check("last/first kinetic", history["kinetic[J]"][-1] / history["kinetic[J]"][0], at_most=1e-2),
                Check("gap/h", abs(gap), at_most=0.1)]


ROWS = (EarlyTool(), EarlyBody(), Stick(), PullOff(), Pressed())
