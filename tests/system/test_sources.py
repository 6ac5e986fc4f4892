# SPDX-License-Identifier: MIT
"""Sources of heat: a disc on a half space, a moving line, what they give and when."""

import math
import re

import driver
import numpy as np
import pytest

CONDUCTIVITY = 167.0  # [W/(m K)]
DIFFUSIVITY = 167.0 / (2700.0 * 896.404)  # 6.9e-5 [m2/s]
RADIUS = 9e-3  # of the disc [m]
FLUX = 1500.0 / (math.pi * RADIUS**2)  # [W/m2]


def ierfc(x):
    return math.exp(-x * x) / math.sqrt(math.pi) - x * math.erfc(x)


def under_disc(z, t):
    """Temperature rise [K] on the axis of the disc, at depth z [m]."""
    a = 2.0 * math.sqrt(DIFFUSIVITY * t)
    return FLUX * a / CONDUCTIVITY * (ierfc(z / a) - ierfc(math.hypot(z, RADIUS) / a))


def balance(results):
    """The change of heat is what the sources gave less what the films took, from the doubles of the
    checkpoint; returns the heat of the sources [J]."""
    state, history = results.checkpoint(), results.history()
    given, lost = history["source_heat[J]"][-1], history["film_loss[J]"][-1]
    content = 896.404 * np.sum(state.mass * (state.temp - 300.0)) + state.heat.sum()
    print(f"given {given} J, lost {lost} J, balance {content / (given - lost) - 1:.1e}")
    assert content == pytest.approx(given - lost, abs=2e-10 * given)   # 10 digits are printed
    return given


@pytest.mark.parametrize("cell, room, depth, end, formula, graded", [
    (0.75e-3, 18e-3, 12e-3, 0.1, 103.955, False), (1.5e-3, 27e-3, 21e-3, 1.0, 225.064, False), (1.5e-3, 27e-3, 21e-3, 1.0, 225.064, True)])
def test_disc_on_a_half_space(run, cell, room, depth, end, formula, graded):
    """Exact: centre of a disc of 9 mm under constant q (1500 W) on a half space: 2 q sqrt(a t)/k
    [1/sqrt(pi) - ierfc(R/(2 sqrt(a t)))] = 103.955 K at 0.1 s, 225.064 K at 1 s (and the same with depth).
    The particles next to the axis, each against the exact temperature at its depth: those of the cell at
    the surface to 2 % in the mean, every one to 4 %, deeper ones (to 0.7 R) to 2.5 %. The power is exact. Graded: cells half as deep
    at the surface, growing below."""
    assert under_disc(0.0, end) == pytest.approx(formula, abs=6e-4)
    sets = {"GRID.CELL": cell, "GRID.LOWER": f"0,0,{-depth}", "TIME.END": end, "OUTPUT.CHECKPOINT_INTERVAL": end,
            "GRID.UPPER": f"{room + cell},{room + cell},{cell}", "SHAPE.LOWER": f"0,0,{-depth}",
            "SHAPE.UPPER": f"{room},{room},0"}
    if graded:
        sets |= {"METHOD.SHAPE": "bspline", "GRID.CELL": f"{cell},{cell},{0.5 * cell}", "GRID.GRADED": "z", "GRID.FINE": f"{-6 * cell},{cell}"}
    results = run("disc", "--quiet", sets=sets).results("disc")
    state = results.checkpoint()
    given = balance(results)
    assert given == pytest.approx(375.0 * end, rel=1e-9)
    near = np.all(state.x[:, :2] < 0.5 * cell, axis=1) & (state.x[:, 2] > -0.7 * RADIUS)
    z, rise = -state.x[near, 2], state.temp[near] - 300.0
    z, rise = z[np.argsort(z)], rise[np.argsort(z)]
    off = rise / [under_disc(d, end) for d in z] - 1.0
    print(end, np.round(off, 4))
    first = np.sum(z < cell)
    assert first == (4 if graded else 2)
    assert abs(off[:first].mean()) < 0.02
    assert np.abs(off[:first]).max() < 0.04
    assert np.abs(off[first:]).max() < 0.025


def under_line(x, y, t, v, radius=0.0):
    """Temperature rise [K] in a plate at (x, y) [m] at t from 250 kW/m that moves from x = 0 with v [m/s]; spread over a
    disc of this radius [m], whose second moments are those of eight lines around it at 1/sqrt(2) of the radius."""
    log_since = np.linspace(np.log(1e-7), np.log(t), 20001)
    since = np.exp(log_since)
    far = 0.0
    for angle in np.arange(8) * np.pi / 4:
        x_line, y_line = x + radius * np.cos(angle) / np.sqrt(2), y + radius * np.sin(angle) / np.sqrt(2)
        far = far + np.exp(-((x_line - v * (t - since)) ** 2 + y_line**2) / (4.0 * DIFFUSIVITY * since)) / 8
    return 250e3 / (4.0 * np.pi * CONDUCTIVITY) * np.trapezoid(far, log_since)


