#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What the constants of contact, sleep, drives and graded cells are worth: each at half and twice its value, on rows of verification.

usage: tests/verification/ablation.py [--list] [--only CONSTANT]... [--rows ROW]... [--scratch DIR] [--json FILE]
       tests/verification/ablation.py --table FILE       the table of measured results, for ablation.md

The sources are copied to DIR (a new one if none is given; a second call with the same DIR builds only what changed), changed there,
built, and run. A row is a problem of verify.py at one resolution; its figures have an exact value or that of the unchanged program, and a
tolerance: what is asked of them. A constant matters where half or twice its value moves a figure by more than that.
"""

import argparse
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import exact  # noqa: E402
import numpy as np  # noqa: E402
import problems  # noqa: E402
from problems.base import Problem, driver, values  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOOL, BODIES, SLEEP, GRADED, DRIVE = "tool", "bodies", "sleep", "graded", "drive"

# Constant: which rows, file, text, what takes its place for half and twice.
PARTICLES, LIMITS, IMPULSES = (f"modules/contact/tool_{name}.f90" for name in ("particles", "limits", "impulses"))
NORMALS, PAIRS, SURFACES, NODE_PAIRS = (
    f"modules/contact/{name}.f90" for name in ("body_normals", "body_pairs", "body_surfaces")) + ("modules/state/node_pairs.f90",)
CRITERIA, KEYS = "modules/sleep/criteria.f90", "modules/setup/keys.f90"


def number(name, value, half, twice):
    """A parameter of kind rp: its text, and those with half and twice its value."""
    return tuple(f":: {name} = {text}_rp" for text in (value, half, twice))


CONSTANTS = {
    "min_load_return": (TOOL, IMPULSES, *number("min_load_return", "1.0e-3", "0.5e-3", "2.0e-3")),
    "band": (TOOL, IMPULSES, *number("band", "3.51", "3.01", "7.01")),
    "slop": (TOOL, PARTICLES, *number("slop", "0.02", "0.01", "0.04")),
    "relaxation": (TOOL, PARTICLES, *number("relaxation", "60.0", "30.0", "120.0")),
    "recovery_speed": (TOOL, PARTICLES, *number("recovery_speed", "3.0e-3", "1.5e-3", "6.0e-3")),
    "friction_distance": (TOOL, PARTICLES, *number("friction_distance", "0.5", "0.25", "1.0")),
    "edge_pressure": (TOOL, LIMITS, *(f":: edge_pressure = {part}" for part in (
        "2.0_rp + pi", "0.5_rp*(2.0_rp + pi)", "2.0_rp*(2.0_rp + pi)"))),
    "min_rise": (TOOL, LIMITS, *number("min_rise", "1.0", "0.5", "2.0")),
    "min_softening": (TOOL, LIMITS, *number("min_softening", "1.0e-4", "0.5e-4", "2.0e-4")),
    "min_sensitivity": (TOOL, LIMITS, *number("min_sensitivity", "1.0e-3", "0.5e-3", "2.0e-3")),
    "min_slope": (TOOL, LIMITS, *number("min_slope", "1.0e-3", "0.5e-3", "2.0e-3")),
    "mu_saturated": (TOOL, "modules/tools/law.f90", *number("mu_saturated", "1.0e3", "0.5e3", "2.0e3")),
    "ridge": (BODIES, NORMALS, *(f":: ridge = {part}sqrt(epsilon" for part in ("", "0.5_rp*", "2.0_rp*"))),
    "overlap": (BODIES, NORMALS, *number("overlap", "0.02", "0.01", "0.04")),
    "min_gap_gain": (BODIES, SURFACES, *number("min_gap_gain", "1.0e-3", "0.5e-3", "2.0e-3")),
    "min_weight": (BODIES, NODE_PAIRS, *number("min_weight", "1.0e-6", "0.5e-6", "2.0e-6")),
    "withheld_fraction": (BODIES, PAIRS, *number("withheld_fraction", "0.05", "0.025", "0.1")),
    "slack": (BODIES, PAIRS, *number("slack", "0.05", "0.025", "0.1")),
    "apart": (SLEEP, CRITERIA, *number("apart", "3.5", "1.75", "7.0")),
    "sleep_check_interval": (SLEEP, CRITERIA, *(f":: sleep_check_interval = {steps} " for steps in (200, 100, 400))),
    "max_deferred_fraction": (SLEEP, CRITERIA, *number("max_deferred_fraction", "0.05", "0.025", "0.1")),
    "edge": (SLEEP, "modules/sleep/cubes.f90", *(f":: edge = {cells} " for cells in (2, 1, 4))),
    "negligible": (SLEEP, "modules/sleep/held_layer.f90", *number("negligible", "1.0e-9", "0.5e-9", "2.0e-9")),
    "SLEEP_STRESS": (SLEEP, KEYS, *(f"'{part} if SLEEPING = auto or on', '(0,1)'" for part in ("1e-2", "5e-3", "2e-2"))),
    "SLEEP_HEAT": (SLEEP, KEYS, *(f"'{kelvin} if SLEEPING = auto or on', '(0,inf)'" for kelvin in (20, 10, 40))),
    "GROWTH": (GRADED, KEYS, *(f"'{growth} if GRADED = x or y or z', '[1,2]'" for growth in ("1.2", "1.1", "1.4"))),
    "smoothing": (GRADED, "modules/heat/nodes.f90", *number("smoothing", "0.3", "0.15", "0.6")),
    "averaging_cells": (DRIVE, "modules/step/drives.f90", *(f":: averaging_cells = {cells} " for cells in (12, 6, 24))),
}


class Row:
    """A problem at one resolution, with the figures that are looked at: {name: (exact, tolerance)}. 'error' is that of the
    problem; exact None is what the unchanged program has, the tolerance a part of it."""

    def __init__(self, name, problem, n, figures, parameters=(), sets=None, grading=None):
        self.name, self.problem, self.n, self.figures, self.sets, self.grading = name, problem, n, figures, sets, grading
        self.parameters = dict(parameters)

    def measure(self):
        """{figure: value}, not a number where the run broke down."""
        problem = OTHERS.get(self.problem) or problems.ALL[self.problem]
        with tempfile.TemporaryDirectory() as folder:
            try:
                error, figures, _ = problem.solve(self.n, problem.parameters | self.parameters, folder, self.sets, timeout=900, grading=self.grading)
            except AssertionError:
                return dict.fromkeys(self.figures, math.nan)
        return {name: float((figures | {"error": error})[name]) for name in self.figures}


ASLEEP = {"force": (1.0, 0.01), "torque": (1.0, 0.01), "plastic work": (1.0, 0.02), "hotter [K]": (0.0, 3.0), "sleep loss/work": (0.0, 1e-3),
          "awake": (None, 0.1), "time": (None, 0.1)}
STICK = {"friction": 1000.0, "slowness": 3.0}
ROWS = {
    TOOL: (
        Row("plane punch, 5", "punch_plane", 5, {"error": (0.0, 0.03), "ripple": (0.0, 0.03)}),
        Row("round punch, 5", "punch_circle", 5, {"error": (0.0, 0.03), "ripple": (0.0, 0.03)}),
        Row("elastic punch, 2", "punch_elastic", 2, {"error": (0.0, 0.03)}),
        Row("sliding disc, 6", "tool_torque", 6, {"torque": (1.0, 0.02), "force": (1.0, 0.02)}),
        Row("sticking disc, 6", "tool_torque_stick", 6, {"torque": (1.0, 0.02), "loss": (0.0, 0.01)}, STICK),
        Row("the same, true mass", "tool_torque_stick", 6, {"torque": (1.0, 0.02), "loss": (0.0, 0.01)}, STICK | {"scaling": 1.0}),
        Row("pushed block, 1", "friction_block", 1, {"error": (0.0, 0.01), "turned [rad]": (0.0, 1e-4)}),
        Row("block on a slope, 4", "incline_block", 4, {"error": (0.0, 0.02)}),
        Row("rolling cylinder, 16", "incline_cylinder", 16, {"error": (0.0, 0.02)}),
        Row("Hertz, line, 40", "hertz_line", 40, {"error": (0.0, 0.05)}),
        Row("bar on a plane, 50", "bar_impact", 50, {"error": (0.0, 0.03)}),
        Row("Taylor, 6", "taylor", 6, {"foot [mm]": (None, 0.04), "loss": (0.0, 0.04)}),
        Row("groove, 4", "groove", 4, {"undisplaced": (0.0, 0.02), "contact loss/work": (0.0, 0.02)}),
        Row("stirred layer, 5", "stirred_layer", 5, {"tau": (1.0, 0.05), "work": (1.0, 0.05)}),
        Row("disc on a plate, 4", "face_on_plate", 4, {"torque": (1.0, 0.03), "area": (1.0, 0.025), "force": (None, 0.03)}),
    ),
    BODIES: (
        Row("discs, 8, six grids", "discs", 8, {"energy lost": (0.0, 0.02), "gained": (0.0, 1e-3), "touch/h": (0.0, 0.1)}),
        *(Row(f"discs anyhow {k}", "discs_anyhow", 8, {"lost": (0.0, 0.02), "gained": (0.0, 2e-3), "spin": (1.0, 2e-2 if friction else 3e-3)},
              {"seed": k, "friction": friction}) for k, friction in ((1, 0.0), (2, 0.3), (3, 0.0), (4, 0.6))),
        Row("the same by regression", "discs_anyhow", 8, {"lost": (0.0, 0.02), "gained": (0.0, 2e-3), "spin": (1.0, 3e-3)},
            {"seed": 5}, {"CONTACT.NORMAL": "regression"}),
        Row("slow discs, 10", "discs_nairn", 10, {"error": (0.0, 0.02)}),
        Row("spheres, 12", "hertz_impact", 12, {"approach": (None, 0.05), "energy lost": (0.0, 0.05)}),
        Row("block on a slab", "block_on_slab", 1, {"speed": (1.0, 5e-3), "force": (1.0, 5e-3)}),
        Row("the same, B-splines", "block_on_slab", 1, {"speed": (1.0, 5e-3), "force": (1.0, 5e-3)}, sets={"METHOD.SHAPE": "bspline"}),
        Row("box of particles, 8", "box_of_particles", 8, {"force": (None, 0.02)}),
    ),
    SLEEP: tuple(Row(f"pass in cells of {cell} mm, {scaling:.0e}, {end} s", "slow_pass", cell, ASLEEP, {"scaling": scaling, "end": end})
                 for cell, scaling, end in ((6.0, 1e3, 2.0), (4.8, 1e4, 6.0), (4.0, 1e5, 12.0), (2.0, 1e6, 3.0))),
    GRADED: (
        *(Row(f"{problem}, {n}", problem, n, {"error": (0.0, 5e-3)}, grading=("x", 0.25, *fine)) for problem, n, fine in (
            ("heat_fixed", 16, (0.3, 0.5)), ("heat_step", 20, (0.45, 0.55)), ("heat_robin", 16, (0.7, 1.0)))),
        Row("Hertz, line, 40", "hertz_line", 40, {"error": (0.0, 0.05)}, sets={"BODY.LATTICE": "body"}, grading=("z", 0.25, 0.0, 0.1)),
        Row("Taylor, 4", "taylor", 4, {"foot [mm]": (None, 0.04), "loss": (0.0, 0.04)}, grading=("z", 0.25, 0.0, 0.1)),
        Row("stirred plate", "stirred_flat", 4, {"force": (1.0, 0.01), "torque": (1.0, 0.01), "hottest [K]": (0.0, 5.0),
                                                 "coldest [K]": (0.0, 5.0), "particles": (None, 1.0)}),
    ),
    DRIVE: (
        Row("plunge until 20 kN", "plunge_until", 1, {"force": (1.0, 0.25), "time [ms]": (None, 0.05)}),
        Row("the same, at a third of the speed", "plunge_until", 1, {"force": (1.0, 0.25), "time [ms]": (None, 0.05)}, {"speed": 1e-3}),
        Row("travel under 20 kN", "plunge_until", 1, {"travel": (1.0, 0.01), "ripple": (0.0, 0.01)}),
    ),
}


class FaceOnPlate(Problem):
    """A disc that spins on a plate wider than it, of metal that hardly knows rate and temperature."""

    folder, input, name = ROOT / "benchmarks", "disc_on_plate", "face_on_plate"
    radius, factor, deep = 9.3e-3, 0.7, 50e-6

    def sets(self, n, p):
        cell = self.radius / n
        side, height = 20 * cell, 4 * cell
        return {"GRID.CELL": cell, "GRID.LOWER": values(-2 * cell, -2 * cell, -2 * cell), "TOOL.RADIUS": self.radius,
                "GRID.UPPER": values(side + 2 * cell, side + 2 * cell, height + 3 * cell), "SHAPE.UPPER": values(side, side, height),
                "CLAMP(3).LOWER": values(-1, side, -1), "CLAMP(5).LOWER": values(side, -1, -1), "TOOL.FRICTION_LAW": "shear-factor",
                "TOOL.POSITION": values(10.3 * cell, 9.6 * cell, height), "TOOL.SHEAR_FACTOR": self.factor, "TIME.END": 12e-3,
                "MOTION(1).DURATION": 4e-3, "MOTION(1).VELOCITY": values(0, 0, -self.deep / 4e-3), "MOTION(2).VELOCITY": values(0, 0, 0),
                "OUTPUT.HISTORY_INTERVAL": 5e-4, "MATERIAL.JC_A": 200e6, "MATERIAL.JC_B": 0, "MATERIAL.JC_C": 0.002,
                "MATERIAL.T_MELT": 1e4, "METHOD.SLEEPING": "on"}

    def measure(self, run, n, p):
        history = run.history()
        late = history["time[s]"] > 8e-3
        area, strength, torque, force = (history[f"disc_{name}"][late].mean() for name in (
            "face_area[m2]", "shear_strength[Pa]", "torque[Nm]", "force_z[N]"))
        face = math.pi * self.radius**2
        wanted = self.factor * strength * face * (2.0 / 3.0 * self.radius + 2.0 * self.deep)
        return abs(torque / wanted - 1.0), {"torque": torque / wanted, "area": area / face, "force": force}


class BlockOnSlab(Problem):
    """A block pushed and pressed on a rigid slab of particles."""

    folder, input, name = driver.INPUTS, "blocks", "block_on_slab"

    def sets(self, n, p):
        return {"TIME.END": 2e-3, "OUTPUT.CHECKPOINT_INTERVAL": 2e-3}

    def measure(self, run, n, p):
        history, state = run.history(), run.checkpoint()
        block = state.body == 1
        speed = state.mass[block] @ state.v[block, 0] / state.mass[block].sum()
        wanted = exact.ramped_speed(0.5 * 35.294 / 3e-3, 1e-4, 2e-3)
        return abs(speed / wanted - 1.0), {"speed": speed / wanted, "force": -history["slab_force_z[N]"][-20:].mean() / 35.294}


class BoxOfParticles(Problem):
    """A rigid box of particles pressed into an elastic block."""

    folder, input, name = driver.INPUTS, "press", "box_of_particles"

    def sets(self, n, p):
        return {"TIME.END": 4e-5, "OUTPUT.CHECKPOINT_INTERVAL": 4e-5, "TIME.CFL": 0.1, "GRID.CELL": 8e-3 / n}

    def measure(self, run, n, p):
        return 0.0, {"force": run.history()["punch_force_z[N]"][-10:].mean()}


class SlowPass(Problem):
    """The pass of cavity 1 in coarse cells, always awake and with sleepers: what they change, and what of the time is left."""

    folder, input, name = ROOT / "input", "fsp_copper_cavity1_1mm", "slow_pass"

    def sets(self, n, p):
        return {"GRID.CELL": n * 1e-3, "TIME.MASS_SCALING": p["scaling"], "TIME.ELASTIC_SCALING": 25, "TIME.END": p["end"],
                "OUTPUT.CHECKPOINT_INTERVAL": p["end"]}

    def runs(self, n, p):
        return [self.sets(n, p) | {"METHOD.SLEEPING": mode} for mode in ("off", "on")]

    def measure(self, runs, n, p):
        awake, asleep = (run.history() for run in runs)
        late = [history["time[s]"] > 0.5 * p["end"] for history in (awake, asleep)]
        figures = {short: asleep[name][late[1]].mean() / awake[name][late[0]].mean() for short, name in (
            ("force", "tool_force_z[N]"), ("torque", "tool_torque[Nm]"))}
        figures |= {"plastic work": asleep["plastic_work[J]"][-1] / awake["plastic_work[J]"][-1],
                    "hotter [K]": max(abs(probes[name][-1] - other[name][-1]) for probes, other in [[run.probes() for run in runs]]
                                      for name in probes.names if name.endswith("[K]")),
                    "sleep loss/work": asleep["sleep_loss[J]"][-1] / asleep["plastic_work[J]"][-1],
                    "awake": runs[1].summary()["awake_share"],
                    "time": runs[1].summary()["cpu_seconds"] / runs[0].summary()["cpu_seconds"]}
        return abs(figures["force"] - 1.0), figures


class StirredFlat(Problem):
    """The short stirring in cells of 4 x 4 mm, 1 mm deep in all of the plate, and graded down to it by the default growth."""

    folder, input, name = driver.INPUTS, "stir", "stirred_flat"

    def runs(self, n, p):
        both = {"METHOD.SHAPE": "bspline", "GRID.CELL": values(n * 1e-3, n * 1e-3, 1e-3), "METHOD.SLEEPING": "off", "TIME.END": 0.08,
                "OUTPUT.CHECKPOINT_INTERVAL": 0.08, "MOTION(1).VELOCITY": values(0, 0, -20e-3), "TIME.MASS_SCALING": 1e6}
        return [both, both | {"GRID.GRADED": "z", "GRID.FINE": values(8e-3, 14e-3), "GRID.LARGEST_CELL": 4e-3}]

    def measure(self, runs, n, p):
        equal, graded = (run.history() for run in runs)
        figures = {short: graded[name][-20:].mean() / equal[name][-20:].mean() for short, name in (
            ("force", "tool_force_z[N]"), ("torque", "tool_torque[Nm]"))}
        temp = [run.checkpoint().temp for run in runs]
        figures |= {"hottest [K]": temp[1].max() - temp[0].max(), "coldest [K]": temp[1].min() - 298.0, "particles": len(temp[1])}
        return abs(figures["force"] - 1.0), figures


class PlungeUntil(Problem):
    """A disc that plunges until it feels 20 kN, and travels under that force."""

    folder, input, name = driver.INPUTS, "phased", "plunge_until"
    parameters = {"speed": 3e-3}

    def sets(self, n, p):
        longer = 3e-3 / p["speed"]
        return {"MOTION(1).VELOCITY": values(0, 0, -p["speed"]), "MOTION(1).DURATION": 10e-3 * longer, "TIME.END": 24e-3 * longer,
                "OUTPUT.HISTORY_INTERVAL": 1e-4}

    def measure(self, run, n, p):
        history = run.history()
        time, force, phase = (history[name] for name in ("time[s]", "disc_force_z[N]", "disc_phase"))
        after = int(np.argmax(phase > 1))
        travel = force[phase == 3][10:]
        return 0.0, {"force": force[after - 1:after + 2].mean() / 20e3, "time [ms]": 1e3 * time[after], "travel": travel.mean() / 20e3,
                     "ripple": travel.std() / 20e3}


OTHERS = {problem.name: problem for problem in (FaceOnPlate(), BlockOnSlab(), BoxOfParticles(), SlowPass(), StirredFlat(), PlungeUntil())}


def build(scratch, jobs):
    """The program from the sources in `scratch`."""
    folder = scratch / "build"
    if not (folder / "CMakeCache.txt").exists():
        subprocess.run(["cmake", "-S", scratch, "-B", folder, "-D", "CMAKE_BUILD_TYPE=Release", "-D", "STIRPOINT_TESTS=OFF"], check=True,
                       stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder, "--parallel", str(jobs)], check=True, stdout=subprocess.DEVNULL)
    return str(folder / "stirpoint")


def measure(rows):
    """{row: {figure: value}}."""
    return {row.name: row.measure() for row in rows}


def changed(scratch, constant, k):
    """Change a constant in `scratch` to half (k = 3) or twice (4) its value; its file and text before."""
    path, before = scratch / CONSTANTS[constant][1], CONSTANTS[constant][2]
    text = path.read_text(encoding="utf-8")
    if text.count(before) != 1:
        sys.exit(f"ablation.py: {constant}: not once in {path.name}: {before}")
    path.write_text(text.replace(before, CONSTANTS[constant][k]), encoding="utf-8")
    return path, text


def moved(row, figure, value, base):
    """Change of a figure, in units of its tolerance."""
    exact, tolerance = row.figures[figure]
    scale = tolerance * (abs(base) if exact is None else 1.0)
    return math.inf if math.isnan(value) else abs(value - base) / scale


def show(results):
    """A table in Markdown: constants by the two figures that they move most, and how many they move by a tenth of a tolerance or more."""
    rows = {row.name: row for group in ROWS.values() for row in group}
    print("| constant | half | twice |")
    print("|---|---|---|")
    for constant, found in results.items():
        if constant in ROWS:
            continue
        base, cells = results[found["rows"]]["default"], []
        for side in ("half", "twice"):
            moves = sorted(((moved(rows[row], figure, value, base[row][figure]), row, figure, value, base[row][figure])
                            for row, figures in found[side].items() for figure, value in figures.items()), reverse=True)
            words = [f"{row}: {figure} {value:.3g} ({before:.3g}), {by:.1f}" for by, row, figure, value, before in moves[:3] if by >= 0.1]
            cells.append("; ".join(words) or f"less than {max(0.001, moves[0][0]):.1g}")
        print(f"| {constant} | {cells[0]} | {cells[1]} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="constants and rows")
    parser.add_argument("--only", action="append", metavar="CONSTANT", help="these constants; not given: all")
    parser.add_argument("--rows", action="append", metavar="ROW", help="rows whose names contain this; not given: all")
    parser.add_argument("--scratch", metavar="DIR", type=pathlib.Path, help="where the copy of the sources is or will be")
    parser.add_argument("--jobs", metavar="N", type=int, default=2, help="of the build (2)")
    parser.add_argument("--json", metavar="FILE", type=pathlib.Path, help="keep what was measured there, and go on from it")
    parser.add_argument("--table", metavar="FILE", type=pathlib.Path, help="show the table of what was kept, and measure nothing")
    options = parser.parse_args()
    if options.table:
        show(json.loads(options.table.read_text(encoding="utf-8")))
        return
    if options.list:
        for name, (group, path, *texts) in CONSTANTS.items():
            print(f"{name:20} {group:7} {path:36} {' | '.join(texts)}")
        for group, rows in ROWS.items():
            for row in rows:
                print(f"{group:7} {row.name:24} {row.problem} --resolution {row.n}: {', '.join(row.figures)}")
        return
    run(options)


def run(options):
    """Measure what is asked, keep it, and show the table."""
    results = {}
    if options.json and options.json.exists():
        results = json.loads(options.json.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as new:
        scratch = (options.scratch or pathlib.Path(new) / "stirpoint").resolve()
        if not scratch.exists():
            shutil.copytree(ROOT, scratch, ignore=shutil.ignore_patterns("build", ".git"))
        wanted = {group: [row for row in rows if not options.rows or any(part in row.name for part in options.rows)]
                  for group, rows in ROWS.items()}
        for constant in options.only or CONSTANTS:
            group = CONSTANTS[constant][0]
            if group not in results:
                driver.EXECUTABLE = build(scratch, options.jobs)
                results[group] = {"default": measure(wanted[group])}
            if constant not in results:
                found = {"rows": group}
                for k, side in ((3, "half"), (4, "twice")):
                    path, before = changed(scratch, constant, k)
                    try:
                        driver.EXECUTABLE = build(scratch, options.jobs)
                        found[side] = measure(wanted[group])
                    finally:
                        path.write_text(before, encoding="utf-8")
                results[constant] = found
                print(f"{constant} is measured", file=sys.stderr, flush=True)
            if options.json:
                options.json.write_text(json.dumps(results, indent=1), encoding="utf-8")
    show(results)


if __name__ == "__main__":
    main()
