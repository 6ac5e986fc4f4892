# SPDX-License-Identifier: MIT
"""Default steps are stable whatever the lattice, cells, elasticity and method; a run whose physics has gone ends."""

import ctypes
import os
import random
import re
import subprocess

import driver
import numpy as np
import pytest

CELL = 1e-3  # [m]
BLOCK = driver.ROOT / "benchmarks/stability/block.nml"
METHODS = [{"METHOD.SHAPE": shape, "METHOD.SELECTIVE_SCALING": "off"} for shape in ("ugimp", "bspline", "cpgimp")] + [
    {"METHOD.SHAPE": "bspline", "METHOD.SELECTIVE_SCALING": "on"},
    {"METHOD.SHAPE": "ugimp", "METHOD.TRANSFER": "apic"},
    {"METHOD.SHAPE": "bspline", "METHOD.TRANSFER": "apic"},
    {"METHOD.SHAPE": "bspline", "METHOD.TRANSFER": "fmpm", "METHOD.ORDER": 2},
]


def drawn_block(draw, is_graded):
    """A free block of 4 x 4 x 4 cells at a drawn offset from the grid, which is uniform or graded, as overrides."""
    method = draw.choice([METHODS[1], METHODS[3]] if is_graded else METHODS)
    is_selective = method.get("METHOD.SELECTIVE_SCALING") == "on"
    edges = (1, 1, 1) if is_selective or is_graded else draw.choice([(1, 1, 1), (1, 1, 2), (2, 2, 1), (1, 1, 4), (4, 4, 1), (1, 2, 3)])
    counts = [draw.choice([2, 3, 4] if is_selective else [1, 1, 2, 3] if is_graded else [1, 1, 2, 3, 6]) for _ in range(3)]
    shift = [draw.random() for _ in range(3)]

    def text(*cells):
        return ",".join(str(n * edge * CELL) for n, edge in zip(cells, edges))

    graded = draw.choice(["x", "yz", "xyz"])
    ends = [draw.choice([-1, 0, 2, 4]) for _ in graded]
    grading = {"GRID.GRADED": graded, "GRID.FINE": ",".join(f"{end * CELL},{(end + draw.choice([0, 1, 2])) * CELL}" for end in ends),
               "GRID.GROWTH": draw.choice([1.2, 1.3, 1.3 if is_selective else 2.0]), "GRID.LARGEST_CELL": 8 * CELL}
    return method | (grading if is_graded else {}) | {
        "GRID.CELL": text(1, 1, 1), "GRID.LOWER": text(*(-9 - s for s in shift)), "GRID.UPPER": text(17, 17, 17),
        "SHAPE.UPPER": text(4, 4, 4), "BODY.CENTRE": text(2, 2, 2), "TIME.MAX_STEPS": 2000,
        "BODY.PARTICLES_PER_CELL": ",".join(map(str, counts)), "MATERIAL.POISSON_RATIO": draw.choice([0.1, 0.33, 0.45])}


def test_default_steps_are_stable(tmp_path):
    """The law of a free elastic body: its energy does not grow by more than 5 % in 2,000 default steps. Sixteen
    drawn blocks on uniform grids and eight on graded ones; STIRPOINT_SEED draws others."""
    draw = random.Random(int(os.environ.get("STIRPOINT_SEED", "1")))
    blocks = [drawn_block(draw, k >= 16) for k in range(24)]
    done = driver.run_all({k: ((BLOCK, "--quiet"), {"sets": sets}) for k, sets in enumerate(blocks)}, tmp_path)
    for k, sets in enumerate(blocks):
        assert done[k].status == driver.WELL, (sets, done[k].err)
        history = done[k].results("block").history()
        energy = history["kinetic[J]"] + history["elastic[J]"]
        assert energy.max() < 1.05 * energy[0], sets


