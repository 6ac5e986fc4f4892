# SPDX-License-Identifier: MIT
"""Walls as mirrors: order of convergence at them, their forces, their heat."""

import math

import driver
import numpy as np
import pytest

LENGTH = 64e-3  # of the bars between two walls [m]
SPEED = 1e3  # sqrt(E/rho) of their plastic [m/s]
DIFFUSIVITY = 391.0 / (8960.0 * 386.0)  # of their copper [m2/s]
CORNER = (driver.INPUTS / "wall_corner.nml").read_text()


def narrow(cells):
    """Keys of a bar of so many cells that is one cell wide."""
    h = LENGTH / cells
    box = f"{LENGTH},{h},{h}"
    return {"GRID.CELL": h, "GRID.UPPER": box, "SHAPE.UPPER": box}


def go_on(name, directory, sets, end, dt=0.0, **fields):
    """Start a scene, give its particles fields by their place, run it to `end`: states before and after."""
    directory.mkdir()
    results = driver.run(name, "--quiet", directory=directory, sets=sets).results(name)
    path = results.path("_checkpoint.h5")
    driver.rewrite_checkpoint(path, **fields)
    before = results.checkpoint()
    sets = {**sets, "TIME.END": end, "TIME.DT": dt, "OUTPUT.CHECKPOINT_INTERVAL": end}
    driver.run(name, "--quiet", "--restart", path, directory=directory, sets=sets)
    return before, results.checkpoint()


def orders(errors):
    """Observed orders of columns of errors, whose rows belong to cells halved each time."""
    errors = np.array(errors)
    found = np.log2(errors[:-1] / errors[1:])
    print("rms and largest error:", errors.tolist(), "orders:", found.tolist())
    return found


def wave_errors(directory, cells, **method):
    """Errors (rms, largest) of the displacement over its amplitude, after 9/8 periods of the first mode."""
    omega, top = math.pi * SPEED / LENGTH, 1e-2
    end = 1.125 * 2.0 * math.pi / omega

    def velocity(x):
        v = np.zeros_like(x)
        v[:, 0] = top * np.sin(math.pi * x[:, 0] / LENGTH)
        return v

    sets = {**narrow(cells), **{f"METHOD.{key}": value for key, value in method.items()}}
    before, after = go_on("wall_wave", directory / str(cells), sets, end, v=velocity)
    exact = top / omega * np.sin(math.pi * before.x[:, 0] / LENGTH) * math.sin(omega * end)
    error = (after.x[:, 0] - before.x[:, 0] - exact) / (top / omega)
    assert np.abs(after.v[:, 1:]).max() < 1e-9 * top   # nothing moves sideways
    return np.sqrt(np.mean(error**2)), np.abs(error).max()


@pytest.mark.parametrize(
    "shape, transfer",
    [("ugimp", "flip"), ("bspline", "flip"), ("bspline", "apic"), ("ugimp", "xpic"), ("bspline", "fmpm")],
)
def test_standing_wave_between_walls(tmp_path, shape, transfer):
    """Exact: u = V/w sin(pi x/L) sin(w t), w = pi c/L, between walls (one fixed, one sliding), L = 64 mm,
    V/c = 1e-5: rms and largest displacement error after 9/8 periods fall with order 2 (above 1.8) from 16 to
    32 to 64 cells."""
    errors = [wave_errors(tmp_path, n, SHAPE=shape, TRANSFER=transfer) for n in (16, 32, 64)]
    assert orders(errors).min() > 1.8
    assert errors[-1][1] < 5e-3


def heat_errors(directory, cells, shape):
    """Errors (rms, largest) of the temperature of a sine mode between fixed ends, over its amplitude when it
    has decayed by half; conduction in every step."""
    decay = DIFFUSIVITY * (math.pi / LENGTH) ** 2
    end = math.log(2.0) / decay
    dt = end / math.ceil(end / (0.135 * (LENGTH / cells) ** 2 / DIFFUSIVITY))
    before, after = go_on("wall_heat", directory / str(cells), {**narrow(cells), "METHOD.SHAPE": shape}, end, dt,
                          temp=lambda x: 300.0 + 100.0 * np.sin(math.pi * x[:, 0] / LENGTH))
    error = (after.temp - 300.0 - 50.0 * np.sin(math.pi * before.x[:, 0] / LENGTH)) / 50.0
    near = np.minimum(before.x[:, 0], LENGTH - before.x[:, 0]) < 2.0 * LENGTH / cells
    return np.sqrt(np.mean(error**2)), np.abs(error).max(), np.abs(error[near]).max()


