"""Pickling of symbolic records: SX expressions that share symbols go through one CasADi Function."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import casadi as ca

from powertrain.compiler.hybrid import HybridDae

_SYMBOLS = ("t", "x", "z", "m", "p")


@dataclass(frozen=True)
class _Slot:
    """Stands for the k-th expression."""

    k: int


@dataclass(frozen=True)
class Packed:
    """A model whose expressions are replaced by slots, and the function of (t, x, z, m, p) that gives them."""

    skeleton: dict[str, Any]
    function: ca.Function


def pack(dae: HybridDae) -> Packed:
    """A form of the model that pickles."""
    expressions: list[ca.SX] = []

    def strip(value: Any) -> Any:
        if isinstance(value, ca.SX):
            expressions.append(value)
            return _Slot(len(expressions) - 1)
        if isinstance(value, tuple):
            return tuple(strip(item) for item in value)
        if is_dataclass(value) and not isinstance(value, type):
            return type(value), {f.name: strip(getattr(value, f.name)) for f in fields(value)}
        return value

    skeleton = {f.name: strip(getattr(dae, f.name)) for f in fields(dae) if f.name not in _SYMBOLS}
    return Packed(skeleton, ca.Function("powertrain_packed", [getattr(dae, s) for s in _SYMBOLS], expressions))


def unpack(packed: Packed) -> HybridDae:
    """The model again, on symbols of its own."""
    sizes = [packed.function.size1_in(i) for i in range(len(_SYMBOLS))]
    symbols: dict[str, Any] = {name: ca.SX.sym(name, size) for name, size in zip(_SYMBOLS, sizes, strict=True)}
    expressions = packed.function.call(list(symbols.values()))

    def fill(value: Any) -> Any:
        if isinstance(value, _Slot):
            return expressions[value.k]
        if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], type):
            return value[0](**{name: fill(item) for name, item in value[1].items()})
        if isinstance(value, tuple):
            return tuple(fill(item) for item in value)
        return value

    return HybridDae(**symbols, **{name: fill(item) for name, item in packed.skeleton.items()})
