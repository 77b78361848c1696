"""A car moves off: engine, flywheel, slipping clutch with disc, gear, elastic drive shaft, car.

The clutch closes over 0.8 s. It slips until the flywheel and the gearbox have the same speed, then it sticks, and the drive
shaft oscillates: this is the shuffle that a driver feels. The model does not state when the clutch sticks; the simulation finds the
instant.
"""

from __future__ import annotations

import sys

import matplotlib.pyplot as plt

import powertrain as pt
from powertrain.components.blocks import Ramp
from powertrain.components.rotational import Clutch, ConstantTorque, IdealGear, Inertia, SpringDamper


class MovingOff(pt.Component):
    """An engine at constant torque moves a car off from standstill."""

    engine: ConstantTorque = ConstantTorque(tau_constant=120)
    flywheel: Inertia = Inertia(J=0.15)
    pedal: Ramp = Ramp(height=1, duration=0.8)
    clutch: Clutch = Clutch(fn_max=500)
    disc: Inertia = Inertia(J=0.01)
    gear: IdealGear = IdealGear(ratio=12)  # gearbox and axle
    shaft: SpringDamper = SpringDamper(c=8000, d=100)
    car: Inertia = Inertia(J=117)  # 1,300 kg on wheels of 0.3 m

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.flywheel.flange_a)
        yield pt.connect(self.flywheel.flange_b, self.clutch.flange_a)
        yield pt.connect(self.pedal.y, self.clutch.f_normalized)
        yield pt.connect(self.clutch.flange_b, self.disc.flange_a)
        yield pt.connect(self.disc.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.car.flange_a)

    def initial(self) -> pt.Equations:
        yield self.flywheel.w == 160
        yield self.disc.w == 0


def main() -> None:
    """Simulate and print the events; pass a file name to save the figure."""
    result = pt.simulate(MovingOff(), stop=3)
    print(result.events)
    print(f"After {result.time[-1]:g} s the car does {0.3 * result['car.w'][-1] * 3.6:.1f} km/h.")
    if len(sys.argv) > 1:
        figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
        result.plot("flywheel.w", "disc.w", ax=above)
        result.plot("shaft.tau", "clutch.lossPower", ax=below)
        figure.savefig(sys.argv[1], dpi=120)


if __name__ == "__main__":
    main()
