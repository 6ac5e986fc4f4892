# SPDX-License-Identifier: MIT
"""The command line: a run directory in, pictures and a page out."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from . import alarms, curves, look, maps, page, summary, surface
from .run import NoRun, Run


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    try:
        run = Run(options.run_directory)
        output = options.output or options.run_directory / "report"
        output.mkdir(parents=True, exist_ok=True)
    except (NoRun, OSError) as problem:
        print(f"report.py: {problem}", file=sys.stderr)
        return 2
    with matplotlib.rc_context(look.STYLE):
        pictures = draw_all(run, output)
    written = output / "report.html"
    warned = alarms.alarms(run)
    for text in warned:
        print(f"warning: {text}")
    page.write_page(
        written,
        f"{run.name}",
        "Stirpoint run report",
        warned,
        summary.key_figures(run),
        summary.phase_tables(run),
        pictures,
        run.input_text,
    )
    print(f"{len(pictures)} pictures and {written}")
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="report.py",
        description="Draws a Stirpoint run: PNG pictures and one page, report.html.",
    )
    parser.add_argument(
        "run_directory",
        metavar="RUN_DIRECTORY",
        type=Path,
        help="the directory NAME.out that a run has written",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        type=Path,
        help="where to write (default: RUN_DIRECTORY/report)",
    )
    return parser.parse_args(arguments)


def draw_all(run: Run, output: Path) -> list[page.Picture]:
    """Every picture the run has data for, in the order of the page."""
    pictures: list[page.Picture] = []

    def add(name: str, figure: Figure | None, caption: str) -> None:
        if figure is not None:
            pictures.append(page.Picture(look.save(figure, output / f"{name}.png"), caption))

    if run.frames:
        draw_frames(run, add)
    if run.probes is not None:
        add(
            "thermocouples",
            curves.thermocouples(run.probes),
            "Temperature at the thermocouples, with their first positions.",
        )
    if run.history is not None:
        add(
            "tool_loads",
            curves.tool_loads(run.history),
            "Torque, force and power of the tool, and what it is doing.",
        )
        add("wall_loads", curves.wall_loads(run.history), "Forces of walls and clamps on the metal.")
        add(
            "energies",
            curves.energies(run.history),
            "Energies since the start, and the error of their audit.",
        )
        add("history", curves.others(run.history), "Further histories.")
    return pictures


def draw_frames(run: Run, add) -> None:
    """The plate, and top views and sections of temperature and plastic strain."""
    frames = maps.choose_frames(run.frames)
    scene = maps.build_scene(run, frames)
    along = scene.follows if scene.follows.startswith("the axis") else "its middle"
    views = (
        ("top", "top", "seen from above (each pixel shows the highest particle)"),
        ("cross", "cross_section", f"in the cross-section through {scene.follows}"),
        ("along", "long_section", f"in the section along the plate through {along}"),
    )
    if all("temperature" in frame.fields for frame in frames):
        norm = maps.temperature_norm(frames)
        for name, frame in surface_frames(run, frames):
            add(
                name,
                surface.plate_picture(run, frame, norm),
                f"The deformed plate at {look.seconds(frame.time)}, coloured by temperature.",
            )
        for kind, name, where in views:
            add(
                f"temperature_{name}",
                maps.field_map(
                    getattr(scene, kind),
                    kind,
                    "temperature",
                    "temperature [K]",
                    look.TEMPERATURE,
                    norm,
                ),
                f"Temperature {where}.",
            )
    if all("plastic_strain" in frame.fields for frame in frames):
        norm = maps.strain_norm(frames)
        for kind, name, where in views:
            add(
                f"plastic_strain_{name}",
                maps.field_map(
                    getattr(scene, kind),
                    kind,
                    "plastic_strain",
                    "equivalent plastic strain [1]",
                    look.STRAIN,
                    norm,
                    extend="max",
                ),
                f"Equivalent plastic strain {where}; the scale ends at 99.5 % of what has yielded.",
            )
    if all("grain_size" in frame.fields for frame in frames):
        norm = maps.size_norm(frames)
        for kind, name, where in views:
            add(
                f"grain_size_{name}",
                maps.field_map(
                    getattr(scene, kind),
                    kind,
                    "grain_size",
                    "grain size [m]",
                    look.STRAIN,
                    norm,
                ),
                f"Grain size {where}, on a logarithmic scale.",
            )


def surface_frames(run: Run, frames: list) -> list:
    """The last frame, and before it the hottest of the chosen ones if that is another."""
    shown = [("surface_end", frames[-1])]
    hottest = max(frames, key=peak_temperature)
    if hottest is not frames[-1] and hottest is not frames[0]:
        shown.insert(0, ("surface_hottest", hottest))
    return shown


def peak_temperature(frame) -> float:
    values = frame.field("temperature")
    return float(np.max(values[np.isfinite(values)], initial=0.0))
