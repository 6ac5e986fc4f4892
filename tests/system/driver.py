# SPDX-License-Identifier: MIT
"""Run the executable and read what it writes."""

import concurrent.futures
import csv
import dataclasses
import json
import os
import pathlib
import signal
import subprocess
import time

import h5py
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
INPUTS = pathlib.Path(__file__).resolve().parent / "inputs"
EXECUTABLE = str(
    pathlib.Path(os.environ.get("STIRPOINT_EXECUTABLE", ROOT / "build/release/stirpoint")).resolve()
)

# Exit status of the program.
WELL, BAD_INPUT, BROKEN, BY_SIGNAL = 0, 2, 3, 75

# More ranks than cores, as root, several at a time: Open MPI refuses or crawls without these. It finds `pml`
# itself on one machine, but searches for networks first, for 0.2 s; the last two: hwloc looks
# for no devices, which takes 0.03 s of each process.
ENVIRONMENT = dict(
    os.environ,
    OMPI_ALLOW_RUN_AS_ROOT="1",
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
    OMPI_MCA_rmaps_base_oversubscribe="1",
    OMPI_MCA_hwloc_base_binding_policy="none",
    OMPI_MCA_mpi_yield_when_idle="1",
    PRTE_MCA_rmaps_default_mapping_policy=":oversubscribe",
    PRTE_MCA_hwloc_default_binding_policy="none",
    OMPI_MCA_pml="ob1",
    HWLOC_COMPONENTS="-linuxio",
    HWLOC_PLUGINS_PATH="/",
)

# For python -m stirpost: the package of this tree, installed or not.
POSTPROC = ENVIRONMENT | {"PYTHONPATH": str(ROOT / "postproc")}

# First column of the fields in the particle blocks of a checkpoint, and how many
# (modules/particles/store.f90); symmetric tensors are xx, yy, zz, xy, yz, xz.
LANES = 64
FIELDS = {
    "x": (0, 3),  # position [m]
    "mass": (3, 1),  # [kg]
    "temp": (4, 1),  # temperature [K]
    "heat": (5, 1),  # heat waiting for conduction [J]
    "jac": (6, 1),  # volume ratio
    "v": (7, 3),  # velocity [m/s]
    "tau": (10, 6),  # Kirchhoff stress [Pa]
    "b": (16, 6),  # isochoric elastic left Cauchy-Green tensor
    "plastic": (22, 1),  # equivalent plastic strain
    "rate": (23, 1),  # [1/s]
    "flow": (24, 1),  # [Pa]
}
# Fields that only some scenes have.
MORE_FIELDS = {"half": (25, 3)}  # cpgimp: half lengths of the domain [cells]


def command_of(name, options, ranks, sets):
    """The command line. `name` is an input of this directory, a path, or None."""
    words = [] if ranks is None else ["mpirun", "-n", str(ranks)]
    words.append(EXECUTABLE)
    if name is not None:
        path = INPUTS / f"{name}.nml"
        words.append(str(path if path.exists() else name))
    for key, value in (sets or {}).items():
        words += ["--set", f"{key}={value}"]
    return words + [str(option) for option in options]


@dataclasses.dataclass
class Done:
    """A finished run: exit status, what it printed, and its results."""

    status: int
    out: str
    err: str
    directory: pathlib.Path
    seconds: float
    files: tuple = ()

    def results(self, name):
        return Results(self.directory / f"{name}.out", name)


def run(name, *options, directory, ranks=None, sets=None, expect=WELL, timeout=120):
    """Run to the end; `ranks` None is without mpirun. `expect` None accepts any exit status."""
    words = command_of(name, options, ranks, sets)
    begun = time.monotonic()
    done = subprocess.run(
        words, cwd=directory, env=ENVIRONMENT, capture_output=True, text=True, timeout=timeout
    )
    if expect is not None:
        assert done.returncode == expect, f"{' '.join(words)}\n{done.stdout}\n{done.stderr}"
    seconds = time.monotonic() - begun
    return Done(done.returncode, done.stdout, done.stderr, pathlib.Path(directory), seconds)


def lacks(solver, directory):
    """True if this build says that it does not have a solver of the heat equation."""
    plain = ROOT / "input" / "heat_copper_plain.nml"
    done = run(plain, "--check=scene", directory=directory, sets={"HEAT.SOLVER": solver}, expect=None)
    return done.status == BAD_INPUT and "was built without" in done.err


