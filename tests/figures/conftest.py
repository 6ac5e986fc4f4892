# SPDX-License-Identifier: MIT
"""Import paths of the tests."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
