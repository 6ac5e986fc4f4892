# SPDX-License-Identifier: MIT
"""Materials in whole runs: bodies that start stretched, with either elastic energy, and a creeping layer."""

import re

import driver
import numpy as np
import pytest

# Lame's constants and bulk modulus of the rubber of stretched.nml and released.nml [Pa].
MU = 1e6 / 2.6
BULK = 1e6 / 1.2
LAMBDA = BULK - 2.0 / 3.0 * MU
VOLUME = (4e-3) ** 3  # of the block, deformed [m3]

# Initial deformation gradient and kind of the walls. A shear stress needs walls that hold everything.
STRETCHES = {
    "sliding": np.diag([1.3, 0.8, 1.1]),
    "fixed": np.array([[1.2, 0.3, -0.1], [0.0, 0.9, 0.2], [0.1, -0.2, 1.1]]),
}


def exact(energy, f):
    """Kirchhoff stress [Pa], xx yy zz xy yz xz, and energy per initial volume [J/m3] of a gradient."""
    jac, b, one = np.linalg.det(f), f @ f.T, np.eye(3)
    if energy == "coupled":
        tau = MU * (b - one) + LAMBDA * np.log(jac) * one
        w = 0.5 * MU * (np.trace(b) - 3.0) - MU * np.log(jac) + 0.5 * LAMBDA * np.log(jac) ** 2
    else:
        bbar = b * jac ** (-2.0 / 3.0)
        tau = MU * (bbar - np.trace(bbar) / 3.0 * one) + 0.5 * BULK * (jac**2 - 1.0) * one
        w = 0.5 * BULK * (0.5 * (jac**2 - 1.0) - np.log(jac)) + 0.5 * MU * (np.trace(bbar) - 3.0)
    return tau[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]], w


def numbers(f):
    return ",".join(str(x) for x in f.ravel())


@pytest.mark.parametrize("walls", STRETCHES)
@pytest.mark.parametrize("energy", ["coupled", "decoupled"])
def test_stretched_block_stays_in_equilibrium(run, energy, walls):
    """Exact: a uniform stress between walls is in equilibrium: after 100 steps (ten wave transits) every
    particle has the stress of the formula to 1e-12 of the shear modulus and less than 1e-12 of the wave
    speed, the block's mass is rho V/J, and its energy is V/J times that of the formula in every row."""
    f = STRETCHES[walls]
    sets = {"MATERIAL.ENERGY": energy, "WALL.KIND": walls, "BODY.DEFORMATION": numbers(f)}
    results = run("stretched", "--quiet", sets=sets).results("stretched")
    tau, w = exact(energy, f)
    state, history = results.checkpoint(), results.history()
    print(state.step, np.abs(state.tau - tau).max() / MU, np.abs(state.v).max())
    assert state.step > 90
    assert np.abs(state.tau - tau).max() < 1e-12 * MU
    assert np.abs(state.v).max() < 1e-12 * np.sqrt((LAMBDA + 2.0 * MU) / 1e3)
    assert state.mass.sum() == pytest.approx(1e3 * VOLUME / np.linalg.det(f), rel=1e-13)
    assert history["elastic[J]"] == pytest.approx(VOLUME / np.linalg.det(f) * w, rel=1e-10)


@pytest.mark.parametrize("energy", ["coupled", "decoupled"])
def test_first_step_knows_the_stretch(run, energy):
    """Exact: the first time step is 0.4 h/c with rho c^2 = K J^2 + 4/3 G tr(Bbar)/3, or lambda (1 - ln J) +
    mu (1 + 1.3^2) with the coupled energy."""
    sets = {"MATERIAL.ENERGY": energy, "TIME.CFL": 0.4, "TIME.MAX_STEPS": 1}
    history = run("stretched", "--quiet", sets=sets).results("stretched").history()
    f = STRETCHES["sliding"]
    jac = np.linalg.det(f)
    if energy == "coupled":
        stiffness = LAMBDA * (1.0 - np.log(jac)) + MU * (1.0 + 1.3**2)
    else:
        stiffness = BULK * jac**2 + 4.0 / 9.0 * MU * np.trace(f @ f.T) * jac ** (-2.0 / 3.0)
    assert history["step"][-1] == 1
    assert history["dt[s]"][-1] == pytest.approx(0.4 * 1e-3 / np.sqrt(stiffness / 1e3), rel=1e-9)


