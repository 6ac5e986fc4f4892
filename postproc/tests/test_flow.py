# SPDX-License-Identifier: MIT
"""Measures of flow of plates whose metal was moved by hand, particle by particle, so that all answers are counted."""

import json

import h5py
import numpy as np
import pytest
import synthetic

from stirpost.analysis.flow import Flow
from stirpost.cli import flow
from stirpost.io.frames import NoRun
from stirpost.io.scene import Scene, Solid, cavity_of
from stirpost.run import Run

H = 1e-3
SIZE = np.array([0.060, 0.030, 0.008])
CAVITY = np.array([[0.036, 0.012, 0.005], [0.042, 0.018, 0.008]])
RADIUS = 6e-3


def turn(x, quarter):
    """Points turned by quarters about z, plates then shifted to their first quadrant."""
    x = np.array(x, dtype=float, copy=True).reshape(-1, 3)
    for _ in range(quarter % 4):
        x[:, :2] = np.column_stack([-x[:, 1], x[:, 0]])
    return x


def text_of(quarter, cavity=True, more=""):
    def box(low, high):
        corners = turn([low, high], quarter)
        return ", UPPER = ".join(", ".join(f"{v:.9g}" for v in c) for c in (corners.min(axis=0), corners.max(axis=0)))
    text = f"&MATERIAL NAME = 'm', DENSITY = 1, {more} /\n&BODY NAME = 'plate', MATERIAL = 'm' /\n"
    text += f"&SHAPE BODY = 'plate', LOWER = {box([0, 0, 0], SIZE)} /\n"
    if cavity:
        text += f"&SHAPE BODY = 'plate', OPERATION = 'subtract', LOWER = {box(*CAVITY)} /\n"
    return text + f"&TOOL NAME = 'tool', RADIUS = {RADIUS} /\n"


def make(tmp_path, start, frames, quarter=0, spin=1.0, text=None, fields=None, way=(0.0, 0.050)):
    """A run of the plate: the tool goes along the middle from x = way[0] to way[1] in 10 s, clockwise if spin > 0;
    all then turned by quarters."""
    directory = tmp_path / "a.out"
    directory.mkdir()
    for k, (time, ids, points) in enumerate(frames):
        values = {"id": ids, "body": np.ones(len(ids), dtype=np.int32)}
        values |= (fields or {}).get(k, {})
        synthetic.write_frame(directory / f"a_{k:06d}.hdf", turn(points, quarter), values, time, input_text=text or text_of(quarter),
                              attributes={"spacing": [H], "cell": 2 * H, "body_names": np.array([b"plate"])})
    t = np.linspace(0.0, 10.0, 41)
    place = turn(np.column_stack([way[0] + (way[1] - way[0]) * t / 10, np.full(41, SIZE[1] / 2), np.full(41, SIZE[2])]), quarter)
    rows = [",".join(f"{v:.9g}" for v in (a, 5.0, 10.0, 0.0, 900.0, 100.0, *p, spin * 100.0 * a)) for a, p in zip(t, place)]
    heading = "time[s],tool_torque[Nm],tool_force_x[N],tool_force_y[N],tool_force_z[N],tool_power[W],tool_x[m],tool_y[m],tool_z[m],tool_angle[rad]"
    (directory / "a_history.csv").write_text("\n".join([heading, *rows]) + "\n")
    return Run(directory)


def plate(cavity=True):
    points = synthetic.lattice(H, SIZE)
    if cavity:
        points = points[~((points > CAVITY[0]) & (points < CAVITY[1])).all(axis=1)]
    return np.arange(1, len(points) + 1), points


