"""The examples of Modelica.Mechanics.Translational 4.0.0, with the parameters and initial values of that version."""

from __future__ import annotations

from powertrain import Component, Equations, connect
from powertrain.components import rotational as rot
from powertrain.components import translational as trans
from powertrain.components.blocks import Constant, Gain, Sine, Step, TimeTable
from powertrain.components.thermal import Convection, FixedTemperature, HeatCapacitor
from powertrain.components.vehicle import G_N
from powertrain.components.vehicle import Vehicle as RoadVehicle

COPPER = 3.92e-3


class SignConvention(Component):
    """A force on either end of a mass, and one against the arrow of its source."""

    mass1: trans.Mass = trans.Mass(L=1, m=1)
    force1: trans.Force = trans.Force()
    constant1: Constant = Constant(k=1)
    mass2: trans.Mass = trans.Mass(L=1, m=1)
    force2: trans.Force = trans.Force()
    constant2: Constant = Constant(k=1)
    mass3: trans.Mass = trans.Mass(L=1, m=1)
    force3: trans.Force = trans.Force()
    constant3: Constant = Constant(k=1)
    fixed: trans.Fixed = trans.Fixed()

    def equations(self) -> Equations:
        yield connect(self.constant1.y, self.force1.f)
        yield connect(self.constant2.y, self.force2.f)
        yield connect(self.constant3.y, self.force3.f)
        yield connect(self.force1.flange, self.mass1.flange_a)
        yield connect(self.force2.flange, self.mass2.flange_b)
        yield connect(self.mass3.flange_b, self.force3.flange)
        yield connect(self.fixed.flange, self.force3.support)

    def initial(self) -> Equations:
        for mass in (self.mass1, self.mass2, self.mass3):
            yield mass.s == 0
            yield mass.v == 0


class InitialConditions(Component):
    """Two chains of masses and springs, started by positions and by elongations."""

    fixed2: trans.Fixed = trans.Fixed(s0=1)
    s2: trans.Spring = trans.Spring(s_rel0=2, c=1e3)
    m3: trans.Mass = trans.Mass(L=3, m=1)
    sd2: trans.SpringDamper = trans.SpringDamper(s_rel0=4, c=111, d=1)
    m4: trans.Mass = trans.Mass(L=5, m=1)
    fixed1: trans.Fixed = trans.Fixed(s0=-1)
    s1: trans.Spring = trans.Spring(s_rel0=1, c=1e3)
    m1: trans.Mass = trans.Mass(L=1, m=1)
    sd1: trans.SpringDamper = trans.SpringDamper(s_rel0=1, c=111, d=1)
    m2: trans.Mass = trans.Mass(L=2, m=1)

    def equations(self) -> Equations:
        yield connect(self.s2.flange_a, self.fixed2.flange)
        yield connect(self.s1.flange_a, self.fixed1.flange)
        yield connect(self.m1.flange_a, self.s1.flange_b)
        yield connect(self.sd1.flange_a, self.m1.flange_b)
        yield connect(self.m2.flange_a, self.sd1.flange_b)
        yield connect(self.m4.flange_a, self.sd2.flange_b)
        yield connect(self.sd2.flange_a, self.m3.flange_b)
        yield connect(self.m3.flange_a, self.s2.flange_b)

    def initial(self) -> Equations:
        yield self.m3.s == 4.5
        yield self.m3.v == 0
        yield self.m4.s == 12.5
        yield self.m4.v == 0
        yield self.s1.s_rel == 0.5
        yield self.m1.v == 0
        yield self.sd1.s_rel == 1
        yield self.sd1.v_rel == 0


