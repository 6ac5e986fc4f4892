# SPDX-License-Identifier: MIT
"""What signals do: during the set-up, in a run, twice, and to mpirun."""

import os
import random
import signal
import subprocess
import time

import driver
import pytest

PLAIN = driver.ROOT / "input" / "heat_copper_plain.nml"
ASKING = [signal.SIGINT, signal.SIGHUP, signal.SIGTERM, signal.SIGUSR1]
SLOW = {"TIME.END": 5.0, "OUTPUT.FRAME_INTERVAL": 0}


def heeded():
    """In the child: no signal is ignored, as in a terminal, whatever started the tests."""
    for number in ASKING:
        signal.signal(number, signal.SIG_DFL)


def start(directory, name, sets, *options):
    log = open(directory / "log.txt", "w")
    return subprocess.Popen(driver.command_of(str(name), ["--quiet", *options], None, sets), cwd=directory,
                            env=driver.ENVIRONMENT, stdout=log, stderr=subprocess.STDOUT, preexec_fn=heeded)


def wait_until(condition, seconds=60):
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit, "it did not come to that"
        time.sleep(0.005)


def is_heeding(process, number):
    """Whether the program has begun to heed a signal."""
    for line in open(f"/proc/{process.pid}/status"):
        if line.startswith("SigCgt"):
            return int(line.split()[1], 16) >> (number - 1) & 1 == 1
    return False


@pytest.mark.parametrize("number", ASKING)
@pytest.mark.parametrize("scene", ["stir", PLAIN])
def test_before_the_run(tmp_path, number, scene):
    """Exact: from the moment when the program heeds signals, one ends it with status 75 and a word: that nothing was
    written, or the checkpoint."""
    process = start(tmp_path, scene, SLOW)
    wait_until(lambda: process.poll() is not None or is_heeding(process, number))
    time.sleep(random.Random(f"{number}{scene}").uniform(0.0, 0.3))
    process.send_signal(number)
    assert process.wait(60) == driver.BY_SIGNAL
    text = (tmp_path / "log.txt").read_text()
    print(text)
    folders = [path for path in tmp_path.iterdir() if path.is_dir()]
    if folders:
        assert f"signal {int(number)} stopped the run at step" in text
        assert list(folders[0].glob("*_checkpoint.h5"))
    else:
        assert f"signal {int(number)} stopped the run before it began: nothing was written" in text


@pytest.mark.parametrize("number, scene", [(signal.SIGINT, "stir"), (signal.SIGHUP, PLAIN)])
def test_in_a_run(tmp_path, number, scene):
    """Exact: SIGINT and SIGHUP end a run as SIGTERM does, with status 75 and a checkpoint; heat alone too."""
    process = start(tmp_path, scene, SLOW | {"TIME.END": 50.0})
    wait_until(lambda: list(tmp_path.glob("*.out/*_history.csv")))
    process.send_signal(number)
    assert process.wait(60) == driver.BY_SIGNAL
    assert f"signal {int(number)} stopped the run at step" in (tmp_path / "log.txt").read_text()
    assert list(tmp_path.glob("*.out/*_checkpoint.h5"))


def test_the_same_again_ends_it_at_once(tmp_path):
    """Exact: while the program stops, the same signal again half a second later kills it: stopped by the debugger's
    SIGSTOP it cannot come to its end in between."""
    process = start(tmp_path, "stir", SLOW)
    wait_until(lambda: list(tmp_path.glob("*.out/*_history.csv")))
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.1)
    if process.poll() is not None:
        pytest.skip("it had ended before it was stopped")
    time.sleep(0.6)
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGCONT)
    assert process.wait(60) in (-signal.SIGINT, driver.BY_SIGNAL)


def test_check_ends_at_once(tmp_path):
    """Exact: what is no run dies of a signal as any program."""
    process = start(tmp_path, "stir", {"GRID.CELL": 0.2e-3}, "--check")
    wait_until(lambda: process.poll() is not None or is_heeding(process, signal.SIGTERM))
    process.send_signal(signal.SIGTERM)
    assert process.wait(60) in (-signal.SIGTERM, driver.BAD_INPUT, driver.WELL)


@pytest.mark.parametrize("number, status", [
    (signal.SIGUSR1, driver.BY_SIGNAL), (signal.SIGTERM, 1), (signal.SIGINT, 1), (signal.SIGHUP, 1), (signal.SIGUSR2, 140)])
def test_to_mpirun(tmp_path, number, status):
    """Open MPI's mpirun forwards SIGUSR1, and the job ends with status 75; SIGTERM, SIGINT and SIGHUP make it send SIGTERM
    to the ranks, which have a second (odls_base_sigkill_timeout) for their checkpoint, and end with its own status;
    SIGUSR2, handed on too, kills the ranks."""
    one = driver.Started("stir", "--quiet", directory=tmp_path, ranks=2,
                         environment=dict(driver.ENVIRONMENT, OMPI_MCA_odls_base_sigkill_timeout="6"))
    results = driver.Results(tmp_path / "stir.out", "stir")
    try:
        one.wait_for_rows(results.path("_history.csv"), 10)
        one.send(number)
        ended = one.wait(90)
    finally:
        one.end()
    print(ended, one.directory.joinpath("log.txt").read_text())
    assert number == signal.SIGUSR2 or results.path("_checkpoint.h5").exists()
    if os.environ.get("PRTE_MCA_prefix") is None and "Open MPI" in subprocess.run(
            ["mpirun", "--version"], capture_output=True, text=True).stdout:
        assert ended == status


def test_run_that_stands_still(tmp_path):
    """One of two ranks is stopped: within seconds the other says that no step ends, and goes on when that one does."""
    one = driver.Started("stir", "--quiet", directory=tmp_path, ranks=2, sets=SLOW,
                         environment=dict(driver.ENVIRONMENT, STIRPOINT_SILENCE="2"))
    try:
        one.wait_for_rows(driver.Results(tmp_path / "stir.out", "stir").path("_history.csv"), 3)
        one.send(signal.SIGSTOP, to_rank=1)
        wait_until(lambda: "no step has ended for 2 s" in one.text())
        one.send(signal.SIGCONT, to_rank=1)
        one.send(signal.SIGUSR1)
        assert one.wait(60) == driver.BY_SIGNAL
    finally:
        one.end()
