"""Where an expression has no real value: roots and logarithms of negative numbers, arcsines of numbers beyond one.

CasADi computes nan there, and fmin, fmax and comparisons drop a nan without a word: fmin(sqrt(-1), 2) is 2. The arguments that
interval arithmetic does not place inside the domain get a guard, at which a run ends. Within the tolerance of the guard, they count as the
limit of the domain.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import casadi as ca

from powertrain.compiler.flat import Flat, rewritten
from powertrain.compiler.intervals import ALL, POSITIVE, UNIT, Interval, interval_of
from powertrain.compiler.operations import operation
from powertrain.dae.tolerances import LIMIT
from powertrain.language.dimensions import unit_of
from powertrain.language.recorder import Guard, Place
from powertrain.language.symbols import Symbol, key
from powertrain.numerics.tape import again, graph_of

_DOMAINS: dict[int, tuple[str, Interval]] = {
    ca.OP_SQRT: ("the argument of a square root", POSITIVE),
    ca.OP_LOG: ("the argument of a logarithm", POSITIVE),
    ca.OP_LOG1P: ("the argument of log1p", (-1.0, math.inf)),
    ca.OP_ASIN: ("the argument of an arcsine", UNIT),
    ca.OP_ACOS: ("the argument of an arccosine", UNIT),
    ca.OP_ATANH: ("the argument of an inverse hyperbolic tangent", UNIT),
    ca.OP_ACOSH: ("the argument of an inverse hyperbolic cosine", (1.0, math.inf)),
    ca.OP_POW: ("the base of a power", POSITIVE),
    ca.OP_CONSTPOW: ("the base of a power", POSITIVE),
}
"""What may leave its domain in an operation, and the domain of its first operand."""


def guard_domains(flat: Flat) -> Flat:
    """The model with guards for the arguments that may leave the domain of a root, a logarithm or the like."""
    active = flat.recorder
    known = {key(c.symbol): (c.low, c.high) for c in flat.parameters}
    lines: list[tuple[Place | str, Symbol, str]] = [(place, expression, "error") for place, expression in flat.lines()]
    lines += [(g.where, g.value, "start" if g.action == "start" else "error") for g in active.guards]
    found, unsafe = dict[tuple[int, Interval], Guard](), dict[int, Interval]()
    for place, expression, action in lines:
        for operation_key, what, argument, (low, high) in unsafe_arguments(expression, known):
            unsafe[operation_key] = low, high
            unit = unit_of(argument, active.units) or "1"
            guard = Guard(what, place, argument, Symbol(low), Symbol(high), unit, action)
            found.setdefault((key(argument), (low, high)), guard)
    if not found:
        return flat
    guarded = replace(flat, recorder=replace(active, guards=[*active.guards, *found.values()]))
    return rewritten(guarded, lambda listed: _rounded(listed, unsafe))


def _rounded(expressions: Sequence[Symbol], unsafe: Mapping[int, Interval]) -> list[Symbol]:
    """The expressions; arguments of the ``unsafe`` operations (by keys) that are beyond the domain by round-off are at its limit."""
    new: dict[int, Symbol] = {}
    for place, (node, operands) in graph_of(*expressions).items():
        inner = [new[key(o)] for o in operands]
        if place in unsafe:
            inner[0] = _at_limit(inner[0], *unsafe[place])
        same = all(key(one) == key(other) for one, other in zip(inner, operands, strict=True))
        new[place] = node if same else again(node, inner)
    return [new[key(e)] for e in expressions]


def _at_limit(argument: Symbol, low: float, high: float) -> Symbol:
    for limit, beyond in ((low, low - argument), (high, argument - high)):
        if math.isfinite(limit):
            near = ca.logic_and(beyond > 0.0, beyond <= LIMIT * (1.0 + abs(limit)))
            argument = ca.if_else(near, limit, argument)
    return argument


def unsafe_arguments(expression: Symbol, known: Mapping[int, Interval]) -> Iterator[tuple[int, str, Symbol, Interval]]:
    """(key of the operation, what, argument, domain) where an expression may have no value; ``known``: ranges of symbols by their keys.

    Operations in a branch, which count only where it is taken, are left out.
    """
    graph = graph_of(expression)
    if all(operation(node) not in _DOMAINS for node, _ in graph.values()):
        return
    ranges: dict[int, Interval] = {}
    for place, (node, operands) in graph.items():
        if not operands:
            ranges[place] = (float(node), float(node)) if node.is_constant() else known.get(place, ALL)
        else:
            same = len({key(o) for o in operands}) == 1
            ranges[place] = interval_of(operation(node), [ranges[key(o)] for o in operands], same)
    for at in _always_computed(expression, graph):
        node, operands = graph[at]
        if operation(node) not in _DOMAINS or _may_be_whole(operands):
            continue
        what, (low, high) = _DOMAINS[operation(node)]
        least, most = ranges[key(operands[0])]
        if not (low <= least and most <= high):
            yield at, what, operands[0], (low, high)


def _may_be_whole(operands: list[Symbol]) -> bool:
    """Whether a power may have a whole number as exponent, with which negative numbers have powers."""
    power = operands[1] if len(operands) > 1 else None
    return power is not None and not (power.is_constant() and not float(power).is_integer())


def _always_computed(expression: Symbol, graph: Mapping[int, tuple[Symbol, list[Symbol]]]) -> list[int]:
    """The nodes outside the branches of if_else."""
    found, stack = dict[int, None](), [key(expression)]
    while stack:
        place = stack.pop()
        if place in found:
            continue
        found[place] = None
        node, operands = graph[place]
        stack += [key(o) for o in operands[: 1 if operation(node) == ca.OP_IF_ELSE_ZERO else None]]
    return list(found)
