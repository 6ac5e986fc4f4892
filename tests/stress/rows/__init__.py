# SPDX-License-Identifier: MIT
"""All rows by name, in the order of the table."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

from . import base  # noqa: E402  (finds the driver)
from . import broken, cfl, contacts, energy, large, nodes, noise, plastic, ranks  # noqa: E402

MODULES = (cfl, nodes, noise, large, contacts, energy, broken, ranks, plastic)
ALL = {row.name: row for module in MODULES for row in module.ROWS}
