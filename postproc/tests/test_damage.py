# SPDX-License-Identifier: MIT
"""Every command on damaged files: one line that names the file and a status, or the rest of the work with a warning."""

import io
import os
import random
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic
from PIL import Image

from stirpost import cli
from stirpost.plots import canvas, look, maps

SEED = 20
SOLVER = """#!/bin/sh
# Gives the run that is kept, whatever is asked.
trap '' XFSZ
folder=run
for word; do
  [ "$last" != --output ] || place=$word
  [ "$word" != --material ] || folder=curves
  last=$word
done
[ -z "$place" ] || {{ mkdir -p "$place" && cp -RP {kept}/$folder/. "$place"; }}
"""
# Words of a command by name; {run}, {record}, {curves}, {law}, {input}, {solver}, {out}: files.
COMMANDS = {
    "report": "report {run} --measured {record} -o {out}",
    "flow": "flow {run} -o {out}",
    "section": "section {run} --x 40e-3 -o {out}",
    "track": "track {run} 7 {out}/track.csv",
    "tracks": "tracks {run} -o {out}",
    "film": "film {run} -o {out}/film.webp",
    "calculix": "calculix {run} --strength 300=200 --expansion 1e-5 -o {out}/plate.inp",
    "compare": "compare {run} {run} -o {out}",
    "compare machine": "compare {run} --machine {record} -o {out}",
    "sweep": "sweep {input} --set TOOL.FRICTION=.1,.2 --program {solver} -o {out}",
    "calibrate run": "calibrate run {input} {record} --vary TOOL.FRICTION=.2,.1,.3 --runs 3 --program {solver} -o {out}",
    "calibrate law": "calibrate law {input} {law} --material copper --fit ST_N=5 -o {out}",
    "calibrate heat film": "calibrate heat film {record} --from 1 --density 8960 --specific-heat 386 --volume 1e-4 --area 1e-2",
    "calibrate heat fit": "calibrate heat fit {input} {record} --vary TOOL.FRICTION=.2,.1,.3 --program {solver}",
    "material": "material {curves} -o {out}",
    "heat": "heat {heated} {heated} -o {out} --times 6",
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """All files that commands read, without damage, in one folder."""
    folder = tmp_path_factory.mktemp("sound")
    text = ("&TIME\n  END = 12 /\n&BODY NAME = 'plate', MATERIAL = 'copper' /\n&MATERIAL NAME = 'copper', YOUNGS_MODULUS = 1e11 /\n"
            "&SHAPE BODY = 'plate', LOWER = 0, 0, 0, UPPER = 0.1, 0.04, 0.012 /\n&TOOL NAME = 'pin', RADIUS = 9e-3 /\n")
    run = synthetic.make_run(folder / "plate.out", spacing=0.004, frames=3, rows=30, input_text=text,
                             attributes={"body_names": [b"plate"], "spacing": 0.004, "cell": 0.008})
    for path in run.glob("*_0*.hdf"):
        with h5py.File(path, "a") as file:
            count = len(file["VTKHDF/Points"])
            file["VTKHDF/PointData/grain_size"] = np.full(count, 1e-5)
            file["VTKHDF/PointData/dislocation_density"] = np.full(count, 1e12)
    synthetic.write_tools(run)
    synthetic.write_summary(run, hottest_over_melting_K=3.0, melted_share_max=0.001)
    (run / "plate_input.nml").write_text(text)
    tracers = [f"{t},line,{n},{n},plate,{0.01 * n + 1e-3 * t},0.02,0.01,{300 + t},{0.1 * t}" for t in range(4) for n in (1, 2)]
    (run / "plate_tracers.csv").write_text("# tracers\ntime[s],group,tracer,id,body,x[m],y[m],z[m],temperature[K],plastic_strain[1]\n"
                                           + "\n".join(tracers) + "\n")
    rows = [f"{t:g},{500 * np.exp(-0.05 * t) + 300:.2f},{30 + 0.1 * t:.2f}" for t in np.linspace(0.5, 11.5, 12)]
    (folder / "record.csv").write_text("time[s],T1[K],pin_torque[N m]\n" + "\n".join(rows) + "\n")
    rows = [f"{k},{0.1 * k},{300 + k},1,{1e8 + 1e7 * k}" for k in range(6)]
    curve = "time[s],plastic_strain[1],temperature[K],strain_rate[1/s],stress[Pa]\n" + "\n".join(rows) + "\n"
    for place in ("curves", "kept/curves"):
        (folder / place).mkdir(parents=True)
        for name in ("hot-1", "c0", "c1"):
            (folder / place / f"{name}.csv").write_text(curve)
    shutil.copytree(run, folder / "kept/run")
    shutil.copytree(run, folder / "heated.out")
    points = synthetic.lattice(0.004)
    for k in (0, 1):
        synthetic.write_frame(folder / f"heated.out/plate_00000{k}.hdf", points, {"temperature": 300 + points[:, 0]}, 6.0 * k)
    rows = [f"{t},1,{0.1 * k},{1e8 + 1e7 * k}" for t in (300, 400) for k in range(1, 5)]
    (folder / "law.csv").write_text("temperature[K],strain_rate[1/s],plastic_strain[1],stress[Pa]\n" + "\n".join(rows) + "\n")
    (folder / "input.nml").write_text(text)
    return folder


# -- damages: each changes one file by a random number generator ------------------------------------------------------


def cut(path, dice):
    path.write_bytes(path.read_bytes()[:dice.randrange(path.stat().st_size)])


def empty(path, dice):
    path.write_bytes(b"")


def noise(path, dice):
    path.write_bytes(dice.randbytes(200))


def flipped(path, dice):
    raw = bytearray(path.read_bytes())
    for _ in range(3):
        raw[dice.randrange(len(raw))] ^= 1 << dice.randrange(8)
    path.write_bytes(raw)


def folder_instead(path, dice):
    path.unlink()
    path.mkdir()


def unreadable(path, dice):
    path.unlink()
    path.symlink_to("/proc/self/mem")


def missing(path, dice):
    path.unlink()


def bad_cell(path, dice):
    lines = path.read_text().splitlines()
    row = dice.choice([k for k, x in enumerate(lines) if k > 0 and not lines[k - 1].startswith("#") and not x.startswith("#")])
    cells = lines[row].split(",")
    cells[dice.randrange(len(cells))] = dice.choice(["*****", "NaN", "-inf", "1.2.3", "x", "", "\0", '"', "1e999"])
    lines[row] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")


def short_row(path, dice):
    lines = path.read_text().splitlines()
    row = dice.randrange(len(lines) - 2, len(lines))
    lines[row] = ",".join(lines[row].split(",")[:-1])
    path.write_text("\n".join(lines) + "\n")


def heading_alone(path, dice):
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:1 + sum(x.startswith("#") for x in lines)]) + "\n")


