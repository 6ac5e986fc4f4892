# SPDX-License-Identifier: MIT
"""Runs that are killed and continued, and what they leave: common to the programs of this directory."""

import hashlib
import os
import pathlib
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))

import driver
import h5py

ROOT = driver.ROOT
TABLES = ("_history.csv", "_probes.csv", "_tracers.csv", "_errors.csv")


def digest(path):
    """Of every dataset of an HDF5 file, whatever its order in the file, but not of what names the run."""
    found = {}
    with h5py.File(path, "r") as file:
        def keep(name, item):
            if isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf":
                found[name] = hashlib.sha256(item[()].tobytes()).hexdigest()
        file.visititems(keep)
    return found


def state_of(folder, name):
    """Everything that two equal runs have in common: tables as text, frames and checkpoint as digests."""
    state = {rest: (folder / f"{name}{rest}").read_text() for rest in TABLES if (folder / f"{name}{rest}").exists()}
    for path in sorted(folder.glob(f"{name}_[0-9]*.hdf")):
        state[path.name] = digest(path)
    state["series"] = (folder / f"{name}.hdf.series").read_text()
    state["checkpoint"] = digest(folder / f"{name}_checkpoint.h5")
    return state


def differences(one, two):
    return sorted(key for key in one.keys() | two.keys() if one.get(key) != two.get(key))


class Scene:
    """An input, and more groups behind its own, with its overrides on so many ranks (None: without mpirun)."""

    def __init__(self, label, name, sets, ranks, more=""):
        self.label, self.sets, self.ranks, self.more = label, sets, ranks, more
        path = driver.INPUTS / f"{name}.nml"
        self.path = path if path.exists() else pathlib.Path(name)
        self.name = self.path.stem

    def folder(self, directory):
        return directory / f"{self.name}.out"

    def command(self, directory, *options):
        path = self.path
        if self.more:
            path = directory / path.name
            path.write_text(self.path.read_text(encoding="utf-8") + self.more, encoding="utf-8")
        return driver.command_of(str(path), ["--quiet", *options], self.ranks, self.sets)


class Process:
    """A run in a session of its own, so that all of it can be killed."""

    def __init__(self, scene, directory, *options):
        self.log = open(directory / "log.txt", "a+", encoding="utf-8")
        self.begun = time.monotonic()
        self.process = subprocess.Popen(scene.command(directory, *options), cwd=directory, env=driver.ENVIRONMENT,
                                        stdout=self.log, stderr=subprocess.STDOUT, start_new_session=True)

    def ranks(self):
        """Process ids of the ranks: the descendants that are the program."""
        parents, found = {self.process.pid}, []
        for _ in range(3):
            for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
                try:
                    fields = stat.read_text().rsplit(")", 1)[1].split()
                except OSError:
                    continue
                if int(fields[1]) in parents:
                    parents.add(int(stat.parent.name))
        for pid in parents:
            try:
                if os.readlink(f"/proc/{pid}/exe") == driver.EXECUTABLE:
                    found.append(pid)
            except OSError:
                continue
        return sorted(found)

    def kill(self, what, chance):
        """SIGKILL to one rank or to all."""
        ranks = self.ranks()
        for pid in ([chance.choice(ranks)] if what == "one" and ranks else ranks):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass

    def wait(self, seconds):
        """Exit status, or None if it still runs after so many seconds."""
        try:
            return self.process.wait(max(0.0, seconds))
        except subprocess.TimeoutExpired:
            return None

    def end(self):
        if self.process.poll() is None:
            for pid in [*self.ranks(), self.process.pid]:
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    pass
            self.process.wait()
        self.log.close()
