# SPDX-License-Identifier: MIT
"""Quantities of one run that are compared with the thesis."""

import numpy as np
from calculate import HERE, ROOT  # noqa: F401  (the path to driver and stirpost)
import sys

sys.path.insert(0, str(ROOT / "postproc"))
from stirpost.analysis import flow  # noqa: E402
from stirpost.run import Run  # noqa: E402

SECTIONS = (0.025, 0.065)  # [m]
WINDOWS = ((12.0, 13.0), (29.0, 31.0), (49.0, 51.0))  # [s]
STIRRED = 1.0  # strain


def number(value):
    return None if value is None or not np.isfinite(value) else float(value)


def dip(time, values, begin=18.0, end=40.0):
    """How far a curve falls between two higher places while the tool is over the cavity [K]; medians over 2 s, as single
    rows of a probe may stand out where the particles around it change."""
    there = (time >= begin) & (time <= end)
    wide = max(1, int(np.sum((time >= begin) & (time <= begin + 2.0))) // 2)
    padded = np.pad(values[there], wide, mode="edge")
    t = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * wide + 1), axis=1)
    return float(np.max(np.minimum(np.maximum.accumulate(t), np.maximum.accumulate(t[::-1])[::-1]) - t))


def thermocouples(probes):
    found = {}
    for name in ("T1", "T2", "T3"):
        t = probes[f"{name}[K]"]
        k = int(np.argmax(t))
        found |= {f"{name} peak, K": t[k], f"{name} time of the peak, s": probes["time[s]"][k],
                  f"{name} dip over the cavity, K": dip(probes["time[s]"], t)}
    return found


def loads(history):
    time = history["time[s]"]
    found = {}
    for begin, end in WINDOWS:
        m = (time >= begin) & (time <= end)
        at = f"at {(begin + end) / 2:g} s"
        for what, column, factor in (("force, kN", "tool_force_z[N]", 1e-3), ("torque, N m", "tool_torque[Nm]", 1.0),
                                     ("power, kW", "tool_power[W]", 1e-3)):
            name, unit = what.split(", ")
            found[f"{name} {at}, {unit}"] = factor * history[column][m].mean()
    whole = (time >= 5.0) & (time <= 0.93 * time[-1])
    share, velocity = history["tool_friction_share[%]"][whole], history["tool_interface_velocity[m/s]"][whole]
    found |= {"share of friction, %": share.mean(), "interface velocity, mm/s": 1e3 * velocity.mean(),
              "interface velocity, % of the tool's": 100 * velocity.mean() / history["tool_tool_velocity[m/s]"][whole].mean(),
              "interface velocity, largest, % of the tool's": 100 * velocity.max() / history["tool_tool_velocity[m/s]"][whole].mean(),
              "hottest metal, K": history["temperature_max[K]"].max(),
              "strain rate, largest, /s": np.quantile(history["strain_rate_max[1/s]"][whole], 0.99),
              "inertial over flow stress, median, %": np.median(history["inertial_stress_over_flow[%]"]),
              "inertial over flow stress, largest, %": history["inertial_stress_over_flow[%]"].max(),
              "rows with more than 5 % of it, %": 100 * np.mean(history["inertial_stress_over_flow[%]"] > 5.0),
              "energy audit, largest, %": np.abs(history["audit_error[%]"]).max()}
    return found


