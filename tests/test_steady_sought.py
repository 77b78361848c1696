"""Operating points at which laws at rest share a load with inputs that are sought: each share is a solution."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_models import Motor

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.rotational.interfaces import Flange

OK, STUCK, SEVERAL = 0, 1, 2
ONE = ((0.0, 1.0),)


class Series(pt.Component):
    """Two couplings in series join three shafts; a torque drives each of them, and the middle one is damped."""

    one: pt.Component
    other: pt.Component
    first: rot.Inertia = rot.Inertia(J=1.0)
    middle: rot.Inertia = rot.Inertia(J=1e-4)
    last: rot.Inertia = rot.Inertia(J=1.0)
    damper: rot.Damper = rot.Damper(d=0.1)
    ground: rot.Fixed = rot.Fixed()
    torques: tuple[rot.Torque, ...] = (rot.Torque(), rot.Torque(), rot.Torque())
    tau_first: pt.Input = pt.signal_input("N.m", "Torque on the first shaft")
    tau_middle: pt.Input = pt.signal_input("N.m", "Torque on the middle shaft")
    tau_last: pt.Input = pt.signal_input("N.m", "Torque on the last shaft")

    def equations(self) -> pt.Equations:
        inputs = (self.tau_first, self.tau_middle, self.tau_last)
        for torque, given, shaft in zip(self.torques, inputs, (self.first, self.middle, self.last), strict=True):
            yield pt.connect(given, torque.tau)
            yield pt.connect(torque.flange, shaft.flange_a)
        yield pt.connect(self.first.flange_b, self.one.flange_a)  # type: ignore[attr-defined]
        yield pt.connect(self.one.flange_b, self.middle.flange_b, self.other.flange_a, self.damper.flange_a)  # type: ignore[attr-defined]
        yield pt.connect(self.damper.flange_b, self.ground.flange)
        yield pt.connect(self.other.flange_b, self.last.flange_b)  # type: ignore[attr-defined]
        for clutch in (self.one, self.other):
            if isinstance(clutch, rot.Clutch):
                yield clutch.f_normalized.value == 1.0


def clutches(one: float, other: float) -> Series:
    return Series(one=rot.Clutch(fn_max=one, mue_pos=ONE), other=rot.Clutch(fn_max=other, mue_pos=ONE))


BOTH = ["tau_first", "tau_last"]


@pytest.mark.parametrize("speed", [0.0, 30.0])
@pytest.mark.parametrize("load", [0.0, 0.5, -4.9])
def test_two_motors_brace_themselves_through_clutches(speed: float, load: float) -> None:
    """At equal speeds the motors may work against each other; at others, one of the clutches slips."""
    given: dict[str, Any] = {"first.w": speed + np.array([-1.0, 0.0, 1.0]), "last.w": speed, "tau_middle": load}
    plant = pt.compile(clutches(5.0, 3.0))
    found = pt.steady(plant, given, free=BOTH, outputs=[*BOTH, "middle.w"])
    assert found.status.values.tolist() == [OK, SEVERAL, OK]
    assert "one.mode" in found.attrs["problems"]
    assert "other.mode" in found.attrs["problems"]
    one = pt.steady(plant, given, free=BOTH, outputs=[*BOTH, "middle.w"], first=True)
    np.testing.assert_allclose(one["tau_first"] + one["tau_last"], 0.1 * one["middle.w"] - load, atol=1e-6)


def test_a_load_that_takes_all_clutches_has_one_solution() -> None:
    given: dict[str, Any] = {"first.w": 0.0, "last.w": 0.0, "tau_middle": [7.9, 8.0, 8.1]}
    found = pt.steady(clutches(5.0, 3.0), given, free=BOTH, outputs=[*BOTH, "middle.w"])
    assert found.status.values.tolist() == [SEVERAL, OK, OK]
    for name, value in zip([*BOTH, "middle.w"], ([-5.0, -5.0], [-3.0, -3.0], [0.0, 1.0]), strict=True):
        np.testing.assert_allclose(found[name][1:], value, atol=1e-6)


@pytest.mark.parametrize(("load", "status"), [(-0.5, SEVERAL), (0.0, OK), (0.5, OK)])
def test_freewheels_pass_torque_on_in_one_direction(load: float, status: int) -> None:
    """Both drive the middle shaft; one alone or both hold it against a load, and none without."""
    model = Series(one=rot.Freewheel(), other=Reversed())
    given = {"first.w": 0.0, "last.w": 0.0, "tau_middle": load}
    found = pt.steady(model, given, free=BOTH, outputs=BOTH)
    assert found.status == status
    if status == OK:
        np.testing.assert_allclose([found[name] for name in BOTH], 0.0, atol=1e-6)


class Reversed(pt.Component):
    """A freewheel in the other direction."""

    wheel: rot.Freewheel = rot.Freewheel()
    flange_a: Flange = pt.port(Flange)
    flange_b: Flange = pt.port(Flange)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.wheel.flange_b)
        yield pt.connect(self.flange_b, self.wheel.flange_a)


class Held(pt.Component):
    """A shaft with brakes, and what depends on how they share its torque."""

    brakes: tuple[rot.Brake, ...]
    shaft: rot.Inertia = rot.Inertia(J=1.0)
    drive: rot.Torque = rot.Torque()
    tau: pt.Input = pt.signal_input("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, *(brake.flange_a for brake in self.brakes))
        for brake in self.brakes:
            yield brake.f_normalized.value == 1.0


def test_ranges_of_what_depends_on_the_torque_of_a_stuck_brake() -> None:
    """The squares and products of torques between the limits, not at these."""
    outputs = {
        "square": lambda m: m.brakes[0].tau ** 2,
        "bowl": lambda m: m.brakes[0].tau * (m.brakes[0].tau - 1.0),
        "product": lambda m: m.brakes[-1].tau * m.tau.value,
    }
    for limits, ends in (((5.0,), (0.0, 25.0)), ((5.0, 3.0), (-6.25, 24.0))):
        model = Held(brakes=tuple(rot.Brake(fn_max=limit, mue_pos=ONE) for limit in limits))
        found = pt.steady(model, {"shaft.w": 0.0}, free=["tau"], outputs=outputs)
        assert found.status == STUCK
        expected = {"square": (0.0, 25.0), "bowl": (-0.25, 30.0), "product": ends}
        for name, values in expected.items():
            np.testing.assert_allclose([found[f"{name}_{end}"] for end in ("low", "high")], values, atol=1e-6)


class LockedTwice(pt.Component):
    """A planetary gear that either of two clutches makes turn as one block."""

    gear: rot.IdealPlanetary = rot.IdealPlanetary(ratio=1.7923747532796717)
    sun: rot.Inertia = rot.Inertia(J=0.3)
    ring: rot.Inertia = rot.Inertia(J=2.0)
    carrier: rot.Inertia = rot.Inertia(J=0.7)
    one: rot.Clutch = rot.Clutch(fn_max=5.0, mue_pos=ONE)
    other: rot.Clutch = rot.Clutch(fn_max=3.0, mue_pos=ONE)
    drive: rot.Torque = rot.Torque()
    damper: rot.Damper = rot.Damper(d=0.1)
    ground: rot.Fixed = rot.Fixed()
    tau: pt.Input = pt.signal_input("N.m", "Torque on the carrier")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau, self.drive.tau)
        yield pt.connect(self.drive.flange, self.carrier.flange_a)
        yield pt.connect(self.carrier.flange_b, self.gear.carrier, self.one.flange_a)
        yield pt.connect(self.gear.sun, self.sun.flange_a, self.one.flange_b, self.other.flange_a)
        yield pt.connect(self.gear.ring, self.ring.flange_a, self.other.flange_b, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)
        yield self.one.f_normalized.value == 1.0
        yield self.other.f_normalized.value == 1.0


def test_clutches_share_a_torque_at_any_speed() -> None:
    """The compliance by which they do must not make torques of the round-off in their speeds."""
    w = np.linspace(-7.3, 9.1, 23)
    found = pt.steady(LockedTwice(), {"carrier.w": w}, free=["tau"], outputs=["tau", "sun.w"])
    assert (found.status == OK).all()
    np.testing.assert_allclose(found["tau"], 0.1 * w, atol=1e-6)
    np.testing.assert_allclose(found["sun.w"], w, atol=1e-9)


class Balances(pt.Component):
    """A planetary gear whose carrier drags a braked shaft by a clutch; the sun has a brake, and a clutch to the carrier."""

    parts: tuple[pt.Component, ...]
    nodes: tuple[tuple[tuple[int, str], ...], ...]
    torques: tuple[rot.Torque, ...] = (rot.Torque(), rot.Torque())
    tau_carrier: pt.Input = pt.signal_input("N.m", "Torque on the carrier")
    tau_sun: pt.Input = pt.signal_input("N.m", "Torque on the sun")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.tau_carrier, self.torques[0].tau)
        yield pt.connect(self.tau_sun, self.torques[1].tau)
        driven = {0: self.torques[0].flange, 3: self.torques[1].flange}
        for k, node in enumerate(self.nodes):
            yield pt.connect(*(getattr(self.parts[i], name) for i, name in node), *([driven[k]] if k in driven else []))
        for part in self.parts:
            if isinstance(part, rot.Brake | rot.Clutch):
                yield part.f_normalized.value == 1.0


def test_torques_without_bound_balance_nothing() -> None:
    """The brake takes 1.3 N.m from the shaft it brakes, the clutch gives it at most 1.1 N.m: no torque elsewhere keeps its speed."""
    parts, nodes = list[pt.Component](), tuple(list[tuple[int, str]]() for _ in range(4))

    def put(part: pt.Component, *places: tuple[int, str]) -> None:
        for shaft, name in places:
            nodes[shaft].append((len(parts), name))
        parts.append(part)

    for shaft, (torque, slope) in enumerate(((0.0, -0.7), (0.0, 0.0), (1.9, -1.4), (0.0, -0.1))):
        put(Motor(torque=torque, slope=slope), (shaft, "flange"))
    for shaft, J in enumerate((2.4360978325132727, 1.7416522712775413, 1.1762323527432774)):
        put(rot.Inertia(J=J), (shaft, "flange_a"))
    put(rot.Brake(fn_max=1.3, mue_pos=ONE), (1, "flange_a"))
    put(rot.Brake(fn_max=1.2, mue_pos=ONE), (3, "flange_a"))
    put(rot.Clutch(fn_max=2.2, mue_pos=ONE), (3, "flange_a"), (0, "flange_b"))
    put(rot.Clutch(fn_max=1.1, mue_pos=ONE), (1, "flange_a"), (0, "flange_b"))
    put(rot.IdealPlanetary(ratio=1.23), (3, "sun"), (2, "ring"), (0, "carrier"))
    model = Balances(parts=tuple(parts), nodes=tuple(map(tuple, nodes)))
    found = pt.steady(model, {"parts[3].w": 0.7, "parts[1].w": 0.7}, free=["tau_carrier", "tau_sun"])
    assert found.status not in (OK, STUCK, SEVERAL)


class Braced(pt.Component):
    """A shaft that a gear ties to a driven one; a freewheel and a clutch tie both to a third. Another joins it to a stopped one."""

    shaft: rot.Inertia = rot.Inertia(J=1.0)
    geared: rot.Inertia = rot.Inertia(J=1.0)
    third: rot.Inertia = rot.Inertia(J=1e-3)
    stopped: rot.Inertia = rot.Inertia(J=1.0)
    gear: rot.Gear = rot.Gear(ratio=-1.2, efficiency=1.0)
    wheel: rot.Freewheel = rot.Freewheel()
    clutch: rot.Clutch = rot.Clutch(fn_max=5.0, mue_pos=ONE)
    between: rot.Clutch = rot.Clutch(fn_max=5.0, mue_pos=ONE)
    torques: tuple[rot.Torque, ...] = (rot.Torque(), rot.Torque(), rot.Torque())
    tau: pt.Input = pt.signal_input("N.m", "Torque on the shaft")
    tau_geared: pt.Input = pt.signal_input("N.m", "Torque on the driven shaft")
    tau_stopped: pt.Input = pt.signal_input("N.m", "Torque on the stopped shaft")

    def equations(self) -> pt.Equations:
        inputs = (self.tau, self.tau_geared, self.tau_stopped)
        for torque, given, shaft in zip(self.torques, inputs, (self.shaft, self.geared, self.stopped), strict=True):
            yield pt.connect(given, torque.tau)
            yield pt.connect(torque.flange, shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.gear.flange_a, self.clutch.flange_a, self.between.flange_b)
        yield pt.connect(self.geared.flange_b, self.gear.flange_b, self.wheel.flange_b)
        yield pt.connect(self.third.flange_a, self.clutch.flange_b, self.wheel.flange_a)
        yield pt.connect(self.stopped.flange_b, self.between.flange_a)
        yield self.clutch.f_normalized.value == 1.0
        yield self.between.f_normalized.value == 1.0


@pytest.mark.parametrize("tau", [5.0, 3.0])
def test_laws_that_share_a_load_at_one_end_of_an_interval(tau: float) -> None:
    """With 5 N.m the clutch to the stopped shaft takes all of it at one end, and leaves it to the freewheel and the others at the other."""
    given: dict[str, Any] = {"geared.w": 0.0, "stopped.w": 0.0, "tau": tau}
    free = ["tau_geared", "tau_stopped"]
    assert pt.steady(Braced(), given, free=free, outputs=free).status == SEVERAL
    one = pt.steady(Braced(), given, free=free, outputs=[*free, "gear.flange_a.tau", "shaft.w"], first=True)
    assert np.isfinite(one["tau_geared"]).all()
    np.testing.assert_allclose(one["shaft.w"], 0.0, atol=1e-9)
