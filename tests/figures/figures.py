#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Figures of the documents, each with the command that measures it.

    build/venv/bin/python tests/figures/figures.py                   # the documents agree with what was measured (nothing runs)
    build/venv/bin/python tests/figures/figures.py cantilever rotation     # measure these anew and compare
    build/venv/bin/python tests/figures/figures.py --quick | --all         # those of a few seconds | all
    build/venv/bin/python tests/figures/figures.py --list            # what is measured, how, and which document says it
    build/venv/bin/python tests/figures/figures.py NAME --record     # keep what is measured; then --pages
    build/venv/bin/python tests/figures/figures.py --pages           # write the tables of the documents

A NAME is a measurement or the first word of some. Exit status 1: a figure no longer holds.
"""

import argparse
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

import documents  # noqa: E402
import measures  # noqa: E402
import statements  # noqa: E402
import tables  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="*", help="measurements (see --list)")
    parser.add_argument("--list", action="store_true", help="measurements, commands, documents")
    parser.add_argument("--quick", action="store_true", help="measure what takes a few seconds")
    parser.add_argument("--all", action="store_true", help="measure everything")
    parser.add_argument("--record", action="store_true", help="keep what is measured in measured.jsonl")
    parser.add_argument("--pages", action="store_true", help="write the tables of the documents")
    return parser.parse_args()


def named(words):
    """The measurements of these names."""
    chosen = []
    for word in words:
        found = [m for m in measures.ALL.values() if m.name == word or m.name.startswith(word + " ")]
        if not found:
            sys.exit(f"figures.py: no measurement {word}; see --list")
        chosen += [m for m in found if m not in chosen]
    return chosen


def not_as_recorded(record):
    """Statements, tables and numbers of the documents that no record bears out."""
    complaints = []
    for name in documents.NAMES:
        text = documents.read(name)
        covered, own = statements.check(name, text, record)
        complaints += own
        for number in documents.figures(text):
            if not any(begin <= number.begin and number.end <= end for begin, end in covered):
                complaints.append(f"{name}:{documents.line_of(text, number.begin)}: {number.text}: no measurement and no "
                                  "definition in tests/figures/statements.py covers this number")
    for name in documents.NAMES:
        for title, lines in documents.tables(documents.read(name)).items():
            if title not in tables.ALL:
                complaints.append(f"{name}: no table '{title}' in tests/figures/tables.py")
                continue
            try:
                agrees = tables.ALL[title](record) == lines
            except KeyError as missing:
                complaints.append(f"{name}: table '{title}': nothing recorded for {missing}")
                continue
            if not agrees:
                complaints.append(f"{name}: table '{title}' is not what was measured; figures.py --pages writes it")
    if not tables.has_series(documents.read(tables.SERIES)):
        complaints.append(f"{tables.SERIES}: tables of benchmarks/work_precision are not those of its results; its work_precision.py --page "
                          "writes them")
    return complaints


def compare(measure, fresh, record):
    """What of `fresh` is not as recorded, with the documents that say it."""
    complaints = []
    for key, value in fresh.items():
        known = record[measure.name].get(key)
        if known is None:
            complaints.append(f"{measure.name}: {key} is not recorded")
        elif not measure.agrees(known, value):
            places = statements.places(measure.name, key, known, value) or [f"{measure.name}, {key}: {known:.4g} recorded, "
                                                                            f"{value:.4g} measured"]
            complaints += places
    return complaints


def show_list():
    for measure in measures.ALL.values():
        print(f"{measure.name:22} {'quick ' if measure.quick else '      '} {', '.join(statements.said_in(measure.name))}")
        print(f"{'':29} {measure.command}")
        print(f"{'':29} to {measure.tolerance:.1%}: {measure.reason}")


def write_pages(record):
    for name in documents.NAMES:
        text = documents.read(name)
        titles = documents.tables(text)
        if titles:
            new = documents.with_tables(text, {title: tables.ALL[title](record) for title in titles})
            (documents.ROOT / name).write_text(new, encoding="utf-8")


def main():
    options = arguments()
    if options.list:
        show_list()
        return 0
    record = measures.recorded()
    if options.pages:
        write_pages(record)
    chosen = named(options.name)
    if options.quick or options.all:
        chosen += [m for m in measures.ALL.values() if options.all or m.quick]
    complaints = []
    for measure in chosen:
        fresh = measure.run()
        print(f"{measure.name}: " + "; ".join(f"{key}: {value:.5g}" for key, value in fresh.items()), flush=True)
        if options.record:
            measures.keep(measure, fresh)
        elif measure.name not in record:
            complaints.append(f"{measure.name}: nothing recorded (--record)")
        else:
            complaints += compare(measure, fresh, record)
    if options.record:
        record = measures.recorded()
    complaints += not_as_recorded(record)
    for complaint in complaints:
        print(complaint)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
