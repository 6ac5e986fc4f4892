# SPDX-License-Identifier: MIT
"""The passes: plates, flow laws and variants, made of the shipped inputs."""

import json
import pathlib
import re

HERE = pathlib.Path(__file__).resolve().parent
INPUT = HERE.parents[1] / "input"
CALIBRATED = HERE / "calibrated.json"
CUT = re.compile(r"(?m)^! 1290 mm3.*\n&SHAPE BODY = 'plate', OPERATION = 'subtract'[^/]*/\n")
TITLE = re.compile(r"TITLE = '[^']*'")
MATERIAL = re.compile(r"(?ms)^&MATERIAL.*?/$")
HOT = "&MATERIAL NAME = 'copper', FROM = 'copper-hot', SPECIFIC_HEAT = 386, CONDUCTIVITY = 391 /"

# Name: shipped input of the pass, that whose cavity it has, title.
SCENES = {}
for law, base, words in (("jc", "fsp_copper_cavity1_1mm", "Johnson-Cook"), ("tp", "fsp_copper_two_phase_1mm", "two-phase law"),
                         ("hot", "fsp_copper_cavity1_1mm", "hot copper")):
    for plate, cut, what in (("cavity1", "heat_copper_cavity1", "cavity 1"), ("cavity2", "heat_copper_cavity2", "cavity 2"),
                             ("cavity3", "heat_copper_cavity3", "cavity 3"), ("plain", None, "no cavity")):
        SCENES[f"{plate}_{law}"] = (base, cut, f"Copper plate, {what}, {words}")
SCENES["aa5005_tp"] = ("fsp_aa5005_two_phase_1mm", "as it is", "AA5005 plate, two-phase law")

# Points that are followed, as in figures 5.22 to 5.27 of the thesis: rows on the surface under the advancing edge, the
# middle and the retreating edge of the tool, a block on the surface, and the layer 1 to 2 mm below it.
TRACERS = """
&TRACER NAME = 'retreating', KIND = 'line', FROM = 12e-3, 12e-3, {top}, TO = 88e-3, 12e-3, {top}, SPACING = 4e-3, INTERVAL = 0.1 /
&TRACER NAME = 'middle', KIND = 'line', FROM = 12e-3, 20e-3, {top}, TO = 88e-3, 20e-3, {top}, SPACING = 4e-3, INTERVAL = 0.1 /
&TRACER NAME = 'advancing', KIND = 'line', FROM = 12e-3, 28e-3, {top}, TO = 88e-3, 28e-3, {top}, SPACING = 4e-3, INTERVAL = 0.1 /
&TRACER NAME = 'block', KIND = 'box', LOWER = 20e-3, 9e-3, {low}, UPPER = 30e-3, 31e-3, {top}, NUMBER = 5, 11, 1, INTERVAL = 0.1 /
&TRACER NAME = 'below', KIND = 'box', LOWER = 20e-3, 9e-3, {deep}, UPPER = 30e-3, 31e-3, {low}, NUMBER = 5, 11, 1, INTERVAL = 0.1 /
"""


def text_of(name, kind="printed"):
    """The input of a pass."""
    base, cut, title = SCENES[name]
    text = (INPUT / f"{base}.nml").read_text(encoding="utf-8")
    if name.endswith("_hot"):
        text = MATERIAL.sub(HOT, text, count=1)
    text = TITLE.sub(f"TITLE = '{title}, 970 rpm'", text, count=1)
    if cut != "as it is":
        other = CUT.search((INPUT / f"{cut}.nml").read_text(encoding="utf-8")).group() if cut else ""
        text, found = CUT.subn(other, text)
        assert found == 1, f"{base}.nml has no cavity to replace"
    top = 6.5 if name.startswith("aa5005") else 12.0
    return text + TRACERS.format(top=f"{top}e-3", low=f"{top - 1:g}e-3", deep=f"{top - 2:g}e-3") + (
        HELD if kind in ("held", "stuck_held", "valley") else "")


