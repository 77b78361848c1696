"""Sets the speeds of stuck laws and the gaps of closed contacts exactly to zero, by the smallest correction of the states.

With the speeds w(x) of the stuck laws and W = dw/dx, the correction of least norm is -W'λ with W W'λ = w. A second correction removes
what rounding and nonlinear speeds leave.

Where the gap of a closed contact is a nonlinear function of the states, errors of the integration add up. A projection after each step
keeps the order of the method (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VII.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import casadi as ca

from powertrain.compiler.cancellation import terms
from powertrain.dae.hybrid import Contact, HybridDae
from powertrain.language.symbols import column, scalars

_DEPENDENT = 1e-13
"""A row of W is dependent if elimination leaves less than this share of the square of its terms: others hold its motion already, or it is
round-off, as where a clutch connects two shafts that gears tie to one speed.
"""


def at_rest(dae: HybridDae) -> ca.SX:
    """The states with the speeds of all stuck laws set to zero."""
    x, free, coupled = scalars(dae.x), _moved(dae), []
    for law in dae.frictions:
        if law.algebraic or law.prescribed:
            continue
        stuck, slopes = dae.m[law.index] == 0, ca.jacobian(law.w, dae.x)
        if not _is_multiple(law.w, slopes, dae.x):
            coupled.append((stuck, law.w))
            continue
        (i,), factor = slopes.sparsity().get_col(), slopes.nz[0]
        if not factor.is_constant():
            stuck = ca.logic_and(stuck, factor**2 > _DEPENDENT * terms(factor) ** 2)
        x[i], free[i] = ca.if_else(stuck, 0.0, x[i]), ca.if_else(stuck, 0.0, free[i])
    return _projected(dae, column(x), column(free), coupled) if coupled else column(x)


def _is_multiple(speed: ca.SX, slopes: ca.SX, x: ca.SX) -> bool:
    """Whether a speed is a multiple of one state, as those of all gears on one shaft; the state is then zero where the speed is."""
    if slopes.nnz() != 1:
        return False
    state = x[slopes.sparsity().get_col()[0]]
    return bool(ca.substitute(speed, state, 0).is_zero()) and not ca.depends_on(slopes.nz[0], state)


def closed(dae: HybridDae) -> ca.SX | None:
    """The states with the gaps of closed contacts set to zero; None if these are linear in the states: they remain so by integration."""
    if not any(map(partial(_drifts, dae), dae.contacts)):
        return None
    gaps = [(dae.m[law.index] > 0.5, law.gap) for law in dae.contacts]
    return _projected(dae, dae.x, _positions(dae), gaps)


def _drifts(dae: HybridDae, law: Contact) -> bool:
    """Whether the gap of a closed contact has the errors of the integration."""
    slopes = ca.jacobian(law.gap, dae.x)
    return ca.depends_on(law.gap, ca.vertcat(dae.t, dae.z)) or ca.depends_on(slopes, dae.x)


def _positions(dae: HybridDae) -> ca.SX:
    """1 for the states that follow from speeds which torques move."""
    moved = _moved(dae)
    speeds = [dae.x[j] for j, moves in enumerate(moved) if float(moves)]
    following = set(ca.jacobian_sparsity(dae.xdot, ca.vertcat(*speeds)).row())
    return column([ca.SX(j in following and not float(moves)) for j, moves in enumerate(moved)])


def _moved(dae: HybridDae) -> list[ca.SX]:
    """1 for the states that torques move, else 0: it is shafts that bring a mesh to rest, and not a change of the ratio of a variator."""
    n = dae.x.numel()
    if dae.opened is None:
        return [ca.SX(1)] * n
    moved = {j for causes in (dae.opened.tau, dae.z) for j in ca.jacobian_sparsity(dae.opened.xdot, causes).row()}
    return [ca.SX(j in moved) for j in range(n)]


def _projected(dae: HybridDae, x: ca.SX, free: ca.SX, laws: list[tuple[ca.SX, ca.SX]]) -> ca.SX:
    """The states with the speeds (or gaps) of the laws that hold among these set to zero; states that are not ``free`` stay."""
    stuck, speeds = column([held for held, _ in laws]), column([w for _, w in laws])
    values = ca.Function("speeds", dae.arguments, [speeds, ca.jacobian(speeds, dae.x)])

    def at(x: ca.SX) -> tuple[ca.SX, ca.SX]:
        w, W = values.call([dae.t, x, dae.z, dae.m, dae.p])
        return ca.if_else(stuck, w, 0.0), W

    w, W = at(x)
    entries = list(zip(*W.sparsity().get_triplet(), ca.vertsplit(ca.vec(W.nz[:])), strict=True))
    sizes = [ca.SX(0)] * len(laws)
    for i, _, entry in entries:
        sizes[i] += terms(entry) ** 2
    held = [ca.if_else(stuck[i], entry, 0.0) * free[j] for i, j, entry in entries]
    W = ca.SX(W.sparsity(), column(held))
    solve = _semidefinite(W @ W.T, sizes)
    x -= W.T @ solve(w)
    return x - W.T @ solve(at(x)[0])


def _semidefinite(A: ca.SX, sizes: Sequence[ca.SX]) -> Callable[[ca.SX], ca.SX]:
    """Solve with a symmetric matrix by L D L'; unknowns of rows that depend on earlier rows are zero.

    ``sizes``: the diagonal as it would be if no terms cancelled.
    """
    n = A.rows()
    rows: list[dict[int, ca.SX]] = [{} for _ in range(n)]
    for i, j in zip(*A.sparsity().get_triplet(), strict=True):
        rows[i][j] = A[i, j]
    inverse, L = [], []
    for k in range(n):
        pivot = rows[k].get(k, ca.SX(0))
        inverse.append(ca.if_else(pivot > _DEPENDENT * sizes[k], 1.0 / pivot, 0.0))
        L.append({i: value * inverse[k] for i, value in rows[k].items() if i > k})
        for i, factor in L[k].items():
            for j in L[k]:
                rows[i][j] = rows[i].get(j, ca.SX(0)) - factor * rows[k][j]

    def solve(b: ca.SX) -> ca.SX:
        x = [b[k] for k in range(n)]
        for k in range(n):
            for i, factor in L[k].items():
                x[i] -= factor * x[k]
        for k in reversed(range(n)):
            x[k] = inverse[k] * x[k] - sum((factor * x[i] for i, factor in L[k].items()), ca.SX(0))
        return column(x)

    return solve
