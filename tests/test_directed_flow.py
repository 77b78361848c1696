"""Directions of power on graphs written down by hand: cases of a variator, circulating power, and what counts as zero."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

import powertrain as pt
from powertrain.power.directedflow import DirectedFlow
from powertrain.power.powerflow import PowerFlow
from powertrain.power.powergraph import PowerGraph, Terminal
from powertrain.power.variator import VARIATOR_CASES

V = "variator"
NOISE = 1e-13
Flow = tuple[str, str, float]


def directed(flows: Sequence[Flow], **ends: dict[str, float]) -> DirectedFlow:
    """From power between components and nodes; ``ends``: power supplied, lost, delivered and stored by the components."""
    nodes = sorted({name for flow in flows for name in flow[:2] if name.startswith("node")})
    names = sorted({name for flow in flows for name in flow[:2]} - set(nodes))
    terminals: list[Terminal] = []
    power: list[list[float]] = []
    for tail, head, value in flows:
        inward = tail in nodes
        component, node = (head, tail) if inward else (tail, head)
        terminals.append(Terminal(f"{component}.{len(terminals)}", names.index(component), nodes.index(node)))
        power.append([value if inward else -value])
    members = tuple((i,) for i in range(len(names)))
    graph = PowerGraph(tuple(names), members, tuple(nodes), tuple(terminals))

    def terms(kind: str) -> np.ndarray:
        return np.array([[ends.get(kind, {}).get(name, 0.0)] for name in names])

    return DirectedFlow(graph, np.array(power), *(terms(k) for k in ("supplied", "loss", "delivered", "stored")))


def case_of(flow: DirectedFlow) -> str:
    """The case of the variator."""
    return VARIATOR_CASES[flow.cases(flow.graph.component(V))[0]]


def chain(*names: str, power: float = 10.0) -> list[Flow]:
    """Power that one component passes to the next."""
    return [
        flow
        for k, (one, other) in enumerate(pairwise(names))
        for flow in ((one, f"node {k}", power), (f"node {k}", other, power))
    ]


SERIES = {
    "delivered": directed(chain("motor", V, "load"), supplied={"motor": 10.0}, delivered={"load": 10.0}),
    "released by a flywheel": directed(
        chain("flywheel", V, "load"), stored={"flywheel": -10.0}, delivered={"load": 10.0}
    ),
    "released beside a supply": directed(
        [*chain("motor", V, "load"), ("flywheel", "node 1", 2.0)],
        supplied={"motor": 10.0}, stored={"flywheel": -2.0}, delivered={"load": 12.0},
    ),
    "lost in drag behind a lossy gear": directed(
        chain("motor", "gear", V, "drag"), supplied={"motor": 10.0}, loss={"gear": 1.0, V: 1.0, "drag": 8.0}
    ),
    "stored behind a lossy gear": directed(
        chain("motor", "gear", V, "wheel"), supplied={"motor": 10.0}, loss={"gear": 1.0}, stored={"wheel": 9.0}
    ),
    "delivered beside it within round-off": directed(
        chain("motor", V, "load"), supplied={"motor": 10.0}, delivered={"load": 10.0, "motor": NOISE}
    ),
    "a way beside it within round-off": directed(
        [*chain("motor", V, "load"), ("node 0", "bypass", NOISE), ("bypass", "node 1", NOISE)],
        supplied={"motor": 10.0}, delivered={"load": 10.0},
    ),
    "a loop within round-off": directed(
        [*chain("motor", V, "load"), ("node 1", "bypass", NOISE), ("bypass", "node 0", NOISE)],
        supplied={"motor": 10.0}, delivered={"load": 10.0},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SERIES)
def test_all_power_goes_through_the_variator(name: str) -> None:
    """From wherever it comes to wherever it goes; nothing circulates."""
    flow = SERIES[name]
    assert case_of(flow) == "series"
    assert flow.circulation[0][0] == 0.0


def beside(through: float, around: float) -> DirectedFlow:
    """10 W from a motor to a load, ``through`` of them through the variator and ``around`` through a gear; negative ones flow back."""
    ways = [("node 0", V, "node 1", through), ("node 0", "gear", "node 1", around)]
    flows = [("motor", "node 0", 10.0), ("node 1", "load", 10.0)]
    for one, name, other, value in ways:
        tail, head = (one, other) if value > 0 else (other, one)
        flows += [(tail, name, abs(value)), (name, head, abs(value))]
    return directed(flows, supplied={"motor": 10.0}, delivered={"load": 10.0})


@pytest.mark.parametrize(
    ("through", "around", "case", "circulating"),
    [
        (4.0, 6.0, "split", 0.0),
        (13.0, -3.0, "positive recirculation", 3.0),
        (-3.0, 13.0, "negative recirculation", 3.0),
        (NOISE, 10.0, "idle", 0.0),
    ],
)
def test_cases_of_two_ways(through: float, around: float, case: str, circulating: float) -> None:
    """What flows back circulates: the smaller of both powers."""
    flow = beside(through, around)
    assert case_of(flow) == case
    assert flow.circulation[0][0] == pytest.approx(circulating, abs=1e-12)


def test_cycles_that_share_a_terminal() -> None:
    """5 W of A return by B and by C: all power circulates, 5 W in total."""
    flow = directed(
        [("A", "node 0", 5.0), ("node 1", "A", 5.0)]
        + [f for name, p in (("B", 3.0), ("C", 2.0)) for f in (("node 0", name, p), (name, "node 1", p))]
    )
    total, around = flow.circulation
    assert total[0] == pytest.approx(5.0)
    np.testing.assert_allclose(around, np.abs(flow.power))


def test_drag_is_wanted_before_storage() -> None:
    """A motor turns a fan, which loses all that it receives, through the variator, and a flywheel beside it."""
    flow = directed(
        [("motor", "node 0", 10.0), ("node 0", V, 6.0), (V, "node 1", 6.0), ("node 1", "fan", 6.0), ("node 0", "wheel", 4.0)],
        supplied={"motor": 10.0}, loss={"fan": 6.0}, stored={"wheel": 4.0},
    )  # fmt: skip
    assert case_of(flow) == "series"


def test_a_point_without_a_solution() -> None:
    """It has neither circulating power nor strands nor a case."""
    flow = beside(13.0, -3.0)
    flow.power[0] = np.nan
    assert np.isnan(flow.circulation[0]).all()
    assert np.isnan(flow.circulation[1]).all()
    assert flow.strands(0) == ([], [])
    assert flow.cases(flow.graph.component(V))[0] == len(VARIATOR_CASES)


def test_paths_from_everything_that_enters() -> None:
    """A motor, a flywheel that slows down and a model's error as a negative loss supply what is lost, delivered and stored."""
    flow = directed(
        [("motor", "node", 5.0), ("flywheel", "node", 3.0), ("fault", "node", 1.0), ("node", "load", 9.0)],
        supplied={"motor": 5.0}, stored={"flywheel": -3.0, "load": 2.0}, loss={"fault": -1.0, "load": 1.0},
        delivered={"load": 6.0},
    )  # fmt: skip
    paths = flow.strands(0)[1]
    assert sum(path.flow for path in paths) == pytest.approx(9.0)
    ends = {end: sum(p.flow for p in paths if flow.end(p) == end) for end in ("loss", "delivered", "stored")}
    assert ends == pytest.approx({"loss": 1.0, "delivered": 6.0, "stored": 2.0})


