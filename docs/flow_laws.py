#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Flow stress of the metals for welds over temperature, hot working beside Johnson-Cook: picture and table of docs/materials.md.

    docs/flow_laws.py

Writes docs/pictures/flow_laws.png and the table. The program is that of STIRPOINT_EXECUTABLE, else build/release/stirpoint.
"""

from __future__ import annotations

import re
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "postproc"))

import matplotlib  # noqa: E402
import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
from PIL import Image  # noqa: E402

from stirpost.io import program  # noqa: E402
from stirpost.plots import look  # noqa: E402

PAGE = ROOT / "docs/materials.md"
PICTURE = ROOT / "docs/pictures/flow_laws.png"
LAWS = {"hot-working": "hot working", "johnson-cook": "Johnson-Cook"}
RATES = (1, 100)  # [1/s]
PARTS = (0.7, 0.8, 0.9)  # of T_MELT, in the table
STRAIN = 0.5
TABLE = re.compile(r"(<!-- flow stress: docs/flow_laws.py -->\n)(.*?)(<!-- end of the flow stress -->)", re.DOTALL)


@dataclass
class Metal:
    """An entry of the library with hot working: what the source of its law says, in K, 1/s and MPa."""

    name: str
    melts: float
    temperatures: tuple  # of the tests
    rates: tuple  # empty if the source names none
    plausible: tuple  # temperature, lowest and highest stress at 1/s and at 100/s; empty if the source names none


def metals() -> list[Metal]:
    text = (ROOT / "share/stirpoint/materials.nml").read_text(encoding="utf-8")
    found = []
    for entry in re.split(r"(?m)^&MATERIAL", text):
        if "LAW = 'hot-working'" not in entry:
            continue
        source = re.search(r"KEYS = 'LAW ST_.*?TEXT = '([^']*)'", entry, re.DOTALL)[1]
        low, high, *rates = re.search(r"([\d.]+) to ([\d.]+) K(?:, ([\d.e-]+) to ([\d.e-]+) 1/s)?", source).groups()
        stresses = re.search(r"plausible at (\d+) K: (\d+) to (\d+) MPa at 1/s, (\d+) to (\d+) MPa at 100/s", source)
        found.append(Metal(re.search(r"NAME = '([^']*)'", entry)[1], float(re.search(r"T_MELT = (\d+)", entry)[1]), (low, high),
                           tuple(filter(None, rates)), tuple(map(float, stresses.groups())) if stresses else ()))
    return found


def stresses(points: list[tuple[str, str, float, float]]) -> np.ndarray:
    """Stress [MPa] at a plastic strain of STRAIN for each (entry, law, rate, temperature)."""
    text = "&RUN TITLE = 'Flow laws side by side' /\n"
    for name, law in dict.fromkeys(point[:2] for point in points):
        text += f"&MATERIAL NAME = '{name} {law}', FROM = '{name}', LAW = '{law}' /\n"
    for k, (name, law, rate, temperature) in enumerate(points):
        text += (f"&PATH NAME = '{k}', MATERIAL = '{name} {law}', RATE = {rate}, TEMPERATURE = {temperature:.2f}, "
                 f"STRAIN = {STRAIN}, STEP = 0.1, ROWS = 1 /\n")
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "laws.nml").write_text(text, encoding="utf-8")
        done = program.run([f"{folder}/laws.nml", "--material", "--quiet", "--output", f"{folder}/laws.out"])
        if done.returncode:
            raise SystemExit(done.stderr)
        return np.array([pd.read_csv(f"{folder}/laws.out/{k}.csv", comment="#")["stress[Pa]"].iloc[-1]
                         for k in range(len(points))]) * 1e-6


def table() -> str:
    """Rows of the table: hot working / Johnson-Cook."""
    points = [(m.name, law, rate, part * m.melts) for m in metals() for part in PARTS for rate in RATES for law in LAWS]
    values = iter(stresses(points))
    lines = ["| | tests [K] | [1/s] | " + " | ".join(f"{part:g} T_MELT, {rate}/s" for part in PARTS for rate in RATES) + " |",
             "|---" * (3 + len(PARTS) * len(RATES)) + "|"]
    for m in metals():
        cells = [f"{next(values):.0f} / {next(values):.0f}" for _ in range(len(PARTS) * len(RATES))]
        lines.append(f"| `{m.name}` | {' to '.join(m.temperatures)} | {' to '.join(m.rates)} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def picture():
    """A panel a metal; the range of the temperatures of the tests is shaded."""
    shown = metals()
    grids = [np.linspace(298.0, m.melts - 1.0, 45) for m in shown]
    points = [(m.name, law, rate, t) for m, grid in zip(shown, grids) for law in LAWS for rate in RATES for t in grid]
    values = stresses(points).reshape(len(shown), len(LAWS), len(RATES), -1)
    figure = look.new_figure(11.0, 7.0)
    axes = figure.subplots(-(-len(shown) // 4), 4).ravel()
    for axis, m, grid, curves in zip(axes, shown, grids, values):
        axis.axvspan(*map(float, m.temperatures), color="#dbe4ec")
        for law, style, rates in zip(LAWS, ("-", "--"), curves):
            for rate, colour, curve in zip(RATES, look.LINES, rates):
                axis.plot(grid, curve, style, color=colour, label=f"{LAWS[law]}, {rate}/s")
        axis.set_title(m.name)
        axis.set_ylim(0.0, None)
        axis.grid(True)
        axis.set_axisbelow(True)
    for axis in axes[len(shown):]:
        axis.set_axis_off()
    axes[-1].legend(*axes[0].get_legend_handles_labels(), loc="center")
    figure.supxlabel("temperature [K]")
    figure.supylabel("flow stress at a strain of 0.5 [MPa]")
    return figure


def main() -> int:
    with matplotlib.rc_context(look.STYLE):
        look.save(picture(), PICTURE)
    with Image.open(PICTURE) as image:
        image.convert("P", palette=Image.Palette.ADAPTIVE, colors=128).save(PICTURE, optimize=True)
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(TABLE.sub(lambda found: found[1] + table() + found[3], page), encoding="utf-8")
    print(f"{PICTURE.relative_to(ROOT)}: {PICTURE.stat().st_size / 1000:.0f} kB; table of {PAGE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
