"""The torques and forces of friction laws and contacts, solved together from the modes of the laws.

For given torques tau, the rates of the laws' speeds are affine, v = a - G tau, with G symmetric and positive semidefinite. A sliding law
gives its torque; a stuck law makes its rate zero. If stuck laws hold the same motion, G is singular, and v = 0 determines only the sum of
their torques. Each stuck law that others may hold therefore has a compliance, tiny compared with the inertia on which it acts,

    v_i - eps G_ii (tau_i - q_i) = 0,

first with q = 0, then with q = the torques found (a proximal point step). Laws that hold the same motion then share its torque like equally
stiff springs. A stuck law creeps by eps^2 of what its torque accelerates, which is round-off. If the other laws leave little of its
mobility, the creep is larger, (eps G_ii/G_left)^2. For a light part between a clutch and a brake in series, G_left would be its share of
the inertia; but these hold no common motion, and laws that others cannot hold have no compliance (``set_apart``).

R. T. Rockafellar, Monotone operators and the proximal point algorithm, SIAM J. Control Optim. 14 (1976) 877.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.linalg import matrix_rank, svd

from powertrain.compiler.cancellation import terms
from powertrain.compiler.generic import generic_values
from powertrain.compiler.law_torques import LawTorque
from powertrain.dae.friction import least_torque, sliding_torque
from powertrain.dae.tolerances import GIVEN
from powertrain.language.laws import FrictionLaw, UnilateralLaw
from powertrain.language.symbols import Symbol, column, free_symbols, key, scalars
from powertrain.numerics.sparse_lu import Numbers, Row, eliminate

COMPLIANCE = 1e-8
"""eps: creep of a stuck law relative to its own G_ii. Its square is round-off; round-off over eps is the accuracy of shared torques."""
IMPLICIT_COMPLIANCE = 1e-11
"""eps of laws that are nonlinear in the torques: they are solved with pivoting, and without the second step."""
_DEPENDENT = 1e-12
"""Singular values of G below this count as zero, with each law's own effect scaled to 1: round-off, while inertias may differ by 1e10."""
_PRESENT = 1e-14
"""Share in a combination of laws without effect below which a law is certainly not part of it."""
_ROUND_OFF = 1e-13
"""What remains of terms that cancel counts as zero below this share of them."""


@dataclass(frozen=True)
class Motion:
    """The states, their rates for given torques of the laws, and the unknowns that remain implicit."""

    x: Symbol
    rates: Symbol
    implicit: Symbol


def set_apart(laws: Sequence[LawTorque], motion: Motion) -> list[LawTorque]:
    """The laws, with a mark on those that others cannot hold for any parameters: their rows of G are independent of the others.

    Such a law moves a state that no other law moves, apart from laws already marked. Laws that are independent only for most parameters
    (clutches behind two gears whose ratios may be equal) are not marked; slopes that may become zero therefore do not count. Nor is a law
    marked if a source ties its state to those of others (a freewheel between a prescribed speed and a brake).
    """
    if not laws or not motion.x.numel():
        return list(laws)
    own = [_constantly_moved(t, motion) for t in laws]
    moved = [_moved(t, motion) for t in laws]
    left = set(range(len(laws)))
    while found := {i for i in left if own[i].difference(*(moved[k] for k in left - {i}))}:
        left -= found
    if len(left) < len(laws):
        left |= _replaceable(laws)
    return [replace(t, apart=i not in left) for i, t in enumerate(laws)]


def _replaceable(laws: Sequence[LawTorque]) -> set[int]:
    """The laws whose columns of G are combinations of the others, for parameters without special values; all if that is not known."""
    slopes = generic_values(ca.jacobian(column([t.rate for t in laws]), column([t.law.effort for t in laws]))).full()
    if not np.isfinite(slopes).all():
        return set(range(len(laws)))
    sizes = np.sqrt(np.abs(np.diag(slopes)))
    sizes[sizes == 0.0] = 1.0
    scaled = slopes / np.outer(sizes, sizes)
    _, values, combinations = svd(scaled)
    rank = int((values > _DEPENDENT).sum())
    involved = np.abs(combinations[rank:]).max(axis=0, initial=0.0) > _PRESENT
    return {
        i for i in np.flatnonzero(involved).tolist() if matrix_rank(np.delete(scaled, i, axis=1), _DEPENDENT) == rank
    }


def _moved(t: LawTorque, motion: Motion) -> set[int]:
    """The states on which the speed of a law depends; with an implicit unknown this may be any state."""
    if contains(t.speed, motion.implicit):
        return set(range(motion.x.numel()))
    return set(ca.jacobian_sparsity(t.speed, motion.x).get_col())


