"""Laws at a limit of their torque that do not slide, because stuck laws and closed contacts hold what they move.

Example: a mass is pressed against a stop harder than its friction can resist. Friction is at its limit, yet the mass rests. The speed of
such a law follows from those of the holding laws, w = c w_C, so its rate a = b - G tau is the same combination of theirs:

    G_i - c G_C = 0,  b_i - c b_C = 0,  c = G_iC G_CC^+.

It stays at rest as long as they hold. A prescribed motion leaves a difference in b only. A law that no torque moves, as between shafts that
gears tie to each other, needs none that hold it: c = 0.
(See ``powertrain.modes.complementarity`` for G.)
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.dae.contact import CLOSED
from powertrain.dae.friction import FORWARD, STUCK
from powertrain.dae.hybrid import Friction, HybridDae, Opened, OperatingPoint
from powertrain.dae.tolerances import INTEGRATED, LEAST_TORQUE
from powertrain.modes.complementarity import Complementarity
from powertrain.numerics.buffers import PREFIX

SINGULAR = 1e-10
"""Relative rank tolerance: smaller mobilities left by the holding laws count as held. It is also the uncertainty of c."""
NOTHING = 1e-8
"""Rates are the same combination if they differ by less than this share of their terms."""


def resting(problem: Complementarity, point: OperatingPoint) -> list[int]:
    """The places in the held values that mark the friction laws at a limit that others hold at rest at ``point``."""
    dae, modes, count = problem.dae, point.m[problem.laws.index], problem.laws.frictions
    holds = np.concatenate([modes[:count] == STUCK, modes[count:] == CLOSED])
    limited = [k for k, law in enumerate(dae.frictions) if law.rests is not None and abs(modes[k]) == FORWARD]
    if not limited:
        return []
    near = problem.laws.at(point, np.zeros(problem.laws.count))
    if not np.isfinite(near.rate_slope).all():
        return []
    size = np.sqrt(_own(-np.diag(near.rate_slope), near.reach))
    held = _follow(-near.rate_slope / np.outer(size, size), near.rate / size, LEAST_TORQUE * size, limited, holds)
    rest = problem.laws.at_rest(point, near, INTEGRATED)
    marks = [dae.frictions[k].rests for k, follows in zip(limited, held, strict=True) if follows and rest[k]]
    return [place for place in marks if place is not None]


def _own(own: NDArray[np.float64], terms: NDArray[np.float64]) -> NDArray[np.float64]:
    """G_ii, or the size of its terms if they cancel, as for a clutch between two shafts that gears tie to each other."""
    return np.where(np.abs(own) > SINGULAR * terms, np.abs(own), np.where(terms > 0.0, terms, 1.0))


def _follow(
    G: NDArray[np.float64], b: NDArray[np.float64], zero: NDArray[np.float64], rows: list[int], holds: NDArray[np.bool_]
) -> list[bool]:
    """Whether each of these rates is a combination of the rates of the holding laws, each scaled by its own size.

    The rate of a massless law is a speed, so G need not be symmetric. Rates below ``zero`` are nothing: what remains of a motion that has
    died away.
    """
    c = np.linalg.lstsq(G[np.ix_(holds, holds)].T, G[rows][:, holds].T, rcond=SINGULAR)[0]
    left = np.abs(G[rows] - c.T @ G[holds]).max(axis=1)
    moved = np.abs(b[rows] - c.T @ b[holds])
    terms = np.abs(b[rows]) + np.abs(c.T) @ np.abs(b[holds])
    known = zero[rows] + NOTHING * terms + SINGULAR * np.abs(b[holds]).sum()
    return [bool(one) for one in (left <= NOTHING) & (moved <= known)]


def mobility(dae: HybridDae) -> ca.Function | None:
    """A function of (time and step, y, m, p) for the loop in C; None if no laws can be held at rest at a limit of their torque.

    None, too, if contacts may hold them. Gives the rates of all laws by their torques, row by row, and without torques, and their reach;
    and whether the laws that may be held are at rest but for the error of the integration.
    """
    laws, opened = [f for f in dae.frictions if f.rests is not None], dae.opened
    if not laws or opened is None or dae.contacts:
        return None
    y, moment = ca.SX.sym("y", dae.x.numel() + dae.z.numel()), ca.SX.sym("time", 2)
    before, now = [ca.vertcat(dae.t, dae.x, dae.z)], [ca.vertcat(moment[0], y)]
    values = [ca.densify(e) for e in ca.substitute(_rates(dae, laws, opened), before, now)]
    return ca.Function(PREFIX + "mobility", [moment, y, dae.m, dae.p], values)


def _rates(dae: HybridDae, laws: Sequence[Friction], opened: Opened) -> list[ca.SX]:
    """Rates of all laws: derivatives by torques, values without them, and reach; whether ``laws`` are at rest."""
    slope, free = -ca.jacobian(opened.rate, opened.tau), opened.rate
    if n := opened.residual.numel():
        z = dae.z[:n]
        right = ca.horzcat(ca.jacobian(opened.residual, opened.tau), opened.residual)
        moved = ca.jacobian(opened.rate, z) @ ca.solve(ca.jacobian(opened.residual, z), right)
        slope, free = slope + moved[:, :-1], free - moved[:, -1]
    given = [slope, free, opened.reach]
    slope, free, reach = ca.substitute(given, [opened.tau], [ca.DM.zeros(opened.tau.numel())])
    rest = [ca.SX(1) if law.algebraic else ca.fabs(law.w) <= INTEGRATED for law in laws]
    return [slope.T, free, reach, ca.vertcat(*rest)]