def no_heading(path, dice):
    lines = [x for x in path.read_text().splitlines() if not x.startswith("#")]
    path.write_text("\n".join(lines[1:]) + "\n")


def one_column_less(path, dice):
    lines = path.read_text().splitlines()
    gone = dice.randrange(len(lines[-1].split(",")))
    path.write_text("\n".join(x if x.startswith("#") else ",".join(c for k, c in enumerate(x.split(",")) if k != gone)
                              for x in lines) + "\n")


def odd_json(path, dice):
    path.write_text(dice.choice(["[]", "null", '{"steps": "x", "files": 3, "ranks": "two", "wall_seconds": []}', "{", '{"files": [{"name": 3}]}']))


def no_field(path, dice):
    with h5py.File(path, "a") as file:
        names = [name for name in file["VTKHDF/PointData"]]
        del file[f"VTKHDF/PointData/{dice.choice(names)}"]


def no_places(path, dice):
    with h5py.File(path, "a") as file:
        file["VTKHDF/Points"][...] = np.nan


def far_place(path, dice):
    with h5py.File(path, "a") as file:
        places = file["VTKHDF/Points"]
        places[dice.randrange(len(places)), dice.randrange(3)] = dice.choice([1e30, -1e12, np.inf])


def huge_length(path, dice):
    with h5py.File(path, "a") as file:
        there = [name for name in ("spacing", "cell") if name in file.attrs] or list(file.attrs)
        name = dice.choice(there)
        file.attrs[name] = np.full_like(file.attrs[name], 1e308)


def brackets(path, dice):
    path.write_text(f"&RUN {dice.choice(['x = ' + 100000 * '(', 'x' + 20000 * '%x' + ' = 1', 'x = ' + 100000 * '['])} /\n" + path.read_text())


def odd_values(path, dice):
    with h5py.File(path, "a") as file:
        data = file[f"VTKHDF/PointData/{dice.choice([n for n in file['VTKHDF/PointData']])}"]
        data[...] = dice.choice([np.nan, 1e30, -1.0]) if data.dtype.kind == "f" else -7


