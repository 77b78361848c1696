"""Hydrodynamic torque: torque converter and fluid coupling."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Self

import casadi as ca
import numpy as np

from powertrain import (
    Equations,
    Input,
    Map,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    der,
    friction,
    parameter,
    signal_input,
    variable,
)
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import Lossy, TwoFlangesAndSupport

CREEP = 1e-3
"""Smallest speed [rad/s] of a wheel in a speed ratio."""
STALL_SPEED, STALL_TORQUE = parameter("rad/s", "Stall speed", above=0), parameter("N.m", "Torque at stall", above=0)
CHECKED = 51
"""Points between two rows at which the efficiency of a table is checked."""


class _Hydrodynamic(TwoFlangesAndSupport, Lossy):
    """Partial: pump wheel (flange_a) and turbine wheel (flange_b) in one housing."""

    w_a: Variable = variable("rad/s", "Speed of the pump against the support")
    w_b: Variable = variable("rad/s", "Speed of the turbine against the support")
    tau_drive: Variable = variable("N.m", "Torque of the pump to drive the oil")
    tau_coast: Variable = variable("N.m", "Torque of the turbine to drive the oil, in overrun")

    def _flows(self, capacity: Map, scale: Symbol | float = 1.0) -> Equations:
        """The two circulations, each with the square of the speed of its driving wheel; ``capacity`` ends with 0 at 1.

        Torque over speed squared is ``scale capacity`` [N.m.s2/rad2].
        """
        yield from self._balance()
        yield self.w_a == der(self.flange_a.phi - self.support.phi)
        yield self.w_b == der(self.flange_b.phi - self.support.phi)
        yield self.tau_drive == scale * capacity(self._ratio(self.w_b, self.w_a)) * self.w_a * ca.fabs(self.w_a)
        yield self.tau_coast == scale * capacity(self._ratio(self.w_a, self.w_b)) * self.w_b * ca.fabs(self.w_b)

    def _ratio(self, driven: Symbol, driving: Symbol) -> Symbol:
        """Speed ratio within 0..1; 0 if the wheels turn in opposite directions."""
        return limited(driven * driving / (driving**2 + CREEP**2))


def _stronger(one: Symbol, other: Symbol) -> Symbol:
    """The sum of two values; if they have the same sign, only the one of larger magnitude."""
    return ca.fmax(ca.fmax(one, other), 0) + ca.fmin(ca.fmin(one, other), 0)


class TorqueConverter(_Hydrodynamic):
    """A hydrodynamic torque converter with K factor and torque ratio, and with a lock-up clutch.

    nu = w_b/w_a within 0..1;  tau_drive = (w_a/K(nu))^2 for w_b < w_a,  tau_coast = (w_b/K(1/nu))^2 for w_b > w_a,  else 0
    flange_a.tau = tau_drive - tau_coast - tau_lock,  flange_b.tau = tau_coast - R(nu) tau_drive + tau_lock
    w_a w_b < 0: |flange_a.tau + tau_lock| = max(|tau_drive|, |tau_coast|),  |flange_b.tau - tau_lock| = max(R(0) |tau_drive|, |tau_coast|)
    w_rel = w_b - w_a > 0: tau_lock = tau_max lockup;  w_rel < 0: tau_lock = -tau_max lockup;  w_rel = 0: |tau_lock| <= tau_max lockup

    ``table``: rows (nu, K in rad/s/root(N.m), R) from nu = 0 up, K = w_a/root(flange_a.tau) at the pump; 1/K^2 and R are linear between
    them, and after the last row 1/K^2 falls to 0 at nu = 1. In overrun the turbine drives the oil instead of the pump, and the stator
    freewheels, so torque is not multiplied. If the wheels turn in opposite directions, as in a car that rolls back in gear, the
    faster one drives the oil as at stall: the K factor at negative speed ratios is about that of stall. The stator torque acts on the
    support. The loss is due to the slip of the wheels and is never negative, because R nu <= 1. Errors: ParameterError for a table that
    does not begin at 0, does not increase, has a K that is not positive or a negative R, or delivers more power than it receives. The
    default values are invented, for a 150 N.m engine: stall at 2,000 rpm, with a torque ratio of two.
    Source: SAE J643, hydrodynamic drive test code (K factor, torque ratio over speed ratio).
    """

    table: tuple[tuple[float, float, float], ...] = (
        (0.0, 17.0, 2.0),
        (0.2, 17.2, 1.8),
        (0.4, 17.6, 1.58),
        (0.6, 18.2, 1.35),
        (0.8, 19.5, 1.11),
        (0.88, 21.5, 1.0),
        (0.95, 30.0, 1.0),
        (0.98, 46.0, 1.0),
    )
    tau_max: Parameter = parameter("N.m", "Torque of the closed lock-up clutch", default=400.0, min=0)
    lockup: Input = signal_input("1", "Lock-up clutch, 0 open to 1 closed", default=0.0)
    w_rel: Variable = variable("rad/s", "Speed of the turbine against the pump", prefer=True)
    tau_lock: Variable = variable("N.m", "Torque of the lock-up clutch")

    @classmethod
    def of_stall(cls, w: float | str, tau: float | str, **parameters: Any) -> Self:
        """The default converter in another size: the pump torque ``tau`` [N.m] stalls it at the speed ``w`` [rad/s].

        All K factors have the same proportion; the lock-up clutch holds 1.5 tau unless ``tau_max`` says otherwise. Values with a unit,
        such as "1600 rpm", are converted. Errors: ParameterError for values that are not positive.
        """
        where, like = f"{cls.__name__}.of_stall", cls()
        stall, torque = STALL_SPEED.check(w, f"{where}: w"), STALL_TORQUE.check(tau, f"{where}: tau")
        scale = stall / torque**0.5 / like.table[0][1]
        table = tuple((nu, K * scale, R) for nu, K, R in like.table)
        return cls(**{"table": table, "tau_max": 1.5 * torque} | parameters)

    def equations(self) -> Equations:
        """Oil and clutch in parallel."""
        nu, capacity, R = _checked_table(self.table, f"{self._label}.table")
        yield from self._flows(_over_ratio(nu, capacity, "capacity", "N.m.s2/rad2"))
        multiplied = _over_ratio(nu, R, "torque ratio", "1")(self._ratio(self.w_b, self.w_a)) * self.tau_drive
        yield self.w_rel == der(self.flange_b.phi - self.flange_a.phi)
        yield self.flange_a.tau == _stronger(self.tau_drive, -self.tau_coast) - self.tau_lock
        yield self.flange_b.tau == self.tau_lock - _stronger(multiplied, -self.tau_coast)
        limit = self.tau_max * limited(self.lockup.value)
        yield friction(self.w_rel, self.tau_lock, -limit, limit, name="lock")
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Power in minus power out; the support is at rest."""
        return self.flange_a.tau * self.w_a + self.flange_b.tau * self.w_b