@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
def test_heat_mode_between_walls(tmp_path, shape):
    """Exact: T = 300 K + 100 K sin(pi x/L) exp(-kappa (pi/L)^2 t) between walls of 300 K: rms and largest error,
    also of the two cells at the walls, fall with order 2 (above 1.8) from 16 to 32 to 64 cells; with 64 the
    largest is below 1e-3 of the amplitude left."""
    errors = [heat_errors(tmp_path, n, shape) for n in (16, 32, 64)]
    assert orders(errors).min() > 1.8
    assert errors[-1][1] < 1e-3


@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
def test_steady_heat_between_walls(run, shape):
    """Exact: between walls of 300 and 400 K every particle, also the outermost, ends at 300 K + 100 K x/L, to
    1e-6 K, whatever it began with; the wall gave the heat that the bar gained [J]."""
    sets = {**narrow(8), "METHOD.SHAPE": shape, "WALL(2).TEMPERATURE": 400.0, "TIME.END": 80.0,
            "OUTPUT.CHECKPOINT_INTERVAL": 80.0, "TIME.DT": 0.135 * (LENGTH / 8) ** 2 / DIFFUSIVITY}
    results = run("wall_heat", "--quiet", sets=sets).results("wall_heat")
    state = results.checkpoint()
    assert np.abs(state.temp - 300.0 - 100.0 * state.x[:, 0] / LENGTH).max() < 1e-6
    history = results.history()
    gained = history["heat_content[J]"] - history["heat_content[J]"][0]
    assert gained[-1] > 100.0
    assert history["wall_heat[J]"] == pytest.approx(gained, abs=1e-9 * history["heat_content[J]"][0])


@pytest.mark.parametrize("place", [0.0, 1e-3])
@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
def test_weight_of_a_column(run, shape, place):
    """Exact: a column of 8 mm at rest under 4000 m/s2 presses on the wall below it with its weight of
    0.128 N, to 1e-6, also where the wall lies between two planes of nodes and these are held."""
    sets = {"SHAPE.UPPER": "8e-3,2e-3,2e-3", "TIME.GRAVITY": "-4e3,0,0", "TIME.END": 2.4e-3,
            "METHOD.PIC_FRACTION": 0.5, "METHOD.SHAPE": shape, "WALL(1).POSITION": place}
    history = run("wall_bar", "--quiet", sets=sets).results("wall_bar").history()
    print(history["wall_xmin_force_x[N]"][-5:])
    assert history["wall_xmin_force_x[N]"][-5:] == pytest.approx(0.128, rel=1e-6)
    assert np.abs(history["wall_xmin_force_y[N]"]).max() < 1e-9


@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
def test_force_of_an_impact(run, shape):
    """Exact: a bar that flies at 1 m/s into a wall presses on it with rho c A v = 4 N for 2L/c = 0.1 ms: the
    mean of the plateau to 0.5 %, no row of it off by more than 10 %; a wall at rest does no work."""
    sets = {"BODY.VELOCITY": "-1,0,0", "TIME.END": 1e-4, "METHOD.SHAPE": shape}
    history = run("wall_bar", "--quiet", sets=sets).results("wall_bar").history()
    t, force = history["time[s]"], history["wall_xmin_force_x[N]"]
    middle = force[(t > 2e-5) & (t < 8e-5)]
    print(shape, middle.mean(), middle.min(), middle.max())
    assert middle.mean() == pytest.approx(4.0, rel=5e-3)
    assert np.abs(middle - 4.0).max() < 0.4
    assert np.abs(history["wall_work[J]"]).max() == 0.0


WALLS = ["wall_xmin", "wall_ymin", "wall_zmin"]


