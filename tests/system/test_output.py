# SPDX-License-Identifier: MIT
"""What a run writes, and what the program says about itself."""

import json
import re

import driver
import h5py
import numpy as np
import pytest

UNITS = {"x": "m", "temperature": "K", "plastic_strain": "1", "strain_rate": "1/s", "flow_stress": "Pa",
         "pressure": "Pa", "von_mises": "Pa", "stress": "Pa", "velocity": "m/s", "body": "1", "material": "1", "id": "1"}


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    directory = tmp_path_factory.mktemp("small")
    return driver.run("small", directory=directory)


def test_frames_are_vtkhdf(small):
    """Exact: three frames (t = 0, 1e-6, 2e-6 s) of 640 particles, VTKHDF 1.0 UnstructuredGrid of vertices,
    every field with its unit, float32; time [s], step, cell [m], spacing [m], names and the input inside."""
    results = small.results("small")
    files = sorted(results.directory.glob("small_0*.hdf"))
    assert [f.name for f in files] == [f"small_{k:06d}.hdf" for k in range(3)]
    for path in files:
        with h5py.File(path, "r") as file:
            group = file["/VTKHDF"]
            assert list(group.attrs["Version"]) == [1, 0]
            assert bytes(group.attrs["Type"]) == b"UnstructuredGrid"
            n = int(group["NumberOfPoints"][:].sum())
            assert n == 640 == int(group["NumberOfCells"][:].sum())
            assert n == int(group["NumberOfConnectivityIds"][:].sum())
            assert group["Points"].shape == (n, 3) and group["Points"].dtype == np.float32
            assert np.all(group["Types"][:] == 1)
            assert np.array_equal(group["Connectivity"][:], np.arange(n))
            assert np.array_equal(group["Offsets"][:], np.arange(n + 1))
            text = file["/stirpoint/input"][()]
            text = text.decode() if isinstance(text, bytes) else str(np.asarray(text).item(), "utf-8")
            assert "&MATERIAL" in text and "YOUNGS_MODULUS = 124e9" in text
        data, units, attributes = driver.read_frame(path)
        assert units == UNITS
        assert sorted(np.unique(data["id"])) == sorted(data["id"])
        assert set(data["body"]) == {1, 2} and np.sum(data["body"] == 2) == 256
        assert attributes["cell"] == 1e-3 and np.all(attributes["spacing"] == 0.5e-3)
    first, _, attributes = driver.read_frame(files[0])
    assert attributes["time"] == 0.0 and attributes["step"] == 0
    assert np.all(first["temperature"][first["body"] == 1] == 300.0)
    assert np.all(first["temperature"][first["body"] == 2] == 400.0)
    assert np.all(first["velocity"] == 0.0) and np.all(first["von_mises"] == 0.0)
    assert first["x"].min(axis=0) == pytest.approx([2.25e-3] * 3, rel=1e-6)
    assert first["x"].max(axis=0) == pytest.approx([5.75e-3, 5.75e-3, 6.75e-3], rel=1e-6)


@pytest.mark.parametrize("ranks", [1, 2])
def test_vtk_reads_names_units_and_time(run, ranks):
    """A single frame says in VTK's field data what bodies and materials its numbers mean, its time and its units; with
    INITIAL_POSITION where each particle began."""
    vtk = pytest.importorskip("vtk")
    results = run("small", "--quiet", ranks=ranks, sets={"OUTPUT.INITIAL_POSITION": "T"}).results("small")

    def read(path):
        reader = vtk.vtkHDFReader()
        reader.SetFileName(str(path))
        reader.Update()
        fields = reader.GetOutputDataObject(0).GetFieldData()
        arrays = [fields.GetArray(k) for k in range(fields.GetNumberOfArrays())]
        return {array.GetName(): array.GetValue(0) for array in arrays}

    notes = read(results.path("_000002.hdf"))
    assert notes["TimeValue"] == results.series()["files"][2]["time"]
    assert notes["unit of velocity: m per s"] == 1.0 and notes["unit of temperature: K"] == 1.0
    first, _, attributes = driver.read_frame(results.path("_000000.hdf"))
    last, units, _ = driver.read_frame(results.path("_000002.hdf"))
    names = [bytes(name).decode() for name in attributes["body_names"]]
    made_of = [bytes(name).decode() for name in attributes["material_names"]]
    assert len(names) == len(made_of) == 2
    for k, (name, material) in enumerate(zip(names, made_of), 1):
        assert notes[f"body {k}: {name}"] == k
        assert notes[f"material of {name}: {material}"] == last["material"][last["body"] == k][0]
    assert units["initial_position"] == "m"
    a, b = np.argsort(first["id"]), np.argsort(last["id"])
    assert np.array_equal(first["x"][a], last["initial_position"][b])
    assert np.abs(last["x"][b] - first["x"][a]).max() > 0
    notes = read(results.path("_tools_000002.hdf"))
    assert notes["TimeValue"] == results.series()["files"][2]["time"] and notes["tool 1: punch"] == 1


