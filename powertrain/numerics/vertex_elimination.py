"""Sparse Jacobians of long expressions, by elimination of vertices.

The operations of an expression are the vertices of a graph, and the edges are their derivatives by their operands. To eliminate a vertex,
each edge into it is multiplied by each edge out of it, and the product is added to the edge that bypasses it. When only variables and
outputs are left, the edges are the Jacobian. Forward and reverse mode are two of many orders; CasADi's modes write a sweep for each
colour of columns or rows. Here the next vertex is the one that leaves the fewest edges, after H. Markowitz
(A. Griewank, S. Reese: On the calculation of Jacobian matrices by the Markowitz rule, in: Automatic Differentiation of Algorithms, SIAM
1991; A. Griewank, A. Walther: Evaluating Derivatives, SIAM 2008, sections 9.2 and 10.1).
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Sequence

import casadi as ca

from powertrain.language.symbols import Symbol, column, key, scalars
from powertrain.numerics.tape import again, graph_of

_ONE = Symbol(1)
_STEEP = frozenset((ca.OP_SQRT, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_ASIN, ca.OP_ACOS, ca.OP_ACOSH))
"""Operations with a value where their slope is infinite."""


def sparse_jacobian(outputs: Symbol, variables: Symbol) -> Symbol:
    """d(outputs)/d(variables) of two columns, sparse; duplicate products are left to ``ca.cse``.

    Otherwise like ``ca.jacobian``, also for operations without a derivative. CasADi turns a product with a conditional value into a
    conditional product, so slopes of branches that are not taken may be infinite.
    """
    graph = _Graph(scalars(ca.cse(outputs)), scalars(variables))
    graph.eliminate()
    found = {(j, i): slope for i, row in enumerate(graph.rows()) for j, slope in row.items()}
    places = sorted(found)  # column by column, CasADi's order
    rows, columns = [i for _, i in places], [j for j, _ in places]
    pattern = ca.Sparsity.triplet(outputs.numel(), variables.numel(), rows, columns)
    return Symbol(pattern, column([found[place] for place in places]))


class _Graph:
    """Vertices are numbered: variables, then operations in an order of computation, then outputs.

    ``into[v]`` are the operands of v with the slopes, ``out[v]`` those of which v is an operand. Operations that no variable affects have
    no vertex. ``steep`` are the edges whose slopes may be infinite, from vertices with ``branches`` before them. Such a slope vanishes if
    it meets a branch that is not taken, but becomes nan if it meets the sum of two. So the operands of steep edges are eliminated first,
    from the last one on: the order of reverse mode.
    """

    def __init__(self, outputs: Sequence[Symbol], variables: Sequence[Symbol]) -> None:
        self.into: list[dict[int, Symbol]] = [{} for _ in variables]
        self.out: list[dict[int, None]] = [{} for _ in variables]  # used as sets with a fixed order
        self.steep, self.branches = set[tuple[int, int]](), set[int]()
        numbers, slopes = {key(symbol): j for j, symbol in enumerate(variables)}, _Slopes()
        for place, (node, operands) in graph_of(*outputs).items():
            known = [numbers.get(key(operand)) for operand in operands]
            if place not in numbers and any(number is not None for number in known):
                by = zip(known, slopes.of(node, operands), strict=True)
                edges = [(number, slope) for number, slope in by if number is not None and not slope.is_zero()]
                if edges:
                    numbers[place] = self._add(edges)
                    self._mark(node, numbers[place])
        self._inner = range(len(variables), len(self.into))
        for node in outputs:
            self._add([(numbers[key(node)], _ONE)] if key(node) in numbers else [])

    def _mark(self, node: Symbol, number: int) -> None:
        before, code = self.branches.intersection(self.into[number]), None if node.is_output() else node.op()
        if before or code == ca.OP_IF_ELSE_ZERO:
            self.branches.add(number)
        if code in _STEEP:
            self.steep.update((operand, number) for operand in before)

    def _add(self, edges: Iterable[tuple[int, Symbol]]) -> int:
        """The number of a new vertex with these operands, which may contain duplicates."""
        number = len(self.into)
        self.into.append({})
        self.out.append({})
        for operand, slope in edges:
            self._connect(operand, number, slope)
        return number

    def _connect(self, operand: int, v: int, slope: Symbol) -> None:
        edges = self.into[v]
        # ca.SX.binary: operators take six times as long
        total = ca.SX.binary(ca.OP_ADD, edges[operand], slope) if operand in edges else slope
        if total.is_zero():
            edges.pop(operand, None)
            self.out[operand].pop(v, None)
        else:
            edges[operand] = total
            self.out[operand][v] = None

    def rows(self) -> list[dict[int, Symbol]]:
        """The edges into the outputs."""
        return self.into[self._inner.stop :]

    def eliminate(self) -> None:
        """Eliminate all vertices between variables and outputs."""
        heap = [self._rank(v) for v in self._inner]
        heapq.heapify(heap)
        open_ = set(self._inner)
        while heap:
            rank = heapq.heappop(heap)
            v = -rank[-1]
            if v in open_ and rank == self._rank(v):
                open_.discard(v)
                near = [*self.into[v], *self.out[v]]
                self._eliminate(v)
                for u in near:
                    if u in open_:
                        heapq.heappush(heap, self._rank(u))

    def _rank(self, v: int) -> tuple[int, int, int, int]:
        """Operands of steep edges first; then by the most edges that removing v may add, plus one; by followers; the last first."""
        enter, leave = len(self.into[v]), len(self.out[v])
        if any((v, follower) in self.steep for follower in self.out[v]):
            return 0, 0, 0, -v
        return 1, (enter - 1) * (leave - 1), leave, -v

    def _eliminate(self, v: int) -> None:
        before, after = self.into[v], self.out[v]
        for operand in before:
            del self.out[operand][v]
        for follower in after:
            slope = self.into[follower].pop(v)
            for operand, inner in before.items():
                self._connect(operand, follower, ca.SX.binary(ca.OP_MUL, slope, inner))
                if operand in self.branches and (v, follower) in self.steep:
                    self.steep.add((operand, follower))
        self.into[v], self.out[v] = {}, {}


class _Slopes:
    """Derivatives of single operations, as defined by CasADi."""

    def __init__(self) -> None:
        self._known: dict[int, ca.Function | list[Symbol]] = {}

    def of(self, node: Symbol, operands: Sequence[Symbol]) -> list[Symbol]:
        """By all operands."""
        if node.is_output():
            return list(_gradient(node, operands).call(operands))
        code = node.op()
        if code == ca.OP_MUL:
            return [operands[1], operands[0]]  # the most frequent case, without a call
        if code not in self._known:
            function = _gradient(node, operands)
            slopes = function.call(function.sx_in())
            self._known[code] = slopes if all(slope.is_constant() for slope in slopes) else function
        known = self._known[code]
        return known if isinstance(known, list) else list(known.call(operands))


def _gradient(node: Symbol, operands: Sequence[Symbol]) -> ca.Function:
    """The derivatives of one operation, or of one result of a call, with respect to its operands, as a function of these."""
    symbols = ca.vertsplit(ca.SX.sym("operand", len(operands)))
    value = again(node, symbols)
    slopes = ca.jtimes(value, column(symbols), _ONE, True).T
    known = ca.densify(ca.project(slopes, ca.jacobian_sparsity(value, column(symbols))))
    return ca.Function("powertrain_slopes", symbols, ca.horzsplit(known))