def _constantly_moved(t: LawTorque, motion: Motion) -> set[int]:
    """The states that the torque of a law moves, and on which its speed depends with a constant coefficient."""
    if t.algebraic or contains(t.speed, motion.implicit):
        return set()
    slopes, driven = ca.jacobian(t.speed, motion.x), set(ca.jacobian_sparsity(motion.rates, t.law.effort).row())
    return {j for j in driven if slopes[j].is_constant() and not slopes[j].is_zero()}


def contains(expression: Symbol, symbols: Symbol) -> bool:
    """Whether any element of the expression depends on any of the symbols."""
    return bool(ca.depends_on(expression, symbols))


@dataclass(frozen=True)
class LawTorques:
    """The torques ``tau`` of all laws as expressions of states, implicit unknowns and modes.

    ``creep`` is the rate of each law before the proximal step plus the rate after it, computed from the coefficients for which the torques
    were solved. It then has the round-off of the torques. The round-off of a rate by itself, divided by the compliance, may be as large as
    a torque. ``implicit`` are the laws that are nonlinear in the torques (an efficiency that depends on the load): their own ``tau``
    remains an unknown, with the equations ``residuals`` = 0.
    """

    tau: list[Symbol]
    creep: list[Symbol]
    implicit: list[int]
    residuals: list[Symbol]


def solve_torques(laws: Sequence[LawTorque]) -> LawTorques:
    """All torques for given modes; ``laws`` in terms of states and of their own torques."""
    if not laws:
        return LawTorques([], [], [], [])
    modes = [t.mode == 0 if isinstance(t.law, FrictionLaw) else t.mode == 1 for t in laws]
    tau, n = [t.law.effort for t in laws], len(laws)
    torques = column(tau)
    held, loose = [_rate_held(t, torques) for t in laws], [_loose(t, torques) for t in laws]
    short, parts = _affine([*held, *loose, *(t.rate for t in laws)], tau)
    held, loose = short[:n], short[n : 2 * n]
    laws = [replace(t, rate=rate) for t, rate in zip(laws, short[2 * n :], strict=True)]
    rows = [ca.if_else(mode, a, b) for mode, a, b in zip(modes, held, loose, strict=True)]
    curved = _curved(rows, tau)
    signs = [1 if isinstance(t.law, UnilateralLaw) else -1 for t in laws]  # a friction torque opposes its rate
    yields = [sign * compliance(t, torques) for t, sign in zip(laws, signs, strict=True)]
    soft = [ca.if_else(mode, value, 0) for mode, value in zip(modes, yields, strict=True)]
    explicit = [i for i in range(n) if i not in curved]
    kept = _Rows(*([values[i] for i in explicit] for values in (modes, held, loose, tau)))
    steps = kept.solved([COMPLIANCE * soft[i] for i in explicit])
    first, whole = (_exchanged(tau, explicit, step) for step in steps)
    rates = [ca.substitute(column([t.rate for t in laws]), torques, column(values)) for values in (first, whole)]
    creep = _exchanged(scalars(rates[0] + rates[1]), explicit, kept.rates(*steps))
    everything = [*whole, *creep, *(rows[i] + IMPLICIT_COMPLIANCE * soft[i] * tau[i] for i in curved)]
    if parts:
        everything = scalars(ca.substitute(column(everything), *parts))
    return LawTorques(everything[:n], everything[n : 2 * n], curved, everything[2 * n :])


def _exchanged(values: list[Symbol], places: list[int], others: list[Symbol]) -> list[Symbol]:
    """The values, with others at some places."""
    at = dict(zip(places, others, strict=True))
    return [at.get(i, value) for i, value in enumerate(values)]


def _rate_held(t: LawTorque, tau: Symbol) -> Symbol:
    """The expression that is zero while the law is stuck or the contact closed.

    If its torque changes no motion, a law has the smallest torque within its bounds.
    """
    if isinstance(t.law, UnilateralLaw) or not is_prescribed(t):
        return t.rate
    return t.law.effort - (Symbol(0) if limits_follow(t.law, tau) else least_torque(t.law.lower, t.law.upper))


def is_prescribed(t: LawTorque) -> bool:
    """Whether its own torque never changes the motion of a law."""
    return not contains(t.rate, t.law.effort)


def limits_follow(law: FrictionLaw, tau: Symbol) -> bool:
    """Whether the limits of a law depend on torques."""
    return contains(ca.vertcat(law.lower, law.upper), tau)


def _loose(t: LawTorque, tau: Symbol) -> Symbol:
    """The expression that is zero while the law slides or the contact is open.

    A law held at rest by others does not slide: its limit is the peak torque.
    """
    if isinstance(t.law, UnilateralLaw):
        return t.law.effort
    holds = ca.if_else(t.rests, t.law.peak, 1) if breaks_away(t.law) and held_by_others(t, tau) else 1
    return t.law.effort - holds * sliding_torque(t.mode, t.law.lower, t.law.upper, is_prescribed(t))


def breaks_away(law: FrictionLaw) -> bool:
    """Whether a law may hold more than it transmits when sliding."""
    return not (law.peak.is_constant() and float(law.peak) == 1.0)