def test_initial_positions_go_on_after_a_restart(run, tmp_path):
    """Kept in checkpoints; a restart cannot ask for what was not kept."""
    keep = {"OUTPUT.INITIAL_POSITION": "T"}
    results = run("small", "--quiet", sets=keep).results("small")
    begin = driver.read_frame(results.path("_000000.hdf"))[0]
    run(None, "--quiet", "--restart", results.path("_checkpoint.h5"), sets={"TIME.END": 4e-6})
    last = driver.read_frame(results.path("_000004.hdf"))[0]
    a, b = np.argsort(begin["id"]), np.argsort(last["id"])
    assert np.array_equal(begin["x"][a], last["initial_position"][b])
    done = run(None, "--restart", results.path("_checkpoint.h5"), sets={"OUTPUT.INITIAL_POSITION": "F", "TIME.END": 5e-6},
               expect=driver.BAD_INPUT)
    assert "&OUTPUT INITIAL_POSITION = F: a restart cannot change it" in done.err


def test_frames_on_two_ranks(run, small):
    """Exact: on 2 ranks the frames hold two pieces and the same particles."""
    results = run("small", "--quiet", ranks=2).results("small")
    path = results.path("_000002.hdf")
    with h5py.File(path, "r") as file:
        pieces = file["/VTKHDF/NumberOfPoints"][:]
        assert len(pieces) == 2 and pieces.sum() == 640
        assert len(file["/VTKHDF/Offsets"][:]) == 640 + 2
    one = driver.read_frame(small.results("small").path("_000002.hdf"))[0]
    two = driver.read_frame(path)[0]
    a, b = np.argsort(one["id"]), np.argsort(two["id"])
    assert np.array_equal(one["id"][a], two["id"][b])
    assert np.allclose(one["x"][a], two["x"][b], rtol=1e-6)
    assert np.allclose(one["temperature"][a], two["temperature"][b], rtol=1e-6)


def test_tools_are_a_series_of_their_own(run, small):
    """The ball of small.nml in each frame: where its history says, closed, with its velocity; the same from 2 ranks."""
    results = small.results("small")
    series = json.loads(results.path("_tools.hdf.series").read_text())["files"]
    assert [entry["time"] for entry in series] == [entry["time"] for entry in results.series()["files"]]
    other = run("small", "--quiet", ranks=2).results("small")
    history = results.history()
    for entry in series:
        with h5py.File(results.directory / entry["name"], "r") as file, h5py.File(other.directory / entry["name"], "r") as two:
            points = file["VTKHDF/Points"][:].astype(float)
            assert np.array_equal(file["VTKHDF/Points"][:], two["VTKHDF/Points"][:])
            assert np.array_equal(file["VTKHDF/Connectivity"][:], two["VTKHDF/Connectivity"][:])
            assert int(two["VTKHDF/NumberOfCells"][:].sum()) == len(two["VTKHDF/Types"])
            triangles = file["VTKHDF/Connectivity"][:].reshape(-1, 3)
            assert file.attrs["time"] == pytest.approx(entry["time"], rel=1e-14) and bytes(file.attrs["tool_names"][0]).strip() == b"punch"
            assert file["VTKHDF/PointData/velocity"].attrs["units"] in (b"m/s", "m/s")
            assert np.allclose(file["VTKHDF/PointData/velocity"][:], [0.0, 0.0, -10.0])
            assert set(file["VTKHDF/PointData/tool"][:]) == {1}
        z = np.interp(entry["time"], history["time[s]"], history["punch_z[m]"])
        assert np.linalg.norm(points - [4e-3, 4e-3, z], axis=1) == pytest.approx(2e-3, rel=1e-5)
        a, b, c = (points[triangles[:, k]] - [4e-3, 4e-3, z] for k in range(3))
        volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
        assert volume == pytest.approx(4.0 / 3.0 * np.pi * 2e-3**3, rel=5e-3)