def written(flow: DirectedFlow, **dims: int) -> PowerFlow:
    """The same as users see it, at one point or at equal points over several dimensions."""
    ports, components = [t.port for t in flow.graph.terminals], list(flow.graph.components)

    def over(values: np.ndarray, first: str) -> xr.DataArray:
        shape = (len(values), *(1 for _ in dims))
        return xr.DataArray(np.tile(values.reshape(shape), (1, *dims.values())), dims=(first, *dims))

    data = {"power": over(flow.power, "port")}
    data |= {n: over(getattr(flow, n), "component") for n in ("supplied", "loss", "delivered", "stored")}
    return PowerFlow(flow.graph, xr.Dataset(data, coords={"port": ports, "component": components}))


def test_round_off_is_no_power() -> None:
    """It gives no K, no branch, and no share of what leaves a vertex."""
    flow = directed(
        [*chain("flywheel", "gear", "load"), ("motor", "node 0", NOISE), ("node 1", V, NOISE)],
        supplied={"motor": NOISE}, stored={"flywheel": -10.0}, delivered={"load": 10.0},
    )  # fmt: skip
    seen = written(flow)
    assert np.isnan(seen.variator("gear").K)
    assert float(seen.variator("gear", source="flywheel").K) == pytest.approx(1.0)
    assert {(b.source, b.target) for b in seen.branches} == {("flywheel", "gear"), ("gear", "load")}
    assert seen.splits == {}
    assert np.isnan(seen.split("load")).all()
    assert np.isnan(seen.variator("motor").efficiency)
    with pytest.raises(pt.ParameterError, match="has no component wheel"):
        seen.split("wheel")


def test_efficiency_is_what_is_not_lost_of_all_that_enters() -> None:
    """A motor and a flywheel that slows down drive a load and charge a battery; what only circulates is neither input nor output."""
    flow = directed(
        [("motor", "node", 5.0), ("flywheel", "node", 3.0), ("node", "load", 5.0), ("node", "battery", 3.0)],
        supplied={"motor": 5.0}, stored={"flywheel": -4.0, "battery": 2.0}, loss={"flywheel": 1.0, "battery": 1.0},
        delivered={"load": 5.0},
    )  # fmt: skip
    assert float(written(flow).efficiency) == pytest.approx(1 - 2 / 9)
    loop = directed(
        [*chain("gear", "brace", "gear"), ("motor", "node 0", NOISE)], supplied={"motor": NOISE}, loss={"gear": NOISE}
    )
    assert np.isnan(written(loop).efficiency)


def test_input_and_output_are_unknown_with_any_of_their_parts() -> None:
    flow = beside(4.0, 6.0)
    flow.supplied[0] = flow.delivered[0] = np.nan
    assert np.isnan(written(flow).input)
    assert np.isnan(written(flow).output)


def test_dimensions_in_any_order() -> None:
    """Powers over two dimensions, in the order of neither ports nor points."""
    flow = written(beside(13.0, -3.0), a=2, b=3)
    flow.data["power"] = flow.data["power"] * xr.DataArray([[1.0, 2, 3], [4, 5, 6]], dims=("a", "b"))
    turned = PowerFlow(flow.graph, flow.data.assign(power=flow.data.power.transpose("b", "port", "a")))
    np.testing.assert_allclose(flow.circulating, np.array([[3.0, 6, 9], [12, 15, 18]]))
    xr.testing.assert_allclose(turned.circulating.transpose("a", "b"), flow.circulating)
