# SPDX-License-Identifier: MIT
"""A tilted disc drawn over a plastic plate."""

import math

import numpy as np

from .base import Problem, values

SIZE = (4.5, 2.25, 1.25)  # of the plate, half of it [radii]
STEADY = (0.6, 1.2)  # where the groove is looked at: from its start, up to behind the tool [radii]


class Groove(Problem):
    """The groove of a flat disc without spin, half of it."""

    name = "groove"
    section = "1.19"
    cells = "over the radius"
    norm = "larger of: floor off the envelope, in particles over 5 (a tenth: 2 %); volume not displaced, over the groove's"
    passes = 0.02
    resolutions = (4, 6)
    fine = (8,)
    quick = (4,)
    bounds = {4: 0.18, 6: 0.12, 8: 0.12}  # docs/method.md, Edges
    parameters = {"tilt": 6.0, "dip": 0.02, "speed": 8.0, "friction": 0.1, "way": 3.5}

    def place(self, p):
        """Of the middle of the disc's face at first: its leading edge is at x = 0, `dip` below the surface."""
        tilt = math.radians(p["tilt"])
        return -math.cos(tilt), SIZE[2] - p["dip"] - math.sin(tilt)

    def sets(self, n, p):
        h, end = 1.0 / n, p["way"] / p["speed"]
        x, z = self.place(p)
        size = [round(s * n) * h for s in SIZE]
        return {
            "GRID.CELL": h,
            "GRID.LOWER": values(-2 * h, -2 * h, -2 * h),
            "GRID.UPPER": values(size[0] + 2 * h, size[1] + 2 * h, size[2] + 1.0),
            "SHAPE.UPPER": values(*size),
            "TOOL.POSITION": values(x, 0, z + size[2] - SIZE[2]),
            "TOOL.TILT_DEG": p["tilt"],
            "TOOL.FRICTION": p["friction"],
            "MOTION.VELOCITY": values(p["speed"], 0, 0),
            "WALL(2).POSITION": size[0],
            "WALL(4).POSITION": size[1],
            "TIME.END": end,
            "OUTPUT.CHECKPOINT_INTERVAL": end,
            "OUTPUT.HISTORY_INTERVAL": end / 200.0,
        }

    def floor(self, x, y, p, top):
        """Height of what the disc has swept at (x, y), at most `top`."""
        tilt = math.radians(p["tilt"])
        middle, z = self.place(p)
        end = middle + p["way"]
        reach = math.cos(tilt) * np.sqrt(np.maximum(0.0, 1.0 - y * y))
        last = np.minimum(end, x + reach)  # middle of the disc when it is lowest above (x, y)
        swept = (np.abs(y) < 1.0) & (x < last + reach)
        return np.where(swept, np.minimum(top, z + (x - last) * math.tan(tilt) + top - SIZE[2]), top)

    def measure(self, run, n, p):
        state, history = run.checkpoint(), run.history()
        s = 0.5 / n
        top = round(SIZE[2] * n) / n
        volume = state.jac * s**3
        x, y, z = state.x.T
        # what the tool has swept below the surface, and what is above that
        fine = s / 8.0
        gx, gy = np.meshgrid(np.arange(0.5 * fine, SIZE[0], fine), np.arange(0.5 * fine, 1.0, fine), indexing="ij")
        groove = np.sum(top - self.floor(gx, gy, p, top)) * fine**2
        raised = np.sum(volume * np.clip((z + 0.5 * s - top) / s, 0.0, 1.0))
        squeezed = np.sum(s**3 - volume)
        # floor of the groove behind the tool, columns of one particle
        a, b = STEADY
        part_x = np.clip((np.minimum(x + 0.5 * s, b) - np.maximum(x - 0.5 * s, a)) / s, 0.0, 1.0)
        off = []
        for k in range(2 * n):
            lower = k * s
            part = sum(np.clip((np.minimum(side * y + 0.5 * s, lower + s) - np.maximum(side * y - 0.5 * s, lower)) / s,
                               0.0, 1.0) for side in (1, -1))
            height = np.sum(volume * part * part_x) / (s * (b - a))
            gx, gy = np.meshgrid(np.arange(a + 0.5 * fine, b, fine), np.arange(lower + 0.5 * fine, lower + s, fine))
            wanted = np.mean(self.floor(gx, gy, p, top))
            off.append((height - wanted) / s)
        off = np.array(off).reshape(-1, 2).mean(axis=1)  # strips of a cell
        inside = (z > self.floor(x, y, p, top)) & (z < top)
        lost = (groove - raised - squeezed) / groove
        work = history["tool_work[J]"][-1]
        figures = {"floor": float(np.abs(off[:-1]).max()), "undisplaced": float(lost),
                   "inside": float(np.sum(volume[inside]) / groove), "elastic": float(squeezed / groove),
                   "pressure/k": float(history["disc_force_z[N]"][-60:].mean()) * 2.0 / math.pi / 1e6,
                   "contact loss/work": float(history["contact_loss[J]"][-1] / work)}
        return max(figures["floor"] / 5.0, abs(lost)), figures


PROBLEMS = (Groove(),)
