# SPDX-License-Identifier: MIT
"""What a reader must know before trusting the figures of a run."""

from __future__ import annotations

import numpy as np

from . import look
from .run import Run

AUDIT = 1.0  # largest error of the energy balance that needs no word [%]
INERTIA = 5.0  # inertial over flow stress, unless the input says another INERTIAL_FRACTION [%]
CONDUCTION = 1.0  # [%]


def alarms(run: Run) -> list[str]:
    """Sentences, the gravest first; none if all is well."""
    return [*ended_badly(run), *melting(run), *inertia(run), *balances(run), *gaps(run)]


def ended_badly(run: Run) -> list[str]:
    if (run.directory / f"{run.name}_broken.h5").is_file():
        return [f"The run broke down: its last state is in {run.name}_broken.h5."]
    times = [frame.time for frame in run.frames[-1:]]
    if run.history is not None:
        times.append(float(run.history["time"][-1]))
    reached, end = max(times), run.setting("TIME", "END")
    if run.summary is None:
        return [f"The run has not ended, or was killed: there is no summary. Results reach to {look.seconds(reached)}."]
    if end is not None and reached < end * (1.0 - 1e-6):
        return [f"The run stopped at {look.seconds(reached)} of {look.seconds(end)}."]
    return []


def melting(run: Run) -> list[str]:
    """From the summary of the run, which knows the melting points."""
    known = run.summary or {}
    share, over = (number(known.get(key)) for key in ("melted_share_max", "hottest_over_melting_K"))
    if not (share > 0 or over > 0):
        return []
    parts = [f"up to {100 * share:.3g} % of it at once"] if share > 0 else []
    parts += [f"the hottest place by {over:.0f} K"] if over > 0 else []
    return [f"Metal was hotter than its melting point: {', '.join(parts)}. Melt has no strength and no latent heat here."]


def inertia(run: Run) -> list[str]:
    largest = largest_of(run, "inertial_stress_over_flow")
    limit = 100.0 * (run.setting("TIME", "INERTIAL_FRACTION") or 0.01 * INERTIA)
    scaled = run.setting("TIME", "MASS_SCALING")
    if largest <= limit or (scaled is not None and scaled <= 1.0) or (scaled is None and run.input_text):
        return []
    return [
        f"Mass scaling: the inertial stress reached {largest:.3g} % of the flow stress, {limit:.3g} % are small enough. "
        "Forces and flow may be too large there; a smaller MASS_SCALING tells."
    ]


def balances(run: Run) -> list[str]:
    found = []
    audit, conduction = largest_of(run, "audit_error"), largest_of(run, "conduction_error")
    if audit > AUDIT:
        found.append(f"The energy balance is off by up to {audit:.3g} %.")
    if conduction > CONDUCTION:
        found.append(f"Conduction loses or gains up to {conduction:.3g} % of the heat turned over.")
    return found


def gaps(run: Run) -> list[str]:
    """Values of the history that are no numbers."""
    if run.history is None:
        return []
    bad = [look.words(c.name) for c in run.history.columns if not np.isfinite(c.values).all()]
    return [f"The history has values that are no numbers: {', '.join(bad[:5])}{' ...' * (len(bad) > 5)}."] if bad else []


def largest_of(run: Run, name: str) -> float:
    """Largest magnitude of a column of the history, 0 without it."""
    if run.history is None:
        return 0.0
    return max((float(np.nanmax(np.abs(c.values))) for c in run.history.matching(name)), default=0.0)


def number(value) -> float:
    return float(value) if isinstance(value, (int, float)) and np.isfinite(value) else 0.0
