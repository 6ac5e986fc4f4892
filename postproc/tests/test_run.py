# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import synthetic

from stirpost.io.frames import Frame, NoRun, particle_spacing
from stirpost.run import Run


def test_frames_in_the_order_of_the_series(tmp_path):
    directory = synthetic.make_run(tmp_path / "plate.out", spacing=0.004, frames=3)
    synthetic.write_series(directory, "plate", [0.0, 1.5, 2.5])  # the series tells the times
    run = Run(directory)
    assert run.name == "plate"
    assert [frame.time for frame in run.frames] == [0.0, 1.5, 2.5]
    assert [frame.path.name for frame in run.frames][1] == "plate_000001.hdf"
    assert run.input_text == synthetic.INPUT.rstrip()


def test_without_a_series_the_frames_carry_their_times(tmp_path):
    directory = synthetic.make_run(tmp_path / "plate.out", spacing=0.004, frames=3)
    (directory / "plate.hdf.series").unlink()
    assert [frame.time for frame in Run(directory).frames] == [0.0, 6.0, 12.0]


def test_frames_that_are_missing_or_broken_are_left_out(tmp_path):
    directory = synthetic.make_run(tmp_path / "plate.out", spacing=0.004, frames=4)
    (directory / "plate_000001.hdf").unlink()
    (directory / "plate_000003.hdf").write_bytes(b"cut short")
    assert [frame.time for frame in Run(directory).frames] == [0.0, 8.0]


def test_a_renamed_directory_is_read(tmp_path):
    directory = synthetic.make_run(tmp_path / "plate.out", spacing=0.004, frames=2)
    assert Run(directory.rename(tmp_path / "kept for later")).name == "plate"


def test_fields_and_those_that_are_not_there(tmp_path):
    path = tmp_path / "a_000000.hdf"
    points = synthetic.lattice(0.002)
    synthetic.write_frame(
        path, points, {"temperature": np.arange(len(points))}, 0.5, step=7, ranks=3
    )
    frame = Frame(path)
    assert (frame.count, frame.step, frame.time) == (len(points), 7, 0.5)
    assert frame.field("temperature")[-1] == len(points) - 1
    assert frame.field("pressure") is None


def test_particles_without_a_position_are_left_out(tmp_path):
    path = tmp_path / "a_000000.hdf"
    points = synthetic.lattice(0.01)
    points[3] = np.nan
    synthetic.write_frame(path, points, {"id": np.arange(len(points))}, 0.0)
    frame = Frame(path)
    assert len(frame.points()) == len(points) - 1
    assert 3 not in frame.field("id")


@pytest.mark.parametrize(
    "attributes, expected",
    [(None, 0.0008), ({"spacing": 0.001}, 0.001), ({"spacing": [0.001, 0.002]}, 0.002)],
)
def test_spacing_is_given_or_measured(tmp_path, attributes, expected):
    path = tmp_path / "a_000000.hdf"
    points = np.random.default_rng(1).permutation(synthetic.lattice(0.0008, (0.02, 0.02, 0.01)))
    synthetic.write_frame(path, points, {}, 0.0, attributes=attributes)
    assert particle_spacing(Frame(path)) == pytest.approx(expected, rel=1e-4)


def test_an_empty_directory_is_no_run(tmp_path):
    with pytest.raises(NoRun):
        Run(tmp_path)
    with pytest.raises(NoRun):
        Run(tmp_path / "absent")


def test_two_runs_in_one_directory(tmp_path):
    directory = synthetic.make_run(tmp_path / "plate.out", spacing=0.004, frames=2).rename(tmp_path / "both")
    for suffix in ("_history.csv", ".hdf.series"):
        for path in list(directory.glob(f"*{suffix}")):
            (directory / f"other{suffix}").write_bytes(path.read_bytes())
    with pytest.raises(NoRun, match="more than one run .*other"):
        Run(directory)


def test_surfaces_of_tools_that_are_cut_short(tmp_path):
    directory = synthetic.make_run(tmp_path / "plate.out", spacing=0.004, frames=2)
    (directory / "plate_tools_000001.hdf").write_bytes(b"cut short")
    run = Run(directory)
    assert run.tools(run.frames[-1]) is None
