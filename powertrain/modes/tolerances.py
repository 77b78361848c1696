"""What counts as zero, and how well things are known: all tolerances of modes, each with its unit and its reason."""

from __future__ import annotations

import casadi as ca

EPS = 1e-10
"""Hysteresis of speeds (rad/s, m/s), of gaps (m), and of conditions without torques: far above the accuracy of events in time."""
ZONE = 2 * EPS
"""Speeds (rad/s, m/s) below this are rest."""
INTEGRATED = 3e-7
"""How well a speed (rad/s, m/s) is known that follows from states which no law sets to zero: 30 times their usual tolerance."""
SWIFT = 1e-3
"""Rates (rad/s2, m/s2) above this tell the direction of a prescribed speed that is not known: it is known again within 0.1 ms."""
REST_SPEED = 1e-4
"""A contact that would rebound slower than this (m/s, rad/s) stays closed."""
LIMIT = 1e-9
"""A value may lie beyond its limit by this, relative to one and to the limit: rounding of what a model sets to the limit itself."""
LEAST_TORQUE = 1e-9
"""Torques and forces (N.m, N) below this are nothing."""
RESOLVED = 1e-8
"""How well torques that meet are known together, relative to the largest of them: round-off through stiff couplings."""
SHARED = 1e-7
"""How well a torque is known that laws on one motion share by their compliance, relative to those that meet there: round-off over eps."""
ALONE = 1e-10
"""How well a torque is known that no other meets in its own motion, relative to the largest that it meets through others."""

NOW = 1e-12
"""Instants (s) within this, relative to one and to the time, are the same."""

NO_WIDTH = 1e-10
"""Limits of a law that are nearer to each other (N.m, N) are one: nothing is transmitted, or always the same torque."""
REST = 1e-9
"""At an operating point: a speed counts as rest, a condition as zero, below this share of the terms that it is the sum of."""
BALANCED = 1e-7
"""How well equations for unknowns without a rate are zero, relative to their terms."""
FOUND = 1e-11
"""Such unknowns are found with a step of Newton's method below this share of their size plus one."""

ROUND_OFF = 1e-15
"""How well a torque is known that is the difference of large ones, relative to these: some units in the last place of the states."""


def rounding_tolerance(terms: ca.SX) -> ca.SX:
    """How well a torque is known to which the states add ``terms``, as the angles at the ends of a shaft do after many turns."""
    return ROUND_OFF * terms


def torque_tolerance(meeting: ca.SX, largest: ca.SX) -> ca.SX:
    """How well the torque of a law is known: ``meeting`` are those that meet in it, ``largest`` is that of all it meets."""
    return LEAST_TORQUE + SHARED * meeting + RESOLVED * largest


def alone_tolerance(largest: ca.SX) -> ca.SX:
    """How well the torque of a law is known that moves on its own."""
    return LEAST_TORQUE + ALONE * largest


def condition_tolerance(torques: ca.SX, largest: ca.SX) -> ca.SX:
    """How well the condition of a switch is known, to which the laws' torques add ``torques``."""
    return ca.SX(EPS) if torques.is_zero() else torque_tolerance(torques, largest)
