# SPDX-License-Identifier: MIT
"""A particle that leaves the grid, or a run that blows up, ends the run in good order."""

import re

import driver
import numpy as np
import pytest

NUMBER = r"[-+]?[0-9.]+(?:e[-+]?[0-9]+)?"
MESSAGE = re.compile(
    rf"particle ([0-9]+) left the grid at \(({NUMBER}), ({NUMBER}), ({NUMBER})\) m with velocity "
    rf"\(({NUMBER}), ({NUMBER}), ({NUMBER})\) m/s \(step ([0-9]+), t = ({NUMBER}) s\); [^;]*; checkpoint (\S+)"
)


@pytest.mark.parametrize("ranks", [None, 2])
def test_particle_leaves_the_grid(run, tmp_path, ranks):
    """Exact: a block that flies at (300, 20, 0) m/s reaches the side of the grid at x = 10 mm with its first
    particles (at 3.75 mm) after 20.83 us. It ends with status 3 before the layer has gone one cell further,
    and one message names a particle that is outside, its place [m] and velocity [m/s]; the checkpoint holds
    that very particle; all rows of the history until then are there."""
    done = run("runaway", "--quiet", ranks=ranks, expect=None)
    print(done.err)
    assert done.status == driver.BROKEN
    found = MESSAGE.findall(done.err)
    assert len(found) == 1, done.err
    particle, *numbers, step, time, path = found[0]
    x, v = np.array(numbers[:3], dtype=float), np.array(numbers[3:], dtype=float)
    assert 10e-3 < x[0] < 11e-3
    assert v == pytest.approx([300.0, 20.0, 0.0], abs=1e-3)
    assert 20.83e-6 < float(time) < 20.83e-6 + 1e-3 / 300.0
    assert path == "runaway.out/runaway_checkpoint.h5"
    results = done.results("runaway")
    state = results.checkpoint()
    assert state.step == int(step)
    k = np.flatnonzero(state.number == int(particle))[0]
    assert state.x[k] == pytest.approx(x, rel=1e-5)
    assert results.history()["time[s]"][-1] > 20e-6
    assert len(state.number) == 512


@pytest.mark.parametrize("ranks", [None, 2])
def test_restart_of_a_lost_particle_says_the_same(run, ranks):
    """Exact: going on from that checkpoint cannot work: status 3 (or 2) and a message again, no crash."""
    done = run("runaway", "--quiet", ranks=ranks, expect=driver.BROKEN)
    path = done.results("runaway").path("_checkpoint.h5")
    again = run("runaway", "--quiet", "--restart", path, ranks=ranks, expect=None)
    print(again.status, again.err)
    assert again.status in (driver.BROKEN, driver.BAD_INPUT)
    assert again.err.count("left the grid") == 1
    assert "SIG" not in again.err and "Backtrace" not in again.err


BLOW_UPS = {
    "too long a step": {"TIME.DT": 8e-6},   # 3.5 times the time of a wave through a cell
    "a step of ten cells": {"TIME.DT": 2e-4},
    "infinite stiffness": {"MATERIAL.YOUNGS_MODULUS": 1e15, "TIME.DT": 1e-6},
}


@pytest.mark.parametrize("how, ranks", [(how, None) for how in BLOW_UPS] + [("too long a step", 2)])
def test_run_that_blows_up(run, how, ranks):
    """Exact: whatever the numbers do (too long a time step, unstable shape functions, overflow), the run ends
    with status 3 and a message that names a particle, and a checkpoint; it never crashes or goes on with NaN."""
    done = run("punch", "--quiet", ranks=ranks, sets=BLOW_UPS[how] | {"TIME.END": 3e-3}, expect=None)
    print(done.status, done.err[:600])
    assert "SIG" not in done.err and "Backtrace" not in done.err
    assert done.status == driver.BROKEN
    assert re.search(r"particle [0-9]+ (left the grid|runs away|has a state that is not a finite)", done.err)
    assert done.results("punch").path("_checkpoint.h5").exists()


