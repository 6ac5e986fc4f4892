# SPDX-License-Identifier: MIT
"""Runs killed at random moments, a rank or all of them, and continued from what they left, until they end: the
same rows, frames and final state, bit for bit, as the run that was let alone.

    build/venv/bin/python tests/robustness/kills.py [--kills 100] [--seed 1]
"""

import argparse
import pathlib
import random
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent))

from chain import Process, ROOT, Scene, differences, driver, state_of

PLAIN = ROOT / "input" / "heat_copper_plain.nml"
STIR = {"OUTPUT.CHECKPOINT_INTERVAL": 0.0031, "OUTPUT.SAFETY_INTERVAL": 0.3}
TRACED = """&TRACER NAME = 'path', KIND = 'line', FROM = 2e-3, 20e-3, 12e-3, TO = 46e-3, 20e-3, 12e-3, SPACING = 4e-3 /
&TRACER NAME = 'layer', KIND = 'box', LOWER = 10e-3, 10e-3, 10e-3, UPPER = 30e-3, 30e-3, 12e-3, NUMBER = 4, INTERVAL = 7e-4 /
"""
HEAT = {"GRID.CELL": 2e-3, "TIME.END": 9.05, "OUTPUT.CHECKPOINT_INTERVAL": 0.07, "OUTPUT.HISTORY_INTERVAL": 0.05,
        "OUTPUT.FRAME_INTERVAL": 3, "OUTPUT.SAFETY_INTERVAL": 0.3}
SCENES = [Scene("stir, 2 ranks", "stir", STIR, 2, TRACED), Scene("stir, 1 rank", "stir", STIR, None, TRACED),
          Scene("heat rkl2, 2 ranks", PLAIN, HEAT, 2),
          Scene("heat tr-bdf2, 1 rank", PLAIN, HEAT | {"HEAT.INTEGRATOR": "tr-bdf2", "HEAT.SOLVER": "cg",
                                                      "HEAT.TOLERANCE": 0.05}, None)]


def whole(scene, directory):
    """The run let alone: how long it takes [s] and what it leaves."""
    directory.mkdir()
    one = Process(scene, directory)
    try:
        status = one.wait(300)
        assert status == 0, f"{scene.label}: {status}\n{(directory / 'log.txt').read_text()}"
        return time.monotonic() - one.begun, state_of(scene.folder(directory), scene.name)
    finally:
        one.end()


def continued(scene, directory, seconds, kills, chance):
    """Killed so many times and let end: how many kills met a run at work, and what is left."""
    directory.mkdir()
    checkpoint = scene.folder(directory) / f"{scene.name}_checkpoint.h5"
    met = 0
    for k in range(kills + 1):
        options = ["--restart", str(checkpoint)] if checkpoint.exists() else []
        one = Process(scene, directory, *options)
        try:
            if k < kills:
                if one.wait(chance.uniform(0.1, max(0.5, 1.5 * seconds / kills))) is None:
                    one.kill(chance.choice(["one", "all"]), chance)
                    met += 1
                if one.wait(90) is None:
                    raise AssertionError(f"{scene.label}: ranks outlive a killed one")
            else:
                status = one.wait(300)
                assert status == 0, f"{scene.label}: {status}\n{(directory / 'log.txt').read_text()}"
        finally:
            one.end()
    return met, state_of(scene.folder(directory), scene.name)


def try_all(scenes, kills, seed, directory, tell=print):
    """Chains of up to four kills each over the scenes in turn; returns kills met and chains that differ."""
    chance = random.Random(seed)
    alone, met, chain, bad = {}, 0, 0, []
    while met < kills:
        scene = scenes[chain % len(scenes)]
        if scene.label not in alone:
            alone[scene.label] = whole(scene, directory / f"whole {scene.label}")
        seconds, state = alone[scene.label]
        n, left = continued(scene, directory / f"{chain} {scene.label}", seconds, min(4, kills - met), chance)
        differing = differences(state, left)
        met += n
        chain += 1
        tell(f"{scene.label}: {n} kills, {'the same' if not differing else 'DIFFERS: ' + ', '.join(differing)} ({met} kills)")
        if differing:
            bad.append((scene.label, differing))
        if chain > 3 * kills:
            raise AssertionError("the runs end before they are killed")
    return met, bad


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        met, bad = try_all(SCENES, given.kills, given.seed, pathlib.Path(directory),
                           lambda text: print(text, flush=True))
    print(f"{met} kills, {len(bad)} chains differ")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
