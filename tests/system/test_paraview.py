# SPDX-License-Identifier: MIT
"""share/paraview/stirpoint.py draws a run with its tool. Needs pvpython and a display or xvfb-run; else the test is skipped."""

import os
import shutil
import subprocess

import driver
import numpy as np
import pytest

SCRIPT = driver.ROOT / "share/paraview/stirpoint.py"


def pvpython():
    """The command of ParaView's Python, or the reason why there is none."""
    program = shutil.which("pvpython")
    if program is None:
        pytest.skip("pvpython is not installed (apt install paraview python3-paraview)")
    if os.environ.get("DISPLAY"):
        return [program]
    if shutil.which("xvfb-run") is None:
        pytest.skip("no display for ParaView, and xvfb-run is not installed")
    # two that start at once must not share a number, and a server that resets after its first client refuses the next one
    return ["xvfb-run", "-a", "-n", str(200 + os.getpid() % 20000), "-s", "-screen 0 1280x1024x24 -noreset", program]


MACRO = """
import runpy, sys
from paraview import simple
reader = simple.OpenDataFile({series!r})
simple.Show(reader)
sys.argv = [{script!r}]
runpy.run_path({script!r}, run_name="__main__")
simple.SaveScreenshot({picture!r}, simple.GetActiveView(), ImageResolution=[700, 450])
"""


def colours_of(path):
    """Parts of the picture that are white (nothing), grey-blue (the tool, half through) and coloured."""
    pixels = pytest.importorskip("matplotlib.image").imread(path)[:, :, :3]
    spread = pixels.max(2) - pixels.min(2)
    white = (pixels.min(2) > 0.97).mean()
    grey = ((spread < 0.16) & (pixels[:, :, 2] >= pixels[:, :, 0]) & (pixels.max(2) < 0.95) & (pixels.max(2) > 0.5)).mean()
    return white, grey, (spread > 0.3).mean(), len(np.unique((pixels * 8).astype(int).reshape(-1, 3), axis=0))


@pytest.mark.parametrize("how", ["command", "macro"])
def test_a_picture_of_a_run(run, tmp_path, how):
    """Metal, coloured by a field that varies, the tool, and white around them."""
    command = pvpython()
    results = run("stir", "--quiet", sets={"TIME.END": 0.06}).results("stir")
    picture = str(tmp_path / "run.png")
    if how == "macro":
        macro = tmp_path / "macro.py"
        macro.write_text(MACRO.format(series=str(results.path(".hdf.series")), script=str(SCRIPT), picture=picture))
        command += [str(macro)]
    else:
        command += [str(SCRIPT), str(results.directory), "--picture", picture]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=tmp_path)
    assert os.path.exists(picture), done.stdout + done.stderr
    white, grey, coloured, kinds = colours_of(picture)
    print(how, white, grey, coloured, kinds)
    assert 0.2 < white < 0.95
    assert coloured > 0.008 and kinds > 12
    assert grey > 0.015