def other_length(path, dice):
    with h5py.File(path, "a") as file:
        name = dice.choice([name for name in ("Points", "PointData/temperature", "PointData/id") if f"VTKHDF/{name}" in file])
        name = f"VTKHDF/{name}"
        values = file[name][: dice.choice([0, 5])]
        del file[name]
        file[name] = values


def text_instead(path, dice):
    with h5py.File(path, "a") as file:
        file.attrs[dice.choice(["time", "step", "spacing", "cell", "body_names"])] = "x"


ANY = (cut, empty, noise, flipped, folder_instead, unreadable, missing)
CSV = (*ANY, bad_cell, short_row, heading_alone, no_heading, one_column_less)
FRAME = (*ANY, no_field, no_places, far_place, huge_length, odd_values, other_length, text_instead)
RUN = {"plate_history.csv": CSV, "plate_probes.csv": CSV, "plate_tracers.csv": CSV, "plate_000000.hdf": FRAME,
       "plate_000001.hdf": FRAME, "plate_000002.hdf": FRAME, "plate_tools_000002.hdf": ANY, "plate.hdf.series": (*ANY, odd_json),
       "plate_summary.json": (*ANY, odd_json), "plate_input.nml": (*ANY, brackets)}
READS = {"record": {"record.csv": CSV}, "law": {"law.csv": CSV}, "curves": {"curves/hot-1.csv": CSV}, "input": {"input.nml": ANY},
         "run": {f"plate.out/{name}": damages for name, damages in RUN.items()},
         "heated": {f"heated.out/{name}": RUN[name] for name in ("plate_probes.csv", "plate_000000.hdf")},
         "solver": {f"kept/run/{name}": damages for name, damages in RUN.items()}, "law curves": {"kept/curves/c0.csv": CSV}}
CASES = [(name, path, damage) for name, words in COMMANDS.items() for key, files in READS.items() if f"{{{key}}}" in words or key == "law curves" and "law" in name
         for path, damages in files.items() for damage in damages]


def words_of(name, folder):
    places = {"run": folder / "plate.out", "heated": folder / "heated.out", "record": folder / "record.csv", "curves": folder / "curves", "law": folder / "law.csv",
              "input": folder / "input.nml", "solver": folder / "solver", "out": folder / "out"}
    return [word.format(**places) for word in COMMANDS[name].split()]


