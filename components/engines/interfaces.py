"""The common interface of engines: crankshaft, throttle, fuel, idle control, rev limiter, starter, and operating points as numbers."""

from __future__ import annotations

from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from powertrain import (
    Axis,
    Component,
    Equations,
    Input,
    ModelError,
    OperatingMap,
    Output,
    Parameter,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    port,
    signal_input,
    signal_output,
    support,
    variable,
    within,
)
from powertrain.components.common_units import G_KWH, RPM
from powertrain.components.evaluation import numbers
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.thermal import HeatPort

VOLUME = parameter("m3", "Displacement", above=0, max=0.1)
"""A displacement in SI units: more than 0.1 m3 was probably meant in litres."""
SMALL = 1e-3
"""Smallest torque of combustion at full load [N.m]: at idle speed an engine may have none."""


class Engine(Component):
    """Partial: a combustion engine with its inertia, fuel consumption, idle control, rev limiter and starter.

    J der(der(crank.phi)) = tau + crank.tau,  tau = firing + starter - drag = housing.tau,  w = der(crank.phi - housing.phi)
    w > 0: drag = warmth motoring(w);  w < 0: drag = -warmth motoring(-w);  w = 0: |drag| <= warmth motoring(0)
    fuel_rate heating_value = fuel power(w, firing),  der(fuel) = fuel_rate,  power = tau w

    The firing torque is the torque of combustion in addition to the motoring drag. It is zero with a closed throttle: no fuel
    flows in overrun. The throttle u and the starter, with throttle and on limited to 0..1, are

    u = on started limited min(throttle + idle, 1),  starter = on (1 - started) tau_starter,  started = w/w_fire within 0..1
    limited = (w_limit - w)/band_limit within 0..1 (rev limiter)
    idle = x + k_idle (w_idle - w) within 0..1,  der(x) = (on idle - x)/T_idle

    The idle controller is proportional-integral without windup; it starts with the throttle required for idling.

    ``warmth`` is 1 for a warm engine and greater for a cold one, see ``CoolantCircuit``; methods that return numbers are for the
    warm engine. The heat at ``heat_port`` is the work against drag and the share ``coolant_share`` of the combustion heat that does
    no work; the rest leaves with the exhaust.

    ``housing`` takes the reaction of the torque, for instance to a ``MountedHousing``; it is ground if nothing is connected.

    With ``on`` = 0 the engine burns no fuel and its drag brings it to rest and holds it. When ``on`` returns to 1, the starter
    turns it. ``statistics`` of a run counts the steps in which the vehicle drives the engine beyond w_limit, as after a missed shift, or
    backward beyond w_fire. The engine is a boundary: it supplies the chemical power of its fuel and the power of the starter; its loss is
    the power that does not reach the crankshaft. Errors: ParameterError for an idle speed below w_fire, or not below the rev limiter.
    """

    boundary: ClassVar[bool] = True
    crank: Flange = port(Flange)
    housing: Flange = support(Flange)
    throttle: Input = signal_input("1", "Throttle, 0 to 1")
    on: Input = signal_input("1", "1: running, 0: stopped", default=1.0)
    warmth: Input = signal_input("1", "Friction over that of the warm engine", default=1.0)
    heat_port: HeatPort = support(HeatPort)
    speed: Output = signal_output("rad/s", "Speed of the crank against the housing")
    J: Parameter = parameter("kg.m2", "Moment of inertia with the flywheel", default=0.15, min=0)
    heating_value: Parameter = parameter("J/kg", "Lower heating value of the fuel", default=43e6, above=0)
    fuel_density: Parameter = parameter("kg/m3", "Density of the fuel", default=745.0, above=0)
    co2_per_fuel: Parameter = parameter("kg/kg", "Mass of carbon dioxide per mass of fuel", default=3.17, min=0)
    coolant_share: Parameter = parameter("1", "Share of the heat of combustion to walls", default=0.45, min=0, max=1)
    w_idle: Parameter = parameter("rad/s", "Idle speed", default=85.0, min=0)
    k_idle: Parameter = parameter("s/rad", "Throttle per speed deviation below idle", default=0.02, min=0)
    T_idle: Parameter = parameter("s", "Integral time of the idle controller", default=0.5, above=0)
    w_limit: Parameter = parameter("rad/s", "Speed from which the engine does not fire", default=680.0, above=0)
    band_limit: Parameter = parameter(
        "rad/s", "Speed range below w_limit in which the limiter acts", default=10.0, above=0
    )
    w_fire: Parameter = parameter("rad/s", "Speed from which the engine fires fully", default=40.0, above=0)
    tau_starter: Parameter = parameter("N.m", "Torque of the starter at rest", default=60.0, min=0)
    w: Variable = variable("rad/s", "Speed of the crank against the housing", prefer=True)
    tau: Variable = variable("N.m", "Torque of the engine, without its inertia")
    firing: Variable = variable("N.m", "Combustion torque")
    drag: Variable = variable("N.m", "Friction and pumping torque")
    x: Variable = variable("1", "Integral part of the idle controller")
    power: Variable = variable("W", "Power of the engine, without its inertia")
    fuel_rate: Variable = variable("kg/s", "Fuel flow")
    fuel: Variable = variable("kg", "Fuel burnt", start=0.0)

    def _motoring(self, w: Symbol) -> Symbol:
        """Torque that turns the engine without fuel at a speed >= 0."""
        raise self._lacks("_motoring(w)")

    def _full_load(self, w: Symbol) -> Symbol:
        """Torque with an open throttle."""
        raise self._lacks("_full_load(w)")

    def _firing(self, w: Symbol, u: Symbol) -> Symbol:
        """Torque of combustion with throttle u."""
        return u * (self._full_load(w) + self._motoring(w))

    def _opening(self, w: Symbol, part: Symbol) -> Symbol:
        """Throttle for a share of the torque of combustion at full load, both within 0..1: the inverse of ``_firing``."""
        return part

    def _fuel_power(self, w: Symbol, firing: Symbol) -> Symbol:
        """Chemical power of the fuel for a torque of combustion."""
        raise self._lacks("_fuel_power(w, firing)")

    def _lacks(self, law: str) -> ModelError:
        return ModelError(f"{self._label}: {type(self).__name__} does not define its law {law}")

    def check(self) -> Equations:
        """The engine idles without its starter, and below the rev limiter."""
        yield self.w_fire <= self.w_idle  # else the starter would help it to idle
        yield self.w_idle < self.w_limit - self.band_limit

    def _fires_within(self, speeds: Axis) -> Equations:
        """The rev limiter is within the speeds of a table of full load, unless this extrapolates."""
        if speeds.outside != "linear":
            yield self.w_limit <= speeds.high + speeds.slack  # the highest speed of the full load

    def _run(self) -> Equations:
        w, on = self.w, limited(self.on.value)
        # an engine that stalls rocks back, but not far
        within(w, -self.w_fire, self.w_limit, name="speed of the engine", unit="rad/s", action="count")
        yield self.w == der(self.crank.phi - self.housing.phi)
        yield self.speed.value == self.w
        yield self.J * der(der(self.crank.phi)) == self.tau + self.crank.tau
        yield self.housing.tau == self.tau
        yield self.tau == self.firing + self._starter() - self.drag
        idle = limited(self.x + self.k_idle * (self.w_idle - w))
        yield der(self.x) == (on * idle - self.x) / self.T_idle
        u = on * self._started() * limited((self.w_limit - w) / self.band_limit)
        yield self.firing == self._firing(w, u * ca.fmin(limited(self.throttle.value) + idle, 1))
        limit = ca.fmax(self.warmth.value, 0) * self._motoring(ca.fabs(w))
        yield friction(w, self.drag, -limit, limit)
        yield self.power == self.tau * w
        yield self.fuel_rate == self._fuel_power(w, self.firing) / self.heating_value
        yield der(self.fuel) == self.fuel_rate
        heat = self.fuel_rate * self.heating_value - self.firing * w
        yield self.heat_port.Q_flow == -self.coolant_share * heat - self.drag * w

    def initial(self) -> Equations:
        """A running engine starts with the throttle that keeps it at idle speed; less above idle speed, down to zero.

        Without idle control (k_idle = 0) it starts with zero.
        """
        drag = self._motoring(self.w_idle)
        part = drag / ca.fmax(self._full_load(self.w_idle) + drag, SMALL)
        idle = self._opening(self.w_idle, limited(part))
        most = ca.fmin(idle, self.k_idle * self.w_idle)
        yield self.x == limited(self.on.value) * limited(idle + self.k_idle * (self.w_idle - self.w), 0, most)

    def _started(self) -> Symbol:
        return limited(self.w / self.w_fire)

    def _starter(self) -> Symbol:
        return limited(self.on.value) * (1 - self._started()) * self.tau_starter

    def energy(self) -> Symbol:
        """Kinetic energy J der(crank.phi)^2/2."""
        return self.J * der(self.crank.phi) ** 2 / 2

    def loss(self) -> Symbol:
        """Heat of combustion that does no work, and work against drag."""
        return self.fuel_rate * self.heating_value - self.firing * self.w + self.drag * self.w

    def full_load(self, w: ArrayLike | Symbol) -> Any:
        """Torque [N.m] with an open throttle at speeds w [rad/s], numbers or an expression."""
        return numbers(self._full_load, w)

    @property
    def speed_range(self) -> tuple[float, float]:
        """The speeds [rad/s] between which the full load counts: from idling to the start of the rev limiter."""
        return float(self.w_idle), float(self.w_limit - self.band_limit)

    def motoring(self, w: ArrayLike | Symbol) -> Any:
        """Torque [N.m] >= 0 that turns the engine without fuel at speeds w [rad/s], numbers or an expression."""
        return numbers(self._motoring, w)

    def torque(self, w: ArrayLike, u: ArrayLike) -> Any:
        """Torque [N.m] at speeds w [rad/s] with throttles u [1], limited to 0..1, without idle controller and limiter."""
        return numbers(lambda w, u: self._firing(w, limited(u)) - self._motoring(w), w, u)

    def opening(self, w: ArrayLike | Symbol, part: ArrayLike | Symbol) -> Any:
        """Throttle [1] for a share [1] of the torque of combustion at full load, at speeds w [rad/s]; numbers or an expression."""
        return numbers(self._opening, w, part)

    def fuel_flow(self, w: ArrayLike, tau: ArrayLike) -> Any:
        """Fuel flow [kg/s] at steady operating points: speeds w [rad/s], torques tau [N.m] (zero below the motoring line)."""

        def law(w: Symbol, tau: Symbol) -> Symbol:
            return self._fuel_power(w, ca.fmax(tau + self._motoring(w), 0)) / self.heating_value

        return numbers(law, w, tau)

    def bsfc(self, w: ArrayLike, tau: ArrayLike) -> Any:
        """Brake specific fuel consumption [kg/J], fuel flow over power; infinite without power. Multiply by 3.6e9 for g/kWh."""
        flow, power = self.fuel_flow(w, tau), np.multiply(w, tau)
        return np.where(power > 0, flow / np.where(power > 0, power, 1), np.inf)[()]

    def operating_map(self) -> OperatingMap:
        """Specific fuel consumption [g/kWh] over speed [rpm] and torque [N.m], up to full load."""
        w = np.linspace(0.8 * float(self.w_idle), float(self.w_limit), 81)
        full, motored = self.full_load(w), -self.motoring(w)
        tau = np.linspace(0.02 * float(full.max()), float(full.max()), 81)
        with np.errstate(invalid="ignore"):
            used = np.where(tau[:, None] <= full, self.bsfc(w, tau[:, None]) / G_KWH, np.nan)
        best = float(np.nanmin(used))
        return OperatingMap(
            quantity="Specific fuel consumption [g/kWh]",
            x="w",
            y="tau",
            x_label="Speed [rpm]",
            y_label="Torque [N·m]",
            x_values=w / RPM,
            y_values=tau,
            values=used,
            levels=tuple(float(round(best * (1 + 0.1 * k))) for k in range(11)),
            limits=(("full load", w / RPM, full), ("motored", w / RPM, motored)),
            x_scale=1 / RPM,
            low_is_best=True,
        )
