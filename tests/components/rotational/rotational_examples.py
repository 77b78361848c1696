"""The examples of Modelica.Mechanics.Rotational 4.0.0, with the parameters and initial values of that version."""

from __future__ import annotations

import math

from powertrain import Component, Equations, Input, Output, connect, signal_input, signal_output
from powertrain.components import rotational as rot
from powertrain.components import translational as trans
from powertrain.components.blocks import Constant, Feedback, Product, Pulse, Ramp, Sine, Step
from powertrain.components.thermal import Convection, FixedTemperature, HeatCapacitor

COPPER = 3.92e-3


class First(Component):
    """Motor inertia, gear, damped shaft, spring, load; the supports are joined to one fixed point."""

    fixed: rot.Fixed = rot.Fixed()
    sine: Sine = Sine(amplitude=10, f=5)
    torque: rot.Torque = rot.Torque()
    inertia1: rot.Inertia = rot.Inertia(J=0.1)
    idealGear: rot.IdealGear = rot.IdealGear(ratio=10)
    inertia2: rot.Inertia = rot.Inertia(J=2)
    spring: rot.Spring = rot.Spring(c=1e4)
    inertia3: rot.Inertia = rot.Inertia(J=2)
    damper: rot.Damper = rot.Damper(d=10)

    def equations(self) -> Equations:
        yield connect(self.sine.y, self.torque.tau)
        yield connect(self.torque.flange, self.inertia1.flange_a)
        yield connect(self.inertia1.flange_b, self.idealGear.flange_a)
        yield connect(self.idealGear.flange_b, self.inertia2.flange_a)
        yield connect(self.inertia2.flange_b, self.spring.flange_a, self.damper.flange_a)
        yield connect(self.spring.flange_b, self.inertia3.flange_a)
        yield connect(self.fixed.flange, self.damper.flange_b, self.torque.support, self.idealGear.support)

    def initial(self) -> Equations:
        yield self.inertia2.phi == 0
        yield self.inertia2.w == 0
        yield self.spring.phi_rel == 0
        yield self.inertia3.w == 0


class FirstGrounded(Component):
    """First with supports that are ground by themselves."""

    fixed: rot.Fixed = rot.Fixed()
    sine: Sine = Sine(amplitude=10, f=5)
    torque: rot.Torque = rot.Torque()
    inertia1: rot.Inertia = rot.Inertia(J=0.1)
    idealGear: rot.IdealGear = rot.IdealGear(ratio=10)
    inertia2: rot.Inertia = rot.Inertia(J=2)
    spring: rot.Spring = rot.Spring(c=1e4)
    inertia3: rot.Inertia = rot.Inertia(J=2)
    damper: rot.Damper = rot.Damper(d=10)

    def equations(self) -> Equations:
        yield connect(self.sine.y, self.torque.tau)
        yield connect(self.torque.flange, self.inertia1.flange_a)
        yield connect(self.inertia1.flange_b, self.idealGear.flange_a)
        yield connect(self.idealGear.flange_b, self.inertia2.flange_a)
        yield connect(self.inertia2.flange_b, self.spring.flange_a, self.damper.flange_a)
        yield connect(self.spring.flange_b, self.inertia3.flange_a)
        yield connect(self.fixed.flange, self.damper.flange_b)

    def initial(self) -> Equations:
        yield self.inertia2.phi == 0
        yield self.inertia2.w == 0
        yield self.spring.phi_rel == 0
        yield self.inertia3.w == 0


