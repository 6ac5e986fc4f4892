# SPDX-License-Identifier: MIT
"""What the documents state in their sentences: figures that are measured, and numbers that are none.

A statement is a text of a document with '#' for each number, and the values behind these in their order: a measurement,
its key and a factor. Numbers that are no results belong to a definition, with the reason why nothing measures them."""

import dataclasses

import documents
import tables

@dataclasses.dataclass(frozen=True)
class Statement:
    document: str
    words: str
    values: tuple  # (measurement, key, factor) for each '#'


STATEMENTS = (
    Statement("docs/accuracy.md", "FLIP loses # % of its angular momentum with uGIMP and # % with B-splines, MUSL # %, FMPM all of "
              "it; APIC # and # %.", tuple(("rotation", key, 100.0) for key in ("flip ugimp", "flip bspline", "musl ugimp",
                                                                               "apic ugimp", "apic bspline"))),
    Statement("docs/accuracy.md", "| uGIMP, FLIP | # |", (("limits", "limit_ugimp", 1.0),)),
    Statement("docs/accuracy.md", "| B-spline, FLIP | # |", (("limits", "limit_bspline", 1.0),)),
    Statement("docs/accuracy.md", "SELECTIVE_SCALING = 'on' | # |", (("limits", "limit_selective", 1.0),)),
    Statement("docs/accuracy.md", "on all axes, B-spline | # times that", (("limits", "sparse_factor", 1.0),)),
    Statement("docs/accuracy.md", "Poisson's ratio nu above # |", (("limits", "volumetric_from", 1.0),)),
    Statement("docs/accuracy.md", "| APIC | # times that of FLIP |", (("limits", "apic_gain", 1.0),)),
    Statement("docs/accuracy.md", "k to the power of # times that of FLIP", (("limits", "filter_power", 1.0),)),
    Statement("docs/accuracy.md", "The default time step is # of these limits (# with SELECTIVE_SCALING)",
              (("limits", "margin", 1.0), ("limits", "margin_selective", 1.0))),
    Statement("docs/heat.md", "The volume of the plate with cavity is # mm3", (("heat cavity", "volume", 1.0),)),
    Statement("docs/heat.md", "falls with order # in the plain plate", (("heat plates", "copper_plain, order", 1.0),)),
    Statement("docs/heat.md", "the order (# to #) is not conclusive", (("heat plates", "cavities, least order", 1.0),
                                                               ("heat plates", "cavities, largest order", 1.0))),
    Statement("docs/heat.md", "at 1 mm come at #, # and # s", tuple(("heat record", f"T{k}, time", 1.0) for k in (1, 2, 3))),
    Statement("docs/heat.md", "after 65 s is # 1/s", (("heat record", "cooling rate", 1.0),)),
    Statement("docs/heat.md", "at 1 mm (# cells) takes # steps and # evaluations of the rates",
              tuple(("heat record", key, 1.0) for key in ("cells", "steps", "evaluations"))),
    Statement("docs/heat.md", "it takes # s of processor time on one rank, # s at 0.5 mm",
              tuple(("heat plates", f"copper_plain, {cell}, cpu_seconds", 1.0) for cell in ("1", "0.5"))),
    Statement("docs/heat.md", "at every size, #, # and # times. In",
              tuple(("heat crossing", f"{cell}, explicit over implicit", 1.0) for cell in ("1", "0.5", "0.25"))),
    Statement("docs/heat.md", "implicit steps cost less below # mm", (("heat crossing", "rkl2 to tr-bdf2, fftw", 1.0),)),
    Statement("docs/heat.md", "with 700 W/(m2 K) they give # and # W/(m2 K).", (("heat cavity", "differences", 1.0),
                                                                         ("heat cavity", "exponential", 1.0))),
    Statement("docs/heat.md", "the temperature of the plate is not yet uniform (# W/(m2 K)).", (("heat cavity", "free end", 1.0),)),
    Statement("docs/heat.md", "g (# for copper and tool steel)", (("heat share", "copper", 1.0),)),
    Statement("docs/heat.md", "changes the peaks of cavity 1 by # K", (("heat cavity", "air", 1.0),)),
    Statement("docs/heat.md", "# % at 16 cells, # % at 32", (("heat_robin 16", "error", 100.0), ("heat_robin 32", "error", 100.0))),
    Statement("docs/microstructure.md", "The residual is # % (the noise:", (("calibration", "residual", 100.0),)),
)

# Why a number of a document is not measured.
KEY = "a parameter of the method or of a scene, as the program or the input has it"
ASKED = "a limit that a test or a command enforces"
QUOTED = "a figure of the literature"
ABLATION = "measured as tests/verification/ablation.md says"
WELDS = "in benchmarks/welds/results.jsonl and rule.jsonl, or follows from the rows there, as reported in the sources"
PASSES = "in benchmarks/passes/results, in words"
STUDY = "measured once by the command or the test beside it, which prints it again"
FORMULA = "follows from the formula beside it"
ABOUT = "the order of a processor time, which depends on the machine"

