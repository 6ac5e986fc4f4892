# SPDX-License-Identifier: MIT
"""Quick forms of the studies of robustness in this folder."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