class Friction(Component):
    """A clutch that locks, and a brake behind a spring."""

    sine: Sine = Sine(amplitude=200, f=50 / math.pi)
    step2: Step = Step(height=-1, offset=1, startTime=0.5)
    product: Product = Product()
    torque: rot.Torque = rot.Torque()
    inertia3: rot.Inertia = rot.Inertia(J=1)
    clutch: rot.Clutch = rot.Clutch(fn_max=160)
    inertia2: rot.Inertia = rot.Inertia(J=0.05)
    spring: rot.SpringDamper = rot.SpringDamper(c=160, d=1)
    inertia1: rot.Inertia = rot.Inertia(J=1)
    brake: rot.Brake = rot.Brake(fn_max=1600)
    const: Constant = Constant(k=1)
    step: Step = Step(startTime=0.5)
    fixed: rot.Fixed = rot.Fixed()

    def equations(self) -> Equations:
        yield connect(self.sine.y, self.product.u1)
        yield connect(self.step2.y, self.product.u2)
        yield connect(self.product.y, self.torque.tau)
        yield connect(self.torque.flange, self.inertia3.flange_a)
        yield connect(self.inertia3.flange_b, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.inertia2.flange_a)
        yield connect(self.inertia2.flange_b, self.spring.flange_a)
        yield connect(self.spring.flange_b, self.brake.flange_a)
        yield connect(self.brake.flange_b, self.inertia1.flange_a)
        yield connect(self.const.y, self.clutch.f_normalized)
        yield connect(self.step.y, self.brake.f_normalized)
        yield connect(self.fixed.flange, self.torque.support, self.brake.support)

    def initial(self) -> Equations:
        for inertia, w in ((self.inertia3, 100), (self.inertia2, 90), (self.inertia1, 90)):
            yield inertia.phi == 0
            yield inertia.w == w


class CoupledClutches(Component):
    """Four inertias and three clutches in a row."""

    torque: rot.Torque = rot.Torque()
    sin1: Sine = Sine(amplitude=10, f=5)
    sin2: Sine = Sine(amplitude=1, f=0.2, phase=math.pi / 2)
    step1: Step = Step(startTime=0.4)
    step2: Step = Step(startTime=0.9)
    J1: rot.Inertia = rot.Inertia(J=1)
    J2: rot.Inertia = rot.Inertia(J=1)
    J3: rot.Inertia = rot.Inertia(J=1)
    J4: rot.Inertia = rot.Inertia(J=1)
    clutch1: rot.Clutch = rot.Clutch(peak=1.1, fn_max=20)
    clutch2: rot.Clutch = rot.Clutch(peak=1.1, fn_max=20)
    clutch3: rot.Clutch = rot.Clutch(peak=1.1, fn_max=20)
    fixed: rot.Fixed = rot.Fixed()

    def equations(self) -> Equations:
        yield connect(self.sin1.y, self.torque.tau)
        yield connect(self.torque.support, self.fixed.flange)
        yield connect(self.torque.flange, self.J1.flange_a)
        yield connect(self.J1.flange_b, self.clutch1.flange_a)
        yield connect(self.clutch1.flange_b, self.J2.flange_a)
        yield connect(self.J2.flange_b, self.clutch2.flange_a)
        yield connect(self.clutch2.flange_b, self.J3.flange_a)
        yield connect(self.J3.flange_b, self.clutch3.flange_a)
        yield connect(self.clutch3.flange_b, self.J4.flange_a)
        yield connect(self.sin2.y, self.clutch1.f_normalized)
        yield connect(self.step1.y, self.clutch2.f_normalized)
        yield connect(self.step2.y, self.clutch3.f_normalized)

    def initial(self) -> Equations:
        yield self.J1.w == 10
        for inertia in (self.J2, self.J3, self.J4):
            yield inertia.w == 0
        for inertia in (self.J1, self.J2, self.J3, self.J4):
            yield inertia.phi == 0


