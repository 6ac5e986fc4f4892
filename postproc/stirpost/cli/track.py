# SPDX-License-Identifier: MIT
"""The history of a particle from the frames of a run, as &PATH KIND = 'history' reads it.

usage: stirpost track RUN_DIRECTORY ID FILE.csv      columns: time[s], temperature[K], plastic_strain[1]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..io.files import write
from ..io.frames import NoRun
from ..run import Run


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost track", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("id", type=int, help="the field id of a frame")
    parser.add_argument("file", type=Path)
    options = parser.parse_args(arguments)
    rows = track(Run(options.run), options.id)
    text = "".join(f"{t:.9g},{temp:.9g},{strain:.9g}\n" for t, temp, strain in rows)
    write(options.file, "time[s],temperature[K],plastic_strain[1]\n" + text)
    print(f"{len(rows)} rows in {options.file}")
    return 0


def track(run: Run, number: int) -> list[tuple[float, float, float]]:
    rows = []
    for frame in run.frames:
        (place,) = np.nonzero(frame.need("id") == number)
        if len(place):
            k = place[0]
            rows.append((frame.time, frame.need("temperature")[k], frame.need("plastic_strain")[k]))
    if not rows:
        raise NoRun(f"no particle has the id {number}")
    return rows

