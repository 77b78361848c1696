"""An electric machine with its inverter: a demanded torque within limits, and losses."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Self

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from powertrain import (
    Equations,
    Input,
    Map,
    OperatingMap,
    Output,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    arguments_checked,
    der,
    parameter,
    port,
    signal_input,
    signal_output,
    variable,
)
from powertrain.components.common_units import RPM
from powertrain.components.electric.efficiency import losses_of_efficiency
from powertrain.components.electric.interfaces import DCTerminal
from powertrain.components.evaluation import numbers
from powertrain.components.limited import limited
from powertrain.components.map_checks import check_units
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.thermal import HeatPort, Lossy

TURNING = 1.0
"""Speed [rad/s] above which the sign of the torque decides whether a machine drives or generates."""

LEVELS = (70.0, 75.0, 80.0, 85.0, 90.0, 95.0, 100.0)
"""Efficiencies [%] of the contour lines."""

LEAST = 1e-3
"""Voltage [V] from which the supply is full if V_full = 0: the voltage then limits nothing."""

STILL = 1e-12
"""Smallest speed [rad/s] in the torque limit, which avoids a division by zero."""


class ElectricMachine(Lossy):
    """A motor and generator whose torque follows a demand within its limits.

    J der(w) = tau + shaft.tau,  bus.v bus.i = tau w + lossPower,  w = der(shaft.phi)
    tau = torque_demand within -limit..limit,  limit = min(tau_max, P_max supply/|w|) fade derating
    fade = (w_max supply - |w|)/band within 0..1,  derating = (T_max - heat_port.T)/T_band within 0..1
    supply = bus.v/V_full within 0..1,  lossPower = P_0 + copper warm tau^2 + iron |w| + windage w^2,  or loss_map
    warm = 1 + alpha (heat_port.T - 293.15 K)

    Forward it drives if tau > 0; it generates if tau w < 0. Below the voltage V_full, field weakening begins at a lower speed: power and
    top speed fall with the voltage; with V_full = 0 they do not. The default T_max is that of insulation class H (IEC 60085).
    ``loss_map`` [W] replaces the formula. It is over |w| [rad/s] and |tau| [N.m]; or, if its torques extend below zero, over |w| and a
    torque that is positive while the machine drives and negative while it generates. Below 1 rad/s the two losses are blended; at rest the
    loss is their mean, and beyond the torque at which one of them ends, it rises like the other. The bus supplies the loss, also at rest
    and without torque. The torque follows without delay. ``from_efficiency`` takes efficiencies instead of losses. The default values are
    invented, for a machine of 50 kW. A loss map holds for one temperature: alpha must be 0.

    Errors: ParameterError for an alpha beside a loss map, other axes or a negative loss.
    """

    shaft: Flange = port(Flange)
    bus: DCTerminal = port(DCTerminal)
    torque_demand: Input = signal_input("N.m", "Torque demand, positive in the forward direction")
    speed: Output = signal_output("rad/s", "Speed of the shaft")
    loss_map: Map | None = None
    J: Parameter = parameter("kg.m2", "Moment of inertia", default=0.03, min=0)
    tau_max: Parameter = parameter("N.m", "Maximum torque", default=200.0, above=0)
    P_max: Parameter = parameter("W", "Maximum power at the shaft", default=50e3, above=0)
    w_max: Parameter = parameter("rad/s", "Speed from which there is no torque", default=1200.0, above=0)
    band: Parameter = parameter("rad/s", "Speed range below w_max in which the torque fades out", default=20.0, above=0)
    V_full: Parameter = parameter("V", "Voltage of the bus from which P_max and w_max hold", default=0.0, min=0)
    T_max: Parameter = parameter(
        "K", "Temperature of the winding from which there is no torque", default=453.15, above=0
    )
    T_band: Parameter = parameter(
        "K", "Temperature range below T_max in which the torque fades out", default=20.0, above=0, max=200
    )
    alpha: Parameter = parameter("1/K", "Rise of the winding's resistance, 0.0039 for copper", default=0.0, min=0)
    P_0: Parameter = parameter("W", "Loss at rest without torque", default=50.0, min=0)
    copper: Parameter = parameter("W/(N2.m2)", "Loss over torque squared", default=0.1, min=0)
    iron: Parameter = parameter("W.s/rad", "Loss over speed", default=1.0, min=0)
    windage: Parameter = parameter("W.s2/rad2", "Loss over speed squared", default=1e-3, min=0)
    w: Variable = variable("rad/s", "Speed of the shaft", prefer=True)
    tau: Variable = variable("N.m", "Torque of the machine, without its inertia")
    tau_limit: Variable = variable("N.m", "Maximum torque at its speed, voltage and temperature")
    power: Variable = variable("W", "Power of the machine, without its inertia, positive when driving")

    @classmethod
    @arguments_checked
    def from_efficiency(
        cls,
        efficiency: Map | str | Path,
        *,
        no_load: float | str | Map | None = None,
        standstill: float | str | Map | None = None,
        **parameters: Any,
    ) -> Self:
        """A machine with the losses that belong to a table of efficiencies, such as ``speed [rpm], torque [Nm], efficiency [%]``.

        driving, tau > 0: loss = tau w (1/eta - 1),  generating, tau < 0: loss = |tau| w (1 - eta)

        The losses are interpolated, not the efficiencies. A table with positive torques only holds for both directions of power, with
        the losses of driving. No efficiency determines the losses without torque and at rest: they are arguments, and become
        points of the table. Without them, below the lowest speed and torque the axes of the table determine the loss; in a table with
        torques of both signs it is linear from one to the other.

        Parameters
        ----------
        efficiency : Map or path
            Efficiency [1] of machine and inverter over speed [rad/s] and torque [N.m], or its file. Beyond the table of a file the losses
            are those at its edge, so that the efficiency rises with speed and torque; runs count the steps there.
        no_load : float, str or Map, optional
            Loss without torque [W], or a curve over the speed [rad/s].
        standstill : float, str or Map, optional
            Loss with torque at rest [W], or a curve over the torque [N.m].
        **parameters
            Other parameters of the machine.

        Raises
        ------
        ParameterError
            For efficiencies that are not above 0 and at most 1, with their point; for points without speed or torque whose loss is not
            given; for other axes or units.

        Examples
        --------
        >>> from powertrain import Axis
        >>> table = Map([Axis("speed", "rad/s", [100, 500]), Axis("torque", "N.m", [20, 100])], [[0.8, 0.9], [0.9, 0.95]], "1")
        >>> machine = ElectricMachine.from_efficiency(table, no_load="100 W", P_max="60 kW")
        >>> round(machine.losses(100, 20)), round(machine.losses(100, 10)), round(machine.losses(500, 100))
        (500, 300, 2632)
        """
        where = f"{cls.__name__}.from_efficiency"
        cls._check_names(parameters, "no_load", "standstill")
        table = efficiency if isinstance(efficiency, Map) else Map.from_csv(efficiency, outside="clip")
        return cls(loss_map=losses_of_efficiency(table, no_load, standstill, where), **parameters)

    def check(self) -> Equations:
        """At rest there is torque, and a loss map holds for one temperature of the winding."""
        yield self.band <= self.w_max  # the torque does not fade at rest
        if self.loss_map is not None:
            yield self.alpha <= 0  # a loss map holds for one temperature

    def equations(self) -> Equations:
        """A limited torque, and a power balance."""
        if self.loss_map is not None:
            _checked_loss(self.loss_map, self._label)
        yield self.tau_limit == self._limit(self.w, self.bus.v, self.heat_port.T)
        yield self.w == der(self.shaft.phi)
        yield self.speed.value == self.w
        yield self.tau == limited(self.torque_demand.value, -self.tau_limit, self.tau_limit)
        yield self.J * der(self.w) == self.tau + self.shaft.tau
        yield self.power == self.tau * self.w
        yield self.bus.v * self.bus.i == self.power + self.lossPower
        yield from self._dissipate()

    def _limit(self, w: Symbol, v: Symbol, T: Symbol) -> Symbol:
        supply = limited(v / ca.fmax(self.V_full, LEAST))
        speed, power = ca.fabs(w), self.P_max * supply
        constant_power = power / ca.fmax(ca.fmax(speed, power / self.tau_max), STILL)
        fade, derating = (self.w_max * supply - speed) / self.band, (self.T_max - T) / self.T_band
        return constant_power * limited(fade) * limited(derating)

    def _loss(self, w: Symbol, tau: Symbol, T: Symbol) -> Symbol:
        if self.loss_map is None:
            copper = self.copper * (1 + self.alpha * (T - HeatPort.reference))
            return self.P_0 + copper * tau**2 + self.iron * ca.fabs(w) + self.windage * w**2
        if self.loss_map.axes[1].low < 0:
            drives, turns = ca.if_else(w >= 0, tau, -tau), limited(ca.fabs(w) / TURNING)
            turning = ca.fmax(self.loss_map(ca.fabs(w), drives), 0)
            return turns * turning + (1 - turns) * _loss_at_rest(self.loss_map, ca.fabs(w), ca.fabs(tau))
        return ca.fmax(self.loss_map(ca.fabs(w), ca.fabs(tau)), 0)

    def energy(self) -> Symbol:
        """Kinetic energy J w^2/2."""
        return self.J * self.w**2 / 2

    def loss(self) -> Symbol:
        """The loss by the formula or the map."""
        return self._loss(self.w, self.tau, self.heat_port.T)

    def full_load(self, w: ArrayLike, v: ArrayLike = math.inf, T: ArrayLike = HeatPort.reference) -> Any:
        """The largest torque [N.m] at speeds w [rad/s], voltages v [V] of the bus and temperatures T [K]."""
        return numbers(self._limit, w, v, T)

    @property
    def speed_range(self) -> tuple[float, float]:
        """The speeds [rad/s] between which the full load counts: up to that from which the torque fades out."""
        return 0.0, float(self.w_max - self.band)

    def losses(self, w: ArrayLike, tau: ArrayLike, T: ArrayLike = HeatPort.reference) -> Any:
        """The loss [W] at speeds w [rad/s], torques tau [N.m] and temperatures T [K]."""
        return numbers(self._loss, w, tau, T)

    def loss_at(self, tau: Symbol) -> Any:
        """The loss [W] with a torque tau [N.m], up to the last of loss_map, at the present speed and temperature."""
        within = tau if self.loss_map is None else self.loss_map.axes[1].clipped(tau)
        return self.losses(self.w, within, self.heat_port.T)

    def efficiency(self, w: ArrayLike, tau: ArrayLike) -> Any:
        """Power out over power in: at the shaft if it drives, at the bus if it generates (0 if the loss takes everything)."""
        shaft, loss = np.multiply(w, tau), self.losses(w, tau)
        out, taken = np.where(shaft > 0, shaft, -shaft - loss), np.where(shaft > 0, shaft + loss, -shaft)
        return np.where(taken > 0, np.maximum(out, 0) / np.where(taken > 0, taken, 1), 0.0)[()]

    def operating_map(self) -> OperatingMap:
        """Efficiency [%] over speed [rpm] and torque [N.m] of both signs, within the limits."""
        w = np.linspace(-float(self.w_max), float(self.w_max), 121)
        limit = self.full_load(w)
        tau = np.linspace(-float(limit.max()), float(limit.max()), 81)
        inside = np.abs(tau[:, None]) <= limit
        efficiency = np.where(inside, 100 * self.efficiency(w, np.where(inside, tau[:, None], 0.0)), np.nan)
        return OperatingMap(
            quantity="Efficiency of machine and inverter [%]",
            x="w",
            y="tau",
            x_label="Speed [rpm]",
            y_label="Torque [N·m]",
            x_values=w / RPM,
            y_values=tau,
            values=efficiency,
            levels=LEVELS,
            limits=(("limit", w / RPM, limit), ("limit, backward", w / RPM, -limit)),
            x_scale=1 / RPM,
        )


def _loss_at_rest(table: Map, w: Symbol, tau: Symbol) -> Symbol:
    """The mean of driving and generating; beyond the torque at which one of them ends, it rises like the other."""
    axis = table.axes[1]
    longer = 1 if axis.high >= -axis.low else -1
    both = ca.fmin(tau, min(axis.high, -axis.low))
    half = (table(w, longer * both) - table(w, -longer * both)) / 2
    return ca.fmax(table(w, longer * tau) - half, 0)


def _checked_loss(table: Map, path: str) -> None:
    other = "; ElectricMachine.from_efficiency takes efficiencies" if table.unit == "1" else ""
    wanted = f"a loss [W] over speed [rad/s] and torque [N.m]{other}"
    check_units(table, f"{path}.loss_map", "W", ("rad/s", "N.m"), wanted)
    if table.values.min() < 0:
        raise ParameterError(f"{path}.loss_map falls to {table.values.min():g} W; a loss must not be negative")
