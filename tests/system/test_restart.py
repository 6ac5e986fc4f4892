# SPDX-License-Identifier: MIT
"""Stopped by a signal and continued: the same run, bit for bit."""

import shutil
import signal

import driver
import h5py
import numpy as np
import pytest


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The run of stir.nml in one go on so many ranks: tool in contact, conduction, film, probes."""
    known = {}

    def results(ranks):
        if ranks not in known:
            directory = tmp_path_factory.mktemp("whole")
            known[ranks] = driver.run("stir", "--quiet", directory=directory, ranks=ranks).results("stir")
        return known[ranks]

    return results


def stop_in_the_middle(directory, ranks, number, to_rank=None, sets=None):
    """Start stir.nml, stop it by a signal while the tool is in contact; its results so far."""
    one = driver.Started("stir", "--quiet", directory=directory, ranks=ranks, sets=sets)
    results = driver.Results(one.directory / "stir.out", "stir")
    try:
        one.wait_for_rows(results.path("_history.csv"), 45)
        one.send(number, to_rank)
        status = one.wait()
        text = one.text()
    finally:
        one.end()
    checkpoint = results.checkpoint()
    print(f"stopped at step {checkpoint.step}, t = {checkpoint.time} s:", text)
    assert status == driver.BY_SIGNAL
    assert 0.08 < checkpoint.time < 0.199, "the signal came too late: the machine is too busy or too fast"
    assert results.history()["tool_torque[Nm]"][-1] != 0.0, "the tool is not in contact"
    assert f"signal {int(number)}" in text and "stir_checkpoint.h5" in text
    return results


@pytest.fixture(scope="module")
def continued(tmp_path_factory):
    """stir.nml on so many ranks, stopped by SIGUSR1 and continued."""
    known = {}

    def results(ranks):
        if ranks not in known:
            directory = tmp_path_factory.mktemp("continued")
            known[ranks] = stop_in_the_middle(directory, ranks, signal.SIGUSR1)
            path = known[ranks].path("_checkpoint.h5")
            driver.run("stir", "--quiet", "--restart", path, directory=directory, ranks=ranks)
        return known[ranks]

    return results


def assert_same_run(whole, other):
    """Same final state, same histories and frames, bit for bit."""
    one, two = whole.checkpoint(), other.checkpoint()
    assert one.step == two.step
    for path, values in one.all.items():
        assert np.array_equal(values, two.all[path]), f"{path} differs"
    for table in ("_history.csv", "_probes.csv"):
        assert whole.path(table).read_text() == other.path(table).read_text(), table
    times = driver.Table(other.path("_history.csv"))["time[s]"]
    assert np.all(np.diff(times) > 0.0), "double rows"
    for entry in whole.series()["files"]:
        data = driver.read_frame(whole.directory / entry["name"])
        more = driver.read_frame(other.directory / entry["name"])
        assert data[2]["time"] == more[2]["time"] and data[2]["step"] == more[2]["step"]
        for name, values in data[0].items():
            assert np.array_equal(values, more[0][name]), f"{entry['name']} {name}"


@pytest.mark.parametrize("ranks", [None, 2])
def test_stopped_by_sigusr1_and_continued(whole, continued, ranks):
    """Exact: exit status 75 and a checkpoint at the signal; --restart ends with the same doubles in the
    checkpoint and the same histories, probes and frames as the run in one go, on 1 and 2 ranks."""
    assert_same_run(whole(ranks), continued(ranks))


def test_series_of_a_continued_run(whole, continued):
    """Exact: stir.hdf.series of the continued run lists the same frames at the same times [s]."""
    assert continued(None).series() == whole(None).series()


def test_stopped_by_sigterm_and_continued(tmp_path, run, whole):
    """Exact: as SIGUSR1, with SIGTERM."""
    results = stop_in_the_middle(tmp_path, None, signal.SIGTERM)
    run("stir", "--quiet", "--restart", results.path("_checkpoint.h5"))
    assert_same_run(whole(None), results)


def test_sigterm_to_one_rank_stops_all(tmp_path, run, whole):
    """Exact: a signal that only rank 1 of 2 gets ends both with status 75, and the run can go on."""
    results = stop_in_the_middle(tmp_path, 2, signal.SIGTERM, to_rank=1)
    run("stir", "--quiet", "--restart", results.path("_checkpoint.h5"), ranks=2)
    assert_same_run(whole(2), results)


def test_restart_without_the_input(tmp_path, run):
    """Exact: the checkpoint knows its input (overrides included) and its name: without the input file the
    run goes on in its own directory, to step 1000 at 7e-5 s."""
    half = {"TIME.MAX_STEPS": 500, "OUTPUT.CHECKPOINT_INTERVAL": 3.5e-5}
    results = run("block", "--quiet", sets=half).results("block")
    assert results.checkpoint().step == 500
    run(None, "--quiet", "--restart", results.path("_checkpoint.h5"), sets={"TIME.MAX_STEPS": 0})
    assert [p.name for p in tmp_path.iterdir()] == ["block.out"]
    assert results.checkpoint().step == 1000
    assert results.history()["time[s]"][-1] == pytest.approx(7e-5, rel=1e-12)


@pytest.mark.parametrize("before, after", [(2, None), (None, 4)])
def test_restart_on_another_number_of_ranks(run, tmp_path, before, after):
    """Exact: the smooth block for 500 steps, then 500 more on another number of ranks, ends as 1000 steps
    on one: positions [m], velocities [m/s], temperatures [K], stresses [Pa] to 1e-10 of the largest."""
    other = tmp_path / "other"
    other.mkdir()
    one = run("block", "--quiet", directory=other).results("block").checkpoint()
    half = {"TIME.MAX_STEPS": 500, "OUTPUT.CHECKPOINT_INTERVAL": 3.5e-5}
    results = run("block", "--quiet", ranks=before, sets=half).results("block")
    assert results.checkpoint().step == 500
    run("block", "--quiet", "--restart", results.path("_checkpoint.h5"), ranks=after)
    two = results.checkpoint()
    assert one.step == two.step == 1000
    apart = driver.distance(one, two, ["x", "v", "b", "jac", "plastic", "temp", "tau"])
    print(apart)
    assert max(apart.values()) <= 1e-10, apart


def damage(path, how):
    """Spoil a checkpoint."""
    if how == "missing":
        path.unlink()
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "text":
        path.write_text("This is not HDF5.\n" * 50)
    elif how == "cut":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif how == "bit":
        with h5py.File(path, "r+") as file:
            state = file["/particles/state"]
            row = state[0]
            row[5] = np.nextafter(row[5], 1.0)
            state[0] = row
    elif how == "other file":
        with h5py.File(path, "w") as file:
            file["something"] = np.arange(5.0)
    elif how == "version":
        with h5py.File(path, "r+") as file:
            file.attrs.modify("version", np.int32(99))
    elif how == "other fields":
        with h5py.File(path, "r+") as file:
            del file.attrs["layout"]
        driver.seal(path)


@pytest.fixture(scope="module")
def crumb(tmp_path_factory):
    directory = tmp_path_factory.mktemp("crumb")
    return driver.run("crumb", "--quiet", directory=directory).results("crumb")


DAMAGES = ["missing", "empty", "text", "cut", "bit", "other file", "version", "other fields"]


@pytest.fixture(scope="module")
def refused(tmp_path_factory, crumb):
    """All attempts to go on from a bad checkpoint, with and without the input file."""
    directory = tmp_path_factory.mktemp("damaged")
    cases = {}
    for how in DAMAGES:
        path = directory / f"saved {how}.h5"
        shutil.copy(crumb.path("_checkpoint.h5"), path)
        damage(path, how)
        for name in ("crumb", None):
            cases[how, name] = ((name, "--restart", path), {})
    return driver.run_all(cases, directory)


@pytest.mark.parametrize("how", DAMAGES)
@pytest.mark.parametrize("name", ["crumb", None])
def test_missing_or_damaged_checkpoint(refused, how, name):
    """Exact: status 2 and one message that names the checkpoint, no HDF5 error stack, nothing written,
    for a missing, empty, foreign, cut file, one flipped bit in the particles, another format version, particles
    with the fields of another program."""
    done = refused[how, name]
    print(done.err)
    assert done.status == driver.BAD_INPUT
    lines = done.err.strip().splitlines()
    assert len(lines) == 1 and "error: " in lines[0] and f"saved {how}.h5" in lines[0], done.err
    assert done.files == []


def test_damage_is_reported_once_on_two_ranks(run, tmp_path, crumb):
    """Exact: a flipped bit on 2 ranks: status 2, one message from the program."""
    path = tmp_path / "saved.h5"
    shutil.copy(crumb.path("_checkpoint.h5"), path)
    damage(path, "bit")
    done = run("crumb", "--restart", path, ranks=2, expect=None)
    assert done.status == driver.BAD_INPUT
    assert done.err.count("saved.h5 is damaged") == 1


def test_checkpoint_of_another_scene(run, tmp_path, crumb):
    """Exact: the checkpoint of a scene with a probe and no tool does not fit stir.nml: status 2."""
    done = run("stir", "--restart", crumb.path("_checkpoint.h5"), expect=None)
    assert done.status == driver.BAD_INPUT
    assert "error: &GRID CELL = 4e-3: a restart cannot change it from 1e-3 to 4e-3" in done.err
    assert list(tmp_path.iterdir()) == []