@pytest.mark.parametrize("kind", ["fixed", "sliding"])
@pytest.mark.parametrize("shape, scheme", [("ugimp", "usl"), ("bspline", "usl"), ("bspline", "usavg")])
def test_impulses_of_a_corner(run, tmp_path, kind, shape, scheme):
    """Exact: momentum of the block [N s] = its weight times the time + impulses of three walls and a clamp, in
    every direction, to the digits of the history; the walls' heat is what the block gained less 0.9 of the
    plastic work; the heat of friction and films is none."""
    text = CORNER.replace("'fixed'", f"'{kind}'").replace("&HEAT", """
        &CLAMP LOWER = 1e-3, 3e-3, 3e-3, UPPER = 1e-3, 3e-3, 3e-3, VELOCITY = -3, 2, 1, COMPONENTS = 'xz' /
        &CLAMP LOWER = 1e-3, 0, 1e-3, UPPER = 1e-3, 0, 1e-3, VELOCITY = 2, 0, 0, COMPONENTS = 'x' / &HEAT""")
    (tmp_path / "corner.nml").write_text(text)
    sets = {"METHOD.SHAPE": shape, "METHOD.SCHEME": scheme}
    results = run("corner.nml", "--quiet", sets=sets).results("corner")
    state, history = results.checkpoint(), results.history()
    momentum = state.mass @ state.v
    weight = -1.5e7 * state.mass.sum() * state.time
    names = WALLS + ["clamp1", "clamp2"]
    impulse = np.array([[history.impulse(f"{wall}_force_{axis}[N]") for axis in "xyz"] for wall in names])
    print(impulse, momentum, weight)
    assert np.abs(impulse[[0, 1, 2], [0, 1, 2]]).min() > 0.1 * abs(weight)
    assert np.abs(impulse[3, [0, 2]]).min() > 1e-3 * abs(weight) and impulse[3, 1] == 0.0
    assert impulse.sum(axis=0) + weight == pytest.approx(momentum, abs=1e-8 * abs(weight))
    last = history.rows[-1]
    heat = last[history.names.index("heat_content[J]")]
    gained = heat - history["heat_content[J]"][0]
    given = history["wall_heat[J]"][-1] + 0.9 * history["plastic_work[J]"][-1]
    print("heat", gained, given, history["plastic_work[J]"][-1])
    assert history["plastic_work[J]"][-1] > 0.01 and history["wall_heat[J]"][-1] < -1.0
    assert gained == pytest.approx(given, abs=1e-8 * heat)


def test_corner_has_no_first_axis(run):
    """Exact: the block in the corner of three equal walls under a force along the diagonal is the same after
    the axes are exchanged in turn: places [m], velocities [m/s] and temperatures [K] to 1e-9."""
    state = run("wall_corner", "--quiet", sets={"METHOD.SHAPE": "bspline"}).results("wall_corner").checkpoint()
    n = round(len(state.number) ** (1.0 / 3.0))
    start = np.round(state.x / 0.5e-3 - 0.5).astype(int)   # the block has moved by less than half a spacing
    order = np.lexsort(start.T[::-1])
    turned = np.lexsort(start[:, [1, 2, 0]].T[::-1])
    assert n**3 == len(state.number) == 512 and len(np.unique(start, axis=0)) == 512
    assert np.abs(state.v).max() > 1.0 and state.plastic.max() > 1e-3
    for name in ("x", "v"):
        one, two = getattr(state, name)[order], getattr(state, name)[turned][:, [1, 2, 0]]
        assert np.abs(one - two).max() <= 1e-9 * np.abs(one).max(), name
    assert np.abs(state.temp[order] - state.temp[turned]).max() <= 1e-9 * 400.0


@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
def test_octant_is_an_eighth_of_the_whole(run, tmp_path, shape):
    """Exact: a block that stretches about its centre, yields and is hot inside is the same as its octant in
    the corner of three sliding, insulated walls: places, velocities, temperatures, stresses to 1e-9."""
    text = CORNER.replace("'fixed', TEMPERATURE = 300", "'sliding'").replace("GRAVITY = -1.5e7, -1.5e7, -1.5e7", "")
    text = text.replace("LOWER = -3e-3, -3e-3, -3e-3", "LOWER = -6e-3, -6e-3, -6e-3").replace(
        "TEMPERATURE = 400", "TEMPERATURE = 400, VELOCITY_GRADIENT = 9e3, 0, 0, 0, -5e3, 0, 0, 0, -6e3")
    (tmp_path / "octant.nml").write_text(text)
    lines = [line for line in text.splitlines() if not line.startswith("&WALL")]
    (tmp_path / "whole.nml").write_text("\n".join(lines).replace("LOWER = 0, 0, 0", "LOWER = -4e-3, -4e-3, -4e-3"))
    sets = {"METHOD.SHAPE": shape}
    whole = run("whole.nml", "--quiet", sets=sets).results("whole").checkpoint()
    octant = run("octant.nml", "--quiet", sets=sets).results("octant").checkpoint()
    mine = np.all(whole.x > 0.0, axis=1)
    assert len(octant.number) == mine.sum() == 512 and octant.plastic.max() > 1e-3
    places = [np.lexsort(np.round(x / 1e-6).T) for x in (whole.x[mine], octant.x)]
    for name in ("x", "v", "temp", "tau", "plastic"):
        one, two = getattr(whole, name)[mine][places[0]], getattr(octant, name)[places[1]]
        assert np.abs(one - two).max() <= 1e-9 * np.abs(one).max(), name


