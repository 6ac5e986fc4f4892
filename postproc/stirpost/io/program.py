# SPDX-License-Identifier: MIT
"""The solver that stirpost starts: the one that is named, else STIRPOINT_EXECUTABLE, that of the source tree, PATH."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

BUILT = Path(__file__).resolve().parents[3] / "build" / "release" / "stirpoint"
AS_ROOT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


def find(named: str | None = None) -> str:
    for candidate in (named, os.environ.get("STIRPOINT_EXECUTABLE"), str(BUILT) if BUILT.is_file() else None):
        if candidate:
            return candidate
    found = shutil.which("stirpoint")
    if found is None:
        raise ValueError("stirpoint was not found: give its path by --program or STIRPOINT_EXECUTABLE")
    return found


class Failed(RuntimeError):
    """The program failed."""

    def __init__(self, text: str, status: int):
        super().__init__(text)
        self.status = status


def compute(words: list, named: str | None = None, ranks: int = 1, what: str = "") -> None:
    """Run the program; raises Failed, with `what` and the program's message, if its exit status is not 0."""
    done = run(words, named, ranks)
    if done.returncode != 0:
        raise Failed(f"{what}{': ' * bool(what)}{done.stderr.strip() or f'stirpoint ended with status {done.returncode}'}", done.returncode)


def run(words: list, named: str | None = None, ranks: int = 1) -> subprocess.CompletedProcess:
    """Run the program; returns its output."""
    before = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    environment = dict(os.environ, **AS_ROOT) if os.geteuid() == 0 else None
    return subprocess.run([*before, find(named), *map(str, words)], capture_output=True, text=True, check=False,
                          env=environment, stdin=subprocess.DEVNULL)
