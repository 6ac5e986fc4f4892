# SPDX-License-Identifier: MIT
"""Where the tests find the problems and the driver."""

import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "system")]
