"""The energy audit: closed balances, the order of what is left over, instants, and components that hide energy."""

from __future__ import annotations

import pickle
from typing import ClassVar

import casadi as ca
import numpy as np
import pytest

import powertrain as pt
from powertrain import Equations, Input, Parameter, Symbol, Variable, connect, der, parameter, signal_input, variable
from powertrain.analysis.audit import energy_audit
from powertrain.components import blocks
from powertrain.components import rotational as rot
from powertrain.components import translational as trans
from powertrain.components.differentials import PlanetaryGear
from powertrain.components.rotational.interfaces import CompliantWithRelativeStates, OneFlangeAndSupport, TwoFlanges


class Shaft(pt.Component):
    """A spring between two dampers, as one part."""

    flange_a: rot.Flange = pt.port(rot.Flange)
    flange_b: rot.Flange = pt.port(rot.Flange)
    spring: rot.Spring = rot.Spring(c=100.0)
    damper: rot.Damper = rot.Damper(d=0.5)

    def equations(self) -> Equations:
        yield connect(self.flange_a, self.spring.flange_a, self.damper.flange_a)
        yield connect(self.flange_b, self.spring.flange_b, self.damper.flange_b)


class Oscillator(pt.Component):
    J1: rot.Inertia = rot.Inertia(J=2.0)
    J2: rot.Inertia = rot.Inertia(J=3.0)
    shaft: Shaft = Shaft()
    torque: rot.Torque = rot.Torque()
    sine: blocks.Sine = blocks.Sine(amplitude=1.0, f=2.0)

    def equations(self) -> Equations:
        yield connect(self.sine.y, self.torque.tau)
        yield connect(self.torque.flange, self.J1.flange_a)
        yield connect(self.J1.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.J2.flange_a)


def test_balance_of_an_oscillator() -> None:
    result = pt.simulate(Oscillator(), 5.0, rtol=1e-9)
    audit = energy_audit(result)
    assert audit.closure < 1e-7
    assert not audit.hidden
    table = audit.components
    assert list(table.index) == ["", "J1", "J2", "shaft", "shaft.spring", "shaft.damper", "torque"]
    assert table["type"][""] == "Oscillator"
    assert table.attrs["units"]["lost"] == "J"
    balance = table["supplied"] + table["sources"] + table["impulses"] - table["lost"] - table["stored"]
    assert np.allclose(balance, table["residual"], rtol=0, atol=1e-12)
    whole, shaft = ({name: table[name][path] for name in ("supplied", "sources", "lost")} for path in ("", "shaft"))
    assert whole["sources"] == pytest.approx(-table["supplied"]["torque"])
    assert whole["lost"] == shaft["lost"] == table["lost"]["shaft.damper"]
    assert shaft["supplied"] == pytest.approx(table["supplied"]["shaft.spring"] + table["supplied"]["shaft.damper"])
    fine = result.at(np.linspace(0.0, 5.0, 20001), ["torque.tau", "J1.w", "shaft.damper.w_rel"])
    supply = np.trapezoid(fine["torque.tau"] * fine["J1.w"], dx=5.0 / 20000)
    assert whole["sources"] == pytest.approx(supply, rel=1e-5)
    assert whole["lost"] == pytest.approx(np.trapezoid(0.5 * fine["shaft.damper.w_rel"] ** 2, dx=5.0 / 20000), rel=1e-5)


class DrivenInside(pt.Component):
    """A torque and a brake on parts inside an oscillator."""

    inside: Oscillator = Oscillator()
    motor: rot.ConstantTorque = rot.ConstantTorque(tau_constant=3.0)
    brake: rot.Damper = rot.Damper(d=0.7)
    ground: rot.Fixed = rot.Fixed()

    def equations(self) -> Equations:
        yield connect(self.motor.flange, self.inside.shaft.spring.flange_a)
        yield connect(self.brake.flange_a, self.inside.J2.flange_b)
        yield connect(self.brake.flange_b, self.ground.flange)


