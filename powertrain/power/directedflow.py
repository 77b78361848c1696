"""The powers of many points on the graph of a model: their directions, what circulates, and the cases of a variator.

Vertices: the components, the nodes, the source of all power, and its destinations: lost, delivered, stored. Edges: the terminals in the
direction of their power, and those from the source and to the destinations.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from powertrain.language.reals import Array
from powertrain.power.circulation import Edge, Strand, decompose, loops
from powertrain.power.powergraph import PowerGraph
from powertrain.power.variator import IDLE, NEGATIVE, POSITIVE, SERIES, SPLIT, VARIATOR_CASES, goes_beside

Matrix = NDArray[np.float64]
ENDS = ("loss", "delivered", "stored")
FLOOR = 1e-9
"""Power below this share of the largest power at a point counts as zero."""


@dataclass(frozen=True)
class DirectedFlow:
    """Powers, one column per point: into the components at the terminals; and supplied, lost, delivered and stored by the components."""

    graph: PowerGraph
    power: Matrix
    supplied: Matrix
    loss: Matrix
    delivered: Matrix
    stored: Matrix

    @cached_property
    def _outer(self) -> Matrix:
        """Power entering the model (supplied, released from storage, from negative losses) and leaving it (lost, delivered, stored)."""
        entering = [self.supplied, np.maximum(-self.stored, 0.0), np.maximum(-self.loss, 0.0)]
        return np.concatenate([*entering, np.maximum(self.loss, 0.0), self.delivered, np.maximum(self.stored, 0.0)])

    @cached_property
    def _outer_edges(self) -> list[Edge]:
        C, source = len(self.graph.components), self._source
        into = [(source, c) for _ in range(3) for c in range(C)]
        return into + [(c, source + 1 + k) for k in range(len(ENDS)) for c in range(C)]

    @property
    def _source(self) -> int:
        return len(self.graph.components) + len(self.graph.nodes)

    @property
    def floor(self) -> Array:
        """The power that counts as zero at every point."""
        floor: Array = FLOOR * np.abs(self.power).max(axis=0, initial=0.0)
        return floor

    def edges(self, point: int) -> list[Edge]:
        """All edges in the direction of their power at one point."""
        return [*self._directed(self.power[:, point]), *self._outer_edges]

    def end(self, strand: Strand) -> str:
        """Where a path ends."""
        return ENDS[self._outer_edges[strand.edges[-1] - len(self.power)][1] - self._source - 1]

    def strands(self, point: int) -> tuple[list[Strand], list[Strand]]:
        """Cycles and paths at one point."""
        power = self.power[:, point]
        if not np.isfinite(power).all():
            return [], []
        flow = np.concatenate([np.abs(power), self._outer[:, point]])
        ends = {self._source + 1 + k for k in range(len(ENDS))}
        return decompose(self.edges(point), flow, {self._source}, ends, FLOOR * float(flow.max(initial=0.0)))

    @cached_property
    def circulation(self) -> tuple[Array, Matrix]:
        """Circulating power at every point, and the circulating part of the power at every terminal.

        Points with the same directions of power share their cycles. If these have no vertex in common, the flow on each cycle is the
        smallest flow on its edges.
        """
        power = self.power
        total, around = np.zeros(power.shape[1]), np.zeros(power.shape)
        for points, usable in self._patterns:
            edges = self._directed(power[:, points[0]])
            cycles = loops([edges[k] for k in usable], self._source)
            if cycles is None:
                for i in points:
                    for strand in self.strands(i)[0]:
                        total[i] += strand.flow
                        around[list(strand.edges), i] += strand.flow
                continue
            for cycle in cycles:
                places = np.ix_(np.array([usable[k] for k in cycle]), points)
                least = np.abs(power[places]).min(axis=0)
                total[points] += least
                around[places] += least
        lost = ~np.isfinite(power).all(axis=0)
        total[lost] = np.nan
        around[:, lost] = np.nan
        return total, around

    @cached_property
    def _patterns(self) -> list[tuple[NDArray[np.intp], list[int]]]:
        """Groups of points with the same directions of power, with the terminals that carry power."""
        finite = np.flatnonzero(np.isfinite(self.power).all(axis=0))
        if not finite.size or not len(self.power):
            return []
        some = self.power[:, finite]
        signs = np.where(np.abs(some) > FLOOR * np.abs(some).max(axis=0), np.sign(some), 0.0)
        kinds, which = np.unique(signs, axis=1, return_inverse=True)
        which = which.ravel()
        return [(finite[which == i], np.flatnonzero(kinds[:, i]).tolist()) for i in range(kinds.shape[1])]

    def _directed(self, power: Array) -> list[Edge]:
        C = len(self.graph.components)
        ends = [(C + t.node, t.component) for t in self.graph.terminals]
        return [(n, c) if p > 0 else (c, n) for (n, c), p in zip(ends, power, strict=True)]

    def entering(self, v: int) -> Array:
        """Power into a component."""
        flows: Array = np.maximum(self.power[self.graph.of_component(v)], 0.0).sum(axis=0)
        return flows

    def leaving(self, v: int) -> Array:
        """Power out of a component."""
        flows: Array = np.maximum(-self.power[self.graph.of_component(v)], 0.0).sum(axis=0)
        return flows

    def own(self) -> Matrix:
        """Power into every component minus power out of it."""
        result = np.zeros(self.supplied.shape)
        for k, terminal in enumerate(self.graph.terminals):
            result[terminal.component] += self.power[k]
        return result

    def cases(self, v: int) -> NDArray[np.intp]:
        """The index of a variator's case in ``VARIATOR_CASES`` at every point; one past the end if there is no solution."""
        terminals = self.graph.of_component(v)
        into, around = self.entering(v), self.circulation[1][terminals]
        left = self.leaving(v) - around.sum(axis=0) / 2
        floor = self.floor
        on_loop = np.asarray((around > 0.0).any(axis=0))
        case = np.full(self.power.shape[1], len(VARIATOR_CASES))
        for points, usable in self._patterns:
            edges = self._directed(self.power[:, points[0]])
            kept = [edges[k] for k in usable]
            case[points] = np.where(left[points] > floor[points], POSITIVE, NEGATIVE)
            apart = points[~on_loop[points]]
            kinds, which = np.unique(self._outer[:, apart] > floor[apart], axis=1, return_inverse=True)
            for i in range(kinds.shape[1]):
                beside = goes_beside(v, [*kept, *self._ends(kinds[:, i], {tail for tail, _ in kept})])
                case[apart[which.ravel() == i]] = SPLIT if beside else SERIES
            case[points[into[points] <= floor[points]]] = IDLE
        return case

    def _ends(self, used: NDArray[np.bool_], passing: set[int]) -> list[Edge]:
        """Edges from the supplies (or, if there are none, from released storage), and to the useful destinations.

        These are the deliveries; if there are none, components that pass nothing on and lose all they receive (drag); else storage.
        """
        supplied, released, _, loss, delivered, stored = (
            np.flatnonzero(block).tolist() for block in used.reshape(6, len(self.graph.components))
        )
        wanted = delivered or [c for c in loss if c not in passing] or stored
        return [*((-1, c) for c in supplied or released), *((c, -2) for c in wanted)]
