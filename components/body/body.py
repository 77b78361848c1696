"""The body of a vehicle on a road: mass, air, slope, and the loads of its axles."""

from __future__ import annotations

from typing import ClassVar

import casadi as ca

from powertrain import (
    Component,
    Connector,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    Variable,
    connect,
    der,
    flow,
    parameter,
    port,
    signal_input,
    signal_output,
    support,
    variable,
)
from powertrain.components.thermal import HeatPort, Lossy
from powertrain.components.translational import Flange

G_N = 9.80665
"""Standard gravity [m/s2]."""


class AirStream(Connector):
    """Moving air along the road: its speed v and the force f on the component; the power is f v."""

    v: Variable = variable("m/s", "Speed of the air over the road")
    f: Variable = flow("N", "Force on the component")

    def power(self) -> Symbol:
        """Power into the component [W]."""
        return self.f * self.v


class Wind(Component):
    """Air with a prescribed speed: air.v = v."""

    boundary: ClassVar[bool] = True
    v: Input = signal_input("m/s", "Speed of the wind, positive with the vehicle")
    air: AirStream = port(AirStream)

    def equations(self) -> Equations:
        """The signal."""
        yield self.air.v == self.v.value


class Body(Component):
    """Partial: the mass of a body, its axles and its signals. The defaults are a mid-size car."""

    m: Parameter = parameter("kg", "Mass of the vehicle with its wheels", default=1500.0, above=0)
    wheelbase: Parameter = parameter("m", "Distance of the axles", default=2.7, above=0)
    h: Parameter = parameter("m", "Height of the centre of mass", default=0.55, min=0)
    front_share: Parameter = parameter("1", "Part of the weight on the front axle at rest", default=0.55, min=0, max=1)
    g: Parameter = parameter("m/s2", "Gravity", default=G_N, min=0)
    front: Flange = port(Flange)
    rear: Flange = port(Flange)
    grade: Input = signal_input("1", "Slope of the road, tan(alpha), positive uphill", default=0.0)
    v: Output = signal_output("m/s", "Speed of the vehicle")
    s: Output = signal_output("m", "Path of the vehicle")
    front_load: Output = signal_output("N", "Load of the front axle")
    rear_load: Output = signal_output("N", "Load of the rear axle")


class _InAir(Body):
    """Partial: a body with a drag coefficient and a frontal area."""

    Cd: Parameter = parameter("1", "Drag coefficient", default=0.3, min=0)
    A: Parameter = parameter("m2", "Cross section", default=2.2, min=0)
    rho: Parameter = parameter("kg/m3", "Density of the air", default=1.2, min=0)


class MovingBody(Body, Lossy):
    """Partial: a mass that moves along the road against a resistance."""

    speed: Variable = variable("m/s", "Speed over the road", start=0.0, prefer=True)
    path: Variable = variable("m", "Path along the road", start=0.0)
    height: Variable = variable("m", "Height that was climbed", start=0.0)
    a: Variable = variable("m/s2", "Acceleration")

    def _moves(self, resistance: Symbol) -> Equations:
        """Newton's law, and the balance of moments about the contact points."""
        slope = self.grade.value
        cosine = 1 / ca.sqrt(1 + slope**2)
        weight, push = self.m * self.g * cosine, self.front.f + self.rear.f
        yield self.front.s == self.path
        yield self.rear.s == self.path
        yield self.speed == der(self.path)
        yield self.a == der(self.speed)
        yield self.m * self.a == push - resistance - weight * slope
        yield der(self.height) == slope * cosine * self.speed
        yield self.v.value == self.speed
        yield self.s.value == self.path
        yield self.front_load.value == weight * self.front_share - self.h / self.wheelbase * push
        yield self.front_load.value + self.rear_load.value == weight
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy, and potential energy above the start."""
        return self.m * self.speed**2 / 2 + self.m * self.g * self.height


class Chassis(_InAir, MovingBody):
    """The body, with the air as a port; see ``VehicleBody``."""

    air: AirStream = support(AirStream)
    drag: Variable = variable("N", "Resistance of the air")

    def equations(self) -> Equations:
        """The drag of the air."""
        yield from self._moves(self.drag)
        against = self.speed - self.air.v
        yield self.drag == self.Cd * self.A * self.rho / 2 * against * ca.fabs(against)
        yield self.air.f == -self.drag

    def loss(self) -> Symbol:
        """Air resistance times speed relative to the air."""
        return self.drag * (self.speed - self.air.v)


class VehicleBody(_InAir):
    """The body of a vehicle between its two axles, which are rigidly attached to one mass.

    m a = front.f + rear.f - drag - m g sin(alpha),  tan(alpha) = grade,  drag = Cd A rho (v - u) |v - u|/2,  u = wind + tailwind
    front_load = m g cos(alpha) front_share - h/wheelbase (front.f + rear.f),  front_load + rear_load = m g cos(alpha)

    The forces at the flanges are the tractive forces of the axles. Air and weight act at the centre of mass, so only the axles' forces
    pitch the body, with the lever arm h. Axle loads neglect the torque that accelerates the wheels.
    The height gained is stored energy; the wind may do work.
    """

    heat_port: HeatPort = support(HeatPort)
    wind: Input = signal_input("m/s", "Speed of the wind along the road, positive with the vehicle", default=0.0)
    tailwind: Parameter = parameter("m/s", "Constant part of the wind, negative for a head wind", default=0.0)
    chassis: Chassis = Chassis()
    surroundings: Wind = Wind()

    def equations(self) -> Equations:
        """A chassis in the wind."""
        for name in ("m", "Cd", "A", "rho", "wheelbase", "h", "front_share", "g"):
            yield getattr(self.chassis, name) == getattr(self, name)
        for name in ("front", "rear", "heat_port", "grade", "v", "s", "front_load", "rear_load"):
            yield connect(getattr(self, name), getattr(self.chassis, name))
        yield self.surroundings.v.value == self.wind.value + self.tailwind
        yield connect(self.surroundings.air, self.chassis.air)
