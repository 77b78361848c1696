"""Linear models against closed forms, finite differences of simulations, and each other."""

from __future__ import annotations

import pickle
import warnings
from typing import Any

import casadi as ca
import control
import numpy as np
import pytest
from joined import joined
from numpy.typing import NDArray
from scipy.linalg import expm

import powertrain as pt
from powertrain import (
    Equations,
    Input,
    Output,
    Parameter,
    Variable,
    connect,
    parameter,
    signal_input,
    signal_output,
    variable,
)
from powertrain.analysis.linear_model import _dotless
from powertrain.analysis.linearization import linearize
from powertrain.analysis.reduction import Matrices, _independent, substitute_inputs
from powertrain.components import blocks
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.belts import BeltSpan, ChainDrive
from powertrain.components.rotational.interfaces import CompliantWithRelativeStates, TwoFlanges
from powertrain.vehicles import RearDriveCar

FREQUENCIES = np.array([0.3, 2.0, 7.0, 9.0, 40.0])


def response(system: Any, frequencies: NDArray[np.float64] = FREQUENCIES) -> NDArray[np.complex128]:
    """(outputs, inputs, frequencies)."""
    return np.asarray(system(1j * frequencies, squeeze=False))


class Oscillator(pt.Component):
    """Two inertias on a spring and damper; a sine drives the first."""

    J1: rot.Inertia = rot.Inertia(J=2.0)
    J2: rot.Inertia = rot.Inertia(J=3.0)
    shaft: rot.SpringDamper = rot.SpringDamper(c=100.0, d=0.5)
    torque: rot.Torque = rot.Torque()
    sine: blocks.Sine = blocks.Sine(amplitude=1.0, f=2.0)

    def equations(self) -> Equations:
        yield connect(self.sine.y, self.torque.tau)
        yield connect(self.torque.flange, self.J1.flange_a)
        yield connect(self.J1.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.J2.flange_a)


def oscillator_speeds(w: float) -> NDArray[np.complex128]:
    s = 1j * w
    k = 100.0 + 0.5 * s
    return np.asarray(s * np.linalg.solve(np.array([[2 * s**2 + k, -k], [-k, 3 * s**2 + k]]), [1.0, 0.0]), complex)


@pytest.mark.parametrize("drive", ["torque.tau", "sine.y", "J1.flange_a.tau", "shaft.flange_a.tau"])
def test_two_masses_have_their_transfer_function(drive: str) -> None:
    system = linearize(Oscillator(), [drive], ["J1.w", "J2.w", lambda m: m.J1.w - m.J2.w])
    expected = np.array([oscillator_speeds(w) for w in FREQUENCIES]).T
    found = response(system)[:, 0]
    assert np.allclose(found[:2], expected, rtol=1e-9)
    assert np.allclose(found[2], expected[0] - expected[1], rtol=1e-9)
    assert system.linearization.outputs == ("J1.w", "J2.w", "J1.w-J2.w")
    assert list(system.input_labels) == [drive.replace(".", "_")]
    assert system.linearization.units["J1.w"] == "rad/s"
    assert system.linearization.units[drive] in ("N.m", "1")


@pytest.mark.parametrize("drive", ["torque.tau", "sine.y"])
def test_outputs_are_expressions_of_inputs_and_derivatives(drive: str) -> None:
    """A torque contains what is added to it, alone and in expressions; an acceleration is s times its speed."""
    shown: list[Any] = [lambda m: 2 * m.torque.tau.value - m.J1.w, lambda m: pt.der(m.J1.w), "torque.tau"]
    system = linearize(Oscillator(), [drive], shown)
    w1 = np.array([oscillator_speeds(w)[0] for w in FREQUENCIES])
    assert np.allclose(response(system)[:, 0], [2 - w1, 1j * FREQUENCIES * w1, np.ones(len(w1))], rtol=1e-9)


