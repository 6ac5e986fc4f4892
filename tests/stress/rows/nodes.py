# SPDX-License-Identifier: MIT
"""Nodes with hardly any mass at free surfaces."""

import modes
import numpy as np

from .base import SHIFT, Check, Row, box, finite, values

CELL, SPEED = 1e-3, 1000.0
PROTRUDING = [10.0**-k for k in range(3, 10)]  # [cells]
DEFAULT = {"ugimp": 0.9 * 0.473, "bspline": 0.9 * 0.632}


def windowed(energy, n):
    """Means of n successive values."""
    return np.convolve(energy, np.ones(n) / n, mode="valid")


def energy_checks(results, fastest):
    """No particle faster than 3 v0, and no gain of energy: means over an eighth of the run, since the energy
    of a leapfrog swings within a period."""
    history = results.history()
    energy = windowed(history["kinetic[J]"] + history["elastic[J]"], len(history.rows) // 8)
    state = results.checkpoint()
    speed = np.linalg.norm(state.v - state.momentum() / state.mass.sum(), axis=1).max()
    peak = np.sqrt(history["kinetic[J]"].max() / history["kinetic[J]"][0])
    return [finite(history), Check("speed/v0", max(speed / fastest, peak), at_most=3.0),
            Check("energy gain", energy.max() / energy[0] - 1.0, at_most=1e-3)]


class Slid(Row):
    """A breathing free bar anywhere on the grid."""

    name = "small_mass"
    text = "free bar, breathing, slid by 401 offsets, and by 1e-3 to 1e-9 h over a node: no |v| > 3 v0, energy + < 0.1 %"
    input = "breathing_bar"

    def cases(self, quick):
        some = np.linspace(0.0, 1.0, 4 if quick else 401)[:-1]
        shapes = ("ugimp",) if quick else ("ugimp", "bspline", "cpgimp")
        result = {}
        for shape in shapes:
            few = some if shape == "ugimp" else some[::10]
            for offset in [*few, *PROTRUDING[:: 3 if quick else 1]]:
                result[f"{shape} offset {offset:.4g}"] = {"shape": shape, "offset": float(offset)}
        return result

    def measure(self, place, ranks, shape, offset):
        sets = {"METHOD.SHAPE": shape, "SHAPE.LOWER": values(offset * CELL, 0, 0),
                "SHAPE.UPPER": values((8 + offset) * CELL, CELL, CELL),
                "BODY.CENTRE": values((4 + offset) * CELL, 0, 0)}
        _, results = self.run(place, ranks, sets, "--quiet")
        return energy_checks(results, 3.75)


class Growth(Row):
    """The same offsets in theory: the step map of the free bar at the default step."""

    name = "free_ends"
    text = "spectral radius of the step of a free bar of 8 cells, 401 offsets, at the program's default step"
    input = "free_bar"
    alone = True
    methods = {
        "uGIMP": (0.25, {}, {}),
        "B-spline": (0.5, {"METHOD.SHAPE": "bspline"}, {}),
        "uGIMP FMPM2": (0.25, {"METHOD.TRANSFER": "fmpm"}, {"transfer": "fmpm", "order": 2}),
        "uGIMP FMPM4": (0.25, {"METHOD.TRANSFER": "fmpm", "METHOD.ORDER": 4}, {"transfer": "fmpm", "order": 4}),
        "B-spline FMPM4": (0.5, {"METHOD.TRANSFER": "fmpm", "METHOD.ORDER": 4, "METHOD.SHAPE": "bspline"},
                           {"transfer": "fmpm", "order": 4}),
        "uGIMP XPIC2": (0.25, {"METHOD.TRANSFER": "xpic"}, {"transfer": "xpic", "order": 2}),
        "uGIMP APIC": (0.25, {"METHOD.TRANSFER": "apic"}, {"transfer": "apic"}),
        "B-spline APIC": (0.5, {"METHOD.TRANSFER": "apic", "METHOD.SHAPE": "bspline"}, {"transfer": "apic"}),
        "uGIMP MUSL": (0.25, {"METHOD.SCHEME": "musl"}, {"scheme": "musl"}),
        "uGIMP USAVG": (0.25, {"METHOD.SCHEME": "usavg"}, {"scheme": "usavg"}),
    }

    def cases(self, quick):
        return {name: {"method": name, "offsets": 21 if quick else 401} for name in self.methods}

    def measure(self, place, ranks, method, offsets):
        half, sets, theory = self.methods[method]
        _, results = self.run(place, ranks, sets | {"TIME.MAX_STEPS": 2}, "--quiet")
        dt = results.history()["dt[s]"][-1] * SPEED / CELL
        bar = (np.arange(16) + 0.5) / 2.0
        worst = max(modes.growth(bar + offset, half, dt, **theory) for offset in np.linspace(0.0, 1.0, offsets))
        return [Check("spectral radius - 1", worst - 1.0, at_most=1e-6)]


class Pip(Row):
    """One particle alone on the top of a cube."""

    name = "protruding"
    text = "free cube with one particle on top, moved by 1e-3 to 1e-9 h over the nodes: no |v| > 3 v0, energy + < 0.1 %"
    input = "pip"

    def cases(self, quick):
        offsets = [1e-3, 1e-9] if quick else [0.0, *PROTRUDING]
        return {f"{shape} {offset:.0e} h": {"shape": shape, "offset": offset}
                for shape in (("ugimp",) if quick else ("ugimp", "bspline", "cpgimp")) for offset in offsets}

    def measure(self, place, ranks, shape, offset):
        sets = {"METHOD.SHAPE": shape} | box(CELL, (-3, -3, -3), (7, 7, 8), [-offset] * 3)
        _, results = self.run(place, ranks, sets, "--quiet")
        return energy_checks(results, 1.5 * np.sqrt(3.0))


class Sliding(Row):
    """The cube slides through the grid: all offsets in one run."""

    name = "sliding"
    text = "the same cube flying over 3 cells askew: no |v| > 3 v0, energy + < 0.1 %"
    input = "pip"

    def cases(self, quick):
        shapes = ("ugimp",) if quick else ("ugimp", "bspline", "cpgimp")
        return {shape: {"shape": shape} for shape in shapes}

    def measure(self, place, ranks, shape):
        v = np.array([30.0, 20.0, 10.0])
        sets = {"METHOD.SHAPE": shape, "BODY.VELOCITY": values(*v)} | box(CELL, (-3, -3, -3), (10, 9, 9), SHIFT)
        _, results = self.run(place, ranks, sets, "--quiet")
        history = results.history()
        state = results.checkpoint()
        inner = history["kinetic[J]"] + history["elastic[J]"] - 0.5 * state.mass.sum() * (v @ v)
        mean = windowed(inner, len(inner) // 8)
        speed = np.linalg.norm(state.v - v, axis=1).max() / (1.5 * np.sqrt(3.0))
        return [finite(history), Check("speed/v0", speed, at_most=3.0),
                Check("inner energy gain", mean.max() / mean[0] - 1.0, at_most=1e-3)]


ROWS = (Slid(), Growth(), Pip(), Sliding())