class LossyGearDemo1(Component):
    """A gear of efficiency 0.5 between a shaken motor and a load."""

    gear: rot.LossyGear = rot.LossyGear(ratio=2, lossTable=((0, 0.5, 0.5, 0, 0),))
    Inertia1: rot.Inertia = rot.Inertia(J=1)
    Inertia2: rot.Inertia = rot.Inertia(J=1.5)
    torque1: rot.Torque = rot.Torque()
    torque2: rot.Torque = rot.Torque()
    DriveSine: Sine = Sine(amplitude=10, f=1)
    load: Ramp = Ramp(height=5, duration=2, offset=-10)
    fixed: rot.Fixed = rot.Fixed()

    def equations(self) -> Equations:
        yield connect(self.DriveSine.y, self.torque1.tau)
        yield connect(self.load.y, self.torque2.tau)
        yield connect(self.torque1.flange, self.Inertia1.flange_a)
        yield connect(self.Inertia1.flange_b, self.gear.flange_a)
        yield connect(self.gear.flange_b, self.Inertia2.flange_a)
        yield connect(self.Inertia2.flange_b, self.torque2.flange)
        yield connect(self.fixed.flange, self.gear.support, self.torque1.support, self.torque2.support)

    def initial(self) -> Equations:
        yield self.Inertia2.phi == 0
        yield self.Inertia2.w == 0


class LossyGearDemo2(Component):
    """LossyGearDemo1 with a bearing beside the gear."""

    gear: rot.LossyGear = rot.LossyGear(ratio=2, lossTable=((0, 0.5, 0.5, 0, 0),))
    Inertia1: rot.Inertia = rot.Inertia(J=1)
    Inertia2: rot.Inertia = rot.Inertia(J=1.5)
    torque1: rot.Torque = rot.Torque()
    torque2: rot.Torque = rot.Torque()
    DriveSine: Sine = Sine(amplitude=10, f=1)
    load: Ramp = Ramp(height=5, duration=2, offset=-10)
    bearingFriction: rot.BearingFriction = rot.BearingFriction(tau_pos=((0, 0.5), (1, 1)))
    fixed: rot.Fixed = rot.Fixed()

    def equations(self) -> Equations:
        yield connect(self.DriveSine.y, self.torque1.tau)
        yield connect(self.load.y, self.torque2.tau)
        yield connect(self.torque1.flange, self.bearingFriction.flange_a)
        yield connect(self.bearingFriction.flange_b, self.Inertia1.flange_a)
        yield connect(self.Inertia1.flange_b, self.gear.flange_a)
        yield connect(self.gear.flange_b, self.Inertia2.flange_a)
        yield connect(self.Inertia2.flange_b, self.torque2.flange)
        yield connect(
            self.fixed.flange,
            self.gear.support,
            self.torque1.support,
            self.torque2.support,
            self.bearingFriction.support,
        )

    def initial(self) -> Equations:
        yield self.Inertia2.phi == 0
        yield self.Inertia2.w == 0


class LossyGearDemo3(Component):
    """A gear of ratio 1 whose driving side is not obvious."""

    gear: rot.LossyGear = rot.LossyGear(ratio=1, lossTable=((0, 0.25, 0.25, 0.625, 2.5),))
    Inertia1: rot.Inertia = rot.Inertia(J=0.001)
    Inertia2: rot.Inertia = rot.Inertia(J=0.001)
    torque1: rot.Torque = rot.Torque()
    torque2: rot.Torque = rot.Torque()
    step: Step = Step(height=0)
    step1: Step = Step(height=1, startTime=0.5)

    def equations(self) -> Equations:
        yield connect(self.step.y, self.torque1.tau)
        yield connect(self.step1.y, self.torque2.tau)
        yield connect(self.torque1.flange, self.Inertia1.flange_a)
        yield connect(self.Inertia1.flange_b, self.gear.flange_a)
        yield connect(self.gear.flange_b, self.Inertia2.flange_a)
        yield connect(self.Inertia2.flange_b, self.torque2.flange)

    def initial(self) -> Equations:
        yield self.Inertia2.phi == 0
        yield self.Inertia2.w == 10


class EddyCurrentBrake(Component):
    """An inertia, braked by eddy currents that heat the disc."""

    eddyCurrentTorque: rot.EddyCurrentTorque = rot.EddyCurrentTorque(tau_nominal=100, w_nominal=10, alpha20=COPPER)
    inertia: rot.Inertia = rot.Inertia(J=1)
    heatCapacitor: HeatCapacitor = HeatCapacitor(C=1)

    def equations(self) -> Equations:
        yield connect(self.eddyCurrentTorque.flange, self.inertia.flange_a)
        yield connect(self.eddyCurrentTorque.heat_port, self.heatCapacitor.port)

    def initial(self) -> Equations:
        yield self.inertia.phi == 0
        yield self.inertia.w == 20
        yield self.heatCapacitor.T == 293.15


