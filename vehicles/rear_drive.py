"""A rear-driven car whose differential can be exchanged, on a straight or curved road, each driven wheel on its own ground."""

from __future__ import annotations

from powertrain import Component, Equations, Input, connect, signal_input
from powertrain.components.body import AxlePath, VehicleBody
from powertrain.components.differentials import BevelDifferential, CrownGear, Differential
from powertrain.components.engines import Engine, WillansEngine
from powertrain.components.rotational import Clutch, IdealGear, Inertia, SpringDamper, TwoFlanges
from powertrain.components.wheels import MagicFormulaWheel, RigidWheel, Wheel, WheelBrake


class RearDriveCar(Component):
    """A rear-driven car of 1,500 kg: engine, clutch, one gear, crown gear, differential, half shafts, wheels, body.

    Any ``Differential`` goes into the slot: bevel, limited-slip, circular cam, spherical cam, linkage. The friction of the ground is
    ``left.mu`` and ``right.mu``; the front axle is one rigid wheel that rolls along. The half shafts twist, so that a differential that
    locks at once has something to lock against. The loss of the gearbox counts in the crown gear. On the path of the given curvature
    the driver holds the car by steering.
    The parts stand from the road up to the engine: at the start the road turns the wheels, and they turn the rest.
    """

    throttle: Input = signal_input("1", "Throttle, 0 to 1", default=0.0)
    brake: Input = signal_input("1", "Brake pedal, 0 to 1", default=0.0)
    engaged: Input = signal_input("1", "Clutch, 0 open to 1 closed", default=1.0)
    curvature: Input = signal_input("1/m", "Curvature of the path, positive to the left", default=0.0)
    grade: Input = signal_input("1", "Slope of the road, tan(alpha), positive uphill", default=0.0)
    wind: Input = signal_input("m/s", "Speed of the wind along the road, positive with the car", default=0.0)

    body: VehicleBody = VehicleBody(front_share=0.5)
    path: AxlePath = AxlePath(track=1.5, h=0.55)
    left: Wheel = MagicFormulaWheel()
    right: Wheel = MagicFormulaWheel()
    front: Wheel = RigidWheel(J=2.0)
    left_brake: WheelBrake = WheelBrake(tau_max=700)
    right_brake: WheelBrake = WheelBrake(tau_max=700)
    front_brake: WheelBrake = WheelBrake(tau_max=3000)
    left_shaft: SpringDamper = SpringDamper(c=1e4, d=30)
    right_shaft: SpringDamper = SpringDamper(c=1e4, d=30)
    differential: Differential = BevelDifferential(eta=0.97)
    cage: Inertia = Inertia(J=0.1)
    crown: CrownGear = CrownGear(ratio=3.9, eta_ab=0.95, eta_ba=0.95)
    gearbox: TwoFlanges = IdealGear(ratio=3.5)
    shaft: Inertia = Inertia(J=0.02)
    clutch: Clutch = Clutch(fn_max=300, mue_pos=((0.0, 1.0),))
    engine: Engine = WillansEngine()

    def equations(self) -> Equations:
        """From the engine to the road."""
        yield connect(self.engine.crank, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.gearbox.flange_a)
        yield connect(self.gearbox.flange_b, self.crown.flange_a)
        yield connect(self.crown.flange_b, self.cage.flange_a)
        yield connect(self.cage.flange_b, self.differential.crown)
        yield from self._rear_axle()
        yield connect(self.front_brake.flange_b, self.front.hub)
        yield connect(self.front.road, self.body.front)
        yield connect(self.body.front_load, self.front.load)
        yield connect(self.throttle, self.engine.throttle)
        yield connect(self.engaged, self.clutch.f_normalized)
        yield connect(self.brake, self.left_brake.demand, self.right_brake.demand, self.front_brake.demand)
        yield connect(self.grade, self.body.grade)
        yield connect(self.wind, self.body.wind)

    def _rear_axle(self) -> Equations:
        for side in ("left", "right"):
            shaft, brake = getattr(self, f"{side}_shaft"), getattr(self, f"{side}_brake")
            wheel: Wheel = getattr(self, side)
            yield connect(getattr(self.differential, side), shaft.flange_a)
            yield connect(shaft.flange_b, brake.flange_a)
            yield connect(brake.flange_b, wheel.hub)
            yield connect(wheel.road, getattr(self.path, side))
            yield connect(wheel.load, getattr(self.path, f"{side}_load"))
        yield connect(self.path.side, self.left.side, self.right.side)
        yield connect(self.path.axle, self.body.rear)
        yield connect(self.body.rear_load, self.path.load)
        yield connect(self.curvature, self.path.curvature)

    def initial(self) -> Equations:
        """The cage turns with the wheels, and the half shafts are not twisted."""
        yield self.cage.w == (self.left.w + self.right.w) / 2
        yield self.left_shaft.phi_rel == 0
        yield self.right_shaft.phi_rel == 0
