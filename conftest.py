# SPDX-License-Identifier: MIT
"""Three tiers of the tests that run programs, by what each took when its time was last recorded.

    pytest --tier smoke    what takes up to 1.5 s; of a file without such the quickest test that is not long
    pytest --tier all      the default; without those of `long`
    pytest --tier long     what takes 6 s and more, cases marked `long`, robustness, stress
    pytest --tier every    also what a file or test that is named gets

tests/times.txt has the seconds of one case of each test function that takes more than 1.5 s, with two tests a core. Every
function that it does not name is quick. `--tier every --record-times` writes it anew.

STIRPOINT_SEED is added to the `seed` of each test that draws parameters at random.
"""

import collections
import os
import pathlib

import pytest

# Matrices of tests are small: more threads of BLAS only take the cores from other tests.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
TIMES = pathlib.Path(__file__).parent / "tests/times.txt"
QUICK, LONG = 1.5, 6.0
SEED = int(os.environ.get("STIRPOINT_SEED", 0))
LONG_FOLDERS = ("tests/robustness/", "tests/stress/")
spent = collections.defaultdict(dict)  # seconds of each case of each function


def function_of(nodeid):
    return nodeid.split("[")[0]


def pytest_addoption(parser):
    parser.addoption("--tier", choices=("smoke", "all", "long", "every"), default="all")
    parser.addoption("--record-times", action="store_true", help="write tests/times.txt")


def pytest_report_header(config):
    return f"STIRPOINT_SEED: {SEED}"


def pytest_collection_modifyitems(config, items):
    for item in items:
        parameters = item.callspec.params if hasattr(item, "callspec") else {}
        if "seed" in parameters:
            parameters["seed"] += SEED
    tier = config.getoption("--tier")
    named = any(".py" in word for word in config.args)
    if tier == "every" or named:
        return
    seconds = {name: float(word) for word, name in (line.split(None, 1) for line in TIMES.read_text().splitlines())}

    def time_of(item):
        return seconds.get(function_of(item.nodeid), 0.0)

    def is_long(item):
        return item.get_closest_marker("long") or item.nodeid.startswith(LONG_FOLDERS) or time_of(item) >= LONG

    if tier == "smoke":
        of_file = collections.defaultdict(list)
        for item in items:
            if not is_long(item):
                of_file[item.path].append(item)
        kept = [item for group in of_file.values() for item in group if time_of(item) <= QUICK]
        kept += [min(group, key=time_of) for group in of_file.values() if min(map(time_of, group)) > QUICK]
    else:
        kept = [item for item in items if bool(is_long(item)) == (tier == "long")]
    chosen = set(kept)
    config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
    items[:] = [item for item in items if item in chosen]


def pytest_runtest_logreport(report):
    cases = spent[function_of(report.nodeid)]
    cases[report.nodeid] = cases.get(report.nodeid, 0.0) + report.duration


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    if not session.config.getoption("--record-times") or hasattr(session.config, "workerinput"):
        return
    means = {name: sum(cases.values()) / len(cases) for name, cases in spent.items()}
    lines = [f"{mean:.1f} {name}\n" for name, mean in sorted(means.items()) if mean > QUICK]
    TIMES.write_text("".join(lines))
