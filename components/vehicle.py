"""A vehicle in one dimension: mass, wheels and the resistances of road, air and slope."""

from __future__ import annotations

from typing import ClassVar

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Input,
    Parameter,
    Variable,
    connect,
    parameter,
    port,
    signal_input,
    variable,
)
from powertrain.components.blocks import Constant
from powertrain.components.body.body import G_N
from powertrain.components.rotational import Flange as Shaft
from powertrain.components.rotational import IdealRollingWheel, Inertia
from powertrain.components.translational import AirDrag, Flange, Mass, OneFlangeAndSupport, RollingResistance, Speed

__all__ = [
    "G_N",
    "GradeForce",
    "Vehicle",
]


class GradeForce(OneFlangeAndSupport):
    """The force of gravity along a slope; the potential energy is not tracked.

    flange.f = m g sin(alpha),  tan(alpha) = inclination
    """

    boundary: ClassVar[bool] = True
    m: Parameter = parameter("kg", "Mass", min=0)
    g: Parameter = parameter("m/s2", "Gravity", default=G_N, min=0)
    inclination: Input = signal_input("1", "Inclination of the road, tan(alpha)")
    f: Variable = variable("N", "Resistance, flange.f")

    def equations(self) -> Equations:
        """The weight's part along the road."""
        yield from self._against_support()
        slope = self.inclination.value
        yield self.f == self.m * self.g * slope / ca.sqrt(1 + slope**2)
        yield self.flange.f == self.f


class Vehicle(Component):
    """A vehicle on a road, driven at the wheels' shaft flangeR or pulled at flangeT, or both, or a trailer.

      (m + J/R^2) a = flangeR.tau/R + flangeT.f - fDrag - fRoll - fGrav
    fDrag = Cd A rho (v - vWind) |v - vWind|/2,  fRoll = Cr m g cos(alpha) sign(v),  fGrav = m g sin(alpha)

    tan(alpha) is the inclination. The sign is smoothed to v/vReg below vReg. With ``useWindInput``, ``useCrInput`` and
    ``useInclinationInput`` the signals vWind, cr and inclination replace the constants.
    Source: Modelica Standard Library 4.0.0, Translational.Components.Vehicle.
    """

    m: Parameter = parameter("kg", "Total mass of the vehicle", min=0)
    J: Parameter = parameter("kg.m2", "Total inertia of the drive train at the wheels", min=0)
    R: Parameter = parameter("m", "Wheel radius", above=0)
    A: Parameter = parameter("m2", "Cross section", min=0)
    Cd: Parameter = parameter("1", "Drag coefficient", min=0)
    rho: Parameter = parameter("kg/m3", "Density of the air", default=1.2, min=0)
    g: Parameter = parameter("m/s2", "Gravity", default=G_N, min=0)
    vWindConstant: Parameter = parameter("m/s", "Wind speed, positive in the direction of the vehicle", default=0.0)
    CrConstant: Parameter = parameter("1", "Rolling resistance coefficient", default=0.015, min=0)
    vReg: Parameter = parameter("m/s", "Speed below which rolling resistance is smoothed", default=1e-3, above=0)
    inclinationConstant: Parameter = parameter("1", "Inclination of the road, tan(alpha)", default=0.0)
    useWindInput: bool = False
    useCrInput: bool = False
    useInclinationInput: bool = False

    flangeR: Shaft = port(Shaft)
    flangeT: Flange = port(Flange)
    vWind: Input = signal_input("m/s", "Wind speed, positive in the direction of the vehicle", default=0.0)
    cr: Input = signal_input("1", "Rolling resistance coefficient", default=0.0)
    inclination: Input = signal_input("1", "Inclination of the road, tan(alpha)", default=0.0)
    s: Variable = variable("m", "Path of the vehicle")
    v: Variable = variable("m/s", "Speed of the vehicle")
    a: Variable = variable("m/s2", "Acceleration of the vehicle")

    inertia: Inertia = Inertia(J=0)
    idealRollingWheel: IdealRollingWheel = IdealRollingWheel()
    mass: Mass = Mass(m=0)
    fDrag: AirDrag = AirDrag(A=0, Cd=0)
    windSpeed: Speed = Speed(exact=True)
    fRoll: RollingResistance = RollingResistance(fWeight=0, reg="linear", useCrInput=True, useInclinationInput=True)
    fGrav: GradeForce = GradeForce(m=0)
    constWind: Constant = Constant(k=0)
    constCr: Constant = Constant(k=0)
    constInclination: Constant = Constant(k=0)

    def equations(self) -> Equations:
        """The parts, their data and how they are joined."""
        yield from self._data()
        yield connect(self.flangeR, self.inertia.flange_a)
        yield connect(self.inertia.flange_b, self.idealRollingWheel.flangeR)
        yield connect(self.idealRollingWheel.flangeT, self.mass.flange_a)
        yield connect(self.mass.flange_b, self.flangeT, self.fDrag.flange, self.fRoll.flange, self.fGrav.flange)
        yield connect(self.fDrag.support, self.windSpeed.flange)
        inclination = self.inclination if self.useInclinationInput else self.constInclination.y
        yield connect(self.vWind if self.useWindInput else self.constWind.y, self.windSpeed.v_ref)
        yield connect(self.cr if self.useCrInput else self.constCr.y, self.fRoll.cr)
        yield connect(inclination, self.fRoll.inclination, self.fGrav.inclination)
        yield self.s == self.mass.s
        yield self.v == self.mass.v
        yield self.a == self.mass.a

    def _data(self) -> Equations:
        yield self.inertia.J == self.J
        yield self.idealRollingWheel.radius == self.R
        yield self.mass.m == self.m
        yield self.fDrag.A == self.A
        yield self.fDrag.Cd == self.Cd
        yield self.fDrag.rho == self.rho
        yield self.fRoll.fWeight == self.m * self.g
        yield self.fRoll.v0 == self.vReg
        yield self.fGrav.m == self.m
        yield self.fGrav.g == self.g
        yield self.constWind.k == self.vWindConstant
        yield self.constCr.k == self.CrConstant
        yield self.constInclination.k == self.inclinationConstant
