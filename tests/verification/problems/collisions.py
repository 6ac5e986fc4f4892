# SPDX-License-Identifier: MIT
"""Elastic bodies that collide and part."""

import math

import exact
import numpy as np

from .base import Problem, crossing, values

OFFSETS = ((0.0, 0.0), (0.13, 0.29), (0.41, 0.07), (0.5, 0.5), (0.77, 0.23), (0.9, 0.63))  # of the grid [cells]


class Discs(Problem):
    """Sulsky's discs at a quarter of the wave speed, at six offsets of the grid."""

    name = "discs"
    section = "1.7"
    cells = "over the radius"
    norm = "worst of six grids: touch too early or late over 0.1 h, energy lost over 2 %, gained over 0.1 %"
    passes = 1.0
    resolutions = (4, 8)
    fine = (16,)
    parameters = {}

    def runs(self, n, p):
        return [self.sets(n, p) | self.grid(n, offset) for offset in OFFSETS]

    def sets(self, n, p):
        h = 0.2 / n
        return {
            "GRID.CELL": h,
            "SHAPE.LENGTH": h,
            "OUTPUT.HISTORY_INTERVAL": 0.02 * h / 0.2828,  # a way of 0.02 h
            "SHAPE(1).CENTRE": values(0.25, 0.25, 0.5 * h),
            "SHAPE(2).CENTRE": values(0.75, 0.75, 0.5 * h),
        }

    def grid(self, n, offset):
        h = 0.2 / n
        lower = [-0.1 - o * h for o in offset]
        return {"GRID.LOWER": values(*lower, 0), "GRID.UPPER": values(*(low + 1.2 + h for low in lower), h)}

    def reach(self, h):
        """Radius of the lattice of particles along the way."""
        x, y = np.meshgrid(*2 * [(np.arange(-40, 40) + 0.5) * 0.5 * h])
        return float(((x + y) / math.sqrt(2.0))[np.hypot(x, y) < 0.2].max() + 0.25 * h)

    def measure(self, runs, n, p):
        h, closing = 0.2 / n, 2.0 * math.hypot(0.1, 0.1)
        wanted = exact.discs_touch(math.hypot(0.5, 0.5), self.reach(h), 0.5 * closing)
        lost, gained, late, momentum = [], [], [], []
        for run in runs:
            history, state = run.history(), run.checkpoint()
            total = history["kinetic[J]"] + history["elastic[J]"]
            start = crossing(history["time[s]"], history["kinetic[J]"] / history["kinetic[J]"][0], 0.9999)
            late.append((start - wanted) * closing / h)
            lost.append(1.0 - total[-1] / total[0])
            gained.append(total.max() / total[0] - 1.0)
            momentum.append(np.abs(state.momentum()).max() / (0.1 * state.mass[state.body == state.body.min()].sum()))
        figures = {"energy lost": float(max(lost)), "gained": float(max(gained)),
                   "touch/h": float(max(late, key=abs)), "momentum": float(max(momentum))}
        worst = max(max(np.abs(late)) / 0.1, max(lost) / 0.02, max(gained) / 1e-3, max(momentum) / 1e-12)
        return float(worst), figures


class DiscsAnyhow(Problem):
    """The same discs at a random offset, angle and place of the grid, on straight or round lattices."""

    name = "discs_anyhow"
    input = "discs"
    section = "1.7"
    cells = "over the radius"
    norm = "largest of: energy lost without becoming heat, over 2 %; gained, over 0.2 %; angular momentum off, over 0.3 %, with friction 2 %"
    passes = 1.0
    resolutions = (8,)
    fine = (16,)
    parameters = {"seed": 0, "friction": 0.0}
    speed = 0.1414  # of each

    def draw(self, seed):
        """Offset [radii], angle, place of the grid [cells], lattice."""
        draw = np.random.default_rng(seed)
        return draw.uniform(0.1, 0.9), draw.uniform(0, 2 * np.pi), draw.uniform(0, 1, 2), ("body", "round")[seed % 2]

    def sets(self, n, p):
        offset, angle, grid, lattice = self.draw(p["seed"])
        along, h = np.array([np.cos(angle), np.sin(angle)]), 0.2 / n
        aside = np.array([-along[1], along[0]])
        sets = {"GRID.CELL": h, "SHAPE.LENGTH": h, "TIME.END": 2.2, "BODY.LATTICE": lattice,
                "GRID.LOWER": values(*(-0.1 - grid * h), 0), "GRID.UPPER": values(*(1.1 + h - grid * h), h)}
        if p["friction"]:
            sets |= {"CONTACT.LAW": "coulomb", "CONTACT.FRICTION": p["friction"]}
        for k, side in ((1, -1), (2, 1)):
            sets |= {f"SHAPE({k}).CENTRE": values(*(0.5 + side * (0.3 * along - 0.2 * offset * aside)), 0.5 * h),
                     f"BODY({k}).VELOCITY": values(*(-side * self.speed * along), 0)}
        return sets

    def measure(self, run, n, p):
        history, state = run.history(), run.checkpoint()
        energy = (history["kinetic[J]"] + history["elastic[J]"]) / history["kinetic[J]"][0]
        heat = history["friction_heat[J]"][-1] / history["kinetic[J]"][0]
        figures = {"lost": float(1.0 - energy[-1] - heat), "gained": float(energy.max() - 1.0),
                   "spin": float(-state.angular_momentum()[2] / (state.mass.sum() * self.speed * 0.2 * self.draw(p["seed"])[0])),
                   "heat": float(heat)}
        return max(figures["lost"] / 0.02, figures["gained"] / 2e-3,
                   abs(figures["spin"] - 1.0) / (0.02 if p["friction"] else 0.003)), figures


