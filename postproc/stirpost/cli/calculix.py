# SPDX-License-Identifier: MIT
"""Residual stress and distortion of a run by CalculiX: a deck of the plate, its temperatures and its clamps.

usage: stirpost calculix RUN_DIRECTORY [--cell MM] [--frames N] [--rate 1/S] [--strength K=MPa ...] [--expansion 1/K] [--cool S] [-o FILE.inp]

The plate at the start is a mesh of bricks (C3D8I); its bodies are one plate from the start. Each frame of the run is a step with the
temperatures of the metal that is there then; then the plate cools to AMBIENT, and at last all clamps and walls let it go: it stands on
three of its corners. &CLAMP holds its nodes until UNTIL, &WALL those of a face that it touches in the direction of its normal, until
the end of cooling. The metal is elastic and perfectly plastic, with the flow stress of its law at a plastic strain of 0.2 % and --rate
(default 1e-3 1/s) over temperature, or with --strength. Force and flow of the tool are left out, and
with them the stresses that they leave in the stir zone.

Written to FILE (default RUN_DIRECTORY/report/plate.inp) in mm, N and MPa. `ccx -i FILE` without .inp computes it (Debian:
calculix-ccx); FILE.frd has stresses and displacements at the end of cooling and after the release.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..analysis import metal
from ..analysis.tools import rigid
from ..analysis.units import MM
from ..calibrate.law import run_program
from ..io.files import write
from ..io.frames import Frame, NoRun
from ..run import Run, Scene

LEAST = 1.0  # MPa: strength of metal that has none, which CalculiX does not take
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])  # of a brick, in the order of C3D8
SIDES = ("xmin", "xmax", "ymin", "ymax", "zmin", "zmax")
NEAR = 6  # particles whose temperatures make that of a node
STRAIN = 2e-3


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost calculix", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--cell", type=float, metavar="MM", help="edge of the bricks (default: two particles)")
    parser.add_argument("--frames", type=int, default=30, help="largest number of steps of the run (default 30)")
    parser.add_argument("--rate", type=float, default=1e-3, metavar="1/S")
    parser.add_argument("--strength", nargs="+", metavar="K=MPa", help="flow stress of all metal over temperature, instead of that of the law")
    parser.add_argument("--expansion", type=float, metavar="1/K", help="expansion of metal whose &MATERIAL has none")
    parser.add_argument("--cool", type=float, default=100.0, metavar="S", help="time of the cooling (default 100 s)")
    parser.add_argument("--program", help="path of stirpoint, if it is not found by itself")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE")
    options = parser.parse_args(arguments)
    run = Run(options.run)
    plate = Plate(run, (options.cell / MM) if options.cell else 2.0 * run.spacing)
    strengths = {name: given(options.strength) if options.strength else strength_of(run.scene, name, options) for name in plate.materials}
    path = options.output or options.run / "report" / "plate.inp"
    path.parent.mkdir(parents=True, exist_ok=True)
    write(path, "\n".join([*plate.head(strengths, options.expansion), *plate.steps(options.frames, options.cool)]) + "\n")
    print(f"{len(plate.points)} nodes, {len(plate.bricks)} bricks in {path}")
    return 0


class Plate:
    """The metal at the start as bricks, numbered from 1 in the deck."""

    def __init__(self, run: Run, cell: float):
        if not run.frames:
            raise NoRun(f"{run.directory}: no frames")
        self.run, first = run, run.frames[0]
        self.tools = rigid(run.history)
        points, body = metal.metal_points(first, self.tools)
        half = 0.5 * run.spacing
        self.low, high = points.min(axis=0) - half, points.max(axis=0) + half
        self.counts = np.maximum(1, np.round((high - self.low) / cell)).astype(int)
        self.edge = (high - self.low) / self.counts
        inside = np.clip(((points - self.low) / self.edge).astype(int), 0, self.counts - 1)
        bricks, which = np.unique(inside, axis=0, return_index=True)
        nodes = (bricks[:, None] + CORNERS).reshape(-1, 3)
        index, self.bricks = np.unique(nodes, axis=0, return_inverse=True)
        self.bricks = self.bricks.reshape(-1, 8)
        self.points = self.low + index * self.edge
        names = [str(run.scene.of("body", first.body_names[b]).get("material", "")) for b in range(len(first.body_names))]
        self.material = np.array(names)[body[which]]
        self.materials = sorted(set(self.material))

    def temperatures(self, frame: Frame) -> np.ndarray:
        """Temperatures of the nodes: means over the nearest particles [K]."""
        from scipy.spatial import cKDTree

        points, _ = metal.metal_points(frame, self.tools)
        away, near = cKDTree(points).query(self.points, k=min(NEAR, len(points)))
        weight = 1.0 / (away + 0.1 * self.run.spacing) ** 2
        values = frame.need("temperature")[metal.metal_mask(frame, self.tools)].astype(float)
        return (values[near] * weight).sum(axis=1) / weight.sum(axis=1)

    def held(self, time: float) -> list[tuple[int, int]]:
        """Nodes and directions (1 to 3) that are fixed at a time."""
        found: set[tuple[int, int]] = set()
        reach = 1e-6 + 1e-3 * self.edge.min()
        for clamp in self.run.scene.groups("clamp"):
            if time > float(clamp.get("until", np.inf)):
                continue
            there = ((self.points >= np.array(clamp["lower"]) - reach) & (self.points <= np.array(clamp["upper"]) + reach)).all(axis=1)
            found |= {(n + 1, "xyz".index(c) + 1) for n in np.flatnonzero(there) for c in str(clamp.get("components", "xyz")).lower()}
        grid = self.run.scene.groups("grid")
        for wall in self.run.scene.groups("wall"):
            side = SIDES.index(str(wall["side"]).lower())
            axis, face = side // 2, (self.low, self.low + self.counts * self.edge)[side % 2][side // 2]
            at = wall.get("position", grid[0][("lower", "upper")[side % 2]][axis] if grid else np.nan)
            if abs(float(at) - face) < 0.5 * self.edge[axis]:
                found |= {(n + 1, axis + 1) for n in np.flatnonzero(np.abs(self.points[:, axis] - face) < reach)}
        return sorted(found)

    def supports(self) -> list[tuple[int, int]]:
        """Three nodes at the bottom whose supports prevent rigid-body motion only."""
        flat = self.points[self.points[:, 2] < self.low[2] + 0.5 * self.edge[2]]
        corners = [flat[np.argmin(flat @ direction)] for direction in ([1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, -1.0, 0.0])]
        a, b, c = (int(np.flatnonzero((self.points == corner).all(axis=1))[0]) + 1 for corner in corners)
        return [(a, 1), (a, 2), (a, 3), (b, 2), (b, 3), (c, 3)]

    def head(self, strengths: dict[str, list[tuple[float, float]]], expansion: float | None) -> list[str]:
        """Mesh and materials."""
        scene = self.run.scene
        lines = [f"** {self.run.name}: plate, temperatures and clamps, by stirpost calculix; mm, N, MPa, K", "*NODE, NSET=ALL"]
        lines += [f"{k}, {x:.9g}, {y:.9g}, {z:.9g}" for k, (x, y, z) in enumerate(self.points * MM, 1)]
        for number, name in enumerate(self.materials, 1):
            keys = scene.of("material", name)
            alpha = keys.get("expansion") or expansion
            if not alpha or not keys.get("youngs_modulus"):
                raise ValueError(f"&MATERIAL '{name}': YOUNGS_MODULUS and EXPANSION are needed, or --expansion")
            own = np.flatnonzero(self.material == name)
            lines += [f"*ELEMENT, TYPE=C3D8I, ELSET=BODY{number}"]
            lines += [f"{k + 1}, " + ", ".join(str(n + 1) for n in self.bricks[k]) for k in own]
            zero = float(keys.get("t_room", 298.0))
            lines += [f"** {name}", f"*MATERIAL, NAME=METAL{number}", "*ELASTIC",
                      f"{float(keys['youngs_modulus']) * 1e-6:.9g}, {float(keys.get('poisson_ratio', 0.3)):.6g}",
                      f"*EXPANSION, ZERO={zero:.9g}", f"{float(alpha):.9g}", "*PLASTIC",
                      *(f"{max(stress, LEAST):.9g}, 0, {kelvin:.9g}" for kelvin, stress in strengths[name]),
                      f"*SOLID SECTION, ELSET=BODY{number}, MATERIAL=METAL{number}"]
        start = self.temperatures(self.run.frames[0])
        return lines + ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", *(f"{k}, {t:.2f}" for k, t in enumerate(start, 1))]

    def steps(self, most: int, cool: float) -> list[str]:
        frames = self.run.frames[1:]
        frames = [frames[k] for k in np.unique(np.linspace(0, len(frames) - 1, most).astype(int))] if frames else []
        before, lines = self.run.frames[0].time, []
        for frame in frames:
            lines += step(f"t = {frame.time:.6g} s", frame.time - before, self.held(frame.time), enumerate(self.temperatures(frame), 1))
            before = frame.time
        ambient = float(self.run.scene.get("HEAT.AMBIENT", 298.0))
        everywhere = [("ALL", ambient)]
        end = np.nextafter(before, np.inf) if cool else before
        lines += step("cold, held", cool, self.held(end), everywhere, output=True)
        return lines + step("released", 1.0, self.supports(), everywhere, output=True)


def step(title: str, duration: float, held: list[tuple[int, int]], temperatures: Iterable[tuple[int | str, float]], output: bool = False) -> list[str]:
    shown = ["*NODE FILE", "U, NT", "*EL FILE", "S, PEEQ"] if output else []
    return [f"** {title}", "*STEP, INC=500", "*STATIC", f"{0.1 * duration:.6g}, {duration:.6g}", "*BOUNDARY, OP=NEW",
            *(f"{node}, {axis}, {axis}" for node, axis in held), "*TEMPERATURE", *(f"{node}, {kelvin:.2f}" for node, kelvin in temperatures),
            *(shown or ["*NODE FILE, FREQUENCY=0", "*EL FILE, FREQUENCY=0"]), "*END STEP"]


def given(pairs: list[str]) -> list[tuple[float, float]]:
    """Temperatures [K] and strengths [MPa] of K=MPa."""
    try:
        return sorted((float(kelvin), float(stress)) for kelvin, stress in (pair.split("=") for pair in pairs))
    except ValueError:
        raise ValueError(f"--strength {' '.join(pairs)}: expected K=MPa ...") from None


def strength_of(scene: Scene, name: str, options: argparse.Namespace) -> list[tuple[float, float]]:
    """Temperatures [K] and flow stresses [MPa] at a small plastic strain, by stirpoint --material."""
    material = scene.of("material", name)
    kelvins = np.linspace(298.0, float(material.get("t_melt", 1000.0)), 13)
    wanted = Scene("")
    wanted.add("MATERIAL", **material)
    names = [f"t{k:02d}" for k in range(len(kelvins))]
    for curve, kelvin in zip(names, kelvins):
        wanted.add("PATH", name=curve, material=name, kind="strain", rate=options.rate, strain=STRAIN, step=STRAIN / 10.0,
                   temperature=float(kelvin), rows=10)
    with tempfile.TemporaryDirectory() as folder:
        curves = run_program([wanted.write(Path(folder) / "law.nml")], Path(folder), names, options.program)
    return [(float(kelvin), float(curves[curve]["stress"][-1]) * 1e-6) for curve, kelvin in zip(names, kelvins)]
