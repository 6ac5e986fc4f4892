#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Restart with every key of a scene changed, one at a time, on 1, 2 and 3 ranks in turn.

    python3 tests/robustness/restarts.py [--quick] [--seed N] [SCENE...]

A checkpoint holds its scene with all defaults. Each value is changed by --set: a restart must refuse it (exit status
2 and a message that names the group) unless `stirpoint --keys` says that a restart may change it; then it must go on, or
say what is wrong. Anything else is silent or a crash, and the command fails. --quick: 12 keys of each scene.
"""

import argparse
import concurrent.futures
import os
import pathlib
import random
import re
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))

import driver

SCENES = {"stir": {"TIME.MAX_STEPS": 3, "TIME.MASS_SCALING": 1e8}, "line": {"TIME.MAX_STEPS": 3},
          "pushed": {"TIME.MAX_STEPS": 3}, "heat_slab": {"TIME.MAX_STEPS": 2}}
LATER = {("MOTION", 2), ("SOURCE", "END")}   # still to come when the checkpoint was written


def table():
    """What each key may be, and which of them a restart may change, from --keys=markdown."""
    text = driver.run(None, "--keys=markdown", directory=".").out
    group, allowed = "", {}
    for line in text.splitlines():
        if line.startswith("## &"):
            group = line[4:]
        elif line.startswith("| `"):
            cells = [cell.strip() for cell in line.split("|")[1:-1]]
            allowed[group, cells[0].strip("`")] = (cells[1], re.findall(r"[\w-]+", cells[4]))
    may, words = set(), re.search(r"A restart may change.*?\n\s*(.*)", text).group(1)
    for part in words.split(";"):
        group, *keys = part.split()
        group = group.lstrip("&").rstrip(".")
        if group not in ("MOTION", "SOURCE"):
            may |= {(group, key) for key in keys or [k for g, k in allowed if g == group]}
    return allowed, may


def other(kind, choices, value):
    """A value that is not this one; '' if there is none."""
    items = [item.strip() for item in value.split(",")]
    if kind.endswith("choice"):
        rest = [word for word in choices if word != items[0].strip("'").lower()]
        return rest[0] if rest else ""
    if kind.endswith("logical"):
        return "F" if "t" in items[0].lower() else "T"
    if kind.endswith("text"):
        return "y" if items[0].strip("'") == "x" else "x"
    number = float(items[-1])
    items[-1] = str(int(number) + 1) if kind.endswith("integer") else repr(1.01 * number if number else 0.01)
    return ",".join(items)


def changes(path, allowed):
    """(group, which of them, key, value) for all keys of the scene of a checkpoint."""
    import h5py

    with h5py.File(path, "r") as file:
        text = file["scene"][()].decode()
    counts = {}
    for line in text.splitlines():
        if line.startswith("&"):
            group = line[1:]
            counts[group] = counts.get(group, 0) + 1
        elif " = " in line:
            key, value = line.strip().split(" = ", 1)
            new = other(*allowed[group, key], value)
            if new:
                yield group, counts[group], key, new


def attempt(name, path, may, place, k, change):
    group, i, key, value = change
    folder = place / f"{name}{k}"
    folder.mkdir()
    sets = SCENES[name] | {"TIME.MAX_STEPS": 4}
    repeats = {} if group in ("RUN", "GRID", "TIME", "METHOD", "HEAT", "OUTPUT") else {"i": i}
    sets[f"{group}({i}).{key}" if repeats else f"{group}.{key}"] = value
    try:
        done = driver.run(name, "--quiet", "--restart", path, directory=folder, ranks=(None, 2, 3)[k % 3], sets=sets,
                          expect=None, timeout=120)
    except Exception as trouble:  # a hang
        return f"&{group} {key} = {value}: {trouble}"
    what = f"&{group}({i}) {key} = {value}: status {done.status}: {done.err[:300]}"
    if done.status == driver.BAD_INPUT:
        return "" if "error: " in done.err else what
    fits = (group, key) in may or (group, i) in LATER or (group, key) in LATER
    if group == "MOTION" and key == "DURATION":
        fits = True   # of the phase under way: its end is still to come
    return "" if fits and done.status in (driver.WELL, driver.BROKEN) else what


def study(name, most, seed, report=print):
    """Try so many changes of one scene; the failures."""
    allowed, may = table()
    with tempfile.TemporaryDirectory() as directory:
        place = pathlib.Path(directory)
        path = driver.run(name, "--quiet", directory=place, sets=SCENES[name]).results(name).path("_checkpoint.h5")
        tried = list(changes(path, allowed))
        random.seed(f"{name} {seed}")
        tried = random.sample(tried, min(most, len(tried)))
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 2) as pool:
            found = pool.map(lambda k: attempt(name, path, may, place, k, tried[k]), range(len(tried)))
            failures = [text for text in found if text]
    for text in failures:
        report(f"{name}: {text}")
    report(f"{name}: {len(tried)} changed keys, {len(failures)} of them silent or crashed")
    return failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=", ".join(SCENES))
    parser.add_argument("--quick", action="store_true", help="12 keys of each scene")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    return any([study(name, 12 if options.quick else 10000, options.seed) for name in options.scenes or SCENES])


if __name__ == "__main__":
    sys.exit(main())
