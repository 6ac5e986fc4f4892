# SPDX-License-Identifier: MIT
"""Figures of other programs, and the core time they stand for.

The errors were measured with NairnMPM (bars in plane strain, one cell high). Its core time is an
estimate: particles x steps / speed, with 0.25 million particle-steps per core-second (measured on this kind of
machine), 4 particles per cell, and steps of CFL 0.5 or, for conduction, of half the stable one
(kappa dt/h^2 = 0.25). FMPM(2) takes 1.9 times the time. With 2 particles per cell all its times halve.
"""

import dataclasses

SPEED = 0.25e6  # particle-steps per core-second
CELLS = (16, 32, 64, 128)
NOTE = "NairnMPM: measured errors;\ncore time estimated as\nparticles x steps / 0.25 M/s,\n4 particles per cell,\n"


@dataclasses.dataclass(frozen=True)
class Peer:
    """Quoted points (resolution, error, estimated core-seconds) of a program."""

    label: str
    note: str
    points: tuple


def wave(errors, times=1.0):
    """Five periods of 2 L/c at CFL 0.5, n cells of 4 particles."""
    return tuple((n, e, times * 4 * n * (10 * n / 0.5) / SPEED) for n, e in zip(CELLS, errors))


def heat(errors):
    """kappa t/L^2 = 0.1 at kappa dt/h^2 = 0.25, n cells of 4 particles."""
    return tuple((n, e, 4 * n * (0.1 * n * n / 0.25) / SPEED) for n, e in zip(CELLS, errors))


PEERS = {
    "standing_wave": (
        Peer("NairnMPM uGIMP FLIP", NOTE + "CFL 0.5", wave((1.1e-1, 2.6e-2, 6.3e-3, 1.8e-3))),
        Peer("NairnMPM FMPM(2)", NOTE + "CFL 0.5", wave((4.6e-2, 1.2e-2, 2.9e-3, 1.4e-3), 1.9)),
    ),
    "heat_insulated": (
        Peer("NairnMPM", NOTE + "step 0.25 h\u00b2/\u03ba", heat((6.6e-4, 1.6e-4, 4.1e-5, 1.1e-5))),),
    "heat_fixed": (
        Peer("NairnMPM", NOTE + "step 0.25 h\u00b2/\u03ba", heat((2.2e-2, 7.6e-3, 2.7e-3, 9.4e-4))),),
}
