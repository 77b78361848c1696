"""The loss of a mesh by the side that drives: one law for gear pairs, meshes on a carrier and variable units."""

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
    """The torque loss at side a of a mesh that takes up ``tau`` there, for backward and for forward motion.

    a drives: (1 - eta_ab) tau,  b drives: (1 - 1/eta_ba) tau;  forward, a drives where tau >= 0, backward, where tau <= 0

    ``bearings`` are friction torques at a that add to it where a drives and where b drives, ``at_a`` the part of them that the mesh does
    not carry: the side changes where the torque of the mesh itself does.
    """
    a_drives, b_drives = (1 - eta_ab) * tau, (1 - 1 / eta_ba) * tau
    bearing_a, bearing_b = bearings
    upper = switch(tau >= at_a, a_drives + bearing_a, b_drives + bearing_b, continuous=True)
    lower = switch(tau >= 0.0 - at_a, b_drives - bearing_b, a_drives - bearing_a, continuous=True)
    return lower, upper
