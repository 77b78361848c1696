"""Margins of laws at their limits, and impacts of several contacts at once, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from joined import joined

import powertrain as pt
from powertrain.components import translational as tr
from powertrain.components.blocks import Ramp
from powertrain.dae.contact import pressure_margin
from powertrain.dae.friction import STUCK, rest_margin, torque_margins
from powertrain.dae.hybrid import Contact, Friction
from powertrain.dae.tolerances import LEAST_TORQUE

NONE = ca.SX(0)


@pytest.mark.parametrize("lower", [-2.0, 0.5])
@pytest.mark.parametrize("torque", [-3.0, 0.7, 4.0])
def test_margins_are_the_same_on_both_sides(lower: float, torque: float) -> None:
    """The hysteresis lies outside both limits; turned round, the lower limit is the upper one."""

    def margins(tau: float, low: float, high: float) -> tuple[float, float]:
        law = Friction("law", "", 0, NONE, ca.SX(tau), ca.SX(low), ca.SX(high), ca.SX(1.0), NONE, known=ca.SX(0.25))
        below, above = torque_margins(law)
        return float(below), float(above)

    below, above = margins(torque, lower, 3.0)
    assert (below, above) == pytest.approx((torque - lower + 0.25, 3.0 - torque + 0.25))
    assert margins(-torque, -3.0, -lower) == pytest.approx((above, below))


def test_a_load_of_round_off_does_not_move_a_one_way_law() -> None:
    """Whether its rate exceeds its torque is then accidental: the margin must not depend on it. A motion that others prescribe counts."""

    def margin(tau: float, rate: float, w: float) -> float:
        law = Friction(
            "law", "", 0, ca.SX(w), ca.SX(tau), ca.SX(-np.inf), NONE, ca.SX(1.0), ca.SX(rate), reach=ca.SX(15.6)
        )
        dae: Any = SimpleNamespace(m=ca.SX(STUCK))
        return float(rest_margin(dae, law))

    samples = [margin(3e-17, rate, 1.3e-18) for rate in (-4e-16, 0.0, 0.0, 4e-16)]
    assert samples == pytest.approx([samples[0]] * 4, rel=1e-9)
    assert min(samples) > 0.0 > margin(1e8, 9.0, 4e-7)


@pytest.mark.parametrize("restitutions", [(0.5,), (0.0, 0.5), (0.5, 0.0), (0.2, 0.0, 0.7)])
def test_stops_at_one_place(restitutions: tuple[float, ...]) -> None:
    """By Moreau's law the most elastic one throws the mass back and opens all of them; it leaves freely and keeps its energy."""
    stops = [
        tr.MassWithStopAndFriction(
            m=1.0, F_prop=0, F_Coulomb=0, F_Stribeck=0, fexp=1, smin=-0.1, smax=9.0, restitution=e
        )
        for e in restitutions
    ]
    joints = "=".join(f"{k}.flange_a" for k in range(len(stops)))
    rod = tr.Mass(m=1.0)
    model = joined(*stops, rod, joints=f"{joints}={len(stops)}.flange_a")
    result = pt.simulate(model, 1.0, starts={f"parts[{len(stops)}].v": -1.0})
    v = result[f"parts[{len(stops)}].v"]
    assert v[-1] == pytest.approx(max(restitutions), rel=1e-6)
    assert all(result[f"parts[{k}].stop_min"][-1] == 0 for k in range(len(stops)))
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-9
    assert audit.violations.empty


@pytest.mark.parametrize(("v", "closed"), [(-1.9e-4, True), (-2.1e-4, False)])
def test_a_rebound_below_a_tenth_of_a_millimetre_per_second_stays_closed(v: float, closed: bool) -> None:
    stop = tr.MassWithStopAndFriction(
        m=1.0, F_prop=0, F_Coulomb=0, F_Stribeck=0, fexp=1, smin=-1e-5, smax=9.0, restitution=0.5
    )
    load = tr.ConstantForce(f_constant=-1e-6)
    result = pt.simulate(joined(stop, load, joints="0.flange_b=1.flange"), 0.08, starts={"parts[0].v": v})
    assert (result["parts[0].stop_min"][-1] == 1) == closed
    assert (abs(result["parts[0].v"][-1]) < 1e-12) == closed


def test_a_prescribed_motion_runs_into_a_stop() -> None:
    """No impulse stops it: refused at the stop, with its name."""
    stop = tr.MassWithStopAndFriction(m=1.0, F_prop=0, F_Coulomb=0, F_Stribeck=0, fexp=1, smin=-0.1, smax=9.0)
    model = joined(stop, tr.ConstantSpeed(v_fixed=-0.4), joints="0.flange_b=1.flange")
    with pytest.raises(
        pt.SimulationError, match=r"(?s)at t = 0\.25.* s a motion that no force can stop closes parts\[0\]\.stop_min"
    ):
        pt.simulate(model, 1.0)


class Relieved(pt.Component):
    """A mass on a stop under two large forces that cancel, and a small one that ends after a second."""

    A: pt.Parameter = pt.parameter("N", "Amplitude of the forces", default=5e5)
    press: Ramp = Ramp(offset=-1.0, height=1.0, duration=1.0)
    x: pt.Variable = pt.variable("m", "Distance from the stop", start=0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=0)
    force: pt.Variable = pt.variable("N", "Force of the stop")

    def equations(self) -> pt.Equations:
        cancelled = self.A * ca.sin(3 * pt.time) - self.A * ca.cos(3 * pt.time - np.pi / 2)
        yield pt.der(self.x) == self.v
        yield 2.0 * pt.der(self.v) == self.force + self.press.y.value + cancelled
        yield pt.unilateral(self.x, self.force)


def test_a_stop_that_nothing_presses_stays_closed_but_for_round_off() -> None:
    """What is left of the forces, up to some 1e-10 N, is no pull: it may not open the stop."""
    run = pt.simulate(Relieved(), stop=20.0)
    assert 1e-10 < np.abs(run["force"][run.time > 1.0]).max() < LEAST_TORQUE
    assert len(run.events) == 0


def test_a_closed_stop_is_located_where_it_pulls_by_more_than_its_force_is_known() -> None:
    contact = Contact("stop", "", 0, NONE, NONE, NONE, ca.SX(-0.3), NONE, known=ca.SX(0.25), rounding=ca.SX(0.125))
    assert float(pressure_margin(contact)) == -0.3 + 0.375


def test_a_slow_rebound_from_a_fast_impact_is_one() -> None:
    """At 0.5 mm/s, a two-thousandth of the speed of the impact: that is no round-off."""
    stop = tr.MassWithStopAndFriction(
        m=1.0, F_prop=0, F_Coulomb=0, F_Stribeck=0, fexp=1, smin=-0.1, smax=9.0, restitution=5e-4
    )
    result = pt.simulate(
        joined(stop, tr.ConstantForce(f_constant=0.0), joints="0.flange_b=1.flange"), 1.0, starts={"parts[0].v": -1.0}
    )
    assert result["parts[0].v"][-1] == pytest.approx(5e-4, rel=1e-9)
    assert result["parts[0].stop_min"][-1] == 0
