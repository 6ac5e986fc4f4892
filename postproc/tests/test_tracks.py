# SPDX-License-Identifier: MIT
"""Pathlines of tracers that go round circles."""

import numpy as np
import pytest
import pyvista as pv
import synthetic

from stirpost import cli
from stirpost.analysis import tracks
from stirpost.cli.tracks import picture
from stirpost.run import Run

RADIUS = np.array([2e-3, 3e-3, 4e-3, 5e-3])
CENTRE = np.array([0.05, 0.02, 0.01])
GROUPS = ["ring", "ring", "rim", "rim"]


def place(k, t):
    """Of tracer k at a time [s]; the last ones also rise."""
    angle = t + 0.3 * k
    return CENTRE + RADIUS[k] * np.array([np.cos(angle), np.sin(angle), 0.0]) + [0.0, 0.0, 1e-3 * t * (k > 1)]


@pytest.fixture
def run(tmp_path):
    """Four tracers, rows of all of them time by time; the third is lost half way; a row cut short; one repeated after a restart."""
    directory = synthetic.make_run(tmp_path / "circles.out", spacing=0.008, frames=2, rows=10)
    rows = ["# circles", "time[s],group,tracer,id,body,x[m],y[m],z[m],temperature[K],plastic_strain[1]"]
    times = np.linspace(0.0, 6.0, 61)
    for t in [*times, times[-1]]:
        for k in range(4):
            if k != 2 or t < 3.0:
                rows.append(f"{t:.12E},{GROUPS[k]},{k + 1},{100 + k},plate," + ",".join(f"{v:.8E}" for v in (*place(k, t), 300 + 10 * t + k, 0.1 * t)))
    (directory / "circles_tracers.csv").write_text("\n".join(rows) + "\n6.1E+00,ring,1,100\n")
    return Run(directory)


def test_lines_for_vtk(run, tmp_path):
    """Exact: a line a tracer, as long as its arc, with what it was at each point and where it began."""
    mesh = tracks.polydata(tracks.Tracks.read(run))
    mesh.save(tmp_path / "a.vtp")
    mesh = pv.read(tmp_path / "a.vtp")
    assert mesh.n_lines == 4 and mesh.n_points == 3 * 61 + 30
    length = mesh.compute_cell_sizes(length=True, area=False, volume=False)["Length"]
    arcs = [6.0 * RADIUS[0], 6.0 * RADIUS[1], 2.9 * np.hypot(RADIUS[2], 1e-3), 6.0 * np.hypot(RADIUS[3], 1e-3)]
    assert length == pytest.approx(arcs, rel=1e-3)
    assert mesh.cell_data["tracer"].tolist() == [1, 2, 3, 4] and mesh.cell_data["id"].tolist() == [100, 101, 102, 103]
    assert mesh.cell_data["group"].tolist() == [0, 0, 1, 1] and list(mesh.field_data["group_names"]) == ["ring", "rim"]
    starts = np.column_stack([mesh.cell_data[f"origin_{axis}"] for axis in "xyz"])
    assert starts == pytest.approx(np.array([place(k, 0.0) for k in range(4)]), abs=1e-9)
    first = mesh.get_cell(3).point_ids
    assert mesh.point_data["time"][first] == pytest.approx(np.linspace(0, 6, 61))
    assert mesh.point_data["temperature"][first] == pytest.approx(303 + 10 * np.linspace(0, 6, 61))
    assert mesh.points[first[-1]] == pytest.approx(place(3, 6.0), abs=1e-7)


def test_pictures(run):
    """All colours; lines drawn are those of the chosen group up to the time, in the three views; what is missing is said."""
    assert cli.main(["tracks", str(run.directory)]) == 0
    made = {path.name for path in (run.directory / "report").iterdir()}
    assert made == {"tracks_origin.png", "tracks_time.png", "tracks_temperature.png", "tracks.vtp"}
    some = tracks.Tracks.read(run, ["rim"], until=1.0)
    figure = picture(run, some, "origin")
    for panel, across, up in zip(figure.axes, (0, 2, 0), (1, 1, 2)):
        segments = np.array(panel.collections[0].get_segments())
        assert len(segments) == 2 * 10
        assert segments[-1, -1] == pytest.approx(1e3 * place(3, 1.0)[[across, up]], abs=1e-6)
        assert segments[9, -1] == pytest.approx(1e3 * place(2, 1.0)[[across, up]], abs=1e-6)
    values = figure.axes[0].collections[0].get_array()
    assert values[0] == pytest.approx(1e3 * place(2, 0.0)[1]) and values[-1] == pytest.approx(1e3 * place(3, 0.0)[1])


def test_what_is_missing(run, tmp_path, capsys):
    assert cli.main(["tracks", str(run.directory), "--group", "ring", "none"]) == 2
    assert "no group none; there are: ring, rim" in capsys.readouterr().err
    (run.directory / "circles_tracers.csv").unlink()
    assert cli.main(["tracks", str(run.directory)]) == 2
    assert "the input has no &TRACER" in capsys.readouterr().err
