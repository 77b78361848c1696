"""Laws at one point, written by hand: rates a - G tau and bounds that are piecewise linear, and brute force over all their modes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import casadi as ca
import numpy as np

from powertrain.dae.hybrid import Contact, Friction, HybridDae, Opened, OperatingPoint, Switch

Matrix = np.ndarray[Any, Any]
NONE = ca.SX(0)
TORQUE, RATE = 1e-6, 1e-14
"""How well brute force in double precision knows torques that laws share, and rates over G_ii: a law creeps by 1e-8 of its torque."""


@dataclass(frozen=True)
class Piecewise:
    """v = a - G tau + R |g|, bounds -/+ (b + B tau + W |g|) about ``middle``, with g = C tau + c; the last ``contacts`` laws are contacts.

    A contact has -inf <= tau <= 0. ``speed``: of laws that are not at rest; an open contact has a speed above zero.
    """

    a: Matrix
    G: Matrix
    b: Matrix
    contacts: int = 0
    speed: Matrix = field(default_factory=lambda: np.zeros(0))
    B: Matrix = field(default_factory=lambda: np.zeros((0, 0)))
    W: Matrix = field(default_factory=lambda: np.zeros((0, 0)))
    C: Matrix = field(default_factory=lambda: np.zeros((0, 0)))
    c: Matrix = field(default_factory=lambda: np.zeros(0))
    R: Matrix = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def n(self) -> int:
        return len(self.a)

    @property
    def frictions(self) -> int:
        return self.n - self.contacts

    def filled(self) -> Piecewise:
        """With zeros for what was not given."""
        n, s = self.n, len(self.c)

        def matrix(value: Matrix, *shape: int) -> Matrix:
            return value if value.size else np.zeros(shape)

        return Piecewise(
            self.a, self.G, self.b, self.contacts, matrix(self.speed, n), matrix(self.B, n, n), matrix(self.W, n, s),
            matrix(self.C, s, n), self.c, matrix(self.R, n, s),
        )  # fmt: skip

    def sign(self) -> Matrix:
        """The unknown of a contact is its force, minus what it transmits."""
        return np.where(np.arange(self.n) < self.frictions, 1.0, -1.0)


def dae_of(given: Piecewise) -> tuple[HybridDae, OperatingPoint]:
    """The model, of which only ``opened`` and the laws' places count, and its point; contacts are closed where they do not move."""
    one = given.filled()
    n, s = one.n, len(one.c)
    t, x, z, p = ca.SX.sym("t"), ca.SX.sym("x", n), ca.SX.sym("z", 0), ca.SX.sym("p", 0)
    m, unknown = ca.SX.sym("m", n + s), ca.SX.sym("tau", n)
    tau = ca.DM(one.sign()) * unknown
    g = ca.DM(one.C) @ tau + ca.DM(one.c) if s else ca.SX(0, 1)
    size = ca.vertcat(ca.SX(0, 1), *(ca.if_else(m[n + k], g[k], -g[k]) for k in range(s)))
    bound = ca.DM(one.b) + ca.DM(one.B) @ tau + (ca.DM(one.W) @ size if s else 0)
    rate = ca.DM(one.a) - ca.DM(one.G) @ tau + (ca.DM(one.R) @ size if s else 0)
    friction = np.arange(n) < one.frictions
    opened = Opened(
        tau=unknown,
        xdot=rate,
        residual=ca.SX(0, 1),
        speed=x,
        rate=rate,
        lower=ca.vertcat(*(-bound[i] if friction[i] else -np.inf for i in range(n))),
        upper=ca.vertcat(*(bound[i] if friction[i] else 0.0 for i in range(n))),
        peak=ca.SX.ones(n),
        reach=ca.SX(np.diag(one.G)),
        compliance=ca.SX(np.diag(one.G)),
        conditions=g,
    )
    dae = HybridDae(
        t, x, z, m, p, rate, ca.SX(0, 1), tuple(f"w{i}" for i in range(n)), np.zeros(n + s),
        frictions=tuple(
            Friction(f"law{i}", "hand", i, x[i], NONE, NONE, NONE, ca.SX(1), NONE, may_free=False) for i in range(one.frictions)
        ),
        contacts=tuple(
            Contact(f"contact{i}", "hand", i, NONE, NONE, NONE, NONE, NONE) for i in range(one.frictions, n)
        ),
        switches=tuple(Switch(f"bend{k}", "hand", n + k, NONE, continuous=True) for k in range(s)),
        opened=opened,
    )  # fmt: skip
    held = np.zeros(n + s)
    held[one.frictions : n] = one.speed[one.frictions :] == 0.0
    return dae, OperatingPoint(0.0, one.speed.copy(), np.zeros(0), held, np.zeros(0))


