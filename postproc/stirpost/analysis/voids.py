# SPDX-License-Identifier: MIT
"""Holes in the track behind the pin, or behind the face of a tool without a pin: tunnels, grooves, lack of fill at the root, and what is too small to be told.

A probe is a ball, or an ellipsoid of the same volume that is STRETCH times as slender along the track, which fits between the
centres of particles, the bottom of the metal and the lid. The lid is the first top face, or the lowest place of the face of the
tool where that is lower. Metal reaches half the edge of its domain beyond the centre of a particle: a void is the union of
probes less that much all round. N particles at random places (a Poisson process) leave 6.77 N exp(-x) (1 + x + x2/2) places where
a ball of x particles' volume touches four and holds none (Miles 1974). x is chosen so that FALSE of them are expected in the track: disorder
makes no voids, and what is smaller than a probe is not seen. A gap narrower than a cell closes on the grid before it closes in space.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..io.frames import NoRun
from . import units

if TYPE_CHECKING:
    from ..run import Run
    from .flow import Flow

FALSE = 0.01  # voids of disorder in a track of particles at random places
VERTICES = 24 * np.pi**2 / 35  # of the Voronoi cells of points at random places, per point
STRETCH = 8.0  # of the probe along the track: half as wide as the ball
STEPS = 4  # of the raster over a particle's edge
KINDS = ("closed", "root", "open")


@dataclass
class Void:
    """One connected hole. The largest section is across the track; `depth` is that of its centre below the first face, `offset` is
    positive on the advancing side."""

    kind: str  # closed, root: down to the bottom, open: up to the lid
    volume: float
    length: float
    area: float
    at: float
    depth: float
    offset: float


def probe_radius(particles: float) -> float:
    """Radius of the ball, in edges of a particle."""
    x = 50.0
    for _ in range(60):  # a contraction by (1 + x)/(1 + x + x2/2), which is less than a half beyond x = 3
        x = np.log(VERTICES / FALSE * max(particles, 1.0) * (1.0 + x + 0.5 * x * x))
    return float(np.cbrt(x * 0.75 / np.pi))


class Voids:
    """Voids of the track behind the tool, on a raster along the way (s), across it (n) and in height (z)."""

    def __init__(self, flow: Flow):
        way = flow.tool_path
        if way is None:
            raise NoRun("no tool that travels straight: no track")
        keys = flow.scene.of("tool", way.tool.name)
        self.flow, self.pin = flow, float(keys.get("pin_radius") or 0.0)
        self.edge = h = flow.spacing
        self.until = way.length - (self.pin + h if self.pin else way.radius)
        if self.until < 2.0 * h:
            raise NoRun("the tool has not yet left a track behind it")
        self.lid = lid_of(flow, keys)
        self.step = h / STEPS
        s, n, z = (np.arange(a + 0.5 * self.step, b, self.step) for a, b in (
            (0.0, self.until), (-way.radius, way.radius), (flow.low[2], self.lid)))
        middle = way.side(0.5 * (flow.low + flow.high)[None])[0]
        half = 0.5 * np.abs((flow.high - flow.low)[:2] @ np.array([-way.along[1], way.along[0]]))
        n = n[np.abs(n - middle) < half]
        if not (len(n) and len(z)):
            raise NoRun("no metal under the track")
        self.axes = s, n, z
        self.place = np.column_stack([way.progress(flow.x), way.side(flow.x), flow.x[:, 2]])
        self.particles = self.until * 2.0 * way.radius * (self.lid - flow.low[2]) / h**3
        self.reach = probe_radius(self.particles)
        self.open = self.found(1.0) | self.found(STRETCH)
        kept = s < self.until - self.reach * h  # beyond, no ball fits before the end
        if not kept.any():
            raise NoRun("the track behind the tool is shorter than what is resolved")
        self.open, self.axes, self.until = self.open[kept], (s[kept], n, z), self.until - self.reach * h
        if flow.cavity is not None:
            self.open &= ~flow.cavity.holds(self.points()).reshape(self.open.shape)
        self.all = self.listed()

    def found(self, stretch: float) -> np.ndarray:
        """Points of the raster in a probe that holds no centre of a particle, less half an edge of its domain."""
        from scipy.ndimage import distance_transform_edt
        from scipy.spatial import cKDTree

        squeeze = np.array([1.0 / stretch, 1.0, 1.0])
        slender = stretch ** (-1.0 / 3.0)
        s, n, z = self.axes
        mesh = np.stack(np.meshgrid(s, n, z, indexing="ij"), axis=-1)
        points = (mesh * squeeze).reshape(-1, 3)
        free = np.full(len(points), np.inf)
        edges = np.cbrt(self.flow.volume)
        for body in np.unique(self.flow.body):
            own = self.flow.body == body
            away, nearest = cKDTree(self.place[own] * squeeze).query(points)
            free = np.minimum(free, away / edges[own][nearest])
        bounds = np.minimum(mesh[..., 2] - self.flow.low[2], self.lid - mesh[..., 2])
        bounds = np.minimum(bounds, (self.until - mesh[..., 0]) / stretch).ravel()
        free = np.minimum(free, bounds / self.edge + 0.5 * slender).reshape(mesh.shape[:3])
        centres = free > self.reach * slender
        if not centres.any():
            return centres
        away = distance_transform_edt(~centres, sampling=self.step * squeeze)
        return away < (self.reach - 0.5) * slender * self.edge

    def points(self) -> np.ndarray:
        """Places of the raster (n, 3) [m]."""
        way = self.flow.tool_path
        s, n, z = (a.ravel() for a in np.meshgrid(*self.axes, indexing="ij"))
        left = np.array([-way.along[1], way.along[0]])
        across = left if way.advancing is None else way.advancing
        return np.column_stack([way.place[0] + s[:, None] * way.along + n[:, None] * across, z])

    def listed(self) -> list[Void]:
        """The voids, the largest section first."""
        from scipy.ndimage import find_objects, label

        self.labels, _ = label(self.open, np.ones((3, 3, 3)))
        s, n, z = self.axes
        found = []
        for number, box in enumerate(find_objects(self.labels), 1):
            own = self.labels[box] == number
            areas = own.sum(axis=(1, 2)) * self.step**2
            k = int(areas.argmax())
            j, i = np.nonzero(own[k])
            z0, z1 = box[2].start, box[2].stop
            kind = "open" if z1 == len(z) else "root" if z0 == 0 else "closed"
            found.append(Void(kind, float(own.sum()) * self.step**3, len(own) * self.step, float(areas[k]), self.coordinate(s[box[0]][k]),
                              self.flow.face - float(z[box[2]][i].mean()), float(n[box[1]][j].mean())))
        return sorted(found, key=lambda void: -void.area)

    def coordinate(self, s: float) -> float:
        way = self.flow.tool_path
        return float(way.coordinate(np.append(way.place[0] + s * way.along, 0.0)[None])[0])

    @property
    def smallest(self) -> dict[str, float]:
        """What particles and cells resolve: sections of a tunnel (the slender probe; a disc a cell wide) [m2], a ball [m3]."""
        slender = np.pi * ((self.reach - 0.5) * STRETCH ** (-1.0 / 3.0) * self.edge) ** 2
        cell = self.flow.run.cell
        return {"smallest_tunnel_of_particles[m2]": slender,
                "smallest_tunnel_of_cells[m2]": 0.25 * np.pi * cell**2 if np.isfinite(cell) else None,
                "smallest_pore[m3]": 4.0 / 3.0 * np.pi * ((self.reach - 0.5) * self.edge) ** 3}

    @property
    def resolved(self) -> float:
        """The smallest section of a tunnel that particles and cells resolve [m2]."""
        return max(x for key, x in self.smallest.items() if key.endswith("[m2]") and x is not None)

    def measures(self) -> dict:
        """Areas [m2], volumes [m3], lengths [m]."""
        s = self.axes[0]
        result = {"from[m]": self.coordinate(0.0), "until[m]": self.coordinate(self.until), "lid_below_face[m]": self.flow.face - self.lid,
                  **self.smallest, "volume[m3]": sum(v.volume for v in self.all),
                  "area_max[m2]": self.all[0].area if self.all else 0.0, "count": len(self.all)}
        for kind in KINDS:
            result[f"{kind}[m3]"] = sum(v.volume for v in self.all if v.kind == kind)
        level, words = self.verdict()
        result |= {"level": level, "verdict": words}
        if self.all:
            worst = self.all[0]
            result["largest"] = {"kind": worst.kind, "side": self.side(worst), "area[m2]": worst.area, "at[m]": worst.at,
                                 "depth[m]": worst.depth, "offset[m]": worst.offset, "length[m]": worst.length, "volume[m3]": worst.volume}
        areas = self.open.sum(axis=(1, 2)) * self.step**2
        result["sections"] = [{"at[m]": self.coordinate(s[k]), "area[m2]": float(areas[k])}
                              for k in np.unique(np.round(np.linspace(0, len(s) - 1, 21)).astype(int))]
        return result

    def side(self, void: Void) -> str:
        if abs(void.offset) < 0.5 * self.edge:
            return "in the middle"
        sides = ("advancing", "retreating") if self.flow.tool_path.advancing is not None else ("left", "right")
        return f"on the {sides[void.offset < 0]} side"

    def is_pore(self, void: Void) -> bool:
        """A closed void shorter than the pin is wide (two cells without a pin)."""
        return void.kind == "closed" and void.length < 2.0 * (self.pin or self.flow.run.cell)

    def verdict(self) -> tuple[str, str]:
        """Traffic light and sentence."""
        if not self.all:
            return "green", f"The weld is closed: no void above {units.mm(self.resolved, 2, 2)}, the smallest that particles and cells resolve."
        worst = self.all[0]
        pore = self.is_pore(worst)
        name = {"open": "an open groove", "root": "lack of fill at the root", "closed": "a pore" if pore else "a tunnel"}[worst.kind]
        text = f"The weld is open: {name} of {units.mm(worst.area, 2, 2)} {self.side(worst)}, {worst.depth * units.MM:.2g} mm below the surface, " \
               f"{worst.length * units.MM:.3g} mm long; voids of {units.mm(sum(v.volume for v in self.all), 3, 3)} in all."
        amber = all(self.is_pore(void) for void in self.all)
        return ("amber" if amber else "red"), text


def lid_of(flow: Flow, keys: dict) -> float:
    """The first face, or the lowest place that the face of the tool came to."""
    rows = flow.tool_path.tool.presses() & (flow.run.history["time"] <= flow.frame.time * (1 + 1e-9))
    tilt = flow.tool_path.tool.column("tilt")
    lean = np.sin(np.abs(np.nan_to_num(tilt.values[rows]))) if tilt is not None else np.sin(np.radians(abs(float(keys.get("tilt_deg", 0.0)))))
    return min(flow.face, float(np.nanmin(flow.tool_path.tool.column("z").values[rows] - flow.tool_path.radius * lean)))


def rows(result: dict) -> list[tuple[str, str]]:
    """Meaning and value of the measures."""
    found = [("voids behind the tool: largest section; volume", f"{units.mm(result['area_max[m2]'], 2, 3)}; {units.mm(result['volume[m3]'], 3, 3)}"),
             ("of this open to the top; closed; at the root", "; ".join(units.mm(result[f"{k}[m3]"], 3, 3) for k in ("open", "closed", "root")))]
    if "largest" in result:
        worst = result["largest"]
        found.append(("largest section: place along the travel; depth below the first top face; off the middle (advancing side is positive)",
                      "; ".join(units.mm(worst[f"{k}[m]"], 1, 3) for k in ("at", "depth", "offset"))))
    found.append(("smallest tunnel that particles resolve; that cells resolve; smallest pore",
                  "; ".join([units.mm(result["smallest_tunnel_of_particles[m2]"], 2, 2), units.mm(result["smallest_tunnel_of_cells[m2]"], 2, 2),
                             units.mm(result["smallest_pore[m3]"], 3, 2)])))
    return found


@lru_cache(maxsize=8)
def of_run(run: Run) -> Voids | None:
    """Voids at the end of a run; None without a track."""
    if len(run.frames) < 2 or "id" not in run.frames[-1].fields:
        return None
    try:
        return run.flow().voids
    except NoRun:
        return None
