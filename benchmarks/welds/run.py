#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Published welds, computed by one rule without a fitted number, against the reported values.

    build/venv/bin/python benchmarks/welds/run.py [NAME...] [--variant fine] [--set MATERIAL.ST_ALPHA=1e-8] [--folder FOLDER] [--record]
    build/venv/bin/python benchmarks/welds/run.py NAME --film 50 --friction 0.2 --travel 1 [--record]
    build/venv/bin/python benchmarks/welds/run.py --rabe [--record]
    build/venv/bin/python benchmarks/welds/run.py --page

The rule (docs/welds.md): library metal of welds; friction and film of the library's pairs of surfaces (hot work steel on aluminium and copper,
PCBN on steel, sheet on steel anvil); a steel backing plate behind the film, an endless
cold sheet beyond the sides, on pins of tool steel the finest left-hand thread that the cells resolve (half a cell deep, a pitch of two), the centre of the face 0.2 mm below the surface, or less: half the metal below the tip is kept. Cells: 2/5 of the
thickness up to 4 mm, else a quarter, and longer beside the shoulder. Results are means of the last second, or second half, of a travel of two radii of the shoulder, and of 1.2 s at least. A variant has other
cells, another mass scaling or a smooth pin, for the numerical error; --set changes one key of the rule. --film (at 1 MPa), --friction (0: the metal
seizes on the tool) and --travel are recorded in rule.jsonl.
--page draws docs/pictures/welds.png and welds_rabe.png from results.jsonl and prints the deviations. docs/welds.md names the sources; reported.json has the
reported values, remembered (cited from memory) or read in a text, a range as two values.
"""

import argparse
import json
import os
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / part) for part in ("tests/system", "tests/figures", "postproc")]

import driver
import matplotlib
import measures
import numpy as np
import tables
from stirpost.analysis import voids
from stirpost.plots import look
from stirpost.run import Run

MM = 1e-3
LIBRARY = ROOT / "share/stirpoint/materials.nml"
PICTURE, WINDOW = (ROOT / f"docs/pictures/{name}.png" for name in ("welds", "welds_rabe"))
RESULTS = pathlib.Path(__file__).with_name("results.jsonl")
RULE_RESULTS = pathlib.Path(__file__).with_name("rule.jsonl")
PAIRS = {"AA": "tool steel on aluminium", "304L": "PCBN on steel", "copper": "tool steel on copper"}    # of metals that begin so
ANVIL = "sheet on steel anvil"
TRAVEL = 2.0       # distance of travel [radii of the shoulder]
STEADY = 1.2       # least duration of travel [s]: at 33 mm/s torque is steady after 0.7 s
SCALING = 3e6      # of mass, where a weld has none of its own
# Cells over thin and thick sheets, of whole layers of particles, and a factor of the mass scaling; smooth: a pin without thread.
RULE = (2.5, 4, 1.0)
VARIANTS = {"coarse": (2, 3, 1.0), "fine": (3, 5, 1.0), "light": (2.5, 4, 1 / 3)}
VARIANTS |= {"smooth": RULE} | {f"smooth-{name}": sizes for name, sizes in VARIANTS.items()}


def weld(metal, thickness, shoulder, pin, length, rpm, speed, tilt=2.0, concavity=0.0, probe=None,
         force=None, beside=None, tip=None, depth=None, backing=20.0, scaling=None):
    """Dimensions in mm (diameters, tip: of the pin), speed in mm/s, force of the travel in kN instead of a depth, metal of the
    retreating side; depth of the centre of the face below the surface [mm], thickness of the steel below the sheet [mm]."""
    return dict(locals())


def rabe(metal, thickness, rpm, speed, left):
    """A weld of Rabe, Reisgen and Schiebahn (2023): rpm, speed in mm/min, metal left under the trailing edge of the shoulder [mm]."""
    length, tilt = 2.85 if thickness == 3.0 else 1.42, 1.5
    return weld(metal, thickness, 14.0, 5.0, length, rpm, speed / 60, tilt=tilt, concavity=7.0,
                tip=5.0 - 2 * length * np.tan(np.radians(10.0)), depth=thickness - left - 7.0 * np.sin(np.radians(tilt)),
                backing=8.0, scaling=4e5)


TANG = ("AA6061-T6-weld", 6.4, 19.0, 6.4, 5.8)
PRESSED = {"probe": (0.5, 5.0), "force": 14.0}
WELDS = {
    "aa2024": weld("AA2024-T3-weld", 3.0, 18.0, 6.0, 2.4, 400, 2.0, tilt=1.0, concavity=10.0),
    "aa2024-pressed": weld("AA2024-T3-weld", 3.0, 18.0, 6.0, 2.4, 400, 2.0, tilt=1.0, concavity=10.0, force=21.5),
    "304l-300": weld("304L-weld", 3.18, 19.0, 8.0, 2.8, 300, 1.69),
    "304l-pressed": weld("304L-weld", 3.18, 19.0, 8.0, 2.8, 300, 1.69, force=31.0),
    "304l-500": weld("304L-weld", 3.18, 19.0, 8.0, 2.8, 500, 1.69),
    "aa6061-300": weld(*TANG, 300, 2.0, **PRESSED),
    "aa6061-400": weld(*TANG, 400, 2.0, **PRESSED),
    "aa6061-650": weld(*TANG, 650, 2.0, **PRESSED),
    "aa6061-1000": weld(*TANG, 1000, 2.0, **PRESSED),
    "copper-900": weld("copper-hot", 3.0, 12.0, 3.0, 2.9, 900, 0.67),
} | {
    f"aa2524-{rpm}": weld("AA2024-T3-weld", 6.4, 20.3, 7.1, 6.1, rpm, 2.1) for rpm in (150, 300, 450, 600, 800)
} | {
    f"aa6061-650-{speed}": weld(*TANG, 650, float(speed), **PRESSED) for speed in (1, 4)
} | {
    f"aa5083-6082-{speed}": weld("AA5083-H116-weld", 3.0, 18.0, 5.0, 2.6, 560, speed / 60, probe=(0.5, 6.5), beside="AA6082-T6-weld")
    for speed in (100, 200, 300)    # [mm/min]
}
SETTINGS_OF_RABE = (*((rpm, rpm // 2) for rpm in (600, 1200, 1800, 2400, 3000)), *((1200, speed) for speed in (900, 1200, 1500, 2000)),
                    *((1800, speed) for speed in (600, 1200, 1500, 2000)))    # rotation [1/min], travel [mm/min]
RABE = {    # nominal depths, of which a sound weld is meant, and .15 mm less
    f"rabe-{alloy}-{thickness:g}-{rpm}-{speed}-{depth}": rabe(metal, thickness, rpm, speed, left + less)
    for alloy, metal, thickness, left, settings in (
        ("5754", "AA5754-H22-weld", 3.0, 2.78, SETTINGS_OF_RABE),
        ("5754", "AA5754-H22-weld", 1.5, 1.32, ((600, 300), (1200, 600), (1200, 2000))),
        ("7075", "AA7075-T6-weld", 1.5, 1.32, ((600, 300), (1200, 600), (1200, 2000))))
    for rpm, speed in settings for depth, less in (("nominal", 0.0), ("reduced", 0.15))
}
WELDS |= RABE


def pair_of(name):
    """The pair of surfaces of the tool and the metal."""
    return next(pair for metal, pair in PAIRS.items() if WELDS[name]["metal"].startswith(metal))


def friction_of(name, own):
    """Friction on the tool: that of the pair, or Coulomb's with a coefficient of one's own; 0: the metal seizes."""
    if own is None:
        return f"FROM = '{pair_of(name)}'"
    return f"FRICTION = {own}" if own else "FRICTION_LAW = 'shear-factor', SHEAR_FACTOR = 1"


def of_library(metal, key):
    """A value of the library of materials."""
    entry = re.search(rf"^&MATERIAL NAME = '{metal}'.*?/$", LIBRARY.read_text(), re.M | re.S).group()
    return float(re.search(rf"\b{key} = ([\d.e+-]+)", entry).group(1))


def travel_of(w, radii):
    """Distance of travel [mm]."""
    return max(radii * w["shoulder"] / 2, STEADY * w["speed"])


def text_of(name, variant=None, film=None, friction=None, radii=TRAVEL):
    """The input of a weld."""
    w = WELDS[name]
    thin, thick, factor = VARIANTS.get(variant, RULE)
    scaling = factor * (w["scaling"] or SCALING)
    h = w["thickness"] / (thin if w["thickness"] <= 4.0 else thick)
    radius, distance = w["shoulder"] / 2, travel_of(w, radii)
    size_x, size_y = h * round((4.0 * radius + distance) / h), 2 * h * round(2.25 * radius / h)    # walls on nodes
    fine = h * round(1.1 * radius / h)    # from the middle, of equal cells
    tilt = np.radians(w["tilt"])
    lowers = (w["tip"] or w["pin"]) / 2 * np.sin(tilt)    # by the tilt the rim of the tip is lower than its centre
    start, above = 1.8 * radius, max(0.1, lowers + 0.05)
    rim = min(0.2, 0.5 * (w["thickness"] - w["length"] * np.cos(tilt) - lowers)) if w["depth"] is None else w["depth"]    # below the surface
    plunge = w["length"] + above + rim
    dwell = 1.0
    travel = distance / w["speed"]
    ambient = 298.0
    metals = [w["metal"]] if not w["beside"] else [w["metal"], w["beside"]]
    probes = ""
    if w["probe"]:
        depth, beside = w["probe"]
        for side, sign in (("advancing", 1), ("retreating", -1)):
            y = size_y / 2 + sign * (w["pin"] / 2 + beside)
            probes += f"&PROBE NAME = '{side}', POSITION = {(start + distance - 0.4 * radius) * MM:.6g}, {y * MM:.6g}, {depth * w['thickness'] * MM:.6g} /\n"
    bodies = surfaces = ""
    for body, metal in zip(("sheet", "beside"), metals):        # the first on the advancing side, towards +y
        lower, upper = (size_y / 2, size_y) if body == "sheet" and w["beside"] else (0.0, size_y / len(metals))
        bodies += f"""&MATERIAL NAME = '{metal}', FROM = 'library' /
