# SPDX-License-Identifier: MIT
"""Disks that become full at a random byte of a random file: exit status 4, a message with file and reason, complete rows up
to the one that is lost, and an intact earlier checkpoint, from which the run can be resumed when there is space.

    build/venv/bin/python tests/robustness/full_disk.py [--disks 30] [--seed 1]

A small library that is preloaded (small_disk.c, built with cc) simulates the disk, without rights of root.
"""

import argparse
import os
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent))

from chain import ROOT, Scene, driver

PLAIN = ROOT / "input" / "heat_copper_plain.nml"
SMALL = {"OUTPUT.CHECKPOINT_INTERVAL": 3e-7, "OUTPUT.FRAME_INTERVAL": 5e-7}
HEAT = {"GRID.CELL": 4e-3, "TIME.END": 2, "OUTPUT.CHECKPOINT_INTERVAL": 0.3, "OUTPUT.HISTORY_INTERVAL": 0.1,
        "OUTPUT.FRAME_INTERVAL": 0.5}
SCENES = [Scene("small, 1 rank", "small", SMALL, None), Scene("small, 2 ranks", "small", SMALL, 2),
          Scene("heat, 1 rank", PLAIN, HEAT, None), Scene("heat, 2 ranks", PLAIN, HEAT, 2)]
# What is written, and by which name: new files are complete before they get theirs.
FILES = ["_history.csv", "_probes.csv", "_run.txt", "_checkpoint.h5.tmp", "_000001.hdf.tmp", "_000000.hdf.tmp", ".hdf.series.tmp",
         "_summary.json.tmp"]


def build(directory):
    """The library that plays a small disk."""
    library = directory / "small_disk.so"
    source = pathlib.Path(__file__).with_name("small_disk.c")
    subprocess.run([os.environ.get("CC", "cc"), "-O1", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    return library


def run(scene, directory, library=None, file="", room=0, options=()):
    """Exit status and what was said."""
    environment = driver.ENVIRONMENT
    if library:
        environment |= {"LD_PRELOAD": str(library), "SMALL_DISK_FILE": scene.name + file, "SMALL_DISK_BYTES": str(room)}
    done = subprocess.run(scene.command(directory, *options), cwd=directory, env=environment, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout + done.stderr


def sizes(scene, directory):
    """Bytes of each file of a run that has room."""
    directory.mkdir()
    status, text = run(scene, directory)
    assert status == 0, text
    return {file: (scene.folder(directory) / (scene.name + file.removesuffix(".tmp"))).stat().st_size for file in FILES}


def trouble(scene, directory, library, file, room):
    """What is wrong when `file` has room for so many bytes; '' if nothing."""
    directory.mkdir()
    status, text = run(scene, directory, library, file, room)
    folder = scene.folder(directory)
    if status != 4:
        return f"exit status {status}: {text[-300:]}"
    if f"{scene.name}{file.removesuffix('.tmp')} cannot be written: No space left on device" not in text:
        return f"no message: {text[-300:]}"
    if list(folder.glob("*.tmp")):
        return "an incomplete file stays"
    checkpoint = folder / f"{scene.name}_checkpoint.h5"
    if file.endswith(".csv"):
        rows = {rest: len((folder / f"{scene.name}{rest}").read_text().splitlines()) for rest in FILES[:2]}
        if room and abs(rows["_history.csv"] - rows["_probes.csv"]) > 1:
            return f"it went on: {rows}"
    if checkpoint.exists():
        status, text = run(scene, directory, options=["--restart", str(checkpoint)])
        if status != 0 or "warning" in text:
            return f"the checkpoint before is of no use: {status} {text[-300:]}"
    return ""


def try_all(scenes, disks, seed, directory, tell=print):
    """So many full disks over scenes and files in turn; returns what went wrong."""
    chance = random.Random(seed)
    library = build(directory)
    known, bad = {}, []
    for k in range(disks):
        scene, file = scenes[k % len(scenes)], FILES[k // len(scenes) % len(FILES)]
        if scene.label not in known:
            known[scene.label] = sizes(scene, directory / f"whole {scene.label}")
        room = chance.randrange(known[scene.label][file])
        wrong = trouble(scene, directory / str(k), library, file, room)
        tell(f"{scene.label}: {file.removesuffix('.tmp')} full at byte {room}: {wrong or 'as it should be'}")
        if wrong:
            bad.append((scene.label, file, room, wrong))
    return bad


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--disks", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        bad = try_all(SCENES, given.disks, given.seed, pathlib.Path(directory), lambda text: print(text, flush=True))
    print(f"{given.disks} full disks, {len(bad)} of them not as they should be")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
