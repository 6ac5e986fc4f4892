"""PETSc as a guest: only scenes that ask for it load it, it leaves signals alone, and its failures end the run."""

import shutil
import signal
import subprocess

import pytest

import driver

PLAIN = driver.ROOT / "input" / "heat_copper_plain.nml"
LONG = {"GRID.CELL": 2e-3, "TIME.END": 1e4, "HEAT.INTEGRATOR": "tr-bdf2", "HEAT.STEP": 0.1,
        "OUTPUT.FRAME_INTERVAL": 1e4, "OUTPUT.HISTORY_INTERVAL": 0.1}
LIBRARY = "libstirpoint_petsc.so"


@pytest.fixture(autouse=True)
def needs_petsc(tmp_path):
    if driver.lacks("petsc", tmp_path):
        pytest.skip("this build has no petsc")


def process_of(solver, directory):
    """Memory maps and caught signals of a run with a solver, which ends by SIGUSR1."""
    directory.mkdir()
    started = driver.Started(PLAIN, "--quiet", directory=directory, sets=LONG | {"HEAT.SOLVER": solver})
    try:
        started.wait_for_rows(directory / "heat_copper_plain.out" / "heat_copper_plain_history.csv", 2)
        place = f"/proc/{started.process.pid}"
        maps = open(f"{place}/maps", encoding="utf-8").read()
        status = dict(line.split(":", 1) for line in open(f"{place}/status", encoding="utf-8"))
        started.send(signal.SIGUSR1)
        assert started.wait() == driver.BY_SIGNAL
    finally:
        started.end()
    return maps, int(status["SigCgt"], 16)


def test_loaded_when_asked_for_and_signals_stay(tmp_path):
    """A run without PETSc does not load its library (which doubles the time of a start); one with PETSc catches the
    same signals and ends by SIGUSR1 as any other."""
    without, caught = process_of("cg", tmp_path / "cg")
    maps, caught_by_petsc = process_of("petsc", tmp_path / "petsc")
    assert "libpetsc" not in without and "libpetsc" in maps
    assert caught == caught_by_petsc, f"{caught ^ caught_by_petsc:#x}"


def test_petsc_that_fails_ends_the_run(run, monkeypatch):
    """A system that is not solved, here for want of iterations, is an error by name; so is one inside PETSc."""
    sets = LONG | {"HEAT.SOLVER": "petsc", "TIME.END": 1}
    for options, words in (("-ksp_max_it 1", "PETSc did not solve"), ("-pc_type nothing_such", "nothing_such")):
        monkeypatch.setitem(driver.ENVIRONMENT, "PETSC_OPTIONS", options)
        done = run(PLAIN, "--quiet", sets=sets, expect=None)
        assert done.status not in (driver.WELL, driver.BAD_INPUT, driver.BY_SIGNAL)
        assert words in done.err


def test_program_is_copied_with_its_library(tmp_path):
    """The executable finds the library beside itself; a damaged one is an error of the input that says what is wrong."""
    for name in ("stirpoint", LIBRARY):
        shutil.copy(driver.pathlib.Path(driver.EXECUTABLE).parent / name, tmp_path / name)
    words = [str(tmp_path / "stirpoint"), str(PLAIN), "--check=scene", "--set", "HEAT.INTEGRATOR=tr-bdf2", "--set", "HEAT.SOLVER=petsc"]
    done = subprocess.run(words, cwd=tmp_path, env=driver.ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode == driver.WELL, done.stderr
    (tmp_path / LIBRARY).write_bytes(b"nothing")
    done = subprocess.run(words, cwd=tmp_path, env=driver.ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode == driver.BAD_INPUT
    assert "PETSc cannot be loaded" in done.stderr and LIBRARY in done.stderr
