#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Pictures and one page of a run: python3 postproc/report.py RUN_DIRECTORY [-o DIR]"""

import sys

import stirpost.needs  # before the packages that it provides
from stirpost.cli import main

if __name__ == "__main__":
    sys.exit(main())
