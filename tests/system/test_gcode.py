# SPDX-License-Identifier: MIT
"""A machine's program as &MOTION: places, speeds and spin are those of the program, and the input that it goes into runs."""

import re
import sys

import driver
import numpy as np
import pytest

sys.path.insert(0, str(driver.ROOT / "postproc"))
from stirpost import cli  # noqa: E402
from stirpost.cli import gcode  # noqa: E402

PROGRAM = """%
O1000 (a weld along an L)
N10 G21 G90 G94 G17
N20 G0 X15 Y20 Z13.3
N30 S300 M3
N40 G1 Z7.4 F120 ; plunge
N50 G4 P0.5
N60 G1 X30 F240
N70 G91 Y5
N80 G90 G0 Z20
N90 M5
M30
"""


def test_program_of_a_weld():
    """Exact: each place that the program names, the time of each move, the spin; relative moves, inches and the other sense."""
    machine = gcode.read(PROGRAM, rapid=1e-2)
    times = np.array([phase[0] for phase in machine.phases])
    assert np.allclose(machine.start, [15e-3, 20e-3, 13.3e-3])
    assert np.allclose(times, [5.9 / 2.0, 0.5, 15 / 4.0, 5 / 4.0, 12.6e-3 / 1e-2])
    places = machine.start + np.cumsum([phase[0] * phase[1] for phase in machine.phases], axis=0)
    assert np.allclose(1e3 * places, [[15, 20, 7.4], [15, 20, 7.4], [30, 20, 7.4], [30, 25, 7.4], [30, 25, 20]])
    assert [phase[2] for phase in machine.phases] == [300.0] * 5
    inches = gcode.read("G20 G1 X0 Y0 Z1 F6\nM4 S200\nG1 Z0.5")
    assert np.allclose(inches.phases[0][0], 5.0) and inches.phases[0][2] == -200.0
    assert np.allclose(inches.phases[0][1], [0, 0, -0.1 * 25.4e-3])


@pytest.mark.parametrize("line, told", [("G2 X1 I5", "G2 is not read"), ("G1 A30", "A: only straight moves"), ("G0 X50", "--rapid"),
                                        ("G1 X#5", "not understood"), ("G95 G1 X3", "G95 is not read")])
def test_what_is_not_read_is_refused(line, told):
    with pytest.raises(ValueError, match=f"line 2: .*{re.escape(told)}"):
        gcode.read(f"G1 X0 Y0 Z0 F60\n{line}\n")


def test_input_with_a_program(run, tmp_path, capsys):
    """The groups are those of an input that --check takes: ways and speeds of its phases are the program's."""
    (tmp_path / "weld.nc").write_text(PROGRAM, encoding="utf-8")
    assert cli.main(["gcode", str(tmp_path / "weld.nc"), "--rapid", "600"]) == 0
    motions, warned = capsys.readouterr()
    assert "POSITION = 0.015, 0.02, 0.0133" in motions and "moves 9.21 s, dwells (G4 P) 0.5 s" in motions and warned == ""
    (tmp_path / "ms.nc").write_text(PROGRAM.replace("P0.5", "P500"), encoding="utf-8")
    assert cli.main(["gcode", str(tmp_path / "ms.nc"), "--rapid", "600"]) == 0
    assert "the dwells take 500 s, longer than the moves (9.21 s)" in capsys.readouterr().err
    scene = re.sub(r"^&MOTION [^/]*/\n", "", run(None, "--new", "pin").out, flags=re.M)
    (tmp_path / "weld.nml").write_text(scene + motions, encoding="utf-8")
    out = run("weld.nml", "--check=scene", sets={"TIME.END": 9.71, "TOOL.POSITION": "15e-3,20e-3,13.3e-3"}).out
    rows = [line.split() for line in out.splitlines() if re.match(r" {4}\w+ +\d+\.\d+ ", line)]
    rows = rows[:5]   # a rest of no length may follow
    assert [row[0] for row in rows] == ["plunge", "dwell", "travel", "travel", "retract"]
    assert np.allclose([[float(word) for word in row[3:6]] for row in rows],
                       [[5.9, 2, 300], [0, 0, 300], [15, 4, 300], [5, 4, 300], [12.6, 10, 300]], atol=1e-3)
