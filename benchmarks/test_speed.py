# SPDX-License-Identifier: MIT
"""The benchmark of speed says how long it takes, and keeps what versions reached."""

import importlib.machinery
import importlib.util
import pathlib
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
loader = importlib.machinery.SourceFileLoader("speed", str(HERE / "speed"))
speed = importlib.util.module_from_spec(importlib.util.spec_from_loader("speed", loader))
loader.exec_module(speed)


def kinds(scenes):
    return [(scene, *kind) for scene in scenes for kind in ((1, 1), (2, 1), (1, 2))]


def test_default_set_takes_less_than_four_minutes():
    """By the speeds of the kept result: the default set in 240 s, all in more."""
    kept = speed.read(speed.KEPT)
    usual = speed.seconds_needed(kept, ["kernels", *speed.SCENES], kinds(speed.SCENES), 3)
    every = speed.seconds_needed(kept, ["kernels", *speed.SCENES, *speed.PASSES], kinds(speed.SCENES), 5)
    print(usual, every)
    assert 100 < usual < 240 < every
    assert speed.seconds_needed(kept, [], kinds(["block"]), 1) < speed.seconds_needed(kept, [], kinds(["unknown"]), 1)


def test_versions_are_kept(tmp_path, monkeypatch):
    """A kept result becomes a row with its ratios; the table has a row for each version."""
    lines = speed.read(speed.KEPT)
    monkeypatch.setattr(speed, "VERSIONS", tmp_path / "versions.jsonl")
    speed.keep(lines)
    speed.keep(lines)
    one, two = speed.read(tmp_path / "versions.jsonl")
    assert one == two and one["version"] == lines[0]["version"]
    assert abs(one["stirring_over_block"] - lines[-1]["stirring_over_block"]) < 1e-4
    table = subprocess.run([HERE / "speed", "--versions"], check=True, capture_output=True, text=True).stdout.splitlines()
    assert len(table) == 2 + len((HERE / "speed_versions.jsonl").read_text().splitlines())
