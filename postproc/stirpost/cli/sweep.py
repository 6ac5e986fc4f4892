# SPDX-License-Identifier: MIT
"""A study: an input is run with every combination of some values, and drawn over them.

usage: stirpost sweep INPUT --set TOOL.FRICTION=.1,.2,.3 [--set GROUP.KEY=VALUE,...] [-o DIR] [--slurm]

Each combination is a run of its own in DIR (default INPUT's stem_sweep), named after its values. A run that has ended
is not repeated, so that a study that was stopped goes on. Written to DIR: sweep.csv (a row a run: its values, highest
temperature, largest and mean loads of the tool over what follows the plunge, heat, flash), sweep.png.
With --slurm nothing is computed here: DIR gets a job array, array.sh (jobscripts/slurm.sh, once: adapt it), and its
list, cases.txt, and the command that submits the cases which are not done is printed. The same call again draws those that are
done, and prints the command for the others, which carry on from their checkpoints; wait until the array before has ended.
A value that is a list has its parts parted by blanks: --set 'TOOL.POSITION=1e-3 0 0,2e-3 0 0'.
"""

from __future__ import annotations

import argparse
import itertools
import re
import shlex
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis import summary
from ..io import program
from ..io.files import text_of, write
from ..io.frames import NoRun
from ..plots import look
from ..run import Run

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost sweep", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", type=Path)
    parser.add_argument("--set", action="append", required=True, metavar="GROUP.KEY=VALUE,VALUE...", dest="sets")
    add_how(parser)
    options = parser.parse_args(arguments)
    import pandas as pd

    text_of(options.input)
    axes = [axis_of(text) for text in options.sets]
    output = options.output or Path(f"{options.input.stem}_sweep")
    output.mkdir(parents=True, exist_ok=True)
    rows, left = [], list[str]()
    for values in itertools.product(*(values for _, values in axes)):
        chosen = dict(zip((key for key, _ in axes), values))
        directory = output / f"{name_of(chosen)}.out"
        if case(options, directory, chosen, left):
            rows.append({**{key: number(value) for key, value in chosen.items()}, **summary.measures(Run(directory))})
    if rows:
        table = pd.DataFrame(rows)
        write(output / "sweep.csv", table.to_csv(index=False))
        with look.style():
            look.save(picture(table, [key for key, _ in axes]), output / "sweep.png")
        print(f"{len(table)} runs in {output}: sweep.csv, sweep.png")
    if left:
        print(f"{summary.counted(len(left), 'run')} left:", array(options, output, left), sep="\n")
    return 0


def add_how(parser: argparse.ArgumentParser) -> None:
    """How the runs of a study are computed, and where they go."""
    parser.add_argument("--ranks", type=int, default=1, help="MPI ranks of each run (default 1)")
    parser.add_argument("--program", help="path of stirpoint, if it is not found by itself")
    parser.add_argument("--slurm", action="store_true", help="write a job array instead of computing")
    parser.add_argument("-o", "--output", type=Path)


def case(options: argparse.Namespace, directory: Path, chosen: dict[str, str], left: list[str]) -> bool:
    """Compute a case that is not finished, or with --slurm add it to the list of the job array; True if it is finished now."""
    note = "is there"
    if not is_done(directory, options.input, chosen):
        if options.slurm:
            left.append(prepared(options, directory, chosen))
            return False
        note = calculate(options, directory, chosen)
    print(f"{directory}: {note}", flush=True)
    return True


def prepared(options: argparse.Namespace, directory: Path, chosen: dict[str, str]) -> str:
    """Command line of a case. Results of a run with other keys are deleted, since it cannot be resumed from them."""
    asked, made = directory / "sweep_asked.txt", recipe(options.input, chosen)
    if not asked.is_file() or text_of(asked) != made:
        directory.mkdir(exist_ok=True)
        for checkpoint in directory.glob("*_checkpoint*.h5"):
            checkpoint.unlink()
        write(asked, made)
    return "\t".join(words_of(options.input, directory, chosen))


def array(options: argparse.Namespace, output: Path, left: list[str]) -> str:
    """Write script and list; returns the command that submits the unfinished cases. Lines of the list keep their numbers."""
    script, path = output / "array.sh", output / "cases.txt"
    if not script.exists():
        shutil.copy(Path(__file__).parent / "assets" / "slurm.sh", script)
    lines = text_of(path).splitlines() if path.exists() else []
    lines += [line for line in left if line not in lines]
    write(path, "".join(f"{line}\n" for line in lines))
    numbers = ",".join(str(k) for k in sorted(lines.index(line) + 1 for line in left))
    words = ["sbatch", f"--array={numbers}", f"--ntasks={options.ranks}", script, "--cases", path]
    return f"STIRPOINT={shlex.quote(program.find(options.program))} {shlex.join(map(str, words))}"


def axis_of(text: str) -> tuple[str, list[str]]:
    key, mark, values = text.partition("=")
    found = [value.strip() for value in values.split(",")]
    if not mark or "." not in key or not all(found):
        raise ValueError(f"--set {text}: expected GROUP.KEY=VALUE,VALUE...")
    return key.strip(), found


def name_of(chosen: dict[str, str]) -> str:
    return re.sub(r"[^\w.+=-]+", "_", "_".join(f"{key.split('.')[-1]}={value}" for key, value in chosen.items()))


def number(value: str) -> float | str:
    try:
        return float(re.sub("[dD]", "e", value))
    except ValueError:
        return value


def recipe(path: Path, chosen: dict[str, str]) -> str:
    """Input and values of a run."""
    return "".join(f"{key}={value}\n" for key, value in chosen.items()) + text_of(path)


def is_done(directory: Path, path: Path, chosen: dict[str, str]) -> bool:
    made = directory / "sweep_input.txt"
    return made.is_file() and text_of(made) == recipe(path, chosen) and \
        any(directory.glob("*_summary.json"))


def words_of(path: Path, directory: Path, chosen: dict[str, str]) -> list[str]:
    """The arguments of `stirpoint`."""
    sets = [word for key, value in chosen.items() for word in ("--set", f"{key}={','.join(value.split())}")]
    return [str(path), "--quiet", "--output", str(directory), *sets]


def calculate(options: argparse.Namespace, directory: Path, chosen: dict[str, str]) -> str:
    program.compute([*words_of(options.input, directory, chosen), "--overwrite"], options.program, options.ranks, str(directory))
    write(directory / "sweep_input.txt", recipe(options.input, chosen))
    return "computed"


def picture(table: pd.DataFrame, keys: list[str]) -> Figure:
    """Each quantity over the first key, with a line for each value of the others."""
    first, *others = keys
    quantities = [name for name in table.columns if name not in keys and table[name].notna().any()]
    if not quantities:
        raise NoRun("no run has a history to draw")
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
