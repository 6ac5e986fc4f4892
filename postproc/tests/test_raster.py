# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import synthetic

from stirpost import raster

H = 0.001


def test_a_pixel_of_the_top_view_shows_the_highest_particle():
    points = np.array([[0.5, 0.5, 3.0], [0.5, 0.5, 9.0], [0.5, 0.5, 5.0], [1.5, 0.5, 1.0]]) * H
    index, grid = raster.top_view(points, H, np.array([0, 0, 0]) * H, np.array([2, 1, 10]) * H)
    per = round(H / grid.pixel)
    assert index.shape == (per, 2 * per)
    assert (index[:, :per] == 1).all() and (index[:, per:] == 3).all()


def test_the_top_view_of_a_lattice_is_its_top_layer():
    points = np.random.default_rng(3).permutation(synthetic.lattice(H, (0.012, 0.008, 0.004)))
    index, _ = raster.top_view(points, H, np.zeros(3), np.array([0.012, 0.008, 0.004]))
    assert np.allclose(points[index.ravel(), 2], 0.0035)
    assert len(np.unique(index)) == 12 * 8


@pytest.mark.parametrize("axis, across", [(0, 1), (1, 0)])
def test_a_section_takes_the_particles_at_the_plane(axis, across):
    points = synthetic.lattice(H, (0.012, 0.012, 0.004))
    index, grid = raster.section(
        points, H, axis, 0.0044, np.zeros(3), np.array([0.012, 0.012, 0.004])
    )
    assert np.allclose(points[index.ravel(), axis], 0.0045)
    rows, columns = np.indices(index.shape)
    assert np.abs(points[index, across] - (columns + 0.5) * grid.pixel).max() <= H / 2 * 1.0001
    assert np.abs(points[index, 2] - (rows + 0.5) * grid.pixel).max() <= H / 2 * 1.0001


def test_empty_places_stay_empty_and_narrow_gaps_close():
    index = np.full((20, 40), raster.EMPTY)
    index[5:15, 5:15], index[5:15, 17:25] = 1, 2  # a gap of two pixels
    closed = raster.close_gaps(index, 2)
    assert set(np.unique(closed[5:15, 15:17])) <= {1, 2}
    assert (closed[:5] == raster.EMPTY).all() and (closed[:, 25:] == raster.EMPTY).all()
    index[5:15, 15:24] = raster.EMPTY  # a gap of nine is a gap
    assert (raster.close_gaps(index, 2)[5:15, 15:24] == raster.EMPTY).any()


def test_values_on_pixels():
    picture = raster.values_on(np.array([[1, raster.EMPTY]]), np.array([10.0, 20.0]))
    assert picture[0, 0] == 20.0 and np.isnan(picture[0, 1])


def test_a_stray_particle_does_not_widen_the_box():
    points = np.vstack([synthetic.lattice(H, (0.05, 0.04, 0.012)), [[5.0, 0, 0]]])
    _, high = raster.common_box([points], H)
    assert high[0] < 0.06
