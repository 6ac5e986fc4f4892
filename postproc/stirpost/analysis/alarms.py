# SPDX-License-Identifier: MIT
"""Conditions under which the results of a run can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import units, voids
from .tools import face_radius, main_tool

if TYPE_CHECKING:
    from ..run import Run

GREEN, AMBER, RED = "green", "amber", "red"
PACKING = 5.0, 15.0    # excess of the fill of the room [%]; a slot of a tenth of the pin's section has 18
AUDIT = 1.0, 5.0  # error of the energy balance, and of conduction: above the first amber, above the second red [%]
INERTIA = 5.0  # inertial over flow stress, unless the input says another INERTIAL_FRACTION [%]; red above four times that
MELT = 1.0  # of the metal at once: above it is red [%]
SLEEP = 0.1, 1.0  # energy lost in sleeping metal, of the energy exchanged [%]
CELLS = 5.0, 3.0  # over the radius of the tool: below the first amber, below the second red


@dataclass
class Check:
    """One condition of trust, the sections of the page that have more of it, and a sentence where it is not green."""

    name: str
    value: str
    level: str
    sections: tuple[str, ...]
    text: str = ""


def checks(run: Run) -> list[Check]:
    """All checks for which the run has data."""
    found = (run.attempt(f"the check {check.__name__}", check, run) for check in (weld, ended, audit, packing, inertia, loads, melting, cells, sleep))
    return [check for check in found if check is not None]


def alarms(run: Run) -> list[str]:
    """Messages of the checks that are not met; empty if all are met."""
    return [check.text for check in checks(run) if check.text] + run.faults


def verdict(found: list[Check]) -> tuple[str, str]:
    """The worst level, and the checks that have it."""
    for level, words in ((RED, "The figures are not to be trusted"), (AMBER, "Use the figures with care")):
        names = [check.name for check in found if check.level == level]
        if names:
            return level, f"{words}: {', '.join(names)}."
    return GREEN, "The figures may be trusted: all checks are passed."


def level_of(value: float, amber: float, red: float) -> str:
    return RED if value > red else AMBER if value > amber else GREEN


def weld(run: Run) -> Check | None:
    """Whether the metal closes behind the tool; None without a track."""
    found = voids.of_run(run)
    if found is None:
        return None
    level, words = found.verdict()
    value = "closed" if level == GREEN else f"{'loose metal, lacks' if found.all[0].kind == 'loose' else 'largest void'} {units.mm(found.all[0].area, 2, 2)}"
    text = "" if level == GREEN else f"{words} Torque and force are those of a tool that leaves voids, not of a sound weld."
    return Check("weld", value, level, ("Voids", "Metal"), text)


def ended(run: Run) -> Check:
    sections = "Over time", "All figures"
    if (run.directory / f"{run.name}_broken.h5").is_file():
        return Check("run", "broken down", RED, sections, f"The run broke down: its last state is in {run.name}_broken.h5.")
    times = [frame.time for frame in run.frames[-1:]]
    if run.history:
        times.append(float(run.history["time"][-1]))
    reached, end = max(times), run.scene.get("TIME.END")
    if run.summary is None:
        return Check("run", "not ended", AMBER, sections, "The run has not ended, or was killed: there is no summary. "
                     f"Results reach to {units.seconds(reached)}.")
    if end is not None and reached < end * (1.0 - 1e-6):
        return Check("run", "stopped early", AMBER, sections, f"The run stopped at {units.seconds(reached)} of {units.seconds(end)}.")
    return Check("run", f"ended at {units.seconds(reached)}", GREEN, sections)


def audit(run: Run) -> Check | None:
    energy, conduction = largest_of(run, "audit_error"), largest_of(run, "conduction_error")
    if energy is None and conduction is None:
        return None
    text = []
    if (energy or 0.0) > AUDIT[0]:
        text.append(f"The energy balance is off by up to {energy:.3g} %.")
    if (conduction or 0.0) > AUDIT[0]:
        text.append(f"Conduction loses or gains up to {conduction:.3g} % of the heat exchanged.")
    worst = max(energy or 0.0, conduction or 0.0)
    return Check("energy audit", f"{worst:.2g} %", level_of(worst, *AUDIT), ("Over time", "All figures"), " ".join(text))


def packing(run: Run) -> Check | None:
    largest = largest_of(run, "packing")
    if largest is None:
        return None
    text = f"Particles are packed: they fill up to {largest:.3g} % more than the room that they have, beyond their disorder. Pressure and friction there are wrong."
    level = level_of(largest, *PACKING)
    return Check("packing", f"{largest:.2g} %", level, ("Over time", "All figures"), "" if level == GREEN else text)


def limit_of_inertia(run: Run) -> float:
    """In percent."""
    return 100.0 * (run.scene.get("TIME.INERTIAL_FRACTION") or 0.01 * INERTIA)


def inertia(run: Run) -> Check | None:
    largest = largest_of(run, "inertial_stress_over_flow")
    if largest is None:
        return None
    limit = limit_of_inertia(run)
    scaled = run.scene.get("TIME.MASS_SCALING")
    sections = "Over time", "All figures"
    if largest <= limit or (scaled is not None and scaled <= 1.0) or (scaled is None and run.input_text):
        return Check("inertial stress", f"{largest:.2g} % of the flow stress", GREEN, sections)
    level, parts = level_of(largest, limit, 4.0 * limit), parts_of_loads(run)
    if level == RED and parts is not None and parts[0] <= limit:
        level = AMBER  # single particles, at the rim of a tool that turns fast: the loads do not notice
    return Check("inertial stress", f"{largest:.3g} % of the flow stress", level, sections,
                 f"Mass scaling: the inertial stress of a particle reached {largest:.3g} % of its flow stress, {limit:.3g} % are small enough. "
                 "Flow may be wrong there; a smaller MASS_SCALING tells.")


def largest_load(run: Run, parts: tuple[str, ...]) -> float:
    """The largest load on all tools together, over the rows of the history."""
    names = [column.name.removesuffix("_torque") for column in run.history.columns if column.name.endswith("_torque")]
    return float(np.nanmax(sum((np.sqrt(sum(run.history[f"{name}_{part}"] ** 2 for part in parts)) for name in names), np.zeros(1))))


def parts_of_loads(run: Run) -> tuple[float, float] | None:
    """What mass scaling adds to the loads of the tools, the largest of any row [%]: inertial force over the largest force or power over
    the largest power, and the part of the force on metal that the tools have not reached (0 in older histories). None without mass scaling."""
    force, power = largest_of(run, "inertial_force"), largest_of(run, "inertial_power")
    scaled = run.scene.get("TIME.MASS_SCALING")
    if force is None or power is None or (scaled or 1.0) <= 1.0:
        return None
    early = float(np.nanmax(sum((column.values for column in run.history.matching(".*_early_force")), np.zeros(1))))
    of_force, of_power = largest_load(run, ("force_x", "force_y", "force_z")), largest_load(run, ("power",))
    inertial = max((mine / of_all for mine, of_all in ((force, of_force), (power, of_power)) if of_all > 0.0), default=0.0)
    return 100.0 * inertial, 100.0 * early / of_force if of_force > 0.0 else 0.0


def loads(run: Run) -> Check | None:
    """The error of the loads of the tools by mass scaling, which the inertial part and the part on metal not reached bound together. The
    second is 1.2 to 9 times the error in tests: it is told, and the level is that of the first."""
    parts = parts_of_loads(run)
    if parts is None:
        return None
    inertial, early = parts
    limit = limit_of_inertia(run)
    return Check("inertia in the loads", f"{inertial:.2g} %, on metal not reached at most {early:.2g} %", level_of(inertial, limit, 4.0 * limit),
                 ("Over time", "All figures"), "" if inertial <= limit else
                 f"Mass scaling: {inertial:.3g} % of the largest force or power of the tools accelerate metal; where a load rises it may be wrong "
                 f"by so much, {limit:.3g} % are small enough. A smaller MASS_SCALING or a MASS_SCALING_RANGE tells.")


def melting(run: Run) -> Check | None:
    """From the summary of the run, which knows the melting points."""
    if not run.summary:
        return None
    share, over = (number(run.summary.get(key)) for key in ("melted_share_max", "hottest_over_melting_K"))
    sections = "Temperature", "Process", "All figures"
    if not (share > 0 or over > 0):
        return Check("melting", "none", GREEN, sections)
    parts = [f"up to {100 * share:.3g} % of it at once"] if share > 0 else []
    parts += [f"the hottest place by {over:.0f} K"] if over > 0 else []
    return Check("melting", parts[0].replace(" of it", ""), RED if 100 * share > MELT else AMBER, sections,
                 f"Metal was hotter than its melting point: {', '.join(parts)}. Melt has no strength and no latent heat here.")


def cells(run: Run) -> Check | None:
    tool = main_tool(run.history)
    if tool is None or not (count := face_radius(run, tool) / run.cell) > 0.0:
        return None
    level = level_of(-count, -CELLS[0], -CELLS[1])
    text = "" if level == GREEN else (f"The grid has {count:.2g} cells over the radius of the tool: temperatures, force and torque "
                                      f"need {CELLS[0]:.0f} or more.")
    return Check("cells over the radius of the tool", f"{count:.3g}", level, ("Input", "All figures"), text)


def sleep(run: Run) -> Check | None:
    lost = largest_of(run, "sleep_loss")
    if lost is None:
        return None
    works = [np.abs(column.values) for column in run.history.matching("(tool|body|wall)_work")]
    turned = float(np.nanmax(np.sum(works, axis=0))) if works else 0.0
    part = 100.0 * lost / turned if turned > 0.0 else 0.0
    level = level_of(part, *SLEEP)
    text = "" if level == GREEN else (f"Sleeping metal has taken {part:.2g} % of the energy exchanged: lower SLEEP_STRESS, or "
                                      "SLEEPING = off.")
    return Check("loss by sleep", f"{part:.2g} %", level, ("Over time", "All figures"), text)


def largest_of(run: Run, name: str) -> float | None:
    """Largest magnitude of a column of the history, None without it."""
    column = run.history.column(name)
    return None if column is None else float(np.nanmax(np.abs(column.values)))


def number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) and np.isfinite(value) else 0.0
