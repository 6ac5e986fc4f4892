# SPDX-License-Identifier: MIT
"""The key figures of a run, as rows (meaning, value with unit)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..io.table import Column, Table
from . import alarms, metal, units, voids
from .tools import LOADS, Phase, main_tool, rigid, supports, tools_of

if TYPE_CHECKING:
    from ..run import Run

Rows = list[tuple[str, str]]


def key_figures(run: Run) -> Rows:
    return (frame_rows(run) if run.frames else []) + history_rows(run.history) + probe_rows(run.probes)


def frame_rows(run: Run) -> Rows:
    last = run.frames[-1]
    rows = [("simulated time", units.seconds(last.time))]
    if last.step >= 0:
        rows.append(("time steps", f"{last.step}"))
    rows += [("frames", f"{len(run.frames)}"), ("particles", f"{last.count}"), ("particle spacing", f"{run.spacing * units.MM:.4g} mm")]
    if np.isfinite(run.cell):
        rows.append(("grid cell", f"{run.cell * units.MM:.4g} mm"))
    hottest = hottest_frame(run)
    if hottest is not None:
        kelvin, time = hottest
        rows.append(("highest temperature in the frames", f"{degrees(kelvin)} at {units.seconds(time)}"))
    strain = last.field("plastic_strain")
    if strain is not None and np.isfinite(strain).any():
        rows.append(("largest plastic strain at the end", f"{np.nanmax(strain):.3g}"))
    return rows + shape_rows(run)


def hottest_frame(run: Run) -> tuple[float, float] | None:
    """Highest temperature [K] over the frames and when [s]."""
    found = None
    for frame in run.frames:
        values = frame.field("temperature")
        if values is not None and np.isfinite(values).any():
            peak = float(np.nanmax(values))
            if found is None or peak > found[0]:
                found = (peak, frame.time)
    return found


def shape_rows(run: Run) -> Rows:
    """Flash above the initial top face, debris apart, and groove below it at the end; none for a scene without a tool,
    or whose metal has not moved."""
    tools = rigid(run.history)
    if run.history and not tools:
        return []
    shape = metal.measure(run, run.frames[-1], tools)
    if shape is None:
        return []
    debris = f"{counted(shape.debris_particles, 'particle')} in {counted(shape.debris_pieces, 'piece')}, {cubic(shape.debris_volume)}"
    rows = [("flash: height above the initial top face", f"{shape.flash_height * units.MM:.2f} mm"),
            ("flash: volume above the initial top face", cubic(shape.flash_volume)),
            ("debris", debris if shape.debris_pieces else "none")]
    if shape.groove is not None:
        rows.append(("groove: greatest depth below the initial top face", f"{shape.groove * units.MM:.2f} mm"))
    return rows


def history_rows(history: Table) -> Rows:
    """Peaks of loads, energies at the end; means of loads are in the phases."""
    rows: Rows = []
    for tool in tools_of(history):
        for column in tool.loads(r"(torque|power|force_[xyz])"):
            rows.append((f"{units.words(column.name)}: peak", amount(peak(column), column.unit)))
        whole = Phase("all", 1, len(history) - 1)
        if len(history) > 1 and np.isfinite(tool.friction_share(whole)):
            rows.append((f"{units.words(tool.name)}: share of its friction in all friction heat and plastic work",
                         f"{tool.friction_share(whole):.4g} %"))
    for column in supports(history):
        rows.append((f"{units.words(column.name)}: peak; at the end",
                     f"{amount(peak(column), column.unit)}; {amount(last_number(column), column.unit)}"))
    for column in history.with_unit("J"):
        if np.nanmax(np.abs(column.values), initial=0.0) > 0.0:
            first = column.values[0] if column.name.endswith("heat_content") else 0.0  # which counts from 0 K
            rows.append((f"{units.words(column.name)}{' since the start' if first else ''} at the end", amount(last_number(column) - first, "J")))
    for column in history.matching(r"audit_error.*"):
        rows.append((f"{units.words(column.name)}: largest", amount(np.nanmax(np.abs(column.values)), column.unit)))
    for column in history.matching(r"temperature_max"):
        rows.append(("highest temperature in the history", degrees(np.nanmax(column.values))))
    return rows


def phase_tables(run: Run) -> list[tuple[str, list[str], list[list[str]]]]:
    """For each tool whose position is known: title, headings and a row for each phase of its motion."""
    tables = []
    for tool in tools_of(run.history):
        phases = tool.phases()
        if not phases:
            continue
        columns = [column for load in LOADS for column in tool.loads(load)]
        scales = [units.scaled(float(np.nanmax(np.abs(column.values))), column.unit) for column in columns]
        hottest = run.history.column("temperature_max")
        headings = ["phase", "time [s]", "way [mm]"]
        for column, (_, unit) in zip(columns, scales):
            headings.append(f"{units.words(column.name[len(tool.name) + 1:])} [{unit}]")
        headings += ["friction share [%]"] + ["hottest [K]"] * (hottest is not None)
        rows = []
        for phase in phases:
            before, end = run.history["time"][[phase.first - 1, phase.last]]
            way = np.linalg.norm(tool.place(end) - tool.place(before)) * units.MM
            row = [phase.kind, f"{before:.4g} to {end:.4g}", f"{way:.4g}"]
            row += [figure(tool.mean(column, phase) * factor) for column, (factor, _) in zip(columns, scales)]
            row.append(figure(tool.friction_share(phase)))
            if hottest is not None:
                there = hottest.values[phase.first:phase.last + 1]
                there = there[np.isfinite(there)]
                row.append(f"{there.max():.0f}" if there.size else "")
            rows.append(row)
        tables.append((f"Phases of {units.words(tool.name)}: means", headings, rows))
    return tables


Process = tuple[list[str], list[tuple[str, list[str], str]]]


def process_table(run: Run) -> Process | None:
    """Prescribed process parameters of the tool with the most work: headings, and rows of a quantity, its values in each phase and over all, and
    warnings. None without a tool whose position is known."""
    tool, history = main_tool(run.history), run.history
    if tool is None or not (phases := tool.phases()):
        return None
    shown = [phase for phase in phases if phase.kind not in ("approach", "away")]
    spans = [*shown, Phase("whole run", 1, len(history) - 1)]
    rows = [("time [s]", [f"{history['time'][p.first - 1]:.4g} to {history['time'][p.last]:.4g}" for p in spans], "")]

    def remark(check: Callable[[Run], alarms.Check | None]) -> str:
        found = run.attempt("a check", check, run)
        return found.text if found is not None else ""

    hottest = history.column("temperature_max")
    if hottest is not None:
        rows.append(("peak temperature [K]", [figure(largest(hottest.values, p), 4) for p in spans], remark(alarms.melting)))
    beside = {"force_z": alarms.inertia, "torque": alarms.weld}
    for load, words in (("force_z", "axial force"), ("force_x", "force along the track"), ("force_y", "force across"),
                        ("torque", "torque"), ("power", "power")):
        for column in tool.loads(load):
            factor, unit = units.scaled(float(np.nanmax(np.abs(column.values))), column.unit)
            values = [f"{figure(factor * tool.mean(column, p), 4)}; {figure(factor * largest(column.values, p), 4)}" for p in spans]
            rows.append((f"{words} [{unit}], mean; peak", values, remark(beside[load]) if load in beside else ""))
    shares = [figure(tool.friction_share(p), 3) for p in spans]
    rows.append(("share of friction in the heat [%]", shares, remark(alarms.audit)))
    return [phase.kind for phase in spans], rows


def measures(run: Run) -> dict[str, float]:
    """Quantities that studies compare, with units: of the run, and of the tool that does the most work after its plunge
    (during all of its contact if it only plunges)."""
    history, tool = run.history, main_tool(run.history)
    found = {"highest temperature [K]": float(np.nanmax(column.values)) for column in history.matching("temperature_max")}
    found |= {f"{units.words(column.name)} [J]": last_number(column) for column in history.matching("friction_heat|plastic_work")}
    if tool is not None:
        phases = [p for p in tool.phases() if p.kind in ("travel", "dwell")] or [Phase("all", 1, len(history) - 1)]
        steady = phases[-1]
        found["from [s]"] = float(history["time"][steady.first - 1])
        for load, words, unit in (("force_z", "axial force", "N"), ("force_x", "force along x", "N"), ("torque", "torque", "N m"),
                                  ("power", "power", "W")):
            for column in tool.loads(load):
                found[f"{words}, mean [{unit}]"] = tool.mean(column, steady)
                found[f"{words}, peak [{unit}]"] = abs(largest(column.values, Phase("all", 0, len(history) - 1)))
    found |= {f"{column.name}, peak [K]": float(np.nanmax(column.values)) for column in run.probes.with_unit("K")}
    if run.frames and tool is not None:
        shape = metal.measure(run, run.frames[-1], rigid(history))
        if shape is not None:
            found["flash [mm3]"] = shape.flash_volume * units.MM**3
            if shape.groove is not None:
                found["groove [mm]"] = shape.groove * units.MM
    track = voids.of_run(run)
    if track is not None:
        found["void, largest section [mm2]"] = track.all[0].area * units.MM**2 if track.all else 0.0
        found["void, depth [mm]"] = track.all[0].depth * units.MM if track.all else float("nan")
        found["of it loose metal [mm2]"] = track.all[0].loose * units.MM**2 if track.all else 0.0
        found["voids [mm3]"] = sum(void.volume for void in track.all) * units.MM**3
        found["smallest void resolved [mm2]"] = track.resolved * units.MM**2
        found["narrowest seam resolved [mm]"] = track.smallest["smallest_seam[m]"] * units.MM
    return found


def weld(run: Run) -> str:
    """Workpiece, tool and process, as far as the run gives them."""
    tool, scene = main_tool(run.history), run.scene
    tools = rigid(run.history)
    bodies = [n.strip() for n in run.frames[0].body_names if n.strip() not in tools] if run.frames else []
    parts = []
    for name in bodies:
        material = scene.of("body", name).get("material")
        parts.append(f"{name} ({material})" if material else name)
    text = f"{'Weld' if len(bodies) > 1 else 'Pass'} of {' and '.join(parts)}" if parts else "Pass"
    if run.frames:
        points = metal.metal_points(run.frames[0], tools)[0]
        size = " x ".join(f"{x * units.MM:.3g}" for x in np.ptp(points, axis=0) + run.spacing) if len(points) else ""
        text += f", {size} mm" if size else ""
    if tool is None:
        return f"{text}, without a tool."
    keys = scene.of("tool", tool.name)
    lengths = [f"{words} {1e3 * float(keys[key]):.4g} mm" for key, words in
               (("radius", "shoulder radius"), ("pin_radius", "pin radius"), ("pin_length", "pin length")) if keys.get(key)]
    how = [f"tilt {float(keys['tilt_deg']):g}\N{DEGREE SIGN}"] if keys.get("tilt_deg") else []
    moves = [phase for phase in tool.phases() if phase.kind == "travel"] or [p for p in tool.phases() if p.kind == "dwell"]
    if moves:
        phase = max(moves, key=lambda p: p.last - p.first)
        start, end = run.history["time"][[phase.first - 1, phase.last]]
        angle = tool.column("angle")
        if angle is not None:
            turns = np.abs(np.diff(angle.values[[phase.first - 1, phase.last]]))[0] / (2.0 * np.pi)
            how.append(f"{60.0 * turns / (end - start):.4g} rpm")
        way = np.linalg.norm(tool.place(end) - tool.place(start)) * units.MM
        if phase.kind == "travel":
            how.append(f"{way / (end - start):.3g} mm/s over {way:.3g} mm")
    return "; ".join([text, *([", ".join([tool.name, *lengths])]), *([", ".join(how)] if how else [])]) + "."


def largest(values: np.ndarray, phase: Phase) -> float:
    """The value of the largest magnitude in a phase."""
    there = values[phase.first:phase.last + 1]
    there = there[np.isfinite(there)]
    return float(there[np.abs(there).argmax()]) if there.size else float("nan")


def origin(run: Run) -> str:
    """Provenance of a page: version, commit and date of the run."""
    known = run.summary or {}
    parts = [f"run {run.name}"]
    if known.get("finished"):
        parts.append(str(known["finished"]))
    if known.get("commit"):
        parts.append(f"Stirpoint {known.get('version', '')}, commit {known['commit']}")
    ranks, wall = (alarms.number(known.get(key)) for key in ("ranks", "wall_seconds"))
    if ranks:
        parts.append(counted(int(ranks), "rank"))
    if wall:
        parts.append(f"computed in {duration(wall)}")
    return " \N{MIDDLE DOT} ".join(parts)


def duration(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


def peak(column: Column) -> float:
    return float(column.values[np.nanargmax(np.abs(column.values))])


def figure(value: float, digits: int = 4) -> str:
    return f"{value:.{digits}g}" if np.isfinite(value) else ""


def counted(number: int, word: str) -> str:
    return f"{number} {word}{'s' * (number != 1)}"


def cubic(volume: float) -> str:
    return f"{volume * units.MM**3:.4g} mm\N{SUPERSCRIPT THREE}"


def probe_rows(probes: Table) -> Rows:
    rows: Rows = []
    for column in probes.with_unit("K"):
        at = np.nanargmax(column.values)
        rows.append((f"thermocouple {column.name}: peak", f"{degrees(column.values[at])} at {units.seconds(probes['time'][at])}"))
    return rows


def last_number(column: Column) -> float:
    return float(column.values[np.isfinite(column.values)][-1])


def degrees(kelvin: float) -> str:
    return f"{kelvin:.0f} K ({kelvin - units.CELSIUS:.0f} \N{DEGREE SIGN}C)"


def amount(value: float, unit: str) -> str:
    factor, shown = units.scaled(value, unit)
    return f"{value * factor:.4g} {shown}"
