# SPDX-License-Identifier: MIT
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import synthetic

from stirpost import cli
from stirpost.analysis import alarms, summary
from stirpost.io.table import Column, Table
from stirpost.plots import curves, maps
from stirpost.run import Run

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
    "wall_loads",
    "energies",
    "history",
}


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    return synthetic.make_run(tmp_path_factory.mktemp("runs") / "plate.out")


def test_the_report_holds_every_picture_the_figures_and_the_input(plate, tmp_path):
    assert cli.main(["report", str(plate), "-o", str(tmp_path)]) == 0
    written = {path.stem for path in tmp_path.glob("*.png")}
    assert written - {"surface_hottest"} == PICTURES - {"surface_hottest"}
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/webp;base64,") == len(written)
    assert "&lt;rpm&gt; &amp; more" in page
    assert "pin torque: peak" in page and "N m" in page
    assert "Phases of pin: means" in page and "<td>travel</td>" in page


def test_a_probe_file_without_probes_is_no_error(tmp_path):
    directory = synthetic.make_run(tmp_path / "none.out", spacing=0.004, frames=1, probes=False)
    (directory / "none_probes.csv").write_text("time[s]\n0.0\n1.0\n")
    assert cli.main(["report", str(directory)]) == 0


def test_frames_without_temperature_are_drawn_as_far_as_they_go(tmp_path):
    """A frame of one field, and neither probes, history nor series."""
    directory = tmp_path / "cold.out"
    directory.mkdir()
    points = synthetic.lattice(0.004)
    synthetic.write_frame(
        directory / "cold_000000.hdf", points, {"plastic_strain": np.zeros(len(points))}, 0.0
    )
    assert cli.main(["report", str(directory)]) == 0
    assert {path.stem for path in (directory / "report").glob("*.png")} == {
        "plastic_strain_top",
        "plastic_strain_cross_section",
        "plastic_strain_long_section",
    }


def test_an_empty_directory_ends_with_2_and_one_line(tmp_path):
    done = subprocess.run([sys.executable, "-m", "stirpost", "report", str(tmp_path)], capture_output=True, text=True,
                          cwd=Path(__file__).parents[1])
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


def test_sections_follow_the_tool_where_the_history_tells_it(plate):
    run = Run(plate)
    frames = maps.choose_frames(run.frames)
    clouds = [frame.points() for frame in frames]
    places, follows = maps.section_positions(run, frames, clouds)
    assert follows == "the axis of pin"
    assert [place[0] for place in places] == pytest.approx([0.020 + 0.005 * frame.time for frame in frames])
    assert [place[1] for place in places] == pytest.approx([0.02] * len(frames))
    scene = maps.build_scene(run, frames)
    assert [view.title.split("x = ")[1] for view in scene.cross][-1] == "80.0 mm"
    run.history = Table([])
    places, follows = maps.section_positions(run, frames, clouds)
    assert follows == "the hottest place" and places[-1][0] == pytest.approx(0.08, abs=4e-3)


def test_key_figures(plate):
    rows = dict(summary.key_figures(Run(plate)))
    assert rows["simulated time"] == "12.00 s" and rows["time steps"] == "3000"
    assert rows["particles"] == f"{len(synthetic.lattice(0.002))}"
    assert rows["particle spacing"] == "2 mm"
    assert rows["audit error: largest"].endswith("%")
    assert rows["pin force z: peak"].endswith("kN") and "pin power: peak" in rows
    assert rows["wall zmin force z: peak; at the end"].count("kN") == 2
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
        "flash: height above the initial top face": "0.00 mm",
        "flash: volume above the initial top face": "0 mm³",
        "debris": "1 particle in 1 piece, 1 mm³",
        "groove: greatest depth below the initial top face": "1.50 mm",
    }


def test_curves_take_every_group_that_is_there(plate):
    history = Run(plate).history
    assert len(curves.tool_loads(history).axes) == 3
    axes = curves.energies(history).axes
    assert axes[-1].get_ylabel().startswith("audit error")
    drawn = sum(len(axis.lines) for axis in axes[:-1])
    assert drawn == sum(bool(np.any(column.values)) for column in history.with_unit("J"))
    for axis, change in zip(axes, ([line.get_ydata()[0] for line in axis.lines] for axis in axes)):
        assert not axis.get_ylabel().startswith("heat stored") or change == [0.0] * len(change)
        legend, figure = axis.get_legend(), axis.figure
        assert legend is None or legend.get_window_extent().x1 <= figure.get_figwidth() * figure.dpi
    only_time = Table([Column("time", "s", np.arange(3.0)), Column("step", "", np.arange(3.0))])
    assert curves.tool_loads(only_time) is None and curves.energies(only_time) is None
    assert curves.others(only_time) is None


