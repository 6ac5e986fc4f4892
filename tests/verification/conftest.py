# SPDX-License-Identifier: MIT
"""Import paths of the tests: problems and driver."""

import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "system")]
