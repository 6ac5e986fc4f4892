# SPDX-License-Identifier: MIT
"""exact.py against numbers that were computed or published elsewhere."""

import math

import exact
import limit_punch
import numpy as np
import pytest
import stirred_layer
from pytest import approx
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def test_bars():
    """E = 100, rho = 1, L = 25: omega = 0.62832; the tip of a bar under sudden gravity reaches twice the
    static rho g L^2/(2E) at half its period 4L/c and is back at the end."""
    assert exact.bar_frequency(25.0, 100.0, 1.0) == approx(0.62832, abs=1e-5)
    static = 1.0 * 0.01 * 25.0**2 / (2.0 * 100.0)
    tip = exact.bar_under_gravity(25.0, np.array([0.0, 5.0, 10.0]), 25.0, 100.0, 1.0, 0.01)
    assert tip == approx([0.0, 2.0 * static, 0.0], abs=2e-3 * static)


def test_columns():
    """l0 = 50 m, E = 10 kPa, rho0 = 80, g = 9.81: 24.2331 m (Hencky), 16.3624 m (P = mu(F - 1/F))."""
    assert exact.column_stress(0.0, 50.0, 80.0, 9.81) == approx(-39240.0)
    assert exact.column_height(50.0, 80.0, 9.81, exact.hencky(1e4)) == approx(24.2331, abs=5e-4)
    assert exact.column_height(50.0, 80.0, 9.81, exact.coupled_uniaxial(1e4)) == approx(16.3624, abs=5e-4)


def test_laws_agree_with_linear_elasticity():
    """All laws have dP/dF = lambda + 2 mu at F = 1."""
    for law in (exact.coupled_uniaxial(1.0, 0.3), exact.decoupled_uniaxial(1.0, 0.3)):
        mu, lam = exact.lame(1.0, 0.3)
        assert (law(1.0 + 1e-5) - law(1.0 - 1e-5)) / 2e-5 == approx(lam + 2.0 * mu, rel=1e-6)


@pytest.mark.parametrize("load, tip, shortening", [
    (10e3, 0.2917, 0.0526), (25e3, 0.5445, 0.2005), (50e3, 0.7063, 0.3769), (100e3, 0.8062, 0.5461)])
def test_elastica(load, tip, shortening):
    """E = 12 MPa, nu = 0.2, L = 10, d = 1, plane strain."""
    bending = exact.plane_strain_modulus(12e6, 0.2) / 12.0
    assert exact.elastica_tip(load, 10.0, bending) == approx((tip, shortening), abs=1e-4)


def test_elastica_plane_stress():
    """100 kN with EI = E/12: .8106, .5550."""
    assert exact.elastica_tip(100e3, 10.0, 1e6) == approx((0.8106, 0.5550), abs=1e-4)


def test_friction_and_inclines():
    """Nairn's block 5882 m/s2; R = 1.6, 45 deg, |g| = 10, mu = 0.495."""
    assert exact.block_acceleration(35.294, 35.294, 0.5, 3e-3) == approx(5882.3, abs=0.1)
    assert exact.block_acceleration(10.0, 35.294, 0.5, 3e-3) == 0.0
    assert exact.incline("cylinder", 10.0, math.radians(45), 0.495) == approx((4.7140, True), abs=1e-4)
    assert exact.incline("sphere", 10.0, math.radians(45), 0.495)[0] == approx(5.0508, abs=1e-4)
    assert exact.incline("block", 9.81, math.radians(30), 0.3) == approx((2.3563, False), abs=1e-4)
    assert exact.incline("sphere", 9.81, math.radians(60), 0.2)[1] is False
    a, rolls = exact.incline("cylinder", 9.81, math.radians(60), 0.2)
    assert not rolls and a == approx(9.81 * (math.sin(math.radians(60)) - 0.1))


def test_discs():
    """Sulsky's discs touch at 1.08579 s with 2.51327 J."""
    assert exact.discs_touch(math.hypot(0.5, 0.5), 0.2, math.hypot(0.1, 0.1)) == approx(1.08579, abs=1e-5)
    assert 2.0 * exact.rigid_energy(1000.0, math.pi * 0.04, math.hypot(0.1, 0.1)) == approx(2.51327, abs=1e-5)


def test_hertz():
    """E = 70 GPa, nu = 0.33, rho = 2700, R = 10 mm, rigid plane; 1 MN/m, 1 kN, 1 m/s."""
    e = exact.plane_strain_modulus(70e9, 0.33)
    assert exact.hertz_line(1e6, 0.01, e) == approx((0.40260e-3, 1.5813e9), rel=2e-4)
    assert exact.hertz_sphere(1e3, 0.01, e)[:2] == approx((0.45705e-3, 2.2857e9), rel=2e-4)
    mass = 2700.0 * 4.0 / 3.0 * math.pi * 0.01**3
    assert exact.hertz_impact(mass, 0.01, e, 1.0) == approx((5.259e-5, 791.2), rel=1e-3)


