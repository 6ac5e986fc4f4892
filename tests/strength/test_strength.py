# SPDX-License-Identifier: MIT
"""Metal without strength takes no heat of friction and transmits no shear, in drawn scenes (drawn_scenes.py)."""

import os
import pathlib
import random
import sys

import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import drawn_scenes as scenes

SLIDING = """
&GRID CELL = 1e-3, LOWER = -4e-3, -4e-3, 0, UPPER = 20e-3, 12e-3, 8e-3 /
&TIME END = 0.01, MASS_SCALING = 1e6 /
&MATERIAL NAME = 'metal', LAW = 'norton', NORTON_K = 40e6, NORTON_N = 0.2, T_MELT = 900, DENSITY = 2700
  YOUNGS_MODULUS = 70e9, POISSON_RATIO = 0.33, SPECIFIC_HEAT = 1000, CONDUCTIVITY = 150 /
&BODY NAME = 'below', MATERIAL = 'metal' /
&SHAPE BODY = 'below', LOWER = 0, 0, 0, UPPER = 16e-3, 8e-3, 2e-3 /
&BODY NAME = 'above', MATERIAL = 'metal', VELOCITY = 0.2, 0, 0 /
&SHAPE BODY = 'above', LOWER = 0, 0, 2e-3, UPPER = 8e-3, 8e-3, 4e-3 /
&CONTACT BODY = 'below', OTHER = 'above', FRICTION = 0.5 /
&TOOL NAME = 'press', KIND = 'plane', POSITION = 0, 0, 3.95e-3, NORMAL = 0, 0, -1, FRICTION = 0 /
&WALL SIDE = 'zmin', KIND = 'fixed' /
&HEAT AMBIENT = 298 /
&METHOD DEBRIS = 0.5 /
"""
FIRST = int(os.environ.get("STIRPOINT_SEED", 1))
GROUP = 3


@pytest.mark.parametrize("group", [pytest.param(k, marks=[pytest.mark.long] if k >= 8 else []) for k in range(20)])
def test_no_heat_without_strength(group, tmp_path):
    """The hottest metal is at most 20 K above its solidus, whatever the scene."""
    for seed, _, wrong, text in scenes.run_scenes(GROUP, FIRST + GROUP * group, tmp_path):
        assert not wrong, (seed, wrong, text)


@pytest.mark.parametrize("number", [98, 228, 256, 312, 585, 627, 310102])
def test_scenes_of_faults(number, tmp_path):
    """Tools in the boxes of clamps, whose metal was crushed, and faces that had just entered a node, where conduction
    stood still."""
    _, _, wrong, text = scenes.run_scenes(1, number, tmp_path)[0]
    assert not wrong, (number, wrong, text)


@pytest.mark.parametrize("number, factor", [(22, 1e6), (98, 1e6), (1004, 1e4), (1073, 1e5), (1076, 2e5)])
def test_crumbs_without_inertia_of_light_nodes(number, factor, tmp_path):
    """A tool over the edge of a sheet presses crumbs of a few particles on the wall, without SELECTIVE_SCALING: they gain no energy. Friction beyond
    the strength of metal at its solidus (98, 1073, 1076) does not heat molten metal at the same nodes: no metal is above it by 1 K."""
    text, _, is_molten = scenes.scene(random.Random(number))
    (tmp_path / "tool.stl").write_text(scenes.mesh())
    place = tmp_path / "run"
    place.mkdir()
    (place / "scene.nml").write_text(text)
    done = scenes.driver.run("scene.nml", "--quiet", directory=place,
                             sets={"METHOD.SELECTIVE_SCALING": "off", "TIME.MASS_SCALING": factor})
    above, wrong = scenes.broken_law(done, is_molten)
    assert not wrong
    assert above < 1.0
    assert np.abs(done.results("scene").history()["audit_error[%]"]).max() < 1.0


@pytest.mark.parametrize("law", ["coulomb", "stick"])
def test_molten_bodies_have_no_friction(law, tmp_path):
    """Friction between two pressed bodies, or what stops their slip, heats them below the melting point, and not at all
    above it."""
    (tmp_path / "sliding.nml").write_text(SLIDING)
    heat = {}
    for temperature in (880.0, 930.0):
        done = scenes.driver.run("sliding.nml", "--quiet", "--overwrite", directory=tmp_path,
                                 sets={"BODY.TEMPERATURE": temperature, "CONTACT.LAW": law})
        heat[temperature] = done.results("sliding").history()["friction_heat[J]"][-1]
    assert heat[880.0] > 0.5
    assert abs(heat[930.0]) < 1e-9