def test_a_model_without_states_is_linear_without_a_warning() -> None:
    """With NumPy 2.5, python-control 0.10.2 warns of what it does with matrices without states."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        system = linearize(blocks.Gain(k=3.0))
    assert np.array_equal(system.D, [[3.0]])
    assert system.nstates == 0


class Fed(pt.Component):
    """A store with an input of the model that reaches it by way of a part."""

    u: Input = signal_input("1", "Input")
    gain: blocks.Gain = blocks.Gain(k=3.0)
    h: Variable = variable("1", "Level", start=1.0)

    def equations(self) -> Equations:
        yield connect(self.u, self.gain.u)
        yield pt.der(self.h) == self.gain.y.value - self.h


@pytest.mark.parametrize(("drive", "seen"), [("u", 1.0), ("gain.u", 0.0)])
def test_what_is_added_to_an_input_is_seen_where_it_is_connected_to(drive: str, seen: float) -> None:
    """der(h) = 3 u - h; a signal that is added at the gain does not reach the input before it."""
    shown: list[Any] = [lambda m: pt.der(m.h), lambda m: m.h + m.gain.u.value, lambda m: 2 * m.u.value]
    system = linearize(Fed(), [drive], shown)
    assert np.allclose(system.C.ravel(), [-1.0, 1.0, 0.0])
    assert np.allclose(system.D.ravel(), [3.0, 1.0, 2 * seen])


def test_linear_models_pickle_and_connect() -> None:
    system = linearize(Oscillator(), ["torque.tau"], ["J1.w"])
    again = pickle.loads(pickle.dumps(system))
    assert again.linearization == system.linearization
    assert again.state_labels == system.state_labels
    assert np.array_equal(again.A, system.A)
    single = response(system)[0, 0]
    # A gain in place of the second would be a system without states, for which python-control 0.10.2 does what NumPy 2.5 deprecates.
    returned: Any = system  # python-control declares a number there
    closed = control.feedback(system, returned)
    assert np.allclose(response(closed)[0, 0], single / (1 + single**2))


class Regulated(pt.Component):
    """A speed under a sampled controller, whose measured value comes first and has no unit."""

    reference: pt.Input = pt.signal_input("1", "Set point")
    controller: blocks.SampledPI = blocks.SampledPI(yMax=10.0, yMin=-10.0)
    torque: rot.Torque = rot.Torque()
    rotor: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> Equations:
        yield connect(self.reference, self.controller.u_s)
        yield self.controller.u_m.value == self.rotor.w
        yield connect(self.controller.y, self.torque.tau)
        yield connect(self.torque.flange, self.rotor.flange_a)


def test_a_measured_speed_keeps_its_name_and_unit() -> None:
    system = linearize(Regulated(), ["reference", "torque.tau"], ["rotor.w"])
    assert system.linearization.units["rotor.w"] == "rad/s"
    assert "rotor.w" in system.linearization.states
    assert "controller.u_m" not in system.linearization.states


def test_a_sampled_controller_is_held() -> None:
    """Between samples its output does not depend on its inputs: the speed is torque/(J s)."""
    system = linearize(Regulated(), ["reference", "torque.tau"], ["rotor.w"])
    assert np.allclose(response(system)[0], [np.zeros(len(FREQUENCIES)), 1 / (2j * FREQUENCIES)])


def test_an_input_shows_in_its_own_signal() -> None:
    system = linearize(Oscillator(), ["torque.tau"], ["torque.tau", "sine.y"])
    assert system.D.ravel().tolist() == [1.0, 0.0]


def test_outputs_that_differ_in_a_late_digit() -> None:
    """The slope of (1000 w - c)^2 is 2000 (1000 w - c), for either c."""
    plant = pt.compile(Oscillator())

    def square(c: float) -> Any:
        return lambda m: (1000 * m.J1.w - c) ** 2

    for c in (1000.001, 1000.004):
        system = linearize(plant, ["torque.tau"], [square(c)], at={"J1.w": 1.0})
        assert np.abs(system.C).max() == pytest.approx(2000 * (c - 1000), rel=1e-9)


def test_parameters_are_inputs_of_constants() -> None:
    plant = pt.compile(Oscillator())
    system = linearize(
        plant,
        ["shaft.c", "torque.tau"],
        ["shaft.tau"],
        at={"J1.phi": 0.0, "shaft.phi_rel": 0.2, "J1.w": 3.0, "J2.w": 1.0},
    )
    assert system.D[0] == pytest.approx([0.2, 0.0])
    places = [system.linearization.states.index(n) for n in ("J1.w", "J2.w")]
    assert system.B[places, 0] == pytest.approx([0.2 / 2, -0.2 / 3])
    assert system.linearization.values["J1.w"] == 3.0


class Fan(pt.Component):
    """An input torque drives a fan through a soft shaft."""

    tau: Input = signal_input("N.m", "Torque of the motor")
    speed: Output = signal_output("rad/s", "Speed of the fan")
    torque: rot.Torque = rot.Torque()
    motor: rot.Inertia = rot.Inertia(J=0.5)
    shaft: rot.SpringDamper = rot.SpringDamper(c=80.0, d=0.7)
    fan: rot.Inertia = rot.Inertia(J=1.5)
    air: rot.QuadraticSpeedDependentTorque = rot.QuadraticSpeedDependentTorque(
        tau_nominal=-4.0, w_nominal=10.0, TorqueDirection=False
    )
    sensor: rot.SpeedSensor = rot.SpeedSensor()

    def equations(self) -> Equations:
        yield connect(self.tau, self.torque.tau)
        yield connect(self.torque.flange, self.motor.flange_a)
        yield connect(self.motor.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.fan.flange_a)
        yield connect(self.fan.flange_b, self.air.flange, self.sensor.flange)
        yield connect(self.sensor.w, self.speed)


STEADY = {"tau": 9.0, "motor.w": 15.0, "fan.w": 15.0, "shaft.phi_rel": -9.0 / 80.0}


def test_linear_model_predicts_differences_of_simulations() -> None:
    plant = pt.compile(Fan())
    system = linearize(plant, at=STEADY)
    assert system.linearization.inputs == ("tau",)
    assert system.linearization.outputs == ("speed",)
    starts = {n: v for n, v in STEADY.items() if n != "tau"}

    def simulated(change: float, input_change: float) -> float:
        result = plant.simulate(
            0.2, starts=starts | {"motor.w": 15.0 + change}, inputs={"tau": 9.0 + input_change}, rtol=1e-11, atol=1e-12
        )
        return float(result["speed"][-1])

    eps, n = 1e-3, len(system.A)
    block = expm(0.2 * np.block([[system.A, system.B], [np.zeros((1, n + 1))]]))
    x0 = np.eye(n)[system.linearization.states.index("motor.w")]
    by_state = (simulated(eps, 0.0) - simulated(-eps, 0.0)) / (2 * eps)
    by_input = (simulated(0.0, eps) - simulated(0.0, -eps)) / (2 * eps)
    assert by_state == pytest.approx((system.C @ block[:n, :n] @ x0).item(), rel=1e-6)
    assert by_input == pytest.approx((system.C @ block[:n, n]).item(), rel=1e-6)


def test_same_point_of_a_result() -> None:
    plant = pt.compile(Fan())
    result = plant.simulate(1.0, inputs={"tau": 5.0}, rtol=1e-9, parameters={"fan.J": 2.0})
    at_time = linearize(plant, at=(result, 0.6))
    values = {n: result.at(0.6, n) for n in ("motor.w", "fan.w", "motor.phi", "fan.phi")}
    by_hand = linearize(plant, at={"tau": 5.0, "time": 0.6, **values}, parameters={"fan.J": 2.0})
    for a, b in zip((at_time.A, at_time.B, at_time.C), (by_hand.A, by_hand.B, by_hand.C), strict=True):
        assert np.allclose(a, b, rtol=1e-7)
    place = at_time.linearization.states.index("speed")
    slope = at_time.A[place, place]
    assert slope == pytest.approx(-(0.7 + 2 * 4.0 / 100 * values["fan.w"]) / 2.0)


class Clutches(pt.Component):
    """Three clutches between four inertias, as CoupledClutches."""

    sine: blocks.Sine = blocks.Sine(amplitude=10.0, f=5.0)
    torque: rot.Torque = rot.Torque()
    J: tuple[rot.Inertia, ...] = tuple(rot.Inertia(J=1.0 + i) for i in range(4))
    clutch: tuple[rot.Clutch, ...] = tuple(rot.Clutch(peak=1.1, fn_max=20.0) for _ in range(3))
    press: tuple[blocks.Step, ...] = (
        blocks.Step(startTime=0.0),
        blocks.Step(startTime=0.4),
        blocks.Step(startTime=0.9),
    )

    def equations(self) -> Equations:
        yield connect(self.sine.y, self.torque.tau)
        yield connect(self.torque.flange, self.J[0].flange_a)
        for i in range(3):
            yield connect(self.J[i].flange_b, self.clutch[i].flange_a)
            yield connect(self.clutch[i].flange_b, self.J[i + 1].flange_a)
            yield connect(self.press[i].y, self.clutch[i].f_normalized)

    def initial(self) -> Equations:
        yield self.J[0].w == 10.0


def test_stuck_clutches_take_states_away() -> None:
    plant = pt.compile(Clutches())
    result = plant.simulate(4.0)
    stuck_counts = set()
    for t in (0.1, 0.39, 0.7, 0.89, 1.1, 2.0, 3.0, 4.0):
        stuck = [result.at(t, f"clutch[{i}].mode") == 0 for i in range(3)]
        system = linearize(plant, ["torque.tau", "clutch[1].f_normalized"], ["J[0].w", "J[3].w"], at=(result, t))
        note = system.linearization
        assert len(system.A) == 8 - 2 * sum(stuck)
        assert set(note.states) | set(note.removed) == set(plant.compiled.states)
        for i in range(3):
            assert (f"clutch[{i}].w_rel" in note.removed) == stuck[i]
            assert (f"clutch[{i}].phi_rel" in note.removed) == stuck[i]
        joined = 1 + next((i for i, s in enumerate(stuck) if not s), 3)
        mass = sum(1.0 + i for i in range(joined))
        assert response(system)[0, 0] == pytest.approx(1 / (1j * FREQUENCIES * mass))
        if all(stuck):
            assert response(system)[1, 0] == pytest.approx(1 / (1j * FREQUENCIES * mass))
        else:
            assert np.abs(response(system)[1, 0]).max() < 1e-12
        if stuck[0] and not stuck[1] and result.at(t, "clutch[1].mode") != 2:
            assert np.abs(response(system)[0, 1]).min() > 1e-3
        stuck_counts.add(sum(stuck))
    assert {0, 3} <= stuck_counts or {1, 3} <= stuck_counts


class Driven(pt.Component):
    """A motion source, a rigid inertia, a spring and damper, a second inertia."""

    source: rot.Speed | rot.Position | rot.Accelerate
    first: rot.Inertia = rot.Inertia(J=0.3)
    shaft: rot.SpringDamper = rot.SpringDamper(c=50.0, d=2.0)
    second: rot.Inertia = rot.Inertia(J=0.8)

    def equations(self) -> Equations:
        yield connect(self.source.flange, self.first.flange_a)
        yield connect(self.first.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.second.flange_a)
        signal = {rot.Speed: "w_ref", rot.Position: "phi_ref", rot.Accelerate: "a_ref"}[type(self.source)]
        yield getattr(self.source, signal).value == 0.1 * ca.sin(pt.time)


CASES = [
    (rot.Position(exact=True), "source.phi_ref", 0),
    (rot.Speed(exact=True), "source.w_ref", 1),
    (rot.Accelerate(), "source.a_ref", 2),
]


@pytest.mark.parametrize(("source", "signal", "order"), CASES, ids=[c[1] for c in CASES])
def test_motion_sources_drive_inertias(source: pt.Component, signal: str, order: int) -> None:
    system = linearize(Driven(source=source), [signal], ["second.phi", "shaft.phi_rel"])  # type: ignore[arg-type]
    s = 1j * FREQUENCIES
    expected = (2.0 * s + 50.0) / (0.8 * s**2 + 2.0 * s + 50.0) / s**order
    found = response(system)[:, 0]
    assert np.allclose(found[0], expected, rtol=1e-9)
    assert np.allclose(found[1], expected - 1 / s**order, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("source", "signal", "order"), CASES[:2], ids=[c[1] for c in CASES[:2]])
def test_an_output_that_needs_derivatives_of_an_input_is_refused(source: pt.Component, signal: str, order: int) -> None:
    said = "derivative" if order else "second derivative"
    with pytest.raises(pt.ModelError, match=rf"source\.flange\.tau depends on the {said} of the input {signal}"):
        linearize(Driven(source=source), [signal], ["source.flange.tau"])  # type: ignore[arg-type]
    system = linearize(Driven(source=rot.Accelerate()), ["source.a_ref"], ["source.flange.tau"])
    s = 1j * FREQUENCIES
    through = (2.0 * s + 50.0) * 0.8 / (0.8 * s**2 + 2.0 * s + 50.0)
    assert response(system)[0, 0] == pytest.approx(-0.3 - through)


def test_shifted_states_are_named() -> None:
    note = linearize(Driven(source=rot.Position(exact=True)), ["source.phi_ref"], ["second.phi"]).linearization
    assert note.shifted
    assert all(set(gains) == {"source.phi_ref"} for gains in note.shifted.values())


class Held(pt.Component):
    """A speed source, a brake-like clutch that is stuck, and an inertia."""

    source: rot.Speed = rot.Speed(exact=True)
    clutch: rot.Clutch = rot.Clutch(fn_max=100.0)
    load: rot.Inertia = rot.Inertia(J=1.0)
    soft: rot.SpringDamper = rot.SpringDamper(c=10.0, d=1.0)
    end: rot.Inertia = rot.Inertia(J=2.0)

    def equations(self) -> Equations:
        yield self.source.w_ref.value == 1.0
        yield self.clutch.f_normalized.value == 1.0
        yield connect(self.source.flange, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.load.flange_a)
        yield connect(self.load.flange_b, self.soft.flange_a)
        yield connect(self.soft.flange_b, self.end.flange_a)


def test_stuck_on_a_driven_shaft() -> None:
    shown = ["load.w", "end.w", "load.phi"]
    system = linearize(Held(), ["source.w_ref"], shown, at={"load.w": 1.0, "end.w": 1.0})
    s = 1j * FREQUENCIES
    assert system.linearization.modes["clutch.mode"] == 0
    assert np.allclose(response(system)[0, 0], 1.0)
    assert np.allclose(response(system)[1, 0], (s + 10.0) / (2 * s**2 + s + 10.0))
    assert np.allclose(response(system)[2, 0], 1 / s)


class Cubic(CompliantWithRelativeStates):
    """phi_rel = tau + tau^3: the torque is an implicit unknown."""

    def equations(self) -> Equations:
        yield from self._transmit()
        yield self.phi_rel == self.tau + self.tau**3 + ca.sinh(self.tau)


class Implicit(pt.Component):
    fixed: rot.Fixed = rot.Fixed()
    spring: Cubic = Cubic()
    J: rot.Inertia = rot.Inertia(J=0.5)

    def equations(self) -> Equations:
        yield connect(self.fixed.flange, self.spring.flange_a)
        yield connect(self.spring.flange_b, self.J.flange_a)


def test_implicit_unknowns_are_eliminated() -> None:
    plant = pt.compile(Implicit())
    assert plant.compiled.dae.z.numel() == 1
    phi = 0.7 + 0.7**3 + np.sinh(0.7)
    system = linearize(plant, ["J.flange_b.tau"], ["J.phi", "spring.tau"], at={"J.phi": phi})
    c = 1 / (1 + 3 * 0.49 + np.cosh(0.7))
    expected = 1 / (0.5 * (1j * FREQUENCIES) ** 2 + c)
    assert np.allclose(response(system)[0, 0], expected)
    assert np.allclose(response(system)[1, 0], c * expected)


class Stop(TwoFlanges):
    """A one-sided rigid stop between two shafts."""

    gap: Variable = variable("rad", "Play", start=0.1, prefer=True)
    force: Variable = variable("N.m", "Contact torque")

    def equations(self) -> Equations:
        yield self.gap == self.flange_b.phi - self.flange_a.phi
        yield self.flange_b.tau == -self.force
        yield self.flange_a.tau == self.force
        yield pt.unilateral(self.gap, self.force)


class Stopped(pt.Component):
    tau: Input = signal_input("N.m", "Torque on the first inertia")
    torque: rot.Torque = rot.Torque()
    a: rot.Inertia = rot.Inertia(J=1.0)
    stop: Stop = Stop()
    b: rot.Inertia = rot.Inertia(J=3.0)

    def equations(self) -> Equations:
        yield connect(self.tau, self.torque.tau)
        yield connect(self.torque.flange, self.a.flange_a)
        yield connect(self.a.flange_b, self.stop.flange_a)
        yield connect(self.stop.flange_b, self.b.flange_a)


def test_closed_contacts_take_states_away() -> None:
    plant = pt.compile(Stopped())
    result = plant.simulate(2.0, inputs={"tau": 1.0})
    before, after = (linearize(plant, outputs=["a.w", "b.w"], at=(result, t)) for t in (0.1, 1.5))
    assert (len(before.A), len(after.A)) == (4, 2)
    assert np.allclose(response(before)[:, 0], [1 / (1j * FREQUENCIES), 0 * FREQUENCIES])
    assert np.allclose(response(after)[:, 0], 1 / (4j * FREQUENCIES))


class Follower(pt.Component):
    """A part with an input of its own that it hands on."""

    u: Input = signal_input("N.m", "Torque")
    flange: rot.Flange = pt.port(rot.Flange)
    gain: blocks.Gain = blocks.Gain(k=3.0)
    torque: rot.Torque = rot.Torque()

    def equations(self) -> Equations:
        yield connect(self.u, self.gain.u)
        yield connect(self.gain.y, self.torque.tau)
        yield connect(self.torque.flange, self.flange)


class Whole(pt.Component):
    part: Follower = Follower()
    other: rot.Torque = rot.Torque()
    source: blocks.Constant = blocks.Constant(k=1.0)
    J: rot.Inertia = rot.Inertia(J=2.0)
    J2: rot.Inertia = rot.Inertia(J=5.0)

    def equations(self) -> Equations:
        yield connect(self.source.y, self.part.u, self.other.tau)
        yield connect(self.part.flange, self.J.flange_a)
        yield connect(self.other.flange, self.J2.flange_a)


def test_an_input_inside_is_perturbed_alone() -> None:
    inputs = ["part.u", "part.gain.u", "part.gain.y", "part.torque.tau", "source.y", "other.tau", "part.flange.tau"]
    system = linearize(Whole(), inputs, ["J.w", "J2.w"])
    gains = np.real(response(system) * 1j * FREQUENCIES)[:, :, 0]
    assert gains[0] == pytest.approx(np.array([3, 3, 1, 1, 3, 0, 1]) / 2)
    assert gains[1] == pytest.approx(np.array([0, 0, 0, 0, 1, 1, 0]) / 5)


def test_refusals_name_what_is_known() -> None:
    plant = pt.compile(Oscillator())
    with pytest.raises(pt.ParameterError, match=r"no inputs; name what drives"):
        linearize(plant)
    with pytest.raises(pt.ParameterError, match=r"inputs is empty; name what drives"):
        linearize(plant, [])
    with pytest.raises(pt.ParameterError, match=r"torque\.tua; did you mean torque\.tau"):
        linearize(plant, ["torque.tua"])
    with pytest.raises(pt.ParameterError, match=r"J1\.ww; did you mean J1\.w"):
        linearize(plant, ["torque.tau"], ["J1.ww"])
    with pytest.raises(pt.ParameterError, match="appears twice"):
        linearize(plant, ["torque.tau", "torque.tau"])
    result = plant.simulate(0.1)
    with pytest.raises(pt.ParameterError, match="outside the simulated span"):
        linearize(plant, ["torque.tau"], at=(result, 0.2))
    with pytest.raises(pt.ParameterError, match="another model"):
        linearize(pt.compile(Fan()), at=(result, 0.1))


class Root(TwoFlanges):
    """A torque whose slope is infinite at rest."""

    k: Parameter = parameter("N.m", "Size", default=1.0)

    def equations(self) -> Equations:
        phi = self.flange_b.phi - self.flange_a.phi
        yield self.flange_b.tau == self.k * ca.sqrt(phi)
        yield self.flange_a.tau + self.flange_b.tau == 0


class Steep(pt.Component):
    fixed: rot.Fixed = rot.Fixed()
    root: Root = Root()
    J: rot.Inertia = rot.Inertia(J=1.0)

    def equations(self) -> Equations:
        yield connect(self.fixed.flange, self.root.flange_a)
        yield connect(self.root.flange_b, self.J.flange_a)


def test_infinite_derivatives_are_refused() -> None:
    with pytest.raises(pt.ModelError, match=r"derivatives of der\(J\.w\) are not finite"):
        linearize(Steep(), ["J.flange_b.tau"])


class Tow(pt.Component):
    """Motor, gear, soft shaft, load; free to turn; the integral of the power beside it."""

    torque: rot.Torque = rot.Torque()
    command: Input = signal_input("N.m", "Torque")
    motor: rot.Inertia = rot.Inertia(J=0.1)
    gear: rot.IdealGear = rot.IdealGear(ratio=4.0)
    shaft: rot.SpringDamper = rot.SpringDamper(c=300.0, d=1.0)
    load: rot.Inertia = rot.Inertia(J=5.0)
    work: Variable = variable("J", "Work", start=0.0)

    def equations(self) -> Equations:
        yield connect(self.command, self.torque.tau)
        yield connect(self.torque.flange, self.motor.flange_a)
        yield connect(self.motor.flange_b, self.gear.flange_a)
        yield connect(self.gear.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.load.flange_a)
        yield pt.der(self.work) == self.torque.flange.tau * self.motor.w + 1.0


def test_rigid_motions_that_no_output_sees_are_reduced() -> None:
    """The transfer function stays, the angle and the work go; what remains of two angles is the twist."""
    plant, outputs, at = pt.compile(Tow()), ["load.w", "shaft.tau"], {"load.w": 2.0, "motor.w": 8.0}
    whole = linearize(plant, ["command"], outputs, at=at)
    small = linearize(plant, ["command"], outputs, at=at, reduced=True)
    note = small.linearization
    assert (len(whole.A), len(small.A)) == (5, 3)
    assert len(note.unseen) == 2
    assert "work" in note.unseen
    np.testing.assert_allclose(response(small), response(whole), rtol=1e-9)
    assert np.abs(np.linalg.eigvals(small.A)).min() < 1e-9  # the speed, which the output shows, stays
    (angle,) = (name for name in note.unseen if name != "work")
    ((other, gains),) = note.relative.items()
    assert gains == {angle: pytest.approx(1.0)}
    assert f"{other}-{angle}" in note.states
    hidden = linearize(plant, ["command"], ["shaft.tau"], at=at, reduced=True)
    assert len(hidden.A) == 2
    assert np.abs(np.linalg.eigvals(hidden.A)).min() > 1.0
    np.testing.assert_allclose(response(hidden)[0], response(whole)[1], rtol=1e-9)
    shown = linearize(plant, ["command"], ["load.phi"], at=at, reduced=True)
    assert "work" in shown.linearization.unseen
    assert len(shown.A) == 4
    np.testing.assert_allclose(response(shown), response(linearize(plant, ["command"], ["load.phi"], at=at)), rtol=1e-9)


def test_a_regulator_of_a_reduced_model_stabilises_the_simulation() -> None:
    """lqr needs the reduced model; its cost is that of the closed-loop response, x' S x for the start."""
    outputs = ["load.w", "shaft.tau"]
    model = linearize(Tow(), ["command"], outputs, reduced=True)
    weight = model.C.T @ np.diag([10.0, 1e-3]) @ model.C
    gain, cost, _ = control.lqr(model, weight, [[1e-2]])
    closed = model.A - model.B @ gain
    assert np.real(np.linalg.eigvals(closed)).max() < -0.1
    start = np.linalg.lstsq(model.C, [1.0, 0.0], rcond=None)[0]
    times = np.linspace(0.0, 30.0, 30001)
    step, state, total = expm(closed * times[1]), start, []
    for _ in times:
        total.append(state @ (weight + gain.T @ (1e-2 * gain)) @ state)
        state = step @ state
    assert np.trapezoid(total, times) == pytest.approx(start @ cost @ start, rel=1e-4)


