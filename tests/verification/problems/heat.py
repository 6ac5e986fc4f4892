# SPDX-License-Identifier: MIT
"""Conduction, films, heat of friction."""

import math

import exact
import numpy as np

from .base import Problem, values


def heat_steps(h, diffusivity):
    """A fixed mechanical step as long as conduction allows; the mass scaling leaves room for it."""
    return {"TIME.DT": 0.15 * h * h / diffusivity, "TIME.MASS_SCALING": 1e11}


class HeatStep(Problem):
    """Two halves of different temperature, at rest or flying."""

    name = "heat_step"
    section = "1.13"
    cells = "in each half"
    norm = "rms error of the particles' temperature over the step of 50 K"
    passes = 0.005
    resolutions = (10, 20, 32)
    fine = (64,)
    quick = (20,)
    parameters = {"time": 0.1, "cells_flown": 0.0}
    half = 20e-3

    def sets(self, n, p):
        h = self.half / n
        speed = p["cells_flown"] * h / p["time"]
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-self.half - 2 * h, -2 * h, -2 * h),
            "GRID.UPPER": values(self.half + 3 * h + p["cells_flown"] * h, 4 * h, 4 * h),
            "SHAPE(1).LOWER": values(-self.half, 0, 0),
            "SHAPE(1).UPPER": values(0, h, h),
            "SHAPE(2).UPPER": values(self.half, h, h),
            "BODY.VELOCITY": values(speed, 0, 0),
            "TIME.END": p["time"],
            "OUTPUT.CHECKPOINT_INTERVAL": p["time"],
        } | heat_steps(h, 391.0 / (8960.0 * 386.0))

    def measure(self, run, n, p):
        state = run.checkpoint()
        kappa = 391.0 / (8960.0 * 386.0)
        x = state.x[:, 0] - np.average(state.x[:, 0], weights=state.mass)
        near = np.abs(x) < 0.75 * self.half  # the ends are not infinitely far
        wanted = 350.0 + np.sign(x) * 50.0 * (1.0 - exact.half_space_step(np.abs(x), state.time, kappa))
        error = (state.temp - wanted)[near]
        heat = run.history()["heat_content[J]"]
        figures = {"worst": np.abs(error).max() / 50.0, "heat lost": float(np.abs(heat / heat[0] - 1.0).max())}
        return math.sqrt(np.mean(error**2)) / 50.0, figures


class HeatRobin(Problem):
    """Slab with a film."""

    name = "heat_robin"
    section = "1.13"
    cells = "over the half thickness"
    norm = "rms error of the particles' temperature over the start (1000 K)"
    passes = 0.005
    least_order = 1.0   # at a face nodes average particles on one side
    resolutions = (8, 16, 32)
    fine = (64,)
    quick = (8,)
    quick_passes = 0.01
    parameters = {"biot": 1.0, "fourier": 1.0}
    length = 20e-3

    def sets(self, n, p):
        h, end = self.length / n, p["fourier"] * self.length**2 / 1e-4
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-2 * h, -2 * h, -2 * h),
            "GRID.UPPER": values(self.length + 4 * h, 3 * h, 3 * h),
            "SHAPE.UPPER": values(self.length, h, h),
            "SURFACE.COEFFICIENT": p["biot"] * 100.0 / self.length,
            "TIME.END": end,
            "OUTPUT.CHECKPOINT_INTERVAL": end,
            "OUTPUT.HISTORY_INTERVAL": end / 100.0,
        } | heat_steps(h, 1e-4)

    def measure(self, run, n, p):
        state = run.checkpoint()
        wanted = exact.robin_slab(state.x[:, 0] / self.length, p["biot"], p["fourier"])
        error = state.temp / 1000.0 - wanted
        figures = {"at the film": float(error[state.x[:, 0] > self.length * (1 - 0.5 / n)].mean()),
                   "worst": float(np.abs(error).max())}
        return math.sqrt(np.mean(error**2)), figures


class HeatMode(HeatRobin):
    """Decaying mode of an insulated slab."""

    name = "heat_mode"
    norm = "rms error of the particles' temperature over the amplitude"
    quick = ()
    parameters = {"fourier": 0.1}

    def sets(self, n, p):
        result = super().sets(n, p | {"biot": 0.0})
        del result["SURFACE.COEFFICIENT"]
        return result

    def measure(self, run, n, p):
        state = run.checkpoint()
        wanted = 300.0 + 10.0 * exact.slab_mode(state.x[:, 0], state.time, self.length, 1e-4)
        error = (state.temp - wanted) / 10.0
        return math.sqrt(np.mean(error**2)), {"worst": float(np.abs(error).max())}


class HeatFriction(Problem):
    """Half space heated by a sliding plane."""

    name = "heat_friction"
    section = "1.15"
    cells = "over 8 mm"
    norm = "rms error of the rise within 2 sqrt(kappa t) of the face, over that of the face"
    passes = 0.02
    resolutions = (16, 32)
    fine = (64,)
    quick = (16,)
    quick_passes = 0.06
    parameters = {"friction": 0.3, "pressure": 1e7, "speed": 1.0}
    height = 8e-3

    def sets(self, n, p):
        h = self.height / n
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-2 * h, -2 * h, -2 * h),
            "GRID.UPPER": values(3 * h, 3 * h, self.height + 4 * h),
            "SHAPE.UPPER": values(h, h, self.height),
            "TOOL.FRICTION": p["friction"],
            "MOTION.VELOCITY": values(p["speed"], 0, 0),
            "LOAD.FORCE": values(0, 0, -p["pressure"] * h * h),
        }

    def measure(self, run, n, p):
        history, state = run.history(), run.checkpoint()
        k, kappa, h = 167.0, 6.9e-5, self.height / n
        flux = 0.5 * p["friction"] * p["pressure"] * p["speed"]
        near = state.x[:, 2] < 2.0 * math.sqrt(kappa * state.time)
        t = state.time - 0.5e-4  # half the ramp of the pressure
        wanted = exact.half_space_flux(state.x[:, 2], t, flux, k, kappa)
        scale = float(exact.half_space_flux(0.0, t, flux, k, kappa))
        error = (state.temp - 300.0 - wanted)[near] / scale
        given = history["friction_heat[J]"][-1] / (2.0 * flux * h * h * t)
        heat = history["heat_content[J]"]
        figures = {"friction heat": given, "face": float(error[state.x[near, 2] < 0.5 * h].mean()),
                   "kept": float((heat[-1] - heat[0]) / (0.5 * history["friction_heat[J]"][-1]))}
        return math.sqrt(np.mean(error**2)), figures


PROBLEMS = (HeatStep(), HeatRobin(), HeatMode(), HeatFriction())
