"""The loss of a mesh depending on the driving side: one law for gear pairs, meshes on a carrier and variable units."""

from __future__ import annotations

from powertrain import Symbol, switch

Expression = Symbol | float


def mesh_losses(
    tau: Symbol,
    eta_ab: Expression,
    eta_ba: Expression,
    bearings: tuple[Expression, Expression] = (0.0, 0.0),
    at_a: Expression = 0.0,
) -> tuple[Symbol, Symbol]:
    """The torque loss at side a of a mesh with the torque ``tau`` there, for backward and for forward motion.

    a drives: (1 - eta_ab) tau,  b drives: (1 - 1/eta_ba) tau;  forward, a drives if tau >= 0, backward, if tau <= 0

    ``bearings`` are additional friction torques at a, if a drives and if b drives; ``at_a`` is the part of them that the mesh does
    not carry: the driving side changes with the torque of the mesh itself.
    """
    a_drives, b_drives = (1 - eta_ab) * tau, (1 - 1 / eta_ba) * tau
    bearing_a, bearing_b = bearings
    upper = switch(tau >= at_a, a_drives + bearing_a, b_drives + bearing_b, continuous=True)
    lower = switch(tau >= 0.0 - at_a, b_drives - bearing_b, a_drives - bearing_a, continuous=True)
    return lower, upper
