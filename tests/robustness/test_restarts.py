# SPDX-License-Identifier: MIT
"""The quick form of restarts.py: no changed key of a scene goes unnoticed."""

import pytest
import restarts


@pytest.mark.parametrize("scene", restarts.SCENES)
def test_no_changed_key_is_silent(scene):
    """Exact: 5 keys of each scene, changed at a restart: refused unless documented as changeable."""
    assert restarts.study(scene, 5, seed=2) == []
