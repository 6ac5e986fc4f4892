# SPDX-License-Identifier: MIT
"""A tool on a path from a file: places, tilt and force, restarts in it, and files that are none."""

import re
import shutil

import driver
import h5py
import numpy as np
import pytest

SCENE = "curved"
BEGIN, SPEED, RAMP, RADIUS = 4e-3, 0.5, 1e-3, 4e-3  # of curved.nml and curved.csv
LENGTH = 60 * RADIUS * np.sin(np.pi / 120) / SPEED + RAMP  # of the phase, with 30 chords [s]
COLUMNS = ("disc_x[m]", "disc_y[m]", "disc_z[m]", "disc_force_x[N]", "disc_force_z[N]", "disc_torque[Nm]")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The run in one go on so many ranks."""
    known = {}

    def results(ranks):
        if ranks not in known:
            known[ranks] = driver.run(SCENE, "--quiet", directory=tmp_path_factory.mktemp("whole"), ranks=ranks).results(SCENE)
        return known[ranks]

    return results


def test_quarter_of_a_circle(whole):
    """The tool follows the mean of the circle over RAMP, within the sagitta of the steps of 3 degrees, and then stops at the
    last point of the file. The lowest point of the tool lies opposite to the direction of travel, within three degrees, from the plunge
    on. The force across the axis turns with it, within a tenth."""
    results = whole(1)
    history = results.history()
    time, x, y, z, fx, fy = (history[name] for name in ("time[s]", "disc_x[m]", "disc_y[m]", "disc_z[m]", "disc_force_x[N]", "disc_force_y[N]"))
    within = (time > BEGIN + RAMP) & (time < BEGIN + LENGTH - RAMP)
    half = 0.5 * SPEED / RADIUS * RAMP
    angle = SPEED / RADIUS * (time - BEGIN - 0.5 * RAMP)
    mean = RADIUS * np.sin(half) / half
    assert within.sum() > 30
    sagitta = RADIUS * np.radians(3.0) ** 2 / 8.0
    assert x[within] == pytest.approx((16e-3 + mean * np.sin(angle))[within], abs=1.1 * sagitta)
    assert y[within] == pytest.approx((16e-3 + RADIUS - mean * np.cos(angle))[within], abs=1.1 * sagitta)
    depth = 11.9e-3 - 0.5 * 0.15 * RAMP  # the plunge ends within the RAMP
    assert z[within] == pytest.approx(depth, abs=1e-9)
    after = time > BEGIN + LENGTH
    assert x[after] == pytest.approx(20e-3, abs=1e-9) and y[after] == pytest.approx(20e-3, abs=1e-9)
    assert z[-1] == pytest.approx(depth + 0.3 * (time[-1] - BEGIN - LENGTH), abs=1e-8)
    for number, ahead in ((0, [1.0, 0.0]), (1, None), (2, [0.0, 1.0])):
        with h5py.File(results.path(f"_tools_{number:06d}.hdf")) as file:
            points, when = file["/VTKHDF/Points"][:], file.attrs["time"]
        a = SPEED / RADIUS * (when - BEGIN - 0.5 * RAMP)
        ahead = np.array([np.cos(a), np.sin(a)] if ahead is None else ahead)
        rim = points[np.abs(points[:, 2] - points[:, 2].min()) < 1e-6].mean(0)
        middle = np.array([np.interp(when, time, column) for column in (x, y)]) if when > 0 else np.array([16e-3, 16e-3])
        assert (rim[:2] - middle) / 8e-3 == pytest.approx(-ahead * np.cos(np.radians(3.0)), abs=0.06), when
    first, last = (time > BEGIN + 2 * RAMP) & (time < BEGIN + 4 * RAMP), (time > BEGIN + LENGTH - 3 * RAMP) & (time < BEGIN + LENGTH - RAMP)
    turned = np.diff([np.arctan2(fy[part].mean(), fx[part].mean()) for part in (first, last)])[0]
    print(np.degrees(turned), np.degrees(np.mean(angle[last]) - np.mean(angle[first])))
    assert turned == pytest.approx(np.mean(angle[last]) - np.mean(angle[first]), rel=0.1)


def test_check(run):
    """--check knows the way, the speed and the end of the path, which has no DURATION."""
    row = re.search(r"\n +path +(.*)\n", run(SCENE, "--check=scene").out)[1]
    begin, end, way, speed = map(float, row.split()[:4])
    assert (begin, end) == pytest.approx((BEGIN, BEGIN + LENGTH), abs=1e-3)
    assert way == pytest.approx(0.5e3 * np.pi * RADIUS, rel=0.01) and speed == pytest.approx(1e3 * SPEED, rel=0.01)


def test_restart_is_bitwise(whole, run, tmp_path):
    """Exact: stopped in mid path on two ranks, the state and the history are those of one go."""
    state, history = whole(2).checkpoint(), whole(2).history()
    cut = run(SCENE, "--quiet", directory=tmp_path, ranks=2, sets={"TIME.END": 12e-3}).results(SCENE)
    run(None, "--quiet", "--restart", cut.path("_checkpoint_previous.h5"), directory=tmp_path, ranks=2, sets={"TIME.END": 20e-3})
    assert np.array_equal(state.x, cut.checkpoint().x) and np.array_equal(state.v, cut.checkpoint().v)
    for name in COLUMNS:
        assert np.array_equal(history[name], cut.history()[name]), name


def test_ranks(whole):
    """Results on one rank and on two are the same to rounding."""
    one, two = whole(1).history(), whole(2).history()
    for name in COLUMNS:
        assert one[name] == pytest.approx(two[name], rel=1e-5, abs=1e-5 * np.abs(one[name]).max())


def test_what_a_restart_may_change(run, tmp_path):
    """The content of a path may not change, once it is under way or as it leads the tilt of the plunge before it; else it may. A path
    may be added behind, and the one under way may end early."""
    for name in ("curved.nml", "curved.csv"):
        shutil.copy(driver.INPUTS / name, tmp_path)
    path, points = tmp_path / "curved.nml", tmp_path / "curved.csv"
    text, rows = path.read_text(), points.read_text()
    said = "the content of the file is not that with which the run began"

    for end, tilt, may_change in ((1e-3, "F", True), (1e-3, "T", False), (6e-3, "F", False)):
        sets = {"OUTPUT.FRAME_INTERVAL": 0, "MOTION(2).TILT_FOLLOWS": tilt}
        done = run(path, "--quiet", "--overwrite", directory=tmp_path, sets=sets | {"TIME.END": end})
        words = path, "--check=scene", "--restart", done.results(SCENE).path("_checkpoint.h5")
        points.write_text(rows.replace("0.004000000,0.004000000", "0.004000000,0.0041"))
        err = run(*words, directory=tmp_path, sets=sets, expect=driver.WELL if may_change else driver.BAD_INPUT).err
        assert may_change or said in err
        points.write_text(rows)
        (tmp_path / "more.csv").write_text("x[m],y[m]\n5,5\n5.001,5\n")
        path.write_text(text.replace("RAMP = 1e-3", "RAMP = 1e-3, DURATION = 9e-3").replace(
            "VELOCITY = 0, 0, 0.3", "FILE = 'more.csv', SPEED = 0.1"))
        run(*words, directory=tmp_path, sets=sets)
        path.write_text(text)


BAD = {
    "bad numbers": ("x[m],y[m]\n0,0\n0,nan\n1,2,3\n0.001,x\n0,1e-3\n0,1e-3\n", {}, [
        ":3: error: 'nan' is no number for y[m]", ":4: error: has 3 values, the table 2 columns", ":5: error: 'x' is no number for y[m]",
        ":7: error: repeats the point before"]),
    "times": ("time[s],x[m],y[m],z[m]\n0,0,0,0\n1,0,1e-3,0\n0.5,0,2e-3,0\n0.5,0,3e-3,0\n", {}, [
        ":4: error: time does not rise, as in 1 more rows", "SPEED = 0.5: has no effect"]),
    "too far, too fast": ("x [m], y [m]\n0,0\n0,1e-3\n0.1,0.2\n", {"MOTION(2).SPEED": 50}, [
        ":4: error: the path leaves the grid", ":3: error: the segment to this point is faster than"]),
    "no columns": ("0,0\n0,1\n", {}, [": error: needs columns x[m] and y[m]"]),
    "one point": ("x[m],y[m]\n0,0\n", {}, [": error: has fewer than two points"]),
    "empty": ("", {}, [": error: needs columns x[m] and y[m]"]),
    "no file": (None, {}, ["path.csv cannot be read"]),
    "keys": ("x[m],y[m]\n0,0\n0,1e-3\n", {"MOTION(2).RAMP": 0, "MOTION(2).VELOCITY": "1,0,0", "MOTION(3).SPEED": 1, "MOTION(1).TILT_FOLLOWS": "T"}, [
        "TILT_FOLLOWS = T: needs a RAMP", "has no effect beside a FILE", "SPEED = 1: needs a FILE", "TILT_FOLLOWS = T: needs a FILE"]),
    "duration": ("x[m],y[m]\n0,0\n0,1e-3\n", {"MOTION(2).DURATION": 1}, ["is longer than path and RAMP take, 0.003 s"]),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files(run, tmp_path, name):
    """All that is wrong with a path is said at once, with the line."""
    text, sets, words = BAD[name]
    if text is not None:
        (tmp_path / "path.csv").write_text(text)
    done = run(SCENE, "--check=scene", sets={"MOTION(2).FILE": tmp_path / "path.csv"} | sets, expect=driver.BAD_INPUT)
    for word in words:
        assert word in done.err, done.err
    assert done.err.count("error:") == len(words), done.err
