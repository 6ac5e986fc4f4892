# SPDX-License-Identifier: MIT
"""How pictures look: colours, fonts, scales."""

from __future__ import annotations

import io
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.units import CELSIUS
from ..io.files import write

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure

SCALES = {"K": ("K", 0.0), "C": ("\N{DEGREE SIGN}C", CELSIUS)}
degrees = "K"  # of temperatures in pictures: a name of SCALES
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
LINES = ["#0b6fa4", "#d1541b", "#2a8c4a", "#8a4fa3", "#b8860b", "#c2335a", "#4b5fc1", "#5d6a75", "#14a0a0", "#7a4a21"]
WIDTH, LEFT, BAR, BELOW, TITLE, GAP = 10.8, 0.62, 1.05, 0.5, 0.27, 0.18  # of a picture of panels, and beside them [inches]


@cache
def part_of(name: str, low: float, high: float) -> Colormap:
    """A part of a colour map of matplotlib."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    whole = matplotlib.colormaps[name]
    return ListedColormap(whole(np.linspace(low, high, 256)), name=f"{name}_part")


MAPS = {"TEMPERATURE": ("inferno", 0.20, 0.975), "STRAIN": ("viridis", 0.0, 1.0), "FILL": ("Greys", 0.0, 0.7)}


def __getattr__(name: str) -> Colormap:
    """look.TEMPERATURE and look.STRAIN, the colour maps: matplotlib is imported when something is drawn."""
    if name not in MAPS:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    return part_of(*MAPS[name])


def style() -> AbstractContextManager[None]:
    """Context in which pictures are drawn in the style of the report."""
    import matplotlib

    return matplotlib.rc_context(STYLE)


def new_figure(width: float, height: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.09, h_pad=0.05)
    FigureCanvasAgg(figure)
    return figure


def panels(count: int, size: tuple[float, float], scale: float, bar: bool = True, per_row: int | None = None,
           below: float = BELOW) -> tuple[Figure, list[Axes], Axes | None]:
    """A figure of `count` panels of `size` [mm] at `scale` inches per mm, laid out by hand: axes in rows, those below and at the
    left with ticks, which take a third of the time of a picture, and the axis of a colour bar at the right (None without)."""
    width, height = size[0] * scale, size[1] * scale
    columns = per_row or max(1, min(count, int((WIDTH - LEFT - BAR + GAP) / (width + GAP))))
    rows = -(-count // columns)
    wide = LEFT + columns * width + (columns - 1) * GAP + (BAR if bar else 0.15)
    tall = below + rows * height + rows * TITLE + 0.04
    figure = new_figure(wide, tall)
    figure.set_layout_engine("none")
    axes = []
    for k in range(count):
        row, column = divmod(k, columns)
        left, bottom = LEFT + column * (width + GAP), tall - (row + 1) * (height + TITLE)
        axis = figure.add_axes((left / wide, bottom / tall, width / wide, height / tall))
        axis.tick_params(labelleft=column == 0, labelbottom=k + columns >= count)
        whole_ticks(axis, width if k + columns >= count else 0.0, height if column == 0 else 0.0)
        axes.append(axis)
    strip = None
    if bar:
        high = min(rows * (height + TITLE) - TITLE, 3.2)
        strip = figure.add_axes(((wide - BAR + 0.14) / wide, (tall - TITLE - high) / tall, 0.14 / wide, high / tall))
    return figure, axes, strip


def strips(count: int, height: float = 1.85) -> tuple[Figure, list[Axes]]:
    """A figure of `count` panels over one another that share their x, with room for legends at their right."""
    left, right, below, above, gap = 0.78, 2.35, 0.5, 0.3, 0.17
    wide, tall = 9.6, below + above + count * height + (count - 1) * gap
    figure = new_figure(wide, tall)
    figure.set_layout_engine("none")
    axes: list[Axes] = []
    for k in range(count):
        bottom = tall - above - (k + 1) * height - k * gap
        axes.append(figure.add_axes((left / wide, bottom / tall, (wide - left - right) / wide, height / tall), sharex=axes[0] if axes else None))
        axes[-1].tick_params(labelbottom=k == count - 1)
        axes[-1].yaxis.set_label_coords(-0.55 / (wide - left - right), 0.5)
    return figure, axes


def whole_ticks(axis: Axes, width: float, height: float) -> None:
    """Ticks at whole numbers, half an inch apart or more; none on an axis without length."""
    from matplotlib.ticker import MaxNLocator, NullLocator

    for one, inches in ((axis.xaxis, width), (axis.yaxis, height)):
        one.set_major_locator(NullLocator() if inches == 0.0 else MaxNLocator(nbins=max(1, min(10, int(inches / 0.4))), steps=[1, 2, 5, 10], integer=True, min_n_ticks=2))


def colour_bar(figure: Figure, norm: Normalize, colours: Colormap, strip: Axes | None, label: str, extend: str = "neither", **more: str) -> None:
    """Colour bar beside panels of given positions; a logarithmic scale has plain numbers."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    bar = figure.colorbar(ScalarMappable(norm, colours), cax=strip, label=label, extend=extend, **more)
    if isinstance(norm, LogNorm) and norm.vmin >= 1e-3:
        decades = 10.0 ** np.arange(np.ceil(np.log10(norm.vmin) - 1e-6), np.log10(norm.vmax))
        decades = decades[decades < norm.vmax / 1.5]  # a number would lie on that of the end
        bar.set_ticks([x for x in np.append(decades, norm.vmax)])
        bar.set_ticklabels([f"{x:.3g}" for x in np.append(decades, norm.vmax)])
        bar.minorticks_off()


def rendered(figure: Figure) -> bytes:
    """The figure as PNG."""
    from matplotlib.layout_engine import PlaceHolderLayoutEngine

    engine = figure.get_layout_engine()
    if engine is not None and not isinstance(engine, PlaceHolderLayoutEngine):
        engine.execute(figure)
        figure.set_layout_engine("none")
    figure.set_facecolor("white")
    picture = io.BytesIO()
    figure.canvas.print_png(picture, pil_kwargs={"compress_level": 1})  # savefig would draw it twice for its layout
    return picture.getvalue()


def drawn(draw: Callable[..., Figure | None], *arguments: Any) -> bytes | None:
    """The picture that a function draws; None if it draws none."""
    figure = draw(*arguments)
    return None if figure is None else rendered(figure)


def save(figure: Figure, path: Path) -> Path:
    return write(path, rendered(figure))


def line_kinds(count: int) -> list[dict]:
    """Colours, and after the last of them the same again dashed, then dotted."""
    kinds = ("-", "--", ":")
    return [{"color": LINES[k % len(LINES)], "linestyle": kinds[k // len(LINES) % len(kinds)]} for k in range(count)]


def line_colours(count: int) -> list:
    if count <= len(LINES):
        return LINES[:count]
    import matplotlib

    return list(matplotlib.colormaps["viridis"](np.linspace(0, 0.92, count)))


def use_degrees(name: str) -> None:
    """Pictures have temperatures in K or C."""
    global degrees
    degrees = name


def unit_of_temperature() -> str:
    return SCALES[degrees][0]


def shown(name: str, values: np.ndarray) -> np.ndarray:
    """Values of a field as pictures have them: temperatures in the unit that was chosen."""
    return values - SCALES[degrees][1] if name == "temperature" else values