def metal(run):
    """Shapes, strains and grains at the end, strain under the tool at 15 s."""
    end = flow.Flow(run, run.frames[-1])
    told = end.measures(list(SECTIONS), STIRRED, [748.0], whole=True)
    volume, flash = told["volumes"], told["flash"]
    found = {f"cavity {name}, %": 100 * told["cavity"][name] if "cavity" in told else np.nan for name in ("filled", "covered")}
    if "cavity" in told:
        quarters = {name: told["cavity"][f"{name}[m3]"] for name in ("rear_advancing", "rear_retreating", "front_advancing", "front_retreating")}
        total = max(sum(quarters.values()), 1e-30)
        found |= {f"in the {name.replace('_', ' ')} quarter, %": 100 * value / total for name, value in quarters.items()}
    for side in ("retreating", "advancing"):
        found |= {f"flash, {side} side, mm": 1e3 * flash[f"height_{side}[m]"], f"metal above the plate, {side} side, mm3":
                  1e9 * volume[f"above_{side}[m3]"]}
    found |= {"groove, mm3": 1e9 * volume["groove[m3]"], "beyond sides and ends, mm3": 1e9 * (volume["sides[m3]"] + volume["ends[m3]"]),
              "volumes close to, %": 100 * abs(volume["closure"])}
    if np.ptp(np.atleast_1d(run.frames[0].attributes["cell"])) > 1e-9:  # stirpost flow takes particles for cubes
        found |= {name: np.nan for name in found if name.endswith("mm3") or name == "volumes close to, %"}
    for zone in told["stir_zone"]:
        found[f"stir zone at {1e3 * zone['at[m]']:g} mm, depth, mm"] = 1e3 * zone["depth[m]"]
    strain, rows = end.field("plastic_strain"), told["layers"]
    top = rows[0]
    found |= {"largest way of a tracer, tool diameters": top["ahead_max_diameters"], "longest path, tool diameters": top["path_max_diameters"],
              "of the moved metal on the advancing side, %": 100 * (top["of_moved_on_advancing_side"] or np.nan),
              "displacement of the layer 1 to 2 mm deep over the surface's, %":
                  100 * layer(end, 1e-3, 2e-3) / max(layer(end, 0.0, 1e-3), 1e-12)}
    grains = end.field("grain_size")
    slab = np.abs(end.tool_path.coordinate(end.x) - SECTIONS[1]) <= 0.5 * end.spacing * (1 + 1e-6)
    under = slab & (np.abs(end.tool_path.side(end.x)) < 0.8 * end.tool_path.radius)
    stirred, edge = slab & (strain > STIRRED), slab & (strain > 0.3) & (strain <= STIRRED)
    surface = under & (end.face - end.x0[:, 2] < end.spacing)
    for name, own in (("stir zone", stirred), ("surface", surface), ("edge of the zone", edge)):
        found[f"grain size, {name}, nm"] = 1e9 * grains[own].mean() if grains is not None and own.any() else np.nan
    at = next((f for f in run.frames if f.time >= 15.0), run.frames[-1])
    now = flow.Flow(run, at)
    centre = now.tool_path.place[-1]
    near = (np.linalg.norm(now.x[:, :2] - centre, axis=1) < now.tool_path.radius) & (now.face - now.x0[:, 2] < now.spacing)
    strain = now.field("plastic_strain")[near]
    return found | {"strain under the tool at 15 s, mean": strain.mean() if near.any() else np.nan,
                    "strain under the tool at 15 s, largest": strain.max() if near.any() else np.nan}


def layer(end, above, below):
    """Median displacement along the plate of what began between two depths under the path [m], or of what is nearest."""
    depth = end.face - end.x0[:, 2]
    nearest = np.unique(np.round(depth, 9))
    inside = nearest[(nearest > above) & (nearest < below)]
    chosen = inside if len(inside) else nearest[[np.abs(nearest - 0.5 * (above + below)).argmin()]]
    own = np.isin(np.round(depth, 9), chosen) & end.tool_path.passed(end.x0, margin=1.0)
    return float(np.median(np.linalg.norm((end.x - end.x0)[own, :2], axis=1)))


def measures(results):
    """Name, unit in it: number or None."""
    run = Run(results.directory)
    found = thermocouples(results.probes()) | loads(results.history()) | metal(run)
    summary = results.summary()
    found |= {"particles": summary["particles"], "steps": summary["steps"], "distance of particles, mm": 1e3 * run.spacing}
    return {name: number(value) for name, value in found.items()}
