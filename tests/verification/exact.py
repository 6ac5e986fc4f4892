# SPDX-License-Identifier: MIT
"""Closed answers of the verification problems. Pure functions, SI units, angles in rad; each names its
source. tests/verification/test_exact.py holds them against published or independently computed numbers."""

import math

import numpy as np
from scipy.fft import dctn, idctn
from scipy.sparse.linalg import LinearOperator, cg


def trapezoid(y, x):
    """Integral of samples by the trapezoidal rule (numpy has renamed its own)."""
    y, x = np.asarray(y, dtype=float), np.asarray(x, dtype=float)
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))


def bisect(f, low, high, steps=200):
    """Root of `f` between `low` and `high`, where its sign changes; to rounding."""
    left = f(low)
    for _ in range(steps):
        middle = 0.5 * (low + high)
        value = f(middle)
        if (value > 0.0) == (left > 0.0):
            low, left = middle, value
        else:
            high = middle
    return 0.5 * (low + high)


# ---------------------------------------------------------------------------------- elastic bars


def bar_speed(young, density):
    """Speed of waves in a slender bar [m/s]: sqrt(E/rho) (Kolsky 1963, eq. 3.2)."""
    return math.sqrt(young / density)


def bar_impact_force(young, density, area, speed):
    """Force [N] of a bar on a rigid wall until 2L/c: rho c A v (Kolsky 1963, section 3)."""
    return density * bar_speed(young, density) * area * speed


def bar_frequency(length, young, density):
    """Lowest circular frequency [rad/s] of a fixed-free bar: pi c/(2L) (Rayleigh, Theory of Sound, 150)."""
    return 0.5 * math.pi / length * bar_speed(young, density)


def bar_under_gravity(x, t, length, young, density, gravity, terms=400):
    """Displacement [m] at x of a fixed-free bar on which gravity acts from t = 0: the static parabola less
    its standing waves (Timoshenko, Vibration Problems in Engineering, section 49)."""
    c = bar_speed(young, density)
    static = density * gravity / young * (length * x - 0.5 * x * x)
    n = np.arange(1, 2 * terms, 2)[:, None]
    k = n * math.pi / (2.0 * length)
    x, t = np.broadcast_arrays(np.atleast_1d(x), np.atleast_1d(t))
    waves = (2.0 * gravity / (length * c * c)) * np.sin(k * x) * np.cos(k * c * t) / k**3
    return static - waves.sum(axis=0)


def column_stress(y, height, density, gravity):
    """Cauchy stress [Pa] over the initial place y in a column under its own weight, without lateral strain,
    for any law: -rho0 g (l0 - y) by equilibrium (Coombs, Augarde 2020, AMPLE)."""
    return -density * gravity * (height - y)


def column_height(height, density, gravity, stress):
    """Height [m] of a column under its own weight; `stress(stretch)` is the nominal stress [Pa] of the law."""
    y, w = np.polynomial.legendre.leggauss(64)
    places = 0.5 * height * (y + 1.0)
    stretch = [bisect(lambda s, q=q: stress(s) - column_stress(q, height, density, gravity), 1e-3, 1.0)
               for q in places]
    return 0.5 * height * float(np.dot(w, stretch))


def hencky(young):
    """Nominal uniaxial stress of the Hencky law, nu = 0: E ln(F)/F."""
    return lambda s: young * math.log(s) / s


def coupled_uniaxial(young, poisson=0.0):
    """Nominal stress of P = mu (F - F^-T) + lambda ln(J) F^-T in uniaxial strain."""
    mu, lam = lame(young, poisson)
    return lambda s: mu * (s - 1.0 / s) + lam * math.log(s) / s


def decoupled_uniaxial(young, poisson=0.0):
    """Nominal stress in uniaxial strain of the law with volume and shape apart (docs/method.md):
    tau = G dev(Bbar) + K/2 (J^2 - 1), P = tau/F."""
    mu, lam = lame(young, poisson)
    bulk = lam + 2.0 * mu / 3.0
    return lambda s: (mu * 2.0 / 3.0 * (s ** (4.0 / 3.0) - s ** (-2.0 / 3.0)) + 0.5 * bulk * (s * s - 1.0)) / s


def lame(young, poisson):
    """Lame's constants mu, lambda [Pa]."""
    return young / (2.0 * (1.0 + poisson)), young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))


