# SPDX-License-Identifier: MIT
"""The passes: plates, flow laws and experiments, made of the shipped inputs."""

import pathlib
import re

HERE = pathlib.Path(__file__).resolve().parent
INPUT = HERE.parents[1] / "input"
CUT = re.compile(r"(?m)^! 1290 mm3.*\n&SHAPE BODY = 'plate', OPERATION = 'subtract'[^/]*/\n")
TITLE = re.compile(r"TITLE = '[^']*'")
MATERIAL = re.compile(r"(?ms)^&MATERIAL.*?/$")
SIDES = re.compile(r"(?m)^&WALL SIDE = '[xy]m(in|ax)'.*\n")
COPPER = "fsp_copper_hot_1mm"  # friction and film on the floor of the valley of hot copper (valley.py), sides and ends held

# Flow law of copper: the input that has it, keys of the friction and film on the floor of its own valley.
LAWS = {"hot": (COPPER, {}),
        "jc": ("fsp_copper_cavity1_1mm", {"TOOL.SHEAR_FACTOR": "1", "SURFACE.COEFFICIENT": "40000"}),
        "tp": ("fsp_copper_two_phase_1mm", {"TOOL.SHEAR_FACTOR": "0.65", "SURFACE.COEFFICIENT": "10000"})}
WORDS = {"hot": "hot copper", "jc": "Johnson-Cook", "tp": "two-phase law"}
PLATES = {"cavity1": ("heat_copper_cavity1", "cavity 1"), "cavity2": ("heat_copper_cavity2", "cavity 2"),
          "cavity3": ("heat_copper_cavity3", "cavity 3"), "plain": (None, "no cavity")}
SCENES = [f"{plate}_{law}" for law in LAWS for plate in PLATES] + ["aa5005_tp"]

# Points that are followed, as in figures 5.22 to 5.27 of the thesis: rows on the surface under the advancing edge, the
# middle and the retreating edge of the tool, a block on the surface, and the layer 1 to 2 mm below it.
TRACERS = """
&TRACER NAME = 'retreating', KIND = 'line', FROM = 12e-3, 12e-3, {top}, TO = 88e-3, 12e-3, {top}, SPACING = 4e-3, INTERVAL = 0.1 /
&TRACER NAME = 'middle', KIND = 'line', FROM = 12e-3, 20e-3, {top}, TO = 88e-3, 20e-3, {top}, SPACING = 4e-3, INTERVAL = 0.1 /
&TRACER NAME = 'advancing', KIND = 'line', FROM = 12e-3, 28e-3, {top}, TO = 88e-3, 28e-3, {top}, SPACING = 4e-3, INTERVAL = 0.1 /
&TRACER NAME = 'block', KIND = 'box', LOWER = 20e-3, 9e-3, {low}, UPPER = 30e-3, 31e-3, {top}, NUMBER = 5, 11, 1, INTERVAL = 0.1 /
&TRACER NAME = 'below', KIND = 'box', LOWER = 20e-3, 9e-3, {deep}, UPPER = 30e-3, 31e-3, {low}, NUMBER = 5, 11, 1, INTERVAL = 0.1 /
"""


def text_of(name, kind="floor"):
    """The input of a pass."""
    plate, law = name.rsplit("_", 1)
    if plate == "aa5005":
        text, top = (INPUT / "fsp_aa5005_two_phase_1mm.nml").read_text(encoding="utf-8"), 6.5
    else:
        text, top = (INPUT / f"{COPPER}.nml").read_text(encoding="utf-8"), 12.0
        cut, words = PLATES[plate]
        text = TITLE.sub(f"TITLE = 'Copper plate, {words}, {WORDS[law]}, 970 rpm'", text, count=1)
        text = MATERIAL.sub(MATERIAL.search((INPUT / f"{LAWS[law][0]}.nml").read_text(encoding="utf-8")).group(), text, count=1)
        other = CUT.search((INPUT / f"{cut}.nml").read_text(encoding="utf-8")).group() if cut else ""
        text, found = CUT.subn(other, text)
        assert found == 1, f"{COPPER}.nml has no cavity to replace"
    if kind == "free":
        text = SIDES.sub("", text)
    return text + TRACERS.format(top=f"{top}e-3", low=f"{top - 1:g}e-3", deep=f"{top - 2:g}e-3")


# What is changed to learn what a number depends on: keys beside those of the pass on the floor of the valley.
EXPERIMENTS = {
    "free": ("sides and ends free", {}),
    "cooled": ("film of hot copper", {"SURFACE.COEFFICIENT": "45000"}),
    "fast": ("mass scaling 1e6", {"TIME.MASS_SCALING": "1e6"}),
    "adaptive": ("mass scaling 1e3 to 1e5", {"TIME.MASS_SCALING": "1e5", "TIME.MASS_SCALING_RANGE": "1e3,1e5", "TIME.INERTIAL_FRACTION": "0.03"}),
    "deep06": ("tool 0.6 mm deeper", {"MOTION(1).DURATION": "0.8", "METHOD.DEBRIS": "0.05"}),
    "soft50": ("machine of 50 kN/mm, slide 1.5 mm deeper", {"TOOL.STIFFNESS": "5e7", "MOTION(1).DURATION": "1.4", "METHOD.DEBRIS": "0.05"}),
    "soft20": ("machine of 20 kN/mm, slide 3 mm deeper", {"TOOL.STIFFNESS": "2e7", "MOTION(1).DURATION": "2.4", "METHOD.DEBRIS": "0.05"}),
}
# Grains after the tool: input/material/cooling.nml, whose numbers are unverified.
AFTER = {"MATERIAL.RECRYSTALLISATION": "9.3e-7,104e3", "MATERIAL.NUCLEATION_DENSITY": "1e14", "MATERIAL.NUCLEUS_SPACING": "2e-6",
         "MATERIAL.RECRYSTALLISED_STRAIN": "0.5", "MATERIAL.GROWTH": "2.3e-6,104e3", "MATERIAL.RECOVERY": "8e-22,117e3",
         "MATERIAL.RECOVERY_EXPONENT": "3"}
WATER = {"SURFACE.COEFFICIENT": "45000", "SURFACE.FACE": "all"}
EXPERIMENTS |= {"annealing": ("annealing after the tool", AFTER), "annealing_water": ("annealing, in water", AFTER | WATER)}
KINDS = ("floor", *EXPERIMENTS)


def variant(name, kind):
    """Keys of a pass beside those of its input."""
    plate, law = name.rsplit("_", 1)
    keys = EXPERIMENTS[kind][1] if kind in EXPERIMENTS else {}
    return keys | {"METHOD.DEBRIS": "0.05"} if plate == "aa5005" else LAWS[law][1] | keys


def cells(name, particles):
    """Keys for particles so many mm apart: cells hold two of them along each edge."""
    cell = 2e-3 * particles
    if name.startswith("aa5005"):
        cell *= 13.0 / 12.0  # whole layers in 6.5 mm
        # Three cells over the thickness at least: where nodes are clamped and touched by the tool, torque has no limit.
        return {"GRID.CELL": f"{cell:.17g},{cell:.17g},{min(cell, 6.5e-3 / 3):.17g}"}
    return {"GRID.CELL": f"{cell:.17g}"}