@pytest.mark.parametrize("m, strain, temperature, stress", [
    (1.0, 1.0, 433.674, 344.32), (1.0, 2.0, 551.033, 285.13), (1.0, 5.0, 776.031, 130.64),
    (1.34, 1.0, 441.364, 378.23), (1.34, 5.0, 813.910, 126.44)])
def test_johnson_cook(m, strain, temperature, stress):
    """AA6061 at 1/s from 300 K."""
    got = exact.johnson_cook_adiabatic(strain, 324e6, 114e6, 0.42, 0.002, m, 1.0, 300.0, 925.0, 2700.0, 896.0, 0.9)
    assert got[0] == approx(temperature, abs=2e-3)
    assert got[1] / 1e6 == approx(stress, abs=6e-3)


@pytest.mark.parametrize("k, n, torque, spins", [
    (1e6, 0.5, 1159.62, (0.313725, 0.058824, 0.008473)), (3e7, 0.2, 6816.31, (0.056313, 0.000976))])
def test_couette(k, n, torque, spins):
    """a = 3, b = 12 mm, 1000 rpm; spins at 4, 6, 9 mm."""
    omega = 1000.0 * 2.0 * math.pi / 60.0
    assert exact.couette_torque(k, n, omega, 3e-3, 12e-3) == approx(torque, rel=1e-5)
    places = [4e-3, 6e-3, 9e-3][: len(spins)]
    assert exact.couette_spin(places, n, 3e-3, 12e-3) == approx(spins, abs=6e-7)


def test_norton_shear():
    """sigma = sqrt(3) k (sqrt(3) rate)^n."""
    assert exact.norton_shear(math.sqrt(3.0) * 1e6 * math.sqrt(3.0) ** 0.5, 0.5) == approx(1e6)


def test_tube():
    """a = 1, b = 2, p = 1, E = 1000."""
    for nu, u in ((0.3, 1.90667e-3), (0.49, 1.99660e-3), (0.4999, 1.99997e-3)):
        assert exact.tube_displacement(1.0, 1.0, 1.0, 2.0, 1000.0, nu) == approx(u, abs=6e-9)
    assert exact.tube_stress(1.5, 1.0, 1.0, 2.0) == approx((-0.25926, 0.92593), abs=5e-6)
    assert exact.tube_limit(1.0, 1.0, 2.0) == approx(0.80038, abs=1e-5)


def test_tool_torque():
    """R = 9, r = 3, H = 4 mm, 20 MPa, 1000 rpm: 30.536 + 4.524 N m, 3671.5 W."""
    disc, pin = exact.tool_torque(20e6, 9e-3, 3e-3, 4e-3)
    assert (disc, pin) == approx((30.536, 4.524), abs=1e-3)
    assert (disc + pin) * 1000.0 * 2.0 * math.pi / 60.0 == approx(3671.5, abs=0.1)


@pytest.mark.parametrize("biot, middle, face", [
    (1.0, 0.5338594, 0.3481769), (0.1, 0.9223886, 0.8781265), (10.0, 0.1638176, 0.0231721)])
def test_robin(biot, middle, face):
    """Fo = 1."""
    assert exact.robin_slab([0.0, 1.0], biot, 1.0) == approx([middle, face], abs=1e-7)


@pytest.mark.parametrize("ste, root", [(0.1, 0.22001627), (0.5, 0.46478592), (1.0, 0.62006263)])
def test_stefan(ste, root):
    assert exact.stefan_root(ste) == approx(root, abs=1e-8)


SOURCE = (1e-3, 167.0, 6.9e-5)


def test_moving_sources():
    """k = 167, alpha = 6.9e-5, 1 mm/s, 1500 W, plate of 6 mm."""
    for place, rise in (((0.0, 0.010), 132.961), ((-0.010, 0.0), 142.954), ((-0.020, 0.010), 62.846)):
        assert exact.moving_point(*place, 1500.0, *SOURCE) == approx(rise, abs=1e-3)
    for place, rise in (((0.0, 0.010), 654.13), ((-0.010, 0.0), 703.30), ((-0.020, 0.010), 538.48)):
        assert exact.moving_line(*place, 1500.0, 6e-3, *SOURCE) == approx(rise, abs=1e-2)
    for t, rise in ((1.0, 45.595), (5.0, 189.875), (20.0, 347.754), (100.0, 517.308)):
        assert exact.moving_line_transient(-0.010, 0.010, t, 1500.0, 6e-3, *SOURCE) == approx(rise, abs=2e-3)


