# SPDX-License-Identifier: MIT
"""Meshes and their pictures against exact values, and against VTK."""

import numpy as np
import pytest
import pyvista as pv
from scipy.spatial import Delaunay

from stirpost.io.mesh import Mesh, corner_normals, half, loops, point_normals, sharp_edges, welded
from stirpost.plots.canvas import SAMPLES, Canvas, Eye

RANDOM = np.random.default_rng(20261128)
ABOVE = Eye((0.0, -1e-6, 1.0))


def of(found: pv.PolyData) -> Mesh:
    return Mesh(np.array(found.points, dtype=float), np.array(found.regular_faces), {"x": np.array(found.points[:, 0], dtype=float)})


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_cut_is_that_of_vtk(axis):
    """A torus: the area of its half, with data interpolated, and closed lines as long as those of VTK."""
    found = pv.ParametricTorus(ringradius=1.0, crosssectionradius=0.3).clean().triangulate()
    mesh, at = of(found), RANDOM.uniform(-0.1, 0.1)
    part, expected = half(mesh, axis, at, 1.0), found.clip(normal=np.eye(3)[axis], origin=at * np.eye(3)[axis], invert=True)
    assert part.to_pyvista().area == pytest.approx(expected.area, rel=1e-5)
    assert part.bounds[1, axis] == pytest.approx(at, abs=1e-7) and part["x"] == pytest.approx(part.points[:, 0], abs=1e-12)
    lines = loops(mesh, axis, at)
    assert len(lines) == 2 and all(np.allclose(line[0], line[-1]) for line in lines)
    length = sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines)
    cut = found.slice(normal=np.eye(3)[axis], origin=at * np.eye(3)[axis])
    assert length == pytest.approx(cut.compute_cell_sizes()["Length"].sum(), rel=1e-5)


def test_an_open_surface_is_cut_in_an_open_line():
    line, = loops(of(pv.Plane(i_resolution=7, j_resolution=5).triangulate()), 0, 0.03)
    assert np.ptp(line[:, 0]) == pytest.approx(1.0, abs=1e-6) and not np.allclose(line[0], line[-1])


def test_normals_and_edges_of_a_box_and_a_ball():
    box, left = welded(of(pv.Box(bounds=(0, 1, 0, 2, 0, 3)).triangulate()))
    assert left.all() and len(box.points) == 8
    edges = sharp_edges(box, 30.0)
    assert np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum() == pytest.approx(4 * (1 + 2 + 3))
    assert np.sort(np.abs(corner_normals(box, 30.0)), axis=2)[..., :2] == pytest.approx(0.0)
    ball = of(pv.Icosphere(radius=1.0, nsub=4))
    assert (point_normals(ball) * ball.points).sum(axis=1) == pytest.approx(1.0, abs=1e-3)
    assert len(sharp_edges(ball, 30.0)) == 0


def test_a_picture_shows_what_is_nearest():
    """A ball before a sheet, from a random side: as many pixels as its circle, in the middle of the picture."""
    eye = Eye(tuple(RANDOM.normal(size=3)))
    canvas = Canvas(eye, np.array([[-1.5, -1.5], [1.5, 1.5]]), 40.0)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ eye.axes[:2] - 2.0 * eye.axes[2]
    picture = np.full((2, 2, 4), 255, dtype=np.uint8)
    picture[0, 0] = 255, 0, 0, 255
    picture[1, 1, 3] = 0
    ball = of(pv.Icosphere(radius=0.5, nsub=5))
    canvas.draw(ball.points, ball.corners, np.full((len(ball.corners), 3, 3), [0, 0, 255], dtype=np.float32), cull=True)
    canvas.sheet(corners, picture)
    shown = canvas.pixels().astype(int)
    blue, red = (shown == [0, 0, 255]).all(axis=2), (shown == [255, 0, 0]).all(axis=2)
    assert blue.sum() / 40.0**2 == pytest.approx(np.pi * 0.25, rel=0.05)
    assert np.argwhere(blue).mean(axis=0) == pytest.approx([59.5, 59.5], abs=0.5)
    assert red.sum() / 40.0**2 == pytest.approx(1.0 - np.pi * 0.0625, rel=0.05) and np.argwhere(red).max() < 60


def test_triangles_that_share_edges_leave_no_gap_and_do_not_overlap():
    flat = np.vstack([RANDOM.uniform(0, 1, (400, 2)), [[0, 0], [1, 0], [1, 1], [0, 1]]])
    mesh = Mesh(np.column_stack([flat, np.zeros(len(flat))]), Delaunay(flat).simplices)
    canvas = Canvas(ABOVE, np.array([[0.0, 0.0], [1.0, 1.0]]), 100.0)
    sample, weights, _ = canvas.cover(mesh.points, mesh.corners)
    assert len(np.unique(sample)) == (100 * SAMPLES) ** 2 and len(sample) < 1.001 * (100 * SAMPLES) ** 2
    assert weights.min() > -1e-4 and weights.sum(axis=1) == pytest.approx(1.0, abs=1e-5)


def test_lines_are_hidden_by_what_is_before_them():
    canvas = Canvas(ABOVE, np.array([[0.0, 0.0], [1.0, 1.0]]), 50.0)
    sheet = np.array([[0, 0, 1.0], [0.5, 0, 1], [0.5, 1, 1], [0, 1, 1]])
    canvas.sheet(sheet, np.full((1, 1, 4), 255, dtype=np.uint8))
    canvas.lines(np.array([[[0, 0.5, 0], [1, 0.5, 0]], [[0, 0.25, 1], [1, 0.25, 1]]], dtype=float), (0, 0, 0), 0.01)
    dark = (canvas.pixels() < 200).all(axis=2)
    hidden, seen = dark[:30], dark[30:]
    assert seen[:, 1:49].any(axis=0).all() and hidden[:, 27:49].any(axis=0).all() and not hidden[:, :24].any()
