"""Bipartite matching of equations to variables by augmenting paths; strongly connected components."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import casadi as ca


class Matching:
    """A growing matching; ``adjacent(e)`` lists the variables of equation e, best candidates first."""

    def __init__(self, adjacent: Callable[[int], Iterable[int]]) -> None:
        self.adjacent = adjacent
        self.variable_of: dict[int, int] = {}
        self.equation_of: dict[int, int] = {}
        self.seen_equations: set[int] = set()
        self.seen_variables: set[int] = set()

    def release(self, variable: int) -> int | None:
        """Free a variable; return the equation matched to it."""
        equation = self.equation_of.pop(variable, None)
        if equation is not None:
            del self.variable_of[equation]
        return equation

    def augment(self, start: int) -> bool:
        """Find a variable for equation ``start`` along a shortest path; after a failure ``seen_*`` hold what was reached."""
        via: dict[int, int] = {}
        self.seen_equations, self.seen_variables = {start}, set()
        queue = deque([start])
        while queue:
            e = queue.popleft()
            for v in self.adjacent(e):
                if v in self.seen_variables:
                    continue
                self.seen_variables.add(v)
                via[v] = e
                owner = self.equation_of.get(v)
                if owner is None:
                    self._flip(v, via, start)
                    return True
                self.seen_equations.add(owner)
                queue.append(owner)
        return False

    def _flip(self, v: int, via: dict[int, int], start: int) -> None:
        while True:
            e = via[v]
            previous = self.variable_of.get(e)
            self.equation_of[v], self.variable_of[e] = e, v
            if e == start or previous is None:
                return
            v = previous


def components(successors: Sequence[Sequence[int]]) -> list[list[int]]:
    """Strongly connected components of a directed graph, each after all to which it points."""
    n, arrows = len(successors), [(head, tail) for tail, heads in enumerate(successors) for head in heads]
    _, vertices, ends = ca.Sparsity.triplet(n, n, [head for head, _ in arrows], [tail for _, tail in arrows]).scc()
    return [list(vertices[first:last]) for first, last in pairwise(ends)]