@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
def test_half_of_a_punched_block(run, tmp_path, shape):
    """Exact: half a block that falls onto a plane with friction, cut by a sliding wall, does as the whole
    while it is pressed (when it separates, rounding decides which particle goes first), in equal steps (their
    length follows the nodes that carry enough metal, and a node on a wall carries half): places [m], velocities
    [m/s] and stresses [Pa] to 1e-9, half the force on the plane."""
    text = (driver.INPUTS / "punch.nml").read_text()
    half = text.replace("LOWER = 0, 0, 4e-3", "LOWER = 4e-3, 0, 4e-3")
    (tmp_path / "half.nml").write_text(half + "&WALL SIDE = 'xmin', POSITION = 4e-3 /\n")
    sets = {"METHOD.SHAPE": shape, "TIME.END": 2.1e-4, "TIME.DT": 9e-7, "OUTPUT.CHECKPOINT_INTERVAL": 2.1e-4}
    whole = run("punch", "--quiet", sets=sets).results("punch")
    half = run("half.nml", "--quiet", sets=sets).results("half")
    one, two = whole.checkpoint(), half.checkpoint()
    mine = one.x[:, 0] > 4e-3
    assert mine.sum() == len(two.number) == 256
    places = [np.lexsort(np.round(x / 1e-7).T) for x in (one.x[mine], two.x)]
    for name in ("x", "v", "tau"):
        a, b = getattr(one, name)[mine][places[0]], getattr(two, name)[places[1]]
        assert np.abs(a - b).max() <= 1e-9 * np.abs(a).max(), name
    force = [h.history()["punch_force_z[N]"] for h in (whole, half)]
    assert np.abs(force[0]).max() > 10.0
    assert force[1] == pytest.approx(0.5 * force[0], abs=1e-8 * np.abs(force[0]).max())


@pytest.mark.parametrize("shape, transfer", [("ugimp", "flip"), ("bspline", "flip"), ("bspline", "fmpm")])
def test_walls_do_not_depend_on_the_number_of_ranks(run, tmp_path_factory, shape, transfer):
    """Exact: 200 steps of the block in the corner, cut anew every 5 steps close to the walls, are the same on
    1, 2, 4 and 8 ranks to 1e-10; forces and heat of the walls to 1e-8 of their largest."""
    sets = {"METHOD.SHAPE": shape, "METHOD.TRANSFER": transfer, "METHOD.SORT_INTERVAL": 5,
            "METHOD.REBALANCE": 1.0}
    one = run("wall_corner", "--quiet", sets=sets).results("wall_corner")
    assert one.checkpoint().step == 200 and one.checkpoint().plastic.max() > 1e-3
    for ranks in (2, 4, 8):
        many = run("wall_corner", "--quiet", sets=sets, ranks=ranks,
                   directory=tmp_path_factory.mktemp("ranks")).results("wall_corner")
        apart = driver.distance(one.checkpoint(), many.checkpoint(), ["x", "v", "temp", "tau", "plastic"])
        print(ranks, apart)
        assert max(apart.values()) <= 1e-10
        a, b = one.history(), many.history()
        for name in a.names:
            if name.startswith("wall_"):
                assert b[name] == pytest.approx(a[name], abs=1e-8 * max(1e-12, np.abs(a[name]).max())), name


