# SPDX-License-Identifier: MIT
"""The key figures of a run, as rows (meaning, value with unit)."""

from __future__ import annotations

import numpy as np

from . import look, metal
from .run import Run
from .table import Column, Table
from .tools import LOADS, Phase, supports, tools_of

Rows = list[tuple[str, str]]


def key_figures(run: Run) -> Rows:
    rows: Rows = []
    if run.frames:
        rows += frame_rows(run)
    if run.history is not None:
        rows += history_rows(run.history)
    if run.probes is not None:
        rows += probe_rows(run.probes)
    return rows


def frame_rows(run: Run) -> Rows:
    last = run.frames[-1]
    rows = [("simulated time", look.seconds(last.time))]
    if last.step >= 0:
        rows.append(("time steps", f"{last.step}"))
    rows += [
        ("frames", f"{len(run.frames)}"),
        ("particles", f"{last.count}"),
        ("particle spacing", f"{run.spacing * look.MM:.4g} mm"),
    ]
    if np.isfinite(run.cell):
        rows.append(("grid cell", f"{run.cell * look.MM:.4g} mm"))
    hottest = hottest_frame(run)
    if hottest is not None:
        kelvin, time = hottest
        rows.append(
            ("highest temperature in the frames", f"{degrees(kelvin)} at {look.seconds(time)}")
        )
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
    """Flash above the first top face, debris apart, and groove below it at the end; none for a scene without a tool,
    or whose metal has not moved."""
    tools = tools_of(run.history)
    if run.history is not None and not tools:
        return []
    shape = metal.measure(run, run.frames[-1], {tool.name for tool in tools})
    if shape is None:
        return []
    rows = [
        ("flash: highest connected metal above the first top face", f"{shape.flash_height * look.MM:.2f} mm"),
        ("flash: connected metal above that face", cubic(shape.flash_volume)),
        (
            "debris, which hangs together with no body",
            f"{counted(shape.debris_particles, 'particle')} in {counted(shape.debris_pieces, 'piece')}, "
            f"{cubic(shape.debris_volume)}"
            if shape.debris_pieces
            else "none",
        ),
    ]
    if shape.groove is not None:
        rows.append(("deepest place of the surface below that face", f"{shape.groove * look.MM:.2f} mm"))
    return rows


def history_rows(history: Table) -> Rows:
    """Peaks of loads, energies at the end; means of loads are in the phases."""
    rows: Rows = []
    for tool in tools_of(history):
        for column in tool.loads(r"(torque|power|force_[xyz])"):
            rows.append((f"{look.words(column.name)}: peak", amount(peak(column), column.unit)))
        whole = Phase("all", 1, len(history) - 1)
        if len(history) > 1 and np.isfinite(tool.friction_share(whole)):
            rows.append((f"{look.words(tool.name)}: share of its friction in all friction heat and plastic work",
                         f"{tool.friction_share(whole):.4g} %"))
    for column in supports(history):
        rows.append((f"{look.words(column.name)}: peak; at the end",
                     f"{amount(peak(column), column.unit)}; {amount(last_number(column), column.unit)}"))
    for column in history.with_unit("J"):
        rows.append((f"{look.words(column.name)} at the end", amount(last_number(column), "J")))
    for column in history.matching(r"audit_error.*"):
        rows.append(
            (
                f"{look.words(column.name)}: largest",
                amount(np.nanmax(np.abs(column.values)), column.unit),
            )
        )
    for column in history.matching(r"temperature_max"):
        rows.append(("highest temperature in the history", degrees(np.nanmax(column.values))))
    return rows


def phase_tables(run: Run) -> list[tuple[str, list[str], list[list[str]]]]:
    """For each tool whose place is known: title, headings and a row for each phase of its way."""
    tables = []
    for tool in tools_of(run.history):
        phases = tool.phases()
        if not phases:
            continue
        columns = [column for load in LOADS if (column := tool.column(load)) is not None]
        scales = [look.scaled(float(np.nanmax(np.abs(column.values))), column.unit) for column in columns]
        hottest = next(iter(run.history.matching("temperature_max")), None)
        headings = ["phase", "time [s]", "way [mm]"]
        for column, (_, unit) in zip(columns, scales):
            headings.append(f"{look.words(column.name[len(tool.name) + 1:])} [{unit}]")
        headings += ["friction share [%]"] + ["hottest [K]"] * (hottest is not None)
        rows = []
        for phase in phases:
            before, end = run.history["time"][[phase.first - 1, phase.last]]
            way = np.linalg.norm(tool.place(end) - tool.place(before)) * look.MM
            row = [phase.kind, f"{before:.4g} to {end:.4g}", f"{way:.4g}"]
            row += [figure(tool.mean(column, phase) * factor) for column, (factor, _) in zip(columns, scales)]
            row.append(figure(tool.friction_share(phase)))
            if hottest is not None:
                there = hottest.values[phase.first:phase.last + 1]
                there = there[np.isfinite(there)]
                row.append(f"{there.max():.0f}" if there.size else "")
            rows.append(row)
        tables.append((f"Phases of {look.words(tool.name)}: means", headings, rows))
    return tables


def peak(column: Column) -> float:
    return float(column.values[np.nanargmax(np.abs(column.values))])


def figure(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else ""


def counted(number: int, word: str) -> str:
    return f"{number} {word}{'s' * (number != 1)}"


def cubic(volume: float) -> str:
    return f"{volume * look.MM**3:.4g} mm\N{SUPERSCRIPT THREE}"


def probe_rows(probes: Table) -> Rows:
    rows: Rows = []
    for column in probes.with_unit("K"):
        at = np.nanargmax(column.values)
        rows.append(
            (
                f"thermocouple {column.name}: peak",
                f"{degrees(column.values[at])} at {look.seconds(probes['time'][at])}",
            )
        )
    return rows


def last_number(column: Column) -> float:
    return float(column.values[np.isfinite(column.values)][-1])


def degrees(kelvin: float) -> str:
    return f"{kelvin:.0f} K ({kelvin - look.CELSIUS:.0f} \N{DEGREE SIGN}C)"


def amount(value: float, unit: str) -> str:
    factor, shown = look.scaled(value, unit)
    return f"{value * factor:.4g} {shown}"