class WhyArrows(Component):
    """Rods on either side of a fixed point, and one oscillator drawn in two directions."""

    fixed: trans.Fixed = trans.Fixed()
    rod1: trans.Rod = trans.Rod(L=1)
    rod2: trans.Rod = trans.Rod(L=1)
    rod3: trans.Rod = trans.Rod(L=1)
    positionSensor1: trans.PositionSensor = trans.PositionSensor()
    positionSensor2: trans.PositionSensor = trans.PositionSensor()
    positionSensor3: trans.PositionSensor = trans.PositionSensor()
    fixed1: trans.Fixed = trans.Fixed(s0=-1.9)
    spring1: trans.Spring = trans.Spring(s_rel0=2, c=11)
    mass1: trans.Mass = trans.Mass(L=2, m=1)
    fixed2: trans.Fixed = trans.Fixed(s0=-1.9)
    spring2: trans.Spring = trans.Spring(s_rel0=2, c=11)
    inertia2: trans.Mass = trans.Mass(L=2, m=1)

    def equations(self) -> Equations:
        yield connect(self.spring1.flange_b, self.mass1.flange_b)
        yield connect(self.spring2.flange_b, self.inertia2.flange_b)
        yield connect(self.rod3.flange_b, self.positionSensor3.flange)
        yield connect(self.rod1.flange_a, self.positionSensor1.flange)
        yield connect(self.rod1.flange_b, self.rod3.flange_a, self.rod2.flange_a, self.fixed.flange)
        yield connect(self.rod2.flange_b, self.positionSensor2.flange)
        yield connect(self.fixed1.flange, self.spring1.flange_a)
        yield connect(self.fixed2.flange, self.spring2.flange_a)

    def initial(self) -> Equations:
        for mass in (self.mass1, self.inertia2):
            yield mass.s == 0
            yield mass.v == 0


class Accelerate(Component):
    """A mass moved by an acceleration."""

    accelerate: trans.Accelerate = trans.Accelerate()
    mass: trans.Mass = trans.Mass(L=1, m=1)
    constantAcc: Constant = Constant(k=1)

    def equations(self) -> Equations:
        yield connect(self.accelerate.flange, self.mass.flange_a)
        yield connect(self.constantAcc.y, self.accelerate.a_ref)


class Damper(Component):
    """Three masses against a fixed point: a damper, a damper and a spring, a spring-damper."""

    mass1: trans.Mass = trans.Mass(L=1, m=1)
    damper1: trans.Damper = trans.Damper(d=25)
    fixed1: trans.Fixed = trans.Fixed(s0=4.5)
    mass2: trans.Mass = trans.Mass(L=1, m=1)
    damper2: trans.Damper = trans.Damper(d=25)
    fixed2: trans.Fixed = trans.Fixed(s0=4.5)
    mass3: trans.Mass = trans.Mass(L=1, m=1)
    fixed3: trans.Fixed = trans.Fixed(s0=4.5)
    spring2: trans.Spring = trans.Spring(s_rel0=1, c=1)
    springDamper3: trans.SpringDamper = trans.SpringDamper(s_rel0=1, d=25, c=1)

    def equations(self) -> Equations:
        yield connect(self.mass1.flange_b, self.damper1.flange_a)
        yield connect(self.mass2.flange_b, self.damper2.flange_a, self.spring2.flange_a)
        yield connect(self.damper2.flange_b, self.spring2.flange_b, self.fixed2.flange)
        yield connect(self.mass3.flange_b, self.springDamper3.flange_a)
        yield connect(self.damper1.flange_b, self.fixed1.flange)
        yield connect(self.springDamper3.flange_b, self.fixed3.flange)

    def initial(self) -> Equations:
        for mass in (self.mass1, self.mass2, self.mass3):
            yield mass.s == 3
            yield mass.v == 10


