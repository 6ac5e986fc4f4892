#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Largest stable time step of each method, in units of h/c, by bisection: a free elastic block of 6 x 6 x 6
cells, five offsets from the grid, 3,000 steps, stable if no energy is gained.

    build/venv/bin/python benchmarks/stability/limits.py [NAME...]
"""

import pathlib
import random
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tests" / "system"))

import driver  # noqa: E402

CELL = 1e-3  # [m]
SPEED = ((1e9 / (3 * 0.34) + 4 / 3 * 1e9 / (2 * 1.33)) / 1000) ** 0.5  # of pressure waves [m/s]
METHODS = {f"{shape} {transfer}": {"METHOD.SHAPE": shape, "METHOD.TRANSFER": transfer.rstrip("24"),
                                   **({"METHOD.ORDER": transfer[-1]} if transfer[-1].isdigit() else {})}
           for shape in ("ugimp", "bspline") for transfer in ("flip", "apic", "fmpm2", "fmpm4")}
METHODS["bspline flip, selective"] = {"METHOD.SHAPE": "bspline", "METHOD.SELECTIVE_SCALING": "on"}
METHODS["ugimp flip, no FBAR"] = {"METHOD.SHAPE": "ugimp", "METHOD.FBAR": "F"}


def is_stable(cfl, sets):
    """True if the block neither breaks down nor gains 5 % of energy at any offset."""
    offset = random.Random(1)
    for shift in [(0, 0, 0), (0.13, 0.29, 0.41)] + [[offset.random() for _ in range(3)] for _ in range(3)]:
        with tempfile.TemporaryDirectory() as place:
            keys = sets | {"TIME.DT": cfl * CELL / SPEED,
                           "GRID.LOWER": ",".join(str(-5e-3 - s * CELL) for s in shift)}
            done = driver.run(HERE / "block.nml", "--quiet", directory=place, sets=keys, expect=None, timeout=600)
            if done.status != driver.WELL:
                return False
            history = done.results("block").history()
            energy = history["kinetic[J]"] + history["elastic[J]"]
            if energy.max() > 1.05 * energy[0]:
                return False
    return True


def main():
    for name in sys.argv[1:] or METHODS:
        low, high = 0.05, 2.0
        for _ in range(6):
            middle = (low * high) ** 0.5
            low, high = (middle, high) if is_stable(middle, METHODS[name]) else (low, middle)
        print(f"{name:24} stable to {low:.3f}, not at {high:.3f}", flush=True)


if __name__ == "__main__":
    main()
