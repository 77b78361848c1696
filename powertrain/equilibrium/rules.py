"""One pass of the mode rules at the iterates of a steady problem: those of the laws, for the columns of many points."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import reduce

import casadi as ca
import numpy as np

from powertrain.compiler.hybrid import Contact, Friction
from powertrain.equilibrium.balance import Balance
from powertrain.equilibrium.points import Index, Iterates, Mask
from powertrain.language.symbols import Symbol
from powertrain.modes import contact, friction, switch
from powertrain.modes.friction import BACKWARD, FORWARD
from powertrain.modes.tolerances import BALANCED, NO_WIDTH, REST, balance_tolerance
from powertrain.numerics.batch import Columns
from powertrain.numerics.buffers import Array


@dataclass(frozen=True)
class NextModes:
    """What follows at iterates: the modes, equal to those of the iterates if these hold, and whether all equations are zero.

    ``still``: laws whose speed is zero; ``open``: laws whose limits differ. One row per point.
    """

    modes: Array
    balanced: Mask
    still: Mask
    open: Mask

    def put(self, which: Index, other: NextModes) -> None:
        """Replace some points."""
        for f in fields(self):
            getattr(self, f.name)[which] = getattr(other, f.name)


class SteadyRules:
    """The rules of one steady problem, whose torques all have the same sign. Serves one thread."""

    def __init__(self, balance: Balance, compile: bool) -> None:
        b = balance
        self._count, self._modes = b.tau.numel(), b.modes.numel()
        given, side, drive = (ca.SX.sym(name, self._count) for name in ("given", "side", "drive"))
        lossless, z = ca.SX.sym("lossless"), ca.vertcat(b.y, b.tau)
        zones = rest_zones(b)
        laws = zip(_laws(b, lossless), zones, *map(_each, (drive, side, given)), strict=True)
        others = [_next_mode(b, k, law, lossless, *values) for k, (law, *values) in enumerate(laws)]
        modes = others[: len(b.dae.frictions)]
        turning = zip(_each(b.conditions), _terms(b.conditions, z), strict=True)
        first = len(modes)
        for mode, (g, terms) in zip(_each(b.modes)[first:], turning, strict=False):
            modes.append(switch.next_steady_mode(mode, g, REST * (1 + terms)))
        balanced = [ca.fabs(r) <= BALANCED * (1 + t) for r, t in zip(_each(b.rows), _terms(b.rows, z), strict=True)]
        still = [ca.fabs(w) <= zone for w, zone in zip(_each(b.speed), zones, strict=True)]
        wide = [high - low > NO_WIDTH for low, high in zip(_each(b.lower), _each(b.upper), strict=True)]
        outputs = [*modes, *others[first:], reduce(ca.logic_and, balanced, Symbol(1)), *still, *wide]
        varying = [s for e in (b.grid, b.modes, z, given, side, drive, lossless) for s in _each(e)]
        self._columns = Columns("steady_rules", varying, b.common, outputs, compile)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._columns.set_common(values)

    def __call__(self, at: Iterates, given: Mask, side: Array, drive: Array | None, lossless: bool) -> NextModes:
        """What follows; the arguments are those of ``powertrain.modes.friction.next_steady_mode``, one row per point.

        ``lossless``: torques that depend on others are left out, and these laws move with their speed.
        """
        drive = np.zeros_like(at.tau) if drive is None else drive
        which = np.full((len(at.y), 1), float(lossless))
        with np.errstate(all="ignore"):
            found = self._columns.of_points([at.grid, at.modes, at.y, at.tau, given, side, drive, which])
        flags = (found[self._modes :] != 0.0).T
        return NextModes(
            found[: self._modes].T, flags[:, 0], flags[:, 1 : 1 + self._count], flags[:, 1 + self._count :]
        )


def rest_zones(b: Balance) -> list[Symbol]:
    """Speeds of the laws below these count as rest."""
    return [REST * (1 + terms) for terms in _terms(b.speed, b.y)]


def _laws(b: Balance, lossless: Symbol) -> list[Friction | Contact]:
    """All laws that move, with speed, torque, limits and uncertainty at the iterate.

    The uncertainty is the same for all: the laws' own hysteresis follows from torques in given modes, and these are iterates. An iterate
    may have its limits in the wrong order.
    """
    known = balance_tolerance(reduce(ca.fmax, map(ca.fabs, _each(b.tau)), Symbol(0)))
    found: list[Friction | Contact] = []
    sides = zip(*map(_each, (b.tau, b.speed, b.lower, b.upper, b.peak)), strict=True)
    laws: list[Friction | Contact] = [*b.dae.frictions, *b.dae.contacts]
    for law, (tau, speed, lower, upper, peak) in zip(laws, sides, strict=True):
        low, high = ca.fmin(lower, upper), ca.fmax(lower, upper)
        if isinstance(law, Contact):
            found.append(replace(law, gap=speed, force=peak * high - tau, known=known, rounding=Symbol(0)))
            continue
        if not law.may_free:
            low, high = (ca.if_else(lossless, 0, limit) for limit in (low, high))
        found.append(
            replace(law, w=speed, torque=tau, lower=low, upper=high, peak=peak, known=known, rounding=Symbol(0))
        )
    return found


def _next_mode(
    b: Balance,
    k: int,
    law: Friction | Contact,
    lossless: Symbol,
    zone: Symbol,
    drive: Symbol,
    side: Symbol,
    given: Symbol,
) -> Symbol:
    if isinstance(law, Contact):
        return contact.next_steady_mode(law, b.modes[len(b.dae.switches) + k], zone)
    new = friction.next_steady_mode(law, b.modes[k], zone, drive, side, given)
    return new if law.may_free else ca.if_else(lossless, ca.if_else(law.w < 0, BACKWARD, FORWARD), new)


def _terms(expressions: Symbol, unknowns: Symbol) -> list[Symbol]:
    """For each expression, the size of the terms that the unknowns contribute to it."""
    return _each(ca.densify(ca.fabs(ca.jacobian(expressions, unknowns)) @ ca.fabs(unknowns)))


def _each(values: Symbol) -> list[Symbol]:
    return list(ca.vertsplit(values)) if values.numel() else []
