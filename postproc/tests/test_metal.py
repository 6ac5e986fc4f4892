# SPDX-License-Identifier: MIT
"""Flash, debris and groove of shapes with known dimensions."""

import numpy as np
import pytest
import synthetic

from stirpost.analysis import metal
from stirpost.run import Run

H = 0.001
PLATE = (0.030, 0.020, 0.006)


def run_of(tmp_path, points, extra=None, attributes=None, start=None, body=None):
    directory = tmp_path / "a.out"
    directory.mkdir()
    start = synthetic.lattice(H, PLATE) if start is None else start
    attributes = {"spacing": [H], "cell": 2 * H} | (attributes or {})
    for k, cloud in enumerate((start, points)):
        numbers = np.ones(len(cloud), dtype=np.int32) if body is None else body
        synthetic.write_frame(directory / f"a_{k:06d}.hdf", cloud, {"body": numbers}, float(k), attributes=attributes)
    return Run(directory)


def measured(run, rigid=frozenset()):
    return metal.measure(run, run.frames[-1], frozenset(rigid))


def test_a_wall_of_flash_and_debris_apart(tmp_path):
    """A wall of 4 x 10 particles, 4 high, stands on the plate; a crumb of 3 particles flies 5 mm above."""
    plate = synthetic.lattice(H, PLATE)
    wall = synthetic.lattice(H, (0.010, 0.001, 0.004)) + [0.010, 0.005, 0.006]
    crumb = synthetic.lattice(H, (0.003, 0.001, 0.001)) + [0.010, 0.015, 0.011]
    shape = measured(run_of(tmp_path, np.vstack([plate, wall, crumb])))
    assert shape.flash_height == pytest.approx(4 * H, rel=1e-4)
    assert shape.flash_volume == pytest.approx(40 * H**3, rel=1e-3)
    assert (shape.debris_pieces, shape.debris_particles) == (1, 3)
    assert shape.debris_volume == pytest.approx(3 * H**3)
    assert shape.groove == pytest.approx(0.0, abs=1e-6)


def test_pieces_hold_together_within_a_cell(tmp_path):
    points = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0], [6.0, 0, 0]]) * H
    label = metal.pieces_of(points, 2 * H)
    assert label[0] == label[1] == label[2] != label[3]
    turned = points @ np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    assert len(np.unique(metal.pieces_of(turned, 2 * H))) == 2


def test_two_plates_apart_are_no_debris_and_a_rigid_tool_is_no_flash(tmp_path):
    one, other = synthetic.lattice(H, (0.010, 0.010, 0.004)), synthetic.lattice(H, (0.004, 0.004, 0.004)) + [0.030, 0, 0]
    tool = synthetic.lattice(H, (0.004, 0.004, 0.004)) + [0.004, 0.004, 0.004]
    start = np.vstack([one, other, tool])
    body = np.repeat([1, 2, 3], [len(one), len(other), len(tool)]).astype(np.int32)
    points = start.copy()
    points[: len(one), 0] += 1e-5
    names = {"body_names": np.array([b"plate", b"piece", b"punch"]), "spacing": [H, H, H]}
    shape = measured(run_of(tmp_path, points, attributes=names, start=start, body=body), {"punch"})
    assert shape.debris_particles == 0 and shape.flash_height < 1e-6


def test_an_old_cavity_is_no_groove_but_a_new_one_is(tmp_path):
    start = synthetic.lattice(H, PLATE)
    start = start[~((np.abs(start[:, 0] - 0.020) < 0.004) & (start[:, 2] > 0.003))]
    points = start.copy()
    points[(np.abs(points[:, 0] - 0.0075) < 0.002), 2] -= 0.0012
    assert measured(run_of(tmp_path, points, start=start)).groove == pytest.approx(0.0012, abs=1e-6)


def test_metal_that_did_not_move_has_no_shape(tmp_path):
    assert measured(run_of(tmp_path, synthetic.lattice(H, PLATE))) is None
