"""A trailer with its own brakes, behind a body of another mass."""

from __future__ import annotations

import math

import pytest

import powertrain as pt
from powertrain.components.blocks import Constant, Step
from powertrain.components.body import Trailer, VehicleBody
from powertrain.components.cycles import DriveCycle
from powertrain.components.translational import ConstantForce
from powertrain.trials.cycle_run import CycleRun

M, G = 1500.0, 9.80665
M_T, J, R, CR, HITCH = 1000.0, 1.5, 0.3, 0.01, 0.06
TURNING = M_T + J / R**2


class Towed(pt.Component):
    """A body without air, pulled by a force, with a trailer on a slope."""

    push: ConstantForce = ConstantForce(f_constant=4000)
    body: VehicleBody = VehicleBody(m=M, Cd=0)
    trailer: Trailer = Trailer()
    slope: Constant = Constant(k=0)
    pedal: Step = Step(height=0, startTime=1)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.push.flange, self.body.front)
        yield pt.connect(self.body.rear, self.trailer.hitch)
        yield pt.connect(self.slope.y, self.body.grade, self.trailer.grade)
        yield pt.connect(self.pedal.y, self.trailer.brake)


def test_the_hitch_pulls_mass_wheels_tyres_and_weight() -> None:
    """(M + m + J/R^2) a = F - (M + m) g sin(alpha) - Cr m g cos(alpha) (1 - share); the hitch bears the trailer's part."""
    slope = 0.08
    cosine = 1 / math.sqrt(1 + slope**2)
    run = pt.simulate(pt.replace(Towed(), {"slope.k": slope, "trailer.body.Cd": 0}), 2.0)
    rolling = CR * M_T * G * cosine * (1 - HITCH)
    a = (4000 - (M + M_T) * G * slope * cosine - rolling) / (M + TURNING)
    assert run["body.v"][-1] == pytest.approx(2 * a, rel=1e-9)
    assert run["trailer.hitch.f"][-1] == pytest.approx(TURNING * a + M_T * G * slope * cosine + rolling, rel=1e-9)
    assert pt.energy_audit(run).closure < 1e-9


def test_its_brakes_relieve_the_hitch_and_hold_it() -> None:
    """At half demand the brakes take 1,000 N.m: they push neither more nor less than that over the radius."""
    braked = pt.replace(Towed(), {"push.f_constant": 0, "trailer.body.Cd": 0, "pedal.height": 0.5})
    run = pt.simulate(braked, 20.0, starts={"body.v": 20.0, "trailer.axle.wheels.w": 20.0 / R})
    force = CR * M_T * G * (1 - HITCH) + 1000 / R
    later = run.at([2.0], "trailer.hitch.f")[0]
    assert later == pytest.approx(force * M / (M + TURNING), rel=1e-9)  # the body has no brakes of its own here
    assert run["body.v"][-1] == 0


def test_air_and_rolling_resistance_at_constant_speed() -> None:
    """The hitch pulls with Cd A rho v^2/2 + Cr m g (1 - share)."""
    found = pt.steady(Towed(), {"body.chassis.speed": 25.0}, free=["push.f_constant"], outputs=["trailer.hitch.f"])
    expected = 0.3 * 2.0 * 1.2 / 2 * 25**2 + CR * M_T * G * (1 - HITCH)
    assert float(found["trailer.hitch.f"]) == pytest.approx(expected, rel=1e-9)


def test_the_energy_demand_of_a_cycle_includes_the_trailer() -> None:
    """The force that pulls both does the work F s; what the body alone takes would be 58 % of it."""
    plant = pt.compile(Towed())
    run = plant.simulate(5.0, points=2001)
    demand = CycleRun(DriveCycle.named("nedc"), plant, run, {}, "").demand
    assert demand == pytest.approx(4000 * run["body.s"][-1], rel=1e-6)
