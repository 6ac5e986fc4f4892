# SPDX-License-Identifier: MIT
"""Voids in the track behind the pin, or behind the face of a tool without a pin: tunnels, grooves, lack of fill at the root, loose metal, and the
smallest size that is resolved.

The fill of the track, how much of its room the volumes of the particles take, is that of fill.py, between the bottom of the metal and
the lid: the first top face, or the lowest place of the face of the tool where that is lower. A void is a connected place where
metal is missing beyond what disorder explains; its size is the metal that is missing, whether one hole or loose metal.
A gap narrower than a cell closes on the grid before it closes in space.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..io.frames import NoRun
from . import units
from .fill import STEPS, Missing, beside, deposit
from .tools import Tool, tools_of

if TYPE_CHECKING:
    from ..run import Run
    from .flow import Flow

HALF = 0.5  # fill at the edge of a hole, as at a face
KINDS = ("closed", "root", "open", "loose")


@dataclass
class Void:
    """Connected missing metal. Its section across the track is a mean along the needle, or a quarter of a short void; of the largest one, `loose` is the part more than
    half a particle outside of holes and `depth` that of the centre below the first face; `offset` is positive on the advancing side."""

    kind: str  # closed, root: down to the bottom, open: up to the lid; loose: most of it outside of holes
    volume: float
    length: float
    area: float
    loose: float
    at: float
    depth: float
    offset: float


class Voids:
    """Voids of the track behind the tool, on a raster along the way (s), across it (n) and in height (z)."""

    def __init__(self, flow: Flow):
        self.flow = flow
        self.way = way = flow.way
        if not flow.scene.radius(way.tool.name) > 0.0:
            raise NoRun(f"{way.tool.name} has no RADIUS: where on its surface face and pin are is not known")
        self.pin = float(flow.scene.of("tool", way.tool.name).get("pin_radius") or 0.0)
        self.edge = h = flow.spacing
        self.cell = flow.run.cell if np.isfinite(flow.run.cell) else 2.0 * h
        self.until = way.length - (self.pin or way.radius) - self.cell
        if self.until < 4.0 * h:
            raise NoRun("the tool has not yet left a track behind it, or one shorter than is resolved")
        self.lid = lid_of(flow)
        self.step = h / STEPS
        s, n, z = (np.arange(a + 0.5 * self.step, b, self.step) for a, b in (
            (0.0, self.until), (-way.radius, way.radius), (flow.low[2], self.lid)))
        middle = way.side(0.5 * (flow.low + flow.high)[None])[0]
        half = 0.5 * np.abs((flow.high - flow.low)[:2] @ way.across)
        n = n[np.abs(n - middle) < half]
        if not len(n) or len(z) < 2 * STEPS:
            raise NoRun("no metal under the track, or less than two particles")
        self.axes = s, n, z
        self.place = np.column_stack([way.progress(flow.x), way.side(flow.x), flow.x[:, 2]])
        missing = 1.0 - self.filled()
        if flow.cavity:
            missing[flow.cavity.holds(self.points()).reshape(missing.shape)] = 0.0
        self.missing = Missing(missing)
        self.fill = 1.0 - self.missing.mean
        self.all = self.listed()

    def filled(self) -> np.ndarray:
        """Fill by the particles with their centres below the lid, and above the bottom less half an edge, as contact on the grid lets them
        come to a face or the bottom: their cubes are moved within the two."""
        edge = np.cbrt(self.flow.volume)
        own = (self.place[:, 2] < self.lid) & (self.place[:, 2] > self.flow.low[2] - 0.5 * edge)
        x, edge = self.place[own], edge[own]
        x[:, 2] = np.maximum(np.minimum(x[:, 2], self.lid - 0.5 * edge), self.flow.low[2] + 0.5 * edge)
        return deposit(x, edge, self.axes, self.step)

    def above(self, high: float) -> tuple[np.ndarray, np.ndarray]:
        """Heights above the lid, and the fill there, by the same kernel."""
        from scipy.ndimage import gaussian_filter

        z = np.arange(self.lid + 0.5 * self.step, max(high, self.lid + self.step), self.step)
        edge, needle = np.cbrt(self.flow.volume), self.missing.holes[0]
        own = self.place[:, 2] >= self.lid
        x, edge = self.place[own], edge[own]
        x[:, 2] = np.maximum(x[:, 2], self.lid + 0.5 * edge)
        fill = deposit(x, edge, (*self.axes[:2], z), self.step)
        return z, gaussian_filter(fill, [STEPS * needle.along, STEPS * needle.thin, STEPS * needle.wide], mode=("nearest", "nearest", "reflect"))

    def points(self) -> np.ndarray:
        """Places of the raster (n, 3) [m]."""
        s, n, z = (a.ravel() for a in np.meshgrid(*self.axes, indexing="ij"))
        return np.column_stack([self.way.place[0] + s[:, None] * self.way.along + n[:, None] * self.way.across, z])

    def listed(self) -> list[Void]:
        """The voids, the largest section first."""
        from scipy.ndimage import distance_transform_edt, find_objects, gaussian_filter1d, label

        self.labels, _ = label(self.missing.found, np.ones((3, 3, 3)))
        self.holes = beside(self.missing.found & (self.fill < HALF), self.missing.core)
        rim = distance_transform_edt(~self.holes) <= 0.5 * STEPS if self.holes.any() else self.holes
        s, n, z = self.axes
        self.sections, found = np.zeros(len(s)), []  # what is missing in voids in each section [m2]
        for number, box in enumerate(find_objects(self.labels), 1):
            own = self.labels[box] == number
            hole = own & self.holes[box]
            volume = float(self.missing.missing[box][own].sum()) * self.step**3
            if volume <= 0.0:
                continue
            mean = min(STEPS * self.missing.holes[0].along, 0.25 * len(own))
            mean = gaussian_filter1d(self.missing.missing[:, box[1], box[2]], mean, axis=0, mode="reflect")[box[0]]
            areas, loose = (np.where(part, mean, 0.0).sum(axis=(1, 2)) * self.step**2 for part in (own, own & ~rim[box]))
            self.sections[box[0]] += areas
            k = int(areas.argmax())
            weight = np.where(own[k], np.maximum(self.missing.mean[box][k], 0.0), 0.0)
            weight /= max(weight.sum(), 1e-30)
            z0, z1 = box[2].start, box[2].stop
            kind = "loose" if loose[k] > 0.5 * areas[k] else "open" if z1 == len(z) and hole[:, :, -1].any() else "root" if z0 == 0 and hole[:, :, 0].any() else "closed"
            found.append(Void(kind, volume, len(own) * self.step, float(areas[k]), float(max(loose[k], 0.0)), self.coordinate(s[box[0]][k]),
                              self.flow.face - float(weight.sum(axis=0) @ z[box[2]]), float(weight.sum(axis=1) @ n[box[1]])))
        return sorted(found, key=lambda void: -void.area)

    def coordinate(self, s: float) -> float:
        return float(self.way.coordinate(np.append(self.way.place[0] + s * self.way.along, 0.0)[None])[0])

    @property
    def smallest(self) -> dict[str, float]:
        """Smallest voids that particles and cells resolve: sections of a tunnel (a cylinder; a disc a cell wide) [m2], a pore [m3], the width of a seam
        through the track [m]."""
        tunnel, pore, seam = self.missing.smallest
        cell = self.flow.run.cell
        return {"smallest_tunnel_of_particles[m2]": tunnel * self.edge**2,
                **({"smallest_tunnel_of_cells[m2]": 0.25 * np.pi * cell**2} if np.isfinite(cell) else {}),
                "smallest_pore[m3]": pore * self.edge**3, "smallest_seam[m]": seam * self.edge}

    @property
    def resolved(self) -> float:
        """The smallest section of a tunnel that particles and cells resolve [m2]."""
        return max(x for key, x in self.smallest.items() if key.endswith("[m2]"))

    @property
    def loose(self) -> float:
        """The largest section of loose metal: what is missing in it [m2]."""
        return max((void.loose for void in self.all), default=0.0)

    def measures(self) -> dict:
        """Areas [m2], volumes [m3], lengths [m]."""
        s = self.axes[0]
        inner, volume = ~self.missing.found, sum(v.volume for v in self.all)
        inner[:, :, -STEPS:] = False
        result: dict = {"from[m]": self.coordinate(0.0), "until[m]": self.coordinate(self.until), "lid_below_face[m]": self.flow.face - self.lid,
                        **self.smallest, "volume[m3]": volume, "area_max[m2]": self.all[0].area if self.all else 0.0, "loose_max[m2]": self.loose,
                        "count": len(self.all), "missing_elsewhere[m3]": float(self.missing.missing[inner].sum()) * self.step**3,
                        "disorder[m3]": float(np.sqrt(inner.sum() * self.step**3 * self.edge**3))}
        for kind in KINDS:
            result[f"{kind}[m3]"] = sum(v.volume for v in self.all if v.kind == kind)
        level, words = self.verdict()
        result |= {"level": level, "verdict": words}
        if self.all:
            worst = self.all[0]
            result["largest"] = {"kind": worst.kind, "side": self.side(worst), "area[m2]": worst.area, "loose[m2]": worst.loose, "at[m]": worst.at,
                                 "depth[m]": worst.depth, "offset[m]": worst.offset, "length[m]": worst.length, "volume[m3]": worst.volume}
        areas = self.sections
        result["sections"] = [{"at[m]": self.coordinate(s[k]), "area[m2]": float(areas[k])}
                              for k in np.unique(np.round(np.linspace(0, len(s) - 1, 21)).astype(int))]
        return result

    def side(self, void: Void) -> str:
        if abs(void.offset) < 0.5 * self.edge:
            return "in the middle"
        sides = ("advancing", "retreating") if self.way.advancing is not None else ("left", "right")
        return f"on the {sides[void.offset < 0]} side"

    def is_minor(self, void: Void) -> bool:
        """A pore: closed or loose, and shorter than the pin is wide (two cells without a pin); or loose metal that lacks less than the
        smallest section that is resolved, as a seam that the grid has closed."""
        short = void.length < 2.0 * (self.pin or self.cell)
        return void.kind in ("closed", "loose") and short or void.kind == "loose" and void.area < self.resolved

    def verdict(self) -> tuple[str, str]:
        """Traffic light and sentence."""
        if not self.all:
            return "green", f"The weld is closed: no void above {units.mm(self.resolved, 2, 2)} and no seam through it wider than " \
                f"{units.mm(self.smallest['smallest_seam[m]'], 1, 2)}, the smallest that are resolved."
        amber = all(self.is_minor(void) for void in self.all)
        worst = next(void for void in self.all if amber or not self.is_minor(void))
        place = f"{self.side(worst)}, {worst.depth * units.MM:.2g} mm below the surface, {worst.length * units.MM:.3g} mm long"
        whole = f"{units.mm(sum(v.volume for v in self.all), 3, 3)} are missing in all."
        if worst.kind == "loose":
            return ("amber" if amber else "red"), f"The weld is loose: {units.mm(worst.area, 2, 2)} of metal are missing {place}, without a hole that is resolved; {whole}"
        name = {"open": "an open groove", "root": "lack of fill at the root", "closed": "a pore" if self.is_minor(worst) else "a tunnel"}[worst.kind]
        loose = f" ({units.mm(worst.loose, 2, 2)} of it from loose metal)" if worst.loose > 0.1 * worst.area else ""
        return ("amber" if amber else "red"), f"The weld is open: {name} of {units.mm(worst.area, 2, 2)}{loose} {place}; {whole}"

def lid_of(flow: Flow) -> float:
    """The first face, or the lowest place that the face of the tool came to; of a pin and a shoulder that are tools of their own, the shoulder's."""
    tool = shoulder_of(flow)
    rows = tool.presses() & (flow.run.history["time"] <= flow.frame.time * (1 + 1e-9))
    tilt = tool.column("tilt")
    lean = (np.sin(np.abs(np.nan_to_num(tilt.values[rows]))) if tilt is not None
            else np.sin(np.radians(abs(float(flow.scene.of("tool", tool.name).get("tilt_deg", 0.0))))))
    return min(flow.face, float(np.nanmin(tool.pose[rows, 2] - flow.scene.radius(tool.name) * lean)))


