# SPDX-License-Identifier: MIT
"""What every verification problem has: an input, parameters, resolutions, a way to measure its error."""

import pathlib
import re
import sys

TESTS = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TESTS / "system"))

import driver  # noqa: E402  (runs the program and reads its results)

INPUTS = TESTS / "verification" / "inputs"
SHIFT = (0.13, 0.29, 0.41)  # of the grid [cells]


def values(*numbers):
    """A list of numbers as --set takes it."""
    return ",".join(repr(float(number)) for number in numbers)


def grid_of(path, sets):
    """The text of an input, and a function that gives a key of its grid as a list of numbers."""
    text = re.sub(r"!.*", "", path.read_text(encoding="utf-8"))
    grid = re.search(r"&GRID(.*?)/", text, re.DOTALL).group(1)
    number = r"[-+0-9.eE]+"

    def given(key):
        if f"GRID.{key}" in sets:
            return [float(v) for v in str(sets[f"GRID.{key}"]).split(",")]
        found = re.search(rf"{key}\s*=\s*((?:{number}[,\s]*)+)", grid)
        return [float(v) for v in re.findall(number, found.group(1))] if found else [0.0] * 3

    return text, grid, given


def shifted(path, sets):
    """Sets that move the grid of an input by a part of a cell, on the axes where nothing hangs on it: not on periodic
    ones, which the body fills, and where walls lie on the sides of the grid."""
    text, grid, given = grid_of(path, sets)
    held = re.search(r"PERIODIC\s*=\s*'([xyz]*)'", grid)
    held = set(held.group(1)) if held else set()
    held |= {wall[1] for wall in re.findall(r"&WALL\s+SIDE\s*=\s*'(([xyz])m[^']*)'(?![^/]*POSITION)", text)}
    h = given("CELL")[0]
    move = [0.0 if axis in held else h * part for axis, part in zip("xyz", SHIFT)]
    return {"GRID.LOWER": values(*(v - d for v, d in zip(given("LOWER"), move))),
            "GRID.UPPER": values(*(v + (h - d if d else 0.0) for v, d in zip(given("UPPER"), move)))}


def graded(path, sets, axis, ratio, begin, end):
    """Sets that grade the cells of an input along an axis: `ratio` times as long from the part `begin` of the grid's
    length to the part `end`, and growing from there to what they are. Parts without room for four cells are fine too."""
    _, _, given = grid_of(path, sets)
    a = "xyz".index(axis)
    edges = (given("CELL") * 3)[:3]
    lower, length = given("LOWER")[a], given("UPPER")[a] - given("LOWER")[a]
    fine = ratio * edges[a]
    cells = round(length / fine)
    first, last = round(begin * cells), round(end * cells)
    first, last = (first if first >= 4 else 0), (last if cells - last >= 4 else cells)
    longest = edges[a]
    edges[a] = fine
    return {"METHOD.SHAPE": "bspline", "GRID.CELL": values(*edges), "GRID.GRADED": axis, "GRID.LARGEST_CELL": longest,
            "GRID.FINE": values(lower + first * fine, lower + last * fine)}


class Problem:
    """One problem. A resolution `n` is the number of cells across the length that `cells` names."""

    name = ""
    section = ""  # of the list of problems in README.md
    input = ""  # stem of the input file; not given: the name
    folder = INPUTS  # where it is
    cells = ""  # what n counts
    norm = ""  # what the error is
    passes = 0.0  # largest error at the last of `resolutions`
    least_order = None  # smallest order of the error between the last two resolutions
    resolutions = ()
    fine = ()  # added by --fine
    quick = ()  # resolutions of the pytest run; () : by the command only
    quick_passes = None  # largest error there; not given: `passes`
    bounds = {}  # largest error of a resolution whose `passes` is not reached for a reason that the documents give
    parameters = {}

    def sets(self, n, p):
        """Values of keys for resolution n and parameters p, as {GROUP.KEY: value}."""
        raise NotImplementedError

    def measure(self, run, n, p):
        """Error and a dictionary of figures from the results of a run."""
        raise NotImplementedError

    def limit(self, n):
        """Largest error at resolution n: what is asked, or what bounds the problem there."""
        return max(self.passes, self.bounds.get(n, 0.0))

    def runs(self, n, p):
        """The sets of all runs of one resolution (mostly one)."""
        return [self.sets(n, p)]

    def solve(self, n, p, directory, sets=None, ranks=None, timeout=3600, shift=False, edges=None,
              grading=None):
        """Run resolution n in `directory`, if asked on a shifted grid, or with cells of these edges, in units of the
        problem's, or graded (axis, ratio, begin, end); error, figures, core-seconds."""
        results, seconds = [], 0.0
        stem = self.input or self.name
        for k, own in enumerate(self.runs(n, p)):
            if shift:
                own = own | shifted(self.folder / f"{stem}.nml", own)
            if edges:
                own = own | {"GRID.CELL": values(*(own["GRID.CELL"] * edge for edge in edges))}
            if grading:
                own = own | graded(self.folder / f"{stem}.nml", own | (sets or {}), *grading)
            place = pathlib.Path(directory) / f"{self.name}_{n}_{k}"
            place.mkdir(parents=True)
            done = driver.run(self.folder / f"{stem}.nml", "--quiet", directory=place, ranks=ranks,
                              sets=own | (sets or {}), timeout=timeout)
            results.append(done.results(stem))
            seconds += results[-1].summary()["cpu_seconds"]
        error, figures = self.measure(results[0] if len(results) == 1 else results, n, p)
        return error, figures, seconds


def crossing(x, y, level):
    """First x at which y passes `level`, by linear interpolation."""
    for i in range(1, len(x)):
        if (y[i - 1] - level) * (y[i] - level) <= 0.0 and y[i] != y[i - 1]:
            return x[i - 1] + (level - y[i - 1]) / (y[i] - y[i - 1]) * (x[i] - x[i - 1])
    return float("nan")