def test_the_stress_is_the_tensor_behind_pressure_and_von_mises(run):
    """After some steps the pressure is -tr/3 and von Mises stress sqrt(3/2) of the deviator's norm."""
    results = run("small", "--quiet", sets={"TIME.END": 2e-5, "OUTPUT.FRAME_INTERVAL": 0}).results("small")
    data, units, _ = driver.read_frame(sorted(results.directory.glob("small_0*.hdf"))[-1])
    stress = data["stress"].astype(float)
    mean = stress[:, :3].mean(axis=1)
    shear = stress[:, 3:]
    mises = np.sqrt(1.5 * (((stress[:, :3] - mean[:, None]) ** 2).sum(axis=1) + 2.0 * (shear**2).sum(axis=1)))
    assert units["stress"] == "Pa" and data["von_mises"].max() > 1e6
    assert data["pressure"] == pytest.approx(-mean, rel=1e-3, abs=1e-4 * float(data["von_mises"].max()))
    assert data["von_mises"] == pytest.approx(mises, rel=1e-3, abs=1e-4 * float(data["von_mises"].max()))


def test_series_lists_the_frames(small):
    """Exact: small.hdf.series names every frame with the time [s] that stands in it."""
    results = small.results("small")
    series = results.series()
    assert series["file-series-version"] == "1.0"
    assert [f["name"] for f in series["files"]] == [f"small_{k:06d}.hdf" for k in range(3)]
    for entry in series["files"]:
        time = driver.read_frame(results.directory / entry["name"])[2]["time"]
        assert entry["time"] == pytest.approx(time, rel=1e-14, abs=0.0)
    times = [f["time"] for f in series["files"]]
    assert times[0] == 0.0 and 1e-6 <= times[1] < 1.1e-6 and times[2] == pytest.approx(2e-6, rel=1e-12)


def test_histories(small):
    """Exact: rows every 1e-7 s from 0 to 2e-6 s (21, +1 for the last), every column named with its unit in
    brackets, every number finite, time and step rising, ten columns of the tool's load and five of its pose."""
    history = small.results("small").history()
    assert history.text.startswith("# Small\n")
    for name in history.names:
        assert name in ("step", "mass_scaling") or re.fullmatch(r"[A-Za-z0-9_]+\[[^\]]+\]", name), name
    for name in ("time[s]", "kinetic[J]", "elastic[J]", "plastic_work[J]", "tool_work[J]", "friction_heat[J]",
                 "audit_error[%]", "heat_content[J]", "temperature_max[K]", "punch_torque[Nm]", "punch_force_z[N]",
                 "punch_power[W]"):
        assert name in history.names
    assert sum(name.startswith("punch_") for name in history.names) == 15
    assert 20 <= len(history.rows) <= 22
    assert history["time[s]"][0] == 0.0
    assert history["time[s]"][-1] == pytest.approx(2e-6, rel=1e-12)
    assert np.all(np.diff(history["time[s]"]) > 0.0) and np.all(np.diff(history["step"]) > 0)
    assert np.isfinite(history.rows).all()
    heat = 8960.0 * 386.0 * 0.5e-3**3 * (384 * 300.0 + 256 * 400.0)
    assert history["heat_content[J]"][0] == pytest.approx(heat, rel=1e-9)
    assert np.all(history["temperature_max[K]"] >= 400.0)


@pytest.mark.parametrize("ranks", [None, 2])
def test_sums_of_a_tool(run, ranks):
    """Exact to the digits of the history: every sum of the table in tools/sums.f90 is in the checkpoint under its name and unit, and its
    column in a history of one interval is the sum over its weight, or over the time."""
    end = 0.04
    done = run("stir", "--quiet", ranks=ranks, sets={
        "TIME.END": end, "TOOL.FRICTION": 0.8, "MOTION(1).VELOCITY": "0,0,-20e-3", "MOTION(1).DURATION": 0.03, "OUTPUT.HISTORY_INTERVAL": end,
        "OUTPUT.CHECKPOINT_INTERVAL": end}).results("stir")
    history, state = done.history(), done.checkpoint()
    table = re.search(r"tool_sum_of\(\*\) = \[(.*?)\]\n", (driver.ROOT / "modules/tools/sums.f90").read_text(encoding="utf-8"), re.S)[1]
    rows = [re.findall(r"'([^']*)'", line) for line in re.findall(r"tool_sum_t\((.*)\)", table)]
    total = {name: state.of_ranks(f"{name} of a tool [{unit}]") for name, unit, *_ in rows}
    assert len(history.rows) == 2 and len(total) == len(rows) and total["layer_work"] > 0.0
    for name, _, column, unit, *over in (row for row in rows if row[2:]):
        assert history[f"tool_{column}[{unit}]"][-1] == pytest.approx(total[name] / (total[over[0]] if over else end), rel=1e-5), name


