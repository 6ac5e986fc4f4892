# SPDX-License-Identifier: MIT
"""Problems with published or measured figures of other programs: standing wave, bars of temperature."""

import math

import numpy as np

from .base import driver, values
from .fields import Field
from .heat import HeatRobin, heat_steps


class StandingWave(Field):
    """Five periods of a standing wave between two walls."""

    name = "standing_wave"
    section = "1.4"
    cells = "along half a wave"
    norm = "greatest rms error of the displacement in five periods, over A"
    passes = 2e-2
    least_order = 1.8
    resolutions = (16, 32, 64)
    fine = (128,)
    quick = (32,)
    quick_passes = 5e-2
    parameters = {"amplitude": 1e-4, "length": 25.0, "periods": 5.0}

    def sets(self, n, p):
        h, period = p["length"] / n, 2.0 * p["length"] / 10.0
        upper = values(p["length"], h, h)
        return {"GRID.CELL": h, "GRID.UPPER": upper, "SHAPE.UPPER": upper,
                "FIELD.WAVELENGTH": values(2.0 * p["length"], 1, 1), "FIELD.AMPLITUDE": p["amplitude"],
                "TIME.END": p["periods"] * period, "OUTPUT.HISTORY_INTERVAL": period / 40.0}


class HeatBar(Field):
    """Decaying mode of a bar whose ends are insulated or held at a temperature."""

    section = "1.13"
    cells = "along the bar"
    norm = "rms error of the particles' temperature at the end, over the amplitude"
    passes = 1e-3
    least_order = 1.8
    resolutions = (16, 32)
    fine = (64, 128)
    quick = (32,)
    parameters = {"fourier": 0.1, "number": 0.15}  # kappa t/L^2 at the end; of one step
    length, diffusivity = HeatRobin.length, 1e-4

    def __init__(self, name, ends):
        self.name, self.ends, self.input = name, ends, "heat_bar"

    def sets(self, n, p):
        h = self.length / n
        upper, end = values(self.length, h, h), p["fourier"] * self.length**2 / self.diffusivity
        step = heat_steps(h, self.diffusivity) | {"TIME.DT": p["number"] * h * h / self.diffusivity}
        ends = {"WALL.TEMPERATURE": 300.0} if self.ends == "fixed" else {"FIELD.SHIFT": values(0.5 * math.pi, 0, 0)}
        return {"GRID.CELL": h, "GRID.UPPER": upper, "SHAPE.UPPER": upper, "TIME.END": end,
                "HEAT.FOURIER": p["number"], "OUTPUT.HISTORY_INTERVAL": end / 20.0} | step | ends

    def measure(self, run, n, p):
        table = driver.Table(run.path("_errors.csv"))
        worst = float(np.max(table["bar_temperature_max[K]"])) / 10.0
        return float(table["bar_temperature_rms[K]"][-1]) / 10.0, {"worst particle": worst}


PROBLEMS = (StandingWave(), HeatBar("heat_insulated", "insulated"), HeatBar("heat_fixed", "fixed"))
