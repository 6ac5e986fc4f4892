#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Which faults the tests detect: flipped signs, off-by-ones and dropped factors at places drawn over all libraries of modules/.

    build/venv/bin/python tests/detection/mutations.py SCRATCH [--number 25] [--seed 1] [--only LIBRARY...] [--units]
    build/venv/bin/python tests/detection/mutations.py SCRATCH --table

The sources are copied to SCRATCH and built there; each mutation is built from what it changes, meets the unit and
parallel tests, and where these pass (and without --units) the tests of whole runs of the tier smoke. What became of each
is a line of SCRATCH/mutations.jsonl, and a further call with the same folder goes on behind it; one without --units begins
with what survived one with it. --table: what is caught, by library. What survives is read: it may change nothing that a
result shows, a message or an estimate, and then gets a `reason` in its line. The lines of docs/verification.md are in
tests/detection/mutations.jsonl.
"""

import argparse
import collections
import filecmp
import itertools
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/system"))

import driver  # noqa: E402

OPERAND = r"(?:[a-z]\w*(?:%\w+)*|\d+\.\d*(?:e-?\d+)?_rp)"
# Kind: what is replaced, and what stands there then.
KINDS = {
    "sign": [(r"(?<=[\w)]) \+ (?=[\w(])", " - "), (r"(?<=[\w)]) - (?=[\w(])", " + ")],
    "factor": [(rf"\b{OPERAND}\*(?=[\w(])", ""), (rf"(?<=[\w)])\*{OPERAND}(?![\w%(]|\*\*)", "")],
    "off by one": [(r"(?<=[\w)]) [+-] 1(?=[,):]|$)", ""), (r"(?<== )1(?=, )", "2")],
}
STATEMENT = re.compile(r"(?:if \(.*\) )?[a-z][\w%]*(?:\([^=]*\))? = |do \w+ = ")


def candidates(path):
    """[(line, kind, new text)] of the statements of a file that calculate: neither declarations nor texts."""
    found = []
    for k, line in enumerate(path.read_text(encoding="utf-8").splitlines()):
        code = line.split("!")[0].rstrip()
        if not STATEMENT.match(code.strip()) or "'" in code or "::" in code:
            continue
        for kind, rules in KINDS.items():
            for pattern, new in rules:
                for hit in re.finditer(pattern, code):
                    if kind != "sign" or not re.match(r"1(?=[,):]|$)", code[hit.end():]):
                        found.append((k, kind, code[:hit.start()] + new + code[hit.end():]))
    return found


def draw(seed, only):
    """Library after library in a drawn order, forever: (library, file, line, kind, new text)."""
    chance = random.Random(seed)
    places = {}
    for folder in sorted((ROOT / "modules").iterdir()):
        files = [(path, *place) for path in sorted(folder.glob("*.[fF]90")) for place in candidates(path)]
        if files and (not only or folder.name in only):
            places[folder.name] = files
    while True:
        for library in chance.sample(sorted(places), len(places)):
            path, line, kind, text = chance.choice(places[library])
            yield library, path.relative_to(ROOT), line, kind, text


def call(words, log, **more):
    """Exit status; what it says goes to a file."""
    with open(log, "w", encoding="utf-8") as file:
        return subprocess.run(words, stdout=file, stderr=subprocess.STDOUT, check=False, **more).returncode


class Copy:
    """The sources and the build in the scratch folder."""

    def __init__(self, scratch):
        self.scratch, self.source, self.build = scratch, scratch / "source", scratch / "source/build/release"
        self.source.mkdir(parents=True, exist_ok=True)
        for name in subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines():
            copied = self.source / name
            if (ROOT / name).exists() and not (copied.exists() and filecmp.cmp(ROOT / name, copied, shallow=False)):
                copied.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, copied)
        assert self.builds(configure=True), f"the unchanged sources do not build: {scratch}/build.log"

    def builds(self, configure=False):
        log = self.scratch / "build.log"
        if configure and call(["cmake", "-S", self.source, "-B", self.build, "-D", "CMAKE_BUILD_TYPE=Release"], log):
            return False
        return call(["cmake", "--build", self.build, "--parallel", str(os.cpu_count())], log) == 0

    def caught(self, units_alone, since):
        """('unit' or 'whole run', the first test that fails), or ('', ''); of the unit tests only those that were linked
        after the time `since` can fail."""
        log = self.scratch / "test.log"
        linked = [path.name for path in (self.build / "tests").glob("test_*") if path.is_file() and path.stat().st_mtime >= since]
        if linked and call(["ctest", "--test-dir", self.build, "--parallel", str(os.cpu_count()), "--stop-on-failure",
                            "--tests-regex", f"^({'|'.join(linked)})_np"], log):
            failed = re.findall(r"\d+ - (\w+) \(", log.read_text(encoding="utf-8"))
            return "unit", failed[0] if failed else "?"
        if units_alone:
            return "", ""
        environment = driver.ENVIRONMENT | {"STIRPOINT_EXECUTABLE": str(self.build / "stirpoint")}
        words = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-n", str(2 * os.cpu_count()), "--dist",
                 "worksteal", "--tier", "smoke", "tests/system", "tests/verification"]
        if call(words, log, cwd=self.source, env=environment):
            failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", log.read_text(encoding="utf-8"), re.M)
            return "whole run", failed[0] if failed else "?"
        return "", ""

    def outcome(self, path, line, text, units_alone):
        """Result of the tests of a mutation, or None if it does not compile."""
        assert self.builds(), f"the sources of before do not build: {self.scratch}/build.log"
        since = time.time()
        file = self.source / path
        lines = file.read_text(encoding="utf-8").splitlines()
        old, lines[line] = lines[line], text
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        try:
            if not self.builds():
                return None
            stage, test = self.caught(units_alone, since)
        finally:
            lines[line] = old
            file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return {"old": old.strip(), "new": text.strip(), "by": stage, "test": test, "whole_runs": not units_alone}


def table(records):
    """Markdown: what catches the mutations of each library; `before` has what did when they were drawn, if that was other."""
    libraries = collections.defaultdict(list)
    for record in records:
        libraries[record["library"]].append(record)
    lines = ["| library | mutations | unit tests at first | unit tests | whole runs | change no result | survive |\n",
             "|---|---|---|---|---|---|---|\n"]
    for library, those in [*sorted(libraries.items()), ("all", records)]:
        by = [record["by"] or ("no result" if "reason" in record else "") for record in those]
        first = [record.get("before", record["by"]) for record in those]
        counts = [len(by), sum(map(bool, first)), *map(by.count, ("unit", "whole run", "no result", ""))]
        lines.append(f"| {library} | {' | '.join(map(str, counts))} |\n")
    return "".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scratch", type=pathlib.Path)
    parser.add_argument("--number", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", default=[], metavar="LIBRARY")
    parser.add_argument("--units", action="store_true", help="without whole runs")
    parser.add_argument("--table", action="store_true")
    arguments = parser.parse_args()
    record_file = arguments.scratch.resolve() / "mutations.jsonl"
    records = [json.loads(line) for line in record_file.read_text().splitlines()] if record_file.exists() else []
    if not arguments.table:
        copy = Copy(arguments.scratch.resolve())
        again = [record for record in records if not (record["by"] or "reason" in record or record["whole_runs"]
                                                  or arguments.units)]
        records = [record for record in records if record not in again]
        done = {(record["file"], record["line"], record["new"]) for record in records}
        drawn = ((record["library"], record["file"], record["line"] - 1, record["kind"], record["new"]) for record in again)
        for library, path, line, kind, text in itertools.chain(drawn, draw(arguments.seed, arguments.only)):
            if len(records) >= arguments.number:
                break
            if (str(path), line + 1, text.strip()) in done:
                continue
            found = copy.outcome(path, line, text, arguments.units)
            if found is None:
                continue
            done.add((str(path), line + 1, text.strip()))
            records.append({"library": library, "file": str(path), "line": line + 1, "kind": kind, **found})
            record_file.write_text("".join(json.dumps(record) + "\n" for record in records), encoding="utf-8")
            print(f"{path}:{line + 1}: {kind}: {found['old']}  ->  {found['new']}: {found['test'] or 'SURVIVES'}", flush=True)
    print(table(records), end="")


if __name__ == "__main__":
    main()
