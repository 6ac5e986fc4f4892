# SPDX-License-Identifier: MIT
"""stirpost report: a run directory in, pictures and a page out."""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from . import alarms, curves, look, maps, page, summary, surface
from .run import Run


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    run = Run(options.run_directory)
    output = options.output or options.run_directory / "report"
    output.mkdir(parents=True, exist_ok=True)
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
        prog="stirpost report",
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


# Field, colours, its scale, whether that ends early, label, caption.
KINDS = (
    ("temperature", look.TEMPERATURE, maps.temperature_norm, "neither", "temperature [K]", "Temperature {}."),
    ("plastic_strain", look.STRAIN, maps.strain_norm, "max", "equivalent plastic strain [1]",
     "Equivalent plastic strain {}; the scale ends at 99.5 % of what has yielded."),
    ("grain_size", look.STRAIN, maps.size_norm, "neither", "grain size [m]", "Grain size {}, on a logarithmic scale."),
)


def draw_frames(run: Run, add) -> None:
    """The plate, and top views and sections of temperature, plastic strain and grain size."""
    frames = maps.choose_frames(run.frames)
    scene = maps.build_scene(run, frames)
    along = scene.follows if scene.follows.startswith("the axis") else "its middle"
    views = [
        ("cross", "cross_section", f"in the cross-section through {scene.follows}"),
        ("along", "long_section", f"in the section along the plate through {along}"),
    ]
    if surface.can_render():
        views.insert(0, ("top", "top", "seen from above"))
    else:
        print(f"warning: {surface.HINT}")
    for name, colours, scale, extend, label, caption in KINDS:
        if not all(name in frame.fields for frame in frames):
            continue
        norm = scale(frames)
        if name == "temperature" and surface.can_render():
            for picture, frame in surface_frames(frames):
                mesh = scene.top[frames.index(frame)].mesh
                add(picture, surface.plate_picture(frame, mesh, name, label, norm, colours),
                    f"The deformed plate at {look.seconds(frame.time)}, coloured by temperature.")
        for kind, view, where in views:
            add(f"{name}_{view}", maps.field_map(getattr(scene, kind), kind, name, label, colours, norm, extend),
                caption.format(where))


def surface_frames(frames: list) -> list:
    """The last frame, and before it the hottest of the chosen ones if that is another."""
    shown = [("surface_end", frames[-1])]
    hottest = max(frames, key=peak_temperature)
    if hottest is not frames[-1] and hottest is not frames[0]:
        shown.insert(0, ("surface_hottest", hottest))
    return shown


def peak_temperature(frame) -> float:
    values = frame.field("temperature")
    return float(np.max(values[np.isfinite(values)], initial=0.0))
