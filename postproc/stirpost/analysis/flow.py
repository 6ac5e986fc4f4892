# SPDX-License-Identifier: MIT
"""Flow of the metal by the tool: flash, groove, cavity, stir zone, layers, voids."""

from __future__ import annotations

from collections.abc import Callable, Set
from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..io.frames import Frame, NoRun
from ..io.scene import cavity_of
from . import metal
from .tool_path import ToolPath, tool_path_of
from .tools import rigid
from .voids import Voids

if TYPE_CHECKING:
    from ..run import Run

REGIONS = ("plate", "cavity", "above_advancing", "above_retreating", "ends", "sides", "below", "debris")
PARTS = 5  # points along each edge of a particle that lies in several regions
SHIFTS = 0.5 * np.array([np.sqrt(2.0), np.sqrt(3.0), np.sqrt(5.0)])  # of these points from particle to particle


class Flow:
    """Particles of a frame and the same particles in the first frame, without rigid bodies."""

    def __init__(self, run: Run, frame: Frame):
        self.run, self.frame, self.scene = run, frame, run.scene
        tools = rigid(run.history)
        self.bodies = [name for name in frame.body_names if name not in tools]
        self.first = first = run.frames[0]
        if first is frame:
            raise NoRun("there is one frame only: nothing to compare it with")
        self.ids, place, body = by_number(first, tools)
        now_ids, now, _ = by_number(frame, tools)
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
        self.whole, self.pieces = metal.connected(self.x, self.body, max(reach, 1.01 * run.spacing))
        self.tool_path: ToolPath | None = None
        with suppress(NoRun):  # measures without the track remain
            self.tool_path = self.way
        self.cavity = cavity_of(self.scene, self.bodies)

    def field(self, name: str, frame: Frame | None = None) -> np.ndarray | None:
        """A field in the order of the particles."""
        frame = frame or self.frame
        values = frame.field(name)
        if values is None:
            return None
        ids = frame.need("id")
        order = np.argsort(ids)
        return values[order][np.searchsorted(ids[order], self.number)].astype(float)

    def expansion(self) -> np.ndarray:
        """Volume over the initial volume, from temperature and pressure; 1 if the input has no properties for it."""
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

    @property
    def way(self) -> ToolPath:
        """The path of the tool; NoRun without one that travels."""
        return self.tool_path or tool_path_of(self.run, self.scene, self.frame.time)

    @cached_property
    def voids(self) -> Voids:
        return Voids(self)

    # -- where the metal is ---------------------------------------------------------------------------------------

    def side(self, x: np.ndarray) -> np.ndarray:
        return self.tool_path.side(x) if self.tool_path is not None else x[:, 1] - 0.5 * (self.low[1] + self.high[1])

    def shares(self, x: np.ndarray, edge: np.ndarray) -> np.ndarray:
        """Part of each box of edges (n, 3) in each region (n, len(REGIONS)): exact where planes bound it, else of points in it."""
        axis = 0 if self.tool_path is None else int(np.abs(self.tool_path.along).argmax())
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
        if self.cavity:
            result[:, 1] = inside * self.sampled(np.flatnonzero(inside > 0.0), *inner, self.cavity.holds)
        result[:, 0] = inside - result[:, 1]
        return result

    def sampled(self, chosen: np.ndarray, low: np.ndarray, high: np.ndarray, holds: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Fraction of each chosen box inside the region `holds`, 0 for the others. Boxes whose corners differ are sampled by points that are shifted
        from box to box, so that a boundary along a lattice is not resolved in steps."""
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

    def budget(self) -> dict[str, float | None]:
        """Volumes [m3]: increase in each region since the first frame, groove, expansion."""
        now, then = self.shares(self.x, self.edges), self.shares(self.x0, np.repeat(self.edge0[:, None], 3, axis=1))
        now[~self.whole] = np.eye(len(REGIONS))[REGIONS.index("debris")]
        gain = {name: float((now[:, k] * self.volume).sum() - (then[:, k] * self.volume0).sum())
                for k, name in enumerate(REGIONS)}
        result: dict[str, float | None] = {f"{name}[m3]": gain[name] for name in REGIONS[1:]}
        result["expansion[m3]"] = expansion = float(self.volume.sum() - self.volume0.sum())
        self.now_shares, self.then_shares = now, then
        if self.tool_path is None:
            return result
        depth, centres = self.depths(now[:, 0] * self.volume, then[:, 0] * self.volume0)
        strip = self.tool_path.passed(np.column_stack([centres, np.zeros(len(centres))]), beyond=self.spacing)
        groove = float(depth[strip].sum()) * self.spacing**2
        left = sum(gain[name] for name in REGIONS[1:]) - expansion
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

    def measures(self, sections: list[float] | None = None, strain: float = 1.0, isotherms: list[float] | None = None,
                 whole: bool = False) -> dict:
        """All measures; `whole` reads every frame, for the highest temperatures and the lengths of paths."""
        result: dict = {"time[s]": self.frame.time, "since[s]": self.first.time, "particles": len(self.x), "lost": self.lost,
                        "flash": self.flash(), "volumes": self.budget()}
        if self.cavity:
            result["cavity"] = self.fill()
        if len(self.bodies) > 1:
            result["mixing"] = self.mixing()
        if self.tool_path is None:
            return result
        length = None
        peak = self.field("temperature")
        if whole:
            peak, length = self.over_time()
        places = self.default_sections() if sections is None else sections
        result["stir_zone"] = [self.stir_zone(at, strain, peak, isotherms) for at in places]
        result["layers"] = self.layers(length)
        with suppress(NoRun):  # there is no track behind the tool yet
            result["voids"] = self.voids.measures()
        return result

    def flash(self) -> dict:
        """Height of the metal above the first face on each side [m], without debris that has left its body."""
        top = self.x[:, 2] + 0.5 * self.edge0 - self.face
        found: dict[str, float] = {"debris_pieces": self.pieces, "debris_particles": int((~self.whole).sum())}
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
        if self.tool_path is None:
            return result
        inside = self.now_shares[:, k] * self.volume
        ahead = self.tool_path.progress(self.x) > self.tool_path.progress(middle[None])[0]
        advancing = self.tool_path.side(self.x) > self.tool_path.side(middle[None])[0]
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

    def stir_zone(self, at: float, limit: float, peak: np.ndarray | None, isotherms: list[float] | None) -> dict:
        """In the slab of a spacing around a place along the travel: extent of strains above `limit`, and of isotherms."""
        strain = self.field("plastic_strain")
        strain = np.zeros(len(self.x)) if strain is None else strain
        slab = (np.abs(self.way.coordinate(self.x) - at) <= 0.5 * self.spacing * (1 + 1e-6)) & self.whole
        stirred = slab & (strain > limit)
        found: dict = {"at[m]": float(at), "strain_above": limit} | self.extent(stirred)
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
            ids, points = frame.need("id"), frame.points()
            order = np.argsort(ids)
            place = points[order][np.searchsorted(ids[order], self.number)]
            length += np.linalg.norm(place - last, axis=1)
            last = place
            warm = self.field("temperature", frame)
            if warm is not None:
                peak = warm if peak is None else np.maximum(peak, warm)
        return peak, length


def by_number(frame: Frame, tools: Set[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers, positions and bodies of all particles but those of tools, sorted by number."""
    keep = metal.metal_mask(frame, tools)
    points, body, ids = frame.points()[keep], frame.bodies()[keep], frame.need("id")[keep]
    order = np.argsort(ids)
    return ids[order], points[order], body[order]


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