def between(part: pt.Component, **starts: float) -> Any:
    """The eigenvalues of two inertias of 1 and 2 kg.m2, or masses of 1 and 2 kg, with a part between them."""
    shafts = "flange_a" in part._fields and issubclass(part._fields["flange_a"].kind, rot.Flange)
    ends: Any = [rot.Inertia(J=J) for J in (1.0, 2.0)] if shafts else [tr.Mass(m=m) for m in (1.0, 2.0)]
    model = joined(ends[0], part, ends[1], joints="0.flange_b=1.flange_a 1.flange_b=2.flange_a")
    at = {f"parts[0].{name}": value for name, value in starts.items()}
    drive = f"parts[0].flange_a.{'tau' if shafts else 'f'}"
    return np.linalg.eigvals(linearize(model, [drive], [f"parts[0].{'w' if shafts else 'v'}"], at=at).A)


@pytest.mark.parametrize(
    "part",
    [
        rot.ElastoBacklash(c=1000.0, d=10.0, b=0.1),
        rot.ElastoBacklash2(c=1000.0, d=10.0, b=0.1),
        tr.ElastoGap(c=1000.0, d=10.0, s_rel0=-0.05),
        BeltSpan(T_0=0.0),
    ],
)
def test_parts_that_do_not_touch_are_free_also_at_rest(part: pt.Component) -> None:
    assert np.abs(between(part, **({"flange_b.s": 0.1} if isinstance(part, BeltSpan) else {}))).max() < 1e-12


