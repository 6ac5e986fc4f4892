# SPDX-License-Identifier: MIT
"""Noise of velocities and strain rates where metal flows: null modes, averages of volume, the last step."""

import driver
import h5py
import numpy as np
import pytest


def applied(time):
    """Strain rate of the squeezed block [1/s]."""
    return 8.25 / (6e-3 - 8.25 * (time - 0.5e-5))


def squeezed(run, **sets):
    """The results, and the deviation of strain rates from particle to particle over the applied one, mean of the frames."""
    sets = {f"METHOD.{key}": value for key, value in sets.items()} | {"OUTPUT.FRAME_INTERVAL": 4e-6}
    results = run("squeezed", sets=sets).results("squeezed")
    scatter = []
    for frame in results.series()["files"]:
        if frame["time"] > 4e-5:
            with h5py.File(results.directory / frame["name"]) as file:
                scatter.append(file["/VTKHDF/PointData/strain_rate"][:].std() / applied(frame["time"]))
    return results, np.mean(scatter)


def test_squeezed_block(run):
    """Own measure: strain rates at the end are the applied one within 2 % in the mean and 3 % from particle to particle (20 and
    47 % with averages of volume around nodes and a last step of what is left); over the run they scatter by 7 %, and by half as
    much again if null modes stay. The force is the same within a percent, and the energy balance closes as well."""
    results, scatter = squeezed(run)
    noisy, noisy_scatter = squeezed(run, NULL_CELLS=0)
    state = results.checkpoint()
    rate = state.rate / applied(state.time)
    print(rate.mean(), rate.std(), scatter, noisy_scatter)
    assert rate.mean() == pytest.approx(1.0, abs=0.02) and rate.std() < 0.03
    assert scatter < 0.07 and noisy_scatter > 1.3 * scatter
    histories = [results.history(), noisy.history()]
    late = histories[0]["time[s]"] > 0.5e-4
    force = [np.abs(h["press_force_z[N]"][late]).mean() for h in histories]
    assert force[0] == pytest.approx(force[1], rel=0.01)
    audit = [abs(h["audit_error[%]"][-1]) for h in histories]
    assert audit[0] < 1.05 * audit[1] + 1e-3


def off_linear(x, v):
    """Largest deviation of a component of velocity from a linear field [m/s]."""
    field = np.c_[np.ones(len(x)), x]
    return max(np.std(v[:, a] - field @ np.linalg.lstsq(field, v[:, a], rcond=None)[0]) for a in range(3))


def test_velocities_of_frames(run):
    """Frames show the velocities with which particles move: of the squeezed block a linear field to 0.2 % of the tool's speed;
    those that particles carry are off by twenty times as much."""
    results = run("squeezed").results("squeezed")
    state = results.checkpoint()
    with h5py.File(results.directory / results.series()["files"][-1]["name"]) as file:
        shown = off_linear(file["/VTKHDF/Points"][:], file["/VTKHDF/PointData/velocity"][:])
    carried = off_linear(state.x, state.v)
    print(shown, carried)
    assert shown < 0.002 * 8.25 and carried > 20 * shown


def test_elastic_bodies_are_left_alone(run):
    """The same to the bit, with or without, where nothing can flow; and an error where it cannot be done."""
    results = [run("bar", "--output", f"out{cells}", sets={"METHOD.NULL_CELLS": cells}).directory / f"out{cells}" for cells in (0, 5)]
    states = [driver.Checkpoint(path / "bar_checkpoint.h5") for path in results]
    assert np.array_equal(states[0].v, states[1].v) and np.array_equal(states[0].x, states[1].x)
    done = run("squeezed", "--check", sets={"METHOD.NULL_CELLS": 5, "METHOD.SCHEME": "usavg"}, expect=driver.BAD_INPUT)
    assert "NULL_CELLS" in done.err and "usl only" in done.err
