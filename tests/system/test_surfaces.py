# SPDX-License-Identifier: MIT
"""What a &SURFACE gives and takes: a coefficient by pressure, radiation."""

import math
import pathlib
import sys

import driver
import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "verification"))

import exact

LENGTH, CELL = 32e-3, 1.6e-3


def pressure_of(stretch, young, poisson):
    """Cauchy pressure across the planes of a compression by `stretch` of the material of docs/method.md [Pa]."""
    bulk, shear = young / (3 - 6 * poisson), young / (2 + 2 * poisson)
    across = stretch ** (4 / 3)   # of Bbar = J^(-2/3) F F^T
    mean = (across + 2 * stretch ** (-2 / 3)) / 3
    return -(shear * (across - mean) + bulk / 2 * (stretch**2 - 1)) / stretch


def law(seed):
    """Keys of a coefficient that depends on pressure, and the coefficient at `p`."""
    random = np.random.default_rng(seed)
    if seed % 2:
        base, factor, exponent = random.uniform(0, 500), random.uniform(60, 300), random.choice([0.5, 0.95, 1.2])
        keys = {"SURFACE.COEFFICIENT": base, "SURFACE.PRESSURE_FACTOR": factor, "SURFACE.PRESSURE_EXPONENT": exponent}
        return keys, lambda p: base + factor * (p / 1e6) ** exponent
    at = np.cumsum(random.uniform(1e7, 8e7, 6))
    there = np.cumsum(random.uniform(100, 2000, 6))
    keys = {"SURFACE.TABLE_OF": "pressure", "SURFACE.TABLE_AT": ",".join(map(str, at)),
            "SURFACE.TABLE_COEFFICIENT": ",".join(map(str, there))}
    return keys, lambda p: float(np.interp(p, at, there))


def table_scene(name, directory, table):
    """An input, without the keys of a coefficient that a table replaces."""
    text = (driver.INPUTS / f"{name}.nml").read_text()
    if table:
        text = text.replace("COEFFICIENT = 0, PRESSURE_FACTOR = 100", "")
    path = directory / f"{name}.nml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("seed, integrator", [(0, "explicit"), (1, "backward-euler"), (2, "backward-euler"), (3, "explicit")])
def test_coefficient_by_pressure(run, tmp_path, seed, integrator):
    """A slab squeezed between walls: temperatures within 1 % of the Robin slab with the coefficient at its pressure, and
    what it lost is booked."""
    random = np.random.default_rng(100 + seed)
    keys, coefficient = law(seed)
    young, poisson, stretch = random.uniform(4e10, 2e11), random.uniform(0, 0.35), 1 - random.uniform(3e-4, 1.5e-3)
    h = coefficient(pressure_of(stretch, young, poisson))
    conductivity = h * LENGTH / random.uniform(0.5, 2.0)
    end = LENGTH**2 / (conductivity / 2.43e6)
    sets = keys | {"MATERIAL.YOUNGS_MODULUS": young, "MATERIAL.POISSON_RATIO": poisson, "MATERIAL.CONDUCTIVITY": conductivity,
                   "GRID.CELL": CELL, "GRID.LOWER": f"{-2 * CELL},{-2 * CELL},0", "GRID.UPPER": f"{3 * CELL},{3 * CELL},{LENGTH}",
                   "SHAPE.UPPER": f"{CELL},{CELL},{LENGTH}", "WALL(2).POSITION": CELL, "WALL(4).POSITION": CELL,
                   "BODY.DEFORMATION": f"1,0,0,0,1,0,0,0,{stretch}", "TIME.END": end, "OUTPUT.CHECKPOINT_INTERVAL": end,
                   "OUTPUT.HISTORY_INTERVAL": end / 10, "TIME.DT": 0.15 * CELL**2 / conductivity * 2.43e6,
                   "HEAT.INTEGRATOR": integrator}
    if integrator != "explicit":
        sets["HEAT.EVERY"] = 4
    results = run(table_scene("squeezed_slab", tmp_path, seed % 2 == 0), "--quiet", sets=sets).results("squeezed_slab")
    state, history = results.checkpoint(), results.history()
    wanted = 300 + 200 * exact.robin_slab(1 - state.x[:, 2] / LENGTH, h * LENGTH / conductivity, 1.0)
    error = np.abs(state.temp - wanted).max() / 200
    lost = history["heat_content[J]"][0] - history["heat_content[J]"][-1]
    print(seed, integrator, h, h * LENGTH / conductivity, error)
    assert error < 0.01
    assert history["film_loss[J]"][-1] == pytest.approx(lost, rel=1e-6)
    assert np.abs(history["conduction_error[%]"]).max() < 1e-9


def cooling_time(t, start, around, emissivity, capacity, area):
    """When a body of one temperature that radiates has come from `start` down to `t` [K]: integral of
    capacity dT/(emissivity sigma area (around^4 - T^4))."""
    def primitive(x):
        return 0.5 * math.log((x + around) / (x - around)) + math.atan(x / around)

    return capacity / (2 * emissivity * 5.670374419e-8 * area * around**3) * (primitive(t) - primitive(start))


RADIATING = [(0, "explicit"), (1, "explicit"), (2, "backward-euler")]


