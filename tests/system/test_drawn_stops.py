# SPDX-License-Identifier: MIT
"""Stopped at steps drawn at random and continued where metal sleeps and the mass scaling adapts: the same run, bit for bit on
as many ranks, to rounding on others, in every column of the history."""

import random
import shutil

import driver
import numpy as np
import pytest
from test_ranks import STATE, worst_column
from test_restart import assert_same_run


def drawn(seed):
    """Sets of stir.nml with a plate twice as long, ranks and the steps of three stops and of the end."""
    chance = random.Random(seed)
    sets = {"GRID.UPPER": "104e-3,48e-3,28e-3", "SHAPE.UPPER": "96e-3,40e-3,12e-3", "TIME.END": 0.5,
            "MOTION(1).VELOCITY": "0,0,-8e-3", "METHOD.SLEEPING": "on", "METHOD.SHAPE": chance.choice(["ugimp", "bspline"]),
            "METHOD.SLEEP_STRESS": 10 ** chance.uniform(-2, -0.5), "METHOD.SORT_INTERVAL": chance.choice([20, 50]),
            "METHOD.SLEEP_HEAT": chance.choice([1, 20]), "TIME.MASS_SCALING": 10 ** chance.uniform(5.5, 6.5),
            "TOOL.PIN_RADIUS": 4e-3, "TOOL.PIN_LENGTH": chance.choice([2e-3, 3e-3]), "TOOL.POSITION": "20e-3,20e-3,15.6e-3"}
    sets["MOTION(1).VELOCITY"] = "0,0,-30e-3"
    if chance.random() < 0.7:
        sets["TIME.MASS_SCALING_RANGE"] = "1e5,1e7"
    last = chance.randint(450, 650)
    return sets, chance.choice([1, 2, 3]), sorted(chance.sample(range(200, last), 3)), last


def ended(directory, start, ranks, last, sets):
    """Results of a run up to step `last`, from `start`: an input, or a checkpoint."""
    words = (start, "--quiet") if "/" not in str(start) else (None, "--quiet", "--restart", start)
    driver.run(*words, directory=directory, ranks=ranks, sets=sets | {"TIME.MAX_STEPS": last})
    name = next(directory.glob("*.out")).stem
    return driver.Results(directory / f"{name}.out", name)


@pytest.mark.parametrize("seed", [0, 1, 2, 1218])   # 1218: sleepers that end at a plane of nodes
def test_stops_at_any_step(tmp_path, seed):
    """Exact: stopped three times and continued, and once on another number of ranks."""
    sets, ranks, stops, last = drawn(seed)
    for name in ("whole", "part", "other"):
        (tmp_path / name).mkdir()
    whole = ended(tmp_path / "whole", "stir", ranks, last, sets)
    part = ended(tmp_path / "part", "stir", ranks, stops[0], sets)
    shutil.copytree(part.directory, tmp_path / "other/stir.out")
    print(seed, ranks, stops, last, sets, whole.summary()["awake_share"])
    for step in [*stops[1:], last]:
        ended(tmp_path / "part", part.path("_checkpoint.h5"), ranks, step, {})
    other = ended(tmp_path / "other", tmp_path / "other/stir.out/stir_checkpoint.h5", 1 + ranks % 3, last, {})
    apart = driver.distance(whole.checkpoint(), other.checkpoint(), STATE)
    print(apart, worst_column(whole.history(), other.history()))
    assert np.abs(whole.history()["tool_torque[Nm]"]).max() > 0.1
    assert_same_run(whole, part)
    assert max(apart.values()) < 1e-9, apart
    assert worst_column(whole.history(), other.history())[1] < 1e-7


@pytest.mark.parametrize("stop, ranks", [(304, 2), (random.Random(1).randint(100, 400), 3)])
def test_contact_history_on_other_ranks(tmp_path, stop, ranks):
    """Exact: what a particle keeps of its last contact does not depend on a sort, which other ranks need at the restart, nor
    friction of a wall on whether the rank of a particle stores the node on the wall behind the last one that it reaches (3 ranks)."""
    for name in ("whole", "part"):
        (tmp_path / name).mkdir()
    whole = ended(tmp_path / "whole", "path", ranks, 450, {})
    part = ended(tmp_path / "part", "path", ranks, stop, {})
    part = ended(tmp_path / "part", part.path("_checkpoint.h5"), 1, 450, {})
    apart = driver.distance(whole.checkpoint(), part.checkpoint(), STATE)
    print(stop, apart)
    assert max(apart.values()) < 1e-9, apart