def compliance(t: LawTorque, tau: Symbol) -> Symbol:
    """The compliance of a law relative to eps: the effect of its torque on its own rate.

    A law that others cannot hold shares its torque with none; it has a compliance only if others prescribe its motion.
    """
    slope = ca.jacobian(t.rate, t.law.effort)
    if slope.is_zero():
        return Symbol(0)
    return _or_terms(slope, ca.fabs(slope) if held_by_others(t, tau) else Symbol(0))


def shares(t: LawTorque, tau: Symbol) -> bool:
    """Whether the torques of other laws take part in the motion of this one."""
    others = [s for s in scalars(tau) if key(s) != key(t.law.effort)]
    return contains(t.rate, column(others))


def held_by_others(t: LawTorque, tau: Symbol) -> bool:
    """Whether other laws may hold the motion of this one; its torque then does not follow from its own rest."""
    return not t.apart and shares(t, tau)


def mobility(slope: Symbol) -> Symbol:
    """|G_ii|, the effect of a law's torque on its own rate; the size of its terms if the motion is prescribed and they cancel."""
    return _or_terms(slope, ca.fabs(slope))


def _or_terms(slope: Symbol, otherwise: Symbol) -> Symbol:
    """The size of the slope's terms if they cancel."""
    size = terms(slope)
    return ca.if_else(ca.fabs(slope) <= GIVEN * size, size, otherwise)


def _curved(rows: list[Symbol], symbols: list[Symbol]) -> list[int]:
    """The symbols on which the slopes of the rows depend."""
    slopes = ca.jacobian(column(rows), column(symbols))
    inside = {key(s) for s in free_symbols(slopes)}
    return [i for i, s in enumerate(symbols) if key(s) in inside]


def _affine(rows: list[Symbol], symbols: list[Symbol]) -> tuple[list[Symbol], tuple[Symbol, Symbol] | None]:
    """The rows; if they do not look affine, with symbols for all parts without torques, and these symbols with their expressions.

    A table of several arguments hides that it is independent of the torques.
    """
    if not _curved(rows, symbols):
        return rows, None
    torques, whole = {key(s) for s in symbols}, column(rows)
    others = column([s for s in free_symbols(whole) if key(s) not in torques])
    short, names, parts = ca.extract_parametric(whole, others, {})
    return scalars(short), (column(names), column(parts))


class _Rows:
    """Affine equations of some torques: ``held`` = 0 in the mode of the law, else ``loose`` = 0; each row's own torque is its pivot."""

    def __init__(self, modes: list[Symbol], held: list[Symbol], loose: list[Symbol], tau: list[Symbol]) -> None:
        self.modes = modes
        self.held, self.loose = _coefficients(held, tau), _coefficients(loose, tau)

    def solved(self, soft: list[Symbol]) -> tuple[list[Symbol], list[Symbol]]:
        """The torques before and after one proximal step, row + soft (torque - q) = 0."""
        entries: list[Row] = []
        numbers: list[Numbers] = []
        right = []
        for i, (mode, (a, b), (c, d)) in enumerate(zip(self.modes, self.held, self.loose, strict=True)):
            row = {j: ca.if_else(mode, a.get(j, 0), c.get(j, 0)) for j in sorted(a.keys() | c.keys() | {i})}
            row[i] += soft[i]
            entries.append(row)
            numbers.append({j: 1e9 if i == j else 1.0 for j in row})
            right.append(-ca.if_else(mode, b, d))
        factors = eliminate(entries, numbers)
        first = factors.solve(right)
        second = factors.solve([b + s * first[i] for i, (b, s) in enumerate(zip(right, soft, strict=True))])
        return [first[j] for j in range(len(soft))], [second[j] for j in range(len(soft))]

    def rates(self, first: list[Symbol], second: list[Symbol]) -> list[Symbol]:
        """``held`` for the first torques plus ``held`` for the second."""
        return [sum((a * (first[j] + second[j]) for j, a in slopes.items()), 2 * value) for slopes, value in self.held]


def _coefficients(rows: list[Symbol], tau: list[Symbol]) -> list[tuple[Row, Symbol]]:
    """The slopes of each affine row, and its value without torques."""
    if not rows:
        return []
    whole, symbols = column(rows), column(tau)
    slopes, entries = ca.jacobian(whole, symbols), [Row() for _ in rows]
    for i, j, entry in zip(*slopes.sparsity().get_triplet(), scalars(slopes.nz[:]), strict=True):
        entries[i][j] = entry
    return list(zip(entries, scalars(ca.substitute(whole, symbols, ca.DM.zeros(len(rows)))), strict=True))


def cancels(slope: Symbol) -> bool:
    """Whether the terms of an expression cancel each other whatever the values."""
    return bool(generic_values(ca.fabs(slope) <= _ROUND_OFF * terms(slope)))