DEFINITIONS = (
    ("docs/verification.md", "nowhere is the hottest metal more than 3.1 K above its solidus", STUDY),
    ("docs/verification.md", "where 20 K are allowed", ASKED),
    ("docs/verification.md", "kinetic below 1e-4 of elastic energy", ASKED),
    ("docs/verification.md", "metal 29 K above its solidus, an energy balance that does not close", STUDY),
    ("docs/verification.md", "no end after 100 s", STUDY),
    ("docs/verification.md", "no metal 1 K above its solidus, drawn scenes", ASKED),
    ("docs/method.md", "turns by more than 30 degrees", KEY),
    ("README.md", "CMake >= 3.20", QUOTED),
    ("README.md", "ParaView 5.11", QUOTED),
    ("docs/choosing.md", "A film of 560 to 700 W/(m2 K)", QUOTED),
    ("docs/choosing.md", "The shoulder of `stationary` is pressed by 80 N/mm2 of its face. With 50 N/mm2 it floated 0.2 to 0.3 mm above the plate on the metal of the "
     "plunge, and a groove of 1.7 mm2 was left beside the pin; held 0.1 mm below the top, under 16 to 24 kN, it closes the weld as well", STUDY),
    ("docs/choosing.md", "`--check` states for 1 mm/s and", KEY),
    ("docs/choosing.md", "a shoulder of 18 mm under 25 kN, 0.25 mm deep in 3 mm of AA2024 at first, is 0.11 mm deep after 4 s of travel in the "
     "metal `AA2024-T3-weld`, and 0.04 mm above the sheet", STUDY),
    ("docs/choosing.md", "(`aa2024`, but with cells of 1.5 mm) under 25 kN; the force of the plunge at 2 mm/s is largest at its end, 466 kN, "
     "and 28 to 40 kN while the pin alone is in the cold sheet: | plunge | face at the top of the sheet | torque in "
     "travel | depth of the face in travel | |---|---|---|---| | at 2 mm/s to a depth of 0.22 mm, dwell of 1 s, then the "
     "force | after 1.3 s | 43 N m | 0.21 mm, sinking by 0.04 mm/s | | the force alone from 298 K, travel after 8 s | "
     "after 9.6 s | 39 N m | 0.09 mm, sinking by 0.01 mm/s | | the force alone on a sheet of 650 K, no travel | 0.08 mm "
     "above it after 6 s", STUDY),
    ("docs/choosing.md", "table shows the differences from a mass scaling of 1e5 in the same cells of 2.67 mm, for the tool of "
     "`input/fsp_copper_cavity1_1mm.nml` plunged into a hot plate and travelling for 3.6 s", KEY),
    ("docs/choosing.md", "| mass 1e6 | 0.2 % | 0.3 K | 1.5 % | 1.2 % | 1.5 % | 2.7 times | | mass 1e7 | 0.8 % | 1.4 K | 2.8 % | 2.1 % | "
     "1.0 % | 7.0 times | | mass 1e6, elastic 10 | 2.8 % | 6.8 K | 19.6 % | 5.7 % | 9.6 % | 7.1 times |", STUDY),
    ("docs/choosing.md", "In the cells of the input, 2 mm, 1e6 changes force, torque, heat and fill by 0.5, 0.7, 1.0 and 0.1 %, in 76 instead of 197 s, "
     "and 1e7 by 1.0, 1.8, 1.9 and 0.2 %, in 31 s: the input has 1e6.", STUDY),
    ("docs/choosing.md", "scaling of 1e8 (in cells of 4 mm) reduces the force by 6 % and the fill by a fifth although the inertial stress is "
     "only 0.7 % of the flow stress, because the rim of the tool then moves by more than a cell in a step. Over the whole"
     " pass 1e6 instead of 1e5 changes the means of force and torque and the friction heat by 0.4 % at most, the force of a single second by 7 %, "
     "peaks of thermocouples by 2 K, and the fill of the cavity from 25.3 to 24.4 %. Use", STUDY),
    ("docs/choosing.md", "cells of 1.33 mm, force, torque, heat and temperatures at thermocouples are within 3.2 % in cells of 2.67 mm. "
     "Strain and groove converge more slowly: from cells of 4 to 2 mm the error of the strain falls from 59 to 29 %, that "
     "of the groove from 23 to 5 %; that of the fill falls from 27 to 0.2 %. ![error", STUDY),
    ("docs/choosing.md", "The weld of `input/quickstart.nml`, single runs; force and torque are means of the last 0.6 s of travel", KEY),
    ("docs/choosing.md", '| 4e5 | 1 | 141 % | 16.8 | 3.2 | 22.3 | 830 | none | 162 |', STUDY),
    ("docs/choosing.md", '| 1e3 to 2e6 | 8 | 3.9 % | 9.0 | 2.6 | 21.8 | 831 | none | 224 |', STUDY),
    ("docs/choosing.md", 'The force of 16.8 kN is inertia: the machine of this weld plunged with 7 to 9 kN ([welds.md](welds.md#welds-of-rabe)).', STUDY),
    ("docs/choosing.md", "the machine of this weld plunged with 7 to 9 kN", QUOTED),
    ("docs/choosing.md", "a mass scaling of 1e7 show loads and temperatures of a pass", KEY),
    ("docs/choosing.md", "Compared with cells of 1.33 mm at the same mass scaling (`benchmarks/stirring_front`) the force is 6 % too large, torque and heat are 3 % and 4 % too small, "
     "a thermocouple is 21 K and the hottest metal 44 K too cold, and strain, groove and fill are 59, 23 and 27 % too small", "in benchmarks/stirring_front.jsonl"),
    ("docs/choosing.md", "Cells of 2.67 mm take four times as long, with 3 % in the loads and 11 and 32 K.", "in benchmarks/stirring_front.jsonl"),
    ("docs/choosing.md", "the plunge into cold metal at 2 mm/s.", KEY),
    ("docs/choosing.md", "travel under the force of a machine, 40 N/mm2 of the face", KEY),
    ("docs/choosing.md", "with the 20 kN of a machine: to 0.3 mm below the top they take 44 to 62 kN", STUDY),
    ("docs/choosing.md", "plunge its last 0.6 mm slowly: `butt` takes 30 kN at 0.4 mm/s and 22 kN at 0.2 mm/s", STUDY),
    ("docs/accuracy.md", "good to some 30 %", ABOUT),
    ("docs/accuracy.md", "every 10 or 100 steps", KEY),
    ("docs/accuracy.md", "FOURIER = 0.25, the default", KEY),
    ("docs/accuracy.md", "(Poisson's ratio 0.33,", KEY),
    ("docs/accuracy.md", "In 3,000 steps its energy does not grow", KEY),
    ("docs/accuracy.md", "TIME.CFL = 0.4)", KEY),
    ("docs/accuracy.md", "pressed 0.05 mm into a clamped copper plate in 2 ms. Force and torque are means from 0.5 to 1.9 ms, heat is "
     "that after 1.9 ms. The grid is shifted by (0.13, 0.29, 0.41) cells", KEY),
    ("docs/restart.md", "more than 10 % of the energy exchanged (`audit_error`; above 1 % a", KEY),
    ("docs/restart.md", "hotter than 1.15 times its T_MELT", KEY),
    ("docs/heat.md", "100 x 40 x 12 mm, 970 rpm, 1.8 mm/s, 700 W/(m2 K) below", KEY),
    ("docs/heat.md", "the cavity of 1290 mm3", KEY),
    ("docs/heat.md", "15 W/(m2 K) of air", KEY),
    ("docs/heat.md", "an AA5005 plate of 6.5 mm", KEY),
    ("docs/heat.md", "less than 40 % of its volume joins", KEY),
    ("docs/heat.md", "mm3. - **Bodies**", KEY),
    ("docs/heat.md", "thesis eqs. 4.1-4.15", QUOTED),
    ("docs/heat.md", "`YIELD_LOGISTIC` (eq. 4.16)", QUOTED),
    ("docs/heat.md", "plate and tool (eq. 2.11)", QUOTED),
    ("docs/heat.md", "In the plain plate at 1 mm probes differ from those with a tolerance of 0.02 K", KEY),
    ("docs/heat.md", "at most 1.5 times the one before", KEY),
    ("docs/heat.md", "below 1e-9 %", ASKED),
    ("docs/heat.md", "from cells of 1 and 0.5 mm, and for cells of 2, 1 and 0.5 mm", KEY),
    ("docs/heat.md", "more than 1 K off at 1 mm or 0.4 K at 0.5 mm", ASKED),
    ("docs/heat.md", "passes a thermocouple 1 mm beside it", KEY),
    ("docs/heat.md", "the errors of 2 mm partly cancel", KEY),
    ("docs/heat.md", "Peaks of the plain plate at 1 mm come", KEY),
    ("docs/heat.md", "cooling rate after 65 s", KEY),
    ("docs/heat.md", "a balance of heat to 1e-9", ASKED),
    ("docs/heat.md", "implicit and explicit probes to 0.2 K", ASKED),
    ("docs/heat.md", "against steps of 1.25 ms", KEY),
    ("docs/heat.md", "The whole record of 100 s of the plain plate at 1 mm", KEY),
    ("docs/heat.md", "With the `TOLERANCE` of 1 K", KEY),
    ("docs/heat.md", "s at 0.5 mm. Results on several", KEY),
    ("docs/heat.md", "the first 2 s of the source", KEY),
    ("docs/heat.md", "with a tolerance of 0.2 K:", KEY),
    ("docs/heat.md", "In the first 2 s, where", KEY),
    ("docs/heat.md", "over 6 s implicit steps", KEY),
    ("docs/heat.md", "with outputs every 0.2 s", KEY),
    ("docs/heat.md", "implicit steps (2 s, tolerance 2;", KEY),
    ("docs/heat.md", "(eqs. 4.10, 4.18, 4.19) and by exponentials (eq. 6.16)", QUOTED),
    ("docs/heat.md", "From the computed record of cavity 1 with 700 W/(m2 K)", KEY),
    ("docs/heat.md", "draws figures 4.6, 4.8 and, with a second run, 4.9 of the thesis", QUOTED),
    ("docs/heat.md", "Cavity 1 at 1 mm", KEY),
    ("docs/method.md", "a punch of five cells would be 9 % too stiff", ABLATION),
    ("docs/method.md", "within 3 % at 5, 8 and 12 cells", ABLATION),
    ("docs/method.md", "a tilted disc by 17, 11 and 10 %", ABLATION),
    ("docs/method.md", "is 0.23, 0.36 and 0.39 particles off", ABLATION),
    ("docs/method.md", "the limits are 2 % and 0.1 particles", ASKED),
    ("docs/accuracy.md", "angular momentum of 24 pairs", ABLATION),
    ("docs/accuracy.md", "1.64 % at 8 cells a radius and 0.33 % at 16, without friction 0.20 and 0.08 %;", ABLATION),
    ("docs/accuracy.md", "limit is 0.2 % (`verify.py", ASKED),
    ("docs/accuracy.md", "slopes are 1.9 % in the mean and 4.2 % at", STUDY),
    ("docs/accuracy.md", "(4) | 0.8 % | 1.0 % | 7.2 % | 1.0 % | 4.8 % |", STUDY),
    ("docs/accuracy.md", "(4) | 1.3 % | 0.9 % | 13.7 % |", STUDY),
    ("docs/accuracy.md", "(4) | 2.3 % | 3.2 % | 3.6 % | 3.4 % | 3.5 % |", STUDY),
    ("docs/accuracy.md", "(10) | 1.9 % | 0.9 % | 0.3 % |", STUDY),
    ("docs/accuracy.md", "cubes with 3.9 %) | 2.7 % | 2.2 % | 1.2 % | 1.6 % | 0.23 % |", STUDY),
    ("docs/accuracy.md", "block within 0.22 %, energy after the rebound of discs 98.2 to 99.1 % (`tests/system/test_graded_contact.py`). "
     "Spheres on a straight lattice lose 14 % of", STUDY),
    ("docs/accuracy.md", "torque by 0.02 %, and temperatures at the thermocouples by 0.1 K. A sharp pulse at the true mass loses 28 % of "
     "its energy at sleepers in cells of 1 mm. -", STUDY),
    ("docs/accuracy.md", "starts at 298 K, the coldest particle has 296.2 K in cells of 4 x 4 x 2 mm and 291.1 K in cells of 4 x 4 x 1 "
     "mm. -", STUDY),
    ("docs/accuracy.md", "particle takes 10 % longer", STUDY),
    ("docs/accuracy.md", "speeds of 0.02 to 0.5 m/s and times of 0.1 to 2 s, compared with finite differences on a mesh of 10 um "
     "(`verify.py", KEY),
    ("docs/accuracy.md", "| temperature 1 mm deep | work | |---|---|---|---| | 2 mm | -0.3 to +2.4 % | -12 to +2 K | -0.8 to +1.9 % | | 1 "
     "mm | -2.5 to +0.9 % | -5 to +17 K | -1.3 to +0.3 % | | 0.25 mm at the face, graded to 1 mm | -1.5 to +0.2 % | 0 to +11 K "
     "| -0.8 to +0.2 % |", STUDY),
    ("docs/accuracy.md", "- Strain 0.5, 1 and 2 mm deep is within 35 % where the layer is thicker than a cell, or the flow stress depends on "
     "the rate as strongly as that of hot copper. Where the velocity decays by a factor e in 0.25 mm, strain below 0.5 mm"
     " is up to 4.5 times too large in cells of 1 and 2 mm; it is within 16 % in cells of 0.5 mm (`verify.py "
     "stirred_layer --fine`) and within 17 % in", STUDY),
    ("docs/accuracy.md", "metal of 600 K that still heats by 3 K a", STUDY),
    ("docs/accuracy.md", "growth of 1.1, 1.2 and 1.4 from cells of 0.5 mm to 2 mm the temperature is 2, 6 and 11 K off", STUDY),
    ("docs/accuracy.md", "is within 0.3 % of 2/3 pi k R^3 and at most 0.7 % of the work is lost, for mass scalings from 1 to 1e4 and "
     "pressures from 0.004 to 0.055 of the", STUDY),
    ("docs/accuracy.md", "**Tilted by 3 degrees** (`verify.py tool_torque_tilted`): the torque is within 1.5 % under a pressure of 0.03 of "
     "the yield stress and more, and 6 % too small under lower pressure at low speed. Light nodes lose up to 3.4 % of the"
     " work with SELECTIVE_SCALING, 0.12 % without.", STUDY),
    ("docs/accuracy.md", "**PIC_FRACTION** of 0.02 adds 3.2 % to the torque and loses 3.2 % of", STUDY),
    ("docs/accuracy.md", "force within 0.2 % with every scheme in cubes and flat", STUDY),
    ("docs/accuracy.md", "(`verify.py punch_elastic`): 2 to 8 % too stiff, as if an eighth of a cell wider; 7 to 8 % too", STUDY),
    ("docs/accuracy.md", "order: from 2 to 1 mm the force falls by 5.3 % and the torque by 6.4 %, from 1 to 0.5 mm by 2.4 and 2.7 %; the "
     "remaining error of the force at 1 mm is about 4 %.", STUDY),
    ("docs/microstructure.md", "The energy of 104 kJ/mol is that of diffusion", KEY),
    ("docs/microstructure.md", "copper has 0.85 eV an atom, 82 kJ/mol (Yin", QUOTED),
    ("docs/microstructure.md", "The rates at 700 K are", KEY),
    ("docs/heat.md", "thesis eq. 2.11); `--check`", QUOTED),
    ("docs/heat.md", "has 167 W/(m K), 2700 kg/m3 and 896 J/(kg K)", QUOTED),
    ("docs/heat.md", "hot work steel 24.4 W/(m K), 7800 kg/m3 and 460 J/(kg K)", QUOTED),
    ("docs/heat.md", "the metal gets 68 %", FORMULA),
    ("docs/heat.md", "the enthalpy over 0 K", KEY),
    ("docs/heat.md", "a wall and a film is within 1 % from two cells off the film on", ASKED),
    ("docs/heat.md", "heat is within 1 % once it has penetrated nine cells", ASKED),
    ("docs/heat.md", "(p/1 MPa)^PRESSURE_EXPONENT", KEY),
    ("docs/heat.md", "h = 1.25 k m/s (p/H)^0.95", QUOTED),
    ("docs/heat.md", "With k = 50 W/(m K), m = 0.1, s = 5 um and H = 1 GPa that is 1800 W/(m2 K) at 1 MPa", FORMULA),
    ("docs/heat.md", "At 700 K and an emissivity of 0.8 4 eps sigma T^3 is 62 W/(m2 K)", FORMULA),
    ("docs/heat.md", "come out within 1 %", ASKED),
    ("docs/tutorial.md", "plunge at 1 mm/s until the force is 60 kN", KEY),
    ("docs/tutorial.md", "travel under 36 kN", KEY),
    ("docs/tutorial.md", "With cells of 2 mm the pin", KEY),
    ("docs/tutorial.md", "with the solidus, 855 K here", KEY),
    ("docs/heat.md", "0, 500, 10e6, 3000, 100e6, 12000", KEY),
    ("docs/heat.md", "half spaces is within 1 % once it", ASKED),
    ("docs/heat.md", "24 cells, heat through two bars of 16 cells between walls within 1 %; the particle next to the gap is up to 3 % of "
     "the", ASKED),
    ("docs/heat.md", "Exact problems, within 1 %", ASKED),
    ("docs/method.md", "or 3.5 cells of a tool", KEY),
    ("docs/choosing.md", "A plate of 100 x 150 x 6 mm stirred by a flat tool (`benchmarks/band.nml`): cells of 0.5 mm everywhere, and in a band of 30 mm in its", KEY),
    ("docs/choosing.md", "upper 2 mm, from which they grow by at most 1.3 to 4 mm", KEY),
    ("docs/choosing.md", "8 % of these steps (0.035 of an awake one", "of the numbers of particles in the table: 0.035 (1440 - 416)/(416 + 0.035 (1440 - 416))"),
    ("docs/accuracy.md", "From cubes cells may grow by 0.3, along one", KEY),
    ("docs/accuracy.md", "With growths up to 1.5 1 of 150 does", STUDY),
    ("docs/method.md", "cubes that grow by at most 0.3", KEY),
    ("docs/validation.md", "is 100 mm long, 40 mm wide and 12 mm thick, with a cavity of 1290 mm3", KEY),
    ("docs/validation.md", "has a radius of 10 mm and a tilt of 3 degrees; its trailing edge is 1.1 mm deep; it turns at 970 rpm and travels at 1.8 mm/s", KEY),
    ("docs/validation.md", "held), 0.836 of the heat", QUOTED),
    ("docs/validation.md", "with particles 2 mm apart and mass scaling 1e6", KEY),
    ("docs/validation.md", "the stir zone at 65 mm (3 to 4 mm in the experiment), and the axial force at 12.5 s", KEY),
    ("docs/validation.md", "films many times the 700 W/(m2 K)", QUOTED),
    ("docs/validation.md", "with m = 0.65 and a film of 45000 W/(m2 K)", KEY),
    ("docs/validation.md", "has m = 1 and 40000, the two-phase law m = 0.65 and 10000", KEY),
    ("docs/validation.md", "peaks within 6 % of the thermocouples", PASSES),
    ("docs/validation.md", "none at 2 mm", PASSES),
    ("docs/validation.md", "With particles 1 mm apart the peaks are within 5 % of the record", PASSES),
    ("docs/validation.md", "of that with particles 2 mm apart, and", KEY),
    ("docs/validation.md", "20 h + 0.0523 pi 10^2/2 mm2, with h = 0.575 mm the depth of the middle of the face: 19.7 mm2, or 394 mm3 over the 20 mm of the cavity, 31 % of", "geometry, in the text itself"),
    ("docs/validation.md", "In the pass with particles 1 mm apart most", KEY),
    ("docs/validation.md", "is 60 to 64 % with hot copper", PASSES),
    ("docs/validation.md", "for 68, 59 and 69 % in the experiment", QUOTED),
    ("docs/validation.md", "probably the covered area. Numerical experiments with one change each, particles 2 mm apart:", KEY),
    ("docs/validation.md", "With 0.6 mm more", KEY),
    ("docs/validation.md", "A tool on a slide of 20 or 50 kN/mm", KEY),
    ("docs/validation.md", "Hot copper, particles 2 mm apart", KEY),
    ("docs/validation.md", "The thesis has a film of 200 W/(m2 K)", KEY),
    ("docs/validation.md", "The 2.5 um of the experiment", QUOTED),
    ("docs/validation.md", "from 1.83 um at 555 K to 7.53 um at 883 K", PASSES),
    ("docs/validation.md", "near 630 K", "log-linear between the two columns"),
    ("docs/validation.md", "## Particles 0.5 mm apart", KEY),
    ("docs/validation.md", "mass scaling 1e6, up to the peak of T1 and 17 s (374,000 particles), compared with particles 1 and 2 mm apart", KEY),
    ("docs/validation.md", "axial force at 10 to 13 s, kN | torque, N m | |---|---|---|---| | 2 mm | 697 | 106 | 134 | | 1 mm | 786 | 9.3 | 164"
     " | | 0.5 mm | 826 | 11.7 | 164 | At 1 mm", STUDY),
    ("docs/validation.md", "between 1 and 0.5 mm the torque stays", KEY),
    ("docs/validation.md", "the peak rises by 5 %, half", STUDY),
    ("docs/validation.md", "12 s of this pass", STUDY),
    ("docs/validation.md", "to 20 %, to 0.5 mm by 5 %", STUDY),
    ("docs/validation.md", "to a fifth between particles 2 and 1 mm apart, converged from 1 mm", PASSES),
    ("docs/validation.md", "from particles 1 mm apart; it falls", STUDY),
    ("docs/validation.md", "1 and 2 mm apart. A zone that is not strained above 1", KEY),
    ("docs/validation.md", "The thesis has 323 to 331 nm in the stir zone, 350 at the surface and 600 at the edge", QUOTED),
    ("docs/validation.md", "With the film of hot copper (45000 W/(m2 K)) and particles 1 mm apart", KEY),
    ("docs/validation.md", "is within 5 % of it, the stir zone has 476 nm", PASSES),
    ("docs/validation.md", "3 under the tool instead of 30, since metal of this law moves at 0.05 %", PASSES),
    ("docs/validation.md", "123 K at T1 change the stir zone's", PASSES),
    ("docs/validation.md", "grains by 11 %", PASSES),
    ("docs/validation.md", "The pass with particles 1 mm apart:", KEY),
    ("docs/validation.md", "The floor of the valley has a constant factor of 1e5", KEY),
    ("docs/validation.md", "rows of the history with more than 5 %", ASKED),
    ("docs/validation.md", "T3 rises by 8 %", PASSES),
    ("docs/validation.md", "a constant mass scaling of 1e5 for particles 1 mm apart (`--particles 1 --mass-scaling 1e5`) and 1e6 for those 2 mm apart", KEY),
    ("docs/validation.md", "and peaks are higher by 13 to 20 %", PASSES),
    ("docs/validation.md", "table. The stir zone of Johnson-Cook's law is that of hot copper with particles 2 mm apart;", KEY),
    ("docs/validation.md", "the force falls from 106 to 6 kN", PASSES),
    ("docs/validation.md", "which starts 3 or 1.5 mm deeper", KEY),
    ("docs/validation.md", "`MASS_SCALING_RANGE = 1e3, 1e5` with `INERTIAL_FRACTION = 0.03`, which `input/fsp_copper_hot_1mm.nml` has", PASSES),
    ("docs/validation.md", "A factor of 1e6 makes", KEY),
    ("docs/validation.md", "between particles 2 and 1 mm apart peaks rise by 13 to 20 %", PASSES),
    ("docs/welds.md", 'Travel: two radii of the shoulder, and 1.2 s at least, since a fast tool must leave the heat of the dwell: at 1200 rpm and 2000 mm/min torque', WELDS),
    ("docs/welds.md", 'pin: these welds are open, by 2.8 and 6.7 mm2, and bear 15 and 20 kN. A better film under the tool takes 11 K off.', WELDS),
    ("docs/welds.md", 'is the hottest place. Friction decides, with a smooth pin: with a coefficient of 0.2 the face is at 855 K, with 0.1 at 706 K, but metal that slides is not carried around the', WELDS),
    ("docs/welds.md", 'and 1500 and 2000 mm/min a tunnel of 0.9 and 1.0 mm2 remains. At reduced depth all but 600 rpm, 300 mm/min are open, by 1.8 to 3.2 mm2.', WELDS),
    ("docs/welds.md", 'The thread decides: with a smooth pin (`--variant smooth`) 11 of 13 settings at nominal depth are open, by 1.4 to 2.7 mm2, and 15 of 26 settings are as meant. The axial', WELDS),
    ("docs/welds.md", 'force is larger by up to 61 %, the face 5 to 46 K hotter. The thread of these tools is not published, nor which settings of the measured welds had a void.', WELDS),
    ("docs/welds.md", 'Its size is a matter of cells: with a smooth pin 3.0 mm2 at 1200 rpm, 600 mm/min and reduced depth in cells of 1.2 mm, 1.2 mm2 in cells of 1 mm', WELDS),
    ("docs/welds.md", 'Void with speed: faster travel opens the weld at nominal depth, and at reduced depth the void grows from 1.8 to 3.1 mm2 between 600 and 2000 mm/min at 1200 rpm: the', WELDS),
    ("docs/welds.md", '600 mm/min, 11.4 to 12.8 kN at 2000 mm/min in welds with voids (sheet not told): computed are 9.4 kN with the sound weld and 11.7 kN with the void.', WELDS),
    ("docs/welds.md", 'The largest force of the plunge is 7 to 17 kN, measured 7 to 9 kN.', WELDS),
    ("docs/welds.md", 'The hot law of the metal is the other unknown: with a smooth pin and the law of AA6082 the force is 4 kN, with that of AA5083 17 kN, 14 kN with that of the rule.', WELDS),
    ("docs/welds.md", 'Mass scaling, smooth pins: at 1200 rpm and 600 mm/min a third of it changes the axial force by -3 and -6 %, and torque by 1 %. The void at reduced depth stays; at nominal depth the weld, closed', WELDS),
    ("docs/welds.md", 'Sheets of 1.5 mm, 1200 rpm, 600 mm/min: AA5754 and AA7075 are closed at nominal depth and open at reduced depth, by 1.8 and 1.0 mm2, 0.5 mm below the top and 0.7 to', WELDS),
    ("docs/welds.md", '1.1 mm off the middle on the advancing side. CT found slits 0.5 to 1.05 mm below the top, 2.4 mm off the middle.', WELDS),
    ("docs/welds.md", 'With a smooth pin both alloys are closed at 600 rpm, 300 mm/min and reduced depth as well, and AA7075 at nominal depth has a fold under the rim of the', WELDS),
    ("docs/welds.md", 'At 2000 mm/min AA5754 has 0.4 mm2 at nominal and 2.3 mm2 at reduced depth; AA7075 is closed at nominal depth and has 1.5 mm2 at reduced depth.', WELDS),
    ("docs/welds.md", 'shoulder: 9 of 12 settings as meant. With a thread, 600 rpm and 300 mm/min are not among the rows: the inertial stress of the mass scaling of the rule', WELDS),
    ("docs/welds.md", 'is as large as the flow stress there (99 % in AA7075 at nominal depth, with a void of 0.1 mm2).', WELDS),
    ("docs/welds.md", 'is steady after 0.7 s; over two radii (0.4 s) the axial force is 13 % lower, and six welds of Rabe with a smooth pin seemed closed at nominal depth that are not.', WELDS),
    ("docs/welds.md", 'AA2024: torque and power are 11 % low, the axial force is 10 % too large, and the face is within 4 %. With a smooth pin torque is 9 % low and the', WELDS),
    ("docs/welds.md", 'force 1 % too large at the depth of the rule; under the reported force (`aa2024-pressed`, computed with a smooth pin only) torque is 12 % low.', WELDS),
    ("docs/welds.md", 'The void is a tunnel of the advancing side: 1.0 to 1.7 mm below the top and 1.0 to 2.5 mm off the middle, with a smooth pin 1.8 to 2.5 mm below the top. CT found', WELDS),
    ("docs/welds.md", 'Axial force: 8 to 16 kN at nominal, 6 to 12 kN at reduced depth; it rises by 56 to 75 % from 600 to 2000 mm/min. Measured were 7 to 9 kN in sound welds at', WELDS),
    ("docs/welds.md", 'A depth of 0.15 mm is worth 1 to 4 kN, and the depths of the measured welds are not known.', WELDS),
    ("docs/welds.md", 'otherwise, then has one of 1.2 mm2, twice what is resolved: settings near the border can go either way. The inertial stress is 31 % of the flow stress', WELDS),
    ("docs/welds.md", 'at 3000 rpm and 29 to 46 % in the thin sheets: these rows are uncertain.', WELDS),
    ("docs/welds.md", 'Sections of closed welds show a loose place where each flank of the pin has passed, of a fill of 0.6 to 0.7 and smaller than what is resolved.', WELDS),
    ("docs/welds.md", "AA6061 at 300 to 1000 rpm under 14 kN and AA2524 at 150 to 800 rpm are closed", WELDS),
    ("docs/welds.md", "they lacked 11 to 17 mm2 in a section", WELDS),
    ("docs/welds.md", "of the tool and thickness of the sheets), a robot's settings from groove to flash (tool, alloy and depth), a steel sheet of 1.6 mm (pin and force).", WELDS),
    ("docs/welds.md", 'AA6061 needs the force of the machine: at 650 rpm, held 0.33 mm below the surface, where the whole face touches the sheet, it bears 7 kN in travel and', WELDS),
    ("docs/welds.md", 'leaves a tunnel of 8 mm2; under 14 kN none. But under 14 kN the tool sinks by', WELDS),
    ("docs/welds.md", "0.4 mm along 19 mm of travel", WELDS),
    ("docs/welds.md", "with AA6061 (14 kN, remembered)", KEY),
    ("docs/welds.md", "the probe is 22 K too hot at 400 rpm; it rises by 16 K from 300 to 650 rpm and by 10 K to 1000 rpm. A rise by 40 K from 300 to 650 and by 20 K to "
     "1000 rpm is reported", WELDS),
    ("docs/welds.md", "to the power of -0.88; -0.65 is reported. The face is near the solidus from 300 rpm on", WELDS),
    ("docs/welds.md", "the mass scaling is 4e5", KEY),
    ("docs/welds.md", "welded sheets of 3 mm AA5754-H22", QUOTED),
    ("docs/welds.md", "computed tomography (limit 0.08 mm)", QUOTED),
    ("docs/welds.md", "concave shoulder of 14 mm (7 degrees), a pin of 5 mm with a cone of 10 degrees, 2.85 mm long, and is tilted by 1.5 degrees", QUOTED),
    ("docs/welds.md", "is 2.64 to 2.92 mm in sound welds and 2.86 to 2.98 mm in defective ones. *Nominal* leaves 2.78 mm, *reduced* 2.93 mm", QUOTED),
    ("docs/welds.md", 'The metal is `AA5754-H22-weld` with the hot law of AA5052, the nearest alloy, from memory: chosen by its magnesium, 2.5 for 3 %, not fitted.', WELDS),
    ("docs/welds.md", 'No law of an aluminium-magnesium alloy could be read. AA6082, whose law was read, has half of its strength at 723 K, AA5083 1.8 times as much:', WELDS),
    ("docs/welds.md", 'voids 2.3 mm below the top, 0.9 to 1.4 mm off the middle.', WELDS),
    ("docs/welds.md", '([changes](#numerical-error)). CT found less than 0.03 mm2, which no cells of an affordable size resolve.', WELDS),
    ("docs/welds.md", "torque is 89 % too large at 300 rpm and 78 % at 500 rpm", WELDS),
    ("docs/welds.md", "4 % above the reported one, and power 4 % above", WELDS),
    ("docs/welds.md", "is a coefficient of 0.24. But the face rises to 0.8 mm above the sheet", WELDS),
    ("docs/welds.md", "is 8 % too hot: this force", WELDS),
    ("docs/welds.md", "rises to 0.4 mm, and torque is 18 % above", WELDS),
    ("docs/welds.md", "a hot strength that is 30 % less", KEY),
    ("docs/welds.md", "2/5 of the thickness up to 4 mm", KEY),
    ("docs/welds.md", "the centre of the shoulder is 0.2 mm below the surface", KEY),
    ("docs/welds.md", "The bands are 15 and 30 %, 5 % for temperatures", KEY),
    ("docs/welds.md", "welds succeeded from 733 to 803 K", QUOTED),
    ("docs/welds.md", "gives 1000 to 10000 W/(m2 K) at 1 MPa. At a pressure of 80 MPa a film of 1800 at 1 MPa resists as much as 0.4 mm of steel", FORMULA),
    ("docs/welds.md", "A poor film (50)", WELDS),
    ("docs/welds.md", "a film of 50 W/(m2 K) at 1 MPa, no walls on the sides and a mass scaling of 1e7", KEY),
    ("docs/welds.md", "friction 0.3, at 4.5 s of 6.9", KEY),
    ("docs/choosing.md", "hot aluminium hardly changes between 0.4 and", WELDS),
    ("docs/choosing.md", "from 50 to 2000 W/(m2 K) at 1 MPa the torque rises by a quarter", WELDS),
    ("docs/choosing.md", '| AA6061, 6.4 mm, 650 rpm, 2 mm/s | depth 0.33 mm: the whole face touches | 1.6 | 7.9 (1.1) | 51 | 7 |', WELDS),
    ("docs/choosing.md", '| | force 14 kN | 1.6 | 0.0 (1.1) | 53 | 14 |', WELDS),
    ("docs/choosing.md", '| AA5754, 3 mm, 1200 rpm, 10 mm/s | 2.93 mm left under the trailing edge | 1.2 | 3.0 (0.6) | 18 | 10 |', WELDS),
    ("docs/choosing.md", '| | the same, a third of the mass scaling | 1.2 | 3.0 (0.6) | 18 | 9 |', WELDS),
    ("docs/choosing.md", '| | the same | 1.0 | 1.2 (0.4) | 17 | 8 |', WELDS),
    ("docs/choosing.md", '| | 2.78 mm left | 1.2 | 0.0 (0.6) | 18 | 14 |', WELDS),
    ("docs/choosing.md", '| | the same, a third of the mass scaling | 1.2 | 1.2 (0.6) | 18 | 13 |', WELDS),
    ("docs/choosing.md", '| | the same | 1.0 | 0.0 (0.4) | 18 | 12 |', WELDS),
    ("docs/choosing.md", '| | the same, hot law of AA6082 | 1.2 | 0.0 (0.6) | 21 | 4 |', WELDS),
    ("docs/choosing.md", '| | the same, hot law of AA5083 | 1.2 | 1.4 (0.6) | 17 | 17 |', WELDS),
    ("docs/choosing.md", 'First give the depth or the force of the machine, to a tenth of a millimetre or a kilonewton: 0.15 mm is worth a void of 3 mm2.', WELDS),
    ("docs/choosing.md", 'The force that closes AA6061 presses the tip onto the anvil within 19 mm, which the column `tool_z[m]` shows: look at it where a tool is held by its force.', WELDS),
    ("docs/method.md", "half after (3.69-3.81)", QUOTED),
    ("docs/method.md", "At 0.5 m/s and in cells of\n2 mm, 0.24 of the metal that moves", STUDY),
    ("docs/method.md", "in cells of 1 mm 0.91 (`verify.py stirred_layer`", STUDY),
    ("docs/method.md", "(flow stress above 1e-4 of the shear modulus)", KEY),
    ("docs/speed.md", "which shears at 6e4/s", KEY),
    ("docs/method.md", "whose bulk modulus is above 6 times its shear modulus", KEY),
    ("docs/method.md", "proportional to p up to 1.3 to 1.5 flow stresses", FORMULA),
    ("docs/method.md", "shears in a layer of 0.3 to 1 mm", FORMULA),
    ("docs/method.md", "compares columns of cells of 2, 1 and 0.5 mm with finite differences on a mesh of 10 um", KEY),
    ("docs/method.md", "no faster than 0.003 of the wave speed", KEY),
    ("docs/method.md", '[accuracy.md](accuracy.md) compares them. A free elastic disc of six cells over the radius keeps its spin with APIC (0.05 % in five', STUDY),
    ("docs/method.md", 'turns), while FLIP loses 30 % and the schemes MUSL and USAVG lose 50 %: use APIC where bodies turn freely. Velocities of FLIP particles contain modes that vanish at all nodes (null modes). Where', STUDY),
    ("docs/accuracy.md", "Round ones are within 4 % there", ABLATION),
    ("docs/method.md", 'the force of a slow punch is within 0.2 % of that without', STUDY),
    ("docs/method.md", 'it is 1.6 % larger at a mass scaling of 100', STUDY),
    ("docs/method.md", 'in `tests/stress/inputs/free_block.nml` (now 0.2 %)', STUDY),
    ("docs/method.md", '$\\omega^2 = 3 K Q / ( \\rho h^2 )$, where $Q$ is the sum of slope^2/weight on an axis (6 for B-splines, $2/l + 1/(1 - l)$ for uGIMP),', KEY),
    ("docs/method.md", '$1 - \\omega^2 dt^2$ and is stable to $\\omega \\, dt < \\sqrt 2$ instead of 2. With', KEY),
    ("docs/method.md", 'The step is 0.9 of this while a particle is of a fragment: the metal around it, without images behind walls, fills less than a sixth of its room. It is looked for in the', KEY),
    ("docs/method.md", 'first step and, where metal flows, in every twentieth. APIC, MUSL, USAVG and selective scaling do not need it.', KEY),
    ("docs/method.md", 'not reached the punch has 27, 17 and 16 %, the others below 1 %:', STUDY),
    ("docs/method.md", 'keep this bound, which is at most five times the error (`tests/system/test_mass_scaling.py`). The first three scenes keep that of the inertial part alone; on metal', STUDY),
    ("docs/method.md", '$60 h \\chi^{1/2} / c$, so that metal is pressed before the tool reaches it, by the smaller of this time and h/50 over the speed at', KEY),
    ("docs/method.md", '\\frac{c \\, dt}{h} < \\sqrt{ \\frac{2}{Q} \\cdot \\frac{1 - \\nu}{1 + \\nu} }', KEY),
    ("docs/method.md", '| punch, rising force (`tests/system/inputs/rising.nml`) | 10, 100, 400 | 6.8, 35, 50 % | 28, 90, 134 % | 0.2, 1.3, 6 % |', STUDY),
    ("docs/method.md", '| upsetting (`squeezed.nml`) | 10, 100 | 13, 63 % | 21, 135 % | 0.8, 8.5 % |', STUDY),
    ("docs/method.md", '| elastic rod, impact (`rod.nml`) | 100, 1000 | 2.4, 11 % | 3.7, 13.7 % | 0 |', STUDY),
    ("docs/method.md", '| sticking disc, pressed in 2 ms, then steady | 1e5, 1e6, 1e7 | 43, 78, 91 % | 58, 89, 88 % | 0.8, 6, 9 % |', STUDY),
    ("docs/method.md", '| disc that is pressed in and travels (`stir.nml`) | 1e5, 1e6, 1e7 | 33, 37, 37 % | 1, 11, 30 %; on metal not reached 33, 45, 37 % | 0.001, 0.02, 0.1 % |', STUDY),
    ("docs/method.md", '$\\boldsymbol\\tau : \\mathbf d_p$ at finite elastic strain (with $G a$ instead it is wrong by 0.9 times the elastic strain, by sign of', STUDY),
    ("docs/method.md", 'the face on the side where the flow divides. The metal arrives behind the pin packed by 10 %.', STUDY),
    ("docs/method.md", 'does not fill the room: a slot opens there by half of the fill per second, at a pressure of 20 to 40 MPa beside it. Where the metal at', STUDY),
    ("docs/method.md", '- The friction of a packed layer is too large, since each particle at the face carries its own area: the torque in travel is 12 to 17 % above', STUDY),
    ("docs/method.md", 'Therefore every 20 steps stirred metal (plastic strain above 3) moves down the gradient of the fill, with a diffusivity of 0.2 h^2 per correction and', STUDY),
    ("docs/method.md", 'at most by 0.04 cells. The fill of a node is the volume of the particles, m J/rho, with its weights, that of their mirror images and', STUDY),
    ("docs/method.md", 'next to an open node, less than half full, count only with an excess above 0.1, which disorder of particles explains. A void larger than a cell stays a void.', STUDY),
    ("docs/method.md", '| closed box, 1 mm cells | without | with |', STUDY),
    ("docs/method.md", '| largest hole after 3.2, 5.2, 7.6 mm [mm2] | 1.9, 3.1, 3.8 | 0.2, 0.4, 0.4 |', STUDY),
    ("docs/method.md", '| fill of nodes | 0.35 to 1.30 | 0.96 to 1.04 |', STUDY),
    ("docs/method.md", '| torque over $2 \\pi r^2 k L$, from 0.5 to 7.6 mm | 1.06 to 1.18 | 1.02 to 1.05 |', STUDY),
    ("docs/method.md", "Every 20 steps each particle of metal stores", KEY),
    ("docs/method.md", '$f_v$, by which the fill at its place is less than 0.9; in every step', KEY),
    ("docs/method.md", '(Taylor\'s bar: length off by 1.7 instead of 2.8 % with 9 cells)', STUDY),
    ("docs/method.md", '$\\dot\\epsilon$ and the flow stress $\\sigma_f$ (A.L. Gurson, J. Eng. Mater. Technol. 99 (1977) 2, at small $f_p$),', FORMULA),
    ("docs/method.md", 'The bound above is the limit of the same law without shear. $f_p$ is the part of the room of a particle that neither metal nor tool fills, found every 20', STUDY),
    ("docs/method.md", "steps for metal with a plastic strain above 1", KEY),
    ("docs/method.md", 'with the limits 0, 1 and 3 the torque of the closed box is 1.009, 1.012 and 1.03 to 1.06 times the exact', ABLATION),
    ("docs/method.md", 'one, and the part of a shallow groove that stays under the tool which draws it (verification problem `groove`) 0.182, 0.180 and 0.174; welds', ABLATION),
    ("docs/method.md", 'Without the law metal behind a pin stays loose by 5 to 15 % over the whole stir zone, under a pressure of 20 to 40 MPa.', STUDY),
    ("docs/method.md", '| weld of 6.4 mm AA6061, 650 rpm, pressed by 14 kN, cells of 1.6 mm | without | with |', STUDY),
    ("docs/method.md", '| largest void [mm2] | 9.2 | 0.0 |', STUDY),
    ("docs/method.md", '| missing in the track, beyond disorder [mm3] | 75 | 1 |', STUDY),
    ("docs/method.md", '| mean fill below the surface within 5 mm of the middle | 0.88 | 0.97 |', STUDY),
    ("docs/method.md", '| hole of 28 mm2 pressed shut in a box, 1 mm cells (`tests/verification/test_room.py`) | without | with | exact |', STUDY),
    ("docs/method.md", '| pressure when 5.5, 3.1, 0.7 mm2 are left, less compression [MPa] | 80, 151, 260 | 78, 94, 130 | 85, 98, 124 (cylinder) |', STUDY),
    ("docs/method.md", '| pressure when 4.1 mm2 too much are pressed in [MPa] | 538 | 380 | 340 to 361 |', STUDY),
    ("docs/verification.md", '| friction of a sticking tool that leaks: one iteration a step stops only an even slip | torque of a bar in torsion, .5 % in 200 us | `test_friction_of_tools.py::test_torque_of_a_sticking_tool_remains` |', ASKED),
    ("docs/verification.md", '| booked work that is not the dissipated work | 60 draws of laws and loads to 1e-4; a press to 2e-3 | `test_plastic`, `test_elastic_scaling.py::test_work_of_the_press` |', ASKED),
    ("docs/verification.md", '| state that depends on the moment of a sort, a gather or a restart | drawn stops: bitwise, on other ranks to 1e-9 | `test_drawn_stops.py` |', ASKED),
    ("docs/verification.md", 'without `SELECTIVE_SCALING`, metal 18 to 31 K above its solidus (0 K now)', STUDY),
    ("docs/verification.md", '| a wall that changes nodes whose partner on the wall another rank has | state on 3 ranks and on 1 to 1e-9 | `test_drawn_stops.py::test_contact_history_on_other_ranks` |', ASKED),
    ("docs/verification.md", '| sums of norms over the ranks | all columns of the history to 1e-7 | `test_drawn_stops.py` |', ASKED),
    ("docs/verification.md", '| set-up time that grows with the square of the input, signals unheard meanwhile | 5 s for 100,000 points, status 75 | `test_large_inputs.py` |', ASKED),
    ("docs/verification.md", '| null modes that a filter of high order amplifies | energy at most 1.02 of the first swing, orders 2 to 10 | `test_scheme.py::test_fmpm_with_one_particle_along_an_axis` |', ASKED),
    ("docs/method.md", "at least 56 % of the shear stiffness, of two cells with two layers each 88 %", FORMULA),
    ("docs/choosing.md", "n^2/(n^2 - 1) times that of a beam, 1.13 with three, 1.03 with six", FORMULA),
    ("docs/method.md", r"$60 h \chi^{1/2} / c$", FORMULA),
    ("docs/method.md", "gains 12 % of its energy, with `usl` as well", STUDY),
    ("docs/accuracy.md", "The force of a plane punch is within 2.5 % of the limit load", STUDY),
    ("docs/accuracy.md", "by 20 % with 2, 11 % with", STUDY),
    ("docs/accuracy.md", "2.25, 3 % with 2.5 cells", STUDY),
    ("docs/accuracy.md", "too large by 0.33 (uGIMP) to 0.46 (B-splines) over n^2", STUDY),
    ("docs/accuracy.md", "2.0 to 2.7 % at four cells", STUDY),
    ("docs/accuracy.md", "straight lattice adds 2 % at four cells. Take six cells for 1 %", STUDY),
    ("docs/accuracy.md", "4 to 8 % too stiff with six cells between face and wall, 2 to 4 % with twelve", STUDY),
    ("docs/accuracy.md", "the force falls by 0.7 % and the torque by 2.6 % in", STUDY),
    ("docs/accuracy.md", "340 wave transits; with `CFL = 0.2` by 0.3 and 2.0 %, without friction by 0.3 %", STUDY),
    ("docs/accuracy.md", "keeps force and torque to 1e-4 and 0.2 %", STUDY),
    ("docs/accuracy.md", "ended 0.25 (XPIC of order 2) to 0.5 cells (FMPM of order 4)", STUDY),
    ("docs/accuracy.md", "FLIP and APIC are within 0.3 %", STUDY),
    ("docs/accuracy.md", "6:3:2, pressed by 30 %, shear factor m = 0.3", STUDY),
    ("docs/accuracy.md", "changes by +0.5, -1.7 and -3.3 % with 4, 8 and 16 cells", STUDY),
    ("docs/accuracy.md", "about -5 %; four cells act as if m were 0.23, eight as if it were 0.26", STUDY),
    ("docs/method.md", "with z = 0.3 kappa dt/spacing^2", KEY),
    ("docs/method.md", "an elastic rod of eight cells would be 3 % too stiff", ABLATION),
    ("docs/method.md", "stretched elastically to 0.9 of the distance", KEY),
    ("docs/method.md", "3 times the spacing for uGIMP", KEY),
    ("docs/method.md", "(to 1e-6 of a cell)", KEY),
    ("docs/method.md", "lose at most 2 % of their energy without friction", ASKED),
    ("docs/method.md", "is within 3 % at any offset", ASKED),
    ("docs/method.md", "every 200 steps", KEY),
    ("docs/method.md", "0.035 for a sleeping particle.", KEY),
    ("docs/method.md", "differ in volume by more than 2 %", KEY),
    ("docs/microstructure.md", "eqs. 6.1-6.15", QUOTED),
    ("docs/microstructure.md", "The third term of 6.5", QUOTED),
    ("docs/microstructure.md", "eqs. 6.14 and 6.15, which jump", QUOTED),
    ("docs/microstructure.md", "substeps of 0.005 of plastic strain", KEY),
    ("docs/microstructure.md", "(by more than 0.5 K)", KEY),
    ("docs/microstructure.md", "The factor is 1 up to 0.95 `T_MELT`", KEY),
    ("docs/microstructure.md", "| 20 reference points, stress and grain size | 0.1 % |", ASKED),
    ("docs/microstructure.md", "| adiabatic temperatures at strains 4 and 30 | 0.1 K |", ASKED),
    ("docs/microstructure.md", "| det(Bbar) - 1 at a strain of 30 in shear | 1e-12 |", ASKED),
    ("docs/microstructure.md", "290-1356 K, 1e-6..1e3/s, dt 1e-9..1e-4 s", KEY),
    ("docs/microstructure.md", "| 1 % in every row |", ASKED),
    ("docs/microstructure.md", "that of flow at 1e-12/s", KEY),
    ("docs/microstructure.md", "from 1e-30 to 1e9/s and from 1 to 5000 K", ASKED),
    ("docs/microstructure.md", "| 5.18, Johnson-Cook,", QUOTED),
    ("docs/microstructure.md", "| 6.1, 6.2, original", QUOTED),
    ("docs/microstructure.md", "| 6.4, 6.5, calibrated", QUOTED),
    ("docs/microstructure.md", "| 6.6, 6.7, both", QUOTED),
    ("docs/microstructure.md", "| 6.9, 6.10, AA5005", QUOTED),
    ("docs/microstructure.md", "| 6.11-6.13, AA5005", QUOTED),
    ("docs/microstructure.md", "by the driver with 2 % of noise, started from beta* = 0.001, k_0 = 3 and alpha* = 0.1", KEY),
    ("docs/microstructure.md", "(the noise: 2 %)", KEY),
    ("docs/microstructure.md", "figures 6.6 and 6.7 of the thesis). The integration in time", QUOTED),
    ("docs/microstructure.md", "a strain of 30 at 773 K and 25/s", KEY),
    ("docs/microstructure.md", "at 0.0140 1/s", KEY),
    ("docs/microstructure.md", "(friction 0.3, h = 200)", KEY),
    ("docs/microstructure.md", "The thesis has 323 to 331 nm", QUOTED),
    ("docs/microstructure.md", "With particles 1 mm apart", KEY),
    ("docs/restart.md", "SAFETY_INTERVAL (10 minutes)", KEY),
    ("docs/restart.md", "up to 50 times", KEY),
    ("docs/results.md", "particles 1 mm apart, cells of 2 mm,", KEY),
    ("docs/results.md", "mass scaling 1e6", KEY),
    ("docs/results.md", "in some 20 minutes of processor time", STUDY),
    ("docs/results.md", "axial forces of 10 to 25 kN, 12 to 35 N m, and power that falls from 3.5 to 0.9 kW; strain rates are 3 to 25 /s "
     "and interface velocities 5 to 25 mm/s", QUOTED),
    ("docs/results.md", "torque and power are a little above them at 40 s, the force a little below at 50 s", KEY),
    ("docs/results.md", "but for the force at 20 s", KEY),
    ("docs/results.md", "1 mm below the surface at 11 mm from the centre line", KEY),
    ("docs/results.md", "plunged at x = 25 mm", KEY),
    ("docs/results.md", "The first 10 s of the same pass", KEY),
    ("docs/results.md", "SHEAR_FACTOR = 1), a factor of 0.9, and Coulomb's law with 0.4", KEY),
    ("docs/results.md", "1 for 2 mm and 1e5, and for sticking metal at 1 mm.", KEY),
    ("docs/results.md", "no flash forms in 10 s", KEY),
    ("docs/results.md", "between particles 1 and 2 mm apart", KEY),
    ("docs/results.md", "below its melting temperature (1356 K)", KEY),
    ("docs/results.md", "metal with a factor of 0.9", KEY),
    ("docs/results.md", "a plate of 900 K with a mass scaling of 1e4, a tool that is plunged within 0.3 s", KEY),
    ("docs/results.md", "in the experiment (5 to 25 mm/s)", QUOTED),
    ("docs/results.md", "torque is 0.96 to 1.03 of that", STUDY),
    ("docs/results.md", "that force: 38.1 and 26.1 N m at 0.4. Pressed with 12 kN (`&MOTION FORCE`) the disc has 31.8 and 33.0 N m.", STUDY),
    ("docs/results.md", "with particles 2 mm apart (`GRID.CELL=4e-3`) and a constant mass scaling of 1e5 is run with Coulomb's 0.2 and a "
     "film of 700 W/(m2 K),", KEY),
    ("docs/results.md", "second at 20 s; flow is that of `stirpost flow` at the end: | | mu = 0.2 | sticks | |---|---|---| | axial force, "
     "torque, power | 22.8 kN, 37 N m, 3.8 kW | 1.7 kN, 88 N m, 8.9 kW | | temperature of the face | 1121 K | 1269 K | | "
     "shear strength of the metal under the face | 61 MPa | 47 MPa | | ridge, retreating side | 0.3 mm | 10.1 mm | | "
     "depth of the stir zone at x = 25 mm | 2.9 mm | 6.2 mm | Sticking metal forms a flash similar to that of the "
     "experiment (8 mm), but its heat is too large: the measured temperatures require some 12 MPa over the face. Hot "
     "metal therefore sticks to only a part of the face or for a part of the time. A tool at a prescribed depth loses "
     "contact with metal that flows away: its force falls to zero at 40 s. The ridge leaves the grid at 54.6 s and", STUDY),
    ("docs/speed.md", "particles 1 mm apart and a tilted tool at x = 25 mm", KEY),
    ("docs/speed.md", "over particles above 0.1", KEY),
    ("docs/speed.md", "differences that 99 % of the particles", KEY),
    ("docs/speed.md", "limits the differences to 2 % of torque, force and plastic strain and 3 K", ASKED),
    ("docs/speed.md", "(particles 0.5 mm apart) on two ranks, stretches of 0.6 s", KEY),
    ("docs/speed.md", "whole pass with particles 1 mm apart", KEY),
    ("docs/speed.md", "plunged at 8 mm/s and 970 rpm", KEY),
    ("docs/speed.md", "means from 0.05 to 0.2 s; INERTIAL_FRACTION 0.02, MASS_SCALING_RANGE = 1e4, 1e7", KEY),
    ("docs/speed.md", "a particle-step of 200 ns", KEY),
    ("docs/speed.md", "has 2 us and 10 GB/s", KEY),
    ("docs/speed.md", "at most 353 in the passes of copper", ASKED),
    ("docs/speed.md", "has a plate of 100 x 40 x 12 mm with a flat tool of 20 mm; metal is awake within 20 mm of its axis", KEY),
    ("docs/speed.md", "a disk of 1 GB/s", KEY),
    ("docs/speed.md", "a frame has 100 bytes a particle", KEY),
    ("docs/speed.md", "one a step, 56 us on 10,000 ranks, 3 % of the shortest step", FORMULA),
    ("docs/speed.md", "the box of every rank, 24 bytes each", KEY),
    ("docs/speed.md", "it has 32 fields and a tag, 264 bytes. The nodes take the rest: two grids of 64 bytes a node, 16 bytes for volume averaging, and 40 bytes", KEY),
    ("docs/speed.md", "takes 40 bytes a particle more while it lasts, and a frame 92", KEY),
    ("docs/speed.md", "is 1 awake, 0.15 more where its block flows, 22 more at a tool, 0.035 asleep", KEY),
    ("docs/speed.md", "agree to 1 %. `tests/system/test_sleeping.py`", STUDY),
    ("docs/speed.md", "alone reach 0.92 (stirring) and 0.89 (asleep) of", STUDY),
)