def test_probes(small):
    """Exact: in every row, the first too, the probe in the block reads 300 K and the one in the lid 400 K (both
    far from the interface for 2 us, to 1 K); their places start as given [m]."""
    probes = small.results("small").probes()
    assert probes.names[:3] == ["time[s]", "inside[K]", "lid[K]"]
    assert np.array_equal(probes["time[s]"], small.results("small").history()["time[s]"])
    assert [probes[f"lid_{a}[m]"][0] for a in "xyz"] == pytest.approx([4e-3, 4e-3, 6.2e-3], rel=1e-9)
    assert probes["inside[K]"] == pytest.approx(300.0, abs=1.0)
    assert probes["lid[K]"][1:] == pytest.approx(400.0, abs=1.0)
    assert probes["lid[K]"][0] == pytest.approx(400.0, abs=1.0)


def test_moving_body_has_a_finite_history(run):
    """Exact: a block that flies and has no internal energy: every number of its history is finite."""
    history = run("punch", "--quiet", sets={"TIME.END": 1e-5}).results("punch").history()
    bad = [name for name in history.names if not np.isfinite(history[name]).all()]
    assert bad == []


def test_summary(small):
    """Exact: small_summary.json is JSON with the particles, steps and ranks of the run."""
    summary = json.loads(small.results("small").path("_summary.json").read_text())
    assert summary["particles"] == 640 and summary["ranks"] == 1
    assert summary["steps"] == small.results("small").history()["step"][-1]
    assert summary["wall_seconds"] >= 0.0
    assert sum(summary["phase_percent"].values()) == pytest.approx(100.0, abs=1.0)


def test_summary_of_heat_alone(run, small):
    """Exact: the summary of a run without mechanics names its program and cost like that of a run with it."""
    both = [json.loads(done.results(name).path("_summary.json").read_text())
            for done, name in ((small, "small"), (run("heat_slab", "--quiet", sets={"TIME.MAX_STEPS": 2}), "heat_slab"))]
    for key in ("version", "commit", "finished", "ranks", "steps", "wall_seconds", "cpu_seconds", "peak_memory_bytes"):
        assert type(both[0][key]) is type(both[1][key]), key
    assert both[0]["commit"] == both[1]["commit"]


def test_nothing_else_is_written(small):
    """Exact: only small.out with the files that --help names."""
    assert [p.name for p in small.directory.iterdir()] == ["small.out"]
    names = {re.sub(r"[0-9]{6}", "N", p.name) for p in (small.directory / "small.out").iterdir()}
    assert names == {"small_history.csv", "small_probes.csv", "small_N.hdf", "small.hdf.series",
                     "small_tools_N.hdf", "small_tools.hdf.series",
                     "small_summary.json", "small_run.txt", "small_input.nml", "small.log", "small_checkpoint.h5"}


def test_quiet(run, small):
    """Exact: --quiet prints where the results are, no more, where there is nothing to warn of."""
    done = run("small", "--quiet", sets={"MATERIAL.CONDUCTIVITY": 391})
    assert done.out == "results in small.out\n" and done.err == ""
    assert small.out.splitlines()[-1] == "results in small.out"


def test_progress(run):
    """Exact: with PROGRESS_INTERVAL = 0.02 s a run of more than 0.1 s prints lines of percent, step, t [s], dt
    [s], speed and time left; percent and step rise."""
    sets = {"OUTPUT.PROGRESS_INTERVAL": 0.02, "OUTPUT.FRAME_INTERVAL": 0}
    done = run("stir", sets=sets | {"TIME.END": 0.1})
    pattern = r" *([0-9.]+) %  left \S+ \S+  t = (\S+) s  step ([0-9]+)  dt = (\S+) s  (\S+) M particle-steps/s$"
    lines = [re.match(pattern, line) for line in done.out.splitlines()]
    lines = [m for m in lines if m]
    assert len(lines) >= 3
    steps = [int(m[3]) for m in lines]
    assert steps == sorted(set(steps))
    for m in lines:
        assert float(m[1]) == pytest.approx(100.0 * float(m[2]) / 0.1, abs=0.1)


