# SPDX-License-Identifier: MIT
"""A few kills and full disks of tests/robustness/kills.py and full_disk.py, which do many."""

import full_disk
import kills


def test_kills(tmp_path):
    """Exact: a chain of kills of each of two scenes leaves the same rows, frames and state."""
    met, bad = kills.try_all([kills.SCENES[0], kills.SCENES[3]], 4, 5, tmp_path)
    assert met >= 4 and bad == []


def test_full_disks(tmp_path):
    """Exact: each kind of file once."""
    assert full_disk.try_all([full_disk.SCENES[0], full_disk.SCENES[3]], 16, 3, tmp_path) == []
