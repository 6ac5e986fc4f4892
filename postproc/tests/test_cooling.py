# SPDX-License-Identifier: MIT
"""Cooling records, shares, residuals, and the fit of inputs with a program that is made up."""

import re
import sys

import numpy as np
import pytest

from stirpost import cli
from stirpost.analysis import cooling

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


FILM = ["--density", "8960", "--specific-heat", "386", "--volume", "4.671e-5", "--area", "0.004"]


def test_undetermined_final_temperature_leaves_the_other_fits(tmp_path, capsys):
    """A straight line has no final temperature: the exponential with a free one reports an error, the two other fits remain;
    likewise if one of two thermocouples fails."""
    time = np.arange(65.0, 100.0, 1.0)
    straight, bent = 700.0 - 2.0 * (time - 65.0), 298.0 + 400.0 * np.exp(-0.02 * (time - 65.0))
    for names, curves, last in (("T1[K]", [straight], "T1 no fit  the record does not determine it"),
                                ("T1[K],T2[K]", [straight, bent], "T1 no fit  T2 0.02000  mean 0.02000 1/s")):
        path = tmp_path / "line.csv"
        path.write_text(f"time[s],{names}\n" + "".join(f"{','.join(map(repr, map(float, row)))}\n" for row in zip(time, *curves)))
        assert cli.main(["calibrate", "heat", "film", str(path), *FILM]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert len(lines) == 3 and all("W/(m2 K)" in line for line in lines[:2])
        assert last in lines[2]


# One record in many hands: header, values of a row from (time, T1 in K), options.
HANDS = {
    "kelvin": ("time[s],T1[K]", lambda t, x: f"{t},{x}", ""),
    "celsius": ("time[s],T1[C]", lambda t, x: f"{t},{x - 273.15}", ""),
    "degrees": ("t (s);T1 (\u00b0C)", lambda t, x: f"{t};{x - 273.15}", ""),
    "minutes": ("time[min],T1[K]", lambda t, x: f"{t / 60!r},{x}", ""),
    "decimal commas": ("time[s];T1[C]", lambda t, x: f"{t};{x - 273.15}".replace(".", ","), ""),
    "tabs": ("time[s]\tT1[K]", lambda t, x: f"{t}\t{x}", ""),
    "byte order mark": ("\ufefftime[s],T1[K]", lambda t, x: f"{t},{x}", ""),
    "unit by hand": ("time[s],T1", lambda t, x: f"{t},{x - 273.15}", "C"),
    "other columns": ("time[s],force[N],T1[K],T1_x[m]", lambda t, x: f"{t},,{x},0.1", ""),
    "quoted": ('"time[s]","T1[K]"', lambda t, x: f'"{t}","{x}"', ""),
}


@pytest.mark.parametrize("hand", HANDS)
def test_records_are_read_as_they_come(tmp_path, hand):
    header, row, unit = HANDS[hand]
    path = tmp_path / "a.csv"
    text = header + "\n" + "".join(row(t, x) + "\r\n" for t, x in ((0.5, 300.25), (1.5, 573.5), (2.5, 450.0)))
    for encoding in ("utf-8",) if header.startswith("\ufeff") else ("utf-8", "cp1252", "utf-16"):
        path.write_bytes(text.encode(encoding))
        found = cooling.Record.read(path, unit or None)
        assert found.names == ["T1"]
        assert found.time == pytest.approx([0.5, 1.5, 2.5])
        assert found.values[:, 0] == pytest.approx([300.25, 573.5, 450.0])


MISTAKES = {
    "celsius for kelvin": ("time[s],T1[K]\n0,300\n1,24.5\n", r"a\.csv:3: T1 is 24\.5 K: if that is degrees Celsius"),
    "no unit": ("time[s],T1\n0,300\n", r"a\.csv:1: column 'T1': expected T1\[K\] or T1\[C\]"),
    "no unit of time": ("time,T1[K]\n0,300\n", r"a\.csv:1: the first column is 'time': expected time\[s\]"),
    "fahrenheit": ("time[s],T1[F]\n0,300\n", r"a\.csv:1: column 'T1\[F\]'"),
    "no thermocouple": ("time[s],force[N]\n0,300\n", r"a\.csv:1: no column of temperatures"),
    "twice": ("time[s],T1[K],T1[K]\n0,300,300\n", r"a\.csv:1: two columns are called T1"),
    "empty time": ("time[s],T1[K]\n0,300\n,301\n", r"a\.csv:3: '' is no number for time"),
    "decimal commas": ("# x\ntime[s],T1[K]\n0,5,300,1\n", r"a\.csv:3: 4 values in a table of 2 columns \(numbers with decimal"),
    "cut row": ("time[s],T1[K],T2[K]\n0,300,300\n1,301\n", r"a\.csv:3: 2 values in a table of 3 columns"),
    "words": ("time[s],T1[K]\n0,300\n1,open\n", r"a\.csv:3: 'open' is no number for T1"),
    "infinite": ("time[s],T1[K]\n0,300\n1,inf\n", r"a\.csv:3: inf for T1"),
    "time falls": ("time[s],T1[K]\n0,300\n2,300\n1,300\n", r"a\.csv:4: time does not rise"),
    "empty column": ("time[s],T1[K],T2[K]\n0,300,\n1,301,\n", r"T2 has no reading"),
    "no rows": ("time[s],T1[K]\n", r"no rows"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_records_that_are_refused(tmp_path, capsys, name):
    text, message = MISTAKES[name]
    (tmp_path / "a.csv").write_text(text)
    assert cli.main(["calibrate", "heat", "film", str(tmp_path / "a.csv"), *FILM]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert re.search(message, line), line


def test_all_mistakes_at_once_and_room_in_celsius(tmp_path, capsys):
    path = tmp_path / "a.csv"
    path.write_text("time[s],T1[K]\n0,300\n1,x\n1.5,y\n2,24\n")
    assert cli.main(["calibrate", "heat", "film", str(path), *FILM]) == 2
    assert [line.split(":")[1] for line in capsys.readouterr().err.splitlines()[1:]] == ["4", "5"]
    path.write_text("time[s],T1[K]\n" + "".join(f"{t},{400 - t}\n" for t in range(65, 80)))
    for room, message in (("25", "--room 25 is in kelvin"), ("500", "not above the room")):
        assert cli.main(["calibrate", "heat", "film", str(path), "--room", room, *FILM]) == 2
        assert message in capsys.readouterr().err


def test_readings_that_are_missing_are_left_out(tmp_path):
    """Each thermocouple without every third reading gives the rate of the whole record."""
    whole = record(0.0174)
    rows = [f"{t}," + ",".join("" if (k + c) % 3 == 0 else repr(float(x)) for c, x in enumerate(row))
            for k, (t, row) in enumerate(zip(whole.time, whole.values))]
    path = tmp_path / "gaps.csv"
    path.write_text("time[s],T1[K],T2[K]\n" + "\n".join(rows) + "\n")
    found = cooling.Record.read(path)
    for rates in (cooling.rate_by_differences(found, 298.0), cooling.rate_by_exponential(found, 298.0),
                  cooling.rate_by_exponential(found)):
        assert rates == pytest.approx(0.0174, rel=1e-3)


def test_standard_errors_of_a_fit():
    """Over 200 records with noise the fitted numbers scatter by their standard errors, whether the noise of rows
    is independent or lasts for ten of them; one at a bound has none."""
    random = np.random.default_rng(5)
    time = np.linspace(0.0, 100.0, 400)
    true, low, high = np.array([400.0, 0.02]), np.array([100.0, 0.001]), np.array([900.0, 0.1])

    def curve(x):
        return x[0] * np.exp(-x[1] * time)

    for lasts, tolerance in ((1, 0.15), (10, 0.3)):
        noise = random.standard_normal((200, len(time) + lasts - 1))
        noise = np.array([np.convolve(row, np.ones(lasts), "valid") for row in noise])
        fits = [cooling.fit(lambda x, rest=rest: [curve(x) - curve(true) - rest], 0.8 * true, low, high) for rest in noise]
        scatter = np.std([found.values for found in fits], axis=0)
        errors = np.mean([found.errors for found in fits], axis=0)
        assert errors / scatter == pytest.approx(1.0, abs=tolerance)
    held = cooling.fit(lambda x: [curve(x) - curve(true)], [300.0, 0.05], [100.0, 0.04], high)
    assert np.isfinite(held.errors[0]) and np.isnan(held.errors[1])
    same = cooling.fit(lambda x: [curve([x[0] + x[1], 0.02]) - curve(true)], [200.0, 100.0], [0.0, 0.0], [500.0, 500.0])
    assert np.isnan(same.errors).all()


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
    status = cli.main(["calibrate", "heat", "fit", "input.nml", str(data), "--vary", "A.B=3,0,20", "--program", str(program)])
    assert status == 0
    assert "A.B = 7 +- " in capsys.readouterr().out