class Oscillator(Component):
    """A mass on a spring excited at resonance, without and with damping."""

    mass1: trans.Mass = trans.Mass(L=1, m=1)
    spring1: trans.Spring = trans.Spring(s_rel0=1, c=10000)
    fixed1: trans.Fixed = trans.Fixed(s0=1)
    force1: trans.Force = trans.Force()
    sine1: Sine = Sine(f=15.9155)
    mass2: trans.Mass = trans.Mass(L=1, m=1)
    spring2: trans.Spring = trans.Spring(s_rel0=1, c=10000)
    fixed2: trans.Fixed = trans.Fixed(s0=1)
    force2: trans.Force = trans.Force()
    sine2: Sine = Sine(f=15.9155)
    damper1: trans.Damper = trans.Damper(d=10)

    def equations(self) -> Equations:
        yield connect(self.mass1.flange_b, self.spring1.flange_a)
        yield connect(self.mass2.flange_b, self.spring2.flange_a, self.damper1.flange_a)
        yield connect(self.damper1.flange_b, self.spring2.flange_b, self.fixed2.flange)
        yield connect(self.sine1.y, self.force1.f)
        yield connect(self.sine2.y, self.force2.f)
        yield connect(self.spring1.flange_b, self.fixed1.flange)
        yield connect(self.force2.flange, self.mass2.flange_a)
        yield connect(self.force1.flange, self.mass1.flange_a)

    def initial(self) -> Equations:
        for mass in (self.mass1, self.mass2):
            yield mass.s == -0.5
            yield mass.v == 0


class Sensors(Component):
    """All that can be measured on a mass that a force moves."""

    forceSensor: trans.ForceSensor = trans.ForceSensor()
    speedSensor1: trans.SpeedSensor = trans.SpeedSensor()
    positionSensor1: trans.PositionSensor = trans.PositionSensor()
    accSensor1: trans.AccSensor = trans.AccSensor()
    mass: trans.Mass = trans.Mass(L=1, m=1)
    force: trans.Force = trans.Force()
    sineForce: Sine = Sine(amplitude=10, f=4)
    positionSensor2: trans.PositionSensor = trans.PositionSensor()
    multiSensor: trans.MultiSensor = trans.MultiSensor()

    def equations(self) -> Equations:
        yield connect(self.sineForce.y, self.force.f)
        yield connect(self.forceSensor.flange_a, self.force.flange)
        yield connect(self.forceSensor.flange_b, self.multiSensor.flange_a)
        yield connect(
            self.multiSensor.flange_b,
            self.mass.flange_a,
            self.positionSensor1.flange,
            self.speedSensor1.flange,
            self.accSensor1.flange,
        )
        yield connect(self.mass.flange_b, self.positionSensor2.flange)

    def initial(self) -> Equations:
        yield self.mass.s == 0
        yield self.mass.v == 0


class Friction(Component):
    """Stribeck friction by formula and by table, and a mass that flies against its stop."""

    stop1: trans.MassWithStopAndFriction = trans.MassWithStopAndFriction(
        L=1, smax=25, smin=-25, m=1, F_prop=1, F_Coulomb=5, F_Stribeck=10, fexp=2
    )
    force: trans.Force = trans.Force()
    sineForce: Sine = Sine(amplitude=25, f=0.25)
    stop2: trans.MassWithStopAndFriction = trans.MassWithStopAndFriction(
        L=1, smax=0.9, smin=-0.9, m=1, F_prop=1, F_Coulomb=3, F_Stribeck=5, fexp=2
    )
    spring: trans.Spring = trans.Spring(s_rel0=1, c=500)
    fixed2: trans.Fixed = trans.Fixed(s0=-1.75)
    force2: trans.Force = trans.Force()
    mass: trans.Mass = trans.Mass(L=1, m=1)
    supportFriction: trans.SupportFriction = trans.SupportFriction(
        f_pos=trans.stribeck_table(F_prop=1, F_Coulomb=5, F_Stribeck=10, fexp=2, v_max=12, rows=50)
    )

    def equations(self) -> Equations:
        yield connect(self.spring.flange_b, self.stop2.flange_a)
        yield connect(self.sineForce.y, self.force.f, self.force2.f)
        yield connect(self.spring.flange_a, self.fixed2.flange)
        yield connect(self.force.flange, self.stop1.flange_a)
        yield connect(self.force2.flange, self.mass.flange_a)
        yield connect(self.mass.flange_b, self.supportFriction.flange_a)

    def initial(self) -> Equations:
        yield self.stop1.s == 0
        yield self.stop1.v == 0
        yield self.stop2.s == 0
        yield self.stop2.v == -5
        yield self.mass.s == 0
        yield self.mass.v == 0


