# SPDX-License-Identifier: MIT
"""Backings that get hot behind a film, without particles: plates and bodies of one temperature."""

import re

import driver
import numpy as np
import pytest
from test_tool_heat import conserves, draw, effusivity, heat_through

BACKING = "column_zmin_backing"
CELL = 2.5e-4
PLATE = re.compile(r"BACKING = 'plate'.*?/", re.DOTALL)


def sets_of(metal, plate, hot, cold, depth=4.5e-3, cell=CELL, columns=1):
    """Temperatures of a column of these materials until the diffusion length sqrt(kappa t) is `depth`."""
    kappa = metal["CONDUCTIVITY"] / metal["DENSITY"] / metal["SPECIFIC_HEAT"]
    end = depth**2 / kappa
    sets = {f"MATERIAL.{key}": value for key, value in metal.items()}
    sets |= {f"SURFACE.BACKING_{key}": value for key, value in plate.items()}
    return sets | {"BODY.TEMPERATURE": hot, "SURFACE.BACKING_TEMPERATURE": cold, "TIME.END": end,
                   "TIME.DT": 0.1 * cell**2 / kappa, "OUTPUT.HISTORY_INTERVAL": end / 50, "OUTPUT.CHECKPOINT_INTERVAL": end,
                   "GRID.CELL": cell, "GRID.UPPER": f"{(columns + 4) * cell},{5 * cell},22e-3",
                   "SHAPE.UPPER": f"{columns * cell},{cell},20e-3"}


def lumped_scene(directory):
    """An input whose backing is of one temperature."""
    text = PLATE.sub("BACKING = 'lumped', BACKING_CAPACITY = 1 /", (driver.INPUTS / "backed_column.nml").read_text())
    path = directory / "column.nml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("seed, gap, integrator", [(1, 10.0, "explicit"), (2, 1.0, "explicit"), (3, 3.0, "explicit"),
                                                   (4, 0.2, "explicit"), (5, 1.0, "backward-euler")])
def test_two_half_spaces(run, seed, gap, integrator):
    """Metal and a plate without end: heat that went through the film within 1 % once it has gone nine cells deep. `gap` is
    the film over the conductance of a millimetre of metal."""
    metal, plate, hot, cold = draw(seed)
    film = gap * metal["CONDUCTIVITY"] / 1e-3
    sets = sets_of(metal, plate, hot, cold) | {"SURFACE.COEFFICIENT": film, "HEAT.INTEGRATOR": integrator}
    if integrator != "explicit":
        sets["HEAT.EVERY"] = 2
    history = run("backed_column", "--quiet", sets=sets).results("backed_column").history()
    conserves(history, BACKING)
    assert history["film_loss[J]"][-1] == pytest.approx(history[f"{BACKING}_heat_gained[J]"][-1], rel=1e-6)
    late = history["time[s]"] > 0.249 * history["time[s]"][-1]
    wanted = CELL**2 * np.array([heat_through(t, effusivity(metal), effusivity(plate), hot - cold, film)
                                 for t in history["time[s]"][late]])
    error = history[f"{BACKING}_heat_gained[J]"][late] / wanted - 1.0
    print(seed, gap, integrator, error[0], error[-1])
    assert np.abs(error).max() < 0.01


@pytest.mark.parametrize("entered", [1e-2, 1e-4, 1e-6])
def test_face_in_a_node_it_has_just_entered(run, entered):
    """A face that has come into the support of a node by this part of a cell gives it a conductance with its first power and
    a capacity with its second: conduction steps are as long as elsewhere, and the heat through the film within 1 %."""
    metal, plate, hot, cold = draw(1)
    film = 10.0 * metal["CONDUCTIVITY"] / 1e-3
    sets = sets_of(metal, plate, hot, cold) | {"SURFACE.COEFFICIENT": film, "SHAPE.LOWER": f"0,0,{-entered * CELL}",
                                               "SHAPE.UPPER": f"{CELL},{CELL},{20e-3 - entered * CELL}"}
    done = run("backed_column", "--quiet", sets=sets, timeout=60)
    history = done.results("backed_column").history()
    conserves(history, BACKING)
    wanted = CELL**2 * heat_through(history["time[s]"][-1], effusivity(metal), effusivity(plate), hot - cold, film)
    print(entered, done.seconds, history[f"{BACKING}_heat_gained[J]"][-1] / wanted - 1.0)
    assert history[f"{BACKING}_heat_gained[J]"][-1] == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("seed", [1, 2])
