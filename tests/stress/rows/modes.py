# SPDX-License-Identifier: MIT
"""The step of a frozen one-dimensional lattice as a matrix, in numpy alone.

Particles of equal mass at `x` [cells] carry a velocity and a stress each; h = c = rho = 1, so `dt` is in units of
h/c. The nodes 0..n-1 are periodic, or (n = None) as many as needed. The kernel is the linear function
averaged over the domain of a particle, 2 half [cells] wide: half -> 0 linear, 1/(2 ppc) uGIMP, 1/2 B-spline.
"""

import numpy as np


def shapes(x, half, n=None):
    """Weights S and slopes G [1/cell] of all particles at the nodes."""
    x = np.asarray(x, dtype=float)
    first = first_node(x, n)
    count = n or int(np.ceil(x.max())) + 3 - first
    s, g = np.zeros((len(x), count)), np.zeros((len(x), count))

    def primitive(r):  # integral of max(0, 1 - |r|)
        r = np.clip(r, -1.0, 1.0)
        return r - 0.5 * r * np.abs(r)

    def hat(r):
        return np.maximum(0.0, 1.0 - np.abs(r))

    nearest = np.floor(x + 0.5).astype(int)
    for k in (-1, 0, 1):
        d = x - (nearest + k)
        node = (nearest + k - first) % count if n else nearest + k - first
        np.add.at(s, (np.arange(len(x)), node), (primitive(d + half) - primitive(d - half)) / (2.0 * half))
        np.add.at(g, (np.arange(len(x)), node), (hat(d + half) - hat(d - half)) / (2.0 * half))
    return s, g


def step_map(x, half, dt, n=None, scheme="usl", transfer="flip", order=2, volume=1.0):
    """Matrix that takes (velocities, stresses, and of APIC gradients) of the particles over a step."""
    s, g = shapes(x, half, n)
    mass = s.sum(axis=0) * volume
    used = mass > 0.0
    s, g, mass = s[:, used], g[:, used], mass[used]
    back = (s * volume).T / mass[:, None]  # S+: velocities of the nodes
    push = -dt * (g * volume).T / mass[:, None]  # change of the nodes' velocities by the stresses
    count = len(x)
    state = np.eye((3 if transfer == "apic" else 2) * count)
    half_v, half_s = state[:count], state[count : 2 * count]
    old = back @ half_v
    if transfer == "apic":
        arm = np.where(s > 0.0, np.flatnonzero(used)[None, :] + first_node(x, n) - np.asarray(x)[:, None], 0.0)
        if n:
            arm = np.where(s > 0.0, (arm + 0.5 * n) % n - 0.5 * n, 0.0)
        old = old + (s * arm * volume).T / mass[:, None] @ state[2 * count :]
    early = 0.5 if scheme == "usavg" else 0.0
    half_s = half_s + early * dt * g @ old
    change = push @ half_s
    new = old + change
    if transfer in ("fmpm", "xpic"):
        term = new if transfer == "fmpm" else old
        for _ in range(order - 1):
            term = term - back @ (s @ term)
            new = new + term
    v = half_v + s @ change if transfer == "flip" else s @ new
    if scheme == "usl":
        half_s = half_s + dt * g @ new
    else:  # MUSL, USAVG: velocities mapped again
        half_s = half_s + (1.0 - early) * dt * g @ back @ v
    if transfer == "apic":
        return np.vstack([v, half_s, (s * arm) @ new / (s * arm**2).sum(axis=1)[:, None]])
    return np.vstack([v, half_s])


def first_node(x, n):
    """Number of the first column of `shapes`."""
    return 0 if n else int(np.floor(np.min(x))) - 2


def growth(*lattice, **method):
    """Spectral radius of the step."""
    return np.abs(np.linalg.eigvals(step_map(*lattice, **method))).max()


def limit(x, half, **method):
    """Largest dt [h/c] below which nothing grows, from the growth of the frozen lattice."""
    low, high = 0.05, 3.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        if growth(x, half, middle, **method) > 1.0 + 1e-6:
            high = middle
        else:
            low = middle
    return low


def lattice(n, per_cell, offset=0.5):
    """Places of per_cell n particles on n periodic cells, the first at offset/per_cell [cells]."""
    return ((np.arange(n * per_cell) + offset) / per_cell) % n
