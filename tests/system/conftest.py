# SPDX-License-Identifier: MIT
"""System tests: they drive the executable as a user does, each in a directory of its own.

    STIRPOINT_EXECUTABLE=build/release/stirpoint python3 -m pytest tests/system

The inputs in tests/system/inputs run on their own as well.
"""

import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parent))

import driver


@pytest.fixture
def run(tmp_path):
    """Run the program in an empty directory: run('bar', '--quiet', ranks=2, sets={...})."""

    def call(name, *options, **more):
        more.setdefault("directory", tmp_path)
        return driver.run(name, *options, **more)

    return call
