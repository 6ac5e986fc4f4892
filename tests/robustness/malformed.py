#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Malformed inputs: mutations of the shipped ones, on coarse grids, two steps long.

    tests/robustness/malformed.py [--quick] [--executable PATH] [--cases N] [--seed N] [--only TEXT] [--keep DIR]

Each case must end in time with status 2 and nothing but `...: error: ...` on standard error, having written nothing;
or with status 3 and a message (the state was lost); or with status 0 and finite results, which a mutation that is
certainly an error must not. All else is a failure: a signal, a sanitizer's report, a case that hangs, silence.
Best with the `debug` build:

    cmake --preset debug && cmake --build --preset debug --target stirpoint
    tests/robustness/malformed.py --executable build/debug/stirpoint
"""

import argparse
import concurrent.futures
import math
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
ENVIRONMENT = dict(
    os.environ,
    ASAN_OPTIONS="detect_leaks=0:allocator_may_return_null=1",
    UBSAN_OPTIONS="print_stacktrace=1",
    OMPI_ALLOW_RUN_AS_ROOT="1",
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
    OMPI_MCA_rmaps_base_oversubscribe="1",
    OMPI_MCA_hwloc_base_binding_policy="none",
    OMPI_MCA_ess_singleton_isolated="1",
    OMPI_MCA_orte_create_session_dirs="0",
    OMPI_MCA_pml="ob1",
)
CPU_LIMIT = 60     # [s] of the processor, sanitizers included: a busy machine is no fault of the program
TIME_LIMIT = 600.0  # [s] for a case that waits
KEY = re.compile(r"(?<![\w'])([A-Za-z_]\w*)(\(\d+\))?\s*=\s*")
NUMBER = re.compile(r"(?<![\w'.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w'.-])")


# ---------------------------------------------------------------------------------------------------------------------
# What is mutated


def coarse(text):
    """The same scene with few cells and two steps."""
    text = re.sub(r"CELL = [\d.e-]+", "CELL = 4e-3", text)
    text = re.sub(r"(&GRID CELL = 4e-3,? LOWER =)[^=]*(UPPER =)[^/]*/",
                  r"\1 -8e-3, -8e-3, -4e-3, \2 112e-3, 56e-3, 28e-3 /", text)
    text = re.sub(r"&TIME ", "&TIME MAX_STEPS = 2, ", text)
    text = re.sub(r"STRAIN = (\d+)\.?\d* ", "STRAIN = 0.05 ", text)
    return text


def sources():
    """Name and coarse text of each shipped input; those of a material point are shortened."""
    found = {}
    for path in sorted((ROOT / "input").rglob("*.nml")):
        text = coarse(path.read_text())
        if "&PATH" in text:
            head, *paths = text.split("&PATH")
            text = head + "".join("&PATH" + p for p in paths[:3])
        found[path.stem] = text
    return found


class Text:
    """A text, where its keys and their values are, and what has been put into it."""

    def __init__(self, text, rng):
        self.text, self.rng = text, rng
        bare = re.sub(r"!.*", lambda m: " " * len(m.group()), text)
        self.keys = []  # start of the key, start and end of the value
        marks = [m for m in KEY.finditer(bare)]
        for k, m in enumerate(marks):
            end = marks[k + 1].start() if k + 1 < len(marks) else len(bare)
            value = re.match(r"(?:'[^']*'|\"[^\"]*\"|[^'\"/&])*", bare[m.end() : end]).group()
            value = value.rstrip().rstrip(",").rstrip()
            self.keys.append((m.start(), m.end(), m.end() + len(value)))
        self.groups = [m.span() for m in re.finditer(r"&[A-Z]+", bare)]
        self.numbers = [m.span() for a, b, c in self.keys if "'" not in bare[b:c]
                        for m in NUMBER.finditer(bare, b, c)]

    def put(self, span, new):
        return self.text[: span[0]] + new + self.text[span[1] :]

    def key(self, pattern=None):
        choice = [k for k in self.keys if pattern is None or re.match(pattern, self.text[k[0] : k[1]])]
        return self.rng.choice(choice) if choice else None

    def quoted(self):
        return [k for k in self.keys if self.text[k[1]] in "'\""]

    def end_of_group(self, span):
        i, quote = span[1], None
        while i < len(self.text):
            c = self.text[i]
            if quote:
                quote = None if c == quote else quote
            elif c in "'\"":
                quote = c
            elif c == "!":
                i = self.text.index("\n", i)
            elif c == "/":
                return i + 1
            i += 1
        return len(self.text)


SURE, OPEN = True, False  # certainly an error; an error or a sound result


def delete_key(t):
    a, _, c = t.key()
    return t.put((a, c), ""), OPEN


def delete_required(t):
    k = t.key(r"(DENSITY|YOUNGS_MODULUS|POISSON_RATIO|END|CELL|UPPER|T_MELT|SPECIFIC_HEAT|JC_A|TP_BURGERS)\b")
    if k is None or "&PATH" in t.text:
        return t.text.replace("&MATERIAL", "&MATERIAQ"), SURE
    return t.put((k[0], k[2]), ""), OPEN if t.text[k[0] : k[0] + 3] == "END" else SURE


def duplicate_key(t):
    a, _, c = t.key()
    return t.put((c, c), ", " + t.text[a:c]), SURE


def misspell_key(t):
    a, b, _ = t.key()
    i = t.rng.randrange(a, a + len(re.match(r"\w+", t.text[a:b]).group()))
    return t.put((i, i + 1), t.rng.choice("QXZ") + t.text[i]), SURE


def misspell_group(t):
    a, b = t.rng.choice(t.groups)
    i = t.rng.randrange(a + 1, b)
    return t.put((i, i + 1), "QX"), SURE


def delete_group(t):
    span = t.rng.choice(t.groups)
    return t.put((span[0], t.end_of_group(span)), ""), OPEN


def duplicate_group(t):
    span = t.rng.choice(t.groups)
    end = t.end_of_group(span)
    return t.put((end, end), "\n" + t.text[span[0] : end]), OPEN


def repeat_group(t):
    span = t.rng.choice(t.groups)
    end = t.end_of_group(span)
    return t.put((end, end), ("\n" + t.text[span[0] : end]) * 3000), OPEN


def remove_slash(t):
    end = t.end_of_group(t.rng.choice(t.groups))
    return t.put((end - 1, end), ""), OPEN


def wrong_type(t):
    _, b, c = t.key()
    new = {"'": "3.5", '"': "3.5"}.get(t.text[b], "'text'")
    return t.put((b, c), new), SURE


def not_a_number(t):
    new = t.rng.choice(["nan", "NaN", "inf", "-Infinity", "1e400", "-1e999", "1e", "0x10", "1,5e-3.", "--1", "1.2.3", "1e3000000000"])
    return t.put(t.rng.choice(t.numbers), new), SURE


def huge_number(t):
    return t.put(t.rng.choice(t.numbers), t.rng.choice(["1e300", "-1e300", "1.7e308", "1e40", "-1e40"])), SURE


def odd_number(t):
    new = t.rng.choice(["0", "-1", "1e-300", "-0.0", "1e12", "2147483648", "-2147483649", "99999999999999999999", "1e-9",
                        "1e6", "1e-6", "7", "1000"])
    return t.put(t.rng.choice(t.numbers), new), OPEN


def negative_number(t):
    a, b = t.rng.choice(t.numbers)
    return t.put((a, b), "-" + t.text[a:b].lstrip("-+")), OPEN


def scaled_number(t):
    a, b = t.rng.choice(t.numbers)
    return t.put((a, b), repr(float(t.text[a:b]) * 10.0 ** t.rng.choice([-6, -3, 3, 6, 9]))), OPEN


def swap_values(t):
    one, other = sorted(t.rng.sample(t.keys, 2))
    a, b = t.text[one[1] : one[2]], t.text[other[1] : other[2]]
    return t.text[: one[1]] + b + t.text[one[2] : other[1]] + a + t.text[other[2] :], OPEN


def too_many_values(t):
    _, b, c = t.key()
    return t.put((c, c), ", " + ", ".join([t.text[b:c]] * t.rng.choice([1, 5000]))), OPEN


def repeat_count(t):
    a, b = t.rng.choice(t.numbers)
    return t.put((a, b), t.rng.choice(["999999*", "0*", "99999999999*", "-3*", "2*3*", "*"]) + t.text[a:b]), SURE


def index_of_key(t):
    a, b, _ = t.key()
    end = a + len(re.match(r"\w+", t.text[a:b]).group())
    return t.put((end, end), t.rng.choice(["(0)", "(-1)", "(99999)", "(1", "()", "(1.5)", "(9999999999999)", "(1)(2)"])), SURE


def long_text(t):
    k = t.rng.choice(t.quoted())
    return t.put((k[1], k[2]), "'" + "long" * t.rng.choice([10, 300, 100000]) + "'"), OPEN


def bad_name(t):
    k = t.key(r"NAME\b") or t.rng.choice(t.quoted())
    new = t.rng.choice(["'a,b'", "'../x'", "'a\"b'", "'.'", "'x/y'", "''", "' '", "'a''b'", "'a;b'", "'a\tb'", "'*'", "'a\\b'"])
    if t.text[k[0] : k[0] + 4] != "NAME":
        return t.put((k[1], k[2]), new), OPEN
    return t.put((k[1], k[2]), new), new not in ("'a;b'", "'a\tb'", "'*'")


def bad_run_name(t):
    name = t.rng.choice(["../x", "/tmp/x", "a,b", ".hidden", "a b", "a\"b", "", "x" * 300, "a\\b", "a*"])
    return f"&RUN NAME = '{name}' /\n" + re.sub(r"&RUN [^\n]*\n", "", t.text), SURE


def open_quote(t):
    _, b, _ = t.rng.choice(t.quoted())
    return t.put((b, b + 1), ""), OPEN


def many_open_quotes(t):
    return t.text + "&BODY NAME = 'x\n" * t.rng.choice([1, 30000]), SURE


def garbage(t):
    place = t.rng.randrange(len(t.text))
    noise = bytes(t.rng.randrange(256) for _ in range(t.rng.choice([1, 20, 2000]))).decode("latin-1")
    return t.put((place, place), noise), OPEN


def cut(t):
    return t.text[: t.rng.randrange(len(t.text))], OPEN


def dos_lines(t):
    return t.text.replace("\n", "\r\n"), OPEN


def byte_order_mark(t):
    return "\u00ef\u00bb\u00bf" + t.text, OPEN


def wide_characters(t):
    return t.text.encode("utf-16").decode("latin-1"), SURE


def swap_characters(t):
    new = list(t.text)
    for _ in range(20):
        i, j = t.rng.randrange(len(new)), t.rng.randrange(len(new))
        new[i], new[j] = new[j], new[i]
    return "".join(new), OPEN


def empty(t):
    return t.rng.choice(["", "\n", "!", "/", "&", "&RUN", "= = =", "&RUN /", "'", "&GRID CELL = /"]), SURE


def absent_group(t):
    name = t.rng.choice(["GRID", "TIME", "MATERIAL", "BODY", "SHAPE"])
    if "&PATH" in t.text:
        name = "MATERIAL"
    return re.sub(rf"&{name}\b", f"&{name[:-1]}Q", t.text), SURE


def other_word(t):
    k = t.rng.choice(t.quoted())
    words = ["elastic", "table", "norton", "two-phase", "sliding", "plane", "box", "sphere", "stir", "ball", "bspline", "cpgimp",
             "apic", "fmpm", "backward-euler", "petsc", "fftw", "xmin", "moving", "coupled", "round", "history", "shear", "on"]
    return t.put((k[1], k[2]), f"'{t.rng.choice(words)}'"), OPEN


def override(t):
    return t.text, OPEN  # the options below spoil it


def history_file(t):
    return t.text, OPEN  # the CSV is spoiled


MUTATIONS = [delete_key, delete_required, duplicate_key, misspell_key, misspell_group, delete_group, duplicate_group, repeat_group,
             remove_slash, wrong_type, not_a_number, huge_number, odd_number, odd_number, negative_number, scaled_number,
             swap_values, too_many_values, repeat_count, index_of_key, long_text, bad_name, bad_run_name, open_quote,
             many_open_quotes, garbage, cut, dos_lines, byte_order_mark, wide_characters, swap_characters, empty, absent_group,
             other_word, other_word, override, history_file]

# Overrides and options, and whether they are certainly wrong.
OVERRIDES = [
    (["--set", "GRID.CELL=1e-6"], SURE), (["--set", "GRID.CELL=1e-9"], SURE), (["--set", "GRID.CELL=1e9"], SURE),
    (["--set", "GRID.UPPER=1e9,1e9,1e9"], SURE), (["--set", "TIME.END=nan"], SURE), (["--set", "TIME.END=1e400"], SURE),
    (["--set", "TIME.END=" + "9" * 600], SURE), (["--set", "TIME.END"], SURE), (["--set", "=.="], SURE), (["--set", ""], SURE),
    (["--set", "RUN.NAME=../x"], SURE), (["--set", "RUN.NAME=a,b"], SURE), (["--set", "RUN.NAME="], SURE),
    (["--set", "RUN.TITLE=" + "t" * 3000], OPEN), (["--set", "RUN.TITLE=a\nb"], SURE), (["--set", "RUN.TITLE='a"], SURE),
    (["--set", "MATERIAL(9).DENSITY=1"], SURE), (["--set", "MATERIAL(x).DENSITY=1"], SURE),
    (["--set", "MATERIAL.DENSITY(2)=1"], SURE), (["--set", "BODY.PARTICLES_PER_CELL=8,8,8"], OPEN),
    (["--output", ""], SURE), (["--restart", ""], SURE), ([""], SURE), (["--restart", "nothing.h5"], SURE),
    (["--restart", "case.nml"], SURE), (["--set"], SURE), (["--output"], SURE), (["--frob"], SURE),
    (["--set", "HEAT.TOLERANCE=1e-300"], SURE), (["--set", "HEAT.STEP=1e-300"], SURE),
    (["--set", "TIME.DT=1e-300"], SURE), (["--set", "METHOD.SORT_INTERVAL=2147483647"], SURE),
    (["--set", "OUTPUT.HISTORY_INTERVAL=1e-300"], SURE), (["--set", "TIME.GRAVITY=1e300,0,0"], SURE),
    (["--set", "MATERIAL.YOUNGS_MODULUS=1e30"], SURE), (["--set", "MATERIAL.DENSITY=1e-30"], SURE),
    (["--set", "MATERIAL.LAW=table"], SURE), (["--set", "MATERIAL.LAW=norton"], SURE),
    (["--set", "BODY.TEMPERATURE=1e9"], SURE), (["--set", "BODY.VELOCITY=1e9,0,0"], SURE),
    (["--set", "TOOL.POSITION=1,1,1"], OPEN), (["--set", "TOOL.RADIUS=1e-9"], OPEN),
    (["--set", "MOTION.SPIN_RPM=1e12"], SURE), (["--set", "MOTION.VELOCITY=1e9,0,0"], SURE),
    (["--set", "SOURCE.SPIN_RPM=0"], OPEN), (["--set", "SOURCE.RADIUS=1e-9"], OPEN),
]


def spoiled_csv(rng):
    """A file for a path of KIND = 'history'."""
    good = "time[s],temperature[K],plastic_strain[1]\n0,298,0\n1,500,0.1\n2,700,0.3\n"
    return rng.choice([
        (None, SURE), ("", SURE), ("time[s]\n", SURE), (good[:41], SURE), (good.replace("500", "nan"), SURE),
        (good.replace("500", "1e400"), SURE), (good.replace("500", ""), SURE), (good.replace("\n1,", "\n0,"), SURE),
        (good.replace("500", "-500"), SURE), (good.replace(",", ";"), SURE), (good.replace("\n", "\r\n"), OPEN),
        ("\u00ef\u00bb\u00bf" + good, OPEN), (good.replace("500", "5" * 5000), SURE), (good + "2.5," * 3000 + "\n", OPEN),
        (good.replace("0.1", "x"), SURE), ("\x00\x01\xff" * 500, SURE), (good.replace("0.1", "1e12"), SURE),
        (good.replace("0.3", "0.05"), OPEN), (good + "".join(f"{3 + k},700,{0.3 + k * 1e-6}\n" for k in range(2000)), OPEN),
    ])


# ---------------------------------------------------------------------------------------------------------------------
# Cases and their judgement


def make_case(k, seed, texts):
    """Name, text, options, other files, and whether it is certainly an error."""
    rng = random.Random(f"{seed} {k}")
    mutation = MUTATIONS[k % len(MUTATIONS)]
    name = sorted(texts)[(k // len(MUTATIONS) + k) % len(texts)]
    if mutation is history_file:
        name = "copper"
    text = texts[name]
    is_point = "&PATH" in text
    options, files, sure = (["--material"] if is_point else rng.choice([["--check"], ["--quiet"]])), {}, OPEN
    if mutation is override:
        more, sure = OVERRIDES[(k // len(MUTATIONS)) % len(OVERRIDES)]
        group = re.match(r"(?:--set )?([A-Z]+)\b", " ".join(more))
        if is_point or (group and f"&{group.group(1)} " not in text):   # any scene that has the group
            scenes = [n for n in sorted(texts) if "&PATH" not in texts[n]
                      and (not group or f"&{group.group(1)} " in texts[n])]
            name = rng.choice(scenes) if scenes else name
            text = texts[name]
            options = ["--material"] if "&PATH" in text else ["--check"]
        return f"{k} override {name} {more}", text, options + more, files, sure
    if mutation is history_file:
        csv, sure = spoiled_csv(rng)
        text = text[: text.index("&PATH")] + "&PATH NAME = 'h', MATERIAL = 'copper', KIND = 'history', FILE = 'h.csv' /\n"
        files = {} if csv is None else {"h.csv": csv}
        return f"{k} history_file {name}", text, options, files, sure
    text, sure = mutation(Text(text, rng))
    if not is_point and "MAX_STEPS = 2," not in text:
        options = ["--check"]   # else a sound scene may run for hours
    return f"{k} {mutation.__name__} {name}", text, options, files, sure


def not_finite(folder):
    """A table in a folder with a value that is not finite, '' if there is none."""
    for path in folder.rglob("*.csv"):
        for line in path.read_text(errors="replace").splitlines():
            for item in line.split(","):
                try:
                    if not math.isfinite(float(item)):
                        return f"{path.name}: {line[:100]}"
                except ValueError:
                    continue
    return ""


def judge(status, out, err, folder, before, sure):
    """What is wrong with the end of a case; '' if nothing is."""
    if "AddressSanitizer" in err or "runtime error" in err or "SIGSEGV" in err or "Backtrace" in err or "Error termination" in err:
        return "crash: " + " | ".join(line for line in err.splitlines() if re.search(r"ERROR|runtime error|#[0-9] |signal|Error", line))[:600]
    if status in (-signal.SIGXCPU, -signal.SIGKILL):
        return f"hang: no end after {CPU_LIMIT} s of the processor"
    if status not in (0, 2, 3):
        return f"status {status}: {err[-300:]}"
    left = {p.name for p in folder.iterdir()} - before
    if status == 2:
        lines = [line for line in err.split("\n") if line.strip()]
        bad = [line for line in lines if not re.search(r": (error|warning): ", line)]
        if not lines or bad:
            return f"status 2 without a message of the right form: {(bad or ['nothing'])[0][:200]!r}"
        if left:
            return f"status 2, and {left} was written"
        return ""
    if status == 3:
        return "" if err.strip() else "status 3 without a word"
    if sure:
        return f"silent: an error for certain, and status 0 (printed: {(out + err)[-200:]!r})"
    value = not_finite(folder)
    return f"status 0 with {value}" if value else ""


def limit_cpu():
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_LIMIT, CPU_LIMIT + 5))


def run_case(case, executable, keep):
    name, text, options, files, sure = case
    folder = pathlib.Path(tempfile.mkdtemp(prefix="malformed_"))
    try:
        (folder / "case.nml").write_bytes(text.encode("latin-1", "replace"))
        for other, content in files.items():
            (folder / other).write_bytes(content.encode("latin-1"))
        before = {p.name for p in folder.iterdir()}
        try:
            done = subprocess.run([str(executable), "case.nml", *options], cwd=folder, env=ENVIRONMENT, capture_output=True,
                                  timeout=TIME_LIMIT, stdin=subprocess.DEVNULL, preexec_fn=limit_cpu)
            verdict = judge(done.returncode, done.stdout.decode("latin-1"), done.stderr.decode("latin-1"), folder, before, sure)
            status = done.returncode
        except subprocess.TimeoutExpired:
            verdict, status = f"hang: no end after {TIME_LIMIT:.0f} s", None
        if verdict and keep:
            shutil.copytree(folder, pathlib.Path(keep) / name.split()[0], dirs_exist_ok=True)
            (pathlib.Path(keep) / name.split()[0] / "options").write_text(f"{name}\n{options}\n{verdict}\n")
        return name, status, verdict
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one case of each kind of mutation")
    parser.add_argument("--executable", default=ROOT / "build/release/stirpoint", type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=12 * len(MUTATIONS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="cases whose name has this text, such as a mutation")
    parser.add_argument("--keep", help="a folder for the cases that fail")
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1))
    args = parser.parse_args()
    executable = args.executable.resolve()
    texts = sources()
    whole = [(f"{name} as it is", text, ["--material"] if "&PATH" in text else ["--quiet"], {}, OPEN)
             for name, text in texts.items() if name != "cooling"]   # which reads files beside it
    if args.quick:
        whole, args.cases = whole[:1], len(MUTATIONS)
    cases = whole + [make_case(k, args.seed, texts) for k in range(args.cases)]
    cases = [case for case in cases if args.only in case[0]]
    counts, failures = {}, []
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for name, status, verdict in pool.map(lambda case: run_case(case, executable, args.keep), cases):
            if not verdict and name.endswith("as it is") and status != 0:
                verdict = f"the unchanged scene ended with status {status}"
            counts[status] = counts.get(status, 0) + 1
            if verdict:
                failures.append(f"{name}: {verdict}")
                print(failures[-1], flush=True)
    ends = ", ".join(f"{n} with status {s}" for s, n in sorted(counts.items(), key=str))
    print(f"{len(cases)} cases ({ends}): {len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
