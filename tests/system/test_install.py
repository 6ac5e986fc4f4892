# SPDX-License-Identifier: MIT
"""cmake --install into a prefix with a blank, find_package from another project, the Debian package, stirpost, CI."""

import pathlib
import re
import shutil
import subprocess
import sys

import driver
import pytest

BUILD = pathlib.Path(driver.EXECUTABLE).parent
pytestmark = pytest.mark.skipif(
    not (BUILD / "CMakeCache.txt").exists(), reason="the program is not where it was built"
)
PROJECT = """cmake_minimum_required(VERSION 3.20)
project(user LANGUAGES NONE)
find_package(Stirpoint 0.1 REQUIRED)
get_target_property(program Stirpoint::stirpoint LOCATION)
execute_process(COMMAND "${program}" --version OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
message(STATUS "found ${Stirpoint_VERSION}: ${text}")
"""


def call(*words, **more):
    done = subprocess.run(
        [str(word) for word in words], env=driver.ENVIRONMENT, capture_output=True, text=True, timeout=300, **more
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """The program installed, then moved: it finds what it needs relative to itself."""
    place = tmp_path_factory.mktemp("in stall")
    call("cmake", "--install", BUILD, "--prefix", place / "first")
    shutil.move(place / "first", place / "an other")
    return place / "an other"


def test_installed_program_runs(prefix, tmp_path):
    """From its prefix: a scene to begin with, with a material of the installed library; PETSc if it is there."""
    program = prefix / "bin/stirpoint"
    (tmp_path / "my.nml").write_text(call(program, "--new", "shoulder"), encoding="utf-8")
    out = call(program, "my.nml", "--set", "TIME.MAX_STEPS=3", cwd=tmp_path)
    assert "material copper from the library" in out and "results in my.out" in out
    assert str(prefix / "share/stirpoint/materials.nml") in str(
        pathlib.Path(call(program, "--materials").split("\nfrom ")[1].strip()).resolve()
    )
    heat = driver.ROOT / "input/heat_copper_plain.nml"
    if not driver.lacks("petsc", tmp_path):
        words = ["--set", "HEAT.SOLVER=petsc", "--set", "HEAT.INTEGRATOR=tr-bdf2", "--set", "TIME.END=0.1"]
        call(program, heat, *words, cwd=tmp_path)
    man = call("man", "-l", prefix / "share/man/man1/stirpoint.1") if shutil.which("man") else "--restart"
    assert "--restart" in man
    assert (prefix / "share/paraview/stirpoint.py").read_bytes() == (driver.ROOT / "share/paraview/stirpoint.py").read_bytes()
    (module,) = (prefix / "share/modulefiles/stirpoint").iterdir()
    assert module.read_text(encoding="utf-8").startswith("#%Module1.0")


def test_find_package(prefix, tmp_path):
    (tmp_path / "CMakeLists.txt").write_text(PROJECT, encoding="utf-8")
    out = call("cmake", "-S", tmp_path, "-B", tmp_path / "b", "-D", f"CMAKE_PREFIX_PATH={prefix}")
    assert "found 0.1" in out and "Stirpoint 0.1" in out


def test_package_of_stirpost(tmp_path):
    """What goes into a wheel is every file of the package, data included."""
    copy = shutil.copytree(driver.ROOT / "postproc", tmp_path / "copy", ignore=shutil.ignore_patterns("build", "*.egg-info"))
    call(sys.executable, "-c", "import setuptools; setuptools.setup()", "build", "--build-lib", tmp_path / "built", cwd=copy)
    package = copy / "stirpost"
    files = {path.relative_to(copy) for path in package.rglob("*") if path.is_file() and path.suffix != ".pyc"}
    assert any(path.suffix not in (".py",) for path in files)
    assert files == {path.relative_to(tmp_path / "built") for path in (tmp_path / "built").rglob("*") if path.is_file()}


def test_workflow_runs_the_stages():
    """Those of .ci/run, all of them."""
    stages = re.search(r"stage: \[(.*)\]", (driver.ROOT / ".github/workflows/ci.yml").read_text()).group(1).split(", ")
    script = (driver.ROOT / ".ci/run").read_text()
    known = re.findall(r"^#   (\S+) ", script, re.MULTILINE)
    assert sorted(stages) == sorted(known)
    assert all(re.search(rf"^{stage}\(\) {{", script, re.MULTILINE) for stage in stages)


@pytest.mark.skipif(shutil.which("dpkg-deb") is None, reason="no dpkg-deb")
def test_debian_package(tmp_path):
    """It has the program and its files, names the libraries it needs, and runs where it is unpacked."""
    call("cpack", "--config", BUILD / "CPackConfig.cmake", "-G", "DEB", "-B", tmp_path)
    (package,) = tmp_path.glob("stirpoint_*.deb")
    content = call("dpkg-deb", "--contents", package)
    for file in ("bin/stirpoint", "share/paraview/stirpoint.py", "share/stirpoint/materials.nml", "share/stirpoint/new/pin.nml", "share/man/man1/stirpoint.1"):
        assert f" ./usr/{file}\n" in content
    assert ".mod\n" not in content and ".a\n" not in content
    needs = call("dpkg-deb", "--field", package, "Depends")
    assert "libc6" in needs and "libgfortran5" in needs and "hdf5" in needs
    call("dpkg-deb", "--extract", package, tmp_path / "root")
    assert "Stirpoint 0.1" in call(tmp_path / "root/usr/bin/stirpoint", "--version")
