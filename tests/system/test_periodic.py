# SPDX-License-Identifier: MIT
"""Periodic sides of the grid."""

import driver
import h5py
import numpy as np
import pytest

STATE = ["x", "v", "b", "jac", "plastic", "temp", "tau"]


@pytest.mark.parametrize("ranks", [None, 3])
@pytest.mark.parametrize("shape", ["ugimp", "cpgimp", "bspline"])
def test_uniform_flight_through_the_sides(run, ranks, shape):
    """Exact: a block that crosses the box 5, 4 and 2.5 times keeps its velocity (to 1e-12), stays without
    stress (to 1e-12 E) and comes down at x0 + v t, modulo the box; its probe counts the whole way."""
    results = run("crossing", "--quiet", ranks=ranks, sets={"METHOD.SHAPE": shape}).results("crossing")
    state = results.checkpoint()
    assert state.step == 1000
    v, box, lower = np.array([300.0, -200.0, 100.0]), np.array([6e-3, 5e-3, 4e-3]), np.array([0.0, 1e-3, -2e-3])
    i, j, k = np.meshgrid(np.arange(12), np.arange(6), np.arange(8), indexing="ij")
    start = np.stack([1e-3 + (i + 0.5) * 1e-3 / 3, 2e-3 + (j + 0.5) * 0.5e-3, -2e-3 + (k + 0.5) * 0.5e-3], axis=-1)
    kept = np.isin(np.arange(1, 1 + 13 * 7 * 9), state.number)   # the lattice has one more point an axis
    assert kept.sum() == len(state.number) == start.size // 3
    apart = np.mod(state.x - start.reshape(-1, 3) - v * state.time + box / 2, box) - box / 2
    print(ranks, shape, np.abs(state.v - v).max() / 300.0, np.abs(state.tau).max(), np.abs(apart).max())
    assert np.abs(state.v - v).max() < 1e-12 * 300.0
    assert np.abs(state.tau).max() < 1e-12 * 124e9
    assert np.abs(apart).max() < 1e-12 * box[0]
    assert np.all(state.x > lower - 1.6e-3) and np.all(state.x < lower + box + 0.6e-3)
    probe = results.probes().rows[-1, 2:]
    assert np.allclose(probe, [3e-3, 3e-3, 0.0] + v * 1e-4, rtol=1e-9)


def test_no_face_at_a_periodic_side(run):
    """Exact: the block fills the box along z: no particle lies on a face zmin or zmax; 6 x 8 = 48 of them
    lie on each face along x, 12 x 8 = 96 on each along y."""
    results = run("crossing", "--quiet").results("crossing")
    with h5py.File(results.path("_checkpoint.h5"), "r") as file:
        tags = file["/particles/tag"][:]
    faces = [int(np.sum((tags >> (48 + face)) & 1)) for face in range(6)]
    assert faces == [48, 48, 96, 96, 0, 0]


@pytest.fixture(scope="module")
def torus(tmp_path_factory):
    directory = tmp_path_factory.mktemp("torus")
    return driver.run("torus", "--quiet", directory=directory).results("torus")


@pytest.mark.parametrize("ranks", [1, 2, 4, 8])
def test_torus_does_not_depend_on_the_number_of_ranks(run, torus, ranks):
    """Exact: two halves of a periodic plate (plasticity, conduction, films, gravity, a clamp at the side,
    probes) are after 400 steps the same on any number of ranks: to 1e-10 of the largest value."""
    one = torus.checkpoint()
    results = run("torus", "--quiet", ranks=ranks).results("torus")
    many = results.checkpoint()
    assert one.step == many.step == 400
    assert one.plastic.max() > 1e-3 and np.abs(one.tau).max() > 50e6   # it is worth comparing
    assert min(many.particles_of_rank) > 0 and len(many.particles_of_rank) == ranks
    apart = driver.distance(one, many, STATE)
    print(ranks, apart)
    assert max(apart.values()) <= 1e-10, apart
    assert np.allclose(torus.probes().rows, results.probes().rows, rtol=1e-8)


