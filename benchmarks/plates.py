# SPDX-License-Identifier: MIT
"""The model of benchmarks/scaling for a plate that is stirred: most of it sleeps, and the tool is in contact with a few."""

import dataclasses
import itertools
import json
import math
import os
import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
HALO, BYTES = 2, 80                 # nodes beyond a rank's own; of a node in the message of a step
# Costs of particles (run/balance.f90); bytes of a particle and of a node (docs/speed.md, Memory).
HELD, ASLEEP, FLOWS, AT_TOOL, AT = 0.04, 0.035, 0.15, 22.0, 0.75
LANES = 64
PARTICLE_BYTES, NODE_BYTES = 232*33/32, 144
LENGTH_IS_WORTH = 0.05              # grid/partition.f90
TIE = 0.005                         # cuts nearer than this may fall otherwise: blocks, and with them loads, change at a restart
SIZE = (100.0, 40.0, 12.0)          # of the plate [mm]
TOOL, AWAKE = 10.0, 20.0            # radius of the tool, and that within which metal is awake [mm]
TO_GRID = 1/3                       # part of a step's work before the sums are needed (docs/speed.md)
DISK = 1e9                          # bytes a second that a disk takes, for frames


@dataclasses.dataclass
class Plate:
    """Loads of the nodes of a plate by columns: `body` for each layer of particles, `face` more in the top one."""

    n: tuple              # nodes along x, y, z
    body: list            # prefix sums over x and y
    face: list
    awake: tuple          # first and last node along each axis that particles of steps may touch

    def load(self, low, high):
        """Of the nodes from `low` to `high`."""
        return self.layers(low[2], high[2])*within(self.body, low, high) + (
            within(self.face, low, high) if low[2] <= self.n[2] - 1 <= high[2] else 0.0)

    def layers(self, k, m):
        """Cells of a column of nodes from `k` to `m`: those at the faces have half a cell."""
        return m - k + 1 - 0.5*(k == 0) - 0.5*(m == self.n[2] - 1)

    def profile(self, low, high, axis):
        """Load of each plane of a box."""
        planes = []
        for i in range(low[axis], high[axis] + 1):
            one, two = list(low), list(high)
            one[axis] = two[axis] = i
            planes.append(self.load(one, two))
        return planes

    def particles(self, low, high):
        """Of the nodes from `low` to `high`."""
        side = [high[a] - low[a] + 1 - 0.5*(low[a] == 0) - 0.5*(high[a] == self.n[a] - 1) for a in range(2)]
        return 8*side[0]*side[1]*self.layers(low[2], high[2])


class Measured:
    """Loads of the nodes by the particles of a checkpoint, as run/balance.f90 has them."""

    def __init__(self, path, edge, lower, tool_place, n):
        import h5py
        import numpy as np
        with h5py.File(path, "r") as file:
            state = file["/particles/state"][:].reshape(-1, int(file.attrs["fields"]), LANES)
            tag, count = file["/particles/tag"][:], file["/particles/count"][:]
        used = np.arange(LANES)[None, :] < count[:, None]
        x, rate, rest = state[:, 0:3], state[:, 23], (tag >> 54) & 3
        awake = used & (rest == 0)
        cost = np.where(awake, 1.0, np.where(rest == 1, HELD, ASLEEP))
        cost += awake*FLOWS*((rate > 0) & awake).any(axis=1)[:, None]
        r = np.hypot(x[:, 0] - tool_place[0], x[:, 1] - tool_place[1])
        clearance = np.hypot(np.maximum(0.0, r - 1e-3*TOOL), np.maximum(0.0, tool_place[2] - x[:, 2]))
        cost += awake*AT_TOOL*(clearance < AT*0.5*edge)
        node = np.floor((np.moveaxis(x, 1, 2) - lower)/edge + 0.5).astype(int)
        self.n, self.sums = n, np.zeros([m + 1 for m in n])
        np.add.at(self.sums, tuple(node[used].T + 1), cost[used])
        for axis in range(3):
            self.sums = self.sums.cumsum(axis)
        moving = node[used & (rest < 2)]
        self.awake = tuple((int(moving[:, a].min()) - HALO, int(moving[:, a].max()) + HALO) for a in range(3))
        self.awake_share = awake.sum()/used.sum()

    def load(self, low, high):
        """Of the nodes from `low` to `high`."""
        total = 0.0
        for corner in itertools.product((0, 1), repeat=3):
            at = tuple(high[a] + 1 if corner[a] else low[a] for a in range(3))
            total += (-1)**(3 - sum(corner))*self.sums[at]
        return float(total)

    profile = Plate.profile


def within(sums, low, high):
    """Sum over x and y from prefix sums."""
    i, j, k, m = low[0], high[0] + 1, low[1], high[1] + 1
    return sums[j][m] - sums[i][m] - sums[j][k] + sums[i][k]