@pytest.fixture
def workshop(sound, tmp_path, monkeypatch):
    """A copy of the files, with a solver that gives those in `kept`; figures are made, but not rendered, as this is slow."""
    shutil.copytree(sound, tmp_path, dirs_exist_ok=True)
    (tmp_path / "out").mkdir()
    (tmp_path / "solver").write_text(SOLVER.format(kept=tmp_path / "kept"))
    (tmp_path / "solver").chmod(0o755)
    monkeypatch.setattr(maps, "PIXELS", 60)
    monkeypatch.setattr(canvas.Canvas, "cover", lambda *_, **__: (np.zeros(0, int), np.zeros((0, 3)), np.zeros(0, int)))
    picture = io.BytesIO()
    Image.new("RGB", (40, 40)).save(picture, "PNG")
    monkeypatch.setattr(look, "rendered", lambda figure: picture.getvalue() + bytes(200))
    monkeypatch.setenv("STIRPOINT_EXECUTABLE", str(tmp_path / "solver"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outcome(words, capsys):
    status = cli.main(words)
    said = capsys.readouterr().err
    assert "Traceback" not in said and "mistake of stirpost" not in said, said
    assert status in (0, 2), said
    return status, said


def chosen():
    """Of each command and damage one file, by the random numbers of the seed."""
    dice, kinds = random.Random(SEED), {}
    for name, path, damage in CASES:
        kinds.setdefault((name, damage), []).append(path)
    return [(name, dice.choice(paths), damage, dice.randrange(10**6)) for (name, damage), paths in kinds.items()]


@pytest.mark.parametrize("name, path, damage, seed", chosen(), ids=lambda x: getattr(x, "__name__", str(x)))
def test_a_damaged_file(workshop, capsys, name, path, damage, seed):
    """Done, or one complaint a line that names the file; a report is written all the same."""
    damage(workshop / path, random.Random(seed))
    status, said = outcome(words_of(name, workshop), capsys)
    if status == 2:
        assert Path(path).name.removeprefix("plate_") in said or ": the run ends at" in said, said
    if name == "report" and path != "record.csv":
        assert status == 0 and (workshop / "out/report.html").is_file(), said


@pytest.mark.parametrize("name", COMMANDS)
def test_a_full_disk(workshop, capsys, monkeypatch, name):
    """Writing ends at 20 bytes: the file that could not be written is named."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # modules cut at 20 bytes would break later processes
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, limits[1]))
    try:
        status, said = outcome(words_of(name, workshop), capsys)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert status == (0 if name == "calibrate heat film" else 2)
    assert status == 0 or re.search(r"/\S+: File too large\n", said), said


@pytest.mark.parametrize("name", [name for name, words in COMMANDS.items() if "{run}" in words])
def test_a_run_that_has_just_begun(workshop, capsys, name):
    """Histories with headings and no rows, and no frames."""
    for path in (workshop / "plate.out").iterdir():
        if path.suffix == ".csv":
            heading_alone(path, None)
        else:
            path.unlink()
    status, said = outcome(words_of(name, workshop), capsys)
    assert status == 2 and "plate_history.csv: no rows yet" in said and len(said.splitlines()) == 1


@pytest.mark.parametrize("field", ["temperature", "plastic_strain", "body", "id", "grain_size"])
@pytest.mark.parametrize("name", [name for name, words in COMMANDS.items() if "{run}" in words])
def test_a_run_whose_frames_lack_a_field(workshop, capsys, name, field):
    """In one frame, or in that and all later ones: done, or a complaint; no command takes it for granted."""
    dice = random.Random(f"{SEED} {name} {field}")
    frames = sorted((workshop / "plate.out").glob("plate_0*.hdf"))[dice.randrange(3):]
    for path in frames[:dice.choice([1, 3])]:
        with h5py.File(path, "a") as file:
            del file[f"VTKHDF/PointData/{field}"]
    outcome(words_of(name, workshop), capsys)


def test_output_that_nobody_reads(workshop):
    """A pipe that is closed, and standard output on a full disk."""
    command = [sys.executable, "-m", "stirpost", *words_of("section", workshop)]
    place = {"cwd": Path(__file__).parents[1], "stderr": subprocess.PIPE, "text": True}
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, **place)
    assert done.returncode == 2 and done.stderr == "stirpost section: No space left on device\n"
    read, write = os.pipe()
    os.close(read)
    for words in (command, command[:4] + ["--help"], command[:3] + ["--help"], command[:3] + ["--version"], command[:3] + ["calibrate", "--help"]):
        done = subprocess.run(words, stdout=write, **place)
        assert done.returncode == 1 and done.stderr == "", words
    os.close(write)


def test_a_report_names_what_is_left_out(workshop, capsys):
    """A bad value with its line and column, a frame that is cut, on standard error and on the page; all else is there."""
    run = workshop / "plate.out"
    lines = (run / "plate_history.csv").read_text().splitlines()
    cells = lines[9].split(",")
    cells[10] = "**"
    lines[9] = ",".join(cells)
    (run / "plate_history.csv").write_text("\n".join(lines) + "\n")
    (run / "plate_000001.hdf").write_bytes((run / "plate_000001.hdf").read_bytes()[:3000])
    status, said = outcome(words_of("report", workshop), capsys)
    page = (workshop / "out/report.html").read_text()
    assert status == 0
    assert f"warning: {run}/plate_history.csv:10: column 11, pin_torque, is '**', no number\n" in said
    assert "plate_000001.hdf: cut short or damaged: truncated file" in said and said.count("\n") == 2
    assert "plate_history.csv:10: column 11, pin_torque" in page and "plate_000001.hdf: cut short" in page
    assert {path.stem for path in (workshop / "out").glob("*.png")} >= {"tool_loads", "energies", "temperature_cross_section"}


def test_what_is_out_of_all_measure_costs_no_picture(workshop, capsys):
    """A particle at 1e30 m, a cell of 1e308 m, an input of brackets: every picture of the sound run is made."""
    outcome(words_of("report", workshop), capsys)
    sound = {path.stem for path in (workshop / "out").glob("*.png")}
    for damage, name in ((far_place, "plate_000002.hdf"), (huge_length, "plate_000000.hdf")):
        shutil.rmtree(workshop / "out")
        damage(workshop / "plate.out" / name, random.Random(SEED))
        status, said = outcome(words_of("report", workshop), capsys)
        assert status == 0 and "left out" not in said, said
        assert {path.stem for path in (workshop / "out").glob("*.png")} == sound
    for seed in (0, 1, 5):  # each kind of brackets
        brackets(workshop / "plate.out/plate_input.nml", random.Random(seed))
        status, said = outcome(words_of("report", workshop), capsys)
        assert status == 0 and (workshop / "out/report.html").is_file(), said
