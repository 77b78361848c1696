"""Directed flows split into cycles and paths.

A flow on a directed graph is a sum of flows on cycles and on paths from its sources to its sinks. If cycles share edges or paths cross, the
sum is not unique. The rule here: cycles before paths, always the one whose weakest edge carries most, and among these the one with the
fewest edges. With a single loop the circulating flow is unique, whatever the rule: the smallest flow on its edges.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.matching import components
from powertrain.language.reals import Array

Edge = tuple[int, int]


@dataclass(frozen=True)
class Strand:
    """A cycle or a path: its flow, and its edges in order."""

    flow: float
    edges: tuple[int, ...]


def decompose(
    edges: Sequence[Edge], flow: Array, sources: set[int], sinks: set[int], floor: float
) -> tuple[list[Strand], list[Strand]]:
    """Cycles and paths of a flow. ``flow`` is not negative; values up to ``floor`` count as zero."""
    left = np.array(flow, float)

    def cycle(added: list[int], k: int) -> list[int] | None:
        back = way(edges, added, {edges[k][1]}, {edges[k][0]})
        return None if back is None else [*back, k]

    def path(added: list[int], k: int) -> list[int] | None:
        return way(edges, [*added, k], sources, sinks)

    return _taken(left, floor, cycle), _taken(left, floor, path)


def loops(edges: Sequence[Edge], count: int) -> list[list[int]] | None:
    """The cycles of a graph of ``count`` vertices, as edges, if no two of them share a vertex; otherwise None."""
    successors: list[list[int]] = [[] for _ in range(count)]
    for tail, head in edges:
        successors[tail].append(head)
    group = np.zeros(count, int)
    for i, members in enumerate(components(successors)):
        group[members] = i
    inner = [k for k, (tail, head) in enumerate(edges) if group[tail] == group[head]]
    leaving: dict[int, int] = {}
    for k in inner:
        if edges[k][0] in leaving:
            return None
        leaving[edges[k][0]] = k
    found: list[list[int]] = []
    while leaving:
        start = vertex = next(iter(leaving))
        cycle: list[int] = []
        while vertex in leaving:
            cycle.append(leaving.pop(vertex))
            vertex = edges[cycle[-1]][1]
        assert vertex == start
        found.append(cycle)
    return found


def _taken(left: Array, floor: float, completed: Callable[[list[int], int], list[int] | None]) -> list[Strand]:
    """Subtract one strand after another from ``left``, always the widest.

    Edges are added, the strongest first, until one completes a strand with those before it.
    """
    found: list[Strand] = []
    while strand := _widest(left, floor, completed):
        amount = float(left[strand].min())
        left[strand] -= amount
        found.append(Strand(amount, tuple(strand)))
    return found


def _widest(left: Array, floor: float, completed: Callable[[list[int], int], list[int] | None]) -> list[int] | None:
    order: NDArray[np.intp] = np.argsort(-left, kind="stable")
    usable = [int(k) for k in order if left[k] > floor]
    return next((strand for i, k in enumerate(usable) if (strand := completed(usable[:i], k))), None)


def way(edges: Sequence[Edge], usable: Sequence[int], starts: set[int], ends: set[int]) -> list[int] | None:
    """The edges of a shortest path over usable edges; [] if start and end coincide, None if there is no path."""
    reached: dict[int, int | None] = dict.fromkeys(sorted(starts))
    front = list(reached)
    while front:
        for vertex in front:
            if vertex in ends:
                path: list[int] = []
                while (k := reached[vertex]) is not None:
                    path.insert(0, k)
                    vertex = edges[k][0]
                return path
        following: list[int] = []
        for k in usable:
            tail, head = edges[k]
            if tail in front and head not in reached:
                reached[head] = k
                following.append(head)
        front = following
    return None
