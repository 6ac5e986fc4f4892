# SPDX-License-Identifier: MIT
"""Plastic flow: pressure noise, melting, fast tools, mass scaling, long stirring."""

import numpy as np

from .base import SHIFT, Check, Row, box, finite, values, yes

MELT = 1356.0  # of copper [K]


class Punch(Row):
    """Prandtl's punch to a tenth of its half width: layers of particles pass its corner.

    Its pressure rises: sunk by d it has pushed up lips as high as d over the half width a on either side (Hill's mechanism), so
    that the slip line which ends at the surface is longer by 2 d sqrt(2), along which metal moves sqrt(2) times as fast as the
    punch: 4 k d/a more than (2 + pi) k. About that it waves as layers of particles pass the corner."""

    name = "pressure_noise"
    text = "Prandtl punch, 10 % deep: rms of the pressure against its neighbourhood < 0.3 of the yield stress, force over (2 + pi + 4 d/a) k even to 3 % (rms)"
    input = "punch_plane"

    def cases(self, quick):
        pairs = [("ugimp", 6), ("bspline", 4)] if quick else [(s, n) for s in ("ugimp", "bspline") for n in (12, 16)]
        return {f"{shape} {n} cells": {"shape": shape, "n": n} for shape, n in pairs}

    def measure(self, place, ranks, shape, n):
        h, speed, depth = 1.0 / n, 0.5, 0.1
        end = depth / speed
        sets = {"METHOD.SHAPE": shape, "SHAPE.UPPER": values(6, h, 4), "MATERIAL.POISSON_RATIO": 0.33, "MATERIAL.YOUNGS_MODULUS": 1e9,
                "TIME.END": end,
                "OUTPUT.CHECKPOINT_INTERVAL": end, "OUTPUT.HISTORY_INTERVAL": end / 200.0}
        sets |= box(h, (-2, 0, -2), (6 * n + 2, 1, 4 * n + 4), (-SHIFT[0], 0.0, -SHIFT[2]))
        _, results = self.run(place, ranks, sets, "--quiet")
        history, state = results.history(), results.checkpoint()
        pressure = -state.tau[:, :3].sum(axis=1) / 3.0 / state.jac
        flowing = np.flatnonzero(state.plastic > 1e-3)
        noise = [pressure[k] - pressure[np.abs(state.x - state.x[k]).max(axis=1) < 0.75 * h].mean() for k in flowing]
        late = history["time[s]"] > 0.5 * end  # more than a layer at 12 cells and 16
        force = np.abs(history["punch_force_z[N]"][late]) / (2.0 + np.pi + 4.0 * speed * history["time[s]"][late])
        return [Check("rms/yield stress", float(np.std(noise)) / 3.0**0.5 / 1e6, at_most=0.3),
                Check("unevenness of the force", force.std() / force.mean(), at_most=0.03)]


class Runaway(Row):
    """Strength goes to nothing at the melting point: neither the heat nor the step may run away."""

    name = "melting"
    text = "tool at 2000 rpm on hot copper, m = 1.34: T <= T_melt + 1 K (heated by the tool alone), step within 20 %, finite"
    input = "stir_small"

    def cases(self, quick):
        starts = {"from 1300 K": 1300} if quick else {"from 1300 K": 1300, "from 298 K": 298, "molten, 1400 K": 1400}
        return {f"{shape} {label}": {"shape": shape, "start": start, "steps": 2000 if quick else 100000}
                for shape in ("ugimp", "bspline") for label, start in starts.items()}

    def measure(self, place, ranks, shape, start, steps):
        sets = {"METHOD.SHAPE": shape, "BODY.TEMPERATURE": start, "MATERIAL.JC_M": 1.34, "MOTION(1).SPIN_RPM": 2000, "MOTION(2).SPIN_RPM": 2000,
                       "SURFACE.COEFFICIENT": 0, "TIME.MAX_STEPS": steps, "TIME.END": steps * 1e-3}
        sets |= box(4e-3, (-2, -2, 0), (8, 7, 6), (-SHIFT[0], -SHIFT[1], -SHIFT[2]))
        _, results = self.run(place, ranks, sets, "--quiet", timeout=36000)
        history = results.history()
        step = history["dt[s]"][1:-1]
        hottest = history["temperature_max[K]"].max()
        return [finite(history), Check("hottest [K]", hottest, at_most=max(MELT, start) + 1.0),
                Check("least/first step", step.min() / step[0], at_least=0.8)]


