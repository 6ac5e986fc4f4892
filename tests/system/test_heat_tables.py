# SPDX-License-Identifier: MIT
"""Specific heat and conductivity over temperature beside mechanics: exact profiles, fluxes and heat contents."""

import driver
import numpy as np
import pytest

def pairs(temperatures, values):
    return ",".join(f"{t!r},{v!r}" for t, v in zip(temperatures.tolist(), values.tolist()))


def integral(t, x, y):
    """Exact: of the table from its first point on; constant beyond the ends."""
    knots = np.unique(np.concatenate((x[(x < t)], [x[0], t])))
    return np.trapezoid(np.interp(knots, x, y), knots) if t >= x[0] else (t - x[0]) * y[0]


def inverse(value, x, y):
    """Exact up to bisection: the temperature where the integral has a value."""
    low, high = 0.0, 1e4
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if integral(middle, x, y) < value else (low, middle)
    return low


@pytest.mark.parametrize("solver, seed", [("explicit", 1), ("cg", 2), ("cg", 3), ("petsc", 4)])
def test_steady_bar(run, tmp_path, solver, seed):
    """Exact (Kirchhoff): between a wall at T_0 and a film the integral of k over T is linear in x, and what flows is
    its slope and what the film takes up. Profile within 1 % (any draw: 1.5 %) of its difference from two cells off the film on, for
    drawn tables whose points are apart by three cells' difference in temperature."""
    if solver == "petsc" and driver.lacks("petsc", tmp_path):
        pytest.skip("this build has no petsc")
    draw = np.random.default_rng(seed)
    length, cold, ambient = 64e-3, draw.uniform(280, 320), draw.uniform(900, 1500)
    x = draw.uniform(250, 300) + np.cumsum(draw.uniform(150, 250, 4))
    k = draw.uniform(50, 100, 4) * np.array([1, 2, 1, 3])[draw.permutation(4)]
    if seed == 1:                        # linear in T
        x, k = np.array([cold, 900.0]), np.array([100.0, 400.0])
    film = draw.uniform(0.5, 2.0) * k.mean() / length
    text = (driver.INPUTS / "wall_heat.nml").read_text()
    text = text.replace("CONDUCTIVITY = 391", f"CONDUCTIVITY_TABLE = {pairs(x, k)}")
    text = text.replace("'xmin', TEMPERATURE = 300", f"'xmin', TEMPERATURE = {cold}")
    text = text.replace("&WALL SIDE = 'xmax', TEMPERATURE = 300",
                        f"&SURFACE BODY = 'bar', FACE = 'xmax', COEFFICIENT = {film}, AMBIENT = {ambient}")
    text = text.replace("UPPER = 64e-3, 4e-3, 4e-3 /", "UPPER = 80e-3, 4e-3, 4e-3 /", 1)
    path = tmp_path / "steady.nml"
    path.write_text(text)
    slowest = 8960 * 386 * (2 * length / np.pi) ** 2 / k.min()    # time constant, at most
    end = round(6 * slowest)
    sets = {"TIME.END": end, "TIME.MASS_SCALING": 9e11, "OUTPUT.CHECKPOINT_INTERVAL": end, "BODY.TEMPERATURE": 600}
    if solver != "explicit":
        sets |= {"HEAT.INTEGRATOR": "backward-euler", "HEAT.STEP": 2, "HEAT.SOLVER": solver}
    results = run(path, "--quiet", sets=sets).results("steady")
    low, high = cold, ambient            # the temperature of the face
    for _ in range(60):
        face = (low + high) / 2
        low, high = (face, high) if (integral(face, x, k) - integral(cold, x, k)) / length < film * (ambient - face) else (low, face)
    whole = integral(face, x, k) - integral(cold, x, k)
    state = results.checkpoint()
    wanted = [inverse(integral(cold, x, k) + at / length * whole, x, k) for at in state.x[:, 0]]
    off = (np.abs(state.temp - wanted) / (face - cold))[state.x[:, 0] < length - 8e-3].max()
    print(solver, seed, off, cold, face, ambient)
    assert off < (0.01 if seed < 5 else 0.015)
    assert np.abs(results.history()["conduction_error[%]"]).max() < 1e-9


