# SPDX-License-Identifier: MIT
"""stirpost.Scene and the units that Run carries."""

import inspect

import numpy as np
import pytest
import synthetic

import stirpost
from stirpost import Frame, Run, Scene

TEXT = """&RUN TITLE = 'A plate''s pass' /   ! a comment
&TOOL NAME = 'pin', KIND = 'stl', FILE = 'pin.stl', FRICTION = 4e-1, POSITION = 1D-3, 2*0.0 /
&PROBE NAME = 'T1', POSITION = 3*1e-3 /
&PROBE NAME = 'T2', POSITION = 3*2e-3 /
"""


def test_values_are_read_and_changed_by_the_addresses_of_set(tmp_path):
    """One group, the second, that of a name, and all; what is written reads back the same."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a/weld.nml").write_text(TEXT)
    scene = Scene.read(tmp_path / "a/weld.nml")
    assert scene.get("RUN.TITLE") == "A plate's pass" and scene.get("tool.friction") == 0.4
    assert scene.get("PROBE(2).NAME") == "T2" and scene.get("PROBE(t1).POSITION") == [1e-3] * 3
    assert scene.get("PROBE(3).NAME") is None and scene.get("HEAT.AMBIENT", 298.0) == 298.0
    scene.set("TOOL.FRICTION", np.float64(0.25))
    scene.set("PROBE(T2).POSITION", np.array([1e-3, 2e-3, 1 / 3]))
    scene.add("PROBE", NAME="T3", POSITION=(0, 0, 0))
    scene.add("HEAT", AMBIENT=300)
    again = Scene.read(scene.write(tmp_path / "other.nml"))
    for place in (scene, again):
        assert place.get("TOOL.FRICTION") == 0.25 and place.get("PROBE(2).POSITION") == [1e-3, 2e-3, 1 / 3]
        assert [probe["name"] for probe in place.groups("PROBE")] == ["T1", "T2", "T3"]
        assert place.get("HEAT.AMBIENT") == 300 and place.get("TOOL.FILE") == str(tmp_path / "a/pin.stl")
    again.set("PROBE.POSITION", [0.0, 0.0, 0.0])
    assert [probe["position"] for probe in again.groups("PROBE")] == [[0.0] * 3] * 3
    for address in ("FRICTION", "SURFACE.AMBIENT", "PROBE(T9).NAME", "PROBE(4).NAME"):
        with pytest.raises(ValueError, match="expected GROUP.KEY|no such group"):
            again.set(address, 1)


def test_units_are_in_the_tables_and_meshes(tmp_path):
    run = Run(synthetic.make_run(tmp_path / "plate.out", spacing=0.004, frames=2, rows=30))
    assert run.history.frame.attrs["units"]["pin_torque"] == run.history.unit("pin_torque") == "Nm"
    frame, mesh = run.at(5.0), run.at().mesh()
    assert frame is run.frames[1] and mesh.n_points == frame.count
    assert set(mesh.point_data.keys()) == set(frame.fields) == set(frame.units)
    assert np.array_equal(mesh.point_data["temperature"], frame.field("temperature"))


@pytest.mark.parametrize("kind", [Run, Frame, Scene, stirpost.Table])
def test_the_interface_is_documented_and_typed(kind):
    """Every public method has a text, and types of all it takes and gives."""
    for name, method in inspect.getmembers(kind, inspect.isfunction):
        if name.startswith("_"):
            continue
        signature = inspect.signature(method)
        assert signature.return_annotation is not inspect.Signature.empty, name
        assert all(p.annotation is not inspect.Parameter.empty for p in list(signature.parameters.values())[1:]), name
        assert inspect.getdoc(method), f"{kind.__name__}.{name} has no text"
