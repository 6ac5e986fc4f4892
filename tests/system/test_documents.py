"""What README and the documents print can be typed: files exist, options are known, scenes pass --check."""

import json
import os
import re
import shlex
import subprocess
import sys

import lunr
import numpy as np
import pytest

import driver

DOCUMENTS = [driver.ROOT / "README.md", driver.ROOT / "CONTRIBUTING.md", *sorted((driver.ROOT / "docs").glob("*.md")),
             *sorted((driver.ROOT / "tests").rglob("*.md"))]
FOLDERS = ("tests/", "benchmarks/", "postproc/", "jobscripts/", "input/", "docs/", "cmake/", "modules/", "src/", ".ci/")
FIRST = ("bash", "cmake", "ctest", "mpirun", "python3", "stirpoint", "sbatch", "build/venv/bin/python", "build/release/stirpoint", "stirpost",
         "build/venv/bin/stirpost")


def code_of(path):
    """Lines of fenced blocks, and what stands in single quotes of code, on one line each."""
    text = path.read_text(encoding="utf-8")
    blocks = [line.split(" #")[0].strip() for block in re.findall(r"^```\w*\n(.*?)^```", text, re.M | re.S)
              for line in block.splitlines()]
    rest = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    return blocks + [" ".join(code.split()) for code in re.findall(r"`([^`]+)`", rest)]


def commands():
    """(document, words) of every printed command."""
    for path in DOCUMENTS:
        for code in code_of(path):
            first = code.split(" ")[0]
            if first not in FIRST and not (" " in code and first.startswith(FOLDERS)):
                continue
            for one in code.split(" && "):
                if " " in one:
                    yield path.name, one


COMMANDS = sorted(set(commands()))


def test_there_are_commands():
    """The documents are read as they are meant: README's blocks and table are among the commands."""
    text = [command for document, command in COMMANDS if document == "README.md"]
    for wanted in ("bash jobscripts/local.sh test", "cmake --preset release", "build/venv/bin/stirpost report fsp_copper_cavity1_1mm.out",
                   "stirpoint INPUT --check"):
        assert wanted in text
    assert len(COMMANDS) > 20


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_files_exist(path):
    """Files and folders that a document names are there: in commands, in code and behind links."""
    text = path.read_text(encoding="utf-8")
    words = [word for code in code_of(path) for word in code.split(" ") if word.startswith(FOLDERS)]
    words = [word for word in words if not re.search(r"[*<>{}A-Z]{2}|[*<>{}]|\.\.\.", word)]
    missing = [word for word in words if not (driver.ROOT / word.rstrip(",;:.")).exists()]
    links = [link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if not re.match(r"\w+:|#", link)]
    missing += [link for link in links if not (path.parent / link).exists()]
    assert not missing


# Those of a shell in which nobody activated build/venv.
PLAIN = dict(driver.ENVIRONMENT, PATH="/usr/local/bin:/usr/bin:/bin")


def anchors_of(path):
    """The anchors of a page: of its headings, as the site and GitHub make them."""
    headings = re.findall(r"^#+ (.*)", re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S), re.M)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def missing_tests(text):
    """What a table of tests names that is not there: files, functions of files, problems of verify.py."""
    files = {path.name: path.read_text(encoding="utf-8") for folder in ("tests", "postproc/tests")
             for path in (driver.ROOT / folder).rglob("*") if path.suffix in (".py", ".f90")}
    problems = "".join(path.read_text(encoding="utf-8") for path in (driver.ROOT / "tests/verification/problems").glob("*.py"))

    def is_there(name):
        file, _, function = name.rpartition("::")
        if name.startswith("verify.py "):
            return all(f'name = "{problem}"' in problems for problem in name.split()[1:])
        return name in files or f"{name}.f90" in files or f"def {function}(" in (files.get(file, "") if file else "".join(files.values()))

    return [name for row in text.splitlines() if row.startswith("| ") for name in re.findall("`([^`]+)`", row.rsplit("|", 2)[1])
            if not is_there(name)]


