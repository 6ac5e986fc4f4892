# SPDX-License-Identifier: MIT
"""Heat through the gap between bodies in contact (&CONTACT CONDUCTANCE)."""

import driver
import numpy as np
import pytest
from test_surfaces import pressure_of
from test_tool_heat import draw, effusivity, heat_through

CELL = 2.5e-4


def pair(seed):
    """Two metals, whose diffusivities are at most a factor of two apart, and their temperatures."""
    upper, _, hot, cold = draw(seed)
    lower = draw(seed + 1000)[0]
    diffusivity = upper["CONDUCTIVITY"] / upper["DENSITY"] / upper["SPECIFIC_HEAT"] * np.random.default_rng(seed).uniform(0.5, 2)
    return upper, lower | {"CONDUCTIVITY": diffusivity * lower["DENSITY"] * lower["SPECIFIC_HEAT"]}, hot, cold


def end_of(upper, lower, depth):
    """When heat has gone `depth` deep in the slower of both metals."""
    return depth**2 / min(m["CONDUCTIVITY"] / m["DENSITY"] / m["SPECIFIC_HEAT"] for m in (upper, lower))


def sets_of(upper, lower, hot, cold, cell=CELL, depth=24 * CELL, shift=0.0):
    """Columns of these materials until heat has gone `depth` deep in the slower; they meet at `shift` over the grid's plane."""
    kappa = max(m["CONDUCTIVITY"] / m["DENSITY"] / m["SPECIFIC_HEAT"] for m in (upper, lower))
    end = end_of(upper, lower, depth)
    sets = {f"MATERIAL(upper).{key}": value for key, value in upper.items()}
    sets |= {f"MATERIAL(lower).{key}": value for key, value in lower.items()}
    return sets | {"BODY(hot).TEMPERATURE": hot, "BODY(cold).TEMPERATURE": cold, "TIME.END": end,
                   "TIME.DT": 0.2 * cell**2 / kappa, "OUTPUT.HISTORY_INTERVAL": end / 10, "OUTPUT.CHECKPOINT_INTERVAL": end,
                   "GRID.CELL": cell, "GRID.UPPER": f"{5 * cell},{5 * cell},22e-3",
                   "GRID.LOWER": f"{-4 * cell},{-4 * cell},{-22e-3 - shift * cell}",
                   "SHAPE(1).UPPER": f"{cell},{cell},20e-3", "SHAPE(2).UPPER": f"{cell},{cell},0"}


def heat_below(results, lower, cold):
    """Heat over area that has come into the lower column [J/m2]."""
    state = results.checkpoint()
    there = state.x[:, 2] < 0
    area = np.ptp(state.x[:, 0]) * 2 * np.ptp(state.x[:, 1]) * 2
    return (state.mass[there] * lower["SPECIFIC_HEAT"] * (state.temp[there] - cold)).sum() / area


def through_gap(run, metals, gap, sets):
    """Heat that has come through a gap of this conductance over 1 mm of the upper metal, over the exact one; nothing is lost."""
    upper, lower, hot, cold = metals
    conductance = gap * upper["CONDUCTIVITY"] / 1e-3
    results = run("two_columns", "--quiet", sets=sets | {"CONTACT.CONDUCTANCE": conductance}).results("two_columns")
    content = results.history()["heat_content[J]"]
    assert np.ptp(content) < 1e-9 * content[0]
    wanted = heat_through(sets["TIME.END"], effusivity(upper), effusivity(lower), hot - cold, conductance)
    return heat_below(results, lower, cold) / wanted


CASES = [(1, 10.0, 0.0, "explicit"), (2, 1.0, 0.3, "explicit"), (3, 0.2, 0.5, "explicit"), (4, 3.0, 0.7, "explicit"),
         (5, 1.0, 0.2, "backward-euler")]


@pytest.mark.parametrize("seed, gap, shift, integrator", CASES)
def test_two_half_spaces(run, seed, gap, shift, integrator):
    """Two columns brought together wherever the grid is: heat that went through the gap within 1 % once it has gone
    24 cells deep, nothing lost."""
    sets = sets_of(*pair(seed), shift=shift) | {"HEAT.INTEGRATOR": integrator}
    if integrator != "explicit":
        sets["HEAT.EVERY"] = 5
    found = through_gap(run, pair(seed), gap, sets)
    print(seed, gap, shift, integrator, found - 1)
    assert found == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize("seed, rigid, ranks", [(1, False, None), (2, True, None), (3, False, 2)])
