"""All tolerances of modes, each with its unit and its reason."""

from __future__ import annotations

import casadi as ca

EPS = 1e-10
"""Hysteresis of speeds (rad/s, m/s), of gaps (m), and of conditions without torques: far above the accuracy of events in time."""
ZONE = 2 * EPS
"""Speeds (rad/s, m/s) below this are rest."""
INTEGRATED = 3e-7
"""Uncertainty of a speed (rad/s, m/s) computed from states that no law sets to zero: 30 times their usual tolerance."""
SWIFT = 1e-3
"""Rates (rad/s2, m/s2) above this give the direction of an uncertain prescribed speed, which is certain again within 0.1 ms."""
REST_SPEED = 1e-4
"""A contact that would rebound slower than this (m/s, rad/s) stays closed."""
LIMIT = 1e-9
"""A value may exceed its limit by this, relative to one and to the limit: rounding of values that a model sets to the limit."""
LEAST_TORQUE = 1e-9
"""Torques and forces (N.m, N) below this count as zero."""
RESOLVED = 1e-8
"""Uncertainty of torques in equilibrium with each other, relative to the largest: round-off through stiff couplings."""
SHARED = 1e-7
"""Uncertainty of a torque shared by compliance between laws on one motion, relative to the torques there: round-off over compliance."""
ALONE = 1e-10
"""Uncertainty of the torque of a law alone on its motion, relative to the largest torque it meets through others."""

NOW = 1e-12
"""Instants (s) within this, relative to one and to the time, are the same."""

NO_WIDTH = 1e-10
"""Limits of a law closer together than this (N.m, N) coincide: it transmits nothing, or always the same torque."""
REST = 1e-9
"""At an operating point: a speed counts as rest, or a condition as zero, below this share of the terms in its sum."""
BALANCED = 1e-7
"""Residuals of equations for algebraic unknowns count as zero below this, relative to their terms."""
FOUND = 1e-11
"""Newton's method for algebraic unknowns ends with a step below this, relative to their size plus one."""

ROUND_OFF = 1e-15
"""Uncertainty of a torque that is a difference of large ones, relative to these: a few units in the last place of the states."""


def rounding_tolerance(terms: ca.SX) -> ca.SX:
    """Uncertainty of a torque to which states contribute ``terms``, as the angles at the ends of a shaft do after many turns."""
    return ROUND_OFF * terms


def torque_tolerance(meeting: ca.SX, largest: ca.SX) -> ca.SX:
    """Uncertainty of the torque of a law: ``meeting`` are the torques in its own motion, ``largest`` the largest of all it meets."""
    return LEAST_TORQUE + SHARED * meeting + RESOLVED * largest


def alone_tolerance(largest: ca.SX) -> ca.SX:
    """Uncertainty of the torque of a law that is alone on its motion."""
    return LEAST_TORQUE + ALONE * largest


def condition_tolerance(torques: ca.SX, largest: ca.SX) -> ca.SX:
    """Uncertainty of the condition of a switch to which the laws' torques contribute ``torques``."""
    return ca.SX(EPS) if torques.is_zero() else torque_tolerance(torques, largest)
