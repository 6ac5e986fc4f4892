#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The stirred layer: metal sheared by its surface, which moves at V along itself, by finite differences.

Quasi-static: the shear stress tau is the same at all depths z. J2 flow: the law's stress at strain, rate and temperature is
sqrt(3) tau, the shear rate sqrt(3) times the rate. Of the work tau times shear rate `heated` heats, conduction carries it
down to `depth`, which is at rest and keeps the temperature T0; the surface is insulated. V is reached linearly in `ramp`.

The mesh is finest (10 um) at the surface and grows by 3 % from node to node. scipy's BDF integrates temperatures and
the states of the law; tau at each time is that whose rates add up to V.

usage: stirred_layer.py [--speed V] [--start T0] [--law NAME] [--times t,t,...]
"""
import argparse
import dataclasses

import numpy as np
from scipy.integrate import solve_ivp

FINEST, GROWTH = 10e-6, 1.03


@dataclasses.dataclass(frozen=True)
class Law:
    """A flow law by its inverse, the rate at which metal flows under a stress, and by how its state follows the strain.

    `state` has a row for each internal variable; the first is the plastic strain."""

    melting: float = 1356.0     # [K]
    softens: float = 0.95       # of `melting`: from here on the strength falls linearly to 0

    def begin(self):
        """The state before any strain."""
        return [0.0]

    def left(self, temp):
        """Part of the strength that melting leaves."""
        return np.clip((self.melting - temp)/(self.melting*(1.0 - self.softens)), 1e-9, 1.0)

    def log_rate(self, sigma, temp, state):
        """ln of the rate at which the metal flows under sigma (-inf: it does not), and its derivative by sigma."""
        raise NotImplementedError

    def by_strain(self, temp, state, log_rate):
        """Derivative of the state by the plastic strain."""
        return np.ones((1, len(temp)))


@dataclasses.dataclass(frozen=True)
class JohnsonCook(Law):
    """sigma = (A + B eps^n)(1 + C ln(rate/rate0))(1 - ((T - room)/(melting - room))^m). The program has the rate's factor not below a
    half; what flows more slowly here, at exp(-1/(2 C)) of the rate 1/s, adds nothing."""

    a: float = 0.0
    c: float = 0.0
    b: float = 0.0
    n: float = 1.0
    m: float = 1.0
    rate0: float = 1.0
    room: float = 298.0

    def log_rate(self, sigma, temp, state):
        theta = np.clip((temp - self.room)/(self.melting - self.room), 1e-30, 1.0 - 1e-9)
        hardening = self.b*(np.maximum(state[0], 0.0) + 1e-9)**self.n if self.b else 0.0
        static = (self.a + hardening)*(1.0 - theta**self.m)
        slope = 1.0/(self.c*static)
        return (sigma - static)*slope + np.log(self.rate0), slope


@dataclasses.dataclass(frozen=True)
class SellarsTegart(Law):
    """rate = A exp(-Q/(R T)) sinh(alpha sigma)^n."""

    alpha: float = 1.0
    n: float = 1.0
    log_a: float = 0.0
    q: float = 0.0

    def log_rate(self, sigma, temp, state):
        part = self.alpha/self.left(temp)
        x = np.maximum(part*sigma, 1e-12)
        log_sinh = x + np.log1p(-np.exp(-2.0*x)) - np.log(2.0)
        return self.log_a - self.q/(8.314462618*temp) + self.n*log_sinh, self.n*part/np.tanh(x)


@dataclasses.dataclass(frozen=True)
class TwoPhase(Law):
    """The two-phase dislocation law of docs/microstructure.md without annealing; state: strain, sqrt(rho_w), rho_c, f.
    alpha* is a/(T + b) + c between two temperatures, and constant outside."""

    shear: float = 0.0
    sigma0: float = 0.0
    taylor: float = 3.06
    alpha: float = 0.25
    burgers: float = 1.0
    beta: float = 0.0
    k0: float = 0.0
    a: float = 30000.0
    b: float = 14900.0
    rate0: float = 1000.0
    size: float = 1.0
    f0: float = 0.25
    f_end: float = 0.06
    gamma: float = 3.2
    walls: float = 1.0
    interior: float = 1.0
    star: tuple = (0.0, 0.0, 0.0)
    star_range: tuple = (0.0, 1e5)
    star_ends: tuple = (0.0, 0.0)

    def begin(self):
        return [0.0, np.sqrt(self.walls), self.interior, self.f0]

    def bounded(self, state):
        """The state within what can be, where a trial of the integration leaves that."""
        return np.maximum(state[1], 1.0), np.maximum(state[2], 1.0), np.clip(state[3], self.f_end, self.f0)

    def log_rate(self, sigma, temp, state):
        u, cells, f = self.bounded(state)
        mean = f*u + (1.0 - f)*np.sqrt(cells)
        over = np.maximum(sigma/self.left(temp) - self.sigma0, 1.0)
        exponent = self.a/temp
        full = self.taylor*self.alpha*self.shear*self.burgers*mean
        return exponent*np.log(over/full) + np.log(self.rate0/self.taylor), exponent/(over*self.left(temp))

    def by_strain(self, temp, state, log_rate):
        u, cells, f = self.bounded(state)
        inside = (temp >= self.star_range[0]) & (temp <= self.star_range[1])
        star = np.where(inside, self.star[0]/(temp + self.star[1]) + self.star[2],
                        np.where(temp < self.star_range[0], *self.star_ends))
        k = self.k0*np.exp(np.minimum(80.0, -temp/self.b*(log_rate + np.log(self.taylor/self.rate0))))
        crossed = 6.0*self.beta/(self.burgers*self.size)*np.sqrt(f*u*u + (1.0 - f)*cells)
        third = (1.0 - f)**(-1.0/3.0)
        walls = (1.0 - f)*(crossed*third + np.sqrt(3.0)*self.beta*u/self.burgers)/f - k*u*u
        interior = star/(np.sqrt(3.0)*self.burgers)*u - crossed*third - k*cells
        fraction = (self.f_end - f)/self.gamma
        return np.array([np.ones(len(temp)), *(self.taylor*rate for rate in (0.5*walls/u, interior, fraction))])


COPPER = JohnsonCook(a=200e6, c=0.05)
HARDENING = JohnsonCook(a=90e6, b=292e6, n=0.31, c=0.025, m=1.09)
TWO_PHASE = TwoPhase(shear=124e9/2.68, burgers=2.56e-10, beta=0.0018, k0=4.6, size=10.0, walls=1e13, interior=1e12,
                     star=(600.0, 885.6, -0.3), star_range=(298.0, 1100.0), star_ends=(0.216, 0.002))
HOT = SellarsTegart(alpha=1.93e-8, n=5.0, log_a=14.58, q=145e3)
LAWS = {"copper": COPPER, "johnson-cook": HARDENING, "two-phase": TWO_PHASE, "sellars-tegart": HOT}


@dataclasses.dataclass(frozen=True)
class Layer:
    """A stirred layer; `at` gives its state."""

    speed: float = 0.5          # of the surface [m/s]
    start: float = 700.0        # [K]
    law: object = COPPER
    density: float = 8960.0
    heat_capacity: float = 386.0
    conductivity: float = 391.0
    heated: float = 0.9
    depth: float = 10e-3        # [m]
    ramp: float = 20e-3         # [s]

    def mesh(self):
        n = int(np.ceil(np.log(1.0 + self.depth*(GROWTH - 1.0)/FINEST)/np.log(GROWTH)))
        widths = FINEST*GROWTH**np.arange(n)
        return np.concatenate([[0.0], np.cumsum(widths)*self.depth/widths.sum()])

    def at(self, times):
        """State at each of the rising `times` [s]: dicts of tau [Pa], work [J/m2], and of the functions of depth z:
        T [K], v [m/s], strain."""
        z = self.mesh()
        widths = np.diff(z)
        middle = 0.5*(z[1:] + z[:-1])
        n = len(middle)
        gap = np.diff(np.concatenate([middle, [self.depth]]))      # between cells, and to the cold end
        last = {"tau": 1e8}                                        # where the search begins; kept from time to time

        begin_with = self.law.begin()
        scale = np.repeat(  # of strain, and of densities and fractions what they begin with
            np.maximum(np.abs(begin_with), [1.0] + [1e-3]*(len(begin_with) - 1)), n)

        def parts(y):
            return y[:n], (y[n:-1]*scale).reshape(len(begin_with), n)

        def rates(t, y):
            temp, state = parts(y)
            tau, log_rate = self.balance(min(1.0, t/self.ramp)*self.speed, temp, state, widths, last)
            rate = np.exp(log_rate)
            flux = np.concatenate([[0.0], self.conductivity*np.diff(np.concatenate([temp, [self.start]]))/gap])
            power = tau*np.sqrt(3.0)*rate
            heating = (np.diff(flux)/widths + self.heated*power)/(self.density*self.heat_capacity)
            change = (self.law.by_strain(temp, state, log_rate)*rate).ravel()/scale
            return np.concatenate([heating, change, [(power*widths).sum()]])

        y = np.concatenate([np.full(n, self.start), np.repeat(begin_with, n)/scale, [0.0]])
        stops = sorted({self.ramp, *times})
        found, begin = {}, 1e-6*self.ramp
        for stop in stops:
            y = solve_ivp(rates, (begin, stop), y, method="BDF", rtol=1e-5, atol=[1e-3]*n + [1e-5]*len(scale) + [1.0],
                          first_step=1e-7*self.ramp if begin < 1e-3*self.ramp else None).y[:, -1]
            begin = stop
            temp, state = parts(y)
            tau, log_rate = self.balance(min(1.0, stop/self.ramp)*self.speed, temp, state, widths, last)
            below = np.concatenate([np.cumsum((np.sqrt(3.0)*np.exp(log_rate)*widths)[::-1])[::-1], [0.0]])
            found[stop] = {"tau": tau, "work": y[-1], "T": curve(middle, temp), "v": curve(z, below),
                           "strain": curve(middle, state[0])}
        return [found[t] for t in times]

    def balance(self, speed, temp, state, widths, last):
        """tau at which the shear rates add up to `speed`, by Newton's method in the logarithm of the sum; ln of the rates."""
        tau = last["tau"]
        low, high = 0.0, np.inf
        for _ in range(200):
            log_rate, slope = self.law.log_rate(np.sqrt(3.0)*tau, temp, state)
            log_rate = np.minimum(log_rate, 60.0)
            shear = np.sqrt(3.0)*np.exp(log_rate)
            total = (shear*widths).sum()
            low, high = (tau, high) if total < speed else (low, tau)
            # where a cell begins to flow, its rate jumps, and tau may lie in the jump
            if abs(total - speed) < 1e-9*speed or high - low < 1e-13*tau:
                break
            step = np.log(speed/total)/(np.sqrt(3.0)*(shear*slope*widths).sum()/total) if total > 0.0 else tau
            tau = tau + step
            if not low < tau < high:
                tau = 0.5*(low + high) if np.isfinite(high) else 2.0*max(low, 1.0)
        last["tau"] = tau
        return tau, log_rate


def curve(x, y):
    return lambda z: np.interp(z, x, y)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--speed", type=float, default=0.5)
    parser.add_argument("--start", type=float, default=700.0)
    parser.add_argument("--law", choices=LAWS, default="copper")
    parser.add_argument("--times", default="0.1,0.2,0.5,2")
    options = parser.parse_args()
    times = [float(word) for word in options.times.split(",")]
    for t, s in zip(times, Layer(options.speed, options.start, LAWS[options.law]).at(times)):
        depths = 1e-3*np.array([0.25, 0.5, 1.0, 2.0])
        print(f"{t:5g} s  tau {1e-6*s['tau']:5.1f} MPa  T {np.round(s['T'](1e-3*np.array([0, .5, 1, 2])))}  v mm/s "
              f"{np.round(1e3*s['v'](depths), 2)}  strain {np.round(s['strain'](depths), 2)}  work {1e-6*s['work']:.2f} MJ/m2")


if __name__ == "__main__":
    main()
