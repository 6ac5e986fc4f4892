# SPDX-License-Identifier: MIT
"""What docs/heat.md states of heat alone, measured; long series are kept beside their commands in benchmarks/heat."""

import contextlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
for folder in ("tests/system", "benchmarks/heat", "postproc"):
    sys.path.insert(0, str(ROOT / folder))

import convergence  # noqa: E402
import crossing  # noqa: E402
import driver  # noqa: E402
import numpy as np  # noqa: E402

NAMES = ("T1", "T2", "T3")


@contextlib.contextmanager
def solved(name, sets):
    """Results of a run of input/heat_NAME.nml without frames."""
    with tempfile.TemporaryDirectory() as place:
        yield driver.run(ROOT / f"input/heat_{name}.nml", "--quiet", directory=place, timeout=7200,
                         sets={"OUTPUT.FRAME_INTERVAL": 0} | sets).results(f"heat_{name}")


def tool(*words):
    """What stirpost calibrate heat prints."""
    return subprocess.run([sys.executable, "-m", "stirpost", "calibrate", "heat", *map(str, words)], check=True,
                          capture_output=True, text=True, cwd=ROOT / "postproc").stdout


# --- benchmarks/heat/convergence.py ---------------------------------------------------------------

def converged():
    return json.loads(convergence.KEPT.read_text(encoding="utf-8"))["values"]


def slab():
    """Errors of the slab in space and time."""
    return {key: value for key, value in converged().items() if not key.startswith(convergence.PLATES)}


def slab_again():
    return convergence.slab(driver.EXECUTABLE)


def plates():
    """Peaks, errors and cost of all plates, and the smallest order with a cavity and the largest."""
    values = {key: value for key, value in converged().items() if key.startswith(convergence.PLATES)}
    cavities = [values[f"{plate}, order"] for plate in convergence.PLATES if "cavity" in plate]
    return values | {"cavities, least order": min(cavities), "cavities, largest order": max(cavities)}


def plates_again():
    """Peaks of all plates at 2 mm."""
    values = {}
    for plate in convergence.PLATES:
        values |= convergence.peaks(f"{plate}, 2", convergence.record(driver.EXECUTABLE, plate, 2.0)[0])
    return values


# --- benchmarks/heat/crossing.py ------------------------------------------------------------------

def of_crossing(runs):
    """Cost, error [K], evaluations and iterations a solve by input, cell, method and time."""
    values = {}
    for row in runs:
        name = f"{row['input']}, {row['cell_mm']:g}, {row['method']}, {row['time']:g} s"
        values |= {f"{name}, cpu": row["cpu_per_second"], f"{name}, evaluations": row["evaluations"]}
        if row["solves"]:
            values[f"{name}, iterations"] = row["iterations"] / row["solves"]
        apart = crossing.error(runs, row)
        if apart is not None:
            values[f"{name}, error"] = apart
    return values


def crossed():
    """The columns of all kept results, the ratio of Euler to implicit steps, and where methods cross [mm]."""
    runs = json.loads(crossing.KEPT.read_text(encoding="utf-8"))["runs"]
    values = of_crossing(runs)
    for cell in ("1", "0.5", "0.25"):
        euler, implicit = (values[f"heat_copper_plain, {cell}, {method}, 2 s, cpu"] for method in ("explicit", "tr-bdf2, fftw"))
        values[f"{cell}, explicit over implicit"] = euler / implicit
    for found in crossing.crossings([run for run in runs if (run["input"], run["time"]) == ("heat_copper_plain", 6.0)]):
        values[f"{found['cheaper_above']} to {found['cheaper_below']}"] = found["cell_mm"]
    return values


def crossed_again():
    """Errors and work at 1 mm by what needs no library."""
    runs = [crossing.measure(driver.EXECUTABLE, crossing.PLAIN, 1.0, method, 2.0)
            for method in ("reference", "rkl2", "tr-bdf2, cg")]
    return {key: value for key, value in of_crossing(runs).items() if not key.endswith(", cpu")}


# --- runs of their own ----------------------------------------------------------------------------

def record():
    """The plain plate without changes: work, times of the peaks, mean cooling rate [1/s] after 65 s."""
    with solved("copper_plain", {}) as results:
        probes, summary = results.probes(), results.summary()
    time = probes["time[s]"]
    values = {key: summary[key] for key in ("cells", "steps", "evaluations")}
    values |= {f"{name}, time": float(time[probes[f"{name}[K]"].argmax()]) for name in NAMES}
    late = time > 65.0
    rates = [-np.polyfit(time[late], np.log(probes[f"{name}[K]"][late] - 298.0), 1)[0] for name in NAMES]
    return values | {"cooling rate": float(np.mean(rates))}


TOLERANCES = (0.2, 0.5, 1.0, 2.0, 5.0, 15.0)  # [K]


def tolerance():
    """Largest difference of a probe of the plain plate from TOLERANCE = 0.02 [K], and evaluations of the rates."""
    rows, values = {}, {}
    for most in (0.02, *TOLERANCES):
        with solved("copper_plain", {"HEAT.TOLERANCE": most}) as results:
            rows[most] = results.probes().rows[:, 1:]
            evaluations = results.summary()["evaluations"]
        if most in TOLERANCES:
            values |= {f"{most:g}, apart": float(np.abs(rows[most] - rows[0.02]).max()), f"{most:g}, evaluations": evaluations}
    return values


def cavity():
    """Volume of the plate with cavity 1 [mm3], the film that its own record gives, what air changes of its peaks [K]."""
    with solved("copper_cavity1", {}) as results:
        own = results.probes()
        volume = results.history()["heat_content[J]"][0] / (8960.0 * 386.0 * 298.0) * 1e9
        text = tool("film", results.path("_probes.csv"), "--density", 8960, "--specific-heat", 386, "--volume", 46.71e-6,
                    "--area", 4e-3)
    films = [float(word) for word in re.findall(r"h = (\S+)", text)]
    with solved("copper_cavity1_air", {"TIME.END": 50}) as results:
        air = results.probes()
    apart = max(abs(own[f"{name}[K]"].max() - air[f"{name}[K]"].max()) for name in NAMES)
    return {"volume": float(volume), "air": float(apart)} | dict(zip(("differences", "exponential", "free end"), films))


def share():
    """Part of the heat in a copper plate under tool steel."""
    return {"copper": float(tool("share", "--plate", 391, 8960, 386, "--tool", 14.4, 7800, 460))}
