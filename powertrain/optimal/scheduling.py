"""Decisions for demands that are known in advance: dynamic programming, and equivalent consumption minimisation (ECMS).

A store with the state s is charged and discharged while fuel is consumed. In interval k, of duration h_k, the mode i (engine off or on, a
gear) and one of its controls c are chosen:

    s_{k+1} = s_k + h_k rate_k(i, c, s_k),   cost = sum of h_k cost_k(i, c, s_k) + switching(i_{k-1}, i_k) + price max(end - s_N, 0)

Charge beyond the store's last state is lost. Dynamic programming solves the problem backward over a grid of states (R. Bellman,
Dynamic Programming, Princeton 1957). In each interval the grid begins at the lowest state from which the store does not run empty later:
next to that boundary interpolation with an infinite cost would be useless, and more so with every interval
(O. Sundstroem, D. Ambuehl, L. Guzzella, Oil Gas Sci. Technol. 65 (2010) 91-102). ECMS minimises cost - price rate at every instant,
with a single price for which the store ends at the required state: the minimum principle of Pontryagin for a store whose rate does not
depend on its state (L. Serrao, S. Onori, G. Rizzoni, ASME J. Dyn. Sys. Meas. Control 133 (2011) 031012).
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.errors import ParameterError
from powertrain.language.arguments import count, number, row
from powertrain.language.reals import Array
from powertrain.optimal.stages import IMPOSSIBLE, NEVER, Stages, weights

Indices = NDArray[np.intp]
_DOUBLINGS, _PRECISION = 40, 1e-7
"""Largest number of doublings of the price, and the relative precision with which it is then found."""
_EDGE = 1e-9
"""Share of the range of states by which round-off may leave it."""


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
        The states at which the cost to go is computed: values, whose first and last are the limits of the store; or their number between
        the first and last of ``stages.states``, to which ``end`` is added. What a full store cannot take is lost.
    mode
        The mode before the start.

    Returns
    -------
    Schedule
        Computed forward from ``start`` with the cost to go; states are not rounded to the grid.

    Raises
    ------
    ParameterError
        If the start lies outside the grid, if the store runs empty on the way, if the course comes to a state in which no decision is
        possible, for a grid that is too coarse or wider than ``stages.states``, and for an unknown mode.

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
    first, target, worth = number("start", start), number("end", end), number("price", price)
    nodes = _grid(stages, grid, target)
    _within(first, "grid", (nodes[0], nodes[-1]))
    _checked_mode(stages, mode)
    policy = _CostToGo(stages, *_backward(stages, nodes, worth * np.maximum(target - nodes, 0.0)))
    found = _follow(stages, policy, first, mode, nodes[-1])
    _must_be_possible(stages, found)
    k = _empties(found.states, nodes[0])
    if k is not None:
        raise ParameterError(
            f"no decisions keep the state above {nodes[0]:g}: in interval {k}, from {stages.durations[:k].sum():g} s on, it falls to "
            f"{found.states[k + 1]:.4g}"
        )
    before = [mode, *found.modes]
    for k, state in enumerate(found.states[:-1]):
        if policy.whole(k, state, before[k]).min() >= IMPOSSIBLE:
            raise ParameterError(
                f"the grid is too coarse: in interval {k}, from {stages.durations[:k].sum():g} s on, every decision at the state "
                f"{state:.4g} leads between states of the grid from one of which the demands cannot be met"
            )
    return found


def _grid(stages: Stages, grid: int | ArrayLike, end: float) -> Array:
    """The states at which the cost to go is computed."""
    low, high = stages.limits
    if isinstance(grid, int | np.integer):
        if stages.states.size == 1:
            raise ParameterError(f"grid = {grid}: the stages have a single state, so give the states of the grid")
        nodes = np.linspace(low, high, count("grid", int(grid)))
        nodes = np.union1d(nodes, [end]) if low < end < high else nodes
    else:
        nodes = row("grid", grid)
    if nodes.size < 2 or (np.diff(nodes) <= 0).any():
        raise ParameterError(f"grid = {nodes.tolist()} must be at least two ascending values of the state")
    if nodes[0] < low or nodes[-1] > high:
        raise ParameterError(
            f"grid: from {nodes[0]:g} to {nodes[-1]:g} is more than the states of the stages, {low:g} to {high:g}"
        )
    return nodes


def _within(start: float, what: str, limits: tuple[float, float]) -> None:
    """ParameterError for a start outside the limits of the store."""
    if not limits[0] <= start <= limits[1]:
        raise ParameterError(f"start = {start:g} lies outside the {what} [{limits[0]:g}, {limits[1]:g}]")


def _empties(states: Array, low: float) -> int | None:
    """The first interval at whose end a store is below its lowest state."""
    below = np.flatnonzero(states[1:] < low - _EDGE * (1 + abs(low)))
    return int(below[0]) if below.size else None


def _checked_mode(stages: Stages, mode: object) -> None:
    """ParameterError for a mode before the start that the stages do not have."""
    modes = len(stages.switches)
    whole = isinstance(mode, Integral) and not isinstance(mode, bool)
    if not whole or mode not in range(modes):
        raise ParameterError(f"mode = {mode!r} must be a whole number from 0 to {modes - 1}")


def _must_be_possible(stages: Stages, found: Schedule) -> None:
    """ParameterError if a schedule comes to a state in which nothing is possible."""
    for k, (i, c) in enumerate(zip(found.modes, found.controls, strict=True)):
        if stages.at(k, found.states[k])[0][i, c] >= IMPOSSIBLE:
            raise ParameterError(
                f"in interval {k}, from {stages.durations[:k].sum():g} s on, no decision is possible at the state {found.states[k]:.4g}"
            )


def _backward(stages: Stages, nodes: Array, final: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The grid (instant, node), and the cost to go (instant, previous mode, node), at the end independent of the mode.

    Nodes below the lowest state from which the store does not run empty are moved there.
    """
    n, modes = stages.cost.shape[:2]
    grid, found = np.empty((n + 1, nodes.size)), np.empty((n + 1, modes, nodes.size))
    grid[n], found[n] = nodes, final
    for k in range(n - 1, -1, -1):
        least = _least_state(stages, k, grid[k + 1, 0])
        grid[k] = np.clip(nodes, least, nodes[-1])
        to_grid = weights(stages.states, grid[k])
        cost, rate = stages.cost[k] @ to_grid, stages.rate[k] @ to_grid
        after = np.minimum(grid[k] + stages.durations[k] * rate, nodes[-1])
        whole = stages.durations[k] * cost + _at(grid[k + 1], found[k + 1], after)
        best = np.minimum(whole.min(axis=1), NEVER) if least <= nodes[-1] else np.full((modes, nodes.size), NEVER)
        found[k] = np.minimum((best[None] + stages.switches[:, :, None]).min(axis=1), NEVER)
    return grid, found


