"""Bipartite matching of equations to variables by augmenting paths; strongly connected components."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence


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
    """Strongly connected components of a directed graph, each after all to which it points (Tarjan, without recursion)."""
    n = len(successors)
    order, low, on_stack = [-1] * n, [0] * n, [False] * n
    stack: list[int] = []
    result: list[list[int]] = []
    counter = 0
    for root in range(n):
        if order[root] >= 0:
            continue
        work = [(root, 0)]
        while work:
            node, i = work.pop()
            if i == 0:
                order[node] = low[node] = counter
                counter += 1
                stack.append(node)
                on_stack[node] = True
            if i < len(successors[node]):
                work.append((node, i + 1))
                child = successors[node][i]
                if order[child] < 0:
                    work.append((child, 0))
                elif on_stack[child]:
                    low[node] = min(low[node], order[child])
                continue
            if low[node] == order[node]:
                members = [stack.pop()]
                while members[-1] != node:
                    members.append(stack.pop())
                for member in members:
                    on_stack[member] = False
                result.append(members[::-1])
            if work:
                parent = work[-1][0]
                low[parent] = min(low[parent], low[node])
    return result
