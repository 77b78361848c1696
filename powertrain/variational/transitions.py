"""The variational equations over the steps of a run, by Radau IIA with four stages (order 7) on its dense output.

    dS/dt = A S + B,   A = df/ds, B = df/dq   =>   S(end of step) = Phi S(start of step) + Psi

f are the rates of the states, zeros for the discrete variables, and the integrand of the objective as a last row. All steps are solved as
one batch. E. Hairer, G. Wanner: Solving Ordinary Differential Equations II, 1996, IV.8.
"""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca
import numpy as np

from powertrain.language.symbols import Symbol
from powertrain.numerics.batch import Lanes
from powertrain.numerics.buffers import Array
from powertrain.signals import Samples
from powertrain.variational.partials import Block, Partials, Slopes, System
from powertrain.variational.record import POINTS, STAGES, Steps

_POWERS = np.arange(STAGES)
RADAU = (POINTS[:, None] ** (_POWERS + 1) / (_POWERS + 1)) @ np.linalg.inv(POINTS[:, None] ** _POWERS)
"""Integrals of the polynomials through the stages, from the start of a step to each of them."""
WEIGHTS = RADAU[-1]
_BATCH = 2000
"""Steps of one batch: their matrices stay in the cache of the processor or near it."""


class VariationalRates:
    """Rates of s and of the objective's integral, with their derivatives. Serves one thread."""

    def __init__(self, system: System, integrand: Symbol | None) -> None:
        self.system, self.integrals = system, int(integrand is not None)
        rates = system.dae.xdot if integrand is None else ca.vertcat(system.dae.xdot, integrand)
        self.size = system.size + self.integrals
        self.places = np.r_[: system.states, system.size : self.size]
        """The rows of f that are not zero."""
        self.partials = Partials(system, rates)
        self._values = Lanes(system.inputs, rates)

    def rates(self, samples: Samples, p: Array) -> Block:
        """The rates alone, one row per sample."""
        f = np.zeros((len(samples.t), self.size))
        f[:, self.places] = self._values(samples, p)
        return f

    def __call__(self, samples: Samples, p: Array) -> tuple[Block, Block, Block, Slopes]:
        """f, A and B, one per sample, and the derivatives they are made of."""
        slopes = self.partials(samples, p)
        count, n = len(samples.t), self.system.size
        f, a = np.zeros((count, self.size)), np.zeros((count, self.size, self.size))
        b = np.zeros((count, self.size, slopes.q.shape[2]))
        f[:, self.places], b[:, self.places] = slopes.value, slopes.q
        a[:, self.places, :n] = slopes.s
        return f, a, b, slopes


def batches(steps: Steps) -> Iterator[tuple[slice, Samples]]:
    """The steps in batches, with the samples of their collocation points."""
    for first in range(0, len(steps.times), _BATCH):
        here = slice(first, min(first + _BATCH, len(steps.times)))
        yield here, Samples(*(v[STAGES * here.start : STAGES * here.stop] for v in steps.samples))


def collocation(durations: Array, a: Block) -> Block:
    """The matrix I - h (RADAU x A) of the stages of every step."""
    count, size = len(durations), a.shape[2]
    matrix = -np.einsum("k,ij,kiab->kiajb", durations, RADAU, a.reshape(count, STAGES, size, size))
    matrix = matrix.reshape(count, STAGES * size, STAGES * size)
    matrix[:, range(STAGES * size), range(STAGES * size)] += 1.0
    return np.asarray(matrix)


def effects(durations: Array, a: Block) -> Block:
    """What a rate added at every stage changes at the end of the step: h (b x I) (I - h (RADAU x A))^-1, one matrix per step."""
    size = a.shape[2]
    matrix = collocation(durations, a).transpose(0, 2, 1)
    right = durations[:, None, None] * np.kron(WEIGHTS[:, None], np.eye(size))
    return np.asarray(np.linalg.solve(matrix, right).transpose(0, 2, 1), float)


def transitions(flow: VariationalRates, steps: Steps, p: Array) -> tuple[Block, Block]:
    """Phi and Psi of every step."""
    count, size = len(steps.times), flow.size
    phi, psi = np.empty((count, size, size)), np.empty((count, size, flow.system.free.numel()))
    for here, samples in batches(steps):
        _, a, b, _ = flow(samples, p)
        found = effects(steps.durations[here], a)
        phi[here] = np.eye(size) + found @ a.reshape(len(found), STAGES * size, size)
        psi[here] = found @ b.reshape(len(found), STAGES * size, -1)
    return phi, psi


class Reverse:
    """w^T df/dq for all parameters and segments at the cost of a few evaluations of f. Serves one thread."""

    def __init__(self, system: System, integrand: Symbol | None) -> None:
        dae = system.dae
        rates = dae.xdot if integrand is None else ca.vertcat(dae.xdot, integrand)
        rows = ca.vertcat(rates, dae.residual)
        seed = Symbol.sym("seed", rows.numel())
        product = ca.jtimes(rows, system.free, seed, True)
        inputs = (dae.t, dae.x, dae.z, ca.vertcat(dae.m, seed), dae.p)
        self.lanes = Lanes(inputs, ca.cse(ca.densify(product)))

    def __call__(self, samples: Samples, p: Array, seeds: Block, slopes: Slopes) -> Block:
        """One row per sample; ``seeds`` belong to the rows of f that are not zero."""
        residual = -np.einsum("kez,ke->kz", slopes.weights, seeds)
        m = np.concatenate([samples.m, seeds, residual], axis=1)
        return self.lanes(samples._replace(m=m), p)
