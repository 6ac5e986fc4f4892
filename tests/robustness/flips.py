#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Flip single bits at uniformly random places of checkpoints and restart from them.

    python3 tests/robustness/flips.py [--quick] [--flips N] [--seed N] [KIND...]

A restart must refuse the file (exit status 2, one message that names it) or, where the bit means
nothing, end with the state and the histories of the undamaged one, bit for bit. Anything else is
silent damage or a crash, and the command fails. KIND: mechanics, two-ranks, beside, heat; all by
default. --quick: 12 flips of each kind; else 200.
"""

import argparse
import concurrent.futures
import os
import pathlib
import random
import shutil
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))

import driver

# Input, ranks and overrides of each kind, the last of them those of the restart.
KINDS = {
    "mechanics": ("stir", None, {"OUTPUT.FRAME_INTERVAL": 0}, {"TIME.MAX_STEPS": 8}, {"TIME.MAX_STEPS": 10}),
    "two-ranks": ("stir", 2, {"OUTPUT.FRAME_INTERVAL": 0}, {"TIME.MAX_STEPS": 8}, {"TIME.MAX_STEPS": 10}),
    "beside": ("line", None, {"OUTPUT.FRAME_INTERVAL": 0}, {"TIME.MAX_STEPS": 4}, {"TIME.MAX_STEPS": 6}),
    "heat": ("heat_slab", None, {"OUTPUT.HISTORY_INTERVAL": 1}, {"TIME.MAX_STEPS": 3}, {"TIME.MAX_STEPS": 5}),
}


def prepare(kind, place):
    """A folder with a run that stopped at a checkpoint, and what a restart makes of it."""
    name, ranks, sets, first, then = KINDS[kind]
    whole = place / "whole"
    whole.mkdir()
    driver.run(name, "--quiet", directory=whole, ranks=ranks, sets=sets | first)
    good = place / "good"
    shutil.copytree(whole / f"{name}.out", good)
    restart(kind, whole, whole / f"{name}.out" / f"{name}_checkpoint.h5", place)
    return good, contents(whole / f"{name}.out")


def restart(kind, folder, checkpoint, place, expect=driver.WELL):
    name, ranks, sets, _, then = KINDS[kind]
    return driver.run(name, "--quiet", "--restart", checkpoint, directory=folder, ranks=ranks,
                      sets=sets | then, expect=expect, timeout=60)


def contents(folder):
    """What must be the same: tables, frames, and the checkpoint but for the name of the run."""
    import h5py

    found = {path.name: path.read_bytes() for path in sorted(folder.glob("*.csv"))}
    for path in sorted([*folder.glob("*.hdf"), *folder.glob("*_checkpoint.h5")]):
        with h5py.File(path, "r") as file:
            file.visititems(lambda key, item: found.update({f"{path.name}/{key}": item[()].tobytes()})
                            if isinstance(item, h5py.Dataset) and key != "run" else None)
    return found


def flip(kind, good, wanted, place, k, bit):
    """One flip: 'refused', 'harmless', or what went wrong."""
    name = KINDS[kind][0]
    folder = place / f"flip{k}"
    folder.mkdir()
    shutil.copytree(good, folder / f"{name}.out")
    path = folder / f"{name}.out" / f"{name}_checkpoint.h5"
    data = bytearray(path.read_bytes())
    data[bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)
    done = restart(kind, folder, path, place, expect=None)
    lines = [line for line in done.err.splitlines() if "error:" in line]
    if done.status == driver.BAD_INPUT:
        result = "refused" if len(lines) == 1 and path.name in lines[0] else f"unclear: {done.err}"
    elif done.status == driver.WELL:
        result = "harmless" if contents(folder / f"{name}.out") == wanted else "SILENT"
    else:
        result = f"CRASH, status {done.status}: {done.err[-300:]}"
    shutil.rmtree(folder)
    return result


def study(kind, flips, seed, report=print):
    """Flip so many bits of one kind; returns how often each result came, and the failures."""
    with tempfile.TemporaryDirectory() as directory:
        place = pathlib.Path(directory)
        good, wanted = prepare(kind, place)
        name = KINDS[kind][0]
        size = (good / f"{name}_checkpoint.h5").stat().st_size
        random.seed(f"{kind} {seed}")
        bits = [random.randrange(8 * size) for _ in range(flips)]
        with concurrent.futures.ThreadPoolExecutor(max(1, (os.cpu_count() or 2))) as pool:
            results = list(pool.map(lambda k: flip(kind, good, wanted, place, k, bits[k]), range(flips)))
    failures = [(bits[k], result) for k, result in enumerate(results) if result not in ("refused", "harmless")]
    for bit, result in failures:
        report(f"{kind}: bit {bit % 8} of byte {bit // 8} of {size}: {result}")
    report(f"{kind}: {flips} flips in {size} bytes: {results.count('refused')} refused, "
           f"{results.count('harmless')} harmless, {len(failures)} not noticed or crashed")
    return failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--quick", action="store_true", help="12 flips of each kind")
    parser.add_argument("--flips", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for kind in options.kinds:
        if kind not in KINDS:
            parser.error(f"there is no kind {kind}: {', '.join(KINDS)}")
    flips = 12 if options.quick else options.flips
    return any([study(kind, flips, options.seed) for kind in options.kinds or KINDS])


if __name__ == "__main__":
    sys.exit(main())
