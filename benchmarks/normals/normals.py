#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Normals between two bodies at the nodes that both reach, in the plane: error against the true direction of the
gradient of volume, of linear and of logistic regression (Nairn, Hammerquist & Smith 2020), in degrees.

    build/venv/bin/python benchmarks/normals/normals.py

Uniform lattices of two particles per cell and direction with uGIMP weights, 40 random places and turns of the face
each; nodes count by the mass that meets there, m1 m2/(m1 + m2).
"""

import numpy as np

TRIALS, SPACING = 40, 0.5


def weights(d, half=0.25):
    """uGIMP weights of particles at distances `d` [cells] from a node, along one axis."""

    def primitive(r):
        r = np.clip(r, -1.0, 1.0)
        return r - 0.5 * r * np.abs(r)

    def slope(r):
        return np.maximum(0.0, 1.0 - np.abs(r))

    return ((primitive(d + half) - primitive(d - half)) / (2 * half), (slope(d + half) - slope(d - half)) / (2 * half))


def gradient(x, w, g, side):
    return g[side < 0].sum(0) - g[side > 0].sum(0)


def linear(x, w, g, side, ridge=1e-3):
    mean = w @ x / w.sum()
    y = x - mean
    a = (y * w[:, None]).T @ y / w.sum() + ridge * np.eye(2)
    return np.linalg.solve(a, (w * side) @ y / w.sum())


def logistic(x, w, g, side, penalty=5e-4, steps=60):
    """Newton's method for the plane (n, offset) of greatest likelihood; a small penalty keeps it finite."""
    y = np.hstack([x, np.ones((len(x), 1))])
    phi = np.append(linear(x, w, g, side), 0.0)
    for _ in range(steps):
        p = 1.0 / (1.0 + np.exp(-np.clip(side * (y @ phi), -50, 50)))
        slope = -((1.0 - p) * side * w) @ y + penalty * phi
        curve = (y * (p * (1.0 - p) * w)[:, None]).T @ y + penalty * np.eye(3)
        step = np.linalg.solve(curve, slope)
        phi = phi - step / max(1.0, np.abs(step).max())
        if np.abs(step).max() < 1e-5 * np.abs(phi).max():
            break
    return phi[:2]


METHODS = {"gradient": gradient, "linear": linear, "logistic": logistic}


def turned(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def lattice(random, inside):
    """Particles of a turned and shifted lattice for which `inside` holds."""
    i = np.arange(-24, 25) * SPACING
    x = np.stack(np.meshgrid(i, i), -1).reshape(-1, 2) + SPACING * random.random(2)
    return x[inside(x)]


def scene(name, random):
    """Both bodies, and the normal out of the first one at places."""
    place, angle = random.random(2), 2 * np.pi * random.random()
    if name == "flat, along the grid":
        normal = np.array([1.0, 0.0])
    else:
        normal = turned(angle) @ [1.0, 0.0]
    if name.startswith("flat"):
        one = lattice(random, lambda x: ((x - place) @ normal < -0.25) & (np.abs((x - place) @ normal) < 6))
        two = lattice(random, lambda x: ((x - place) @ normal > 0.25) & (np.abs((x - place) @ normal) < 6))
        return one, two, lambda x: normal
    if name.startswith("disc"):
        radius = float(name.split()[1])
        centre = place - radius * normal
        one = lattice(random, lambda x: np.linalg.norm(x - centre, axis=1) < radius - 0.25)
        two = lattice(random, lambda x: (x - place) @ normal > 0.25)

        def out(x):  # half way between the normals of disc and plane
            n = (x - centre) / np.linalg.norm(x - centre) + normal
            return n / np.linalg.norm(n)

        return one, two, out
    along = turned(np.pi / 2) @ normal  # end of a block on a slab
    one = lattice(random, lambda x: ((x - place) @ normal < -0.25) & ((x - place) @ along < 0.0))
    two = lattice(random, lambda x: (x - place) @ normal > 0.25)
    return one, two, lambda x: normal


def errors(name, random):
    found = {method: [] for method in METHODS}
    mass = []
    for _ in range(TRIALS):
        one, two, out = scene(name, random)
        x = np.vstack([one, two])
        side = np.append(-np.ones(len(one)), np.ones(len(two)))
        for node in np.stack(np.meshgrid(np.arange(-5, 6), np.arange(-5, 6)), -1).reshape(-1, 2):
            (wx, gx), (wy, gy) = weights(x[:, 0] - node[0]), weights(x[:, 1] - node[1])
            w = wx * wy
            if min(w[side < 0].sum(), w[side > 0].sum()) < 1e-6:
                continue
            near = w > 0
            shared = w[side < 0].sum() * w[side > 0].sum() / w.sum()
            mass.append(shared)
            for method, normal in METHODS.items():
                n = normal(x[near] - node, w[near], np.stack([gx * wy, wx * gy], 1)[near], side[near])
                cosine = n @ out(node) / max(np.linalg.norm(n), 1e-300)
                found[method].append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return {method: (np.average(e, weights=mass), np.sqrt(np.average(np.square(e), weights=mass)))
            for method, e in found.items()}


def main():
    print(f"{'scene':24}" + "".join(f"{method + ': mean, rms':>24}" for method in METHODS))
    for name in ("flat, along the grid", "flat, turned", "disc 4 on a plane", "disc 10 on a plane", "end of a block"):
        result = errors(name, np.random.default_rng(1))
        print(f"{name:24}" + "".join(f"{a:16.2f}, {b:6.2f}" for a, b in result.values()), flush=True)


if __name__ == "__main__":
    main()
