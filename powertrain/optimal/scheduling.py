"""Decisions for demands that are known in advance: dynamic programming, and equivalent consumption minimisation (ECMS).

A store with the state s is charged and discharged while fuel is consumed. In interval k, of duration h_k, the mode i (engine off or on, a
gear) and one of its controls c are chosen:

    s_{k+1} = s_k + h_k rate_k(i, c, s_k),   cost = sum of h_k cost_k(i, c, s_k) + switching(i_{k-1}, i_k) + price max(end - s_N, 0)

Charge beyond the store's last state is lost. Dynamic programming solves the problem backward over a grid of states (R. Bellman,
Dynamic Programming, Princeton 1957). ECMS minimises cost - price rate at every instant, with a single price for which the store ends at
the required state: the minimum principle of Pontryagin for a store whose rate does not depend on its state
(L. Serrao, S. Onori, G. Rizzoni, ASME J. Dyn. Sys. Meas. Control 133 (2011) 031012).
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.errors import ParameterError
from powertrain.language.arguments import count, number, row
from powertrain.numerics.buffers import Array

Indices = NDArray[np.intp]
_NEVER = 1e30
"""Represents an infinite cost: interpolation would turn infinity into nan."""
_IMPOSSIBLE = 1e20
"""Interpolated costs above this belong to impossible decisions."""
_DOUBLINGS, _PRECISION = 40, 1e-7
"""Largest number of doublings of the price, and the relative precision with which it is then found."""


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
        cost, rate = (np.asarray(v, float) for v in (self.cost, self.rate))
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
        switching = np.zeros((modes, modes)) if self.switching is None else np.asarray(self.switching, float)
        if switching.shape != (modes, modes) or not np.isfinite(switching).all():
            raise ParameterError(f"stages: switching {switching.shape} must be finite and of shape ({modes}, {modes})")
        for name, value in (("durations", durations), ("states", states), ("switching", switching)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "cost", np.where(possible, cost, _NEVER))
        object.__setattr__(self, "rate", np.where(possible, rate, 0.0))

    @property
    def switches(self) -> NDArray[np.float64]:
        """``switching`` as an array."""
        assert self.switching is not None
        return self.switching

    def at(self, k: int, state: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Cost and rate of every decision (mode, control) in interval ``k`` at a state."""
        weights = _weights(self.states, np.array([state]))
        return (self.cost[k] @ weights)[:, :, 0], (self.rate[k] @ weights)[:, :, 0]

    def empties(self, states: Array) -> int | None:
        """The first interval at whose end a store is below its lowest state."""
        low = self.states[0] if self.states.size > 1 else -np.inf
        below = np.flatnonzero(states[1:] < low - 1e-9 * (1 + abs(low)))
        return int(below[0]) if below.size else None


class Policy(Protocol):
    """A feedback law that decides in every interval from state and mode, also for a store that deviates from the plan."""

    def decide(self, k: int, state: float, mode: int) -> tuple[int, int]:
        """Mode and control in interval ``k``, for the state and the previous mode."""
        ...

    def price(self, k: int, state: float, mode: int) -> float:
        """The worth of a unit of the state there."""
        ...


@dataclass(frozen=True)
class Schedule:
    """The decisions over the known demands.

    ``modes``, ``controls``: their numbers in every interval; ``states``: at the ends of all intervals; ``cost``: the total, with switching,
    without the price of the final state; ``price``: the worth of a unit of the state in every interval: constant for ECMS, minus the slope
    of the cost to go for dynamic programming; ``policy``: the law behind the decisions, with ``policy.decide(k, state, mode)``.
    """

    modes: Indices
    controls: Indices
    states: Array
    cost: float
    price: Array
    policy: Policy