class FluidCoupling(_Hydrodynamic):
    """A fluid (Föttinger) coupling: two wheels without a stator, so both have the same torque.

    nu = w_b/w_a within 0..1,  flange_a.tau = -flange_b.tau = lambda(nu) rho D^5 w_a^2 for w_b < w_a
      In overrun: flange_b.tau = -flange_a.tau = lambda(1/nu) rho D^5 w_b^2
    w_a w_b < 0: flange_a.tau = -flange_b.tau = lambda(0) rho D^5 max(w_a^2, w_b^2) sign(w_a)

    ``table``: rows (nu, lambda) of the performance coefficient, linear between them, from nu = 0 to a coefficient of 0 at nu = 1. The
    efficiency is nu. At 3 % slip the default has the coefficient for which couplings are sized, about 1.8e-3.
    Errors: ParameterError for a table that does not go from 0 to 1, or is negative.
    Source: VDI 2153, Hydrodynamische Leistungsübertragung.
    """

    table: tuple[tuple[float, float], ...] = (
        (0.0, 2e-2),
        (0.5, 1.6e-2),
        (0.8, 9e-3),
        (0.9, 5e-3),
        (0.97, 1.8e-3),
        (1.0, 0.0),
    )
    D: Parameter = parameter("m", "Profile diameter", default=0.25, above=0)
    rho: Parameter = parameter("kg/m3", "Density of the oil", default=850.0, above=0)

    def equations(self) -> Equations:
        """The same torque, whichever wheel drives."""
        where = f"{self._label}.table"
        rows = np.array(self.table, float)
        if not rows.size or rows[0, 0] != 0 or rows[-1].tolist() != [1, 0] or rows.min() < 0 or _falls(rows):
            raise ParameterError(
                f"{where}: {self.table!r} is not a table of rows (nu, lambda) with nu increasing from 0 to (1, 0) and lambda >= 0"
            )
        yield from self._flows(_over_ratio(rows[:, 0], rows[:, 1], "lambda", "1"), self.rho * self.D**5)
        yield self.flange_a.tau == _stronger(self.tau_drive, -self.tau_coast)
        yield self.flange_b.tau == -self.flange_a.tau
        yield from self._dissipate()

    def loss(self) -> Symbol:
        """Torque times slip."""
        return self.flange_a.tau * (self.w_a - self.w_b)


def _falls(rows: np.ndarray) -> bool:
    """Whether a speed ratio is not above the one before."""
    return bool((np.diff(rows[:, 0]) <= 0).any())


def _over_ratio(nu: np.ndarray, values: np.ndarray, name: str, unit: str) -> Map:
    return Map.curve(nu, values, x="nu", unit=unit, name=name, outside="linear")


def _checked_table(
    table: tuple[tuple[float, float, float], ...], where: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Speed ratios with capacities 1/K^2 and torque ratios, up to nu = 1."""
    rows = np.array(table, float)
    if not rows.size or rows[0, 0] != 0 or rows[-1, 0] >= 1 or _falls(rows):
        raise ParameterError(
            f"{where}: {table!r} is not a table of rows (nu, K, R) with nu starting at 0, increasing and below 1"
        )
    if (rows[:, 1] <= 0).any():
        raise ParameterError(f"{where}: a K factor of {rows[:, 1].min():g} rad/s/root(N.m); it must be positive")
    if (rows[:, 2] < 0).any():
        raise ParameterError(f"{where}: a torque ratio R of {rows[:, 2].min():g}; it must not be negative")
    nu, R = np.append(rows[:, 0], 1.0), np.append(rows[:, 2], rows[-1, 2])
    for (a, one), (b, other) in pairwise(zip(nu.tolist(), R.tolist(), strict=True)):
        at = np.linspace(a, b, CHECKED)
        gain = at * np.interp(at, [a, b], [one, other])
        if gain.max() > 1 + 1e-9:
            raise ParameterError(
                f"{where}: between nu = {a:g} and {b:g} the torque ratio times nu rises to {gain.max():.4g}; a converter cannot give more "
                "power than it receives: reduce R, or add rows where the curve bends"
            )
    return nu, np.append(1 / rows[:, 1] ** 2, 0.0), R
