"""Ranges of outputs while a law at rest carries any torque between its bounds: extrema inside, and no bound where there is a pole."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rubbing import FORMULAS, LIMIT, Rubbing

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.dae import friction
from powertrain.equilibrium.points import Points
from powertrain.steadystate.intervals import StuckLine

OK, STUCK = 0, 1


@pytest.mark.parametrize("load", [0.0, 1.0, -1.7, -5.0, 5.0, -1.75, 2.15])
def test_ranges_are_those_of_all_torques(load: float) -> None:
    """With the last two the maximum of the bump is nearer to an end than to any other sample."""
    names = ["tau", *FORMULAS]
    found = pt.steady(Rubbing(), {"w": [0.0, 1.0], "load": [load, 20.0]}, outputs=names)
    assert found.status.values.tolist() == [[STUCK, STUCK], [OK, OK]]
    tau = np.linspace(-LIMIT, LIMIT, 400001) - load
    for name, formula in {"tau": lambda tau: tau, **FORMULAS}.items():
        ends = [found[f"{name}_{end}"].values[0, 0] for end in ("low", "high")]
        values = formula(tau)
        low, high = values.min(), values.max()
        if name in ("pole", "even") and tau[0] < 0.1234567 < tau[-1]:
            low, high = -np.inf if name == "pole" else low, np.inf
        np.testing.assert_allclose(ends, [low, high], rtol=1e-6, atol=1e-8, err_msg=name)
        assert found[f"{name}_low"].values[1, 0] == found[f"{name}_high"].values[1, 0] == found[name].values[1, 0]


def test_a_pole_that_is_struck_has_no_bounds() -> None:
    """There the value is infinite; next to it, the largest number there is. NumPy does not complain about either."""
    found = pt.steady(Rubbing(), {"w": 0.0, "load": 0.0}, outputs=["struck"])
    assert (found["struck_low"].item(), found["struck_high"].item()) == (-np.inf, np.inf)


class Two(pt.Component):
    """Two bearings on the shaft."""

    one: Rubbing = Rubbing()
    other: Rubbing = Rubbing()
    w: pt.Input = pt.signal_input("rad/s", "Speed")
    product: pt.Variable = pt.variable("1", "Of both torques")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.w, self.one.w, self.other.w)
        yield self.one.load.value == 0.0
        yield self.other.load.value == 1.0
        yield self.product == (self.one.tau - self.other.tau) ** 2


def test_two_laws_at_rest() -> None:
    """tau_1 in -2..2 and tau_2 in -3..1: their difference lies between -3 and 5, and its square is zero on a line between two ends."""
    found = pt.steady(Two(), {"w": 0.0}, outputs=["product", "one.bump", "other.tau"])
    assert found.status.item() == STUCK
    assert found["product_high"].item() == pytest.approx(25.0)
    assert found["product_low"].item() == pytest.approx(0.0, abs=1e-9)
    assert found["one.bump_high"].item() == pytest.approx(1.0, rel=1e-9)
    assert (found["other.tau_low"].item(), found["other.tau_high"].item()) == pytest.approx((-3.0, 1.0))


class HeldGear(pt.Component):
    """A load, a bearing, a lossy gear, and a motor that holds it."""

    load: pt.Input = pt.signal_input("N.m", "Load")
    pull: rot.Torque = rot.Torque()
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=((0.0, LIMIT),))
    gear: rot.Gear = rot.Gear(ratio=1.0, efficiency=0.9)
    motor: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.load, self.pull.tau)
        yield pt.connect(self.pull.flange, self.bearing.flange_a)
        yield pt.connect(self.bearing.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.motor.flange)


@pytest.mark.parametrize("load", [LIMIT, -LIMIT, 1.1 * LIMIT, 0.3 * LIMIT])
def test_a_law_that_rests_only_where_another_law_gives_it_a_torque(load: float) -> None:
    """Where the load is the limit of the bearing, the gear carries no torque, and has no width, at one end."""
    found = pt.steady(HeldGear(), {"load": load}, outputs=["gear.tauLoss", "motor.flange.tau"])
    carried = load + np.array([-LIMIT, LIMIT])
    losses = np.concatenate([0.1 * carried, (1 - 1 / 0.9) * carried])
    needed = np.concatenate([0.9 * carried, carried / 0.9])
    assert found.status.item() == STUCK
    for name, values in (("gear.tauLoss", losses), ("motor.flange.tau", needed)):
        ends = [found[f"{name}_{end}"].item() for end in ("low", "high")]
        np.testing.assert_allclose(ends, [values.min(), values.max()], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("load", "end"), [(LIMIT, "high"), (-LIMIT, "low")])
def test_derivatives_at_the_ends_are_those_of_the_values_there(load: float, end: str) -> None:
    """At the end where the gear carries the load and the torque of the bearing, in the worse of both directions of power."""
    found = pt.steady_gradient(HeldGear(), {"load": load}, "load", outputs=["motor.flange.tau"])
    assert found[f"motor.flange.tau_{end}"].item() == pytest.approx(2.0 * load / 0.9, rel=1e-9)
    assert found[f"d(motor.flange.tau)/d(load)_{end}"].item() == pytest.approx(1.0 / 0.9, rel=1e-9)


def test_affine_outputs_alone() -> None:
    found = pt.steady(Rubbing(), {"w": 0.0, "load": [0.0, 1.0]}, outputs=["tau", "affine"])
    np.testing.assert_allclose(found["affine_low"], [-5.0, -8.0])
    np.testing.assert_allclose(found["affine_high"], [7.0, 4.0])


class Nearly(pt.Component):
    """Outputs that the torque of the bearing all but leaves alone."""

    rub: Rubbing = Rubbing()
    same: pt.Variable = pt.variable("1", "Changes by 4e-11")
    other: pt.Variable = pt.variable("1", "Changes by 4e-8")

    def equations(self) -> pt.Equations:
        yield self.rub.w.value == 0.0
        yield self.rub.load.value == 0.0
        yield self.same == 1 + 1e-11 * self.rub.tau
        yield self.other == 1 + 1e-8 * self.rub.tau


def test_only_values_that_differ_by_round_off_are_one() -> None:
    found = pt.steady(Nearly(), {}, outputs=["same", "other"])
    assert found.status.item() == STUCK
    assert found["same"].item() == pytest.approx(1.0)
    assert np.isnan(found["other"].item())


def test_no_place_between_the_ends_is_the_mode_of_a_stuck_law() -> None:
    """From -1 to 1, and from 1 to -1: the middle is not exactly zero, and every other place is where it should be."""
    ends: Any = SimpleNamespace(first=np.array([[-1.0], [1.0]]), last=np.array([[1.0], [-1.0]]))
    parts = np.linspace(0.0, 1.0, 5)
    sides = StuckLine.sides(ends, parts, np.zeros(5, np.intp))
    assert (sides != friction.STUCK).all()
    np.testing.assert_allclose(sides, [2 * parts - 1, 1 - 2 * parts], atol=1e-14)


def test_a_law_that_rests_at_one_end_alone_stays_where_it_is() -> None:
    """The first law goes from limit to limit; the second rests at the first end, the third at the last one; the fourth slides."""

    def end(modes: list[float], rest: list[bool]) -> Points:
        column = np.array(rest)[:, None]
        return Points(np.zeros((0, 1)), np.array(modes)[:, None], np.zeros(1, np.int8), column, column)

    first = end([1.0, -1.0, 1.0, 1.0], [True, True, False, False])
    last = end([-1.0, 1.0, -1.0, 1.0], [True, False, True, False])
    line = StuckLine(SimpleNamespace(), np.zeros((0, 1)), first, last, np.zeros(1, np.intp))  # type: ignore[arg-type]
    np.testing.assert_allclose(line.sides(np.array([0.25]), np.zeros(1, np.intp)).ravel(), [0.5, -1.0, -1.0, 1.0])
