"""Rows, laws and conditions of a steady problem at many points, their derivatives, and the modes that follow from their values."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.equilibrium.balance import Balance
from powertrain.equilibrium.equations import HELD, LEAST, LOWER, NOTHING, UPPER, Equations
from powertrain.modes.contact import CLOSED
from powertrain.modes.friction import BACKWARD, FORWARD, FREE, STUCK
from powertrain.modes.tolerances import BALANCED, NO_WIDTH, REST, balance_tolerance
from powertrain.numerics.batch import Columns
from powertrain.numerics.buffers import Array

Mask = NDArray[np.bool_]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class Iterates:
    """Iterates, one per row: grid values, unknowns, modes (of frictions, switches, contacts), torques (minus forces)."""

    grid: Array
    y: Array
    modes: Array
    tau: Array

    @property
    def z(self) -> Array:
        """Unknowns and torques."""
        return np.concatenate([self.y, self.tau], axis=1)

    def some(self, which: Index | Mask) -> Iterates:
        """Some of them."""
        return Iterates(self.grid[which], self.y[which], self.modes[which], self.tau[which])


@dataclass(frozen=True)
class LawValues:
    """Rows, speeds, limits and conditions (point, quantity), and their derivatives by (y, tau) (point, quantity, unknown)."""

    rows: Array
    speed: Array
    lower: Array
    upper: Array
    g: Array
    rows_: Array
    speed_: Array
    lower_: Array
    upper_: Array
    g_: Array

    def some(self, which: Index) -> LawValues:
        """The values of some points."""
        return LawValues(*(getattr(self, f.name)[which] for f in fields(self)))

    def put(self, which: Index, other: LawValues) -> None:
        """Replace the values of some points."""
        for f in fields(self):
            getattr(self, f.name)[which] = getattr(other, f.name)


class SteadyLaws:
    """The laws of one steady problem. Serves one thread."""

    def __init__(self, balance: Balance, compile: bool = False) -> None:
        dae, b = balance.dae, _of_torques(balance)
        self.balance, self.count, self.unknowns = b, b.tau.numel(), b.y.numel()
        self.frictions, switches = len(dae.frictions), len(dae.switches)
        laws = np.arange(self.count)
        self.contact = laws >= self.frictions
        self.may_free = np.array([f.may_free for f in dae.frictions] + [False] * len(dae.contacts), bool)
        self.tied = ~self.may_free & ~self.contact
        # places among all modes: frictions, switches, contacts
        self.law_modes = np.where(self.contact, laws + switches, laws)
        self.tied_modes = self.law_modes[self.tied]
        self.switch_modes = self.frictions + np.arange(switches)
        self.rate_of, self.rates = b.rate_of, np.flatnonzero(b.rate_of >= 0)
        self.equations = Equations(b, compile)
        moved, parts = ca.vertcat(b.y, b.tau), [b.rows, b.speed, b.lower, b.upper, b.conditions]
        parts += [ca.jacobian(e, moved) for e in parts]
        self._shapes = [e.shape for e in parts]
        self._ends = np.cumsum([0, *(e.numel() for e in parts)])
        self._places = np.concatenate([first + _by_rows(e) for first, e in zip(self._ends, parts, strict=False)])
        outputs = [e.nz[k] for e in parts for k in range(e.nnz())]
        scalars = [s for e in (b.grid, b.modes, moved) for s in (ca.vertsplit(e) if e.numel() else [])]
        self._columns = Columns("steady_balance", scalars, b.common, outputs, compile)
        grid, peaks = (ca.vertsplit(e) if e.numel() else [] for e in (b.grid, b.peak))
        self._peaks = Columns("steady_peaks", grid, b.common, peaks, compile)

    def set_common(self, values: Array) -> None:
        """Parameters and inputs that are the same for all points."""
        self._columns.set_common(values)
        self._peaks.set_common(values)
        self.equations.set_common(values)

    def values(self, at: Iterates, lossless: bool = False) -> LawValues:
        """Everything at the points; ``lossless``: torques that depend on others are left out."""
        with np.errstate(all="ignore"):
            found = self._columns(np.hstack([at.grid, at.modes, at.y, at.tau]).T)
        entries = np.zeros((int(self._ends[-1]), len(at.y)))  # points side by side, for speed
        entries[self._places] = found
        cuts = zip(self._shapes, pairwise(self._ends), strict=True)
        parts = [entries[first:last].reshape(*shape, len(at.y)).transpose(2, 0, 1) for shape, (first, last) in cuts]
        value = LawValues(*(column[:, :, 0] for column in parts[:5]), *parts[5:])
        if lossless:
            for each in (value.lower, value.upper, value.lower_, value.upper_):
                each[:, self.tied] = 0.0
        return value

    def kinds(self, at: Iterates, given: Mask, side: Array, lossless: bool = False) -> Array:
        """The equation of each law in its mode, as a number of ``equations``; ``given`` and ``side`` as in ``next_modes``."""
        mode = at.modes[:, self.law_modes]
        mode = np.where(given & (mode == STUCK), side, mode)
        held = np.where(self.contact, mode == 1.0, mode == STUCK) & ~given
        upper = self.contact | (mode == FORWARD) | (mode == FREE)
        follows = np.broadcast_to(self.tied & lossless, mode.shape)
        kinds = [held, follows, given & (mode == STUCK), upper]
        return np.select(kinds, [HELD, NOTHING, LEAST, UPPER], float(LOWER))

    def peaks(self, at: Iterates) -> Array:
        """The ratio of the torque limit while stuck to that while sliding, for each law."""
        return self._peaks(at.grid.T).T

    def zone(self, value: LawValues, at: Iterates) -> Array:
        """Speeds below this count as rest."""
        return REST * (1.0 + _times(np.abs(value.speed_[:, :, : self.unknowns]), np.abs(at.y)))

    def beyond(self, value: LawValues, at: Iterates) -> tuple[Mask, Mask]:
        """Which torques are below and above the limits of a stuck law.

        Within the same uncertainty for all: the laws' own hysteresis follows from their torques in given modes, and these are iterates.
        """
        known = balance_tolerance(np.abs(at.tau).max(axis=1, initial=0.0))[:, None]
        high, low, peak = np.maximum(value.lower, value.upper), np.minimum(value.lower, value.upper), self.peaks(at)
        return at.tau < peak * low - known, at.tau > peak * high + known

    def next_modes(self, at: Iterates, value: LawValues, given: Mask, side: Array, drive: Array | None) -> Array:
        """The modes that follow from the values; equal to those of ``at`` if these hold.

        ``given`` are laws whose motion is given; ``side`` is the side from which their rest is approached.
        A law that slides at zero speed is held by others; it is stuck unless ``drive``, its rate against its own compliance, drives it.
        The rules are those of the laws (``powertrain.modes``) with speeds in place of rates, and with tolerances of an iterate.
        """
        modes, mode = at.modes.copy(), at.modes[:, self.law_modes]
        zone, (below, above) = self.zone(value, at), self.beyond(value, at)
        rests, sign = np.abs(value.speed) <= zone, np.sign(value.speed)
        stuck = np.where(~rests, sign, np.where(above, FORWARD, np.where(below, BACKWARD, STUCK)))
        sliding = np.where(mode * value.speed < -zone, STUCK, mode)
        if drive is not None:
            sliding = np.where(rests & self.may_free & (mode * drive < 0.0), STUCK, sliding)
        new = np.where((mode == FORWARD) | (mode == BACKWARD), sliding, stuck)
        new = np.where(given, np.where(rests, side, sign), new)
        width = np.maximum(value.lower, value.upper) - np.minimum(value.lower, value.upper)
        new = np.where(self.may_free & (width <= NO_WIDTH), FREE, new)
        closed = np.where(mode == CLOSED, ~(above | (value.speed > zone)), value.speed < -zone)
        modes[:, self.law_modes] = np.where(self.contact, closed, new)
        modes[:, self.switch_modes] = self._switches(at, value)
        return modes

    def _switches(self, at: Iterates, value: LawValues) -> Array:
        """The modes of the switches; a condition at zero keeps its side."""
        sizes = np.concatenate([np.abs(at.y), np.abs(at.tau)], axis=1)
        terms, was = REST * (1.0 + _times(np.abs(value.g_), sizes)), at.modes[:, self.switch_modes]
        return np.where((2.0 * was - 1.0) * value.g >= -terms, was, 1.0 - was)

    def balanced(self, at: Iterates, value: LawValues) -> Mask:
        """Whether the rows are zero."""
        sizes = np.concatenate([np.abs(at.y), np.abs(at.tau)], axis=1)
        terms = BALANCED * (1.0 + _times(np.abs(value.rows_), sizes))
        return np.asarray((np.abs(value.rows) <= terms).all(axis=1))


def _of_torques(b: Balance) -> Balance:
    """The same with torques only: minus the forces of contacts."""
    if not b.dae.contacts:
        return b
    sign = ca.DM([1.0] * len(b.dae.frictions) + [-1.0] * len(b.dae.contacts))
    given = [b.rows, b.speed, b.lower, b.upper, b.conditions]
    rows, speed, lower, upper, conditions = ca.substitute(given, [b.tau], [sign * b.tau])
    return replace(b, rows=rows, speed=speed, lower=lower, upper=upper, conditions=conditions)


def _by_rows(expression: ca.SX) -> Index:
    """The positions of its structural entries, counted row by row."""
    pattern = expression.sparsity()
    return np.array(pattern.row(), np.intp) * expression.shape[1] + np.array(pattern.get_col(), np.intp)


def _times(matrices: Array, vectors: Array) -> Array:
    product: Array = np.einsum("pij,pj->pi", matrices, vectors)
    return product
