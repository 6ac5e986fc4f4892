# SPDX-License-Identifier: MIT
"""How pictures look: colours, fonts, names and units for people."""

from __future__ import annotations

import io
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure

from .files import write

MM = 1e3  # metres to millimetres
CELSIUS = 273.15
INK = "#22303c"
PAPER = "#eef1f4"
STYLE = {
    "font.size": 9.5,
    "font.family": "DejaVu Sans",
    "axes.titlesize": 9.5,
    "axes.edgecolor": "#8a96a3",
    "axes.linewidth": 0.7,
    "axes.labelcolor": INK,
    "axes.grid": False,
    "grid.color": "#d9dfe5",
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "text.color": INK,
    "figure.dpi": 130,
    "savefig.dpi": 130,
}
LINES = [
    "#0b6fa4",
    "#d1541b",
    "#2a8c4a",
    "#8a4fa3",
    "#b8860b",
    "#c2335a",
    "#4b5fc1",
    "#5d6a75",
    "#14a0a0",
    "#7a4a21",
]
PREFIX = {"N", "W", "J", "Nm", "Pa"}
UNIT_NAMES = {"Nm": "N m", "": "1"}


def part_of(name: str, low: float, high: float) -> Colormap:
    """A part of a colour map of matplotlib."""
    whole = matplotlib.colormaps[name]
    return ListedColormap(whole(np.linspace(low, high, 256)), name=f"{name}_part")


TEMPERATURE = part_of("inferno", 0.20, 0.975)
STRAIN = part_of("viridis", 0.0, 1.0)


def new_figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.09, h_pad=0.05)
    FigureCanvasAgg(figure)
    return figure


def rendered(figure: Figure) -> bytes:
    """As PNG."""
    figure.get_layout_engine().execute(figure)
    figure.set_layout_engine("none")  # else the layout is sought a second time
    picture = io.BytesIO()
    figure.savefig(picture, facecolor="white")
    return picture.getvalue()


def drawn(draw, *arguments) -> bytes | None:
    """The picture that a function makes; None if it makes none."""
    figure = draw(*arguments)
    return None if figure is None else rendered(figure)


def save(figure: Figure, path: Path) -> Path:
    return write(path, rendered(figure))


def line_colours(count: int) -> list:
    if count <= len(LINES):
        return LINES[:count]
    return list(matplotlib.colormaps["viridis"](np.linspace(0, 0.92, count)))


def words(name: str) -> str:
    """plastic_work -> plastic work"""
    return name.replace("_", " ")


def scaled(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit that bring a value to a handy size: 12000 N -> 12 kN."""
    shown = UNIT_NAMES.get(unit, unit)
    if unit not in PREFIX or not np.isfinite(largest):
        return 1.0, shown
    for factor, prefix in ((1e-9, "G"), (1e-6, "M"), (1e-3, "k")):
        if abs(largest) * factor >= 2:
            return factor, prefix + shown
    return 1.0, shown


def seconds(time: float) -> str:
    """A time with as many digits as tell frames apart."""
    if abs(time) >= 1 or time == 0:
        return f"{time:.2f} s"
    return f"{time * 1e3:.3g} ms"


def mm(value: float | None, power: int = 1, digits: int = 4) -> str:
    unit = {1: "mm", 2: "mm\N{SUPERSCRIPT TWO}", 3: "mm\N{SUPERSCRIPT THREE}"}[power]
    return "-" if value is None else f"{value * MM**power:.{digits}g} {unit}"


def squares(panel, u: np.ndarray, z: np.ndarray, half: np.ndarray, values: np.ndarray, colours: Colormap, norm):
    """Particles of a slab as squares of half an edge around places, coloured by values."""
    corners = [np.stack([u + a * half, z + b * half], axis=1) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    drawn = PolyCollection(np.stack(corners, axis=1), array=values, cmap=colours, norm=norm, linewidths=0)
    panel.add_collection(drawn)
    return drawn