def test_without_play_it_is_a_spring_and_damper_also_at_rest() -> None:
    reduced, c, d = 2.0 / 3.0, 1000.0, 10.0
    exact = [0.0, 0.0, *np.roots([reduced, d, c])]
    for part in (rot.ElastoBacklash(c=c, d=d), rot.ElastoBacklash2(c=c, d=d), rot.SpringDamper(c=c, d=d)):
        np.testing.assert_allclose(np.sort_complex(between(part)), np.sort_complex(exact), atol=1e-5)


def test_the_slack_strand_of_a_chain_at_rest_does_not_damp() -> None:
    (a, b), c, d = (z * 9.525e-3 / (2 * np.pi) for z in (20, 40)), 1e6, 200.0
    across = a**2 / 1.0 + b**2 / 2.0  # of the stretch x = a phi_a - b phi_b per unit of the strand's force
    exact = [0.0, 0.0, *np.roots([1.0, d * across, c * across])]
    found = between(ChainDrive(T_0=0.0, c=c, d=d, polygon=False), phi=1e-3)
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(exact), atol=1e-5)


@pytest.mark.parametrize("at", [{}, {"parts[0].w": 10.0, "parts[3].w": 5.0}])
@pytest.mark.parametrize(("bearing", "locked"), [(0.0, False), (0.1, True)])
def test_an_unloaded_gear_at_rest_is_not_locked(at: dict[str, float], bearing: float, locked: bool) -> None:
    """1 kg.m2, a gear i = 2 with efficiency 0.9, a spring of 100 N.m/rad, 2 kg.m2: w^2 = c (1/J_2 + eta/(i^2 J_1)).

    Bearing friction, which needs no load, locks it at rest: w^2 = c/J_2.
    """
    gear = rot.LossyGear(ratio=2.0, lossTable=((0.0, 0.9, 0.9, bearing, bearing),))
    model = joined(
        rot.Inertia(J=1.0), gear, rot.SpringDamper(c=100.0, d=0.0), rot.Inertia(J=2.0),
        joints="0.flange_b=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a",
    )  # fmt: skip
    found = np.abs(linearize(model, ["parts[0].flange_a.tau"], ["parts[0].w"], at=at).poles()).max()
    if locked and not at:
        assert found == pytest.approx(np.sqrt(50.0), rel=1e-9)
    else:
        assert np.abs(found - np.sqrt(100.0 * (0.5 + np.array([0.9, 1 / 0.9]) / 4.0))).min() < 1e-6
    frequency = float(pt.eigenmodes(model, at=at)["frequency"].max())
    assert 2 * np.pi * frequency == pytest.approx(found, rel=1e-6)


