"""The common interface of wheels: hub, road, load and rolling resistance."""

from __future__ import annotations

from typing import Annotated

from powertrain import (
    Equations,
    Input,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    port,
    signal_input,
    variable,
    within,
)
from powertrain.components.rotational import Flange as Hub
from powertrain.components.rotational.interfaces import Lossy
from powertrain.components.translational import Flange as Road
from powertrain.components.wheels.tyre_size import radius_of


class Wheel(Lossy):
    """Partial: a wheel between its hub and the road, with inertia and rolling resistance.

    J der(w) = hub.tau - radius f - tau_roll,  w = der(hub.phi),  v = der(road.s),  f = -road.f,  fn = load_nominal + load
    w > 0: tau_roll = limit;  w < 0: tau_roll = -limit;  w = 0: |tau_roll| <= limit,  limit = (Cr + Cr_2 (radius w)^2) radius fn

    ``Cr_2`` [s2/m2] is the increase of the coefficient with the speed squared, about 1e-6 to 5e-6 for car tyres. ``road`` moves with the
    vehicle; f is the force of the road on the vehicle, positive forward. The load is a signal from a body or an axle; without it the
    wheel carries ``load_nominal``. The mass of the wheel is part of the body. A load below zero ends the simulation, because wheels
    that lift off are not modelled. ``radius`` takes the size of a radial tyre as well, such as "205/55R16", see ``rolling_radius``.
    """

    Cr_2: Annotated[float, "s2/m2"] = 0.0
    hub: Hub = port(Hub)
    road: Road = port(Road)
    load: Input = signal_input("N", "Wheel load in addition to load_nominal", default=0.0)
    side: Input = signal_input("1", "Side force over load, which reduces the grip of slipping tyres", default=0.0)
    radius: Parameter = parameter("m", "Rolling radius", default=0.3, above=0, max=5, reads=radius_of)
    J: Parameter = parameter("kg.m2", "Moment of inertia", default=1.0, min=0)
    Cr: Parameter = parameter("1", "Rolling resistance coefficient", default=0.01, min=0)
    load_nominal: Parameter = parameter("N", "Wheel load without the signal", default=0.0, min=0)
    w: Variable = variable("rad/s", "Speed of the wheel")
    v: Variable = variable("m/s", "Speed over the road")
    f: Variable = variable("N", "Force of the road on the wheel, positive forward")
    fn: Variable = variable("N", "Load on the wheel")
    tau_roll: Variable = variable("N.m", "Torque of rolling resistance")

    def _roll(self) -> Equations:
        if not self.Cr_2 >= 0:
            raise ParameterError(f"{self._label}.Cr_2 = {self.Cr_2:g} s2/m2 must not be negative")
        yield self.w == der(self.hub.phi)
        yield self.v == der(self.road.s)
        yield self.f == -self.road.f
        yield self.fn == self.load_nominal + self.load.value
        yield self.J * der(self.w) == self.hub.tau - self.radius * self.f - self.tau_roll
        rising = self.Cr_2 * (self.radius * self.w) ** 2 if self.Cr_2 else 0.0
        limit = (self.Cr + rising) * self.radius * self.fn
        yield friction(self.w, self.tau_roll, -limit, limit, name="rolling")
        within(self.fn, 0, float("inf"), name="load of the wheel", unit="N")
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy J w^2/2."""
        return self.J * self.w**2 / 2
