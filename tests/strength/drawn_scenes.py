#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Drawn scenes of tools in hot thin metal: no metal gets hotter than its solidus by more than 20 K.

    build/venv/bin/python tests/strength/drawn_scenes.py [--number 1000] [--seed 1] [--keep FOLDER]

Metal at its solidus has no strength: it gets no heat of friction and none of plastic work, so that only what it got
just before, and conduction between hotter and colder particles, can take it above. Sheets of one to four cells on walls
and anvils, corners, clamps, pins whose tips are anywhere above the wall, two tools, bodies in contact; laws of
flow and friction, shapes and schemes, mass scalings, one to three ranks. Prints the scenes that break the law and how
far above the solidus the others came.
"""

import argparse
import pathlib
import random
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))

import driver

MOST = 20.0  # [K] above the solidus
METALS = {"AA2024-T3": 775.0, "AA6061-T6": 855.0, "copper": 1356.0, "copper-hot": 1356.0}


def friction(draw):
    law = draw.choice(["coulomb", "shear-factor", "shear-factor", "wanheim-bay", "schmidt-hattel"])
    if law == "coulomb":
        return f"FRICTION = {draw.choice([0.2, 1.0, 5.0])}"
    if law == "schmidt-hattel":
        return f"FRICTION_LAW = '{law}', FRICTION = {draw.choice([0.3, 1.0])}, STICK_FRACTION = {draw.choice([0.5, 1.0])}"
    return f"FRICTION_LAW = '{law}', SHEAR_FACTOR = {draw.choice([0.3, 0.8, 1.0])}"


def scene(draw):
    """(text of an input, number of ranks)."""
    metal = draw.choice(list(METALS))
    melts = METALS[metal]
    h = draw.choice([1e-3, 0.75e-3])
    cells = draw.choice([1, 2, 3, 4])
    thick = (cells + draw.choice([0.0, 0.0, 0.3, 0.5])) * h
    radius = draw.uniform(2.5, 4.0) * h
    side = 2.0 * radius + draw.uniform(3.0, 5.0) * h
    ligament = draw.uniform(0.05, 2.0) * h
    has_pin = cells > 1 and draw.random() < 0.7
    pin = max(0.2 * h, thick - ligament - 0.3 * h) if has_pin else 0.0
    tilt = draw.choice([0.0, 0.0, 2.0])
    spin = draw.choice([300, 800, 2000])
    plunge = draw.uniform(0.3, 0.6) * min(thick, 2.0 * h) if not has_pin else pin + 0.3 * h
    time = 0.06
    start = draw.uniform(0.75, 0.99) * melts
    below = draw.choice(["fixed", "fixed", "fixed", "sliding", "anvil", "body"])
    z0 = thick if below == "body" else 0.0   # the sheet on a body of its own thickness
    margin = 3.0 * h
    at = side / 2.0 if draw.random() < 0.7 else radius - draw.uniform(0.0, 1.0) * radius   # also over an edge or corner
    methods = [f"DEBRIS = 0.5, SHAPE = '{draw.choice(['bspline', 'bspline', 'ugimp'])}'"]
    scheme = draw.choice(["", "", "SCHEME = 'musl'", "TRANSFER = 'apic'"])
    methods += [scheme]
    heats = draw.random() < 0.3 and "musl" not in scheme
    lines = [
        "&RUN TITLE = 'a drawn scene' /",
        f"&GRID CELL = {h}, LOWER = {-margin}, {-margin}, {-margin if below == 'anvil' else 0.0}, "
        f"UPPER = {side + margin}, {side + margin}, {z0 + thick + 6 * h} /",
        f"&TIME END = {2.0 * time}, MASS_SCALING = {draw.choice([1e6, 3e6, 1e7])} /",
        f"&MATERIAL NAME = '{metal}', FROM = 'library' /",
        f"&BODY NAME = 'sheet', MATERIAL = '{metal}', TEMPERATURE = {start:.1f} /",
        f"&SHAPE BODY = 'sheet', LOWER = 0, 0, {z0}, UPPER = {side}, {side}, {z0 + thick} /",
        f"&TOOL NAME = 'tool', RADIUS = {radius}, HEIGHT = {6 * h}, TILT_DEG = {tilt}"
        + (f", PIN_RADIUS = {radius * draw.uniform(0.25, 0.6)}, PIN_LENGTH = {pin}" if has_pin else ""),
        f"  POSITION = {at}, {at}, {z0 + thick + pin + 0.01 * h}, {friction(draw)}"
        + (", HEATS = 'rod', CONDUCTIVITY = 25, DENSITY = 7800, SPECIFIC_HEAT = 460, CONTACT_CONDUCTANCE = 2e4"
           if heats else "") + " /",
        f"&MOTION TOOL = 'tool', DURATION = {time}, VELOCITY = 0, 0, {-plunge / time}, SPIN_RPM = {spin} /",
        f"&MOTION TOOL = 'tool', VELOCITY = {draw.choice([0.0, 5.0, 20.0]) * h}, 0, 0, SPIN_RPM = {spin} /",
        f"&HEAT AMBIENT = 298{draw.choice(['', ', INTEGRATOR = ' + chr(39) + 'backward-euler' + chr(39)])} /",
        f"&OUTPUT HISTORY_INTERVAL = {time / 10}, CHECKPOINT_INTERVAL = 1 /",
    ]
    lines += [f"&METHOD {', '.join(method for method in methods if method)} /"]
    if below in ("fixed", "sliding"):
        lines += [f"&WALL SIDE = 'zmin', KIND = '{below}' /"]
    elif below == "anvil":
        lines += [f"&TOOL NAME = 'anvil', KIND = 'plane', POSITION = 0, 0, 0, NORMAL = 0, 0, 1, {friction(draw)} /"]
    else:
        lines += [f"&BODY NAME = 'under', MATERIAL = '{metal}', TEMPERATURE = {start:.1f} /",
                  f"&SHAPE BODY = 'under', LOWER = 0, 0, 0, UPPER = {side}, {side}, {z0} /",
                  "&WALL SIDE = 'zmin', KIND = 'fixed' /"]
        if draw.random() < 0.5:
            lines += ["&CONTACT BODY = 'sheet', OTHER = 'under', FRICTION = 0.5 /"]
    if draw.random() < 0.5:
        lines += [f"&CLAMP LOWER = {-h}, {-h}, {-h}, UPPER = {1.2 * h}, {side + h}, {z0 + thick + h} /"]
    if draw.random() < 0.3:
        lines[1] = lines[1].replace(f"LOWER = {-margin},", "LOWER = 0,")
        lines += [f"&WALL SIDE = 'xmin', KIND = '{draw.choice(['fixed', 'sliding', 'sliding'])}' /"]
    if draw.random() < 0.2:
        lines += [f"&TOOL NAME = 'other', RADIUS = {1.5 * h}, HEIGHT = {6 * h}, POSITION = {side - h}, {side - h}, "
                  f"{z0 + thick + 0.01 * h}, {friction(draw)} /",
                  f"&MOTION TOOL = 'other', VELOCITY = 0, 0, {-0.5 * plunge / time}, SPIN_RPM = {-spin} /"]
    return "\n".join(lines) + "\n", melts, draw.choice([1, 1, 2, 3])


def above_solidus(done, melts):
    """What the hottest metal ever was above its solidus [K]."""
    history = done.results("scene").history()
    return float(history["temperature_max[K]"].max()) - melts


def run_scenes(number, seed, place):
    """[(seed of the scene, status, K above the solidus or what was said, text)]."""
    found = []
    cases, melts = {}, {}
    for k in range(seed, seed + number):
        text, melts[k], ranks = scene(random.Random(k))
        cases[k] = (("scene.nml", "--quiet"), {"text": text, "ranks": ranks, "timeout": 300})
    texts = {k: case[1]["text"] for k, case in cases.items()}
    for k, done in driver.run_all(cases, place).items():
        try:
            result = above_solidus(done, melts[k])
        except (OSError, KeyError, IndexError, ValueError):
            result = None
        found.append((k, done.status, result, done.err.strip(), texts[k]))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the inputs that break the law")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        found = run_scenes(arguments.number, arguments.seed, place)
    broken = 0
    for k, status, above, said, text in found:
        if status == driver.WELL and above is not None and above <= MOST:
            continue
        broken += 1
        print(f"scene {k}: status {status}, {above} K above the solidus: {said[-300:]}")
        if arguments.keep:
            arguments.keep.mkdir(exist_ok=True)
            (arguments.keep / f"{k}.nml").write_text(text)
    aboves = sorted(above for _, _, above, _, _ in found if above is not None)
    print(f"{len(found)} scenes, {broken} break the law; hottest above the solidus: {aboves[-5:]} K")
    return broken > 0


if __name__ == "__main__":
    sys.exit(main())
