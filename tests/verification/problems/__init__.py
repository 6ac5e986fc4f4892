# SPDX-License-Identifier: MIT
"""All verification problems by name, in the order of the table."""

from . import bars, fields, flows, friction, heat, hertz, plastic, punches

MODULES = (fields, bars, friction, heat, hertz, plastic, punches, flows)
ALL = {problem.name: problem for module in MODULES for problem in module.PROBLEMS}