def test_friction_heat_is_shared(run, tmp_path, seed, rigid, ranks):
    """Exact: of a block that slides on a slab, behind a gap that hardly conducts, both get the heat of friction as their
    effusivities, to 1e-6 of it."""
    upper, lower, _, _ = pair(40 + seed)
    text = (driver.INPUTS / "blocks.nml").read_text().replace("&BODY NAME = 'slab', MATERIAL = 'plastic'", "&BODY NAME = 'slab', MATERIAL = 'lower'")
    path = tmp_path / "sliding.nml"
    path.write_text(text + "&MATERIAL NAME = 'lower', DENSITY = 1000, YOUNGS_MODULUS = 2.5e9, POISSON_RATIO = 0.33 /\n&HEAT AMBIENT = 300 /\n")
    sets = {f"MATERIAL({name}).{key}": metal[key] for name, metal in (("plastic", upper), ("lower", lower)) for key in metal}
    sets |= {"BODY.TEMPERATURE": 300, "BODY(slab).RIGID": rigid, "CONTACT.CONDUCTANCE": 1e-6, "TIME.END": 2e-3, "OUTPUT.CHECKPOINT_INTERVAL": 2e-3}
    results = run(path, "--quiet", sets=sets, ranks=ranks).results("sliding")
    state, friction = results.checkpoint(), results.history()["friction_heat[J]"][-1]
    got = [(state.mass * metal["SPECIFIC_HEAT"] * (state.temp - 300) + state.heat)[state.body == body].sum()
           for body, metal in ((1, upper), (2, lower))]
    share = effusivity(upper) / (effusivity(upper) + effusivity(lower))
    print(seed, rigid, ranks, friction, got, share)
    assert friction > 1e-3
    assert got == pytest.approx([share * friction, (1 - share) * friction], rel=1e-6)


@pytest.mark.parametrize("seed, integrator", [(1, "explicit"), (2, "explicit"), (3, "backward-euler")])
def test_steady(run, seed, integrator, tmp_path):
    """Two bars between walls at temperatures: of 16 cells each: the heat through both within 1 %, and temperatures but for the particles
    next to gap and walls within 1 % of the difference."""
    random = np.random.default_rng(seed)
    upper, lower, hot, cold = pair(30 + seed)
    conductance, length = random.uniform(3e3, 5e4), 4e-3
    text = (driver.INPUTS / "two_columns.nml").read_text()
    path = tmp_path / "bars.nml"
    path.write_text(text + f"&WALL SIDE = 'zmax', POSITION = {length}, TEMPERATURE = {hot} /\n"
                    f"&WALL SIDE = 'zmin', POSITION = {-length}, TEMPERATURE = {cold} /\n")
    sets = sets_of(upper, lower, hot, cold, depth=8e-3)
    sets |= {"SHAPE(1).UPPER": f"{CELL},{CELL},{length}", "SHAPE(2).LOWER": f"0,0,{-length}", "CONTACT.CONDUCTANCE": conductance,
             "HEAT.INTEGRATOR": integrator}
    if integrator != "explicit":
        sets["HEAT.EVERY"] = 10
    state = run(path, "--quiet", sets=sets).results("bars").checkpoint()
    flux = (hot - cold) / (length / upper["CONDUCTIVITY"] + 1 / conductance + length / lower["CONDUCTIVITY"])
    z = state.x[:, 2]
    wanted = np.where(z > 0, hot - flux * (length - z) / upper["CONDUCTIVITY"],
                      cold + flux * (z + length) / lower["CONDUCTIVITY"])
    error = np.abs(state.temp - wanted)[(np.abs(z) > 5e-4) & (np.abs(z) < length - 5e-4)].max() / (hot - cold)
    found = [material["CONDUCTIVITY"] * np.polyfit(z[there], state.temp[there], 1)[0]
             for material, there in ((upper, (z > 1e-3) & (z < length - 1e-3)), (lower, (z < -1e-3) & (z > 1e-3 - length)))]
    print(seed, integrator, error, np.array(found) / flux - 1)
    assert error < 0.01
    assert found == pytest.approx([flux, flux], rel=0.01)


def test_ends(run):
    """No conductance: nothing passes. A very large one: as in perfect contact, to 1 % of the heat."""
    upper, lower, hot, cold = pair(6)
    found = {}
    for name, conductance in (("none", 0), ("large", 1e9)):
        sets = {"CONTACT.CONDUCTANCE": conductance, "HEAT.INTEGRATOR": "backward-euler", "HEAT.EVERY": 5}
        results = run("two_columns", "--quiet", sets=sets_of(upper, lower, hot, cold) | sets)
        found[name] = heat_below(results.results("two_columns"), lower, cold)
    wanted = heat_through(end_of(upper, lower, 24 * CELL), effusivity(upper), effusivity(lower), hot - cold, None)
    print(found, wanted)
    assert abs(found["none"]) < 1e-9 * wanted
    assert found["large"] == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("seed", [1, 2])