def test_connections_that_reach_into_a_part() -> None:
    """The part receives power at them, without a port of its own."""
    run = pt.simulate(DrivenInside(), 5.0, rtol=1e-9, starts={"inside.J1.w": 0.0, "inside.J2.w": 0.0})
    audit = energy_audit(run)
    assert audit.closure < 1e-7
    assert not audit.hidden
    table = audit.components
    for name in ("inside", "inside.shaft", "inside.J2"):
        supplied, sources, lost, stored = (
            float(table[what][name]) for what in ("supplied", "sources", "lost", "stored")
        )
        assert supplied + sources == pytest.approx(lost + stored, abs=1e-6)
    assert table["supplied"]["inside"] == pytest.approx(table["sources"]["motor"] - table["lost"]["brake"])
    flow = pt.power_flow(run, at=2.0)
    assert flow.input == pytest.approx(3.0 * run.at([2.0], ["inside.J1.w"])["inside.J1.w"][0])
    with pytest.raises(
        pt.ParameterError, match=r"inside\.shaft cannot be treated as one, because .*inside\.shaft\.spring"
    ):
        pt.power_flow(run, at=2.0, whole="inside.shaft")


def test_tables_over_time() -> None:
    result = pt.simulate(Oscillator(), 2.0)
    audit = pickle.loads(pickle.dumps(energy_audit(result)))
    assert np.array_equal(audit.time, result.time)
    assert np.allclose(audit.power["torque.flange"], -result["torque.tau"] * result["J1.w"])
    assert np.allclose(audit.energy[""], audit.energy["J1"] + audit.energy["J2"] + audit.energy["shaft"])
    assert np.allclose(audit.energy["shaft.spring"], 50.0 * result["shaft.spring.phi_rel"] ** 2)
    assert np.allclose(audit.loss["shaft"], 0.5 * result["shaft.damper.w_rel"] ** 2)
    assert np.allclose(audit.supply["torque"], -audit.power["torque.flange"] - audit.power["torque.support"])
    assert np.abs(audit.imbalance.to_numpy()).max() < 1e-12
    assert audit.ports["energy"]["J1.flange_b"] == pytest.approx(-audit.ports["energy"]["shaft.flange_a"])
    assert (audit.ports["energy_in"] - audit.ports["energy_out"]).to_numpy() == pytest.approx(
        audit.ports["energy"].to_numpy()
    )
    assert repr(audit).startswith("EnergyAudit of Oscillator, 0 .. 2 s\n")


def test_what_is_left_over_falls_with_the_tolerance() -> None:
    plant = pt.compile(Oscillator())
    closures = [energy_audit(plant.simulate(5.0, rtol=r, atol=1e-2 * r)).closure for r in (1e-4, 1e-6, 1e-8, 1e-10)]
    assert all(closures[i + 1] < closures[i] / 20 for i in range(3))
    assert closures[-1] < 1e-9


class Clutches(pt.Component):
    """Two clutches that are pressed one after the other."""

    sine: blocks.Sine = blocks.Sine(amplitude=10.0, f=5.0)
    torque: rot.Torque = rot.Torque()
    J: tuple[rot.Inertia, ...] = tuple(rot.Inertia(J=1.0) for _ in range(3))
    clutch: tuple[rot.Clutch, ...] = tuple(rot.Clutch(peak=1.1, fn_max=20.0) for _ in range(2))
    press: tuple[blocks.Step, ...] = (blocks.Step(startTime=0.1), blocks.Step(startTime=0.5))

    def equations(self) -> Equations:
        yield connect(self.sine.y, self.torque.tau)
        yield connect(self.torque.flange, self.J[0].flange_a)
        for i in range(2):
            yield connect(self.J[i].flange_b, self.clutch[i].flange_a)
            yield connect(self.clutch[i].flange_b, self.J[i + 1].flange_a)
            yield connect(self.press[i].y, self.clutch[i].f_normalized)

    def initial(self) -> Equations:
        yield self.J[0].w == 10.0


def test_friction_loses_what_the_clutches_say() -> None:
    result = pt.simulate(Clutches(), 3.0, rtol=1e-8)
    audit = energy_audit(result)
    assert len(result.events) > 3
    assert audit.closure < 1e-7
    assert not audit.hidden
    assert min(audit.components["lost"][f"clutch[{i}]"] for i in range(2)) > 1.0
    assert audit.jumps.empty


class Pendulum(pt.Component):
    """Starts with energy and never changes it: nothing is turned over."""

    J: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> Equations:
        yield from ()

    def initial(self) -> Equations:
        yield self.J.w == 3.0