class PreLoad(Component):
    """A spool between spring plates that it leaves only against the preload of their spring."""

    innerContactA: trans.ElastoGap = trans.ElastoGap(c=1000e3, d=250, s_rel0=0.001)
    innerContactB: trans.ElastoGap = trans.ElastoGap(c=1000e3, d=250, s_rel0=0.001)
    spool: trans.Mass = trans.Mass(L=0.19, m=0.150)
    fixedLe: trans.Fixed = trans.Fixed(s0=-0.0955)
    springPlateA: trans.Mass = trans.Mass(m=10e-3, L=0.002)
    springPlateB: trans.Mass = trans.Mass(m=10e-3, L=0.002)
    spring: trans.Spring = trans.Spring(c=20e3, s_rel0=0.025)
    outerContactA: trans.ElastoGap = trans.ElastoGap(c=1000e3, d=250, s_rel0=0.0015)
    outerContactB: trans.ElastoGap = trans.ElastoGap(c=1000e3, d=250, s_rel0=0.0015)
    rod1: trans.Rod = trans.Rod(L=0.007)
    friction: trans.Damper = trans.Damper(d=2500)
    force: trans.Force = trans.Force()
    housing: trans.Rod = trans.Rod(L=0.0305)
    rod3: trans.Rod = trans.Rod(L=0.00575)
    rod4: trans.Rod = trans.Rod(L=0.00575)
    rod2: trans.Rod = trans.Rod(L=0.007)
    sineForce: Sine = Sine(amplitude=150, f=0.01)

    def equations(self) -> Equations:
        yield connect(self.outerContactA.flange_b, self.springPlateA.flange_a)
        yield connect(self.springPlateA.flange_b, self.spring.flange_a, self.rod1.flange_a)
        yield connect(self.spring.flange_b, self.springPlateB.flange_a, self.rod2.flange_b)
        yield connect(self.springPlateB.flange_b, self.outerContactB.flange_a)
        yield connect(self.outerContactB.flange_b, self.housing.flange_b)
        yield connect(self.innerContactA.flange_a, self.rod3.flange_a, self.friction.flange_b)
        yield connect(self.innerContactA.flange_b, self.rod1.flange_b)
        yield connect(self.rod2.flange_a, self.innerContactB.flange_a)
        yield connect(self.rod4.flange_b, self.innerContactB.flange_b)
        yield connect(self.rod3.flange_b, self.rod4.flange_a, self.spool.flange_a, self.force.flange)
        yield connect(self.sineForce.y, self.force.f)
        yield connect(self.outerContactA.flange_a, self.housing.flange_a, self.friction.flange_a, self.fixedLe.flange)

    def initial(self) -> Equations:
        yield self.spool.s == 0.01475
        yield self.spool.v == 0
        yield self.springPlateA.s == -0.093
        yield self.springPlateA.v == 0
        yield self.springPlateB.s == -0.06925
        yield self.springPlateB.v == 0


class ElastoGap(Component):
    """A mass between two spring-dampers, and one between two contacts that lift off."""

    fixed: trans.Fixed = trans.Fixed()
    rod1: trans.Rod = trans.Rod(L=2)
    rod2: trans.Rod = trans.Rod(L=2)
    springDamper1: trans.SpringDamper = trans.SpringDamper(c=10, s_rel0=1, d=1.5)
    springDamper2: trans.SpringDamper = trans.SpringDamper(c=10, s_rel0=1, d=1.5)
    mass1: trans.Mass = trans.Mass(m=1)
    elastoGap1: trans.ElastoGap = trans.ElastoGap(c=10, s_rel0=1.5, d=1.5)
    elastoGap2: trans.ElastoGap = trans.ElastoGap(c=10, s_rel0=1.5, d=1.5)
    mass2: trans.Mass = trans.Mass(m=1)

    def equations(self) -> Equations:
        yield connect(self.rod1.flange_b, self.fixed.flange, self.rod2.flange_a)
        yield connect(self.springDamper1.flange_a, self.rod1.flange_a, self.elastoGap1.flange_a)
        yield connect(self.springDamper2.flange_b, self.rod2.flange_b, self.elastoGap2.flange_b)
        yield connect(self.springDamper1.flange_b, self.mass1.flange_a)
        yield connect(self.mass1.flange_b, self.springDamper2.flange_a)
        yield connect(self.elastoGap1.flange_b, self.mass2.flange_a)
        yield connect(self.mass2.flange_b, self.elastoGap2.flange_a)

    def initial(self) -> Equations:
        for mass in (self.mass1, self.mass2):
            yield mass.s == 2
            yield mass.v == 0