@dataclass(frozen=True)
class Fit:
    """Modes that are consistent: of every law, then of every bend; the torques; and whether no other modes are nearly so."""

    modes: tuple[float, ...]
    tau: Matrix
    clear: bool


def fits(given: Piecewise, eps: float) -> list[Fit]:
    """Brute force: the linear system of every combination of modes, with the compliance ``eps`` of laws at rest."""
    return [
        fit for fit in (_fit(given.filled(), modes, eps) for modes in _combinations(given.filled())) if fit is not None
    ]


def _combinations(one: Piecewise) -> Iterator[tuple[float, ...]]:
    choices: list[Sequence[float]] = []
    for i in range(one.n):
        if i < one.frictions:
            choices.append((-1.0, 0.0, 1.0) if one.speed[i] == 0.0 else (float(np.sign(one.speed[i])),))
        else:
            choices.append((0.0, 1.0) if one.speed[i] == 0.0 else (0.0,))
    yield from product(*choices, *[(0.0, 1.0)] * len(one.c))


def _fit(one: Piecewise, modes: tuple[float, ...], eps: float) -> Fit | None:
    n = one.n
    D = np.diag(np.where(np.array(modes[n:]) == 1.0, 1.0, -1.0)) if len(one.c) else np.zeros((0, 0))
    # v = v0 + V tau and bound = b0 + S tau in this piece
    V = -one.G - eps * np.diag(np.diag(one.G)) + one.R @ D @ one.C
    v0, S, b0 = one.a + one.R @ D @ one.c, one.B + one.W @ D @ one.C, one.b + one.W @ D @ one.c
    rows, right = np.zeros((n, n)), np.zeros(n)
    for i in range(n):
        held = modes[i] == 0.0 if i < one.frictions else modes[i] == 1.0
        if held:
            rows[i], right[i] = V[i], -v0[i]
            continue
        rows[i, i] = 1.0
        if i < one.frictions:
            rows[i] -= modes[i] * S[i]
            right[i] = modes[i] * b0[i]
    if np.linalg.cond(rows) > 1e15:
        return None
    tau = np.linalg.solve(rows, right)
    v, bound, g = (v0 + V @ tau) / np.diag(one.G), b0 + S @ tau, one.C @ tau + one.c
    torques, rates = [*(D @ g)], []
    for i in range(n):
        if i >= one.frictions:
            torques += [-tau[i]] if modes[i] == 1.0 else []
            rates += [v[i]] if modes[i] == 0.0 and one.speed[i] == 0.0 else []
        elif modes[i] == 0.0:
            torques += [tau[i] + bound[i], bound[i] - tau[i]]
        elif one.speed[i] == 0.0:
            rates.append(modes[i] * v[i])
            torques.append(bound[i])
    size = 1.0 + np.abs(tau).max()
    torque, rate = min(torques, default=np.inf) / size, min(rates, default=np.inf) / size
    consistent = torque >= -TORQUE and rate >= -RATE
    return Fit(modes, tau, torque > 100 * TORQUE and rate > 100 * RATE) if consistent else None


def compared(found: dict[int, float], fit: Fit) -> bool:
    """Whether these are the modes that were found; entries that were not are those of laws that do not move."""
    return all(found.get(i, mode) == mode for i, mode in enumerate(fit.modes))


def finite_slopes(function: Callable[[Matrix], Matrix], tau: Matrix, step: float = 1e-6) -> Matrix:
    """Central differences of a function of the torques, a column each."""
    columns = [(function(tau + step * e) - function(tau - step * e)) / (2 * step) for e in np.eye(len(tau))]
    return np.array(columns).T
