# SPDX-License-Identifier: MIT
"""A few kills and full disks of tests/robustness/kills.py and full_disk.py, which do many."""

import shutil

import chain
import full_disk
import kills
import pandas
import pytest


def test_kills(tmp_path):
    """Exact: a chain of kills of each of two scenes leaves the same rows, frames and state."""
    met, bad = kills.try_all([kills.SCENES[0], kills.SCENES[3]], 4, 5, tmp_path)
    assert met >= 4 and bad == []


@pytest.mark.parametrize("scene", kills.SCENES, ids=lambda scene: scene.label)
def test_killed_behind_the_last_checkpoint(scene, tmp_path):
    """Exact: the last rows and frame are written once, and the same, by a run that goes on at its end."""
    state = kills.whole(scene, tmp_path / "whole")[1]
    for left in "all", "none":
        directory = tmp_path / left
        shutil.copytree(tmp_path / "whole", directory)
        folder = scene.folder(directory)
        if left == "none":
            sorted(folder.glob(f"{scene.name}_[0-9]*.hdf"))[-1].unlink()
        go_on(scene, directory)
        assert chain.differences(state, chain.state_of(folder, scene.name)) == []


def go_on(scene, directory, **more):
    """Continue a run from its checkpoint, with other overrides too."""
    again = chain.Scene(scene.label, str(scene.path), scene.sets | more, scene.ranks, scene.more)
    one = chain.Process(again, directory, "--restart", str(scene.folder(directory) / f"{scene.name}_checkpoint.h5"))
    try:
        assert one.wait(300) == 0, (directory / "log.txt").read_text()
    finally:
        one.end()


def test_longer_end(tmp_path):
    """Exact: a run that gets a later end has no rows that were due at the old end alone."""
    kills.whole(kills.SCENES[1], tmp_path / "one")
    go_on(kills.SCENES[1], tmp_path / "one", **{"TIME.END": 0.21})
    rows = pandas.read_csv(kills.SCENES[1].folder(tmp_path / "one") / "stir_tracers.csv", comment="#")
    assert not rows.duplicated(["time[s]", "group", "tracer"]).any()
    times = rows[rows.group == "layer"]["time[s]"].unique()
    assert times[-1] > 0.2 and (times[1:-1] // 7e-4 > times[:-2] // 7e-4).all()


def test_full_disks(tmp_path):
    """Exact: each kind of file once."""
    assert full_disk.try_all([full_disk.SCENES[0], full_disk.SCENES[3]], 16, 3, tmp_path) == []