class Brake(Component):
    """A moving mass is braked to rest, on ground by itself and on a fixed point."""

    brake: trans.Brake = trans.Brake(fn_max=1)
    mass1: trans.Mass = trans.Mass(m=1)
    step: Step = Step(startTime=0.1, height=2)
    brake1: trans.Brake = trans.Brake(fn_max=1)
    mass2: trans.Mass = trans.Mass(m=1)
    fixed: trans.Fixed = trans.Fixed()

    def equations(self) -> Equations:
        yield connect(self.mass1.flange_b, self.brake.flange_a)
        yield connect(self.step.y, self.brake.f_normalized, self.brake1.f_normalized)
        yield connect(self.mass2.flange_b, self.brake1.flange_a)
        yield connect(self.fixed.flange, self.brake1.support)

    def initial(self) -> Equations:
        for mass in (self.mass1, self.mass2):
            yield mass.s == 0
            yield mass.v == 1


class HeatLosses(Component):
    """Everything that dissipates, heating one place that is cooled by convection."""

    mass1: trans.Mass = trans.Mass(m=1, L=0.1)
    springDamper: trans.SpringDamper = trans.SpringDamper(c=100, d=10)
    damper: trans.Damper = trans.Damper(d=10)
    elastoGap: trans.ElastoGap = trans.ElastoGap(c=100, d=20, s_rel0=-0.02)
    fixed1: trans.Fixed = trans.Fixed()
    force: trans.Force = trans.Force()
    sine1: Sine = Sine(f=1, amplitude=20)
    mass2: trans.Mass = trans.Mass(m=1, L=0.1)
    supportFriction: trans.SupportFriction = trans.SupportFriction()
    spring: trans.Spring = trans.Spring(c=100)
    mass3: trans.Mass = trans.Mass(m=1, L=0.1)
    brake: trans.Brake = trans.Brake(fn_max=10)
    sine2: Sine = Sine(amplitude=10, f=2)
    massWithStopAndFriction: trans.MassWithStopAndFriction = trans.MassWithStopAndFriction(
        L=0.1, m=1, F_prop=0.5, F_Coulomb=1, F_Stribeck=2, fexp=2, smin=0, smax=0.4
    )
    convection: Convection = Convection()
    const: Constant = Constant(k=20)
    TAmbient: FixedTemperature = FixedTemperature(T=298.15)
    fixed2: trans.Fixed = trans.Fixed()
    springDamper1: trans.SpringDamper = trans.SpringDamper(c=10000, d=1000)

    def equations(self) -> Equations:
        yield connect(self.mass1.flange_b, self.springDamper.flange_a)
        yield connect(self.sine1.y, self.force.f)
        yield connect(self.force.flange, self.mass1.flange_a, self.damper.flange_a, self.elastoGap.flange_b)
        yield connect(self.damper.flange_b, self.fixed1.flange)
        yield connect(self.springDamper.flange_b, self.mass2.flange_a)
        yield connect(self.mass2.flange_b, self.supportFriction.flange_a)
        yield connect(self.supportFriction.flange_b, self.spring.flange_a)
        yield connect(self.spring.flange_b, self.mass3.flange_a)
        yield connect(self.mass3.flange_b, self.brake.flange_a)
        yield connect(self.sine2.y, self.brake.f_normalized)
        yield connect(self.elastoGap.flange_a, self.fixed2.flange)
        yield connect(self.brake.flange_b, self.springDamper1.flange_a)
        yield connect(self.springDamper1.flange_b, self.massWithStopAndFriction.flange_a)
        yield connect(self.const.y, self.convection.Gc)
        yield connect(self.TAmbient.port, self.convection.fluid)
        yield connect(
            self.convection.solid,
            self.elastoGap.heat_port,
            self.damper.heat_port,
            self.springDamper.heat_port,
            self.supportFriction.heat_port,
            self.brake.heat_port,
            self.springDamper1.heat_port,
            self.massWithStopAndFriction.heat_port,
        )

    def initial(self) -> Equations:
        yield self.mass1.s == 0
        yield self.mass1.v == 0
        yield self.springDamper.s_rel == 0
        yield self.springDamper.v_rel == 0
        yield self.spring.s_rel == 0
        yield self.mass3.v == 0
        yield self.springDamper1.s_rel == 0
        yield self.massWithStopAndFriction.v == 0