class OneWayClutch(Component):
    """A one-way clutch that is engaged from time to time."""

    inertiaIn: rot.Inertia = rot.Inertia(J=1)
    inertiaOut: rot.Inertia = rot.Inertia(J=1)
    oneWayClutch: rot.OneWayClutch = rot.OneWayClutch(peak=25, fn_max=3)
    torque: rot.Torque = rot.Torque()
    signalTorque: Sine = Sine(amplitude=10, f=3)
    signalEngagement: Pulse = Pulse(amplitude=1, width=50, period=1.3, startTime=0.3)

    def equations(self) -> Equations:
        yield connect(self.signalTorque.y, self.torque.tau)
        yield connect(self.torque.flange, self.inertiaIn.flange_a)
        yield connect(self.inertiaIn.flange_b, self.oneWayClutch.flange_a)
        yield connect(self.oneWayClutch.flange_b, self.inertiaOut.flange_a)
        yield connect(self.signalEngagement.y, self.oneWayClutch.f_normalized)

    def initial(self) -> Equations:
        yield self.inertiaIn.phi == 0
        yield self.inertiaIn.w == -0.5
        yield self.inertiaOut.phi == 0
        yield self.inertiaOut.w == 0


class OneWayClutchDisengaged(Component):
    """A one-way clutch as a mere freewheel."""

    inertiaIn: rot.Inertia = rot.Inertia(J=1)
    inertiaOut: rot.Inertia = rot.Inertia(J=1)
    oneWayClutch: rot.OneWayClutch = rot.OneWayClutch(peak=25, fn_max=3)
    torque: rot.Torque = rot.Torque()
    torqueLoad: rot.ConstantTorque = rot.ConstantTorque(tau_constant=-0.3)
    signalTorque: Sine = Sine(amplitude=10, f=2, offset=0.3)
    signalEngagement: Constant = Constant(k=0)

    def equations(self) -> Equations:
        yield connect(self.signalTorque.y, self.torque.tau)
        yield connect(self.torque.flange, self.inertiaIn.flange_a)
        yield connect(self.inertiaIn.flange_b, self.oneWayClutch.flange_a)
        yield connect(self.oneWayClutch.flange_b, self.inertiaOut.flange_a)
        yield connect(self.inertiaOut.flange_b, self.torqueLoad.flange)
        yield connect(self.signalEngagement.y, self.oneWayClutch.f_normalized)

    def initial(self) -> Equations:
        yield self.inertiaIn.phi == 0
        yield self.inertiaIn.w == -0.5
        yield self.inertiaOut.phi == 0
        yield self.inertiaOut.w == 0


class RollingWheel(Component):
    """A wheel that drives a mass against drag."""

    torqueStep: rot.TorqueStep = rot.TorqueStep(stepTorque=10, startTime=0.1)
    inertia: rot.Inertia = rot.Inertia(J=1)
    idealRollingWheel: rot.IdealRollingWheel = rot.IdealRollingWheel(radius=1)
    mass: trans.Mass = trans.Mass(m=1)
    quadraticSpeedDependentForce: trans.QuadraticSpeedDependentForce = trans.QuadraticSpeedDependentForce(
        f_nominal=-10, v_nominal=5, ForceDirection=False
    )

    def equations(self) -> Equations:
        yield connect(self.torqueStep.flange, self.inertia.flange_a)
        yield connect(self.inertia.flange_b, self.idealRollingWheel.flangeR)
        yield connect(self.idealRollingWheel.flangeT, self.mass.flange_a)
        yield connect(self.mass.flange_b, self.quadraticSpeedDependentForce.flange)

    def initial(self) -> Equations:
        yield self.inertia.phi == 0
        yield self.inertia.w == 0


