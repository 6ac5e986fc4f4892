#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Drawn scenes of tools in hot thin metal: metal without strength takes no heat of friction and transmits no shear.

    build/venv/bin/python tests/strength/drawn_scenes.py [--number 1000] [--seed 1] [--keep FOLDER]

No metal gets hotter than its solidus by more than 20 K: what it got just before, and conduction between hotter and colder
particles, can take it above. Where all metal is molten from the start there is no friction, no plastic work and no shear stress.
Sheets of one to three cells on walls, anvils and other bodies, also over edges and corners, in clamps; flat, concave, scrolled,
threaded and tapered tools, sleeves, spheres, boxes and meshes of triangles, at a depth or under a force; pins whose tips come to
the anvil; laws of flow and friction, shapes, schemes, transfers, graded and flat cells, conduction, one to four ranks. Prints
the scenes that break the law and how far above the solidus the others came.
"""

import argparse
import math
import pathlib
import random
import re
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))

import driver

MOST = 20.0  # [K] above the solidus
MOLTEN = 30.0  # [K] above the solidus, where a scene starts with molten metal
LEAST_STRESS = 1.0  # [Pa]
REFUSED = "an inertial stress above its flow stress"
LEAST_FACTOR = 2e4  # of the mass scaling: a run with less takes long

METALS = {  # melting points [K] in the library of materials, by the law of flow
    "AA2024-T3": 775.0, "AA6061-T6": 855.0, "copper": 1356.0,                        # johnson-cook
    "AA2024-T3-weld": 775.0, "AA6061-T6-weld": 855.0, "304L-weld": 1673.0,           # hot-working
    "copper-hot": 1356.0, "AA5005": 905.0,                                           # sellars-tegart, two-phase
    "voce": 900.0, "norton": 900.0, "zerilli-armstrong": 900.0, "table": 900.0}
LAWS = {
    "voce": "VOCE_YIELD = 50e6, VOCE_SATURATION = 200e6, VOCE_STRAIN = 0.1, VOCE_C = 0.02",
    "norton": "NORTON_K = 40e6, NORTON_N = 0.2",
    "zerilli-armstrong": "ZA_C0 = 20e6, ZA_C2 = 500e6, ZA_C3 = 2e-3, ZA_C4 = 1e-4",
    "table": "TABLE_STRAIN = 0, 1, TABLE_T = 300, 600, 890, TABLE_STRESS = 100e6, 200e6, 80e6, 90e6, 30e6, 30e6"}


class Sheet:
    """What the groups of a scene have in common: sizes and places [m], temperatures [K], time of the plunge [s]."""

    def __init__(self, draw):
        self.draw = draw
        self.metal = draw.choice(list(METALS))
        self.melts = METALS[self.metal]
        self.is_molten = draw.random() < 0.08
        self.start = self.melts + MOLTEN if self.is_molten else draw.uniform(0.93, 0.999) * self.melts
        self.h = draw.choice([1e-3, 0.75e-3])
        self.below = draw.choice(["fixed", "fixed", "sliding", "sliding", "raised", "anvil", "box", "body"])
        self.cells = draw.choice([1, 1, 2, 2, 3]) if self.below != "body" else 1
        self.thick = (self.cells + draw.choice([0.0, 0.0, 0.3, 0.5])) * self.h
        self.radius = draw.uniform(2.0, 2.7) * self.h
        self.side = 2.0 * self.radius + draw.uniform(1.5, 3.0) * self.h
        self.bottom = {"body": self.thick, "raised": self.h}.get(self.below, 0.0)
        self.top = self.bottom + self.thick
        self.time = draw.choice([0.01, 0.015])
        self.is_usl = draw.random() < 0.6
        self.shape = draw.choice(["auto", "auto", "bspline", "ugimp", "ugimp", "cpgimp"])
        self.graded = draw.choice(["none", "none", "none", "x", "y", "z"])


def friction(draw):
    law = draw.choice(["coulomb", "coulomb", "shear-factor", "shear-factor", "wanheim-bay", "schmidt-hattel"])
    if law == "coulomb":
        return draw.choice(["FRICTION = 0.2", "FRICTION = 1", "FRICTION = 5", "FRICTION = 0.4, SHEAR_LIMIT = F",
                            "FRICTION_TABLE_OF = 'temperature', FRICTION_AT = 300, 700, FRICTION_MU = 0.5, 0.3"])
    if law == "schmidt-hattel":
        return f"FRICTION_LAW = '{law}', FRICTION = {draw.choice([0.3, 1])}, STICK_FRACTION = {draw.choice([0.5, 1])}"
    return f"FRICTION_LAW = '{law}', SHEAR_FACTOR = {draw.choice([0.3, 0.8, 1])}"


def material(sheet):
    if sheet.metal not in LAWS:
        return f"&MATERIAL NAME = '{sheet.metal}', FROM = 'library' /"
    return (f"&MATERIAL NAME = '{sheet.metal}', LAW = '{sheet.metal}', {LAWS[sheet.metal]}, T_MELT = {sheet.melts}\n"
            "  DENSITY = 2700, YOUNGS_MODULUS = 70e9, POISSON_RATIO = 0.33, SPECIFIC_HEAT = 1000, CONDUCTIVITY = 150 /")


def body(sheet, name, low, high):
    return [f"&BODY NAME = '{name}', MATERIAL = '{sheet.metal}', TEMPERATURE = {sheet.start:.1f} /",
            f"&SHAPE BODY = '{name}', LOWER = 0, 0, {low:.6g}, UPPER = {sheet.side:.6g}, {sheet.side:.6g}, {high:.6g} /"]


def grid(sheet, has_wall_x):
    """Also graded along an axis, with the fine part under the tool or over the thickness."""
    draw, h = sheet.draw, sheet.h
    margin = 4 * h
    low = [0.0 if has_wall_x else -margin, -margin, 0.0 if sheet.below in ("fixed", "sliding", "raised", "body") else -margin]
    high = [sheet.side + margin, sheet.side + margin, sheet.top + 6 * h]
    axis = sheet.graded
    graded = ""
    if axis != "none":
        a = "xyz".index(axis)
        first = 0.0 if axis == "z" else round(0.25 * sheet.side / h) * h
        cells = max(1, round((sheet.top if axis == "z" else 0.5 * sheet.side) / h))
        graded = f", GRADED = '{axis}', FINE = {first:.6g}, {first + cells * h:.6g}, GROWTH = {draw.choice([1.1, 1.3])}, LARGEST_CELL = {1.6 * h:.6g}"
    elif draw.random() < 0.2:
        return f"&GRID CELL = {h}, {h}, {0.5 * h}, LOWER = {text_of(low)}, UPPER = {text_of(high)} /"
    return f"&GRID CELL = {h}, LOWER = {text_of(low)}, UPPER = {text_of(high)}{graded} /"


def text_of(values):
    return ", ".join(f"{value:.6g}" for value in values)


def method(sheet):
    draw = sheet.draw
    keys = ["DEBRIS = 0.9"]
    if sheet.is_usl:
        keys += draw.choice([[], ["TRANSFER = 'xpic', ORDER = 2"], ["TRANSFER = 'fmpm', ORDER = 3"], ["PIC_FRACTION = 0.1"],
                             *([["TRANSFER = 'apic'"]] if sheet.graded == "none" else [])])
    else:
        keys += [f"SCHEME = '{draw.choice(['musl', 'usavg'])}'"]
    if sheet.graded == "none":
        keys += [f"SHAPE = '{sheet.shape}'"]
    keys += draw.choice([[], [], ["SLEEPING = 'off'"], ["FBAR = F"], ["FBAR = T"], ["SELECTIVE_SCALING = 'off'"]])
    return f"&METHOD {', '.join(keys)} /"


def form(sheet):
    """(keys of the shape of a tool, length of what is below its POSITION, by how much its tilt lowers its rim)."""
    draw, h, radius = sheet.draw, sheet.h, sheet.radius
    kind = draw.choice(["flat", "flat", "concave", "pin", "pin", "taper", "thread", "flats", "scroll", "sleeve",
                        "sphere", "box", "stl"])
    tilt = draw.choice([0.0, 0.0, 2.0])
    tilted = f", TILT_DEG = {tilt:g}" if tilt else ""
    sink = radius * 0.035 if tilt else 0.0
    if kind == "sphere":
        return f"KIND = 'sphere', RADIUS = {radius:.6g}", radius, 0.0
    if kind == "box":
        return f"KIND = 'box', SIZE = {radius:.6g}, {1.5 * radius:.6g}, {4 * h:.6g}{tilted}", 2 * h, sink
    if kind == "stl":
        return f"KIND = 'stl', FILE = '../tool.stl', UNIT = 'mm'{tilted}", 0.0, sink
    text = f"RADIUS = {radius:.6g}, HEIGHT = {6 * h:.6g}{tilted}"
    if kind == "concave":
        text += ", CONCAVITY_DEG = 8"
    if kind == "scroll":
        text += f", SCROLL_DEPTH = {0.3 * h:.6g}, SCROLL_PITCH = {h:.6g}"
    if kind == "sleeve":
        text += f", BORE_RADIUS = {0.4 * radius:.6g}"
    if kind not in ("pin", "taper", "thread", "flats"):
        return text, 0.0, sink
    ligament = draw.choice([0.0, draw.uniform(0.05, 1.0)]) * h      # 0: the tip comes to the anvil
    depth = 0.3 * min(h, sheet.thick)
    length = max(0.2 * h, sheet.thick - ligament - depth)
    pin = radius * draw.uniform(0.3, 0.6)
    text += f"\n  PIN_RADIUS = {pin:.6g}, PIN_LENGTH = {length:.6g}"
    if kind == "taper":
        text += f", PIN_TIP_RADIUS = {0.6 * pin:.6g}"
    if kind == "thread":
        text += f", THREAD_DEPTH = {0.2 * pin:.6g}, THREAD_PITCH = {0.8 * h:.6g}"
    if kind == "flats":
        text += f", FLATS = 3, FLAT_DEPTH = {0.2 * pin:.6g}"
    return text, length, sink


def tool(sheet, name, at, spin):
    """A tool that plunges and travels, at a depth or under a force."""
    draw, h = sheet.draw, sheet.h
    keys, below, sink = form(sheet)
    is_round = keys.startswith(("RADIUS", "KIND = 'sphere'"))
    heats = draw.choice(["", "rod", "lumped"]) if sheet.is_usl and is_round and not sheet.is_molten else ""
    if heats:
        keys += (f"\n  HEATS = '{heats}', CONDUCTIVITY = 25, DENSITY = 7800, SPECIFIC_HEAT = 460, CONTACT_CONDUCTANCE = 2e4"
                 + (", HEAT_CAPACITY = 1" if heats == "lumped" else ""))
    forced = draw.random() < 0.3 and is_round and not sheet.is_molten
    press = f", FORCE = {draw.choice([50, 200, 800])}" if forced else ""
    if is_round and draw.random() < 0.1:
        keys += ", STIFFNESS = 1e7"
    above = below + sink + 0.01 * h
    plunge = above - below + draw.uniform(0.2, 0.6) * min(sheet.thick, 2 * h)
    if "PIN" in keys:
        plunge = above + 0.3 * min(h, sheet.thick) - sink
    travel = draw.choice([0.0, 10.0, 50.0]) * h
    return [f"&TOOL NAME = '{name}', {keys}\n  POSITION = {at[0]:.6g}, {at[1]:.6g}, {sheet.top + above:.6g}, {friction(draw)} /",
            f"&MOTION TOOL = '{name}', DURATION = {sheet.time}, VELOCITY = 0, 0, {-plunge / sheet.time:.6g}, SPIN_RPM = {spin} /",
            f"&MOTION TOOL = '{name}', VELOCITY = {travel:.6g}, 0, 0, SPIN_RPM = {spin}{press} /"]


def support(sheet):
    """What the sheet rests on."""
    draw, h, side = sheet.draw, sheet.h, sheet.side
    kind = draw.choice(["fixed", "sliding"])
    cold = f", TEMPERATURE = {0.8 * sheet.melts:.6g}" if draw.random() < 0.2 and not sheet.is_molten else ""
    if sheet.below in ("fixed", "sliding"):
        rubs = ", FRICTION = 0.4" if sheet.below == "sliding" and sheet.cells > 1 else ""
        return [f"&WALL SIDE = 'zmin', KIND = '{sheet.below}'{rubs}{cold} /"]
    if sheet.below == "raised":
        return [f"&WALL SIDE = 'zmin', KIND = '{kind}', POSITION = {h:.6g}{cold} /"]
    if sheet.below == "anvil":
        return [f"&TOOL NAME = 'anvil', KIND = 'plane', POSITION = 0, 0, 0, NORMAL = 0, 0, 1, {friction(draw)} /"]
    if sheet.below == "box":
        return [f"&TOOL NAME = 'anvil', KIND = 'box', SIZE = {2 * side:.6g}, {2 * side:.6g}, {2 * h:.6g}\n"
                f"  POSITION = {side / 2:.6g}, {side / 2:.6g}, {-h:.6g}, {friction(draw)} /"]
    contact = draw.choice([[], ["&CONTACT BODY = 'sheet', OTHER = 'under', FRICTION = 0.5 /"],
                           ["&CONTACT BODY = 'sheet', OTHER = 'under', LAW = 'stick', CONDUCTANCE = 1e4 /"],
                           ["&CONTACT BODY = 'sheet', OTHER = 'under', LAW = 'frictionless', NORMAL = 'gradient' /"]])
    return [*body(sheet, "under", 0.0, sheet.bottom), f"&WALL SIDE = 'zmin', KIND = '{kind}' /", *contact]


def heat(sheet):
    draw = sheet.draw
    keys = draw.choice(["", "", "", ", INTEGRATOR = 'backward-euler'", ", INTEGRATOR = 'backward-euler', EVERY = 5",
                        ", INTEGRATOR = 'backward-euler', SOLVER = 'petsc'"])
    lines = [f"&HEAT AMBIENT = 298{keys} /"]
    if draw.random() < 0.3 and not sheet.is_molten:
        lines += ["&SURFACE BODY = 'sheet', FACE = 'zmin', COEFFICIENT = 1000, PRESSURE_FACTOR = 50, BACKING = 'plate'\n"
                  "  BACKING_CONDUCTIVITY = 45, BACKING_DENSITY = 7850, BACKING_SPECIFIC_HEAT = 480 /"]
    return lines


def scene(draw):
    """(text of the input, number of ranks or None, whether all metal is molten)."""
    sheet = Sheet(draw)
    h, side, radius = sheet.h, sheet.side, sheet.radius
    has_wall_x = draw.random() < 0.3
    at = [side / 2.0 if draw.random() < 0.7 else draw.uniform(0.0, 1.0) * radius for _ in "xy"]  # also over an edge or corner
    spin = draw.choice([300, 1000, 2000])
    more = draw.choice(["", "", "", ", ELASTIC_SCALING = 10", ", MASS_SCALING_RANGE = 1e5, 1e6"])
    lines = [
        "&RUN TITLE = 'a drawn scene' /",
        grid(sheet, has_wall_x),
        f"&TIME END = {2.0 * sheet.time}, MASS_SCALING = {draw.choice([3e5, 1e6]):g}{more} /",
        material(sheet), *body(sheet, "sheet", sheet.bottom, sheet.top),
        *tool(sheet, "tool", at, spin), method(sheet), *support(sheet), *heat(sheet),
        f"&OUTPUT HISTORY_INTERVAL = {sheet.time / 10}, CHECKPOINT_INTERVAL = 1 /"]
    if draw.random() < 0.4:
        lines += [f"&CLAMP LOWER = {-h}, {-h}, {-h}, UPPER = {1.2 * h:.6g}, {side + h:.6g}, {sheet.top + h:.6g} /"]
    if has_wall_x:
        lines += [f"&WALL SIDE = 'xmin', KIND = '{draw.choice(['fixed', 'sliding', 'sliding'])}' /"]
    if draw.random() < 0.2:
        lines += tool(sheet, "other", [side - h, side - h], -spin)
    return "\n".join(lines) + "\n", draw.choice([None] * 17 + [2, 3, 4]), sheet.is_molten


def mesh(radius=2.0, height=5.0, corners=24):
    """A cylinder on the origin as an STL file in mm."""
    angles = [2 * math.pi * (k % corners) / corners for k in range(corners + 1)]
    ring = [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]
    faces = []
    for one, next_ in zip(ring, ring[1:]):
        low, high, next_low, next_high = (*one, 0.0), (*one, height), (*next_, 0.0), (*next_, height)
        faces += [((0.0, 0.0, 0.0), next_low, low), ((0.0, 0.0, height), high, next_high),
                  (low, next_low, next_high), (low, next_high, high)]
    return "solid tool\n" + "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x:g} {y:g} {z:g}\n" for x, y, z in face)
        + "endloop\nendfacet\n" for face in faces) + "endsolid tool\n"


def broken_law(done, is_molten):
    """(K above the solidus where heat took the metal, what of the law is broken or '')."""
    results = done.results("scene")
    above = results.summary()["hottest_over_melting_K"] - (MOLTEN if is_molten else 0.0)
    if above > MOST:
        return above, f"{above} K above the solidus"
    if not is_molten:
        return above, ""
    history, tau = results.history(), results.checkpoint().tau
    shear = max(np.abs(tau[:, 3:]).max(), np.ptp(tau[:, :3], axis=1).max())
    for name, found, most in (("friction heat [J]", np.abs(history["friction_heat[J]"]).max(), 1e-9),
                              ("plastic work [J]", np.abs(history["plastic_work[J]"]).max(), 1e-9),
                              ("shear stress [Pa]", shear, LEAST_STRESS)):
        if found > most:
            return above, f"molten metal has {name} {found}"
    return above, ""


def admitted(done):
    """Sets with the largest mass scaling that passes the check of a run that is refused for it, if it is not tiny."""
    most = [float(value) for value in re.findall(REFUSED + r".* At most (\S+)", done.err)]
    if not most or done.status != driver.BAD_INPUT or min(most) < LEAST_FACTOR:
        return {}
    return {"TIME.MASS_SCALING": 0.99 * min(most), "TIME.MASS_SCALING_RANGE": "0,0"}


def run_scenes(number, seed, place):
    """[(seed of the scene, K above the solidus or None, what is wrong or '', text)]."""
    (pathlib.Path(place) / "tool.stl").write_text(mesh())
    drawn = {k: scene(random.Random(k)) for k in range(seed, seed + number)}
    cases = {k: (("scene.nml", "--quiet"), {"text": text, "ranks": ranks, "timeout": 600})
             for k, (text, ranks, _) in drawn.items()}
    ended = driver.run_all(cases, place)
    again = {k: (case[0], case[1] | {"text": drawn[k][0], "sets": admitted(ended[k])})
             for k, case in cases.items() if admitted(ended[k])}
    (pathlib.Path(place) / "again").mkdir()
    (pathlib.Path(place) / "again/tool.stl").write_text(mesh())
    ended |= driver.run_all(again, pathlib.Path(place) / "again")
    found = []
    for k, done in ended.items():
        text, _, is_molten = drawn[k]
        if REFUSED in done.err and done.status == driver.BAD_INPUT:
            continue                                              # no factor above LEAST_FACTOR passes
        above, wrong = None, f"status {done.status}: {done.err.strip()[-300:]}"
        if done.status == driver.WELL:
            above, wrong = broken_law(done, is_molten)
        found.append((k, above, wrong, text))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the inputs that break the law")
    arguments = parser.parse_args()
    aboves, broken, group = [], 0, 12
    for first in range(arguments.seed, arguments.seed + arguments.number, group):
        number = min(group, arguments.seed + arguments.number - first)
        with tempfile.TemporaryDirectory() as place:
            found = run_scenes(number, first, place)
        for k, above, wrong, text in found:
            aboves += [above] if above is not None else []
            if not wrong:
                continue
            broken += 1
            print(f"scene {k}: {wrong}", flush=True)
            if arguments.keep:
                arguments.keep.mkdir(exist_ok=True)
                (arguments.keep / f"{k}.nml").write_text(text)
    print(f"{arguments.number} scenes, {broken} break the law; hottest above the solidus: {sorted(aboves)[-5:]} K")
    return broken > 0


if __name__ == "__main__":
    sys.exit(main())
