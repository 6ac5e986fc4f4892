# SPDX-License-Identifier: MIT
"""python3 -m stirpost, for a Python that has the package without the command."""

import sys

from .cli import main

sys.exit(main())
