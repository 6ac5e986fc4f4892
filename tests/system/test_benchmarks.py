# SPDX-License-Identifier: MIT
"""Benchmarks that name parts of the source."""

import importlib.machinery
import importlib.util
import shutil

import driver


def test_calls_that_feature_off_deletes_are_there(tmp_path):
    """Exact: every call of the list of benchmarks/feature_off stands in its file; else it ends with status 1."""
    loader = importlib.machinery.SourceFileLoader("feature_off", str(driver.ROOT / "benchmarks/feature_off"))
    feature_off = importlib.util.module_from_spec(importlib.util.spec_from_loader("feature_off", loader))
    loader.exec_module(feature_off)
    for file, names in feature_off.CALLS.items():
        copy = tmp_path / "copy.f90"
        shutil.copy(driver.ROOT / file, copy)
        feature_off.strip(copy, names)
        assert copy.read_text() != (driver.ROOT / file).read_text()
