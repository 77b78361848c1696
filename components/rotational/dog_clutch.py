"""Positive-locking clutches."""

from __future__ import annotations

import math

import casadi as ca

from powertrain import (
    Discrete,
    Equations,
    Input,
    Parameter,
    discrete,
    friction,
    parameter,
    reinit,
    signal_input,
    switch,
    when,
)
from powertrain.components.rotational.backlash import NO_PLAY, _Play
from powertrain.components.rotational.interfaces import FrictionCoupling


class DogClutch(FrictionCoupling):
    """Dogs that connect two shafts: they engage only at nearly equal speeds and disengage only at low torque.

    w_rel = der(flange_b.phi - flange_a.phi),  tau = flange_b.tau = -flange_a.tau
      in as soon as engage > 1/2 and |w_rel| < w_in;  out as soon as engage < 1/2 and |tau| < tau_out;  both also at the start
      in: w_rel = 0 and |tau| <= tau_max, or tau = tau_max sign(w_rel);  out: tau = 0

    On engagement the torque tau_max, at which the dogs shear, removes the remaining w_rel within a short but finite time, so the
    shafts need inertia. The angle between two dogs is assumed to be small, so they engage at once. This gives correct energies and ratios;
    for the torque of the impact and the play of the dogs use ``ElasticDogClutch``.
    """

    w_in: Parameter = parameter("rad/s", "Speed difference below which the dogs engage", default=5.0, above=0)
    tau_out: Parameter = parameter("N.m", "Torque below which the dogs disengage", default=20.0, above=0)
    tau_max: Parameter = parameter("N.m", "Torque capacity of the dogs", default=3000.0, above=0)
    engage: Input = signal_input("1", "Command: 1 engage, 0 disengage")
    inside: Discrete = discrete("1", "1: engaged, 0: disengaged", start=0.0)

    def equations(self) -> Equations:
        """A latch, and the friction that it switches."""
        yield from self._transmit()
        wanted, alike = self.engage.value > 0.5, ca.fabs(self.w_rel) < self.w_in
        enters = ca.logic_and(ca.logic_and(wanted, alike), self.inside < 0.5)
        yield when(enters, reinit(self.inside, 1), initially=True)
        free = ca.logic_and(self.engage.value < 0.5, ca.fabs(self.tau) < self.tau_out)
        yield when(ca.logic_and(free, self.inside > 0.5), reinit(self.inside, 0), initially=True)
        limit = switch(self.inside > 0.5, self.tau_max, 0.0)
        yield friction(self.w_rel, self.tau, -limit, limit)
        yield from self._dissipate()


class ElasticDogClutch(_Play):
    """Dogs with play and stiffness: they engage only if a dog faces a gap, and their impact is elastic.

    x = phi_rel - phi_rel0 - 2 pi k/n with k the gap that the dogs entered;  n gaps of width b lie around phi_rel0 + 2 pi k/n
      in as soon as engage > 1/2, |w_rel| < w_in and a dog faces a gap, |x| < b/2
      out as soon as engage < 1/2 and the dogs are unloaded, |x| < b/2;  both also at the start
      in: tau_c = c (x - b/2) for x > b/2,  c (x + b/2) for x < -b/2,  else 0;  tau = tau_c + tau_d;  out: tau = tau_c = 0
    tau_d = d w_rel limited to [-|tau_c|, |tau_c|]

    With the reduced inertia J = J_a J_b/(J_a + J_b) of two free shafts, a speed difference w causes an impact torque of
    w sqrt(c J) without damping. At equal speeds dogs that stand on dogs stay there, and dogs under load stay in.
    Sources: the Dog Clutch with backlash of Simscape Driveline; ``ElastoBacklash``.
    """

    n: Parameter = parameter("1", "Number of dogs", default=6, min=1)
    b: Parameter = parameter("rad", "Width of a gap beyond that of its dog", default=0.1, above=NO_PLAY)
    w_in: Parameter = parameter("rad/s", "Speed difference below which the dogs engage", default=5.0, above=0)
    engage: Input = signal_input("1", "Command: 1 engage, 0 disengage")
    inside: Discrete = discrete("1", "1: engaged, 0: disengaged", start=0.0)
    gap: Discrete = discrete("1", "Number k of the gap that holds the dogs", start=0.0)

    def check(self) -> Equations:
        """There must be whole dogs, between the gaps."""
        yield ca.floor(self.n) == self.n  # a whole number of dogs
        yield self.n * self.b < 2 * math.pi  # there are dogs between the gaps

    def equations(self) -> Equations:
        """A latch that remembers the gap, and the play in it."""
        yield from self._transmit()
        turned = self.n * (self.phi_rel - self.phi_rel0)
        faced = ca.cos(turned) > ca.cos(self.n * self.b / 2)
        alike = ca.logic_and(ca.fabs(self.w_rel) < self.w_in, faced)
        nearest = ca.floor(turned / (2 * math.pi) + 0.5)
        enters = ca.logic_and(ca.logic_and(self.engage.value > 0.5, alike), self.inside < 0.5)
        yield when(enters, reinit(self.inside, 1), reinit(self.gap, nearest), initially=True)
        middle = 2 * math.pi * self.gap / self.n
        free = ca.logic_and(self.engage.value < 0.5, ca.fabs(self.phi_rel - self.phi_rel0 - middle) < self.b / 2)
        yield when(ca.logic_and(free, self.inside > 0.5), reinit(self.inside, 0), initially=True)
        x, beyond, before = self._gap(middle)
        yield self.tau_c == switch(self.inside > 0.5, self._spring(x, beyond, before), 0.0)
        yield self.tau == self.tau_c + self._limited_damping(beyond, before)
        yield from self._dissipate()
