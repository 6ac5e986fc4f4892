# SPDX-License-Identifier: MIT
"""Cooling records, shares, residuals, and the fit of inputs with a program that is made up."""

import sys

import numpy as np
import pytest

import calibrate_heat as calibrate
from stirpost import cooling

COPPER = dict(density=8960, specific_heat=386, volume=4.671e-5, area=0.004)


def record(rate, room=298.0):
    time = np.arange(65.0, 120.0, 0.5)
    return cooling.Record(time, ["T1", "T2"], np.array([room + a * np.exp(-rate * (time - 65)) for a in (400, 380)]).T)


@pytest.mark.parametrize("rate, film", [(0.0174, 701.7), (0.0140, 564.6)])
def test_both_methods_find_the_rate(rate, film):
    found = (cooling.rate_by_differences(record(rate), 298.0), cooling.rate_by_exponential(record(rate), 298.0),
             cooling.rate_by_exponential(record(rate)))
    for rates in found:
        assert rates == pytest.approx(rate, rel=1e-3)
    h = cooling.film_coefficient(rate, COPPER["density"], COPPER["specific_heat"], COPPER["volume"], COPPER["area"])
    assert h == pytest.approx(film, rel=2e-3)


def test_share_of_copper_and_steel():
    assert cooling.heat_share((391, 8960, 386), (14.4, 7800, 460)) == pytest.approx(0.836, abs=1e-3)


def test_record_and_residuals(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("# a title\ntime[s],T1[K],T2[K],T1_x[m]\n0,300,300,1\n1,310,320,1\n2,320,340,1\n")
    model = cooling.Record.read(path)
    assert model.names == ["T1", "T2"]
    measured = cooling.Record(np.array([0.5, 1.5, 9.0]), ["T2"], np.array([[309.0], [331.0], [0.0]]))
    apart = cooling.residuals(model, measured)
    assert apart["time"].tolist() == [0.5, 1.5]
    assert apart["T2"] == pytest.approx([1.0, -1.0])
    with pytest.raises(ValueError):
        cooling.residuals(model, cooling.Record(model.time, ["X"], model.values[:, :1]))


def test_fit_finds_an_input(tmp_path, capsys):
    """A program that writes T = 300 + 2 t + the input finds that input from a record made with 7."""
    program = tmp_path / "program.py"
    program.write_text(f"""#!{sys.executable}
import sys, pathlib
words = sys.argv[1:]
place = pathlib.Path(words[words.index("--output") + 1])
value = [float(w.split("=")[1]) for w in words if w.startswith("A.B=")][-1]
rows = "".join(f"{{t}},{{300 + 2 * t + value}}\\n" for t in range(5))
(place / "x_probes.csv").write_text("time[s],T1[K]\\n" + rows)
""")
    program.chmod(0o755)
    data = tmp_path / "data.csv"
    data.write_text("time[s],T1[K]\n" + "".join(f"{t},{307 + 2 * t}\n" for t in range(5)))
    status = calibrate.main(["fit", "input.nml", str(data), "--vary", "A.B=3,0,20", "--program", str(program)])
    assert status == 0
    assert "A.B = 7" in capsys.readouterr().out
