# SPDX-License-Identifier: MIT
"""Histories of stopped and continued runs: no row twice, none missing without a warning, and the same digits as in one run."""

import signal

import driver
import numpy as np
import pytest

PLAIN = driver.ROOT / "input" / "heat_copper_plain.nml"
TABLES = ("_history.csv", "_probes.csv")


def tables_of(results):
    return {name: results.path(name).read_text() for name in TABLES}


def test_no_last_row_twice(run):
    """Exact: a checkpoint at END, which is no time of the history, counts the row of the end."""
    sets = {"TIME.END": 2.05e-6, "OUTPUT.CHECKPOINT_INTERVAL": 2.05e-6}
    results = run("small", "--quiet", sets=sets).results("small")
    before = tables_of(results)
    run("small", "--quiet", "--restart", results.path("_checkpoint.h5"), sets=sets)
    assert tables_of(results) == before
    assert np.all(np.diff(results.history()["time[s]"]) > 0.0)


@pytest.mark.parametrize("name", ["small", PLAIN])
def test_one_row_at_the_start(run, name):
    """Exact: a run that ends at t = 0 has one row, and so has one that is extended to it again."""
    sets = {"TIME.END": 0}
    results = run(name, "--quiet", sets=sets).results(getattr(name, "stem", name))
    assert len(results.history().rows) == len(results.probes().rows) == 1
    before = tables_of(results)
    run(name, "--quiet", "--restart", results.path("_checkpoint.h5"), sets=sets)
    assert tables_of(results) == before


def lacking(text):
    lines = text.splitlines(keepends=True)
    return "".join(lines[:10] + lines[12:])


def spoilt(text):
    lines = text.splitlines(keepends=True)
    return "".join(lines[:5] + ["x" + lines[5]] + lines[6:])


CHANGES = {"two rows missing": lacking, "gone": lambda text: None, "a row spoilt": spoilt,
           "a row twice": lambda text: text + text.splitlines(keepends=True)[-1]}


@pytest.mark.parametrize("change", CHANGES)
def test_rows_that_are_missing(run, change):
    """Exact: a table that does not hold the rows of the run is gone on with, which the run says, and kept aside as
    it was; the other one is whole."""
    sets = {"OUTPUT.CHECKPOINT_INTERVAL": 1e-6}
    results = run("small", "--quiet", sets=sets).results("small")
    path = results.path("_history.csv")
    probes = results.path("_probes.csv").read_text()
    text = CHANGES[change](path.read_text())
    path.unlink() if text is None else path.write_text(text)
    done = run("small", "--quiet", "--restart", results.path("_checkpoint.h5"), sets=sets)
    assert f"warning: small.out/small_history.csv {'begins at t = ' if text is None else 'holds '}" in done.out, done.out
    assert "rows that the run had written" in done.out and "_probes" not in done.out
    aside = results.path("_history.csv.1")
    assert aside.exists() == (text is not None)
    if text is not None:
        assert aside.read_text() == text and "kept as small.out/small_history.csv.1" in done.out
    assert results.path("_probes.csv").read_text() == probes


def test_surplus_rows_are_cut(run):
    """Exact: rows behind the restart, and half a row, are cut without a word, since the run writes them again."""
    sets = {"OUTPUT.CHECKPOINT_INTERVAL": 1.3e-6}
    results = run("small", "--quiet", sets=sets).results("small")
    before = tables_of(results)
    with open(results.path("_history.csv"), "a") as file:
        file.write("3.0E-06,17")
    done = run("small", "--quiet", "--restart", results.path("_checkpoint.h5"), sets=sets)
    assert done.out.startswith("results in ") and tables_of(results) == before


def stopped(directory, ranks, sets, rows):
    """The plain plate stopped by SIGUSR1 after so many rows."""
    one = driver.Started(PLAIN, "--quiet", directory=directory, ranks=ranks, sets=sets)
    results = driver.Results(directory / "heat_copper_plain.out", "heat_copper_plain")
    try:
        one.wait_for_rows(results.path("_history.csv"), rows)
        one.send(signal.SIGUSR1)
        status = one.wait()
    finally:
        one.end()
    assert status == driver.BY_SIGNAL, one.text()
    return results


