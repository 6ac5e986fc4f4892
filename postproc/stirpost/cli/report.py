# SPDX-License-Identifier: MIT
"""stirpost report: a run directory in, pictures and a page out."""

from __future__ import annotations

import argparse
import gc
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis import alarms, cooling, summary, units, voids
from ..analysis.flow import Flow
from ..io.files import write
from ..io.frames import Frame
from ..plots import curves, look, page
from ..run import Run
from . import flow

if TYPE_CHECKING:
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

# Field, its scale in maps, whether that ends early, label, caption, chapter.
KINDS = (
    ("temperature", "temperature_norm", "neither", "temperature [{}]", "Temperature {}.", "Temperature"),
    ("plastic_strain", "strain_norm", "both", "equivalent plastic strain [1]",
     "Equivalent plastic strain {}, on a logarithmic scale that ends at 50.", "Plastic strain"),
    ("grain_size", "size_norm", "neither", "grain size [m]", "Grain size {}, on a logarithmic scale.", "Grain size"),
)


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    run = Run(options.run_directory)
    measured = cooling.Record.read(options.measured) if options.measured else None
    output = options.output or options.run_directory / "report"
    output.mkdir(parents=True, exist_ok=True)
    look.use_degrees(options.degrees)
    run.drop_damaged([kind[0] for kind in KINDS])
    stirred = run.attempt("flow", flow_of, run)
    with look.style():
        pictures = draw_all(run, output, measured, stirred)
    made = compose(run, pictures, stirred, measured)
    for text in alarms.alarms(run):
        if text not in run.faults:
            print(f"warning: {text}")
    made.write(output / "report.html")
    print(f"{len(pictures)} pictures and {output / 'report.html'}")
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="stirpost report",
                                     description="Draws a Stirpoint run: PNG pictures and one page, report.html.")
    parser.add_argument("run_directory", metavar="RUN_DIRECTORY", type=Path, help="the directory NAME.out that a run has written")
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, help="where to write (default: RUN_DIRECTORY/report)")
    parser.add_argument("--measured", metavar="FILE", type=Path,
                        help="thermocouples to draw over those of the run: time[s], then T1[K] or T1[C], named like the probes")
    parser.add_argument("--degrees", choices=list(look.SCALES), default="K", help="temperatures of the pictures in K or C (default K)")
    return parser.parse_args(arguments)


def compose(run: Run, pictures: list[page.Picture], stirred: Flow | None, measured: cooling.Record | None) -> page.Page:
    process = run.attempt("the table of the process", summary.process_table, run)
    beside = {remark for _, _, remark in process[1]} if process else set()
    results = run.attempt("the shape of the metal", summary.shape_rows, run) if run.frames else None
    made = page.Page(
        title=run.scene.get("RUN.TITLE", run.name),
        origin=summary.origin(run),
        process=process,
        results=results or [],
        solid=run.attempt("the view that turns", turning, run) or "",
        pictures=pictures,
        tables=run.attempt("the phases", summary.phase_tables, run) or [],
        figures=run.attempt("the key figures", summary.key_figures, run) or [],
        input_text=run.resolved_text,
    )
    measures = run.attempt("measures of flow", stirred.measures) if stirred is not None else None
    if measures is not None:
        made.results += flow.rows(measures)
        made.tables += flow.tables(measures)
    if measured is not None and run.probes:
        made.results += curves.differences(run.probes, measured)
    made.weld = run.attempt("what was welded", summary.weld, run) or ""
    track = run.attempt("voids", voids.of_run, run)
    made.joint = track.verdict() if track is not None else None
    made.checks = alarms.checks(run)
    made.alarms = [text.replace(f"{run.directory}/", "") for text in alarms.alarms(run) if not any(text in remark for remark in beside)]
    return made


def turning(run: Run) -> str:
    """Data of the view that turns; '' if there is nothing to show."""
    from ..plots import maps, solid

    frames = maps.choose_frames(run.frames, solid.MOST_FRAMES) if run.frames else []
    fields = [(name, label.format(look.unit_of_temperature()), getattr(maps, scale)(frames), colours_of(name))
              for name, scale, _, label, _, _ in KINDS if frames and all(name in frame.fields for frame in frames)]
    return solid.pack(run, frames, fields) if fields else ""


def colours_of(name: str) -> Colormap:
    return look.TEMPERATURE if name == "temperature" else look.STRAIN


