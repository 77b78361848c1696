"""One cylinder of a four-stroke engine: slider crank, oscillating mass, and the pressure of the gas over the crank angle."""

from __future__ import annotations

import math
from typing import ClassVar

import casadi as ca

from powertrain import Equations, Input, Parameter, Symbol, Variable, der, parameter, signal_input, variable
from powertrain.components.limited import limited, smooth_step
from powertrain.components.rotational.interfaces import OneFlangeAndSupport

WIEBE_A, WIEBE_M = 5.0, 2.0
"""Efficiency and form parameter of the Wiebe function; J. B. Heywood, Internal Combustion Engine Fundamentals, section 9.2.2."""
OVERLAP = 0.2
"""Sine of the change of theta/2 over which the pressure changes to and from that of the exhaust: 23 degrees of the crankshaft."""
LEAST = 0.05
"""cos(theta/2) above which the angle of the closed cylinder is determined: up to 6 degrees from the bottom dead centre."""


class Cylinder(OneFlangeAndSupport):
    """A cylinder of a four-stroke engine with its throw of the crankshaft.

    theta = phi - phase,  w = der(phi),  r = stroke/2,  l = rod,  A = pi bore^2/4
    x = r (1 - cos(theta)) + l - root(l^2 - r^2 sin(theta)^2),  v = der(x) = k w,  V = V_c + A x,  V_c = A stroke/(eps - 1)
    flange.tau = k (m der(v) - (p - p_0) A) = -support.tau
    closed: p V^n = p_in V_1^n + burnt(theta) (n - 1) Q V_c^(n - 1),  V_1 = V_c + A stroke
    Q = load (1 - walls) mixture A stroke
    intake stroke: p = p_in = p_0 + manifold (p_closed + load (p_open - p_closed) - p_0)
    exhaust stroke: p = p_out = p_0 + manifold (p_exhaust - p_0)
    burnt = 1 - exp(-5 y^3),  y = (theta - ignition)/duration

    theta = 0 is the top dead centre of ignition, x the distance of the piston from it. Compression and expansion are polytropic; the
    Wiebe function blends from the pressure without combustion to that with all heat added at the top dead centre (Eriksson and Andersson).
    The exhaust valve opens at the angle ``opening``; the pressure due to combustion falls to zero until the bottom dead centre, where
    the intake valve closes. The pressure is a smooth function of the angle, so the strokes cause no events. Gas does not leak, not even
    at rest. The crankcase and, at rest, the manifolds have the pressure p_0. The connecting rod is split into two masses: m includes
    piston, pin and small end; the big end belongs to the crankshaft.

    A gasoline engine is throttled: p_closed is the pressure of the residual gas, and the fresh charge grows with p_in - p_closed. For a
    diesel engine p_closed = p_open. The cylinder is a boundary: it supplies the work of the gas. The default values are invented, for a
    cylinder of 0.4 l.

    Sources: L. Eriksson, I. Andersson, An Analytic Model for Cylinder Pressure in a Four Stroke SI Engine, SAE 2002-01-0371;
    J. B. Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988, sections 2.2 and 9.2.
    """

    boundary: ClassVar[bool] = True
    load: Input = signal_input("1", "Heat of a cycle over its heat at full load, 0 to 1", default=0.0)
    manifold: Input = signal_input("1", "How far the manifold pressures have built up, 0 at rest to 1", default=1.0)
    phase: Parameter = parameter("rad", "Angle of the crankshaft at the top dead centre of ignition", default=0.0)
    bore: Parameter = parameter("m", "Bore", default=0.079, above=0)
    stroke: Parameter = parameter("m", "Stroke", default=0.0815, above=0)
    rod: Parameter = parameter("m", "Length of the connecting rod", default=0.14, above=0)
    eps: Parameter = parameter("1", "Compression ratio", default=10.5, above=1)
    m: Parameter = parameter("kg", "Oscillating mass", default=0.5, min=0)
    n: Parameter = parameter("1", "Polytropic exponent", default=1.32, above=1, max=5 / 3)
    p_closed: Parameter = parameter("Pa", "Intake pressure without load", default=20e3, min=0)
    p_open: Parameter = parameter("Pa", "Intake pressure at full load", default=95e3, min=0)
    p_exhaust: Parameter = parameter("Pa", "Exhaust pressure", default=106e3, min=0)
    p_0: Parameter = parameter("Pa", "Pressure in the crankcase", default=101325.0, min=0)
    mixture: Parameter = parameter("J/m3", "Heat of combustion over displacement at full load", default=3.3e6, min=0)
    walls: Parameter = parameter("1", "Share of the heat that the walls take", default=0.22, min=0, max=1)
    ignition: Parameter = parameter("rad", "Angle at which combustion begins", default=-0.35, min=-3, max=2)
    duration: Parameter = parameter("rad", "Duration of combustion", default=1.05, above=0, max=2)
    opening: Parameter = parameter("rad", "Angle at which the exhaust valve opens", default=2.3, above=1, max=3.1)
    w: Variable = variable("rad/s", "Speed of the crankshaft against the support")
    x: Variable = variable("m", "Distance of the piston from its top dead centre")
    v: Variable = variable("m/s", "Speed of the piston, away from the top dead centre")
    p: Variable = variable("Pa", "Pressure in the cylinder", guess=1e5, nominal=1e5)
    volume: Variable = variable("m3", "Volume of the cylinder", guess=1e-4, nominal=1e-4)
    gas: Variable = variable("N.m", "Torque of the gas")

    def check(self) -> Equations:
        """The rod must be longer than the throw, and the intake pressure not fall with the load."""
        yield self.p_closed <= self.p_open
        yield self.rod > self.stroke / 2  # the connecting rod is longer than the throw

    def equations(self) -> Equations:
        """The slider crank by virtual work, with the gas pressure."""
        yield from self._against_support()
        half, theta = (self.phi - self.phase) / 2, self.phi - self.phase
        distance, height = self._distance(ca.cos(theta))
        rate = self.stroke / 2 * ca.sin(theta) * (1 + self.stroke / 2 * ca.cos(theta) / height)
        yield self.w == der(self.phi)
        yield self.x == distance
        yield self.v == rate * self.w
        yield self.volume == self._clearance() + self._area() * self.x
        yield self.p == self._pressure(ca.sin(half), ca.cos(half))
        yield self.gas == rate * (self.p - self.p_0) * self._area()
        yield self.flange.tau == rate * self.m * der(self.v) - self.gas

    def energy(self) -> Symbol:
        """Kinetic energy of the oscillating mass m v^2/2."""
        return self.m * self.v**2 / 2

    def displacement(self) -> Symbol:
        """Displacement [m3]."""
        return self._area() * self.stroke

    def _area(self) -> Symbol:
        return math.pi / 4 * self.bore**2

    def _clearance(self) -> Symbol:
        return self.displacement() / (self.eps - 1)

    def _distance(self, cosine: Symbol) -> tuple[Symbol, Symbol]:
        """Distance of the piston from its top dead centre, and the height of the rod, from the cosine of the crank angle."""
        r = self.stroke / 2
        height = ca.sqrt(self.rod**2 - r**2 * (1 - cosine**2))
        return r * (1 - cosine) + self.rod - height, height

    def _pressure(self, sine: Symbol, cosine: Symbol) -> Symbol:
        """The pressure from sine and cosine of theta/2, whose period is a cycle of two revolutions.

        The valves are closed where the cosine is positive; tan(theta/2) then determines the angle. The sine distinguishes intake and
        exhaust.
        """
        above = ca.fmax(cosine, 0)
        V = self._clearance() + self._area() * self._distance(2 * above**2 - 1)[0]
        full = self._clearance() + self.displacement()
        load, built = limited(self.load.value), limited(self.manifold.value)
        p_in = self.p_0 + built * (self.p_closed + load * (self.p_open - self.p_closed) - self.p_0)
        p_out = self.p_0 + built * (self.p_exhaust - self.p_0)
        heat = load * (1 - self.walls) * self.mixture * self.displacement()
        theta = 2 * ca.atan(sine / ca.fmax(cosine, LEAST))
        burnt = 1 - ca.exp(-WIEBE_A * ca.fmax((theta - self.ignition) / self.duration, 0) ** (WIEBE_M + 1))
        shut = smooth_step(above / ca.cos(self.opening / 2))
        out = smooth_step(-cosine / OVERLAP) * smooth_step((1 + sine / OVERLAP) / 2)
        motored = p_in * (full / V) ** self.n
        added = (self.n - 1) * heat / self._clearance() * (self._clearance() / V) ** self.n
        return (1 - out) * motored + out * p_out + shut * burnt * added
