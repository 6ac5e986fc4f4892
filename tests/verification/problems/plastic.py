# SPDX-License-Identifier: MIT
"""Large plastic flow: an adiabatic element, the Taylor bar, punches."""

import math

import exact
import numpy as np

from .base import Problem, values


class JohnsonCookElement(Problem):
    """Temperature and strength of particles squeezed adiabatically."""

    name = "jc_element"
    section = "1.12"
    cells = "along the cube"
    norm = "largest error of the temperature rise of a particle, or of their mean strength, over the exact one"
    passes = 0.001
    resolutions = (2, 4)
    fine = (8,)
    quick = (2,)
    quick_passes = 0.02
    parameters = {"m": 1.0, "squeeze": 0.6}
    law = dict(a=324e6, b=114e6, n=0.42, c=0.0, rate_ratio=1.0, t_room=300.0, t_melt=925.0, density=2700.0,
               heat=896.0, share=0.9)

    def sets(self, n, p):
        h, end = 1.0 / n, p["squeeze"] / 3.0
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-2 * h, -2 * h, -2 * h),
            "GRID.UPPER": values(2 + 2 * h, 2 + 2 * h, 1 + 2 * h),
            "MATERIAL.JC_M": p["m"],
            "TIME.END": end,
            "OUTPUT.CHECKPOINT_INTERVAL": end,
        }

    def measure(self, run, n, p):
        state = run.checkpoint()
        grid = np.linspace(0.0, state.plastic.max() * 1.001, 60)  # closed answers, then interpolation
        known = np.array([exact.johnson_cook_adiabatic(e, m=p["m"], steps=2000, **self.law) for e in grid])
        temp, flow = (np.interp(state.plastic, grid, known[:, k]) for k in (0, 1))
        strength = float(np.mean(state.flow) / np.mean(flow))
        local = float(np.abs((state.temp - temp) / (temp - 300.0)).max())
        figures = {"strength": strength, "mean strain": float(state.plastic.mean()), "scatter": float(state.plastic.std()),
                   "uniaxial": -math.log(1.0 - p["squeeze"])}
        return max(local, abs(strength - 1.0)), figures


class Taylor(Problem):
    """Taylor bar in physics.md's copper: length, foot radius, heating."""

    name = "taylor"
    section = "1.11"
    cells = "over the radius"
    norm = "largest of: length outside 17.2-17.6 mm, foot outside 6.5-7.1 mm, heating outside 40-42.1 K"
    passes = 0.04
    resolutions = (6, 9)
    fine = (12,)
    radius, length = 3.81e-3, 25.4e-3

    def sets(self, n, p):
        h = self.radius / n
        side = math.ceil(1.1 * n) * h
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-side, -side, -2 * h),
            "GRID.UPPER": values(math.ceil(2.6 * n) * h, math.ceil(2.6 * n) * h, self.length + 4 * h),
        }

    def measure(self, run, n, p):
        state = run.checkpoint()
        h = self.radius / n
        r = np.hypot(state.x[:, 0], state.x[:, 1])
        length = state.x[:, 2].max() + 0.25 * h
        # the foot: the outermost particles of the lowest layer, in eight sectors
        angle = np.arctan2(state.x[:, 1], state.x[:, 0])
        low = state.x[:, 2] < 1.0 * h
        edge = [r[low & (angle >= a) & (angle < a + math.pi / 16)].max() for a in np.arange(8) * math.pi / 16]
        foot = float(np.mean(edge)) + 0.25 * h
        heating = float(state.mass @ state.temp / state.mass.sum()) - 298.0
        history = run.history()
        bound = 0.5 * 190.0**2 * 0.9 / 386.0  # all kinetic energy becomes plastic work

        def outside(value, low, high):
            return max(0.0, (low - value) / low, (value - high) / high)

        figures = {"length [mm]": length * 1e3, "foot [mm]": foot * 1e3, "outermost": float(r[low].max() * 1e3),
                   "heating [K]": heating, "strain": float(state.plastic.max()),
                   "kinetic left": float(history["kinetic[J]"][-1] / history["kinetic[J]"][0]),
                   "loss": float(history["numerical_loss[J]"][-1] / history["kinetic[J]"][0])}
        return max(outside(length, 17.2e-3, 17.6e-3), outside(foot, 6.5e-3, 7.1e-3),
                   outside(heating, 40.0, bound)), figures


PROBLEMS = (JohnsonCookElement(), Taylor())
