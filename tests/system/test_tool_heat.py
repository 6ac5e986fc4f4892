# SPDX-License-Identifier: MIT
"""Where the heat of a tool goes: its share by effusivities, and tools that take heat and get hot."""

import math
import pathlib
import re
import sys

import driver
import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "verification"))

import exact


def erfcx(x):
    """exp(x^2) erfc(x), by its series for large x."""
    if x < 5.0:
        return math.exp(x * x) * math.erfc(x)
    return (1.0 - 0.5 / x**2 + 0.75 / x**4) / (x * math.sqrt(math.pi))


def heat_through(t, one, other, apart, gap):
    """Heat over area that two half spaces of effusivities `one` and `other`, `apart` [K] at first, have exchanged until t
    through a gap of this conductance: the flux is h dT exp(b^2 t) erfc(b sqrt t), b = h (1/one + 1/other)
    (Carslaw, Jaeger 1959, 2.10)."""
    if gap is None:
        return 2.0 * one * other / (one + other) * apart * math.sqrt(t / math.pi)
    b = gap * (1.0 / one + 1.0 / other)
    return gap * apart / b**2 * (erfcx(b * math.sqrt(t)) - 1.0 + 2.0 * b * math.sqrt(t / math.pi))


def draw(seed):
    """Metal, tool and temperatures: anything from steel to copper."""
    random = np.random.default_rng(seed)
    metal = {"CONDUCTIVITY": random.uniform(60, 390), "DENSITY": random.uniform(2600, 8900),
             "SPECIFIC_HEAT": random.uniform(390, 950)}
    tool = {"CONDUCTIVITY": random.uniform(15, 120), "DENSITY": random.uniform(7000, 15000),
            "SPECIFIC_HEAT": random.uniform(200, 500)}
    hot, cold = random.uniform(400, 900), random.uniform(290, 350)
    return metal, tool, hot, cold


def effusivity(material):
    return math.sqrt(math.prod(material.values()))


def column_sets(metal, tool, hot, cold, cell=2.5e-4, depth=4.5e-3):
    """Temperatures of a column of these materials until the diffusion length sqrt(kappa t) is `depth`."""
    kappa = metal["CONDUCTIVITY"] / metal["DENSITY"] / metal["SPECIFIC_HEAT"]
    end = depth**2 / kappa
    sets = {f"MATERIAL.{key}": value for key, value in metal.items()} | {f"TOOL.{key}": value for key, value in tool.items()}
    return sets | {"BODY.TEMPERATURE": hot, "TOOL.TEMPERATURE": cold, "TIME.END": end, "TIME.DT": 0.1 * cell**2 / kappa,
                   "OUTPUT.HISTORY_INTERVAL": end / 50, "OUTPUT.CHECKPOINT_INTERVAL": end, "GRID.CELL": cell,
                   "GRID.UPPER": f"{5 * cell},{5 * cell},22e-3", "SHAPE.UPPER": f"{cell},{cell},20e-3",
                   "TOOL.HEAT_AREA": cell**2}


def conserves(history, name="anvil"):
    """Nothing is lost on the way: what the metal loses the tool gains, and it holds that or gives it to its coolant."""
    gained = history[f"{name}_heat_gained[J]"]
    scale = np.abs(gained).max()
    content = history["heat_content[J]"]
    assert np.abs(content[0] - content - gained).max() < 1e-6 * scale + 1e-9 * content[0]  # printed digits
    held = history[f"{name}_heat_content[J]"]
    assert np.abs(held - held[0] + history[f"{name}_heat_lost[J]"] - gained).max() < 1e-6 * scale + 1e-9 * held[0]
    assert np.abs(history["conduction_error[%]"]).max() < 1e-8


@pytest.mark.parametrize("seed, gap", [(1, None), (2, None), (3, None), (1, 1.0), (2, 10.0), (4, 0.2)])
def test_two_half_spaces(run, seed, gap):
    """Metal and tool brought together, in perfect contact or with a gap: heat exchanged, and the temperature of the face,
    within 1 % (of heat, and of the difference) once heat has gone nine cells deep. `gap` is over that of a millimetre of metal."""
    metal, tool, hot, cold = draw(seed)
    sets = column_sets(metal, tool, hot, cold)
    conductance = None if gap is None else gap * metal["CONDUCTIVITY"] / 1e-3
    if conductance:
        sets["TOOL.CONTACT_CONDUCTANCE"] = conductance
    history = run("hot_column", "--quiet", sets=sets).results("hot_column").history()
    conserves(history)
    one, other = effusivity(metal), effusivity(tool)
    late = history["time[s]"] > 0.249 * history["time[s]"][-1]
    time = history["time[s]"][late]
    wanted = sets["TOOL.HEAT_AREA"] * np.array([heat_through(t, one, other, hot - cold, conductance) for t in time])
    error = history["anvil_heat_gained[J]"][late] / wanted - 1.0
    print(seed, gap, "heat", error[0], error[-1])
    assert np.abs(error).max() < 0.01
    if conductance is None:
        face = (one * hot + other * cold) / (one + other)
        apart = history["anvil_tool_face_temperature[K]"][late] - face
        print("face", np.abs(apart).max() / (hot - cold))
        assert np.abs(apart).max() < 0.01 * (hot - cold)


