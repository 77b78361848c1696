"""Networks of planetary gears: the six types as instances, operating points against the model's, energy, what cannot be."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cases import few
from network_bench import UNIT, random_network, steady
from yu_beachley import CONNECTIONS, only, solutions, unit_ratio

import powertrain as pt
from powertrain.components.transmissions import HOUSING, Lever, Network, UnitLoss, flow, joints

LOSS = UnitLoss(0.85, 0.8)
R1 = np.linspace(0.31, 2.2, 25)


@pytest.mark.parametrize("coupling", ["input", "output"])
@pytest.mark.parametrize("kind", CONNECTIONS)
def test_the_six_types_are_networks(kind: int, coupling: Any) -> None:
    """Against the paper's formulas in closed form."""
    layout: Any = CONNECTIONS[kind]
    network = Network.split_path(layout, coupling, -1.7, 0.95)
    found = flow(network, R1, 10.0, loss=UnitLoss(0.9, 0.9))
    assert (found.status == 0).all()
    for k, r in enumerate(R1):
        wanted = only(solutions(layout, -1.7, r, 0.95, 0.9, coupling))
        V = unit_ratio(layout, -1.7, r, coupling)
        assert found.V[k] == pytest.approx(V if coupling == "input" else 1 / V, rel=1e-12)
        assert found.efficiency[0, k] == pytest.approx(wanted.efficiency, rel=1e-12)
        assert found.K[k] == pytest.approx(wanted.K, rel=1e-11)