@pytest.mark.parametrize("ranks", [None, 2])
def test_debris_leaves_the_grid(run, tmp_path, ranks):
    """Exact: a chip of 8 particles (1 mg) at (20, 0, 60) m/s is let go with its mass, kinetic energy 2 mJ and heat 0.4 J;
    a warning says so, and the energy audit closes. 512 particles are left, and nothing else has changed."""
    done = run("debris", "--quiet", ranks=ranks)
    assert "debris" in done.err + done.out
    results = done.results("debris")
    history, state = results.history(), results.checkpoint()
    assert history["debris_mass[kg]"][0] == 0.0
    assert history["debris_mass[kg]"][-1] == pytest.approx(1e-6)
    assert history["debris_energy[J]"][-1] == pytest.approx(0.5 * 1e-6 * 4000.0)
    assert history["debris_heat[J]"][-1] == pytest.approx(1e-6 * 1000.0 * 400.0)
    assert np.abs(history["audit_error[%]"]).max() < 1e-9
    assert np.abs(history["numerical_loss[J]"]).max() < 1e-15
    assert len(state.number) == 512 and np.abs(state.v).max() == 0.0 and len(set(state.number)) == 512


def test_run_goes_on_without_debris(run, tmp_path):
    """Bitwise: stopped when a part of the chip has left, and continued."""
    whole = run("debris", "--quiet", directory=driver_folder(tmp_path, "whole"))
    half = run("debris", "--quiet", directory=driver_folder(tmp_path, "half"),
               sets={"TIME.END": 4e-5, "OUTPUT.CHECKPOINT_INTERVAL": 4e-5})
    again = run("debris", "--quiet", "--restart", half.results("debris").path("_checkpoint.h5"), directory=half.directory,
                sets={"TIME.END": 1e-4})
    one, two = whole.results("debris"), again.results("debris")
    assert 0.0 < half.results("debris").history()["debris_mass[kg]"][-1]
    assert np.array_equal(one.history()["debris_energy[J]"][-1:], two.history()["debris_energy[J]"][-1:])
    assert np.array_equal(one.checkpoint().x, two.checkpoint().x)


MORE = r"with it ([0-9.e-]+) of all mass would have left, &METHOD DEBRIS allows {}: .*--set METHOD.DEBRIS="


@pytest.mark.parametrize("sets, words", [({"METHOD.DEBRIS": 0.0}, MORE.format("0")), ({"METHOD.DEBRIS": 0.001}, MORE.format("0.001")),
                                         ({"BODY(chip).VELOCITY": "0,0,2000"}, "above the wave speed")])
def test_what_is_no_debris_ends_the_run(run, sets, words):
    """None is allowed; more than is allowed, a chip of 8 of 520 particles; faster than waves (1160 m/s), as when a run
    breaks down, which no option lets go."""
    done = run("debris", "--quiet", sets=sets, expect=driver.BROKEN)
    assert "left the grid" in done.err
    found = re.search(words, done.err)
    assert found, done.err
    if found.groups():
        assert float(found.group(1)) == pytest.approx(8 / 520, rel=1e-5)
    else:
        assert "METHOD.DEBRIS" not in done.err


def test_more_debris_goes_after_a_restart(run):
    """Exact: what was too much to leave goes with DEBRIS raised as the message says, all 8 of 520 particles booked."""
    done = run("debris", "--quiet", sets={"METHOD.DEBRIS": 0.001}, expect=driver.BROKEN)
    again = run("debris", "--quiet", "--restart", done.results("debris").path("_checkpoint.h5"), sets={"METHOD.DEBRIS": 0.02})
    history, state = again.results("debris").history(), again.results("debris").checkpoint()
    assert history["time[s]"][-1] == pytest.approx(1e-4)
    assert history["debris_mass[kg]"][-1] == pytest.approx(1e-6)
    assert np.abs(history["audit_error[%]"]).max() < 1e-9
    assert len(state.number) == 512


def driver_folder(tmp_path, name):
    folder = tmp_path / name
    folder.mkdir()
    return folder
