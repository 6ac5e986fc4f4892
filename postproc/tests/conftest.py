# SPDX-License-Identifier: MIT
"""The package is imported from its folder, without installation."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parent)]
