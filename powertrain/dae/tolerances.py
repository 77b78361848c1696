"""All tolerances of modes, events and operating points, with units and reasons: what counts as zero, and how accurate values are.

Numbers that control a method (pivots, ranks, step sizes) are defined where they are used.
"""

from __future__ import annotations

from typing import TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Size = TypeVar("Size", ca.SX, NDArray[np.float64])

# Speeds, gaps, conditions
EPS = 1e-10
"""Hysteresis of speeds (rad/s, m/s), of gaps (m), and of conditions without torques: far above the accuracy of events in time."""
ZONE = 2 * EPS
"""Speeds (rad/s, m/s) below this are rest."""
INTEGRATED = 3e-7
"""Uncertainty of a speed (rad/s, m/s) computed from states that no law sets to zero: 30 times their usual tolerance."""
CREEP = 1e-3
"""Stuck laws may creep this fast (rad/s, m/s; at an operating point also as a share of a speed) on parts without inertia: their compliance
is a speed there, 1e-7 rad/s for 1 N.m with a drag of 0.1 N.m.s/rad."""
OVERLAP = 1e-6
"""Sides of a contact (m, rad) may overlap by this at a start or after a jump: what rounded values of another run amount to."""
SWIFT = 1e-3
"""Rates (rad/s2, m/s2) above this give the direction of an uncertain prescribed speed, which is certain again within 0.1 ms."""
REST_SPEED = 1e-4
"""A contact that would rebound slower than this (m/s, rad/s) stays closed."""
STRUCK = 1e-9
"""Speeds after an impact are zero below this share of the largest speed before it."""
NOISE = 1e-6
"""Indicators (rad/s, m/s, N.m, N, m) need not be smooth within a step below this: the error of the states is as large."""
LIMIT = 1e-9
"""Allowed excess of a value beyond its limit, relative to 1 + |limit|: rounding of values that a model sets to the limit."""
JUMP = 1e-7
"""Allowed change at an event of a value that must not jump, relative to 1 + |value|: rounding of the instants at which signals bend."""

# Torques and forces
LEAST_TORQUE = 1e-9
"""Torques and forces (N.m, N) below this count as zero."""
RESOLVED = 1e-8
"""Uncertainty of torques in equilibrium with each other, relative to the largest: round-off through stiff couplings."""
SHARED = 1e-7
"""Uncertainty of a torque shared by compliance between laws on one motion, relative to the torques there: round-off over compliance."""
ALONE = 1e-10
"""Uncertainty of a torque that is alone on its motion, relative to the largest torque that it meets through other motions."""
ROUND_OFF = 1e-15
"""Uncertainty of a torque that is the difference of large ones, relative to these: a few units in the last place of the states, such as the
angles at the ends of a shaft after many turns. At an operating point, a speed of a stuck law below this share of the largest is zero."""
YIELDING = 1e-9
"""A law without a torque limit yields if its rate exceeds this share of its torque times its mobility: a fifth of what its compliance
gives way to a motion that others prescribe."""
INACCURATE = 1e-3
"""A law that shares its motion yields if its rate exceeds this share of the uncertainty of its torque times its mobility. Its last proximal
step then changes the torque by 1 % of the torques there, and what remains is the square of this share, 1e-4."""
NO_WIDTH = 1e-10
"""Limits of a law that differ by less than this (N.m, N) are equal: it transmits nothing, or always the same torque."""
CROSSED = 1e-6
"""Limits of a sliding law may cross by this share of the largest torque: the hysteresis of a switch in them."""
REVERSED = 0.1
"""Limits of a law may cross by what this share of the nominal sizes of the states makes of them: a limit that ends at zero has the error of
the integration."""
GIVEN = 1e-11
"""Others prescribe the motion of a law if its own torque moves it by less than this share of the terms that cancel."""

# Instants
NOW = 1e-12
"""Instants (s) within this, relative to one and to the time, are the same."""
BEGINNING = 1e-9
"""Events this soon (s) after the start, relative to max(1, |time|), belong to the start."""
SHORTEST = 1e-15
"""Steps (s) below this, relative to max(1, |time|), do not advance time: the run ends with an error."""

# Algebraic equations
FOUND = 1e-11
"""Newton's method for algebraic unknowns has converged when its step is below this, relative to 1 + |value|."""
SETTLED = 1e-9
"""The same at a corner of a signal, where the last step is applied as well: far below the tolerance of any run."""
STARTED = 1e-12
"""The same at the start of a run, whose error remains throughout."""
STILL = 1e-10
"""The same at an operating point, for torques as a share of the largest: round-off is larger with more unknowns."""
BALANCED = 1e-7
"""Residual of algebraic equations that counts as zero, relative to their terms."""
KINK = 1e-9
"""Residual (N.m, rad/s) that counts as zero where Newton's method oscillates about a kink."""
MISSED = 1e-9
"""A redundant start condition is violated if its error exceeds this, relative to 1 + |value|."""

# Operating points
REST = 1e-9
"""At an operating point: a speed or a condition counts as zero below this share of the terms that it is the sum of."""
SAME = 1e-6
"""Solutions that differ by less are one: operating points relative to 1 + |value|, torques at a start to 1 + the largest |torque|."""
ALIKE = 1e-9
"""Ends of an interval that differ relatively by less than this are one value: round-off through the balance of the model."""
NEUTRAL = 1e6
"""Time [s]: no slope holds a motion that takes longer to come to rest."""
LOCKED = 1e9
"""Torques that change by more than this for a unit change of a limit depend on round-off: the laws lock themselves."""
INFINITE = 1e12
"""Inputs, parameters and torques (in their units) above this count as infinite."""


def torque_tolerance(meeting: ca.SX, largest: ca.SX) -> ca.SX:
    """Uncertainty of the torque of a law: ``meeting`` are the torques in its own motion, ``largest`` the largest of all it meets."""
    return LEAST_TORQUE + SHARED * meeting + RESOLVED * largest


def alone_tolerance(largest: ca.SX) -> ca.SX:
    """Uncertainty of the torque of a law that is alone on its motion."""
    return LEAST_TORQUE + ALONE * largest


def balance_tolerance(largest: Size) -> Size:
    """Uncertainty of the torques at an operating point, of which ``largest`` is the largest."""
    return LEAST_TORQUE + RESOLVED * largest


def condition_tolerance(torques: ca.SX, largest: ca.SX) -> ca.SX:
    """Uncertainty of the condition of a switch to which the laws' torques contribute ``torques``."""
    return ca.SX(EPS) if torques.is_zero() else torque_tolerance(torques, largest)
