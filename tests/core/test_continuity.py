"""Signals that jump into sources that follow them exactly: an impulse, which is refused; corners of a speed are fine."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

import pytest

import powertrain as pt
from powertrain.components import blocks
from powertrain.components import rotational as rot
from powertrain.components.cvu import CVU
from powertrain.engine.simulator import Simulator


class Moved(pt.Component):
    """An inertia with a damper, moved by a signal."""

    signal: pt.Component
    source: Any
    J: rot.Inertia = rot.Inertia(J=2.0)
    damper: rot.Damper = rot.Damper(d=1.0)
    ground: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        wanted = self.source.w_ref if isinstance(self.source, rot.Speed) else self.source.phi_ref
        yield pt.connect(self.signal.y, wanted)  # type: ignore[attr-defined]
        yield pt.connect(self.source.flange, self.J.flange_a, self.damper.flange_a)
        yield pt.connect(self.damper.flange_b, self.ground.flange)


SPEED, POSITION = rot.Speed(exact=True), rot.Position(exact=True)
STEP = blocks.Step(height=5.0, startTime=0.5)
RAMP = blocks.Ramp(height=5.0, startTime=0.2, duration=0.4)
PULSE = blocks.Pulse(period=0.3, amplitude=2.0)
POLYGON = blocks.TimeTable(table=((0.0, 0.0), (1.0, 1.0), (2.0, 3.0)))
TRAPEZOID = blocks.Trapezoid(period=1.0, rising=0.2, width=0.3, falling=0.2)


@pytest.mark.parametrize(
    ("source", "signal", "time", "what"),
    [
        (SPEED, STEP, 0.5, "jump by 5 rad/s, from 0 to 5 rad/s"),
        (SPEED, PULSE, 0.15, "jump by -2 rad/s"),
        (SPEED, blocks.Sine(f=1.0, startTime=0.3, phase=1.0), 0.3, "jump by 0.841471 rad/s"),
        (POSITION, STEP, 0.5, "jump by 5 rad,"),
        (POSITION, RAMP, 0.2, "jump by 12.5 rad/s"),
        (POSITION, POLYGON, 1.0, "jump by 1 rad/s, from 1 to 2 rad/s"),
        (POSITION, TRAPEZOID, 0.2, "jump by -5 rad/s"),
    ],
)
def test_jumps_are_refused_where_they_happen(source: Any, signal: Any, time: float, what: str) -> None:
    """The message names source and signal and the size of the jump; what was reached is kept."""
    with pytest.raises(pt.SimulationError) as caught:
        pt.simulate(Moved(signal=signal, source=source), 1.5)
    said = str(caught.value)
    assert what in said
    assert "signal" in said
    assert "source.w" in said or "source.phi" in said
    assert f"at t = {time:g} s" in said
    assert caught.value.result is not None


@pytest.mark.parametrize("source", [SPEED, POSITION])
def test_table_that_jumps_is_refused_before_a_run(source: Any) -> None:
    table = blocks.TimeTable(table=((0.0, 0.0), (1.0, 1.0), (1.0, 3.5)))
    with pytest.raises(pt.ModelError, match=r"signal: .*\n.* at t = 1 s makes .*source.* jump by 2.5 rad"):
        pt.compile(Moved(signal=table, source=source))


def test_what_the_message_about_a_table_says() -> None:
    """The jump of the variable, not of the signal, and the first one."""

    class Opposite(pt.Component):
        w: pt.Variable = pt.variable("rad/s", "Speed")
        tau: pt.Variable = pt.variable("N.m", "Torque")

        def equations(self) -> pt.Equations:
            yield self.w == -2 * pt.schedule([0, 2, 2, 3, 3, 4, 4], [1, 1, 1, 5, 4, 4, 0])
            yield pt.der(self.w) == self.tau - self.w

    with pytest.raises(pt.ModelError) as caught:
        pt.compile(Opposite())
    assert "the jump of this signal at t = 3 s makes w jump by 2 rad/s. Something" in str(caught.value)


class Jumping(pt.Component):
    """A signal that may jump, and one that does not, which an inertia follows exactly."""

    table: blocks.TimeTable
    ramp: blocks.TimeTable = POLYGON
    source: rot.Speed = SPEED
    J: rot.Inertia = rot.Inertia(J=2.0)
    followed: float = 0.0
    level: pt.Variable = pt.variable("1", "Level", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.level) == self.table.y.value
        yield self.source.w_ref.value == self.ramp.y.value + self.followed * self.table.y.value
        yield pt.connect(self.source.flange, self.J.flange_a)


@pytest.mark.parametrize(
    ("table", "followed"),
    [
        (((0, 1), (0.5, 1), (0.5, 3)), 0.0),  # nothing follows it
        (((0, 1), (0, 2), (1, 2)), 1.0),  # before the start
        (((0, 1), (0.5, 1), (0.5, 1), (1, 2)), 1.0),  # no jump
    ],
)
def test_tables_that_make_nothing_jump(table: Any, followed: float) -> None:
    result = pt.simulate(Jumping(table=blocks.TimeTable(table=table), followed=followed), 0.9)
    assert [smooth.names.startswith("source.w, ") for smooth in result.compiled.dae.smooth] == [True]


@pytest.mark.parametrize(
    "signal", [RAMP, POLYGON, TRAPEZOID, blocks.Sine(f=1.0, startTime=0.3), blocks.Step(height=0.0, startTime=0.5)]
)
def test_corners_of_a_speed_are_fine(signal: Any) -> None:
    result = pt.simulate(Moved(signal=signal, source=SPEED), 1.5, rtol=1e-9)
    assert pt.energy_audit(result).closure < 1e-9


def test_jump_of_a_filtered_source_is_fine() -> None:
    result = pt.simulate(Moved(signal=STEP, source=rot.Speed()), 1.5, rtol=1e-9)
    assert result["J.w"][-1] == pytest.approx(5.0)


def test_jump_without_inertia_is_fine() -> None:
    class Light(pt.Component):
        step: blocks.Step = STEP
        source: rot.Speed = SPEED
        damper: rot.Damper = rot.Damper(d=1.0)
        ground: rot.Fixed = rot.Fixed()

        def equations(self) -> pt.Equations:
            yield pt.connect(self.step.y, self.source.w_ref)
            yield pt.connect(self.source.flange, self.damper.flange_a)
            yield pt.connect(self.damper.flange_b, self.ground.flange)

    assert pt.simulate(Light(), 1.0)["damper.tau"][-1] == pytest.approx(-5.0)


class Geared(pt.Component):
    """A variable unit whose ratio is an input of the model."""

    V: pt.Input = pt.signal_input("1", "Ratio")
    J1: rot.Inertia = rot.Inertia(J=1.0)
    J2: rot.Inertia = rot.Inertia(J=2.0)
    cvu: CVU = CVU()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.J1.flange_b, self.cvu.flange_a)
        yield pt.connect(self.cvu.flange_b, self.J2.flange_a)
        yield pt.connect(self.V, self.cvu.ratio)


@pytest.mark.parametrize(("step", "jumps"), [(0.0, False), (0.5, True)])
def test_a_state_that_loses_its_drift_at_an_event_is_no_jump(step: float, jumps: bool) -> None:
    """All states change by 0.01 at a corner of the ratio, as those of what is at rest do; the ratio goes on, or jumps as well."""
    dae = pt.compile(Geared()).compiled.dae
    engine = Simulator(dae)
    ratio = next(s.index for s in dae.schedules)
    memory, continuity = engine.memory, engine.continuity
    assert continuity is not None
    memory.time[0], memory.p[: dae.p.numel()] = 0.5, 1.0
    memory.m[ratio : ratio + 3] = 0.0, 1.0, 0.0  # since 0 s, the value there, its slope
    memory.y[0][:], memory.y[1][:] = 10.0, 10.01
    continuity.before(0)
    memory.m[ratio : ratio + 3] = 0.5, 1.0 + step, 1.0
    with pytest.raises(pt.SimulationError, match="jump by") if jumps else nullcontext():
        continuity.check(1, reset=False)


def test_ratio_that_jumps_between_inertias() -> None:
    plant = pt.compile(Geared())
    gradual = plant.simulate(1.0, starts={"J1.w": 10.0}, inputs={"V": ([0.0, 1.0], [1.0, 2.0])})
    assert pt.energy_audit(gradual).closure < 1e-6
    with pytest.raises(pt.SimulationError, match=r"at t = 0.5 s V makes .*(J2|cvu).* jump by .* rad/s"):
        plant.simulate(1.0, starts={"J1.w": 10.0}, inputs={"V": ([0.0, 0.5, 0.5], [1.0, 1.0, 2.0])})