@pytest.mark.parametrize("shape", ["ugimp", "bspline"])
def test_walls_along_a_periodic_axis(run, tmp_path, shape):
    """Exact: a bar in the corner of two walls, periodic along y, is the same on 1 and 4 ranks to 1e-10, and its
    momentum [N s] = weight times time + impulses of the walls, in every direction, to the digits of the history."""
    text = "\n".join(line for line in CORNER.splitlines() if "ymin" not in line)
    text = text.replace("LOWER = -3e-3, -3e-3, -3e-3, UPPER = 6e-3, 6e-3",
                        "PERIODIC = 'y', LOWER = -3e-3, 0, -3e-3, UPPER = 6e-3, 5e-3")
    (tmp_path / "bar.nml").write_text(text.replace("UPPER = 4e-3, 4e-3, 4e-3", "UPPER = 4e-3, 5e-3, 4e-3"))
    sets = {"METHOD.SHAPE": shape, "METHOD.SORT_INTERVAL": 5, "METHOD.REBALANCE": 1.0}
    one = run("bar.nml", "--quiet", sets=sets).results("bar").checkpoint()
    results = run("bar.nml", "--quiet", sets=sets, ranks=4).results("bar")
    many, history = results.checkpoint(), results.history()
    assert one.step == many.step == 200 and many.plastic.max() > 1e-3
    assert max(driver.distance(one, many, ["x", "v", "temp", "tau", "plastic"]).values()) <= 1e-10
    impulse = sum(np.array([history.impulse(f"{wall}_force_{axis}[N]") for axis in "xyz"])
                  for wall in ("wall_xmin", "wall_zmin"))
    weight = -1.5e7 * many.mass.sum() * many.time
    assert impulse + weight == pytest.approx(many.mass @ many.v, abs=1e-8 * abs(weight))


def test_walls_of_a_continued_run(run, tmp_path_factory):
    """Exact: 105 steps, then 95 more from the checkpoint: the same particles as after 200, bit for bit, and
    the same history, with forces and heat of the walls."""
    whole = run("wall_corner", "--quiet").results("wall_corner")
    directory = tmp_path_factory.mktemp("continued")
    part = run("wall_corner", "--quiet", directory=directory, sets={
        "TIME.MAX_STEPS": 105, "OUTPUT.CHECKPOINT_INTERVAL": 7.35e-6}).results("wall_corner")
    assert part.checkpoint().step == 105
    run("wall_corner", "--quiet", "--restart", part.path("_checkpoint.h5"), directory=directory)
    one, two = whole.checkpoint(), part.checkpoint()
    assert one.step == two.step == 200
    apart = driver.distance(one, two, list(driver.FIELDS))
    assert max(apart.values()) == 0.0, apart
    a, b = whole.history(), part.history()
    assert a.names == b.names and np.array_equal(a.rows, b.rows)


MISTAKES = {
    "&HEAT AMBIENT = 298 /": (r"", "&WALL TEMPERATURE = 300: has no effect without a &HEAT group"),
    "POSITION = 0,": ("POSITION = 0.5e-3,", "TEMPERATURE = 300: needs a wall on a plane of nodes"),
    "LOWER = 0, 0, 0": ("LOWER = -1e-3, 0, 0", "TEMPERATURE = 300: needs a wall on a plane of nodes"),
}


@pytest.mark.parametrize("old", MISTAKES)
def test_walls_that_cannot_hold_a_temperature(run, tmp_path, old):
    """Exact: status 2 and a complaint for a temperature without conduction or of a wall that is no mirror."""
    new, message = MISTAKES[old]
    assert old in CORNER
    (tmp_path / "bad.nml").write_text(CORNER.replace(old, new, 1))
    done = run("bad.nml", "--quiet", expect=driver.BAD_INPUT)
    print(done.err)
    assert message in done.err


def test_clamp_in_empty_space_feels_nothing(run, tmp_path):
    """Exact: a clamp that moves beside a plate under a tool, at nodes without metal whose inertia is scaled,
    has no force."""
    text = (driver.INPUTS / "stir.nml").read_text()
    clamp = "&CLAMP LOWER = 55e-3, -8e-3, 0, UPPER = 57e-3, 48e-3, 28e-3, VELOCITY = 0, 0, 1 /\n"
    (tmp_path / "stir.nml").write_text(text + clamp)
    history = run(tmp_path / "stir.nml", "--quiet", sets={"TIME.END": "4e-3"}).results("stir").history()
    assert len(history.rows) > 1
    assert np.abs(history["clamp1_force_z[N]"]).max() == 0.0