&BODY NAME = '{body}', MATERIAL = '{metal}', TEMPERATURE = {ambient} /
&SHAPE BODY = '{body}', LOWER = 0, {lower * MM:.6g}, 0, UPPER = {size_x * MM:.6g}, {upper * MM:.6g}, {w["thickness"] * MM:.6g} /
"""
        surfaces += f"""&SURFACE BODY = '{body}', FACE = 'zmin', FROM = '{ANVIL}'{f', PRESSURE_FACTOR = {film:g}' if film else ''}, BACKING = 'plate'
  BACKING_CONDUCTIVITY = 45, BACKING_DENSITY = 7850, BACKING_SPECIFIC_HEAT = 480, BACKING_THICKNESS = {w["backing"]:g}e-3, BACKING_COOLING = 500 /
&SURFACE BODY = '{body}', FACE = 'zmax', COEFFICIENT = 15 /
"""
        conductivity, heat, density = (of_library(metal, key) for key in ("CONDUCTIVITY", "SPECIFIC_HEAT", "DENSITY"))
        sides = ["xmin", "xmax", *(["ymin"] if lower == 0.0 else []), *(["ymax"] if upper == size_y else [])]
        surfaces += "".join(
            f"&SURFACE BODY = '{body}', FACE = '{face}', COEFFICIENT = 1e5, BACKING = 'plate', BACKING_CONDUCTIVITY = {conductivity}"
            f"\n  BACKING_SPECIFIC_HEAT = {heat}, BACKING_DENSITY = {density} /\n" for face in sides)
    details = f", CONCAVITY_DEG = {w['concavity']}" if w["concavity"] else ""
    if pair_of(name).startswith("tool steel") and not (variant or "").startswith("smooth"):
        details += f", THREAD_DEPTH = {0.5 * h * MM:.6g}, THREAD_PITCH = {2 * h * MM:.6g}"
    details += f", PIN_TIP_RADIUS = {w['tip'] / 2 * MM:.6g}" if w["tip"] else ""
    force = f", FORCE = {w['force'] * 1e3:.6g}" if w["force"] else ""
    return f"""&RUN TITLE = '{name}: {", ".join(metals)}, {w["thickness"]} mm, {w["rpm"]} rpm, {w["speed"]:.4g} mm/s' /
