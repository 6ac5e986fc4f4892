# SPDX-License-Identifier: MIT
"""Bodies with a known motion or temperature: the error against it falls with the cell as it should."""

import re

import driver
import numpy as np
import pytest

DIFFUSIVITY = 391.0 / (8960.0 * 386.0)  # of the copper of heat_mode.nml [m2/s]


@pytest.fixture
def errors(tmp_path_factory):
    """The table of errors of a run in a directory of its own."""

    def table(name, **more):
        sets = more.pop("sets", {})
        done = driver.run(name, "--quiet", directory=tmp_path_factory.mktemp(name), sets=sets, **more)
        return driver.Table(done.results(name).path("_errors.csv"))

    return table


def orders(coarse, fine, names):
    """Order of convergence of the largest error over time in each column, for cells of ratio 2."""
    found = {name: np.log2(np.abs(coarse[name]).max() / np.abs(fine[name]).max()) for name in names}
    print({name: (f"{coarse[name].max():.3g}", f"{fine[name].max():.3g}", f"{found[name]:.2f}") for name in names})
    return found


@pytest.mark.parametrize("phase", [0.0, 0.5 * np.pi])
def test_standing_wave(errors, phase):
    """Exact: u = A sin(pi X/L) sin(w t + Q), w = pi c/L, in a bar held at both ends (nu = 0), over one
    period from rest in place or at the largest displacement: the rms error of the displacement falls
    from 12 to 24 cells with order above 1.8, to below 1.5 % of A, that of the velocity with order above 1.4."""
    sets = {"FIELD.PHASE": f"{phase},0,0"}
    coarse = errors("mode", sets=sets | {"TIME.DT": 1e-6})
    fine = errors("mode", sets=sets | {"TIME.DT": 0.5e-6, "GRID.CELL": 2e-3})
    found = orders(coarse, fine, ["bar_displacement_rms[m]", "bar_velocity_rms[m/s]"])
    assert found["bar_displacement_rms[m]"] > 1.8 and found["bar_velocity_rms[m/s]"] > 1.4
    assert fine["bar_displacement_rms[m]"].max() < 1.5e-2 * 1e-6


def test_affine_transfer_starts_with_the_gradient(errors):
    """Exact: APIC particles carry the gradient of the wave from the start: after the first step the rms velocity
    error is below 2e-4 of A w / sqrt(2) (without it, one PIC step, 3.2e-3)."""
    table = errors("mode", sets={"METHOD.TRANSFER": "apic", "GRID.CELL": 2e-3, "TIME.DT": 1e-6, "TIME.END": 1e-6,
                                 "OUTPUT.HISTORY_INTERVAL": 1e-6})
    largest = 1e-6 * np.pi * 1e3 / 48e-3 / np.sqrt(2.0)
    assert len(table.rows) == 2 and table["bar_velocity_rms[m/s]"][1] < 2e-4 * largest


def test_exact_stress_of_the_standing_wave(errors):
    """Exact: the rms of the stress sigma = E A (pi/L) cos(pi X/L) sin(w t) over the bar is its largest value,
    E A pi/L = 65.45 kPa, times |sin w t|/sqrt(2), to the 6e-5 of the strain and 2e-3 of the sums over particles; at
    t = 0 the errors of all but the velocity are 0."""
    table = errors("mode")
    exact = 1e9 * 1e-6 * np.pi / 48e-3 * np.abs(np.sin(np.pi * 1e3 / 48e-3 * table["time[s]"])) / np.sqrt(2.0)
    assert np.abs(table["bar_exact_stress_rms[Pa]"] - exact).max() < 3e-3 * exact.max()
    for name in ("bar_displacement_rms[m]", "bar_displacement_max[m]", "bar_stress_rms[Pa]"):
        assert table[name][0] == 0.0 and table[name].max() > 0.0


def square(cell, side):
    """Sets of a plane-strain square up to `side` [m] with so large cells."""
    corner = f"{side},{side},{cell}"
    return {"GRID.CELL": cell, "GRID.UPPER": corner, "SHAPE.UPPER": corner}


