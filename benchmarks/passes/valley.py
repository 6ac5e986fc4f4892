# SPDX-License-Identifier: MIT
"""The pass of cavity 1 over friction and film: which pairs the thermocouples allow, and what the metal does there.

usage: benchmarks/passes/run.sh --valley [-o DIR]

Each row of results/valley.jsonl is one pass with particles 2 mm apart: flow law, friction law and its value, film below
the plate, sides free or held; peaks of T1 to T3 and their misfit, force, torque, stir zone, fill, flash. Rows that are
there are not computed again.
"""

import json

import calculate
import measure
import report
import scenes
from calculate import HERE, kept

ROWS = HERE / "results/valley.jsonl"
SHEAR, COULOMB = (0.2, 0.35, 0.5, 0.65, 0.8, 1.0), (0.1, 0.2, 0.3, 0.6, 1.0)
FILMS = (20000, 40000, 10000, 100000, 3000, 700)
KEPT = ("T1 peak, K", "T2 peak, K", "T3 peak, K", "force at 12.5 s, kN", "force at 50 s, kN", "torque at 12.5 s, N m", "torque at 50 s, N m",
        "stir zone at 25 mm, depth, mm", "stir zone at 65 mm, depth, mm", "cavity filled, %", "cavity covered, %", "flash, advancing side, mm",
        "flash, retreating side, mm", "interface velocity, mm/s", "hottest metal, K", "inertial over flow stress, largest, %",
        "energy audit, largest, %", "groove, mm3")


def friction(kind, value):
    if kind == "shear":
        return {"TOOL.FRICTION_LAW": "shear-factor", "TOOL.SHEAR_FACTOR": f"{value:g}"}
    return {"TOOL.FRICTION": f"{value:g}"}


def points():
    """Flow law, friction law, its value, film, pressure factor, sides: the whole map for hot copper with held sides first."""
    for film in FILMS:
        for value in SHEAR:
            yield "hot", "shear", value, film, 0, "held"
    for film in FILMS:
        for value in COULOMB:
            yield "hot", "coulomb", value, film, 0, "held"
    for law in ("jc", "tp"):
        for film in (10000, 40000):
            for value in SHEAR[1::2]:
                yield law, "shear", value, film, 0, "held"
    for factor in (10, 100, 1000):
        for value in SHEAR[1::2]:
            yield "hot", "shear", value, 700, factor, "held"
    for film in FILMS[:3]:
        yield "hot", "shear", 0.65, film, 0, "free"


def misfit(row):
    """Root of the mean square of computed over recorded peaks less one."""
    peaks = report.record()
    return (sum((row[f"{name} peak, K"] / float(peaks[f"peak {name}"]) - 1) ** 2 for name in ("T1", "T2", "T3")) / 3) ** 0.5


def write(options):
    there = [json.loads(line) for line in ROWS.read_text(encoding="utf-8").splitlines()] if ROWS.is_file() else []
    for law, kind, value, film, factor, sides in points():
        point = {"law": law, "friction": kind, "value": value, "film": film, "pressure_factor": factor, "sides": sides}
        if any(point.items() <= row.items() for row in there):
            continue
        name = f"cavity1_{law}"
        keys = scenes.cells(name, 2.0) | {"TIME.MASS_SCALING": "1e6", "TOOL.HEAT_SHARE": "0.836", "SURFACE.COEFFICIENT": f"{film}"} | friction(kind, value)
        if factor:
            keys["SURFACE.PRESSURE_FACTOR"] = f"{factor}"
        folder = options.output / "valley" / "_".join(map(str, point.values()))
        try:
            results = calculate.calculate(folder, name, sides, keys, tell=lambda text: print(text, flush=True))
            found = measure.measures(results)
        except RuntimeError as error:
            found = {"ended": str(error)[-300:]}
        row = point | {name: found.get(name) for name in KEPT} | {"ended": found.get("ended")}
        if row["T1 peak, K"]:
            row["misfit"] = misfit(row)
        row |= {"machine": kept.machine(), "version": kept.version()}
        with ROWS.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
