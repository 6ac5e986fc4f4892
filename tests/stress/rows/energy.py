# SPDX-License-Identifier: MIT
"""Energy of waves, of an impact, and of a rotation over long times."""

import math

import modes
import numpy as np

from .base import SHIFT, Check, Row, finite, values

CELL, SPEED, PERIOD = 1e-3, 1000.0, 16e-6  # of ringing.nml


class Drift(Row):
    """A standing wave over many periods against the step map in numpy."""

    name = "drift"
    text = "standing wave, 100 periods: MUSL, USAVG lose < 0.5 %, USL as in theory +-10 %, nothing gains 0.1 %"
    input = "ringing"
    methods = {
        "MUSL": ({"METHOD.SCHEME": "musl"}, {"scheme": "musl"}),
        "USAVG": ({"METHOD.SCHEME": "usavg"}, {"scheme": "usavg"}),
        "USL": ({}, {}),
        "FMPM2": ({"METHOD.TRANSFER": "fmpm"}, {"transfer": "fmpm", "order": 2}),
        "FMPM4": ({"METHOD.TRANSFER": "fmpm", "METHOD.ORDER": 4}, {"transfer": "fmpm", "order": 4}),
    }

    def cases(self, quick):
        shapes = ("ugimp",) if quick else ("ugimp", "bspline")
        names = ("MUSL", "USL") if quick else self.methods
        return {f"{shape} {name}": {"shape": shape, "name": name, "periods": 20 if quick else 100}
                for shape in shapes for name in names}

    def measure(self, place, ranks, shape, name, periods):
        sets, theory = self.methods[name]
        dt = 0.2 * CELL / SPEED
        amplitude = 1e-6  # less drowns in the rounding of the elastic energy
        sets = sets | {"METHOD.SHAPE": shape, "FIELD(1).AMPLITUDE": amplitude, "FIELD(2).AMPLITUDE": 0, "TIME.DT": dt,
                       "TIME.END": periods * PERIOD, "OUTPUT.HISTORY_INTERVAL": 2.0 * dt}
        _, results = self.run(place, ranks, sets, "--quiet")
        history = results.history()
        energy = history["kinetic[J]"] + history["elastic[J]"]
        n = round(PERIOD / (2.0 * dt))
        window = np.convolve(np.ones(n), np.ones(n)) / n**2  # two periods: the swing within one cancels
        mean = np.convolve(energy, window, mode="valid")
        checks = [Check("energy gain", mean.max() / mean[0] - 1.0, at_most=1e-3)]
        if name in ("MUSL", "USAVG"):
            return checks + [Check("energy lost", 1.0 - mean[-1] / mean[0], at_most=5e-3)]
        last = np.flatnonzero(mean > 0.05 * mean[0])[-1]
        wanted = self.decay(0.25 if shape == "ugimp" else 0.5, dt * SPEED / CELL, theory)
        rate = -math.log(mean[last] / mean[0]) / (history["step"][last] - history["step"][0])
        return checks + [Check("rate of loss/theory", rate / wanted, at_least=0.9, at_most=1.1)]

    def decay(self, half, dt, theory):
        """-ln of the energy that one step keeps, of the longest wave."""
        values_of_map = np.linalg.eigvals(modes.step_map(modes.lattice(16, 2), half, dt, n=16, **theory))
        near = np.abs(np.angle(values_of_map) - 2.0 * math.pi / 16.0 * dt)
        near[np.abs(values_of_map) < 0.5] = math.inf
        return -2.0 * math.log(abs(values_of_map[near.argmin()]))


class Discs(Row):
    """Two discs collide and part."""

    name = "discs"
    text = "Sulsky's discs: never more energy than at the start + 0.1 %, momentum kept"
    input = "discs"

    def cases(self, quick):
        methods = {"USL": {}, "MUSL": {"METHOD.SCHEME": "musl"}, "USAVG": {"METHOD.SCHEME": "usavg"},
                   "USAVG without F-bar": {"METHOD.SCHEME": "usavg", "METHOD.FBAR": "F"},
                   "FMPM2": {"METHOD.TRANSFER": "fmpm"}, "B-spline": {"METHOD.SHAPE": "bspline"}}
        return {name: {"sets": sets} for name, sets in methods.items() if name == "USL" or not quick}

    def measure(self, place, ranks, sets):
        sets = {"METHOD.SCHEME": "usl", "METHOD.FBAR": "T"} | sets
        sets = sets | {"GRID.LOWER": values(-0.13 * 0.05, -0.29 * 0.05, 0), "GRID.UPPER": values(1.05 - 0.13 * 0.05, 1.05 - 0.29 * 0.05, 0.05)}
        _, results = self.run(place, ranks, sets, "--quiet")
        history, state = results.history(), results.checkpoint()
        energy = history["kinetic[J]"] + history["elastic[J]"]
        one = state.mass[state.body == 1].sum() * 0.1
        return [finite(history), Check("energy gain", energy.max() / energy[0] - 1.0, at_most=1e-3),
                Check("momentum", np.abs(state.momentum()[:2]).max() / one, at_most=1e-10)]


class Rotation(Row):
    """A small free cube turns ten times (APIC, which keeps rotations)."""

    name = "rotation"
    text = "free cube, 10 turns: von Mises stress stays below 3 rho w2 a2, mean J within 1e-4 of exact, det(Bbar) = 1"
    input = "spin"

    def cases(self, quick):
        turns = 1 if quick else 10
        return {f"{shape} {turns} turns": {"shape": shape, "turns": turns}
                for shape in (("ugimp",) if quick else ("ugimp", "bspline", "cpgimp"))}

    def measure(self, place, ranks, shape, turns):
        a, rate2 = 4e-3, 900.0**2
        end = turns * 2.0 * math.pi / 900.0
        shift = [2e-3 * (o - 6.0) for o in SHIFT]
        sets = {"METHOD.SHAPE": shape, "TIME.END": end, "OUTPUT.CHECKPOINT_INTERVAL": end, "SHAPE.LOWER": values(-a, -a, -a),
                "SHAPE.UPPER": values(a, a, a), "GRID.LOWER": values(*shift), "GRID.UPPER": values(*(s + 24e-3 for s in shift))}
        _, results = self.run(place, ranks, sets, "--quiet")
        history, state = results.history(), results.checkpoint()
        t = state.tau
        mises = np.sqrt(0.5 * ((t[:, 0] - t[:, 1])**2 + (t[:, 1] - t[:, 2])**2 + (t[:, 2] - t[:, 0])**2)
                        + 3.0 * (t[:, 3]**2 + t[:, 4]**2 + t[:, 5]**2)).max()
        b = state.b
        full = np.array([[b[:, 0], b[:, 3], b[:, 5]], [b[:, 3], b[:, 1], b[:, 4]], [b[:, 5], b[:, 4], b[:, 2]]])
        swollen = 0.4 / (3.0 * 1e8) * 1e3 * rate2 * (2.0 * a)**2 / 6.0
        return [finite(history), Check("von Mises/(rho w2 a2)", mises / (1e3 * rate2 * a * a), at_most=3.0),
                Check("mean J off by", abs(state.jac.mean() - 1.0 - swollen), at_most=1e-4),
                Check("det(Bbar) - 1", np.abs(np.linalg.det(full.T) - 1.0).max(), at_most=1e-10)]


ROWS = (Drift(), Discs(), Rotation())
