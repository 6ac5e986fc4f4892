# SPDX-License-Identifier: MIT
"""The model of the exchange counts the messages and bytes that the program sends."""

import importlib.machinery
import importlib.util
import os
import pathlib

import pytest

HERE = pathlib.Path(__file__).resolve().parent
loader = importlib.machinery.SourceFileLoader("scaling", str(HERE / "scaling"))
scaling = importlib.util.module_from_spec(importlib.util.spec_from_loader("scaling", loader))
loader.exec_module(scaling)


@pytest.mark.parametrize("ranks", [2, 4, 8])
def test_messages_and_bytes(ranks):
    """Exact: messages and bytes of a step of the block, predicted and counted."""
    executable = os.environ.get("STIRPOINT_EXECUTABLE", str(HERE.parent / "build/release/stirpoint"))
    messages, sent, most, _ = scaling.exchange(23, ranks)
    assert (messages, sent) == scaling.counted(ranks, str(pathlib.Path(executable).resolve()))
    assert 0 < most <= ranks


def test_prediction_is_sound():
    """More ranks take less time for the same work, and no rank has less than the mean."""
    times = []
    for ranks in (1, 4, 64, 1024):
        most, mean, inner = scaling.nodes_of_boxes(100, ranks)
        assert most >= mean and 0 <= inner <= most
        times.append(most)
    assert times == sorted(times, reverse=True)
