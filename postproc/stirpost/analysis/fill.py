# SPDX-License-Identifier: MIT
"""How full the room of a track is, and where metal is missing beyond what disorder of particles explains.

Each particle fills a cube of its volume. What is missing, 1 less the fill, is exact in volume on a raster, and weighted by Gaussian kernels:
a ball, a needle of the same volume along the track, and plates at several slopes and rods, a quarter as long and wide as the track.
Outside of the track nothing is missing, and the sum of a kernel that reaches there is divided by the root of its weight inside, as its
deviation is less by that. A kernel over N particles at random places (a Poisson process) has the cumulants of shot noise
K(t) = int exp(-t g) - 1 + t g, g the kernel over its density of particles; its weighted sum lacks the part d = -K'(t) with the rate
I = t d - K (saddle point), as a normal field does beyond u = sqrt(2 I) deviations. Such a field exceeds u in
V |L|^(1/2) (u2 - 1) exp(-u2/2)/(2 pi)^2 places, L the covariance of its slopes (R. J. Adler, The Geometry of Random Fields, 1981).
Each kernel's threshold is the part for which FALSE places are expected in the track, over all kernels. Beside what is found the
search goes on in the room of what is found only, with the lower threshold that belongs to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FALSE = 0.01  # places where disorder alone makes a void, in a track of particles at random places
STRETCH = 8.0  # of the needle along the track: half as wide as the ball
STEPS = 4  # of the raster over a particle's edge, two over the thickness of needle and plates
CUBE = 1.0 / 12.0  # variance of the cube of a particle


@dataclass(frozen=True)
class Kernel:
    """Deviations along the track, across and in the plane, in edges of a particle; slope of the plane against the vertical [rad]."""

    along: float
    thin: float
    wide: float
    slope: float = 0.0

    @property
    def whole(self) -> np.ndarray:
        """Standard deviations of the kernel, including those of the cubes."""
        return np.sqrt(np.array([self.along, self.thin, self.wide]) ** 2 + CUBE)

    def threshold(self, room: float, kernels: int) -> float:
        """The part missing beyond which FALSE/kernels places are expected in a room of so many particles, two deviations each way at least."""
        size = float(self.whole.prod())
        room = max(room, 64.0 * size)
        u2 = 20.0
        for _ in range(60):
            u2 = max(2.0, 2.0 * np.log(max(1.0, room * kernels / FALSE / (8.0 * np.sqrt(2.0) * np.pi**2 * size) * (u2 - 1.0))))
        r = np.linspace(0.0, 6.0, 400)
        g = np.exp(-0.5 * r * r) / ((2.0 * np.pi) ** 1.5 * size)
        shell = 4.0 * np.pi * r * r * size * r[1]
        low, high = 1e-6, 1e6
        for _ in range(60):
            t = np.sqrt(low * high)
            missing = float((shell * g * -np.expm1(-t * g)).sum())
            if t * missing - float((shell * (np.expm1(-t * g) + t * g)).sum()) < 0.5 * u2:
                low = t
            else:
                high = t
        return missing


def kernels(length: float, depth: float) -> tuple[list[Kernel], list[Kernel]]:
    """Needle and ball, which find holes, and plates; for a track of a length and depth in edges of a particle."""
    slender = STRETCH ** (-1.0 / 3.0)
    needle = Kernel(min(STRETCH * slender, 0.25 * length), slender, slender)
    plate = Kernel(0.25 * length, slender, max(0.25 * depth, slender))
    # Plates are turned about the track, each from the last one by an angle at which their rims are two thicknesses apart
    slopes = int(np.ceil(0.5 * np.pi * plate.whole[2] / plate.whole[1]))
    rods = [Kernel(plate.along, a, a) for a in (np.sqrt(plate.thin * plate.wide), plate.wide)]
    return [needle, Kernel(1.0, 1.0, 1.0)], [Kernel(plate.along, plate.thin, plate.wide, np.pi * k / slopes) for k in range(slopes)] + rods


def deposit(x: np.ndarray, edge: np.ndarray, axes: tuple[np.ndarray, ...], step: float) -> np.ndarray:
    """Exact volume fraction of cubes in each cell of a raster; `axes` has the cell centres."""
    shape = tuple(len(a) for a in axes)
    low = (x - 0.5 * edge[:, None] - [a[0] - 0.5 * step for a in axes]) / step
    first = np.floor(low).astype(int)
    reach = np.arange(int(np.ceil(edge.max(initial=0.0) / step)) + 1)
    cells, parts = [], []
    for k, count in enumerate(shape):
        cell = first[:, k, None] + reach
        part = np.minimum(cell + 1, (low[:, k] + edge / step)[:, None]) - np.maximum(cell, low[:, k, None])
        parts.append(np.where((cell >= 0) & (cell < count), np.clip(part, 0.0, None), 0.0))
        cells.append(cell.clip(0, count - 1))
    fill = np.zeros(int(np.prod(shape)))
    for i in reach:
        for j in reach:
            part = (parts[0][:, i] * parts[1][:, j])[:, None] * parts[2]
            place = ((cells[0][:, i] * shape[1] + cells[1][:, j]) * shape[2])[:, None] + cells[2]
            fill += np.bincount(place.ravel(), part.ravel(), len(fill))
    return fill.reshape(shape)


class Missing:
    """Points without metal on a raster with STEPS points along the edge of a particle, and those of them that random disorder of the particles does not explain."""

    def __init__(self, missing: np.ndarray):
        self.missing, shape = missing, missing.shape
        length, _, depth = (n / STEPS for n in shape)
        self.holes, self.plates = kernels(length, depth)
        room = float(np.prod(shape)) / STEPS**3
        self.count = len(self.holes) + len(self.plates)
        self.thresholds = {k: k.threshold(room, self.count) for k in self.holes + self.plates}
        self.prepare()
        self.core, self.mean = self.found_holes()
        self.found = self.found_seams()

    def prepare(self) -> None:
        """Sides of the transform, beyond which kernels do not reach around, and its wave numbers in edges of a particle."""
        from scipy.fft import next_fast_len

        wide = max(k.wide for k in self.plates)
        reach = max(k.along for k in self.plates + self.holes), max(wide, 1.0), max(wide, 1.0)
        self.sides = [next_fast_len(int(n + 3.0 * STEPS * r), True) for n, r in zip(self.missing.shape, reach)]
        s, n, z = (2.0 * np.pi * STEPS * f(side) for f, side in zip((np.fft.rfftfreq, np.fft.fftfreq, np.fft.rfftfreq), self.sides))
        self.waves = s[:, None, None], n[:, None], z

    def spectrum(self, values: np.ndarray, along: float) -> np.ndarray:
        """Transforms of the sections of the track, after a mean along it; the kernels of all slopes share it."""
        from scipy.fft import irfft, rfft, rfftn

        damped = rfft(values, self.sides[0], axis=0) * np.exp(-0.5 * (self.waves[0] * along) ** 2)
        return rfftn(irfft(damped, self.sides[0], axis=0)[: len(values)], self.sides[1:])

    def weighted(self, spectrum: np.ndarray, kernel: Kernel) -> np.ndarray:
        """Mean with the weights of a kernel around each place, from the spectrum of its mean along the track."""
        from scipy.fft import irfftn

        _, n, z = self.waves
        cos, sin = np.cos(kernel.slope), np.sin(kernel.slope)
        across, up = cos * n + sin * z, cos * z - sin * n
        damped = np.exp(-0.5 * ((across * kernel.thin) ** 2 + (up * kernel.wide) ** 2))
        return irfftn(spectrum * damped, self.sides[1:])[:, :self.missing.shape[1], :self.missing.shape[2]]

    def found_holes(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres of needles and balls that are too empty, a particle or more below the lid and above the bottom, which are not known
        finer; and the part that is missing in the room of the needle or the ball, the larger of the two."""
        core, room = np.zeros(self.missing.shape, dtype=bool), np.ones(self.missing.shape)
        part, means = np.full(core.shape, -np.inf), []
        for kernel in self.holes:
            mean, weight = (self.weighted(self.spectrum(values, kernel.along), kernel) for values in (self.missing, room))
            inner = mean / np.sqrt(weight)
            inner[:, :, :STEPS - 1] = inner[:, :, 1 - STEPS:] = 0.0
            core |= inner >= self.thresholds[kernel]
            means.append((kernel, inner))
            part = np.maximum(part, mean / weight)
        if core.any():
            particles, first = self.around(core).sum() / STEPS**3, core
            core = np.logical_or.reduce([core, *(beside(inner >= kernel.threshold(particles, self.count), first) for kernel, inner in means)])
        return core, part

    def around(self, core: np.ndarray) -> np.ndarray:
        """Cubes within the size of a particle of the centres, which bound a hole."""
        from scipy.ndimage import distance_transform_edt

        return distance_transform_edt(~core) <= STEPS if core.any() else core

    def found_seams(self) -> np.ndarray:
        """Centres of plates and rods that are too empty even without the holes in them; a layer of one particle at the bottom and the lid is left out."""
        holes = self.around(self.core)
        inner = np.where(holes, 0.0, self.missing)
        inner[:, :, :STEPS] = inner[:, :, -STEPS:] = 0.0
        spectrum, room = (self.spectrum(values, self.plates[0].along) for values in (inner, 1.0 - holes))
        found, means = np.zeros(holes.shape, dtype=bool), {}
        for kernel in self.plates:
            means[kernel] = self.weighted(spectrum, kernel) / np.sqrt(np.clip(self.weighted(room, kernel), 1e-3, 1.0))
            found |= means[kernel] >= self.thresholds[kernel]
        particles = found.sum() / STEPS**3
        for kernel, mean in means.items():
            centres = beside(mean >= kernel.threshold(particles, self.count), found)
            means[kernel] = spread(centres, disc(kernel)) > 0.5 if centres.any() else centres
        return np.logical_or.reduce([holes, *means.values()])

    @property
    def smallest(self) -> tuple[float, float, float]:
        """Section of a cylinder, volume of a sphere, width of a seam through the track that reach the thresholds, in edges of a particle."""
        from scipy.special import erf, gammaincinv

        (needle, ball), plate = self.holes, self.plates[0]
        depth = self.missing.shape[2] / STEPS
        across, radius2 = needle.whole[1], 2.0 * ball.whole[0] ** 2 * gammaincinv(1.5, self.thresholds[ball])
        seen = erf(0.5 * self.missing.shape[0] / STEPS / plate.along / np.sqrt(2.0)) * erf(max(0.5 * depth - 1.0, 0.5) / plate.wide / np.sqrt(2.0))
        return (-2.0 * np.pi * across**2 * float(np.log1p(-self.thresholds[needle])), 4.0 / 3.0 * np.pi * float(radius2) ** 1.5,
                np.sqrt(2.0 * np.pi) * plate.whole[1] * self.thresholds[plate] / float(seen))


