"""The variational equations over the steps of a run, by Radau IIA with four stages (order 7) on its dense output.

    dS/dt = A S + B,   A = df/ds, B = df/dq   =>   S(end of step) = Phi S(start of step) + Psi

f are the rates of the states, zeros for the discrete variables, and the integrand of the objective as a last row. All steps are solved as
one batch. E. Hairer, G. Wanner: Solving Ordinary Differential Equations II, 1996, IV.8.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.engine.trajectory import Samples
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol
from powertrain.numerics.many import Many
from powertrain.variational.partials import Block, Partials, Slopes, System
from powertrain.variational.record import POINTS, STAGES, Steps

_POWERS = np.arange(STAGES)
RADAU = (POINTS[:, None] ** (_POWERS + 1) / (_POWERS + 1)) @ np.linalg.inv(POINTS[:, None] ** _POWERS)
"""Integrals of the polynomials through the stages, from the start of a step to each of them."""
WEIGHTS = RADAU[-1]
_LONG, _FINE = 1.0, 0.25
"""Products of duration and spectral radius: above the first a step is halved, if its derivatives are constant, down to the second."""
_SAME = 1e-6
"""Relative change of the derivatives over a step up to which they are constant."""
_TO_STAGES = np.linalg.inv(POINTS[:, None] ** _POWERS)
_HALVES = tuple(((begin + POINTS[:, None]) / 2) ** _POWERS @ _TO_STAGES for begin in (0.0, 1.0))
"""The polynomials through the stages of a step, at the stages of its two halves."""
_BATCH = 2000
"""Steps per batch: their matrices fit roughly into the processor's cache."""


@dataclass(frozen=True)
class Batch:
    """Some steps: the effects of their stages at their ends, the derivatives at the stages, and the samples."""

    here: slice
    effects: Block
    slopes: Slopes
    samples: Samples


class VariationalRates:
    """Rates of s and of the objective's integral, with their derivatives. Serves one thread."""

    def __init__(self, system: System, integrand: Symbol | None) -> None:
        self.system, self.integrals, dae = system, int(integrand is not None), system.dae
        self.expressions = rates = dae.xdot if integrand is None else ca.vertcat(dae.xdot, integrand)
        self.size = system.size + self.integrals
        self.places = np.r_[: system.states, system.size : self.size]
        """The rows of f that are not zero."""
        found = ca.which_depends(ca.vertcat(rates, dae.residual), dae.x, 1, False) if dae.x.numel() else []
        self.core = np.flatnonzero(found)
        """The states on which rates depend."""
        self.partials = Partials(system, rates)
        self._values = Many(system.dae.arguments, rates)

    def rates(self, samples: Samples, p: Array) -> Block:
        """The rates alone, one row per sample."""
        f = np.zeros((len(samples.t), self.size))
        f[:, self.places] = self._values(samples, p)
        return f

    def effects(self, durations: Array, a: Block) -> Block:
        """The effect of a rate added at each stage on the end of the step, one matrix per step.

        Stages K = h A (R x I) K + G are solved only for the core c; the other rates p follow from it:
        end_c = h (b x I) K_c and end_p = h b (h A_pc (R x I) K_c + G_p). Rows and columns are those of ``places``.
        """
        count, size, core = len(durations), len(self.places), self.core
        others = np.setdiff1d(np.arange(size), core)
        h, a = durations[:, None, None], a.reshape(count, STAGES, *a.shape[1:])[..., core]
        right = np.zeros((count, STAGES, len(core), size))
        right[:, :, range(len(core)), core] = h * WEIGHTS[:, None]
        driven = (WEIGHTS[:, None] * RADAU).T @ a[:, :, others].reshape(count, STAGES, len(others) * len(core))
        right[..., others] = (h * h * driven).reshape(count, STAGES, len(others), len(core)).transpose(0, 1, 3, 2)
        matrix = collocation(durations, a[:, :, core]).transpose(0, 2, 1)
        solved = np.linalg.solve(matrix, right.reshape(count, STAGES * len(core), size))
        found = np.zeros((count, size, STAGES, size))
        found[..., core] = solved.transpose(0, 2, 1).reshape(count, size, STAGES, len(core))
        found[:, others, :, others] = durations[:, None] * WEIGHTS
        return found.reshape(count, size, STAGES * size)

    def linear(self, steps: Steps, p: Array) -> Iterator[Batch]:
        """The steps in batches, with the derivatives of the rates."""
        for here, samples in batches(steps):
            slopes = self.partials(samples, p)
            durations = steps.durations[here]
            halvings = self.halvings(durations, slopes.s)
            effects = self.effects(durations / 2.0**halvings, slopes.s)
            yield Batch(here, self._joined(effects, halvings, slopes.s), slopes, samples)

    def halvings(self, durations: Array, a: Block) -> NDArray[np.int64]:
        """How often each step is halved for its transition: a run at rest takes steps of any length, which leave out its vibrations.

        The spectral radius is at most ||A^8||^(1/8). Steps over which A changes are as long as the motion allows.
        """
        a = a.reshape(len(durations), STAGES, *a.shape[1:])[..., self.core]
        rows = np.abs(a).max(axis=(1, 3), initial=0.0)
        constant = (np.ptp(a, axis=1).max(axis=2, initial=0.0) <= _SAME * rows).all(axis=1)
        power = a[constant, 0][:, self.core]
        size = np.abs(power).max(axis=(1, 2), initial=1e-300)
        power /= size[:, None, None]
        for _ in range(3):
            power = power @ power
        radius = np.zeros(len(durations))
        radius[constant] = size * np.linalg.norm(power, axis=(1, 2)) ** (1 / 8)
        turned = np.where(radius * durations > _LONG, radius * durations, _FINE)
        return np.asarray(np.ceil(np.log2(turned / _FINE)), int)

    def _joined(self, effects: Block, halvings: NDArray[np.int64], a: Block) -> Block:
        """The effects over whole steps from those over halves of halves, by the polynomials through the stages."""
        size = effects.shape[1]
        effects = effects.reshape(len(effects), size, STAGES, size)
        for k in range(halvings.max(initial=0)):
            here = np.flatnonzero(halvings > k)
            half = effects[here]
            first, second = (np.einsum("ksjr,ji->ksir", half, share) for share in _HALVES)
            slopes = np.zeros((len(here), size, size))
            slopes[..., self.core] = a.reshape(len(effects), STAGES, size, -1)[here].mean(axis=1)[..., self.core]
            phi = np.eye(size) + half.sum(axis=2) @ slopes
            effects[here] = np.einsum("kst,ktir->ksir", phi, first) + second
        return effects.reshape(len(effects), size, STAGES * size)