@pytest.mark.parametrize("cells", [{}, {"METHOD.SHAPE": "bspline", "GRID.CELL": "1e-3,2e-3,2e-3", "GRID.GRADED": "x", "GRID.FINE": "-6e-3,34e-3"}])
def test_moving_line(run, cells):
    """Exact: line source of 250 kW/m at 10 mm/s in a plate: dT = Q/(4 pi k d) int exp(-r^2/(4 a s))/s ds (at
    1 mm/s, 10 mm behind and 10 mm beside it: 45.595 K at 1 s, 189.875 K at 5 s). Three probes over 2 s,
    one of which it passes at 10 mm: to 2.5 K at all times, to 1 % at the end."""
    assert under_line(-9e-3, 10e-3, 1.0, 1e-3) == pytest.approx(45.595, abs=1e-3)
    assert under_line(-5e-3, 10e-3, 5.0, 1e-3) == pytest.approx(189.875, abs=1e-3)
    results = run("line", "--quiet", sets=cells).results("line")
    probes = results.probes()
    t = probes["time[s]"]
    for name, x, y in (("side", 10e-3, 10e-3), ("behind", 0.0, 10e-3), ("ahead", 30e-3, 6e-3)):
        exact = np.array([0.0] + [under_line(x, y, each, 10e-3, 2e-3) for each in t[1:]])
        rise = probes[f"{name}[K]"] - 300.0
        print(name, f"worst {np.abs(rise - exact).max():.3f} K of {exact.max():.1f} K, at the end {rise[-1] / exact[-1] - 1:+.2%}")
        assert np.abs(rise - exact).max() < 2.5
        assert rise[-1] == pytest.approx(exact[-1], rel=0.01)
    given = balance(results)
    assert given == pytest.approx(250.0 * t[-1], rel=1e-9)


def test_begin_end_and_films(run, tmp_path):
    """Exact: a ball of 250 W from 0.1 s to 0.45 s gives 87.5 J, whatever the conduction steps; with films the
    heat that is left is what it gave less what they took."""
    sets = {"SOURCE.BEGIN": 0.1, "SOURCE.END": 0.45, "TIME.END": 0.6, "OUTPUT.CHECKPOINT_INTERVAL": 0.6}
    text = (driver.INPUTS / "line.nml").read_text() + "&SURFACE BODY = 'plate', COEFFICIENT = 2e3 /\n"
    (tmp_path / "line.nml").write_text(text)
    results = run(tmp_path / "line.nml", "--quiet", sets=sets).results("line")
    history = results.history()
    assert balance(results) == pytest.approx(87.5, rel=1e-9)
    assert history["film_loss[J]"][-1] > 10.0
    assert np.all(history["source_heat[J]"][history["time[s]"] < 0.1] == 0.0)


@pytest.mark.parametrize("kind", ["disc", "ball"])
def test_ranks_and_restart(run, kind, tmp_path):
    """Exact: the temperatures on 3 ranks are those on one to 1e-10; stopped and continued, the same doubles."""
    sets = {"SOURCE.KIND": kind, "SOURCE.POSITION": "0,0,2e-3", "SOURCE.RADIUS": 5e-3, "TIME.END": 0.4,
            "OUTPUT.CHECKPOINT_INTERVAL": 0.2}
    for name in ("many", "part"):
        (tmp_path / name).mkdir()
    one = run("line", "--quiet", sets=sets).results("line")
    many = run("line", "--quiet", sets=sets, ranks=3, directory=tmp_path / "many").results("line")
    apart = driver.distance(one.checkpoint(), many.checkpoint(), ["temp", "heat"])
    print(kind, apart)
    assert one.checkpoint().temp.max() > 350.0
    assert apart["temp"] <= 1e-10 and apart["heat"] <= 1e-10
    part = run("line", "--quiet", sets=sets | {"TIME.MAX_STEPS": 15}, directory=tmp_path / "part").results("line")
    assert 0 < part.checkpoint().step < one.checkpoint().step
    run("line", "--quiet", "--restart", part.path("_checkpoint.h5"), sets=sets, directory=tmp_path / "part")
    for path, values in one.checkpoint().all.items():
        assert np.array_equal(values, part.checkpoint().all[path]), f"{path} differs"


def test_source_beside_the_body(run):
    """Exact: a source whose body has flown away when it begins heats nothing, says so once, and is not booked."""
    done = run("line", sets={"SOURCE.BEGIN": 0.1, "BODY.VELOCITY": "0,0.1,0", "GRID.UPPER": "60e-3,80e-3,2e-3", "TIME.END": 0.2,
                             "OUTPUT.CHECKPOINT_INTERVAL": 0.2})
    assert done.out.count("touches no particle: its power is lost") == 1
    assert np.all(done.results("line").history()["source_heat[J]"] == 0.0)
    assert done.results("line").checkpoint().temp == pytest.approx(300.0, rel=1e-14)


MISTAKES = {
    "no conductivity": ({"MATERIAL.CONDUCTIVITY": 0}, "&SOURCE.*without a &MATERIAL with CONDUCTIVITY"),
    "end before begin": ({"SOURCE.BEGIN": 2, "SOURCE.END": 1}, "END.*must be after BEGIN"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes(run, name):
    """Exact: status 2 and a message."""
    sets, message = MISTAKES[name]
    done = run("line", sets=sets, expect=driver.BAD_INPUT)
    assert re.search(message, done.err), done.err


def test_without_heat(run, tmp_path):
    """Exact: status 2 and a message for a source in a scene without &HEAT."""
    text = (driver.INPUTS / "line.nml").read_text().replace("&HEAT AMBIENT = 300 /\n", "")
    (tmp_path / "cold.nml").write_text(text)
    done = run(tmp_path / "cold.nml", expect=driver.BAD_INPUT)
    assert re.search("&SOURCE has no effect without a &HEAT group", done.err), done.err