def test_plate_that_is_cooled(run, seed, tmp_path):
    """Steady: a wall at a temperature, metal, film, plate and its film to the surroundings in a row. Heat that the plate
    loses and the temperature of its face within 1 %, and columns side by side know nothing of each other."""
    random = np.random.default_rng(seed)
    metal, plate, hot, around = draw(20 + seed)
    length, thickness = 4e-3, random.uniform(1e-3, 5e-3)
    film, cooling = random.uniform(3e3, 3e4), random.uniform(1e3, 1e4)
    sets = sets_of(metal, plate, hot, around, depth=0.03, cell=5e-4, columns=3)
    sets |= {"SURFACE.COEFFICIENT": film, "SURFACE.BACKING_THICKNESS": thickness, "SURFACE.BACKING_COOLING": cooling,
             "HEAT.AMBIENT": around, "SHAPE.UPPER": f"{3 * 5e-4},5e-4,{length}", "HEAT.INTEGRATOR": "backward-euler",
             "HEAT.EVERY": 20}
    text = (driver.INPUTS / "backed_column.nml").read_text()
    path = tmp_path / "column.nml"
    path.write_text(text + f"&WALL SIDE = 'zmax', POSITION = {length}, TEMPERATURE = {hot} /\n")
    history = run(path, "--quiet", sets=sets).results("column").history()
    whole = 1 / (length / metal["CONDUCTIVITY"] + 1 / film + thickness / plate["CONDUCTIVITY"] + 1 / cooling)
    flux = whole * (hot - around)
    rows = slice(-10, None)
    found = np.polyfit(history["time[s]"][rows], history[f"{BACKING}_heat_lost[J]"][rows], 1)[0] / (3 * 5e-4 * 5e-4)
    face = around + flux * (thickness / plate["CONDUCTIVITY"] + 1 / cooling)
    print(seed, found / flux - 1, history[f"{BACKING}_temperature_max[K]"][-1] - face, hot - around)
    assert found == pytest.approx(flux, rel=0.01)
    assert history[f"{BACKING}_temperature_max[K]"][-1] == pytest.approx(face, abs=0.01 * (hot - around))


def test_columns_are_apart(run, tmp_path):
    """Two columns of metal, one hot and one as cold as the plate: only the hot one loses heat, as much as alone."""
    metal, plate, hot, cold = draw(7)
    sets = sets_of(metal, plate, hot, cold, depth=1.5e-3, cell=5e-4)
    lost = {}
    for name in ("alone", "beside"):
        (tmp_path / name).mkdir()
        text = (driver.INPUTS / "backed_column.nml").read_text()
        if name == "beside":
            text = text.replace("&HEAT ", f"&BODY NAME = 'cold', MATERIAL = 'metal', TEMPERATURE = {cold} /\n"
                                "&SHAPE BODY = 'cold', LOWER = 20e-4, 0, 0, UPPER = 25e-4, 5e-4, 20e-3 /\n"
                                "&SURFACE BODY = 'cold', FACE = 'zmin', COEFFICIENT = 5e3, BACKING = 'plate'\n"
                                "  BACKING_CONDUCTIVITY = 30, BACKING_DENSITY = 7800, BACKING_SPECIFIC_HEAT = 460 /\n&HEAT ")
        path = tmp_path / name / "column.nml"
        path.write_text(text)
        of_first = {key.replace("BODY.", "BODY(column)."): value for key, value in sets.items()
                    if key not in ("SHAPE.UPPER", "GRID.UPPER")}
        history = run(path, "--quiet", sets=of_first, directory=tmp_path / name).results("column").history()
        lost[name] = history[f"{BACKING}_heat_gained[J]"][-1]
        if name == "beside":
            assert abs(history["cold_zmin_backing_heat_gained[J]"][-1]) < 1e-9 * abs(lost[name])
    assert lost["beside"] == pytest.approx(lost["alone"], rel=1e-9)