def plane_strain_modulus(young, poisson):
    """E* = E/(1 - nu^2) [Pa]."""
    return young / (1.0 - poisson**2)


def elastica_tip(load, length, bending, steps=400):
    """Tip of a cantilever under a dead load `load` [N] across its free end: deflection/L and
    shortening/L, from EI theta'' = -P cos(theta), theta(0) = 0, theta'(L) = 0 (Bisshopp, Drucker 1945).
    `bending` is EI [N m2]; for a load per width, EI per width. Shooting with Runge-Kutta."""
    a = load * length**2 / bending
    h = 1.0 / steps

    def slope(state):
        theta, kappa = state[0], state[1]
        return np.array([kappa, -a * math.cos(theta), math.sin(theta), math.cos(theta)])

    def shoot(kappa):
        s = np.array([0.0, kappa, 0.0, 0.0])
        for _ in range(steps):
            k1 = slope(s)
            k2 = slope(s + 0.5 * h * k1)
            k3 = slope(s + 0.5 * h * k2)
            k4 = slope(s + h * k3)
            s = s + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return s

    end = shoot(bisect(lambda k: shoot(k)[1], 0.0, a, 50))
    return float(end[2]), float(1.0 - end[3])


# ------------------------------------------------------------------------------ rigid motion, friction


def ramped_speed(acceleration, ramp, t):
    """Speed [m/s] at t > ramp under an acceleration that rises linearly during `ramp`: a (t - ramp/2)."""
    return acceleration * (t - 0.5 * ramp)


def block_acceleration(push, press, friction, mass):
    """Acceleration [m/s2] of a block pushed along a plane that it is pressed on: (F - mu N)/m or 0."""
    return max(0.0, push - friction * press) / mass


def incline(kind, gravity, angle, friction):
    """Acceleration [m/s2] down a slope from rest, and whether it sticks or rolls (True) or slides: block,
    cylinder (rolls if tan(angle) <= 3 mu), sphere (if <= 7 mu/2) (Bardenhagen, Brackbill, Sulsky 2000)."""
    shape = {"block": (1.0, 0.0), "cylinder": (3.0, 2.0 / 3.0), "sphere": (3.5, 5.0 / 7.0)}
    limit, rolling = shape[kind]
    if math.tan(angle) <= limit * friction:
        return rolling * gravity * math.sin(angle), True
    return gravity * (math.sin(angle) - friction * math.cos(angle)), False


def discs_touch(distance, radius, speed):
    """Time [s] at which two discs, centres `distance` apart, each coming at `speed`, touch (Sulsky 1994)."""
    return (distance - 2.0 * radius) / (2.0 * speed)


# ------------------------------------------------------------------------------------------ contact


def hertz_line(load, radius, modulus):
    """Half width [m] and peak pressure [Pa] of a cylinder on a rigid plane under `load` [N/m]
    (Johnson, Contact Mechanics, 1985, eqs. 4.43, 4.45)."""
    a = math.sqrt(4.0 * load * radius / (math.pi * modulus))
    return a, 2.0 * load / (math.pi * a)


def hertz_sphere(load, radius, modulus):
    """Radius of the contact [m], peak pressure [Pa] and approach [m] of a sphere on a rigid plane under
    `load` [N] (Johnson 1985, eqs. 4.22-4.24)."""
    a = (3.0 * load * radius / (4.0 * modulus)) ** (1.0 / 3.0)
    return a, 3.0 * load / (2.0 * math.pi * a * a), a * a / radius


def hertz_impact(mass, radius, modulus, speed):
    """Contact time [s] and greatest force [N] of a sphere on a rigid plane (Johnson 1985, eqs. 11.22-11.24)."""
    k = 4.0 / 3.0 * modulus * math.sqrt(radius)
    deepest = (5.0 * mass * speed**2 / (4.0 * k)) ** 0.4
    return 2.94326593 * deepest / speed, k * deepest**1.5


def elastic_punch(modulus, radius, depth):
    """Force [N] of a flat circular rigid frictionless punch on an elastic half space: 2 a E* d
    (Sneddon 1965; Johnson 1985, eq. 3.36)."""
    return 2.0 * modulus * radius * depth


