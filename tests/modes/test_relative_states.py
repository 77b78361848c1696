"""A source that jumps under a clutch, a freewheel or a contact: the speed against it jumps, what has inertia keeps its own."""

from __future__ import annotations

import numpy as np
import pytest
from small_models import Floor

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.rotational import Clutch, Freewheel, Inertia, Speed, SpringDamper


class Driven(pt.Component):
    """Partial: an exact speed before a coupling, 2 kg.m2 behind it."""

    u: pt.Input = pt.signal_input("rad/s", "speed of the source")
    source: Speed = Speed(exact=True)
    load: Inertia = Inertia(J=2.0)

    def driven(self, coupling: Clutch | Freewheel) -> pt.Equations:
        yield self.source.w_ref.value == self.u.value
        yield pt.connect(self.source.flange, coupling.flange_a)
        yield pt.connect(coupling.flange_b, self.load.flange_a)


class ByClutch(Driven):
    """The clutch transmits 20 N.m."""

    clutch: Clutch = Clutch(mue_pos=((0.0, 1.0),), fn_max=20.0)
    engaged: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield from self.driven(self.clutch)
        yield pt.connect(self.engaged.y, self.clutch.f_normalized)


class ByFreewheel(Driven):
    """With a second load of 1 kg.m2 on a spring."""

    freewheel: Freewheel = Freewheel()
    spring: SpringDamper = SpringDamper(c=20.0, d=0.1)
    far: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield from self.driven(self.freewheel)
        yield pt.connect(self.load.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.far.flange_a)


class BesideAShaft(Driven):
    """The source turns an inertia without a clutch as well."""

    clutch: Clutch = Clutch(mue_pos=((0.0, 1.0),), fn_max=20.0)
    engaged: Constant = Constant(k=1.0)
    rigid: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield from self.driven(self.clutch)
        yield pt.connect(self.engaged.y, self.clutch.f_normalized)
        yield pt.connect(self.source.flange, self.rigid.flange_a)


STEP = {"u": ([0.0, 0.3, 0.3, 2.0], [0.0, 0.0, 10.0, 10.0])}


@pytest.mark.parametrize("compile", [False, True])
def test_a_clutch_slips_after_a_step_of_an_exact_speed(compile: bool) -> None:
    """20 N.m take 1 s to bring 2 kg.m2 to 10 rad/s."""
    plant = pt.compile(ByClutch())
    result = plant.simulate(2.0, inputs=STEP, compile=compile)
    np.testing.assert_allclose(result.at([0.29, 0.8, 1.2, 1.4], "load.w"), [0.0, 5.0, 9.0, 10.0], atol=1e-8)
    assert abs(float(pt.energy_audit(result).residual)) < 1e-3
    run = plant.start()
    run.step(0.3, u=0.0)
    run.step(0.5, u=10.0)
    assert run["load.w"] == pytest.approx(5.0)


def test_the_step_may_be_a_table_of_the_model() -> None:
    """Which would be refused at once if the load followed it."""

    class Tabled(pt.Component):
        car: ByClutch = ByClutch()

        def equations(self) -> pt.Equations:
            yield self.car.u.value == pt.schedule([0.0, 0.3, 0.3, 2.0], [0.0, 0.0, 10.0, 10.0])

    assert pt.simulate(Tabled(), 2.0).at(0.8, "car.load.w") == pytest.approx(5.0)


@pytest.mark.parametrize("compile", [False, True])
def test_a_freewheel_is_struck_by_a_step_of_an_exact_speed(compile: bool) -> None:
    """The spring transmits no impulse. Afterwards the source holds the load at 10 rad/s while the far one swings behind it."""
    result = pt.simulate(ByFreewheel(), 0.8, inputs=STEP, compile=compile)
    assert result.at(0.31, "load.w") == pytest.approx(10.0, abs=1e-9)
    assert abs(float(result.at(0.3 + 1e-6, "far.w"))) < 1e-4
    assert [e.kind for e in result.events if e.time == 0.3] == ["impact"]
    assert abs(float(pt.energy_audit(result).residual)) < 1e-3


def test_a_load_without_a_coupling_does_not_follow_a_step() -> None:
    class Rigid(Driven):
        def equations(self) -> pt.Equations:
            yield self.source.w_ref.value == self.u.value
            yield pt.connect(self.source.flange, self.load.flange_a)

    with pytest.raises(pt.SimulationError, match=r"makes .*load\.w.* jump by 10 rad/s"):
        pt.simulate(Rigid(), 1.0, inputs=STEP)


@pytest.mark.parametrize("compile", [False, True])
def test_a_floor_that_stops_rising_throws_the_body_up(compile: bool) -> None:
    """It rises with 1 m/s from 0.3 to 0.6 s, the body flies for 0.2 s and lands with 1 m/s."""
    rising = {"h": ([0.0, 0.3, 0.6, 1.0], [0.0, 0.0, 0.3, 0.3])}
    result = pt.simulate(Floor(), 1.0, inputs=rising, compile=compile)
    np.testing.assert_allclose(result.at([0.2, 0.45, 0.7, 0.9], "x"), [0.0, 0.15, 0.35, 0.3], atol=1e-9)
    impacts = [e.time for e in result.events if e.kind == "impact"]
    np.testing.assert_allclose(impacts, [0.3, 0.8], atol=1e-9)


def test_the_gradient_through_it_is_refused() -> None:
    result = pt.simulate(ByClutch(), 2.0, inputs=STEP)
    with pytest.raises(
        pt.SimulationError, match=r"at t = 0\.3 s clutch\.w_rel jumps, because u moves a source under a clutch"
    ):
        pt.gradient(result, "load.w", ["load.J"])


def test_a_clutch_does_not_let_an_inertia_beside_it_jump() -> None:
    with pytest.raises(pt.SimulationError, match=r"at t = 0.3 s u makes .* jump by 10 rad/s"):
        pt.simulate(BesideAShaft(), 2.0, inputs=STEP)