@pytest.mark.parametrize("seed, integrator", [(1, "explicit"), (2, "backward-euler")])
def test_lumped(run, seed, integrator, tmp_path):
    """Of two bodies of one temperature each: heat against the exponential of their 2 x 2 matrix, 1 % of the difference."""
    random = np.random.default_rng(seed)
    cell, height = 5e-4, 2e-3
    metal, flow = 2700 * 900 * cell**2 * height, random.uniform(500, 3000) * cell**2
    capacity, cooling = random.uniform(0.5, 3.0) * metal, random.uniform(200, 2000) * cell**2
    hot, cold, around = random.uniform(500, 700), random.uniform(300, 400), random.uniform(280, 300)
    end, conductivity = 1.5 * metal / flow, 400 * flow / cell**2 * height
    sets = {"SHAPE.UPPER": f"{cell},{cell},{height}", "MATERIAL.CONDUCTIVITY": conductivity,
            "SURFACE.BACKING_CAPACITY": capacity, "SURFACE.COEFFICIENT": flow / cell**2,
            "SURFACE.BACKING_COOLING": cooling / cell**2, "SURFACE.BACKING_TEMPERATURE": cold, "HEAT.AMBIENT": around,
            "BODY.TEMPERATURE": hot, "TIME.END": end, "OUTPUT.HISTORY_INTERVAL": end / 20, "OUTPUT.CHECKPOINT_INTERVAL": end,
            "HEAT.INTEGRATOR": integrator, "TIME.DT": min(end / 400, 0.1 * cell**2 * 2.43e6 / conductivity)}
    if integrator == "backward-euler":
        sets |= {"TIME.DT": end / 800, "HEAT.EVERY": 2}
    history = run(lumped_scene(tmp_path), "--quiet", sets=sets).results("column").history()
    conserves(history, BACKING)
    rate = np.array([[-flow / metal, flow / metal], [flow / capacity, -(flow + cooling) / capacity]])
    values, vectors = np.linalg.eig(rate)
    start = np.linalg.solve(vectors, [hot - around, cold - around])
    wanted = around + np.array([(vectors[1] * np.exp(values * t) * start).sum() for t in history["time[s]"]])
    error = history[f"{BACKING}_temperature_max[K]"] - wanted
    print(seed, np.abs(error).max() / (hot - cold))
    assert np.abs(error).max() < 0.01 * (hot - cold)


def test_film_by_pressure(run, tmp_path):
    """A squeezed slab on a backing too large to get warm loses what it loses to the surroundings, with a film by pressure."""
    text = (driver.INPUTS / "squeezed_slab.nml").read_text()
    lost = {}
    for name, more in (("film", ""), ("backing", ", BACKING = 'lumped', BACKING_CAPACITY = 1e12")):
        (tmp_path / name).mkdir()
        path = tmp_path / name / "slab.nml"
        path.write_text(text.replace("PRESSURE_FACTOR = 100", "PRESSURE_FACTOR = 100" + more))
        lost[name] = run(path, "--quiet", sets={"TIME.END": 0.2}, directory=tmp_path / name).results("slab").history()
    there = lost["film"]["film_loss[J]"]
    assert there[-1] > 0.1
    assert np.abs(lost["backing"]["film_loss[J]"] - there).max() < 1e-6 * there[-1]


def test_goes_on_bitwise(run, tmp_path):
    """Exact: stopped and continued, backing and metal are those of the run in one piece; on three ranks to rounding."""
    metal, plate, hot, cold = draw(5)
    sets = sets_of(metal, plate, hot, cold, cell=5e-4, depth=2e-3, columns=4)
    found = {}
    for name, ranks in (("one", None), ("part", None), ("three", 3)):
        (tmp_path / name).mkdir()
        more = {"TIME.MAX_STEPS": 77} if name == "part" else {}
        found[name] = run("backed_column", "--quiet", sets=sets | more, ranks=ranks, directory=tmp_path / name)
    part = found["part"].results("backed_column")
    run("backed_column", "--quiet", "--restart", part.path("_checkpoint.h5"), sets=sets, directory=tmp_path / "part")
    one, three = (found[name].results("backed_column") for name in ("one", "three"))
    assert one.history().text == part.history().text
    assert driver.distance(one.checkpoint(), three.checkpoint(), ["temp"])["temp"] < 1e-9
    for name in (f"{BACKING}_temperature_max[K]", f"{BACKING}_heat_gained[J]"):
        assert three.history()[name] == pytest.approx(one.history()[name], rel=1e-9, abs=1e-12)


REFUSED = [({"SURFACE.EMISSIVITY": 0.5}, "does not go with BACKING"), ({"SURFACE.BACKING_COOLING": 10}, "no far side"),
           ({"SURFACE.BACKING_CAPACITY": 10}, "BACKING_CAPACITY"),
           ({"METHOD.MECHANICS": "F", "TIME.MASS_SCALING": 1}, "make the backing plate a &BODY")]


@pytest.mark.parametrize("sets, words", REFUSED)
def test_what_does_not_go_together_is_refused(run, sets, words):
    assert words in run("backed_column", "--check=scene", sets=sets, expect=driver.BAD_INPUT).err