def test_nothing_turned_over() -> None:
    audit = energy_audit(pt.simulate(Pendulum(), 1.0))
    assert audit.closure == 0.0
    assert audit.components["stored"]["J"] == 0.0
    assert audit.energy["J"].iloc[-1] == pytest.approx(9.0)


class Stop(TwoFlanges):
    """A rigid stop with restitution between two shafts."""

    e: Parameter = parameter("1", "Coefficient of restitution", default=0.5)
    gap: Variable = variable("rad", "Play", start=0.5, prefer=True)
    force: Variable = variable("N.m", "Contact torque")

    def equations(self) -> Equations:
        yield self.gap == self.flange_b.phi - self.flange_a.phi
        yield self.flange_b.tau == -self.force
        yield self.flange_a.tau == self.force
        yield pt.unilateral(self.gap, self.force, restitution=self.e)


class Collision(pt.Component):
    a: rot.Inertia = rot.Inertia(J=1.0)
    stop: Stop = Stop()
    b: rot.Inertia = rot.Inertia(J=3.0)

    def equations(self) -> Equations:
        yield connect(self.a.flange_b, self.stop.flange_a)
        yield connect(self.stop.flange_b, self.b.flange_a)

    def initial(self) -> Equations:
        yield self.a.w == 2.0


def test_an_impact_is_a_loss_of_the_contact() -> None:
    audit = energy_audit(pt.simulate(Collision(), 1.0))
    lost = (1 - 0.5**2) / 2 * (1.0 * 3.0 / 4.0) * 2.0**2
    table = audit.components
    assert table["lost"]["stop"] == pytest.approx(lost)
    assert table["impulses"]["stop"] == pytest.approx(lost)
    assert table["impulses"][""] == pytest.approx(0.0, abs=1e-9)
    assert table["lost"][""] == pytest.approx(-table["stored"][""])
    assert audit.closure < 1e-9
    assert audit.jumps["components"].tolist() == ["stop"]
    assert audit.jumps["time"].to_numpy() == pytest.approx([0.25])
    assert audit.jumps["energy"].to_numpy() == pytest.approx([-lost])
    assert "at impacts and resets" in repr(audit)
    released, stored = 2.0 - 0.25**2 / 2, 3.0 * 0.75**2 / 2
    assert audit.turnover == pytest.approx((released + stored) / 2)  # without what is lost in the jump


class Press(pt.Component):
    """A motor of constant speed drives a ram against its stop through two ways of a planetary gear; the third has a flywheel."""

    motor: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=5.0)
    gear: PlanetaryGear = PlanetaryGear(ratio=2.0)
    flywheel: rot.Inertia = rot.Inertia(J=1.0)
    rack: rot.IdealRollingWheel = rot.IdealRollingWheel(radius=1.0)
    ram: trans.MassWithStopAndFriction = trans.MassWithStopAndFriction(
        m=1.5, F_prop=0.0, F_Coulomb=0.0, F_Stribeck=0.0, fexp=2.0, smin=-10.0, smax=0.1
    )

    def equations(self) -> Equations:
        yield connect(self.motor.flange, self.gear.sun)
        yield connect(self.gear.carrier, self.flywheel.flange_a)
        yield connect(self.gear.ring, self.rack.flangeR)
        yield connect(self.rack.flangeT, self.ram.flange_a)


@pytest.mark.parametrize(("speed", "flywheel"), [(5.0, 3.0), (-5.0, -1.0)])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_motor_takes_part_in_the_impact_of_its_press(speed: float, flywheel: float, restitution: float) -> None:
    """The ram has v = (3 w - speed)/2; what the flywheel loses, J dw = (2/3) J dv, reaches the motor as an impulse (2/9) J dv."""
    ram = trans.MassWithStopAndFriction(
        m=1.5, F_prop=0.0, F_Coulomb=0.0, F_Stribeck=0.0, fexp=2.0, smin=-10.0, smax=0.1, restitution=restitution
    )
    result = pt.simulate(Press(ram=ram, motor=rot.ConstantSpeed(w_fixed=speed)), 0.15, starts={"flywheel.w": flywheel})
    audit, v = energy_audit(result), (3 * flywheel - speed) / 2
    lost = (1 - restitution**2) / 2 * (1.5 + 4 / 9) * v**2
    supplied = -2 / 9 * (1 + restitution) * v * speed
    assert audit.components["lost"]["ram"] == pytest.approx(lost)
    assert audit.components["sources"]["motor"] == pytest.approx(supplied)
    assert audit.components["impulses"]["motor"] == pytest.approx(-supplied)
    assert audit.jumps["supplied"].to_numpy() == pytest.approx([supplied])
    assert audit.jumps["energy"].to_numpy() == pytest.approx([supplied - lost])
    assert audit.closure < 1e-9
    assert not len(audit.violations), audit


