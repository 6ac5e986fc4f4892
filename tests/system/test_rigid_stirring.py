# SPDX-License-Identifier: MIT
"""A rigid body of particles is no tool for stirring: refused, with the tool to take instead."""

import driver

SCENE = """
&GRID CELL = 2e-3, LOWER = -4e-3, -4e-3, -4e-3, UPPER = 40e-3, 36e-3, 18e-3 /
&TIME END = 0.2, MASS_SCALING = 1e5 /
&MATERIAL NAME = 'copper', DENSITY = 8960, YOUNGS_MODULUS = 124e9, POISSON_RATIO = 0.34, LAW = 'norton', NORTON_K = 90e6,
  NORTON_N = 0.1, SPECIFIC_HEAT = 386, CONDUCTIVITY = 391, T_MELT = 1356 /
&BODY NAME = 'plate', MATERIAL = 'copper' /
&SHAPE BODY = 'plate', LOWER = 0, 0, 0, UPPER = 36e-3, 32e-3, 8e-3 /
&BODY NAME = 'disc', MATERIAL = 'copper', RIGID = T, CENTRE = 16e-3, 16e-3, 8e-3 /
&SHAPE BODY = 'disc', KIND = 'cylinder', CENTRE = 16e-3, 16e-3, 10e-3, LENGTH = 4e-3, RADIUS = 8e-3 /
&CONTACT BODY = 'plate', OTHER = 'disc', FRICTION = 0.4 /
&CLAMP LOWER = -1, -1, -1, UPPER = 1, 1, 0 /
&MOTION TOOL = 'disc', VELOCITY = 0, 0, -2e-3, SPIN_RPM = 970 /
"""


def test_refused(run, tmp_path):
    """Turning and pressed into metal that flows it is refused; turning alone, pressed alone, or on elastic metal it is not."""
    path = tmp_path / "rigid.nml"
    path.write_text(SCENE)
    assert "take a &TOOL of its shape" in run(path, "--check=scene", expect=driver.BAD_INPUT).err
    run(path, "--check=scene", sets={"MOTION.VELOCITY": "2e-3,0,0"})
    run(path, "--check=scene", sets={"MOTION.SPIN_RPM": 0})
    path.write_text(SCENE.replace("LAW = 'norton', NORTON_K = 90e6,\n  NORTON_N = 0.1,", ""))
    run(path, "--check=scene")