@pytest.mark.parametrize("methods", [{"SHAPE": "bspline", "TRANSFER": "fmpm"}, {"SHAPE": "cpgimp", "TRANSFER": "apic"},
                                     {"SCHEME": "usavg"}, {"SCHEME": "musl"}], ids=lambda methods: "-".join(methods.values()))
def test_other_methods_do_not_depend_on_the_number_of_ranks(run, tmp_path, methods):
    """Exact: the same for other methods on 3 ranks, sorted every 7 steps, divided anew every time. (cpGIMP
    without the wall: there rounding decides whether a domain reaches the nodes behind it.)"""
    sets = {f"METHOD.{key}": value for key, value in methods.items()} | {"METHOD.SORT_INTERVAL": 7, "METHOD.REBALANCE": 1.0}
    if "cpgimp" in methods.values():
        sets |= {"GRID.LOWER": "0,0,-1.1e-3", "GRID.UPPER": "10e-3,6e-3,4.9e-3"}
    other = tmp_path / "other"
    other.mkdir()
    one = run("torus", "--quiet", sets=sets, directory=other).results("torus").checkpoint()
    many = run("torus", "--quiet", sets=sets, ranks=3).results("torus").checkpoint()
    apart = driver.distance(one, many, STATE)
    print(methods, apart)
    assert max(apart.values()) <= 1e-10, apart


@pytest.mark.parametrize("ranks", [None, 3])
def test_restart(run, tmp_path, ranks):
    """Exact: stopped after 196 steps, between two sorts and with particles beyond the sides, and continued,
    the plate ends with the same doubles (particles, clock, probes, books) as in one go."""
    other = tmp_path / "other"
    other.mkdir()
    one = run("torus", "--quiet", ranks=ranks, directory=other).results("torus").checkpoint()
    half = {"TIME.MAX_STEPS": 196, "OUTPUT.CHECKPOINT_INTERVAL": 1.372e-5}
    results = run("torus", "--quiet", ranks=ranks, sets=half).results("torus")
    assert results.checkpoint().step == 196
    assert results.checkpoint().x[:, 0].max() > 9.5e-3   # beyond the place where it will be wrapped
    run("torus", "--quiet", "--restart", results.path("_checkpoint.h5"), ranks=ranks)
    two = results.checkpoint()
    assert one.step == two.step == 400
    assert one.all.keys() == two.all.keys()
    for path, values in one.all.items():
        assert np.array_equal(values, two.all[path]), f"{path} differs"


def test_restart_on_another_number_of_ranks(run, torus):
    """Exact: 196 steps on 2 ranks and the rest on 4 end as 400 steps on one, to 1e-10."""
    half = {"TIME.MAX_STEPS": 196, "OUTPUT.CHECKPOINT_INTERVAL": 1.372e-5}
    results = run("torus", "--quiet", ranks=2, sets=half).results("torus")
    run("torus", "--quiet", "--restart", results.path("_checkpoint.h5"), ranks=4)
    one, two = torus.checkpoint(), results.checkpoint()
    box = np.array([10e-3, 6e-3, 1.0])   # the restart sorts at another time, and only a sort wraps
    two.x = one.x + np.mod(two.x - one.x + box / 2, box) - box / 2
    apart = driver.distance(one, two, STATE)
    print(apart)
    assert max(apart.values()) <= 1e-10, apart


LENGTH, SPEED, STEP = 80e-3, 1e3, 0.1   # of the bar [m], of its waves [m/s], half the jump of v [m/s]


def exact_displacement(x, t):
    """[m] of the bar whose left half starts with +STEP and whose right half with -STEP (d'Alembert)."""
    def primitive(s):
        return -STEP * np.abs(np.mod(s, LENGTH) - LENGTH / 2)

    return (primitive(x + SPEED * t) - primitive(x - SPEED * t)) / (2.0 * SPEED)