class EddyCurrentBrake(Component):
    """A moving mass whose energy an eddy-current brake turns into heat."""

    eddyCurrentForce: trans.EddyCurrentForce = trans.EddyCurrentForce(
        f_nominal=100, v_nominal=10, TRef=293.15, alpha20=COPPER
    )
    mass: trans.Mass = trans.Mass(m=1)
    heatCapacitor: HeatCapacitor = HeatCapacitor(C=1)

    def equations(self) -> Equations:
        yield connect(self.eddyCurrentForce.flange, self.mass.flange_a)
        yield connect(self.eddyCurrentForce.heat_port, self.heatCapacitor.port)

    def initial(self) -> Equations:
        yield self.mass.s == 0
        yield self.mass.v == 20
        yield self.heatCapacitor.T == 293.15


class CompareBrakingForce(Component):
    """Four laws of braking force on the same moving mass."""

    mass1: trans.Mass = trans.Mass(m=1)
    signForce: trans.SignForce = trans.SignForce(f_nominal=-100, reg="linear", v0=1)
    mass2: trans.Mass = trans.Mass(m=1)
    linearSpeedDependentForce: trans.LinearSpeedDependentForce = trans.LinearSpeedDependentForce(
        f_nominal=-100, ForceDirection=False, v_nominal=100
    )
    mass3: trans.Mass = trans.Mass(m=1)
    quadraticSpeedDependentForce: trans.QuadraticSpeedDependentForce = trans.QuadraticSpeedDependentForce(
        f_nominal=-100, ForceDirection=False, v_nominal=100
    )
    mass4: trans.Mass = trans.Mass(m=1)
    inverseSpeedDependentForce: trans.InverseSpeedDependentForce = trans.InverseSpeedDependentForce(
        f_nominal=-100, ForceDirection=False, v_nominal=100, v0=1
    )

    def equations(self) -> Equations:
        yield connect(self.signForce.flange, self.mass1.flange_a)
        yield connect(self.linearSpeedDependentForce.flange, self.mass2.flange_a)
        yield connect(self.quadraticSpeedDependentForce.flange, self.mass3.flange_a)
        yield connect(self.inverseSpeedDependentForce.flange, self.mass4.flange_a)

    def initial(self) -> Equations:
        for mass in (self.mass1, self.mass2, self.mass3, self.mass4):
            yield mass.s == 0
            yield mass.v == 100


INCLINATION = ((0.0, 0.0), (20.0, 0.0), (20.0, 0.05), (25.0, 0.05), (25.0, 0.0), (60.0, 0.0))
TORQUE = (
    (0.0, 0.0),
    (5.0, 0.0),
    (5.0, 5.6),
    (10.8, 5.6),
    (10.8, 1.0),
    (20.0, 1.0),
    (20.0, 2.8),
    (25.0, 2.8),
    (25.0, 1.0),
    (50.0, 1.0),
    (50.0, -5.0),
    (55.0, -5.0),
    (55.0, 0.0),
    (60.0, 0.0),
)
V_NOMINAL = 25 / 3.5
NOMINAL_TORQUE = (0.5 * 1 * 1.18 * V_NOMINAL**2 / 2 + 0.01 * 100 * G_N) * 0.25