def batches(steps: Steps) -> Iterator[tuple[slice, Samples]]:
    """The steps in batches, with the samples of their collocation points."""
    for first in range(0, len(steps.times), _BATCH):
        here = slice(first, min(first + _BATCH, len(steps.times)))
        yield here, Samples(*(v[STAGES * here.start : STAGES * here.stop] for v in steps.samples))


def integral(steps: Steps, rates: Array) -> float:
    """The integral of a rate, given at the collocation points of all steps, over these steps."""
    return float((rates.reshape(-1, STAGES) @ WEIGHTS) @ steps.durations)


def collocation(durations: Array, a: Block) -> Block:
    """The matrix I - h A (RADAU x I) of the stages of every step; ``a``: (step, stage, row, column)."""
    count, _, size, _ = a.shape
    matrix = (-durations[:, None, None, None, None] * RADAU[:, None, :, None]) * a[:, :, :, None, :]
    matrix = matrix.reshape(count, STAGES * size, STAGES * size)
    matrix[:, range(STAGES * size), range(STAGES * size)] += 1.0
    return np.asarray(matrix)


def transitions(flow: VariationalRates, steps: Steps, linear: Iterable[Batch]) -> tuple[Block, Block]:
    """Phi and Psi of every step, from the linear equations of all batches."""
    count, size = len(steps.times), flow.size
    phi, psi = np.empty((count, size, size)), np.zeros((count, size, flow.system.free.numel()))
    phi[:] = np.eye(size)
    for batch in linear:
        by_s, by_q = (v.reshape(*batch.effects.shape[::2], v.shape[2]) for v in (batch.slopes.s, batch.slopes.q))
        phi[batch.here, flow.places, : flow.system.size] += batch.effects @ by_s
        psi[batch.here, flow.places] = batch.effects @ by_q
    return phi, psi


def stage_tangents(flow: VariationalRates, durations: Array, slopes: Slopes, s: Block, q: Block) -> Block:
    """The derivatives of s at the stages of steps, from those at their starts and those of q.

    Stages K = A (S + h (R x I) K) + B Q are solved for the core; rates do not depend on the other states, which stay as at the start.
    """
    count, size, core = len(durations), flow.system.size, flow.core
    a = slopes.s.reshape(count, STAGES, *slopes.s.shape[1:])[:, :, core]
    direct = (slopes.q @ q).reshape(count, STAGES, slopes.q.shape[1], s.shape[2])[:, :, core]
    right = a @ s[:, None, :size] + direct
    flat = right.reshape(count, STAGES * len(core), s.shape[2])
    k = np.linalg.solve(collocation(durations, a[..., core]), flat).reshape(right.shape)
    found = s[:, None, :size].repeat(STAGES, axis=1)
    found[:, :, core] += durations[:, None, None, None] * np.einsum("ij,kjcn->kicn", RADAU, k)
    return found.reshape(count * STAGES, *found.shape[2:])


class Reverse:
    """w^T df/dq for all parameters and segments at the cost of a few evaluations of f. Serves one thread."""

    def __init__(self, flow: VariationalRates) -> None:
        self.system, dae = flow.system, flow.system.dae
        rows = ca.vertcat(flow.expressions, dae.residual)
        seed = Symbol.sym("seed", rows.numel())
        product = ca.jtimes(rows, self.system.free, seed, True)
        inputs = (dae.t, dae.x, dae.z, ca.vertcat(dae.m, seed), dae.p)
        self.columns = Many(inputs, ca.densify(product))

    def __call__(self, samples: Samples, p: Array, seeds: Block, slopes: Slopes) -> Block:
        """One row per sample; ``seeds`` belong to the rows of f that are not zero."""
        residual = -np.einsum("kez,ke->kz", slopes.weights, seeds)
        return self.columns(self.system.with_seeds(samples, seeds, residual), p)
