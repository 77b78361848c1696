"""Second derivatives of expressions of a model along tangents, with the algebraic unknowns eliminated.

    e = e(t, s, z, q),   0 = g(t, s, z, q),   L = w^T e - (w^T e_z g_z^-1) g   =>   (w^T e)''[V, V] = V^T L'' V

V are tangents of (t, s, q, z). Those of z follow from the others, z' = -g_z^-1 (g_t t' + g_s s' + g_q q'). L'' V is a forward derivative
of a reverse derivative, so it costs a few evaluations of e per tangent, whatever the size of the model.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol
from powertrain.numerics.many import Many
from powertrain.variational.partials import Block, System


@dataclass(frozen=True)
class Tangents:
    """dt, ds and dq for changes of the unknowns, one matrix per sample and one column per unknown; dt has one row."""

    t: Block
    s: Block
    q: Block

    @property
    def together(self) -> Block:
        """The tangents of (t, s, q), stacked."""
        return np.concatenate([self.t, self.s, self.q], axis=1)


def tangents(s: NDArray[np.float64], q: NDArray[np.float64], t: Array | None = None) -> Tangents:
    """The tangents of one sample; without ``t`` at a fixed time."""
    return Tangents(np.zeros((1, 1, s.shape[1])) if t is None else t[None, None], s[None], q[None])


class Curvature:
    """The second derivatives of a column of expressions. Serves one thread."""

    def __init__(self, system: System, expressions: Symbol) -> None:
        self.system, dae = system, system.dae
        self.explicit, self.implicit = expressions.numel(), dae.z.numel()
        outer = ca.vertcat(dae.t, system.moving, system.free)
        every, rows = ca.vertcat(outer, dae.z), ca.vertcat(expressions, dae.residual)
        seed, direction = Symbol.sym("seed", rows.numel()), Symbol.sym("direction", every.numel())
        slope = ca.jtimes(rows, every, seed, True)
        along = ca.jtimes(slope, every, direction)
        inputs = (dae.t, dae.x, dae.z, ca.vertcat(dae.m, seed, direction), dae.p)
        self._along = Many(inputs, ca.densify(along))
        own = seed[: self.explicit, 0]
        parts = [ca.jtimes(expressions, dae.z, own, True), ca.jacobian(dae.residual, every)] if self.implicit else []
        inputs = (dae.t, dae.x, dae.z, ca.vertcat(dae.m, own), dae.p)
        self._equations = Many(inputs, ca.vertcat(*(ca.vec(ca.densify(part)) for part in parts)))

    def __call__(self, samples: Samples, p: Array, seeds: Block, along: Tangents) -> NDArray[np.float64]:
        """The sum over all samples of (w^T e)''[V, V], with ``seeds`` as w of each sample."""
        v = along.together
        count = v.shape[2]
        found = np.zeros((count, count))
        if not seeds.any():
            return found
        if self.implicit:
            seeds, v = self._eliminated(samples, p, seeds, v)
        for j in range(count):
            slopes = self._along(self.system.with_seeds(samples, seeds, v[:, :, j]), p)
            found[:, j] = np.einsum("kvi,kv->i", v, slopes)
        return found

    def _eliminated(self, samples: Samples, p: Array, seeds: Block, v: Block) -> tuple[Block, Block]:
        """The weights extended to the model's equations, and the tangents extended to z."""
        nz, count = self.implicit, len(samples.t)
        flat = self._equations(self.system.with_seeds(samples, seeds), p)
        e_z, g = flat[:, :nz, None], flat[:, nz:].reshape(count, -1, nz).transpose(0, 2, 1)
        g_v, g_z = g[:, :, :-nz], g[:, :, -nz:]
        multipliers: Block = np.asarray(-np.linalg.solve(g_z.transpose(0, 2, 1), e_z)[:, :, 0], float)
        z: Block = np.asarray(-np.linalg.solve(g_z, g_v @ v), float)
        return np.concatenate([seeds, multipliers], axis=1), np.concatenate([v, z], axis=1)