def flow_of(run: Run) -> Flow | None:
    """Measures of the flow of the metal; None without a tool that travels, or without frames to compare."""
    if len(run.frames) < 2 or "id" not in run.frames[-1].fields:
        return None
    found = run.flow()
    return found if found.tool_path is not None else None


def draw_all(run: Run, output: Path, measured: cooling.Record | None, stirred: Flow | None) -> list[page.Picture]:
    """Every picture the run has data for, in the order of the page."""
    from ..plots import flow_pictures

    gc.freeze()  # what the packages hold is not looked through again and again while their figures come and go
    pictures: list[page.Picture] = []

    def add(name: str, chapter: str, caption: str, draw: Callable[..., Figure | None], *arguments: Any) -> None:
        picture = run.attempt(f"the picture {name}", look.drawn, draw, *arguments)
        if picture is not None:
            pictures.append(page.Picture(write(output / f"{name}.png", picture), caption, chapter))

    track = run.attempt("voids", voids.of_run, run)
    if track is not None:
        add("flow_voids", "Voids", "Sections at equal distances along the track: the fill from which voids are measured (left; metal over room) and the side the metal "
            "came from, faded as the fill (right). Red: within it metal is missing beyond what disorder explains and is counted; thick: holes, less than half "
            "full. Dashed: the lowest place of the face of the tool, below which voids are looked for.", flow_pictures.sheet, track)
    if run.frames:
        run.attempt("pictures of the frames", draw_frames, run, add)
    if run.probes:
        add("thermocouples", "Over time", "Temperature at the thermocouples, with their first positions"
            + ("; dots: measured." if measured is not None else "."), curves.thermocouples, run.probes, measured)
    if run.history:
        for name, caption, draw in (
            ("tool_loads", "Torque, force and power of the tool, and what it is doing.", curves.tool_loads),
            ("wall_loads", "Forces of walls and clamps on the metal.", curves.wall_loads),
            ("energies", "Energies since the start, and the error of their audit.", curves.energies),
            ("history", "Further histories.", curves.others),
        ):
            add(name, "Over time", caption, draw, run.history)
    if stirred is not None and stirred.cavity:
        add("flow_cavity", "Flow", "Three sections through the cavity at the end.", flow_pictures.cavity_picture, stirred)
    return pictures


def draw_frames(run: Run, add: Callable[..., None]) -> None:
    """The plate, and top views and sections of temperature, plastic strain and grain size."""
    from ..plots import maps
    from ..plots.views import plate_picture

    frames = maps.choose_frames(run.frames)
    scene = maps.build_scene(run, frames)
    along = scene.follows if scene.follows.startswith("the axis") else "its middle"
    views = [
        ("top", "top", "seen from above"),
        ("cross", "cross_section", f"in the cross-section through {scene.follows}"),
        ("along", "long_section", f"in the section along the plate through {along}"),
    ]
    for name, scale, extend, label, caption, chapter in KINDS:
        if not all(name in frame.fields for frame in frames):
            continue
        norm, colours, label = getattr(maps, scale)(frames), colours_of(name), label.format(look.unit_of_temperature())
        if name == "temperature":
            for picture, frame in surface_frames(frames):
                k = frames.index(frame)
                add(picture, chapter, f"The deformed plate at {units.seconds(frame.time)}, coloured by temperature, and cut along the track.",
                    plate_picture, frame, scene.top[k].mesh, run.tool_mesh(frame), name, label, norm, colours, scene.along[k])
        for kind, view, where in views:
            add(f"{name}_{view}", chapter, caption.format(where),
                maps.field_map, getattr(scene, kind), kind, name, label, colours, norm, extend)
    if len(frames[-1].body_names) > 1:
        for kind, view, where in views[-2:]:
            add(f"bodies_{view}", "Bodies", f"The bodies {where}, at the end.", maps.body_map, getattr(scene, kind)[-1], kind)


def surface_frames(frames: list[Frame]) -> list[tuple[str, Frame]]:
    """The last frame, and before it the hottest of the chosen ones if that is another."""
    shown = [("surface_end", frames[-1])]
    hottest = max(frames, key=peak_temperature)
    if hottest is not frames[-1] and hottest is not frames[0]:
        shown.insert(0, ("surface_hottest", hottest))
    return shown


def peak_temperature(frame: Frame) -> float:
    values = frame.need("temperature")
    return float(np.max(values[np.isfinite(values)], initial=0.0))
