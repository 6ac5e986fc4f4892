# SPDX-License-Identifier: MIT
"""What is measured: problems of tests/verification, their resolutions, and option sets."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Case:
    """A problem with the resolutions and option sets it is measured with."""

    name: str
    problem: str  # name in tests/verification
    title: str
    resolutions: tuple
    option_sets: dict  # label: OptionSet
    parameters: dict = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class OptionSet:
    """Keys of the input, parameters of the problem, and the time step in units of the method's own."""

    keys: dict
    parameters: dict = dataclasses.field(default_factory=dict)
    step: float = 1.0


TRANSFERS = {
    "flip": {},
    "apic": {"TRANSFER": "apic"},
    "fmpm(2)": {"TRANSFER": "fmpm", "ORDER": 2},
    "fmpm(4)": {"TRANSFER": "fmpm", "ORDER": 4},
    "xpic(2)": {"TRANSFER": "xpic", "ORDER": 2},
    "fmpm(2)/10": {"TRANSFER": "fmpm", "ORDER": 2, "EVERY": 10},
    "fmpm(2)/100": {"TRANSFER": "fmpm", "ORDER": 2, "EVERY": 100},
    "flip musl": {"SCHEME": "musl"},
    "flip usavg": {"SCHEME": "usavg"},
}


def method(shape, transfer, step=1.0, **more):
    """An option set of &METHOD, whatever the input has; `more` are other keys as GROUP_KEY."""
    keys = {"SHAPE": shape, "TRANSFER": "flip", "SCHEME": "usl"} | TRANSFERS[transfer]
    keys = {f"METHOD.{k}": v for k, v in keys.items()} | {"TIME.CFL": 0} | more.pop("keys", {})
    return OptionSet(keys, step=step, **more)


def pairs(shape, transfers, steps=(1.0,), note="", **more):
    """Labelled option sets of one shape."""
    marks = {1.0: "", 0.5: ", dt/2", 0.25: ", dt/4"}
    return {f"{shape} {transfer}{note}{marks[step]}": method(shape, transfer, step, **more)
            for transfer in transfers for step in steps}


def mechanical(shape, cells, thorough=True):
    """The list for mechanics around the best shape of a problem; `cells`: particles per cell for 3 a direction."""
    both = (1.0, 0.5)
    result = pairs(shape, ("flip", "apic"), (1.0, 0.5, 0.25))
    result |= pairs(shape, ("fmpm(2)", "xpic(2)", "flip usavg"), both)
    result |= pairs(shape, ("fmpm(4)", "fmpm(2)/10", "fmpm(2)/100", "flip musl"))
    if thorough:
        result |= pairs(shape, ("flip", "apic"), note=", 3 per cell", keys={"BODY.PARTICLES_PER_CELL": cells})
    for other in ("ugimp", "bspline"):
        if other != shape:
            result |= pairs(other, ("flip", "apic"), both) | pairs(other, ("fmpm(2)",))
    return result


def conduction():
    """The list for conduction: step numbers, shapes, particles."""
    result = {}
    for shape in ("ugimp", "bspline"):
        for number in (0.15, 0.3, 0.5):
            result[f"{shape}, Fo {number}"] = OptionSet({"METHOD.SHAPE": shape}, {"number": number})
    result["ugimp, Fo 0.5, 3 per cell"] = OptionSet(
        {"METHOD.SHAPE": "ugimp", "BODY.PARTICLES_PER_CELL": "3,1,1"}, {"number": 0.5})
    return result


def longest_conduction(h, diffusivity):
    """The longest conduction step that the program allows, taken by mechanics too."""
    return {"HEAT.FOURIER": 0.5, "TIME.DT": 0.5 * h * h / diffusivity}


def fbar(shape, transfer, on):
    """The same with the other choice of volume averaging."""
    note = ", FBAR" if on else ", no FBAR"
    return pairs(shape, (transfer,), note=note, keys={"METHOD.FBAR": "T" if on else "F"})


def few(shape):
    """The list for costly problems and those where the method matters little."""
    result = pairs(shape, ("flip", "apic", "fmpm(2)", "xpic(2)", "fmpm(2)/10", "flip musl", "flip usavg"))
    for other in ("ugimp", "cpgimp", "bspline"):
        if other != shape:
            result |= pairs(other, ("flip", "apic"))
    return result | pairs(shape, ("flip", "apic"), (0.5,))


CASES = {case.name: case for case in (
    Case("waves2d", "waves2d", "Manufactured waves in a square, A = 0.05", (16, 32, 64),
         mechanical("cpgimp", "3,3,1") | fbar("cpgimp", "flip", True)),
    Case("waves2d_small", "waves2d", "Manufactured waves in a square, A = 0.001", (16, 32),
         mechanical("ugimp", "3,3,1", thorough=False), {"amplitude": 0.001}),
    Case("waves3d", "waves3d", "Manufactured waves in a cube, A = 0.05", (8, 16), few("cpgimp")),
    Case("standing_wave", "standing_wave", "Standing wave, five periods", (8, 16, 32, 64, 128),
         mechanical("ugimp", "3,1,1")),
    Case("heat_insulated", "heat_insulated", "Temperature mode, insulated ends", (8, 16, 32, 64, 128), conduction()),
    Case("heat_fixed", "heat_fixed", "Temperature mode, ends held", (8, 16, 32, 64, 128), conduction()),
    Case("bar", "bar_gravity", "Bar under sudden gravity, ten periods", (12, 25, 50),
         few("ugimp") | fbar("ugimp", "flip", True) | pairs("bspline", ("fmpm(2)",))),
    Case("couette", "couette", "Power-law flow between pin and ring", (10, 20),
         pairs("bspline", ("flip", "apic", "fmpm(2)", "flip musl")) | pairs("ugimp", ("flip", "apic"))
         | fbar("bspline", "flip", False)),
    Case("friction_block", "friction_block", "Block pushed over a plane", (1, 2), few("ugimp")),
    Case("taylor", "taylor", "Taylor bar", (4, 6), few("ugimp") | fbar("ugimp", "flip", False)),
    Case("source_plate", "source_plate", "Moving source on a plate", (2,),
         {"ugimp, Fo 0.13": OptionSet({"METHOD.SHAPE": "ugimp"}),
          "ugimp, Fo 0.5": OptionSet({"METHOD.SHAPE": "ugimp"} | longest_conduction(3e-3, 6.9e-5)),
          "bspline, Fo 0.13": OptionSet({"METHOD.SHAPE": "bspline"})}),
)}

QUICK = {"waves2d": ((8, 16), ("cpgimp flip", "cpgimp apic, dt/2", "bspline flip")),
         "heat_insulated": ((16,), ("ugimp, Fo 0.15", "ugimp, Fo 0.5"))}


def quick():
    """The cases of the smoke test, which take some seconds."""
    result = {}
    for name, (resolutions, labels) in QUICK.items():
        sets = {label: CASES[name].option_sets[label] for label in labels}
        result[name] = dataclasses.replace(CASES[name], resolutions=resolutions, option_sets=sets)
    return result
