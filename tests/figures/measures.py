# SPDX-License-Identifier: MIT
"""What the documents state, measured: name, command, how close a new measurement comes, and the values.

What is measured here is kept in measured.jsonl. Series that have a command and results of their own are read from
those; a measurement here takes the cheapest points of them again."""

import dataclasses
import functools
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import typing

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORD = pathlib.Path(__file__).resolve().parent / "measured.jsonl"
PRECISION = ROOT / "benchmarks/work_precision/results.jsonl"
for folder in ("tests/verification", "tests/system", "benchmarks/work_precision"):
    sys.path.insert(0, str(ROOT / folder))

import cases  # noqa: E402
import driver  # noqa: E402
import heat  # noqa: E402
import measuring  # noqa: E402
import numpy as np  # noqa: E402
import problems  # noqa: E402

SAME = "the same program gives the same digits; others may add up in another order"


@dataclasses.dataclass(frozen=True)
class Measure:
    """One measurement: `run` gives its values by name; `own` reads them where they are not in measured.jsonl."""

    name: str
    command: str  # that gives the same
    run: typing.Callable
    quick: bool = False
    tolerance: float = 0.02  # relative
    reason: str = SAME
    own: typing.Optional[typing.Callable] = None

    def agrees(self, known, value):
        return math.isclose(known, value, rel_tol=self.tolerance, abs_tol=1e-12)


def lines(path):
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]


def recorded():
    """Values of all measurements: name: {key: value}."""
    kept = {line["name"]: line["values"] for line in lines(RECORD)} if RECORD.exists() else {}
    return kept | {m.name: m.own() for m in ALL.values() if m.own}


def keep(measure, values):
    """Put the values of a measurement into measured.jsonl."""
    if measure.own:
        sys.exit(f"figures.py: {measure.name} is kept by {measure.command}")
    rows = {line["name"]: line for line in lines(RECORD)} if RECORD.exists() else {}
    program = subprocess.run([driver.EXECUTABLE, "--version"], capture_output=True, text=True, check=True).stdout
    rows[measure.name] = {"name": measure.name, "values": {k: float(f"{v:.6g}") for k, v in values.items()},
                          "version": program.splitlines()[0], "machine": measuring.machine()}
    order = [name for name in ALL if name in rows]
    RECORD.write_text("".join(json.dumps(rows[name]) + "\n" for name in order), encoding="utf-8")


def run(name, sets, *options, ranks=None):
    """Results of one run, read before its folder goes: history and last checkpoint (None if there is none)."""
    stem = pathlib.Path(name).stem
    with tempfile.TemporaryDirectory() as place:
        results = driver.run(name, "--quiet", *options, directory=place, sets=sets, ranks=ranks, timeout=7200).results(stem)
        try:
            state = results.checkpoint()
        except (OSError, KeyError):
            state = None
        return results.history(), state


# --- problems of tests/verification ---------------------------------------------------------------

# Problems and the resolutions that are measured.
VERIFIED = {
    "waves2d": (16, 32), "waves3d": (8,), "vortex": (64,), "ring": (16,), "bar_mode": (13, 25), "bar_impact": (25, 50),
    "bar_gravity": (12, 25), "column": (16,), "friction_block": (1,), "incline_block": (4,), "incline_cylinder": (16,), "hertz_line": (40,), "hertz_sphere": (16,), "heat_step": (10, 20),
    "heat_robin": (8, 16, 32), "heat_friction": (16,), "standing_wave": (16, 32), "heat_insulated": (16, 32),
    "heat_fixed": (16, 32), "jc_element": (2,), "taylor": (6,), "punch_plane": (4,), "punch_circle": (4,), "punch_elastic": (2,),
    "couette": (10,), "tube": (8,), "tube_limit": (8,), "cantilever": (3, 4, 8), "stirred_layer": (5, 10), "source_plate": (1,), "tool_torque": (6,), "tool_torque_stick": (6,), "discs_nairn": (10,),
}
USL = {"METHOD.SCHEME": "usl"}
# The same with other keys: label, problem, resolutions, keys.
VARIANTS = (("cantilever by USL", "cantilever", (3, 4), USL),)
# More than two seconds of processor time each, or sensitive to the order of sums: measured by --all alone.
SLOW = {"incline_cylinder", "hertz_line", "hertz_sphere", "taylor", "punch_circle", "couette", "cantilever", "cantilever by USL", "stirred_layer",
        "source_plate", "tool_torque", "tool_torque_stick", "discs_nairn"}