@pytest.mark.parametrize("fbar", [".true.", ".false."])
@pytest.mark.parametrize("energy", ["coupled", "decoupled"])
def test_books_of_a_released_block(run, tmp_path, energy, fbar):
    """Exact: the work of the stress, and of averaging the volume, is what the elastic energy changes by: the
    audit error of a block let go falls with the square of the time step, and is below 0.1 % at 6e-6 s. Its
    momentum is that of the load of 1e-3 N in 2 ms to 1e-9, however heavy the stretch has made it."""
    worst = []
    for k, dt in enumerate((6e-6, 3e-6)):
        directory = tmp_path / str(k)
        directory.mkdir()
        sets = {"MATERIAL.ENERGY": energy, "METHOD.FBAR": fbar, "TIME.DT": dt}
        results = run("released", "--quiet", directory=directory, sets=sets).results("released")
        worst.append(np.abs(results.history()["audit_error[%]"]).max())
        assert results.checkpoint().momentum() == pytest.approx([0.0, 2e-6, 0.0], abs=2e-15)
    print(worst)
    assert worst[0] < 0.1
    assert worst[0] / worst[1] == pytest.approx(4.0, rel=0.25)


def test_stretched_block_on_ranks(run, tmp_path):
    """Exact: the released block on 3 ranks is that on one, to 1e-10."""
    sets = {"MATERIAL.ENERGY": "coupled"}
    states = []
    for ranks in (1, 3):
        directory = tmp_path / str(ranks)
        directory.mkdir()
        done = run("released", "--quiet", directory=directory, ranks=ranks, sets=sets)
        states.append(done.results("released").checkpoint())
    apart = driver.distance(*states, ("x", "v", "tau", "jac", "b", "mass"))
    print(apart)
    assert max(apart.values()) < 1e-10


def test_creeping_layer(run):
    """Exact: simple shear at 1/s of a Norton material: J2 flow gives tau = K (1/sqrt(3))^N/sqrt(3), K = 40 MPa,
    N = 0.2; the power of plastic work and of the walls is tau V, V = 6e-9 m3: to 1e-6 once the elastic strain
    has built up (3e-3 s). The temperature rises by 0.9 of the plastic work."""
    results = run("layer", "--quiet").results("layer")
    state, history = results.checkpoint(), results.history()
    tau = 40e6 * 3.0**-0.1 / np.sqrt(3.0)
    print(state.tau[0] / tau - 1.0)
    assert state.tau[:, 5] == pytest.approx(tau, rel=1e-6)
    assert state.rate == pytest.approx(1.0 / np.sqrt(3.0), rel=2e-6)
    late = np.flatnonzero(history["time[s]"] > 3e-3)[0]
    for name in ("plastic_work[J]", "wall_work[J]"):
        power = (history[name][-1] - history[name][late]) / (history["time[s]"][-1] - history["time[s]"][late])
        print(name, power / (tau * 6e-9) - 1.0)
        assert power == pytest.approx(tau * 6e-9, rel=2e-6)
    heat = 896.0 * np.sum(state.mass * (state.temp - 298.0))
    assert heat == pytest.approx(0.9 * history["plastic_work[J]"][-1], rel=1e-8)


# What is replaced in stretched.nml, and what the message must say.
MISTAKES = {
    "a law with the coupled energy": ("POISSON_RATIO = 0.3", "POISSON_RATIO = 0.3, ENERGY = 'coupled', LAW = 'norton', "
                                      "NORTON_K = 1e6, NORTON_N = 0.2, PLASTIC_HEAT = 0", r"ENERGY = 'coupled'.* LAW = 'elastic'"),
    "expansion with the coupled energy": ("POISSON_RATIO = 0.3", "POISSON_RATIO = 0.3, ENERGY = 'coupled', EXPANSION = 1e-5",
                                          r"EXPANSION = 1e-5.* must be 0 with ENERGY = 'coupled'"),
    "a law without its keys": ("POISSON_RATIO = 0.3", "POISSON_RATIO = 0.3, LAW = 'norton', NORTON_K = 1e6, PLASTIC_HEAT = 0",
                               r"has no NORTON_N"),
    "a mirrored body": ("0.8, 0", "-0.8, 0", r"DEFORMATION .*determinant above 0"),
    "a flat body": ("0.8, 0", "0, 0", r"DEFORMATION .*determinant above 0"),
    "an implausible stretch": ("0.8, 0", "1e30, 0", r"DEFORMATION .*implausible.* from 1e-6 to 1e6"),
    "an implausible shear": ("0.8, 0", "0.8, 1e4", r"DEFORMATION .*implausible.* from 1e-6 to 1e6"),
    "half a gradient": ("0, 0, 0, 1.1", "0", r"DEFORMATION .*9 real numbers.*found 6"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake(run, tmp_path, mistake):
    """Exact: one mistake gives one message with its line, and nothing is written."""
    old, new, words = MISTAKES[mistake]
    text = (driver.INPUTS / "stretched.nml").read_text()
    line = text[: text.index(old)].count("\n") + 1
    (tmp_path / "wrong.nml").write_text(text.replace(old, new, 1))
    done = run("wrong.nml", expect=driver.BAD_INPUT)
    print(done.err)
    (message,) = done.err.splitlines()
    assert re.match(rf"wrong\.nml:{line}: error: .*{words}", message)
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.nml"]
