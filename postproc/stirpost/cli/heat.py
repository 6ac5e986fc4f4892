# SPDX-License-Identifier: MIT
"""The figures of thesis chapter 4 from runs of heat alone: stirpost heat RUN [OTHER] -o DIR

thermocouples.png   figure 4.6; with a second run two_runs.png, figure 4.9
below_surface.png   figure 4.8: 1 mm below the top at 10, 25 and 40 s, and along three lines
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..calibrate.heat import probes_of
from ..plots import heat_pictures, look
from ..run import Run


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost heat", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("other", type=Path, nargs="?")
    parser.add_argument("-o", "--output", type=Path, default=Path("."))
    parser.add_argument("--times", type=float, nargs="+", default=[10.0, 25.0, 40.0])
    parser.add_argument("--depth", type=float, default=1e-3)
    parser.add_argument("--speed", type=float, default=1.8e-3)
    parser.add_argument("--radius", type=float, default=10e-3)
    parser.add_argument("--length", type=float, default=100e-3)
    parser.add_argument("--middle", type=float, default=20e-3)
    parser.add_argument("--labels", nargs=2, default=["lumped", "with air"])
    options = parser.parse_args(arguments)
    run = Run(options.run)
    record = probes_of(options.run)
    other = probes_of(options.other) if options.other else None
    options.output.mkdir(parents=True, exist_ok=True)
    with look.style():
        made = [
            heat_pictures.thermocouples(record, options.speed, options.radius, options.length,
                                        options.output / "thermocouples.png"),
            heat_pictures.below_surface(run.frames, options.times, options.depth, options.middle, options.radius,
                                        lambda time: options.speed * time, options.output / "below_surface.png"),
        ]
        if other is not None:
            made.append(heat_pictures.two_runs(record, other, tuple(options.labels),
                                               options.output / "two_runs.png"))
    print("\n".join(str(path) for path in made))
    return 0

