# SPDX-License-Identifier: MIT
"""Reads a Stirpoint run directory and draws it. A folder uses only those above it:

io         files, tables, frames, inputs, meshes, the solver
analysis   what a run shows in figures: tools and their paths, shape of the metal, flow, voids, surface, key figures, checks
plots      pictures (canvas: of meshes, by numpy) and the page
run        stirpost.Run and stirpost.Scene, which bring these together
calibrate  keys of an input from measurements: trials, targets, search, and what the measurements do not determine
cli        the command stirpost: a module with main(arguments) for each of its commands

In Python: stirpost.Run, its Frame and Table, stirpost.Scene; docs/python.md has recipes.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .io.frames import Frame
    from .io.table import Table
    from .run import Run, Scene

__all__ = ["Frame", "Run", "Scene", "Table"]


def __getattr__(name: str) -> Any:
    """Imported on first use, so that the command can name a missing package."""
    if name not in __all__:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    return getattr(import_module({"Frame": ".io.frames", "Table": ".io.table"}.get(name, ".run"), __name__), name)
