"""Operating points of equations without laws: follows the motion from the start to rest, for cases in which Newton's method fails.

Where a torque saturates, its slope does not show where saturation ends, and no Newton step leads on. The motion does:

    (y' - y)/h = f(y')

h triples after a step for which one linearisation is valid, and otherwise falls to a quarter.

C. T. Kelley, D. E. Keyes, Convergence analysis of pseudo-transient continuation, SIAM J. Numer. Anal. 35 (1998) 508.
"""

from __future__ import annotations

import numpy as np

from powertrain.equilibrium.beginnings import euler_matrix
from powertrain.equilibrium.laws import LAST_STEP, SteadyLaws
from powertrain.equilibrium.points import AtRest, Iterates
from powertrain.numerics.newton import relative, solved

FIRST, GROWTH, FALL = 1e-4, 3.0, 0.25
"""The first step in seconds, and the factors by which steps grow and shrink."""
DESCRIBED = 0.3
"""A step is accepted if the next correction is shorter than this share of it."""
STEPS = 400


def relaxed(laws: SteadyLaws, at: Iterates, rest: AtRest) -> Iterates:
    """The state after a long motion from ``at``, or after ``STEPS`` steps; every law must be a switch."""
    y, modes = at.y.copy(), at.modes.copy()
    length, active = np.full(len(y), FIRST), np.arange(len(y))
    for _ in range(STEPS):
        here = Iterates(at.grid[active], y[active], modes[active], at.tau[active])
        motion = laws.motion(here)
        modes[active] = laws.next_modes(here, rest.some(active)).modes
        matrix = euler_matrix(laws, motion, length[active, None])
        step = solved(matrix, -motion.rows)
        there = Iterates(here.grid, here.y + step, modes[active], here.tau)
        defect = laws.motion(there).rows
        defect[:, laws.rates] -= step[:, laws.rated] / length[active, None]
        scale = relative(here.y)
        size, left = (np.abs(v / scale).max(axis=1, initial=0.0) for v in (step, solved(matrix, -defect)))
        good = left <= DESCRIBED * size
        y[active[good]] = there.y[good]
        length[active] *= np.where(good, GROWTH, FALL)
        active = active[(length[active] < LAST_STEP) & (length[active] > FIRST**3)]
        if not active.size:
            break
    return Iterates(at.grid, y, modes, at.tau)
