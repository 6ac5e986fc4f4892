# SPDX-License-Identifier: MIT
"""The same on any number of ranks, divided anew at every sort."""

import driver
import numpy as np

from .base import SHIFT, Check, Row, box, values, yes

STATE = ["x", "v", "b", "jac", "plastic", "temp", "tau"]


class Rebalanced(Row):
    """Sorted and divided anew in every step, on 2, 4 and 8 ranks against one."""

    name = "ranks"
    text = "sorted and divided anew every step: state on 2, 4, 8 ranks that of one to 1e-10, no particle lost"
    alone = True
    # Ends, and grids with moved origins; the periodic sides of the torus end where its body does.
    stems = {"torus": {"WALL.POSITION": 0} | box(1e-3, (0, 0, 0), (10, 6, 6), (0.0, 0.0, -SHIFT[2])),
             "stir_small": {"TIME.END": 0.02, "OUTPUT.CHECKPOINT_INTERVAL": 0.02}
             | box(4e-3, (-2, -2, 0), (8, 7, 6), [-o for o in SHIFT]),
             "discs": {"TIME.END": 1.3, "OUTPUT.CHECKPOINT_INTERVAL": 1.3}
             | box(0.05, (-2, -2, 0), (22, 22, 1), (SHIFT[0], SHIFT[1], 0.0))}

    def cases(self, quick):
        stems, shapes = (("torus",), ("ugimp",)) if quick else (self.stems, ("ugimp", "bspline"))
        return {f"{stem} {shape} on {n}": {"stem": stem, "shape": shape, "n": n}
                for stem in stems for shape in shapes for n in ((4,) if quick else (2, 4, 8))}

    def measure(self, place, ranks, stem, shape, n):
        sets = self.stems[stem] | {"METHOD.SHAPE": shape, "METHOD.SORT_INTERVAL": 1, "METHOD.REBALANCE": 1.0}
        states = []
        for count in (1, n):
            folder = place / str(count)
            folder.mkdir()
            states.append(self.run(folder, count, sets, "--quiet", stem=stem)[1].checkpoint())
        one, many = states
        same = np.array_equal(one.number, many.number)
        apart = max(driver.distance(one, many, STATE).values()) if same else np.inf
        return [yes("no particle lost", same), Check("difference", apart, at_most=1e-10),
                Check("ranks with particles", sum(k > 0 for k in many.particles_of_rank), at_least=n)]


ROWS = (Rebalanced(),)