@pytest.mark.parametrize("w", [5.0, -5.0])
@pytest.mark.parametrize("tau", [0.0, 1e-3, -1e-3])
def test_an_unloaded_gear_has_no_derivative(w: float, tau: float) -> None:
    """1 kg.m2 on either side of i = 2, eta = 0.9: der(w_b) = tau/(2 + 0.5/eta) if the torque drives, with eta for 1/eta if it brakes.

    At no torque the model is one of the two, and says of which law.
    """
    model = joined(
        rot.ConstantTorque(tau_constant=tau), rot.Inertia(J=1.0), rot.Gear(ratio=2.0, efficiency=0.9), rot.Inertia(J=1.0),
        joints="0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a",
    )  # fmt: skip
    found = linearize(model, ["parts[1].flange_a.tau"], ["parts[3].w"], at={"parts[1].w": w})
    gain = float(np.real(found(1e-3j) * 1e-3j))
    driven, braked = 1.0 / (2.0 + 0.5 / 0.9), 1.0 / (2.0 + 0.5 * 0.9)
    if tau:
        assert gain == pytest.approx(driven if w * tau > 0.0 else braked, rel=1e-9)
        assert found.linearization.one_sided == ()
    else:
        assert min(abs(gain - driven), abs(gain - braked)) < 1e-9
        assert found.linearization.one_sided == (f"parts[2].switch{0 if w > 0.0 else 1}",)