METHODS = [("rkl2", "cg", None), ("explicit", "cg", None), ("tr-bdf2", "cg", 2), ("backward-euler", "cg", None),
           ("tr-bdf2", "fftw", None), ("backward-euler", "fftw", 2), ("tr-bdf2", "petsc", None)]


@pytest.mark.parametrize("method, solver, ranks", METHODS)
def test_heat_alone_continues_bitwise(run, tmp_path, method, solver, ranks):
    """Exact: heat alone stopped between two rows and continued, with safety checkpoints all the time or none: the
    same rows, powers of the first row after the stop included, and the same last frame. PETSc builds
    its multigrid with random numbers of the process: 1e-7 of the values."""
    if driver.lacks(solver, tmp_path):
        pytest.skip(f"this build has no {solver}")
    sets = {"GRID.CELL": 2e-3, "TIME.END": 12 if method == "rkl2" else 4, "HEAT.INTEGRATOR": method, "HEAT.SOLVER": solver, "HEAT.TOLERANCE": 0.02 if solver == "cg" else 0.1,
            "OUTPUT.HISTORY_INTERVAL": 0.31, "OUTPUT.FRAME_INTERVAL": 0}
    if solver == "petsc":
        sets |= {"TIME.END": 2.5, "HEAT.TOLERANCE": 0.5}
    for name in ("whole", "part"):
        (tmp_path / name).mkdir()
    whole = run(PLAIN, "--quiet", sets=sets | {"OUTPUT.SAFETY_INTERVAL": 0}, ranks=ranks, directory=tmp_path / "whole")
    whole = whole.results("heat_copper_plain")
    part = stopped(tmp_path / "part", ranks, sets | {"OUTPUT.SAFETY_INTERVAL": 0.05}, 5)
    stopped_at = part.history()["time[s]"][-1]
    run(PLAIN, "--quiet", "--restart", part.path("_checkpoint.h5"), sets=sets | {"OUTPUT.SAFETY_INTERVAL": 0.02}, ranks=ranks,
        directory=tmp_path / "part")
    assert 1.0 < stopped_at < sets["TIME.END"]
    if solver == "petsc":
        for one, two in ((whole.history(), part.history()), (whole.probes(), part.probes())):
            rows = [np.delete(table.rows, [k for k, n in enumerate(table.names) if n == "balance_error[%]"], axis=1)
                    for table in (one, two)]
            assert np.all(np.abs(rows[1] - rows[0]) <= 1e-7 * np.abs(rows[0]).max(axis=0))
        return
    assert tables_of(part) == tables_of(whole)
    frames = [driver.read_frame(r.path("_000001.hdf"))[0]["temperature"] for r in (whole, part)]
    assert np.array_equal(*frames)


@pytest.mark.parametrize("ranks", [None, 2])
def test_safety_checkpoints_change_nothing(run, tmp_path, ranks):
    """Exact: stir.nml with checkpoints by the clock every 3 ms, at other moments in every run, and with none: the same
    rows and the same final state."""
    found = []
    for name, interval in (("none", 0), ("many", 3e-3), ("some", 0.04)):
        (tmp_path / name).mkdir()
        sets = {"TIME.END": 0.05, "OUTPUT.SAFETY_INTERVAL": interval}
        results = run("stir", "--quiet", sets=sets, ranks=ranks, directory=tmp_path / name).results("stir")
        assert results.path("_checkpoint_previous.h5").exists() or interval == 0
        found.append((tables_of(results), results.checkpoint().all))
    for tables, state in found[1:]:
        assert tables == found[0][0]
        for name, values in found[0][1].items():
            if np.asarray(values).dtype.kind in "iuf":
                assert np.array_equal(values, state[name]), name
