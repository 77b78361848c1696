"""One symbolic step of Rodas5P, a stiffly accurate Rosenbrock method of order 5 for index-1 DAEs, with its dense output of order 4.

G. Steinebach: Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the Julia Differential Equations package,
BIT Numerical Mathematics 63:27 (2023). For M y' = f(t, y) with constant M and W = M / (h gamma) - df/dy, stage i solves

    W u_i = f(t + alpha_i h, y + sum_j a_ij u_j) + sum_j (c_ij / h) M u_j + gamma_i h df/dt
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import casadi as ca

from powertrain.integration.step import StepResult, combined
from powertrain.numerics.sparse_lu import factorize

GAMMA = 0.21193756319429014
ALPHA = (0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0)
GAMMA_SUM = (GAMMA, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0.0, 0.0, 0.0)
_LAST = (-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946)
A: tuple[tuple[float, ...], ...] = (
    (),
    (3.0,),
    (2.849394379747939, 0.45842242204463923),
    (-6.954028509809101, 2.489845061869568, -10.358996098473584),
    (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
    _LAST,
    (*_LAST, 1.0),
    (*_LAST, 1.0, 1.0),
)
C: tuple[tuple[float, ...], ...] = (
    (),
    (-14.155112264123755,),
    (-17.97296035885952, -2.859693295451294),
    (147.12150275711716, -1.41221402718213, 71.68940251302358),
    (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
    (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471),
    (
        30.91273214028599,
        -3.1208243349937974,
        77.79954646070892,
        34.28646028294783,
        -19.097331116725623,
        -28.087943162872662,
    ),
    (
        37.80277123390563,
        -3.2571969029072276,
        112.26918849496327,
        66.9347231244047,
        -40.06618937091002,
        -54.66780262877968,
        -9.48861652309627,
    ),
)
DENSE = (
    (
        25.948786856663858,
        -2.5579724845846235,
        10.433815404888879,
        -2.3679251022685204,
        0.524948541321073,
        1.1241088310450404,
        0.4272876194431874,
        -0.17202221070155493,
    ),
    (
        -9.91568850695171,
        -0.9689944594115154,
        3.0438037242978453,
        -24.495224566215796,
        20.176138334709044,
        15.98066361424651,
        -6.789040303419874,
        -6.710236069923372,
    ),
    (
        11.419903575922262,
        2.8879645146136994,
        72.92137995996029,
        80.12511834622643,
        -52.072871366152654,
        -59.78993625266729,
        -0.15582684282751913,
        4.883087185713722,
    ),
)


def step(
    rhs: Callable[[ca.SX, ca.SX], ca.SX],
    jacobian: ca.SX,
    time_slope: ca.SX,
    states: int,
    t: ca.SX,
    h: ca.SX,
    y: ca.SX,
    slope: ca.SX,
    rows: Sequence[int] | None = None,
) -> StepResult:
    """A step of size ``h`` from ``(t, y)`` with ``slope = rhs(t, y)``: (dx/dt, residual) for y = (x, z) with ``states`` entries in x.

    ``jacobian`` and ``time_slope`` are the derivatives of ``rhs`` at ``(t, y)`` with respect to y and t; ``rows`` the pivot rows of the
    linear solves (see :func:`powertrain.numerics.pivots.match_rows`).
    """
    n = y.numel()
    zero = type(y).zeros(n)
    mass = ca.diag(ca.vertcat(ca.DM.ones(states), ca.DM(n - states, 1)))
    solve = factorize(mass / (h * GAMMA) - jacobian, rows)
    point, stages = y, [solve(slope + GAMMA * h * time_slope)]
    for i in range(1, 8):
        point, memory = y + combined(A[i], stages), combined(C[i], stages) / h
        right = rhs(t + ALPHA[i] * h, point) + ca.vertcat(memory[:states], zero[states:])
        if GAMMA_SUM[i]:
            right = right + GAMMA_SUM[i] * h * time_slope
        stages.append(solve(right))
    end = point + stages[7]
    rise = end - y
    first, second, third = (combined(row, stages) for row in DENSE)
    dense = ca.horzcat(y, rise + first, second - first, third - second, -third)
    return StepResult(end=end, error=stages[7], dense=dense, stiffness=type(y)(0))