def test_eigenmodes_of_an_unloaded_gear_say_so() -> None:
    model = joined(
        rot.Inertia(J=1.0), rot.Gear(ratio=2.0, efficiency=0.9), rot.SpringDamper(c=100.0, d=0.0), rot.Inertia(J=2.0),
        joints="0.flange_b=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a",
    )  # fmt: skip
    plant, turning = pt.compile(model), {"parts[0].w": 10.0, "parts[3].w": 5.0}
    assert "parts[1].switch0" in pt.eigenmodes(plant, at=turning).notes
    assert pt.eigenmodes(plant, at={**turning, "parts[2].phi_rel": 0.01}).notes == ""


@pytest.mark.slow
def test_the_axle_of_a_standing_car_is_not_locked() -> None:
    """Its shafts carry round-off; a twist of one accelerates the cage between the held wheels, as in a run from that twist."""
    plant, twist, h = pt.compile(RearDriveCar()), "rear.right_shaft.phi_rel", 1e-4
    run = plant.simulate(1.0)
    states = list(plant.compiled.states)
    linear = linearize(plant, ["cycle.v_ref"], states, at=(run, 1.0))
    known = {name: run[name][-1] for name in [*states, *(n for n in plant.compiled.discretes if n in run)]}
    k = linear.linearization.states.index(twist)
    change = dict(zip(states, linear.C[:, k], strict=True))
    ends = [
        plant.simulate(1.0 + h, start=1.0, starts=known | {n: known[n] + e * change[n] for n in states}, rtol=1e-11)
        for e in (0.0, 1e-6)
    ]
    moved = (ends[1][twist][-1] - ends[0][twist][-1]) / 1e-6 - 1.0
    assert moved == pytest.approx(expm(linear.A * h)[k, k] - 1.0, rel=1e-2)
    assert moved < -1e-2