class Dragged(pt.Component):
    """A motor of constant speed drives a wheel through a freewheel; a brake of a moment takes 3 rad/s from it, which come back at once."""

    motor: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=5.0)
    freewheel: rot.Freewheel = rot.Freewheel()
    wheel: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> Equations:
        yield connect(self.motor.flange, self.freewheel.flange_a)
        yield connect(self.freewheel.flange_b, self.wheel.flange_a)
        yield pt.when(pt.time > 0.1, pt.reinit(self.freewheel.w_rel, -3.0))

    def initial(self) -> Equations:
        yield self.wheel.w == 5.0


def test_a_motor_supplies_what_a_freewheel_takes_at_once() -> None:
    """The impulse of 3 N.m.s at 5 rad/s is 15 J: lost at the reset, (5^2 - 2^2)/2 J, and in the freewheel, 3 (0 + 3)/2 J."""
    audit = energy_audit(pt.simulate(Dragged(), 0.2))
    assert audit.components["sources"]["motor"] == pytest.approx(15.0)
    assert audit.components["lost"][""] == pytest.approx(15.0)
    assert audit.closure < 1e-9
    assert not len(audit.violations), audit


class Bounce(pt.Component):
    """A sliding mass runs into its stop and loses its speed there."""

    force: trans.ConstantForce = trans.ConstantForce(f_constant=20.0)
    mass: trans.MassWithStopAndFriction = trans.MassWithStopAndFriction(
        L=1.0, m=2.0, F_prop=1.0, F_Coulomb=5.0, F_Stribeck=10.0, fexp=2.0, smax=25.0, smin=-25.0
    )

    def equations(self) -> Equations:
        yield connect(self.force.flange, self.mass.flange_a)


def test_a_reset_is_a_loss_of_the_component_that_resets() -> None:
    result = pt.simulate(Bounce(), 10.0, rtol=1e-8)
    audit = energy_audit(result)
    speed = np.abs(result["mass.v"]).max()
    assert speed > 1.0
    assert audit.jumps["energy"].min() == pytest.approx(-(speed**2), rel=1e-6)
    assert audit.closure < 1e-7
    assert not audit.hidden
    assert audit.components["sources"]["force"] == pytest.approx(
        20.0 * (result["mass.s"][-1] - result["mass.s"][0]), rel=1e-6
    )


class Forgetful(CompliantWithRelativeStates):
    """A spring and damper that tells neither its loss nor its energy."""

    def equations(self) -> Equations:
        yield from self._transmit()
        yield self.tau == 100.0 * self.phi_rel + 0.5 * self.w_rel


class Hiding(pt.Component):
    a: rot.Inertia = rot.Inertia(J=1.0)
    shaft: Forgetful = Forgetful()
    b: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> Equations:
        yield connect(self.a.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.b.flange_a)

    def initial(self) -> Equations:
        yield self.a.w == 1.0


def test_hidden_energy_is_named() -> None:
    audit = energy_audit(pt.simulate(Hiding(), 1.0))
    assert list(audit.hidden) == ["shaft"]
    assert audit.closure > 0.01
    assert "shaft: power does not balance, " in repr(audit)
    assert audit.imbalance["shaft"].abs().max() == pytest.approx(audit.hidden["shaft"], rel=0.1)


class Generous(CompliantWithRelativeStates):
    """A coupling with a torque in the direction of its slip for a while: it gives energy, and says so."""

    d: Parameter = parameter("N.m.s/rad", "Damping")

    def equations(self) -> Equations:
        yield from self._transmit()
        yield self.tau == self.d * self.w_rel * pt.switch(pt.time > 0.5, 1.0, -1.0)

    def loss(self) -> Symbol:
        return self.tau * self.w_rel