def check(name, text, record):
    """Spans of a document that statements and definitions cover, and what is wrong with them."""
    covered, complaints = [], []
    text = documents.without_tables(text)
    for statement in STATEMENTS:
        if statement.document != name:
            continue
        numbers = documents.find(text, statement.words)
        if numbers is None:
            complaints.append(f"{name}: '{statement.words}' of tests/figures/statements.py is not there just once")
            continue
        covered += [(n.begin, n.end) for n in numbers]
        for number, (measure, key, factor) in zip(numbers, statement.values, strict=True):
            value = record.get(measure, {}).get(key)
            if value is None:
                complaints.append(f"{name}: nothing recorded for {measure}, {key}")
            elif not number.says(factor * value):
                complaints.append(f"{name}:{documents.line_of(text, number.begin)}: {number.text} documented, "
                                  f"{factor * value:.4g} measured ({measure}, {key})")
    for document, words, _ in DEFINITIONS:
        if document == name:
            found = documents.span(text, words)
            if found is None:
                complaints.append(f"{name}: '{words}' of tests/figures/statements.py is not there just once")
            else:
                covered.append(found)
    return covered, complaints


def places(measure, key, known, value):
    """What documents say of a value of which a new measurement differs."""
    said = []
    for statement in STATEMENTS:
        for k, (own, name, factor) in enumerate(statement.values):
            if (own, name) == (measure, key):
                number = documents.find(documents.without_tables(documents.read(statement.document)), statement.words)[k]
                said.append(f"{statement.document}: {number.text} documented, {factor * value:.4g} measured ({measure}, {key})")
    return said + [f"{name}: {known:.4g} documented, {value:.4g} measured ({measure}, {key})"
                   for name in tables.documents_of(measure)]


def said_in(measure):
    """Documents that state something of a measurement."""
    found = [s.document for s in STATEMENTS if any(v[0] == measure for v in s.values)] + tables.documents_of(measure)
    return list(dict.fromkeys(found))
