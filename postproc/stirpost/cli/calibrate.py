# SPDX-License-Identifier: MIT
"""The command `stirpost calibrate`: a table with one line per subcommand."""

from __future__ import annotations

import sys

from . import run_command

COMMANDS = (
    ("law", "calibrate.law", "numbers of a flow law from stress-strain curves"),
    ("run", "calibrate.run", "keys of any input from thermocouples, forces and torques"),
    ("heat", "calibrate.heat", "inputs of the thermal model from thermocouples and cooling records"),
)


def main(arguments: list[str]) -> int:
    if not arguments or arguments[0] in ("-h", "--help"):
        print("usage: stirpost calibrate WHAT [ARGUMENT...]", "", *(f"  {n:5} {text}" for n, _, text in COMMANDS), sep="\n",
              file=sys.stdout if arguments else sys.stderr)
        return 0 if arguments else 2
    return run_command("stirpost calibrate", COMMANDS, arguments)