class Stiffening(CompliantWithRelativeStates):
    """A spring whose rate jumps while it is twisted."""

    later: Parameter = parameter("N.m/rad", "Rate from 0.5 s on", default=200.0)

    def equations(self) -> Equations:
        yield from self._transmit()
        yield self.tau == self.rate * self.phi_rel

    @property
    def rate(self) -> Symbol:
        return pt.switch(pt.time > 0.5, self.later, 100.0)

    def energy(self) -> Symbol:
        return self.rate * self.phi_rel**2 / 2


class Kicked(pt.Component):
    """A mass of 1 kg that gets more speed from nowhere."""

    more: Parameter = parameter("m/s", "Change of the speed", default=2.0)
    v: Variable = variable("m/s", "Speed", start=3.0)

    def equations(self) -> Equations:
        yield der(self.v) == 0.0
        yield pt.when(pt.time > 0.5, pt.reinit(self.v, self.v + self.more))

    def energy(self) -> Symbol:
        return self.v**2 / 2


class Coupled(pt.Component):
    a: rot.Inertia = rot.Inertia(J=1.0)
    shaft: TwoFlanges = rot.Spring(c=100.0)
    b: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> Equations:
        yield connect(self.a.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.b.flange_a)

    def initial(self) -> Equations:
        yield self.b.w == 3.0


def violations(shaft: TwoFlanges) -> list[tuple[str, float, str, float, str]]:
    audit = energy_audit(pt.simulate(Coupled(shaft=shaft), 1.0, rtol=1e-8))
    assert audit.closure < 1e-6 or isinstance(shaft, Stiffening)
    return list(audit.violations.itertuples(index=False, name=None))


def test_a_negative_loss_is_named_with_its_instant() -> None:
    ((component, time, violation, amount, unit),) = violations(Generous(d=1.0))
    assert (component, violation, unit) == ("shaft", "negative loss", "W")
    assert amount == pytest.approx(
        -(3.0**2) * np.exp(3.0 / 2.0), rel=1e-2
    )  # w_rel grows by exp(d (1/J_a + 1/J_b) t) until 0.5 s
    assert time == pytest.approx(0.5, abs=0.02)


def test_stored_energy_that_jumps_is_named_with_its_instant() -> None:
    ((component, time, violation, amount, unit),) = violations(Stiffening())
    assert (component, violation[:19], unit) == ("shaft", "stored energy jumps", "J")
    assert time == pytest.approx(0.5)
    before = pt.simulate(Coupled(), 0.5, rtol=1e-8)["shaft.phi_rel"][-1]
    assert amount == pytest.approx(50.0 * before**2, rel=1e-5)
    assert "shaft: stored energy jumps" in repr(energy_audit(pt.simulate(Coupled(shaft=Stiffening()), 1.0)))


def test_a_reset_that_gives_energy_is_named_with_its_instant() -> None:
    ((component, time, violation, amount, unit),) = energy_audit(pt.simulate(Kicked(), 1.0)).violations.to_numpy()
    assert (component, violation[:12], unit) == ("", "gives energy", "J")
    assert time == pytest.approx(0.5)
    assert amount == pytest.approx((5.0**2 - 3.0**2) / 2)


@pytest.mark.parametrize(("more", "count"), [(1e-7, 0), (1e-5, 1)])
def test_a_reset_may_give_a_millionth_of_the_energy(more: float, count: int) -> None:
    """Of v^2/2 it gives the share 2 more/v, with v = 3 m/s."""
    assert len(energy_audit(pt.simulate(Kicked(more=more), 1.0)).violations) == count


@pytest.mark.parametrize("shaft", [rot.Spring(c=100.0), rot.Damper(d=1.0), rot.SpringDamper(c=100.0, d=1.0)])
def test_what_obeys_is_not_named(shaft: TwoFlanges) -> None:
    assert violations(shaft) == []


class Slippery(CompliantWithRelativeStates):
    """A joint with the given loss, which may be noise."""

    noise: Parameter = parameter("W", "Its loss")

    def equations(self) -> Equations:
        yield from self._transmit()
        yield self.tau == 0.0

    def loss(self) -> Symbol:
        return Symbol(1.0) * self.noise