def beside(places: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Connected regions of which a part has been found."""
    from scipy.ndimage import label

    parts, _ = label(places, np.ones((3, 3, 3)))
    return np.isin(parts, np.setdiff1d(np.unique(parts[found]), 0))


def spread(centres: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Sum of a kernel around each centre. scipy.signal has it too, but takes a second to load."""
    from scipy.fft import irfftn, next_fast_len, rfftn

    sides = [next_fast_len(a + b - 1, True) for a, b in zip(centres.shape, kernel.shape)]
    whole = irfftn(rfftn(centres.astype(float), sides) * rfftn(kernel, sides), sides)
    return whole[tuple(slice((b - 1) // 2, (b - 1) // 2 + a) for a, b in zip(centres.shape, kernel.shape))]


def disc(kernel: Kernel) -> np.ndarray:
    """Raster of an ellipsoid as wide as a plate or a rod, and a particle at least to each side."""
    thin, wide = max(kernel.thin, 1.0), max(kernel.wide, 1.0)
    reach = int(np.ceil(STEPS * wide))
    across = np.arange(-reach, reach + 1) / STEPS
    s, n, z = np.meshgrid(np.arange(-STEPS, STEPS + 1) / STEPS, across, across, indexing="ij")
    cos, sin = np.cos(kernel.slope), np.sin(kernel.slope)
    return (s**2 + ((cos * n + sin * z) / thin) ** 2 + ((cos * z - sin * n) / wide) ** 2 <= 1.0).astype(float)
