#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Pictures of docs/gallery.md and README: runs short scenes and draws the metal, coloured by temperature, with the tool, or by body.

    docs/gallery.py [NAME...] [--stirpoint PROGRAM] [--ranks N] [--runs DIR]

Runs go to DIR (default build/gallery); a run that is finished there is drawn and not computed again.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "postproc"))

import matplotlib  # noqa: E402
from PIL import Image  # noqa: E402

from stirpost.analysis import surface  # noqa: E402
from stirpost.plots import look, maps, views  # noqa: E402
from stirpost.run import Run  # noqa: E402

# Name of the picture: the input, and the time that is shown [s].
SCENES = {"quickstart": (ROOT / "input/quickstart.nml", 2.75), "copper": (ROOT / "input/fsp_copper_quick.nml", 5.5),
          "dissimilar": (ROOT / "input/fsw_copper_aluminium.nml", 7.5)}
SCENES |= {name: (ROOT / f"share/stirpoint/new/{name}.nml", time)
           for name, time in (("pin", 4.5), ("shoulder", 6.0), ("butt", 5.0), ("lap", 5.0), ("heat", 15.0))}
SETS = {"fsw_copper_aluminium": ("GRID.CELL=1e-3", "TIME.END=7.5", "TIME.ELASTIC_SCALING=2")}
BODIES = {"dissimilar": 28e-3}  # coloured by body, in the section across the weld here [m]
WIDTH = 900
MOST_BYTES = 200_000


def main() -> int:
    options = parse()
    for name in options.names or SCENES:
        path, time = SCENES[name]
        run = computed(path, options)
        with matplotlib.rc_context(look.STYLE | {"font.size": 12}):
            figure = draw(run, time, name)
        written = save(figure, ROOT / f"docs/pictures/gallery_{name}.png")
        print(f"{written.relative_to(ROOT)}: {written.stat().st_size / 1000:.0f} kB")
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", metavar="NAME", nargs="*", choices=[[], *SCENES], help=f"which (default: all of {', '.join(SCENES)})")
    parser.add_argument("--stirpoint", metavar="PROGRAM", type=Path, default=ROOT / "build/release/stirpoint")
    parser.add_argument("--ranks", metavar="N", default="1")
    parser.add_argument("--runs", metavar="DIR", type=Path, default=ROOT / "build/gallery")
    return parser.parse_args()


def computed(path: Path, options: argparse.Namespace) -> Run:
    """The finished run of an input."""
    options.runs.mkdir(parents=True, exist_ok=True)
    results = options.runs / f"{path.stem}.out"
    summary = results / f"{path.stem}_summary.json"
    if not summary.is_file() or json.loads(summary.read_text()).get("stopped"):
        launcher = shutil.which("mpirun") or "mpirun"
        root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"} if os.geteuid() == 0 else {}
        subprocess.run([launcher, "-n", options.ranks, options.stirpoint.resolve(), path, "--overwrite", "--quiet",
                        *(word for key in SETS.get(path.stem, ()) for word in ("--set", key))],
                       cwd=options.runs, env=os.environ | root, check=True)
    return Run(results)


def draw(run: Run, time: float, name: str):
    """The frame nearest to a time."""
    frame = min(run.frames, key=lambda f: abs(f.time - time))
    if name in BODIES:
        mesh = surface.metal(run, frame, ["temperature"])
        low, high = maps.common_box([frame.points()], 2 * run.spacing)
        view = maps.View(frame, low, high, f"t = {look.seconds(frame.time)},  x = {BODIES[name] * look.MM:.0f} mm", mesh, axis=0)
        return maps.body_map(maps.section(view, frame.points(), BODIES[name], run.spacing), "cross")
    norm = maps.temperature_norm(run.frames)
    return views.plate_picture(frame, surface.metal(run, frame, ["temperature"]), run.tool_mesh(frame), "temperature",
                               "temperature [K]", norm, look.TEMPERATURE)


def save(figure, path: Path) -> Path:
    """The figure as a PNG that is small."""
    file = io.BytesIO()
    figure.savefig(file, format="png")
    with Image.open(file) as image:
        image = image.convert("RGB").resize((WIDTH, round(WIDTH * image.height / image.width)), Image.LANCZOS)
        image.save(path, optimize=True)
    if path.stat().st_size > MOST_BYTES:
        raise SystemExit(f"{path}: larger than {MOST_BYTES / 1000:.0f} kB")
    return path


if __name__ == "__main__":
    sys.exit(main())
