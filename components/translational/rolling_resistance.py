"""Rolling resistance and air drag of a vehicle."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Input, Parameter, Variable, parameter, signal_input, variable, within
from powertrain.components.characteristics import Regularization, smooth_sign
from powertrain.components.translational.interfaces import Dragged


class RollingResistance(Dragged):
    """The resistance of a rolling wheel against the road.

    f = flange.f = Cr fWeight cos(alpha) sign(v),  tan(alpha) = inclination,  v = der(s)

    The sign is smoothed below v0 by ``reg``: "exp": 2/(1 + exp(-v/(0.01 v0))) - 1;  "sine": sin(pi/2 v/v0);
    "linear": v/v0;  "cosine": sign(v) (1 - cos(pi/2 v/v0)). It therefore cannot hold a vehicle on a slope.
    With ``useCrInput`` and ``useInclinationInput`` the signals cr and inclination replace the constants. A negative cr, which would drive
    the wheel, ends a simulation with an error.
    """

    fWeight: Parameter = parameter("N", "Wheel load due to gravity", min=0)
    CrConstant: Parameter = parameter("1", "Rolling resistance coefficient", default=0.01, min=0)
    inclinationConstant: Parameter = parameter("1", "Inclination of the road, tan(alpha)", default=0.0)
    v0: Parameter = parameter("m/s", "Speed below which the sign is smoothed", default=0.1, above=0)
    useCrInput: bool = False
    useInclinationInput: bool = False
    reg: Regularization = "exp"
    cr: Input = signal_input("1", "Rolling resistance coefficient", default=0.0)
    inclination: Input = signal_input("1", "Inclination of the road, tan(alpha)", default=0.0)
    f: Variable = variable("N", "Resistance, flange.f")

    def equations(self) -> Equations:
        """Resistance in proportion to the load on the road."""
        yield from self._move()
        cr = self.cr.value if self.useCrInput else self.CrConstant
        if self.useCrInput:
            within(cr, 0, ca.inf, name="rolling resistance coefficient", unit="1")
        slope = self.inclination.value if self.useInclinationInput else self.inclinationConstant
        load = self.fWeight / ca.sqrt(1 + slope**2)
        yield self.f == cr * load * smooth_sign(self.v / self.v0, self.reg)
        yield self.flange.f == self.f


class AirDrag(Dragged):
    """Air resistance; the support moves with the wind.

    f = flange.f = Cd A rho v |v|/2,  v = der(s)
    """

    A: Parameter = parameter("m2", "Cross section", min=0)
    Cd: Parameter = parameter("1", "Drag coefficient", min=0)
    rho: Parameter = parameter("kg/m3", "Density of the air", default=1.2, min=0)
    f: Variable = variable("N", "Resistance, flange.f")

    def equations(self) -> Equations:
        """Square law."""
        yield from self._move()
        yield self.f == self.Cd * self.A * self.rho * self.v * ca.fabs(self.v) / 2
        yield self.flange.f == self.f