@pytest.mark.parametrize("order", [1, 2, 3])
def test_inputs_without_their_derivatives_have_the_same_response(order: int) -> None:
    """Transfer functions of outputs and of relative motions at any s: (s - a)^-1 sum_k b_k s^k is sum_k g_k s^k and a proper rest, and d
    is such that the outputs do without the g_k of derivatives."""
    rng = np.random.default_rng(order)
    n, inputs = 5, 2
    a, c, w = (rng.normal(size=(rows, n)) for rows in (n, 3, 2))
    b, v = ([rng.normal(size=(rows, inputs)) for _ in range(order)] for rows in (n, 2))
    none = np.zeros((n, inputs))
    g = [sum((np.linalg.matrix_power(a, j - k - 1) @ b[j] for j in range(k + 1, order)), none) for k in range(order)]
    d = [rng.normal(size=(3, inputs)), *(-c @ each for each in g[1:])]
    full = Matrices(a, b, c, d, w, v)
    proper, gains = substitute_inputs(full, lambda *place: AssertionError(place))
    np.testing.assert_allclose(gains, g[0], atol=1e-12)
    assert len(proper.b) == len(proper.d) == 1
    for s in (0.3 + 1.7j, -2.1, 4j):

        def responses(m: Matrices, s: complex = s) -> list[Any]:
            x = np.linalg.solve(s * np.eye(n) - m.a, sum(each * s**k for k, each in enumerate(m.b)))
            powers = [sum(each * s**k for k, each in enumerate(direct)) for direct in (m.d, m.v)]
            return [m.c @ x + powers[0], m.w @ x + powers[1]]

        for found, expected in zip(responses(proper), responses(full), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10)


class Cam(pt.Component):
    """A follower of 0.5 kg on a spring of 400 N/m is lifted by a cam: x = phi^2/2 m while they touch."""

    flange: rot.Flange = pt.port(rot.Flange)
    x: Variable = variable("m", "Lift", start=0.08)
    v: Variable = variable("m/s", "Speed of the follower")
    force: Variable = variable("N", "Force between them")

    def equations(self) -> Equations:
        yield self.flange.tau == self.force * self.flange.phi
        yield self.v == pt.der(self.x)
        yield 0.5 * pt.der(self.v) == self.force - 400.0 * self.x
        yield pt.unilateral(self.x - self.flange.phi**2 / 2, self.force)


def test_a_contact_on_a_curve_takes_position_and_speed_away() -> None:
    """(J + m phi^2) phi'' = tau - k phi^3/2 around rest: the force k phi^2/2 turns with the slope phi, hence 3 k phi^2/2."""
    phi = 0.4
    model = joined(
        rot.ConstantTorque(tau_constant=400.0 * phi**3 / 2), rot.Inertia(J=0.02), Cam(),
        joints="0.flange=1.flange_a 1.flange_b=2.flange",
    )  # fmt: skip
    at = {"parts[1].phi": phi, "parts[2].x": phi**2 / 2}
    system = linearize(model, ["parts[1].flange_a.tau"], ["parts[1].phi", "parts[2].x"], at=at)
    assert len(system.A) == 2
    note = system.linearization
    assert set(note.values) == {*note.states, *note.removed}
    assert sorted(value for value in note.values.values() if value) == pytest.approx(sorted(at.values()))
    assert [note.units[name] for name in (*note.outputs, *note.inputs)] == ["rad", "m", "N.m"]
    expected = 1 / ((0.02 + 0.5 * phi**2) * (1j * FREQUENCIES) ** 2 + 600.0 * phi**2)
    np.testing.assert_allclose(response(system)[:, 0], [expected, phi * expected], rtol=1e-9)


class Bent(pt.Component):
    """der(h) = u - z with z^3 exp(z) = h: at h = 0 the slope of z is infinite, and 1e24 where Newton ends."""

    u: Input = signal_input("1", "Inflow")
    h: Variable = variable("1", "Level", start=0.0)
    z: Variable = variable("1", "Outflow", guess=0.0)

    def equations(self) -> Equations:
        yield pt.der(self.h) == self.u.value - self.z
        yield self.z**3 * ca.exp(self.z) == self.h


def test_singular_algebraic_equations_are_refused() -> None:
    with pytest.raises(pt.ModelError, match="algebraic equations of Bent are singular at this operating point"):
        linearize(Bent(), ["u"], ["h"])


class DrivenSun(pt.Component):
    """The sun of a free planetary gear follows a given angle; the carrier turns another inertia through a spring."""

    source: rot.Position = rot.Position(exact=True)
    gear: rot.IdealPlanetary = rot.IdealPlanetary(ratio=2.5)
    ring: rot.Inertia = rot.Inertia(J=0.3)
    carrier: rot.Inertia = rot.Inertia(J=0.5)
    spring: rot.Spring = rot.Spring(c=40.0)
    far: rot.Inertia = rot.Inertia(J=0.8)

    def equations(self) -> Equations:
        yield self.source.phi_ref.value == 0.1 * ca.sin(pt.time)
        yield connect(self.source.flange, self.gear.sun)
        yield connect(self.gear.ring, self.ring.flange_a)
        yield connect(self.gear.carrier, self.carrier.flange_a)
        yield connect(self.carrier.flange_b, self.spring.flange_a)
        yield connect(self.spring.flange_b, self.far.flange_a)


def driven_sun(s: complex) -> NDArray[np.complex128]:
    """Angles of ring, carrier and far inertia over that of the sun; the last unknown is the torque of the sun, T, in T : 2.5 T : -3.5 T."""
    rows = [[-2.5, 3.5, 0, 0], [0.3 * s**2, 0, 0, 2.5], [0, 0.5 * s**2 + 40, -40, -3.5], [0, -40, 0.8 * s**2 + 40, 0]]
    return np.asarray(np.linalg.solve(np.array(rows, complex), [1.0, 0.0, 0.0, 0.0]), complex)


