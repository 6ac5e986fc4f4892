# SPDX-License-Identifier: MIT
"""The folder of the results: one run at a time, the results of one run, two generations of checkpoint."""

import os
import pathlib
import shutil
import signal
import subprocess
import time

import driver
import numpy as np
import pytest

SETS = {"TIME.MAX_STEPS": 10, "OUTPUT.FRAME_INTERVAL": 0, "TIME.MASS_SCALING": 1e8}
LONG = {"TIME.END": 20, "OUTPUT.HISTORY_INTERVAL": 2e-3, "OUTPUT.FRAME_INTERVAL": 0, "OUTPUT.CHECKPOINT_INTERVAL": 0}


def files(folder):
    return sorted(path.name for path in pathlib.Path(folder).iterdir())


def test_results_of_an_earlier_run_are_kept(run, tmp_path):
    """Exact: a second run of one name moves what the first left into previous_1, byte for byte, a third that
    of the second into previous_2, and says so in one line; foreign files stay."""
    results = run("stir", "--quiet", sets=SETS).results("stir")
    (results.directory / "notes.txt").write_text("mine")
    (results.directory / "stirring_history.csv").write_text("of another")
    old = {name: (results.directory / name).read_bytes() for name in files(results.directory) if name.startswith("stir_")}
    assert "stir_checkpoint.h5" in old and "stir_000001.hdf" in old
    done = run("stir", "--quiet", sets=SETS | {"TIME.MAX_STEPS": 8})
    (note,) = [line for line in done.out.splitlines() if line.startswith("note: ")]
    assert "stir.out/previous_1" in note
    aside = results.directory / "previous_1"
    for name, content in old.items():
        assert (aside / name).read_bytes() == content, name
    assert results.checkpoint().step == 8
    assert {"notes.txt", "stirring_history.csv"} <= set(files(results.directory))
    assert "previous_2" in run("stir", "--quiet", sets=SETS).out
    assert not (aside / "previous_1").exists()
    run("stir", "--quiet", "--restart", aside / "stir_checkpoint.h5", sets=SETS | {"TIME.MAX_STEPS": 12})


def test_overwrite(run, tmp_path):
    """Exact: --overwrite deletes the results of the first run; frames that the second does not write are gone."""
    results = run("stir", "--quiet", sets=SETS | {"OUTPUT.FRAME_INTERVAL": 2e-3}).results("stir")
    assert len(list(results.directory.glob("stir_0*.hdf"))) > 3
    (results.directory / "notes.txt").write_text("mine")
    done = run("stir", "--quiet", "--overwrite", sets=SETS)
    assert "deleted" in done.out
    assert len(list(results.directory.glob("stir_0*.hdf"))) == 2 == len(results.series()["files"])
    assert "notes.txt" in files(results.directory) and "previous_1" not in files(results.directory)


def test_killed_before_its_first_checkpoint(run, tmp_path):
    """Exact: a run in the folder of a finished one, killed before its first checkpoint, leaves none to go on
    from: a restart says so with status 2 instead of going on from the old run."""
    results = run("stir", "--quiet", sets=SETS).results("stir")
    one = driver.Started("stir", "--quiet", directory=tmp_path, sets=LONG)
    limit = time.monotonic() + 30
    while not (results.directory / "previous_1" / "stir_history.csv").exists() and time.monotonic() < limit:
        time.sleep(0.02)
    one.wait_for_rows(results.path("_history.csv"), 2)
    one.process.kill()
    one.end()
    done = run("stir", "--restart", results.path("_checkpoint.h5"), sets=LONG, expect=driver.BAD_INPUT)
    assert "stir_checkpoint.h5 does not exist" in done.err