@pytest.mark.parametrize("shape", ["bspline", "ugimp"])
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_fragments_are_stable(run, tmp_path, shape, seed):
    """The law of an elastic body that bounces off a face without friction: its energy does not grow. Drawn fragments and rods of one or two
    particles along two axes, which have modes of volume that no particle feels; the step of a large body gives them 3 to 7 times their energy."""
    draw = random.Random(seed)
    counts = [draw.choice([1, 2]), draw.choice([1, 2]), draw.choice([1, 2, 4, 8])]
    size = [0.5 * CELL * n for n in counts]
    low = [(3 + draw.random()) * CELL for _ in size]
    high = [x + edge for x, edge in zip(low, size)]
    (tmp_path / "scene.nml").write_text(f"""&GRID CELL = {CELL}, LOWER = 0, 0, 0, UPPER = {12 * CELL}, {12 * CELL}, {12 * CELL} /
&TIME END = 5e-4, MASS_SCALING = 100 /
&METHOD SHAPE = '{shape}', SELECTIVE_SCALING = 'off' /
&MATERIAL NAME = 'm', DENSITY = 2700, YOUNGS_MODULUS = 70e9, POISSON_RATIO = {draw.uniform(0.2, 0.4)} /
&BODY NAME = 'b', MATERIAL = 'm', VELOCITY = 0, 0, 6 /
&SHAPE BODY = 'b', LOWER = {str(low)[1:-1]}, UPPER = {str(high)[1:-1]} /
&TOOL NAME = 't', KIND = 'plane', POSITION = 0, 0, {high[2] + CELL}, NORMAL = 0, 0, -1, FRICTION = 0 /
&MOTION TOOL = 't' /
&OUTPUT HISTORY_INTERVAL = 1e-6 /
""")
    history = run("scene.nml", "--quiet").results("scene").history()
    energy = history["kinetic[J]"] + history["elastic[J]"]
    print(counts, energy.max() / energy[0], energy[-1] / energy[0])
    assert history["t_force_z[N]"].max() > 0.0
    assert energy.max() < 1.01 * energy[0]


@pytest.mark.parametrize("counts", ["1", "2,2,1", "1,1,2"])
def test_few_particles_balance(run, counts):
    """The law that the balance closes, with one particle in a cell along some axes: to 0.1 %."""
    history = run("stir", "--quiet", sets={"BODY.PARTICLES_PER_CELL": counts}).results("stir").history()
    assert history["tool_work[J]"][-1] > 100.0
    assert np.abs(history["audit_error[%]"]).max() < 0.1


@pytest.mark.parametrize("sets, what", [
    ({"BODY.PARTICLES_PER_CELL": 1}, "one particle in a cell along an axis"),
    ({"GRID.CELL": "4e-3,4e-3,2e-3"}, "cells that are no cubes"),
    ({"GRID.GRADED": "x", "GRID.FINE": "0,8e-3", "GRID.GROWTH": 2, "GRID.LARGEST_CELL": 16e-3}, "cells that grow by more than 0.3"),
])
def test_selective_scaling_is_refused(run, sets, what):
    """Where a free block gains energy with it."""
    done = run("stir", "--check=scene", sets=sets | {"METHOD.SELECTIVE_SCALING": "on"}, expect=driver.BAD_INPUT)
    assert f"SELECTIVE_SCALING = 'on': cannot be on with {what}" in done.err


def test_energy_from_nothing_ends_the_run(run):
    """A step that is twice too long: status 3, with the time since which the balance does not close."""
    done = run("stir", "--quiet", sets={"BODY.PARTICLES_PER_CELL": "2,2,1", "TIME.CFL": 0.7}, expect=driver.BROKEN)
    said = re.search(r"since t = ([\d.e-]+) s the energy balance does not close: (-?[\d.e+-]+) J, .*were created; .*CFL", done.err)
    history = done.results("stir").history()
    bad = np.abs(history["audit_error[%]"]) > 1.0
    assert said and float(said[1]) == pytest.approx(history["time[s]"][np.argmax(bad) - 1], rel=1e-4)
    assert np.abs(history["audit_error[%]"][:-1]).max() < 10.0   # the first row beyond it is the last


@pytest.mark.parametrize("law", ["shear-factor", "wanheim-bay"])
def test_law_of_friction_that_gives_none(run, law):
    """Exact: without friction there is no heat of it, and no force along the tool, but the tool presses and works."""
    sets = {"TOOL.FRICTION_LAW": law, "TOOL.SHEAR_FACTOR": 0, "MOTION(1).VELOCITY": "0,0,-8e-3"}
    history = run("stir", "--quiet", sets=sets).results("stir").history()
    assert history["friction_heat[J]"][-1] == pytest.approx(0.0, abs=1e-9 * history["tool_work[J]"][-1])
    assert history["tool_force_z[N]"].max() > 1e3 and history["tool_work[J]"][-1] > 1.0


