# SPDX-License-Identifier: MIT
"""Error against core-seconds, one picture per problem, with the front and what others quote."""

import pathlib
import sys

import matplotlib
from PIL import Image

from pareto import front, judged
from peers import PEERS

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "postproc"))

from stirpost.plots import look  # noqa: E402

PALE = "#c3cbd3"
MARKS = "osD^vP*Xh<>"
FLOOR = 1e-6  # an error of 0 (inside the accepted range) is drawn here


def curves(points):
    """Points that count, by option set, in the order of resolution."""
    result = {}
    for point in judged(points):
        result.setdefault(point["option_set"], []).append(point)
    return result


def columns(points):
    """Core-seconds and errors to draw."""
    return [p["core_seconds"] for p in points], [max(p["error"], FLOOR) for p in points]


def picture(case, points, path):
    """Draw the points of one problem."""
    with matplotlib.rc_context(look.STYLE):
        figure = look.new_figure(8.2, 4.4)
        axis = figure.add_subplot()
        best = front(points)
        winners = list(dict.fromkeys(p["option_set"] for p in best))
        for label, mine in curves(points).items():
            if label not in winners:
                axis.plot(*columns(mine), color=PALE, linewidth=0.7, marker=".", markersize=3, zorder=1)
        axis.plot([], [], color=PALE, linewidth=0.7, marker=".", label="other option sets")
        for k, (label, colour) in enumerate(zip(winners, look.line_colours(len(winners)))):
            axis.plot(*columns(curves(points)[label]), color=colour, linewidth=1.0, marker=MARKS[k % len(MARKS)],
                      markersize=4.5, label=label, zorder=2)
        axis.plot(*columns(best), color=look.INK, linewidth=2.2, alpha=0.35, label="Pareto front", zorder=3,
                  drawstyle="steps-post")
        quoted(axis, case.name)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel("core-seconds in the step loop")
        axis.set_ylabel("error")
        axis.set_title(case.title)
        axis.grid(True)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), borderaxespad=0.0, fontsize=8)
        look.save(figure, path)
    with Image.open(path) as image:  # few colours: a third of the bytes
        small = image.convert("RGB").quantize(64)
    small.save(path, optimize=True)


def quoted(axis, name):
    """The points of other programs and how their core time was found."""
    for peer, line in zip(PEERS.get(name, ()), ("--", ":")):
        axis.plot([p[2] for p in peer.points], [p[1] for p in peer.points], color="black", linestyle=line,
                  linewidth=1.0, marker="x", markersize=5, label=peer.label, zorder=4)
        axis.text(1.02, 0.0, peer.note, transform=axis.transAxes, fontsize=6.5, va="bottom")


def all_pictures(cases, points, directory):
    """A picture for every case that has points that count; the names of these cases."""
    directory.mkdir(parents=True, exist_ok=True)
    drawn = []
    for case in cases.values():
        mine = [p for p in points if p["problem"] == case.name]
        if judged(mine):
            picture(case, mine, directory / f"precision_{case.name}.png")
            drawn.append(case.name)
    return drawn
