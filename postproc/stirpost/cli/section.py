# SPDX-License-Identifier: MIT
"""Grain size on a cross-section of a processed plate.

usage: stirpost section RUN_DIRECTORY --x 65e-3 [--time T] [--offset 5e-3] [--centre Y] [-o DIR]

Takes the particles of one frame (the last one, or the first at or after T) within half a particle of the plane
x = const, where they are now. Three lines go down through the plate: the centre (default: the middle of the body),
the advancing side at +y (travel +x, spin clockwise seen from above) and the retreating side at -y, OFFSET away. The
stir zone is what has a plastic strain above 1. Written to DIR (default RUN_DIRECTORY/report): section_x65.csv (lines
by distance from the bottom), section_x65.json (stir zone), section_x65.png.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import units
from ..io.files import write
from ..io.frames import NoRun
from ..plots import look
from ..run import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STIRRED = 1.0  # plastic strain
LINES = (("retreating", -1.0), ("centre", 0.0), ("advancing", 1.0))
FIELDS = ("grain_size", "plastic_strain", "temperature", "dislocation_density")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost section", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--x", type=float, default=65e-3, help="[m]")
    parser.add_argument("--time", type=float, help="[s]")
    parser.add_argument("--offset", type=float, default=5e-3, help="distance of the side lines from the centre [m]")
    parser.add_argument("--centre", type=float, help="y of the centre line [m]")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    run = Run(options.run)
    output = options.output or options.run / "report"
    output.mkdir(parents=True, exist_ok=True)
    report(Section(run, options), options, output)
    return 0


class Section:
    """Particles of one frame near the plane, with their fields."""

    def __init__(self, run: Run, options: argparse.Namespace):
        frame = run.at(options.time)
        if "grain_size" not in frame.fields:
            raise NoRun(f"{frame.path}: no grain size (no material with LAW = 'two-phase')")
        points = frame.points()
        self.time, self.spacing = frame.time, run.spacing
        self.bottom = points[:, 2].min() - 0.5 * run.spacing
        self.centre = 0.5 * (points[:, 1].min() + points[:, 1].max()) if options.centre is None else options.centre
        near = np.abs(points[:, 0] - options.x) <= 0.5 * run.spacing * (1.0 + 1e-6)
        if not near.any():
            raise NoRun(f"no particle near x = {options.x} m at t = {frame.time} s")
        self.y, self.z = points[near, 1], points[near, 2]
        self.fields = {name: frame.need(name)[near].astype(float) for name in FIELDS}
        if not (self.fields["grain_size"] > 0.0).all():
            raise NoRun(f"{frame.path}: field grain_size is not above 0 everywhere near x = {options.x} m")
        self.stirred = self.fields["plastic_strain"] > STIRRED

    def line(self, y: float) -> np.ndarray:
        """Means in layers of a particle's height along the line at `y`: height, values, numbers."""
        near = np.abs(self.y - y) <= self.spacing
        layer = np.floor((self.z[near] - self.bottom) / self.spacing).astype(int)
        rows = []
        for k in np.unique(layer):
            own = np.flatnonzero(near)[layer == k]
            rows.append([self.z[own].mean() - self.bottom, len(own)]
                        + [self.fields[name][own].mean() for name in FIELDS])
        return np.array(rows).reshape(-1, 2 + len(FIELDS))

    def stir_zone(self) -> dict:
        """Its extent and grain sizes; the surface are its upper two layers, its edge strains of 1 to 2."""
        zone = self.stirred
        if not zone.any():
            return {"stirred_particles": 0}
        size, strain = self.fields["grain_size"], self.fields["plastic_strain"]
        top = self.z[zone].max()
        surface = zone & (self.z > top - 2.0 * self.spacing)
        edge = zone & (strain < 2.0)
        return {
            "stirred_particles": int(zone.sum()),
            "depth[m]": float(top - self.z[zone].min() + self.spacing),
            "width[m]": float(np.ptp(self.y[zone]) + self.spacing),
            "grain_size_mean[m]": float(size[zone].mean()),
            "grain_size_median[m]": float(np.median(size[zone])),
            "grain_size_10_90[m]": [float(x) for x in np.quantile(size[zone], [0.1, 0.9])],
            "grain_size_surface[m]": float(size[surface].mean()),
            "grain_size_edge[m]": float(size[edge].mean()) if edge.any() else None,
            "temperature_max[K]": float(self.fields["temperature"][zone].max()),
        }


def report(section: Section, options: argparse.Namespace, output: Path) -> None:
    stem = output / f"section_x{options.x * 1e3:g}"
    lines = {name: section.line(section.centre + side * options.offset) for name, side in LINES}
    table = ["line,height[m],particles,grain_size[m],plastic_strain[1],temperature[K],dislocation_density[1/m2]"]
    table += [",".join([name, *(f"{x:.6g}" for x in row)]) for name, rows in lines.items() for row in rows]
    write(Path(f"{stem}.csv"), "\n".join(table) + "\n")
    zone = {"time[s]": section.time, "x[m]": options.x, "offset[m]": options.offset} | section.stir_zone()
    write(Path(f"{stem}.json"), json.dumps(zone, indent=1) + "\n")
    with look.style():
        look.save(picture(section, lines, options), Path(f"{stem}.png"))
    for key, value in zone.items():
        print(f"{key}: {value}")


def picture(section: Section, lines: dict[str, np.ndarray], options: argparse.Namespace) -> Figure:
    from matplotlib.colors import LogNorm

    figure = look.new_figure(7.2, 6.0)
    above, below = figure.subplots(2, 1)
    size = section.fields["grain_size"] * 1e6
    inside = size[section.stirred] if section.stirred.any() else size
    norm = LogNorm(0.8 * inside.min(), max(2.0 * np.median(inside), 1.01 * inside.min()))
    side = 72 * 6.0 * section.spacing / max(np.ptp(section.y), 1e-9)
    drawn = above.scatter(section.y * units.MM, section.z * units.MM, c=size, norm=norm, s=side**2, marker="s",
                          cmap=look.STRAIN, linewidths=0)
    zone = section.stirred
    above.scatter(section.y[zone] * units.MM, section.z[zone] * units.MM, s=2, color="white", linewidths=0)
    figure.colorbar(drawn, ax=above, label="grain size [µm]", extend="both")
    above.set_aspect("equal")
    above.set_xlabel("y [mm], advancing side to the right; dots: plastic strain above 1")
    above.set_ylabel("z [mm]")
    above.set_title(f"x = {options.x * units.MM:g} mm at {units.seconds(section.time)}")
    for (name, rows), colour in zip(lines.items(), look.line_colours(len(lines)), strict=True):
        below.plot(rows[:, 0] * units.MM, rows[:, 2] * 1e6, "o-", markersize=3, color=colour, label=name)
    below.set_yscale("log")
    below.set_xlabel("distance from the bottom [mm]")
    below.set_ylabel("grain size [µm]")
    below.grid(True)
    below.legend()
    return figure

