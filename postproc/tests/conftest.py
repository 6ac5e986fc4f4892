# SPDX-License-Identifier: MIT
"""The package is used from its folder, without being installed."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parent)]
