# SPDX-License-Identifier: MIT
"""Tracers: the right particles, followed exactly, the same on any number of ranks and after any stop."""

import csv
import re
import signal

import driver
import numpy as np
import pytest

TURNED = """
! A rigid square of particles turns about its centre and travels; a small block rests aside.
&GRID CELL = 1e-3, LOWER = -12e-3, -12e-3, -2e-3, UPPER = 16e-3, 12e-3, 4e-3 /
&TIME END = {end}, DT = {dt} /
&MATERIAL NAME = 'm', DENSITY = 1000, YOUNGS_MODULUS = 1e7, POISSON_RATIO = 0.3 /
&BODY NAME = 'block', MATERIAL = 'm' /
&SHAPE BODY = 'block', LOWER = 13e-3, -1e-3, 0, UPPER = 15e-3, 1e-3, 2e-3 /
&BODY NAME = 'square', MATERIAL = 'm', RIGID = T, CENTRE = 0, 0, 0 /
&SHAPE BODY = 'square', LOWER = -5e-3, -5e-3, 0, UPPER = 5e-3, 5e-3, 1e-3 /
&MOTION TOOL = 'square', VELOCITY = {speed}, 0, 0, SPIN_RPM = {rpm} /
&CONTACT BODY = 'block', OTHER = 'square' /
&TRACER NAME = 'edge', KIND = 'line', FROM = 0, 0, 0.2e-3, TO = 5e-3, 0, 0.2e-3, SPACING = 0.9e-3, INTERVAL = {every} /
&TRACER NAME = 'still', POSITION = 14e-3, 0, 1e-3 /
"""


def tracks(results):
    """Rows of each tracer: (group, id, body), times, and [x, y, z, temperature, plastic strain]."""
    lines = [x for x in results.path("_tracers.csv").read_text().splitlines() if not x.startswith("#")]
    rows = list(csv.DictReader(lines))
    found = {}
    for row in rows:
        who = found.setdefault(int(row["tracer"]), ((row["group"], int(row["id"]), row["body"]), [], []))
        assert who[0] == (row["group"], int(row["id"]), row["body"])
        who[1].append(float(row["time[s]"]))
        who[2].append([float(row[k]) for k in ("x[m]", "y[m]", "z[m]", "temperature[K]", "plastic_strain[1]")])
    return {k: (who, np.array(t), np.array(x)) for k, (who, t, x) in found.items()}


def test_circles_of_a_rigid_body(run, tmp_path):
    """Exact: a particle at r from the axis goes x = v t + r cos(w t + a), clockwise with SPIN_RPM > 0: 1e-9 m at every
    row, for spins, speeds, steps and intervals drawn at random."""
    random = np.random.default_rng(28)
    for k in range(3):
        rpm, speed = random.uniform(2000, 20000), random.uniform(-0.2, 0.2)
        dt = 5e-7
        every = random.uniform(2, 7) * 1e-5
        (tmp_path / f"t{k}.nml").write_text(TURNED.format(end=800 * dt, dt=dt, speed=speed, rpm=rpm, every=every))
        found = tracks(run(tmp_path / f"t{k}.nml", "--quiet").results(f"t{k}"))
        assert [who[0] for who, _, _ in found.values()].count("edge") == 6
        for who, t, x in found.values():
            if who[0] == "still":
                assert np.array_equal(x, np.repeat(x[:1], len(x), axis=0)) and who[2] == "block"
                assert len(t) == pytest.approx(501, abs=1)          # the rows of the history
                continue
            assert len(t) == int(800 * dt / every) + 2              # at 0, every INTERVAL, at the end
            first = np.diff(t)[:-1] / every
            assert np.all(np.abs(first - 1) <= dt / every + 1e-9)
            a = -rpm * 2 * np.pi / 60 * t
            exact = np.stack([speed * t + x[0, 0] * np.cos(a) - x[0, 1] * np.sin(a),
                              x[0, 0] * np.sin(a) + x[0, 1] * np.cos(a)], axis=1)
            assert np.abs(x[:, :2] - exact).max() < 2e-9
            assert np.ptp(x[:, 2]) < 1e-12


def with_tracers(tmp_path, name, more, as_name=None):
    path = tmp_path / f"{as_name or name}.nml"
    path.write_text((driver.INPUTS / f"{name}.nml").read_text() + more)
    return path