PRESSED = """
&GRID CELL = 1e-3, LOWER = -4e-3, -4e-3, 0, UPPER = 14e-3, 14e-3, 9e-3 /
&TIME END = 0.01, MASS_SCALING = 1e6 /
&MATERIAL NAME = 'metal', LAW = 'norton', NORTON_K = 40e6, NORTON_N = 0.2, DENSITY = 2700, YOUNGS_MODULUS = 70e9, POISSON_RATIO = 0.33
  SPECIFIC_HEAT = 1000, T_MELT = 900 /
&BODY NAME = 'sheet', MATERIAL = 'metal' /
&SHAPE BODY = 'sheet', LOWER = 0, 0, 0, UPPER = 10e-3, 10e-3, 3e-3 /
&TOOL NAME = 'tool', RADIUS = 2.5e-3, HEIGHT = 6e-3, POSITION = 5e-3, 5e-3, 3.01e-3, FRICTION_LAW = 'shear-factor', SHEAR_FACTOR = 0.5 /
&MOTION TOOL = 'tool', VELOCITY = 0, 0, -0.08, SPIN_RPM = 300 /
&WALL SIDE = 'zmin', KIND = 'fixed' /
&OUTPUT HISTORY_INTERVAL = 1e-3, CHECKPOINT_INTERVAL = 1 /
"""


def test_clamp_in_the_way_of_a_tool(run, tmp_path):
    """A clamp that lies under the face of a tool all over holds nothing: force and torque as without it, and no metal is crushed."""
    clamp = "&CLAMP LOWER = 4e-3, 4e-3, 2e-3, UPPER = 6e-3, 6e-3, 5e-3 /\n"
    found = {}
    for name, more in (("free", ""), ("held", clamp)):
        (tmp_path / f"{name}.nml").write_text(PRESSED + more)
        results = run(tmp_path / f"{name}.nml", "--quiet").results(name)
        history = results.history()
        found[name] = [history["tool_force_z[N]"][-5:].mean(), history["tool_torque[Nm]"][-5:].mean(), results.checkpoint().jac.min()]
    print(found)
    assert found["held"][:2] == pytest.approx(found["free"][:2], rel=0.02)
    assert found["held"][2] == pytest.approx(found["free"][2], abs=0.01)


def test_clamp_beside_a_tool_on_any_ranks(run, tmp_path):
    """A tool that comes into a clamp crushes no metal at its edge, and the clamp yields alike on any number of ranks."""
    clamp = "&CLAMP LOWER = -1e-3, -1e-3, -1e-3, UPPER = 4.3e-3, 11e-3, 4e-3 /\n"
    (tmp_path / "held.nml").write_text(PRESSED + clamp)
    states = {}
    for ranks in (1, 3):
        results = run(tmp_path / "held.nml", "--quiet", "--overwrite", ranks=ranks).results("held")
        states[ranks] = results.checkpoint()
    print(states[1].jac.min(), np.abs(states[1].x - states[3].x).max())
    assert states[1].jac.min() > 0.9
    assert states[3].x == pytest.approx(states[1].x, abs=1e-9)


def test_turning_tool_over_a_sliding_wall(run, tmp_path):
    """A wall at the end of a plate does not change what the metal under a tool resists: torque and heat as at a free end."""
    held = run("side", "--quiet").results("side").history()
    text = "\n".join(line for line in driver.INPUTS.joinpath("side.nml").read_text(encoding="utf-8").splitlines() if "'xmax'" not in line)
    (tmp_path / "free.nml").write_text(text + "\n", encoding="utf-8")
    free = run(tmp_path / "free.nml", "--quiet").results("free").history()
    assert held["tool_torque[Nm]"].max() == pytest.approx(free["tool_torque[Nm]"].max(), rel=0.03)
    assert abs(held["temperature_max[K]"].max() - free["temperature_max[K]"].max()) < 40.0


@pytest.mark.parametrize("sets, message", [
    ({"WALL.POSITION": -0.3e-3}, "&WALL FRICTION = 0.3: needs a wall on a plane of nodes"),
    ({"WALL.FRICTION": -0.1}, "&WALL FRICTION = -0.1: must be >= 0")])
def test_friction_that_is_refused(run, sets, message):
    """Friction needs a wall that is a mirror, and a coefficient that is not negative."""
    assert message in run("wall_friction", sets=sets, expect=driver.BAD_INPUT).err


