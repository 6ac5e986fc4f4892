# SPDX-License-Identifier: MIT
"""Reads a Stirpoint run directory and draws it.

cli       the command stirpost: the table of its commands
report    stirpost report: pictures and a page of a run
section, track, compare, sweep, calibrate, material, heat
          the other commands, each a module with main(arguments)
program   the solver that some of them start

files     reading and writing: errors that name the file
run       the run directory: frames, series, histories, input text
table     CSV histories as pandas frames, columns by name and unit
look      colours, fonts, names and units for people
surface   the free surface of the metal
views     pictures of the metal and the tool in space, without a display
maps      top views and sections of a field
curves    thermocouples, tool loads, energies
tools     where the tools are, and the phases of their way
metal     what hangs together: flash, debris, groove
scene     an input: read, changed, checked and run; solids, cavities
flow      stirpost flow: volumes, stir zone, layers of a pass; flow_pictures: sections of its voids and cavity
film      stirpost film: a moving picture of a weld
tracks    pathlines of tracers: pictures, and lines for VTK
summary   the key figures and the phases
machine   the log of a machine beside a run
alarms    whether the figures may be trusted
window    stirpost window: sound or not over rotational speed, travel speed and force
trials    runs of one input with other values, each kept and computed once
limits    between which values a key is searched
targets   measured numbers that runs are to meet
fitting   the search of keys with which they do
valley    what the measurements do not determine
solid     what the view that turns draws, by three.js
page      one self-contained HTML page

In Python: stirpost.Run, its Frame and Table, stirpost.Scene; docs/python.md has recipes.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .run import Frame, Run
    from .scene import Scene
    from .table import Table

__all__ = ["Frame", "Run", "Scene", "Table"]


def __getattr__(name: str):
    """Imported when they are asked for: the command shall name what a Python lacks."""
    if name not in __all__:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    return getattr(import_module({"Scene": ".scene", "Table": ".table"}.get(name, ".run"), __name__), name)
