"""What counts as zero, and how well things are known: all tolerances of modes, events and operating points, with units and reasons.

Numbers that decide how a method proceeds (pivots, ranks, step sizes) are not among them: they stand where they are used.
"""

from __future__ import annotations

import casadi as ca

# Speeds, gaps, conditions
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
STRUCK = 1e-9
"""What is left of a speed after an impact is nothing below this share of the largest before it."""
NOISE = 1e-6
"""Indicators (counted as rad/s or m/s) below this are not asked to be smooth within a step: the error of the states is as large."""
LIMIT = 1e-9
"""A value may lie beyond its limit by this, relative to one and to the limit: rounding of what a model sets to the limit itself."""
JUMP = 1e-7
"""What may not jump may change by this at an event, relative to one and to its size: rounding of the instants at which signals turn."""

# Torques and forces
LEAST_TORQUE = 1e-9
"""Torques and forces (N.m, N) below this count as zero."""
RESOLVED = 1e-8
"""Uncertainty of torques in equilibrium with each other, relative to the largest: round-off through stiff couplings."""
SHARED = 1e-7
"""Uncertainty of a torque shared by compliance between laws on one motion, relative to the torques there: round-off over compliance."""
ALONE = 1e-10
"""How well a torque is known that no other meets in its own motion, relative to the largest that it meets through others."""
ROUND_OFF = 1e-15
"""How well a torque is known that is the difference of large ones, relative to these: some units in the last place of the states."""
NO_WIDTH = 1e-10
"""Limits of a law that are nearer to each other (N.m, N) are one: nothing is transmitted, or always the same torque."""
CROSSED = 1e-6
"""Limits of a sliding law that cross by less than this share of the largest torque do so by the hysteresis of a switch of theirs."""
GIVEN = 1e-11
"""The motion of a law is given by others where its own torque moves it by less than this share of the terms that cancel."""

# Instants
NOW = 1e-12
"""Instants (s) within this, relative to one and to the time, are the same."""
BEGINNING = 1e-9
"""What happens this soon (s) after the start, relative to one and to the time, belongs to it."""
SHORTEST = 1e-15
"""Steps (s) below this, relative to one and to the time, do not advance it: a run ends."""

# Equations without a rate
FOUND = 1e-11
"""Unknowns without a rate are found with a step of Newton's method below this share of their size plus one."""
SETTLED = 1e-9
"""The same at a corner of a signal, where the step is taken as well: far below the tolerance of any run."""
STARTED = 1e-12
"""The same at the start of a run, which keeps the error."""
STILL = 1e-10
"""The same at an operating point, for torques as a share of the largest: round-off is larger with more unknowns."""
BALANCED = 1e-7
"""How well equations for unknowns without a rate are zero, relative to their terms."""
KINK = 1e-9
"""Where Newton's method turns to and fro about a kink, equations that are zero but for this (N.m, rad/s) are solved."""
MISSED = 1e-9
"""A start condition that follows from others is missed by more than this share of its size plus one."""

# Operating points
REST = 1e-9
"""At an operating point: a speed counts as rest, a condition as zero, below this share of the terms that it is the sum of."""
SAME = 1e-6
"""Operating points, or torques at a start, that differ by less than this share of their size plus one are one solution."""
ALIKE = 1e-9
"""Values at both ends of an interval that differ by less than this share are one value: round-off through the balance of the model."""
NEUTRAL = 1e6
"""Seconds: a motion that takes longer to come to rest is not held by anything."""
LOCKED = 1e9
"""Torques that change by more than this for a unit change of a limit depend on round-off: the laws lock themselves."""
INFINITE = 1e12
"""An input, parameter or torque (in its unit) that would have to be larger counts as infinite."""


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
