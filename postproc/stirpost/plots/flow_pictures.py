# SPDX-License-Identifier: MIT
"""Sections of the track of a tool with its voids, and of a cavity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from ..analysis import surface, units
from . import look, maps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..analysis.flow import Flow
    from ..analysis.voids import Voids

MOST = 5  # sections
ORIGIN = ("Spectral", 0.0, 1.0)  # colours of the side that metal came from


def strain_of(flow: Flow) -> np.ndarray:
    strain = flow.field("plastic_strain")
    return np.zeros(len(flow.x)) if strain is None else strain


def sheet(voids: Voids) -> Figure:
    """Sections at equal distances: the fill from which voids are measured, and how far from the way the metal was at first, faded as the fill."""
    flow, (s, n, z) = voids.flow, voids.axes
    count = min(MOST, len(s) // 4 + 1) + 1
    chosen = ((np.arange(count) + 0.5) / count * len(s)).astype(int)  # not at the ends, where half of what a kernel weighs is missing
    higher, flash = voids.above(flow.face + 0.4 * (flow.face - flow.low[2]))
    up = np.concatenate([z, higher])
    came, half = voids.way.side(flow.x0) * units.MM, 0.5 * voids.step
    colours, norm = look.part_of(*ORIGIN), Normalize(-0.6 * n[-1] * units.MM, 0.6 * n[-1] * units.MM)
    extent = [units.MM * x for x in (n[0] - half, n[-1] + half, up[0] - half, up[-1] + half)]
    scale = min(4.9 / (extent[1] - extent[0]), 2.2 / (extent[3] - extent[2]))
    figure, axes, _ = look.panels(2 * len(chosen), (extent[1] - extent[0], extent[3] - extent[2]), scale, per_row=2, below=1.15, bar=False)
    kinds = ((look.FILL, Normalize(0.0, 1.0)), (colours, norm))
    places = np.stack(np.meshgrid(n, up, indexing="ij"), axis=-1).reshape(-1, 2)
    for k, pair in zip(chosen, zip(axes[::2], axes[1::2])):
        fill = np.concatenate([voids.fill[k], flash[k]], axis=1)
        nearby = np.flatnonzero(np.abs(voids.place[:, 0] - s[k]) <= maps.REACH * flow.spacing)
        nearby = nearby if len(nearby) >= maps.NEIGHBOURS else np.arange(len(voids.place))
        near, weight = maps.weights(np.column_stack([np.full(len(places), s[k]), places]), voids.place[nearby], flow.spacing)
        picture = colours(norm((came[nearby][near] * weight).sum(axis=1).reshape(fill.shape)))
        picture[..., 3] = fill.clip(0.0, 1.0)
        for panel, values, (shades, limits) in zip(pair, (fill, picture), kinds):
            panel.imshow(np.swapaxes(values, 0, 1), origin="lower", extent=extent, cmap=shades, norm=limits, interpolation="bilinear", aspect="auto")
            for there, width in ((voids.missing.found[k], 0.8), (voids.holes[k], 1.8)):
                if there.any() and not there.all():
                    panel.contour(n * units.MM, z * units.MM, there.T.astype(float), [0.5], colors="#e3122d", linewidths=width)
            panel.axhline(voids.lid * units.MM, color=look.INK, linewidth=0.6, linestyle="--")
            panel.set_xlim(extent[:2])
            panel.set_ylim(extent[2:])
            panel.set_facecolor("white")
        pair[0].set_title(f"{voids.coordinate(s[k]) * units.MM:.3g} mm along the travel; missing in voids: {units.mm(voids.sections[k], 2, 2)}", loc="left", pad=3)
        pair[0].set_ylabel("z [mm]")
    sides = "advancing side +" if voids.way.advancing is not None else "left +"
    labels = "fill: metal over room [1]", f"metal came from [mm], {sides}"
    inches = figure.get_size_inches()
    for panel, (shades, limits), label, beyond in zip(axes[-2:], kinds, labels, ("max", "both")):
        panel.set_xlabel(f"from the path [mm], {sides}")
        box = panel.get_position()
        strip = figure.add_axes((box.x0 + 0.1 * box.width, 0.48 / inches[1], 0.8 * box.width, 0.13 / inches[1]))
        look.colour_bar(figure, limits, shades, strip, label, beyond, orientation="horizontal")
    return figure


def cavity_picture(flow: Flow) -> Figure:
    """Three sections through the cavity, across the travel: plastic strain, the cavity's outline."""
    axis = 0 if flow.tool_path is None else int(np.abs(flow.tool_path.along).argmax())
    across = 1 - axis
    low, high = flow.cavity.low, flow.cavity.high
    strain = strain_of(flow)
    norm = maps.strain_norm_of(strain)
    mesh = surface.metal(flow.run, flow.frame, maps.fields_of(flow.frame))
    bottom, top = flow.low - 0.5e-3, flow.high + 0.5e-3
    top[2] = max(flow.face + 2e-3, float(np.percentile(flow.x[:, 2], 99.9)) + 1e-3)
    size = (top - bottom)[[across, 2]] * units.MM
    figure, axes, strip = look.panels(3, tuple(size), min(6.5 / size[0], 2.4 / size[1]), per_row=1)
    for panel, part in zip(axes, (0.25, 0.5, 0.75)):
        at = low[axis] + part * (high[axis] - low[axis])
        view = maps.section(maps.View(flow.frame, bottom, top, "", mesh, axis), flow.x, at, flow.spacing)
        maps.draw_section(panel, view, view.spread(strain), look.STRAIN, norm)
        tool = maps.tool_cut(flow.run.tool_mesh(flow.frame), axis, at)
        panel.add_collection(LineCollection([line * units.MM for line in tool], colors=look.INK, linewidths=1.2))
        gu, gz = (np.linspace(low[k] - 1e-4, high[k] + 1e-4, 200) for k in (across, 2))
        x = np.zeros((200 * 200, 3))
        grid = np.meshgrid(gu, gz, indexing="ij")
        x[:, axis], x[:, across], x[:, 2] = at, grid[0].ravel(), grid[1].ravel()
        panel.contour(gu * units.MM, gz * units.MM, flow.cavity.holds(x).reshape(200, 200).T.astype(float), [0.5], colors="#e3122d", linewidths=1.2)
        panel.set_ylabel("z [mm]")
        panel.set_title(f"{'xy'[axis]} = {at * units.MM:.3g} mm", loc="left", pad=3)
    axes[-1].set_xlabel(f"{'xy'[across]} [mm]; red: outline of the cavity at the start")
    look.colour_bar(figure, norm, look.STRAIN, strip, "equivalent plastic strain [1]", "both")
    return figure