def elastic_punch_on_block(poisson, side, cells=16):
    """Stiffness of the same over 2 a E*, of a punch of radius 1 in the middle of a block 2 `side` wide and `side` deep between
    smooth walls, to about 0.2 %: extrapolated from pressures on squares of edges 1/`cells` and half of that."""
    return 2.0 * punch_of_squares(poisson, side, 2 * cells) - punch_of_squares(poisson, side, cells)


def punch_of_squares(poisson, side, cells):
    """The same for pressures that are constant over squares of edge 1/`cells`, those with their middles under the punch, over
    the radius of a circle of their area. A pressure cos(kx x) cos(ky y) moves the surface of a layer of depth H on a smooth
    base by 2 (cosh 2kH - 1)/(sinh 2kH + 2kH)/(k E*) of it (Johnson 1985, section 5.8)."""
    n = round(side * cells)
    place = (np.arange(n) + 0.5) / cells
    under = np.hypot(place[:, None], place) < 1.0
    wave = np.pi * np.arange(n) / side
    k = np.hypot(wave[:, None], wave)
    k[0, 0] = 1.0
    x = np.minimum(2.0 * k * side, 40.0)
    compliance = 2.0 / k * (np.cosh(x) - 1.0) / (np.sinh(x) + x)
    compliance[0, 0] = side * (1.0 - 2.0 * poisson) / (1.0 - poisson) ** 2  # over E*: confined compression
    pressure = np.zeros((n, n))

    def displacement(load):
        pressure[under] = load
        return idctn(compliance * dctn(pressure))[under]

    count = int(under.sum())
    load, _ = cg(LinearOperator((count, count), matvec=displacement, dtype=float), np.ones(count))
    area = 4.0 * count / cells**2
    return 4.0 * load.sum() / cells**2 / 2.0 / math.sqrt(area / math.pi)


def prandtl(shear):
    """Mean pressure [Pa] under a flat punch in plane strain, perfectly plastic: (2 + pi) k (Prandtl 1920)."""
    return (2.0 + math.pi) * shear


def circular_punch(shear, rough=False):
    """Mean pressure under a circular punch, for Mises with k = sigma/sqrt(3): 5.224 k smooth (+- 0.2 %), 5.53 k rough
    (+- 0.4 %), computed by limit_punch.py, 3.016 and 3.19 sigma. Tresca with k = sigma/2: 5.69 k and 6.05 k (Shield 1955;
    Eason, Shield 1960), 2.845 sigma: Mises is 6 % above it. (Its yield surface lies outside that of Tresca with the same
    sigma and inside that with the same k, so that 4.93 k and 5.69 k bound it.)"""
    return (5.525 if rough else 5.224) * shear


# --------------------------------------------------------------------------------- plastic flow


def johnson_cook_adiabatic(strain, a, b, n, c, m, rate_ratio, t_room, t_melt, density, heat, share, steps=20000):
    """Temperature [K] and flow stress [Pa] of an element strained at a constant rate, adiabatically:
    rho c dT = share sigma d(eps); closed for m = 1, else by Runge-Kutta."""
    factor = 1.0 + c * math.log(rate_ratio)
    scale = share / (density * heat * (t_melt - t_room))

    def cold(e):
        return (a + b * e**n) * factor

    if m == 1.0:
        theta = 1.0 - math.exp(-scale * factor * (a * strain + b * strain ** (n + 1.0) / (n + 1.0)))
    else:
        theta, h = 0.0, strain / steps

        def rate(e, q):
            return scale * cold(e) * (1.0 - max(q, 0.0) ** m)

        for i in range(steps):
            e = i * h
            k1 = rate(e, theta)
            k2 = rate(e + 0.5 * h, theta + 0.5 * h * k1)
            k3 = rate(e + 0.5 * h, theta + 0.5 * h * k2)
            k4 = rate(e + h, theta + h * k3)
            theta += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return t_room + theta * (t_melt - t_room), cold(strain) * (1.0 - theta**m)


def couette_torque(k, n, omega, inner, outer):
    """Torque per length [N] on a pin that turns at `omega` in a fixed ring, tau = k rate^n, creeping
    plane flow (Bird, Armstrong, Hassager, Dynamics of Polymeric Liquids, vol. 1, section 4.2)."""
    rate = 2.0 * omega / n / (inner ** (-2.0 / n) - outer ** (-2.0 / n))
    return 2.0 * math.pi * k * rate**n


