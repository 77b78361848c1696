"""What a unit measures, and the unit of an expression where its operations keep it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from functools import lru_cache

import casadi as ca

from powertrain.language.symbols import Symbol, key
from powertrain.language.units import factors, unknown

Measure = tuple[float, tuple[tuple[str, int], ...]]
"""The size of a unit in SI units, and the powers of these."""
_N, _J, _W = {"kg": 1, "m": 1, "s": -2}, {"kg": 1, "m": 2, "s": -2}, {"kg": 1, "m": 2, "s": -3}
_V, _OHM, _PA = {**_W, "A": -1}, {**_W, "A": -2}, {"kg": 1, "m": -1, "s": -2}
UNITS: dict[str, tuple[float, dict[str, int]]] = {
    **{base: (1.0, {base: 1}) for base in ("m", "s", "kg", "A", "K", "mol", "cd", "degC", "degF")},
    "1": (1.0, {}), "rad": (1.0, {}), "deg": (math.pi / 180, {}), "Hz": (2 * math.pi, {"s": -1}), "rpm": (math.pi / 30, {"s": -1}),
    "N": (1.0, _N), "J": (1.0, _J), "W": (1.0, _W), "Pa": (1.0, _PA),
    "V": (1.0, _V), "C": (1.0, {"A": 1, "s": 1}), "F": (1.0, {"A": 2, "s": 4, "kg": -1, "m": -2}),
    "H": (1.0, {**_J, "A": -2}), "Ohm": (1.0, _OHM),
    "g": (1e-3, {"kg": 1}), "t": (1e3, {"kg": 1}), "km": (1e3, {"m": 1}), "mm": (1e-3, {"m": 1}), "cm": (1e-2, {"m": 1}),
    "l": (1e-3, {"m": 3}), "h": (3600.0, {"s": 1}), "min": (60.0, {"s": 1}),
    "bar": (1e5, _PA), "MPa": (1e6, _PA), "GPa": (1e9, _PA),
    "kW": (1e3, _W), "kJ": (1e3, _J), "MJ": (1e6, _J), "kWh": (3.6e6, _J), "Wh": (3.6e3, _J),
    "Nm": (1.0, _J), "kN": (1e3, _N), "kNm": (1e3, _J), "MW": (1e6, _W), "kPa": (1e3, _PA), "psi": (6894.757293168361, _PA),
    "hp": (745.6998715822702, _W), "PS": (735.49875, _W), "lbf": (4.4482216152605, _N), "lb": (0.45359237, {"kg": 1}),
    "mph": (0.44704, {"m": 1, "s": -1}), "kph": (1 / 3.6, {"m": 1, "s": -1}), "mi": (1609.344, {"m": 1}), "ft": (0.3048, {"m": 1}),
    "in": (0.0254, {"m": 1}), "gal": (3.785411784e-3, {"m": 3}), "ms": (1e-3, {"s": 1}), "Ah": (3600.0, {"A": 1, "s": 1}),
    "kV": (1e3, _V), "mOhm": (1e-3, _OHM), "%": (0.01, {}),
}  # fmt: skip
"""The size of a unit in SI units and the powers of these: the units of components, and below those of every day."""
_KEEPING = frozenset({ca.OP_FABS, ca.OP_NEG, ca.OP_FMIN, ca.OP_FMAX, ca.OP_ADD, ca.OP_SUB, ca.OP_IF_ELSE_ZERO})


@lru_cache(maxsize=1024)
def measure(unit: str) -> Measure:
    """What a unit is in terms of SI units, to twelve digits so that equal units compare equal; an angle is a number.

    >>> measure("rad/s") == measure("1/s"), measure("rpm") == measure("rad/s"), measure("N.m.s") == measure("W.s2")
    (True, False, True)
    """
    size, powers = exact(unit)
    return float(f"{size:.12g}"), powers


def exact(unit: str) -> Measure:
    """What a unit is in terms of SI units. Errors: ModelError for an unknown unit."""
    size, powers = 1.0, Counter[str]()
    for name, power in factors(unit):
        if name not in UNITS:
            raise unknown(name, unit, UNITS)
        factor, inside = UNITS[name]
        size *= factor**power
        for base, exponent in inside.items():
            powers[base] += power * exponent
    return size, tuple(sorted((base, power) for base, power in powers.items() if power))


def unit_of(expression: Symbol, units: Mapping[int, str]) -> str | None:
    """The unit of a variable or a map, also of its size, of limits on it, of sums and of choices; None where an operation may change it."""
    while key(expression) not in units:
        if (
            expression.is_symbolic()
            or expression.is_constant()
            or expression.is_output()
            or expression.op() not in _KEEPING
        ):
            return None
        inner = [operand for operand in _operands(expression) if not operand.is_constant()]
        if not inner:
            return None
        expression = inner[0]
    return units[key(expression)]


def units_of_terms(expression: Symbol, units: Mapping[int, str]) -> list[str]:
    """The units of the variables in a sum or a choice, without those whose operations may change them."""
    found, seen, stack = dict[str, None](), set[int](), [expression]
    while stack:
        term = stack.pop()
        if key(term) in seen:
            continue
        seen.add(key(term))
        if key(term) in units:
            found[units[key(term)]] = None
        elif term.n_dep() and not term.is_output() and term.op() in _KEEPING:
            stack += reversed(_operands(term))
    return list(found)


def _operands(expression: Symbol) -> list[Symbol]:
    """What an operation that keeps units is applied to; a choice is a sum whose terms also have a condition, as their first operand."""
    first = 1 if expression.op() == ca.OP_IF_ELSE_ZERO else 0
    return [expression.dep(i) for i in range(first, expression.n_dep())]
