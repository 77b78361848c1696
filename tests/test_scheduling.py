"""Dynamic programming and ECMS against enumeration of all decisions, and against the bound that a constant price gives."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.optimal import scheduling
from powertrain.optimal.stages import weights


def random_stages(seed: int, n: int = 5, modes: int = 2, controls: int = 2) -> pt.Stages:
    """Rates are whole numbers, so that the states stay on a grid of whole numbers and interpolation is exact."""
    random = np.random.default_rng(seed)
    rate = random.integers(-2, 3, (n, modes, controls, 1)).astype(float)
    rate[:, 0, 0] = -1.0
    cost = np.where(rate > -1, random.uniform(0.5, 4, rate.shape), random.uniform(0, 0.5, rate.shape))
    cost[random.random(cost.shape) < 0.1] = np.nan
    cost[:, 0, 0] = 0.1
    cost, rate = (v.repeat(2, axis=3) for v in (cost, rate))
    return pt.Stages(
        np.ones(n), np.array([0.0, 12.0]), cost, rate, random.uniform(0, 1.5, (modes, modes)) * (1 - np.eye(modes))
    )


def test_rates_between_states_are_linear_and_constant_beyond() -> None:
    states = np.array([1.0, 2.0, 5.0])
    values = np.array([3.0, 7.0, 1.0])
    nodes = np.array([0.0, 1.0, 1.25, 2.0, 3.5, 5.0, 9.0])
    np.testing.assert_allclose(values @ weights(states, nodes), [3.0, 3.0, 4.0, 7.0, 4.0, 1.0, 1.0])
    assert (weights(states[:1], nodes) == 1.0).all()


def enumerated(stages: pt.Stages, start: float, end: float, price: float) -> float:
    """The least cost of all sequences of decisions."""
    n, modes, controls, _ = stages.cost.shape
    best = np.inf
    for decisions in product(product(range(modes), range(controls)), repeat=n):
        s, total, before = start, 0.0, 0
        for k, (i, c) in enumerate(decisions):
            total += stages.cost[k, i, c, 0] + stages.switches[before, i]
            s, before = min(s + stages.rate[k, i, c, 0], 12.0), i
            if s < 0:
                total = np.inf
                break
        best = min(best, total + price * max(end - s, 0.0))
    return best


@pytest.mark.parametrize("seed", range(20))
def test_dynamic_programming_finds_the_least_of_all_sequences(seed: int) -> None:
    stages = random_stages(seed)
    found = pt.dynamic_programming(stages, start=3.0, end=4.0, price=7.0, grid=13)
    assert found.cost + 7.0 * max(4.0 - found.states[-1], 0.0) == pytest.approx(
        enumerated(stages, 3.0, 4.0, 7.0), rel=1e-12
    )


@pytest.mark.parametrize("seed", range(10))
def test_its_cost_and_states_are_those_of_its_decisions(seed: int) -> None:
    stages = random_stages(seed, n=40)
    found = pt.dynamic_programming(stages, start=6.0, end=6.0, price=9.0, grid=13)
    s, total, before = 6.0, 0.0, 0
    for k, (i, c) in enumerate(zip(found.modes, found.controls, strict=True)):
        total += float(stages.cost[k, i, c, 0] + stages.switches[before, i])
        s, before = min(s + float(stages.rate[k, i, c, 0]), 12.0), int(i)
        assert found.states[k + 1] == pytest.approx(s)
    assert found.cost == pytest.approx(total)


def without_switching(seed: int) -> pt.Stages:
    """Many small controls without cost of switching, and a store that is never full."""
    random = np.random.default_rng(seed)
    load, power = random.uniform(0, 2, 60), np.linspace(0, 3, 25)
    cost = np.where(power > 0, 0.3 + power + 0.15 * power**2, 0.0)
    shape = (60, 1, 25, 2)
    rate = (power[None, :] - load[:, None])[:, None, :, None]
    return pt.Stages(
        np.ones(60),
        np.array([0.0, 100.0]),
        np.broadcast_to(cost[None, None, :, None], shape),
        np.broadcast_to(rate, shape),
    )


@pytest.mark.parametrize("seed", range(5))
def test_a_constant_price_is_optimal_where_rates_do_not_depend_on_the_state(seed: int) -> None:
    """Weak duality: no schedule costs less than the least of cost - price (rate) summed up, plus the price of what the store gained."""
    stages = without_switching(seed)
    planned = pt.dynamic_programming(stages, start=50.0, end=50.0, price=20.0, grid=2001)
    followed = pt.ecms(stages, start=50.0, end=50.0)
    price = float(followed.price[0])
    bound = float((stages.cost - price * stages.rate)[..., 0].min(axis=(1, 2)).sum())
    assert bound <= planned.cost + 1e-9
    assert planned.cost <= followed.cost + 1e-6 + price * 0.06  # a grid of 0.05
    assert followed.cost - price * (followed.states[-1] - 50.0) == pytest.approx(bound, rel=1e-9)
    assert planned.price[30] == pytest.approx(price, rel=0.1)


def test_the_policy_decides_from_the_real_state() -> None:
    stages = without_switching(1)
    policy = pt.dynamic_programming(stages, start=50.0, end=50.0, price=20.0).policy
    low, high = (policy.decide(59, s, 0)[1] for s in (45.0, 60.0))
    assert low == 24, "a store that is short at the last interval is charged as much as possible"
    assert high == 0, "and nothing is burnt for one that is full"
    assert policy.decide(30, -5.0, 0) == policy.decide(30, 0.0, 0)


def test_modes_wait_for_a_cost_that_pays() -> None:
    cost = np.array([[0.0], [1.0]])[None, :, :, None].repeat(20, axis=0).repeat(2, axis=3)
    rate = np.array([[-1.0], [1.0]])[None, :, :, None].repeat(20, axis=0).repeat(2, axis=3)
    starts = []
    for switching in (0.0, 0.3, 50.0):
        stages = pt.Stages(np.ones(20), np.array([0.0, 30.0]), cost, rate, np.array([[0.0, switching], [0.0, 0.0]]))
        found = pt.dynamic_programming(stages, start=15.0, end=15.0, price=100.0, grid=31)
        assert found.states[-1] >= 15.0
        starts.append(int((np.diff([0, *found.modes]) > 0).sum()))
    assert starts[1] == starts[2] == 1


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"durations": [1.0, 0.0]}, "durations .s. must be positive"),
        ({"states": [1.0, 0.0]}, "states must ascend"),
        ({"cost": np.full((2, 1, 1, 2), np.nan)}, "nothing is possible in interval 0"),
        ({"cost": np.zeros((2, 1, 2, 2))}, "must have the shape"),
        ({"switching": np.zeros((2, 2))}, r"of shape \(1, 1\)"),
    ],
)
def test_wrong_stages_are_refused(changes: dict[str, Any], said: str) -> None:
    given = {
        "durations": [1.0, 1.0],
        "states": [0.0, 1.0],
        "cost": np.zeros((2, 1, 1, 2)),
        "rate": np.zeros((2, 1, 1, 2)),
    }
    with pytest.raises(pt.ParameterError, match=said):
        pt.Stages(**{**given, **changes})


def test_what_cannot_be_reached_is_refused() -> None:
    stages = pt.Stages(np.ones(4), np.array([0.0, 2.0]), np.zeros((4, 1, 1, 2)), np.full((4, 1, 1, 2), -1.0))
    with pytest.raises(pt.ParameterError, match="no decisions keep the state above 0"):
        pt.dynamic_programming(stages, start=1.0, end=1.0, price=1.0)
    with pytest.raises(pt.ParameterError, match="no price brings the store"):
        pt.ecms(stages, start=1.0, end=1.0)
    with pytest.raises(pt.ParameterError, match="lies outside the grid"):
        pt.dynamic_programming(stages, start=3.0, end=1.0, price=1.0)
    with pytest.raises(pt.ParameterError, match="dwell = 0 s must be positive"):
        pt.ecms(stages, start=1.0, end=1.0, dwell=0.0)


def _charging_or_not() -> pt.Stages:
    """Four seconds with the choice between a discharge of 1/s for nothing and a charge of 1/s that costs 3/s."""
    cost, rate = np.array([[0.0, 3.0]]), np.array([[-1.0, 1.0]])
    return pt.Stages(
        np.ones(4),
        np.array([0.0, 10.0]),
        *(v[None, :, :, None].repeat(4, axis=0).repeat(2, axis=3) for v in (cost, rate)),
    )


_METHODS = pytest.mark.parametrize(
    "method", [lambda stages, **given: pt.dynamic_programming(stages, price=9.0, **given), pt.ecms], ids=["dp", "ecms"]
)


@_METHODS
def test_a_course_on_which_nothing_is_possible_is_an_error(method: Any) -> None:
    """The only decision of the first second leads to 5, where the second one offers none; the cost used to be 1e30."""
    cost = np.array([[[[1.0, 1.0, 1.0]]], [[[np.nan, np.nan, 1.0]]]])
    rate = np.array([[[[-5.0, -5.0, -5.0]]], [[[0.0, 0.0, 0.0]]]])
    stages = pt.Stages(np.ones(2), np.array([0.0, 5.0, 10.0]), cost, rate)
    with pytest.raises(pt.ParameterError, match=r"interval 1, from 1 s on, .*no decision is possible .* 5"):
        method(stages, start=10.0, end=0.0)


@_METHODS
@pytest.mark.parametrize("start", [-2.0, 15.0, np.nan])
def test_a_start_outside_the_states_is_an_error(method: Any, start: float) -> None:
    """ECMS used to drop the charge above the last state in the first interval."""
    with pytest.raises(pt.ParameterError, match="start"):
        method(_charging_or_not(), start=start, end=0.0)


@_METHODS
@pytest.mark.parametrize("mode", [-1, 1, 0.5, 0.0, False, np.array(0), "0"])
def test_a_mode_before_the_start_that_does_not_exist_is_an_error(method: Any, mode: Any) -> None:
    """-1 used to be the last mode; 0.0 and False failed as indices."""
    with pytest.raises(pt.ParameterError, match="must be a whole number from 0 to 0"):
        method(_charging_or_not(), start=5.0, end=5.0, mode=mode)


def _engine_that_stops_early(n: int = 60) -> pt.Stages:
    """A load of 0.001/s, and an engine that yields 0.021/s at a cost of 1/s, but not in the last twenty seconds."""
    cost, rate = np.zeros((n, 2, 1, 2)), np.full((n, 2, 1, 2), -0.001)
    rate[:, 1], cost[:, 1] = 0.02, 1.0
    cost[-20:, 1] = np.nan
    return pt.Stages(np.ones(n), np.array([0.0, 1.0]), cost, rate)


@pytest.mark.parametrize(("start", "seconds"), [(0.0605, 0), (0.0595, 1), (0.0385, 2), (0.0005, 3)])
def test_a_store_that_ends_empty_needs_no_reserve(start: float, seconds: int) -> None:
    """Sixty seconds take 0.06, a second of the engine gives 0.021. Every interval used to make the lowest node of the grid useless."""
    found = pt.dynamic_programming(_engine_that_stops_early(), start=start, end=0.0, price=1.0)
    assert found.cost == seconds
    assert found.states.min() >= -1e-12
    assert np.isfinite(found.price).all()


def _near_empty(seed: int) -> pt.Stages:
    """Rates depend on the state, some decisions are impossible, and a store that starts almost empty."""
    random = np.random.default_rng(seed)
    rate = random.uniform(-0.8, 0.8, (8, 2, 2, 1)) + random.uniform(-0.1, 0.1, (8, 2, 2, 3))
    cost = np.where(rate > 0, rate * random.uniform(0.5, 2, rate.shape), 0.05)
    cost[:, 1][random.random((8, 2)) < 0.3] = np.nan
    switching = random.uniform(0, 0.3, (2, 2)) * (1 - np.eye(2))
    return pt.Stages(random.uniform(0.5, 1.5, 8), np.array([0.0, 1.0, 3.0]), cost, rate, switching)


def _all_courses(stages: pt.Stages, start: float, end: float, price: float) -> float:
    """The least cost of all courses, which are followed forward."""
    reached = {(start, 0): 0.0}
    for k, h in enumerate(stages.durations):
        then: dict[tuple[float, int], float] = {}
        for (s, mode), spent in reached.items():
            cost, rate = stages.at(k, s)
            for i, c in np.argwhere((cost < 1e20) & (s + h * rate >= 0)).tolist():
                key = min(s + float(h * rate[i, c]), 3.0), i
                total = spent + float(h * cost[i, c]) + float(stages.switches[mode, i])
                then[key] = min(total, then.get(key, np.inf))
        reached = then
    return min((spent + price * max(end - s, 0.0) for (s, _), spent in reached.items()), default=np.inf)


@pytest.mark.parametrize("seed", range(20))
def test_dynamic_programming_of_an_almost_empty_store(seed: int) -> None:
    stages = _near_empty(seed)
    least = _all_courses(stages, 0.3, 1.0, 5.0)
    if least == np.inf:
        with pytest.raises(pt.ParameterError, match="no decisions keep the state above 0"):
            pt.dynamic_programming(stages, start=0.3, end=1.0, price=5.0, grid=1001)
        return
    found = pt.dynamic_programming(stages, start=0.3, end=1.0, price=5.0, grid=1001)
    assert least - 1e-9 <= found.cost + 5.0 * max(1.0 - found.states[-1], 0.0) <= least + 0.02


def _charging(rate: float) -> pt.Stages:
    return pt.Stages(np.ones(10), np.array([0.0, 1.0]), np.zeros((10, 1, 1, 2)), np.full((10, 1, 1, 2), rate))


def test_the_ends_of_the_grid_are_the_limits_of_the_store() -> None:
    """The state used to leave them without a word."""
    full = pt.dynamic_programming(_charging(0.1), start=0.5, end=0.0, price=1.0, grid=np.linspace(0.4, 0.8, 41))
    assert full.states[-1] == full.states.max() == 0.8
    with pytest.raises(pt.ParameterError, match=r"no decisions keep the state above 0\.4: in interval 5"):
        pt.dynamic_programming(_charging(-0.02), start=0.5, end=0.0, price=1.0, grid=np.linspace(0.4, 0.8, 41))
    with pytest.raises(pt.ParameterError, match=r"from -0\.5 to 1 is more than the states of the stages, 0 to 1"):
        pt.dynamic_programming(_charging(0.1), start=0.5, end=0.0, price=1.0, grid=[-0.5, 0.5, 1.0])


def test_a_grid_between_whose_nodes_decisions_are_impossible_is_too_coarse() -> None:
    """Nothing is possible between 4 and 6, and two nodes lie there; that states of 5 are left alone is not known to the grid."""
    states = np.array([0.0, 4.0, 5.0, 6.0, 10.0])
    cost = np.array([0.0, 0.0, np.nan, 0.0, 0.0])[None, None, None, :].repeat(3, axis=0)
    stages = pt.Stages(np.ones(3), states, cost, np.full_like(cost, -0.1))
    with pytest.raises(pt.ParameterError, match="the grid is too coarse: in interval 0"):
        pt.dynamic_programming(stages, start=4.0, end=0.0, price=1.0, grid=[0.0, 3.5, 4.5, 10.0])
    assert pt.dynamic_programming(stages, start=4.0, end=0.0, price=1.0, grid=[0.0, 4.0, 10.0]).states[-1] < 3.8


def test_a_store_that_ends_full_enough_without_a_price_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search for the lowest price used to halve it a thousand times, down to the smallest number there is."""
    runs, follow = [], scheduling._follow

    def counted(*given: Any) -> pt.Schedule:
        runs.append(given)
        return follow(*given)

    monkeypatch.setattr(scheduling, "_follow", counted)
    found = pt.ecms(_charging_or_not(), start=5.0, end=1.0)
    assert found.cost == found.price[0] == 0.0
    assert len(runs) == 1