def dynamic_programming(
    stages: Stages,
    *,
    start: float,
    end: float,
    price: float,
    grid: int | ArrayLike = 101,
    mode: int = 0,
) -> Schedule:
    """The decisions of least cost for demands that are known in advance.

    Parameters
    ----------
    stages
        Costs and rates of all decisions.
    start, end
        State at the start, and the state below which the final state costs ``price`` per unit.
    price
        Choose it well above the worth of a unit during the course, so that the store ends full enough.
    grid
        The states at which the cost to go is computed: values, or their number between the first and last of ``stages.states``.
    mode
        The mode before the start.

    Returns
    -------
    Schedule
        Computed forward from ``start`` with the cost to go; states are not rounded to the grid.

    Raises
    ------
    ParameterError
        If the start or the state leaves the grid, if the course comes to a state in which no decision is possible, and for an unknown mode.

    Examples
    --------
    An engine that is off (the store empties) or on at one of two powers, for four seconds:

    >>> import numpy as np
    >>> import powertrain as pt
    >>> cost = np.array([[0.0, np.nan], [2.0, 5.0]])[None, :, :, None].repeat(4, axis=0)
    >>> rate = np.array([[-1.0, np.nan], [1.0, 2.0]])[None, :, :, None].repeat(4, axis=0)
    >>> stages = pt.Stages(np.ones(4), [0.0, 10.0], cost.repeat(2, axis=3), rate.repeat(2, axis=3))
    >>> plan = pt.dynamic_programming(stages, start=5.0, end=5.0, price=100.0, grid=11)
    >>> plan.cost, float(plan.states[-1])
    (4.0, 5.0)
    """
    nodes = (
        np.linspace(stages.states[0], stages.states[-1], count("grid", grid))
        if isinstance(grid, int)
        else row("grid", grid)
    )
    if nodes.size < 2 or (np.diff(nodes) <= 0).any():
        raise ParameterError(f"grid = {nodes.tolist()} must be at least two ascending values of the state")
    first, target, worth = _start(start, "grid", nodes), number("end", end), number("price", price)
    _checked_mode(stages, mode)
    policy = _CostToGo(stages, nodes, _backward(stages, nodes, worth * np.maximum(target - nodes, 0.0)))
    found = _follow(stages, policy, first, mode)
    _must_be_possible(stages, found)
    k = stages.empties(found.states)
    if k is not None:
        raise ParameterError(
            f"no decisions keep the state above {nodes[0]:g}: in interval {k}, from {stages.durations[:k].sum():g} s on, it falls to "
            f"{found.states[k + 1]:.4g}"
        )
    return found


def _start(start: float, what: str, states: Array) -> float:
    """The state at the start, within the states."""
    first = number("start", start)
    if states.size > 1 and not states[0] <= first <= states[-1]:
        raise ParameterError(f"start = {first:g} lies outside the {what} [{states[0]:g}, {states[-1]:g}]")
    return first


def _checked_mode(stages: Stages, mode: object) -> None:
    """ParameterError for a mode before the start that the stages do not have."""
    modes = len(stages.switches)
    whole = isinstance(mode, Integral) and not isinstance(mode, bool)
    if not whole or mode not in range(modes):
        raise ParameterError(f"mode = {mode!r} must be a whole number from 0 to {modes - 1}")


def _must_be_possible(stages: Stages, found: Schedule) -> None:
    """ParameterError if a schedule comes to a state in which nothing is possible."""
    for k, (i, c) in enumerate(zip(found.modes, found.controls, strict=True)):
        if stages.at(k, found.states[k])[0][i, c] >= _IMPOSSIBLE:
            raise ParameterError(
                f"in interval {k}, from {stages.durations[:k].sum():g} s on, no decision is possible at the state {found.states[k]:.4g}"
            )


def _backward(stages: Stages, nodes: Array, final: Array) -> NDArray[np.float64]:
    """The cost to go (interval, previous mode, state); at the end independent of the mode."""
    n, modes = stages.cost.shape[:2]
    found = np.empty((n + 1, modes, nodes.size))
    found[n] = final
    weights = _weights(stages.states, nodes)
    for k in range(n - 1, -1, -1):
        cost, rate = stages.cost[k] @ weights, stages.rate[k] @ weights
        after = np.minimum(nodes + stages.durations[k] * rate, nodes[-1])
        whole = stages.durations[k] * cost + _at(nodes, found[k + 1], after)
        best = np.minimum(whole.min(axis=1), _NEVER)
        found[k] = np.minimum((best[None] + stages.switches[:, :, None]).min(axis=1), _NEVER)
    return found


