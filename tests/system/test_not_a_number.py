# SPDX-License-Identifier: MIT
"""A state that is not a number is refused at a restart, with the particle and the field; one that no step can follow ends the run."""

import driver
import h5py
import numpy as np
import pytest

PLAIN = driver.ROOT / "input" / "heat_copper_plain.nml"

# Fields of the particles as the program calls them.
NAMES = {"x": "position", "temp": "temperature", "heat": "waiting heat", "jac": "volume ratio", "v": "velocity",
         "tau": "stress", "b": "elastic strain", "plastic": "plastic strain", "rate": "strain rate", "flow": "flow stress"}


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A checkpoint of the smallest scene in its middle."""
    directory = tmp_path_factory.mktemp("saved")
    sets = {"TIME.END": 1e-6}
    return driver.run("small", "--quiet", directory=directory, sets=sets).results("small").path("_checkpoint.h5")


def spoil(path, field, value):
    """Give the first particle of the last block this value in the last component of a field; its place."""
    first, n = driver.FIELDS[field]
    with h5py.File(path, "r+") as file:
        n_fields = int(file.attrs["fields"])
        raw = file["/particles/state"][:]
        block = raw.reshape(-1, n_fields, driver.LANES)
        place = block[-1, 0:3, 0].copy()
        block[-1, first + n - 1, 0] = value
        file["/particles/state"][:] = block.reshape(raw.shape)
    driver.seal(path)
    return place


@pytest.mark.parametrize("field", NAMES)
def test_any_field(tmp_path, saved, field):
    """Exact: status 2 with file, data set, field and value; nothing is written."""
    path = tmp_path / "spoilt.h5"
    path.write_bytes(saved.read_bytes())
    spoil(path, field, np.nan if field != "v" else np.inf)
    done = driver.run("small", "--quiet", "--restart", path, "--output", "spoilt", directory=tmp_path, expect=driver.BAD_INPUT)
    print(done.err)
    value = "Infinity" if field == "v" else "NaN"
    assert "spoilt.h5: /particles/state: particle " in done.err and f" has a {NAMES[field]} of {value}, not from " in done.err
    assert not (tmp_path / "spoilt").exists()


def test_no_step_can_follow(tmp_path, saved):
    """Exact: an implausible stress: status 3 by the next row, with the particle."""
    path = tmp_path / "spoilt.h5"
    path.write_bytes(saved.read_bytes())
    spoil(path, "tau", 9e29)
    sets = {"TIME.END": 2e-6, "OUTPUT.HISTORY_INTERVAL": 1e-8, "OUTPUT.CHECKPOINT_INTERVAL": 1e-8}
    done = driver.run("small", "--quiet", "--restart", path, "--output", "spoilt", directory=tmp_path, sets=sets, expect=driver.BROKEN)
    print(done.err)
    assert "runs away: at (" in done.err
    times = driver.Table(tmp_path / "spoilt" / "small_history.csv")["time[s]"]
    assert len(times) <= 2


def test_sleeping_particle(tmp_path, run):
    """Exact: a temperature that is not a number in a particle that sleeps, whose mechanics touch no field of it."""
    sets = {"METHOD.SLEEPING": "on", "METHOD.SLEEP_STRESS": 0.2, "TIME.END": 0.1, "OUTPUT.FRAME_INTERVAL": 0,
            "GRID.UPPER": "104e-3,48e-3,28e-3", "SHAPE.UPPER": "96e-3,40e-3,12e-3"}
    results = run("stir", "--quiet", sets=sets).results("stir")
    path = results.path("_checkpoint.h5")
    with h5py.File(path, "r+") as file:
        rest = file["/particles/tag"][:] >> 54 & 3
        count = file["/particles/count"][:]
        sleepers = np.argwhere((rest == 2) & (np.arange(driver.LANES)[None, :] < count[:, None]))
        assert len(sleepers), "nothing sleeps in this scene"
        block, lane = sleepers[len(sleepers) // 2]
        n_fields = int(file.attrs["fields"])
        raw = file["/particles/state"][:]
        raw.reshape(-1, n_fields, driver.LANES)[block, driver.FIELDS["plastic"][0], lane] = np.nan
        number = int(file["/particles/tag"][block, lane]) & (1 << 48) - 1
        file["/particles/state"][:] = raw
    driver.seal(path)
    done = run("stir", "--quiet", "--restart", path, sets=sets | {"TIME.END": 0.2}, expect=driver.BAD_INPUT)
    print(done.err)
    assert f"stir_checkpoint.h5: /particles/state: particle {number} has a plastic strain of NaN, not from 0 to " in done.err


def test_heat_alone(tmp_path, run):
    """Exact: a temperature of heat alone that is not a number, or not above 0 K: status 2 with file and data set."""
    sets = {"GRID.CELL": 4e-3, "TIME.END": 0.5, "OUTPUT.FRAME_INTERVAL": 0}
    path = run(PLAIN, "--quiet", sets=sets).results("heat_copper_plain").path("_checkpoint.h5")
    for value, what in ((np.nan, "a number that is not finite"), (-1.0, "a temperature that is not above 0 K")):
        with h5py.File(path, "r+") as file:
            state = file["/heat/state"][:]
            state[0, 0] = value
            file["/heat/state"][:] = state
        driver.seal(path)
        done = run(PLAIN, "--quiet", "--restart", path, sets=sets | {"TIME.END": 1.0}, expect=driver.BAD_INPUT)
        print(done.err)
        assert f"heat_copper_plain_checkpoint.h5: /heat/state: {what}" in done.err
