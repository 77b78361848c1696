"""A synchroniser: its time, its blocking condition and its dogs, in the terms of the textbook."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.blocks import TimeTable

J, DW, FORCE = 0.01, 100.0, 800.0
CONE = 0.1 * 0.035 / math.sin(math.radians(6.5))
"""Torque of the cone over the force of the sleeve [m]."""
SHIFT = ((0.0, 0.0), (0.1, 0.0), (0.1, 9e-3), (1.0, 9e-3), (1.0, 0.0))


def shifted(synchroniser: rot.Synchroniser, drag: float = 0.0, table: Any = SHIFT, stop: float = 0.9) -> Any:
    """A wheel of 0.01 kg.m2 with a drag, at rest, and a heavy shaft that turns with 100 rad/s."""
    shift, lever = tr.ShiftActuator(f_max=FORCE), TimeTable(table=table)
    parts = synchroniser, rot.Inertia(J=J), rot.Inertia(J=1e3), shift, lever, rot.ConstantTorque(tau_constant=-drag)
    wired = "0.flange_a=1.flange_a=5.flange 0.flange_b=2.flange_a 0.sleeve=3.flange 4.y=3.s_ref"
    return run(joined(*parts, joints=wired), stop, {"2.w": DW}, rtol=1e-9)


def at(result: Any, name: str, time: float) -> float:
    return float(result.at([time], f"parts[0].{name}")[0])


def happened(result: Any, name: str, new: float) -> float:
    return float(next(e.time for e in result.events if e.name == f"parts[0].{name}" and e.new == new))


@pytest.mark.parametrize("cones", [1.0, 3.0])
@pytest.mark.parametrize("drag", [0.0, 2.0])
def test_synchronisation_takes_its_time(cones: float, drag: float) -> None:
    """From contact with the ring t = J dw/(T - drag); the sleeve stands at the ring until then, and goes through to the end after."""
    result = shifted(rot.Synchroniser(cones=cones), drag, ((0.0, 0.0), (0.1, 0.0), (0.1, 9e-3)))
    contact, passed = happened(result, "stop", 1), happened(result, "stop", 0)
    slip = drag / J * contact  # the drag has turned the free wheel backward
    torque = cones * CONE * FORCE
    assert passed - contact == pytest.approx(
        J * (DW + slip) / (torque - drag), rel=1e-4
    )  # 1000 kg.m2 give way a little
    assert at(result, "x", passed - 1e-4) == pytest.approx(2e-3, abs=1e-9)
    assert at(result, "x", 0.9) == pytest.approx(9e-3, abs=1e-7)
    assert at(result, "inside", 0.9) == 1
    assert at(result, "tau", 0.9) == pytest.approx(drag, rel=1e-4, abs=1e-6)
    assert pt.energy_audit(result).closure < 1e-6


def test_dogs_hold_and_come_out() -> None:
    """Engaged, the dogs carry what the cone never could; the sleeve takes them out again."""
    result = shifted(rot.Synchroniser(), drag=2.0, stop=1.5)
    np.testing.assert_allclose(result.at([0.95], "parts[0].w_rel"), 0, atol=1e-9)
    assert at(result, "passed", 1.5) == at(result, "inside", 1.5) == 0
    assert at(result, "w_rel", 1.5) > 1  # the drag slows the free wheel down


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_run_may_start_in_gear(direction: float) -> None:
    """Only the sleeve is given, at its end: the dogs are in and carry 50 N.m, which no cone could. Before the dogs, they are out."""
    for position, inside in ((9e-3, 1), (4e-3, 0)):
        place = TimeTable(table=((0.0, direction * position),))
        parts = rot.Synchroniser(direction=direction), rot.Inertia(J=J), rot.Inertia(J=1e3), tr.ShiftActuator(), place
        wired = "0.flange_a=1.flange_a=5.flange 0.flange_b=2.flange_a 0.sleeve=3.flange 4.y=3.s_ref"
        model = joined(*parts, rot.ConstantTorque(tau_constant=-50.0), joints=wired)
        result = run(model, 0.2, {"3.s": direction * position, "1.w": DW, "2.w": DW}, rtol=1e-9)
        assert at(result, "inside", 0.2) == inside
        assert at(result, "w_rel", 0.2) == pytest.approx(0.0 if inside else 50 / J * 0.2, abs=1e-9)


@pytest.mark.parametrize(("torque", "slip"), [(2900.0, 0.0), (3100.0, (3100 - 100) / J * 0.01)])
def test_engaged_dogs_hold_their_capacity(torque: float, slip: float) -> None:
    """They hold 3,000 N.m; beyond it they slip, with the 100 N.m of dogs that slide."""
    parts = (
        rot.Synchroniser(),
        rot.Inertia(J=J),
        rot.Inertia(J=1e3),
        tr.ShiftActuator(),
        TimeTable(table=((0.0, 9e-3),)),
    )
    wired = "0.flange_a=1.flange_a=5.flange 0.flange_b=2.flange_a 0.sleeve=3.flange 4.y=3.s_ref"
    model = joined(*parts, rot.ConstantTorque(tau_constant=-torque), joints=wired)
    result = run(model, 0.01, {"3.s": 9e-3, "1.w": DW, "2.w": DW}, rtol=1e-9)
    assert at(result, "w_rel", 0.01) == pytest.approx(slip, rel=1e-4, abs=1e-9)


def test_a_start_beyond_the_last_stop_is_rejected() -> None:
    parts = rot.Synchroniser(), tr.Mass(m=1), rot.Inertia(J=J), rot.Inertia(J=J)
    model = joined(*parts, joints="0.sleeve=1.flange_a 0.flange_a=2.flange_a 0.flange_b=3.flange_a")
    with pytest.raises(pt.InitializationError, match=r"stop .* overlap: the gap is -0\.00"):
        run(model, 0.1, {"1.s": 12e-3})


def test_chamfers_that_are_too_sharp_do_not_block() -> None:
    """Index torque above the cone's: the sleeve passes a ring that still slides, and ratchets on the dogs."""
    cone, index = rot.Synchroniser(chamfer=0.6).torques_per_force()
    assert cone == pytest.approx(CONE, rel=1e-12)
    assert index > cone
    result = shifted(rot.Synchroniser(chamfer=0.6))
    assert at(result, "passed", 0.12) == 1
    assert at(result, "x", 0.9) == pytest.approx(5e-3, abs=1e-9)
    assert at(result, "inside", 0.9) == 0
    assert at(result, "w_rel", 0.9) == pytest.approx(DW, rel=1e-3)


