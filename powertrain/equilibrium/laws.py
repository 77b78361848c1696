"""The laws of a steady problem at iterates of many points: their equations in given modes, and the modes that follow.

    f(y, tau) - (y - y')/h = 0                  rows; the last term only for rates
    w(y, tau) - yields (tau - tau') = 0         stuck laws: at rest, except for their compliance
    tau - U(y, tau) = 0, tau - L(y, tau) = 0    laws at a limit

y' and tau' are the values before the step. The last terms enter only the matrix, and hold motions that nothing else holds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property, reduce

import casadi as ca
import numpy as np

from powertrain.dae import contact, friction, switch
from powertrain.dae.contact import CLOSED
from powertrain.dae.friction import BACKWARD, FORWARD, FREE, STUCK
from powertrain.dae.hybrid import Contact, Friction
from powertrain.dae.tolerances import BALANCED, NO_WIDTH, REST, ROUND_OFF, balance_tolerance
from powertrain.equilibrium.points import AtRest, Index, Iterates, Mask, OfPoints
from powertrain.equilibrium.system import Balance
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, scalars
from powertrain.numerics.batch import Columns, dependence, picked
from powertrain.numerics.buffers import Evaluated
from powertrain.numerics.elimination import Pattern
from powertrain.numerics.newton_abreast import NewtonAbreast
from powertrain.numerics.vectorised import NotWritten

HELD, UPPER, LOWER, LEAST, NOTHING = range(5)
"""The equation of a law: its speed is zero, or its torque equals a limit, the smallest torque between the limits, or zero."""
LAST_STEP = 1e7
"""Step [s] that holds motions that nothing else holds."""


@dataclass(frozen=True)
class Motion:
    """Rows and speeds (point, quantity), and their derivatives by (y, tau) (point, quantity, unknown)."""

    rows: Array
    speed: Array
    rows_: Array
    speed_: Array


@dataclass(frozen=True)
class NextModes(OfPoints):
    """What follows at iterates: the modes, equal to those of the iterates if these hold, and whether all equations are zero.

    ``still``: laws whose speed is zero; ``open``: laws whose limits differ. One row per point.
    """

    modes: Array
    balanced: Mask
    still: Mask
    open: Mask


class SteadyLaws:
    """The laws of one steady problem in z = (y, tau). Serves one thread.

    ``tied`` laws always transmit torque, which grows with other torques. ``driving`` are those whose limits depend on the side that drives,
    with the modes of the switches that tell it. ``rates`` are the rows that are rates, of the unknowns ``rated``. ``holding`` is the mode
    in which each law holds.
    """

    def __init__(self, balance: Balance, compile: bool = False) -> None:
        dae = balance.dae
        self.balance, self.count, self.unknowns = balance, balance.tau.numel(), balance.y.numel()
        self.frictions, switches = len(dae.frictions), len(dae.switches)
        laws = np.arange(self.count)
        self.contact = laws >= self.frictions
        self.holding = np.where(self.contact, CLOSED, STUCK)
        self.may_free = np.array([f.may_free for f in dae.frictions] + [False] * len(dae.contacts), bool)
        self.tied = ~self.may_free & ~self.contact
        # places among all modes: frictions, switches, contacts
        self.law_modes = np.where(self.contact, laws + switches, laws)
        self.tied_modes = self.law_modes[self.tied]
        self.switch_modes = self.frictions + np.arange(switches)
        self.driving = {k: modes for k in np.flatnonzero(self.tied) if (modes := _driving(balance, int(k))).size}
        self.rates = np.flatnonzero(balance.rate_of >= 0)
        self.rated = balance.rate_of[self.rates]
        varying, self.pattern, self._outputs = _equations(balance)
        self._equations = Columns("steady_equations", varying, balance.common, self._outputs, compile)
        self._compile = compile
        self._rules = _rules(balance, compile)
        both = scalars(balance.start) + scalars(balance.initial)
        self._starts = Columns("steady_starts", scalars(balance.grid), balance.common, both)
        needed, z = self._equations.needed, len(varying) - self.unknowns - self.count
        self._fixed, self._moving = needed[needed < z], needed[needed >= z] - z
        self._arguments = [varying[k] for k in self._fixed], varying[z:]

    @cached_property
    def sought(self) -> Index:
        """The unknowns that are inputs or parameters."""
        dae = self.balance.dae
        others = {*dae.state_names, *(s.name() for s in scalars(dae.z))}
        return np.flatnonzero([name not in others for name in self.balance.names])

    def starts(self, grid: Array) -> tuple[Array, Array]:
        """The unknowns (point, unknown) as guessed and as at the start of a run; zero where these have no value."""
        with np.errstate(all="ignore"):
            found = self._starts.of_points([grid])
        start, initial = np.split(np.where(np.isfinite(found), found, 0.0), 2)
        return start.T, initial.T

    def fixed(self, at: Iterates, rest: AtRest, lossless: bool = False, step: float | Array = LAST_STEP) -> list[Array]:
        """Everything constant while z changes, for the modes of the points, one row per quantity.

        ``step`` is h, or a column of one for each point. ``lossless``: torques that depend on others are left out.
        """
        mode = at.modes.T[self.law_modes].T
        mode = np.where(rest.given & (mode == STUCK), rest.side, mode)
        held = (mode == self.holding) & ~rest.given
        upper = self.contact | (mode == FORWARD) | (mode == FREE)
        kinds = np.where(upper, float(UPPER), float(LOWER))
        kinds = np.where(rest.given & (mode == STUCK), LEAST, kinds)
        kinds = np.where(self.tied & lossless, NOTHING, kinds)
        return self._constant(at, np.where(held, HELD, kinds), rest.yields, step)

    def _constant(self, at: Iterates, kinds: Array, yields: Array, step: float | Array) -> list[Array]:
        return picked([at.grid, at.modes, kinds, yields, np.full((len(at.y), 1), step)], self._fixed)

    def equations(self, fixed: list[Array], z: Array) -> tuple[Array, Array]:
        """The entries of the matrix of ``pattern``, and the values, one row per point, of ``fixed`` for the same points."""
        with np.errstate(all="ignore"):
            found = self._equations.of_needed([*fixed, *picked([z], self._moving)], len(z))
        size = self.pattern.rows.size
        return found[:size].T, found[size:].T

    @cached_property
    def abreast(self) -> NewtonAbreast | None:
        """Newton's method with full steps as machine code, if this was asked for and is possible."""
        if not self._compile:
            return None
        try:
            common = self.balance.common.symbols
            return NewtonAbreast(*self._arguments, common, self.pattern, self._outputs, self.unknowns)
        except (NotWritten, OSError):
            return None

    def held(self, at: Iterates) -> tuple[Array, Array]:
        """The equations with all laws stuck: entries of the matrix and values, one row per point."""
        kinds, none = np.full_like(at.tau, HELD), np.zeros_like(at.tau)
        return self.equations(self._constant(at, kinds, none, np.inf), at.z)

    def motion_of(self, entries: Array, value: Array) -> Motion:
        """The motion of which these are the equations."""
        n, matrix = self.unknowns, self.pattern.dense(entries)
        return Motion(value[:, :n], value[:, n:], matrix[:, :n], matrix[:, n:])

    def motion(self, at: Iterates) -> Motion:
        """Rows and speeds at the points, and their slopes."""
        return self.motion_of(*self.held(at))

    def next_modes(self, at: Iterates, rest: AtRest, share: Array | None = None, lossless: bool = False) -> NextModes:
        """The modes that follow.

        ``share``: the torques of the laws' compliances, with which laws that others hold at a limit may stick. ``lossless``: torques that
        depend on others are left out, and these laws move with their speed.
        """
        share = at.tau if share is None else share
        which = np.full((len(at.y), 1), float(lossless))
        with np.errstate(all="ignore"):
            found = self._rules.of_points([at.grid, at.modes, at.y, at.tau, rest.given, rest.side, share, which])
        modes = self.balance.modes.numel()
        flags = (found[modes:] != 0.0).T
        return NextModes(found[:modes].T, flags[:, 0], flags[:, 1 : 1 + self.count], flags[:, 1 + self.count :])


