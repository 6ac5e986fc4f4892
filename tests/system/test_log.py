# SPDX-License-Identifier: MIT
"""Standard output that cannot be written: a full disk ends a run with status 4 when it is done, a reader that has gone
away with 0; the results are whole in either case."""

import subprocess

import driver
import pytest

PLAIN = driver.ROOT / "input" / "heat_copper_plain.nml"
SCENES = {"small": {}, PLAIN: {"GRID.CELL": 4e-3, "TIME.END": 1}}
LOST = 4


def run_into(stdout, name, directory, *options, **more):
    """Exit status and standard error of a run that says a line at every step."""
    sets = SCENES[name] | {"OUTPUT.PROGRESS_INTERVAL": 1e-9}
    words = driver.command_of(name, options, None, sets)
    done = subprocess.run(words, cwd=directory, env=driver.ENVIRONMENT, stdout=stdout, stderr=subprocess.PIPE, text=True,
                          timeout=120, **more)
    return done.returncode, done.stderr


def tables_of(name, directory):
    results = driver.Results(directory / f"{getattr(name, 'stem', name)}.out", getattr(name, "stem", name))
    assert results.path("_checkpoint.h5").exists() and results.path("_summary.json").exists()
    return results.history().text, results.probes().text


@pytest.mark.parametrize("name", SCENES)
def test_log_that_is_lost(tmp_path, name):
    """Exact: the same rows on a full disk (status 4, said once), into a pipe that nobody reads and with standard output
    closed (status 0, nothing said) as into a file."""
    tables = []
    for kind in ("file", "full", "pipe", "closed"):
        place = tmp_path / kind
        place.mkdir()
        path = {"file": place / "log", "full": "/dev/full"}.get(kind, "/dev/null")
        with open(path, "w", encoding="utf-8") as stdout:
            if kind == "pipe":
                read, write = driver.os.pipe()
                driver.os.close(read)
                status, error = run_into(write, name, place)
                driver.os.close(write)
            elif kind == "closed":
                status, error = run_into(stdout, name, place, preexec_fn=lambda: driver.os.close(1))
            else:
                status, error = run_into(stdout, name, place)
        assert status == (LOST if kind == "full" else driver.WELL), error
        said = error.count("stirpoint: standard output cannot be written: No space left on device; the program goes on")
        assert said == (kind == "full") and (said or error == "")
        tables.append(tables_of(name, place))
    assert tables[1:] == tables[:1] * 3
    assert " s  step 1  dt = " in (tmp_path / "file" / "log").read_text(encoding="utf-8")


def test_report_that_is_lost(tmp_path):
    """Exact: a report of --check that cannot be written is no report."""
    with open("/dev/full", "w", encoding="utf-8") as full:
        status, error = run_into(full, "small", tmp_path, "--check")
    assert status == LOST and error.count("standard output cannot be written: No space left on device") == 1


def test_log_of_ranks(tmp_path):
    """Exact: rank 0 of several, with a standard output of its own."""
    script = '[ "$OMPI_COMM_WORLD_RANK" = 0 ] && exec > /dev/full; exec "$@"'
    words = ["mpirun", "-n", "2", "sh", "-c", script, "sh"] + driver.command_of("small", [], None, {})
    done = subprocess.run(words, cwd=tmp_path, env=driver.ENVIRONMENT, capture_output=True, text=True, timeout=120)
    assert done.returncode == LOST and done.stderr.count("standard output cannot be written") == 1, done.stderr
