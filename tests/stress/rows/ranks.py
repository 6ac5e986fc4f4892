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
    stems = {"torus": {}, "stir_small": {"TIME.END": 0.02, "OUTPUT.CHECKPOINT_INTERVAL": 0.02},
             "discs": {"TIME.END": 1.3, "OUTPUT.CHECKPOINT_INTERVAL": 1.3}}

    def cases(self, quick):
        stems = ("torus",) if quick else self.stems
        return {f"{stem} on {n}": {"stem": stem, "n": n} for stem in stems for n in ((4,) if quick else (2, 4, 8))}

    def measure(self, place, ranks, stem, n):
        sets = self.stems[stem] | {"METHOD.SORT_INTERVAL": 1, "METHOD.REBALANCE": 1.0}
        if stem == "stir_small":
            sets |= box(4e-3, (-2, -2, 0), (8, 7, 6), [-o for o in SHIFT])
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
