# SPDX-License-Identifier: MIT
"""The first line of the page: what was welded, and whether its figures may be trusted."""

import re
from pathlib import Path

import numpy as np
import pytest
import synthetic

from stirpost import cli
from stirpost.analysis import alarms, summary
from stirpost.analysis.tools import main_tool
from stirpost.io.scene import Scene
from stirpost.io.table import Column, Table
from stirpost.run import Run

INPUT = """&TIME
  END = 12.0, MASS_SCALING = 1e5
/
&BODY NAME = 'plate', MATERIAL = 'copper' /
&TOOL NAME = 'pin', RADIUS = 9e-3, PIN_RADIUS = 3e-3, PIN_LENGTH = 4e-3, TILT_DEG = 2 /
"""


@pytest.fixture
def run(tmp_path):
    directory = synthetic.make_run(tmp_path / "weld.out", spacing=0.004, frames=2, input_text=INPUT,
                                   attributes={"body_names": [b"plate"], "cell": 0.0015, "spacing": 0.004})
    synthetic.write_summary(directory, hottest_over_melting_K=0.0, melted_share_max=0.0)
    return Run(directory)


def give(run, **columns):
    """The history with columns of a time and this largest value."""
    more = [Column(name, unit, np.linspace(0.0, value, len(run.history))) for name, (value, unit) in columns.items()]
    run.history = Table([c for c in run.history.columns if c.name not in columns] + more)


def test_a_sound_run_is_green(run):
    give(run, inertial_stress_over_flow=(2.0, "%"), sleep_loss=(-1e-4, "J"), packing=(1.0, "%"))
    found = alarms.checks(run)
    assert {check.name: check.value for check in found} == {
        "weld": "closed", "run": "ended at 12.00 s", "energy audit": "0.4 %", "packing": "1 %", "inertial stress": "2 % of the flow stress", "melting": "none",
        "cells over the radius of the tool": "6", "loss by sleep": found[-1].value}
    assert {check.level for check in found} == {alarms.GREEN} and not alarms.alarms(run)
    assert alarms.verdict(found) == ("green", "The figures may be trusted: all checks are passed.")


LEVELS = {
    "audit": (lambda run, x: give(run, audit_error=(-x, "%")), "energy audit", 1.0, 5.0),
    "conduction": (lambda run, x: give(run, conduction_error=(x, "%")), "energy audit", 1.0, 5.0),
    "packing": (lambda run, x: give(run, packing=(x, "%")), "packing", 5.0, 15.0),
    "inertia": (lambda run, x: give(run, inertial_stress_over_flow=(x, "%")), "inertial stress", 5.0, 20.0),
    "loads": (lambda run, x: give(run, inertial_power=(0.0, "W"),
                                  inertial_force=(0.01 * x * alarms.largest_load(run, ("force_x", "force_y", "force_z")), "N")),
              "inertia in the loads", 5.0, 20.0),
    "melting": (lambda run, x: run.summary.update(melted_share_max=x / 100), "melting", 0.0, 1.0),
    "cells": (lambda run, x: setattr(run, "cell", 9e-3 * x), "cells over the radius of the tool", 1 / 5, 1 / 3),
    "sleep": (lambda run, x: give(run, tool_work=(100.0, "J"), sleep_loss=(x, "J")), "loss by sleep", 0.1, 1.0),
}


@pytest.mark.parametrize("kind", LEVELS)
def test_levels(run, kind):
    """Green to the first limit, amber to the second, red above; a sentence where it is not green, which the verdict names."""
    change, name, amber, red = LEVELS[kind]
    for value, level in ((0.99 * amber, "green"), (1.01 * amber + 1e-6, "amber"), (0.99 * red, "amber"), (1.01 * red, "red")):
        change(run, value)
        (check,) = [c for c in alarms.checks(run) if c.name == name]
        assert check.level == level and bool(check.text) == (level != "green"), (value, check)
        verdict = alarms.verdict(alarms.checks(run))
        assert verdict[0] == level and (level == "green" or name in verdict[1])
        assert (check.text in alarms.alarms(run)) == (level != "green")