def test_to_and_fro_in_a_vortex(run, tmp_path):
    """Exact: circles of the annulus turn by A sin(w t) h(R), h = (1 - s^2)^2: the angle of every tracer within 10 % of
    A at every row, the radius within 2 % of A, what is outside at rest; and each is the particle nearest to its place."""
    line = "&TRACER NAME = 'ray', KIND = 'line', FROM = 0.5, 0.2, 0.03, TO = 1.4, 0.2, 0.03, NUMBER = 10, INTERVAL = .1 /\n"
    found = tracks(run(with_tracers(tmp_path, "vortex", line), "--quiet").results("vortex"))
    assert len(found) == 10
    places = np.linspace([0.5, 0.2], [1.4, 0.2], 10)
    moved = 0
    for (_, t, x), place in zip(found.values(), places, strict=True):
        assert np.abs(x[0, :2] - place).max() <= 0.5 * 0.0625 / 2 + 1e-9
        r = np.hypot(x[:, 0], x[:, 1])
        h = max(0.0, 1 - ((r[0] - 1.0) / 0.25) ** 2) ** 2 * (abs(r[0] - 1.0) < 0.25)
        angle = np.arctan2(x[:, 1], x[:, 0])
        assert np.abs(angle - angle[0] - 0.01 * h * np.sin(np.pi * t)).max() < 1e-3
        assert np.abs(r - r[0]).max() < 2e-4
        moved += h > 0.5
    assert moved >= 2


STIRRED = """&TRACER NAME = 'path', KIND = 'line', FROM = 2e-3, 20e-3, 12e-3, TO = 46e-3, 20e-3, 12e-3, SPACING = 4e-3, INTERVAL = 1e-3 /
&TRACER NAME = 'layer', KIND = 'box', LOWER = 10e-3, 10e-3, 10e-3, UPPER = 30e-3, 30e-3, 12e-3, NUMBER = 4, 4, 1 /
"""
SHORT = {"TIME.END": 0.12, "OUTPUT.CHECKPOINT_INTERVAL": 0}


@pytest.fixture(scope="module")
def stirred(tmp_path_factory):
    """stir.nml with tracers to 0.12 s, on so many ranks."""
    known = {}

    def results(ranks):
        if ranks not in known:
            directory = tmp_path_factory.mktemp("stirred")
            path = with_tracers(directory, "stir", STIRRED)
            known[ranks] = driver.run(path, "--quiet", directory=directory, ranks=ranks, sets=SHORT).results("stir")
        return known[ranks]

    return results


@pytest.mark.parametrize("ranks", [2, 4])
def test_ranks_make_no_difference(stirred, ranks):
    """Exact: the same tracers and rows on 1, 2 and 4 ranks; places to 1e-9 m, temperatures to 1e-4 K."""
    one, other = tracks(stirred(None)), tracks(stirred(ranks))
    assert list(one) == list(other) and len(one) == 28
    for k, (who, t, x) in one.items():
        assert who == other[k][0] and np.allclose(t, other[k][1], rtol=1e-9)
        assert np.abs(x[:, :3] - other[k][2][:, :3]).max() < 1e-9
        assert np.abs(x[:, 3:] - other[k][2][:, 3:]).max() < 1e-4


def test_tracers_are_particles_of_the_frames(stirred):
    """Exact: at the times of frames each tracer is where the particle of its number is, as warm and as strained;
    some of them have been stirred."""
    results = stirred(None)
    found = tracks(results)
    for entry in results.series()["files"]:
        data, _, attributes = driver.read_frame(results.directory / entry["name"])
        for (_, number, _), t, x in found.values():
            row = np.flatnonzero(np.abs(t - attributes["time"]) < 1e-12)
            if not len(row):
                continue
            p = np.flatnonzero(data["id"] == number)[0]
            assert np.abs(data["x"][p] - x[row[0], :3]).max() < 1e-8
            assert data["temperature"][p] == pytest.approx(x[row[0], 3], rel=1e-6)
            assert data["plastic_strain"][p] == pytest.approx(x[row[0], 4], rel=1e-6, abs=1e-12)
    assert max(x[-1, 4] for _, _, x in found.values()) > 1e-3


