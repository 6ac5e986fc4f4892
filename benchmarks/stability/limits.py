#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Largest stable time step of each method, in units of h/c, by bisection: a free elastic block of 6 x 6 x 6
cells, five offsets from the grid, 3,000 steps, stable if no energy is gained. With --at one step is looked at
more closely: 28 random offsets, with other Poisson's ratios and more particles among them. With --edges cells have these
edges, in units of h, and so has the block, of 6 x 6 x 6 cells; 1 should be the shortest.

    build/venv/bin/python benchmarks/stability/limits.py [--at CFL] [--edges 4,4,1] [NAME...]
"""

import argparse
import pathlib
import random
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tests" / "system"))

import driver  # noqa: E402

CELL = 1e-3  # [m]
MODULUS, DENSITY = 1e9, 1000.0  # of block.nml [Pa], [kg/m3]
POISSON, PARTICLES = "MATERIAL.POISSON_RATIO", "BODY.PARTICLES_PER_CELL"
CLOSER = 16 * [{}] + 4 * [{POISSON: 0.45}] + 4 * [{POISSON: 0.1}] + 4 * [{PARTICLES: 3}]
METHODS = {f"{shape} {transfer}": {"METHOD.SHAPE": shape, "METHOD.TRANSFER": transfer.rstrip("24"),
                                   **({"METHOD.ORDER": transfer[-1]} if transfer[-1].isdigit() else {})}
           for shape in ("ugimp", "bspline") for transfer in ("flip", "apic", "fmpm2", "fmpm4")}
METHODS["bspline flip, selective"] = {"METHOD.SHAPE": "bspline", "METHOD.SELECTIVE_SCALING": "on"}
METHODS["ugimp flip, no FBAR"] = {"METHOD.SHAPE": "ugimp", "METHOD.FBAR": "F"}


def wave_speed(nu=0.33):
    """Speed of pressure waves [m/s]."""
    return ((MODULUS / (3 * (1 - 2 * nu)) + 4 / 3 * MODULUS / (2 * (1 + nu))) / DENSITY) ** 0.5


def scene(edges):
    """The block of 6 x 6 x 6 cells with these edges, in units of h."""
    def text(cells):
        return ",".join(str(cells * edge * CELL) for edge in edges)

    return {"GRID.CELL": text(1), "GRID.UPPER": text(13), "SHAPE.UPPER": text(6), "BODY.CENTRE": text(3)}


def grows(cfl, sets, shift, edges):
    """True if the block breaks down or gains 5 % of energy at an offset [cells] from the grid."""
    with tempfile.TemporaryDirectory() as place:
        keys = scene(edges) | sets | {"TIME.DT": cfl * CELL / wave_speed(sets.get(POISSON, 0.33)),
                       "GRID.LOWER": ",".join(str((-5.0 - s) * edge * CELL) for s, edge in zip(shift, edges))}
        done = driver.run(HERE / "block.nml", "--quiet", directory=place, sets=keys, expect=None, timeout=600)
        if done.status != driver.WELL:
            return True
        history = done.results("block").history()
        energy = history["kinetic[J]"] + history["elastic[J]"]
        return energy.max() > 1.05 * energy[0]


def random_shifts(n, seed):
    offset = random.Random(seed)
    return [[offset.random() for _ in range(3)] for _ in range(n)]


def is_stable(cfl, sets, edges):
    shifts = [(0, 0, 0), (0.13, 0.29, 0.41), *random_shifts(3, 1)]
    return not any(grows(cfl, sets, shift, edges) for shift in shifts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--at", type=float, metavar="CFL", help="look at this step alone [h/c]")
    parser.add_argument("--edges", default="1,1,1", help="of a cell [h]")
    parser.add_argument("name", nargs="*", help="methods, all if none: " + ", ".join(METHODS))
    options = parser.parse_args()
    edges = [float(edge) for edge in options.edges.split(",")]
    for name in options.name or METHODS:
        if options.at:
            bad = sum(grows(options.at, METHODS[name] | more, shift, edges)
                      for more, shift in zip(CLOSER, random_shifts(len(CLOSER), 7)))
            print(f"{name:24} at {options.at:.3f}: grows in {bad} of {len(CLOSER)}", flush=True)
            continue
        low, high = 0.05, 2.0
        for _ in range(6):
            middle = (low * high) ** 0.5
            low, high = (middle, high) if is_stable(middle, METHODS[name], edges) else (low, middle)
        print(f"{name:24} stable to {low:.3f}, not at {high:.3f}", flush=True)


if __name__ == "__main__":
    main()
