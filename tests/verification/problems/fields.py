# SPDX-License-Identifier: MIT
"""Manufactured motions and modes that the program itself compares with: NAME_errors.csv."""

import math

import exact
import numpy as np

from .base import Problem, driver, values


class Field(Problem):
    """What problems with a &FIELD share."""


    def errors(self, run):
        return driver.Table(run.path("_errors.csv"))

    def measure(self, run, n, p):
        table = self.errors(run)
        scale = p["amplitude"]
        stress = table["body_exact_stress_rms[Pa]"].max()
        figures = {"at the end": table["body_displacement_rms[m]"][-1] / scale,
                   "worst particle": table["body_displacement_max[m]"].max() / scale,
                   "stress": table["body_stress_rms[Pa]"].max() / stress if stress > 0.0 else 0.0}
        return float(table["body_displacement_rms[m]"].max() / scale), figures


class Waves2(Field):
    """Axis-aligned manufactured waves in a periodic square."""

    name = "waves2d"
    section = "1.1"
    cells = "along the side"
    norm = "greatest rms error of the displacement in one period, over A"
    passes = 1.5e-3
    least_order = 1.8
    resolutions = (16, 32, 64)
    fine = (128,)
    quick = (32,)
    quick_passes = 1e-2
    is_cube = False
    parameters = {"amplitude": 0.05}

    def sets(self, n, p):
        h = 1.0 / n
        upper = values(1.0, 1.0, 1.0 if self.is_cube else h)
        return {"GRID.CELL": h, "GRID.UPPER": upper, "SHAPE.UPPER": upper, "FIELD.AMPLITUDE": p["amplitude"]}


class Waves3(Waves2):
    """The same in a cube."""

    name = "waves3d"
    resolutions = (8, 16)
    fine = (32,)
    passes = 2.5e-2
    quick = (8,)
    quick_passes = 0.15
    is_cube = True


class Vortex(Field):
    """Generalised vortex, to and fro. Two particles per cell and direction are too few here: the material
    beside the sheared annulus becomes unstable (--with ppc=2)."""

    name = "vortex"
    section = "1.2"
    cells = "in 4 m (annulus: n/8)"
    norm = "rms error of the displacement at t = 1, over A (1 m)"
    passes = 0.02
    resolutions = (64, 96)
    fine = (128, 192)
    quick = (64,)
    quick_passes = 0.05
    parameters = {"amplitude": 0.3, "ppc": 3}

    def sets(self, n, p):
        h = 4.0 / n
        side = math.ceil(1.5 / h) * h
        return {
            "GRID.CELL": h,
            "GRID.UPPER": values(2, 2, h),
            "BODY.PARTICLES_PER_CELL": f"{p['ppc']},{p['ppc']},1",
            "SHAPE.LOWER": values(-side, -side, 0),
            "SHAPE.UPPER": values(side, side, h),
            "FIELD.AMPLITUDE": p["amplitude"],
        }

    def measure(self, run, n, p):
        table, state = self.errors(run), run.checkpoint()
        rms = table["body_displacement_rms[m]"] / p["amplitude"]
        radius = np.hypot(state.x[:, 0], state.x[:, 1])
        still = (radius > 1.25 + 8.0 / n) | (radius < 0.75 - 8.0 / n)
        figures = {"greatest": float(rms.max()), "worst particle": table["body_displacement_max[m]"].max() / p["amplitude"],
                   "det F - 1, rms": float(np.sqrt(np.mean((state.jac - 1.0) ** 2))),
                   "stray speed": float(np.abs(state.v[still]).max())}
        return float(rms[-1]), figures


class Ring(Field):
    """Expanding ring with free faces across the grid."""

    name = "ring"
    section = "1.3"
    cells = "over the outer radius"
    norm = "greatest rms error of the displacement in one period, over A"
    passes = 0.02
    least_order = 1.0
    resolutions = (16, 32)
    fine = (64,)
    quick = (16,)
    quick_passes = 0.05
    parameters = {"amplitude": 0.1}

    def sets(self, n, p):
        h = 0.6 / n
        side = math.ceil(0.75 / h) * h
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-side, -side, 0),
            "GRID.UPPER": values(side, side, h),
            "SHAPE.CENTRE": values(0, 0, 0.5 * h),
            "SHAPE(1).LENGTH": h,
            "FIELD.AMPLITUDE": p["amplitude"],
        }


class BarMode(Field):
    """Ten periods of a vibrating bar."""

    name = "bar_mode"
    section = "1.4"
    cells = "along the bar"
    norm = "larger of phase error and loss of amplitude in ten periods"
    passes = 0.01
    resolutions = (13, 25, 50)
    fine = (100,)
    quick = (25,)
    parameters = {"length": 25.0, "periods": 10.0}

    def sets(self, n, p):
        h = p["length"] / n
        period = 4.0 * p["length"] / 10.0
        return {
            "GRID.CELL": h,
            "GRID.UPPER": values(p["length"] + 4 * h, h, h),
            "SHAPE.UPPER": values(p["length"], h, h),
            "FIELD.WAVELENGTH": values(4 * p["length"], 1, 1),
            "TIME.END": p["periods"] * period,
            "OUTPUT.HISTORY_INTERVAL": period / 200.0,
            "OUTPUT.CHECKPOINT_INTERVAL": p["periods"] * period,
        }

    def measure(self, run, n, p):
        history = run.history()
        time, kinetic = history["time[s]"], history["kinetic[J]"]
        omega = exact.bar_frequency(p["length"], 100.0, 1.0)
        last = time > time[-1] - 4.0 * math.pi / omega  # fit c0 + c1 cos 2wt + c2 sin 2wt to two periods
        basis = np.stack([np.ones(last.sum()), np.cos(2 * omega * time[last]), np.sin(2 * omega * time[last])], 1)
        fit = np.linalg.lstsq(basis, kinetic[last], rcond=None)[0]
        phase = abs(math.atan2(fit[2], fit[1])) / (2.0 * omega * time[-1])
        loss = 1.0 - math.sqrt(2.0 * math.hypot(fit[1], fit[2]) / kinetic.max())
        total = kinetic + history["elastic[J]"]
        figures = {"phase": phase, "amplitude lost": loss, "energy": float(total[-1] / total[0])}
        return max(phase, abs(loss)), figures


PROBLEMS = (Waves2(), Waves3(), Vortex(), Ring(), BarMode())