def verify(problem, n, sets):
    with tempfile.TemporaryDirectory() as place:
        error, _, _ = problem.solve(n, dict(problem.parameters), place, sets)
    return {"error": float(error)}


def of_verification():
    variants = [(name, name, sizes, {}) for name, sizes in VERIFIED.items()] + list(VARIANTS)
    for label, name, sizes, sets in variants:
        for n in sizes:
            words = "".join(f" --set {key}={value}" for key, value in sets.items())
            yield Measure(f"{label} {n}", f"tests/verification/verify.py {name} --resolution {n}{words}",
                          functools.partial(verify, problems.ALL[name], n, sets), quick=label not in SLOW, tolerance=0.03)


# --- run time against error -----------------------------------------------------------------------

AGAIN = (("waves2d", "cpgimp flip", 16), ("waves2d", "cpgimp apic, dt/2", 16), ("standing_wave", "bspline fmpm(2)", 32),
         ("heat_fixed", "ugimp, Fo 0.5", 16), ("bar", "ugimp apic", 12), ("friction_block", "bspline apic", 1))


def precision():
    """Errors of all points by 'problem, option set, resolution'."""
    return {f"{p['problem']}, {p['option_set']}, {p['resolution']}": p["error"] for p in lines(PRECISION)
            if p["error"] is not None}


def precision_again():
    return {f"{name}, {label}, {n}": measuring.point(cases.CASES[name], label, n, 1)["error"] for name, label, n in AGAIN}


# --- runs of their own ----------------------------------------------------------------------------

SPINS = {"flip ugimp": ("flip", "ugimp", 0.4), "flip bspline": ("flip", "bspline", 0.4),
         "apic ugimp": ("apic", "ugimp", 0.4), "apic bspline": ("apic", "bspline", 0.4),
         "musl ugimp": ("flip", "ugimp", 0.4), "fmpm ugimp": ("fmpm", "ugimp", 0.3)}


def rotation():
    """Lost share of the angular momentum of a free cube in one turn, m (a^2 - s^2)/6 omega at the start."""
    values = {}
    for label, (transfer, shape, cfl) in SPINS.items():
        sets = {"METHOD.TRANSFER": transfer, "METHOD.SHAPE": shape, "TIME.CFL": cfl}
        if label.startswith("musl"):
            sets["METHOD.SCHEME"] = "musl"
        _, state = run("spin", sets)
        exact = 1e3 * 12e-3**3 * (12e-3**2 - 1e-6) / 6.0 * np.array([300.0, 600.0, 600.0])
        values[label] = float(np.linalg.norm(state.angular_momentum() - exact) / np.linalg.norm(exact))
    return values


DISCS = {"2 mm": {}, "2 mm, grid shifted": {"GRID.LOWER": "-4.26e-3,-4.58e-3,-4.82e-3"}}


def disc_on_plate():
    """Means of force and torque from 0.5 to 1.9 ms, friction heat after 1.9 ms: while the disc is pressed. When it stops, the
    plate rings for milliseconds, since its mass is scaled."""
    values = {}
    for shape in ("bspline", "ugimp"):
        for label, sets in DISCS.items():
            history, _ = run(str(ROOT / "benchmarks/disc_on_plate.nml"),
                             {"TIME.END": 1.9e-3, "OUTPUT.HISTORY_INTERVAL": 1e-4, "METHOD.SHAPE": shape} | sets)
            late = history["time[s]"] > 0.5e-3
            values |= {f"{label}, {shape}, force": history["disc_force_z[N]"][late].mean(),
                       f"{label}, {shape}, torque": history["disc_torque[Nm]"][late].mean(),
                       f"{label}, {shape}, heat": history["friction_heat[J]"][-1]}
    return {key: float(value) for key, value in values.items()}


# tests/system/test_mass_scaling.py
SLOWER = {"MOTION(1).VELOCITY": "0,0,-8e-3", "MOTION(2).SPIN_RPM": "300", "OUTPUT.FRAME_INTERVAL": "0",
          "METHOD.SHAPE": "ugimp", "METHOD.SLEEPING": "off", "METHOD.SORT_INTERVAL": "25"}
SCALINGS = {"1e4": {"TIME.MASS_SCALING": "1e4"}, "1e5": {"TIME.MASS_SCALING": "1e5"},
            "adapts": {"TIME.MASS_SCALING": "1e5", "TIME.MASS_SCALING_RANGE": "1e4,1e7", "TIME.INERTIAL_FRACTION": "0.02"}}


