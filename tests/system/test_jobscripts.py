"""jobscripts/local.sh in places it does not expect: blanks in every path, no home directory, no right to install.
What it starts are stand-ins that note their arguments."""

import os
import pathlib
import shutil
import subprocess
import tempfile

import pytest

import driver

NOTE = '#!/bin/bash\nprintf "%s" "$(basename "$0")" >>"$NOTES"\nprintf "|%s" "$@" >>"$NOTES"\necho >>"$NOTES"\n'


@pytest.fixture
def place():
    """A checkout in a path with blanks that all may enter (not so those of pytest), with packages and Python there,
    and a cmake and an mpirun that only record their calls."""
    with tempfile.TemporaryDirectory() as folder:
        yield furnished(pathlib.Path(folder))


def furnished(tmp_path):
    root = tmp_path / "a check out"
    (root / "jobscripts").mkdir(parents=True)
    (root / "postproc").mkdir()
    (root / "build" / "venv").mkdir(parents=True)
    shutil.copy(driver.ROOT / "jobscripts" / "local.sh", root / "jobscripts")
    wanted = ""
    for name in ("postproc/requirements.txt", "postproc/pyproject.toml"):
        shutil.copy(driver.ROOT / name, root / name)
        wanted += (root / name).read_text()
    (root / "build/venv/requirements.installed").write_text(wanted)
    stubs = tmp_path / "stand-ins"
    stubs.mkdir()
    python = root / "build" / "venv" / "bin" / "python"
    python.parent.mkdir()
    for path in (stubs / "cmake", stubs / "mpirun", python):
        path.write_text(NOTE)
        path.chmod(0o755)
    program = root / "build" / "release" / "stirpoint"
    program.parent.mkdir()
    program.write_text("#!/bin/bash\necho my.out/my\n")
    program.chmod(0o755)
    (stubs / "dpkg-query").write_text('#!/bin/bash\necho "$STATE"\n')
    (stubs / "dpkg-query").chmod(0o755)
    for path in (tmp_path, *tmp_path.rglob("*")):
        path.chmod(0o777)
    return root


def local(place, *words, state="installed", ordinary=False):
    """Run local.sh; with `ordinary` as a user who is not root."""
    before = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"] if ordinary and os.geteuid() == 0 else []
    there = place.parent / "a run place"
    there.mkdir(exist_ok=True)
    there.chmod(0o777)
    notes = place.parent / "notes"
    environment = dict(os.environ, PATH=f"{place.parent / 'stand-ins'}:/usr/bin:/bin", STATE=state, NOTES=str(notes),
                       HOME="/nowhere/to be found", RANKS="1")
    done = subprocess.run([*before, "bash", str(place / "jobscripts" / "local.sh"), *words], cwd=there, env=environment,
                          capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=60)
    return done, [line.split("|") for line in notes.read_text().splitlines()] if notes.exists() else []


@pytest.mark.parametrize("ordinary", [False, True], ids=["as_is", "ordinary_user"])
def test_blanks_and_no_home(place, ordinary):
    """Paths with blanks stay whole in what is configured, built and run; the run is made where the call was."""
    given = place.parent / "a run place" / "my input.nml"
    given.parent.mkdir()
    given.write_text("")
    done, notes = local(place, "run", "my input.nml", "--quiet", ordinary=ordinary)
    assert done.returncode == 0, done.stderr
    print(notes)
    calls = [call for call in notes if call[0] != "python"]
    assert calls[0] == ["cmake", "--preset", "release"]
    assert calls[1][:4] == ["cmake", "--build", "--preset", "release"]
    assert calls[2] == ["mpirun", "-n", "1", f"{place}/build/release/stirpoint", "my input.nml", "--quiet"]


def test_missing_packages_are_named(place):
    """An ordinary user without sudo is told what to have installed, PETSc and FFTW with it; nothing is built."""
    if shutil.which("sudo"):
        pytest.skip("sudo is there: it may ask, or install")
    done, notes = local(place, "build", state="not-installed", ordinary=True)
    assert done.returncode == 1 and "neither root nor sudo" in done.stderr
    for package in ("gfortran", "libopenmpi-dev", "libhdf5-openmpi-dev", "libfftw3-dev", "libpetsc-real-dev"):
        assert package in done.stderr
    assert not [call for call in notes if call[0] == "cmake"]


@pytest.mark.parametrize("words, has_tests", [(["build"], False), (["python"], True)])
def test_what_is_installed(place, words, has_tests):
    """A run installs what it and its report need, without tests, sources and stubs of packages; the tests bring the rest; either is
    content with more, and asked for less nothing is installed again."""
    package = place / "build/venv/lib/numpy"
    (package / "tests").mkdir(parents=True)
    for name in ("tests/test_all.py", "core.pyi", "core.c", "core.py"):
        (package / name).touch()
    stamp = place / "build/venv/requirements.installed"
    stamp.unlink()
    done, notes = local(place, *words)
    assert done.returncode == 0, done.stderr
    pip = next(call for call in notes if call[:4] == ["python", "-m", "pip", "install"])
    assert (str(place / "postproc/requirements.txt") in pip) == has_tests and pip[-2:] == ["-e", str(place / "postproc") + "[all]"*has_tests]
    left = {path.name for path in package.rglob("*") if path.is_file()}
    assert left == ({"test_all.py", "core.pyi", "core.c", "core.py"} if has_tests else {"core.py"})
    before = stamp.read_text()
    done, notes = local(place, "build")
    assert "Setting up Python" not in done.stdout and stamp.read_text() == before