def make_plate(size, edge, awake=AWAKE):
    """The plate in cells of `edge` [mm], 8 particles each, in costs of an awake particle."""
    cells = [round(s/edge) for s in size]
    nx, ny = cells[0] + 1, cells[1] + 1
    radius = [[math.hypot(i*edge - size[0]/2, j*edge - size[1]/2) for j in range(ny)] for i in range(nx)]
    body, face = ([[0.0]*(ny + 1) for _ in range(nx + 1)] for _ in range(2))
    for i in range(nx):
        row = face_row = 0.0
        for j in range(ny):
            share = 8*(1 - 0.5*(i in (0, nx - 1)))*(1 - 0.5*(j in (0, ny - 1)))
            row += share*(1 + FLOWS if radius[i][j] <= awake else ASLEEP)
            face_row += 0.5*share*AT_TOOL*(radius[i][j] <= TOOL)   # one of the two layers in a cell
            body[i + 1][j + 1] = body[i][j + 1] + row
            face[i + 1][j + 1] = face[i][j + 1] + face_row
    reach = math.ceil(awake/edge) + 1 + HALO
    middle = (cells[0]//2, cells[1]//2)
    limits = (*((max(-HALO, middle[a] - reach), min(cells[a] + HALO, middle[a] + reach)) for a in range(2)),
              (-HALO, cells[2] + HALO))
    return Plate((nx, ny, cells[2] + 1), body, face, limits)


def cuts(plate, low, high, ranks, tie=0.0):
    """Axes and positions at which a box can be divided, as in grid/partition.f90: the best, then those that are worse by at most the fraction `tie` of the load."""
    share, values = (ranks + 1)//2/ranks, []
    spans = [high[a] - low[a] + 1 for a in range(3)]
    for axis in range(3):
        planes = plate.profile(low, high, axis)
        total, below, kept = sum(planes), 0.0, 0
        if total <= 0.0:
            continue
        while kept < len(planes) and below + 0.5*planes[kept] <= share*total:
            below += planes[kept]
            kept += 1
        excess = max(below/share, (total - below)/(1 - share))/total - 1
        values.append((excess - LENGTH_IS_WORTH*spans[axis]/max(spans), axis, low[axis] + kept - 1))
    values.sort()
    return [cut[1:] for cut in values if cut[0] <= values[0][0] + tie]


def divisions(plate, low, high, ranks, tie=0.0):
    """Boxes of nodes, one list for each way to divide; without `tie` there is one way."""
    if ranks == 1:
        yield [(low, high)]
        return
    lower = (ranks + 1)//2
    for axis, place in cuts(plate, low, high, ranks, tie):
        middle, rest = list(high), list(low)
        middle[axis], rest[axis] = place, place + 1
        for one in divisions(plate, low, tuple(middle), lower, tie):
            for two in divisions(plate, tuple(rest), high, ranks - lower, tie):
                yield one + two


def bisect(plate, low, high, ranks):
    """Boxes of nodes, by the best cuts."""
    return next(divisions(plate, low, high, ranks))


def exchange(plate, boxes):
    """Messages and bytes that each rank sends in a step."""
    first, last = zip(*plate.awake)
    grown = [([max(first[a], low[a] - HALO) for a in range(3)], [min(last[a], high[a] + HALO) for a in range(3)])
             for low, high in boxes]
    bins, width = {}, 24
    for r, (low, high) in enumerate(grown):
        if all(h >= l for l, h in zip(low, high)):
            for key in itertools.product(*(range(l//width, h//width + 1) for l, h in zip(low, high))):
                bins.setdefault(key, []).append(r)
    messages, sent, done = [0]*len(boxes), [0]*len(boxes), set()
    for members in bins.values():
        for i, j in itertools.combinations(members, 2):
            if (i, j) in done:
                continue
            done.add((i, j))
            shared = math.prod(max(0, min(grown[i][1][a], grown[j][1][a]) - max(grown[i][0][a], grown[j][0][a]) + 1)
                               for a in range(3))
            for r in (i, j) if shared else ():
                messages[r] += 1
                sent[r] += BYTES*shared
    return messages, sent


def predict(plate, ranks, options):
    """Time of a step and its parts, and memory of a rank, for a number of ranks."""
    boxes = bisect(plate, (0, 0, 0), tuple(n - 1 for n in plate.n), ranks)
    loads = [plate.load(*box) for box in boxes]
    messages, sent = exchange(plate, boxes) if ranks > 1 else ([0], [0])
    unit = options.particle*1e-9
    ideal = sum(loads)/ranks*unit
    reduction = 2*math.ceil(math.log2(ranks))*options.latency if ranks > 1 else 0.0
    times = []
    for (low, high), load, m, s in zip(boxes, loads, messages, sent):
        inner = math.prod(max(0, high[a] - low[a] + 1 - 2*HALO*((low[a] > 0) + (high[a] < plate.n[a] - 1)))
                          for a in range(3))/math.prod(high[a] - low[a] + 1 for a in range(3))
        way = m*options.latency + s/options.bandwidth
        times.append(load*unit + s*options.pack + reduction + way - min(way, TO_GRID*load*unit*inner))
    held = [plate.particles(*box) for box in boxes]
    nodes = [math.prod(high[a] - low[a] + 1 + 2*HALO for a in range(3)) for low, high in boxes]
    memory = max(PARTICLE_BYTES*p + NODE_BYTES*q + 2*s for p, q, s in zip(held, nodes, sent)) + 24*ranks
    total = sum(held)
    return {"scaling": "plate", "ranks": ranks, "particles": round(total), "imbalance": round(max(loads)*ranks/sum(loads), 3),
            "milliseconds_a_step": round(1e3*max(times), 4), "efficiency": round(ideal/max(times), 4),
            "messages_a_step": sum(messages), "bytes_a_step": sum(sent), "most_messages": max(messages),
            "reduction_percent": round(100*reduction/max(times), 2),
            "megabytes_of_a_rank": round(1e-6*memory, 1), "most_particles_over_mean": round(max(held)*ranks/total, 2),
            # Frames of 100 bytes a particle on one disk; two reductions of a cut after the other.
            "steps_of_a_frame": round(100*total/DISK/max(times), 0),
            "steps_of_a_division": round((ranks - 1)*reduction/max(times) if ranks > 1 else 0.0, 1)}


def edge_for(particles):
    """Edge of the cells of a plate of so many particles [mm]."""
    return (8*math.prod(SIZE)/particles)**(1/3)


def started(folder, executable):
    """A checkpoint of the small plate in which most of the metal sleeps."""
    run(folder / "start", executable, 1, [str(ROOT / "benchmarks/plate.nml")])
    return max((folder / "start").glob("*_checkpoint*.h5"), key=lambda p: p.stat().st_mtime)


def run(folder, executable, ranks, words):
    """A run; its summary."""
    environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMPI_MCA_mpi_yield_when_idle="1", OMPI_MCA_hwloc_base_binding_policy="none")
    start = ["mpirun", "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []
    subprocess.run([*start, executable, *words, "--quiet", "--output", str(folder)], check=True, env=environment,
                   stdout=subprocess.DEVNULL, cwd=folder.parent)
    return json.loads(next(folder.glob("*_summary.json")).read_text())


def counted(folder, executable, checkpoint, ranks):
    """Messages and bytes a step and the imbalance that the program counts, and the share that is awake."""
    few, many = (run(folder / f"{ranks}_{steps}", executable, ranks,
                     ["--restart", str(checkpoint), "--set", f"TIME.MAX_STEPS={START + steps}"]) for steps in (5, 10))
    return ((many["messages"] - few["messages"])/5, (many["bytes_sent"] - few["bytes_sent"])/5, many["imbalance_worst"],
            many["awake_share"])


# Of benchmarks/plate.nml: number of steps, lower corner of the grid [m], number of nodes.
START, LOWER, NODES = 2000, (-8e-3, -8e-3, 0.0), (57, 29, 11)


def compare(options, numbers):
    """The small plate: messages, bytes and imbalance, predicted and counted, for numbers of ranks."""
    with tempfile.TemporaryDirectory() as place:
        checkpoint = started(pathlib.Path(place), options.executable)
        plate = Measured(checkpoint, 2e-3, LOWER, tool_place(checkpoint), NODES)
        for ranks in numbers:
            many, much, imbalance, awake = counted(pathlib.Path(place), options.executable, checkpoint, ranks)
            ways = divisions(plate, (0, 0, 0), tuple(n - 1 for n in NODES), ranks, TIE)
            boxes = min(ways, key=lambda way: abs(sum(exchange(plate, way)[1]) - much))
            loads = [plate.load(*box) for box in boxes]
            messages, sent = exchange(plate, boxes)
            yield {"ranks": ranks, "messages_a_step": [sum(messages), many], "bytes_a_step": [sum(sent), much],
                   "imbalance": [round(max(loads)*ranks/sum(loads), 3), round(imbalance, 3)],
                   "awake_share": [round(plate.awake_share, 3), round(awake, 3)]}


def tool_place(checkpoint):
    """Middle of the face of the tool when the checkpoint was written [m]."""
    import h5py
    with h5py.File(checkpoint, "r") as file:
        return 48e-3, 20e-3, 12.005e-3 - 1.5e-3*float(file.attrs["time"])


def report(options, numbers):
    """The table in the form of benchmarks/scaling."""
    for row in compare(options, numbers) if numbers else ():
        print(json.dumps(row), flush=True)
    for particles in (1e8, 1e9):
        plate = make_plate(SIZE, edge_for(particles))
        for ranks in (1, 16, 100, 1000, 10000):
            print(json.dumps(predict(plate, ranks, options)), flush=True)
