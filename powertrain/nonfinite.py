"""Where a value that is not finite comes from: the line of text whose operation makes it out of finite values."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.numerics.tape import again, graph_of
from powertrain.signals import signals_of

_MOST = 3
_AHEAD = (0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3)
_NAMES = {
    ca.OP_DIV: "division",
    ca.OP_INV: "division",
    ca.OP_SQRT: "square root",
    ca.OP_LOG: "logarithm",
    ca.OP_POW: "power",
    ca.OP_ASIN: "arcsine",
    ca.OP_ACOS: "arccosine",
    ca.OP_EXP: "exponential",
}


def explain(compiled: Compiled, t: float, y: Array, m: Array, p: Array) -> str:
    """The lines of text behind a value that is not finite at a point or just ahead of it; empty where none is found."""
    dae, n = compiled.dae, compiled.dae.x.numel()
    rates = dae.function("ahead", dae.xdot)
    z, m, p = y[n : n + dae.z.numel()], m[: dae.m.numel()], p[: dae.p.numel()]
    slope = np.nan_to_num(np.array(rates(t, y[:n], z, m, p), float).ravel())
    for ahead in _AHEAD:
        step = ahead * max(1.0, abs(t))
        found = _at(compiled, [t + step, y[:n] + step * slope, z, m, p])
        if found:
            return found
    return ""


def _at(compiled: Compiled, point: Sequence[float | Array]) -> str:
    """What is said of one point."""
    source, dae = compiled.source, compiled.dae
    texts = [(e.place, e.residual) for e in source.equations]
    texts += [(place, v) for place, law in source.laws for v in vars(law).values() if isinstance(v, ca.SX)]
    symbols = {key(s): s for _, e in texts for s in free_symbols(e)}
    values = signals_of(compiled).resolve(list(symbols.values()))
    numbers = np.array(dae.function("all", column(values))(*point), float).ravel()
    known = dict(zip(symbols, numbers.tolist(), strict=True))
    if all(np.isfinite(numbers)):
        return ""
    origins: dict[str, None] = {}
    for place, expression in texts:
        what = _origin(expression, known)
        if what:
            origins[f"{place}: {what}"] = None
    if origins:
        return "\n  ".join(["it comes from", *list(origins)[:_MOST]])
    return _loose(compiled, known, symbols)


def _origin(expression: Symbol, known: dict[int, float]) -> str | None:
    """The operation that makes a value that is not finite out of finite ones."""
    values = dict[int, float]()
    for place, (node, operands) in graph_of(expression).items():
        numbers = [values[key(operand)] for operand in operands]
        if not numbers:
            values[place] = known[place] if node.is_symbolic() else float(node)
            continue
        values[place] = float(ca.evalf(again(node, [Symbol(v) for v in numbers])))
        if not np.isfinite(values[place]) and np.isfinite(numbers).all():
            name = "function" if node.is_output() else _NAMES.get(node.op(), "operation")
            return f"{name} of {' and '.join(f'{v:.6g}' for v in numbers)}"
    return None


def _has_infinity(expression: Symbol) -> bool:
    """Whether one of the numbers in an expression is not finite."""
    return any(node.is_constant() and not np.isfinite(float(node)) for node, _ in graph_of(expression).values())


def _loose(compiled: Compiled, known: dict[int, float], symbols: dict[int, Symbol]) -> str:
    """The lines with what is not finite, where no single one of them is to blame."""
    lost = [k for k, value in known.items() if not np.isfinite(value)]
    infinite = [str(e.place) for e in compiled.source.equations if _has_infinity(e.residual)]
    if infinite:
        return "\n  ".join(["it comes from a number that is not finite in", *infinite[:_MOST]])
    rows = [
        (sum(key(s) in lost for s in free_symbols(e.residual)), str(e.place))
        for e in compiled.source.equations
        if any(key(s) in lost for s in free_symbols(e.residual))
    ]
    rows.sort(key=lambda row: row[0])
    places = list(dict.fromkeys(place for _, place in rows))[:_MOST]
    names = ", ".join([symbols[k].name() for k in lost if not symbols[k].name().startswith("der(")][:_MOST])
    said = (
        f"the equations do not determine {names} there; what moves may be loose: put an inertia, mass or damper between"
    )
    return "\n  ".join([said, *places])
