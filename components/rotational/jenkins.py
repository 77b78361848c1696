"""Elastic contacts that slip."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, der, parameter, switch, variable, within
from powertrain.components.rotational.interfaces import CompliantWithRelativeStates, Lossy


class JenkinsElement(CompliantWithRelativeStates, Lossy):
    """A spring in series with a dry friction slider without mass: dry friction that yields elastically before it slips.

    der(tau) = c (w_rel - w_slip),  |tau| <= tau_max
    tau = tau_max and w_rel > 0, or tau = -tau_max and w_rel < 0: w_slip = w_rel,  else w_slip = 0

    The torque depends on the history of the twist and begins at 0. A cycle of amplitude X > tau_max/c loses 4 tau_max (X - tau_max/c).
    Several elements in parallel are an Iwan model, whose stiffness falls gradually; with a ``Spring`` beside them, it is bilinear. Use it
    for the hysteresis of clutch discs, friction dampers and joints, and for friction of which the displacement before sliding matters.
    Linear models have the stiffness c while it sticks, and none while it slips.

    Source: W. D. Iwan, A distributed-element model for hysteresis and its steady-state dynamic response, Journal of Applied Mechanics 33
    (1966) 893. Errors: InitializationError for a torque beyond tau_max at the start.
    """

    c: Parameter = parameter("N.m/rad", "Stiffness", above=0)
    tau_max: Parameter = parameter("N.m", "Torque at which it slips", min=0)
    tau_c: Variable = variable("N.m", "Torque of the spring", start=0.0)
    w_slip: Variable = variable("rad/s", "Speed of the slider")

    def equations(self) -> Equations:
        """The spring winds up while the slider rests."""
        yield from self._transmit()
        forward = ca.logic_and(self.tau_c >= self.tau_max, self.w_rel > 0)
        backward = ca.logic_and(self.tau_c <= -self.tau_max, self.w_rel < 0)
        yield self.w_slip == switch(ca.logic_or(forward, backward), self.w_rel, 0.0)
        yield der(self.tau_c) == self.c * (self.w_rel - self.w_slip)
        yield self.tau == self.tau_c
        yield from self._dissipate()

    def initial(self) -> Equations:
        """The slider holds."""
        within(self.tau_c, -self.tau_max, self.tau_max, name="torque of the spring", unit="N.m")
        yield from ()

    def energy(self) -> Symbol:
        """Elastic energy tau^2/(2 c)."""
        return self.tau_c**2 / (2 * self.c)

    def loss(self) -> Symbol:
        """Torque times speed of the slider."""
        return self.tau_c * self.w_slip
