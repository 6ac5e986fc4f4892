# SPDX-License-Identifier: MIT
"""Heat that friction leaves, and its exchange with films, backings and tools, at any conductance, diffusivity and step."""

import numpy as np
import pytest

SEED = 55


@pytest.mark.parametrize("draw", range(3))
def test_friction_heat_does_not_wait(run, tmp_path, draw):
    """Metals of any diffusivity in cells of any size: torque, friction heat and hottest metal are those of conduction steps
    a fortieth as long (2 %, 4 K), however long a stable step is; what friction and plastic work gave is in the bodies."""
    random = np.random.default_rng([SEED, draw])
    sets = {"MATERIAL.CONDUCTIVITY": 10 ** random.uniform(0.5, 2), "TIME.MASS_SCALING": 1e6, "TIME.END": 0.2,
            "TOOL.FRICTION": random.uniform(0.2, 0.4), "MOTION(1).VELOCITY": "0,0,-5e-3", "SURFACE.COEFFICIENT": 0}
    found = {}
    for name, more in (("default", {}), ("fine", {"HEAT.TOLERANCE": 0.05})):
        (tmp_path / name).mkdir()
        found[name] = run("stir", "--quiet", sets=sets | more, directory=tmp_path / name).results("stir").history()
        history = found[name]
        content = history["heat_content[J]"]
        given = history["friction_heat_to_bodies[J]"] + 0.9 * history["plastic_work[J]"]
        assert content - content[0] == pytest.approx(given, abs=1e-4 * given[-1])
    for column, slack in (("tool_torque[Nm]", 0.02), ("friction_heat[J]", 0.02)):
        one, other = (found[name][column] for name in ("default", "fine"))
        print(column, np.abs(one - other).max() / np.abs(other).max())
        assert one == pytest.approx(other, abs=slack * np.abs(other).max())
    hot = [found[name]["temperature_max[K]"] for name in ("default", "fine")]
    print(sets, hot[0][-1], np.abs(hot[0] - hot[1]).max())
    assert hot[1][-1] > 400 and np.abs(hot[0] - hot[1]).max() < 4


@pytest.mark.parametrize("draw", range(8))
def test_exchange_is_bounded(run, draw):
    """Tools and films of any conductance, on hot and cold plates, with explicit and implicit steps: no metal is colder than all
    in the scene, none is hotter where nothing heats it, and heat is conserved."""
    random = np.random.default_rng([SEED, 10 + draw])
    start = random.choice([298.0, 700.0])
    sets = {"BODY.TEMPERATURE": start, "SURFACE.COEFFICIENT": 10 ** random.uniform(3, 12), "SURFACE.AMBIENT": 298.0,
            "MATERIAL.CONDUCTIVITY": 10 ** random.uniform(1, 2.6), "HEAT.FOURIER": random.uniform(0.05, 0.4),
            "TIME.MASS_SCALING": 1e6, "TOOL.HEATS": random.choice(["lumped", "rod"])}
    if draw % 2:
        sets["TOOL.FRICTION"] = 0.0
    if sets["TOOL.HEATS"] == "lumped":
        sets["TOOL.HEAT_CAPACITY"] = 10 ** random.uniform(-1, 4)
    else:
        sets |= {"TOOL.CONDUCTIVITY": 10 ** random.uniform(1, 3), "TOOL.DENSITY": 7800, "TOOL.SPECIFIC_HEAT": 460}
    if random.random() < 0.5:
        sets["TOOL.CONTACT_CONDUCTANCE"] = 10 ** random.uniform(4, 10)
    if draw == 4:
        sets |= {"HEAT.INTEGRATOR": "backward-euler", "HEAT.STEP": 0.02}
        del sets["HEAT.FOURIER"]
    history = run("stir", "--quiet", sets=sets).results("stir").history()
    coldest, hottest = history["temperature_min[K]"].min(), history["temperature_max[K]"].max()
    warms = history["friction_heat[J]"][-1] + history["plastic_work[J]"][-1]
    print(sets, coldest, hottest, warms)
    assert coldest > 298.0 - 0.02 * (hottest - 298.0) - 0.1
    if warms < 1.0:
        assert hottest < start + 1.0
    assert np.abs(history["conduction_error[%]"]).max() < 1e-9


