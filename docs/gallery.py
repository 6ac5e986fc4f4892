#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Pictures of docs/gallery.md and README: runs short scenes and draws the metal, coloured by temperature, with the tool, or by body.

    docs/gallery.py [NAME...] [--stirpoint PROGRAM] [--ranks N] [--runs DIR]
    docs/gallery.py --stale

Runs go to DIR (default build/gallery); a run that is finished there, and later than its input was changed, is drawn and not computed again. The film of the
README is made from the run of the quick start. docs/pictures/gallery.json keeps of each picture the digest of its input, the commit of
the program and the processor time. --stale lists the pictures of other inputs, and those of an earlier program with the number of
commits to modules/ since, the cheapest first.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "postproc"))

import matplotlib  # noqa: E402
from PIL import Image  # noqa: E402

from stirpost.analysis import surface, units  # noqa: E402
from stirpost.cli import film  # noqa: E402
from stirpost.plots import look, maps, views  # noqa: E402
from stirpost.run import Run  # noqa: E402

# Name of the picture: the input, and the time that is shown [s].
SCENES = {"quickstart": (ROOT / "input/quickstart.nml", 2.75), "copper": (ROOT / "input/fsp_copper_quick.nml", 5.5),
          "dissimilar": (ROOT / "input/fsw_copper_aluminium.nml", 7.5)}
SCENES |= {name: (ROOT / f"share/stirpoint/new/{name}.nml", time)
           for name, time in (("pin", 9.0), ("shoulder", 6.0), ("butt", 7.5), ("lap", 8.0), ("heat", 15.0))}
FILM = ROOT / "docs/pictures/quickstart.webp"  # of the scene quickstart
MADE = ROOT / "docs/pictures/gallery.json"
SETS = {"quickstart": ("OUTPUT.FRAME_INTERVAL=0.06",)}
BODIES = {"dissimilar": 21e-3, "lap": 24e-3}  # coloured by body, in the section across the weld here [m]
WIDTH = 900
MOST_BYTES = 200_000


def main() -> int:
    options = parse()
    if options.stale:
        print(*stale(), sep="\n")
        return 0
    for name in options.names or SCENES:
        path, time = SCENES[name]
        run = computed(path, options)
        with matplotlib.rc_context(look.STYLE | {"font.size": 12}):
            figure = draw(run, time, name)
        written = save(figure, ROOT / f"docs/pictures/gallery_{name}.png")
        print(f"{written.relative_to(ROOT)}: {written.stat().st_size / 1000:.0f} kB")
        if name == FILM.stem:
            film.main([str(run.directory), "--colour", "origin", "--output", str(FILM)])
        made = json.loads(MADE.read_text(encoding="utf-8"))
        made[name] = {"input": digest(path), "commit": run.summary["commit"].split("-")[0], "cpu_seconds": round(run.summary["cpu_seconds"])}
        MADE.write_text(json.dumps(made, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    return 0


def digest(path: Path) -> str:
    """Of an input without its comments, and of what is set in it."""
    text = re.sub(r"(?m)!.*$|\s+", "", path.read_text(encoding="utf-8")) + " ".join(SETS.get(path.stem, ()))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def stale() -> list[str]:
    """A line for each picture that is not of the present input and program."""
    made, lines = json.loads(MADE.read_text(encoding="utf-8")), []
    for name in sorted(made, key=lambda name: made[name]["cpu_seconds"]):
        of = made[name]
        words = ["git", "-C", str(ROOT), "rev-list", "--count", f"{of['commit']}..HEAD", "--", "modules", *(f"share/stirpoint/{name}.nml" for name in ("materials", "pairs"))]
        since = (subprocess.run(words, capture_output=True, text=True).stdout.strip() if shutil.which("git") else "") or "unknown"
        other = ["another input"] * (of["input"] != digest(SCENES[name][0])) + [f"{since} commits to the program since"] * (since != "0")
        if other:
            lines.append(f"{name} ({of['cpu_seconds']} s of processor time): {', '.join(other)}")
    return lines


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", metavar="NAME", nargs="*", choices=[[], *SCENES], help=f"which (default: all of {', '.join(SCENES)})")
    parser.add_argument("--stale", action="store_true", help="list the pictures that are not of the present inputs and program")
    parser.add_argument("--stirpoint", metavar="PROGRAM", type=Path, default=ROOT / "build/release/stirpoint")
    parser.add_argument("--ranks", metavar="N", default="1")
    parser.add_argument("--runs", metavar="DIR", type=Path, default=ROOT / "build/gallery")
    return parser.parse_args()


def computed(path: Path, options: argparse.Namespace) -> Run:
    """The finished run of an input."""
    options.runs.mkdir(parents=True, exist_ok=True)
    results = options.runs / f"{path.stem}.out"
    summary = results / f"{path.stem}_summary.json"
    if not summary.is_file() or summary.stat().st_mtime < path.stat().st_mtime:
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
        view = maps.View(frame, low, high, f"t = {units.seconds(frame.time)},  x = {BODIES[name] * units.MM:.0f} mm", mesh, axis=0)
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