def test_friction_of_a_fixed_wall(run, tmp_path):
    """Exact: a wall that --set changes to KIND = 'fixed' has no friction, and a message says so."""
    text = (driver.INPUTS / "wall_friction.nml").read_text()
    (tmp_path / "held.nml").write_text(text.replace("FRICTION = 0.3", "KIND = 'fixed'"))
    held = run("held.nml", "--quiet").results("held").checkpoint()
    done = run("wall_friction", "--quiet", sets={"WALL.KIND": "fixed"})
    assert "&WALL FRICTION = 0.3: has no effect with KIND = fixed" in done.out
    assert np.array_equal(done.results("wall_friction").checkpoint().v, held.v) and np.abs(held.v).max() > 0.1


GRADED = {"GRID.GRADED": "xz", "GRID.FINE": "0,12e-3,-3e-3,2e-3", "GRID.UPPER": "31e-3,16e-3,6e-3",
          "GRID.LARGEST_CELL": 2e-3}


@pytest.mark.parametrize("sets, ranks, pull", [
    ({}, 1, 0.2), ({"METHOD.SHAPE": "bspline"}, 3, 0.4), ({"METHOD.SHAPE": "cpgimp"}, 2, None),
    ({**GRADED, "METHOD.SHAPE": "bspline"}, 2, None)])
def test_block_rubs_on_a_wall(run, sets, ranks, pull):
    """Exact: friction is 0.3 of the normal impulse, opposite to the motion, while the block slides; the wall
    takes the energy that the block loses. A pull of 0.2 of the pressing force does not move it, of one of 0.4
    a quarter accelerates it."""
    results = run("wall_friction", "--quiet", ranks=ranks, sets=sets).results("wall_friction")
    history, state = results.history(), results.checkpoint()
    mass, pressed = 128e-6, 2.0 * (state.time - 0.5e-4)   # [kg], [N s]
    friction = 0.3 * pressed * np.array([3.0, 1.0]) / math.hypot(3.0, 1.0)
    impulse = np.array([history.impulse(f"wall_zmin_force_{axis}[N]") for axis in "xyz"])
    v = state.mass @ state.v / mass
    print(impulse / pressed, v)
    assert impulse[2] == pytest.approx(pressed, rel=0.02)
    assert impulse[:2] == pytest.approx(-friction, rel=0.01)
    assert v[:2] == pytest.approx([3.0, 1.0] - friction / mass, abs=0.01)
    assert np.abs(history["audit_error[%]"]).max() < 1e-3
    if pull is None:
        return
    sets = {**sets, "BODY.VELOCITY": "0,0,0", "LOAD.FORCE": f"{2.0 * pull},0,-2"}
    end = run("wall_friction", "--quiet", ranks=ranks, sets=sets).results("wall_friction").checkpoint()
    v = end.mass @ end.v / mass
    print(pull, v)
    assert v[:2] == pytest.approx([max(0.0, pull - 0.3) * pressed / mass, 0.0], abs=0.02)


@pytest.mark.parametrize("ranks", [1, 2])
def test_released_clamp(run, tmp_path, ranks):
    """A clamp lets go UNTIL a time, at the end of that step: momentum is that of the load less what the clamp took, to rounding,
    the clamp takes nothing afterwards, and a run that is continued across the release is the same."""
    text = (driver.INPUTS / "released.nml").read_text(encoding="utf-8").split(", DEFORMATION")
    text = text[0] + " /" + text[1].split("/", 1)[1]
    clamp = "&CLAMP LOWER = -1e-3, -1e-3, -1e-3, UPPER = 1e-4, 5e-3, 5e-3, UNTIL = 1.05e-3 /\n"
    (tmp_path / "block.nml").write_text(text + clamp, encoding="utf-8")
    results = run("block.nml", "--quiet", ranks=ranks).results("block")
    history, end = results.history(), results.checkpoint()
    time, force = history["time[s]"], history["clamp1_force_y[N]"]
    after = time > 1.05e-3 + 100e-6
    assert after.sum() > 5 and np.all(force[after] == 0.0) and np.all(force[1:8] < 0.0)
    taken = (force[1:] * np.diff(time)).sum()
    assert end.momentum()[1] == pytest.approx(1e-3 * time[-1] + taken, rel=1e-9)
    run("block.nml", "--quiet", ranks=ranks, sets={"TIME.MAX_STEPS": 100, "RUN.NAME": "half"})
    run(None, "--quiet", "--restart", "half.out/half_checkpoint.h5", ranks=ranks, sets={"TIME.MAX_STEPS": 0})
    assert np.array_equal(driver.Results(tmp_path / "half.out", "half").checkpoint().tau, end.tau)
