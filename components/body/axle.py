"""A driven axle: from the propeller shaft to the road."""

from __future__ import annotations

from powertrain import Component, Equations, Input, connect, port, signal_input
from powertrain.components.body.path import AxlePath
from powertrain.components.differentials import BevelDifferential, CrownGear, Differential
from powertrain.components.rotational import Flange as Shaft
from powertrain.components.rotational import Inertia, SpringDamper
from powertrain.components.translational import Flange
from powertrain.components.wheels import MagicFormulaWheel, Wheel, WheelBrake


class DrivenAxle(Component):
    """Crown gear, differential, half shafts that twist, brakes and two wheels, each on its own path and with its own load.

    ``pinion`` is driven; ``axle`` pushes the body; ``load`` is what the body sends. The differential and the wheels are slots.
    """

    pinion: Shaft = port(Shaft)
    axle: Flange = port(Flange)
    load: Input = signal_input("N", "Load on the axle")
    curvature: Input = signal_input("1/m", "Curvature of the path, positive to the left", default=0.0)
    brake: Input = signal_input("1", "Brake demand, 0 to 1", default=0.0)
    path: AxlePath = AxlePath(track=1.5, h=0.55)
    left: Wheel = MagicFormulaWheel()
    right: Wheel = MagicFormulaWheel()
    left_brake: WheelBrake = WheelBrake(tau_max=1000)
    right_brake: WheelBrake = WheelBrake(tau_max=1000)
    left_shaft: SpringDamper = SpringDamper(c=1e4, d=30)
    right_shaft: SpringDamper = SpringDamper(c=1e4, d=30)
    differential: Differential = BevelDifferential(eta=0.97)
    cage: Inertia = Inertia(J=0.1)
    crown: CrownGear = CrownGear(ratio=3.9, eta_ab=0.95, eta_ba=0.95)

    def equations(self) -> Equations:
        """Both sides alike. The parts stand from the road up: at the start the road turns the wheels, and they the rest."""
        yield connect(self.pinion, self.crown.flange_a)
        yield connect(self.crown.flange_b, self.cage.flange_a)
        yield connect(self.cage.flange_b, self.differential.crown)
        for side in ("left", "right"):
            shaft, brake = getattr(self, f"{side}_shaft"), getattr(self, f"{side}_brake")
            wheel: Wheel = getattr(self, side)
            yield connect(getattr(self.differential, side), shaft.flange_a)
            yield connect(shaft.flange_b, brake.flange_a)
            yield connect(brake.flange_b, wheel.hub)
            yield connect(wheel.road, getattr(self.path, side))
            yield connect(wheel.load, getattr(self.path, f"{side}_load"))
        yield connect(self.path.side, self.left.side, self.right.side)
        yield connect(self.path.axle, self.axle)
        yield connect(self.load, self.path.load)
        yield connect(self.curvature, self.path.curvature)
        yield connect(self.brake, self.left_brake.demand, self.right_brake.demand)

    def initial(self) -> Equations:
        """The cage turns with the wheels, and the half shafts are not twisted."""
        yield self.cage.w == (self.left.w + self.right.w) / 2
        yield self.left_shaft.phi_rel == 0
        yield self.right_shaft.phi_rel == 0
