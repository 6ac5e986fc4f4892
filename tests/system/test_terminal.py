# SPDX-License-Identifier: MIT
"""What a run says: one line that is drawn anew in a window and fits it, few lines in a file, the log and the
resolved input among the results."""

import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import termios

import driver
import numpy as np
import pytest

SETS = {"TIME.END": 0.15, "OUTPUT.FRAME_INTERVAL": 0, "OUTPUT.PROGRESS_INTERVAL": 0.02}


def shown(words, directory, columns):
    """What a terminal of so many columns gets."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    process = subprocess.Popen(words, cwd=directory, env=driver.ENVIRONMENT, stdout=slave, stderr=slave, stdin=slave)
    os.close(slave)
    text = b""
    while True:
        ready, _, _ = select.select([master], [], [], 60)
        assert ready, "nothing more is said"
        try:
            part = os.read(master, 65536)
        except OSError:
            break
        if not part:
            break
        text += part
    os.close(master)
    assert process.wait(60) == 0, text
    return text.decode()


@pytest.mark.parametrize("ranks", [None, 2])
@pytest.mark.parametrize("columns", [30, 200])
def test_line_in_a_window(tmp_path, ranks, columns):
    """Progress is one line that is cleared and drawn anew, never wider than the window, with mpirun as well; other
    lines stand on their own, and the last is where the results are."""
    text = shown(driver.command_of("stir", [], ranks, SETS), tmp_path, columns)
    drawn = re.findall(r"\r\x1b\[K([^\r\n]*)", text)
    lines = [line for line in drawn if " %  left " in line]
    assert len(lines) >= 3
    assert max(map(len, lines)) < columns
    if columns == 200:
        assert all("M particle-steps/s" in line for line in lines)
    plain = [line for line in re.sub(r"\r\x1b\[K[^\r\n]*", "", text).replace("\r", "").split("\n") if line]
    assert not [line for line in plain if " %  left " in line]
    assert "results in stir.out" in text


def test_log_has_what_was_said(run, tmp_path):
    """NAME.log has the lines of standard output, also those before the folder was there, and what a restart says
    goes behind; a stop is in it."""
    one = run("stir", sets=SETS | {"TIME.END": 0.05})
    log = tmp_path / "stir.out/stir.log"
    assert log.read_text(encoding="utf-8") == one.out.replace("results in stir.out\n", "results in stir.out\n")
    more = run(None, "--restart", "stir.out/stir_checkpoint.h5", sets={"TIME.END": 0.06})
    assert log.read_text(encoding="utf-8") == one.out + more.out
    quiet = run("stir", "--quiet", "--overwrite", sets=SETS | {"TIME.END": 0.02})
    assert quiet.out.splitlines()[-1] == "results in stir.out"
    assert log.read_text(encoding="utf-8") == quiet.out
    heat = run("heat_slab")
    assert (tmp_path / "heat_slab.out/heat_slab.log").read_text(encoding="utf-8") == heat.out


def test_resolved_input_runs_again(run, tmp_path):
    """NAME_input.nml has overrides in place and the defaults as comments, and gives the same run bit for bit."""
    run("block", sets={"TIME.END": 7e-6, "BODY(hot).TEMPERATURE": 510})
    first = driver.Results(tmp_path / "block.out", "block").checkpoint()
    text = (tmp_path / "block.out/block_input.nml").read_text(encoding="utf-8")
    assert "TEMPERATURE = 510" in text and "END = 7e-06" in text
    assert "!   SHAPE = 'auto'" in text and "!   PARTICLES_PER_CELL = 2" in text
    assert "!   VOCE_C" not in text and "!   TP_ALPHA" not in text, "keys of other laws do not act"
    (tmp_path / "again.nml").write_text(text, encoding="utf-8")
    run("again.nml", sets={"RUN.NAME": "again"})
    again = driver.Results(tmp_path / "again.out", "again").checkpoint()
    assert np.array_equal(first.tau, again.tau) and np.array_equal(first.temp, again.temp)


def test_resolved_input_names_sources(run, tmp_path):
    """Values of a library stand in it, with their source."""
    scene = run(None, "--new", "shoulder").out
    (tmp_path / "my.nml").write_text(scene, encoding="utf-8")
    run("my.nml", sets={"TIME.MAX_STEPS": 2})
    text = (tmp_path / "my.out/my_input.nml").read_text(encoding="utf-8")
    assert "  JC_A = 90e6\n" in text
    assert re.search(r"! Of material copper a library gave:\n(!   .*\n)*!   .*JC_A = 90e6.*Johnson", text)
