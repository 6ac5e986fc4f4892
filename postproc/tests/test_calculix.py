# SPDX-License-Identifier: MIT
"""The deck for CalculiX, computed by it."""

import re
import shutil
import subprocess

import numpy as np
import pytest
import synthetic

from stirpost import cli

LENGTH, H, YOUNG, EXPANSION, COLD, HOT = 20e-3, 1e-3, 70e9, 23e-6, 200.0, 100.0
INPUT = f"""&MATERIAL NAME = 'metal', YOUNGS_MODULUS = {YOUNG}, POISSON_RATIO = 0.3, EXPANSION = {EXPANSION}, T_ROOM = 298 /
&BODY NAME = 'bar', MATERIAL = 'metal' /
&GRID LOWER = 0, 0, 0, UPPER = 30e-3, 10e-3, 10e-3 /
&WALL SIDE = 'zmin' /
&CLAMP LOWER = 0, 0, 0, UPPER = 0, 4e-3, 4e-3, COMPONENTS = 'x' /
&CLAMP LOWER = {LENGTH}, 0, 0, UPPER = {LENGTH}, 4e-3, 4e-3, COMPONENTS = 'x' /
"""


def bar(directory, rise):
    """A bar that is warmed evenly and cooled, its ends held along it."""
    directory.mkdir()
    (directory / "bar_input.nml").write_text(INPUT)
    points = synthetic.lattice(H, (LENGTH, 4e-3, 4e-3))
    for k, kelvin in enumerate((298.0, 298.0 + rise)):
        synthetic.write_frame(directory / f"bar_{k:06d}.hdf", points, {"temperature": np.full(len(points), kelvin)}, float(k),
                              attributes={"spacing": np.array([H]), "body_names": np.array([b"bar"])})
    return directory


def column(text, title, time, number):
    """A column of the block of a .dat file with a title at a time."""
    blocks = re.findall(title + r" \([^\n]*time +(\S+)\n\n(.*?)(?:\n\n|\Z)", text, re.S)
    (block,) = [rows for at, rows in blocks if float(at) == time]
    return np.array([float(line.split()[number]) for line in block.strip().splitlines()])


@pytest.mark.skipif(shutil.which("ccx") is None, reason="no ccx (Debian: calculix-ccx)")
@pytest.mark.parametrize("rise", [100.0, 150.0, 300.0])
def test_a_held_bar_keeps_the_stress_that_theory_says(tmp_path, rise):
    """Exact: warmed, it yields at its warm strength; cold, the stress is the thermal one less that, at most the cold strength; released, it is
    shorter by the elastic strain and free of stress."""
    directory = bar(tmp_path / "bar.out", rise)
    deck = tmp_path / "bar.inp"
    assert cli.main(["calculix", str(directory), "--cell", "2", "--strength", f"298={COLD}", f"{298 + rise}={HOT}", "-o", str(deck)]) == 0
    steps = deck.read_text().split("*END STEP")
    end = "*EL PRINT, ELSET=BODY1\nS\n*NODE PRINT, NSET=ALL\nU\n*END STEP"
    deck.write_text("*END STEP".join(steps[:1]) + "*END STEP" + steps[1] + end + steps[2] + end + "\n")
    done = subprocess.run(["ccx", "-i", "bar"], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and "Job finished" in done.stdout, done.stdout[-2000:]
    text = (tmp_path / "bar.dat").read_text()
    stress = max(0.0, min(YOUNG * 1e-6 * EXPANSION * rise - HOT, COLD))
    assert column(text, "stresses", 101.0, 2) == pytest.approx(stress, abs=0.5)
    assert column(text, "stresses", 102.0, 2) == pytest.approx(0.0, abs=0.5)
    shorter = np.ptp(column(text, "displacements", 102.0, 1))
    assert shorter == pytest.approx(LENGTH * 1e3 * stress / (YOUNG * 1e-6), rel=0.02)


def test_what_makes_no_deck_is_one_line(tmp_path, capsys):
    directory = bar(tmp_path / "bar.out", 100.0)
    assert cli.main(["calculix", str(directory), "--strength", "298"]) == 2
    (directory / "bar_input.nml").write_text(INPUT.replace("EXPANSION", "! EXPANSION"))
    assert cli.main(["calculix", str(directory), "--strength", "298=200"]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2 and "expected K=MPa" in lines[0] and "EXPANSION" in lines[1]
