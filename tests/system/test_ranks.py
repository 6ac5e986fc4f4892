# SPDX-License-Identifier: MIT
"""The same problem on 1, 2, 4 and 8 ranks."""

import driver
import numpy as np
import pytest

STATE = ["x", "v", "b", "jac", "plastic", "temp", "tau"]


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Results of one process without mpirun, by sets."""
    known = {}

    def results(name, **sets):
        key = (name, *sets.items())
        if key not in known:
            directory = tmp_path_factory.mktemp(name)
            known[key] = driver.run(name, "--quiet", directory=directory, sets=dots(sets)).results(name)
        return known[key]

    return results


def dots(sets):
    return {key.replace("__", "."): value for key, value in sets.items()}


@pytest.mark.parametrize("ranks", [1, 2, 4, 8])
def test_1000_steps_do_not_depend_on_the_number_of_ranks(run, alone, ranks):
    """Exact: a vibrating, spinning, flying elastic-plastic block (3840 particles, two bodies, gravity,
    conduction) has after 1000 steps the same positions [m], velocities [m/s], temperatures [K], Kirchhoff
    stresses [Pa] and plastic strains on any number of ranks: to 1e-10 of the largest value; bit for bit
    with mpirun -n 1. Every rank has its share, and particles have moved 3 cells across the cuts."""
    one = alone("block").checkpoint()
    results = run("block", "--quiet", ranks=ranks).results("block")
    many = results.checkpoint()
    assert one.step == many.step == 1000
    assert len(one.number) == 3840
    assert one.plastic.max() > 1e-3 and np.abs(one.tau).max() > 50e6   # it is worth comparing
    assert len(many.particles_of_rank) == ranks
    assert max(many.particles_of_rank) < 1.3 * 3840 / ranks
    apart = driver.distance(one, many, STATE)
    print(ranks, apart)
    assert max(apart.values()) <= (0.0 if ranks == 1 else 1e-10), apart
    assert worst_column(alone("block").probes(), results.probes())[1] <= 1e-8


def worst_column(one, other):
    """The column in which two histories differ most, and by how much of its largest value; by how many percent
    the energy audit, a small difference of energies in percent of them; that of rounding (conduction_error[%])
    only has to be below 1e-9 in both."""
    assert one.names == other.names and one.rows.shape == other.rows.shape
    apart = []
    for name in one.names:
        if name == "conduction_error[%]":
            assert max(np.abs(one[name]).max(), np.abs(other[name]).max()) < 1e-9
            continue
        scale = 1.0 if name == "audit_error[%]" else np.abs(one[name]).max()
        assert np.isfinite(scale), f"{name} is not finite"
        apart.append((np.abs(one[name] - other[name]).max() / scale if scale > 0.0 else 0.0, name))
    return max(apart)[1], max(apart)[0]


@pytest.mark.parametrize("ranks", [2, 4])
def test_refused_steps_do_not_depend_on_the_number_of_ranks(run, alone, ranks):
    """Exact: half a block is so fast that every step of 27 is found too long in its middle, when the ranks of the
    other half, if they had to wait, have moved particles already: the state is the same on any number of ranks,
    to 1e-10 of the largest value."""
    sets = {"TIME__MASS_SCALING": 1e4, "TIME__DT": 1.2e-5, "TIME__END": 8e-5, "OUTPUT__CHECKPOINT_INTERVAL": 8e-5,
            "BODY(1)__VELOCITY": "0,0,0", "BODY(1)__ANGULAR_VELOCITY": "0,0,0"}
    one = alone("block", **sets).checkpoint()
    done = run("block", ranks=ranks, sets=dots(sets))
    assert " 26 step(s) would have moved a node by more than half a cell" in done.out
    many = done.results("block").checkpoint()
    assert one.step == many.step == 27 and one.plastic.max() > 0.1
    apart = driver.distance(one, many, STATE)
    assert max(apart.values()) <= 1e-10, apart


def test_histories_do_not_depend_on_the_number_of_ranks(run, alone):
    """Exact: every column of the history is finite and the same on 1 and on 2 ranks, to 1e-8 of its
    largest value (10 digits are printed)."""
    results = run("block", "--quiet", ranks=2).results("block")
    name, apart = worst_column(alone("block").history(), results.history())
    assert apart <= 1e-8, (name, apart)


def test_flow_stress_does_not_depend_on_the_number_of_ranks(run, alone):
    """Exact: the flow stress [Pa] of every particle is the same on 1 and on 4 ranks, to 1e-10 of the
    largest, also where the material does not yield: it limits friction and is written to the frames."""
    one = alone("block").checkpoint()
    many = run("block", "--quiet", ranks=4).results("block").checkpoint()
    apart = driver.distance(one, many, ["flow"])
    assert apart["flow"] <= 1e-10, apart


@pytest.mark.parametrize("shape, scheme", [("bspline", "usl"), ("ugimp", "usavg")])
def test_other_methods_do_not_depend_on_the_number_of_ranks(run, alone, shape, scheme):
    """Exact: 200 steps of the same block on 3 ranks as on one, to 1e-10, for B-splines and
    for USAVG (positions [m], velocities [m/s], temperatures [K], stresses [Pa])."""
    sets = dict(METHOD__SHAPE=shape, METHOD__SCHEME=scheme, TIME__END=1.4e-5,
                OUTPUT__CHECKPOINT_INTERVAL=1.4e-5)
    one = alone("block", **sets).checkpoint()
    many = run("block", "--quiet", ranks=3, sets=dots(sets)).results("block").checkpoint()
    assert one.step == many.step == 200
    apart = driver.distance(one, many, STATE)
    print(shape, scheme, apart)
    assert max(apart.values()) <= 1e-10, apart


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_step_of_short_domains_does_not_depend_on_the_number_of_ranks(run, alone, ranks):
    """Exact: with cpGIMP default steps follow the shortest domains: time and state after 100 of them as on one
    rank, to 1e-10 of the largest value; bit for bit if they are stopped after 50 and continued."""
    sets = dict(METHOD__SHAPE="cpgimp", BODY__PARTICLES_PER_CELL="2,2,4", TIME__DT=0, TIME__MAX_STEPS=100)
    one = alone("block", **sets).checkpoint()
    results = run("block", "--quiet", ranks=ranks, sets=dots(sets)).results("block")
    many = results.checkpoint()
    assert one.step == many.step == 100 and many.time == pytest.approx(one.time, rel=1e-12)
    assert max(driver.distance(one, many, STATE).values()) <= 1e-10
    run("block", "--quiet", "--overwrite", ranks=ranks, sets=dots(sets) | {"TIME.MAX_STEPS": 50})
    run(None, "--quiet", "--restart", results.path("_checkpoint.h5"), ranks=ranks, sets={"TIME.MAX_STEPS": 100})
    again = results.checkpoint()
    assert again.time == many.time and set(driver.distance(many, again, STATE).values()) == {0.0}


def test_frequent_repartition_changes_nothing(run, alone):
    """Exact: sorting every 5 steps and dividing the grid anew at any imbalance (REBALANCE = 1) gives the
    state of one process with the default intervals to 1e-10 after 1000 steps."""
    one = alone("block").checkpoint()
    sets = {"METHOD.SORT_INTERVAL": 5, "METHOD.REBALANCE": 1.0}
    many = run("block", "--quiet", ranks=3, sets=sets).results("block").checkpoint()
    apart = driver.distance(one, many, STATE)
    print(apart)
    assert max(apart.values()) <= 1e-10, apart


@pytest.mark.parametrize("ranks, size", [(8, 1e-3), (4, 0.5e-3)])
def test_more_ranks_than_loaded_cells(run, alone, ranks, size):
    """Exact: a crumb of 8 particles (1 mm) on 8 ranks and of a single particle (0.5 mm) on 4 ranks flies
    as on one: ranks without particles take part in every exchange, probe and output. Positions [m],
    velocities [m/s] and stresses [Pa] to 1e-10; the single particle keeps its velocity exactly."""
    corner = 2e-3 + size
    sets = dict(SHAPE__UPPER=f"{corner},{corner},{corner}")
    one = alone("crumb", **sets).checkpoint()
    many = run("crumb", "--quiet", ranks=ranks, sets=dots(sets)).results("crumb").checkpoint()
    assert one.step == many.step == 100
    assert len(many.number) == round((size / 0.5e-3) ** 3)
    assert 0 in many.particles_of_rank and sum(many.particles_of_rank) == len(many.number)
    apart = driver.distance(one, many, ["x", "v", "temp", "jac", "b"])
    assert max(apart.values()) <= 1e-10, apart
    if len(many.number) == 1:
        exact = np.array([300.0, 200.0, 100.0]) + np.cross([0, 0, 1000.0], [-0.25e-3, -0.25e-3, -0.25e-3])
        assert np.allclose(many.v, exact, rtol=1e-12)
        assert np.allclose(many.x, 2.25e-3 + 8e-6 * exact, rtol=1e-12)
