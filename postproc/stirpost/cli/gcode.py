# SPDX-License-Identifier: MIT
"""The program of a machine (G-code) as &MOTION groups of a tool.

usage: stirpost gcode PROGRAM.nc [--tool NAME] [--rapid MM_PER_MIN] [--zero X,Y,Z]

Prints a &MOTION for each straight move and each dwell, to be put into an input in place of its own. Read are G0 and G1 with
X, Y, Z and F, G4 P (seconds), S with M3 (clockwise seen from above, as in SPIN_RPM), M4 and M5, G20 and G21 (inches, mm), G90
and G91 (absolute, relative), G94. The first place that the program goes to is where the tool starts: &TOOL POSITION, the centre
of its face; --zero has the place [mm] in the scene of the zero of the program. Arcs, feed per turn and turned axes are refused:
have the programming system write lines.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..io.files import text_of

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
NOTES = re.compile(r"\([^)]*\)|;.*|^%.*")
# Planes, compensations that are off, offsets of work pieces and modes that are those read here.
WITHOUT_EFFECT = {"17", "40", "49", "54", "61", "64", "80", "90.1", "91.1", "94"}


@dataclass
class Machine:
    """Its state, and the phases so far: duration [s], velocity [m/s], spin [rpm]."""

    rapid: float | None                       # [m/s]
    place: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))   # [m]
    start: np.ndarray | None = None
    unit: float = 1e-3
    relative: bool = False
    mode: str = ""
    feed: float = 0.0                         # [m/s]
    speed: float = 0.0                        # [rpm]
    sense: int = 0
    phases: list[tuple[float, np.ndarray, float]] = field(default_factory=list)

    def take(self, line: str) -> None:
        """One line of the program."""
        text = NOTES.sub("", line.upper()).strip().lstrip("/")
        words = WORD.findall(text)
        if WORD.sub("", text).strip():
            raise ValueError(f"'{WORD.sub('', text).strip()}' is not understood")
        values = {letter: float(number) for letter, number in words if letter not in "GMN"}
        dwells = False
        for letter, number in words:
            code = f"{float(number):g}"
            if letter == "G":
                dwells |= code == "4"
                self.prepare(code)
            elif letter == "M" and code in ("3", "4", "5"):
                self.sense = {"3": 1, "4": -1, "5": 0}[code]
        if unread := set(values) - set("XYZFSPTHDO"):
            raise ValueError(f"{', '.join(sorted(unread))}: only straight moves of X, Y and Z are read")
        if "F" in values:
            self.feed = values["F"] * self.unit / 60.0
        self.speed = values.get("S", self.speed)
        if dwells:
            self.phases.append((values.get("P", values.get("X", 0.0)), np.zeros(3), self.sense * self.speed))
        elif any(axis in values for axis in "XYZ"):
            self.move(values)

    def prepare(self, code: str) -> None:
        if code in ("0", "1"):
            self.mode = code
        elif code in ("20", "21"):
            self.unit = {"20": 25.4e-3, "21": 1e-3}[code]
        elif code in ("90", "91"):
            self.relative = code == "91"
        elif code != "4" and code not in WITHOUT_EFFECT:
            raise ValueError(f"G{code} is not read: have the programming system write straight moves, G0 and G1")

    def move(self, values: dict[str, float]) -> None:
        given = np.array([values.get(axis, np.nan) for axis in "XYZ"]) * self.unit
        target = np.where(np.isnan(given), self.place, given + (self.place if self.relative else 0.0))
        way, self.place = target - self.place, target
        if np.isnan(way).any():               # the machine is somewhere until all axes were named
            return
        if self.start is None:
            self.start = target - way
        length = float(np.linalg.norm(way))
        if length == 0.0:
            return
        if self.mode not in ("0", "1"):
            raise ValueError("a move before G0 or G1")
        speed = self.rapid if self.mode == "0" else self.feed
        if not speed:
            raise ValueError("a rapid move: give its speed with --rapid" if self.mode == "0" else "a move without a feed F")
        self.phases.append((length / speed, way * (speed / length), self.sense * self.speed))


def read(text: str, rapid: float | None = None) -> Machine:
    """The phases of a program; `rapid` is the speed of G0 [m/s]."""
    machine = Machine(rapid)
    for number, line in enumerate(text.splitlines(), 1):
        try:
            machine.take(line)
        except ValueError as problem:
            raise ValueError(f"line {number}: {line.strip()}: {problem}") from None
    if not machine.phases:
        raise ValueError("the program moves nothing")
    return machine


def groups(machine: Machine, tool: str) -> str:
    """The phases as text of an input."""
    lines = []
    for duration, velocity, spin in machine.phases:
        moves = f", VELOCITY = {', '.join(f'{v:.9g}' for v in velocity)}" if velocity.any() else ""
        lines.append(f"&MOTION TOOL = '{tool}', DURATION = {duration:.9g}{moves}, SPIN_RPM = {spin:g} /")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="stirpost gcode", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument("--tool", default="tool", help="NAME of the &TOOL (default tool)")
    parser.add_argument("--rapid", type=float, help="speed of G0 [mm/min]")
    parser.add_argument("--zero", default="0,0,0", help="position of the zero of the program in the scene [mm]: X,Y,Z")
    options = parser.parse_args(arguments)
    zero = np.array([float(part) for part in options.zero.split(",")]) * 1e-3
    if zero.shape != (3,):
        raise ValueError(f"--zero {options.zero}: expected X,Y,Z")
    machine = read(text_of(options.program), options.rapid and options.rapid * 1e-3 / 60.0)
    if machine.start is not None:
        print(f"! Put into &TOOL: POSITION = {', '.join(f'{x:.9g}' for x in machine.start + zero)}")
    dwells = sum(phase[0] for phase in machine.phases if not phase[1].any())
    moves = sum(phase[0] for phase in machine.phases) - dwells
    print(f"! {options.program.name}: {moves + dwells:.6g} s, for &TIME END: moves {moves:.6g} s, dwells (G4 P) {dwells:.6g} s.")
    if dwells > moves:
        print(f"stirpost gcode: warning: G4 P is read in seconds: the dwells take {dwells:.6g} s, longer than the moves "
              f"({moves:.6g} s). If the machine counts milliseconds, divide P by 1000.", file=sys.stderr)
    print(groups(machine, options.tool))
    return 0