class SimpleGearShift(Component):
    """A planetary gear, shifted from first gear (ring braked) to direct drive (ring locked to sun)."""

    torqueStep: rot.TorqueStep = rot.TorqueStep(stepTorque=20, startTime=0.5)
    engine: rot.Inertia = rot.Inertia(J=1)
    idealPlanetary: rot.IdealPlanetary = rot.IdealPlanetary(ratio=75 / 50)
    load: rot.Inertia = rot.Inertia(J=10)
    quadraticSpeedDependentTorque: rot.QuadraticSpeedDependentTorque = rot.QuadraticSpeedDependentTorque(
        tau_nominal=-20, w_nominal=10.471975511966
    )
    clutch: rot.Clutch = rot.Clutch(cgeo=2, fn_max=100)
    brake: rot.Brake = rot.Brake(cgeo=2, fn_max=100)
    feedback: Feedback = Feedback()
    const1: Constant = Constant(k=1)
    ramp: Ramp = Ramp(height=1, startTime=2, duration=0.1)

    def equations(self) -> Equations:
        yield connect(self.torqueStep.flange, self.engine.flange_a)
        yield connect(self.engine.flange_b, self.idealPlanetary.sun, self.clutch.flange_a)
        yield connect(self.idealPlanetary.ring, self.clutch.flange_b, self.brake.flange_a)
        yield connect(self.idealPlanetary.carrier, self.load.flange_a)
        yield connect(self.load.flange_b, self.quadraticSpeedDependentTorque.flange)
        yield connect(self.const1.y, self.feedback.u1)
        yield connect(self.ramp.y, self.feedback.u2, self.clutch.f_normalized)
        yield connect(self.feedback.y, self.brake.f_normalized)

    def initial(self) -> Equations:
        yield self.load.phi == 0
        yield self.load.w == 0
        yield self.clutch.phi_rel == 0
        yield self.clutch.w_rel == 0


class DirectInertia(Component):
    """An inertia as a block: torques in, motion out."""

    inertia: rot.Inertia
    drive: rot.Torque = rot.Torque()
    adaptor: rot.TorqueToAngleAdaptor = rot.TorqueToAngleAdaptor()
    tauDrive: Input = signal_input("N.m", "Accelerating torque")
    tau: Input = signal_input("N.m", "Torque that the other side takes")
    phi: Output = signal_output("rad", "Angle")
    w: Output = signal_output("rad/s", "Speed")
    a: Output = signal_output("rad/s2", "Acceleration")

    def equations(self) -> Equations:
        yield connect(self.tauDrive, self.drive.tau)
        yield connect(self.drive.flange, self.inertia.flange_a)
        yield connect(self.inertia.flange_b, self.adaptor.flange)
        yield connect(self.tau, self.adaptor.tau)
        yield connect(self.phi, self.adaptor.phi)
        yield connect(self.w, self.adaptor.w)
        yield connect(self.a, self.adaptor.a)


class InverseInertia(Component):
    """An inertia as a block: motion in, torque out."""

    inertia: rot.Inertia
    adaptor: rot.AngleToTorqueAdaptor = rot.AngleToTorqueAdaptor()
    phi: Input = signal_input("rad", "Angle")
    tau: Output = signal_output("N.m", "Torque that the motion takes")

    def equations(self) -> Equations:
        yield connect(self.adaptor.flange, self.inertia.flange_a)
        yield connect(self.phi, self.adaptor.phi)
        yield connect(self.adaptor.tau, self.tau)


class ForceElement(Component):
    """A spring or a spring and damper as a block: two angles in, two torques out."""

    element: Component
    left: rot.AngleToTorqueAdaptor = rot.AngleToTorqueAdaptor()
    right: rot.AngleToTorqueAdaptor = rot.AngleToTorqueAdaptor()

    def equations(self) -> Equations:
        yield connect(self.left.flange, self.element.flange_a)  # type: ignore[attr-defined]
        yield connect(self.element.flange_b, self.right.flange)  # type: ignore[attr-defined]