def edit_history(directory, change):
    path = directory / f"{directory.name[:-4]}_history.csv"
    path.write_text(change(path.read_text()))


LEFT = [(0, "one row"), (1, "whole"), (1, "one row"), (2, "no tool"), (0, "not a number"), (0, "two tools"), (0, "none")]


@pytest.mark.parametrize("frames, history", LEFT)
def test_whatever_a_run_has_left(tmp_path, frames, history):
    """Aborted runs, heat alone, runs without tools or with several: a page of what there is, no traceback."""
    directory = synthetic.make_run(tmp_path / "rest.out", spacing=0.008, frames=max(frames, 1), rows=30)
    if frames == 0:
        for path in directory.glob("*.hdf*"):
            path.unlink()

    def change(text):
        lines = text.splitlines()
        if history == "one row":
            return "\n".join(lines[:4]) + "\n"
        if history == "no tool":
            return "".join(",".join(line.split(",")[:6]) + "\n" for line in lines[2:])
        if history == "not a number":
            last = lines[-1].split(",")
            return "\n".join(lines[:-1] + [",".join([last[0]] + ["NaN"] * (len(last) - 1))]) + "\n"
        if history == "two tools":
            head = lines[2].split(",")
            cut = head.index("pin_torque[Nm]")
            more = [name.replace("pin_", "second_") for name in head[cut:] if name.startswith("pin_")]
            rows = [line.split(",") for line in lines[3:]]
            keep = [k for k in range(cut, len(head)) if head[k].startswith("pin_")]
            return "\n".join([",".join(head + more)] + [",".join(r + [r[k] for k in keep]) for r in rows]) + "\n"
        return text

    if history == "none":
        (directory / "rest_history.csv").unlink()
    else:
        edit_history(directory, change)
    if history == "none":
        assert cli.main(["report", str(directory)]) == 2
        return
    assert cli.main(["report", str(directory)]) == 0
    page = (directory / "report" / "report.html").read_text()
    assert "nan" not in re.sub(r"data:[^\"]*|<script>.*?</script>|<style>.*?</style>", "", page, flags=re.S).lower().replace("means", "").replace("is &#39;nan&#39;, no number", "")
    assert ("Phases of second" in page) == (history == "two tools")
    assert ("rest_history.csv:33: column 2, step, is &#39;NaN&#39;, no number, and 24 more such values" in page) == (history == "not a number")


def test_what_to_be_wary_of_stands_on_the_page(tmp_path, capsys):
    directory = synthetic.make_run(tmp_path / "hot.out", spacing=0.004, frames=2)
    synthetic.write_summary(directory, melted_share_max=0.02, hottest_over_melting_K=41.0)
    edit_history(directory, lambda text: text.replace("audit_error[%],", "inertial_stress_over_flow[%],", 1))
    found = alarms.alarms(Run(directory))
    assert any("hotter than its melting point" in text and "2 %" in text and "41 K" in text for text in found)
    assert not any("energy balance" in text for text in found)
    for path in directory.glob("*.hdf*"):
        path.unlink()
    assert cli.main(["report", str(directory)]) == 0
    assert "melting point" in capsys.readouterr().out
    assert "melting point" in (directory / "report" / "report.html").read_text()


def test_a_run_that_went_well_has_nothing_to_be_wary_of(tmp_path):
    directory = synthetic.make_run(tmp_path / "well.out", spacing=0.004, frames=2)
    assert [text.split(":")[0] for text in alarms.alarms(Run(directory))] == ["The run has not ended, or was killed"]
    synthetic.write_summary(directory)
    assert alarms.alarms(Run(directory)) == []
    (directory / "well_broken.h5").touch()
    assert len(alarms.alarms(Run(directory))) == 1


def test_limits_of_inertia_and_balance(tmp_path):
    text = "&TIME\n  END = 12.0\n  MASS_SCALING = 1e5\n  INERTIAL_FRACTION = 0.1\n/\n&GRID\n  CELL = 1\n/\n"
    directory = synthetic.make_run(tmp_path / "fast.out", spacing=0.004, frames=2, input_text=text)
    synthetic.write_summary(directory)
    run = Run(directory)
    assert run.scene.get("TIME.MASS_SCALING") == 1e5 and run.scene.get("grid.cell") == 1.0
    assert run.scene.get("TIME.CELL") is None
    time = np.arange(3.0) * 6.0
    for inertia, audit, count in ((9.0, 0.5, 0), (11.0, 0.5, 1), (11.0, -3.0, 2)):
        run.history = Table([
            Column("time", "s", time),
            Column("inertial_stress_over_flow", "%", np.array([0.0, inertia, 1.0])),
            Column("audit_error", "%", np.array([0.0, audit, 0.0])),
        ])
        assert len(alarms.alarms(run)) == count