def test_by_pressure(run, seed, tmp_path):
    """Squeezed between walls: the conductance of the table at that pressure, within 1 % of the heat."""
    random = np.random.default_rng(seed)
    upper, lower, hot, cold = pair(40 + seed)
    young, stretch = random.uniform(4e10, 2e11), 1 - random.uniform(3e-4, 1.5e-3)
    pressures = np.cumsum(random.uniform(1e7, 8e7, 5))
    there = np.cumsum(random.uniform(2e3, 3e4, 5))
    conductance = float(np.interp(pressure_of(stretch, young, 0.0), pressures, there))
    text = (driver.INPUTS / "two_columns.nml").read_text()
    table = ",".join(f"{p},{h}" for p, h in zip(pressures, there, strict=True))
    text = text.replace("CONDUCTANCE = 5e3", f"CONDUCTANCE_TABLE = {table}")
    walls = "".join(f"&WALL SIDE = '{side}', POSITION = {place} /\n" for side, place in (
        ("xmin", 0), ("xmax", CELL), ("ymin", 0), ("ymax", CELL), ("zmin", -20e-3 * stretch), ("zmax", 20e-3 * stretch)))
    path = tmp_path / "squeezed.nml"
    path.write_text(text + walls)
    sets = sets_of(upper, lower, hot, cold) | {"MATERIAL.YOUNGS_MODULUS": young,
                                               "BODY.DEFORMATION": f"1,0,0,0,1,0,0,0,{stretch}"}
    results = run(path, "--quiet", sets=sets).results("squeezed")
    found = heat_below(results, lower, cold)
    wanted = heat_through(sets["TIME.END"], effusivity(upper), effusivity(lower), hot - cold, conductance)
    print(seed, conductance, found / wanted - 1)
    assert found == pytest.approx(wanted, rel=0.01)


def test_bodies_apart_do_not_conduct(run):
    """A fifth of a cell between the columns: they share nodes, and no heat."""
    upper, lower, hot, cold = pair(8)
    sets = sets_of(upper, lower, hot, cold, cell=5e-4, depth=1e-3)
    sets |= {"SHAPE(2).UPPER": "5e-4,5e-4,-1e-4", "SHAPE(2).LOWER": "0,0,-20.1e-3"}
    state = run("two_columns", "--quiet", sets=sets).results("two_columns").checkpoint()
    assert np.abs(state.temp[state.x[:, 2] < 0] - cold).max() < 1e-9


def test_goes_on_bitwise(run, tmp_path):
    """Exact: stopped and continued as in one piece; on three ranks to rounding."""
    upper, lower, hot, cold = pair(5)
    sets = sets_of(upper, lower, hot, cold, cell=5e-4, depth=2e-3, shift=0.4)
    found = {}
    for name, ranks in (("one", None), ("part", None), ("three", 3)):
        (tmp_path / name).mkdir()
        more = {"TIME.MAX_STEPS": 57} if name == "part" else {}
        found[name] = run("two_columns", "--quiet", sets=sets | more, ranks=ranks, directory=tmp_path / name)
    part = found["part"].results("two_columns")
    run("two_columns", "--quiet", "--restart", part.path("_checkpoint.h5"), sets=sets, directory=tmp_path / "part")
    one, three = (found[name].results("two_columns") for name in ("one", "three"))
    assert one.history().text == part.history().text
    assert driver.distance(one.checkpoint(), three.checkpoint(), ["temp"])["temp"] < 1e-9


THIRD = """&BODY NAME = 'third', MATERIAL = 'lower', TEMPERATURE = 300 /
&SHAPE BODY = 'third', LOWER = 1e-3, 0, 0, UPPER = 15e-4, 5e-4, 5e-3 /
"""
REFUSED = [("", {"MATERIAL(lower).CONDUCTIVITY": 0}, "needs bodies that conduct"),
           ("", {"CONTACT.CONDUCTANCE_TABLE": "0,1,1e6,2"}, "give one of them"),
           (THIRD, {}, "both bodies conduct perfectly to a third")]


@pytest.mark.parametrize("more, sets, words", REFUSED)
def test_what_does_not_go_together_is_refused(run, tmp_path, more, sets, words):
    path = tmp_path / "columns.nml"
    path.write_text((driver.INPUTS / "two_columns.nml").read_text() + more)
    assert words in run(path, "--check=scene", sets=sets, expect=driver.BAD_INPUT).err
