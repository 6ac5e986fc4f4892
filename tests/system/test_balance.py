# SPDX-License-Identifier: MIT
"""Balance of the ranks while a tool crosses a plate: nothing but the speed depends on it."""

import driver
import pytest

STATE = ["x", "v", "b", "jac", "plastic", "temp", "tau"]
# stir.nml with a longer plate, which the tool crosses by half in 0.06 s. Planes of nodes are what a cut can
# move by: in cells of 4 mm, where the tool is 5 cells wide, 4 ranks cannot be more even than 1.2.
CROSSING = {"GRID.CELL": "2e-3", "GRID.UPPER": "104e-3,48e-3,28e-3", "SHAPE.UPPER": "96e-3,40e-3,12e-3", "TIME.END": "0.08",
            "MOTION(1).DURATION": "0.02", "MOTION(1).VELOCITY": "0,0,-20e-3",
            "MOTION(2).VELOCITY": "0.5,0,0", "MOTION(2).RAMP": "0.01", "METHOD.SORT_INTERVAL": "25",
            "OUTPUT.CHECKPOINT_INTERVAL": "0.08", "OUTPUT.FRAME_INTERVAL": "0", "METHOD.SELECTIVE_SCALING": "off"}


def test_rebalancing_follows_the_tool_and_changes_no_result(run, tmp_path):
    """The project's own measure: with sleepers, whose window of awake material moves with the tool, the most
    loaded rank has at most 1.1 times the mean in every step, flow and contact counted, and the state after 1039
    steps is that without rebalancing to 1e-10 of the largest value (positions, velocities, stresses, ...). Without
    rebalancing the window leaves the boxes."""
    results = {}
    for limit in (1.03, 1e9):
        place = tmp_path / str(limit)
        place.mkdir()
        sets = {**CROSSING, "METHOD.SLEEPING": "on", "METHOD.REBALANCE": limit}
        results[limit] = run("stir", "--quiet", sets=sets, directory=place, ranks=4).results("stir")
    on, off = (results[limit].summary() for limit in (1.03, 1e9))
    for name in ("imbalance_mean", "imbalance_worst", "partitions"):
        print(name, on[name], off[name])
    assert on["awake_share"] < 0.97   # nothing may fall asleep before step 500
    assert off["partitions"] == 1 and off["imbalance_worst"] > 1.2
    assert on["partitions"] > 1 and 1.0 <= on["imbalance_mean"] <= on["imbalance_worst"] <= 1.1
    one, two = (results[limit].checkpoint() for limit in (1.03, 1e9))
    assert one.step == two.step > 500 and one.plastic.max() > 0.05
    assert list(one.particles_of_rank) != list(two.particles_of_rank)
    apart = driver.distance(one, two, STATE)
    print(apart)
    assert max(apart.values()) <= 1e-10, apart


def test_always_awake(run, tmp_path):
    """Without sleepers the load hardly moves: at most 1.1 times the mean in every step."""
    summary = run("stir", "--quiet", sets={**CROSSING, "METHOD.SLEEPING": "off"}, directory=tmp_path, ranks=4).results("stir").summary()
    print(summary["imbalance_worst"], summary["partitions"])
    assert summary["awake_share"] == 1.0 and summary["imbalance_worst"] <= 1.1