class NairnDiscs(Problem):
    """Discs at 1 % of the wave speed."""

    name = "discs_nairn"
    section = "1.7"
    cells = "over the radius"
    norm = "energy lost or gained over that before"
    passes = 0.02
    resolutions = (10, 20)
    fine = (40,)
    quick = (10,)
    parameters = {"speed": 4.9695}

    def sets(self, n, p):
        h = 10e-3 / n
        side = math.ceil(12e-3 / h) * h
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-23e-3, -side, 0),
            "GRID.UPPER": values(23e-3, side, h),
            "SHAPE.LENGTH": h,
            "SHAPE(1).CENTRE": values(-10.5e-3, 0, 0.5 * h),
            "SHAPE(2).CENTRE": values(10.5e-3, 0, 0.5 * h),
            "BODY(1).VELOCITY": values(p["speed"], 0, 0),
            "BODY(2).VELOCITY": values(-p["speed"], 0, 0),
        }

    def measure(self, run, n, p):
        history, state = run.history(), run.checkpoint()
        total = history["kinetic[J]"] + history["elastic[J]"]
        one = state.body == state.body.min()
        figures = {"gained": float(total.max() / total[0] - 1.0),
                   "contact": float(history["contact_loss[J]"][-1] / total[0]),
                   "rebound": float(-(state.mass[one] @ state.v[one, 0]) / state.mass[one].sum() / p["speed"]),
                   "momentum": float(np.abs(state.momentum()).max() / (p["speed"] * state.mass[one].sum()))}
        return float(max(1.0 - total[-1] / total[0], figures["gained"])), figures


class HertzImpact(Problem):
    """Two equal spheres: each as if it met a rigid plane."""

    name = "hertz_impact"
    section = "1.10"
    cells = "over the radius"
    norm = "largest of: deepest approach, time between half the kinetic energy, off by, and energy lost"
    passes = 0.05
    resolutions = (12, 16)
    fine = (24,)
    parameters = {"speed": 5.0}

    def sets(self, n, p):
        h = 1.0 / n
        end = 0.004 * 5.0 / p["speed"] + 0.016 * (5.0 / p["speed"]) ** 0.2
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-1 - h, -1 - h, -math.ceil(2.2 * n) * h),
            "GRID.UPPER": values(1 + 3 * h, 1 + 3 * h, math.ceil(2.2 * n) * h),
            "BODY(upper).VELOCITY": values(0, 0, -p["speed"]),
            "BODY(lower).VELOCITY": values(0, 0, p["speed"]),
            "TIME.END": end,
            "OUTPUT.CHECKPOINT_INTERVAL": end,
        }

    def measure(self, run, n, p):
        history, probes = run.history(), run.probes()
        modulus = exact.plane_strain_modulus(1e9, 0.3)
        time, _ = exact.hertz_impact(4.0 / 3.0 * math.pi * 1e3, 1.0, modulus, p["speed"])
        deepest = time * p["speed"] / 2.94326593
        # half the kinetic energy is left where (d/deepest)^(5/2) = 1/2
        x = np.linspace(0.0, 1.0, 200001)[:-1] ** 0.5
        whole = (1.0 - x**2.5) ** -0.5
        steps = 0.5 * (whole[1:] + whole[:-1]) * np.diff(x)
        wanted = float(steps[x[1:] > 0.5**0.4].sum() / steps.sum()) * time
        kinetic = history["kinetic[J]"] / history["kinetic[J]"][0]
        middle = int(np.argmin(kinetic))
        first = crossing(history["time[s]"], kinetic, 0.5)
        last = crossing(history["time[s]"][middle:], kinetic[middle:], 0.5)
        near = 0.5 * (probes["upper_z[m]"] - probes["lower_z[m]"])
        total = history["kinetic[J]"] + history["elastic[J]"]
        figures = {"approach": float((1.0 - near.min()) / deepest), "time": (last - first) / wanted,
                   "energy lost": float(1.0 - total[-1] / total[0]), "a/h": math.sqrt(deepest) * n}
        return max(abs(figures["approach"] - 1.0), abs(figures["time"] - 1.0), abs(figures["energy lost"])), figures


PROBLEMS = (Discs(), DiscsAnyhow(), NairnDiscs(), HertzImpact())
