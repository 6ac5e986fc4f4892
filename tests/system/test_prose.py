"""How the documents read: short sentences, the present, and no phrases of machines."""

import re

import driver
import pytest

# docs/input.md is written by the program.
DOCUMENTS = [driver.ROOT / "README.md", driver.ROOT / "CONTRIBUTING.md",
             *sorted(p for p in (driver.ROOT / "docs").rglob("*.md") if p.name != "input.md" and "ford" not in p.parts)]
LONGEST = 30   # words of a sentence; it ends at . ! ? : or ;
HISTORY = ("previously", "no longer(?! than)", "formerly", "used to be", "as of today", "until recently", "so far", "in the past", "was changed",
           "has been changed", "was removed", "were removed", "was added", "were added", "earlier version", "older version", "is new",
           "now(?! and then)", "not yet", "recently")
MACHINES = ("it is recommended", "it should be noted", "it is noted", "it can be seen", "can be seen that", "is performed by", "are performed by",
            "was carried out", "is carried out", "are carried out", "is being", "are being", "in order to", "due to the fact", "utilize",
            "is able to", "please note", "it is possible to", "has to be noted")
# Not prose: what programs write, comments, code, equations.
SILENT = re.compile(r"<!-- table .*?<!-- end of the table -->|<!-- (?:tables|pictures) .*?<!-- end of the \w+ -->|<!--.*?-->"
                    r"|^```.*?^```|^\$\$.*?^\$\$", re.DOTALL | re.MULTILINE)


def paragraphs(text):
    """Paragraphs and items of lists as one line each; headings, tables and indented code are left out."""
    block = []
    for line in [*SILENT.sub("", text).splitlines(), ""]:
        item = re.match(r" {0,3}(?:[-*]|\d+\.) ", line)
        silent = not line.strip() or line.startswith(("#", "|")) or (line.startswith("    ") and not block)
        if (silent or item) and block:
            yield " ".join(block)
            block = []
        if not silent:
            block.append(line[item.end() if item else 0:].strip())


def sentences(text):
    """Sentences of prose; code and formulas count as a word, a link as its text."""
    for paragraph in paragraphs(text):
        plain = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", paragraph)
        plain = re.sub(r"\]\([^)]*\)", "]", plain)
        plain = re.sub(r"`[^`]*`|\$[^$]+\$", "code", plain)
        plain = re.sub(r"\b(eqs?|figs?|e\.g|i\.e|vs|ch)\. ", r"\1 ", plain)
        yield from re.split(r"(?<=[.!?:;])\s+|(?<=[.!?]\))\s+", plain)


def complaints(text):
    for sentence in sentences(text):
        count = sum(any(c.isalnum() for c in word) for word in sentence.split())
        if count > LONGEST:
            yield f"{count} words: {sentence}"
        for kind, phrases in (("history", HISTORY), ("a machine's phrase", MACHINES)):
            found = [p for p in phrases if re.search(rf"\b{p}\b", sentence, re.IGNORECASE)]
            if found:
                yield f"{kind} ('{found[0]}'): {sentence}"


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_prose(path):
    """The house's rule: sentences of at most 30 words, in the present tense."""
    found = list(complaints(path.read_text(encoding="utf-8")))
    assert not found, "\n".join(found)


@pytest.mark.parametrize("text, wanted", [
    ("A " + "word " * 29 + "end.", "31 words"), ("A " + "word " * 28 + "end.", None), ("- one " + "word " * 15 + "\n- two " + "word " * 15, None),
    ("This was\nchanged.", "history"), ("It `now` runs, and knows.", None), ("It is performed by tools.", "a machine's phrase"),
    ("```\n" + "word " * 40 + "\n```\nText.", None), ("| " + "word " * 40 + "|", None), ("See eq. 4 " + "word " * 20 + "here. " + "word " * 20, None),
    ("At the end " + "word " * 20 + "and\nthe rest " + "word " * 10, "36 words")])
def test_checker(text, wanted):
    """It finds what it is for, across lines, and leaves code, tables and items of lists alone."""
    found = list(complaints(text))
    assert (found == []) if wanted is None else (len(found) == 1 and found[0].startswith(wanted))


@pytest.mark.parametrize("name, least", [("theory", 40), ("method", 20)])
def test_equations_are_drawn(name, least):
    """Every formula of these documents becomes MathML, which browsers draw without a script; none is left as it was typed."""
    pytest.importorskip("l2m4m")
    import markdown

    text = (driver.ROOT / f"docs/{name}.md").read_text(encoding="utf-8")
    formulas = re.findall(r"\$\$.*?\$\$|\$[^$]+\$", text, re.DOTALL)
    drawn = markdown.markdown(text, extensions=["l2m4m:LaTeX2MathMLExtension"])
    assert len(formulas) > least and drawn.count("<math") == len(formulas)
    assert "$" not in drawn and "\\" not in drawn and "merror" not in drawn