def run_all(cases, directory):
    """Runs that mostly wait for their start, four at a time, each in a directory of its own, whatever
    their exit status; `cases` maps a name to the arguments of run. What each left there is in `.files`."""

    def one(k, words, more):
        place = pathlib.Path(directory) / str(k)
        place.mkdir()
        text = more.pop("text", None)
        if text is not None:
            (place / words[0]).write_text(text, encoding="utf-8")
        done = run(*words, directory=place, expect=None, **more)
        done.files = sorted(path.name for path in place.iterdir())
        return done

    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        jobs = {name: pool.submit(one, k, *case) for k, (name, case) in enumerate(cases.items())}
        return {name: job.result() for name, job in jobs.items()}


class Started:
    """A run in progress."""

    def __init__(self, name, *options, directory, ranks=None, sets=None, environment=None):
        self.directory = pathlib.Path(directory)
        self.log = open(self.directory / "log.txt", "w+", encoding="utf-8")
        self.process = subprocess.Popen(
            command_of(name, options, ranks, sets),
            cwd=directory,
            env=environment or ENVIRONMENT,
            stdout=self.log,
            stderr=subprocess.STDOUT,
        )

    def wait_for_rows(self, path, rows, timeout=60):
        """Wait until the history has so many rows."""
        limit = time.monotonic() + timeout
        while time.monotonic() < limit:
            if self.process.poll() is not None:
                break
            if path.exists():
                lines = path.read_text(encoding="utf-8").splitlines()
                if sum(not line.startswith("#") for line in lines) > rows:
                    return
            time.sleep(0.02)
        raise AssertionError(f"no {rows} rows in {path}: {self.text()}")

    def ranks(self):
        """Process ids of the ranks: the children of mpirun, or the program itself."""
        children = []
        for status in pathlib.Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = status.read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue
            if int(fields[1]) == self.process.pid:
                children.append(int(status.parent.name))
        return sorted(children) or [self.process.pid]

    def send(self, number, to_rank=None):
        """Send a signal to what was started (mpirun forwards SIGUSR1), or to one rank."""
        os.kill(self.process.pid if to_rank is None else self.ranks()[to_rank], number)

    def wait(self, timeout=60):
        """Exit status."""
        return self.process.wait(timeout)

    def text(self):
        if not self.log.closed:
            self.log.flush()
        return (self.directory / "log.txt").read_text(encoding="utf-8")

    def end(self):
        if self.process.poll() is None:
            for pid in self.ranks():
                os.kill(pid, signal.SIGKILL)
            self.process.kill()
            self.process.wait()
        self.log.close()