def _driving(b: Balance, k: int) -> Index:
    """The modes of the switches in the limits of a law whose conditions are unknown."""
    first, last = len(b.dae.frictions), len(b.dae.frictions) + len(b.dae.switches)
    used = dependence([b.lower[k], b.upper[k]], scalars(b.modes)[first:last]).any(axis=0)
    unknown = dependence(scalars(b.conditions), scalars(ca.vertcat(b.y, b.tau))).any(axis=1)
    return first + np.flatnonzero(used & unknown)


def _equations(b: Balance) -> tuple[list[Symbol], Pattern, list[Symbol]]:
    """Arguments (grid, modes, kinds of the laws, yields, h and z), pattern of the matrix, and its entries followed by the values."""
    count = b.tau.numel()
    kinds, yields, step = Symbol.sym("kinds", count), Symbol.sym("yields", count), Symbol.sym("h")
    z = ca.vertcat(b.y, b.tau)
    matrix, values = ca.jacobian(b.rows, z), [b.rows]
    for i in np.flatnonzero(b.rate_of >= 0).tolist():
        matrix[i, int(b.rate_of[i])] -= 1 / step
    held, low, high = (ca.jacobian(e, z) for e in (b.speed, b.lower, b.upper))
    speeds, y = scalars(b.speed), scalars(b.y)
    moving = [y[j] for j in np.flatnonzero(dependence(speeds, y).any(axis=0))]
    unsure = ROUND_OFF * reduce(ca.fmax, map(ca.fabs, moving), Symbol(1))
    speed = [ca.if_else(ca.fabs(w) <= unsure, 0, w) for w in speeds]  # compliance would make a torque of round-off
    for k in range(count):
        own = ca.SX(ca.DM.triplet([0], [b.y.numel() + k], [1.0], 1, z.numel()))
        options = {HELD: held[k, :] - yields[k] * own, UPPER: own - high[k, :], LOWER: own - low[k, :]}
        matrix = ca.vertcat(matrix, _chosen(kinds[k], options | {LEAST: own, NOTHING: own}))
        smallest = friction.least_torque(ca.fmin(b.lower[k], b.upper[k]), ca.fmax(b.lower[k], b.upper[k]))
        torque = {UPPER: b.tau[k] - b.upper[k], LOWER: b.tau[k] - b.lower[k], LEAST: b.tau[k] - smallest}
        values.append(_chosen(kinds[k], torque | {HELD: speed[k], NOTHING: b.tau[k]}))
    varying = scalars(ca.vertcat(b.grid, b.modes, kinds, yields, step, z))
    outputs = [*(matrix.nz[k] for k in range(matrix.nnz())), *scalars(ca.vertcat(*values))]
    return varying, Pattern(matrix.sparsity()), ca.cse([ca.densify(e) for e in outputs])


