# SPDX-License-Identifier: MIT
"""Rigid-body motion under friction: Nairn's block, blocks, cylinders and spheres on slopes."""

import math

import exact
import numpy as np

from .base import Problem, values

SIZE = (0.040, 0.015, 0.005)  # of Nairn's block [m]
MASS = 1000.0 * math.prod(SIZE)  # [kg]
RAMP = 1e-4  # [s]


class FrictionBlock(Problem):
    """Speed of a block pushed over a plane."""

    name = "friction_block"
    section = "1.9"
    cells = "over its height"
    norm = "speed after 5 ms, off by, over the exact speed, at least a quarter of that without friction"
    passes = 0.01
    resolutions = (1, 2)
    fine = (4,)
    quick = (1,)
    parameters = {"friction": 0.5, "push": 35.294, "press": 35.294, "time": 5e-3}

    @staticmethod
    def speeds(p):
        """Exact speed at the end, and that without friction [m/s]."""
        pushed = exact.block_acceleration(p["push"], p["press"], p["friction"], MASS), p["push"] / MASS
        return [exact.ramped_speed(each, RAMP, p["time"]) for each in pushed]

    def common(self, n, p):
        h = SIZE[2] / n
        length = max(0.14 if n < 4 else 0.12, SIZE[0] + self.speeds(p)[0] * p["time"] + 2 * h)   # of a way at its last speed
        return {
            "GRID.CELL": h,
            "GRID.UPPER": values(length, 0.025, 0.015),
            "TOOL.FRICTION": p["friction"],
            "TIME.END": p["time"], "OUTPUT.CHECKPOINT_INTERVAL": p["time"],
        }

    def sets(self, n, p):
        return self.common(n, p) | {"LOAD.FORCE": values(p["push"], 0, -p["press"])}

    def measure(self, run, n, p):
        history, state = run.history(), run.checkpoint()
        v = state.momentum() / MASS
        wanted, free = self.speeds(p)
        inertia = MASS / 12.0 * (SIZE[0] ** 2 + SIZE[2] ** 2)
        figures = {"speed": v[0], "exact": wanted,
                   "press": -history["plane_force_z[N]"][-20:].mean() / p["press"],
                   "turned [rad]": abs(state.angular_momentum()[1]) / inertia * p["time"]}
        return abs(v[0] - wanted) / max(wanted, 0.25 * free), figures


class FrictionPush(FrictionBlock):
    """The same with the published tractions on two faces."""

    name = "friction_push"
    cells = "over its height (even: the side load starts on a layer of particles)"
    resolutions = (2,)
    fine = (4,)
    quick = ()

    def sets(self, n, p):
        return self.common(n, p) | {
            "TRACTION(1).VECTOR": values(0, 0, -p["press"] / (SIZE[0] * SIZE[1])),
            "TRACTION(2).VECTOR": values(p["push"] / (SIZE[1] * 0.5 * SIZE[2]), 0, 0),
        }


class Incline(Problem):
    """Acceleration of a body on a slope."""

    section = "1.9"
    norm = "mean acceleration after the first fifth of the time, off by, over g sin(angle)"
    passes = 0.02
    radius = 1.6
    parameters = {"angle": 30.0, "friction": 0.495, "gravity": 10.0, "young": 1e7, "time": 1.5}

    def __init__(self, kind, resolutions, fine, quick=()):
        self.kind = kind
        self.name = f"incline_{kind}"
        self.cells = "over the height" if kind == "block" else "over the radius"
        self.resolutions, self.fine, self.quick = resolutions, fine, quick

    def sets(self, n, p):
        h, r, angle = self.radius / n, self.radius, math.radians(p["angle"])
        way = 0.5 * p["gravity"] * math.sin(angle) * p["time"] ** 2
        tall = (1.0 if self.kind == "block" else 2.0) * r
        across = math.ceil(1.2 * n) * h if self.kind == "sphere" else 0.0
        result = {
            "GRID.CELL": h,
            "GRID.LOWER": values(-4 * h, -across, -4 * h),
            "GRID.UPPER": values(2 * r + way + 6 * h, across or h, tall + 4 * h),
            "TIME.END": p["time"],
            "TIME.GRAVITY": values(p["gravity"] * math.sin(angle), 0, -p["gravity"] * math.cos(angle)),
            "MATERIAL.YOUNGS_MODULUS": p["young"],
            "TOOL.FRICTION": p["friction"],
            "OUTPUT.HISTORY_INTERVAL": p["time"] / 200.0,
            "OUTPUT.CHECKPOINT_INTERVAL": p["time"],
        }
        if self.kind == "block":
            result["SHAPE.UPPER"] = values(2 * r, h, r)
        elif self.kind == "cylinder":
            result |= {"SHAPE.CENTRE": values(r, 0.5 * h, r), "SHAPE.LENGTH": h}
        return result

    def measure(self, run, n, p):
        state = run.checkpoint()
        angle = math.radians(p["angle"])
        drive = p["gravity"] * math.sin(angle)
        wanted, sticks = exact.incline(self.kind, p["gravity"], angle, p["friction"])
        history = run.history()
        time = history["time[s]"]
        pull = history["plane_force_x[N]"][time > 0.2 * p["time"]].mean()  # by the body on the plane
        got = drive - pull / state.mass.sum()
        speed = state.momentum()[0] / state.mass.sum()
        centre = state.mass @ state.x / state.mass.sum()
        arm = state.x - centre
        inertia = np.sum(state.mass * (arm[:, 0] ** 2 + arm[:, 2] ** 2))
        spin = state.angular_momentum()[1] / inertia
        figures = {"acceleration": got, "exact": wanted, "sticks": sticks,
                   "from the last speed": speed / p["time"],
                   "spin radius/speed": spin * self.radius / speed if speed > 0.0 else 0.0}
        return abs(got - wanted) / drive, figures


PROBLEMS = (
    FrictionBlock(),
    FrictionPush(),
    Incline("block", (4, 8), (16,), (4,)),
    Incline("cylinder", (16, 32), (64,), (20,)),
    Incline("sphere", (4, 8), (16,)),
)