@pytest.mark.parametrize("ranks, stop", [(None, "kill"), (2, signal.SIGUSR1)])
def test_stopped_and_continued(stirred, tmp_path, run, ranks, stop):
    """Exact: killed after its checkpoint, or stopped by a signal, and continued: the same file, byte for byte."""
    path = with_tracers(tmp_path, "stir", STIRRED)
    sets = SHORT | {"OUTPUT.CHECKPOINT_INTERVAL": 0.011}
    one = driver.Started(path, "--quiet", directory=tmp_path, ranks=ranks, sets=sets)
    results = driver.Results(tmp_path / "stir.out", "stir")
    try:
        one.wait_for_rows(results.path("_history.csv"), 45)
        if stop != "kill":
            one.send(stop)
            assert one.wait() == driver.BY_SIGNAL
    finally:
        one.end()
    assert 0.05 < results.checkpoint().time < 0.119
    run(path, "--quiet", "--restart", results.path("_checkpoint.h5"), ranks=ranks, sets=SHORT)
    assert results.path("_tracers.csv").read_bytes() == stirred(ranks).path("_tracers.csv").read_bytes()


def test_an_extended_run_drops_the_last_rows(run, tmp_path):
    """Exact: rows of the old END that were not due are not in the run that goes on."""
    more = "&TRACER NAME = 'p', POSITION = 1e-3, 1e-3, 1e-3, INTERVAL = 2.1e-5 /\n"
    path = with_tracers(tmp_path, "block", more)
    half = {"TIME.END": 3.5e-5, "TIME.DT": 7e-8, "OUTPUT.HISTORY_INTERVAL": 7e-6}
    results = run(path, "--quiet", sets=half).results("block")
    assert len(tracks(results)[1][1]) == 3
    run(None, "--quiet", "--restart", results.path("_checkpoint.h5"), sets={"TIME.END": 7e-5})
    continued = results.path("_tracers.csv").read_bytes()
    whole = run(path, "--quiet", "--overwrite", sets=half | {"TIME.END": 7e-5}).results("block")
    assert continued == whole.path("_tracers.csv").read_bytes()
    assert len(tracks(whole)[1][1]) == 5


def test_debris_takes_its_tracers_along(run, tmp_path):
    """Exact: the rows of a tracer end when its particle leaves the grid; the others go on to the end, and a restart
    from there finds all rows."""
    more = ("&TRACER NAME = 'chip', POSITION = 1.5e-3, 1.5e-3, 7.5e-3, INTERVAL = 1e-6 /\n"
            "&TRACER NAME = 'block', POSITION = 2e-3, 2e-3, 2e-3, INTERVAL = 1e-6 /\n")
    path = with_tracers(tmp_path, "debris", more)
    results = run(path, "--quiet").results("debris")
    chip, block = tracks(results).values()
    assert chip[2][-1, 2] == pytest.approx(10e-3, abs=0.6e-3) and chip[1][-1] < 6e-5
    assert block[1][-1] == pytest.approx(1e-4)
    done = run(None, "--restart", results.path("_checkpoint.h5"), sets={"TIME.END": 1.1e-4})
    assert "rows that the run had written" not in done.out + done.err


def test_places_of_a_layer_and_shared_particles(run, tmp_path):
    """Exact: NUMBER and SPACING give the middles of equal parts of a box, lines have their ends; places that share a
    particle are followed once, and --check says so."""
    more = ("&TRACER NAME = 'deck', KIND = 'box', LOWER = 0, 0, 2e-3, UPPER = 4e-3, 4e-3, 4e-3, SPACING = 2e-3 /\n"
            "&TRACER NAME = 'dense', KIND = 'line', FROM = 0, 2.2e-3, 2.2e-3, TO = 4e-3, 2.2e-3, 2.2e-3, NUMBER = 80 /\n"
            "&TRACER NAME = 'high', KIND = 'line', FROM = 2e-3, 2.2e-3, 0, TO = 2e-3, 2.2e-3, 6e-3, NUMBER = 7 /\n")
    path = with_tracers(tmp_path, "debris", more)
    done = run(path, "--check=scene")
    line = next(x for x in done.out.splitlines() if x.startswith("tracers"))
    assert re.search(r"deck 4, dense 8 \(72 more positions have the same nearest particles\), high 5$", line), line
    found = tracks(run(path, "--quiet", sets={"TIME.MAX_STEPS": 1}).results("debris"))
    deck = sorted(tuple(np.round(x[0, :3] * 1e3, 2)) for who, _, x in found.values() if who[0] == "deck")
    assert np.all(np.abs(np.array(deck) - [[1, 1, 3], [1, 3, 3], [3, 1, 3], [3, 3, 3]]) < 0.26)
    assert len({who[1] for who, _, _ in found.values() if who[0] == "dense"}) == 8


