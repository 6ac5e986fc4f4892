# SPDX-License-Identifier: MIT
"""The numbers in the documents are those recorded, and quick measurements reproduce the record."""

import dataclasses
import importlib.util

import documents
import figures
import measures
import pytest
import statements

RECORD = measures.recorded()


def test_documents_say_what_was_measured():
    """Every number of the documents is as recorded, or is a parameter, a limit or a figure of the literature."""
    assert not figures.not_as_recorded(RECORD)


@pytest.mark.parametrize("measure", [m for m in measures.ALL.values() if m.quick], ids=lambda m: m.name)
def test_quick_measurements(measure):
    """Measured anew: as recorded, within the tolerance of the measurement."""
    assert not figures.compare(measure, measure.run(), RECORD)


def test_the_window_is_of_the_rule_of_welds():
    """The input of the window of docs/window.md is the weld that the rule makes now; of another one its picture and table are to be made again."""
    spec = importlib.util.spec_from_file_location("welds_run", measures.ROOT / "benchmarks/welds/run.py")
    welds = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(welds)
    text = (measures.ROOT / "benchmarks/welds/window.nml").read_text(encoding="utf-8")
    assert text.split("\n", 1)[1] == welds.text_of("rabe-5754-3-1200-600-nominal", radii=4.0)


def test_another_value_is_named_with_its_document():
    """A number that is no longer reproduced is reported with its documented and its measured value."""
    measure = dataclasses.replace(measures.ALL["rotation"], own=None)
    fresh = dict(RECORD["rotation"], **{"flip ugimp": 0.4})
    complaints = figures.compare(measure, fresh, RECORD)
    assert any("docs/accuracy.md: 33 documented, 40 measured" in line for line in complaints)


@pytest.mark.parametrize("old, new, wanted", [
    ("FLIP loses 33 %", "FLIP loses 34 %", "34 documented, 33.03 measured"),
    ("FLIP loses 33 %", "FLIP loses some 33 %", "is not there just once"),
    ("## Rotation\n", "## Rotation\n\nIt is 12 % better.\n", ": 12: no measurement"),
    ("verify.py -->\n| problem", "verify.py -->\n| puzzle", "table 'verification' is not what was measured"),
])
def test_an_edited_document_fails(old, new, wanted, monkeypatch):
    """A number, a sentence or a table that is changed without the record, and a figure that nothing measures."""
    text = documents.read("docs/accuracy.md")
    assert old in text
    monkeypatch.setattr(documents, "read", lambda name, read=documents.read: text.replace(old, new, 1)
                        if name == "docs/accuracy.md" else read(name))
    assert any(wanted in line for line in figures.not_as_recorded(RECORD))


def test_numbers_are_read_with_their_digits():
    """A number says a value that it is when rounded to the digits printed."""
    def number(text):
        return documents.Found(text, 0, len(text))

    assert number("0.8").says(0.768) and not number("0.8").says(0.86) and not number("0.8").says(5.776)
    assert number("1.9e-3").says(1.94e-3) and not number("1.9e-3").says(1.96e-3)
    assert number("557,779").says(557779) and number("-0.37").says(-0.37)


def test_figures_are_found():
    """Numbers with units, points or exponents are figures; code, comments and tables of programs are silent."""
    text = "a 5 b, 0.8 and 0.9 % `7 %` <!-- 3 K --> in 12 s\n    6 K\n<!-- table x: y -->\n| 4 K |\n<!-- end of the table --> 1e-6"
    assert [n.text for n in documents.figures(text)] == ["0.8", "0.9", "12", "1e-6"]


def test_every_document_is_read_or_has_a_reason():
    there = {"README.md"} | {f"docs/{path.name}" for path in (documents.ROOT / "docs").glob("*.md")}
    assert there == set(documents.NAMES) | set(documents.NOT_READ)


def test_statements_and_definitions_are_of_these_documents():
    assert {s.document for s in statements.STATEMENTS} | {d[0] for d in statements.DEFINITIONS} <= set(documents.NAMES)
