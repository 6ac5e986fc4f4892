# SPDX-License-Identifier: MIT
"""The layer of metal that a sticking tool stirs, against finite differences."""

import functools
import math
import sys

import numpy as np

from .base import TESTS, Problem, driver, values

sys.path.insert(0, str(TESTS / "verification"))

import stirred_layer  # noqa: E402


@functools.lru_cache
def reference(layer, time):
    """Reference states of the layer at 0.95 of the time and at the end."""
    return layer.at([0.95 * time, time])


class StirredLayer(Problem):
    """Half space sheared by its surface."""

    name = "stirred_layer"
    section = "1.18"
    cells = "over 10 mm"
    norm = "largest of: shear stress off, temperature 1 mm deep off, over 300 K, work off, over it"
    passes = 0.05
    resolutions = (5, 10)
    fine = (20,)
    quick = (5,)
    quick_passes = 0.07
    parameters = {"speed": 0.5, "start": 700.0, "time": 0.5, "strength": 200e6, "rate_factor": 0.05, "conductivity": 391.0,
                  "finest": 0.0, "growth": 1.2}
    depth = 10e-3
    fine_part = 0.5e-3

    def metal(self, p):
        """Keys of the material."""
        return {"MATERIAL.JC_A": p["strength"], "MATERIAL.JC_C": p["rate_factor"]}

    def sets(self, n, p):
        h = self.depth / n
        return self.metal(p) | self.grid(h, p) | {
            "SHAPE.UPPER": values(h, h, self.depth),
            "MATERIAL.CONDUCTIVITY": p["conductivity"],
            "MOTION(1).VELOCITY": values(p["speed"], 0, -1e-3),
            "MOTION(2).VELOCITY": values(p["speed"], 0, 0),
            "BODY.TEMPERATURE": p["start"],
            "WALL.TEMPERATURE": p["start"],
            "HEAT.AMBIENT": p["start"],
            "TIME.END": p["time"],
            "OUTPUT.HISTORY_INTERVAL": p["time"] / 100,
            "OUTPUT.CHECKPOINT_INTERVAL": p["time"],
            "OUTPUT.FRAME_INTERVAL": p["time"] - self.way(n, p) / p["speed"],
        }

    def grid(self, h, p):
        """Cubes, or cells as deep as `finest` [m] at the surface and growing down from half a millimetre on."""
        if not p.get("finest"):
            return {"GRID.CELL": h, "GRID.UPPER": values(h, h, self.depth + 2 * h)}
        top = self.depth + 2 * p["finest"]
        deep = math.ceil(self.fine_part / p["finest"] - 1e-9) * p["finest"]
        return {"GRID.CELL": values(h, h, p["finest"]), "GRID.UPPER": values(h, h, top), "GRID.GRADED": "z",
                "GRID.FINE": values(self.depth - deep, top), "GRID.GROWTH": p.get("growth", 1.2), "GRID.LARGEST_CELL": h}

    def way(self, n, p):
        """Of the plane between the last two frames: less than a cell, the period [m]."""
        return min(0.4 * self.depth / n, 0.02 * p["time"] * p["speed"])

    def law(self, p):
        """The same metal for the reference."""
        return stirred_layer.JohnsonCook(a=p["strength"], c=p["rate_factor"])

    def layer(self, p):
        return stirred_layer.Layer(p["speed"], p["start"], self.law(p), conductivity=p["conductivity"])

    def measure(self, run, n, p):
        before, wanted = reference(self.layer(p), p["time"])
        history, state = run.history(), run.checkpoint()
        h = self.depth / n
        late = history["time[s]"] > 0.9 * p["time"]
        tau = -history["plane_force_x[N]"][late].mean() / h**2
        work = (history["friction_heat[J]"][-1] + history["plastic_work[J]"][-1]) / h**2
        z = self.depth - state.x[:, 2]
        layer = np.empty(len(z), int)
        layer[np.argsort(z)] = np.arange(len(z)) // 4           # 2 x 2 particles in each
        layers = np.unique(layer)
        at, temp, strain = (np.array([f[layer == k].mean() for k in layers]) for f in (z, state.temp, state.plastic))
        figures = {"tau": tau / before["tau"], "T at 1 mm off": float(np.interp(1e-3, at, temp) - wanted["T"](1e-3)),
                   "work": work / wanted["work"],
                   "T of the face off": float(history["plane_face_temperature[K]"][late].mean() - before["T"](0.0))}
        for deep in (0.5e-3, 1e-3, 2e-3):
            found = math.exp(np.interp(deep, at, np.log(np.maximum(strain, 1e-9))))
            figures[f"strain at {1e3 * deep:g} mm"] = found / float(wanted["strain"](deep))
        v = self.velocities(run, n, p, layer, layers)
        edges = np.concatenate([[0.0], np.cumsum([state.mass[layer == k].sum() for k in layers]) / (8960.0 * h**2)])
        exact = [mean_over(wanted["v"], top, bottom) for top, bottom in zip(edges, edges[1:])]
        figures["metal carried"] = np.dot(v, np.diff(edges)) / np.dot(exact, np.diff(edges))
        for deep in (0.5e-3, 1e-3, 2e-3):
            found, right = (math.exp(np.interp(deep, at, np.log(np.maximum(f, 1e-9)))) for f in (v, exact))
            figures[f"v at {1e3 * deep:g} mm"] = found / right
        return max(abs(figures["tau"] - 1.0), abs(figures["T at 1 mm off"]) / 300.0, abs(figures["work"] - 1.0)), figures

    def velocities(self, run, n, p, layer, layers):
        """Mean of each layer of particles [m/s], from their places in the last two frames."""
        h = self.depth / n
        (x0, t0), (x1, t1) = (places(run, entry) for entry in run.series()["files"][-2:])
        moved = np.mod(x1 - x0 + 0.25 * h, h) - 0.25 * h        # periodic
        return np.array([moved[layer == k].mean() for k in layers]) / (t1 - t0)