def dug(random):
    """Particles of two layers of the groove, in random order, moved to: cavity, ridges on both sides, ends, sides,
    below, and a crumb that flies; the places, and what went where."""
    ids, start = plate()
    under = (start[:, 2] > SIZE[2] - 2 * H) & (np.abs(start[:, 1] - 0.015) < 0.005) & (start[:, 0] < 0.048)
    taken = random.permutation(np.flatnonzero(under))
    x = start.copy()
    cave = synthetic.lattice(H, CAVITY[1] - CAVITY[0]) + CAVITY[0]
    # as they lie: the two lower layers of the cavity, whole
    cave = cave[cave[:, 2] < CAVITY[0][2] + random.integers(1, 3) * H]
    def wall(n, low, size):
        return synthetic.lattice(H, size)[:n] + low
    n = {name: int(random.integers(20, 60)) for name in ("left", "right", "end", "side", "below")}
    goals = {
        "cavity": cave,
        "left": wall(n["left"], [0.010, 0.022, SIZE[2]], (0.02, 0.001, 0.004)),
        "right": wall(n["right"], [0.010, 0.007, SIZE[2]], (0.02, 0.001, 0.005)),
        "end": wall(n["end"], [-0.001, 0.010, 0.001], (0.001, 0.010, 0.006)),
        "side": wall(n["side"], [0.010, 0.030, 0.002], (0.020, 0.001, 0.003)),
        "below": wall(n["below"], [0.010, 0.010, -0.001], (0.01, 0.01, 0.001)),
        "debris": wall(3, [0.050, 0.002, 0.030], (0.003, 0.001, 0.001)),
    }
    at = 0
    for points in goals.values():
        x[taken[at:at + len(points)]] = points
        at += len(points)
    rest = taken[at:]   # stay; the groove is what was taken
    x[rest] = start[rest]
    return ids, start, x, {name: len(points) for name, points in goals.items()}


@pytest.mark.parametrize("quarter, spin", [(0, 1.0), (1, 1.0), (2, -1.0), (3, -1.0), (0, -1.0)])
def test_where_the_volume_went(tmp_path, quarter, spin):
    """Exact: volumes are counts of particles, in any direction of travel and spin; their sum is the groove."""
    random = np.random.default_rng(100 + quarter)
    ids, start, x, counts = dug(random)
    order = random.permutation(len(ids))
    run = make(tmp_path, start, [(0.0, ids, start), (10.0, ids[order], x[order])], quarter, spin)
    found = Flow(run, run.frames[-1]).measures(strain=1.0)
    volume = found["volumes"]
    advancing, retreating = ("left", "right") if spin > 0 else ("right", "left")
    expect = {"cavity": "cavity", "above_advancing": advancing, "above_retreating": retreating, "ends": "end", "sides": "side",
              "below": "below", "debris": "debris"}
    for name, goal in expect.items():
        assert volume[f"{name}[m3]"] == pytest.approx(counts[goal] * H**3, rel=2e-3), name
    assert volume["groove[m3]"] == pytest.approx(sum(counts.values()) * H**3, rel=2e-3)
    assert abs(volume["closure"]) < 2e-3 and volume["expansion[m3]"] == 0.0
    heights = {"left": 4 * H, "right": 5 * H}
    for side, goal in (("advancing", advancing), ("retreating", retreating)):
        assert found["flash"][f"height_{side}[m]"] == pytest.approx(min(heights[goal], counts[goal] * H), abs=1e-6)
    assert found["flash"]["debris_particles"] == 3
    cavity = found["cavity"]
    assert cavity["volume[m3]"] == pytest.approx(np.prod(CAVITY[1] - CAVITY[0]), rel=1e-6)
    assert cavity["filled"] == pytest.approx(counts["cavity"] * H**3 / cavity["volume[m3]"], rel=2e-3)
    quarters = [cavity[f"{a}_{b}[m3]"] for a in ("rear", "front") for b in ("advancing", "retreating")]
    assert quarters == pytest.approx([counts["cavity"] * H**3 / 4] * 4, rel=2e-3)


def test_a_frame_without_numbers_of_particles_is_named(tmp_path):
    ids, start = plate(False)
    run = make(tmp_path, start, [(t, ids, start) for t in (0.0, 5.0, 10.0)], text=text_of(0, False))
    with h5py.File(run.frames[1].path, "a") as file:
        del file["VTKHDF/PointData/id"]
    run = Run(run.directory)
    with pytest.raises(NoRun, match=r"a_000001.hdf: no field id"):
        run.flow().measures(whole=True)


def test_half_a_particle_counts_half(tmp_path):
    """Exact: a plate that is lifted by 0.4 of a particle has 0.4 layers above its face."""
    ids, start = plate(False)
    run = make(tmp_path, start, [(0.0, ids, start), (10.0, ids, start + [0, 0, 0.4 * H])], text=text_of(0, False))
    volume = Flow(run, run.frames[-1]).budget()
    above = volume["above_advancing[m3]"] + volume["above_retreating[m3]"]
    assert above == pytest.approx(0.4 * SIZE[0] * SIZE[1] * H, rel=1e-3)


