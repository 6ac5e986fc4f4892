# SPDX-License-Identifier: MIT
"""Run directories without a run: a plate with a travelling hot spot, a groove and its flash, in the
layout that Stirpoint writes. As a program: python3 synthetic.py DIRECTORY.out [SPACING_MM] [FRAMES]
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import h5py
import numpy as np

SIZE = np.array([0.100, 0.040, 0.012])
AMBIENT = 293.0
SHOULDER = 0.009
INPUT = "&RUN END_TIME = 12.0 /\n&TOOL NAME = 'pin', OMEGA = 800.0 /  ! <rpm> & more\n"


def lattice(spacing: float, size=SIZE) -> np.ndarray:
    """Particle centres filling a box from the origin."""
    counts = np.maximum(1, np.round(np.asarray(size) / spacing).astype(int))
    axes = [(np.arange(count) + 0.5) * spacing for count in counts]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def write_frame(
    path: Path,
    points: np.ndarray,
    fields: dict,
    time: float,
    step: int = 0,
    ranks: int = 1,
    attributes: dict | None = None,
    input_text: str | None = INPUT,
) -> None:
    """One VTKHDF 1.0 file of vertices, one piece a rank."""
    pieces = np.array_split(np.arange(len(points)), ranks)
    counts = np.array([len(piece) for piece in pieces], dtype=np.int64)
    with h5py.File(path, "w") as file:
        file.attrs["time"], file.attrs["step"] = time, step
        for key, value in (attributes or {}).items():
            file.attrs[key] = value
        group = file.create_group("VTKHDF")
        group.attrs["Version"] = np.array([1, 0])
        group.attrs.create("Type", b"UnstructuredGrid", dtype="S16")
        for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"):
            group[name] = counts
        group["Points"] = points.astype(np.float32)
        group["Types"] = np.ones(len(points), dtype=np.uint8)
        group["Connectivity"] = np.concatenate([np.arange(count) for count in counts]).astype(
            np.int64
        )
        group["Offsets"] = np.concatenate([np.arange(count + 1) for count in counts]).astype(
            np.int64
        )
        for name, values in fields.items():
            group[f"PointData/{name}"] = values
        if input_text is not None:
            file["stirpoint/input"] = input_text


def write_tools(directory: Path, turns: int = 48) -> None:
    """A disc of the size of the shoulder, 1 mm in the plate, in every frame, as the program writes surfaces of tools."""
    around = np.arange(turns) * 2 * np.pi / turns
    ring = SHOULDER * np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    k = np.arange(turns)
    nxt = (k + 1) % turns
    low, high = 2 * turns, 2 * turns + 1  # the middles of the faces
    corners = np.concatenate([np.stack(c, axis=1) for c in (
        (k, nxt, nxt + turns), (k, nxt + turns, k + turns), (nxt, k, 0 * k + low), (k + turns, nxt + turns, 0 * k + high))])
    for path in sorted(directory.glob("*_0*.hdf")):
        with h5py.File(path) as file:
            middle = [0.020 + 0.005 * float(file.attrs["time"]), SIZE[1] / 2, SIZE[2] - 0.001]
        points = np.vstack([ring, ring + [0, 0, 0.012], [[0, 0, 0], [0, 0, 0.012]]])
        name, number = path.stem.rsplit("_", 1)
        with h5py.File(path.with_name(f"{name}_tools_{number}.hdf"), "w") as file:
            group = file.create_group("VTKHDF")
            group["Points"] = (points + middle).astype(np.float32)
            group["Connectivity"] = corners.ravel().astype(np.int64)
            group["PointData/azimuth"] = np.arctan2(points[:, 1], points[:, 0]).astype(np.float32)
            group["PointData/velocity"] = np.zeros((len(points), 3), dtype=np.float32)
            group["PointData/tool"] = np.ones(len(points), dtype=np.int32)


def write_series(directory: Path, name: str, times: list[float]) -> None:
    entries = [{"name": f"{name}_{k:06d}.hdf", "time": time} for k, time in enumerate(times)]
    (directory / f"{name}.hdf.series").write_text(
        json.dumps({"file-series-version": "1.0", "files": entries})
    )


def write_summary(directory: Path, **more) -> None:
    """The summary that a run writes at its end."""
    name = directory.name[: -len(".out")]
    (directory / f"{name}_summary.json").write_text(json.dumps({"steps": 3000} | more))


def stirred(start: np.ndarray, tool_x: float, progress: float, rng) -> tuple[np.ndarray, dict]:
    """Positions and fields when the tool has come to tool_x; progress 0 is the untouched plate."""
    points = start.copy()
    middle = SIZE[1] / 2
    y, depth = points[:, 1] - middle, SIZE[2] - points[:, 2]
    ahead = points[:, 0] - tool_x
    radius = np.hypot(ahead, y)
    behind = (points[:, 0] > 0.020) & (ahead < 0)
    trail = np.where(behind, np.abs(y), radius)
    # Hot: a decaying wake behind a moving source.
    wake = np.exp(
        -0.5
        * (np.sqrt(np.minimum(ahead, 0) ** 2 / 9 + np.maximum(ahead, 0) ** 2 + y**2) / 0.011) ** 2
    )
    temperature = AMBIENT + progress * (60 + 470 * wake * (1 - 0.25 * depth / SIZE[2]))
    # Stirred: a bowl of pin and shoulder.
    bowl = 0.003 + 0.006 * np.exp(-depth / 0.004)
    strain = progress * 45 * np.exp(-((trail / bowl) ** 4)) * np.exp(-((depth / 0.008) ** 4))
    strain *= rng.uniform(0.6, 1.4, len(points))
    if progress > 0:
        under = (trail < SHOULDER) & (depth < 0.004)
        rings = 0.00012 * np.sin(
            2 * np.pi * (points[:, 0] - np.sqrt(np.maximum(SHOULDER**2 - y**2, 0))) / 0.0024
        )
        points[under, 2] -= ((0.0007 + np.where(behind, rings, 0)) * (1 - depth / 0.004))[under]
        mixed = strain > 1
        points[mixed] += rng.normal(0, 0.0002, (mixed.sum(), 3)) * [1, 1, 0.5]
        rim = (
            (np.abs(trail - SHOULDER - 0.0006) < 0.0012)
            & (depth < 0.0012)
            & ((points[:, 0] > 0.012) & (ahead < SHOULDER))
        )
        side = np.where(y < 0, 1.0, 0.35)
        ragged = 0.6 + 0.4 * np.sin(points[:, 0] * 1900) * np.sin(points[:, 0] * 700 + 1)
        lift = 0.0030 * side * ragged * (1 - depth / 0.0013)
        points[rim, 2] += lift[rim]
        points[rim, 1] += (np.sign(y) * 0.6 * lift)[rim]
    fields = {
        "temperature": temperature.astype(np.float32),
        "plastic_strain": strain.astype(np.float32),
        "body": np.ones(len(points), dtype=np.int32),
        "id": np.arange(len(points)),
        "velocity": np.zeros((len(points), 3), dtype=np.float32),
    }
    return points, fields


def history_text(times: np.ndarray, rng) -> str:
    """A history with the columns of a friction stir run."""
    names = (
        "time[s],step,dt[s],kinetic[J],elastic[J],plastic_work[J],tool_work[J],friction_heat[J],"
        "audit_error[%],temperature_max[K],pin_torque[Nm],"
        "pin_force_x[N],pin_force_y[N],pin_force_z[N],"
        "pin_power[W],pin_friction_power[W],pin_friction_share[%],pin_interface_velocity[m/s],"
        "pin_x[m],pin_y[m],pin_z[m],pin_angle[rad],pin_tilt[rad],"
        "wall_zmin_force_x[N],wall_zmin_force_y[N],wall_zmin_force_z[N]"
    )
    rise = 1 - np.exp(-times / 1.5)
    torque = 38 * rise * (1 + 0.06 * rng.normal(size=len(times)))
    work = np.cumsum(torque * 83.8) * np.gradient(times)
    columns = [
        times,
        np.arange(len(times)),
        np.full_like(times, 1e-7),
        0.02 * rise,
        3 * rise,
        0.7 * work,
        work,
        0.3 * work,
        0.4 * rise,
        AMBIENT + 530 * rise,
        torque,
        900 * rise * (1 + 0.1 * rng.normal(size=len(times))),
        250 * rng.normal(size=len(times)),
        8200 * rise * (1 + 0.03 * rng.normal(size=len(times))),
        torque * 83.8,
        0.9 * torque * 83.8,
        30 * rise,
        0.4 * rise,
        0.020 + 0.005 * times,
        np.full_like(times, 0.02),
        np.full_like(times, SIZE[2]),
        83.8 * times,
        np.full_like(times, 0.05),
        *(force * rise for force in (900, 250, 9000)),
    ]
    rows = "\n".join(",".join(f"{value:.6E}" for value in row) for row in np.array(columns).T)
    return f"# Stirpoint history\n# SI units\n{names}\n{rows}\n"


def probes_text(times: np.ndarray, places: list) -> str:
    names = [f"T{k + 1}" for k in range(len(places))]
    header = ",".join(
        ["time[s]"] + [f"{n}[K]" for n in names] + [f"{n}_{a}[m]" for n in names for a in "xyz"]
    )
    rows = []
    for time in times:
        tool = 0.02 + 0.005 * time
        heat = [
            AMBIENT + 420 * np.exp(-(((tool - x) / 0.02) ** 2)) * 0.012 / abs(y - 0.02) * 0.7
            for x, y, _ in places
        ]
        rows.append(",".join(f"{v:.6E}" for v in [time, *heat, *np.ravel(places)]))
    return header + "\n" + "\n".join(rows) + "\n"


def make_run(
    directory: Path,
    spacing: float = 0.002,
    frames: int = 4,
    rows: int = 60,
    probes: bool = True,
    ranks: int = 2,
    attributes: dict | None = None,
    input_text: str = INPUT,
) -> Path:
    """A whole run directory NAME.out; returns it."""
    directory.mkdir(parents=True)
    name, rng = directory.name[: -len(".out")], np.random.default_rng(7)
    start, times = lattice(spacing), np.linspace(0, 12, frames)
    for k, time in enumerate(times):
        points, fields = stirred(start, 0.020 + 0.005 * time, min(1.0, time / 2), rng)
        write_frame(
            directory / f"{name}_{k:06d}.hdf", points, fields, time, 1000 * k, ranks, attributes, input_text
        )
    write_series(directory, name, list(times))
    (directory / f"{name}_history.csv").write_text(history_text(np.linspace(0, 12, rows), rng))
    if probes:
        (directory / f"{name}_probes.csv").write_text(
            probes_text(
                np.linspace(0, 12, rows),
                [(0.03, 0.008, 0.006), (0.05, 0.032, 0.006), (0.06, 0.008, 0.011)],
            )
        )
    return directory


if __name__ == "__main__":
    make_run(
        Path(sys.argv[1]),
        *(kind(text) * unit for kind, unit, text in zip((float, int), (1e-3, 1), sys.argv[2:])),
        rows=3000,
    )