@pytest.mark.parametrize(("noise", "count"), [(-1e-11, 0), (-1e-62, 0), (-1e-3, 1)])
def test_noise_is_no_alarm(noise: float, count: int) -> None:
    for start in 0.0, 3.0:
        run = pt.simulate(Coupled(shaft=Slippery(noise=noise)), 10.0, starts={"b.w": start})
        assert (energy_audit(run).violations["violation"] == "negative loss").sum() == count


class Switched(OneFlangeAndSupport):
    """A brake whose loss is written with a switch of its own, and whose constant comes from outside."""

    d: Parameter = parameter("N.m.s/rad", "Damping")
    w: Variable = variable("rad/s", "Speed")

    def equations(self) -> Equations:
        yield from self._against_support()
        yield self.w == der(self.phi)
        yield self.flange.tau == self.d * pt.switch(self.w > 0, self.w, 3 * self.w, continuous=True)

    def loss(self) -> Symbol:
        return self.d * self.w * pt.switch(self.w > 0, self.w, 3 * self.w)


class Engine(pt.Component):
    """A part that is a source itself: it drives the shaft inside it by its own equation, and has an inertia."""

    boundary: ClassVar[bool] = True
    flange: rot.Flange = pt.port(rot.Flange)
    u: Input = signal_input("N.m", "Torque")
    torque: rot.Torque = rot.Torque()
    J: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> Equations:
        yield connect(self.u, self.torque.tau)
        yield connect(self.torque.flange, self.J.flange_a)
        yield connect(self.J.flange_b, self.flange)


class Braked(pt.Component):
    damping: Parameter = parameter("N.m.s/rad", "Damping of the brake", default=0.4)
    sine: blocks.Sine = blocks.Sine(amplitude=3.0, f=0.5)
    engine: Engine = Engine()
    brake: Switched = Switched(d=1.0)

    def equations(self) -> Equations:
        yield self.brake.d == self.damping
        yield connect(self.sine.y, self.engine.u)
        yield connect(self.engine.flange, self.brake.flange)


def test_switches_in_losses_bound_parameters_and_sources_of_parts() -> None:
    plant = pt.compile(Braked())
    count = len(plant.compiled.source.recorder.switches)
    audit = energy_audit(plant.simulate(4.0, parameters={"damping": 0.7}, rtol=1e-8))
    assert len(plant.compiled.source.recorder.switches) == count
    assert audit.closure < 1e-6
    assert not audit.hidden
    table = audit.components
    assert table["sources"]["engine"] == pytest.approx(table["sources"]["engine.torque"])
    assert table["stored"]["engine"] == pytest.approx(table["stored"]["engine.J"])
    assert table["lost"]["brake"] > 1.0


class Cubic(CompliantWithRelativeStates):
    """phi_rel = tau + tau^3: the torque, and with it the energy, is implicit."""

    def equations(self) -> Equations:
        yield from self._transmit()
        yield self.phi_rel == self.tau + self.tau**3

    def energy(self) -> Symbol:
        """Integral of tau dphi_rel."""
        return self.tau**2 / 2 + 3 * self.tau**4 / 4


class Implicit(pt.Component):
    fixed: rot.Fixed = rot.Fixed()
    spring: Cubic = Cubic()
    J: rot.Inertia = rot.Inertia(J=0.5)

    def equations(self) -> Equations:
        yield connect(self.fixed.flange, self.spring.flange_a)
        yield connect(self.spring.flange_b, self.J.flange_a)

    def initial(self) -> Equations:
        yield self.J.phi == 2.0


def test_energy_of_implicit_unknowns() -> None:
    plant = pt.compile(Implicit())
    assert plant.compiled.dae.z.numel() == 1
    audit = energy_audit(plant.simulate(5.0, rtol=1e-8))
    assert audit.closure < 1e-6
    assert not audit.hidden
    assert audit.components["sources"]["spring"] == 0.0


class Endless(CompliantWithRelativeStates):
    """A damper whose energy is not finite where it is relaxed."""

    def equations(self) -> Equations:
        yield from self._transmit()
        yield self.tau == self.w_rel

    def energy(self) -> Symbol:
        return ca.log(self.phi_rel - self.phi_rel)


class Broken(pt.Component):
    a: rot.Inertia = rot.Inertia(J=1.0)
    part: Endless = Endless()
    b: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> Equations:
        yield connect(self.a.flange_b, self.part.flange_a)
        yield connect(self.part.flange_b, self.b.flange_a)