def test_expansion_is_no_flash(tmp_path):
    """Exact: 300 K with 2e-5/K and 1 % of pressure over the bulk modulus make (e^0.018)(0.99) of the volume."""
    ids, start = plate(False)
    more = "EXPANSION = 2e-5, YOUNGS_MODULUS = 1e9, POISSON_RATIO = 0.25"
    hot = {0: {"temperature": np.full(len(ids), 300.0), "pressure": np.zeros(len(ids))},
           1: {"temperature": np.full(len(ids), 600.0), "pressure": np.full(len(ids), 0.01 * 1e9 / 1.5)}}
    run = make(tmp_path, start, [(0.0, ids, start), (10.0, ids, start + 1e-9)], text=text_of(0, False, more), fields=hot)
    volume = Flow(run, run.frames[-1]).budget()
    assert volume["expansion[m3]"] == pytest.approx(np.prod(SIZE) * (np.exp(0.018) * 0.99 - 1), rel=1e-4)


def test_displacement_of_layers(tmp_path):
    """Exact: the top layer goes by 3 mm to the advancing side, the next 1 mm along the travel, the others rest."""
    ids, start = plate(False)
    x = start.copy()
    layer = np.floor((SIZE[2] - start[:, 2]) / H).astype(int)
    x[layer == 0, 1] += 3e-3
    x[layer == 1, 0] += 1e-3
    half = start + 0.5 * (x - start) + np.where(layer == 0, 2e-3, 0.0)[:, None] * [1, 0, 0]
    run = make(tmp_path, start, [(0.0, ids, start), (5.0, ids, half), (10.0, ids, x)], text=text_of(0, False))
    top, second, third = Flow(run, run.frames[-1]).measures(whole=True)["layers"][:3]
    assert top["displacement_median[m]"] == pytest.approx(3e-3, rel=1e-4) and top["displacement_90[m]"] == pytest.approx(3e-3, rel=1e-4)
    assert top["of_moved_passed_to_advancing_side"] == pytest.approx(3 / 6) and top["of_moved_on_advancing_side"] == pytest.approx(9 / 12)
    assert top["path_max_diameters"] == pytest.approx(2 * np.hypot(1.5e-3, 2e-3) / (2 * RADIUS), rel=1e-4)
    assert second["ahead_max_diameters"] == pytest.approx(1e-3 / (2 * RADIUS), rel=1e-3)
    assert third["displacement_max[m]"] == pytest.approx(0.0, abs=1e-8) and third["of_moved_on_advancing_side"] is None
    chords = 2 * np.sqrt(RADIUS**2 - (np.arange(-5.5, 6) * H) ** 2)
    assert top["time_under_tool_mean[s]"] == pytest.approx(chords.mean() / 5e-3, rel=1e-6)


def test_mixing_of_two_bodies(tmp_path):
    """Exact: of two plates side by side a block of 6 mm3 of each changes places with the other, 3 mm deep; the rest stays."""
    ids, start = plate(False)
    far = start[:, 1] > SIZE[1] / 2
    x = start.copy()
    block = (np.abs(start[:, 1] - SIZE[1] / 2) < 3e-3) & (start[:, 0] < 2e-3) & (start[:, 2] > SIZE[2] - H)
    x[block, 1] += np.where(far[block], -3e-3, 3e-3)
    text = "&MATERIAL NAME = 'm', DENSITY = 1 /\n&BODY NAME = 'near', MATERIAL = 'm' /\n&BODY NAME = 'far', MATERIAL = 'm' /\n"
    directory = tmp_path / "b.out"
    directory.mkdir()
    for k, (time, points) in enumerate(((0.0, start), (1.0, x))):
        synthetic.write_frame(directory / f"b_{k:06d}.hdf", points, {"id": ids, "body": np.where(far, 2, 1).astype(np.int32)}, time,
                              input_text=text, attributes={"spacing": [H, H], "cell": 2 * H, "body_names": np.array([b"near", b"far"])})
    run = Run(directory)
    one, other = Flow(run, run.frames[-1]).measures()["mixing"]
    assert (one["body"], one["where"], other["body"], other["where"]) == ("near", "far", "far", "near")
    for pair in (one, other):
        assert pair["volume[m3]"] == pytest.approx(6e-9, rel=1e-4) and pair["depth_max[m]"] == pytest.approx(2.5e-3, rel=1e-3)


