# SPDX-License-Identifier: MIT
"""Places and phases of tools, means over phases, whose forces are whose."""

import numpy as np
import pytest

from stirpost.analysis import summary
from stirpost.analysis.tools import main_tool, supports, tools_of
from stirpost.io.table import Column, Table
from stirpost.plots import curves


def history(names=("tool",), rows=101, end=10.0):
    """Plunge from 1 to 2 s (the tool comes down from 0), dwell to 4 s, travel along x to 8 s, lift to 9 s, then away:
    torque 10 in the plunge, 20 in the dwell, 40 in the travel; a wall with a force of 99 kN."""
    t = np.linspace(0.0, end, rows)
    columns = [Column("time", "s", t)]
    heat = np.zeros(rows)
    for k, name in enumerate(names):
        touch = (t > 1.0) & (t <= 9.0)
        torque = np.select([t <= 1, t <= 2, t <= 4, t <= 8, t <= 9], [0, 10, 20, 40, 5], 0.0) * (k + 1)
        friction = 0.8 * 100.0 * torque
        heat = heat + np.cumsum(friction * np.diff(t, prepend=0.0))
        columns += [
            Column(f"{name}_torque", "Nm", torque),
            *(Column(f"{name}_force_{a}", "N", v * touch) for a, v in zip("xyz", (-100.0, 50.0, 5000.0))),
            Column(f"{name}_power", "W", 100.0 * torque),
            Column(f"{name}_friction_power", "W", friction),
            Column(f"{name}_x", "m", 0.02 + 0.005 * np.clip(t - 4.0, 0.0, 4.0)),
            Column(f"{name}_y", "m", np.full(rows, 0.02 + 0.01 * k)),
            Column(f"{name}_z", "m", 0.012 - 0.001 * np.clip(t, 0.0, 2.0) + 0.002 * np.clip(t - 8.0, 0.0, 2.0)),
            Column(f"{name}_angle", "rad", 100.0 * t),
            Column(f"{name}_tilt", "rad", np.full(rows, 0.05)),
        ]
    columns += [Column(f"wall_zmin_force_{a}", "N", np.full(rows, 99e3)) for a in "xyz"]
    columns += [Column("friction_heat", "J", heat), Column("plastic_work", "J", heat / 4.0)]
    return Table(columns)


def test_phases_and_their_means():
    tool = main_tool(history())
    phases = tool.phases()
    assert [p.kind for p in phases] == ["approach", "plunge", "dwell", "travel", "lift", "away"]
    torque = tool.column("torque")
    means = [tool.mean(torque, p) for p in phases]
    assert means == pytest.approx([0.0, 10.0, 20.0, 40.0, 5.0, 0.0])
    assert [tool.friction_share(p) for p in phases[1:5]] == pytest.approx([80.0] * 4)
    assert np.isnan(tool.friction_share(phases[0]))


def test_means_weigh_rows_by_their_length():
    table = history()
    keep = np.array([k for k in range(101) if k % 5 == 0 or 42 < k < 60])
    short = Table([Column(c.name, c.unit, c.values[keep]) for c in table.columns])
    tool = main_tool(short)
    travel = next(p for p in tool.phases() if p.kind == "travel")
    assert tool.mean(tool.column("torque"), travel) == pytest.approx(40.0)


def test_a_tool_that_never_touches_or_does_not_move_has_no_phases_of_work():
    table = history()
    idle = [c.name for c in table.columns if c.name.startswith("tool_") and c.unit in ("Nm", "N", "W")]
    table.frame[idle] = 0.0
    assert [p.kind for p in main_tool(table).phases()] == ["away"]
    assert summary.history_rows(table)


def test_place_at_a_time():
    tool = main_tool(history())
    assert tool.place(6.0) == pytest.approx([0.03, 0.02, 0.010])
    assert tool.place(99.0) == pytest.approx([0.04, 0.02, 0.014])


def test_the_tool_with_the_most_work_comes_first_and_walls_are_no_tools():
    table = history(("small", "large"))
    assert [tool.name for tool in tools_of(table)] == ["large", "small"]
    assert {c.name for c in supports(table)} == {f"wall_zmin_force_{a}" for a in "xyz"}
    axes = curves.tool_loads(table).axes
    labels = [text.get_text() for text in axes[1].get_legend().get_texts()]
    assert len(labels) == 6 and not any("wall" in label for label in labels)
    walls = curves.wall_loads(table)
    assert len(walls.axes) == 1 and "wall zmin" in walls.axes[0].get_ylabel()
    titles = [title for title, _, _ in summary.phase_tables(type("R", (), {"history": table})())]
    assert titles == ["Phases of large: means", "Phases of small: means"]


def test_a_tool_named_like_a_pattern():
    table = history(("a.b(c",))
    assert main_tool(table).column("torque") is not None
    assert curves.tool_loads(table) is not None and curves.others(table) is None


def test_without_tools_there_is_nothing():
    bare = Table([Column("time", "s", np.arange(3.0)), Column("wall_force_x", "N", np.arange(3.0))])
    assert tools_of(bare) == [] and tools_of(Table([])) == [] and main_tool(bare) is None
    assert curves.tool_loads(bare) is None and curves.wall_loads(bare) is not None
