# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from stirpost.io.table import parse_heading, parse_numbers, read_table


def table_of(tmp_path, text):
    path = tmp_path / "history.csv"
    path.write_text(text)
    return read_table(path, [])


def test_columns_are_found_by_name_with_their_unit(tmp_path):
    table = table_of(
        tmp_path,
        "# a comment\n# SI\ntime[s], pin_torque[Nm],step,kinetic[J]\n0,1.5,0,2\n1,2.5,10,4\n",
    )
    assert table["pin_torque"].tolist() == [1.5, 2.5]
    assert table.unit("pin_torque") == "Nm" and table.unit("step") == ""
    assert [c.name for c in table.with_unit("J")] == ["kinetic"]
    assert [c.name for c in table.matching(r".+_torque")] == ["pin_torque"]
    assert "elastic" not in table


@pytest.mark.parametrize(
    "text, expected",
    [
        ("audit_error[%]", ("audit_error", "%")),
        (" step ", ("step", "")),
        ("v [m/s]", ("v", "m/s")),
        ("a[]", ("a", "")),
    ],
)
def test_heading(text, expected):
    assert parse_heading(text) == expected


@pytest.mark.parametrize(
    "text, expected", [("1.5E+02", 150.0), ("1.5D+02", 150.0), (" -2.5-101", -2.5e-101)]
)
def test_numbers_of_fortran(text, expected):
    assert parse_numbers([text])[0] == expected


def test_stars_are_not_a_number():
    assert np.isnan(parse_numbers(["********"])[0])


def test_a_row_cut_short_is_left_out(tmp_path):
    assert table_of(tmp_path, "time[s],T1[K]\n0,300\n1,310\n2,3")["T1"].tolist() == [300, 310, 3]
    assert table_of(tmp_path, "time[s],T1[K]\n0,300\n1")["T1"].tolist() == [300]


def test_after_a_restart_the_later_rows_count(tmp_path):
    table = table_of(tmp_path, "time[s],T1[K]\n0,1\n1,2\n2,3\n3,4\n2,30\n3,40\n4,50\n")
    assert table["time"].tolist() == [0, 1, 2, 3, 4]
    assert table["T1"].tolist() == [1, 2, 30, 40, 50]


def test_nothing_to_read_is_an_empty_table(tmp_path):
    assert len(read_table(tmp_path / "absent.csv", [])) == 0
    for text in ("", "time[s],T1[K]\n", "time[s],T1[K]\nNaN,300\n", "x[m],T1[K]\n1,300\n"):
        table = table_of(tmp_path, text)
        assert not table and table.columns == table.with_unit("K") == table.matching(".*") == []
