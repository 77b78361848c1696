"""Values limited to a range."""

from __future__ import annotations

import casadi as ca

from powertrain import Symbol


def limited(value: Symbol, low: Symbol | float = 0.0, high: Symbol | float = 1.0) -> Symbol:
    """``value`` within ``low`` to ``high``, else the limit that it exceeds; all in the unit of ``value``."""
    return ca.fmin(ca.fmax(value, low), high)


def limited_by(spring: Symbol, damping: Symbol) -> Symbol:
    """The force of a damper within -``spring`` to ``spring``, the force of the spring beside it: together they pull but never push.

    Where the spring is slack, the damper's slope is zero too, as linear models need it.
    """
    return ca.if_else(spring > 0, limited(damping, -spring, spring), 0)