def test_manufactured_waves(errors):
    """Exact: u_x = A sin(2 pi X) sin(w t), u_y = A sin(2 pi Y) sin(w t + pi) with its body force, A = 1 mm, one
    period: the rms displacement error falls from 8 to 16 cells with order above 1.5, to below 3 % of A; that of
    the stress (uGIMP: 1.0 to 1.1 in one dimension) with order above 0.9."""
    names = ["square_displacement_rms[m]", "square_stress_rms[Pa]"]
    coarse, fine = (errors("waves", sets=square(cell, 1)) for cell in (0.125, 0.0625))
    found = orders(coarse, fine, names)
    assert found[names[0]] > 1.5 and found[names[1]] > 0.9
    assert fine[names[0]].max() < 3e-2 * 1e-3


def test_manufactured_waves_of_large_amplitude(errors):
    """Exact: the same waves with A = 50 mm, strains of 31 %, and domains that follow the deformation (cpGIMP): the
    rms displacement error falls from 16 to 32 cells with order above 1.8, to below 1 % of A, that of the stress
    with order above 1.2."""
    sets = {"METHOD.SHAPE": "cpgimp", "FIELD.AMPLITUDE": 0.05}
    names = ["square_displacement_rms[m]", "square_stress_rms[Pa]"]
    coarse, fine = (errors("waves", sets=sets | square(cell, 1)) for cell in (0.0625, 0.03125))
    found = orders(coarse, fine, names)
    assert found[names[0]] > 1.8 and found[names[1]] > 1.2
    assert fine[names[0]].max() < 1e-2 * 0.05


def torus(tmp_path, name, *changes):
    """Path of an input without its walls in a box that is periodic along all axes."""
    text = "\n".join(line for line in (driver.INPUTS / f"{name}.nml").read_text().splitlines() if "&WALL" not in line)
    for old, new in (("&GRID ", "&GRID PERIODIC = 'xyz', "), *changes):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / f"torus_{name}.nml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("ranks", [None, 2])
def test_manufactured_waves_in_a_periodic_box(run, tmp_path, ranks):
    """Exact: the same waves with phases, so that the body starts deformed and moves through all sides of a
    periodic box: the rms displacement error falls from 8 to 16 cells with order above 1.5, to below 3 % of A; on
    one and on two ranks."""
    path = torus(tmp_path, "waves", ("AXES = 'xy'", "AXES = 'xy', SHIFT = 1, 2, 0"), ("PHASE = 0, 3.14", "PHASE = 1, 4.14"))
    name = "square_displacement_rms[m]"
    tables = []
    for cell in (0.125, 0.0625):
        sets = square(cell, 1) | {"GRID.UPPER": f"1,1,{4 * cell}", "SHAPE.UPPER": f"1,1,{4 * cell}"}
        results = run(str(path), "--quiet", ranks=ranks, sets=sets).results("torus_waves")
        tables.append(driver.Table(results.path("_errors.csv")))
    assert tables[0][name][0] == 0.0 and tables[0]["square_exact_stress_rms[Pa]"][0] > 1e4
    assert orders(*tables, [name])[name] > 1.5
    assert tables[1][name].max() < 3e-2 * 1e-3


def test_work_of_the_body_force(run):
    """Exact: what the body force of the manufactured waves gives is what kinetic and elastic energy take, at
    every time, to 2 % of the largest energy (16 cells, steps of CFL 0.1: velocities are half a step behind); it
    gives and takes back a third of it at least."""
    history = run("waves", "--quiet", sets=square(0.0625, 1) | {"TIME.CFL": 0.1}).results("waves").history()
    energy = history["kinetic[J]"] + history["elastic[J]"]
    given = history["body_work[J]"]
    print(np.abs(given - energy + energy[0]).max() / energy.max(), np.abs(given).max() / energy.max())
    assert np.abs(given).max() > 0.3 * energy.max()
    assert np.abs(given - energy + energy[0]).max() < 0.02 * energy.max()


def test_vortex_of_small_angle(errors):
    """Exact: circles of the annulus 0.75 < R < 1.25 turn to and fro by at most 0.01 rad: the rms displacement
    error falls from cells of 1/8 to 1/16 with order above 1.5."""
    coarse, fine = (errors("vortex", sets=square(cell, 1.5)) for cell in (0.125, 0.0625))
    assert orders(coarse, fine, ["square_displacement_rms[m]"])["square_displacement_rms[m]"] > 1.5


