# SPDX-License-Identifier: MIT
"""stirpoint --version: what the program is made of, against what the machine says."""

import ctypes
import ctypes.util
import re
import shutil
import subprocess

import driver
import pytest

PATTERN = re.compile(r"""Stirpoint \d+\.\d+\.\d+, commit (?P<commit>unknown|[0-9a-f]{7,40}(-dirty)?)
build (?P<build>\w+) -march=(?P<arch>\S+) for \S+: (?P<flags>-\S.*)
compiler GCC version (?P<compiler>\S+)
MPI (?P<mpi>\S.*)
HDF5 (?P<hdf5>\d+\.\d+\S*), FFTW (?P<fftw>not built in|\d+\.\d+\S*), PETSc (?P<petsc>not built in|\d+\.\d+\.\d+)
""")
SCRIPT = driver.ROOT / "cmake/commit.cmake"


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    out = driver.run(None, "--version", directory=tmp_path_factory.mktemp("version")).out
    found = PATTERN.fullmatch(out)
    assert found, out
    return found.groupdict()


def test_libraries(parts, tmp_path):
    """Versions of the libraries are those the loader finds."""
    lines = subprocess.run(["ldd", driver.EXECUTABLE], capture_output=True, text=True, check=True).stdout
    libraries = dict(re.findall(r"(\S+) => (\S+)", lines))

    def of(name):
        (path,) = [path for file, path in libraries.items() if re.match(rf"lib{name}\b", file)]
        return path

    mpi = ctypes.CDLL(of("mpi"))
    text, length = ctypes.create_string_buffer(8192), ctypes.c_int()
    assert mpi.MPI_Get_library_version(text, ctypes.byref(length)) == 0
    assert text.value.decode().splitlines()[0].startswith(parts["mpi"])
    numbers = [ctypes.c_uint() for _ in range(3)]
    hdf5 = [path for file, path in libraries.items() if re.match(r"libhdf5(_openmpi)?\.so", file)]
    assert ctypes.CDLL(hdf5[0]).H5get_libversion(*map(ctypes.byref, numbers)) == 0
    assert parts["hdf5"] == ".".join(str(number.value) for number in numbers)
    if driver.lacks("fftw", tmp_path):
        assert parts["fftw"] == "not built in"
    else:
        name = (ctypes.c_char * 32).in_dll(ctypes.CDLL(of("fftw3")), "fftw_version")
        assert name.value.decode() == "fftw-" + parts["fftw"]
    assert (parts["petsc"] == "not built in") == driver.lacks("petsc", tmp_path)


def test_build(parts):
    """Type, architecture, flags and compiler."""
    assert parts["build"] in ("Release", "Debug")
    if parts["build"] == "Release":
        assert f"-march={parts['arch']}" in parts["flags"] and "-O3" in parts["flags"]
    assert re.fullmatch(r"\d+\.\d+\.\d+", parts["compiler"])


def commit_of(source, file, path=None):
    """What the script of the build writes about a folder; `path`: where it finds programs."""
    words = [shutil.which("cmake"), "-D", f"SOURCE={source}", "-D", f"FILE={file}"]
    words += ["-D", "GIT=GIT-NOTFOUND", "-D", "CMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF",
              "-D", "CMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH=OFF"] if path == "none" else []
    subprocess.run([*words, "-P", SCRIPT], check=True, capture_output=True)
    return re.search(r'strncpy\(name, "(.*)", 64\)', file.read_text())[1]


@pytest.mark.skipif(not (shutil.which("git") and shutil.which("cmake")), reason="needs git and cmake")
def test_commit(tmp_path):
    """The commit; -dirty with changed sources; unknown without a repository, in a folder of another one and without
    git. A file that says so already is not written again."""
    source, file = tmp_path / "source", tmp_path / "commit.c"
    (source / "inner").mkdir(parents=True)
    assert commit_of(source, file) == "unknown"

    def git(*words):
        words = ["git", "-C", source, "-c", "user.name=n", "-c", "user.email=e@x", "-c", "commit.gpgsign=false", *words]
        return subprocess.run(words, check=True, capture_output=True, text=True).stdout.strip()

    git("init")
    assert commit_of(source, file) == "unknown"
    (source / "a.f90").write_text("one\n")
    git("add", ".")
    git("commit", "-m", "one")
    head = git("rev-parse", "--short=12", "HEAD")
    assert commit_of(source, file) == head
    written = file.stat().st_mtime_ns
    assert commit_of(source, file) == head and file.stat().st_mtime_ns == written
    git("tag", "-a", "v1", "-m", "v1")
    assert commit_of(source, file) == head
    (source / "a.f90").write_text("two\n")
    assert commit_of(source, file) == head + "-dirty"
    assert commit_of(source / "inner", file) == "unknown"
    assert commit_of(source, file, path="none") == "unknown"