@pytest.mark.parametrize("heats", [False, True])
def test_share_by_effusivities(run, heats, tmp_path):
    """A plane that slides on a column, both at one temperature: metal and tool share the heat of friction as their
    effusivities. Exact as a share that is computed (1e-9), within 1 % where the tool takes what its temperature lets it."""
    metal, tool, _, _ = draw(11 if heats else 12)
    share = effusivity(metal) / (effusivity(metal) + effusivity(tool))
    sets = {f"MATERIAL.{key}": value for key, value in metal.items()} | {f"TOOL.{key}": value for key, value in tool.items()}
    if heats:
        sets |= {"TOOL.HEATS": "rod", "TOOL.TEMPERATURE": 300, "TOOL.HEAT_AREA": 2.5e-4**2, "TIME.END": 0.02}
    else:
        sets["TIME.END"] = 2e-3
    path = tmp_path / "sliding.nml"
    path.write_text((driver.ROOT / "tests/verification/inputs/heat_friction.nml").read_text().replace("HEAT_SHARE = 0.5", ""))
    done = run(path, sets=sets)
    history = done.results("sliding").history()
    heat = history["friction_heat[J]"][-1]
    if heats:
        assert history["friction_heat_to_bodies[J]"][-1] == pytest.approx(heat, rel=1e-9)  # from where the tool takes it
        found = 1.0 - history["plane_heat_gained[J]"][-1] / heat
        print(found, share)
        assert found == pytest.approx(share, abs=0.01)
    else:
        assert history["friction_heat_to_bodies[J]"][-1] / heat == pytest.approx(share, rel=1e-9)
        assert f"{100 * share:.4f}"[:5] in done.out


@pytest.mark.parametrize("seed, integrator", [(1, "explicit"), (2, "explicit"), (3, "backward-euler")])
def test_lumped_tool(run, seed, integrator, tmp_path):
    """A lumped tool that is cooled, on a thin hot plate behind a gap: of two bodies of one temperature each, temperature of
    the tool and heat that it gave away against the exponential of their 2 x 2 matrix, 1 % of the difference at first."""
    random = np.random.default_rng(seed)
    cell, height, capacity = 5e-4, 2e-3, random.uniform(0.5, 3.0) * 2.43e6 * 2.5e-7 * 2e-3
    gap, cooling = random.uniform(500, 3000), random.uniform(0.2, 2.0) * 1000 * cell**2
    hot, cold, coolant = random.uniform(500, 700), random.uniform(300, 400), random.uniform(280, 300)
    metal = 2700 * 900 * cell**2 * height
    end = 1.5 * metal / (gap * cell**2)
    sets = {"SHAPE.UPPER": f"{cell},{cell},{height}", "MATERIAL.CONDUCTIVITY": 100 * gap * height, "TOOL.HEATS": "lumped",
            "TOOL.HEAT_CAPACITY": capacity, "TOOL.CONTACT_CONDUCTANCE": gap, "TOOL.COOLING": cooling,
            "TOOL.COOLING_TEMPERATURE": coolant, "TOOL.TEMPERATURE": cold, "BODY.TEMPERATURE": hot, "TIME.END": end,
            "OUTPUT.HISTORY_INTERVAL": end / 20, "OUTPUT.CHECKPOINT_INTERVAL": end, "HEAT.INTEGRATOR": integrator,
            "TIME.DT": min(end / 400, 0.1 * cell**2 * 2.43e6 / (100 * gap * height))}
    if integrator == "backward-euler":
        sets |= {"TIME.DT": end / 800, "HEAT.EVERY": 2}
    path = tmp_path / "column.nml"
    text = (driver.INPUTS / "hot_column.nml").read_text()
    path.write_text(re.sub(r"HEAT_AREA = [0-9e.-]*,|CONDUCTIVITY = 30,.*SPECIFIC_HEAT = 460", "", text))
    history = run(path, "--quiet", sets=sets).results("column").history()
    conserves(history)
    flow = gap * cell**2
    rate = np.array([[-flow / metal, flow / metal], [flow / capacity, -(flow + cooling) / capacity]])
    values, vectors = np.linalg.eig(rate)
    start = np.linalg.solve(vectors, [hot - coolant, cold - coolant])
    exact_tool = coolant + np.array([(vectors[1] * np.exp(values * t) * start).sum() for t in history["time[s]"]])
    error = history["anvil_heat_content[J]"] / capacity - exact_tool
    print(seed, np.abs(error).max() / (hot - cold))
    assert np.abs(error).max() < 0.01 * (hot - cold)


