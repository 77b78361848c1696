"""Values limited to a range."""

from __future__ import annotations

import casadi as ca

from powertrain import Symbol


def limited(value: Symbol, low: Symbol | float = 0.0, high: Symbol | float = 1.0) -> Symbol:
    """``value`` within ``low`` to ``high``, else the limit that it exceeds; all in the unit of ``value``."""
    return ca.fmin(ca.fmax(value, low), high)
