"""Positive-locking clutches."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Discrete,
    Equations,
    Input,
    Parameter,
    Symbol,
    discrete,
    friction,
    parameter,
    reinit,
    signal_input,
    switch,
    when,
)
from powertrain.components.rotational.interfaces import CompliantWithRelativeStates, Lossy


class DogClutch(CompliantWithRelativeStates, Lossy):
    """Dogs that connect two shafts: they engage only at nearly equal speeds and disengage only at low torque.

    w_rel = der(flange_b.phi - flange_a.phi),  tau = flange_b.tau = -flange_a.tau
    in as soon as engage > 1/2 and |w_rel| < w_in;  out as soon as engage < 1/2 and |tau| < tau_out
    in: w_rel = 0 and |tau| <= tau_max, or tau = tau_max sign(w_rel);  out: tau = 0

    On engagement the torque tau_max, beyond which the dogs shear, removes the remaining w_rel within a short but finite time, so the
    shafts need inertia. The angle between two dogs is assumed to be small, so they engage at once.
    """

    w_in: Parameter = parameter("rad/s", "Speed difference below which the dogs engage", default=5.0, above=0)
    tau_out: Parameter = parameter("N.m", "Torque below which the dogs disengage", default=20.0, above=0)
    tau_max: Parameter = parameter("N.m", "Torque capacity of the dogs", default=3000.0, above=0)
    engage: Input = signal_input("1", "Command: 1 engage, 0 disengage")
    inside: Discrete = discrete("1", "1: engaged, 0: disengaged", start=0.0)

    def equations(self) -> Equations:
        """A latch, and friction that it switches."""
        yield from self._transmit()
        wanted, alike = self.engage.value > 0.5, ca.fabs(self.w_rel) < self.w_in
        yield when(ca.logic_and(wanted, alike), reinit(self.inside, 1))
        free = ca.logic_and(self.engage.value < 0.5, ca.fabs(self.tau) < self.tau_out)
        yield when(ca.logic_and(free, self.inside > 0.5), reinit(self.inside, 0))
        limit = switch(self.inside > 0.5, self.tau_max, 0.0)
        yield friction(self.w_rel, self.tau, -limit, limit)
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Torque times relative speed, while the last of it is stopped."""
        return self.tau * self.w_rel
