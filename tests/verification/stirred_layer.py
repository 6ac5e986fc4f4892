#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The stirred layer: metal sheared by its surface, which moves at V along itself, by finite differences.

Quasi-static: the shear stress tau is the same at all depths z. J2 flow: the law's stress at strain, rate and temperature is
sqrt(3) tau, the shear rate sqrt(3) times the rate. Of the work tau times shear rate `heated` heats, conduction carries it
down to `depth`, which is at rest and keeps the temperature T0; the surface is insulated. V is reached linearly in `ramp`.

The mesh is finest (10 um) at the surface and grows by 3 % from node to node. scipy's BDF integrates temperatures and
strains; tau at each time is that whose rates add up to V.

usage: stirred_layer.py [--speed V] [--start T0] [--times t,t,...]
"""
import argparse
import dataclasses

import numpy as np
from scipy.integrate import solve_ivp

FINEST, GROWTH = 10e-6, 1.03


@dataclasses.dataclass(frozen=True)
class JohnsonCook:
    """sigma = (A + B eps^n)(1 + C ln(rate/rate0))(1 - ((T - room)/(melting - room))^m), the rate's factor not below a half."""

    a: float
    c: float
    b: float = 0.0
    n: float = 1.0
    m: float = 1.0
    rate0: float = 1.0
    room: float = 298.0
    melting: float = 1356.0

    def log_rate(self, sigma, temp, strain):
        """ln of the rate at which the metal flows under sigma (-inf: it does not), and its derivative by sigma."""
        theta = np.clip((temp - self.room)/(self.melting - self.room), 1e-30, 1.0 - 1e-9)
        static = (self.a + self.b*(strain + 1e-9)**self.n)*(1.0 - theta**self.m)
        factor = sigma/static
        slope = 1.0/(self.c*static)
        return np.where(factor > 0.5, (factor - 1.0)/self.c + np.log(self.rate0), -np.inf), slope


COPPER = JohnsonCook(a=200e6, c=0.05)


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

        def rates(t, y):
            temp, strain = y[:n], y[n:2*n]
            tau, shear = self.balance(min(1.0, t/self.ramp)*self.speed, temp, strain, widths, last)
            flux = np.concatenate([[0.0], self.conductivity*np.diff(np.concatenate([temp, [self.start]]))/gap])
            power = tau*shear
            heating = (np.diff(flux)/widths + self.heated*power)/(self.density*self.heat_capacity)
            return np.concatenate([heating, shear/np.sqrt(3.0), [(power*widths).sum()]])

        y = np.concatenate([np.full(n, self.start), np.zeros(n + 1)])
        stops = sorted({self.ramp, *times})
        found, begin = {}, 1e-6*self.ramp
        for stop in stops:
            y = solve_ivp(rates, (begin, stop), y, method="BDF", rtol=1e-5, atol=[1e-3]*n + [1e-5]*n + [1.0],
                          first_step=1e-7*self.ramp if begin < 1e-3*self.ramp else None).y[:, -1]
            begin = stop
            tau, shear = self.balance(min(1.0, stop/self.ramp)*self.speed, y[:n], y[n:2*n], widths, last)
            below = np.concatenate([np.cumsum((shear*widths)[::-1])[::-1], [0.0]])
            found[stop] = {"tau": tau, "work": y[-1], "T": curve(middle, y[:n]), "v": curve(z, below),
                           "strain": curve(middle, y[n:2*n])}
        return [found[t] for t in times]

    def balance(self, speed, temp, strain, widths, last):
        """tau at which the shear rates add up to `speed`, by Newton's method in the logarithm of the sum."""
        tau = last["tau"]
        low, high = 0.0, np.inf
        for _ in range(200):
            log_rate, slope = self.law.log_rate(np.sqrt(3.0)*tau, temp, strain)
            shear = np.sqrt(3.0)*np.exp(np.minimum(log_rate, 60.0))
            total = (shear*widths).sum()
            if abs(total - speed) < 1e-9*speed:
                break
            low, high = (tau, high) if total < speed else (low, tau)
            step = np.log(speed/total)/(np.sqrt(3.0)*(shear*slope*widths).sum()/total) if total > 0.0 else tau
            tau = tau + step
            if not low < tau < high:
                tau = 0.5*(low + high) if np.isfinite(high) else 2.0*max(low, 1.0)
        last["tau"] = tau
        return tau, shear


def curve(x, y):
    return lambda z: np.interp(z, x, y)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--speed", type=float, default=0.5)
    parser.add_argument("--start", type=float, default=700.0)
    parser.add_argument("--times", default="0.1,0.2,0.5,2")
    options = parser.parse_args()
    times = [float(word) for word in options.times.split(",")]
    for t, s in zip(times, Layer(options.speed, options.start).at(times)):
        depths = 1e-3*np.array([0.25, 0.5, 1.0, 2.0])
        print(f"{t:5g} s  tau {1e-6*s['tau']:5.1f} MPa  T {np.round(s['T'](1e-3*np.array([0, .5, 1, 2])))}  v mm/s "
              f"{np.round(1e3*s['v'](depths), 2)}  strain {np.round(s['strain'](depths), 2)}  work {1e-6*s['work']:.2f} MJ/m2")


if __name__ == "__main__":
    main()