def mass_scaling():
    values = {}
    for label, sets in SCALINGS.items():
        history, _ = run("stir", SLOWER | sets)
        late = history["time[s]"] > 0.05
        values |= {f"{label}, steps": history["step"][-1], f"{label}, torque": history["tool_torque[Nm]"][late].mean(),
                   f"{label}, force": history["tool_force_z[N]"][late].mean(),
                   f"{label}, hottest": history["temperature_max[K]"][-1],
                   f"{label}, inertial": history["inertial_stress_over_flow[%]"].max()}
        if "TIME.MASS_SCALING_RANGE" in sets:
            values[f"{label}, factor"] = history["mass_scaling"][-1]
    return {key: float(value) for key, value in values.items()}


def command(*words):
    """What a command prints."""
    return subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True, cwd=ROOT,
                          env=dict(os.environ, PYTHONPATH=str(ROOT / "postproc"))).stdout


MODELLED = (8, 64, 1024)  # ranks
PLATE_RANKS = {"1e+08": (16, 100, 1000, 10000), "1e+09": (100, 1000, 10000)}
PLATE_KEYS = ("milliseconds_a_step", "imbalance", "efficiency", "megabytes_of_a_rank", "steps_of_a_frame", "steps_of_a_division")


def scaling():
    """Efficiencies and imbalances that the model predicts, with and without a network."""
    values = {}
    for label, words in (("", ()), ("network, ", ("--latency", "2e-6", "--bandwidth", "10e9"))):
        for line in command("benchmarks/scaling", *words).splitlines():
            row = json.loads(line)
            for key in ("efficiency", "efficiency_without_overlap", "imbalance") if row["ranks"] in MODELLED else ():
                values[f"{label}{row['scaling']}, {row['ranks']}, {key}"] = row[key]
    for line in command("benchmarks/scaling", "--shape", "plate", "--latency", "2e-6", "--bandwidth", "10e9").splitlines():
        row = json.loads(line)
        for key in PLATE_KEYS:
            values[f"plate, {row['particles']:.0e}, {row['ranks']}, {key}"] = row[key]
    return values


def cooling(sets=None):
    """Grain sizes at the end of the paths of input/material/cooling.nml [m]."""
    with tempfile.TemporaryDirectory() as place:
        driver.run(str(ROOT / "input/material/cooling.nml"), "--material", directory=place, sets=sets)
        values = {}
        for path in sorted(pathlib.Path(place).rglob("*.csv")):
            rows = [row for row in path.read_text(encoding="utf-8").splitlines() if not row.startswith("#")]
            head, last = rows[0].split(","), rows[-1].split(",")
            column = next(k for k, name in enumerate(head) if name.startswith("grain_size"))
            values[path.stem] = float(last[column])
    return values


# What annealing depends on: what is changed, keys. 82 kJ/mol with the same rates at 700 K.
ANNEALING = {
    "as it is": {},
    "`GROWTH` over 10": {"GROWTH": "2.3e-7,104e3"}, "`GROWTH` times 10": {"GROWTH": "2.3e-5,104e3"},
    "`RECOVERY` over 10": {"RECOVERY": "8e-23,117e3"}, "`RECOVERY` times 10": {"RECOVERY": "8e-21,117e3"},
    "`RECRYSTALLISATION` over 10": {"RECRYSTALLISATION": "9.3e-8,104e3"}, "`RECRYSTALLISATION` times 10": {"RECRYSTALLISATION": "9.3e-6,104e3"},
    "82 kJ/mol for 104 in both": {"GROWTH": "5.25e-8,82e3", "RECRYSTALLISATION": "2.12e-8,82e3"},
    "`NUCLEUS_SPACING` half": {"NUCLEUS_SPACING": "1e-6"}, "`NUCLEUS_SPACING` twice": {"NUCLEUS_SPACING": "4e-6"},
    "`NUCLEATION_DENSITY` half": {"NUCLEATION_DENSITY": "5e13"}, "`NUCLEATION_DENSITY` twice": {"NUCLEATION_DENSITY": "2e14"},
    "`RECRYSTALLISED_STRAIN` half": {"RECRYSTALLISED_STRAIN": "0.25"}, "`RECRYSTALLISED_STRAIN` twice": {"RECRYSTALLISED_STRAIN": "1"},
}