def _chosen(kind: Symbol, options: Mapping[int, Symbol]) -> Symbol:
    """The entries of the option with this number; those of other options may have no value."""
    places = sorted({j for e in options.values() for j in e.sparsity().get_col()})
    chosen = ca.SX(1, next(iter(options.values())).shape[1])
    for j in places:
        chosen[j] = sum((ca.if_else(kind == k, e[j], 0) for k, e in options.items()), Symbol(0))
    return chosen


def _rules(b: Balance, compile: bool) -> Columns:
    """The fields of ``NextModes``, in terms of grid, modes, z and the arguments of ``SteadyLaws.next_modes``."""
    given, side, share = (ca.SX.sym(name, b.tau.numel()) for name in ("given", "side", "share"))
    lossless, z = ca.SX.sym("lossless"), ca.vertcat(b.y, b.tau)
    zones, m, first = rest_zones(b), scalars(b.modes), len(b.dae.frictions)
    last = first + len(b.dae.switches)
    laws = zip(_laws(b, share, lossless), [*m[:first], *m[last:]], zones, *map(scalars, (side, given)), strict=True)
    moved = [_next_mode(law, lossless, mode, *values) for law, mode, *values in laws]
    conditions = zip(m[first:last], scalars(b.conditions), _terms(b.conditions, z), strict=True)
    turned = [switch.next_steady_mode(mode, g, REST * (1 + terms)) for mode, g, terms in conditions]
    balanced = [ca.fabs(r) <= BALANCED * (1 + t) for r, t in zip(scalars(b.rows), _terms(b.rows, z), strict=True)]
    still = [ca.fabs(w) <= zone for w, zone in zip(scalars(b.speed), zones, strict=True)]
    wide = [high - low > NO_WIDTH for low, high in zip(scalars(b.lower), scalars(b.upper), strict=True)]
    varying = [s for e in (b.grid, b.modes, z, given, side, share, lossless) for s in scalars(e)]
    outputs = [*moved[:first], *turned, *moved[first:], reduce(ca.logic_and, balanced, Symbol(1)), *still, *wide]
    return Columns("steady_rules", varying, b.common, outputs, compile)