class GenerationOfFMUs(Component):
    """Drivelines that are cut into blocks and joined again by signals."""

    sine1: Sine = Sine(f=2, amplitude=10)
    directInertia: DirectInertia = DirectInertia(inertia=rot.Inertia(J=1.1))
    inverseInertia: InverseInertia = InverseInertia(inertia=rot.Inertia(J=2.2))
    sine2: Sine = Sine(f=2, amplitude=10)
    torque2: rot.Torque = rot.Torque()
    inertia2a: rot.Inertia = rot.Inertia(J=1.1)
    torqueToAngle2a: rot.TorqueToAngleAdaptor = rot.TorqueToAngleAdaptor(use_a=False)
    springDamper: ForceElement = ForceElement(element=rot.SpringDamper(c=1e4, d=100))
    torqueToAngle2b: rot.TorqueToAngleAdaptor = rot.TorqueToAngleAdaptor(use_a=False)
    inertia2b: rot.Inertia = rot.Inertia(J=2.2)
    sine3: Sine = Sine(f=2, amplitude=10)
    torque3: rot.Torque = rot.Torque()
    inertia3a: rot.Inertia = rot.Inertia(J=1.1)
    torqueToAngle3a: rot.TorqueToAngleAdaptor = rot.TorqueToAngleAdaptor(use_a=False, use_w=False)
    spring: ForceElement = ForceElement(element=rot.Spring(c=1e4))
    torqueToAngle3b: rot.TorqueToAngleAdaptor = rot.TorqueToAngleAdaptor(use_a=False, use_w=False)
    inertia3b: rot.Inertia = rot.Inertia(J=2.2)

    def equations(self) -> Equations:
        yield connect(self.sine1.y, self.directInertia.tauDrive)
        yield connect(self.directInertia.phi, self.inverseInertia.phi)
        yield connect(self.inverseInertia.tau, self.directInertia.tau)
        yield connect(self.sine2.y, self.torque2.tau)
        yield connect(self.torque2.flange, self.inertia2a.flange_a)
        yield connect(self.inertia2a.flange_b, self.torqueToAngle2a.flange)
        yield connect(self.torqueToAngle2a.phi, self.springDamper.left.phi)
        yield connect(self.springDamper.left.tau, self.torqueToAngle2a.tau)
        yield connect(self.torqueToAngle2b.phi, self.springDamper.right.phi)
        yield connect(self.springDamper.right.tau, self.torqueToAngle2b.tau)
        yield connect(self.inertia2b.flange_a, self.torqueToAngle2b.flange)
        yield connect(self.sine3.y, self.torque3.tau)
        yield connect(self.torque3.flange, self.inertia3a.flange_a)
        yield connect(self.inertia3a.flange_b, self.torqueToAngle3a.flange)
        yield connect(self.torqueToAngle3a.phi, self.spring.left.phi)
        yield connect(self.spring.left.tau, self.torqueToAngle3a.tau)
        yield connect(self.torqueToAngle3b.phi, self.spring.right.phi)
        yield connect(self.spring.right.tau, self.torqueToAngle3b.tau)
        yield connect(self.inertia3b.flange_a, self.torqueToAngle3b.flange)

    def initial(self) -> Equations:
        for inertia in (self.directInertia.inertia, self.inertia2a, self.inertia2b, self.inertia3a, self.inertia3b):
            yield inertia.phi == 0
            yield inertia.w == 0