def test_stir_zone_and_isotherms(tmp_path):
    """Exact: a stirred half disc 3 mm deep, an isotherm that encloses it: counted particles of a slab."""
    random = np.random.default_rng(7)
    ids, start = plate(False)
    depth, width = random.integers(2, 5) * H, random.integers(2, 5) * 2 * H
    stirred = (start[:, 2] > SIZE[2] - depth) & (np.abs(start[:, 1] - 0.015) < width / 2)
    warm = (start[:, 2] > SIZE[2] - depth - H) & (np.abs(start[:, 1] - 0.015) < width / 2)
    fields = {1: {"plastic_strain": np.where(stirred, 1.5, 0.5), "temperature": np.where(warm, 760.0, 700.0)},
              2: {"plastic_strain": np.where(stirred, 1.5, 0.5), "temperature": np.full(len(ids), 400.0)}}
    fields[0] = {"plastic_strain": np.zeros(len(ids)), "temperature": np.full(len(ids), 300.0)}
    frames = [(0.0, ids, start), (5.0, ids, start + 1e-8), (10.0, ids, start + 1e-8)]
    run = make(tmp_path, start, frames, text=text_of(0, False), fields=fields)
    (zone,) = Flow(run, run.frames[-1]).measures([0.0255], 1.0, [748.0], whole=True)["stir_zone"]
    assert zone["depth[m]"] == pytest.approx(depth, rel=1e-3) and zone["width[m]"] == pytest.approx(width, rel=1e-3)
    assert zone["area[m2]"] == pytest.approx(depth * width, rel=1e-3)
    (iso,) = zone["isotherms"]
    assert iso["depth[m]"] == pytest.approx(depth + H, rel=1e-3) and iso["share_of_stir_zone"] == pytest.approx(1.0)


def test_command(tmp_path, capsys):
    """flow.json is what --json prints; the picture of the cavity is there; lines name all."""
    ids, start, x, _ = dug(np.random.default_rng(3))
    run = make(tmp_path, start, [(0.0, ids, start), (10.0, ids, x)])
    assert flow.main([str(run.directory), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((run.directory / "report/flow.json").read_text())
    assert (run.directory / "report/flow_cavity.png").stat().st_size > 5000
    assert flow.main([str(run.directory)]) == 0
    out = capsys.readouterr().out
    assert "cavity: filled" in out and "Displacement along the plate" in out


def test_a_way_that_bends_is_refused(tmp_path):
    ids, start = plate(False)
    run = make(tmp_path, start, [(0.0, ids, start), (10.0, ids, start + 1e-6)], text=text_of(0, False))
    run.history.frame.loc[20:30, "tool_y"] += 3e-3
    with pytest.raises(ValueError, match="not straight"):
        Flow(run, run.frames[-1])


def test_trapezoid_cylinder_and_sphere():
    """Exact: volumes of cavities; 1290 mm3 of the trapezoid 20 mm long, 7.5 to 14 mm wide, 6 mm deep."""
    base = "&BODY NAME = 'p' /\n&SHAPE BODY = 'p', LOWER = 0,0,0, UPPER = .1,.04,.012 /\n&SHAPE BODY = 'p', OPERATION = 'subtract', "
    cuts = {
        "KIND = 'trapezoid', LOWER = .04,.013,.006, UPPER = .06,.027,.012, ALONG = 'x', ACROSS = 'y', WIDTH_LOWER = 7.5e-3, WIDTH_UPPER = 14e-3 /":
            1290e-9,
        "KIND = 'cylinder', CENTRE = .05,.02,.012, RADIUS = 5e-3, LENGTH = 12e-3 /": np.pi * 25e-6 * 6e-3,
        "KIND = 'sphere', CENTRE = .05,.02,.012, RADIUS = 5e-3 /": 2 / 3 * np.pi * 125e-9,
    }
    for text, volume in cuts.items():
        assert cavity_of(Scene(base + text), ["p"]).volume(1e-4) == pytest.approx(volume, rel=5e-3)
    for text in ("", base.partition("&SHAPE")[0], base.rpartition("&SHAPE")[0], base + "LOWER = .2,.2,.2, UPPER = .3,.3,.3 /", base + "KIND = 'stl' /",
                 base.replace("&SHAPE", "&NONE", 1) + "LOWER = .04,.013,.006, UPPER = .06,.027,.012 /"):
        assert not cavity_of(Scene(text), ["p"])
    wide = Solid(dict(kind="trapezoid", lower=[0, 0, 0], upper=[1, 1, 1], along="x", across="y", width_lower=0.2, width_upper=1.0))
    assert wide.holds(np.array([[0.01, 0.5, 0.5], [0.01, 0.7, 0.5], [0.99, 0.9, 0.5]])).tolist() == [True, False, True]
