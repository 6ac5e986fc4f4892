# SPDX-License-Identifier: MIT
"""stirpost report: a run directory in, pictures and a page out."""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from . import alarms, cooling, curves, flow, look, maps, page, solid, summary, surface
from .run import Run

# Field, colours, its scale, whether that ends early, label, caption, chapter.
KINDS = (
    ("temperature", look.TEMPERATURE, maps.temperature_norm, "neither", "temperature [K]", "Temperature {}.", "Temperature"),
    ("plastic_strain", look.STRAIN, maps.strain_norm, "max", "equivalent plastic strain [1]",
     "Equivalent plastic strain {}; the scale ends at 99.5 % of what has yielded.", "Plastic strain"),
    ("grain_size", look.STRAIN, maps.size_norm, "neither", "grain size [m]", "Grain size {}, on a logarithmic scale.",
     "Grain size"),
)


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    run = Run(options.run_directory)
    measured = cooling.Record.read(options.measured) if options.measured else None
    output = options.output or options.run_directory / "report"
    output.mkdir(parents=True, exist_ok=True)
    stirred = flow_of(run)
    with matplotlib.rc_context(look.STYLE):
        pictures = draw_all(run, output, measured)
        if stirred is not None and stirred.cavity is not None:
            pictures.append(page.Picture(look.save(flow.cavity_picture(stirred), output / "flow_cavity.png"),
                                         "Three sections through the cavity at the end.", "Flow"))
    for text in alarms.alarms(run):
        print(f"warning: {text}")
    written = output / "report.html"
    made = compose(run, pictures)
    if stirred is not None:
        measures = stirred.measures()
        made.results += flow.rows(measures)
        made.tables += flow.tables(measures)
    if measured is not None and run.probes is not None:
        made.results += curves.apart(run.probes, measured)
    made.write(written)
    print(f"{len(pictures)} pictures and {written}")
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="stirpost report",
                                     description="Draws a Stirpoint run: PNG pictures and one page, report.html.")
    parser.add_argument("run_directory", metavar="RUN_DIRECTORY", type=Path, help="the directory NAME.out that a run has written")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, help="where to write (default: RUN_DIRECTORY/report)")
    parser.add_argument("--measured", metavar="FILE", type=Path,
                        help="thermocouples to draw over those of the run: time[s], then T1[K] or T1[C], named like the probes")
    return parser.parse_args(arguments)


def compose(run: Run, pictures: list[page.Picture]) -> page.Page:
    process = summary.process_table(run)
    beside = {remark for _, _, remark in process[1]} if process else set()
    return page.Page(
        title=run.title or run.name,
        origin=summary.origin(run),
        alarms=[text for text in alarms.alarms(run) if not any(text in remark for remark in beside)],
        process=process,
        results=summary.shape_rows(run) if run.frames else [],
        solid=turning(run),
        pictures=pictures,
        tables=summary.phase_tables(run),
        figures=summary.key_figures(run),
        input_text=run.resolved_text,
    )


def turning(run: Run) -> str:
    """Data of the view that turns; '' if there is nothing to show."""
    frames = maps.choose_frames(run.frames, solid.MOST_FRAMES) if run.frames else []
    fields = [(name, label, scale(frames), colours) for name, colours, scale, _, label, _, _ in KINDS
              if frames and all(name in frame.fields for frame in frames)]
    return solid.pack(run, frames, fields) if fields else ""


def flow_of(run: Run) -> flow.Flow | None:
    """What the tool did to the metal; None without a tool that travels, or without frames to compare."""
    if len(run.frames) < 2 or "id" not in run.frames[-1].fields:
        return None
    try:
        found = flow.Flow(run, run.frames[-1])
    except ValueError as problem:
        print(f"warning: no measures of flow: {problem}")
        return None
    return found if found.way is not None else None


def draw_all(run: Run, output: Path, measured: cooling.Record | None = None) -> list[page.Picture]:
    """Every picture the run has data for, in the order of the page."""
    pictures: list[page.Picture] = []

    def add(name: str, figure: Figure | None, caption: str, chapter: str) -> None:
        if figure is not None:
            pictures.append(page.Picture(look.save(figure, output / f"{name}.png"), caption, chapter))

    if run.frames:
        draw_frames(run, add)
    if run.probes is not None:
        add("thermocouples", curves.thermocouples(run.probes, measured),
            "Temperature at the thermocouples, with their first positions"
            + ("; dots: measured." if measured is not None else "."), "Over time")
    if run.history is not None:
        add("tool_loads", curves.tool_loads(run.history), "Torque, force and power of the tool, and what it is doing.",
            "Over time")
        add("wall_loads", curves.wall_loads(run.history), "Forces of walls and clamps on the metal.", "Over time")
        add("energies", curves.energies(run.history), "Energies since the start, and the error of their audit.", "Over time")
        add("history", curves.others(run.history), "Further histories.", "Over time")
    return pictures


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
    for name, colours, scale, extend, label, caption, chapter in KINDS:
        if not all(name in frame.fields for frame in frames):
            continue
        norm = scale(frames)
        if name == "temperature" and surface.can_render():
            for picture, frame in surface_frames(frames):
                mesh = scene.top[frames.index(frame)].mesh
                add(picture, surface.plate_picture(frame, mesh, run.tools(frame), name, label, norm, colours),
                    f"The deformed plate at {look.seconds(frame.time)}, coloured by temperature.", chapter)
        for kind, view, where in views:
            add(f"{name}_{view}", maps.field_map(getattr(scene, kind), kind, name, label, colours, norm, extend),
                caption.format(where), chapter)
    if len(frames[-1].body_names) > 1:
        for kind, view, where in views[-2:]:
            add(f"bodies_{view}", maps.body_map(getattr(scene, kind)[-1], kind), f"The bodies {where}, at the end.", "Bodies")


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