def test_terms_that_are_not_finite_are_refused() -> None:
    with pytest.raises(pt.ModelError, match=r"energy of part is not finite at t = "):
        energy_audit(pt.simulate(Broken(), 0.1))


def test_a_result_of_samples_only_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match="only samples of the named signals"):
        energy_audit(pt.simulate(Hiding(), 0.1, record=["a.w"]))


def test_a_run_that_takes_no_time() -> None:
    audit = energy_audit(pt.simulate(Oscillator(), 0.0))
    assert audit.closure == 0.0
    assert audit.components["lost"].sum() == 0.0
    assert "EnergyAudit of Oscillator" in repr(audit)


class Swung(pt.Component):
    """A damped inertia that swings as a source says: there are no states, and steps of any length."""

    sine: blocks.Sine = blocks.Sine(amplitude=1.0, f=5.0)
    source: rot.Position = rot.Position(exact=True)
    inertia: rot.Inertia = rot.Inertia(J=2.0)
    damper: rot.Damper = rot.Damper(d=3.0)
    ground: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.sine.y, self.source.phi_ref)
        yield pt.connect(self.source.flange, self.inertia.flange_a)
        yield pt.connect(self.inertia.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


@pytest.mark.parametrize("f", [0.3, 5.0, 50.0])
def test_what_swings_within_a_step_is_integrated(f: float) -> None:
    result = pt.simulate(pt.replace(Swung(), {"sine.f": f}), 2.0)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-9
    w = 2 * np.pi * f
    lost = 3.0 * w**2 * (1.0 + np.sin(4 * w) / (4 * w))
    assert audit.components.loc["damper", "lost"] == pytest.approx(lost, rel=1e-7)


class PulsingDamper(TwoFlanges):
    """A damper that calls 1 W for a millisecond a gain, in its loss alone."""

    w_rel: Variable = variable("rad/s", "Relative speed")

    def equations(self) -> Equations:
        yield self.w_rel == der(self.flange_b.phi) - der(self.flange_a.phi)
        yield self.flange_b.tau == 0.5 * self.w_rel
        yield self.flange_a.tau == -0.5 * self.w_rel

    def loss(self) -> Symbol:
        pulse = pt.switch(pt.time > 0.501, pt.switch(pt.time < 0.502, 1.0, 0.0), 0.0)
        return 0.5 * self.w_rel**2 - pulse


class Pulsing(pt.Component):
    a: rot.Inertia = rot.Inertia(J=1.0)
    b: rot.Inertia = rot.Inertia(J=2.0)
    damper: PulsingDamper = PulsingDamper()

    def equations(self) -> Equations:
        yield connect(self.a.flange_b, self.damper.flange_a)
        yield connect(self.damper.flange_b, self.b.flange_a)


def test_a_short_pulse_of_time_in_a_loss_is_seen() -> None:
    """The run has no event there; the audit cuts its pieces at the instants of conditions of time in losses."""
    found = energy_audit(pt.simulate(Pulsing(), 1.0, starts={"a.w": 1.0, "b.w": 0.0})).violations
    gain = found[found["violation"] == "negative loss"]
    assert gain["component"].tolist() == ["damper"]
    assert 0.501 < gain["time"].item() < 0.502


class Declared(pt.Component):
    """Loses ``steady`` W, but gains ``gained`` W for ``lasting`` s from 0.5 s on, where its energy jumps; nothing moves."""

    steady: Parameter = parameter("W", "Loss", default=0.0)
    gained: Parameter = parameter("W", "Gain", default=0.0)
    lasting: Parameter = parameter("s", "Duration of the gain", default=0.0)
    jump: Parameter = parameter("J", "Energy from 0.5 s on", default=0.0)
    late: Variable = variable("1", "Whether it is later than 0.5 s")

    def equations(self) -> Equations:
        yield self.late == pt.switch(pt.time > 0.5, 1.0, 0.0)

    def loss(self) -> Symbol:
        gains = pt.switch(pt.time > 0.5, pt.switch(pt.time < 0.5 + self.lasting, 1.0, 0.0), 0.0)
        return self.steady - (self.steady + self.gained) * gains

    def energy(self) -> Symbol:
        return self.jump * self.late


class Several(pt.Component):
    parts: tuple[Declared, ...] = ()

    def equations(self) -> Equations:
        yield from ()


def named(violation: str, *parts: Declared) -> bool:
    """Whether a violation of the first of these parts is named, in a run of 1 s."""
    found = energy_audit(pt.simulate(Several(parts=parts), 1.0)).violations
    return bool(((found["component"] == "parts[0]") & found["violation"].str.startswith(violation)).any())


@pytest.mark.parametrize(("lasting", "wrong"), [(5e-6, False), (2e-5, True)])
def test_a_part_may_gain_a_hundred_millionth_of_its_own_energy(lasting: float, wrong: bool) -> None:
    """1 W over 1 s is 1 J; 1 mW for 5 us is 5e-9 J, and for 20 us 2e-8 J. The power itself is far above round-off."""
    assert named("negative loss", Declared(steady=1.0, gained=1e-3, lasting=lasting)) == wrong


@pytest.mark.parametrize(("lasting", "wrong"), [(2e-6, False), (1e-5, True)])
def test_a_part_may_gain_1e_14_of_the_energy_exchanged(lasting: float, wrong: bool) -> None:
    """1 GW over 1 s turns over half a gigajoule, of which 1e-14 is 5e-6 J; 1 W gives 2e-6 J in 2 us and 1e-5 J in 10 us."""
    assert named("negative loss", Declared(gained=1.0, lasting=lasting), Declared(steady=1e9)) == wrong


@pytest.mark.parametrize(("loss", "wrong"), [(3e-7, False), (3e-6, True)])
def test_an_imbalance_of_1e_15_of_the_largest_power_is_round_off(loss: float, wrong: bool) -> None:
    """Nothing supplies what the part loses, some millionths of a watt beside a gigawatt."""
    assert named("power does not balance", Declared(steady=loss), Declared(steady=1e9)) == wrong


@pytest.mark.parametrize(("jump", "wrong"), [(1e-7, False), (2e-6, True)])
def test_a_jump_of_1e_15_of_the_energy_exchanged_is_round_off(jump: float, wrong: bool) -> None:
    """1e-15 of half a gigajoule is 5e-7 J."""
    assert named("stored energy jumps", Declared(jump=jump), Declared(steady=1e9)) == wrong


class Exaggerating(CompliantWithRelativeStates):
    """A damper that calls a little more than its power its loss."""

    beyond: Parameter = parameter("1", "How much more")

    def equations(self) -> Equations:
        yield from self._transmit()
        yield self.tau == self.w_rel

    def loss(self) -> Symbol:
        return self.tau * self.w_rel * (1.0 + self.beyond)


@pytest.mark.parametrize(("share", "wrong"), [(3e-7, False), (1e-5, True)])
def test_a_millionth_of_the_terms_is_round_off(share: float, wrong: bool) -> None:
    """The loss beside the power of the terms, and the jump beside the largest energy, of which sin^2(sqrt(150)/2) = 0.025 is left."""
    for shaft in Exaggerating(beyond=share), Stiffening(later=100.0 * (1.0 + share / 0.025)):
        audit = energy_audit(pt.simulate(Coupled(shaft=shaft), 1.0, rtol=1e-8))
        assert audit.violations["component"].tolist() == ["shaft"] * wrong


@pytest.mark.parametrize(("jump", "count"), [(0.1, 0), (2.0, 1)])
def test_jumps_below_1e_9_of_the_energy_exchanged_are_not_listed(jump: float, count: int) -> None:
    """1e-9 of half a gigajoule is half a joule."""
    parts = Declared(jump=jump), Declared(steady=1e9)
    assert len(energy_audit(pt.simulate(Several(parts=parts), 1.0)).jumps) == count


class Coasting(pt.Component):
    """A wheel of 1 GJ that coasts beside a part whose loss nothing supplies."""

    wheel: rot.Inertia = rot.Inertia(J=2e9)
    part: Declared = Declared(steady=1e-3)

    def equations(self) -> Equations:
        yield from ()

    def initial(self) -> Equations:
        yield self.wheel.w == 1.0


def test_what_is_left_over_counts_beside_what_is_stored() -> None:
    """A millijoule is twice the energy exchanged, but a thousandth of 1e-9 of what is stored."""
    audit = energy_audit(pt.simulate(Coasting(), 1.0))
    assert audit.turnover == pytest.approx(5e-4)
    assert audit.closure == pytest.approx(1e-3)