class ElasticBearing(Component):
    """A gear whose housing stands on a spring and damper."""

    ramp: Ramp = Ramp(height=100, duration=5)
    torque: rot.Torque = rot.Torque()
    shaft: rot.Inertia = rot.Inertia(J=1)
    idealGear: rot.IdealGear = rot.IdealGear(ratio=3)
    spring: rot.Spring = rot.Spring(c=1e3)
    load: rot.Inertia = rot.Inertia(J=50)
    housing: rot.Inertia = rot.Inertia(J=5)
    multiSensor: rot.MultiSensor = rot.MultiSensor()
    springDamper: rot.SpringDamper = rot.SpringDamper(c=1e5, d=5)
    fixed: rot.Fixed = rot.Fixed()

    def equations(self) -> Equations:
        yield connect(self.ramp.y, self.torque.tau)
        yield connect(self.torque.flange, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.idealGear.flange_a)
        yield connect(self.idealGear.flange_b, self.spring.flange_a)
        yield connect(self.spring.flange_b, self.load.flange_a)
        yield connect(self.idealGear.support, self.housing.flange_b)
        yield connect(self.housing.flange_a, self.multiSensor.flange_b)
        yield connect(self.multiSensor.flange_a, self.springDamper.flange_b)
        yield connect(self.fixed.flange, self.springDamper.flange_a, self.torque.support)

    def initial(self) -> Equations:
        yield self.shaft.phi == 0
        yield self.shaft.w == 0
        yield self.load.w == 0
        yield self.spring.phi_rel == 0
        yield self.springDamper.phi_rel == 0
        yield self.springDamper.w_rel == 0


class Backlash(Component):
    """A spring and damper without and with backlash, of both kinds."""

    fixed: rot.Fixed = rot.Fixed()
    springDamper: rot.SpringDamper = rot.SpringDamper(c=20e3, d=50)
    elastoBacklash: rot.ElastoBacklash = rot.ElastoBacklash(c=20e3, d=50, b=math.pi / 4)
    elastoBacklash2: rot.ElastoBacklash2 = rot.ElastoBacklash2(c=20e3, d=50, b=math.pi / 4)
    inertia1: rot.Inertia = rot.Inertia(J=5)
    inertia2: rot.Inertia = rot.Inertia(J=5)
    inertia3: rot.Inertia = rot.Inertia(J=5)

    def equations(self) -> Equations:
        yield connect(
            self.fixed.flange, self.springDamper.flange_a, self.elastoBacklash.flange_a, self.elastoBacklash2.flange_a
        )
        yield connect(self.springDamper.flange_b, self.inertia1.flange_a)
        yield connect(self.elastoBacklash.flange_b, self.inertia2.flange_a)
        yield connect(self.elastoBacklash2.flange_b, self.inertia3.flange_a)

    def initial(self) -> Equations:
        for inertia in (self.inertia1, self.inertia2, self.inertia3):
            yield inertia.phi == math.pi / 2
            yield inertia.w == 0