MISTAKES = {
    "two of a name": ("&TRACER NAME = 'a', POSITION = 1e-3,1e-3,1e-3 /\n&TRACER NAME = 'a', POSITION = 2e-3,2e-3,2e-3 /",
                      r"NAME = 'a': is the name of another &TRACER"),
    "in the air": ("&TRACER NAME = 'a', POSITION = 5.5e-3, 5.5e-3, 9e-3 /", r"&TRACER lies outside the bodies"),
    "both": ("&TRACER NAME = 'a', KIND = 'line', FROM = 0,0,0, TO = 1e-3,0,0, NUMBER = 3, SPACING = 1e-3 /",
             r"needs NUMBER or SPACING"),
    "neither": ("&TRACER NAME = 'a', KIND = 'box', LOWER = 0,0,0, UPPER = 1e-3,1e-3,1e-3 /", r"needs NUMBER or SPACING"),
    "upside down": ("&TRACER NAME = 'a', KIND = 'box', LOWER = 1e-3,0,0, UPPER = 0,1e-3,1e-3, NUMBER = 2 /",
                    r"UPPER = .*: must not be below LOWER"),
    "no line": ("&TRACER NAME = 'a', KIND = 'line', FROM = 1e-3,0,0, TO = 1e-3,0,0, NUMBER = 2 /",
                r"TO = .*: must not be the place FROM"),
    "three numbers of a line": ("&TRACER NAME = 'a', KIND = 'line', FROM = 0,0,0, TO = 1e-3,0,0, NUMBER = 2,3,4 /",
                                r"NUMBER = .*: of a line is one number"),
    "idle key": ("&TRACER NAME = 'a', POSITION = 1e-3,1e-3,1e-3, SPACING = 1 /", r"SPACING"),
    "too many": ("&TRACER NAME = 'a', KIND = 'box', LOWER = 0,0,0, UPPER = 1e-3,1e-3,1e-3, SPACING = 1e-9 /",
                 r"places; at most 100000 are possible"),
    "too often": ("&TRACER NAME = 'a', POSITION = 1e-3,1e-3,1e-3, INTERVAL = 1e-13 /", r"rows until &TIME END; at most"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes(run, tmp_path, mistake):
    """Exact: one mistake gives one message with file and line, status 2, and nothing is written."""
    text, words = MISTAKES[mistake]
    path = with_tracers(tmp_path, "debris", text + "\n")
    done = run(path, expect=driver.BAD_INPUT)
    messages = done.err.splitlines()
    assert len(messages) == 1 and re.search(words, messages[0]) and re.search(r"debris\.nml:\d+: ", messages[0]), messages
    assert [p.name for p in tmp_path.iterdir()] == ["debris.nml"]


def test_heat_alone_has_no_tracers(run, tmp_path):
    """Exact: material at rest is not followed: refused."""
    path = with_tracers(tmp_path, driver.ROOT / "input/heat_copper_plain",
                        "&TRACER NAME = 'a', POSITION = 10e-3, 10e-3, 5e-3 /\n", "plain")
    done = run(path, expect=driver.BAD_INPUT)
    assert "&TRACER has no effect with MECHANICS = F" in done.err


def test_a_restart_may_change_how_often_not_what(run, tmp_path):
    """Exact: INTERVAL may change, another place is refused."""
    more = "&TRACER NAME = 'p', POSITION = 1e-3, 1e-3, 1e-3, INTERVAL = 1e-5 /\n"
    path = with_tracers(tmp_path, "block", more)
    results = run(path, "--quiet", sets={"TIME.MAX_STEPS": 300}).results("block")
    words = ["--quiet", "--restart", results.path("_checkpoint.h5")]
    done = run(path, *words, sets={"TRACER.POSITION": "2e-3,1e-3,1e-3"}, expect=driver.BAD_INPUT)
    assert "a restart cannot change" in done.err
    run(path, *words, sets={"TRACER.INTERVAL": "1e-6"})
    t = tracks(results)[1][1]
    assert np.median(np.diff(t)) == pytest.approx(1e-6, rel=0.1) and len(t) > 20