class Stirring(Row):
    """Many steps of stirring: no NaN, no gain of energy."""

    name = "stirring"
    text = "stirring on the spot, scaled mass 1e3 to 1e7, one particle per cell: finite, no energy gained (0.1 % of the work), books within 2 %"
    input = "stir_small"
    long = True

    def cases(self, quick):
        variants = {f"mass 1e{k}": {"TIME.MASS_SCALING": 10.0**k} for k in (5, 3, 4, 6, 7)}
        variants |= {"2000 rpm": {"MOTION(1).SPIN_RPM": 2000, "MOTION(2).SPIN_RPM": 2000},
                     "one per cell": {"BODY.PARTICLES_PER_CELL": 1}, "USAVG": {"METHOD.SCHEME": "usavg"},
                     "FMPM2": {"METHOD.TRANSFER": "fmpm"}, "APIC": {"METHOD.TRANSFER": "apic"}}
        steps = 1000 if quick else 100000
        result = {f"{shape} {name}": {"shape": shape, "sets": sets, "steps": steps}
                  for shape in ("bspline", "ugimp") for name, sets in variants.items()}
        return result | {"cpgimp mass 1e5": {"shape": "cpgimp", "sets": {}, "steps": steps}}

    def measure(self, place, ranks, shape, sets, steps):
        sets = {"METHOD.SHAPE": shape} | sets | box(4e-3, (-2, -2, 0), (8, 7, 6), (-SHIFT[0], -SHIFT[1], -SHIFT[2]))
        scaling = sets.get("TIME.MASS_SCALING", 1e5)
        sets |= {"TIME.MAX_STEPS": steps, "TIME.END": steps * 1e-3 * (scaling / 1e5) ** 0.5}  # never reached
        _, results = self.run(place, ranks, sets, "--quiet", timeout=36000)
        history = results.history()
        work = history["tool_work[J]"][-1]
        return [finite(history), Check("steps", history["step"][-1], at_least=steps),
                Check("energy gain", -history["numerical_loss[J]"].min() / work, at_most=1e-3),
                Check("audit error [%]", np.abs(history["audit_error[%]"]).max(), at_most=2.0)]


class MassScaling(Row):
    """The answer must not depend on the scaled mass."""

    name = "mass_scaling"
    text = "stirring with mass x 1e3, 4e3, 1.6e4: torque and hottest particle change by less than 2 %"
    input = "stir"

    def cases(self, quick):
        return {} if quick else {f"{shape} 1e3 to 1.6e4": {"shape": shape} for shape in ("bspline", "ugimp")}

    def measure(self, place, ranks, shape):
        torque, hottest = [], []
        for k, factor in enumerate((1e3, 4e3, 1.6e4)):
            folder = place / str(k)
            folder.mkdir()
            sets = {"METHOD.SHAPE": shape, "TIME.MASS_SCALING": factor, "TIME.END": 0.16}
            sets |= box(4e-3, (-2, -2, 0), (14, 12, 8), [-o for o in SHIFT]) | {"WALL.POSITION": 0}
            _, results = self.run(folder, ranks, sets, "--quiet")
            history = results.history()
            torque.append(history["tool_torque[Nm]"][history["time[s]"] > 0.1].mean())
            hottest.append(history["temperature_max[K]"][-1] - 298.0)
        spread = [max(abs(v / x[0] - 1.0) for v in x) for x in (torque, hottest)]
        return [Check("torque", spread[0], at_most=0.02), Check("rise of T", spread[1], at_most=0.02)]


ROWS = (Punch(), Runaway(), MassScaling(), Stirring())