def rest_zones(b: Balance) -> list[Symbol]:
    """Speeds of the laws below these count as rest."""
    return [REST * (1 + terms) for terms in _terms(b.speed, b.y)]


def _terms(expressions: Symbol, unknowns: Symbol) -> list[Symbol]:
    """For each expression, the size of the terms that the unknowns contribute to it."""
    return scalars(ca.fabs(ca.jacobian(expressions, unknowns)) @ ca.fabs(unknowns))


def _laws(b: Balance, share: Symbol, lossless: Symbol) -> list[Friction | Contact]:
    """All laws that move, with speed, torque, share, limits and uncertainty at the iterate.

    The uncertainty is the same for all: the laws' own hysteresis follows from torques in given modes, and these are iterates. An iterate
    may have its limits in the wrong order.
    """
    known = balance_tolerance(reduce(ca.fmax, map(ca.fabs, scalars(b.tau)), Symbol(0)))
    found: list[Friction | Contact] = []
    values = zip(*map(scalars, (b.tau, share, b.speed, b.lower, b.upper, b.peak)), strict=True)
    laws: list[Friction | Contact] = [*b.dae.frictions, *b.dae.contacts]
    for law, (tau, part, speed, lower, upper, peak) in zip(laws, values, strict=True):
        low, high = ca.fmin(lower, upper), ca.fmax(lower, upper)
        if isinstance(law, Contact):
            found.append(replace(law, gap=speed, force=peak * high - tau, known=known, rounding=Symbol(0)))
            continue
        if not law.may_free:
            low, high = (ca.if_else(lossless, 0, limit) for limit in (low, high))
        own = replace(law, w=speed, torque=tau, share=part, known=known, rounding=Symbol(0))
        found.append(replace(own, lower=low, upper=high, peak=peak))
    return found


def _next_mode(
    law: Friction | Contact, lossless: Symbol, mode: Symbol, zone: Symbol, side: Symbol, given: Symbol
) -> Symbol:
    if isinstance(law, Contact):
        return contact.next_steady_mode(law, mode, zone)
    new = friction.next_steady_mode(law, mode, zone, side, given)
    return new if law.may_free else ca.if_else(lossless, ca.if_else(law.w < 0, BACKWARD, FORWARD), new)


@dataclass(frozen=True)
class LawValues(Motion):
    """Also the limits and conditions, with their slopes; speeds below ``zone`` count as rest."""

    zone: Array
    lower: Array
    upper: Array
    g: Array
    lower_: Array
    upper_: Array
    g_: Array

    def first(self) -> LawValues:
        """The values at the first point."""
        return LawValues(*(getattr(self, f.name)[0] for f in fields(self)))


class Linearized:
    """Values and slopes of the laws at one point, for continuation: more than Newton's method for given modes needs. Serves one thread."""

    def __init__(self, laws: SteadyLaws) -> None:
        b, self._tied, self._common = laws.balance, laws.tied, laws.balance.common
        moved, values = ca.vertcat(b.y, b.tau), [b.rows, b.speed, b.lower, b.upper, b.conditions]
        parts = [*values, column(rest_zones(b)), *(ca.jacobian(e, moved) for e in values)]
        given = [b.grid, b.modes, moved, b.common.symbols]
        self._parts = Evaluated(ca.Function("powertrain_linearized", given, ca.cse([ca.densify(e) for e in parts])))

    def __call__(self, at: Iterates, lossless: bool) -> LawValues:
        """Everything at the point; ``lossless``: torques that depend on others are left out."""
        parts = [each[None] for each in self._parts(at.grid[0], at.modes[0], at.z[0], self._common.values)]
        rows, speed, lower, upper, g, zone = (each[:, :, 0] for each in parts[:6])
        rows_, speed_, lower_, upper_, g_ = parts[6:]
        if lossless:
            for each in (lower, upper, lower_, upper_):
                each[:, self._tied] = 0.0
        return LawValues(rows, speed, rows_, speed_, zone, lower, upper, g, lower_, upper_, g_)
