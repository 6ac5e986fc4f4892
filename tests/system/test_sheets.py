# SPDX-License-Identifier: MIT
"""Sheets of one cell under a lasting load: layers of particles that resist bending, and those that are refused."""

import driver
import numpy as np
import pytest

CELL, LENGTH, FORCE = 2e-3, 0.019, 7.69230769  # cell [m], fixed end to the middle of the loaded cell [m], [N]


def cantilever(directory, offset, layers, shape="bspline"):
    """A strip of 10 x 1 cells in plane strain, `offset` cells above a plane of nodes, whose last cell is loaded."""
    bottom = -4e-3 - offset * CELL
    scene = directory / "sheet.nml"
    scene.write_text(f"""&GRID CELL={CELL}, LOWER=0,0,{bottom}, UPPER=0.026,{CELL},{bottom + 14e-3}, PERIODIC='y' /
&TIME END=1.6e-3 /
&METHOD SHAPE='{shape}' /
&MATERIAL NAME='m', DENSITY=2700, YOUNGS_MODULUS=70e9, POISSON_RATIO=0.3 /
&BODY NAME='beam', MATERIAL='m', PARTICLES_PER_CELL=2,1,{layers} /
&SHAPE BODY='beam', LOWER=0,0,0, UPPER=0.018,{CELL},{CELL} /
&BODY NAME='tip', MATERIAL='m', PARTICLES_PER_CELL=2,1,{layers} /
&SHAPE BODY='tip', LOWER=0.018,0,0, UPPER=0.02,{CELL},{CELL} /
&WALL SIDE='xmin', KIND='fixed' /
&LOAD BODY='tip', FORCE=0,0,-{FORCE}, RAMP=4.6e-4 /
&PROBE NAME='tip', POSITION={LENGTH},0.001,0.001 /
&OUTPUT HISTORY_INTERVAL=1e-5 /
""")
    return scene


@pytest.mark.parametrize("offset, layers", [(0.0, 3), (0.0, 4), (0.25, 3), (0.5, 2)])
def test_sheet_of_one_cell_under_a_lasting_load(run, tmp_path, offset, layers):
    """Exact: n layers have n^2/(n^2 - 1) times the deflection of a beam, F L^3/(3 E' I) + F L/(5/6 G A), to 5 %; over
    two periods the mean stays, to 1 % (it would grow by 50 % if the layers did not resist bending)."""
    probes = run(cantilever(tmp_path, offset, layers), "--quiet").results("sheet").probes()
    way = 1e-3 - probes["tip_z[m]"]
    beam = FORCE * LENGTH**3 / (3 * 70e9 / 0.91 * CELL**4 / 12) + FORCE * LENGTH / (5 / 6 * 70e9 / 2.6 * CELL**2)
    means = [way[(probes["time[s]"] > t) & (probes["time[s]"] <= t + 0.5e-3)].mean() for t in (0.6e-3, 1.1e-3)]
    print(layers, np.array(means) / beam, layers**2 / (layers**2 - 1))
    assert means[1] == pytest.approx(beam * layers**2 / (layers**2 - 1), rel=0.05)
    assert means[1] == pytest.approx(means[0], rel=0.01)


@pytest.mark.parametrize("offset, layers, shape", [(0.0, 2, "bspline"), (0.1, 2, "bspline"), (0.0, 1, "bspline"), (0.4, 1, "bspline"),
                                                   (0.3, 1, "ugimp")])
def test_sheet_that_would_sink(run, tmp_path, offset, layers, shape):
    """Layers with a nodal velocity that vanishes at them and has the same gradient there are refused under a load across the
    sheet, and not if it is pulled along."""
    scene = cantilever(tmp_path, offset, layers, shape)
    assert "too few layers of particles along z" in run(scene, "--check", expect=driver.BAD_INPUT).err
    scene.write_text(scene.read_text().replace(f"0,0,-{FORCE}", f"{FORCE},0,0"))
    run(scene, "--check")


@pytest.mark.parametrize("width, speed, refused", [(0.03, 0, False), (0.01, 0, True), (0.03, 1e-3, True)])
def test_sheet_on_an_anvil(run, tmp_path, width, speed, refused):
    """A tool at rest below the whole sheet bears it as a wall does; a narrower one, or one that moves, does not."""
    scene = cantilever(tmp_path, 0.0, 2)
    scene.write_text(scene.read_text() + f"""&TOOL NAME='anvil', KIND='box', SIZE={width},0.03,0.01, POSITION=0.01,0.001,-0.005 /
&MOTION TOOL='anvil', VELOCITY=0,0,{speed} /
""")
    run(scene, "--check", expect=driver.BAD_INPUT if refused else 0)
