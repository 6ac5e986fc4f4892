# SPDX-License-Identifier: MIT
"""The moving picture of a weld."""

import argparse

import pytest
import synthetic
from PIL import Image

from stirpost import cli
from stirpost.cli import film
from stirpost.io.frames import NoRun
from stirpost.io.scene import Scene
from stirpost.io.table import Table
from stirpost.run import Run

INPUT = f"&BODY NAME = 'plate' /\n&TOOL NAME = 'pin', RADIUS = {synthetic.SHOULDER} /\n"


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    directory = synthetic.make_run(tmp_path_factory.mktemp("runs") / "plate.out", spacing=0.002, frames=5, input_text=INPUT)
    synthetic.write_tools(directory)
    return directory


@pytest.mark.parametrize("colour, suffix", [("strain", "webp"), ("origin", "gif")])
def test_a_film_has_a_picture_of_each_frame_and_is_small(plate, tmp_path, colour, suffix):
    path = tmp_path / f"film.{suffix}"
    assert cli.main(["film", str(plate), "--colour", colour, "--most", "0.3", "-o", str(path)]) == 0
    assert path.stat().st_size < 0.3e6
    with Image.open(path) as image:
        assert image.n_frames == 5 and image.width > 200


def test_the_cut_follows_the_tool(plate):
    """Metal is seen from the cut on, which is the same distance behind the tool in every frame; its face is full of metal."""
    made = film.Film(Run(plate), argparse.Namespace(colour="origin", behind=12.0, frames=10))
    for frame in made.frames[2:]:
        metal, tool, face = made.parts(frame)
        at = 0.005 * (frame.time - made.tool_path.time[0]) - 0.012
        assert metal.points[:, 0].min() == pytest.approx(at, abs=1e-5)
        assert face[0][:, 0] == pytest.approx(at, abs=2e-5)
        assert tool.bounds[:, 0].mean() == pytest.approx(at + 0.012, abs=1e-4)


def test_a_tool_that_makes_no_film_is_named(tmp_path):
    """Without a tool, without its radius, or one that stands, the reason is told."""
    run = Run(synthetic.make_run(tmp_path / "plate.out", spacing=0.004, frames=2, input_text=INPUT))
    history, scene = run.history, run.scene
    for reason in ("no tool", "no RADIUS of pin", "pin does not travel"):
        run.history = Table([]) if reason == "no tool" else history
        run.scene = Scene("") if "RADIUS" in reason else scene
        if "travel" in reason:
            run.history.frame[["pin_x", "pin_y"]] = 0.02
        with pytest.raises(NoRun, match=reason):
            film.Film(run, argparse.Namespace(colour="strain", behind=None, frames=2))


def test_what_makes_no_film_is_one_line(plate, tmp_path, capsys):
    other = synthetic.make_run(tmp_path / "other.out", spacing=0.004, frames=2)  # its input has no radius
    assert cli.main(["film", str(other)]) == 2
    assert cli.main(["film", str(plate), "-o", str(tmp_path / "film.mp4")]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2 and ".webp or .gif" in lines[1]
