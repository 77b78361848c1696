"""Values limited to a range."""

from __future__ import annotations

import casadi as ca

from powertrain import Symbol, switch


def limited(value: Symbol, low: Symbol | float = 0.0, high: Symbol | float = 1.0) -> Symbol:
    """``value`` within ``low`` to ``high``, else the limit that it exceeds; all in the unit of ``value``."""
    return ca.fmin(ca.fmax(value, low), high)


def limited_at(value: Symbol, low: Symbol | float, high: Symbol | float) -> Symbol:
    """``limited``, with an event where the value reaches a limit and where it leaves it, so that runs meet the corners."""
    raised = switch(value < low, low, value, continuous=True)
    return switch(value > high, high, raised, continuous=True)


def magnitude(value: Symbol) -> Symbol:
    """|value|, with an event where it changes its sign, so that runs meet the corner."""
    return switch(value >= 0, value, -value, continuous=True)


def smooth_step(x: Symbol) -> Symbol:
    """x^2 (3 - 2 x) with x within 0 to 1: a step whose slope is zero at both ends."""
    within = limited(x)
    return within**2 * (3 - 2 * within)


def limited_by(spring: Symbol, damping: Symbol) -> Symbol:
    """The force of a damper within -``spring`` to ``spring``, the force of the spring beside it: together they pull but never push.

    Where the spring is slack, the damper's slope is zero too, as linear models need it.
    """
    return ca.if_else(spring > 0, limited(damping, -spring, spring), 0)