def test_tests_of_the_kinds_exist():
    """The tests that verification.md names for the kinds of faults are there; a name that is not is found."""
    table = (driver.ROOT / "docs/verification.md").read_text(encoding="utf-8").split("<!-- kinds -->\n")[1].split("<!-- end")[0]
    assert missing_tests(table) == []
    wrong = ["test_none.py", "test_rooms", "test_room.py::test_ring", "verify.py taylor rings"]
    assert missing_tests("".join(f"| a | b | `{name}`, `test_room.py` |\n" for name in wrong)) == wrong


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_to_headings(path):
    """What stands behind the # of a link is a heading of the page that it leads to."""
    links = [link.split("#") for link in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")) if not re.match(r"\w+:", link)]
    lost = [link for link in links if len(link) == 2 and link[0].endswith((".md", "/") if link[0] else "")
            and link[1] not in anchors_of((path.parent / link[0]) if link[0] else path)]
    assert not lost


def output_of(words):
    done = subprocess.run(words, cwd=driver.ROOT, env=PLAIN, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout + done.stderr


def test_messages():
    """Each message of docs/troubleshooting.md is one of the sources, where parts that are put together with & are one text;
    its exit statuses are those of --help."""
    page = (driver.ROOT / "docs/troubleshooting.md").read_text(encoding="utf-8")
    rows = [line for block in re.findall(r"<!-- messages -->\n(.*?)<!-- end", page, re.S) for line in block.splitlines()[2:]]
    quoted = [re.match(r"\| `([^`]+)` \|", row) for row in rows]
    assert len(rows) > 45 and all(quoted)
    sources = "".join(path.read_text(encoding="utf-8") for path in sorted((driver.ROOT / "modules").rglob("*.[fc]*")))
    sources = re.sub(r"""(['"]) *// *&\s*\n\s*\1""", "", sources)
    missing = [part for row in quoted for part in row[1].split("...") if part.strip() not in sources]
    assert not missing
    helped = re.search(r"^exit status:(.*)", output_of([driver.EXECUTABLE, "--help"])[1], re.M | re.S)[1]
    assert re.findall(r"^\| (\d+) \|", page, re.M) == re.findall(r"(?<!\w)(\d+) [a-z]", helped)


def tutorial_scene(directory):
    """The weld.nml of the tutorial as `stirpoint --new pin` writes it, in cells so coarse that a run takes a few seconds."""
    text = output_of([driver.EXECUTABLE, "--new", "pin"])[1]
    text = text.replace("MASS_SCALING_RANGE = 1e4, 4e6, ", "")
    for key, value in {"CELL": "4e-3", "MASS_SCALING": "1e7"}.items():
        text, count = re.subn(rf"(?<=[ ,]){key} = [-+.\w]+", f"{key} = {value}", text)
        assert count == 1, key
    (directory / "weld.nml").write_text(text, encoding="utf-8")


def test_python(tmp_path):
    """The blocks of docs/python.md run one after the other on the weld of the tutorial."""
    blocks = re.findall(r"^```python\n(.*?)^```", (driver.ROOT / "docs/python.md").read_text(encoding="utf-8"), re.M | re.S)
    assert len(blocks) == 11
    tutorial_scene(tmp_path)
    (tmp_path / "recipes.py").write_text("\n".join(blocks), encoding="utf-8")
    done = subprocess.run([sys.executable, "recipes.py"], cwd=tmp_path, env=driver.POSTPROC | {"STIRPOINT_EXECUTABLE": driver.EXECUTABLE},
                          capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert "degrees Celsius" in done.stdout and "choose other factors" not in done.stdout and int(re.search(r" s: (\d+) particles above", done.stdout)[1]) > 0 and (tmp_path / "particles.vtp").exists()
    read = re.search(r"^`(pd\.read_csv\(.*\))`", (driver.ROOT / "docs/python.md").read_text(encoding="utf-8"), re.M)[1]
    table = eval(read.replace('"faster', f'"{tmp_path}/faster', 1), {"pd": pytest.importorskip("pandas")})
    assert np.isfinite(table["tool_torque[Nm]"]).all() and table["time[s]"].is_monotonic_increasing
    points = pytest.importorskip("meshio", reason="meshio is not installed").read(tmp_path / "particles.vtu")
    assert len(points.points) == len(points.point_data["temperature"]) > 1000


def test_notebook(tmp_path):
    """The cells of docs/weld.ipynb run one after the other beside a run and a log of its torque and of a probe."""
    book = json.loads((driver.ROOT / "docs/weld.ipynb").read_text(encoding="utf-8"))
    assert book["nbformat"] == 4 and not any(cell.get("outputs") for cell in book["cells"])
    driver.run("stir", "--quiet", "--output", "weld.out", directory=tmp_path)
    made = driver.Results(tmp_path / "weld.out", "stir")
    history, probes = made.history(), made.probes()
    time = history["time[s]"][10::10]
    rows = zip(time, 1.1 * history["tool_torque[Nm]"][10::10], np.interp(time, probes["time[s]"], probes["T1[K]"]) - 273.15)
    cells = ["".join(cell["source"]) for cell in book["cells"] if cell["cell_type"] == "code"]
    (tmp_path / "cells.py").write_text("\n".join(cells), encoding="utf-8")
    environment = driver.POSTPROC | {"MPLBACKEND": "agg"}
    alone = subprocess.run([sys.executable, "cells.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=600)
    assert alone.returncode == 0 and "no log.csv here" in alone.stdout, alone.stderr
    log = "time [s];spindle torque [N m];T1 [C]\n" + "".join(f"{t};{a};{b}\n" for t, a, b in rows)
    (tmp_path / "log.csv").write_text(log, encoding="utf-8")
    done = subprocess.run([sys.executable, "cells.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert "tool torque, " in done.stdout and "T1, " in done.stdout and "energy audit" in done.stdout
    assert (tmp_path / "machine.png").stat().st_size > 10000


def shell_lines(name):
    """Commands in the fenced blocks of a page without a language, in their order, without comments."""
    text = (driver.ROOT / "docs" / name).read_text(encoding="utf-8")
    lines = [line.split(" #")[0].strip() for block in re.findall(r"^```\n(.*?)^```", text, re.M | re.S) for line in block.splitlines()]
    return [line for line in lines if re.match(r"(mpirun -n \d+ )?(stirpoint|stirpost) ", line)]


def test_tutorial(tmp_path):
    """What the tutorial prints is typed, in order and as printed, in one folder, with the program and stirpost in PATH; the weld
    that --new writes is made coarse before anything is done with it. Its variants and further runs stand in the text."""
    text = (driver.ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    further = [code for code in re.findall(r"`(stirpoint weld\.nml [^`]+)`", text)]
    lines = shell_lines("tutorial.md") + further
    assert lines[0] == "stirpoint --new pin > weld.nml" and "stirpost report weld.out" in lines and further
    folders = [str(driver.pathlib.Path(driver.EXECUTABLE).parent), str(driver.pathlib.Path(sys.executable).parent), PLAIN["PATH"]]
    environment = driver.POSTPROC | {"PATH": ":".join(folders)}
    for line in lines:
        done = subprocess.run(["bash", "-c", line], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, (line, done.stdout[-500:], done.stderr)
        if "--new pin" in line:
            tutorial_scene(tmp_path)
    assert (tmp_path / "weld.out/report/report.html").exists()


def check_program(words, directory):
    """Arguments of the program: as printed with --check; where a file is only named, its options are known."""
    status, known = output_of([driver.EXECUTABLE, "--help"])
    assert status == 0
    for word in words:
        if word.startswith("--"):
            assert word.split("=")[0] in known, f"{word} is no option"
    if "FILE" in words or any(word.startswith("RUN.out") or word.endswith("_checkpoint.h5") for word in words):
        return
    # the tutorial's scene is what --new writes
    scenes = {"INPUT": "input/quickstart.nml", "RUN.nml": "input/quickstart.nml", "weld.nml": "share/stirpoint/new/pin.nml"}
    arguments = [scenes.get(word, word) for word in words]
    arguments = [driver.ROOT / word if word.endswith(".nml") else word for word in arguments]
    for k in reversed([k for k, word in enumerate(words) if word.endswith("=...")]):
        del arguments[k - 1:k + 1]     # --set KEY=...: any value
    if "--material" in words:
        arguments = ["--material", sorted((driver.ROOT / "tests/system/points").glob("*.nml"))[0]]
    elif not any(word.startswith(("--keys", "--version", "--materials", "--pairs", "--new", "--help")) for word in words):
        arguments.append("--check=scene")
    done = driver.run(None, *arguments, directory=directory, expect=None)
    assert done.status == driver.WELL, done.err
    assert not list(directory.glob("*.out")) or "--material" in words


def check_script(script, words, python=sys.executable):
    """Options of a script are those of its --help; names of tests and rows those of --help or --list."""
    path = driver.ROOT / script
    assert path.is_file()
    known = path.read_text(encoding="utf-8")
    if "bash" in known.splitlines()[0]:
        assert output_of(["bash", "-n", script])[0] == 0
    else:
        status, known = output_of([python, script, "--help"])
        assert status == 0, known
        if "--list" in known:
            known += output_of([python, script, "--list"])[1]
    for word in words:
        if word.startswith("-") or re.fullmatch(r"[a-z_]+", word):
            assert word in known, f"{script} does not know {word}"


def check_stirpost(words):
    """A command of stirpost, and options that its --help knows."""
    call = [sys.executable, "-m", "stirpost", *words[:2 if words[0] == "calibrate" else 1]]
    heat = words[2:3] if words[:2] == ["calibrate", "heat"] else []
    done = subprocess.run([*call, *heat, "--help"], env=driver.POSTPROC, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert all(word in done.stdout for word in words if word.startswith("-"))


def check_cmake(words):
    presets = json.loads((driver.ROOT / "CMakePresets.json").read_text(encoding="utf-8"))
    kind = "buildPresets" if "--build" in words else "configurePresets"
    if "--install" in words:   # test_install.py does it
        assert words[1].removeprefix("build/") in [p["name"] for p in presets["buildPresets"]] and words[2] == "--prefix"
        return
    assert words[words.index("--preset") + 1] in [p["name"] for p in presets[kind] if not p.get("hidden")]
    given = [word[2:].split("=")[0] for word in words if word.startswith("-D")]
    lists = "".join((driver.ROOT / name).read_text(encoding="utf-8") for name in ("CMakeLists.txt", "cmake/dependencies.cmake"))
    assert all(name in lists for name in given)


def check_ctest(words):
    presets = json.loads((driver.ROOT / "CMakePresets.json").read_text(encoding="utf-8"))["testPresets"]
    assert words[words.index("--preset") + 1] in [p["name"] for p in presets]
    labels = {path.name for path in (driver.ROOT / "tests").iterdir()} | {"layers"}
    assert {words[k + 1] for k, word in enumerate(words) if word in ("-L", "-LE")} <= labels


@pytest.mark.parametrize("document, command", COMMANDS, ids=[command for _, command in COMMANDS])
def test_command(document, command, tmp_path):
    """Each printed command is one that works, as far as can be told in a second."""
    words = shlex.split(command)
    if "-c" in words and words[words.index("-c") - 1] == "sh":
        words = shlex.split(words[words.index("-c") + 1].removeprefix("exec "))
    words = words[:next((k for k, word in enumerate(words) if word in (">", "|")), None)]   # what a shell does with it
    if words[0] == "mpirun":
        words = words[next(k for k, word in enumerate(words) if word.endswith("stirpoint")):]
    if words[0] in ("stirpoint", "build/release/stirpoint"):
        check_program(words[1:], tmp_path)
    elif words[0] == "cmake":
        check_cmake(words[1:])
    elif words[0] == "ctest":
        check_ctest(words[1:])
    elif words[1:3] == ["-m", "pytest"]:
        assert all((driver.ROOT / word).exists() for word in words[3:])
    elif words[0].endswith("stirpost"):
        check_stirpost(words[1:])
    elif words[0] == "python3":
        check_script(words[1], words[2:], python="python3")
    elif words[0] in ("bash", "sbatch", "build/venv/bin/python"):
        check_script(words[1], words[2:])
    elif words[0].startswith("build/release/"):
        assert (driver.pathlib.Path(driver.EXECUTABLE).parent / words[0][len("build/release/"):]).exists()
    else:
        assert os.access(driver.ROOT / words[0], os.X_OK), f"{words[0]} is not executable"
        check_script(words[0], words[1:])


QUESTIONS = {
    "why is my run slow": "troubleshooting.html#why-is-my-run-slow",
    "axial force too high": "troubleshooting.html#my-force-is-too-high",
    "metal melts": "troubleshooting.html#metal-melts",
    "temperatures too low": "troubleshooting.html#temperatures-are-too-high-or-too-low",
    "tool climbs out of the plate": "troubleshooting.html#the-tool-climbs-out-or-sinks",
    "no stir zone": "troubleshooting.html#no-stir-zone",
    "which friction coefficient": "choosing.html#friction",
    "cell size": "choosing.html#cells",
    "calibrate friction": "postprocessing.html#calibration",
    "compare with a log of the machine": "postprocessing.html#a-machines-log",
    "meaning of symbols": "symbols.html#symbols",
    "read results in Python": "python.html",
    "read frames in MATLAB": "troubleshooting.html#files-for-other-programs",
    "open results in ParaView": "tutorial.html#10-results",
    "install on a cluster": "install.html",
    "how to restart a run": "restart.html",
    "how do I get help": "troubleshooting.html#help",
    "how to cite": "troubleshooting.html#help",
    "report a bug": "troubleshooting.html#help",
    "how do I contribute": "troubleshooting.html#help",
}


def test_questions(tmp_path):
    """What visitors type into the search of the site, which is lunr's, is answered in the first place that it finds."""
    subprocess.run([sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", tmp_path], cwd=driver.ROOT, check=True)
    pages = json.loads((tmp_path / "search/search_index.json").read_text(encoding="utf-8"))["docs"]
    index = lunr.lunr(ref="location", fields=("title", "text"), documents=pages)
    assert {question: index.search(question)[0]["ref"] for question in QUESTIONS} == QUESTIONS


SYMBOL = re.compile(r"(?:\\(?:mathbf|boldsymbol|bar|dot|tilde)\s*\{?\s*)*(?:\\[a-zA-Z]+|[a-zA-Z])\}?(?:_(?:\{[^}]*\}|\\?\w))?(?:\^\*)?")
SIGNS = {"\\" + name for name in ("cdot cos cosh det exp frac ge le left leftarrow ll ln max min nabla otimes partial pi qquad right sqrt "
                                "sum sum_i sum_p tanh").split()}


def symbols_of(name):
    """The symbols in the equations of a page, without functions and signs."""
    text = re.sub(r"^```.*?^```|`[^`]*`", "", (driver.ROOT / "docs" / name).read_text(encoding="utf-8"), flags=re.M | re.S)
    equations = " ".join(a or b for a, b in re.findall(r"\$\$(.*?)\$\$|\$([^$]+)\$", text, re.S))
    equations = re.sub(r"\\operatorname\{\w+\}|\b(?:dev|tr|sech)\b", " ", equations)
    return {re.sub(r"[\s{}]", "", found) for found in SYMBOL.findall(equations)} - SIGNS


@pytest.mark.parametrize("name", ["theory.md", "method.md", "microstructure.md"])
def test_symbols(name):
    """docs/symbols.md has each symbol of the equations."""
    used = symbols_of(name)
    assert len(used) > 20 and not used - symbols_of("symbols.md")