def bar(run, cell, **sets):
    """State of the periodic bar, its particles' first places [m] and displacements [m] without the drift."""
    more = {f"SHAPE({k}).UPPER": f"{x}e-3,{cell},{cell}" for k, x in ((1, 40), (2, 60), (3, 80))}
    more |= {"GRID.CELL": cell, "GRID.UPPER": f"80e-3,{cell},{cell}"}
    more |= {key.replace("__", "."): value for key, value in sets.items()}
    state = run("ring_bar", "--quiet", sets=more).results("ring_bar").checkpoint()
    fast = state.body == 1
    start = np.empty(len(fast))
    start[fast] = np.repeat(np.arange(fast.sum() // 4) + 0.5, 4) * cell / 2
    start[~fast] = 40e-3 + np.repeat(np.arange((~fast).sum() // 4) + 0.5, 4) * cell / 2
    way = np.mod(state.x[:, 0] - start - 100.0 * state.time + LENGTH / 2, LENGTH) - LENGTH / 2
    return state, start, way


@pytest.mark.parametrize("time", [0.9e-4, 1.0e-4])
def test_waves_in_a_periodic_bar(run, time):
    """Exact: d'Alembert's piecewise linear displacement after more than one turn of the waves, in a bar that
    has moved by 9 or 10 cells through the side: rms error < 4 % of the largest displacement with 80 cells,
    < 2 % with 160; sideways nothing moves."""
    for cell, bound in ((1e-3, 0.04), (0.5e-3, 0.02)):
        state, start, way = bar(run, cell, TIME__END=time, OUTPUT__CHECKPOINT_INTERVAL=time)
        largest = STEP * LENGTH / (4.0 * SPEED)
        error = np.sqrt(np.mean((way - exact_displacement(start, time)) ** 2)) / largest
        print(time, cell, error)
        assert error < bound
        assert np.abs(state.v[:, 1:]).max() < 1e-12 * 100.0


def test_momentum_of_a_periodic_bar(run):
    """Exact: the momentum of the bar is that of its drift, 1000 kg/m3 80e-9 m3 100 m/s, to 1e-12."""
    state, _, _ = bar(run, 1e-3)
    momentum = state.momentum()
    print(momentum / 0.008 - [1, 0, 0])
    assert np.abs(momentum - [0.008, 0.0, 0.0]).max() < 1e-12 * 0.008


def test_the_place_of_the_side_does_not_matter(run):
    """Exact: the bar laid 20 cells further along the box, so that its slow half goes through the side, has
    the same stresses and the same velocities, to 1e-10 of the largest."""
    one, _, _ = bar(run, 1e-3)
    moved = {f"SHAPE({k}).LOWER": f"{x}e-3,0,0" for k, x in ((1, 20), (2, 60), (3, 0))}
    moved |= {f"SHAPE({k}).UPPER": f"{x}e-3,1e-3,1e-3" for k, x in ((1, 60), (2, 80), (3, 20))}
    two = run("ring_bar", "--quiet", sets=moved).results("ring_bar").checkpoint()
    # numbers run along x in every body: those of the slow half begin with the 20 mm moved through the side
    slow = np.flatnonzero(two.body == 2)
    order = np.concatenate([np.flatnonzero(two.body == 1), np.roll(slow, len(slow) // 2)])
    for name in ("v", "tau", "jac"):
        a, b = getattr(one, name), getattr(two, name)[order]
        print(name, np.abs(a - b).max() / np.abs(a).max())
        assert np.abs(a - b).max() <= 1e-10 * np.abs(a).max(), name


def test_clamp_at_a_periodic_side(run, tmp_path):
    """Exact: nodes clamped at the upper side are those of the lower side, too: in a bar at rest that they drag
    sideways, velocities are symmetric about the side, to 1e-12 of the largest."""
    text = (driver.INPUTS / "ring_bar.nml").read_text(encoding="utf-8")
    clamp = "&CLAMP LOWER = 80e-3, 0, 0, UPPER = 80e-3, 1e-3, 1e-3, VELOCITY = 0, 1, 0 /\n"
    (tmp_path / "drag.nml").write_text(text + clamp, encoding="utf-8")
    still = {"BODY(fast).VELOCITY": "0,0,0", "BODY(slow).VELOCITY": "0,0,0"}
    state = run("drag.nml", "--quiet", sets=still).results("drag").checkpoint()
    order = np.argsort(np.mod(state.x[:, 0], LENGTH), kind="stable").reshape(-1, 4)   # four particles a section
    v = state.v[order, 1].mean(axis=1)
    assert v.max() > 0.5
    assert np.abs(v - v[::-1]).max() < 1e-12 * v.max()


def test_heat_in_a_periodic_bar(run):
    """Exact: series solution of a periodic bar of which half starts at 300 K and half, around the side of the
    box, at 400 K, after 0.3 s: rms error < 0.1 % of the step; its heat is kept to 1e-12."""
    state = run("ring_heat", "--quiet").results("ring_heat").checkpoint()
    n = np.arange(1, 400)[:, None]
    diffusivity = 391.0 / (8960.0 * 386.0)
    waves = 200.0 / (np.pi * n) * np.sin(0.5 * np.pi * n) * np.cos(2.0 * np.pi * n * state.x[:, 0] / LENGTH)
    decay = np.exp(-((2.0 * np.pi * n / LENGTH) ** 2) * diffusivity * state.time)
    error = np.sqrt(np.mean((state.temp - 350.0 - np.sum(waves * decay, axis=0)) ** 2))
    print(error)
    assert error < 0.1
    assert np.sum(state.mass * state.temp) == pytest.approx(8960.0 * 80e-9 * 350.0, rel=1e-12)


def slices(state, layers):
    """State by numbers (particles of a section, layers along z)."""
    points = round((len(state.number) / layers) ** 0.5)
    assert points**2 * layers == len(state.number)
    return {name: getattr(state, name).reshape(points**2, layers, -1) for name in STATE}


@pytest.fixture(scope="module")
def thin(tmp_path_factory):
    directory = tmp_path_factory.mktemp("slice")
    return driver.run("slice", "--quiet", directory=directory).results("slice").checkpoint()


def test_plane_strain_by_one_cell(run, thin):
    """Exact: in a plane problem one cell that repeats itself is as good as three: the same places, velocities,
    stresses and plastic strains in all layers to 1e-10 of the largest, and nothing moves along z."""
    three = {"GRID.UPPER": "14e-3,14e-3,3e-3", "SHAPE.UPPER": "10e-3,10e-3,3e-3"}
    thick = run("slice", "--quiet", sets=three).results("slice").checkpoint()
    assert thin.step == thick.step == 300 and thin.plastic.max() > 5e-3
    assert np.abs(thin.v[:, 2]).max() < 1e-12 * np.abs(thin.v).max()
    one, more = slices(thin, 2), slices(thick, 6)
    for name in STATE:
        a = one[name][:, :1, :2] if name == "x" else one[name][:, :1]
        b = more[name][:, :, :2] if name == "x" else more[name]
        print(name, np.abs(a - b).max() / np.abs(a).max())
        assert np.abs(a - b).max() <= 1e-10 * np.abs(a).max(), name


def test_plane_strain_on_ranks(run, thin):
    """Exact: one cell that repeats itself on 4 ranks gives the state of one process to 1e-10."""
    apart = driver.distance(thin, run("slice", "--quiet", ranks=4).results("slice").checkpoint(), STATE)
    print(apart)
    assert max(apart.values()) <= 1e-10, apart


def test_mistakes(run, tmp_path):
    """Exact: a box of 6.5 cells and a wall at a periodic side are complained about, each on its line."""
    done = run("torus", expect=driver.BAD_INPUT, sets={"GRID.UPPER": "10.5e-3,6e-3,5e-3"})
    assert len(done.err.splitlines()) == 1 and "GRID" in done.err and "whole number of cells" in done.err
    done = run("torus", expect=driver.BAD_INPUT, sets={"GRID.PERIODIC": "'xyz'"})
    assert len(done.err.splitlines()) == 1 and "torus.nml:13: error: &WALL SIDE" in done.err
    assert "periodic" in done.err
    done = run("torus", expect=driver.BAD_INPUT, sets={"GRID.PERIODIC": "'xa'"})
    assert len(done.err.splitlines()) == 1 and "only the characters xyz" in done.err
    assert list(tmp_path.iterdir()) == []
