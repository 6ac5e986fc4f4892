# SPDX-License-Identifier: MIT
"""stirpost compare RUN --machine LOG: names, units, separators, bad rows, and the differences."""

import re

import numpy as np
import pandas as pd
import pytest
import synthetic

from stirpost import cli
from stirpost.analysis.cooling import Record
from stirpost.plots import machine
from stirpost.run import Run


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return synthetic.make_run(tmp_path_factory.mktemp("runs") / "plate.out", spacing=0.008, frames=1, rows=241)


def curves(run):
    """What the run computes at every tenth of its rows, averaged over half a second."""
    there, time = Run(run), np.linspace(1, 11, 21)
    return time, {name: machine.means(table["time"], table[name], time) for table, name in (
        (there.history, "pin_torque"), (there.history, "pin_force_z"), (there.history, "pin_power"), (there.probes, "T1"))}


# A log in many hands: headings, numbers of a row from (time, torque [N m], force [N], power [W], T1 [K]), separator, options.
HANDS = {
    "as the run": ("time[s],pin_torque[Nm],pin_force_z[N],pin_power[W],T1[K]", lambda t, m, f, p, k: (t, m, f, p, k), ","),
    "units of the shop": ("Time (min);Spindle Torque [kN m];Fz [kN];power (kW);t1 [\u00b0C]",
                          lambda t, m, f, p, k: (t / 60, m / 1e3, f / 1e3, p / 1e3, k - 273.15), ";"),
    "decimal commas": ("time [s];torque [N m];axial force [kN];spindle_power [kW];T1 [C]",
                       lambda t, m, f, p, k: (t, m, f / 1e3, p / 1e3, k - 273.15), ";"),
    "names and units by hand": ("no|clock|M|F1|P [W]|TC one|state", lambda t, m, f, p, k: (7, t / 60, m, -f / 1e3, p, k - 273.15, 1), "|",
                                "--delimiter | --column time=clock --unit time=min --column torque=M --unit torque=N\u00b7m "
                                "--column force_z=-F1 --unit force_z=kN --column power=P --column T1=TC~one --unit T1=C"),
    "later": ("time[s],torque[Nm],Fz[N],power[W],T1[K]", lambda t, m, f, p, k: (t - 2.5, m, f, p, k), ",", "--shift 2.5"),
}


@pytest.mark.parametrize("hand", HANDS)
def test_logs_are_read_as_they_come(run, tmp_path, capsys, hand):
    """The log is what the run computes: no difference is left, whatever its names, units and separators."""
    header, row, mark, *words = HANDS[hand]
    time, known = curves(run)
    rows = [mark.join(f"{x:.9g}" for x in row(*values)) for values in zip(time, *known.values())]
    text = "\n".join(rows)
    path = tmp_path / "log.csv"
    path.write_text("# a log\n" + header + "\n" + (text.replace(".", ",") if hand == "decimal commas" else text) + "\n")
    words = [word.replace("~", " ") for word in words[0].split()] if words else []
    assert cli.main(["compare", str(run), "--machine", str(path), "-o", str(tmp_path / "out"), *words]) == 0
    table = pd.read_csv(tmp_path / "out/machine.csv", index_col="quantity")
    assert set(table.index) == set(known) and (table["readings"] == len(time)).all()
    for name, values in known.items():
        assert table.loc[name, "peak, measured"] == pytest.approx(values.max(), rel=1e-6)
        assert table.loc[name, ["rms", "peak, difference", "mean, difference", "time of peak, difference"]].tolist() == \
            pytest.approx([0.0] * 4, abs=1e-5 * values.max())
    assert (tmp_path / "out/machine.png").stat().st_size > 5000
    assert "pin torque, 1 to 11 s, 21 readings" in capsys.readouterr().out


def test_differences(run, tmp_path):
    """A torque that is a tenth larger, and two newton metres more: peak, mean and rms, over the span of both."""
    time, known = curves(run)
    torque = known["pin_torque"]
    (pair,) = machine.pairs(Run(run), Record(np.append(time, 99.0), ["torque"], np.append(1.1 * torque + 2.0, 0.0)[:, None], ["Nm"], []), 0.0)
    rows = pair.rows()
    mean = machine.over_time(time, torque)
    assert len(pair.time) == len(time) and pair.time[-1] == 11.0
    assert rows["peak"] == pytest.approx((torque.max(), 1.1 * torque.max() + 2.0, -0.1 * torque.max() - 2.0))
    assert rows["mean"] == pytest.approx((mean, 1.1 * mean + 2.0, -0.1 * mean - 2.0))
    assert rows["time of peak"][2] == 0.0
    assert pair.rms() == pytest.approx(np.sqrt(machine.over_time(time, (0.1 * torque + 2.0) ** 2)))
    assert machine.lines([pair])[2].split()[-1] == "%)"


def test_bad_rows_are_named_and_left_out(run, tmp_path, capsys):
    path = tmp_path / "log.csv"
    path.write_text("time [s],torque [N m],other [bar],Foo [N]\n1,30,5,1\n2,31,5\n3,x,5,1\n4,33,5,1\n3.5,33,5,1\ny,1,5,1\n5,inf,5,1\n6,34,,1\n")
    assert cli.main(["compare", str(run), "--machine", str(path), "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr()
    for line, text in ((3, "3 values in a table of 4"), (4, "'x' is no number for torque"), (6, "time does not rise"),
                       (7, "'y' is no number for time"), (8, "inf for torque")):
        assert f"warning: {path}:{line}: {text}" in said.err
    assert "'Foo' of the log is no column of the run" in said.err and "other [bar]" in said.err
    assert "pin torque, 1 to 6 s, 3 readings" in said.out


REFUSED = {
    "no such column": ("time[s],torque[Nm]\n0,1\n1,2\n", "--column torque=M", r"log.csv:1: no column 'M'; there are: time\[s\], torque"),
    "nothing to compare": ("time[s],M[Nm]\n0,1\n1,2\n", "", "no column of the log can be compared"),
    "another time": ("time[s],torque[Nm]\n100,1\n101,2\n", "", "has 0 readings between 0 and 12 s"),
    "another unit": ("time[s],torque[N]\n1,1\n2,2\n", "", "is in N, pin_torque of the run in Nm"),
    "no unit of time": ("time,torque[Nm]\n1,1\n2,2\n", "", r"log.csv:1: the first column is 'time': expected time\[s\]"),
    "no unit": ("time[s],torque\n1,1\n2,2\n", "", "log.csv:1: no column of temperatures, as .* or of loads"),
    "celsius": ("time[s],T1[K]\n1,25\n2,30\n", "", "if that is degrees Celsius"),
    "delimiter": ("time[s],T1[K]\n1,25\n2,30\n", "--delimiter xx", "expected one character"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_logs_that_are_refused(run, tmp_path, capsys, name):
    text, words, message = REFUSED[name]
    (tmp_path / "log.csv").write_text(text)
    assert cli.main(["compare", str(run), "--machine", str(tmp_path / "log.csv"), "-o", str(tmp_path / "out"), *words.split()]) == 2
    assert re.search(message, capsys.readouterr().err)


@pytest.mark.parametrize("words", [[], ["other.out", "--machine", "log.csv"]])
def test_one_thing_to_compare_with(run, words, capsys):
    with pytest.raises(SystemExit):
        cli.main(["compare", str(run), *words])
    assert "either a second run or --machine" in capsys.readouterr().err
