# SPDX-License-Identifier: MIT
"""Targets of calibrations have the values of stirpost flow and of the table of a study; limits of keys are those printed."""

import re
from pathlib import Path

import numpy as np
import pytest
import synthetic

from stirpost.analysis import summary
from stirpost.calibrate import limits, targets
from stirpost.io.scene import Scene
from stirpost.run import Run

INPUT = ("&BODY NAME = 'plate' /\n&SHAPE BODY = 'plate', LOWER = 0, 0, 0, UPPER = 0.1, 0.04, 0.012 /\n"
         "&TOOL NAME = 'pin', RADIUS = 9e-3, FRICTION = 0.3 /\n")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return Run(synthetic.make_run(tmp_path_factory.mktemp("run") / "plate.out", spacing=0.002, frames=3, rows=60, input_text=INPUT,
                                  attributes={"body_names": [b"plate"], "spacing": 0.002, "cell": 0.004}))


def test_each_target_is_the_measure_of_its_name(run):
    loads, flow = summary.measures(run), run.flow().measures([30e-3])
    zone, history = flow["stir_zone"][0], run.history
    wanted = {"axial_force[kN]": loads["axial force, mean [N]"], "torque[N m]": loads["torque, mean [N m]"],
              "T1_peak[K]": loads["T1, peak [K]"], "groove[mm3]": flow["volumes"]["groove[m3]"], "groove_depth[mm]": flow["volumes"]["groove_mean_depth[m]"],
              "flash_retreating[mm]": flow["flash"]["height_retreating[m]"], "stir_depth@30e-3[mm]": zone["depth[m]"],
              "stir_width@0.03[mm]": zone["width[m]"]}
    for name, value in wanted.items():
        assert value != 0.0 and targets.read(f"{name}=0,1", run).of(run) == value, name
    within = (history["time"] >= 4.0) & (history["time"] <= 8.0)
    mean = targets.read("pin_torque@4:8=0,1", run).of(run)
    assert mean == pytest.approx(history["pin_torque"][within].mean(), rel=0.02)


@pytest.mark.parametrize("text, value, error", [("axial_force[kN]=12,0.5", 12e3, 500.0), ("stir_depth@30e-3[mm]=3.5,.5", 3.5e-3, 5e-4),
                                                ("temperature_max[C]=500,10", 773.15, 10.0), ("fill[%]=68,5", 0.68, 0.05)])
def test_units(run, text, value, error):
    found = targets.read(text, run)
    assert (found.value, found.scale) == pytest.approx((value, error))
    assert found.known and found.label == text.split("[")[0].replace("30e-3", "0.03")


@pytest.mark.parametrize("text, message", [("fill=1,0.1", "no fill"), ("stir_depth@9=1e-3,1e-4", "")])
def test_what_a_run_does_not_have(run, text, message):
    target = targets.read(text, run)
    if message:
        with pytest.raises(ValueError, match=message):
            target.of(run)
    else:
        assert target.of(run) == 0.0


def test_limits():
    """Places and values are one another's inverse; each way to address a key finds its row; bounds and start may be given."""
    scene = Scene(INPUT)
    keys = limits.varied(["TOOL(pin).FRICTION", "Surface(2).Coefficient", "GRID.CELL=2,1,4"], scene)
    assert [key.start for key in keys] == pytest.approx([0.3, 1e3, 2.0])
    assert [(key.low, key.high, key.scale) for key in keys] == [(0, 1, "linear"), (1, 1e6, "log"), (1, 4, "linear")]
    taken = Scene("&TOOL NAME = 'pin', SHEAR_FACTOR = 0.9 /")
    keys += limits.varied(["TOOL.SHEAR_FACTOR"], Scene("&TOOL NAME = 'pin', FROM = 'a pair' /"), lambda: taken)
    assert keys[-1].start == 0.9
    for key in keys:
        places = np.array([0.0, 0.2, 1.0])
        assert [key.scaled(key.value(place)) for place in places] == pytest.approx(places)
        assert key.error(0.3, 1e-6) == pytest.approx(key.value(0.3 + 1e-6) - key.value(0.3), rel=1e-4)
    for texts, message in ((["TOOL.FRICTION", "tool.friction"], "twice"), (["TOOL.SPIN"], "give START,LOW,HIGH"),
                        (["TOOL.FRICTION=1.5"], "LOW and HIGH are 0 and 1"), (["TOOL.FRICTION=1,x,2"], "LOW < START < HIGH"),
                        (["SURFACE.COEFFICIENT=3,0,9,log"], "0 < LOW < HIGH")):
        with pytest.raises(ValueError, match=message):
            limits.varied(texts, scene)


@pytest.mark.parametrize("text, message", [("axial_force[mm]=1,1", "is no unit of axial_force"), ("tork=1,1", "no such measure"),
                                        ("torque=1", "VALUE,UNCERTAINTY"), ("stir_depth=1,1", "no such measure"),
                                        ("torque=1,0", "above 0")])
def test_what_is_no_target(run, text, message):
    with pytest.raises(ValueError, match=message):
        targets.read(text, run)


def test_tables_stand_in_the_document():
    text = (Path(__file__).parents[2] / "docs/postprocessing.md").read_text(encoding="utf-8")
    for name, printed in (("limits", limits.table()), ("targets", targets.table())):
        block = re.search(rf"<!-- {name} -->\n(.*?)<!-- end", text, re.S)[1].splitlines()[2:]
        assert [re.split(r" *\| *", row.strip("| `")) for row in (line.replace("`", "") for line in block)] == \
            [re.split(r"  +", row) for row in printed.splitlines()]
