"""Piston engines: cylinders on one crankshaft, with the torque of every stroke."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Self

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    arguments_checked,
    connect,
    der,
    friction,
    parameter,
    port,
    replace,
    signal_input,
    signal_output,
    support,
    variable,
)
from powertrain.components.engines.cylinder import Cylinder
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import Flange, Lossy, OneFlangeAndSupport
from powertrain.components.thermal import HeatPort


class Crankshaft(OneFlangeAndSupport, Lossy):
    """A crankshaft with its flywheel, and the mechanical friction of the whole engine.

    w = der(phi),  J der(der(flange.phi)) = flange.tau - drag = -support.tau - drag
    w > 0: drag = limit;  w < 0: drag = -limit;  w = 0: |drag| <= limit
    limit = warmth displacement/(4 pi) (p_f0 + p_f1 |w| + p_f2 w^2)

    The friction has the form of Barnes-Moss, without the pumping work, which the cylinder pressures contain. ``warmth`` multiplies
    it while the oil is cold, see ``CoolantCircuit``. Source: J. B. Heywood, Internal Combustion Engine Fundamentals, McGraw-Hill 1988,
    section 13.5.
    """

    J: Parameter = parameter("kg.m2", "Moment of inertia with flywheel and big ends", default=0.12, min=0)
    displacement: Parameter = parameter("m3", "Displacement of the engine", default=1.6e-3, min=0)
    p_f0: Parameter = parameter("Pa", "Friction mean effective pressure at rest", default=60e3, min=0)
    p_f1: Parameter = parameter("Pa.s/rad", "Rise of the friction pressure with speed", default=143.0, min=0)
    p_f2: Parameter = parameter("Pa.s2/rad2", "Rise of the friction pressure with speed squared", default=0.46, min=0)
    warmth: Input = signal_input("1", "Friction over that of the warm engine", default=1.0)
    w: Variable = variable("rad/s", "Speed against the support")
    drag: Variable = variable("N.m", "Friction torque")

    def equations(self) -> Equations:
        """Inertia and friction; the support takes the friction only."""
        yield self.phi == self.flange.phi - self.support.phi
        yield self.w == der(self.phi)
        yield self.J * der(der(self.flange.phi)) == self.flange.tau - self.drag
        yield self.support.tau == -self.drag
        pressure = self.p_f0 + self.p_f1 * ca.fabs(self.w) + self.p_f2 * self.w**2
        limit = ca.fmax(self.warmth.value, 0) * self.displacement / (4 * math.pi) * pressure
        yield friction(self.w, self.drag, -limit, limit)
        yield from self._dissipate()

    def energy(self) -> Symbol:
        """Kinetic energy."""
        return self.J * der(self.flange.phi) ** 2 / 2

    def loss(self) -> Symbol:
        """Friction torque times speed."""
        return self.drag * self.w


class PistonEngine(Component):
    """A four-stroke engine with one or more cylinders on a rigid crankshaft; its torque follows from the cylinder pressures.

    load = on throttle manifold,  manifold = w/w_fire,  each within 0..1,  w = der(crank.phi - housing.phi)
    heat = load mixture displacement w/(4 pi) summed over the cylinders,  fuel_rate = heat/heating_value,  der(fuel) = fuel_rate

    Torque and speed fluctuate with the orders 1/2, 1, 3/2 ... per revolution; with equal cylinders that fire at equal intervals only
    multiples of half their number remain. ``housing`` takes the reactions of cylinders and friction; it is ground if nothing is connected.
    Heat and fuel are means over a cycle; the heat of walls and friction leaves through ``heat_port``, the rest with the exhaust.
    ``inline`` makes engines that fire at equal intervals; for others the ``phase`` of each cylinder determines when it fires: in a V
    engine it is the crank angle between two ignitions that counts, not the angle of the throws. For a crankshaft that twists, connect
    each ``Cylinder`` to an ``Inertia`` of its own, with springs between them.

    Errors: ParameterError for an engine without cylinders.
    Source: H. Dresig, F. Holzweissig, Dynamics of Machinery, Springer 2010, section 2.3 (slider crank on a rigid shaft).
    """

    cylinders: tuple[Cylinder, ...] = (Cylinder(),)
    crankshaft: Crankshaft = Crankshaft()
    crank: Flange = port(Flange)
    housing: Flange = support(Flange)
    heat_port: HeatPort = support(HeatPort)
    throttle: Input = signal_input("1", "Throttle, 0 to 1")
    on: Input = signal_input("1", "1: running, 0: stopped", default=1.0)
    warmth: Input = signal_input("1", "Friction over that of the warm engine", default=1.0)
    speed: Output = signal_output("rad/s", "Speed of the crankshaft against the housing")
    w_fire: Parameter = parameter(
        "rad/s", "Speed from which the engine fires and breathes fully", default=40.0, above=0
    )
    heating_value: Parameter = parameter("J/kg", "Lower heating value of the fuel", default=43e6, above=0)
    load: Variable = variable("1", "Heat of a cycle over its heat at full load")
    tau: Variable = variable("N.m", "Torque of all cylinders")
    heat: Variable = variable("W", "Power of combustion, mean over a cycle")
    fuel_rate: Variable = variable("kg/s", "Fuel flow, mean over a cycle")
    fuel: Variable = variable("kg", "Fuel burnt", start=0.0)

    @classmethod
    @arguments_checked
    def inline(cls, order: Sequence[int], cylinder: Cylinder | None = None, **values: Any) -> Self:
        """An engine whose cylinders fire at equal intervals, in the given ``order`` of their numbers; ``values`` are its other fields.

        ``cylinders[0]`` is cylinder 1. The first in the order fires at the ``phase`` of ``cylinder``, by default at the crank angle 0.
        Errors: ParameterError for an order that does not name every cylinder once.

        >>> [round(math.degrees(c.phase)) for c in PistonEngine.inline((1, 3, 2)).cylinders]
        [0, 480, 240]
        """
        fired = list(order)
        if not fired or sorted(fired) != list(range(1, len(fired) + 1)):
            raise ParameterError(
                f"order = {order} is not a firing order: it must name each cylinder from 1 on once, such as (1, 3, 4, 2)"
            )
        interval, one = 4 * math.pi / len(fired), cylinder or Cylinder()
        parts = (replace(one, phase=one.phase + interval * fired.index(number)) for number in range(1, len(fired) + 1))
        return cls(cylinders=tuple(parts), **values)

    def check(self) -> Equations:
        """There is at least one cylinder."""
        yield len(self.cylinders) > 0  # it has cylinders

    def equations(self) -> Equations:
        """All cylinders on one shaft."""
        crankshaft, cylinders = self.crankshaft, self.cylinders
        yield connect(self.crank, crankshaft.flange, *(c.flange for c in cylinders))
        yield connect(self.warmth, crankshaft.warmth)
        yield connect(self.housing, crankshaft.support, *(c.support for c in cylinders))
        yield crankshaft.displacement == _sum(c.displacement() for c in cylinders)
        w = crankshaft.w
        yield self.speed.value == w
        yield self.load == limited(self.on.value) * limited(self.throttle.value) * limited(w / self.w_fire)
        for c in cylinders:
            yield c.load.value == self.load
            yield c.manifold.value == limited(w / self.w_fire)
        yield self.tau == -_sum(c.flange.tau for c in cylinders)
        yield self.heat == self.load * w / (4 * math.pi) * _sum(c.mixture * c.displacement() for c in cylinders)
        yield self.fuel_rate == self.heat / self.heating_value
        yield der(self.fuel) == self.fuel_rate
        walls = _sum(c.walls * c.mixture * c.displacement() for c in cylinders)
        yield self.heat_port.Q_flow == -self.load * w / (4 * math.pi) * walls - crankshaft.lossPower


def _sum(terms: Iterable[Symbol]) -> Symbol:
    return ca.sum1(ca.vertcat(*terms))
