# SPDX-License-Identifier: MIT
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from stirpost import cli
from stirpost.cli import calibrate

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("commands", [cli.COMMANDS, calibrate.COMMANDS], ids=["stirpost", "calibrate"])
def test_each_command_has_its_module(commands):
    for name, module, text in commands:
        assert callable(import_module(f"stirpost.{module}").main) and text


def test_help_names_all_commands_without_the_large_packages():
    code = "import sys; from stirpost import cli; cli.main(['--help']); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    for name, _, text in cli.COMMANDS:
        assert name in done.stdout and text in done.stdout
    assert "vtkmodules" not in done.stdout and "matplotlib" not in done.stdout


@pytest.mark.parametrize("words", [[name] for name, _, _ in cli.COMMANDS] + [["calibrate", name] for name, _, _ in calibrate.COMMANDS])
def test_help_of_a_command_loads_no_large_package(words):
    """Only numpy is loaded; packages for pictures and fits are loaded when they are used."""
    code = f"import sys\nfrom stirpost import cli\ntry: cli.main({[*words, '--help']!r})\nexcept SystemExit: pass\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert "usage: stirpost" in done.stdout
    loaded = set(done.stdout.splitlines()[-1].split())
    assert not loaded & {"matplotlib", "scipy", "pandas", "pyvista", "vtkmodules", "h5py", "f90nml", "pysplashsurf", "PIL", "jinja2"}


@pytest.mark.parametrize("words", [["reprot"], ["calibrate", "cold"], ["report", "/nowhere"], ["track", "/nowhere", "1", "x"]])
def test_what_a_person_can_put_right_is_one_line(words, capsys):
    assert cli.main(words) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_a_missing_package_is_named(capsys, monkeypatch):
    monkeypatch.setattr(cli, "COMMANDS", (("odd", "no_such_module_here", "nothing"),))
    assert cli.main(["odd"]) == 2
    assert "no_such_module_here" in capsys.readouterr().err


def test_the_version_is_that_of_the_program():
    package = (ROOT / "pyproject.toml").read_text()
    program = (ROOT.parent / "CMakeLists.txt").read_text()
    version = package.split('version = "')[1].split('"')[0]
    assert f"project(stirpoint VERSION {version} " in program
