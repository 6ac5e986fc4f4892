# SPDX-License-Identifier: MIT
"""Measures of a run, without pictures."""
