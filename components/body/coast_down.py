"""A body whose road load was measured by letting the vehicle coast."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, friction, parameter, variable
from powertrain.components.body.body import MovingBody


class CoastDownBody(MovingBody):
    """The body of a vehicle whose total road load is a polynomial in speed, as measured by a coast-down test.

    m a = front.f + rear.f - load - m g sin(alpha),  tan(alpha) = grade
    v > 0: load = F_0 + F_1 v + F_2 v^2;  v < 0: load = -(F_0 - F_1 v + F_2 v^2);  v = 0: |load| <= F_0
    front_load = m g cos(alpha) front_share - h/wheelbase (front.f + rear.f),  front_load + rear_load = m g cos(alpha)

    The coefficients include everything that brakes the vehicle coasting in neutral: air, tyres, bearings, brakes, and everything that turns
    with the wheels. The wheels must not add to it: use Cr = 0, which cars check. This also applies to parts that still turn in neutral,
    such as the oil of a gearbox behind its clutches, or of one without neutral. ``m`` is the test mass; the rotating equivalent mass is the
    wheels' J. F_1 may be negative, as in fits of measurements, as long as the load is not.

    Source: 40 CFR 1066.301 to 1066.325; UN GTR No. 15, Annex 4 (f_0, f_1, f_2). Errors: ParameterError for coefficients whose load becomes
    negative at some speed. The default is a compact car.
    """

    F_0: Parameter = parameter("N", "Road load at rest, by extrapolation", default=110.0, min=0)
    F_1: Parameter = parameter("N.s/m", "Rise of the road load with the speed", default=1.5)
    F_2: Parameter = parameter("N.s2/m2", "Rise with the square of the speed", default=0.4, min=0)
    load: Variable = variable("N", "Road load")

    def check(self) -> Equations:
        """The smallest load, at v = -F_1/(2 F_2), must not be negative."""
        yield ca.fmin(self.F_1, 0) ** 2 <= 4 * self.F_0 * self.F_2  # else the road load is negative at some speed

    def equations(self) -> Equations:
        """The road load, which also holds the vehicle at rest."""
        yield from self._moves(self.load)
        limit = self.F_0 + self.F_1 * ca.fabs(self.speed) + self.F_2 * self.speed**2
        yield friction(self.speed, self.load, -limit, limit)

    def loss(self) -> Symbol:
        """Road load times speed."""
        return self.load * self.speed
