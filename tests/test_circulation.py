"""Cycles and paths of flows against all simple cycles and paths of the graph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from powertrain.power.circulation import Edge, decompose, loops
from powertrain.power.directedflow import DirectedFlow
from powertrain.power.powergraph import PowerGraph, Terminal
from powertrain.power.variator import goes_beside

Matrix = np.ndarray[Any, Any]


def ways(edges: Sequence[Edge], start: int, ends: set[int], passed: tuple[int, ...] = ()) -> list[tuple[int, ...]]:
    """All simple ways from a vertex to others, as edges; a cycle where the start is the end."""
    found = []
    seen = {edges[k][0] for k in passed} | {start}
    for k, (tail, head) in enumerate(edges):
        if tail != start:
            continue
        if head in ends:
            found.append((*passed, k))
        elif head not in seen:
            found += ways(edges, head, ends, (*passed, k))
    return found


def cycles(edges: Sequence[Edge]) -> set[tuple[int, ...]]:
    """All simple cycles, each from its least edge."""
    found = set()
    for vertex in {tail for tail, _ in edges}:
        for way in ways(edges, vertex, {vertex}):
            at = way.index(min(way))
            found.add(way[at:] + way[:at])
    return found


def graph(rng: np.random.Generator, n: int, density: float) -> list[Edge]:
    return [(i, j) for i in range(n) for j in range(n) if i != j and rng.random() < density]


@pytest.mark.parametrize("seed", range(25))
def test_the_widest_cycle_comes_first_and_none_is_left(seed: int) -> None:
    rng = np.random.default_rng(seed)
    edges = graph(rng, 6, 0.35)
    flow = rng.uniform(0.1, 1.0, len(edges))
    found, _ = decompose(edges, flow, set(), set(), 1e-12)
    left = flow.copy()
    for strand in found:
        usable = [k for k in range(len(edges)) if left[k] > 1e-12]
        every = [tuple(usable[k] for k in cycle) for cycle in cycles([edges[k] for k in usable])]
        widest = max(left[list(cycle)].min() for cycle in every)
        assert strand.flow == pytest.approx(widest, rel=1e-12)
        assert set(strand.edges) in [set(cycle) for cycle in every]
        assert len(strand.edges) == min(len(c) for c in every if left[list(c)].min() == widest)
        left[list(strand.edges)] -= strand.flow
    usable = [k for k in range(len(edges)) if left[k] > 1e-12]
    assert not cycles([edges[k] for k in usable])


@pytest.mark.parametrize("seed", range(25))
def test_the_widest_path_comes_first(seed: int) -> None:
    """Two sources and two sinks on a graph without cycles."""
    rng = np.random.default_rng(seed)
    edges = [(i, j) for i, j in graph(rng, 7, 0.6) if i < j]
    flow = rng.uniform(0.1, 1.0, len(edges))
    found, paths = decompose(edges, flow, {0, 1}, {5, 6}, 1e-12)
    assert not found
    left = flow.copy()
    for path in paths:
        usable = [k for k in range(len(edges)) if left[k] > 1e-12]
        kept = [edges[k] for k in usable]
        every = [tuple(usable[k] for k in way) for start in (0, 1) for way in ways(kept, start, {5, 6})]
        widest = max(left[list(way)].min() for way in every)
        assert path.flow == pytest.approx(widest, rel=1e-12)
        assert path.edges in every
        left[list(path.edges)] -= path.flow
    usable = [k for k in range(len(edges)) if left[k] > 1e-12]
    assert not [way for start in (0, 1) for way in ways([edges[k] for k in usable], start, {5, 6})]


def test_cycles_come_before_paths() -> None:
    """S-A, A-B, B-A, A-C, C-B, B-T carry 1 W each: the cycle of two edges, and the path that it leaves; 0.01 W count as nothing."""
    edges = [(0, 1), (1, 2), (2, 1), (1, 3), (3, 2), (2, 4), (0, 4)]
    cycles, paths = decompose(edges, np.array([1.0, 1, 1, 1, 1, 1, 0.01]), {0}, {4}, 0.1)
    assert [(strand.flow, set(strand.edges)) for strand in cycles] == [(1.0, {1, 2})]
    assert [(strand.flow, strand.edges) for strand in paths] == [(1.0, (0, 3, 4, 5))]


@pytest.mark.parametrize("seed", range(40))
def test_loops_are_all_cycles_where_none_share_a_vertex(seed: int) -> None:
    rng = np.random.default_rng(seed)
    edges = graph(rng, 8, 0.14)
    every = cycles(edges)
    vertices = [edges[k][0] for cycle in every for k in cycle]
    found = loops(edges, 8)
    if len(set(vertices)) < len(vertices):
        assert found is None
        return
    assert found is not None
    assert {frozenset(cycle) for cycle in found} == {frozenset(cycle) for cycle in every}


@pytest.mark.parametrize("seed", range(20))
def test_power_goes_beside_where_a_path_avoids_the_vertex(seed: int) -> None:
    rng = np.random.default_rng(seed)
    edges = [(i - 2, j - 2) for i, j in graph(rng, 7, 0.25)]  # -1 the source, -2 the sink
    paths = ways(edges, -1, {-2})
    for v in range(5):
        beside = any(all(v not in edges[k] for k in path) for path in paths)
        assert goes_beside(v, edges) == (beside or not paths)


def flow_of(power: Matrix) -> DirectedFlow:
    """Source, first node, two branches (the second through a unit), second node, load: terminals in this order, power into each."""
    names = ("source", "branch", "unit", "load")
    terminals = [(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (3, 1)]
    graph = PowerGraph(
        names, tuple((i,) for i in range(4)), ("first", "second"),
        tuple(Terminal(f"p{k}", c, n) for k, (c, n) in enumerate(terminals)),
    )  # fmt: skip
    own = np.zeros((4, power.shape[1]))
    for k, (c, _) in enumerate(terminals):
        own[c] += power[k]
    zero = np.zeros_like(own)
    supplied, delivered, loss = zero.copy(), zero.copy(), zero.copy()
    supplied[0], delivered[3], loss[1:3] = -own[0], own[3], own[1:3]
    return DirectedFlow(graph, power, supplied, loss, delivered, zero)


def powers(given: Matrix, unit: Matrix, eta: float = 0.9) -> Matrix:
    """``given`` W are supplied, ``unit`` go into the unit at the first node; below zero they come back through it."""
    back = np.where(unit > 0, eta * unit, unit / eta)
    branch = given - unit
    return np.array([-given, branch, unit, -branch, -back, branch + back])


def test_circulation_of_many_points_is_that_of_each() -> None:
    """Forward, backward and idle unit, more and less than all of the power, and a point without solution."""
    given = np.array([100.0, 100.0, 100.0, 100.0, -100.0, np.nan])
    unit = np.array([30.0, -40.0, 0.0, 130.0, 50.0, 10.0])
    flow = flow_of(powers(given, unit))
    total, around = flow.circulation
    for i in range(5):
        strands, paths = flow.strands(i)
        assert total[i] == pytest.approx(sum(s.flow for s in strands))
        expected = np.zeros(6)
        for strand in strands:
            expected[list(strand.edges)] += strand.flow
        np.testing.assert_allclose(around[:, i], expected, atol=1e-12)
        entering = flow.supplied[:, i].clip(0).sum() - flow.loss[:, i].clip(None, 0).sum()
        assert sum(s.flow for s in paths) == pytest.approx(entering) or given[i] < 0
    assert np.isnan(total[5])
    assert np.isnan(around[:, 5]).all()
    np.testing.assert_allclose(total[:4], [0.0, 40.0, 0.0, 30.0], atol=1e-9)


def test_cases_of_the_unit() -> None:
    """Split; all through it and more comes back beside it; back through it; idle; nothing beside it; no solution."""
    given = np.array([100.0, 100.0, 100.0, 100.0, 100.0, np.nan])
    unit = np.array([30.0, 130.0, -40.0, 0.0, 100.0, 1.0])
    flow = flow_of(powers(given, unit))
    names = ["idle", "split", "series", "positive recirculation", "negative recirculation", ""]
    assert [names[k] for k in flow.cases(2)] == [
        "split", "positive recirculation", "negative recirculation", "idle", "series", "",
    ]  # fmt: skip
    np.testing.assert_allclose(flow.entering(2)[:5], [30, 130, 40 / 0.9, 0, 100])
    np.testing.assert_allclose(flow.leaving(2)[:5], [27, 117, 40, 0, 90])
    np.testing.assert_allclose(flow.own()[2][:5], [3, 13, 40 / 0.9 - 40, 0, 10])


def test_a_loop_that_carries_more_than_what_goes_on() -> None:
    """300 W into the unit, 200 W of them on the loop, 70 W beyond it: still positive recirculation."""
    flow = flow_of(powers(np.array([100.0]), np.array([300.0])))
    np.testing.assert_allclose(flow.circulation[0], 200.0)
    assert flow.cases(2).tolist() == [3]


def test_losses_below_zero_bring_power_in() -> None:
    """A unit that gives 110 % of what it takes, such as one with a mapped efficiency beyond its map."""
    flow = flow_of(powers(np.array([100.0]), np.array([30.0]), eta=1.1))
    assert sum(path.flow for path in flow.strands(0)[1]) == pytest.approx(103.0)


def test_drag_is_where_power_is_wanted_if_nothing_else_is() -> None:
    """A load that takes all as a loss: series and split as with a delivery."""
    flow = flow_of(powers(np.array([100.0, 100.0]), np.array([100.0, 30.0])))
    loss = flow.loss.copy()
    loss[3] = flow.delivered[3]
    dragged = replace(flow, loss=loss, delivered=np.zeros_like(loss))
    assert dragged.cases(2).tolist() == flow.cases(2).tolist() == [2, 1]


def test_what_is_below_the_floor_counts_as_nothing() -> None:
    """A billionth of the largest power."""
    small = flow_of(powers(np.array([1e12, 1.0]), np.array([3e11, 1.3])))  # each point by itself
    assert small.cases(2).tolist() == [1, 3]
    flow = flow_of(powers(np.array([100.0, 100.0]), np.array([5e-8, 5e-7])))
    np.testing.assert_allclose(flow.floor, 1e-7)
    assert flow.cases(2).tolist() == [0, 1]
    beside = flow_of(powers(np.array([100.0, 100.0]), np.array([100.0 - 5e-8, 100.0 - 5e-7])))
    assert beside.cases(2).tolist() == [2, 1]