def test_ring_of_small_amplitude(errors):
    """Exact: the ring 0.4 < R < 0.6 with free surfaces breathes by A = 1 mm outside: the rms displacement error
    falls from cells of 1/20 to 1/40 with order above 1, to below 3 % of A."""
    def sets(cell):
        return {"GRID.CELL": cell, "GRID.UPPER": f"0.8,0.8,{cell}", "SHAPE(1).LENGTH": cell,
                "SHAPE(2).LENGTH": 3 * cell, "SHAPE.CENTRE": f"0,0,{cell / 2}"}
    name = "ring_displacement_rms[m]"
    coarse, fine = (errors("ring", sets=sets(cell)) for cell in (0.05, 0.025))
    assert orders(coarse, fine, [name])[name] > 1.0
    assert fine[name].max() < 3e-2 * 1e-3


def test_decay_of_temperature(errors):
    """Exact: T = 350 K + 50 K cos(pi X/L) exp(-kappa (pi/L)^2 t) in an insulated bar; steps of
    0.05 h^2/kappa: the rms error falls from 8 to 16 cells with order above 1.8, to below 0.2 % of 50 K."""
    def sets(cell):
        return {"GRID.CELL": cell, "HEAT.FOURIER": 0.05, "TIME.DT": 0.05 * cell**2 / DIFFUSIVITY}
    name = "bar_temperature_rms[K]"
    coarse, fine = (errors("heat_mode", sets=sets(cell)) for cell in (4e-3, 2e-3))
    assert orders(coarse, fine, [name])[name] > 1.8
    assert fine[name].max() < 2e-3 * 50.0


def test_errors_on_three_ranks(errors):
    """Exact: every column is the same on one and on three ranks, to 1e-8 of its largest value."""
    one, three = errors("waves"), errors("waves", ranks=3)
    assert one.names == three.names and len(one.rows) == 21
    for name in one.names:
        assert np.abs(one[name] - three[name]).max() <= 1e-8 * np.abs(one[name]).max(), name


def test_errors_of_a_continued_run(errors, run, tmp_path):
    """Exact: a run stopped at half time and continued from its checkpoint writes the table of one that was
    not, to the last digit."""
    sets = {"TIME.DT": 1e-6, "OUTPUT.CHECKPOINT_INTERVAL": 48e-6}
    whole = errors("mode", sets=sets)
    results = run("mode", "--quiet", sets=sets | {"TIME.END": 48e-6}).results("mode")
    run("mode", "--quiet", "--restart", results.path("_checkpoint.h5"), sets=sets)
    assert results.path("_errors.csv").read_text() == whole.text


def test_no_table_without_fields(run):
    """Exact: a scene without a known field has no table of errors; noise is none."""
    results = run("mode", "--quiet", sets={"FIELD.KIND": "noise", "TIME.END": 1e-6}).results("mode")
    assert results.path("_history.csv").exists() and not results.path("_errors.csv").exists()


def test_noise_does_not_depend_on_the_number_of_ranks(run, tmp_path_factory):
    """Exact: noise of 1 m/s in all components after 25 steps: positions [m], velocities [m/s] and stresses
    [Pa] of the particles are the same on 1 and 2 ranks to 1e-10 of the largest; another seed is another noise."""
    sets = {"FIELD.KIND": "noise", "FIELD.AMPLITUDE": 1, "FIELD.AXES": "xyz", "TIME.DT": 1e-6, "TIME.END": 25e-6,
            "OUTPUT.CHECKPOINT_INTERVAL": 25e-6}
    one = run("mode", "--quiet", sets=sets).results("mode").checkpoint()
    two = run("mode", "--quiet", ranks=2, sets=sets, directory=tmp_path_factory.mktemp("two")).results("mode").checkpoint()
    other = run("mode", "--quiet", sets=sets | {"FIELD.SEED": 2}).results("mode").checkpoint()
    apart = driver.distance(one, two, ["x", "v", "tau", "jac"])
    assert one.step == 25 and max(apart.values()) <= 1e-10, apart
    assert np.abs(one.v).max() > 0.5
    assert np.abs(one.v - other.v).max() > 0.5