def ecms(stages: Stages, *, start: float, end: float, mode: int = 0, dwell: float = 10.0) -> Schedule:
    """The decisions of least equivalent cost at every instant, with the price for which the store ends at ``end``.

    Parameters
    ----------
    stages
        Costs and rates of all decisions.
    start, end
        State at the start and at the end.
    mode
        The mode before the start.
    dwell
        Time [s] over which the cost of a change of mode is spread.

    Returns
    -------
    Schedule
        The schedule with the lowest final state at or above ``end``; decisions are discrete, so ``end`` may not be reached exactly.

    Raises
    ------
    ParameterError
        If no price brings the store to ``end``, if it leaves its range on the way, if the course comes to a state in which no decision is
        possible, for a start outside ``stages.states`` and for an unknown mode.
    """
    if not number("dwell", dwell, "s") > 0:
        raise ParameterError(f"dwell = {dwell:g} s must be positive")
    first, target = _start(start, "states", stages.states), number("end", end)
    _checked_mode(stages, mode)

    def followed(worth: float) -> Schedule:
        return _follow(stages, _Price(stages, worth, dwell), first, mode)

    def ends(found: Schedule) -> bool:
        return bool(found.states[-1] >= target) and found.cost < _IMPOSSIBLE and stages.empties(found.states) is None

    possible = stages.cost < _IMPOSSIBLE
    high = 1e-12 + float(np.abs(stages.cost[possible]).max()) / max(float(np.abs(stages.rate).max()), 1e-300)
    low, best = 0.0, followed(high)
    for _ in range(_DOUBLINGS):
        if ends(best):
            break
        low, high = high, 2.0 * high
        best = followed(high)
    else:
        _must_be_possible(stages, best)
        raise ParameterError(f"ecms: no price brings the store from {start:g} to {end:g}")
    while high - low > _PRECISION * high:
        middle = 0.5 * (low + high)
        tried = followed(middle)
        low, high, best = (low, middle, tried) if ends(tried) else (middle, high, best)
    return best


@dataclass(frozen=True)
class _CostToGo:
    """Decides by the least cost of the interval plus the cost to go."""

    stages: Stages
    nodes: Array
    to_go: NDArray[np.float64]

    def decide(self, k: int, state: float, mode: int) -> tuple[int, int]:
        h, here = self.stages.durations[k], float(np.clip(state, self.nodes[0], self.nodes[-1]))
        cost, rate = self.stages.at(k, here)
        after = np.minimum(here + h * rate, self.nodes[-1])
        later = _at(self.nodes, self.to_go[k + 1], after[:, :, None])[:, :, 0]
        return _least(h * cost + self.stages.switches[mode][:, None] + later, cost, rate)

    def price(self, k: int, state: float, mode: int) -> float:
        return -float(np.interp(state, self.nodes, np.gradient(self.to_go[k, mode], self.nodes)))


@dataclass(frozen=True)
class _Price:
    """Decides by the least equivalent cost of the present instant."""

    stages: Stages
    worth: float
    dwell: float

    def decide(self, k: int, state: float, mode: int) -> tuple[int, int]:
        cost, rate = self.stages.at(k, state)
        low = self.stages.states[0] if self.stages.states.size > 1 else -np.inf
        whole = cost - self.worth * rate + self.stages.switches[mode][:, None] / self.dwell
        return _least(np.where(state + self.stages.durations[k] * rate >= low, whole, _NEVER), cost, rate)

    def price(self, k: int, state: float, mode: int) -> float:
        return self.worth


def _least(whole: NDArray[np.float64], cost: NDArray[np.float64], rate: NDArray[np.float64]) -> tuple[int, int]:
    """The decision of least cost; if none is possible, the one that charges most."""
    if whole.min() >= _IMPOSSIBLE:
        whole = np.where(cost < _IMPOSSIBLE, -rate, np.inf)
    i, c = np.unravel_index(int(whole.argmin()), whole.shape)
    return int(i), int(c)


def _follow(stages: Stages, policy: Policy, start: float, mode: int) -> Schedule:
    """The schedule that follows from a policy."""
    n, most = len(stages.durations), stages.states[-1] if stages.states.size > 1 else np.inf
    modes, controls, states, price = np.empty(n, np.intp), np.empty(n, np.intp), np.full(n + 1, start), np.empty(n)
    total = 0.0
    for k, h in enumerate(stages.durations):
        cost, rate = stages.at(k, states[k])
        price[k] = policy.price(k, states[k], mode)
        i, c = policy.decide(k, states[k], mode)
        total += float(h * cost[i, c] + stages.switches[mode, i])
        modes[k], controls[k], states[k + 1], mode = i, c, min(states[k] + h * rate[i, c], most), i
    return Schedule(modes, controls, states, total, price, policy)


def _weights(states: Array, nodes: Array) -> NDArray[np.float64]:
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


def _at(nodes: Array, values: NDArray[np.float64], where: NDArray[np.float64]) -> NDArray[np.float64]:
    """The cost to go (mode, node) at states (mode, control, state), clipped to the nodes."""
    i = np.clip(nodes.searchsorted(where, side="right") - 1, 0, nodes.size - 2)
    part = (where - nodes[i]) / (nodes[i + 1] - nodes[i])
    rows = np.arange(values.shape[0]).reshape(-1, 1, 1)
    found = (1 - part) * values[rows, i] + part * values[rows, i + 1]
    edge = 1e-9
    return np.asarray(np.where((part < -edge) | (part > 1 + edge), _NEVER, np.minimum(found, _NEVER)))