@pytest.mark.parametrize(("share", "passes"), [(0.98, True), (1.02, False)])
def test_cold_oil_keeps_it_blocked(share: float, passes: bool) -> None:
    """At equal speeds the cone carries the drag; above F index less the ring's own torque the ring stays in the way."""
    synchroniser = rot.Synchroniser()
    cone, index = synchroniser.torques_per_force()
    drag = share * (index * FORCE - 0.1)
    assert drag < cone * FORCE
    result = shifted(synchroniser, drag, ((0.0, 9e-3),), stop=2.0)
    assert at(result, "passed", 2.0) == passes
    if not passes:
        assert at(result, "w_rel", 2.0) == pytest.approx(0.0, abs=1e-9)


def test_one_sleeve_serves_two_wheels() -> None:
    """Two synchronisers on one sleeve, the second with direction -1: each takes its wheel, and never both."""
    lever = TimeTable(table=((0.0, 9e-3), (0.4, 9e-3), (0.4, -9e-3)))
    one, other = rot.Synchroniser(), rot.Synchroniser(direction=-1.0)
    parts = one, other, rot.Inertia(J=J), rot.Inertia(J=J), rot.Inertia(J=1e3), tr.ShiftActuator(f_max=FORCE), lever
    wired = "0.flange_a=2.flange_a 1.flange_a=3.flange_a 0.flange_b=1.flange_b=4.flange_a 0.sleeve=1.sleeve=5.flange 6.y=5.s_ref"
    result = run(joined(*parts, joints=wired), 0.9, {"4.w": DW}, rtol=1e-9)
    both = [result.at([0.35, 0.85], f"parts[{k}].inside").tolist() for k in (0, 1)]
    assert both == [[1, 0], [0, 1]]
    np.testing.assert_allclose(result["parts[3].w"][-1], result["parts[4].w"][-1], rtol=1e-9)


def test_what_cannot_be_is_rejected() -> None:
    for wrong in ({"angle": 0.09}, {"s_dog": 1e-3}, {"s_end": 4e-3}, {"direction": 0.5}, {"chamfer": 1.5}):
        with pytest.raises(pt.ParameterError, match="does not hold"):
            rot.Synchroniser(**wrong)


class Lifted(pt.Component):
    """A mass of 2 kg that 10 N press against a stop; at 1 s a reset puts it 0.1 m away."""

    s: pt.Variable = pt.variable("m", "Distance from the stop", start=0.1)
    v: pt.Variable = pt.variable("m/s", "Speed")
    f: pt.Variable = pt.variable("N", "Force of the stop")

    def equations(self) -> pt.Equations:
        yield self.v == pt.der(self.s)
        yield 2 * pt.der(self.v) == self.f - 10
        yield pt.unilateral(self.s, self.f)
        yield pt.when(pt.time > 1.0, pt.reinit(self.s, 0.1))


def test_a_reset_opens_a_closed_contact() -> None:
    """It falls to the stop in sqrt(2 s m/F) after the reset, as it did from the start."""
    result = pt.simulate(Lifted(), 2.0, rtol=1e-10)
    hits = [e.time for e in result.events if e.name == "contact" and e.new == 1]
    np.testing.assert_allclose(hits, [math.sqrt(0.04), 1 + math.sqrt(0.04)], rtol=1e-7)