def test_charge_that_is_lost_earns_nothing() -> None:
    """At any price a full store is not charged: two seconds fill it, and ten of discharge follow."""
    cost, rate = np.zeros((30, 2, 1, 2)), np.zeros((30, 2, 1, 2))
    rate[:, 1], cost[:, 1] = 0.25, 1.0
    rate[20:, 0], rate[20:, 1] = -0.1, 0.15
    stages = pt.Stages(np.ones(30), np.array([0.0, 1.0]), cost, rate)
    found = pt.ecms(stages, start=0.5, end=0.9)
    assert found.modes[:20].sum() <= 2
    assert found.cost <= 6.0


@pytest.mark.parametrize("seed", range(6))
def test_one_state_stands_for_all_where_nothing_depends_on_it(seed: int) -> None:
    two = random_stages(seed)
    one = pt.Stages(two.durations, np.array([5.0]), two.cost[..., :1], two.rate[..., :1], two.switching)
    given: dict[str, Any] = {"start": 1.0, "end": 2.0, "price": 7.0, "grid": np.arange(13.0)}
    expected, found = (pt.dynamic_programming(stages, **given) for stages in (two, one))
    assert found.cost == pytest.approx(expected.cost, rel=1e-12)
    np.testing.assert_allclose(found.policy.grid, expected.policy.grid, atol=1e-12)  # type: ignore[attr-defined]


