# SPDX-License-Identifier: MIT
"""The command `stirpost`: a table with one line per command."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path
from traceback import extract_tb

# Name, module with `main(arguments) -> exit status`, what it does. A module is imported only when it is asked for.
COMMANDS = (
    ("report", "cli.report", "one page of a run, report.html, and its pictures"),
    ("flow", "cli.flow", "flash, groove, cavity, stir zone, displacement of layers of a pass"),
    ("section", "cli.section", "grain size on a cross-section"),
    ("track", "cli.track", "the history of one particle, as &PATH KIND = 'history' reads it"),
    ("tracks", "cli.tracks", "pathlines of the tracers: pictures, and lines for VTK"),
    ("film", "cli.film", "a moving picture of a weld: the tool and the section behind it"),
    ("compare", "cli.compare", "numbers and pictures of two runs, or of a run and a machine's log"),
    ("sweep", "cli.sweep", "a study over keys of an input, and its picture"),
    ("window", "cli.window", "the process window of a weld: sound or not over rotational and travel speed"),
    ("calibrate", "cli.calibrate", "keys of an input from measurements"),
    ("material", "cli.material", "pictures of the curves of stirpoint --material"),
    ("gcode", "cli.gcode", "the program of a machine as &MOTION groups"),
    ("calculix", "cli.calculix", "a deck for CalculiX: residual stress and distortion of the plate"),
    ("heat", "cli.heat", "thermocouples of heat alone, and temperature below the surface"),
)


def main(arguments: list[str] | None = None) -> int:
    """Exit status; 1 without a message if the reader of standard output, such as `head`, has closed the pipe."""
    try:
        try:
            return run(list(sys.argv[1:] if arguments is None else arguments))
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # what is left in the buffer is lost
        return 1


def run(words: list[str]) -> int:
    name = words[0] if words else "--help"
    if name in ("-h", "--help"):
        print(usage())
        return 0 if words else 2
    if name == "--version":
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"stirpost {version('stirpost')}")
        except PackageNotFoundError:
            print("stirpost, not installed")
        return 0
    return run_command("stirpost", COMMANDS, words)


def run_command(before: str, commands: tuple[tuple[str, str, str], ...], words: list[str]) -> int:
    """Call the module of the command with its arguments; an error that the user can correct is one line, status 2."""
    known = {name: module for name, module, _ in commands}
    if words[0] not in known:
        print(f"{before}: no command {words[0]}; there are: {', '.join(known)}", file=sys.stderr)
        return 2
    try:
        status: int = import_module(f"stirpost.{known[words[0]]}").main(words[1:])
        sys.stdout.flush()
        return status
    except ModuleNotFoundError as problem:
        print(f"{before} {words[0]}: this Python lacks {problem.name}: 'pip install ./postproc[all]' brings all it needs, and "
              "'bash jobscripts/local.sh python' makes build/venv, which has it", file=sys.stderr)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        raise
    except Exception as problem:
        from ..io.files import message_of

        if isinstance(problem, OSError) and problem.filename is None:  # of standard output: what is in its buffer is lost
            sys.stdout = open(os.devnull, "w", encoding="utf-8")
        own, where = not isinstance(problem, (OSError, ValueError, RuntimeError)), extract_tb(problem.__traceback__)[-1]
        place = f" ({Path(where.filename).name}, line {where.lineno}: a mistake of stirpost)" if own else ""
        print(f"{before} {words[0]}: {message_of(problem)}{place}", file=sys.stderr)
        return 3 if own else 2
    return 2


def usage() -> str:
    width = max(len(name) for name, _, _ in COMMANDS)
    lines = [f"  {name:{width}}  {text}" for name, _, text in COMMANDS]
    return "\n".join(["usage: stirpost COMMAND [ARGUMENT...]", "", *lines, "", "stirpost COMMAND --help tells more."])