class HeatLosses(Component):
    """Every lossy element in one driveline, warming one convection."""

    sine: Sine = Sine(f=5, amplitude=20)
    torque: rot.Torque = rot.Torque()
    inertia1: rot.Inertia = rot.Inertia(J=2)
    damper: rot.Damper = rot.Damper(d=10)
    fixed: rot.Fixed = rot.Fixed()
    convection: Convection = Convection()
    TAmbient: FixedTemperature = FixedTemperature(T=298.15)
    const: Constant = Constant(k=20)
    springDamper: rot.SpringDamper = rot.SpringDamper(c=1e4, d=20)
    inertia2: rot.Inertia = rot.Inertia(J=2)
    elastoBacklash: rot.ElastoBacklash = rot.ElastoBacklash(c=1e5, d=100, b=0.001)
    inertia3: rot.Inertia = rot.Inertia(J=2)
    bearingFriction: rot.BearingFriction = rot.BearingFriction()
    spring3: rot.Spring = rot.Spring(c=1e4)
    inertia4: rot.Inertia = rot.Inertia(J=2)
    lossyGear: rot.LossyGear = rot.LossyGear(ratio=2, lossTable=((0, 0.8, 0.8, 1, 1), (1, 0.7, 0.7, 2, 2)))
    clutch: rot.Clutch = rot.Clutch(fn_max=10)
    inertia5: rot.Inertia = rot.Inertia(J=2)
    sine2: Sine = Sine(f=0.2, amplitude=1)
    oneWayClutch: rot.OneWayClutch = rot.OneWayClutch(fn_max=1)
    inertia6: rot.Inertia = rot.Inertia(J=2)
    brake: rot.Brake = rot.Brake(fn_max=2)

    def equations(self) -> Equations:
        yield connect(self.sine.y, self.torque.tau)
        yield connect(self.torque.flange, self.inertia1.flange_a)
        yield connect(self.inertia1.flange_b, self.damper.flange_b, self.springDamper.flange_a)
        yield connect(self.damper.flange_a, self.fixed.flange)
        yield connect(self.springDamper.flange_b, self.inertia2.flange_a)
        yield connect(self.inertia2.flange_b, self.elastoBacklash.flange_a)
        yield connect(self.elastoBacklash.flange_b, self.inertia3.flange_a)
        yield connect(self.inertia3.flange_b, self.bearingFriction.flange_a)
        yield connect(self.bearingFriction.flange_b, self.spring3.flange_a)
        yield connect(self.spring3.flange_b, self.inertia4.flange_a)
        yield connect(self.inertia4.flange_b, self.lossyGear.flange_a)
        yield connect(self.lossyGear.flange_b, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.inertia5.flange_a)
        yield connect(self.inertia5.flange_b, self.oneWayClutch.flange_a)
        yield connect(self.oneWayClutch.flange_b, self.inertia6.flange_a)
        yield connect(self.inertia6.flange_b, self.brake.flange_a)
        yield connect(self.sine2.y, self.clutch.f_normalized, self.oneWayClutch.f_normalized, self.brake.f_normalized)
        yield connect(
            self.convection.solid,
            self.damper.heat_port,
            self.springDamper.heat_port,
            self.elastoBacklash.heat_port,
            self.bearingFriction.heat_port,
            self.lossyGear.heat_port,
            self.clutch.heat_port,
            self.oneWayClutch.heat_port,
            self.brake.heat_port,
        )
        yield connect(self.const.y, self.convection.Gc)
        yield connect(self.convection.fluid, self.TAmbient.port)

    def initial(self) -> Equations:
        for inertia in (self.inertia1, self.inertia2, self.inertia3, self.inertia4):
            yield inertia.phi == 0
            yield inertia.w == 0
        for clutch in (self.clutch, self.oneWayClutch):
            yield clutch.phi_rel == 0
            yield clutch.w_rel == 0


class CompareBrakingTorque(Component):
    """Four laws of braking torque."""

    inertia1: rot.Inertia = rot.Inertia(J=1)
    inertia2: rot.Inertia = rot.Inertia(J=1)
    inertia3: rot.Inertia = rot.Inertia(J=1)
    inertia4: rot.Inertia = rot.Inertia(J=1)
    signTorque: rot.SignTorque = rot.SignTorque(tau_nominal=-100, reg="linear", w0=1)
    linear: rot.LinearSpeedDependentTorque = rot.LinearSpeedDependentTorque(
        tau_nominal=-100, w_nominal=100, TorqueDirection=False
    )
    quadratic: rot.QuadraticSpeedDependentTorque = rot.QuadraticSpeedDependentTorque(
        tau_nominal=-100, w_nominal=100, TorqueDirection=False
    )
    inverse: rot.InverseSpeedDependentTorque = rot.InverseSpeedDependentTorque(
        tau_nominal=-100, w_nominal=100, w0=1, TorqueDirection=False
    )

    def equations(self) -> Equations:
        yield connect(self.signTorque.flange, self.inertia1.flange_a)
        yield connect(self.linear.flange, self.inertia2.flange_a)
        yield connect(self.quadratic.flange, self.inertia3.flange_a)
        yield connect(self.inverse.flange, self.inertia4.flange_a)

    def initial(self) -> Equations:
        for inertia in (self.inertia1, self.inertia2, self.inertia3, self.inertia4):
            yield inertia.phi == 0
            yield inertia.w == 100