def test_output_directory(run, tmp_path):
    """Exact: --output DIR puts everything there; a second run over it replaces its files."""
    for _ in range(2):
        done = run("small", "--quiet", "--output", "elsewhere")
        assert [p.name for p in tmp_path.iterdir()] == ["elsewhere"]
        results = driver.Results(done.directory / "elsewhere", "small")
        assert len(results.series()["files"]) == 3
        assert np.all(np.diff(results.history()["time[s]"]) > 0.0)


def test_shorter_run_leaves_no_old_frames_in_the_series(run):
    """Exact: a run of half the time over an older one lists only its own two frames."""
    run("small", "--quiet")
    results = run("small", "--quiet", sets={"TIME.END": 1e-6}).results("small")
    assert len(results.series()["files"]) == 2
    assert results.history()["time[s]"][-1] == pytest.approx(1e-6)


def test_name_and_output_that_cannot_be(run, tmp_path):
    """Exact: RUN NAME is the stem of all files; a directory that cannot be made is status 4."""
    run("small", "--quiet", sets={"RUN.NAME": "other"})
    assert (tmp_path / "other.out" / "other_history.csv").exists()
    done = run("small", "--quiet", "--output", "/proc/nowhere", expect=4)
    assert "error: cannot make directory /proc/nowhere" in done.err


def test_frames_switched_on_at_a_restart(run):
    """Exact: a run without frames in between, continued with FRAME_INTERVAL = 2e-6 s, writes frames at 4, 6
    and 8e-6 s (to a step) besides the first: five in all with the last."""
    half = {"TIME.END": 4e-6, "OUTPUT.CHECKPOINT_INTERVAL": 2e-6}
    results = run("crumb", "--quiet", sets=half).results("crumb")
    sets = {"OUTPUT.FRAME_INTERVAL": 2e-6}
    run("crumb", "--quiet", "--restart", results.path("_checkpoint.h5"), sets=sets)
    times = [entry["time"] for entry in results.series()["files"]]
    print(times)
    assert any(5.9e-6 < t < 6.2e-6 for t in times)
    assert times[-1] == pytest.approx(8e-6, rel=1e-12)


def test_version(run, tmp_path):
    """Exact: --version names the program, a version a.b.c, and the compiler."""
    done = run(None, "--version")
    assert re.match(r"Stirpoint [0-9]+\.[0-9]+\.[0-9]+", done.out)
    assert "GCC" in done.out or "ifx" in done.out.lower() or "nvfortran" in done.out
    assert done.err == "" and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help(run, option):
    """Exact: --help lists every option, the results, the signals and the exit statuses."""
    done = run(None, option)
    for word in ("--check", "--set", "--restart", "--output", "--quiet", "--keys", "--version", "--help",
                 "SIGUSR1", "SIGTERM", "exit status", "_history.csv", "_probes.csv", "_checkpoint.h5"):
        assert word in done.out, word
    assert done.err == ""
    assert max(len(line) for line in done.out.splitlines()) <= 100


def test_keys_list_every_key(run):
    """Exact: --keys lists every group and key that any input uses, with type, default and text; the Markdown
    page has the same groups and keys."""
    done = run(None, "--keys")
    keys, group = {}, None
    for line in done.out.splitlines():
        if line.startswith("&"):
            group = line[1:].split()[0]
            keys[group] = []
        elif re.match(r"  [A-Z]", line):
            keys[group].append(line.split()[0])
            assert len(line.split(None, 3)) == 4, line
    used = 0
    for path in [*driver.INPUTS.glob("*.nml"), *(driver.ROOT / "input").glob("*.nml")]:
        text = re.sub(r"'[^'\n]*'", "''", re.sub(r"!.*", "", path.read_text()))
        for name, body in re.findall(r"&([A-Z]+)(.*?)/", text, re.DOTALL):
            for key in re.findall(r"([A-Z0-9_]+)\s*=", body):
                assert key in keys[name], (name, key)
                used += 1
    assert used > 200
    markdown = run(None, "--keys=markdown").out
    kept = (driver.ROOT / "docs/input.md").read_text()
    assert markdown == kept, "stirpoint --keys=markdown > docs/input.md"
    for name, list_of_keys in keys.items():
        assert f"&{name}" in markdown or name in markdown
        for key in list_of_keys:
            assert key in markdown, key