def annealing():
    """Grain sizes of the cooled paths with one parameter of annealing changed [m]."""
    values = {}
    for name, keys in ANNEALING.items():
        found = cooling({f"MATERIAL(annealing copper).{key}": value for key, value in keys.items()})
        values |= {f"{name}, {path}": found[f"cooling-{path}"] for path in ("plate", "quench")}
    return values


def calibration():
    """Numbers found from curves with noise, as the head of input/material/calibration.nml says, and their errors."""
    with tempfile.TemporaryDirectory() as place:
        data, folder = f"{place}/measured.csv", f"{place}/fit"
        words = ("-m", "stirpost", "calibrate", "law", str(ROOT / "input/material/calibration.nml"), data)
        command(*words, "--generate", "--noise", "0.02")
        command(*words, "--material", "copper", "--fit", "TP_BETA=0.001", "TP_K0=3", "TP_STAR=0.1,0.1,0.1,0.1", "-o", folder)
        report = json.loads(pathlib.Path(folder, "fit.json").read_text(encoding="utf-8"))
    values = {"residual": report["relative_rms"]}
    for kind in ("fitted", "standard_errors"):
        for key, numbers in report[kind].items():
            values |= {f"{kind}, {key}, {k}": number for k, number in enumerate(numbers)}
    return values


def limits():
    """Constants of modules/mpm/stability.f90."""
    text = (ROOT / "modules/mpm/stability.f90").read_text(encoding="utf-8")
    return {name: float(value) for name, value in re.findall(r"(\w+) = (-?[0-9.]+)_rp", text)}


def limits_again():
    """The limits again, as far as one offset tells: stable at the limit, growing a little above what no offset stands."""
    sys.path.insert(0, str(ROOT / "benchmarks/stability"))
    import limits as study

    known, found = limits(), {}
    for name, key in (("bspline flip", "limit_bspline"), ("ugimp flip", "limit_ugimp")):
        sets = study.METHODS[name]
        at, above = (study.grows(part * known[key], sets, (0, 0, 0), (1, 1, 1)) for part in (1.0, 1.3))
        good = above and not at
        found[key] = known[key] if good else math.nan
    return found


OWN = (
    Measure("precision", "benchmarks/work_precision/run.sh", precision_again, quick=True, tolerance=0.02, own=precision),
    Measure("rotation", "tests/figures/figures.py rotation", rotation),
    Measure("disc_on_plate", "tests/figures/figures.py disc_on_plate", disc_on_plate),
    Measure("mass_scaling", "tests/figures/figures.py mass_scaling", mass_scaling, tolerance=0.01,
            reason="chaotic: particles that flow amplify differences of rounding"),
    Measure("scaling", "benchmarks/scaling", scaling, tolerance=1e-6, reason="a formula"),
    Measure("annealing", "build/release/stirpoint --material input/material/cooling.nml --set 'MATERIAL(annealing copper).KEY=VALUE'", annealing),
    Measure("cooling", "build/release/stirpoint --material input/material/cooling.nml", cooling, quick=True),
    Measure("calibration", "stirpost calibrate law (input/material/calibration.nml)", calibration),
    Measure("limits", "benchmarks/stability/limits.py", limits_again, own=limits,
            reason="bisection of 5 offsets; here one offset at the limit and 15 % above it"),
)
# Of docs/heat.md.
HEAT = (
    Measure("heat slab", "benchmarks/heat/convergence.py --fine --keep", heat.slab_again, quick=True, own=heat.slab),
    Measure("heat plates", "benchmarks/heat/convergence.py --fine --keep", heat.plates_again, quick=True, tolerance=3e-5,
            reason="0.02 K of a peak", own=heat.plates),
    Measure("heat crossing", "benchmarks/heat/crossing.py --keep", heat.crossed_again, quick=True, tolerance=0.05,
            reason="steps follow an estimate; processor times are not compared", own=heat.crossed),
    Measure("heat record", "tests/figures/figures.py heat", heat.record, quick=True, tolerance=0.01),
    Measure("heat tolerance", "tests/figures/figures.py heat", heat.tolerance, tolerance=0.05,
            reason="steps follow an estimate"),
    Measure("heat cavity", "tests/figures/figures.py heat", heat.cavity, tolerance=0.01),
    Measure("heat share", "stirpost calibrate heat share --plate 391 8960 386 --tool 14.4 7800 460", heat.share, quick=True),
)
ALL = {measure.name: measure for measure in (*of_verification(), *OWN, *HEAT)}
