# SPDX-License-Identifier: MIT
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import synthetic

from stirpost import cli, curves, maps, summary, surface
from stirpost.run import Run
from stirpost.table import Column, Table

PICTURES = {
    "surface_end",
    "surface_hottest",
    "temperature_top",
    "temperature_cross_section",
    "temperature_long_section",
    "plastic_strain_top",
    "plastic_strain_cross_section",
    "plastic_strain_long_section",
    "thermocouples",
    "tool_loads",
    "energies",
    "history",
}


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    return synthetic.make_run(tmp_path_factory.mktemp("runs") / "plate.out")


def test_the_report_holds_every_picture_the_figures_and_the_input(plate, tmp_path):
    assert cli.main([str(plate), "-o", str(tmp_path)]) == 0
    written = {path.stem for path in tmp_path.glob("*.png")}
    assert written - {"surface_hottest"} == PICTURES - {"surface_hottest"}
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/png;base64,") == len(written)
    assert not re.search(r'(src|href)="(?!data:)', page)  # nothing from elsewhere
    assert "&lt;rpm&gt; &amp; more" in page
    assert "pin torque: peak" in page and "N m" in page


def test_missing_probes_history_and_series_are_no_error(tmp_path):
    directory = synthetic.make_run(tmp_path / "bare.out", spacing=0.004, frames=1, probes=False)
    (directory / "bare_history.csv").unlink()
    (directory / "bare.hdf.series").unlink()
    assert cli.main([str(directory)]) == 0
    assert (directory / "report" / "report.html").is_file()
    assert not (directory / "report" / "thermocouples.png").exists()


def test_a_probe_file_without_probes_is_no_error(tmp_path):
    directory = synthetic.make_run(tmp_path / "none.out", spacing=0.004, frames=2, probes=False)
    (directory / "none_probes.csv").write_text("time[s]\n0.0\n1.0\n")
    assert cli.main([str(directory)]) == 0


def test_frames_without_temperature_are_drawn_as_far_as_they_go(tmp_path):
    directory = tmp_path / "cold.out"
    directory.mkdir()
    points = synthetic.lattice(0.004)
    synthetic.write_frame(
        directory / "cold_000000.hdf", points, {"plastic_strain": np.zeros(len(points))}, 0.0
    )
    assert cli.main([str(directory)]) == 0
    assert {path.stem for path in (directory / "report").glob("*.png")} == {
        "plastic_strain_top",
        "plastic_strain_cross_section",
        "plastic_strain_long_section",
    }


def test_an_empty_directory_ends_with_2_and_one_line(tmp_path):
    script = Path(__file__).parents[1] / "report.py"
    done = subprocess.run(
        [sys.executable, str(script), str(tmp_path)], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1 and "no run here" in done.stderr


def test_at_most_four_frames_with_the_first_and_the_last():
    assert maps.choose_frames(list("abcdefghijkl")) == ["a", "e", "h", "l"]
    assert maps.choose_frames(["a"]) == ["a"]
    assert maps.choose_frames(["a", "b"]) == ["a", "b"]


def test_the_section_goes_through_the_hottest_place():
    x = np.linspace(0, 0.1, 2000)
    assert maps.hottest_place(x, 300 + 500 * np.exp(-(((x - 0.07) / 0.01) ** 2))) == pytest.approx(
        0.07, abs=1e-3
    )
    assert maps.hottest_place(x, np.full_like(x, 293.0)) is None


def test_the_section_follows_the_tool_where_the_history_tells_it(plate):
    run = Run(plate)
    time = np.array([0.0, 12.0])
    run.history = Table(
        [
            Column("time", "s", time),
            Column("pin_torque", "Nm", time),
            Column("pin_x", "m", np.array([0.02, 0.08])),
        ]
    )
    assert maps.tool_from_history(run, 6.0) == pytest.approx(0.05)


def test_key_figures(plate):
    rows = dict(summary.key_figures(Run(plate)))
    assert rows["simulated time"] == "12.00 s" and rows["time steps"] == "3000"
    assert rows["particles"] == f"{len(synthetic.lattice(0.002))}"
    assert rows["particle spacing"] == "2 mm"
    assert rows["audit error: largest"].endswith("%")
    assert rows["pin force z: peak; mean of the last quarter"].count("kN") == 2
    assert re.fullmatch(r"587 K \(314 .C\) at \d\.\d\d s", rows["thermocouple T1: peak"])


def test_flash_and_groove_are_measured_from_the_first_top_face(tmp_path):
    directory = tmp_path / "bump.out"
    directory.mkdir()
    points = synthetic.lattice(0.001, (0.02, 0.02, 0.004))
    synthetic.write_frame(directory / "bump_000000.hdf", points, {}, 0.0)
    points[(np.abs(points[:, :2] - 0.0105) < 0.0012).all(axis=1), 2] -= 0.0015  # 3 x 3 columns
    points[
        (np.abs(points[:, :2] - 0.0055) < 0.0002).all(axis=1), 2
    ] -= 0.0030  # one column: a chink
    points[np.argmax(points[:, 2] + (points[:, 0] < 0.004)), 2] += 0.0025
    synthetic.write_frame(directory / "bump_000001.hdf", points, {}, 1.0)
    rows = dict(summary.shape_rows(Run(directory)))
    assert rows == {
        "highest particle above the first top face": "2.50 mm",
        "deepest place of the surface below it": "1.50 mm",
    }


def test_the_nearest_particle_hides_those_behind():
    seen = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.002], [0.01, 0.0, 0.0]])
    grid = surface.raster.Grid.over((-0.002, -0.002), (0.012, 0.002), 0.0002)
    index, depth = surface.nearest_particles(seen, 0.001, grid)
    assert set(np.unique(index)) == {-1, 1, 2}
    assert np.nanmax(depth) == pytest.approx(0.002 + 0.00085, abs=2e-5)


def test_a_slope_has_no_hollows():
    v, u = np.mgrid[0:60, 0:60] * 0.1
    flat = surface.hollowness(0.3 * u - 0.2 * v, 3, 0.1)[15:-15, 15:-15]
    assert np.abs(flat).max() < 1e-12
    pit = surface.hollowness(np.where(np.hypot(u - 3, v - 3) < 0.3, -1.0, 0.0), 3, 0.1)
    assert pit[30, 30] > 0.1


def test_curves_take_every_group_that_is_there(plate):
    history = Run(plate).history
    assert len(curves.tool_loads(history).axes) == 3
    axes = curves.energies(history).axes
    assert axes[-1].get_ylabel().startswith("audit error")
    drawn = sum(len(axis.lines) for axis in axes[:-1])
    assert drawn == sum(bool(np.any(column.values)) for column in history.with_unit("J"))
    only_time = Table([Column("time", "s", np.arange(3.0)), Column("step", "", np.arange(3.0))])
    assert curves.tool_loads(only_time) is None and curves.energies(only_time) is None
    assert curves.others(only_time) is None