# What is changed to learn what a number depends on: keys beside those of the pass as printed.
EXPERIMENTS = {
    "cells": ("cells halved", {}),  # its particles are half as far apart
    "coarse": ("cells half as large again", {}),
    "steps": ("mass scaling a tenth", {}),
    "stick": ("metal sticks to the face", {"TOOL.FRICTION_LAW": "shear-factor", "TOOL.SHEAR_FACTOR": "1"}),
    "half": ("half the shear strength", {"TOOL.FRICTION_LAW": "shear-factor", "TOOL.SHEAR_FACTOR": "0.5"}),
    "soft": ("machine of 20 kN/mm", {"TOOL.STIFFNESS": "2e7"}),
    "film": ("film 2500 W/(m2 K)", {"SURFACE.COEFFICIENT": "2500"}),
    "stuck_film": ("sticks, film 2500 W/(m2 K)", {"TOOL.FRICTION_LAW": "shear-factor", "TOOL.SHEAR_FACTOR": "1",
                                                  "SURFACE.COEFFICIENT": "2500", "TOOL.HEAT_SHARE": "0.836"}),
}
for kind, film in (("stuck_cool", 8000), ("stuck_fitted", 60000), ("stuck_cold", 100000)):
    EXPERIMENTS[kind] = (f"sticks, film {film} W/(m2 K)", EXPERIMENTS["stuck_film"][1] | {"SURFACE.COEFFICIENT": f"{film}"})
# Grains after the tool: input/material/cooling.nml, whose numbers are unverified.
AFTER = {"MATERIAL.RECRYSTALLISATION": "9.3e-7,104e3", "MATERIAL.NUCLEATION_DENSITY": "1e14", "MATERIAL.NUCLEUS_SPACING": "2e-6",
         "MATERIAL.RECRYSTALLISED_STRAIN": "0.5", "MATERIAL.GROWTH": "2.3e-6,104e3", "MATERIAL.RECOVERY": "8e-22,117e3",
         "MATERIAL.RECOVERY_EXPONENT": "3"}
WATER = {"SURFACE.COEFFICIENT": "5000", "SURFACE.FACE": "all"}
EXPERIMENTS |= {"annealing": ("annealing after the tool", AFTER), "water": ("in water, 5000 W/(m2 K)", WATER),
                "annealing_water": ("annealing, in water", AFTER | WATER)}
EXPERIMENTS["held"] = ("sides and ends held", {})
EXPERIMENTS["stuck_held"] = ("sticks, film 2500 W/(m2 K), sides and ends held", EXPERIMENTS["stuck_film"][1])
# The floor of the valley of the thermocouples (valley.py), with the stir zone of the experiment.
EXPERIMENTS["valley"] = ("two thirds of the shear strength, film 45000 W/(m2 K), sides and ends held",
                         {"TOOL.FRICTION_LAW": "shear-factor", "TOOL.SHEAR_FACTOR": "0.65", "SURFACE.COEFFICIENT": "45000", "TOOL.HEAT_SHARE": "0.836"})
HELD = "".join(f"&WALL SIDE = '{side}', KIND = 'sliding', POSITION = {place} /\n" for side, place in
               (("xmin", "0"), ("xmax", "100e-3"), ("ymin", "0"), ("ymax", "40e-3")))
KINDS = ("printed", "calibrated", *EXPERIMENTS)


def variant(kind):
    """Keys of a variant: 'printed' has none; 'calibrated' those that were found on cavity 1."""
    if kind == "calibrated":
        return json.loads(CALIBRATED.read_text(encoding="utf-8"))["keys"]
    return EXPERIMENTS[kind][1] if kind in EXPERIMENTS else {}


def cells(name, particles):
    """Keys for particles so many mm apart: cells hold two of them along each edge."""
    cell = 2e-3 * particles
    if name.startswith("aa5005"):
        cell *= 13.0 / 12.0  # whole layers in 6.5 mm
        # Three cells over the thickness at least: where nodes are clamped and touched by the tool, torque has no limit.
        return {"GRID.CELL": f"{cell:.17g},{cell:.17g},{min(cell, 6.5e-3 / 3):.17g}"}
    return {"GRID.CELL": f"{cell:.17g}"}
