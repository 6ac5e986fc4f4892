# SPDX-License-Identifier: MIT
"""Bodies from STL files: the same as their analytic solids, in any unit and place, cut out as well as added."""

import driver
import numpy as np
import pytest
from test_tool_shapes import write_binary

SCENE = (driver.INPUTS / "released.nml").read_text(encoding="utf-8")
HEAD = SCENE[:SCENE.index("&SHAPE")]
TAIL = SCENE[SCENE.index("&LOAD"):]


def facets_of(mesh):
    """(n, 3, 3) corners of the triangles of a surface."""
    mesh = mesh.triangulate()
    return mesh.points[mesh.faces.reshape(-1, 4)[:, 1:]]


def state(run, directory, name, shapes):
    (directory / f"{name}.nml").write_text(HEAD + shapes + TAIL, encoding="utf-8")
    done = run(f"{name}.nml", "--quiet", sets={"TIME.MAX_STEPS": 20})
    return done.results(name).checkpoint()


@pytest.mark.parametrize("unit, scale", [("mm", 1e-3), ("um", 1e-6)])
def test_box_with_a_hole(run, tmp_path, unit, scale):
    """Exact: bitwise the state of a box and of another cut out of it, where the file has these in another unit and place."""
    import pyvista as pv

    place = np.array([1e-3, -2e-3, 0.5e-3])
    box = pv.Box(bounds=np.ravel([np.array([0.0, 4e-3]) - p for p in place]) / scale)
    hole = pv.Box(bounds=np.ravel([np.array(b) - p for b, p in zip(([1e-3, 3e-3], [1e-3, 2e-3], [-1e-3, 5e-3]), place)]) / scale)
    write_binary(tmp_path / "box.stl", facets_of(box))
    write_binary(tmp_path / "hole.stl", facets_of(hole))
    at = ", ".join(map(str, place))
    exact = state(run, tmp_path, "exact", "&SHAPE BODY = 'block', LOWER = 0, 0, 0, UPPER = 4e-3, 4e-3, 4e-3 /\n&SHAPE BODY = 'block', "
                  "OPERATION = 'subtract', LOWER = 1e-3, 1e-3, -1e-3, UPPER = 3e-3, 2e-3, 5e-3 /\n")
    read = state(run, tmp_path, "read", f"&SHAPE BODY = 'block', KIND = 'stl', FILE = 'box.stl', UNIT = '{unit}', POSITION = {at} /\n"
                 f"&SHAPE BODY = 'block', KIND = 'stl', FILE = 'hole.stl', UNIT = '{unit}', POSITION = {at}, OPERATION = 'subtract' /\n")
    assert 0 < len(exact.tau) == len(read.tau) < 8**3
    assert np.array_equal(exact.tau, read.tau) and np.array_equal(exact.x, read.x)


def test_sphere(run, tmp_path):
    """The volume asked for is that of the triangles, that of the particles within 2 %, and a file that is not closed is an
    error of its line."""
    import pyvista as pv

    ball = pv.Icosphere(radius=2.0, center=(2, 2, 2), nsub=4)
    facets = facets_of(ball)
    write_binary(tmp_path / "ball.stl", facets)
    text = HEAD + "&SHAPE BODY = 'block', KIND = 'stl', FILE = 'ball.stl', UNIT = 'mm' /\n" + TAIL
    (tmp_path / "ball.nml").write_text(text, encoding="utf-8")
    out = run("ball.nml", "--check=scene", sets={"GRID.CELL": 2.5e-4}).out
    filled, asked = (float(word) for word in out.split("block: ")[2].replace(" mm3 for ", " ").split()[:2])
    assert asked == pytest.approx(ball.volume, rel=1e-5) and filled == pytest.approx(asked, rel=0.02)
    write_binary(tmp_path / "ball.stl", facets[1:])
    done = run("ball.nml", "--check=scene", expect=driver.BAD_INPUT)
    assert "ball.stl" in done.err and "closed" in done.err
    (tmp_path / "ball.stl").unlink()
    done = run("ball.nml", "--check=scene", expect=driver.BAD_INPUT)
    assert f"ball.nml:{1 + text[:text.index('&SHAPE')].count(chr(10))}: error: &SHAPE FILE" in done.err
    assert done.err.count("cannot be read") == 1