def couette_spin(r, n, inner, outer):
    """Angular velocity of the material at r over that of the pin in the same flow."""
    r = np.asarray(r, dtype=float)
    return ((outer / r) ** (2.0 / n) - 1.0) / ((outer / inner) ** (2.0 / n) - 1.0)


def norton_shear(norton_k, norton_n):
    """k of tau = k (shear rate)^n for the Mises law sigma = NORTON_K (strain rate)^n."""
    return norton_k / math.sqrt(3.0) ** (1.0 + norton_n)


def tube_displacement(r, pressure, inner, outer, young, poisson):
    """Radial displacement [m] of a thick tube under inner pressure, plane strain (Lame; Timoshenko, Goodier,
    Theory of Elasticity, section 28)."""
    front = (1.0 + poisson) * pressure * inner**2 / (young * (outer**2 - inner**2))
    return front * ((1.0 - 2.0 * poisson) * r + outer**2 / r)


def tube_stress(r, pressure, inner, outer):
    """Radial and hoop stress [Pa] of the same tube."""
    front = pressure * inner**2 / (outer**2 - inner**2)
    return front * (1.0 - outer**2 / r**2), front * (1.0 + outer**2 / r**2)


def tube_limit(yield_stress, inner, outer):
    """Inner pressure [Pa] at which a perfectly plastic tube flows, plane strain, Mises:
    2/sqrt(3) sigma_y ln(b/a) (Hill 1950, section 5.2)."""
    return 2.0 / math.sqrt(3.0) * yield_stress * math.log(outer / inner)


def tube_widening(yield_stress, density, rate, inner, outer, r, steps=20000):
    """Times [s] and radii [m] of a ring that began at `r` in a rigid, perfectly plastic tube (Mises, plane strain)
    whose inner pressure rises with `rate` [Pa/s] on the initial face. With q = a da/dt the momentum balance gives
    p a0/a = 2 k ln(b/a) + rho (dq/dt ln(b/a) + q^2/2 (1/b^2 - 1/a^2)), 2 k = 2 sigma_y/sqrt(3)."""
    times, radii = [0.0], [r]
    a, q, t = inner, 0.0, tube_limit(yield_stress, inner, outer) / rate
    dt = 0.2 * t / steps
    while times[-1] < 1.2 * tube_limit(yield_stress, inner, outer) / rate and a < 1.5 * inner:
        b = math.sqrt(outer**2 + a * a - inner**2)
        log = math.log(b / a)
        push = rate * t * inner / a - 2.0 * yield_stress / math.sqrt(3.0) * log
        q = max(0.0, q + dt * (push / density - 0.5 * q * q * (1.0 / b**2 - 1.0 / a**2)) / log)
        a, t = a + dt * q / a, t + dt
        times.append(t)
        radii.append(math.sqrt(r * r + a * a - inner * inner))
    return np.array(times), np.array(radii)


def tool_torque(shear, radius, pin_radius=0.0, pin_length=0.0):
    """Torque [N m] of a full disc and of the side of a pin under a uniform shear stress [Pa]:
    2/3 pi tau R^3, 2 pi r^2 H tau."""
    return 2.0 / 3.0 * math.pi * shear * radius**3, 2.0 * math.pi * pin_radius**2 * pin_length * shear


# ------------------------------------------------------------------------------------------- heat

_erf = np.vectorize(math.erf, otypes=[float])


def erfc(x):
    """Complementary error function of an array."""
    return 1.0 - _erf(x)


def ierfc(x):
    """Its integral from x to infinity (Carslaw, Jaeger, Conduction of Heat in Solids, app. II)."""
    x = np.asarray(x, dtype=float)
    return np.exp(-x * x) / math.sqrt(math.pi) - x * erfc(x)


def half_space_step(x, t, diffusivity):
    """Temperature over the step of the surface of a half space (Carslaw, Jaeger 1959, 2.4): erfc."""
    return erfc(np.asarray(x) / (2.0 * math.sqrt(diffusivity * t)))


def half_space_flux(x, t, flux, conductivity, diffusivity):
    """Temperature rise [K] of a half space under a constant flux [W/m2] (Carslaw, Jaeger 1959, 2.9)."""
    s = math.sqrt(diffusivity * t)
    return 2.0 * flux * s / conductivity * ierfc(np.asarray(x) / (2.0 * s))


