"""A split-path transmission on its test bench, with the quantities of Yu & Beachley's figures.

D. Yu, N. Beachley, Mechanical efficiency of differential gearing, Gear Technology (July/August 1986) 9-16, 48.
"""

from __future__ import annotations

import powertrain as pt
from powertrain.components.rotational import ConstantSpeed, Inertia, Torque
from powertrain.components.transmissions import SplitPathTransmission, members


class SplitPathBench(pt.Component):
    """A split-path transmission driven at a constant speed and loaded by a torque.

    ``efficiency`` is power delivered over power supplied; the input supplies power, in overrun the output. It is below 0 if both supply
    power and all of it is lost. K is power into the variable unit over input power (eq. 29), positive if it flows through the unit towards
    the output. P_1, P_2 and P_3 are the powers into the differential's members at input, variable unit and output; their signs distinguish
    the cases of Fig. 8. The inertia at the output separates the load from the pressure of a hydrostatic unit, which is a state.
    """

    V: pt.Input = pt.signal_input("1", "Speed ratio of the variable unit")
    load: pt.Input = pt.signal_input("N.m", "Accelerating torque on the output")
    r: pt.Variable = pt.variable("1", "Output speed over input speed")
    efficiency: pt.Variable = pt.variable("1", "Power delivered over power supplied")
    K: pt.Variable = pt.variable("1", "Fraction of the input power through the variable unit")
    P_1: pt.Variable = pt.variable("W", "Power into the differential at the input")
    P_2: pt.Variable = pt.variable("W", "Power into the differential at the variable unit")
    P_3: pt.Variable = pt.variable("W", "Power into the differential at the output")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    transmission: SplitPathTransmission = SplitPathTransmission()
    torque: Torque = Torque()
    inertia: Inertia = Inertia(J=1)

    def equations(self) -> pt.Equations:
        """Connections, and the quantities of the figures."""
        gear = self.transmission
        yield pt.connect(self.drive.flange, gear.flange_a)
        yield pt.connect(self.torque.flange, self.inertia.flange_a, gear.flange_b)
        yield pt.connect(self.V, gear.ratio)
        yield pt.connect(self.load, self.torque.tau)
        yield self.r * self.drive.w == pt.der(self.torque.phi)
        P_in = gear.flange_a.power()
        P_out = gear.flange_b.power()
        drives = P_in >= 0
        yield self.efficiency * pt.switch(drives, P_in, P_out) == pt.switch(drives, -P_out, -P_in)
        from_unit = -gear.cvu.flange_b.power()
        into_unit = pt.switch(from_unit >= 0, gear.cvu.flange_a.power(), from_unit)
        yield self.K * P_in == (into_unit if gear.coupling == "input" else -into_unit)
        one, two, three = (getattr(gear.differential, name) for name in members(gear.layout))
        yield one.power() == self.P_1
        yield two.power() == self.P_2
        yield three.power() == self.P_3