def places(run, entry):
    """Places along the plane's way of all particles by their numbers, and the time, of a frame."""
    data, _, _ = driver.read_frame(run.directory / entry["name"])
    return data["x"][np.argsort(data["id"]), 0].astype(float), entry["time"]


def mean_over(f, top, bottom):
    """Mean of a function of depth over a layer."""
    return float(np.mean(f(np.linspace(top, bottom, 101))))


class StirredLayerOf(StirredLayer):
    """The same with another law; by the command only, as the reference takes a minute."""

    quick = ()
    input = "stirred_layer"
    parameters = {"speed": 0.1, "start": 700.0, "time": 0.2, "conductivity": 391.0, "finest": 0.0, "growth": 1.2}

    def __init__(self, name, law, keys):
        self.name = f"stirred_layer_{name}"
        self.own, self.keys = law, keys

    def metal(self, p):
        return {f"MATERIAL.{key}": value for key, value in self.keys.items()}

    def law(self, p):
        return self.own


HOT = StirredLayerOf("hot", stirred_layer.HOT, {"LAW": "sellars-tegart"} | {
    f"ST_{key.upper()}": getattr(stirred_layer.HOT, field) for key, field in
    (("alpha", "alpha"), ("n", "n"), ("ln_a", "log_a"), ("q", "q"))})
TWO_PHASE = StirredLayerOf("two_phase", stirred_layer.TWO_PHASE, {"LAW": "two-phase"} | {
    f"TP_{key}": getattr(stirred_layer.TWO_PHASE, field) for key, field in
    (("BURGERS", "burgers"), ("WALLS", "walls"), ("INTERIOR", "interior"), ("SIZE", "size"), ("BETA", "beta"), ("K0", "k0"))} | {
    f"TP_STAR_{key}": values(*getattr(stirred_layer.TWO_PHASE, field)) for key, field in
    (("FIT", "star"), ("RANGE", "star_range"), ("ENDS", "star_ends"))})
PROBLEMS = (StirredLayer(), HOT, TWO_PHASE)