@pytest.mark.parametrize("solver, seed", [("explicit", 1), ("explicit", 2), ("cg", 3)])
def test_heated_bar(run, tmp_path, solver, seed):
    """Exact: the enthalpies of the particles of an insulated plate are the heat of its source, for drawn tables with a
    latent heat across 20 K that a part of the plate takes up."""
    draw = np.random.default_rng(seed)
    melts = draw.uniform(330, 400)
    x = np.array([300.0, melts, melts + 2, melts + 18, melts + 20, 1500.0])
    c = draw.uniform(500, 1000, 6)
    c[2:4] = draw.uniform(5e3, 2e4)
    text = (driver.INPUTS / "line.nml").read_text()
    text = text.replace("SPECIFIC_HEAT = 896.404, CONDUCTIVITY = 167",
                        f"SPECIFIC_HEAT_TABLE = {pairs(x, c)}, CONDUCTIVITY_TABLE = 300, 150, 600, 250")
    text = text.replace("-40e-3, 0, 0, UPPER = 60e-3, 40e-3", "-8e-3, 0, 0, UPPER = 12e-3, 8e-3")
    text = text[:text.index("&PROBE")] + text[text.index("&OUTPUT"):]
    path = tmp_path / "heated.nml"
    path.write_text(text.replace("VELOCITY = 10e-3, 0, 0,", "END = 0.5,"))
    sets = {"TIME.END": 4, "TIME.MASS_SCALING": 9e11, "OUTPUT.CHECKPOINT_INTERVAL": 4}
    if solver != "explicit":
        sets |= {"HEAT.INTEGRATOR": "backward-euler", "HEAT.TOLERANCE": 0.5, "HEAT.SOLVER": solver}
    results = run(path, "--quiet", sets=sets).results("heated")
    history, state = results.history(), results.checkpoint()
    content, given = history["heat_content[J]"], history["source_heat[J]"][-1]
    held = sum(m * integral(t, x, c) for m, t in zip(state.mass, state.temp))
    print(solver, seed, state.temp.min(), state.temp.max(), x[1:5], content[-1] - content[0], held, given)
    assert content[-1] - content[0] == pytest.approx(given, rel=1e-6)     # printed digits
    assert held == pytest.approx(given, rel=1e-6)
    assert np.abs(history["conduction_error[%]"]).max() < 1e-9


def test_plastic_heat(run):
    """Exact: what 0.9 of the plastic work brings to a squeezed block is in its enthalpy, for a drawn table."""
    draw = np.random.default_rng(5)
    table = pairs(np.array([290.0, 300.5, 310.0, 330.0, 900.0]), draw.uniform(300, 2000, 5))
    history = run("squeezed", "--quiet", sets={"MATERIAL.SPECIFIC_HEAT_TABLE": table}).results("squeezed").history()
    content = history["heat_content[J]"]
    assert history["temperature_max[K]"][-1] > 310.0
    assert content[-1] - content[0] == pytest.approx(0.9 * history["plastic_work[J]"][-1], rel=1e-5)  # printed digits


REFUSED = {
    "pairs": ("line", "MATERIAL.CONDUCTIVITY_TABLE", "300,100,200,150", "must be pairs in rising temperature"),
    "odd": ("line", "MATERIAL.SPECIFIC_HEAT_TABLE", "300,1000,400", "must be pairs in rising temperature"),
    "zero": ("line", "MATERIAL.SPECIFIC_HEAT_TABLE", "300,1000,400,0", "must be above 0"),
    "known": ("heat_mode", "MATERIAL.CONDUCTIVITY_TABLE", "300,100,400,150", "needs a material without tables"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(run, case):
    """What is no table, and a known field that tables would make wrong."""
    name, key, value, complaint = REFUSED[case]
    assert complaint in run(name, "--check=scene", sets={key: value}, expect=driver.BAD_INPUT).err