@pytest.mark.parametrize("ranks", [None, 2])
def test_two_runs_in_one_folder(run, tmp_path, ranks):
    """Exact: while one run is at work a second in its folder ends with status 2, names the process and leaves
    the files alone; when the first was killed the folder is free at once."""
    one = driver.Started("stir", "--quiet", directory=tmp_path, sets=LONG, ranks=ranks)
    folder = tmp_path / "stir.out"
    try:
        one.wait_for_rows(folder / "stir_history.csv", 3)
        begun = (folder / "stir_run.txt").read_text()
        second = run("stir", "--quiet", sets=SETS, expect=driver.BAD_INPUT, ranks=ranks)
        print(second.err)
        assert second.err.count("is in use by another run: process ") == 1
        assert second.err.split("process ")[1].split()[0] in begun
        assert (folder / "stir_run.txt").read_text() == begun and "previous_1" not in files(folder)
    finally:
        one.end()
    run("stir", "--quiet", sets=SETS)


def test_surplus_frames(run, tmp_path):
    """Exact: a restart from an earlier checkpoint than the last frames deletes those; frames, series and
    the later checkpoint are those of the new run."""
    sets = {"TIME.MASS_SCALING": 1e8, "TIME.DT": 5e-4, "OUTPUT.FRAME_INTERVAL": 1e-3}
    results = run("stir", "--quiet", sets=sets | {"TIME.END": 2e-3}).results("stir")
    saved = tmp_path / "saved.h5"
    shutil.copy(results.path("_checkpoint.h5"), saved)
    run("stir", "--quiet", "--restart", results.path("_checkpoint.h5"), sets=sets | {"TIME.END": 6e-3})
    assert len(results.series()["files"]) == len(list(results.directory.glob("stir_0*.hdf"))) == 7
    done = run("stir", "--quiet", "--restart", saved, sets=sets | {"TIME.END": 3e-3})
    assert "4 frame(s) later than the checkpoint deleted" in done.out
    assert len(results.series()["files"]) == len(list(results.directory.glob("stir_0*.hdf"))) == 4
    assert files(results.directory / "previous_1") == ["stir_checkpoint.h5", "stir_run.txt"]
    assert results.checkpoint().time == pytest.approx(3e-3)


def test_restart_among_results_of_another_run(run, tmp_path):
    """Exact: a checkpoint taken to a folder that has results of another run of this name: those are kept
    aside, none of their rows and frames is mixed in."""
    here, there = tmp_path / "here", tmp_path / "there"
    for place in (here, there):
        place.mkdir()
    one = run("stir", "--quiet", directory=here, sets=SETS).results("stir")
    two = run("stir", "--quiet", directory=there, sets=SETS).results("stir")
    done = run("stir", "--quiet", "--restart", one.path("_checkpoint.h5"), directory=there, sets=SETS | {"TIME.MAX_STEPS": 14})
    assert "moved to stir.out/previous_1" in done.out
    assert two.history()["step"][0] > 10 or two.history()["step"][0] == 14


@pytest.mark.parametrize("name", ["stir", driver.ROOT / "input" / "heat_copper_plain.nml"])
def test_series_lists_what_is_there(run, tmp_path, name):
    """Exact: after a restart in another folder, and one more there, the series has just the frames of that folder, each
    with its time; that of the first folder stays as it was."""
    if name == "stir":
        sets = {"TIME.MASS_SCALING": 1e8, "TIME.DT": 5e-4, "OUTPUT.FRAME_INTERVAL": 1e-3}
        ends = (2e-3, 4e-3, 6e-3)
    else:
        sets = {"GRID.CELL": 4e-3, "OUTPUT.FRAME_INTERVAL": 1}
        ends = (2, 4, 6)
    results = run(name, "--quiet", sets=sets | {"TIME.END": ends[0]}).results(getattr(name, "stem", name))
    first = results.path(".hdf.series").read_text()
    other = driver.Results(tmp_path / "other", results.name)
    run(None, "--quiet", "--restart", results.path("_checkpoint.h5"), "--output", other.directory, sets={"TIME.END": ends[1]})
    for end, numbers in ((ends[1], [3, 4]), (ends[2], [3, 4, 5, 6])):
        if end == ends[2]:
            run(None, "--quiet", "--restart", other.path("_checkpoint.h5"), sets={"TIME.END": end})
        listed = other.series()["files"]
        assert [item["name"] for item in listed] == [f"{results.name}_{k:06}.hdf" for k in numbers]
        assert [item["name"] for item in listed] == sorted(path.name for path in other.directory.glob(f"{results.name}_0*.hdf"))
        assert [item["time"] for item in listed] == pytest.approx([k * sets["OUTPUT.FRAME_INTERVAL"] for k in numbers])
    assert results.path(".hdf.series").read_text() == first