def test_a_store_that_runs_empty_is_charged_as_much_as_possible() -> None:
    rate = np.array([-3.0, -2.0, -2.5])[None, None, :, None].repeat(3, axis=0).repeat(2, axis=3)
    stages = pt.Stages(np.ones(3), np.array([0.0, 2.0]), np.zeros_like(rate), rate)
    with pytest.raises(pt.ParameterError, match=r"in interval 0, from 0 s on, it falls to -1$"):
        pt.dynamic_programming(stages, start=1.0, end=1.0, price=1.0)


@pytest.mark.parametrize(("worth", "on_from_off", "on_from_on"), [(0.4, 0, 0), (0.75, 0, 1), (1.1, 1, 1)])
def test_a_change_of_mode_costs_what_its_direction_costs(worth: float, on_from_off: int, on_from_on: int) -> None:
    """On costs 1/s and charges 1/s, off discharges 1/s; switching on costs 2, which counts as 1/s for 2 s, off nothing."""
    cost, rate = (np.array(v)[None, :, None, None].repeat(2, axis=3) for v in ([0.0, 1.0], [-1.0, 1.0]))
    stages = pt.Stages(np.ones(1), np.array([0.0, 10.0]), cost, rate, np.array([[0.0, 2.0], [0.0, 0.0]]))
    policy = scheduling._Price(stages, worth, 2.0)
    assert [policy.decide(0, 5.0, mode)[0] for mode in (0, 1)] == [on_from_off, on_from_on]


@pytest.mark.parametrize(("end", "nodes"), [(4.5, 8), (4.0, 7), (0.0, 7), (15.0, 7)])
def test_the_final_state_is_a_node_of_the_grid(end: float, nodes: int) -> None:
    grid = scheduling._grid(random_stages(0), 7, end)
    assert grid.size == nodes
    assert (end in grid) == (end <= 12.0)
