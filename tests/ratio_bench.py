"""A bench for transmissions whose overall ratio is wanted by an input."""

from __future__ import annotations

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.cvu import RatioActuator
from powertrain.components.transmissions import VariableTransmission


class RatioBench(pt.Component):
    """Driven at a constant speed through an elastic shaft, loaded by a torque; the ratio changes at a limited rate."""

    transmission: VariableTransmission
    wanted: pt.Input = pt.signal_input("1", "Overall ratio that is wanted")
    actuator: RatioActuator = RatioActuator(T=0.1, rate=0.1, ratio_start=0.3)
    drive: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=200)
    shaft: rot.SpringDamper = rot.SpringDamper(c=2e4, d=1000)
    engine: rot.Inertia = rot.Inertia(J=0.05)
    output: rot.Inertia = rot.Inertia(J=2.0)
    load: rot.ConstantTorque = rot.ConstantTorque(tau_constant=-100)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.transmission.flange_a)
        yield pt.connect(self.transmission.flange_b, self.output.flange_a)
        yield pt.connect(self.output.flange_b, self.load.flange)
        yield pt.connect(self.wanted, self.actuator.demand)
        yield pt.connect(self.actuator.ratio, self.transmission.ratio)