def test_alternating_velocities_are_not_seen(run, tmp_path):
    """Exact: two particles a cell with velocities +A and -A by turns along x cancel on every node of a periodic
    box: after 96 steps nothing has moved (1e-14 m) and FLIP has kept the velocities to 1e-9 of A = 1 m/s."""
    path = torus(tmp_path, "mode", ("LOWER = 0, -4e-3, -4e-3, UPPER = 48e-3, 8e-3, 8e-3", "LOWER = 0, 0, 0, UPPER = 48e-3, 16e-3, 16e-3"),
                 ("48e-3, 4e-3, 4e-3", "48e-3, 16e-3, 16e-3"))
    sets = {"FIELD.KIND": "alternating", "FIELD.AMPLITUDE": 1, "TIME.DT": 1e-6}
    state = run(str(path), "--quiet", sets=sets).results("torus_mode").checkpoint()
    site = np.floor(state.x[:, 0] / 2e-3)
    print(np.abs(state.x[:, 0] - (site + 0.5) * 2e-3).max(), np.abs(state.v[:, 0] - (-1.0) ** site).max())
    assert state.step == 96 and len(site) == 24 * 8 * 8
    assert np.abs(state.x[:, 0] - (site + 0.5) * 2e-3).max() < 1e-14
    assert np.abs(state.v[:, 0] - (-1.0) ** site).max() < 1e-9
    assert np.abs(state.v[:, 1:]).max() < 1e-9


# What is set, and what the message must say.
MISTAKES = {
    "no such body": ("waves", {"FIELD.BODY": "sqare"}, r"FIELD.BODY=sqare: .*there is no &BODY of this name; known: square"),
    "other energy": ("waves", {"MATERIAL.ENERGY": "decoupled"}, r"waves.nml:\d+: .*KIND = 'waves': .*ENERGY = 'coupled'"),
    "plastic": ("mode", {"MATERIAL.LAW": "johnson-cook", "MATERIAL.JC_A": 1e6, "MATERIAL.JC_B": 0, "MATERIAL.JC_N": 1,
                         "MATERIAL.JC_C": 0, "MATERIAL.JC_M": 1, "MATERIAL.T_MELT": 1356,
                         "MATERIAL.PLASTIC_HEAT": 0}, r"KIND = 'mode': needs an elastic material"),
    "expansion": ("mode", {"MATERIAL.EXPANSION": 1e-5}, r"KIND = 'mode': needs a material without EXPANSION"),
    "mass scaling": ("mode", {"TIME.MASS_SCALING": 2}, r"KIND = 'mode': is wrong with MASS_SCALING"),
    "own velocity": ("mode", {"BODY.VELOCITY": "1,0,0"}, r"&BODY VELOCITY = 1,0,0: the body has its motion from a &FIELD"),
    "inside out": ("waves", {"FIELD.AMPLITUDE": 0.16}, r"AMPLITUDE = 0.16: must be below WAVELENGTH/\(2 pi\)"),
    "no frequency": ("vortex", {"FIELD.FREQUENCY": 0}, r"FREQUENCY = 0: must be > 0"),
    "radii": ("vortex", {"FIELD.RADII": "2,1"}, r"RADII = 2,1: the outer one must be above"),
    "thrice": ("ring", {"FIELD.RADII": "0.2,0.6"}, r"RADII = 0.2,0.6: the outer one must not be thrice"),
    "ring with nu": ("ring", {"MATERIAL.POISSON_RATIO": 0.3}, r"KIND = 'ring': needs a material with POISSON_RATIO = 0"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes(run, tmp_path, mistake):
    """Exact: one mistake gives one message, status 2, and nothing is written."""
    name, sets, words = MISTAKES[mistake]
    done = run(name, sets=sets, expect=driver.BAD_INPUT)
    messages = done.err.splitlines()
    assert len(messages) == 1 and re.search(words, messages[0]), messages
    assert list(tmp_path.iterdir()) == []


def test_start_outside_the_grid(run):
    """Exact: a field that puts particles outside the grid at t = 0 ends the run with their place."""
    sets = {"FIELD.PHASE": "1.57,0,0", "FIELD.SHIFT": "-1.57,0,0", "FIELD.AMPLITUDE": 1.5e-2}
    done = run("mode", sets=sets, expect=driver.BAD_INPUT)
    assert "left the grid at" in done.err and "at the start" in done.err
