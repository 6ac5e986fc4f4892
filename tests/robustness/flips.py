#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Spoil checkpoints at random places and restart from them.

    python3 tests/robustness/flips.py [--values] [--quick] [--number N] [--seed N] [KIND...]

A single bit is flipped. A restart must refuse the file (exit status 2, one message that names it) or, where the
bit means nothing, end with the state and the histories of the undamaged one, bit for bit.

--values: one number of one data set or attribute becomes NaN, infinite, -1, 0, huge, or one more or less, and the file
is sealed again; the restarts are on as many ranks and on one more. They must refuse the file, or end with results
that are finite numbers, or say why the run broke down (exit status 3). With --quick each on one of both, in turn.

Anything else is silent damage, a crash or a hang, and the command fails. KIND: see KINDS; all by default. --quick: 12 of
each kind; else 200.
"""

import argparse
import collections
import concurrent.futures
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))

import driver
import h5py
import numpy as np

# Input, ranks and overrides of each kind, the last of them those of the restart.
SLEEPING = {"METHOD.SLEEPING": "on", "METHOD.SLEEP_STRESS": 0.2, "OUTPUT.FRAME_INTERVAL": 0,
            "GRID.UPPER": "104e-3,48e-3,28e-3", "SHAPE.UPPER": "96e-3,40e-3,12e-3"}
KINDS = {
    "mechanics": ("stir", None, {"OUTPUT.FRAME_INTERVAL": 0}, {"TIME.MAX_STEPS": 8}, {"TIME.MAX_STEPS": 10}),
    "two-ranks": ("stir", 2, {"OUTPUT.FRAME_INTERVAL": 0}, {"TIME.MAX_STEPS": 8}, {"TIME.MAX_STEPS": 10}),
    "beside": ("line", None, {"OUTPUT.FRAME_INTERVAL": 0}, {"TIME.MAX_STEPS": 4}, {"TIME.MAX_STEPS": 6}),
    "heat": ("heat_slab", None, {"OUTPUT.HISTORY_INTERVAL": 1}, {"TIME.MAX_STEPS": 3}, {"TIME.MAX_STEPS": 5}),
    "sleeping": ("stir", 2, SLEEPING, {"TIME.END": 0.06}, {"TIME.END": 0.0625}),
    "watched": ("phased", None, {"OUTPUT.FRAME_INTERVAL": 0, "GRID.CELL": 4e-3, "GRID.UPPER": "44e-3,44e-3,20e-3"},
                {"TIME.END": 6e-3}, {"TIME.END": 6.2e-3}),
    "backed": ("backed_column", None, {"OUTPUT.FRAME_INTERVAL": 0}, {"TIME.MAX_STEPS": 4}, {"TIME.MAX_STEPS": 6}),
    "traced": (driver.ROOT / "input/fsp_copper_quick.nml", None, {"GRID.CELL": 4e-3, "OUTPUT.FRAME_INTERVAL": 0},
               {"TIME.MAX_STEPS": 8}, {"TIME.MAX_STEPS": 10}),
}


def stem(kind):
    return pathlib.Path(KINDS[kind][0]).stem


def prepare(kind, place):
    """A folder with a run that stopped at a checkpoint, and what a restart makes of it."""
    name, ranks, sets, first, then = KINDS[kind]
    whole = place / "whole"
    whole.mkdir()
    driver.run(name, "--quiet", directory=whole, ranks=ranks, sets=sets | first)
    good = place / "good"
    shutil.copytree(whole / f"{stem(kind)}.out", good)
    restart(kind, whole, ranks)
    return good, contents(whole / f"{stem(kind)}.out")


def restart(kind, folder, ranks, expect=driver.WELL):
    name, _, sets, _, then = KINDS[kind]
    path = folder / f"{stem(kind)}.out" / f"{stem(kind)}_checkpoint.h5"
    return driver.run(name, "--quiet", "--restart", path, directory=folder, ranks=ranks, sets=sets | then, expect=expect,
                      timeout=60)


def contents(folder):
    """What must be the same: tables, frames, and the checkpoint but for the name of the run."""
    found = {path.name: path.read_bytes() for path in sorted(folder.glob("*.csv"))}
    for path in sorted([*folder.glob("*.hdf"), *folder.glob("*_checkpoint.h5")]):
        with h5py.File(path, "r") as file:
            file.visititems(lambda key, item: found.update({f"{path.name}/{key}": item[()].tobytes()})
                            if isinstance(item, h5py.Dataset) and key != "run" else None)
    return found


def flip(path, draw):
    """Flip one bit; what was done."""
    data = bytearray(path.read_bytes())
    bit = draw.randrange(8 * len(data))
    data[bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)
    return f"bit {bit % 8} of byte {bit // 8} of {len(data)}"


def hostile(value, draw):
    """Another value of the same type."""
    if value.dtype.kind == "f":
        return draw.choice([np.nan, np.inf, -np.inf, -1, 0, 1e300, -1e300, value + 1, value - 1])
    limits = np.iinfo(value.dtype)
    return draw.choice([-1, 0, limits.max, limits.min, limits.max // 1000, min(value, limits.max - 1) + 1,
                        max(value, limits.min + 1) - 1])


def change(path, draw):
    """Change one number of one data set or attribute, each as likely as any other, and seal the file again; what was done."""
    with h5py.File(path, "r+") as file:
        places = [(file.attrs, key) for key, value in file.attrs.items() if np.asarray(value).dtype.kind in "fi"]
        file.visititems(lambda key, item: places.append((file, key))
                        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fi" and item.size else None)
        holder, key = draw.choice(places)
        values = np.array(holder[key][()] if holder is file else holder[key])
        at = draw.randrange(values.size)
        old, new = values.flat[at], hostile(values.flat[at], draw)
        values.flat[at] = new
        if holder is file:
            file[key][...] = values
        else:
            file.attrs.modify(key, values)
    driver.seal(path)
    return f"{key}[{at}] of {values.size}: {old} -> {new}"


def outcome(kind, done, folder, wanted):
    """'refused', 'harmless', 'finite', 'broken down', or what went wrong."""
    lines = [line for line in done.err.splitlines() if "error:" in line]
    if done.status == driver.BAD_INPUT:
        return "refused" if lines and all("checkpoint" in line for line in lines[:1]) else f"UNCLEAR: {done.err[:300]}"
    if done.status == driver.BROKEN:
        return "broken down"
    if done.status != driver.WELL:
        return f"CRASH, status {done.status}: {' '.join(done.err.split())[:300]}"
    if contents(folder) == wanted:
        return "harmless"
    for table in folder.glob("*.csv"):
        if "nan" in table.read_text().lower() or "inf" in table.read_text().lower():
            return f"NOT FINITE: {table.name}"
    with h5py.File(folder / f"{stem(kind)}_checkpoint.h5") as file:
        names = [name for name in ("particles/state", "heat/state", "global") if name in file]
        bad = [name for name in names if not np.isfinite(file[name][()]).all()]
    return f"NOT FINITE: {bad}" if bad else "finite"


def attempt(kind, spoil, ranks, good, wanted, place, k, seed):
    """Spoil one checkpoint and restart from it: what was done, and what came of it."""
    folder = place / f"{k} {ranks}"
    folder.mkdir()
    results = folder / f"{stem(kind)}.out"
    shutil.copytree(good, results)
    what = spoil(results / f"{stem(kind)}_checkpoint.h5", random.Random(f"{kind} {seed} {k}"))
    try:
        result = outcome(kind, restart(kind, folder, ranks, expect=None), results, wanted)
    except subprocess.TimeoutExpired:
        result = "HANG"
    shutil.rmtree(folder)
    return f"{what} on {ranks or 1} rank(s)", result


def study(kind, number, seed, spoil=flip, report=print, both=True):
    """Spoil so many checkpoints of one kind; the failures. `both`: each changed number on both numbers of ranks."""
    ranks = KINDS[kind][1]
    allowed = {"refused", "harmless"} | ({"finite", "broken down"} if spoil is change else set())
    with tempfile.TemporaryDirectory() as directory:
        place = pathlib.Path(directory)
        good, wanted = prepare(kind, place)
        on = (ranks, (ranks or 1) + 1) if spoil is change else (ranks,)
        cases = [(r, k) for k in range(number) for r in (on if both else [on[k % len(on)]])]
        with concurrent.futures.ThreadPoolExecutor(max(1, (os.cpu_count() or 2))) as pool:
            results = list(pool.map(lambda case: attempt(kind, spoil, case[0], good, wanted, place, case[1], seed), cases))
    failures = [(what, result) for what, result in results if result not in allowed]
    for what, result in failures:
        report(f"{kind}: {what}: {result}")
    counts = collections.Counter(result for _, result in results if result in allowed)
    report(f"{kind}: {len(results)} restarts: " + ", ".join(f"{n} {result}" for result, n in sorted(counts.items()))
           + f", {len(failures)} not noticed or crashed")
    return failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--values", action="store_true", help="change numbers and seal again instead of flipping bits")
    parser.add_argument("--quick", action="store_true", help="12 of each kind")
    parser.add_argument("--number", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for kind in options.kinds:
        if kind not in KINDS:
            parser.error(f"there is no kind {kind}: {', '.join(KINDS)}")
    number = 12 if options.quick else options.number
    spoil = change if options.values else flip
    return any([study(kind, number, options.seed, spoil, both=not options.quick) for kind in options.kinds or KINDS])


if __name__ == "__main__":
    sys.exit(main())