&GRID CELL = {h * MM:.9g}, LOWER = {-4 * h * MM:.9g}, 0, 0, UPPER = {(size_x + 4 * h) * MM:.9g}, {size_y * MM:.9g}, {h * np.ceil((w["thickness"] + 2) / h + 6) * MM:.9g}
  GRADED = 'y', FINE = {(size_y / 2 - fine) * MM:.9g}, {(size_y / 2 + fine) * MM:.9g}, GROWTH = 1.3, LARGEST_CELL = {2 * h * MM:.9g} /
&TIME END = {plunge / 2 + dwell + travel:.4g}, MASS_SCALING = {scaling:g}, ELASTIC_SCALING = 8 /
{bodies}&TOOL NAME = 'tool', RADIUS = {radius * MM:.6g}, PIN_RADIUS = {w["pin"] / 2 * MM:.6g}, PIN_LENGTH = {w["length"] * MM:.6g}{details}
  HEIGHT = 8e-3, POSITION = {start * MM:.6g}, {size_y / 2 * MM:.6g}, {(w["thickness"] + w["length"] + above) * MM:.6g}, TILT_DEG = {w["tilt"]}
  {friction_of(name, friction)}
  HEATS = 'rod', CONDUCTIVITY = 25, DENSITY = 7800, SPECIFIC_HEAT = 460, CONTACT_CONDUCTANCE = 2e4 /
