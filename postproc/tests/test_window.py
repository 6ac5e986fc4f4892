# SPDX-License-Identifier: MIT
"""The process window: what is set for a setting, and what it is called."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from stirpost import cli
from stirpost.cli import window
from stirpost.io.scene import Scene

INPUT = """&TIME END = 9 /
&MOTION TOOL = 'tool', DURATION = 3, VELOCITY = 0, 0, -2e-3, SPIN_RPM = -300 /
&MOTION TOOL = 'tool', DURATION = 2, VELOCITY = 3e-3, 4e-3, 0, SPIN_RPM = -300, FORCE = 5e3 /
&MOTION TOOL = 'tool', VELOCITY = 5e-3, 0, 0, SPIN_RPM = -300 /
"""


@pytest.mark.parametrize("seed", range(5))
def test_each_phase_keeps_its_way_and_the_sense_of_its_spin(seed):
    rpm, speed, force = np.random.default_rng(seed).uniform([100, 1, 2], [3000, 30, 20])
    keys = window.Plan.of(Scene(INPUT)).keys(rpm, speed, force)
    assert all(float(keys[f"MOTION({k}).SPIN_RPM"]) == pytest.approx(-rpm) for k in (1, 2, 3))
    assert "MOTION(1).VELOCITY" not in keys and "MOTION(1).DURATION" not in keys and "MOTION(3).DURATION" not in keys
    velocity = [np.array(keys[f"MOTION({k}).VELOCITY"].split(), dtype=float) for k in (2, 3)]
    assert np.linalg.norm(velocity, axis=1) == pytest.approx(1e-3 * speed)
    assert velocity[0] * float(keys["MOTION(2).DURATION"]) == pytest.approx([6e-3, 8e-3, 0.0])
    last = float(keys["TIME.END"]) - 3.0 - float(keys["MOTION(2).DURATION"])
    assert velocity[1] * last == pytest.approx([20e-3, 0.0, 0.0])
    assert keys["MOTION(2).FORCE"] == f"{1e3 * force:.9g}" and "MOTION(3).FORCE" not in keys


def test_values_and_inputs_that_make_no_window(tmp_path, capsys):
    assert window.values_of("600:3000:5", "rpm") == [600, 1200, 1800, 2400, 3000] and window.values_of("4,2", "speed") == [2, 4]
    for text in ("600:3000", "a", "0:1:2", "3,3", ""):
        with pytest.raises(ValueError, match="expected LOW:HIGH:COUNT"):
            window.values_of(text, "rpm")
    path = tmp_path / "still.nml"
    path.write_text("&TIME END = 1 /\n&MOTION TOOL = 'tool', SPIN_RPM = 300 /\n")
    assert cli.main(["window", str(path), "--rpm", "1,2", "--speed", "1,2"]) == 2
    assert "travels" in capsys.readouterr().err


@pytest.mark.parametrize("kind, minor, flash, name", [
    ("open", False, 0, "groove"), ("root", False, 0, "lack of fill"), ("closed", False, 0, "tunnel"), ("loose", False, 0, "loose metal"),
    ("closed", True, 0, "small voids"), ("loose", True, 99, "small voids"), (None, True, 99, "flash"), (None, True, 0, "closed")])
def test_closed_is_a_weld_without_any_void(kind, minor, flash, name, monkeypatch):
    track = SimpleNamespace(all=[SimpleNamespace(kind=kind)] if kind else [], is_minor=lambda void: minor)
    monkeypatch.setattr(window.voids, "of_run", lambda run: track)
    options = SimpleNamespace(max_force=np.inf, max_torque=np.inf, flash=10.0)
    found = {"flash over the section under the shoulder [%]": flash}
    assert window.name_of(SimpleNamespace(summary={}), found, options) == name


def test_the_map_has_a_field_for_each_setting_and_a_row_for_each_force():
    rows = [{window.AXES["rpm"]: r, window.AXES["speed"]: s, window.AXES["force"]: f, window.FOUND: "tunnel" if s > 2 else "closed",
             "torque, mean [N m]": 1e4 * s / r if r < 600 else np.nan, "highest temperature [K]": 600.0 + r / 10}
            for r in (200.0, 400.0, 600.0) for s in (2.0, 4.0) for f in (5.0, 10.0)]
    figure = window.picture(pd.DataFrame(rows))
    assert len(figure.axes) == 4 and figure.axes[-1].get_xlabel() == window.AXES["rpm"]
    for axis in figure.axes:
        fields = axis.collections[0].get_array()
        assert fields.shape == (2, 3) and len(np.unique(fields)) == 2
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["tunnel", "closed"]