SIDES = {"open": "LOWER = -1e-3, -1e-3, -2e-3, UPPER = 2e-3, 2e-3, 10e-3",
         "periodic": "LOWER = 0, 0, -2e-3, UPPER = 1e-3, 1e-3, 10e-3, PERIODIC = 'xy'"}
FACES = {"film": "COEFFICIENT = 5e3", "radiation": "COEFFICIENT = 0, EMISSIVITY = 0.9",
         "plate": "COEFFICIENT = 5e3, BACKING = 'plate', BACKING_CONDUCTIVITY = 30, BACKING_DENSITY = 7800,"
                  " BACKING_SPECIFIC_HEAT = 460",
         "lumped": "COEFFICIENT = 5e3, BACKING = 'lumped', BACKING_CAPACITY = 1"}


def square_column(directory, sides, face):
    """A column of two by two cells with this on its lower face."""
    text = (driver.INPUTS / "backed_column.nml").read_text()
    text = re.sub(r"&GRID.*?/", f"&GRID CELL = 5e-4, {SIDES[sides]} /", text)
    text = re.sub(r"&SURFACE.*?/", f"&SURFACE BODY = 'column', FACE = 'zmin', {face} /", text, flags=re.DOTALL)
    directory.mkdir()
    path = directory / "square.nml"
    path.write_text(text.replace("UPPER = 5e-4, 5e-4, 20e-3", "UPPER = 1e-3, 1e-3, 8e-3"))
    return path


@pytest.mark.parametrize("face", FACES)
def test_sides_make_no_difference(run, face, tmp_path):
    """A column loses the same heat on an open grid, on one whose period it is, and on two ranks."""
    found = []
    for sides in SIDES:
        path = square_column(tmp_path / sides, sides, FACES[face])
        for ranks in (1, 2):
            done = run(path, "--quiet", "--overwrite", ranks=ranks, directory=path.parent)
            found.append(done.results("square").history()["film_loss[J]"][-1])
    assert found[0] > 0.0
    assert found == pytest.approx([found[0]] * 4, rel=1e-9)


def test_source_across_a_periodic_side(run, tmp_path):
    """A source whose disc is cut by the sides of a periodic grid heats as one in its middle."""
    found = []
    for at in (0.0, 5e-4):
        path = square_column(tmp_path / str(at), "periodic", "COEFFICIENT = 0")
        source = f"&SOURCE POWER = 2, RADIUS = 4e-4, POSITION = {at}, {at}, 8e-3 /\n"
        path.write_text(path.read_text().replace("CONDUCTIVITY = 120 /", "CONDUCTIVITY = 120, T_MELT = 3000 /") + source)
        history = run(path, "--quiet", directory=path.parent).results("square").history()
        found += [history["temperature_max[K]"][-1]]
        assert history["source_heat[J]"][-1] == pytest.approx(2.0)
    assert found[1] == pytest.approx(found[0], rel=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_more_of_the_same_metal(run, tmp_path, seed):
    """BACKING = 'body' in one word, on four faces named in one, is more of the metal: heat into it as into a half space of the
    same metal within 1 % of it once it has gone nine cells deep, and none where it begins at the temperature of the body."""
    metal, _, hot, cold = draw(seed)
    text = PLATE.sub("BACKING = 'body' /", (driver.INPUTS / "backed_column.nml").read_text()).replace(", COEFFICIENT = 5e3", "")
    (tmp_path / "backed_column.nml").write_text(text)
    sets = sets_of(metal, {}, hot, cold)
    history = run("backed_column.nml", "--quiet", sets=sets).results("backed_column").history()
    conserves(history, BACKING)
    late = history["time[s]"] > 0.249 * history["time[s]"][-1]
    wanted = CELL**2 * np.array([heat_through(t, effusivity(metal), effusivity(metal), hot - cold, 1e12)
                                 for t in history["time[s]"][late]])
    error = history[f"{BACKING}_heat_gained[J]"][late] / wanted - 1.0
    print(seed, error[0], error[-1])
    assert np.abs(error).max() < 0.01
    del sets["SURFACE.BACKING_TEMPERATURE"]
    (tmp_path / "backed_column.nml").write_text(text.replace("FACE = 'zmin'", "FACE = 'sides'"))
    history = run("backed_column.nml", "--quiet", "--overwrite", sets=sets).results("backed_column").history()
    for face in ("xmin", "xmax", "ymin", "ymax"):
        assert np.abs(history[f"column_{face}_backing_heat_gained[J]"]).max() < 1e-9 * wanted[-1]
