# SPDX-License-Identifier: MIT
"""Pareto fronts: points, and methods, that no other beats in error and cost; costs at equal error."""

import math

WORST = 0.1  # points with larger errors answer nothing and are not judged


def judged(points):
    """The points with an error that counts."""
    return [p for p in points if p["error"] is not None and math.isfinite(p["error"]) and p["error"] <= WORST]


def front(points):
    """Points that no other beats in both error and core-seconds, by increasing cost."""
    result = []
    for point in sorted(judged(points), key=lambda p: (p["core_seconds"], p["error"])):
        if not result or point["error"] < result[-1]["error"]:
            result.append(point)
    return result


def seconds_at(points, error):
    """Fewest core-seconds of a point with at most this error; infinite if there is none."""
    return min((p["core_seconds"] for p in judged(points) if p["error"] <= error), default=math.inf)


def method(point):
    """The option set less its time step."""
    return point["option_set"].split(", dt/")[0]


def factors(points):
    """For every method: its core-seconds over the fewest of all with at most its error, at the resolution and
    time step where that is least; 1 is on the front, infinite is without a point that counts."""
    result = {method(p): math.inf for p in points}
    for p in judged(points):
        times = p["core_seconds"] / seconds_at(points, p["error"])
        result[method(p)] = min(result[method(p)], times)
    return result

