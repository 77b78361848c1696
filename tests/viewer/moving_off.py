"""A small model with everything that a page shows: a source, a slipping clutch, a composite, a load, signals and events."""

from __future__ import annotations

import powertrain as pt
from powertrain.components.blocks import Ramp
from powertrain.components.rotational import Clutch, ConstantTorque, Flange, IdealGear, Inertia, SpringDamper


class Driveline(pt.Component):
    """A gear and a shaft in one component."""

    flange_a: Flange = pt.port(Flange)
    flange_b: Flange = pt.port(Flange)
    gear: IdealGear = IdealGear(ratio=12)
    shaft: SpringDamper = SpringDamper(c=8000, d=100)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.flange_b)


class MovingOff(pt.Component):
    """An engine moves a car off with a slipping clutch."""

    engine: ConstantTorque = ConstantTorque(tau_constant=120)
    flywheel: Inertia = Inertia(J=0.15)
    pedal: Ramp = Ramp(height=1, duration=0.8)
    clutch: Clutch = Clutch(fn_max=500)
    disc: Inertia = Inertia(J=0.01)
    driveline: Driveline = Driveline()
    car: Inertia = Inertia(J=117)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.clutch.flange_a)
        yield pt.connect(self.pedal.y, self.clutch.f_normalized)
        yield pt.connect(self.clutch.flange_b, self.disc.flange_a)
        yield pt.connect(self.disc.flange_b, self.driveline.flange_a)
        yield pt.connect(self.car.flange_a, self.driveline.flange_b)  # written from right to left

    def initial(self) -> pt.Equations:
        yield self.flywheel.w == 160
        yield self.disc.w == 0
