# SPDX-License-Identifier: MIT
"""The packages that the scripts need. A script imports this module before any of them: if one is missing, it goes on
with the Python of build/venv, which jobscripts/local.sh makes, or ends with one line that says what to do."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("numpy", "scipy", "matplotlib", "h5py")
ROOT = Path(__file__).resolve().parents[2]
PYTHON = ROOT / "build" / "venv" / "bin" / "python"
MARK = "STIRPOINT_PYTHON_CHOSEN"  # set where this module has chosen the Python already


def missing() -> list[str]:
    return [name for name in PACKAGES if find_spec(name) is None]


def provide() -> None:
    """Returns if all packages are there, or if no script of this folder was started."""
    lacking, script = missing(), Path(sys.argv[0])
    if not lacking or script.resolve().parent != ROOT / "postproc":
        return
    if MARK not in os.environ and PYTHON.is_file():
        os.environ[MARK] = "1"
        os.execv(PYTHON, [str(PYTHON), *sys.argv])
    sys.exit(
        f"{script.name}: this Python lacks {', '.join(lacking)}: run 'bash {ROOT}/jobscripts/local.sh' once, which puts "
        f"them into {PYTHON.parents[1]}, or 'python3 -m pip install -r {ROOT}/postproc/requirements.txt'"
    )


provide()