def test_heated_disc():
    """R = 9 mm, 1500 W over its area."""
    flux = 1500.0 / (math.pi * 0.009**2)
    for t, rise in ((0.1, 103.955), (1.0, 225.064), (10.0, 287.120), (1e9, 317.675)):
        assert exact.heated_disc(t, flux, 0.009, 167.0, 6.9e-5) == approx(rise, abs=2e-2)


def test_friction_heat():
    """mu p v = 3 MW/m2 shared by two identical half spaces of k = 167, alpha = 6.9e-5: 2.662 K at 1 ms."""
    for t, rise in ((1e-3, 2.662), (1e-2, 8.419)):
        assert exact.half_space_flux(0.0, t, 1.5e6, 167.0, 6.9e-5) == approx(rise, abs=1e-3)


def test_half_space_flux_is_the_integral_of_the_step():
    """Its heat content is q t: the integral of rho c T over x."""
    x = np.linspace(0.0, 0.05, 20001)
    rise = exact.half_space_flux(x, 1.0, 1e5, 167.0, 6.9e-5)
    assert exact.trapezoid(rise, x) * 167.0 / 6.9e-5 == approx(1e5, rel=1e-5)


def test_punches():
    """The limit loads of coarse finite elements lie above what is exact: a tube by less than 0.1 %, a punch in plane strain
    (2 + pi) and a round one 5.224 k by less than 2 %."""
    assert limit_punch.tube(6) == approx(2.0 * math.log(2.0), rel=1e-3)
    for wanted, block in ((exact.prandtl(1.0), (False, 6.0, 4.0)), (exact.circular_punch(1.0), (True, 4.0, 3.0))):
        found = limit_punch.punch(8, *block)[0]
        assert wanted < found < 1.02 * wanted


@pytest.mark.parametrize("temp, stresses", [(298.0, (295.30, 362.32, 561.22)), (773.0, (119.27, 144.98, 223.84)),
                                            (1123.0, (21.32, 25.18, 36.99))])
def test_two_phase_law_of_the_layer(temp, stresses):
    """Stress [MPa] of copper at 1/s and strains of 0.5, 1, 4 by the law of the stirred layer: the references of the
    material point, to their digits."""
    law, at = stirred_layer.TWO_PHASE, np.array([temp])
    states = solve_ivp(lambda _, y: law.by_strain(at, y[:, None], 0.0)[:, 0], (0.0, 4.0), law.begin(), method="LSODA",
                       rtol=1e-8, t_eval=(0.5, 1.0, 4.0)).y
    for state, stress in zip(states.T, stresses):
        found = brentq(lambda sigma: law.log_rate(sigma, at, state[:, None])[0][0], 1e5, 1e9)
        assert found == approx(1e6 * stress, abs=0.006e6)


def test_slopes_of_laws_of_the_layer():
    """d ln(rate)/d sigma of each law is the difference quotient of its ln(rate)."""
    temp = np.array([600.0, 900.0, 1320.0])
    for name, law in stirred_layer.LAWS.items():
        state = np.repeat(np.array(law.begin())[:, None], 3, axis=1) + np.array([[0.3]] + [[0.0]] * (len(law.begin()) - 1))
        sigma, step = np.array([300e6, 200e6, 40e6]), 1e3
        above, below = (law.log_rate(sigma + sign * step, temp, state)[0] for sign in (1.0, -1.0))
        flows = np.isfinite(below)
        assert flows.any(), name
        assert law.log_rate(sigma, temp, state)[1][flows] == approx(((above - below) / (2.0 * step))[flows], rel=1e-4)


def test_elastic_punch_on_block():
    """A large block is a half space, whatever Poisson's ratio: what its walls add to the compliance goes as 1/side."""
    for poisson in (0.0, 0.25, 0.45):
        near, far = (1.0 / exact.elastic_punch_on_block(poisson, side, 16) for side in (6.0, 12.0))
        assert 2.0 * far - near == approx(1.0, abs=0.012)
        assert near < far < 1.0
    # a block no wider than the punch is pressed as a whole: M A/H
    poisson = 0.3
    confined = (1.0 - poisson) ** 2 / (1.0 - 2.0 * poisson)
    whole = exact.punch_of_squares(poisson, 0.5, 16) * math.sqrt(1.0 / math.pi)
    assert whole == approx(confined * 1.0 / 0.5 / 2.0, rel=1e-4)
