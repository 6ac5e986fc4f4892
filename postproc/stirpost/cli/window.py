# SPDX-License-Identifier: MIT
"""The process window of a weld: which rotational and travel speeds, and forces, make it sound.

usage: stirpost window INPUT --rpm 600:3000:5 --speed 5:33:5 [--force 6:12:3] [--max-force 15] [--max-torque 60] [-o DIR] [--slurm]

LOW:HIGH:COUNT are evenly spaced values, A,B,C those that are named: rotational speed in 1/min, travel speed in mm/s, force in kN. INPUT is a weld
whose tool travels in a phase (&MOTION). Of each setting the phases keep their ways: a phase that travels at another speed takes another
time, as does the run. --force replaces the FORCE of the phases that have one. A setting that has been computed is not computed again, so that a
window which was stopped goes on. --slurm: as a job array, as `stirpost sweep`.

Written to DIR (default INPUT's stem_window): window.csv, a row a setting, and window.png, a map for each force with contours of
axial force, torque, power and temperature. The first of these that is true names a setting: broke down (the run failed),
beyond the machine (mean force or torque in travel above --max-force, --max-torque), above solidus (metal above its melting point, by the
summary of the run), groove, lack of fill, tunnel, loose metal (the largest void), small voids (pores, or less loose metal than is resolved), flash (metal above the
sheet is more than --flash of the section of the sheet under the shoulder), closed. Where no track is behind the tool yet: no track.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import summary, voids
from ..analysis.tools import face_radius, main_tool
from ..io.files import write
from ..io.program import Failed
from ..io.scene import Scene
from ..plots import look
from ..run import Run
from . import sweep

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AXES = {"rpm": "rotational speed [1/min]", "speed": "travel speed [mm/s]", "force": "force [kN]"}
# Names of settings, the first that is true counts, with their colours.
NAMES = {"broke down": "#8a96a3", "beyond the machine": "#b48ccb", "above solidus": "#e8836b", "groove": "#f2b25c", "lack of fill": "#f5d76e",
         "tunnel": "#f7e9a0", "loose metal": "#d9d2c0", "small voids": "#dfeeb5", "flash": "#a9cfe8", "no track": "#ffffff", "closed": "#9fd4a8"}
CONTOURS = {"axial force, mean [N]": (1e-3, "axial force [kN]"), "torque, mean [N m]": (1.0, "torque [N m]"),
            "power, mean [W]": (1e-3, "power [kW]"), "highest temperature [K]": (1.0, "highest temperature [{}]")}
FOUND = "result"


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost window", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", type=Path)
    parser.add_argument("--rpm", required=True, metavar="LOW:HIGH:COUNT", help="rotational speeds [1/min]")
    parser.add_argument("--speed", required=True, metavar="LOW:HIGH:COUNT", help="travel speeds [mm/s]")
    parser.add_argument("--force", metavar="LOW:HIGH:COUNT", help="axial forces [kN]")
    parser.add_argument("--max-force", type=float, default=np.inf, metavar="KN", help="of the machine [kN]")
    parser.add_argument("--max-torque", type=float, default=np.inf, metavar="NM", help="largest torque of the machine [N m]")
    parser.add_argument("--flash", type=float, default=10.0, metavar="PERCENT", help="flash, in percent of the section of the sheet under the shoulder, above which a setting is not sound (default 10)")
    parser.add_argument("--degrees", choices=list(look.SCALES), default="K")
    sweep.add_how(parser)
    options = parser.parse_args(arguments)
    look.use_degrees(options.degrees)
    plan = Plan.of(Scene.read(options.input))
    axes = {name: values_of(getattr(options, name), name) for name in AXES if getattr(options, name) is not None}
    output = options.output or Path(f"{options.input.stem}_window")
    output.mkdir(parents=True, exist_ok=True)
    rows, left = [], list[str]()
    for values in itertools.product(*axes.values()):
        setting = dict(zip(axes, values))
        directory = output / f"{'_'.join(f'{name}={value:g}' for name, value in setting.items())}.out"
        try:
            if sweep.case(options, directory, plan.keys(**setting), left):
                rows.append({AXES[name]: value for name, value in setting.items()} | judged(Run(directory), options))
        except Failed as problem:
            if problem.status != 3:  # a mistake of the input, or no room: so it will be with the others
                raise
            print(f"{directory}: broke down")
            rows.append({AXES[name]: value for name, value in setting.items()} | {FOUND: "broke down"})
    if rows:
        import pandas as pd

        table = pd.DataFrame(rows)
        write(output / "window.csv", table.to_csv(index=False))
        with look.style():
            look.save(picture(table), output / "window.png")
        print(*(f"{name}: {summary.counted(int(count), 'setting')}" for name, count in table[FOUND].value_counts().items()), sep="\n")
        print(f"{output}: window.csv, window.png")
    if left:
        print(f"{summary.counted(len(left), 'run')} left:", sweep.array(options, output, left), sep="\n")
    return 0


def values_of(text: str, name: str) -> list[float]:
    """LOW:HIGH:COUNT or A,B,C: numbers above 0."""
    try:
        if ":" in text:
            low, high, count = text.split(":")
            found = np.linspace(float(low), float(high), int(count)).round(9).tolist()
        else:
            found = [float(word) for word in text.split(",")]
    except ValueError:
        found = []
    if not found or not all(np.isfinite(value) and value > 0.0 for value in found) or len(set(found)) < len(found):
        raise ValueError(f"--{name} {text}: expected LOW:HIGH:COUNT or A,B,C, numbers above 0")
    return sorted(found)


@dataclass
class Phase:
    """One &MOTION: its number from 1, velocity [m/s] and duration [s], and which of its keys change."""

    number: int
    velocity: np.ndarray
    duration: float
    open_end: bool
    spin: float
    force: float | None

    @property
    def travels(self) -> bool:
        return bool(np.hypot(*self.velocity[:2]) > abs(self.velocity[2]))


@dataclass
class Plan:
    """The phases of the tool, and when the run ends [s]."""

    phases: list[Phase]
    end: float

    @classmethod
    def of(cls, scene: Scene) -> Plan:
        end = scene.get("TIME.END")
        groups = scene.groups("motion")
        tools = {str(group.get("tool", "")).lower() for group in groups}
        if end is None or not groups or len(tools) > 1:
            raise ValueError("a window needs an input with TIME.END and the &MOTION phases of one tool")
        phases, start = [], 0.0
        for number, group in enumerate(groups, 1):
            given = group.get("duration")
            velocity = np.zeros(3)
            given_velocity = np.atleast_1d(group.get("velocity", 0.0)).astype(float)
            velocity[:len(given_velocity)] = given_velocity
            length = float(end) - start if given is None else min(float(given), float(end) - start)
            phases.append(Phase(number, velocity, max(length, 0.0), given is None, float(group.get("spin_rpm", 0.0)), group.get("force")))
            start += length
        if not any(phase.travels and phase.duration > 0.0 for phase in phases):
            raise ValueError("no &MOTION of the input travels: its VELOCITY has no part along x and y that is larger than that along z")
        return cls(phases, float(end))

    def keys(self, rpm: float, speed: float, force: float | None = None) -> dict[str, str]:
        """Values of --set for a point of the window."""
        found, end = {}, self.end
        for phase in self.phases:
            if phase.spin:
                found[f"MOTION({phase.number}).SPIN_RPM"] = f"{np.copysign(rpm, phase.spin):.9g}"
            if phase.travels:
                ratio = 1e-3 * speed / np.hypot(*phase.velocity[:2])
                found[f"MOTION({phase.number}).VELOCITY"] = " ".join(f"{v:.9g}" for v in ratio * phase.velocity)
                if not phase.open_end:
                    found[f"MOTION({phase.number}).DURATION"] = f"{phase.duration / ratio:.9g}"
                end += phase.duration / ratio - phase.duration
            if phase.force is not None and force is not None:
                found[f"MOTION({phase.number}).FORCE"] = f"{1e3 * force:.9g}"
        if force is not None and not any(phase.force is not None for phase in self.phases):
            raise ValueError("--force: no &MOTION of the input has a FORCE")
        return found | {"TIME.END": f"{end:.9g}"}


def judged(run: Run, options: argparse.Namespace) -> dict:
    """The measures of a run, and the classification of its setting."""
    found = summary.measures(run)
    thin = flash_share(run, found.get("flash [mm3]"))
    if thin is not None:
        found["flash over the section under the shoulder [%]"] = thin
    return {FOUND: name_of(run, found, options)} | found


def flash_share(run: Run, flash: float | None) -> float | None:
    """Metal above the sheet per length of travel, over the section of the sheet under the shoulder [%]; the way is that of the middle of the tool and its width."""
    tool = main_tool(run.history)
    if flash is None or tool is None or not (radius := face_radius(run, tool)) > 0.0:
        return None
    points = run.frames[0].points()[:, 2]
    way = np.linalg.norm((tool.place(run.history["time"][-1]) - tool.place(run.history["time"][0]))[:2]) + 2.0 * radius
    return float(100.0 * flash * 1e-9 / (way * 2.0 * radius * (np.ptp(points) + run.spacing)))


def name_of(run: Run, found: dict, options: argparse.Namespace) -> str:
    over = (run.summary or {}).get("hottest_over_melting_K") or 0.0
    if abs(found.get("axial force, mean [N]", 0.0)) > 1e3 * options.max_force or abs(found.get("torque, mean [N m]", 0.0)) > options.max_torque:
        return "beyond the machine"
    if over > 0.0:
        return "above solidus"
    track = voids.of_run(run)
    if track is None:
        return "no track"
    for kind, name in (("open", "groove"), ("root", "lack of fill"), ("closed", "tunnel"), ("loose", "loose metal")):
        if any(void.kind == kind and not track.is_minor(void) for void in track.all):
            return name
    if track.all:
        return "small voids"
    return "flash" if found.get("flash over the section under the shoulder [%]", 0.0) > options.flash else "closed"


def picture(table: pd.DataFrame) -> Figure:
    """Maps of the classification of the settings, with contours of loads and temperature; a row for each force."""
    from matplotlib.patches import Patch

    forces = sorted(table[AXES["force"]].unique()) if AXES["force"] in table else [None]
    shown = [name for name in CONTOURS if name in table and table[name].notna().any()] or [""]
    figure = look.new_figure(1.0 + 3.3 * len(shown), 0.9 + 2.9 * len(forces))
    axes = figure.subplots(len(forces), len(shown), squeeze=False, sharex=True, sharey=True)
    for axis in axes[-1]:
        axis.set_xlabel(AXES["rpm"])
    for line, force in zip(axes, forces):
        part = table if force is None else table[table[AXES["force"]] == force]
        for axis, name in zip(line, shown):
            draw(axis, part, name)
        line[0].set_ylabel(AXES["speed"] if force is None else f"{force:g} kN: {AXES['speed']}")
    there = [name for name in NAMES if (table[FOUND] == name).any()]
    figure.legend(handles=[Patch(facecolor=NAMES[name], edgecolor=look.INK, linewidth=0.5, label=name) for name in there],
                  loc="outside lower center", ncols=len(there))
    return figure


def draw(axis: Axes, part: pd.DataFrame, name: str) -> None:
    """Settings as fields of their colours around their places, and contours of a quantity, if there is one."""
    from matplotlib.colors import ListedColormap

    grid = part.pivot(index=AXES["speed"], columns=AXES["rpm"], values=FOUND)
    kinds = list(NAMES)
    number = np.array([[kinds.index(word) if isinstance(word, str) else np.nan for word in row] for row in grid.to_numpy(dtype=object)], dtype=float)
    rpm, speed = grid.columns.to_numpy(dtype=float), grid.index.to_numpy(dtype=float)
    axis.pcolormesh(edges(rpm), edges(speed), number, cmap=ListedColormap(list(NAMES.values())), vmin=-0.5, vmax=len(kinds) - 0.5,
                    edgecolors="white", linewidth=0.8)
    axis.plot(*(x.ravel() for x in np.meshgrid(rpm, speed)), ".", color=look.INK, markersize=3)
    axis.set_xticks(rpm)
    axis.set_yticks(speed)
    if not name:
        return
    factor, label = CONTOURS[name]
    values = part.pivot(index=AXES["speed"], columns=AXES["rpm"], values=name).to_numpy(dtype=float)
    values = look.shown("temperature", values) if "temperature" in label else np.abs(values)
    axis.set_title(label.format(look.unit_of_temperature()), loc="left")
    if min(values.shape) > 1 and np.isfinite(values).sum() > 3 and np.nanmax(values) > np.nanmin(values):
        lines = axis.contour(rpm, speed, np.ma.masked_invalid(factor * values), levels=6, colors=look.INK, linewidths=0.9)
        axis.clabel(lines, fmt="%.3g", fontsize=8)
    else:
        for x, y, value in ((x, y, values[j, i]) for j, y in enumerate(speed) for i, x in enumerate(rpm)):
            axis.annotate(f"{factor * value:.3g}" if np.isfinite(value) else "", (x, y), (0, 5), textcoords="offset points", ha="center", fontsize=8)


def edges(places: np.ndarray) -> np.ndarray:
    """Bounds half way between places; of one place, a tenth of it around it."""
    if len(places) == 1:
        return places[0] * np.array([0.95, 1.05])
    middle = 0.5 * (places[1:] + places[:-1])
    return np.concatenate([[2 * places[0] - middle[0]], middle, [2 * places[-1] - middle[-1]]])