def slab_mode(x, t, length, diffusivity, mode=1):
    """Decaying mode of an insulated slab over its amplitude: cos(k x) exp(-alpha k^2 t), k = mode pi/L."""
    k = mode * math.pi / length
    return np.cos(k * np.asarray(x)) * math.exp(-diffusivity * k * k * t)


def robin_slab(place, biot, fourier, terms=60):
    """Temperature over its start at place = x/L (0: insulated middle, 1: face) of a slab that cools through
    a film: sum of 4 sin z/(2 z + sin 2z) exp(-z^2 Fo) cos(z x/L), z tan z = Bi (Carslaw, Jaeger 1959, 3.11)."""
    total = np.zeros_like(np.asarray(place, dtype=float))
    for i in range(terms):
        z = bisect(lambda q: q * math.sin(q) - biot * math.cos(q), i * math.pi, i * math.pi + 0.5 * math.pi)
        total = total + (4.0 * math.sin(z) / (2.0 * z + math.sin(2.0 * z)) * math.exp(-z * z * fourier)
                         * np.cos(z * np.asarray(place, dtype=float)))
    return total


def stefan_root(stefan):
    """lambda of the one-phase Stefan problem: lambda exp(lambda^2) erf(lambda) = Ste/sqrt(pi)."""
    return bisect(lambda q: q * math.exp(q * q) * math.erf(q) - stefan / math.sqrt(math.pi), 1e-9, 3.0)


def bessel_k0(x, steps=2000):
    """Modified Bessel function K0: integral of exp(-x cosh u) over u > 0 (Abramowitz, Stegun 9.6.24)."""
    top = math.acosh(1.0 + 60.0 / x)
    u = np.linspace(0.0, top, steps + 1)
    return trapezoid(np.exp(-x * np.cosh(u)), u)


def moving_point(ahead, aside, power, speed, conductivity, diffusivity):
    """Steady rise [K] around a point source on a half space (Rosenthal 1946); `ahead` along its motion."""
    r = math.hypot(ahead, aside)
    return power / (2.0 * math.pi * conductivity * r) * math.exp(-speed * (ahead + r) / (2.0 * diffusivity))


def moving_line(ahead, aside, power, thickness, speed, conductivity, diffusivity):
    """Steady rise [K] around a line source through a plate (Rosenthal 1946)."""
    r = math.hypot(ahead, aside)
    return (power / thickness / (2.0 * math.pi * conductivity) * math.exp(-speed * ahead / (2.0 * diffusivity))
            * bessel_k0(speed * r / (2.0 * diffusivity)))


def moving_line_transient(ahead, aside, t, power, thickness, speed, conductivity, diffusivity, steps=20000):
    """The same at time t after the source began (Carslaw, Jaeger 1959, 10.7)."""
    s = np.geomspace(1e-6 * t, t, steps + 1)
    f = np.exp(-((ahead + speed * s) ** 2 + aside**2) / (4.0 * diffusivity * s)) / s
    return power / thickness / (4.0 * math.pi * conductivity) * trapezoid(f, s)


def heated_disc(t, flux, radius, conductivity, diffusivity):
    """Rise [K] in the middle of a disc of constant flux on a half space (Carslaw, Jaeger 1959, 10.5)."""
    s = math.sqrt(diffusivity * t)
    return 2.0 * flux * s / conductivity * (1.0 / math.sqrt(math.pi) - float(ierfc(radius / (2.0 * s))))


def heat_partition(one, other):
    """Share of frictional heat that enters the first of two half spaces, each (k, rho, c):
    e1/(e1 + e2), e = sqrt(k rho c)."""
    e1, e2 = math.sqrt(math.prod(one)), math.sqrt(math.prod(other))
    return e1 / (e1 + e2)


# -------------------------------------------------------------------------------- other bodies


def rigid_energy(density, volume, speed):
    """Kinetic energy [J]."""
    return 0.5 * density * volume * speed**2


def spinning_disc_stress(density, omega, radius, poisson):
    """Stress [Pa] in the middle of a free spinning disc, plane stress: (3 + nu) rho w^2 a^2/8
    (Timoshenko, Goodier, section 32)."""
    return (3.0 + poisson) * density * omega**2 * radius**2 / 8.0
