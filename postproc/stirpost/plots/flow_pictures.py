# SPDX-License-Identifier: MIT
"""Sections of the track of a tool with its voids, and of a cavity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from ..analysis import surface
from . import look, maps

if TYPE_CHECKING:
    from ..analysis.flow import Flow
    from ..analysis.voids import Voids

MOST = 5  # sections
PIXELS = 300  # of the longer of the sides of the track, and of its breadth
ORIGIN = ("Spectral", 0.0, 1.0)  # colours of the side that metal came from


def metal_in(flow: Flow, place: np.ndarray):
    """The surface of the metal at the end whose points have been moved as the particles to `place`: a turn, and perhaps a mirror."""
    mesh = surface.metal(flow.run, flow.frame, maps.fields_of(flow.frame))
    from_, to = (x - x.mean(axis=0) for x in (flow.x, place))
    turn = np.linalg.lstsq(from_, to, rcond=None)[0]
    return mesh.at((mesh.points - flow.x.mean(axis=0)) @ turn + place.mean(axis=0))


def strain_of(flow: Flow) -> np.ndarray:
    strain = flow.field("plastic_strain")
    return np.zeros(len(flow.x)) if strain is None else strain


def sheet(voids: Voids):
    """Sections at equal distances: plastic strain, and how far from the way the metal was at first."""
    flow, (s, n, z) = voids.flow, voids.axes
    chosen = np.unique(np.round(np.linspace(0, len(s) - 1, min(MOST, len(s) // 4 + 1) + 1)).astype(int))
    came = flow.tool_path.side(flow.x0) * look.MM
    wide = 1.15 * flow.tool_path.radius
    low = np.array([s[0], -wide, flow.low[2] - 0.2e-3])
    high = np.array([s[-1], wide, flow.face + 0.4 * (flow.face - flow.low[2])])
    mesh = metal_in(flow, voids.place)
    strain = strain_of(flow)
    kinds = ((strain, look.STRAIN, maps.strain_norm_of(strain)),
             (came, look.part_of(*ORIGIN), Normalize(-0.6 * wide * look.MM, 0.6 * wide * look.MM)))
    size = (high - low)[1:] * look.MM
    scale = min(4.9 / size[0], 2.2 / size[1])
    figure, axes, _ = look.panels(2 * len(chosen), tuple(size), scale, per_row=2, below=1.15, bar=False)
    for k, pair in zip(chosen, zip(axes[::2], axes[1::2])):
        view = maps.section(maps.View(flow.frame, low, high, "", mesh, axis=0), voids.place, s[k], flow.spacing, PIXELS)
        for panel, (values, colours, norm) in zip(pair, kinds):
            maps.draw_section(panel, view, view.spread(values), colours, norm)
            if voids.open[k].any():
                panel.contour(n * look.MM, z * look.MM, voids.open[k].T.astype(float), [0.5], colors="#e3122d", linewidths=1.6)
            panel.axhline(voids.lid * look.MM, color=look.INK, linewidth=0.6, linestyle="--")
        area = float(voids.open[k].sum() * voids.step**2)
        pair[0].set_title(f"{voids.coordinate(s[k]) * look.MM:.3g} mm along the travel; voids: {look.mm(area, 2, 2)}", loc="left", pad=3)
        pair[0].set_ylabel("z [mm]")
    sides = "advancing side positive" if flow.tool_path.advancing is not None else "left positive"
    labels = "equivalent plastic strain [1]", f"metal was at first at [mm], {sides}"
    inches = figure.get_size_inches()
    for panel, (_, colours, norm), label in zip(axes[-2:], kinds, labels):
        panel.set_xlabel(f"from the path [mm], {sides}")
        box = panel.get_position()
        strip = figure.add_axes((box.x0 + 0.1 * box.width, 0.48 / inches[1], 0.8 * box.width, 0.13 / inches[1]))
        look.colour_bar(figure, norm, colours, strip, label, "both", orientation="horizontal")
    return figure


def cavity_picture(flow: Flow):
    """Three sections through the cavity, across the travel: plastic strain, the cavity's outline."""
    axis = 0 if flow.tool_path is None else int(np.abs(flow.tool_path.along).argmax())
    across = 1 - axis
    low, high = flow.cavity.low, flow.cavity.high
    strain = strain_of(flow)
    norm = maps.strain_norm_of(strain)
    mesh = metal_in(flow, flow.x)
    bottom, top = flow.low - 0.5e-3, flow.high + 0.5e-3
    top[2] = max(flow.face + 2e-3, float(np.percentile(flow.x[:, 2], 99.9)) + 1e-3)
    size = (top - bottom)[[across, 2]] * look.MM
    figure, axes, strip = look.panels(3, tuple(size), min(6.5 / size[0], 2.4 / size[1]), per_row=1)
    for panel, part in zip(axes, (0.25, 0.5, 0.75)):
        at = low[axis] + part * (high[axis] - low[axis])
        view = maps.section(maps.View(flow.frame, bottom, top, "", mesh, axis), flow.x, at, flow.spacing)
        maps.draw_section(panel, view, view.spread(strain), look.STRAIN, norm)
        tool = maps.tool_cut(flow.run.tool_mesh(flow.frame), axis, at)
        panel.add_collection(LineCollection([line * look.MM for line in tool], colors=look.INK, linewidths=1.2))
        gu, gz = (np.linspace(low[k] - 1e-4, high[k] + 1e-4, 200) for k in (across, 2))
        x = np.zeros((200 * 200, 3))
        grid = np.meshgrid(gu, gz, indexing="ij")
        x[:, axis], x[:, across], x[:, 2] = at, grid[0].ravel(), grid[1].ravel()
        panel.contour(gu * look.MM, gz * look.MM, flow.cavity.holds(x).reshape(200, 200).T.astype(float), [0.5], colors="#e3122d", linewidths=1.2)
        panel.set_ylabel("z [mm]")
        panel.set_title(f"{'xy'[axis]} = {at * look.MM:.3g} mm", loc="left", pad=3)
    axes[-1].set_xlabel(f"{'xy'[across]} [mm]; red: outline of the cavity at the start")
    look.colour_bar(figure, norm, look.STRAIN, strip, "equivalent plastic strain [1]", "both")
    return figure
