"""The decisions over known demands: what each costs in every interval, and how it changes the state of a store."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError
from powertrain.language.arguments import array, row
from powertrain.language.reals import Array

NEVER = 1e30
"""Represents an infinite cost: interpolation would turn infinity into nan."""
IMPOSSIBLE = 1e20
"""Interpolated costs above this belong to impossible decisions."""


@dataclass(frozen=True)
class Stages:
    """Cost and effect of every decision in every interval.

    Parameters
    ----------
    durations
        Durations of the N intervals [s].
    states
        Ascending states s at which rate and cost are given; they are interpolated linearly. One is enough if they do not depend on s.
    cost, rate
        Cost per second and change of the state per second, of shape (N, modes, controls, states). nan marks impossible decisions.
    switching
        Cost of changing from one mode (row) to another (column), of shape (modes, modes); zeros by default.

    Raises
    ------
    ParameterError
        For shapes that do not match, durations that are not positive, and an interval in which nothing is possible.
    """

    durations: Array
    states: Array
    cost: NDArray[np.float64]
    rate: NDArray[np.float64]
    switching: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        durations, states = row("durations", self.durations), row("states", self.states)
        cost, rate = (array(n, getattr(self, n), finite=False) for n in ("cost", "rate"))
        if (
            cost.ndim != 4
            or cost.shape != rate.shape
            or (cost.shape[0], cost.shape[3]) != (durations.size, states.size)
        ):
            raise ParameterError(
                f"stages: cost {cost.shape} and rate {rate.shape} must have the shape (intervals, modes, controls, states) with "
                f"{durations.size} durations and {states.size} states"
            )
        if not (durations > 0).all() or (np.diff(states) <= 0).any():
            raise ParameterError("stages: durations (s) must be positive, and states must ascend")
        possible = np.isfinite(cost) & np.isfinite(rate)
        none = np.flatnonzero(~possible.any(axis=(1, 2, 3)))
        if none.size:
            start = durations[: none[0]].sum()
            raise ParameterError(
                f"stages: nothing is possible in interval {none[0]}, from {start:g} s on: no decision has a finite cost"
            )
        modes = cost.shape[1]
        switching = np.zeros((modes, modes)) if self.switching is None else array("switching", self.switching)
        if switching.shape != (modes, modes):
            raise ParameterError(f"stages: switching {switching.shape} must be of shape ({modes}, {modes})")
        for name, value in (("durations", durations), ("states", states), ("switching", switching)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "cost", np.where(possible, cost, NEVER))
        object.__setattr__(self, "rate", np.where(possible, rate, 0.0))

    @property
    def switches(self) -> NDArray[np.float64]:
        """``switching`` as an array."""
        assert self.switching is not None
        return self.switching

    def at(self, k: int, state: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Cost and rate of every decision (mode, control) in interval ``k`` at a state."""
        to_state = weights(self.states, np.array([state]))
        return (self.cost[k] @ to_state)[:, :, 0], (self.rate[k] @ to_state)[:, :, 0]

    @property
    def limits(self) -> tuple[float, float]:
        """The lowest and the highest state of the store; infinite if rates and costs do not depend on it."""
        return (float(self.states[0]), float(self.states[-1])) if self.states.size > 1 else (-np.inf, np.inf)


def weights(states: Array, nodes: Array) -> NDArray[np.float64]:
    """Linear interpolation from ``states`` to ``nodes`` as a matrix; constant outside."""
    found = np.zeros((states.size, nodes.size))
    if states.size == 1:
        return found + 1.0
    at = np.clip(nodes, states[0], states[-1])
    i = np.clip(states.searchsorted(at, side="right") - 1, 0, states.size - 2)
    part = (at - states[i]) / (states[i + 1] - states[i])
    columns = np.arange(nodes.size)
    found[i, columns], found[i + 1, columns] = 1 - part, part
    return found