def shoulder_of(flow: Flow) -> Tool:
    """The widest of the tools that press above the one of the track, or that one."""
    pin = flow.way.tool
    above = [tool for tool in tools_of(flow.run.history) if tool.has_pose and tool.presses().any()
             and flow.scene.radius(tool.name) > flow.way.radius and tool.place(flow.frame.time)[2] > pin.place(flow.frame.time)[2]]
    return max(above, key=lambda tool: flow.scene.radius(tool.name), default=pin)


def rows(result: dict) -> list[tuple[str, str]]:
    """Meaning and value of the measures."""
    found = [("voids behind the tool: largest section; volume", f"{units.mm(result['area_max[m2]'], 2, 3)}; {units.mm(result['volume[m3]'], 3, 3)}"),
             ("of this open to the top; closed; at the root; loose without a hole", "; ".join(units.mm(result[f"{k}[m3]"], 3, 3) for k in ("open", "closed", "root", "loose"))),
             ("loose metal, fill above a half: missing in the largest section", units.mm(result["loose_max[m2]"], 2, 3)),
             ("missing in the track besides voids, deeper than a particle; disorder explains",
              f"{units.mm(result['missing_elsewhere[m3]'], 3, 3)}; {units.mm(result['disorder[m3]'], 3, 2)}")]
    if "largest" in result:
        worst = result["largest"]
        found.append(("largest section: place along the travel; depth below the first top face; off the middle (advancing side is positive)",
                      "; ".join(units.mm(worst[f"{k}[m]"], 1, 3) for k in ("at", "depth", "offset"))))
    found.append(("smallest tunnel that particles resolve; that cells resolve; smallest pore; smallest width of a seam through the sheet",
                  "; ".join([units.mm(result["smallest_tunnel_of_particles[m2]"], 2, 2), units.mm(result.get("smallest_tunnel_of_cells[m2]"), 2, 2),
                             units.mm(result["smallest_pore[m3]"], 3, 2), units.mm(result["smallest_seam[m]"], 1, 2)])))
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
