# SPDX-License-Identifier: MIT
"""The benchmark of speed says how long it takes."""

import importlib.machinery
import importlib.util
import pathlib

HERE = pathlib.Path(__file__).resolve().parent
loader = importlib.machinery.SourceFileLoader("speed", str(HERE / "speed"))
speed = importlib.util.module_from_spec(importlib.util.spec_from_loader("speed", loader))
loader.exec_module(speed)


def kinds(scenes):
    return [(scene, *kind) for scene in scenes for kind in ((1, 1), (2, 1), (1, 2))]


def test_default_set_takes_less_than_four_minutes():
    """By the speeds of the kept result: the default set in 240 s, all in more."""
    kept = speed.read(speed.KEPT)
    usual = speed.seconds_needed(kept, ["kernels", *speed.SCENES, "features"], kinds(speed.SCENES), 3)
    every = speed.seconds_needed(kept, ["kernels", *speed.SCENES, "features", *speed.PASSES], kinds(speed.SCENES), 5)
    print(usual, every)
    assert 100 < usual < 240 < every
    assert speed.seconds_needed(kept, [], kinds(["block"]), 1) < speed.seconds_needed(kept, [], kinds(["unknown"]), 1)