def _least_state(stages: Stages, k: int, after: float) -> float:
    """The lowest state from which a decision in interval ``k`` leads to ``after`` or above; infinite if there is none.

    Where a decision leads is a linear function between two states at both of which it is possible.
    """
    states, possible = stages.states, stages.cost[k] < IMPOSSIBLE
    leads = np.where(possible, states + stages.durations[k] * stages.rate[k], -NEVER)
    if states.size == 1:
        return float(after - (leads.max() - states[0]))
    low, high = leads[..., :-1], leads[..., 1:]
    found = np.where(leads >= after, states, np.inf)
    rises = (low > -NEVER) & (low < after) & (high >= after)
    part = np.divide(after - low, high - low, out=np.zeros_like(low), where=rises)
    found[..., :-1] = np.where(rises, states[:-1] + part * np.diff(states), found[..., :-1])
    return float(found.min())


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
        That of the lowest price for which the final state is at or above ``end``; decisions are discrete, so ``end`` may not be
        reached exactly. The price is not negative. What a store at the last of ``stages.states`` cannot take is lost.

    Raises
    ------
    ParameterError
        If no price brings the store to ``end``, if it runs empty on the way, if the course comes to a state in which no decision is
        possible, for a start outside ``stages.states`` and for an unknown mode.
    """
    dwell = number("dwell", dwell, "s")
    if dwell <= 0.0:
        raise ParameterError(f"dwell = {dwell:g} s must be positive")
    first, target, (least, most) = number("start", start), number("end", end), stages.limits
    _within(first, "states", stages.limits)
    _checked_mode(stages, mode)

    def followed(worth: float) -> Schedule:
        return _follow(stages, _Price(stages, worth, dwell), first, mode, most)

    def ends(found: Schedule) -> bool:
        return bool(found.states[-1] >= target) and found.cost < IMPOSSIBLE and _empties(found.states, least) is None

    free = followed(0.0)
    if ends(free):
        return free
    possible = stages.cost < IMPOSSIBLE
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
    grid: NDArray[np.float64]
    to_go: NDArray[np.float64]

    def whole(self, k: int, state: float, mode: int) -> NDArray[np.float64]:
        """The cost of every decision (mode, control) and of all that follow it."""
        h, here = self.stages.durations[k], float(np.clip(state, self.grid[-1, 0], self.grid[-1, -1]))
        cost, rate = self.stages.at(k, here)
        after = np.minimum(here + h * rate, self.grid[-1, -1])
        later = _at(self.grid[k + 1], self.to_go[k + 1], after[:, :, None])[:, :, 0]
        return np.asarray(h * cost + self.stages.switches[mode][:, None] + later)

    def decide(self, k: int, state: float, mode: int) -> tuple[int, int]:
        here = float(np.clip(state, self.grid[-1, 0], self.grid[-1, -1]))
        return _least(self.whole(k, state, mode), *self.stages.at(k, here))

    def price(self, k: int, state: float, mode: int) -> float:
        nodes, costs = self.grid[k], self.to_go[k, mode]
        known = (costs < IMPOSSIBLE) & (np.diff(nodes, append=np.inf) > 0)
        if known.sum() < 2:
            return np.inf
        return -float(np.interp(state, nodes[known], np.gradient(costs[known], nodes[known])))


@dataclass(frozen=True)
class _Price:
    """Decides by the least equivalent cost of the present instant."""

    stages: Stages
    worth: float
    dwell: float

    def decide(self, k: int, state: float, mode: int) -> tuple[int, int]:
        (cost, rate), h, (low, high) = self.stages.at(k, state), self.stages.durations[k], self.stages.limits
        after = state + h * rate
        gained = (np.minimum(after, high) - state) / h
        whole = cost - self.worth * gained + self.stages.switches[mode][:, None] / self.dwell
        return _least(np.where(after >= low, whole, NEVER), cost, rate)

    def price(self, k: int, state: float, mode: int) -> float:
        return self.worth


def _least(whole: NDArray[np.float64], cost: NDArray[np.float64], rate: NDArray[np.float64]) -> tuple[int, int]:
    """The decision of least cost; if none is possible, the one that charges most."""
    if whole.min() >= IMPOSSIBLE:
        whole = np.where(cost < IMPOSSIBLE, -rate, np.inf)
    i, c = np.unravel_index(int(whole.argmin()), whole.shape)
    return int(i), int(c)


def _follow(stages: Stages, policy: Policy, start: float, mode: int, most: float) -> Schedule:
    """The schedule that follows from a policy, for a store that holds no more than ``most``."""
    n = len(stages.durations)
    modes, controls, states, price = np.empty(n, np.intp), np.empty(n, np.intp), np.full(n + 1, start), np.empty(n)
    total = 0.0
    for k, h in enumerate(stages.durations):
        cost, rate = stages.at(k, states[k])
        price[k] = policy.price(k, states[k], mode)
        i, c = policy.decide(k, states[k], mode)
        total += float(h * cost[i, c] + stages.switches[mode, i])
        modes[k], controls[k], states[k + 1], mode = i, c, min(states[k] + h * rate[i, c], most), i
    return Schedule(modes, controls, states, total, price, policy)


def _at(nodes: Array, values: NDArray[np.float64], where: NDArray[np.float64]) -> NDArray[np.float64]:
    """The cost to go (mode, node) at states (mode, control, state) up to the last node; infinite below the first."""
    at = np.clip(where, nodes[0], nodes[-1])
    i = np.clip(nodes.searchsorted(at, side="right") - 1, 0, nodes.size - 2)
    width = nodes[i + 1] - nodes[i]
    part = np.divide(at - nodes[i], width, out=np.zeros_like(at), where=width > 0)
    rows = np.arange(values.shape[0]).reshape(-1, 1, 1)
    found = (1 - part) * values[rows, i] + part * values[rows, i + 1]
    return np.asarray(np.where(where < nodes[0] - _EDGE * (1 + abs(nodes[0])), NEVER, np.minimum(found, NEVER)))
