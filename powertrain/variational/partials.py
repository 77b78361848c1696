"""Values and derivatives of expressions of a model along a run, with the algebraic unknowns eliminated.

    e = e(t, s, z, q),   0 = g(t, s, z, q)   =>   de/dv = e_v - e_z g_z^-1 g_v   for v = t, s, q

``s`` = (x, d): the states and the numeric discrete variables; ``q``: the parameters concerned, the current segments
(t0, y0, slope) of the inputs concerned, and the instants at which these segments end.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.dae.hybrid import HybridDae
from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol
from powertrain.numerics.many import Many

Block = NDArray[np.float64]
"""One matrix per sample."""


@dataclass(frozen=True)
class System:
    """A model, the indices of the parameters and of the held entries of inputs to differentiate by, and the number of these inputs."""

    compiled: Compiled
    parameters: tuple[int, ...]
    segments: tuple[int, ...]
    knots: int = 0

    @property
    def dae(self) -> HybridDae:
        """The equations."""
        return self.compiled.dae

    @cached_property
    def discretes(self) -> list[int]:
        """The indices of the discrete variables in ``m``."""
        return list(self.compiled.discretes.values())

    @cached_property
    def states(self) -> int:
        """The number of states."""
        return int(self.dae.x.numel())

    @cached_property
    def size(self) -> int:
        """The size of s."""
        return self.states + len(self.discretes)

    @cached_property
    def free(self) -> Symbol:
        """The symbols of q; the instants of the next knots appear in no expression."""
        p, m = self.dae.p, self.dae.m
        return ca.vertcat(_chosen(p, self.parameters), _chosen(m, self.segments), Symbol.sym("next", self.knots))

    @cached_property
    def moving(self) -> Symbol:
        """The symbols of s."""
        return ca.vertcat(self.dae.x, _chosen(self.dae.m, self.discretes))

    def with_seeds(self, samples: Samples, *seeds: Block) -> Samples:
        """Samples with further columns after the held values. A run without held values has one column of zeros."""
        return samples._replace(m=np.concatenate([samples.m[:, : self.dae.m.numel()], *seeds], axis=1))


def _chosen(symbols: Symbol, places: list[int] | tuple[int, ...]) -> Symbol:
    return symbols[list(places)] if len(places) else Symbol(0, 1)


@dataclass(frozen=True)
class Slopes:
    """Values of expressions and their total derivatives, one row or matrix per sample; ``weights`` is e_z g_z^-1."""

    value: Block
    t: Block
    s: Block
    q: Block
    weights: Block

    def along(self, rates: Block) -> Block:
        """The derivatives with respect to time along a motion ds/dt."""
        return np.asarray(self.t + np.einsum("kes,ks->ke", self.s, rates))


class Partials:
    """Expressions of (t, x, z, m, p) with their derivatives, evaluated for many samples. Serves one thread."""

    def __init__(self, system: System, expressions: Symbol) -> None:
        dae = system.dae
        self.system, self.count = system, expressions.numel()
        self.groups = [dae.t, system.moving, system.free, dae.z]
        self.sizes = [g.numel() for g in self.groups]
        rows = ca.vertcat(expressions, dae.residual) if dae.z.numel() else expressions
        parts = [ca.vec(ca.densify(ca.jacobian(rows, g))) for g in self.groups if g.numel()]
        self.columns = Many(system.dae.arguments, ca.densify(ca.vertcat(expressions, *parts)))
        self.rows = rows.numel()

    def __call__(self, samples: Samples, p: Array) -> Slopes:
        """Values and derivatives at samples whose algebraic unknowns solve the model's equations."""
        count, ne = len(samples.t), self.count
        flat = self.columns(samples, p)
        first, blocks = ne, []
        for size in self.sizes:
            last = first + self.rows * size
            blocks.append(flat[:, first:last].reshape(count, size, self.rows).transpose(0, 2, 1))
            first = last
        e_t, e_s, e_q, e_z = (b[:, :ne] for b in blocks)
        weights: Block = np.zeros((count, ne, 0))
        if self.sizes[3]:
            g_t, g_s, g_q, g_z = (b[:, ne:] for b in blocks)
            weights = np.asarray(
                np.linalg.solve(g_z.transpose(0, 2, 1), e_z.transpose(0, 2, 1)).transpose(0, 2, 1), float
            )
            e_t, e_s, e_q = e_t - weights @ g_t, e_s - weights @ g_s, e_q - weights @ g_q
        return Slopes(flat[:, :ne], e_t[:, :, 0], e_s, e_q, weights)
