# SPDX-License-Identifier: MIT
"""Numbers in the documents, and which of them a statement, a table or a definition covers."""

import dataclasses
import math
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]

NAMES = ("README.md", "docs/accuracy.md", "docs/choosing.md", "docs/heat.md", "docs/limits.md", "docs/method.md", "docs/microstructure.md",
         "docs/restart.md", "docs/results.md", "docs/speed.md", "docs/tutorial.md", "docs/validation.md", "docs/verification.md", "docs/welds.md")
# Documents that are not read, and why.
NOT_READ = {"docs/input.md": "the program writes it",
            "docs/index.md": "it has no figures",
            "docs/gallery.md": "it has no figures but how long a run takes, which --check measures",
            "docs/postprocessing.md": "it has no figures but limits of stirpost, which tests compare",
            "docs/window.md": "it has no figures but limits of stirpost, which tests compare",
            "docs/python.md": "it has no figures but those of its recipes",
            "docs/troubleshooting.md": "it has no figures; limits are in the pages that it links to",
            "docs/theory.md": "it has equations, and no figures",
            "docs/symbols.md": "it has symbols and units, and no figures",
            "docs/install.md": "it has no figures but versions, which cmake asks for",
            "docs/materials.md": "figures of the literature, with their sources in the library",
            "docs/architecture.md": "it has no figures; docs/architecture.py checks what it draws"}

NUMBER = r"[-+]?\d(?:[\d,]*\d)?(?:\.\d+)?(?:e[-+]?\d+)?"
UNITS = ("%|times|(?:K|s|ms|us|ns|h|hours|minutes|seconds|min|J|kJ|N|kN|kW|W|Pa|kPa|MPa|GPa|N m|GB/s|MB|kB|GB|bytes|mm|um|nm|mm3"
         "|m/s|mm/s|core-seconds|degrees|steps|GFLOP/s)\\b")
# What reads like a figure: a number (or several, "1, 2 and 3 %") with a unit, or one with a point or an exponent.
FIGURE = re.compile(rf"(?<![\w.#-]){NUMBER}(?:(?:,| to| and| or|,? and) {NUMBER})*[ -]?(?:{UNITS})"
                    r"|(?<![\w.#-])[-+]?\d[\d,]*(?:\.\d+(?![.\w])|\.\d+e[-+]?\d+|e[-+]?\d+)")
# What holds no figures: fenced and inline code, comments, tables that a program writes, targets of links.
TABLES = r"<!-- table .*?<!-- end of the table -->|<!-- (?:tables|pictures) .*?<!-- end of the \w+ -->"
WRITTEN = re.compile(TABLES, re.DOTALL)
SILENT = re.compile(TABLES +
                    r"|```.*?```|<!--.*?-->|`[^`]*`|!\[[^\]]*\]|\]\([^)]*\)|(?<=\n)    [^\n]*", re.DOTALL)


@dataclasses.dataclass(frozen=True)
class Found:
    """A number in a document: its text and position."""

    text: str
    begin: int
    end: int

    @property
    def value(self):
        return float(self.text.replace(",", ""))

    @property
    def last_place(self):
        """Size of the last printed digit."""
        digits, _, exponent = self.text.replace(",", "").partition("e")
        decimals = len(digits.partition(".")[2])
        return 10.0 ** (int(exponent or 0) - decimals)

    def says(self, value):
        """True if `value`, rounded to the digits printed, is this number."""
        return math.isfinite(value) and abs(self.value - value) <= 0.5001 * self.last_place + 1e-12 * abs(value)


def read(name):
    return (ROOT / name).read_text(encoding="utf-8")


def silenced(text):
    """The text with blanks for what holds no figures; places stay what they are."""
    return SILENT.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


def without_tables(text):
    """The text with blanks for the tables that programs write; places stay what they are."""
    return WRITTEN.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


def pattern(words):
    """A search for a text that may be broken into lines anywhere; '#' stands for a number."""
    parts = [re.sub(r"(?:\\?\s)+", r"\\s+", re.escape(part)) for part in words.split("#")]
    return re.compile(f"({NUMBER})".join(parts))


def find(text, words):
    """Numbers at the '#' of `words`, which must be in `text` once; None if they are not."""
    found = list(pattern(words).finditer(text))
    if len(found) != 1:
        return None
    return [Found(found[0].group(k), *found[0].span(k)) for k in range(1, (found[0].re.groups) + 1)]


def span(text, words):
    """Position of `words`, with their numbers, in the text; None unless they occur exactly once."""
    found = list(re.finditer(re.sub(r"(?:\\?\s)+", r"\\s+", re.escape(words)), text))
    return found[0].span() if len(found) == 1 else None


def figures(text):
    """All numbers that are figures, one by one."""
    for match in FIGURE.finditer(silenced(text)):
        for number in re.finditer(NUMBER, match.group()):
            yield Found(number.group(), match.start() + number.start(), match.start() + number.end())


def line_of(text, place):
    return text.count("\n", 0, place) + 1


TABLE = re.compile(r"(<!-- table ([\w ,]+): [^>]*-->\n)(.*?)(<!-- end of the table -->)", re.DOTALL)


def tables(text):
    """Name and lines of every table that a program writes."""
    return {match.group(2): match.group(3) for match in TABLE.finditer(text)}


def with_tables(text, written):
    """The text with its tables as `written` (name: lines)."""
    return TABLE.sub(lambda m: m.group(1) + written[m.group(2)] + m.group(4), text)