def _car() -> RoadVehicle:
    return RoadVehicle(m=100, J=0, R=0.25, A=1, Cd=0.5, CrConstant=0.01, useInclinationInput=True)


class Vehicle(Component):
    """A vehicle alone, and one that pulls a trailer of the same data with twice the torque."""

    vehicle: RoadVehicle = _car()
    vehicle1: RoadVehicle = _car()
    trailer: RoadVehicle = _car()
    multiSensor: trans.MultiSensor = trans.MultiSensor()
    tableTorque: TimeTable = TimeTable(table=TORQUE)
    tableInclination: TimeTable = TimeTable(table=INCLINATION)
    torque: rot.Torque = rot.Torque()
    torque1: rot.Torque = rot.Torque()
    gain: Gain = Gain(k=NOMINAL_TORQUE)
    gain1: Gain = Gain(k=2)

    def equations(self) -> Equations:
        yield connect(self.tableTorque.y, self.gain.u)
        yield connect(
            self.tableInclination.y, self.vehicle.inclination, self.vehicle1.inclination, self.trailer.inclination
        )
        yield connect(self.gain.y, self.torque.tau, self.gain1.u)
        yield connect(self.torque.flange, self.vehicle.flangeR)
        yield connect(self.torque1.flange, self.vehicle1.flangeR)
        yield connect(self.gain1.y, self.torque1.tau)
        yield connect(self.vehicle1.flangeT, self.multiSensor.flange_a)
        yield connect(self.multiSensor.flange_b, self.trailer.flangeT)

    def initial(self) -> Equations:
        yield self.vehicle.s == 0
        yield self.vehicle.v == 0
        yield self.vehicle1.s == 0
        yield self.vehicle1.v == 0


class CoupledByAdaptors(Component):
    """Two masses and a spring-damper that see each other as signals, and the same joined by flanges."""

    sine1: Sine = Sine(f=2, amplitude=10)
    force1: trans.Force = trans.Force()
    mass1a: trans.Mass = trans.Mass(m=1.1)
    mass1b: trans.Mass = trans.Mass(m=2.2)
    springDamper1: trans.SpringDamper = trans.SpringDamper(c=1e4, d=100)
    force2: trans.Force = trans.Force()
    mass2a: trans.Mass = trans.Mass(m=1.1)
    mass2b: trans.Mass = trans.Mass(m=2.2)
    adaptor2a: trans.ForceToPositionAdaptor = trans.ForceToPositionAdaptor()
    adaptor2b: trans.ForceToPositionAdaptor = trans.ForceToPositionAdaptor()
    inverse2a: trans.PositionToForceAdaptor = trans.PositionToForceAdaptor()
    inverse2b: trans.PositionToForceAdaptor = trans.PositionToForceAdaptor()
    springDamper2: trans.SpringDamper = trans.SpringDamper(c=1e4, d=100)

    def equations(self) -> Equations:
        yield connect(self.sine1.y, self.force1.f, self.force2.f)
        yield connect(self.force1.flange, self.mass1a.flange_a)
        yield connect(self.mass1a.flange_b, self.springDamper1.flange_a)
        yield connect(self.springDamper1.flange_b, self.mass1b.flange_a)
        yield connect(self.force2.flange, self.mass2a.flange_a)
        yield connect(self.mass2a.flange_b, self.adaptor2a.flange)
        yield connect(self.mass2b.flange_a, self.adaptor2b.flange)
        yield connect(self.adaptor2a.s, self.inverse2a.s)
        yield connect(self.adaptor2b.s, self.inverse2b.s)
        yield connect(self.inverse2a.f, self.adaptor2a.f)
        yield connect(self.inverse2b.f, self.adaptor2b.f)
        yield connect(self.inverse2a.flange, self.springDamper2.flange_a)
        yield connect(self.inverse2b.flange, self.springDamper2.flange_b)

    def initial(self) -> Equations:
        for mass in (self.mass1a, self.mass1b, self.mass2a, self.mass2b):
            yield mass.s == 0
            yield mass.v == 0
