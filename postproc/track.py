#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The history of a particle from the frames of a run, as &PATH KIND = 'history' reads it.

usage: track.py RUN_DIRECTORY ID FILE.csv      columns: time[s], temperature[K], plastic_strain[1]
"""

from __future__ import annotations

import stirpost.needs  # before the packages that it provides

import argparse
import sys
from pathlib import Path

import numpy as np
from stirpost.run import NoRun, Run


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("id", type=int, help="the field id of a frame")
    parser.add_argument("file", type=Path)
    options = parser.parse_args(arguments)
    try:
        rows = track(Run(options.run), options.id)
        text = "".join(f"{t:.9g},{temp:.9g},{strain:.9g}\n" for t, temp, strain in rows)
        options.file.write_text("time[s],temperature[K],plastic_strain[1]\n" + text, encoding="utf-8")
    except (NoRun, OSError) as problem:
        print(f"track.py: {problem}", file=sys.stderr)
        return 2
    print(f"{len(rows)} rows in {options.file}")
    return 0


def track(run: Run, number: int) -> list:
    rows = []
    for frame in run.frames:
        (place,) = np.nonzero(frame.field("id") == number)
        if len(place):
            k = place[0]
            rows.append((frame.time, frame.field("temperature")[k], frame.field("plastic_strain")[k]))
    if not rows:
        raise NoRun(f"no particle has the id {number}")
    return rows


if __name__ == "__main__":
    sys.exit(main())
