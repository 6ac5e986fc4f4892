# SPDX-License-Identifier: MIT
"""What a pass did to the metal: flash on both sides, groove, where its volume went, cavity, stir zone, layers.

usage: stirpost flow RUN_DIRECTORY [--time T] [--section X ...] [--strain 1] [--isotherm K ...] [--json] [-o DIR]

The last frame (or the first at or after T) is compared with the first one, particle by particle. Particles are boxes
of their volume, which is that at rest times what temperature and pressure make of it; they are stretched as far as
their neighbours of the first frame have moved apart, or cubes where these are no neighbours any more. The top face is that of the
first frame. The advancing side is where the tool's surface moves with the travel: +y for travel along +x and spin
clockwise seen from above. The groove is what is missing below the top face, outside the cavity, where the tool's face
has passed or within a particle of it, as metal does not show its rim finer. What left the groove lies above the face (ridges and flash, by side), in the cavity, beyond ends and sides,
below the bottom, or is debris; `closure` is their sum less thermal and elastic expansion over the groove, less 1; what it
leaves is what is missing below the face beside the groove (`sunk_beside`): where sides bulge, the face sinks a little,
and the places of particles enclose a few thousandths less or more than their volumes.

Voids of the track behind the tool are those of stirpost/voids.py: tunnels (closed), grooves (open to the top), lack of fill at
the root, each with its section, depth and side, and the smallest that particles and cells resolve.

Written to DIR (default RUN_DIRECTORY/report): flow.json, flow_voids.png if there is a track, and flow_cavity.png if there is a cavity.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from . import look, metal, voids
from .files import write
from .run import Frame, NoRun, Run
from .scene import Cavity, Scene, cavity_of
from .tools import Tool, main_tool, tools_of
from .voids import Voids

REGIONS = ("plate", "cavity", "above_advancing", "above_retreating", "ends", "sides", "below", "debris")
PARTS = 5  # points along each edge of a particle that lies in several regions
SHIFTS = 0.5 * np.array([np.sqrt(2.0), np.sqrt(3.0), np.sqrt(5.0)])  # of these points from particle to particle
STRAIGHT = 0.1  # of the tool's radius: a way that bends more has no advancing side


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost flow", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--time", type=float, help="[s]")
    parser.add_argument("--section", type=float, nargs="+", metavar="X", help="places along the travel [m] "
                        "(default: quarters of the way)")
    parser.add_argument("--strain", type=float, default=1.0, help="above which metal is stirred (default 1)")
    parser.add_argument("--isotherm", type=float, nargs="+", metavar="K", help="(default: each 100 K that was reached)")
    parser.add_argument("--json", action="store_true", help="print flow.json instead of lines")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    run = Run(options.run)
    flow = run.flow(options.time)
    result = flow.measures(options.section, options.strain, options.isotherm, whole=True)
    output = options.output or options.run / "report"
    output.mkdir(parents=True, exist_ok=True)
    text = json.dumps(result, indent=1)
    write(output / "flow.json", text + "\n")
    from . import flow_pictures

    with look.style():
        if flow.cavity is not None:
            look.save(flow_pictures.cavity_picture(flow), output / "flow_cavity.png")
        if "voids" in result:
            look.save(flow_pictures.sheet(flow.voids), output / "flow_voids.png")
    print(text if options.json else "\n".join(lines(result)))
    return 0


@dataclass
class Way:
    """A straight way of a tool: its direction, that of the advancing side (None without spin), places over time."""

    tool: Tool
    radius: float
    time: np.ndarray
    place: np.ndarray  # (n, 2)
    along: np.ndarray
    advancing: np.ndarray | None

    def coordinate(self, x: np.ndarray) -> np.ndarray:
        """Along the travel: that of the axis it goes along, if it does."""
        axis = int(np.abs(self.along).argmax())
        return x[:, axis] if abs(self.along[axis]) > 1.0 - 1e-9 else x[:, :2] @ self.along

    def side(self, x: np.ndarray) -> np.ndarray:
        """Distance from the way, positive on the advancing side."""
        across = np.array([-self.along[1], self.along[0]]) if self.advancing is None else self.advancing
        return (x[:, :2] - self.place[0]) @ across

    def progress(self, x: np.ndarray) -> np.ndarray:
        """How far along the way from its start."""
        return (x[:, :2] - self.place[0]) @ self.along

    @property
    def length(self) -> float:
        return float(((self.place - self.place[0]) @ self.along).max())

    def passed(self, x: np.ndarray, margin: float = 0.0, beyond: float = 0.0) -> np.ndarray:
        """Where the face has been, up to `margin` radii within its ends, or `beyond` its rim [m]."""
        s, n = self.progress(x), self.side(x)
        past = np.maximum(np.maximum(-s, s - self.length) + margin * self.radius, 0.0)
        if margin > 0:
            return (past == 0.0) & (np.abs(n) < self.radius)
        return past**2 + n**2 < (self.radius + beyond)**2

    def seconds_under(self, x: np.ndarray) -> np.ndarray:
        """Time that places at rest were under the face [s], of way and time that are linear between the rows."""
        total = np.zeros(len(x))
        half = np.sqrt(np.maximum(self.radius**2 - self.side(x) ** 2, 0.0))
        s = self.progress(x)
        at = (self.place - self.place[0]) @ self.along
        for k in range(len(at) - 1):
            a, b, span = at[k], at[k + 1], self.time[k + 1] - self.time[k]
            if abs(b - a) > 1e-12:
                low, high = min(a, b), max(a, b)
                total += span * np.clip(np.minimum(high, s + half) - np.maximum(low, s - half), 0.0, None) / (high - low)
            else:
                total += span * (np.abs(s - a) < half)
        return total


def way_of(run: Run, scene: Scene, until: float) -> Way | None:
    """The way of the tool with the most work until a time [s], while it touches; None without one that travels."""
    tool = main_tool(run.history)
    if tool is None:
        return None
    radius = scene.radius(tool.name)
    if radius is None:
        return None
    time = run.history["time"]
    rows = tool.presses() & (time <= until * (1 + 1e-9))
    if rows.sum() < 2:
        return None
    place = np.column_stack([tool.column(axis).values for axis in "xy"])[rows]
    way = place[-1] - place[0]
    length = np.linalg.norm(way)
    if length < 1e-3 * radius:
        return None
    along = way / length
    off = (place - place[0]) @ np.array([-along[1], along[0]])
    if np.abs(off).max() > STRAIGHT * radius:
        raise ValueError(f"the way of {tool.name} is not straight: it has no advancing side")
    angle = tool.column("angle")
    turned = 0.0 if angle is None else float(np.nan_to_num(angle.values[rows][-1] - angle.values[rows][0]))
    advancing = None if turned == 0.0 else np.sign(turned) * np.array([-along[1], along[0]])
    return Way(tool, radius, time[rows], place, along, advancing)


class Flow:
    """Particles of a frame beside themselves in the first one, without rigid bodies."""

    def __init__(self, run: Run, frame: Frame):
        self.run, self.frame, self.scene = run, frame, run.scene
        rigid = {tool.name for tool in tools_of(run.history)}
        self.bodies = [name for name in frame.body_names if name not in rigid]
        self.first = first = run.frames[0]
        if first is frame:
            raise NoRun("there is one frame only: nothing to compare it with")
        self.ids, place, body = by_number(first, rigid)
        now_ids, now, _ = by_number(frame, rigid)
        there = np.isin(self.ids, now_ids)
        if not there.any():
            raise NoRun(f"{frame.path}: none of the particles of {first.path}")
        self.lost = int((~there).sum())
        self.ids, self.x0, self.body = self.ids[there], place[there], body[there]
        keep = np.isin(now_ids, self.ids)
        self.x = now[keep]
        self.number = np.sort(now_ids[keep])
        self.edge0 = metal.spacings(first, run)[self.body]
        self.spacing = float(self.edge0.max())
        self.low, self.high = (f(place + s * 0.5 * metal.spacings(first, run)[body][:, None], axis=0)
                               for f, s in ((np.min, -1), (np.max, 1)))
        self.face = float(self.high[2])
        self.volume0 = self.edge0**3
        self.volume = self.volume0 * self.expansion()
        self.edges = metal.stretches(self.x0, self.x, self.edge0, self.body) * np.cbrt(self.volume)[:, None]
        reach = run.cell if np.isfinite(run.cell) else 2.0 * run.spacing
        self.whole, self.pieces = metal.hangs_together(self.x, self.body, max(reach, 1.01 * run.spacing))
        self.way = way_of(run, self.scene, frame.time)
        self.cavity: Cavity | None = cavity_of(self.scene, self.bodies)

    def field(self, name: str, frame: Frame | None = None) -> np.ndarray | None:
        """A field in the order of the particles."""
        frame = frame or self.frame
        values = frame.field(name)
        if values is None:
            return None
        ids = frame.field("id")
        order = np.argsort(ids)
        return values[order][np.searchsorted(ids[order], self.number)].astype(float)

    def expansion(self) -> np.ndarray:
        """Volume over that at the start, from temperature and pressure; 1 where the input does not say."""
        ratio = np.ones(len(self.x))
        then, now = ({name: self.field(name, f) for name in ("temperature", "pressure")} for f in (self.first, self.frame))
        for number, name in enumerate(self.frame.body_names):
            own = self.body == number
            material = self.scene.of("material", str(self.scene.of("body", name).get("material", "")))
            alpha = float(material.get("expansion", 0.0))
            young, poisson = (float(material.get(key, 0.0)) for key in ("youngs_modulus", "poisson_ratio"))
            if alpha and now["temperature"] is not None:
                ratio[own] *= np.exp(3.0 * alpha * (now["temperature"] - then["temperature"])[own])
            if young and now["pressure"] is not None:
                bulk = young / (3.0 * (1.0 - 2.0 * poisson))
                ratio[own] *= 1.0 - (now["pressure"] - then["pressure"])[own] / bulk
        return ratio

    @cached_property
    def voids(self) -> Voids:
        return Voids(self)

    # -- where the metal is ---------------------------------------------------------------------------------------

    def side(self, x: np.ndarray) -> np.ndarray:
        return self.way.side(x) if self.way is not None else x[:, 1] - 0.5 * (self.low[1] + self.high[1])

    def shares(self, x: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Part of each box of edges (n, 3) in each region (n, len(REGIONS)): exact where planes bound it, else of points in it."""
        axis = 0 if self.way is None else int(np.abs(self.way.along).argmax())
        low, high = x - 0.5 * edge, x + 0.5 * edge
        inner = np.clip(low, self.low, self.high), np.clip(high, self.low, self.high)
        size = inner[1] - inner[0]
        part = size / edge
        part[edge - size < 1e-6 * edge] = 1.0
        above = np.clip((high[:, 2] - np.maximum(low[:, 2], self.face)) / edge[:, 2], 0.0, 1.0) * (part[:, 2] < 1.0)
        within, ends, sides = part[:, 2], 1.0 - part[:, axis], 1.0 - part[:, 1 - axis]
        result = np.zeros((len(x), len(REGIONS)))
        top = np.maximum(low, [-np.inf, -np.inf, self.face]), high
        advancing = self.sampled(np.flatnonzero(above > 0.0), *top, lambda points: self.side(points) > 0)
        result[:, 2], result[:, 3] = above * advancing, above * (1.0 - advancing)
        result[:, 4], result[:, 5] = within * ends, within * (1.0 - ends) * sides
        result[:, 6] = np.clip(1.0 - within - above, 0.0, 1.0)
        inside = within * (1.0 - ends) * (1.0 - sides)
        if self.cavity is not None:
            result[:, 1] = inside * self.sampled(np.flatnonzero(inside > 0.0), *inner, self.cavity.holds)
        result[:, 0] = inside - result[:, 1]
        return result

    def sampled(self, chosen: np.ndarray, low: np.ndarray, high: np.ndarray, holds) -> np.ndarray:
        """Part of the chosen boxes that `holds` holds, 0 of the others. Boxes whose corners differ are told by points
        that are shifted from box to box, so that what lies along a lattice is not counted by steps."""
        found = np.zeros(len(low))
        corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * (1.0 - 4e-5) + 2e-5
        size = high - low
        first = holds(low[chosen] + corners[0] * size[chosen])
        one = np.ones(len(chosen), dtype=bool)
        for corner in corners[1:]:
            one &= holds(low[chosen] + corner * size[chosen]) == first
        found[chosen[one]] = first[one]
        mixed = chosen[~one]
        shift = (np.arange(len(mixed))[:, None] * SHIFTS) % 1.0
        for a in range(PARTS):
            for b in range(PARTS):
                for c in range(PARTS):
                    place = (np.array([a, b, c]) + shift) / PARTS
                    found[mixed] += holds(low[mixed] + place * size[mixed]) * PARTS**-3.0
        return found

    def budget(self) -> dict:
        """Volumes [m3]: what is more in each region than in the first frame, groove, expansion."""
        now, then = self.shares(self.x, self.edges), self.shares(self.x0, np.repeat(self.edge0[:, None], 3, axis=1))
        now[~self.whole] = np.eye(len(REGIONS))[REGIONS.index("debris")]
        gain = {name: float((now[:, k] * self.volume).sum() - (then[:, k] * self.volume0).sum())
                for k, name in enumerate(REGIONS)}
        result = {f"{name}[m3]": gain[name] for name in REGIONS[1:]}
        result["expansion[m3]"] = float(self.volume.sum() - self.volume0.sum())
        self.now_shares, self.then_shares = now, then
        if self.way is None:
            return result
        depth, centres = self.depths(now[:, 0] * self.volume, then[:, 0] * self.volume0)
        strip = self.way.passed(np.column_stack([centres, np.zeros(len(centres))]), beyond=self.spacing)
        groove = float(depth[strip].sum()) * self.spacing**2
        left = sum(gain[name] for name in REGIONS[1:]) - result["expansion[m3]"]
        result["groove[m3]"] = groove
        result["sunk_beside[m3]"] = float(depth[~strip].sum()) * self.spacing**2
        result["closure"] = left / groove - 1.0 if groove > 0 else None
        result["groove_mean_depth[m]"] = groove / (strip.sum() * self.spacing**2) if strip.any() else None
        return result

    def depths(self, now: np.ndarray, then: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How much metal is missing in each column of the plate [m], and the columns' places (n, 2)."""
        counts = np.maximum(1, np.round((self.high - self.low)[:2] / self.spacing)).astype(int)
        size = (self.high - self.low)[:2] / counts
        missing = np.zeros(counts)
        for x, edge, volume, sign in ((self.x0, self.edge0[:, None], then, 1.0), (self.x, self.edges[:, :2], now, -1.0)):
            spread(missing, (x[:, :2] - self.low[:2]) / size, edge / size, sign * volume)
        axes = [low + (np.arange(n) + 0.5) * s for low, n, s in zip(self.low, counts, size)]
        centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        return missing.reshape(-1) / self.spacing**2, centres

    # -- measures -------------------------------------------------------------------------------------------------

    def measures(self, sections=None, strain: float = 1.0, isotherms=None, whole: bool = False) -> dict:
        """All there is to say; `whole` reads every frame, for the highest temperatures and the lengths of paths."""
        result = {"time[s]": self.frame.time, "since[s]": self.first.time, "particles": len(self.x), "lost": self.lost,
                  "flash": self.flash(), "volumes": self.budget()}
        if self.cavity is not None:
            result["cavity"] = self.fill()
        if len(self.bodies) > 1:
            result["mixing"] = self.mixing()
        if self.way is None:
            return result
        length = None
        peak = self.field("temperature")
        if whole:
            peak, length = self.over_time()
        places = self.default_sections() if sections is None else sections
        result["stir_zone"] = [self.stir_zone(at, strain, peak, isotherms) for at in places]
        result["layers"] = self.layers(length)
        try:
            result["voids"] = self.voids.measures()
        except NoRun:  # there is no track behind the tool yet
            pass
        return result

    def flash(self) -> dict:
        """Highest metal that hangs together above the first face, by side [m]; debris apart."""
        top = self.x[:, 2] + 0.5 * self.edge0 - self.face
        found = {"debris_pieces": self.pieces, "debris_particles": int((~self.whole).sum())}
        side = self.side(self.x)
        for name, own in (("advancing", side > 0), ("retreating", side <= 0)):
            own = own & self.whole
            found[f"height_{name}[m]"] = max(0.0, float(top[own].max())) if own.any() else 0.0
        return found

    def mixing(self) -> list[dict]:
        """For two bodies each: volume of the metal of one that lies where the other was at first [m3], and how deep in it [m]."""
        from scipy.spatial import cKDTree

        names = self.frame.body_names
        away, nearest = cKDTree(self.x0).query(self.x)
        was = np.where(away < self.edge0[nearest], self.body[nearest], -1)
        found = []
        for one in np.unique(self.body):
            for other in np.unique(self.body[self.body != one]):
                passed = (self.body == one) & (was == other)
                deep = cKDTree(self.x0[self.body == one]).query(self.x[passed])[0] - 0.5 * self.edge0[passed]
                found.append({"body": names[one], "where": names[other], "volume[m3]": float(self.volume[passed].sum()),
                              "depth_max[m]": max(0.0, float(deep.max())) if passed.any() else 0.0})
        return found

    def fill(self) -> dict:
        """Part of the cavity's empty volume that is filled, whole and by quarters, and part of its area that metal covers."""
        k = REGIONS.index("cavity")
        before = float((self.then_shares[:, k] * self.volume0).sum())
        volume = self.cavity.volume(0.2 * self.spacing)
        gained = float((self.now_shares[:, k] * self.volume).sum()) - before
        result = {"volume[m3]": volume, "filled": gained / (volume - before), "covered": self.covered()}
        middle = 0.5 * (self.cavity.low + self.cavity.high)
        if self.way is None:
            return result
        inside = self.now_shares[:, k] * self.volume
        ahead = self.way.progress(self.x) > self.way.progress(middle[None])[0]
        advancing = self.way.side(self.x) > self.way.side(middle[None])[0]
        for name, own in (("rear_advancing", ~ahead & advancing), ("rear_retreating", ~ahead & ~advancing),
                          ("front_advancing", ahead & advancing), ("front_retreating", ahead & ~advancing)):
            result[f"{name}[m3]"] = float(inside[own].sum())
        return result

    def covered(self) -> float:
        """Part of the cavity's area, seen from above at half its depth, over which metal lies a particle or more above its floor."""
        low, high = self.cavity.low, self.cavity.high
        edge = 0.25 * self.spacing
        plan = [np.arange(low[k] + 0.5 * edge, high[k], edge) for k in (0, 1)]
        places = np.stack(np.meshgrid(*plan, [0.5 * (low[2] + high[2])], indexing="ij"), axis=-1).reshape(-1, 3)
        places = places[self.cavity.holds(places), :2]
        above = self.x[:, 2] > low[2] + self.spacing
        if not above.any() or not len(places):
            return 0.0
        from scipy.spatial import cKDTree

        away, nearest = cKDTree(self.x[above, :2]).query(places, p=np.inf)
        return float((away <= 0.5 * self.edge0[above][nearest]).mean())

    def default_sections(self) -> list[float]:
        """Places at quarters of the way, as coordinates along the travel."""
        ends = self.way.place[0] + self.way.along * self.way.length * np.array([[0.25], [0.5], [0.75]])
        return [float(s) for s in self.way.coordinate(np.column_stack([ends, np.zeros(3)]))]

    def stir_zone(self, at: float, limit: float, peak: np.ndarray | None, isotherms) -> dict:
        """In the slab of a spacing around a place along the travel: extent of strains above `limit`, and of isotherms."""
        strain = self.field("plastic_strain")
        strain = np.zeros(len(self.x)) if strain is None else strain
        slab = (np.abs(self.way.coordinate(self.x) - at) <= 0.5 * self.spacing * (1 + 1e-6)) & self.whole
        stirred = slab & (strain > limit)
        found = {"at[m]": float(at), "strain_above": limit} | self.extent(stirred)
        if peak is None or not slab.any():
            return found
        if isotherms is None:
            hottest = peak[slab].max()
            isotherms = [float(t) for t in np.arange(np.floor(hottest / 100.0) * 100.0, 300.0, -100.0)]
        found["isotherms"] = []
        for kelvin in isotherms:
            warm = slab & (peak >= kelvin)
            inside = float(self.volume[warm & stirred].sum() / self.volume[stirred].sum()) if stirred.any() else None
            found["isotherms"].append({"temperature[K]": float(kelvin), "share_of_stir_zone": inside} | self.extent(warm))
        return found

    def extent(self, chosen: np.ndarray) -> dict:
        """Depth below the first face, width and area of the chosen particles of a slab."""
        if not chosen.any():
            return {"depth[m]": 0.0, "width[m]": 0.0, "area[m2]": 0.0}
        side, half = self.way.side(self.x[chosen]), 0.5 * self.edge0[chosen]
        return {"depth[m]": max(0.0, self.face - float((self.x[chosen, 2] - half).min())),
                "width[m]": float((side + half).max() - (side - half).min()),
                "area[m2]": float(self.volume[chosen].sum() / self.spacing)}

    def layers(self, length: np.ndarray | None) -> list[dict]:
        """Of each layer of initial depth where the tool has passed wholly: how far it went along the plate."""
        under = self.way.passed(self.x0, margin=1.0)
        if not under.any():
            return []
        layer = np.floor((self.face - self.x0[:, 2]) / self.spacing).astype(int)
        moved = np.linalg.norm((self.x - self.x0)[:, :2], axis=1)
        ahead = (self.x - self.x0)[:, :2] @ self.way.along
        began, ends = self.way.side(self.x0), self.way.side(self.x)
        seconds = self.way.seconds_under(self.x0[under])
        under_it = np.zeros(len(self.x))
        under_it[under] = seconds
        rows = []
        for k in np.unique(layer[under]):
            own = under & (layer == k)
            far = own & (moved > self.spacing)
            started = far & (began < 0)
            row = {"depth[m]": [float(k * self.spacing), float((k + 1) * self.spacing)], "particles": int(own.sum()),
                   "displacement_median[m]": float(np.median(moved[own])),
                   "displacement_90[m]": float(np.quantile(moved[own], 0.9)),
                   "displacement_max[m]": float(moved[own].max()),
                   "ahead_max_diameters": float(ahead[own].max() / (2 * self.way.radius)),
                   "moved_more_than_spacing": float(far.sum() / own.sum()),
                   "of_moved_on_advancing_side": float((ends[far] > 0).mean()) if far.any() else None,
                   "of_moved_passed_to_advancing_side": float((ends[started] > 0).mean()) if started.any() else None,
                   "time_under_tool_mean[s]": float(under_it[own].mean())}
            if length is not None:
                row["path_max_diameters"] = float(length[own].max() / (2 * self.way.radius))
            rows.append(row)
        return rows

    def over_time(self) -> tuple[np.ndarray | None, np.ndarray]:
        """Highest temperature of each particle over the frames, and the length of its path from frame to frame."""
        frames = [f for f in self.run.frames if f.time <= self.frame.time]
        length, last, peak = np.zeros(len(self.x)), self.x0, None
        for frame in frames[1:]:
            ids, points = frame.field("id"), frame.points()
            order = np.argsort(ids)
            place = points[order][np.searchsorted(ids[order], self.number)]
            length += np.linalg.norm(place - last, axis=1)
            last = place
            warm = self.field("temperature", frame)
            if warm is not None:
                peak = warm if peak is None else np.maximum(peak, warm)
        return peak, length


def by_number(frame: Frame, rigid: set[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers, places and bodies of the particles that are no tool, in the order of their numbers."""
    points, body, ids = frame.points(), frame.bodies(), frame.need("id")
    keep = np.ones(len(points), dtype=bool)
    for number, name in enumerate(frame.body_names):
        keep &= (body != number) | (name not in rigid)
    order = np.argsort(ids[keep])
    return ids[keep][order], points[keep][order], body[keep][order]


def spread(grid: np.ndarray, x: np.ndarray, edge: np.ndarray, amount: np.ndarray) -> None:
    """Add amounts of squares at x, in cells, to the cells they lie over; what lies outside goes to the outermost."""
    low = x - 0.5 * edge
    first = np.floor(low + 1e-9).astype(int)
    reach = int(np.ceil(edge.max() - 1e-6)) + 1
    parts = []
    for axis in range(2):
        cells = first[:, axis, None] + np.arange(reach)
        over = np.minimum(cells + 1, (low + edge)[:, axis, None]) - np.maximum(cells, low[:, axis, None])
        over = np.clip(over, 0.0, None)
        parts.append((np.clip(cells, 0, grid.shape[axis] - 1), over / over.sum(axis=1, keepdims=True)))
    for i in range(reach):
        for j in range(reach):
            np.add.at(grid, (parts[0][0][:, i], parts[1][0][:, j]), amount * parts[0][1][:, i] * parts[1][1][:, j])


def percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.3g} %"


def rows(result: dict) -> list[tuple[str, str]]:
    """Meaning and value of what is one number."""
    flash, volume = result["flash"], result["volumes"]
    found = voids.rows(result["voids"]) if "voids" in result else []
    found += [("flash, advancing side: height; volume above the initial top face",
              f"{look.mm(flash['height_advancing[m]'])}; {look.mm(volume['above_advancing[m3]'], 3)}"),
             ("flash, retreating side: height; volume above the initial top face",
              f"{look.mm(flash['height_retreating[m]'])}; {look.mm(volume['above_retreating[m3]'], 3)}")]
    if "groove[m3]" in volume:
        found.append(("groove: volume below the initial top face; mean depth",
                      f"{look.mm(volume['groove[m3]'], 3)}; {look.mm(volume['groove_mean_depth[m]'])}"))
    found.append(("metal displaced beyond ends; sides; below the bottom; debris",
                  "; ".join(look.mm(volume[f"{k}[m3]"], 3) for k in ("ends", "sides", "below", "debris"))))
    found.append(("thermal and elastic expansion", look.mm(volume["expansion[m3]"], 3)))
    if volume.get("closure") is not None:
        found.append(("sinkage of the top face beside the groove: volume", look.mm(volume["sunk_beside[m3]"], 3)))
        found.append(("error of the balance of volumes: metal that left the groove, without expansion, against the volume of the groove", percent(volume["closure"])))
    if "cavity" in result:
        found.append(("cavity: filled; metal in it", f"{percent(result['cavity']['filled'])}; {look.mm(volume['cavity[m3]'], 3)}"))
    for pair in (pair for pair in result.get("mixing", []) if pair["volume[m3]"] > 0.0):
        found.append((f"metal of {pair['body']} where {pair['where']} was: volume; how deep in it",
                      f"{look.mm(pair['volume[m3]'], 3)}; {look.mm(pair['depth_max[m]'])}"))
    for zone in result.get("stir_zone", []):
        found.append((f"stir zone (strain > {zone['strain_above']:g}) at {look.mm(zone['at[m]'])}: depth; width; area",
                      f"{look.mm(zone['depth[m]'])}; {look.mm(zone['width[m]'])}; {look.mm(zone['area[m2]'], 2)}"))
    return found


def tables(result: dict) -> list[tuple[str, list[str], list[list[str]]]]:
    """Title, headings and rows: layers, isotherms."""
    found = []
    if result.get("layers"):
        path = "path_max_diameters" in result["layers"][0]
        headings = ["depth [mm]", "median [mm]", "90 % [mm]", "largest [mm]", "largest ahead [diameters]"]
        headings += ["longest path [diameters]"] * path
        headings += ["moved > a spacing", "of these on the advancing side", "passed to it", "under the tool [s]"]
        body = []
        for row in result["layers"]:
            line = [" to ".join(f"{d * look.MM:.3g}" for d in row["depth[m]"])]
            line += [f"{row[f'displacement_{k}[m]'] * look.MM:.3g}" for k in ("median", "90", "max")]
            line.append(f"{row['ahead_max_diameters']:.2f}")
            if path:
                line.append(f"{row['path_max_diameters']:.2f}")
            line += [percent(row["moved_more_than_spacing"]), percent(row["of_moved_on_advancing_side"]),
                     percent(row["of_moved_passed_to_advancing_side"]), f"{row['time_under_tool_mean[s]']:.3g}"]
            body.append(line)
        found.append(("Displacement along the plate of layers by initial depth, under the path", headings, body))
    warm = [(zone, iso) for zone in result.get("stir_zone", []) for iso in zone.get("isotherms", [])]
    if warm:
        found.append(("Isotherms of the highest temperatures",
                      ["place [mm]", "isotherm [K]", "depth [mm]", "width [mm]", "area [mm2]", "of the stir zone within"],
                      [[f"{zone['at[m]'] * look.MM:.3g}", f"{iso['temperature[K]']:.0f}", f"{iso['depth[m]'] * look.MM:.3g}",
                        f"{iso['width[m]'] * look.MM:.3g}", f"{iso['area[m2]'] * look.MM**2:.3g}",
                        percent(iso["share_of_stir_zone"])] for zone, iso in warm]))
    return found


def lines(result: dict) -> list[str]:
    """The same as text."""
    found = [f"t = {result['time[s]']:g} s, {result['particles']} particles, {result['lost']} lost"]
    found += [f"{name}: {value}" for name, value in rows(result)]
    for title, headings, body in tables(result):
        widths = [max(len(row[k]) for row in [headings, *body]) for k in range(len(headings))]
        found += ["", title] + ["  ".join(text.rjust(w) for text, w in zip(row, widths)) for row in [headings, *body]]
    return found