&MOTION TOOL = 'tool', DURATION = {plunge / 2:.4g}, VELOCITY = 0, 0, -2e-3, SPIN_RPM = {w["rpm"]} /
&MOTION TOOL = 'tool', DURATION = {dwell}, SPIN_RPM = {w["rpm"]} /
&MOTION TOOL = 'tool', VELOCITY = {w["speed"] * MM:.6g}, 0, 0, SPIN_RPM = {w["rpm"]}, RAMP = 0.2{force} /
&METHOD DEBRIS = 0.05 /
&WALL SIDE = 'zmin', FROM = '{ANVIL}' /
{"".join(f"&WALL SIDE = '{side}', POSITION = {place * MM:.6g} /{chr(10)}" for side, place in
         (("xmin", 0), ("xmax", size_x), ("ymin", 0), ("ymax", size_y)))}&HEAT AMBIENT = {ambient} /
{surfaces}{probes}&OUTPUT FRAME_INTERVAL = 100, HISTORY_INTERVAL = {0.05 * window_of(name, radii):.3g}, CHECKPOINT_INTERVAL = 1000 /
"""


def window_of(name, radii):
    """Duration of the means at the end of the travel [s]: a second, or half the travel of a fast weld."""
    w = WELDS[name]
    return min(1.0, 0.5 * travel_of(w, radii) / w["speed"])


def measure(results, seconds):
    """Means of the last seconds: torque [N m], axial and traverse force [kN], power [kW], hottest metal, face, probes [K]; the
    largest axial force of all times [kN]."""
    history = results.history()
    last = history["time[s]"] > history["time[s]"][-1] - seconds
    mean = {name: float(np.mean(history[column][last])) * factor for name, column, factor in (
        ("torque", "tool_torque[Nm]", 1.0), ("force", "tool_force_z[N]", 1e-3), ("traverse", "tool_force_x[N]", 1e-3),
        ("power", "tool_power[W]", 1e-3), ("face", "tool_face_temperature[K]", 1.0), ("face_z", "tool_z[m]", 1e3))}
    mean["plunge"] = float(history["tool_force_z[N]"].max()) * 1e-3
    mean["hottest"] = float(history["temperature_max[K]"].max())
    mean["inertia"] = float(np.median(history["inertial_stress_over_flow[%]"][last]))
    mean["audit"] = float(np.abs(history["audit_error[%]"]).max())
    holes = voids.of_run(Run(results.directory))
    if holes:
        found = holes.measures()
        mean["void"], mean["void_resolved"] = found["area_max[m2]"] * 1e6, found["smallest_tunnel_of_particles[m2]"] * 1e6
        if "largest" in found:
            worst = found["largest"]
            mean["void_below"], mean["void_beside"] = worst["depth[m]"] * 1e3, worst["offset[m]"] * 1e3
    if results.path("_probes.csv").exists():
        probes = results.probes()
        mean["probe"] = max(float(np.nanmax(probes[f"{side}[K]"])) for side in ("advancing", "retreating"))
    return mean


def draw(pairs):
    """Computed over reported, on logarithmic axes, with lines of 15 and 30 % for all but the temperatures; filled: remembered, open: read.
    Bars are the range of the reported value, and of what was computed with other values of the rule, cells or mass scaling."""
    names = list(dict.fromkeys(one.weld["weld"] for _, found in pairs.values() for one in found))
    with matplotlib.rc_context(look.STYLE):
        figure = look.new_figure(7.6, 2.5)
        for axes, (key, (title, found)) in zip(figure.subplots(1, len(pairs)), pairs.items()):
            ends = [end for one in found for end in (*one.told_ends, *one.computed_ends)]
            line = np.array([0.8 * min(ends), 1.25 * max(ends)])
            for part in (0.05, ) if key == "temperature" else (0.15, 0.3):
                axes.fill_between(line, line * (1 - part), line * (1 + part), color=look.LINES[7], alpha=0.15, linewidth=0)
            axes.plot(line, line, color=look.INK, linewidth=0.7)
            for one in found:
                colour = look.LINES[names.index(one.weld["weld"])]
                bars = [[[value - low], [high - value]] for value, (low, high) in ((one.told, one.told_ends), (one.computed, one.computed_ends))]
                axes.errorbar([one.told], [one.computed], xerr=bars[0], yerr=bars[1], fmt="o", markersize=4, color=colour, elinewidth=0.8,
                              markerfacecolor=colour if one.weld["known"] == "remembered" else "white")
            axes.set(xscale="log", yscale="log", xlim=line, ylim=line, xlabel=title, aspect="equal")
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 3, 5, 7)))
                axis.set_major_formatter("{x:g}")
                axis.set_minor_locator(matplotlib.ticker.NullLocator())
            axes.tick_params(labelsize=7.5)
        figure.axes[0].set_ylabel("computed")
        figure.supxlabel("reported", fontsize=9.5)
        shown = {one.weld["weld"]: one.weld["known"] for _, found in pairs.values() for one in found}
        figure.legend(handles=[matplotlib.lines.Line2D([], [], marker="o", linestyle="", markersize=4, color=look.LINES[k], label=name,
                                                       markerfacecolor=look.LINES[k] if shown[name] == "remembered" else "white")
                               for k, name in enumerate(names)], loc="outside upper center", ncols=len(names), fontsize=6.5, handletextpad=0.1)
        look.save(figure, PICTURE)


def draw_rabe():
    """Welds of Rabe over rotation and travel, one plot a depth: filled if closed, else the area of the void in mm2; axial force in kN."""
    with matplotlib.rc_context(look.STYLE):
        figure = look.new_figure(9.6, 3.4)
        for axes, depth in zip(figure.subplots(1, 2, sharey=True), ("nominal", "reduced")):
            for row in measures.lines(RESULTS):
                name = row["weld"].split("-")
                if name[:3] != ["rabe", "5754", "3"] or name[-1] != depth or {"variant", "set"} & row.keys():
                    continue
                rpm, speed, void = int(name[3]), int(name[4]), row["void"]
                colour = look.LINES[1 if void else 2]
                axes.plot(rpm, speed, "o", markersize=9, color=colour, markerfacecolor="white" if void else colour)
                axes.annotate(f"{row['force']:.0f} kN" + (f"\n{void:.1f} mm2" if void else ""), (rpm, speed), (8, 0), textcoords="offset points",
                              va="center", fontsize=7)
            axes.set(title=f"{depth} depth", xlabel="rotational speed [1/min]", xlim=(300, 3700), ylim=(100, 2250))
        figure.axes[0].set_ylabel("travel [mm/min]")
        look.save(figure, WINDOW)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(WELDS))
    parser.add_argument("--variant", choices=VARIANTS, help="other cells, another mass scaling, a smooth pin")
    parser.add_argument("--set", metavar="GROUP.KEY=VALUE")
    parser.add_argument("--film", type=float, help="under the tool, at 1 MPa [W/(m2 K)]; default: that of the pair")
    parser.add_argument("--friction", type=float, help="Coulomb's coefficient; 0: the metal seizes; default: that of the pair")
    parser.add_argument("--travel", type=float, default=TRAVEL, help="distance of travel [radii of the shoulder]")
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("welds"))
    parser.add_argument("--record", action="store_true", help="put into results.jsonl, of which docs/welds.md has the tables")
    parser.add_argument("--rabe", action="store_true", help="the welds of Rabe, instead of names")
    parser.add_argument("--page", action="store_true", help="draw what is kept, without a run")
    arguments = parser.parse_args()
    if arguments.page:
        draw(tables.reported_of_welds())
        draw_rabe()
        print(tables.weld_ratios(None))
        return
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for name in RABE if arguments.rabe else arguments.names or WELDS:
        kind = {key: getattr(arguments, key) for key, own in
                (("variant", None), ("set", None), ("friction", None), ("film", None), ("travel", TRAVEL)) if getattr(arguments, key) != own}
        stem = "-".join((name, *(re.sub(r"\W", "_", str(part)) for part in kind.values())))
        (arguments.folder / f"{stem}.nml").write_text(text_of(name, arguments.variant, arguments.film, arguments.friction, arguments.travel))
        before = os.times()
        done = driver.run(f"{stem}.nml", "--quiet", "--overwrite", directory=arguments.folder, expect=None, timeout=7200,
                          sets=dict([arguments.set.split("=", 1)]) if arguments.set else {})
        after = os.times()
        record = {"weld": name} | kind | {"status": done.status, "cpu": round(after.children_user - before.children_user, 1)}
        if done.status == driver.WELL:
            record |= {key: round(value, 3) for key, value in measure(done.results(stem), window_of(name, arguments.travel)).items()}
        else:
            record["said"] = done.err.strip().splitlines()[-1][-300:]
        print(json.dumps(record), flush=True)
        if arguments.record and done.status == driver.WELL:
            path = RULE_RESULTS if {"film", "friction", "travel"} & kind.keys() else RESULTS
            same = ("weld", "variant", "set", "film", "friction", "travel")
            kept = [row for row in measures.lines(path) if [row.get(key) for key in same] != [record.get(key) for key in same]]
            path.write_text("".join(json.dumps(row) + "\n" for row in (*kept, record)))


if __name__ == "__main__":
    main()
