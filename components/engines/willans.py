"""An engine described by a Willans line and data-sheet values."""

from __future__ import annotations

import math
from typing import Any, Self

import casadi as ca

from powertrain import Equations, Map, Parameter, ParameterError, Symbol, parameter
from powertrain.components.engines.interfaces import VOLUME, Engine
from powertrain.components.limited import limited
from powertrain.components.map_checks import check_units

DISPLACEMENT = 1.6e-3
"""Displacement [m3] of the default engine."""
PROPORTIONAL = ("tau_0", "tau_2", "tau_max", "P_max", "tau_low", "J", "tau_starter")
"""Parameters in proportion to displacement, at equal mean effective pressures and speeds."""
W_FRICTION = 400.0
"""Speed [rad/s] up to which ``p_2`` is the rise of the friction pressure."""
POWER = parameter("W", "Maximum power", above=0)
PRESSURE = parameter("Pa", "Mean effective pressure of friction", min=0)
ROUNDED = 0.03
"""Allowed relative contradiction of data-sheet values: they are rounded, and so are the ends of speed ranges."""


class WillansEngine(Engine):
    """An engine whose fuel power is a linear function of its torque.

    fuel power = firing w/e + P_heat (firing/tau_heat within 0..1),  firing = tau + motoring
    motoring = tau_0 + tau_2 w^2,  tau = u (full load + motoring) - motoring

    In mean effective pressures p = 4 pi tau/V this is p_me = e p_mf - p_me0: e is the indicated efficiency, p_me0 the friction. P_heat
    is the load-independent heat loss to the cylinder walls, fully developed above the combustion torque tau_heat; in overrun it is
    zero. The full-load torque is a curve through the data-sheet points: a parabola from tau_low at w_low to the largest torque tau_max at
    w_tau (below w_low it falls at most in proportion to speed), and from there to the largest power P_max at w_P the cubic with the slope
    of a power maximum, -P_max/w_P^2, which continues as a straight line above w_P: there the power is P_max (1 - (w/w_P - 1)^2). It is
    limited to tau_max and to P_max/w. Alternatively it is ``curve``, a map from speed [rad/s] to torque [N.m].

    Source: L. Guzzella, A. Sciarretta, Vehicle Propulsion Systems, 3rd ed., Springer 2013, section 3.1. The defaults are invented, for a
    1.6 l gasoline engine; ``of_displacement`` makes engines of other sizes. Errors: ParameterError for a curve with other axes or
    another unit, and for a rev limiter ``w_limit`` above its speeds, unless it extrapolates linearly.
    """

    e: Parameter = parameter("1", "Indicated efficiency", default=0.38, above=0, max=1)
    tau_0: Parameter = parameter("N.m", "Motoring torque at rest", default=18.0, min=0)
    P_heat: Parameter = parameter("W", "Heat loss to the cylinder walls while firing", default=0.0, min=0)
    tau_heat: Parameter = parameter("N.m", "Combustion torque from which the full heat is lost", default=1.0, above=0)
    tau_2: Parameter = parameter("N.m.s2/rad2", "Rise of the motoring torque with speed squared", default=4e-5, min=0)
    tau_max: Parameter = parameter("N.m", "Maximum torque", default=150.0, above=0)
    w_tau: Parameter = parameter("rad/s", "Speed of the maximum torque", default=420.0, above=0)
    P_max: Parameter = parameter("W", "Maximum power", default=82e3, above=0)
    w_P: Parameter = parameter("rad/s", "Speed of the maximum power", default=600.0, above=0)
    tau_low: Parameter = parameter("N.m", "Full-load torque at w_low", default=105.0, min=0)
    w_low: Parameter = parameter("rad/s", "A low speed, between idling and w_tau", default=100.0, above=0)
    curve: Map | None = None

    @classmethod
    def of_displacement(
        cls,
        displacement: float | str,
        *,
        P_max: float | str | None = None,
        p_0: float | str | None = None,
        p_2: float | str | None = None,
        **parameters: Any,
    ) -> Self:
        """An engine of the default kind with another displacement V [m3], such as "2.0 l".

        It has the same mean effective pressures at the same speeds, as an engine with more or fewer equal cylinders. Torques, powers and
        moment of inertia are in proportion to V, and the specific consumption is the same at the same mean effective pressure.

        tau_0 = p_0 V/(4 pi),  tau_2 = p_2 V/(4 pi)/(400 rad/s)^2

        Parameters
        ----------
        displacement : float or str
            Displacement [m3] of a four-stroke engine.
        P_max : float or str, optional
            Largest power [W]; the full-load torques are in proportion to it. Default: 51 kW/l.
        p_0, p_2 : float or str, optional
            Mean effective pressure of friction at rest and its rise up to 400 rad/s [Pa]. Default: 1.41 bar and 0.50 bar.
        **parameters
            Other parameters of the engine, as they are.

        Raises
        ------
        ParameterError
            For values that are not positive, and for a displacement above 0.1 m3.

        References
        ----------
        G. Rizzoni, L. Guzzella, B. M. Baumann, Unified modeling of hybrid electric vehicle drivetrains, IEEE/ASME Transactions on
        Mechatronics 4 (1999) 246.
        """
        where, like = f"{cls.__name__}.of_displacement", cls()
        V = VOLUME.check(displacement, f"{where}: displacement")
        made = {name: float(getattr(like, name)) * V / DISPLACEMENT for name in PROPORTIONAL}
        if P_max is not None:
            load = POWER.check(P_max, f"{where}: P_max") / made["P_max"]
            made |= {name: load * made[name] for name in ("tau_max", "P_max", "tau_low")}
        if p_0 is not None:
            made["tau_0"] = PRESSURE.check(p_0, f"{where}: p_0") * V / (4 * math.pi)
        if p_2 is not None:
            made["tau_2"] = PRESSURE.check(p_2, f"{where}: p_2") * V / (4 * math.pi) / W_FRICTION**2
        return cls(**made | parameters)

    def check(self) -> Equations:
        """The points of the full-load curve must be in order; none may exceed the largest power or the largest torque."""
        yield from super().check()
        if self.curve is not None:
            yield from self._fires_within(self.curve.axes[0])
        else:
            yield self.w_low < self.w_tau
            yield self.w_tau < self.w_P
            yield self.tau_low <= self.tau_max
            yield self.tau_max * self.w_tau <= (1 + ROUNDED) * self.P_max  # the power rises up to w_P
            yield self.P_max <= (1 + ROUNDED) * self.tau_max * self.w_P  # the torque at w_P is at most tau_max

    def equations(self) -> Equations:
        """The equations of every engine, with these laws."""
        if self.curve is not None:
            _checked_curve(self.curve, f"{self._label}.curve", self._values["w_idle"])
        yield from self._run()

    def _motoring(self, w: Symbol) -> Symbol:
        return self.tau_0 + self.tau_2 * w**2

    def _full_load(self, w: Symbol) -> Symbol:
        if self.curve is not None:
            return self.curve(w)
        span, torque = self.w_P - self.w_tau, self.P_max / self.w_P
        slope, drop = -torque / self.w_P * span, torque - self.tau_max
        slow = ca.fmin(w - self.w_tau, 0) / (self.w_tau - self.w_low)
        fast = ca.fmax(w - self.w_tau, 0) / span
        part = ca.fmin(fast, 1)
        rise = (self.tau_low - self.tau_max) * slow**2
        # A parabola through two close points falls steeply below them; an engine with full torque from 1,500 rpm could then not move off.
        rise = ca.fmax(rise, ca.fmin(self.tau_low * ca.fmin(w / self.w_low, 1) - self.tau_max, 0))
        # Above w_P the cubic may rise again, to many times the largest power.
        fall = (3 * drop - slope) * part**2 + (slope - 2 * drop) * part**3 + slope * (fast - part)
        return ca.fmax(ca.fmin(self.tau_max + rise + ca.fmin(fall, 0), self.P_max / ca.fmax(w, self.w_tau)), 0)

    def _fuel_power(self, w: Symbol, firing: Symbol) -> Symbol:
        return firing * w / self.e + self.P_heat * limited(firing / self.tau_heat)


def _checked_curve(curve: Map, where: str, w_idle: Any) -> None:
    check_units(curve, where, "N.m", ("rad/s",), "a torque [N.m] over one speed [rad/s]")
    if curve.values.min() < 0:
        raise ParameterError(
            f"{where} falls to {curve.values.min():g} N.m; the torque at full load must not be negative"
        )
    axis = curve.axes[0]
    if axis.outside == "error" and isinstance(w_idle, float) and w_idle < axis.low - axis.slack:
        raise ParameterError(
            f'{where} begins at {axis.low:g} rad/s, above the idle speed w_idle = {w_idle:g} rad/s; with outside = "clip" its first '
            "value holds below it"
        )
