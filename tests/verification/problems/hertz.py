# SPDX-License-Identifier: MIT
"""Elastic bodies with curved faces on a rigid plane."""

import math

import exact
import numpy as np

from .base import Problem, values

MODULUS = exact.plane_strain_modulus(1e9, 0.3)


class HertzLine(Problem):
    """Cylinder on a plane."""

    name = "hertz_line"
    section = "1.10"
    cells = "over the radius of the cylinder"
    norm = "largest of: half width off by, in cells over 10 (h/2: 5 %), mean axial stress on the axis off by, over p0"
    passes = 0.05
    resolutions = (40, 80)
    fine = (160,)
    quick = ()
    share = 2.0  # of the force that the modelled part carries
    parameters = {"press": 0.018, "time": 0.02}

    def sets(self, n, p):
        h = 1.0 / n
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-1, 0, -2 * h),
            "GRID.UPPER": values(1 + 2 * h, h, 2 + 2 * h),
            "SHAPE(1).CENTRE": values(0, 0.5 * h, 1),
            "SHAPE(1).LENGTH": h,
        } | self.press(h, p)

    def press(self, h, p):
        return {
            "CLAMP.LOWER": values(-2, -2, 1.0 - 1.01 * h),
            "CLAMP.VELOCITY": values(0, 0, -p["press"] / p["time"]),
            "TIME.END": p["time"],
            "OUTPUT.CHECKPOINT_INTERVAL": p["time"],
        }

    def load(self, run, h):
        force = -run.history()["plane_force_z[N]"][-5:].mean()
        return self.share * force / h

    def hertz(self, load):
        return exact.hertz_line(load, 1.0, MODULUS)

    def below(self, depth):
        """Normal stress on the axis over p0, at a depth over a."""
        return 1.0 / np.sqrt(1.0 + depth**2)

    def measure(self, run, n, p):
        state, h = run.checkpoint(), 1.0 / n
        load = self.load(run, h)
        a, p0 = self.hertz(load)[:2]
        r = self.distance(state)
        got = self.width(state, r, h, 2.0 * a)
        depth = state.x[:, 2]
        axis = (r < 0.25 * a) & (depth < a)
        wanted = -p0 * self.below(depth[axis] / a)
        error = (state.tau[axis, 2] / state.jac[axis] - wanted) / p0
        first = depth[axis] < 0.5 * h
        figures = {"a/h exact": a / h, "a/h": got / h, "first layer off p0 by": float(error[first].mean()),
                   "others": float(error[~first].mean()), "a/R": a}
        return max(0.1 * abs(got - a) / h, abs(figures["others"])), figures

    spread = 0.25  # mean square distance from the axis of the pressure, over a^2

    def width(self, state, r, h, far):
        """Half width of the contact from how the pressure in the outermost particles is spread."""
        surface = (state.x[:, 2] < 0.45 * h) & (r < far)
        load = np.maximum(0.0, -state.tau[surface, 2]) * state.mass[surface]
        return math.sqrt(float(np.sum(load * r[surface] ** 2) / np.sum(load)) / self.spread)

    def distance(self, state):
        return state.x[:, 0]


class HertzSphere(HertzLine):
    """Sphere on a plane."""

    name = "hertz_sphere"
    cells = "over the radius of the sphere"
    resolutions = (16, 24)
    fine = (32,)
    share = 4.0
    spread = 0.4
    parameters = {"press": 0.04, "time": 0.02}

    def sets(self, n, p):
        h = 1.0 / n
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-1, -1, -2 * h),
            "GRID.UPPER": values(1 + 2 * h, 1 + 2 * h, 2 + 2 * h),
        } | self.press(h, p)

    def load(self, run, h):
        return super().load(run, 1.0)

    def hertz(self, load):
        return exact.hertz_sphere(load, 1.0, MODULUS)

    def below(self, depth):
        return 1.0 / (1.0 + depth**2)

    def distance(self, state):
        return np.hypot(state.x[:, 0], state.x[:, 1])


PROBLEMS = (HertzLine(), HertzSphere())