@pytest.mark.parametrize("film", ["COEFFICIENT", "PRESSURE_FACTOR"])
def test_a_film_without_resistance_takes_no_time(run, film):
    """A film that conducts perfectly costs no more steps, and holds the face at the temperature outside."""
    sets = {f"SURFACE.{film}": 1e9, "BODY.TEMPERATURE": 500, "TIME.MASS_SCALING": 1e6}
    results = run("stir", "--quiet", sets=sets, timeout=60).results("stir")
    state = results.checkpoint()
    face = state.temp[state.x[:, 2] < 1.5e-3]
    print(film, face.min(), face.max())
    assert face.min() > 297.5
    if film == "COEFFICIENT":
        assert np.median(face) < 400


BAR = """&GRID CELL = 2e-3, LOWER = -6e-3, 0, 0, UPPER = 20e-3, 2e-3, 2e-3 /
&TIME END = {end}, MASS_SCALING = 1e9 /
&MATERIAL NAME = 'm', DENSITY = {density}, YOUNGS_MODULUS = 124e9, POISSON_RATIO = 0.34, SPECIFIC_HEAT = {heat}, CONDUCTIVITY = {k} /
&BODY NAME = 's', MATERIAL = 'm', TEMPERATURE = {hot} /
&SHAPE BODY = 's', LOWER = 0, 0, 0, UPPER = 12e-3, 2e-3, 2e-3 /
&HEAT AMBIENT = 300, INTEGRATOR = '{integrator}', TOLERANCE = {tolerance} /
&SURFACE BODY = 's', FACE = 'xmin', AMBIENT = {cold}, COEFFICIENT = {film} /
&WALL SIDE = 'ymin' /
&WALL SIDE = 'ymax' /
&WALL SIDE = 'zmin' /
&WALL SIDE = 'zmax' /
&PROBE NAME = 'mid', POSITION = 6e-3, 1e-3, 1e-3 /
&OUTPUT HISTORY_INTERVAL = {interval}, CHECKPOINT_INTERVAL = 1e3 /
"""


def bar(x, t, length, k, capacity, film):
    """Exact temperature over the first difference from the surroundings in a bar with a film at x = 0 [m] at t [s] (series)."""
    biot = film * length / k
    n = np.arange(200)
    low, high = n * np.pi + 1e-12, (n + 0.5) * np.pi - 1e-12
    for _ in range(80):                                     # roots of z tan z = Bi by bisection
        middle = 0.5 * (low + high)
        above = middle * np.tan(middle) > biot
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    z = 0.5 * (low + high)
    parts = 4 * np.sin(z) / (2 * z + np.sin(2 * z)) * np.exp(-(z**2) * k * t / capacity / length**2)
    return np.sum(parts * np.cos(z * (1 - x / length)))


@pytest.mark.parametrize("integrator", ["explicit", "backward-euler"])
@pytest.mark.parametrize("draw", range(2))
def test_rows_are_of_their_time(run, tmp_path, integrator, draw):
    """Exact: a bar that cools through a film. Probes of all rows, and the first particles at the end, are those of their
    time (1 % of the difference), with the program's own steps, which grow as the bar evens out."""
    random = np.random.default_rng([SEED, 30 + draw])
    values = {"density": random.uniform(2e3, 9e3), "heat": random.uniform(3e2, 1e3), "k": 10 ** random.uniform(1.2, 2.5),
              "hot": random.uniform(500, 1000), "cold": random.uniform(250, 350)}
    capacity = values["density"] * values["heat"]
    values["film"] = values["k"] / 12e-3 * 10 ** random.uniform(-1, 1)
    values["end"] = random.uniform(0.5, 2) * (12e-3) ** 2 * capacity / values["k"]
    values |= {"integrator": integrator, "tolerance": 0.5, "interval": values["end"] / 20}
    path = tmp_path / "bar.nml"
    path.write_text(BAR.format(**values))
    results = run(path, "--quiet").results("bar")
    probes, span = results.probes(), values["hot"] - values["cold"]
    exact = [bar(6e-3, t, 12e-3, values["k"], capacity, values["film"]) for t in probes["time[s]"][1:]]
    off = (probes["mid[K]"][1:] - values["cold"]) / span - exact
    state = results.checkpoint()
    first = state.temp[state.x[:, 0] < 1e-3] - values["cold"]
    wanted = span * bar(0.5e-3, values["end"], 12e-3, values["k"], capacity, values["film"])
    print(values, np.abs(off).max(), (first - wanted) / span)
    assert np.abs(off).max() < 0.01
    assert np.abs(first - wanted).max() < 0.01 * span
