"""One symbolic step of Dormand and Prince's explicit Runge-Kutta method 5(4), with its dense output.

Dormand, Prince: A family of embedded Runge-Kutta formulae, J. Comp. Appl. Math. 6 (1980); dense output of Shampine (1986) as in
Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, II.6.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from powertrain.integration.step import StepResult, combined

A = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
C = (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
DENSE = (
    -12715105075 / 11282082432,
    0.0,
    87487479700 / 32700410799,
    -10690763975 / 1880347072,
    701980252875 / 199316789632,
    -1453857185 / 822651844,
    69997945 / 29380423,
)


def step(rhs: Callable[[ca.SX, ca.SX], ca.SX], t: ca.SX, h: ca.SX, y: ca.SX, k1: ca.SX) -> StepResult:
    """A step of size ``h`` from ``(t, y)`` with ``k1 = rhs(t, y)``; ``rhs`` returns dy/dt.

    ``stiffness`` is Hairer's estimate of h times the spectral radius from the last two stages.
    """
    stages, points = [k1], [y]
    for row, c in zip(A, C, strict=True):
        points.append(y + h * combined(row, stages))
        stages.append(rhs(t + c * h, points[-1]))
    end = points[-1]
    error = h * combined(ERROR, stages)
    rise = end - y
    bend = h * k1 - rise
    third = rise - h * stages[6] - bend
    fourth = h * combined(DENSE, stages)
    dense = ca.horzcat(y, rise + bend, -bend + third + fourth, -third - 2 * fourth, fourth)
    stiffness = ca.sqrt(h**2 * ca.sumsqr(stages[6] - stages[5]) / (ca.sumsqr(end - points[5]) + 1e-300))
    return StepResult(end=end, error=error, dense=dense, stiffness=stiffness)