def test_cells_of_a_tool_from_a_file(run):
    """Exact: as many as with its RADIUS, from the surface; a shank above the metal that is three times as wide does not count. Voids are not looked
    for."""
    synthetic.write_tools(run.directory)
    name = "cells over the radius of the tool"
    (with_radius,) = [check for check in alarms.checks(run) if check.name == name]
    for shank in (1.0, 3.0):
        other = Run(run.directory)
        other.scene = Scene(INPUT.replace("RADIUS = 9e-3, PIN_RADIUS = 3e-3, PIN_LENGTH = 4e-3,", "KIND = 'stl', FILE = 'tool.stl', UNIT = 'mm',"))

        def widened(frame, other=other, shank=shank):
            mesh = Run.tool_mesh(other, frame)
            axis = main_tool(other.history).place(frame.time)[:2]
            above = mesh.points[:, 2] > mesh.points[:, 2].mean()
            mesh.points[above, :2] = axis + shank * (mesh.points[above, :2] - axis)
            return mesh

        other.tool_mesh = widened
        found = {check.name: check for check in alarms.checks(other)}
        assert found[name].value == with_radius.value and "weld" not in found


def test_load_on_metal_not_reached(run):
    """Exact: it is named beside the inertial part, which alone decides of the level, and whether the inertial stress is red."""
    force = 0.01 * alarms.largest_load(run, ("force_x", "force_y", "force_z"))
    for inertial, early, level in ((2.0, 90.0, "green"), (5.1, 3.0, "amber"), (20.1, 0.0, "red")):
        give(run, inertial_power=(0.0, "W"), inertial_force=(inertial * force, "N"), tool_early_force=(early * force, "N"),
             inertial_stress_over_flow=(21.0, "%"))
        found = {check.name: check for check in alarms.checks(run)}
        assert found["inertia in the loads"].level == level and found["inertia in the loads"].value == f"{inertial:.2g} %, on metal not reached at most {early:.2g} %"
        assert found["inertial stress"].level == ("red" if inertial > 5.0 else "amber")


def test_limits_stand_in_the_document():
    rows = dict(re.findall(r"^\| ([a-z ]*[a-z])[^|]*\| ([^|]+\|[^|]+)\|$",
                           (Path(__file__).parents[2] / "docs/postprocessing.md").read_text(), flags=re.M))
    for name, limits in (("energy audit", alarms.AUDIT), ("loss by sleep", alarms.SLEEP), ("packing", alarms.PACKING), ("cells over the radius of the tool", alarms.CELLS)):
        assert tuple(float(x) for x in re.findall(r"[\d.]+", rows[name])) == limits
    assert f"({alarms.INERTIA:g} % by default)" in rows["inertial stress of mass scaling over the flow stress"]
    assert f"above {alarms.MELT:g} %" in rows["melting"]


def test_what_was_welded(run):
    assert summary.weld(run) == ("Pass of plate (copper), 100 x 40 x 12 mm; pin, shoulder radius 9 mm, pin radius 3 mm, pin length 4 mm; "
                                 "tilt 2\N{DEGREE SIGN}, 800.2 rpm, 5 mm/s over 60 mm.")
    run.history, run.scene, run.frames = Table([]), Scene(""), run.frames[:1]
    assert summary.weld(run) == "Pass of plate, 100 x 40 x 12 mm, without a tool."


def test_the_first_line_of_the_page(run):
    """Behind the title, before the table; every check leads to a section that is there."""
    path = run.directory / "weld_history.csv"
    lines = path.read_text().replace("temperature_max[K]", "inertial_stress_over_flow[%]").splitlines()  # hundreds
    path.write_text("\n".join(lines) + "\n")
    assert cli.main(["report", str(run.directory)]) == 0
    page = (run.directory / "report/report.html").read_text()
    words = re.search(r'</h1>\n<p class="weld"><strong class="green">The weld is closed: [^<]*</strong></p>\n<p class="weld">Pass of plate .*<strong class="([a-z]+)">([^<]*)</strong></p>\n<p class="checks">(.*)</p>', page)
    assert words and words[1] == "red" and "inertial stress" in words[2]
    assert page.index('class="weld"') < page.index("<nav>") < page.index('class="process"')
    links = re.findall(r'<a class="(\w+)" href="#(c\d+)">([^<]*)</a>', words[3])
    assert len(links) == words[3].count("<a ") == 6
    titles = dict(re.findall(r'<section id="(c\d+)"><h2>([^<]*)</h2>', page))
    assert {text.split(":")[0]: titles[to] for _, to, text in links} == {
        "weld": "Voids", "run": "Over time", "energy audit": "Over time", "inertial stress": "Over time", "melting": "Temperature", "cells over the radius of the tool": "Input"}
    assert "<td>debris</td><td>" in page
