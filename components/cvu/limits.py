"""Variable units with limits: torque capacity, and rate and range of the actuator."""

from __future__ import annotations

from powertrain import Equations, Parameter, Variable, connect, friction, parameter, variable
from powertrain.components.cvu.actuator import RatioActuator
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.cvu.unit import CVU
from powertrain.components.rotational.interfaces import FrictionCoupling


class TorqueLimiter(FrictionCoupling):
    """A coupling that slips when the torque exceeds tau_max in either direction.

    w_rel = der(flange_b.phi - flange_a.phi),  tau = flange_b.tau = -flange_a.tau
    w_rel > 0: tau = tau_max;  w_rel < 0: tau = -tau_max;  w_rel = 0: |tau| <= tau_max
    """

    tau_max: Parameter = parameter("N.m", "Maximum torque", min=0)
    w_rel: Variable = variable("rad/s", "Relative speed, der(phi_rel)", prefer=True, guess=0)

    def equations(self) -> Equations:
        """Dry friction."""
        yield from self._transmit()
        yield friction(self.w_rel, self.tau, -self.tau_max, self.tau_max)
        yield from self._dissipate()


class LimitedUnit(VariableUnit):
    """A variable unit that slips when the torque at flange_b exceeds tau_max.

    A unit with exact ratio and a torque limiter between it and flange_b.
    """

    tau_max: Parameter = parameter("N.m", "Maximum torque at flange_b", min=0)
    unit: VariableUnit = CVU()
    limiter: TorqueLimiter = TorqueLimiter(tau_max=1)

    def equations(self) -> Equations:
        """Unit and limiter in series."""
        self._ratio()
        yield self.limiter.tau_max == self.tau_max
        yield self.w_a == self.unit.w_a
        yield self.w_b == self.unit.w_b + self.limiter.w_rel
        yield connect(self.ratio, self.unit.ratio)
        yield connect(self.flange_a, self.unit.flange_a)
        yield connect(self.unit.flange_b, self.limiter.flange_a)
        yield connect(self.limiter.flange_b, self.flange_b)
        yield connect(self.unit.support, self.support)
        yield connect(self.heat_port, self.unit.heat_port, self.limiter.heat_port)
        yield self.lossPower == self.unit.lossPower + self.limiter.lossPower


class ActuatedUnit(VariableUnit):
    """A variable unit with an actuator: the signal ``ratio`` is the demand, subject to the actuator's rate and range.

    A demand outside [ratio_min, ratio_max] is limited; the range of the unit must include that of the actuator.
    """

    rate: Parameter = parameter("1/s", "Maximum rate of the ratio", default=1.0, above=0)
    ratio_start: Parameter = parameter("1", "Ratio at the start", default=1.0)
    actuator: RatioActuator = RatioActuator()
    unit: VariableUnit = CVU()

    def equations(self) -> Equations:
        """Actuator and unit in series."""
        yield self.actuator.rate == self.rate
        yield self.actuator.ratio_start == self.ratio_start
        yield self.actuator.ratio_min == self.ratio_min
        yield self.actuator.ratio_max == self.ratio_max
        yield self.w_a == self.unit.w_a
        yield self.w_b == self.unit.w_b
        yield connect(self.ratio, self.actuator.demand)
        yield connect(self.actuator.ratio, self.unit.ratio)
        yield connect(self.flange_a, self.unit.flange_a)
        yield connect(self.flange_b, self.unit.flange_b)
        yield connect(self.support, self.unit.support)
        yield connect(self.heat_port, self.unit.heat_port)
        yield self.lossPower == self.unit.lossPower
