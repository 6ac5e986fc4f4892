# SPDX-License-Identifier: MIT
"""The sheet of sections across the track of a tool, with the voids."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LogNorm, Normalize

from . import look

if TYPE_CHECKING:
    from .voids import Voids

MOST = 7  # sections
STRAINS = 0.1, 50.0  # of the logarithmic scale


def sheet(voids: Voids):
    """Sections at equal distances: particles by plastic strain, and by how far from the way they were at first."""
    flow, (s, n, z) = voids.flow, voids.axes
    chosen = np.unique(np.round(np.linspace(0, len(s) - 1, min(MOST, len(s) // 4 + 1) + 1)).astype(int))
    strain = flow.field("plastic_strain")
    strain = np.zeros(len(flow.x)) if strain is None else strain
    came = flow.way.side(flow.x0) * look.MM
    wide = 1.15 * flow.way.radius * look.MM
    high = flow.face + 0.4 * (flow.face - flow.low[2])
    row = 4.5 * ((high - flow.low[2]) * look.MM / (2.0 * wide)) + 0.45
    figure = look.new_figure(10.4, row * len(chosen) + 1.4)
    panels = figure.subplots(len(chosen), 2, sharex=True, sharey=True, squeeze=False)
    kinds = ((strain.clip(STRAINS[0]), look.STRAIN, LogNorm(*STRAINS)),
             (came, look.part_of("Spectral", 0.0, 1.0), Normalize(-0.6 * wide, 0.6 * wide)))
    drawn = [None, None]
    for line, k in zip(panels, chosen):
        slab = np.abs(voids.place[:, 0] - s[k]) <= flow.spacing * (1 + 1e-6)
        half = 0.5 * np.cbrt(flow.volume[slab]) * look.MM
        for column, (values, colours, norm) in enumerate(kinds):
            panel = line[column]
            drawn[column] = look.squares(panel, voids.place[slab, 1] * look.MM, voids.place[slab, 2] * look.MM, half, values[slab], colours, norm)
            if voids.open[k].any():
                panel.contour(n * look.MM, z * look.MM, voids.open[k].T.astype(float), [0.5], colors="#e3122d", linewidths=1.4)
            panel.axhline(voids.lid * look.MM, color=look.INK, linewidth=0.6, linestyle="--")
            panel.set(xlim=(-wide, wide), ylim=(flow.low[2] * look.MM - 0.2, high * look.MM), facecolor=look.PAPER, aspect="equal")
        area = voids.open[k].sum() * voids.step**2
        line[0].set_title(f"{voids.coordinate(s[k]) * look.MM:.3g} mm along the travel; voids: {look.mm(float(area), 2, 2)}", loc="left")
        line[0].set_ylabel("z [mm]")
    positive = "advancing side" if flow.way.advancing is not None else "left"
    for panel in panels[-1]:
        panel.set_xlabel(f"from the way [mm], positive: {positive}")
    figure.colorbar(drawn[0], ax=panels[:, 0], location="bottom", label="equivalent plastic strain [1]", extend="both", aspect=40, fraction=0.03, pad=0.01)
    figure.colorbar(drawn[1], ax=panels[:, 1], location="bottom", label=f"metal was at first at [mm], positive: {positive}", extend="both", aspect=40, fraction=0.03, pad=0.01)
    return figure
