# SPDX-License-Identifier: MIT
"""All verification problems by name, in the order of the table."""

from . import bars, collisions, fields, flows, friction, grooves, heat, hertz, layer, peers, plastic, punches

MODULES = (fields, bars, friction, heat, peers, hertz, plastic, punches, grooves, flows, layer, collisions)
ALL = {problem.name: problem for module in MODULES for problem in module.PROBLEMS}
