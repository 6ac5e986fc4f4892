# SPDX-License-Identifier: MIT
"""Memory of a rank: by its particles, not by how many ranks there are."""

import json
import re

import driver

CELLS = 16          # along each edge of a rank's part
BOXES = {1: (1, 1, 1), 8: (2, 2, 2), 16: (4, 2, 2)}
REST = {"TIME.MAX_STEPS": 3, "TIME.DT": 0, "MATERIAL.LAW": "elastic",
        "BODY.VELOCITY_GRADIENT": ",".join(9*["0"])}


def box(ranks, cells):
    """A block of so many cells along each edge of a rank's part."""
    def text(more):
        return ",".join(f"{cells*n + more}e-3" for n in BOXES[ranks])
    return {"SHAPE.UPPER": text(0), "GRID.UPPER": text(3)}


def peak(run, ranks, cells, place):
    """Peak memory and particles of a rank, in the mean [bytes]."""
    place.mkdir()
    done = run(driver.ROOT / "benchmarks/block.nml", directory=place, ranks=ranks,
               sets=REST | box(ranks, cells))
    summary = json.loads(next(done.directory.rglob("*_summary.json")).read_text())
    return summary["peak_memory_bytes"]/ranks, summary["particles"]/ranks


def test_memory_of_a_rank_does_not_grow_with_the_ranks(run, tmp_path):
    """A limit: with as many particles a rank, 16 ranks take no more than 1.15 times what 8 take each (half of them have
    neighbours on more sides), less what MPI and the program take without particles; below 900 bytes a particle: it
    passes on most particles when the grid is divided first."""
    taken = {}
    for ranks in (8, 16):
        nothing, _ = peak(run, ranks, 1, tmp_path / f"{ranks}_nothing")
        whole, particles = peak(run, ranks, CELLS, tmp_path / str(ranks))
        assert particles == 8*CELLS**3
        taken[ranks] = (whole - nothing)/particles
    print(taken)
    assert 250 < taken[8] < 900
    assert taken[16] <= 1.15*taken[8]


def test_setup_takes_little_more_than_the_particles(run, tmp_path):
    """A limit: 1.5 times what --check says of a million particles and their grid, less what the program takes without them."""
    nothing, _ = peak(run, 1, 2, tmp_path / "nothing")
    whole, _ = peak(run, 1, 50, tmp_path / "whole")
    said = run(driver.ROOT / "benchmarks/block.nml", "--check=scene", sets=REST | box(1, 50)).out
    said = 1e6 * float(re.search(r"^memory +(\S+) MB", said, re.M)[1])
    print((whole - nothing) / said)
    assert whole - nothing < 1.5 * said