def test_goes_on_bitwise(run, tmp_path):
    """Exact: stopped and continued, tool and metal are those of the run in one piece; on three ranks to rounding."""
    sets = column_sets(*draw(5)[:2], 600, 300, cell=5e-4, depth=2e-3)
    found = {}
    for name, ranks in (("one", None), ("part", None), ("three", 3)):
        (tmp_path / name).mkdir()
        more = {"TIME.MAX_STEPS": 77} if name == "part" else {}
        found[name] = run("hot_column", "--quiet", sets=sets | more, ranks=ranks, directory=tmp_path / name)
    part = found["part"].results("hot_column")
    run("hot_column", "--quiet", "--restart", part.path("_checkpoint.h5"), sets=sets, directory=tmp_path / "part")
    one = found["one"].results("hot_column")
    assert one.history().text == part.history().text
    three = found["three"].results("hot_column")
    assert driver.distance(one.checkpoint(), three.checkpoint(), ["temp"])["temp"] < 1e-9
    for name in ("anvil_tool_face_temperature[K]", "anvil_heat_gained[J]"):
        assert three.history()[name] == pytest.approx(one.history()[name], rel=1e-9, abs=1e-12)


def test_implicit_conduction_knows_the_tool(run, tmp_path):
    """Steps of backward Euler, a fifth of h^2/kappa long, give the heat of the explicit run within 1 %."""
    heat = {}
    for name, more in (("explicit", {}), ("implicit", {"HEAT.INTEGRATOR": "backward-euler", "HEAT.EVERY": 2})):
        (tmp_path / name).mkdir()
        sets = column_sets(*draw(6)[:2], 600, 300, cell=5e-4) | more
        history = run("hot_column", "--quiet", sets=sets, directory=tmp_path / name).results("hot_column").history()
        conserves(history)
        heat[name] = history["anvil_heat_gained[J]"][-1]
    print(heat)
    assert heat["implicit"] == pytest.approx(heat["explicit"], rel=0.01)


REFUSED = [({"TOOL.HEAT_SHARE": 0.5}, "does not go with HEATS"), ({"METHOD.SCHEME": "musl"}, "needs SCHEME = usl"),
           ({"MATERIAL.CONDUCTIVITY": 0}, "needs bodies that conduct"), ({"TOOL.COOLING": 1}, "needs a HEAT_LENGTH"),
           ({"TOOL.HEATS": "no", "TOOL.HEAT_SHARE": 0.5}, "has no effect with HEAT_SHARE")]


@pytest.mark.parametrize("sets, words", REFUSED)
def test_what_does_not_go_together_is_refused(run, sets, words):
    assert words in run("hot_column", "--check=scene", sets=sets, expect=driver.BAD_INPUT).err


@pytest.mark.parametrize("ranks, factor", [(None, 0.5), (2, 0.9)])
def test_friction_heat_goes_to_the_metal_that_resists(run, ranks, factor):
    """Exact: of metal under one face, half of it molten, the solid half gets all heat of friction (to 1e-6 of it), as the molten one
    has no strength; what goes into the bodies is what friction makes."""
    done = run("seam", "--quiet", ranks=ranks, sets={"TOOL.SHEAR_FACTOR": factor})
    assert "does not warm the metal without &HEAT" in done.out + done.err
    results = done.results("seam")
    state, history = results.checkpoint(), results.history()
    solid, molten = (state.heat[state.body == body].sum() for body in (1, 2))
    friction = history["friction_heat[J]"][-1]
    print(ranks, factor, solid, molten, friction)
    assert friction > 1.0 and solid == pytest.approx(friction, rel=1e-6)
    assert abs(molten) < 1e-6 * friction
    assert history["friction_heat_to_bodies[J]"][-1] == pytest.approx(friction, rel=1e-9)
