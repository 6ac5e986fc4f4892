# SPDX-License-Identifier: MIT
"""Inputs that are long, or have no end: the time to read them grows with their length, and signals are heard meanwhile."""

import math
import os
import resource
import signal
import subprocess
import time

import driver
import pytest


def cpu_time(*words, **more):
    """Processor time of a run [s], and the run."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = driver.run(*words, **more)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done


def scene(directory, tools):
    """The scene of stir.nml with other tools and motions."""
    text = (driver.INPUTS / "stir.nml").read_text(encoding="utf-8")
    (directory / "long.nml").write_text(text[:text.index("&TOOL")] + tools + text[text.index("&WALL"):], encoding="utf-8")
    return directory / "long.nml"


def test_path_of_100000_points(tmp_path):
    """Own bound: 5 s for a path of 100,000 points with a ramp over 3,000 of them (0.8 s; 30 s when each look-up counted all points)."""
    n = 100000
    rows = (f"{5e-3 * math.cos(a):.9f},{5e-3 * math.sin(a):.9f}\n" for a in (40 * math.pi * i / n for i in range(n)))
    (tmp_path / "path.csv").write_text("x[m],y[m]\n" + "".join(rows), encoding="utf-8")
    tool = """&TOOL NAME = 'tool', RADIUS = 10e-3, POSITION = 20e-3, 20e-3, 12.6e-3 /
&MOTION TOOL = 'tool', DURATION = 0.1, VELOCITY = 0, 0, -3e-3 /
&MOTION TOOL = 'tool', FILE = 'path.csv', SPEED = 0.5, RAMP = 0.04 /
"""
    seconds, _ = cpu_time(scene(tmp_path, tool), "--quiet", sets={"TIME.MAX_STEPS": 3}, directory=tmp_path)
    print(seconds)
    assert seconds < 5.0


def test_400_tools(tmp_path):
    """Own bound: 6 s of processor time for three steps with 400 tools (2 s; 10 s when texts and columns were copied for each addition)."""
    tools = "".join(f"""&TOOL NAME = 't{k}', RADIUS = 2e-3, POSITION = {k % 20 * 2e-3:.5f}, {k // 20 * 2e-3:.5f}, 13e-3 /
&MOTION TOOL = 't{k}', DURATION = 0.1, VELOCITY = 0, 0, -3e-3, SPIN_RPM = 970 /
""" for k in range(400))
    seconds, _ = cpu_time(scene(tmp_path, tools), "--quiet", sets={"TIME.MAX_STEPS": 3}, directory=tmp_path)
    print(seconds)
    assert seconds < 6.0


def test_input_without_end(tmp_path):
    """Exact: it is refused by its length."""
    seconds, done = cpu_time("/dev/zero", directory=tmp_path, expect=driver.BAD_INPUT)
    print(seconds)
    assert "/dev/zero: error: has more than 33554432 bytes" in done.err and seconds < 15.0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR1])
def test_signal_while_reading(tmp_path, number):
    """Exact: a pipe to which nobody writes is waited for; a signal ends the wait within two seconds, with status 75 and a word."""
    os.mkfifo(tmp_path / "pipe.nml")
    process = subprocess.Popen([driver.EXECUTABLE, "pipe.nml"], cwd=tmp_path, env=driver.ENVIRONMENT, stderr=subprocess.PIPE, text=True)
    time.sleep(1.0)
    process.send_signal(number)
    _, err = process.communicate(timeout=10)
    assert process.returncode == driver.BY_SIGNAL and f"signal {int(number)} stopped the run before it began: nothing was written" in err