@pytest.mark.parametrize("seed", few(range(12), 4))
def test_random_networks_have_the_operating_points_of_their_model(seed: int) -> None:
    rng = np.random.default_rng(seed)
    network = random_network(rng)
    r = rng.uniform(0.2, 2.5, 6) * rng.choice([-1, 1])
    torque = float(rng.uniform(5, 50) * rng.choice([-1, 1]))
    found = flow(network, r, torque, loss=LOSS)
    model = steady(network, r, torque)
    status = model.status.values
    np.testing.assert_array_equal(found.status == 0, status == 0)
    one = status == 0
    assert one.any()
    for name, value in (
        ("gear.flange_a.tau", found.tau_in),
        (f"{UNIT}.flange_a.tau", found.tau[0]),
        (f"{UNIT}.flange_b.tau", found.tau[1]),
    ):
        np.testing.assert_allclose(value[one], model[name].values[one], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_energy_and_the_mechanical_points(seed: int) -> None:
    """What goes in comes out or is lost in levers and unit. Without loss K = d ln r/d ln V, by virtual work, of speeds alone."""
    rng = np.random.default_rng(100 + seed)
    network = random_network(rng)
    r = rng.uniform(-2.5, 2.5, 9)
    found = flow(network, r, np.sign(r) * 20.0, loss=LOSS)
    good = found.status == 0
    delivered, supplied = np.abs(r) * 20.0 * 100.0, found.tau_in * 100.0
    etas = np.array([lever.eta for lever in network.levers])[:, None]
    lost = np.where(found.latent > 0, 1 - etas, 1 / etas - 1) * np.abs(found.latent)
    unit = (found.w * found.tau).sum(axis=0)
    assert (unit[good] >= -1e-9).all()
    np.testing.assert_allclose((supplied - lost.sum(axis=0) - unit)[good], delivered[good], rtol=1e-9)
    assert (found.efficiency[0][good] < 1).all()
    free = Network(tuple(Lever(x.name, x.a, x.b, x.carrier, x.ratio) for x in network.levers), network.unit)
    (A_a, B_a), (A_b, B_b) = (free.speeds()[free.nodes[name]] for name in free.unit)
    share = (A_a + B_a * r) * (A_b + B_b * r) / (r * (A_a * B_b - A_b * B_a))
    lossless = flow(free, r, 20.0)
    np.testing.assert_allclose(lossless.K, share, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(lossless.efficiency, 1.0, rtol=1e-10)


def test_unit_by_its_map() -> None:
    """An efficiency over ratio and torque: the point is the fixed point of both, and that of the model."""
    from powertrain.components.cvu import CVU

    axes = [pt.Axis("ratio", "1", [0.2, 1.0, 3.0], "clip"), pt.Axis("tau", "N.m", [0.0, 5.0, 40.0], "clip")]
    table = pt.Map(axes, [[0.5, 0.7, 0.8], [0.6, 0.8, 0.9], [0.55, 0.75, 0.85]], "1")
    network = Network.split_path("abH", "input", -1.7, 0.95)
    r = np.linspace(0.5, 1.9, 7)
    found = flow(network, r, 12.0, loss=UnitLoss(table, table))
    model = steady(network, r, 12.0, CVU(map_ab=table, map_ba=table))
    np.testing.assert_allclose(found.tau_in, model["gear.flange_a.tau"].values, rtol=1e-9)
    np.testing.assert_allclose(found.tau[0], model[f"{UNIT}.flange_a.tau"].values, rtol=1e-9)


def test_many_candidates_are_each_their_own() -> None:
    rng = np.random.default_rng(3)
    ratios = -rng.uniform(0.3, 4, (50, 1))
    whole = flow(Network.split_path("aHb", "output", -1.0, 0.95), R1, 10.0, loss=LOSS, ratios=ratios)
    for k in (0, 17, 49):
        single = flow(Network.split_path("aHb", "output", float(ratios[k, 0]), 0.95), R1, 10.0, loss=LOSS)
        np.testing.assert_array_equal(whole.efficiency[:, k], single.efficiency)


def test_a_stuck_mesh_has_an_interval_and_a_locked_one_no_solution() -> None:
    found = flow(Network.split_path("abH", "input", -1.7, 0.95), [0.9, 1.0, 1.1], 10.0, loss=UnitLoss(0.9, 0.9))
    assert found.status.tolist() == [0, 1, 0]
    assert found.efficiency[1, 1] > found.efficiency[0, 1]
    locked = flow(Network.split_path("abH", "input", 0.95, 0.9), [0.5, 0.8, 1.2], 10.0, loss=UnitLoss(0.9, 0.9))
    wanted = [len(solutions("abH", 0.95, r, 0.9, 0.9)) for r in (0.5, 0.8, 1.2)]
    assert [{0: 3, 1: 0}.get(n, 2) for n in wanted] == locked.status.tolist()
    assert set(wanted) != {1}


def test_at_standstill_a_geared_neutral_has_torque() -> None:
    """Input-coupled at r = 0: the unit carries the torque of the load, nothing is delivered."""
    found = flow(Network.split_path("bHa", "input", -1.7, 0.95), [0.0, 1e-9], 10.0, loss=LOSS)
    assert found.efficiency[0, 0] == 0
    np.testing.assert_allclose(found.tau[:, 0], found.tau[:, 1], rtol=1e-6)


def test_what_is_no_network() -> None:
    lever = Lever("p", "a", "b", "in", -2.0)
    wrong: dict[str, Callable[[], Any]] = {
        "unit is at the shaft 'x'": lambda: Network((lever,), ("x", "a")),
        "the output is at the shaft 'out', where nothing else is": lambda: Network((lever,), ("a", "b")),
        "a gear cannot have the ratio 1": lambda: Lever("p", "a", "b", "c", 1.0),
        "not three shafts": lambda: Lever("p", "a", "a", "c", -1.0),
        r"must be in \(0, 1\]": lambda: Lever("p", "a", "b", "c", -1.0, 1.1),
        "does not name two shafts": lambda: joints("a"),
        "has 3 degrees of freedom": lambda: Network((lever, Lever("q", "b", "c", "out", -2.0)), ("a", "c")).speeds(),
        "not a fixed gear": lambda: Network.split_path("abH", "input", -2.0).fixed_ratio(),
        "is not in": lambda: UnitLoss(0.0, 1.0),
        "cannot depend on T": lambda: UnitLoss(pt.Map.constant(0.9, x="T", x_unit="K"), 1.0),
    }
    for said, make in wrong.items():
        with pytest.raises(pt.ParameterError, match=said):
            make()


IN_LINE = {
    "input": Network((Lever("pair", "mid", "out", HOUSING, 1.5, 0.97),), ("in", "mid")),
    "output": Network((Lever("pair", "in", "mid", HOUSING, 1.5, 0.97),), ("mid", "out")),
    "both": Network((), ("in", "out")),
}


@pytest.mark.parametrize("name", IN_LINE)
def test_an_end_at_the_unit_alone(name: str) -> None:
    """A unit before or behind a pair of gears, or alone, passes its efficiency on; by hand and by the model."""
    network, r, pair = IN_LINE[name], np.array([0.4, 1.3]), 1.0 if name == "both" else 0.97
    found = flow(network, r, 20.0, loss=LOSS)
    np.testing.assert_allclose(found.V, r if name == "both" else 1.5 * r, rtol=1e-12)
    np.testing.assert_allclose(found.efficiency, 0.85 * pair, rtol=1e-12)
    np.testing.assert_allclose(found.tau_in, 20.0 * r / (0.85 * pair), rtol=1e-12)
    np.testing.assert_allclose(flow(network, r, -20.0, loss=LOSS).tau_in, -20.0 * r * 0.8 * pair, rtol=1e-12)
    if name != "both":
        np.testing.assert_allclose(steady(network, r, 20.0)["gear.flange_a.tau"], found.tau_in, rtol=1e-9)


def test_joints_in_any_order_are_the_same_nodes() -> None:
    levers = (Lever("p", "s", "out", "c", -2.0), Lever("q", "s", "e", "c", -3.0))
    wanted = None
    for order in itertools.permutations(joints("in-c", f"e-{HOUSING}", "x-c")):
        network = Network(levers, ("s", "x"), order)
        found = sorted(
            {frozenset(n for n, k in network.nodes.items() if k == node) for node in network.nodes.values()}, key=sorted
        )
        wanted = wanted or found
        assert found == wanted
