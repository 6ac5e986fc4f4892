# SPDX-License-Identifier: MIT
"""The key figures of a run, as rows (meaning, value with unit)."""

from __future__ import annotations

import numpy as np

from . import look, raster
from .run import Run
from .table import Column, Table

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
    """Flash above and groove below the top face of the first frame [mm]. A chink between particles
    is no groove: a place counts if all within a spacing of it is as low."""
    first, last = run.frames[0].points(), run.frames[-1].points()
    face = first[:, 2].max()
    low, high = first.min(axis=0) + 2 * run.spacing, first.max(axis=0) - 2 * run.spacing
    rows = [
        (
            "highest particle above the first top face",
            f"{(last[:, 2].max() - face) * look.MM:.2f} mm",
        )
    ]
    if (high > low)[:2].all():
        index, grid = raster.top_view(last, run.spacing, low, high)
        height = raster.highest_nearby(
            raster.values_on(index, last[:, 2]), round(run.spacing / grid.pixel)
        )
        if np.isfinite(height).any():
            rows.append(
                (
                    "deepest place of the surface below it",
                    f"{max(0.0, face - np.nanmin(height)) * look.MM:.2f} mm",
                )
            )
    return rows


def history_rows(history: Table) -> Rows:
    """Loads and energies: peak, and the mean over the last quarter of the time."""
    rows: Rows = []
    time = history["time"]
    late = time >= time[0] + 0.75 * (time[-1] - time[0])
    for column in history.matching(r".+_(torque|power|force(_[xyz])?)"):
        peak = column.values[np.nanargmax(np.abs(column.values))]
        rows.append(
            (
                f"{look.words(column.name)}: peak; mean of the last quarter",
                f"{amount(peak, column.unit)}; {amount(mean(column.values[late]), column.unit)}",
            )
        )
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
    for column in history.matching(r"friction_share"):
        rows.append(("friction share at the end", amount(last_number(column), column.unit)))
    return rows


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


def mean(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(values.mean()) if values.size else float("nan")


def degrees(kelvin: float) -> str:
    return f"{kelvin:.0f} K ({kelvin - look.CELSIUS:.0f} \N{DEGREE SIGN}C)"


def amount(value: float, unit: str) -> str:
    factor, shown = look.scaled(value, unit)
    return f"{value * factor:.4g} {shown}"