def test_restart_does_not_adapt_mass(run, tmp_path):
    """A run whose mass scaling adapts, stopped on 2 ranks between two sorts and gone on with on 3: factors and
    plastic work as without the stop, but for rounding."""
    sets = {"TIME.MASS_SCALING": "1e5", "TIME.MASS_SCALING_RANGE": "1e4,1e7", "TIME.INERTIAL_FRACTION": 0.02, "TIME.END": 0.1,
            "MOTION(1).VELOCITY": "0,0,-8e-3", "METHOD.SORT_INTERVAL": 50}
    rows = {}
    for stop in (None, 130):
        place = tmp_path / str(stop)
        place.mkdir()
        first = run("stir", "--quiet", ranks=2, directory=place, sets=sets | ({"TIME.MAX_STEPS": stop} if stop else {}))
        if stop:
            run("stir", "--quiet", "--restart", first.results("stir").path("_checkpoint.h5"), ranks=3, directory=place, sets=sets)
        rows[stop] = first.results("stir").history()
    one, two = rows.values()
    assert two["mass_scaling"][-1] == pytest.approx(one["mass_scaling"][-1], rel=1e-6) and one["mass_scaling"][-1] != 1e5
    assert two["plastic_work[J]"][-1] == pytest.approx(one["plastic_work[J]"][-1], rel=1e-6)


def test_semaphore_of_a_killed_run(run):
    """What Open MPI's shared file pointers leave on a node when a run is killed does not hold up the next one."""
    name = f"/OMPIO_stir_{os.getpid()}_checkpoint.h5.tmp".encode()
    library = ctypes.CDLL("libpthread.so.0", use_errno=True)
    library.sem_open.restype = ctypes.c_void_p
    assert library.sem_open(name, os.O_CREAT, 0o600, 0)
    try:
        run("stir", "--quiet", sets={"RUN.NAME": f"stir_{os.getpid()}", "TIME.END": 0.005}, timeout=60)
    finally:
        library.sem_unlink(name)


def test_long_output_path(run, tmp_path):
    """A path of 240 letters."""
    place = tmp_path / ("d" * (240 - len(str(tmp_path))))
    run("stir", "--quiet", "--output", place, sets={"TIME.END": 0.005})
    assert (place / "stir_checkpoint.h5").exists()


def test_input_from_a_pipe(tmp_path):
    """Exact: an input that has no size is read to its end; lines may end with carriage returns alone."""
    text = driver.INPUTS.joinpath("stir.nml").read_text(encoding="utf-8")
    words = [driver.EXECUTABLE, "/dev/stdin", "--check=scene", "--output", "piped"]
    for end in "\n", "\r":
        done = subprocess.run(words, input=text.replace("\n", end).encode(), capture_output=True, cwd=tmp_path, env=driver.ENVIRONMENT, check=False)
        assert done.returncode == driver.WELL, done.stderr
    done = subprocess.run(words, input=text.replace("\n", "\r").replace("RADIUS", "RADIVS").encode(), capture_output=True, text=False, cwd=tmp_path,
                          env=driver.ENVIRONMENT, check=False)
    line = next(k for k, row in enumerate(text.splitlines(), 1) if "RADIUS" in row and "&TOOL" in row)
    assert done.returncode == driver.BAD_INPUT and f"/dev/stdin:{line}: error" in done.stderr.decode()


def test_end_before_the_checkpoint(run):
    done = run("stir", "--quiet", sets={"TIME.MAX_STEPS": 20})
    path = done.results("stir").path("_checkpoint.h5")
    again = run(None, "--restart", path, "--quiet", sets={"TIME.END": 1e-9, "TIME.MAX_STEPS": 40}, expect=driver.BAD_INPUT)
    assert re.search(r"&TIME END = 1e-0?9: lies before the [\d.e-]+ s of the checkpoint", again.err)
