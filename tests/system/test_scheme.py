# SPDX-License-Identifier: MIT
"""USL against USAVG, and the energy books of a stirring scene."""

import driver
import numpy as np
import pytest


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results of an input with a scheme."""
    known = {}

    def get(name, scheme):
        if (name, scheme) not in known:
            directory = tmp_path_factory.mktemp(name + scheme)
            sets = {"METHOD.SCHEME": scheme} | ({"TIME.CFL": 0.125, "METHOD.SELECTIVE_SCALING": "off"} if name == "stir" else {})
            done = driver.run(name, "--quiet", directory=directory, sets=sets)
            known[name, scheme] = done.results(name)
        return known[name, scheme]

    return get


def test_bar(results):
    """Exact: the same problem: the tip of the bar under sudden gravity moves the same way, to 1 % of its
    way of 0.01 mm at any time in five periods."""
    tips = [results("bar", scheme).probes() for scheme in ("usl", "usavg")]
    t = tips[0]["time[s]"]
    u = [np.interp(t, tip["time[s]"], tip["tip_x[m]"]) for tip in tips]
    apart = np.abs(u[0] - u[1]).max() / 1e-5
    print(f"{apart:.3%}")
    assert apart < 0.01


def test_stirring(results):
    """Exact: the same problem: torque [N m], axial force [N], friction heat, tool work [J] and hottest particle [K] of
    0.2 s of stirring (particles 2 mm apart, short steps) agree to 5 %, as does what ploughing takes: plastic work and
    what contact loses (0.5 % measured). How it is shared between these two, where the tool has two and a half cells a radius
    and metal at its edge is not displaced as a whole (docs/method.md, Edges), agrees to 15 % of the plastic work only:
    10.6 % measured, 13 % with half the step."""
    one, two = [results("stir", scheme).history() for scheme in ("usl", "usavg")]
    for name in ("tool_torque[Nm]", "tool_force_z[N]"):
        late = [h[name][h["time[s]"] > 0.16].mean() for h in (one, two)]
        print(name, late)
        assert late[1] == pytest.approx(late[0], rel=0.05)
    for names, apart in ((["friction_heat[J]"], 0.05), (["tool_work[J]"], 0.05), (["heat_content[J]"], 0.05),
                         (["plastic_work[J]", "contact_loss[J]"], 0.05), (["plastic_work[J]"], 0.15)):
        rise = [sum(h[name][-1] - h[name][0] for name in names) for h in (one, two)]
        print(names, rise)
        assert rise[1] == pytest.approx(rise[0], rel=apart)
    assert two["temperature_max[K]"][-1] == pytest.approx(one["temperature_max[K]"][-1], rel=0.01)


@pytest.mark.parametrize("scheme", ["usl", "usavg"])
def test_energy_books_of_stirring(results, scheme):
    """Exact: tool work = friction heat + plastic work + contact loss + elastic + kinetic + numerical loss [J]
    to 2 % in every row, and heat content rises by the friction heat that reaches the body and 0.9 of the
    plastic work less the film loss, to 1e-6 of the friction heat; of the friction heat the body misses no more than the
    tenth of its layer's work that does not heat; every number is finite."""
    history = results("stir", scheme).history()
    assert np.isfinite(history.rows).all()
    worst = np.abs(history["audit_error[%]"]).max()
    print(f"audit error {worst} %")
    assert worst < 2.0
    last = {name: history[name][-1] for name in history.names}
    taken = sum(last[n] for n in ("friction_heat[J]", "plastic_work[J]", "contact_loss[J]", "elastic[J]",
                                  "kinetic[J]", "numerical_loss[J]"))
    assert taken == pytest.approx(last["tool_work[J]"] + last["wall_work[J]"], rel=0.02)
    gained = last["heat_content[J]"] - history["heat_content[J]"][0]
    exact = last["friction_heat_to_bodies[J]"] + 0.9 * last["plastic_work[J]"] - last["film_loss[J]"]
    print("heat content", gained, exact)
    assert 0.0 <= last["friction_heat[J]"] - last["friction_heat_to_bodies[J]"] < 1e-3 * last["friction_heat[J]"]
    assert gained == pytest.approx(exact, abs=1e-6 * last["friction_heat[J]"])


@pytest.mark.parametrize("scheme", ["usl", "usavg"])
def test_tool_columns_of_stirring(results, scheme):
    """Exact: power [W] = torque times 970 rpm (101.58 rad/s) - force on the tool times its velocity, to 1e-6;
    the tool's mean velocity [m/s] lies between 2/3 of omega R = 1.016 m/s (even pressure on the whole
    face) and omega R; the share of friction in the heat since the last row is what the columns of friction
    heat and plastic work [J] say, between 85 and 100 %. The tool's place is that of its schedule."""
    history = results("stir", scheme).history()
    late = history["time[s]"] > 0.16
    power = history["tool_torque[Nm]"] * 970.0 * 2.0 * np.pi / 60.0 - 10e-3 * history["tool_force_x[N]"]
    assert history["tool_power[W]"][late] == pytest.approx(power[late], rel=1e-6)
    speed = history["tool_tool_velocity[m/s]"][late]
    assert 2.0 / 3.0 * 1.016 < speed.min() and speed.max() < 1.016 + 10e-3
    assert history["tool_interface_velocity[m/s]"].min() >= 0.0
    share = history["tool_friction_share[%]"][late]
    print("friction share", share.min(), share.max())
    assert 85.0 < share.min() and history["tool_friction_share[%]"].max() <= 100.0
    friction, plastic = (np.diff(history[name], prepend=0.0)[late] for name in ("friction_heat[J]", "plastic_work[J]"))
    assert share == pytest.approx(100.0 * friction / (friction + plastic), rel=1e-4)
    time = history["time[s]"]
    ramp = np.clip(time - 0.1, 0.0, 0.05)  # from (0, 0, -3) to (10, 0, 0) mm/s
    assert history["tool_x[m]"] == pytest.approx(20e-3 + 0.1 * ramp**2 + 10e-3 * np.maximum(time - 0.15, 0.0), abs=1e-9)
    assert history["tool_y[m]"] == pytest.approx(20e-3)
    sunk = 3e-3 * np.minimum(time, 0.1) + 3e-3 * ramp - 0.03 * ramp**2
    assert history["tool_z[m]"] == pytest.approx(12.6e-3 - sunk, abs=1e-9)
    assert history["tool_angle[rad]"] == pytest.approx(970.0 * 2.0 * np.pi / 60.0 * time)
    assert history["tool_tilt[rad]"] == pytest.approx(np.radians(3.0))


@pytest.mark.parametrize("particles", ["1,2,2", "2,1,1", "1,1,1"])
@pytest.mark.parametrize("order", [2, 3, 4, 6, 10])
def test_fmpm_with_one_particle_along_an_axis(run, order, particles):
    """Bound: the energy of a bar that swings ten times under a sudden load is never above that of the first swing (by 2 %), at the step that
    follows from the method. Before, orders from 3 on ended the run within a swing or two."""
    sets = {"METHOD.SHAPE": "bspline", "METHOD.TRANSFER": "fmpm", "METHOD.ORDER": order, "BODY.PARTICLES_PER_CELL": particles,
            "TIME.END": 2e-3}
    history = run("bar", "--quiet", sets=sets).results("bar").history()
    energy = history["kinetic[J]"] + history["elastic[J]"]
    first = energy[history["time[s]"] < 2e-4].max()
    print(first, energy.max(), np.abs(history["audit_error[%]"]).max())
    assert 0.0 < energy.max() < 1.02 * first and np.abs(history["audit_error[%]"]).max() < 1.0