@pytest.mark.parametrize("reduced", [False, True])
def test_second_derivatives_of_an_input_shift_states(reduced: bool) -> None:
    """The gear needs the acceleration of the sun. A state relative to others is shifted by the difference of what they are shifted by."""
    ring, carrier, far, _ = np.array([driven_sun(1j * w) for w in FREQUENCIES]).T
    plant, drive = pt.compile(DrivenSun()), "source.phi_ref"
    angles = linearize(plant, [drive], ["ring.phi", "carrier.phi", "far.phi"], reduced=reduced)
    np.testing.assert_allclose(response(angles)[:, 0], [ring, carrier, far], rtol=1e-9)
    twist = linearize(plant, [drive], ["spring.tau"], reduced=reduced)
    np.testing.assert_allclose(response(twist)[0, 0], 40 * (far - carrier), rtol=1e-9)
    note = twist.linearization
    assert bool(note.unseen) is reduced
    whole = {name: gains[drive] for name, gains in angles.linearization.shifted.items()}
    for label, name in zip(note.states, (n for n in note.values if n not in note.unseen), strict=True):
        away = sum(gain * whole.get(other, 0.0) for other, gain in note.relative.get(name, {}).items())
        assert note.shifted.get(label, {}).get(drive, 0.0) == pytest.approx(whole.get(name, 0.0) - away)


class Dry(TwoFlanges):
    """Dry friction between two shafts, without states of its own."""

    w: Variable = variable("rad/s", "Slip")

    def equations(self) -> Equations:
        yield self.w == pt.der(self.flange_b.phi) - pt.der(self.flange_a.phi)
        yield self.flange_a.tau + self.flange_b.tau == 0
        yield pt.friction(self.w, self.flange_b.tau, -50.0, 50.0)


def test_what_a_driven_shaft_holds_moves_with_it() -> None:
    """The slip stays zero, and so does the difference of the angles, not the angle itself: phi = w/s."""
    model = joined(
        blocks.Constant(k=1.0), rot.Speed(exact=True), Dry(), rot.Inertia(J=1.0),
        joints="0.y=1.w_ref 1.flange=2.flange_a 2.flange_b=3.flange_a",
    )  # fmt: skip
    system = linearize(model, ["parts[1].w_ref"], ["parts[3].w", "parts[3].phi"], at={"parts[3].w": 1.0})
    np.testing.assert_allclose(response(system)[:, 0], [np.ones(5), 1 / (1j * FREQUENCIES)], rtol=1e-9)


def test_names_stay_distinct_without_dots() -> None:
    assert _dotless(["J.w", "J_w", "J_w_2", "J.w.2"]) == ["J_w", "J_w_2", "J_w_2_2", "J_w_2_3"]


class Ratchet(TwoFlanges):
    """It holds any torque in one direction."""

    def equations(self) -> Equations:
        yield self.flange_a.tau + self.flange_b.tau == 0
        w = pt.der(self.flange_b.phi) - pt.der(self.flange_a.phi)
        yield pt.friction(w, self.flange_b.tau, 0.0, np.inf)


def test_a_law_without_a_limit_leaves_the_limits_of_others() -> None:
    """A ratchet and a brake hold one rotor each."""
    model = joined(
        rot.Fixed(), Ratchet(), rot.Inertia(J=1.0), rot.ConstantTorque(tau_constant=2.0),
        rot.BearingFriction(tau_pos=((0.0, 5.0),)), rot.Inertia(J=2.0), rot.ConstantTorque(tau_constant=1.0),
        joints="0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange 4.flange_b=5.flange_a 5.flange_b=6.flange",
    )  # fmt: skip
    for sign in (1.0, -1.0):
        found = linearize(model, ["parts[5].flange_a.tau"], ["parts[5].w"], parameters={"parts[3].tau_constant": sign})
        assert found.linearization.modes["parts[4].mode"] == 0
        assert found.nstates == (0 if sign > 0 else 2)


@pytest.mark.parametrize(("tau", "at_limit"), [(99.9, False), (100.0, True), (-100.0, True)])
def test_a_brake_about_to_slip_has_no_derivative(tau: float, at_limit: bool) -> None:
    """It holds up to 100 N.m; with the least more the rotor turns."""
    model = joined(
        rot.ConstantTorque(tau_constant=tau), rot.Inertia(J=1.0), rot.BearingFriction(tau_pos=((0.0, 100.0),)),
        joints="0.flange=1.flange_a 1.flange_b=2.flange_a",
    )  # fmt: skip
    found = linearize(model, ["parts[1].flange_a.tau"], ["parts[1].w"])
    assert found.nstates == 0
    assert found.linearization.one_sided == (("parts[2].mode",) if at_limit else ())


@pytest.mark.parametrize(("tau", "pressed"), [(1.0, True), (0.0, False)])
def test_a_contact_without_force_has_no_derivative(tau: float, pressed: bool) -> None:
    found = linearize(Stopped(), ["tau"], ["a.w", "b.w"], at={"tau": tau, "stop.gap": 0.0})
    assert found.linearization.one_sided == (() if pressed else ("stop.contact",))
    assert linearize(Stopped(), ["tau"], ["a.w", "b.w"]).linearization.one_sided == ()


def test_nearly_parallel_rows() -> None:
    """Rows that differ by 1e-8 are independent; a mean of two of them is not, to round-off."""
    rows = np.hstack([np.ones((3, 1)), 1e-8 * np.eye(3)])
    assert len(_independent(rows)) == 3
    assert len(_independent(np.vstack([rows, (rows[0] + rows[1]) / 2, 0.3 * rows[0] + 0.7 * rows[2]]))) == 3


def test_derivatives_of_inputs_that_cancel_to_round_off() -> None:
    """y = x_1/10 + x_2/5 - 3 x_3/10 does not see what reaches all three states alike."""
    reach = np.full((3, 1), 1e6 / 7)
    full = Matrices(
        np.zeros((3, 3)), [np.zeros((3, 1)), np.zeros((3, 1)), reach], np.array([[0.1, 0.2, -0.3]]),
        [np.zeros((1, 1))] * 3, np.zeros((0, 3)), [np.zeros((0, 1))] * 3,
    )  # fmt: skip
    proper, gains = substitute_inputs(full, lambda output, given, order: AssertionError((output, given, order)))
    assert np.array_equal(gains, 0 * reach)
    assert np.abs(proper.d[0]).max() < 1e-9
