# SPDX-License-Identifier: MIT
"""Flat punches on plastic and elastic blocks."""

import math

import exact
import numpy as np

from .base import Problem, values

SHEAR, RAMP = 1e6, 0.02  # [Pa], [s]


def plateau(history, area, speed, ramp):
    """Depth [m], mean pressure over the shear strength, of the rows after the ramp."""
    time = history["time[s]"]
    depth = speed * (time - 0.5 * ramp)
    pressure = np.abs(history["punch_force_z[N]"]) / area / SHEAR
    return depth[time > ramp], pressure[time > ramp]


class PlanePunch(Problem):
    """Prandtl's punch, to a fiftieth of its half width: what rises beside it carries 5 % more at a fifteenth. The block is
    so stiff that it flows everywhere at a hundredth."""

    name = "punch_plane"
    section = "1.17"
    cells = "over the half width"
    norm = "mean pressure from 1.4 to 2 % of the half width deep, off by, over (2 + pi) k"
    passes = 0.05
    resolutions = (4, 8)
    fine = (16,)
    quick = (4,)
    quick_passes = 0.2
    pressure = exact.prandtl(1.0)
    parameters = {"friction": 0.0, "speed": 0.5, "depth": 0.02, "width": 6.0, "deep": 4.0}

    def area(self, n):
        return 1.0 / n

    def sets(self, n, p):
        h, end = 1.0 / n, p["depth"] / p["speed"]
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-2 * h, 0, -2 * h),
            "GRID.UPPER": values(p["width"] + 2 * h, h, p["deep"] + 4 * h),
            "SHAPE.UPPER": values(p["width"], h, p["deep"]),
            "TOOL.POSITION": values(0, 0, p["deep"] + 0.5),
            "TOOL.FRICTION": p["friction"],
            "MOTION.VELOCITY": values(0, 0, -p["speed"]),
            "WALL(2).POSITION": p["width"],
            "TIME.END": end,
            "OUTPUT.CHECKPOINT_INTERVAL": end,
            "OUTPUT.HISTORY_INTERVAL": end / 200.0,
        }

    def measure(self, run, n, p):
        depth, pressure = plateau(run.history(), self.area(n), p["speed"], RAMP)
        early = pressure[(depth > 0.4 * p["depth"]) & (depth < 0.6 * p["depth"])].mean()
        late = pressure[depth > 0.7 * p["depth"]]
        figures = {"pressure/k": float(late.mean()), "exact": self.pressure, "at half depth": float(early),
                   "ripple": float(late.std() / late.mean())}
        return abs(late.mean() / self.pressure - 1.0), figures


class CirclePunch(PlanePunch):
    """The same with a round punch."""

    name = "punch_circle"
    norm = "mean pressure from 1.4 to 2 % of the radius deep, off by, over 5.224 k"
    pressure = exact.circular_punch(1.0)
    resolutions = (4, 8)
    fine = (10,)
    quick = ()
    parameters = {"friction": 0.0, "speed": 0.5, "depth": 0.02, "width": 4.0, "deep": 3.0}

    def area(self, n):
        return 0.25 * math.pi

    def sets(self, n, p):
        h = 1.0 / n
        result = super().sets(n, p)
        w = p["width"]
        return result | {
            "GRID.LOWER": values(-2 * h, -2 * h, -2 * h),
            "GRID.UPPER": values(w + 2 * h, w + 2 * h, p["deep"] + 4 * h),
            "SHAPE.UPPER": values(w, w, p["deep"]),
            "TOOL.POSITION": values(0, 0, p["deep"]),
            "WALL(4).POSITION": w,
        }


class ElasticPunch(Problem):
    """Round punch on elastic blocks of two sizes."""

    name = "punch_elastic"
    section = "1.10"
    cells = "over the radius"
    norm = "stiffness of an infinite block, by its compliance extrapolated, off by, over 2 a E*"
    passes = 0.03  # rows of particles and the edge fall together as they may: no order can be asked
    resolutions = (2, 4)
    fine = (6,)
    parameters = {"poisson": 0.3, "small": 3.0, "large": 6.0, "depth": 0.02, "speed": 0.1}

    def runs(self, n, p):
        return [self.block(n, p, p["small"]), self.block(n, p, p["large"])]

    def block(self, n, p, w):
        h, end = 1.0 / n, p["depth"] / p["speed"] + 0.025
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-2 * h, -2 * h, -2 * h),
            "GRID.UPPER": values(w + 2 * h, w + 2 * h, w + 4 * h),
            "SHAPE.UPPER": values(w, w, w),
            "TOOL.POSITION": values(0, 0, w),
            "WALL(2).POSITION": w,
            "WALL(4).POSITION": w,
            "MATERIAL.POISSON_RATIO": p["poisson"],
            "MOTION.VELOCITY": values(0, 0, -p["speed"]),
            "TIME.END": end,
            "OUTPUT.CHECKPOINT_INTERVAL": end,
        }

    def measure(self, run, n, p):
        wanted = exact.elastic_punch(exact.plane_strain_modulus(1e9, p["poisson"]), 1.0, 1.0)
        stiffness = []
        for one in run:
            history = one.history()
            depth = p["speed"] * (history["time[s]"] - 0.025)
            force = 4.0 * np.abs(history["punch_force_z[N]"])
            late = depth > 0.3 * p["depth"]
            stiffness.append(float(np.polyfit(depth[late], force[late], 1)[0]) / wanted)
        # what walls and base at the distance w add to the depth under a force goes as 1/w (and 1/w^3, which the same
        # extrapolation of exact answers has as well)
        a, b = 1.0 / p["small"], 1.0 / p["large"]
        known = [exact.elastic_punch_on_block(p["poisson"], p[size]) for size in ("small", "large")]
        endless = (a / known[1] - b / known[0]) / (a / stiffness[1] - b / stiffness[0])
        figures = {"endless": endless, "small": stiffness[0], "large": stiffness[1]}
        return abs(endless - 1.0), figures


PROBLEMS = (PlanePunch(), CirclePunch(), ElasticPunch())
