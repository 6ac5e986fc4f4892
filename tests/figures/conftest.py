# SPDX-License-Identifier: MIT
"""Where the tests find the command and what it uses."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
