# SPDX-License-Identifier: MIT
"""Figures 5.3 to 5.11 of the thesis: what mass scaling does to the first 20 s of the pass of cavity 1 as printed."""

import json

import calculate
import measure
from calculate import driver, kept
from measure import np

FACTORS = (1e3, 1e4, 1e5, 1e6, 1e7)
PASS, END = "cavity1_jc", 20.0  # [s]


def under_the_tool(end):
    """Particles of the first layer below the tool."""
    ahead = np.linalg.norm(end.x[:, :2] - end.way.place[-1], axis=1)
    return (ahead < end.way.radius) & (end.face - end.x0[:, 2] < end.spacing)


def numbers(results):
    """Quantity, unit in it: number."""
    run, history = measure.Run(results.directory), results.history()
    later = history["time[s]"] >= 0.5 * END
    end = measure.flow.Flow(run, run.frames[-1])
    under = under_the_tool(end)
    temperature = end.field("temperature")
    return {
        "heat of friction, kJ": 1e-3 * history["friction_heat[J]"][-1],
        "plastic work, J": history["plastic_work[J]"][-1],
        "elastic energy, J": history["elastic[J]"][-1],
        "kinetic energy (scaled), mJ": 1e3 * history["kinetic[J]"][later].mean(),
        "mean temperature, K": temperature.mean(),
        "temperature under the tool, K": temperature[under].mean(),
        "von Mises stress under the tool, MPa": 1e-6 * end.field("von_mises")[under].mean(),
        "displacement under the tool, mean, mm": 1e3 * np.linalg.norm(end.x - end.x0, axis=1)[under].mean(),
        "displacement, largest, mm": 1e3 * np.linalg.norm(end.x - end.x0, axis=1).max(),
        "torque, mean of 10 to 20 s, N m": history["tool_torque[Nm]"][later].mean(),
        "axial force, mean of 10 to 20 s, kN": 1e-3 * history["tool_force_z[N]"][later].mean(),
        "inertial over flow stress, largest, %": history["inertial_stress_over_flow[%]"].max(),
        "energy audit, largest, %": np.abs(history["audit_error[%]"]).max(),
        "steps": history["step"][-1],
    }


def write(options, table):
    """Compute what is not there and keep the table in the file `table`."""
    columns = []
    for factor in reversed(FACTORS):  # the short ones first
        keys = calculate.keys_of(PASS, "printed", options.particles, factor, options.elastic_scaling) | {"TIME.END": f"{END:g}"}
        folder = options.output / f"mass_scaling/{options.particles:g}mm_{factor:g}"
        results = calculate.calculate(folder, PASS, "printed", keys, options.ranks)
        made = [json.loads(line) for line in (folder / "machine.jsonl").read_text(encoding="utf-8").splitlines()]
        columns.insert(0, numbers(results) | {"processor time, s": sum(one["cpu_seconds"] for one in made)})
    rows = [["", *(f"{factor:.0e}".replace("e+0", "e") for factor in FACTORS)]]
    rows += [[name, *(f"{column[name]:.4g}" for column in columns)] for name in columns[0]]
    title = "mass scaling"
    kept.show(title, rows)
    kept.keep(table, f"benchmarks/passes/run.sh --mass-scaling-study --particles {options.particles:g}", {title: rows})
