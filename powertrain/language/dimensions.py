"""What a unit measures, and the unit of an expression where its operations keep it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import lru_cache

import casadi as ca

from powertrain.language.symbols import Symbol, key

Measure = tuple[float, tuple[tuple[str, int], ...]]
"""The size of a unit in SI units, and the powers of these."""
_N, _J, _W = {"kg": 1, "m": 1, "s": -2}, {"kg": 1, "m": 2, "s": -2}, {"kg": 1, "m": 2, "s": -3}
_V, _OHM = {**_W, "A": -1}, {**_W, "A": -2}
_UNITS: dict[str, tuple[float, dict[str, int]]] = {
    **{base: (1.0, {base: 1}) for base in ("m", "s", "kg", "A", "K", "mol", "cd", "degC")},
    "1": (1.0, {}), "rad": (1.0, {}), "deg": (math.pi / 180, {}), "Hz": (2 * math.pi, {"s": -1}), "rpm": (math.pi / 30, {"s": -1}),
    "N": (1.0, _N), "J": (1.0, _J), "W": (1.0, _W), "Pa": (1.0, {"kg": 1, "m": -1, "s": -2}),
    "V": (1.0, _V), "C": (1.0, {"A": 1, "s": 1}), "F": (1.0, {"A": 2, "s": 4, "kg": -1, "m": -2}),
    "H": (1.0, {**_J, "A": -2}), "Ohm": (1.0, _OHM),
    "g": (1e-3, {"kg": 1}), "t": (1e3, {"kg": 1}), "km": (1e3, {"m": 1}), "mm": (1e-3, {"m": 1}), "cm": (1e-2, {"m": 1}),
    "l": (1e-3, {"m": 3}), "h": (3600.0, {"s": 1}), "min": (60.0, {"s": 1}),
    "bar": (1e5, {"kg": 1, "m": -1, "s": -2}), "MPa": (1e6, {"kg": 1, "m": -1, "s": -2}), "GPa": (1e9, {"kg": 1, "m": -1, "s": -2}),
    "kW": (1e3, _W), "kJ": (1e3, _J), "MJ": (1e6, _J), "kWh": (3.6e6, _J), "Wh": (3.6e3, _J),
}  # fmt: skip
_FACTOR = re.compile(r"([A-Za-z]+|1)(-?\d+)?$")
_KEEPING = frozenset({ca.OP_FABS, ca.OP_NEG, ca.OP_FMIN, ca.OP_FMAX, ca.OP_ADD, ca.OP_SUB})


@lru_cache(maxsize=1024)
def measure(unit: str) -> Measure:
    """What a unit is in terms of SI units; an angle is a number.

    >>> measure("rad/s") == measure("1/s"), measure("rpm") == measure("rad/s"), measure("N.m.s") == measure("W.s2")
    (True, False, True)
    """
    size, powers = 1.0, dict[str, int]()
    above, _, below = unit.partition("/")
    for text, sign in (above, 1), (below.strip("()"), -1):
        for part in text.strip("()").split(".") if text else ():
            found = _FACTOR.match(part)
            assert found is not None, unit
            power = sign * int(found[2] or 1)
            factor, inside = _UNITS[found[1]]
            size *= factor**power
            for base, exponent in inside.items():
                powers[base] = powers.get(base, 0) + power * exponent
    return float(f"{size:.12g}"), tuple(sorted((base, power) for base, power in powers.items() if power))


def unit_of(expression: Symbol, units: Mapping[int, str]) -> str | None:
    """The unit of a variable, also of its size, of limits on it and of sums; None where an operation may change it."""
    while not expression.is_symbolic():
        if expression.is_constant() or expression.is_output() or expression.op() not in _KEEPING:
            return None
        inner = [expression.dep(i) for i in range(expression.n_dep()) if not expression.dep(i).is_constant()]
        if not inner:
            return None
        expression = inner[0]
    return units.get(key(expression))
