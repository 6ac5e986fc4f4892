# SPDX-License-Identifier: MIT
"""The tables 'which method for what' in Markdown, from the points."""

import math

import pareto
from peers import PEERS


def by_case(points):
    """Points of each problem in the order of their appearance."""
    result = {}
    for point in points:
        result.setdefault(point["problem"], []).append(point)
    return result


def fronts(points):
    """Rows: problem, and its front from cheap to precise."""
    lines = ["| problem | on the front, from cheap to precise: method n: error in core-seconds |", "|---|---|"]
    for name, mine in by_case(points).items():
        steps = [f"{p['option_set']} {p['resolution']}: {p['error']:.1e} in {p['core_seconds']:.2g}"
                 for p in pareto.front(mine)]
        lines.append(f"| {name} | {'; '.join(steps)} |")
    return lines


def cell(factor):
    if factor is None:
        return ""
    if math.isinf(factor):
        return "x"
    return "**1**" if factor <= 1.0 else f"{factor:.1f}" if factor < 10.0 else f"{factor:.0f}"


def matrix(points):
    """Rows: methods; columns: problems; how many times the front's core time at equal error, at best."""
    cases = {name: pareto.factors(mine) for name, mine in by_case(points).items()}
    labels = list(dict.fromkeys(pareto.method(p) for p in points))
    lines = ["| method | " + " | ".join(cases) + " |", "|---|" + "---|" * len(cases)]
    for label in labels:
        lines.append(f"| {label} | " + " | ".join(cell(f.get(label)) for f in cases.values()) + " |")
    return lines


def losers(points):
    """Methods that are on no front: their least factor and the problem of it."""
    least = {}
    for name, mine in by_case(points).items():
        for label, factor in pareto.factors(mine).items():
            least.setdefault(label, []).append((factor, name))
    rows = [(min(found), label) for label, found in least.items() if min(found)[0] > 1.0]
    lines = ["| on no front | nearest to one (times its core time) | in |", "|---|---|---|"]
    for (factor, name), label in sorted(rows, reverse=True):
        lines.append(f"| {label} | {cell(factor)} | {name if math.isfinite(factor) else 'none'} |")
    return lines


def against_peers(points):
    """For every quoted point: how many times less core time the front needs at its error."""
    lines = ["| problem | quoted | n | error | core-seconds there (estimate) | here: method n | in the loop "
             "| times less | whole process | times less |", "|---" * 10 + "|"]
    cases = by_case(points)
    for name, quotes in PEERS.items():
        for peer in quotes if name in cases else ():
            for n, error, seconds in peer.points:
                able = [p for p in pareto.judged(cases[name]) if p["error"] <= error]
                start = f"| {name} | {peer.label} | {n} | {error:.1e} | {seconds:.2g} "
                if not able:
                    lines.append(start + "| none as good | | | | |")
                    continue
                best = min(able, key=lambda p: p["core_seconds"])
                whole = best["process_seconds"]
                lines.append(start + f"| {best['option_set']} {best['resolution']} | {best['core_seconds']:.2g} "
                             f"| {seconds / best['core_seconds']:.2g} | {whole:.2g} | {seconds / whole:.2g} |")
    return lines


def markdown(points):
    """All tables."""
    parts = [fronts(points), matrix(points), losers(points), against_peers(points)]
    titles = ["### Fronts", "### Core time over that of the front at equal error, at best",
              "### Methods on no front", "### Against other programs at equal error"]
    return "\n\n".join(f"{title}\n\n" + "\n".join(lines) for title, lines in zip(titles, parts)) + "\n"