def test_two_generations(run, tmp_path):
    """Exact: two checkpoints are kept; a damaged newest is refused and names the one before it, from
    which the run goes on, and the damaged one is moved away."""
    sets = {"TIME.MASS_SCALING": 1e8, "TIME.DT": 5e-4, "OUTPUT.FRAME_INTERVAL": 0, "TIME.END": 4e-3,
            "OUTPUT.CHECKPOINT_INTERVAL": 1e-3}
    results = run("stir", "--quiet", sets=sets).results("stir")
    newest, before = results.path("_checkpoint.h5"), results.path("_checkpoint_previous.h5")
    assert driver.Checkpoint(before).time == pytest.approx(3e-3) and results.checkpoint().time == pytest.approx(4e-3)
    whole = results.checkpoint()
    history = results.path("_history.csv").read_text()
    data = bytearray(newest.read_bytes())
    data[len(data) // 2] ^= 4
    newest.write_bytes(data)
    done = run("stir", "--restart", newest, sets=sets, expect=driver.BAD_INPUT)
    assert "stir_checkpoint.h5 is damaged" in done.err and "stir_checkpoint_previous.h5, is intact" in done.err
    run("stir", "--quiet", "--restart", before, sets=sets)
    assert (results.directory / "previous_1" / "stir_checkpoint.h5").read_bytes() == bytes(data)
    assert whole.step == results.checkpoint().step and (whole.v == results.checkpoint().v).all()
    assert results.path("_history.csv").read_text() == history
    newest.unlink()
    assert "stir_checkpoint_previous.h5, is intact" in run("stir", "--restart", newest, sets=sets, expect=2).err


def test_slurm_script_takes_no_other_run(run, tmp_path):
    """Exact: jobscripts/slurm.sh on its second start: from the checkpoint of its own job, anew if the results
    in the folder are of another job or there is no checkpoint."""
    results = run("stir", "--quiet", sets=SETS).results("stir")
    fake = tmp_path / "bin"
    fake.mkdir()
    (fake / "mpirun").write_text("#!/bin/bash\necho \"called: $*\"\n")
    (fake / "mpirun").chmod(0o755)
    (fake / "stirpoint").write_text("#!/bin/bash\necho stir.out/stir\n")
    (fake / "stirpoint").chmod(0o755)
    run_file = results.path("_run.txt")

    def second_start(job):
        environment = {**os.environ, "PATH": f"{fake}:{os.environ['PATH']}", "SLURM_JOB_ID": job,
                       "SLURM_RESTART_COUNT": "1", "SLURM_SUBMIT_DIR": str(tmp_path), "STIRPOINT": "stirpoint"}
        script = driver.ROOT / "jobscripts" / "slurm.sh"
        return subprocess.run(["bash", script, "stir.nml"], env=environment, capture_output=True, text=True,
                              check=True, timeout=30).stdout

    assert "--restart" not in second_start("77"), "the run was not of a job"
    run_file.write_text(run_file.read_text() + "job 77\n")
    assert "--restart stir.out/stir_checkpoint.h5" in second_start("77")
    assert "--restart" not in second_start("7")
    results.path("_checkpoint.h5").rename(results.path("_checkpoint_previous.h5"))
    assert "--restart stir.out/stir_checkpoint_previous.h5" in second_start("77")
    results.path("_checkpoint_previous.h5").unlink()
    assert "--restart" not in second_start("77")


@pytest.mark.parametrize("launcher", ["mpirun", "srun"])
def test_slurm_script_starts_and_signals(tmp_path, launcher):
    """Exact: jobscripts/slurm.sh starts the ranks with LAUNCHER; the signal of Slurm reaches them, by scancel
    with srun, and a run that stopped with a checkpoint goes back into the queue."""
    fake = tmp_path / "bin"
    fake.mkdir()
    waits = 'trap "exit 75" USR1; touch started; for ((k = 0; k < 300; k++)); do sleep 0.1; done; exit 1'
    commands = {"stirpoint": "echo stir.out/stir", launcher: f'echo "{launcher}: $*"; echo $$ >pid; {waits}', "scontrol": 'echo "scontrol: $*"',
                "scancel": 'echo "scancel: $*"; kill -USR1 "$(cat pid)"'}
    for name, body in commands.items():
        (fake / name).write_text(f"#!/bin/bash\n{body}\n")
        (fake / name).chmod(0o755)
    (tmp_path / "stir.out").mkdir()
    (tmp_path / "stir.out/stir_checkpoint.h5").touch()
    environment = {**os.environ, "PATH": f"{fake}:{os.environ['PATH']}", "SLURM_JOB_ID": "77", "LAUNCHER": launcher,
                   "SLURM_SUBMIT_DIR": str(tmp_path), "STIRPOINT": "stirpoint"}
    job = subprocess.Popen(["bash", driver.ROOT / "jobscripts" / "slurm.sh", "stir.nml"], env=environment,
                           stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    for _ in range(200):
        if (tmp_path / "started").exists():
            break
        time.sleep(0.05)
    job.send_signal(signal.SIGUSR1)
    out = job.communicate(timeout=30)[0]
    assert job.returncode == 0, out
    assert f"{launcher}: stirpoint stir.nml" in out
    assert ("scancel: --signal=USR1 77.0" in out) == (launcher == "srun")
    assert "ended with exit status 75 (signalled: yes)" in out and "scontrol: requeue 77" in out


def test_frames_of_the_tools_of_another_run(run, tmp_path):
    """Exact: stir writes stir_tools_000000.hdf, which a run stir_tools would write too: it may not have this name, from NAME or its file."""
    done = run("stir", sets={"RUN.NAME": "stir_tools"}, expect=driver.BAD_INPUT)
    assert "&RUN NAME = 'stir_tools': must be" in done.err and "not ending in _tools" in done.err
    (tmp_path / "stir_tools.nml").write_text((driver.INPUTS / "stir.nml").read_text(encoding="utf-8"), encoding="utf-8")
    done = run("stir_tools.nml", expect=driver.BAD_INPUT)
    assert "stir_tools.nml: error: the name of this file cannot be that of the results: give &RUN NAME" in done.err


def test_where_results_are(run, tmp_path):
    """--where says what the names of all results begin with, as the job scripts ask: &RUN NAME and --output count."""
    for options, wanted in (((), "stir.out/stir"), (("--set", "RUN.NAME=mine"), "mine.out/mine"),
                            (("--set", "RUN.NAME=mine", "--output", "there"), "there/mine")):
        assert run("stir", "--where", *options).out == wanted + "\n"
    weld = driver.ROOT / "share/stirpoint/new/pin.nml"   # with a material of the library
    done = run(weld, "--where", "--set", "TIME.MASS_SCALING=2e6")
    assert (done.out, done.err) == ("pin.out/pin\n", "")
    assert not list(tmp_path.iterdir())


def test_the_job_is_noted(run, tmp_path, monkeypatch):
    """Exact: under Slurm NAME_run.txt has the job, which slurm.sh looks for."""
    monkeypatch.setitem(driver.ENVIRONMENT, "SLURM_JOB_ID", "4711")
    results = run("stir", "--quiet", sets=SETS).results("stir")
    assert "job 4711" in results.path("_run.txt").read_text().splitlines()


@pytest.mark.parametrize("action", ["moved", "deleted", "replaced"])
def test_history_that_goes_away(tmp_path, run, action):
    """Exact: a history that is moved, deleted or replaced under the run is written again with every row, with a warning, and
    a file that has taken its name is kept."""
    one = driver.Started("stir", "--quiet", directory=tmp_path, sets=LONG)
    path = tmp_path / "stir.out" / "stir_history.csv"
    try:
        one.wait_for_rows(path, 3)
        if action == "deleted":
            path.unlink()
        else:
            path.rename(tmp_path / "away.csv")
        if action == "replaced":
            path.write_text("mine\n")
        limit = time.monotonic() + 30
        while "written again" not in one.text() and time.monotonic() < limit:
            time.sleep(0.02)
        one.send(signal.SIGUSR1)
        assert one.wait() == driver.BY_SIGNAL
    finally:
        one.end()
    assert one.text().count("stir_history.csv was moved, deleted or replaced during the run; it is written again") == 1
    times = driver.Table(path)["time[s]"]
    assert times[0] == 0.0 and len(times) > 3
    assert times == pytest.approx(LONG["OUTPUT.HISTORY_INTERVAL"] * np.arange(len(times)), abs=5e-4)
    if action != "deleted":
        assert path.read_text().startswith((tmp_path / "away.csv").read_text())
    assert (tmp_path / "stir.out" / "stir_history.csv.1").exists() == (action == "replaced")
    done = run("stir", "--restart", path.with_name("stir_checkpoint.h5"), sets=LONG | {"TIME.MAX_STEPS": 1})
    assert "rows that the run had written" not in done.out


def test_folder_that_goes_away(tmp_path):
    """Exact: a run whose folder is moved ends with status 4 and a file that cannot be written."""
    one = driver.Started("stir", "--quiet", directory=tmp_path, sets=LONG)
    try:
        one.wait_for_rows(tmp_path / "stir.out" / "stir_history.csv", 3)
        (tmp_path / "stir.out").rename(tmp_path / "away")
        assert one.wait() == 4
    finally:
        one.end()
    assert "cannot be written: No such file or directory" in one.text()


def test_links_are_not_written_through(run, tmp_path):
    """Exact: results that are symbolic links do not change the files that these point to: NAME_run.txt is refused with status 4,
    a restart replaces the others, or warns of the log."""
    mine = tmp_path / "mine"
    results = run("stir", "--quiet", sets=SETS).results("stir")
    links = [".log", "_history.csv.tmp", "_checkpoint.h5.tmp", "_input.nml.tmp", "_000002.hdf.tmp", "_history.csv", "_probes.csv"]
    for rest in links:
        (tmp_path / f"mine{rest}").write_bytes(results.path(rest).read_bytes() if results.path(rest).exists() else b"mine")
        results.path(rest).unlink(missing_ok=True)
        results.path(rest).symlink_to(tmp_path / f"mine{rest}")
    before = {rest: (tmp_path / f"mine{rest}").read_bytes() for rest in links}
    done = run("stir", "--quiet", "--restart", results.path("_checkpoint.h5"), sets=SETS | {"TIME.MAX_STEPS": 12})
    assert "the log is incomplete: it is a symbolic link" in done.err
    assert {rest: (tmp_path / f"mine{rest}").read_bytes() for rest in links} == before
    assert results.checkpoint().step == 12 and not results.path("_history.csv").is_symlink()
    mine.write_text("mine")
    results.path("_run.txt").unlink()
    results.path("_run.txt").symlink_to(mine)
    done = run("stir", "--quiet", sets=SETS, expect=4)
    assert "stir_run.txt cannot be written: it is a symbolic link" in done.err and mine.read_text() == "mine"
