# SPDX-License-Identifier: MIT
import matplotlib
import numpy as np
import pytest
import synthetic
from matplotlib.colors import Normalize

from stirpost.analysis import surface
from stirpost.io.frames import NoRun
from stirpost.io.mesh import loops
from stirpost.plots import maps, views
from stirpost.run import Run

H = 0.001
SIZE = np.array([0.02, 0.016, 0.012])


def test_the_surface_is_closed_and_lies_where_the_metal_ends():
    """Of a block of particles: volume, faces to a tenth of a particle, and no holes."""
    mesh = surface.reconstruct(synthetic.lattice(H, SIZE), H).to_pyvista()
    assert mesh.n_open_edges == 0 and mesh.is_manifold
    bounds = np.reshape(mesh.bounds, (3, 2))
    assert np.abs(bounds[:, 0]).max() < 0.1 * H and np.abs(bounds[:, 1] - SIZE).max() < 0.1 * H
    assert mesh.volume == pytest.approx(np.prod(SIZE), rel=0.04)  # edges are round to half a particle


@pytest.mark.parametrize("name, low, high", [("SMOOTHING", 0.75, 1.5), ("CUBE", 0.5, 1.5), ("SMOOTHINGS", 0.5, 2.0)])
def test_other_numbers_give_nearly_the_same_surface(name, low, high, monkeypatch):
    """The faces of a block move by a fifth of a particle at most."""
    points = synthetic.lattice(H, SIZE)
    for factor in (low, high):
        monkeypatch.setattr(surface, name, type(getattr(surface, name))(factor * getattr(surface, name)))
        bounds = surface.reconstruct(points, H).bounds
        assert np.abs(bounds - [np.zeros(3), SIZE]).max() < 0.2 * H
        monkeypatch.undo()


def test_fields_on_the_surface_are_those_of_the_particles_there():
    points = synthetic.lattice(H, SIZE)
    mesh = surface.reconstruct(points, H, {"temperature": 300.0 + 1e4 * points[:, 0]})
    assert mesh["temperature"] == pytest.approx(300.0 + 1e4 * mesh.points[:, 0], abs=1e4 * 0.6 * H)


def test_a_section_is_metal_where_the_metal_is():
    """A hole through the block is empty, its walls are lines; values are those of the particles."""
    points = synthetic.lattice(H, SIZE)
    hole = np.hypot(points[:, 0] - 0.01, points[:, 2] - 0.006) < 0.003
    mesh = surface.reconstruct(points[~hole], H)
    lines = loops(mesh, 1, 0.008)
    assert len(lines) == 2 and all(np.allclose(line[0], line[-1]) for line in lines)
    view = maps.View(None, np.zeros(3) - H, SIZE + H, "", mesh, 1)
    view = maps.section(view, points[~hole], 0.008, H)
    area = view.inside.mean() * np.prod((SIZE + 2 * H)[[0, 2]])
    assert area == pytest.approx(SIZE[0] * SIZE[2] - np.pi * 0.003**2, rel=0.05)

    class Frame:
        def need(self, name):
            return points[~hole][:, 0]

    view.frame = Frame()
    picture = view.values("x")
    columns = np.nonzero(view.inside)[1]
    there = -H + (columns + 0.5) * (SIZE[0] + 2 * H) / view.shape[1]
    assert np.isnan(picture[~view.inside]).all() and np.abs(picture[view.inside] - there).max() < 0.75 * H


@pytest.mark.parametrize("contact", (False, True))
def test_bodies_that_move_as_one_share_a_surface(tmp_path, contact):
    """Bodies whose particles are mixed at random fill a plate without a hole in its section; bodies with a &CONTACT have surfaces of their own."""
    directory = tmp_path / "two.out"
    directory.mkdir()
    one = synthetic.lattice(H, (0.01, 0.01, 0.004))
    points = np.vstack([one, one + [0.0, 0.0, 0.004]])
    body = np.repeat([1, 2], len(one)) if contact else np.random.default_rng(7).integers(1, 3, 2 * len(one))
    synthetic.write_frame(directory / "two_000000.hdf", points, {"body": body.astype(np.int32)}, 0.0, attributes={"body_names": [b"One", b"two"]},
                          input_text="&CONTACT BODY = 'one', OTHER = 'two' /\n" if contact else "")
    run = Run(directory)
    mesh = surface.metal(run, run.frames[0], [])
    assert len(mesh.to_pyvista().split_bodies()) == 1 + contact
    with pytest.raises(NoRun, match="two_000000.hdf: no field grain_size"):
        surface.metal(run, run.frames[0], ["grain_size"])
    if not contact:
        view = maps.section(maps.View(run.frames[0], points.min(axis=0), points.max(axis=0), "", mesh, axis=0), points, 0.005, H)
        assert view.inside[3:-3, 3:-3].all()


def test_from_above_x_is_to_the_right_and_y_up():
    points = synthetic.lattice(H, SIZE)
    mesh = surface.reconstruct(points, H, {"x": points[:, 0], "y": points[:, 1]})
    norm = Normalize(0.0, 0.02)
    for name, first, second in (("x", (8, 20), (8, 180)), ("y", (140, 100), (20, 100))):
        image = views.from_above(mesh, name, norm, matplotlib.colormaps["gray"], np.zeros(3), SIZE, 200)
        assert image[first].mean() < image[second].mean() - 50


def test_a_stray_particle_does_not_widen_the_box():
    points = np.vstack([synthetic.lattice(H, (0.05, 0.04, 0.012)), [[5.0, 0, 0]]])
    _, high = maps.common_box([points], H)
    assert high[0] < 0.06
