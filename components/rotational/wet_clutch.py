"""Wet clutches: friction that depends on speed and temperature, and the drag of the oil between open plates."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from powertrain import (
    Axis,
    Equations,
    Map,
    Parameter,
    ParameterError,
    Symbol,
    friction,
    parameter,
)
from powertrain.components.map_checks import check_coefficient
from powertrain.components.pressed import Pressed
from powertrain.components.rotational.interfaces import FrictionCoupling
from powertrain.components.thermal import HeatPort

AXES = {"w_rel": "rad/s", "T": "K"}
"""Arguments of the friction of a wet clutch, with their units."""


def _paper() -> Map:
    w, T = np.array([0.0, 5.0, 20.0, 60.0, 150.0, 400.0]), np.array([253.15, 293.15, 333.15, 373.15, 423.15])
    cold = np.array([1.12, 1.05, 1.0, 0.97, 0.92])
    table = np.array([0.110, 0.122, 0.130, 0.133, 0.131, 0.124])[:, None] * cold
    axes = Axis("w_rel", "rad/s", w, outside="clip"), Axis("T", "K", T, outside="clip")
    return Map(axes, table, unit="1", name="paper lining")


PAPER_LINING = _paper()
"""Typical of a paper lining in transmission fluid: friction rises with speed, which prevents judder, and falls with temperature."""


class WetClutch(Pressed, FrictionCoupling):
    """A wet multi-plate clutch whose coefficient of friction depends on the relative speed and on the temperature of its plates.

    w_rel = der(flange_b.phi - flange_a.phi),  tau = flange_b.tau = -flange_a.tau,  fn = fn_max f_normalized
    sliding: tau = cgeo mue(|w_rel|, T) fn sign(w_rel);  w_rel = 0: |tau| <= cgeo mue(0, T) fn;  fn <= 0: tau = 0

    T is the temperature of the heat port, which takes the friction power: connect a ``HeatCapacitor`` for the plates, and from there a
    ``ThermalConductor`` or a ``Convection`` to the oil. ``mue``: a map over w_rel [rad/s], T [K] or both. A map that rises with speed damps
    judder; one that falls excites it. For the drag of the open clutch add a ``PlateDrag`` in parallel.

    Errors: ParameterError for other axes, another unit, and values below zero.
    """

    mue: Map = PAPER_LINING
    cgeo: Parameter = parameter("m", "Friction radius times number of friction faces", default=1.0, min=0)

    def equations(self) -> Equations:
        """Friction in both directions."""
        yield from self._transmit()
        yield from self._press()
        limit = self.cgeo * ca.fmax(self.fn, 0) * self._mue()
        yield friction(self.w_rel, self.tau, -limit, limit)
        yield from self._dissipate()

    def _mue(self) -> Symbol:
        check_coefficient(self.mue, f"{self._label}.mue", "a coefficient of friction", AXES)
        if (least := float(self.mue.values.min())) < 0:
            raise ParameterError(
                f"{self._label}.mue falls to {least:g}; a coefficient of friction must not be negative"
            )
        values = {"w_rel": ca.fabs(self.w_rel), "T": self.heat_port.T}
        return self.mue(*(values[axis.name] for axis in self.mue.axes))


class PlateDrag(FrictionCoupling):
    """Drag of the oil film between the open plates of a wet clutch or brake.

    tau = flange_b.tau = -flange_a.tau = faces pi eta (r^4 - r_i^4)/(2 h) w_rel,  eta = viscosity exp(-beta (T - 293.15 K))
      r^2 = r_o^2, or 20 eta q/(pi rho w_rel^2 h^3) where this is less, but not below r_i^2;  q = flow/faces

    The torque is that of a Couette flow on the part of the face covered by oil. A plate at rest and one turning at w pump outwards
    pi rho w^2 r^2 h^3/(20 eta), the integral of the laminar profile under centrifugal force without pressure. The film is full up to the
    radius at which this equals the flow supplied. Drag therefore rises with speed to its peak at
    w_rel^2 = 20 eta q/(pi rho h^3 r_o^2), and vanishes at r_o/r_i times this speed. For a clutch in which both sets of plates turn, the
    peak is an approximation. T is the temperature of the heat port. Source: H. Kitabayashi, C. Y. Li, H. Hiraki, Analysis of the Various
    Factors Affecting Drag Torque in Multiple-Plate Wet Clutches, SAE 2003-01-1973 (law of the shrinking film).

    Errors: ParameterError if the plates have no width.
    """

    faces: Parameter = parameter("1", "Number of friction faces", default=10.0, above=0)
    r_i: Parameter = parameter("m", "Inner radius of the faces", default=0.060, above=0)
    r_o: Parameter = parameter("m", "Outer radius of the faces", default=0.075, above=0)
    h: Parameter = parameter("m", "Gap at each face", default=0.2e-3, above=0)
    flow: Parameter = parameter("m3/s", "Oil supplied to the clutch", default=5e-5, above=0)
    viscosity: Parameter = parameter("Pa.s", "Dynamic viscosity of the oil at 293.15 K", default=0.06, above=0)
    beta: Parameter = parameter("1/K", "Decrease of the viscosity's logarithm with temperature", default=0.03, min=0)
    rho: Parameter = parameter("kg/m3", "Density of the oil", default=850.0, above=0)

    def check(self) -> Equations:
        """A ring."""
        yield self.r_i < self.r_o

    def equations(self) -> Equations:
        """Shear of a shrinking film."""
        yield from self._transmit()
        yield self.tau == self._drag(self.heat_port.T)
        yield from self._dissipate()

    def _drag(self, T: Symbol) -> Symbol:
        eta = self.viscosity * ca.exp(-self.beta * (T - HeatPort.reference))
        inner, outer = self.r_i**2, self.r_o**2
        carried = 20 * eta * self.flow / (self.faces * math.pi * self.rho * self.h**3)
        covered = ca.fmax(inner, carried / ca.fmax(self.w_rel**2, carried / outer))
        return self.faces * math.pi * eta * (covered**2 - inner**2) / (2 * self.h) * self.w_rel
