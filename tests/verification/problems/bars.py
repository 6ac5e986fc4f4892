# SPDX-License-Identifier: MIT
"""One-dimensional elastic problems: impact, vibration, a column under its own weight."""

import math

import exact
import numpy as np

from .base import Problem, crossing, values


class BarImpact(Problem):
    """Force plateau, contact time and restitution of a bar on a rigid plane."""

    name = "bar_impact"
    section = "1.4"
    cells = "along the bar"
    norm = "largest of: mean plateau off by 1, contact time off by 1, 1 - restitution"
    passes = 0.03
    resolutions = (25, 50)
    fine = (100, 200)
    quick = (100,)
    parameters = {"length": 0.05, "speed": 1.0, "young": 1e9, "density": 1000.0}

    def sets(self, n, p):
        h = p["length"] / n
        time = 2.0 * p["length"] / exact.bar_speed(p["young"], p["density"])
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-2 * h, -2 * h, -4 * h),
            "GRID.UPPER": values(4 * h, 4 * h, p["length"] + 10 * h),
            "SHAPE.UPPER": values(2 * h, 2 * h, p["length"]),
            "BODY.VELOCITY": values(0, 0, -p["speed"]),
            "MATERIAL.YOUNGS_MODULUS": p["young"],
            "MATERIAL.DENSITY": p["density"],
            "TIME.END": 1.4 * time,
            "OUTPUT.HISTORY_INTERVAL": time / 250.0,
            "OUTPUT.CHECKPOINT_INTERVAL": 1.4 * time,
        }

    def measure(self, run, n, p):
        history, state = run.history(), run.checkpoint()
        h = p["length"] / n
        wanted = exact.bar_impact_force(p["young"], p["density"], 4.0 * h * h, p["speed"])
        duration = 2.0 * p["length"] / exact.bar_speed(p["young"], p["density"])
        time, force = history["time[s]"], -history["wall_force_z[N]"] / wanted
        plateau = force[(time > 0.2 * duration) & (time < 0.9 * duration)]
        middle = np.concatenate([[0.0], 0.5 * (time[1:] + time[:-1])])  # a row is the mean since the last
        late = middle > 0.5 * duration
        contact = crossing(middle[late], force[late], 0.5) / duration
        restitution = state.momentum()[2] / (state.mass.sum() * p["speed"])
        figures = {"plateau": plateau.mean(), "ripple": np.abs(plateau - 1.0).max(), "contact": contact,
                   "restitution": restitution}
        return max(abs(plateau.mean() - 1.0), abs(contact - 1.0), 1.0 - restitution), figures


class BarGravity(Problem):
    """Ten periods of a bar under sudden gravity."""

    name = "bar_gravity"
    section = "1.4"
    cells = "along the bar"
    norm = "rms error of the tip's displacement over ten periods, over its peak"
    passes = 0.02
    least_order = 0.8
    resolutions = (12, 25, 50)
    fine = (100,)
    quick = (25,)
    parameters = {"length": 0.05, "gravity": 4e3, "young": 1e9, "density": 1000.0, "wall": "fixed"}

    def sets(self, n, p):
        h = p["length"] / n
        period = 4.0 * p["length"] / exact.bar_speed(p["young"], p["density"])
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(0, -2 * h, -2 * h),
            "GRID.UPPER": values(p["length"] + 4 * h, 4 * h, 4 * h),
            "SHAPE.UPPER": values(p["length"], 2 * h, 2 * h),
            "PROBE.POSITION": values(p["length"], h, h),
            "TIME.GRAVITY": values(p["gravity"], 0, 0),
            "MATERIAL.YOUNGS_MODULUS": p["young"],
            "MATERIAL.DENSITY": p["density"],
            "WALL.KIND": f"'{p['wall']}'",
            "TIME.END": 10.0 * period,
            "OUTPUT.HISTORY_INTERVAL": period / 200.0,
            "OUTPUT.CHECKPOINT_INTERVAL": 10.0 * period,
        }

    def measure(self, run, n, p):
        probes = run.probes()
        time, tip = probes["time[s]"], probes["tip_x[m]"] - p["length"]
        peak = p["density"] * p["gravity"] * p["length"] ** 2 / p["young"]
        wanted = exact.bar_under_gravity(p["length"], time, p["length"], p["young"], p["density"], p["gravity"])
        swing = tip - 0.5 * peak
        k = np.flatnonzero(swing[1:] * swing[:-1] < 0.0)
        zero = time[k] - swing[k] * (time[k + 1] - time[k]) / (swing[k + 1] - swing[k])
        period = 4.0 * p["length"] / exact.bar_speed(p["young"], p["density"])
        last = tip[time > 9.0 * period]
        figures = {"period": 2.0 * (zero[-1] - zero[0]) / (len(zero) - 1) / period,
                   "last swing": (last.max() - last.min()) / peak}
        return math.sqrt(np.mean((tip - wanted) ** 2)) / peak, figures


class Column(Problem):
    """Stress in a column under its own weight."""

    name = "column"
    section = "1.5"
    cells = "along the column"
    norm = "rms error of the axial Cauchy stress at the particles, over that at the base"
    passes = 0.02
    least_order = 1.0
    resolutions = (16, 32, 64)
    fine = (128,)
    quick = (16,)
    quick_passes = 0.03
    parameters = {"height": 50.0, "young": 1e6, "density": 80.0, "gravity": 9.81, "energy": "decoupled",
                  "periods": 160.0}

    def sets(self, n, p):
        h = p["height"] / n
        period = 4.0 * p["height"] / exact.bar_speed(p["young"], p["density"])
        end = (p["periods"] + 4.0) * period
        return {
            "GRID.CELL": h,
            "GRID.UPPER": values(h, h, p["height"] + 3 * h),
            "SHAPE.UPPER": values(h, h, p["height"]),
            "LOAD.FORCE": values(0, 0, -p["density"] * p["gravity"] * p["height"] * h * h),
            "LOAD.RAMP": p["periods"] * period,
            "MATERIAL.YOUNGS_MODULUS": p["young"],
            "MATERIAL.DENSITY": p["density"],
            "MATERIAL.ENERGY": f"'{p['energy']}'",
            "TIME.END": end,
            "OUTPUT.HISTORY_INTERVAL": period / 10.0,
            "OUTPUT.CHECKPOINT_INTERVAL": end,
        }

    def measure(self, run, n, p):
        state = run.checkpoint()
        # layers of particles keep their order: the place at the start from the rank of the height
        layer = np.argsort(np.argsort(state.x[:, 2]))
        start = (layer + 0.5) * 0.5 * p["height"] / n
        stress = state.tau[:, 2] / state.jac
        base = p["density"] * p["gravity"] * p["height"]
        wanted = exact.column_stress(start, p["height"], p["density"], p["gravity"])
        laws = {"decoupled": exact.decoupled_uniaxial, "coupled": exact.coupled_uniaxial}
        height = exact.column_height(p["height"], p["density"], p["gravity"], laws[p["energy"]](p["young"]))
        top = state.x[layer == layer.max(), 2].mean()
        last = state.x[layer == layer.max() - 1, 2].mean()
        figures = {"shortening": (p["height"] - (1.5 * top - 0.5 * last)) / (p["height"] - height)}
        return math.sqrt(np.mean((stress - wanted) ** 2)) / base, figures


PROBLEMS = (BarImpact(), BarGravity(), Column())
