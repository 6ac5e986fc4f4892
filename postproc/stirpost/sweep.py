# SPDX-License-Identifier: MIT
"""A study: an input is run with every combination of some values, and drawn over them.

usage: stirpost sweep INPUT --set TOOL.FRICTION=.1,.2,.3 [--set GROUP.KEY=VALUE,...] [-o DIR]

Each combination is a run of its own in DIR (default INPUT's stem_sweep), named after its values. A run that has ended
is not repeated, so that a study that was stopped goes on. Written to DIR: sweep.csv (a row a run: its values, highest
temperature, largest and mean loads of the tool over what follows the plunge, heat, flash), sweep.png.
A value that is a list has its parts parted by blanks: --set 'TOOL.POSITION=1e-3 0 0,2e-3 0 0'.
"""

from __future__ import annotations

import argparse
import itertools
import re
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd

from . import look, program, summary
from .files import text_of, write
from .run import NoRun, Run


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost sweep", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", type=Path)
    parser.add_argument("--set", action="append", required=True, metavar="GROUP.KEY=VALUE,VALUE...", dest="sets")
    parser.add_argument("--ranks", type=int, default=1, help="MPI ranks of each run (default 1)")
    parser.add_argument("--program", help="stirpoint itself, where it is not found by itself")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args(arguments)
    text_of(options.input)
    axes = [axis_of(text) for text in options.sets]
    output = options.output or Path(f"{options.input.stem}_sweep")
    output.mkdir(parents=True, exist_ok=True)
    rows = []
    for values in itertools.product(*(values for _, values in axes)):
        chosen = dict(zip((key for key, _ in axes), values))
        directory = output / f"{name_of(chosen)}.out"
        note = "is there" if is_done(directory, options.input, chosen) else calculate(options, directory, chosen)
        rows.append({key: number(value) for key, value in chosen.items()} | summary.measures(Run(directory)))
        print(f"{directory}: {note}")
    table = pd.DataFrame(rows)
    write(output / "sweep.csv", table.to_csv(index=False))
    with matplotlib.rc_context(look.STYLE):
        look.save(picture(table, [key for key, _ in axes]), output / "sweep.png")
    print(f"{len(table)} runs in {output}: sweep.csv, sweep.png")
    return 0


def axis_of(text: str) -> tuple[str, list[str]]:
    key, mark, values = text.partition("=")
    found = [value.strip() for value in values.split(",")]
    if not mark or "." not in key or not all(found):
        raise ValueError(f"--set {text}: expected GROUP.KEY=VALUE,VALUE...")
    return key.strip(), found


def name_of(chosen: dict[str, str]) -> str:
    return re.sub(r"[^\w.+=-]+", "_", "_".join(f"{key.split('.')[-1]}={value}" for key, value in chosen.items()))


def number(value: str):
    try:
        return float(re.sub("[dD]", "e", value))
    except ValueError:
        return value


def recipe(path: Path, chosen: dict[str, str]) -> str:
    """What a run was made from: the input and its values."""
    return "".join(f"{key}={value}\n" for key, value in chosen.items()) + text_of(path)


def is_done(directory: Path, path: Path, chosen: dict[str, str]) -> bool:
    made = directory / "sweep_input.txt"
    return made.is_file() and text_of(made) == recipe(path, chosen) and \
        any(directory.glob("*_summary.json"))


def calculate(options, directory: Path, chosen: dict[str, str]) -> str:
    words = [options.input, "--quiet", "--overwrite", "--output", directory]
    for key, value in chosen.items():
        words += ["--set", f"{key}={','.join(value.split())}"]
    done = program.run(words, options.program, options.ranks)
    if done.returncode != 0:
        raise RuntimeError(f"{directory}: {done.stderr.strip() or 'stirpoint failed'}")
    write(directory / "sweep_input.txt", recipe(options.input, chosen))
    return "computed"


def picture(table: pd.DataFrame, keys: list[str]):
    """Every quantity over the first key, a line for each value of the others."""
    first, *others = keys
    quantities = [name for name in table.columns if name not in keys and table[name].notna().any()]
    if not quantities:
        raise NoRun("the runs have nothing to draw: no history")
    columns = 2 if len(quantities) > 1 else 1
    figure = look.new_figure(10.0, 0.4 + 2.5 * -(-len(quantities) // columns))
    axes = np.ravel(figure.subplots(-(-len(quantities) // columns), columns, squeeze=False))
    groups = list(table.groupby(others, sort=False)) if others else [((), table)]
    for axis, name in zip(axes, quantities):
        for (label, part), colour in zip(groups, look.line_colours(len(groups))):
            label = label if isinstance(label, tuple) else (label,)
            text = ", ".join(f"{key} = {value}" for key, value in zip(others, label))
            axis.plot(part[first], part[name], "o-", color=colour, markersize=4, label=text)
        axis.set_xlabel(first)
        axis.set_ylabel(name)
        axis.grid(True)
    for axis in axes[len(quantities):]:
        axis.set_visible(False)
    if others:
        axes[0].legend(fontsize="small")
    return figure