class Table:
    """A history: columns by name, as table['kinetic[J]']."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.text = self.path.read_text(encoding="utf-8")
        rows = list(csv.reader(line for line in self.text.splitlines() if not line.startswith("#")))
        self.names = rows[0]
        assert len(set(self.names)) == len(self.names), f"{self.path.name}: columns of one name"
        self.rows = np.array(rows[1:], dtype=float).reshape(len(rows) - 1, len(self.names))

    def __getitem__(self, name):
        return self.rows[:, self.names.index(name)]

    def impulse(self, name):
        """Time integral of a column that holds means since the row before."""
        return np.sum(np.diff(self["time[s]"], prepend=0.0) * self[name])


class Results:
    """The output directory of a run."""

    def __init__(self, directory, name):
        self.directory = pathlib.Path(directory)
        self.name = name

    def path(self, rest):
        return self.directory / f"{self.name}{rest}"

    def history(self):
        return Table(self.path("_history.csv"))

    def probes(self):
        return Table(self.path("_probes.csv"))

    def series(self):
        return json.loads(self.path(".hdf.series").read_text(encoding="utf-8"))

    def summary(self):
        return json.loads(self.path("_summary.json").read_text(encoding="utf-8"))

    def checkpoint(self):
        return Checkpoint(self.path("_checkpoint.h5"))


class Checkpoint:
    """The particles of a checkpoint in the order of their numbers: state.x, state.v, state.temp."""

    def __init__(self, path):
        with h5py.File(path, "r") as file:
            assert file.attrs["lanes"] == LANES
            n_fields = int(file.attrs["fields"])
            raw = file["/particles/state"][:].reshape(-1, n_fields, LANES)
            tag = file["/particles/tag"][:]
            count = file["/particles/count"][:]
            body = file["/particles/body"][:]
            self.particles_of_rank = ranks_of(file["/ranks/blocks"][:], count)
            self.all = {}
            file.visititems(lambda path, item: self.keep(path, item))
        used = np.arange(LANES)[None, :] < count[:, None]
        number = (tag & ((1 << 48) - 1))[used]
        order = np.argsort(number)
        self.number = number[order]
        assert len(np.unique(number)) == len(number), "two particles have the same number"
        self.body = np.repeat(body[:, None], LANES, axis=1)[used][order]
        for name, (first, n) in FIELDS.items():
            values = np.moveaxis(raw[:, first : first + n, :], 1, 2)[used][order]
            setattr(self, name, values[:, 0] if n == 1 else values)

    def keep(self, path, item):
        if isinstance(item, h5py.Dataset):
            self.all[path] = item[()]

    def of_run(self, name):
        """First number of the run called so in the names of the file."""
        return float(self.all["global"][self.place("names", name)])

    def of_ranks(self, name):
        """First sum called so, of all ranks."""
        return float(self.all["ranks/local"].reshape(len(self.all["ranks/blocks"]), -1)[:, self.place("ranks/names", name)].sum())

    def place(self, names, name):
        first = 0
        for line in self.all[names].decode().splitlines():
            count, _, found = line.partition(" ")
            if found == name:
                return first
            first += int(count)
        raise KeyError(name)

    @property
    def step(self):
        return int(self.of_run("the step"))

    @property
    def time(self):
        """[s]"""
        return self.of_run("the time [s]")

    def momentum(self):
        """[N s]"""
        return self.mass @ self.v

    def angular_momentum(self):
        """About the centre of mass [N m s]."""
        centre = self.mass @ self.x / self.mass.sum()
        mean = self.momentum() / self.mass.sum()
        return np.sum(self.mass[:, None] * np.cross(self.x - centre, self.v - mean), axis=0)

    def kinetic(self):
        """[J]"""
        return 0.5 * np.sum(self.mass * np.sum(self.v**2, axis=1))


def ranks_of(blocks, count):
    """Particles of each rank from the numbers of blocks and the particles in each block."""
    ends = np.concatenate([[0], np.cumsum(blocks)])
    return [int(count[a:b].sum()) for a, b in zip(ends[:-1], ends[1:])]


def rewrite_checkpoint(path, **fields):
    """Give the particles of a checkpoint other values: each of `fields` is a function of the positions
    (blocks, 3, lanes), and its result has the shape of the field or of its first component."""
    with h5py.File(path, "r+") as file:
        n_fields = int(file.attrs["fields"])
        raw = file["/particles/state"][:]
        old = raw.reshape(-1, n_fields, LANES)
        new = old.copy()
        for name, function in fields.items():
            first, count = (FIELDS | MORE_FIELDS)[name]
            value = function(old[:, 0:3])
            if value.ndim == 2:
                new[:, first] = value
            else:
                new[:, first:first + count] = value
        file["/particles/state"][:] = new.reshape(raw.shape)
    seal(path)


def seal(path):
    """Renew the seal of a checkpoint (modules/io/h5_seal.f90, modules/base/disk.c)."""
    data = pathlib.Path(path).read_bytes()
    piece = 4 << 20
    firsts = range(512, len(data), piece)
    total = sum_words(len(data), [sum_words(k, words_of(data[k:k + piece])) for k in firsts])
    version = data[:data.index(b"\n")].decode()
    head = f"{version}\nbytes {len(data)}\nchecksum {total:016X}\n".encode().ljust(512)
    pathlib.Path(path).write_bytes(head + data[512:])


def words_of(data):
    return np.frombuffer(data.ljust(-(-len(data) // 8) * 8, b"\0"), dtype="<u8").tolist()


def sum_words(total, words):
    mask = (1 << 64) - 1
    for word in words:
        total ^= word
        total = (total << 29 & mask) | total >> 35
        total = total * 0x9E3779B97F4A7C15 & mask
    return total


def distance(one, other, names):
    """Largest difference of two checkpoints in each field, over the largest value of the field."""
    assert np.array_equal(one.number, other.number), "the particles differ in number"
    result = {}
    for name in names:
        a, b = getattr(one, name), getattr(other, name)
        scale = max(np.abs(a).max(), np.abs(b).max())
        result[name] = float(np.abs(a - b).max() / scale) if scale > 0.0 else 0.0
    return result


def read_frame(path):
    """Points and point data of a VTKHDF frame, with its attributes and the units."""
    with h5py.File(path, "r") as file:
        group = file["/VTKHDF"]
        data = {name: item[:] for name, item in group["PointData"].items()}
        data["x"] = group["Points"][:]
        units = {name: item.attrs["units"] for name, item in group["PointData"].items()}
        units["x"] = group["Points"].attrs["units"]
        attributes = dict(file.attrs)
    units = {name: u.decode() if isinstance(u, bytes) else str(u) for name, u in units.items()}
    return data, units, attributes