@pytest.mark.parametrize("seed, how", RADIATING)
def test_radiation(run, seed, how):
    """A small cube that radiates from all faces, hot as steel in the forge: its temperature within 1 % of the difference to
    the surroundings at any time of an integral in closed form."""
    random = np.random.default_rng(seed)
    start, around, emissivity = random.uniform(900, 1600), random.uniform(250, 500), random.uniform(0.3, 1.0)
    capacity, area = 3.6e6 * 4e-3**3, 6 * 4e-3**2
    end = 0.9 * cooling_time(around + 0.3 * (start - around), start, around, emissivity, capacity, area)
    sets = {"BODY.TEMPERATURE": start, "HEAT.AMBIENT": around, "SURFACE.EMISSIVITY": emissivity, "TIME.END": end,
            "OUTPUT.HISTORY_INTERVAL": end / 10, "OUTPUT.CHECKPOINT_INTERVAL": end, "TIME.DT": end / 1000,
            "GRID.CELL": 2e-3}
    if how == "backward-euler":
        sets |= {"HEAT.INTEGRATOR": how, "HEAT.EVERY": 5}
    history = run("radiating_cube", "--quiet", sets=sets).results("radiating_cube").history()
    lost = history["film_loss[J]"]
    found = start - lost / capacity
    times = [cooling_time(t, start, around, emissivity, capacity, area) for t in found]
    error = np.abs(np.array(times) - history["time[s]"]).max() / end
    print(seed, how, found[-1], error)
    assert error < 0.01


def surface_temperature(start, around, film, emissivity, resistance):
    """Of a wall whose other side is held at `start`: what comes through it goes by film and radiation."""
    low, high = sorted((start, around))
    for _ in range(60):
        t = (low + high) / 2
        out = film * (t - around) + emissivity * 5.670374419e-8 * (t**4 - around**4)
        low, high = (low, t) if out > (start - t) / resistance else (t, high)
    return t


@pytest.mark.parametrize("case, how", [(0, "rkl2"), (1, "tr-bdf2"), (2, "backward-euler")])
def test_radiation_of_heat_alone(run, tmp_path, case, how):
    """Exact, in heat alone: the cube as above, within 1 %, and a wall that radiates into hotter or colder surroundings
    beside a film, its steady temperatures within 1e-3 of the whole difference; heat is conserved."""
    random = np.random.default_rng(case)
    start, around, emissivity = random.uniform(900, 1600), random.uniform(250, 500), random.uniform(0.1, 1.0)
    capacity, area = 3.6e6 * 4e-3**3, 6 * 4e-3**2
    end = 0.9 * cooling_time(around + 0.3 * (start - around), start, around, emissivity, capacity, area)
    text = (driver.INPUTS / "radiating_cube.nml").read_text()
    path = tmp_path / "cube.nml"
    path.write_text("&METHOD MECHANICS = F /\n" + text.replace(", MASS_SCALING = 9e11, DT = 0.01", ""))
    sets = {"BODY.TEMPERATURE": start, "HEAT.AMBIENT": around, "SURFACE.EMISSIVITY": emissivity, "TIME.END": end,
            "OUTPUT.HISTORY_INTERVAL": end / 10, "OUTPUT.CHECKPOINT_INTERVAL": end, "HEAT.INTEGRATOR": how,
            "HEAT.TOLERANCE": 0.05 if how == "backward-euler" else 0.5}
    history = run(path, "--quiet", sets=sets).results("cube").history()
    lost, content = history["film_loss[J]"], history["heat_content[J]"]
    times = [cooling_time(start - heat / capacity, start, around, emissivity, capacity, area) for heat in lost]
    assert np.abs(np.array(times) - history["time[s]"]).max() / end < 0.01
    assert content[0] - content[-1] == pytest.approx(lost[-1], rel=1e-5)      # printed digits

    film = random.uniform(0.0, 200.0) * (case > 0)
    around, start = random.uniform(300, 1500), random.uniform(300, 900)
    k, end = ((100.0, 80), (1.0, 4000), (20.0, 400))[case]
    exact = surface_temperature(start, around, film, emissivity, 32e-3 / k)
    path = tmp_path / "wall.nml"
    text = (driver.INPUTS / "heat_slab.nml").read_text()
    text = text.replace("FACE = 'xmin', COEFFICIENT = 6250", f"FACE = 'xmin', COEFFICIENT = 1e9, AMBIENT = {start}")
    path.write_text(text.replace("COEFFICIENT = 6250", f"COEFFICIENT = {film}, EMISSIVITY = {emissivity}, AMBIENT = {around}"))
    sets = {"TIME.END": end, "GRID.CELL": 4e-3, "HEAT.INTEGRATOR": how, "BODY.TEMPERATURE": start, "MATERIAL.CONDUCTIVITY": k}
    probes = run(path, "--quiet", sets=sets).results("wall").probes()
    print(case, how, probes["face[K]"][-1], exact, start, around)
    assert probes["centre[K]"][-1] == pytest.approx((start + exact) / 2, abs=1e-3 * abs(around - start))
    assert probes["face[K]"][-1] == pytest.approx(exact, abs=1e-3 * abs(around - start))


REFUSED = [({"METHOD.MECHANICS": "F", "SURFACE.PRESSURE_FACTOR": 10}, "no pressure is known"),
           ({"SURFACE.TABLE_OF": "pressure"}, "needs as many values")]


@pytest.mark.parametrize("sets, words", REFUSED)
def test_what_does_not_go_together_is_refused(run, sets, words):
    assert words in run("radiating_cube", "--check=scene", sets=sets, expect=driver.BAD_INPUT).err
