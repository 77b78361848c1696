"""The manual gearbox: gears, neutral between them, and what a synchroniser does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import TimeTable
from powertrain.components.differentials import ChurningLoss
from powertrain.components.rotational import Clutch, ConstantTorque, IdealGear, Inertia
from powertrain.components.transmissions import (
    Automatic,
    DualClutchGearbox,
    ManualGearbox,
    PowerShiftGearbox,
    SynchronisedGearbox,
)

J_1, J_2, TORQUE = 0.1, 0.5, 40.0
CONE = Clutch(fn_max=TORQUE, mue_pos=((0.0, 1.0),))
BOX = pt.replace(
    ManualGearbox.of_ratios(3.0, 1.5, 1.0, synchroniser=CONE),
    input=Inertia(J=J_1),
    output=Inertia(J=J_2),
    churning=ChurningLoss(),
)


class Shifted(pt.Component):
    """A gearbox whose lever moves by a table, with both ends free."""

    lever: TimeTable
    box: ManualGearbox = BOX

    def equations(self) -> pt.Equations:
        yield pt.connect(self.lever.y, self.box.lever)


@pytest.mark.parametrize(("gear", "ratio"), [(1, 3.0), (2, 1.5), (3, 1.0)])
def test_synchroniser_brings_both_shafts_to_one_speed(gear: int, ratio: float) -> None:
    """The slip falls at T (1/J_2 + 1/(r^2 J_1)); what stays is the momentum r J_1 w_1 at the output."""
    lever = TimeTable(table=((0.0, gear - 0.5), (0.1, gear - 0.5), (0.1, float(gear))))
    result = pt.simulate(Shifted(lever=lever), stop=2.0, starts={"box.input.w": 90.0, "box.output.w": 0.0}, rtol=1e-9)
    after = J_1 * ratio * 90 / (J_1 * ratio**2 + J_2)
    assert result["box.output.w"][-1] == pytest.approx(after, rel=1e-9)
    assert result["box.input.w"][-1] == pytest.approx(ratio * after, rel=1e-9)
    stuck = next(e for e in result.events if e.name == f"box.synchronisers[{gear - 1}].mode" and e.new == 0)
    assert stuck.time == pytest.approx(0.1 + 90 / ratio / (TORQUE * (1 / J_2 + 1 / (ratio**2 * J_1))), rel=1e-8)
    audit = pt.energy_audit(result)
    lost = J_1 * 90**2 / 2 - (J_1 * ratio**2 + J_2) * after**2 / 2
    assert audit.components.loc["box", "lost"] == pytest.approx(lost, rel=1e-6)
    assert audit.closure < 1e-9


@pytest.mark.parametrize("lever", [0.0, 0.5, 1.5, 2.5, 3.5])
def test_neutral(lever: float) -> None:
    result = pt.simulate(
        Shifted(lever=TimeTable(table=((0.0, lever),))), stop=1.0, starts={"box.input.w": 90.0, "box.output.w": 7.0}
    )
    np.testing.assert_allclose(result["box.input.w"], 90, rtol=1e-12)
    np.testing.assert_allclose(result["box.output.w"], 7, rtol=1e-12)


def test_half_pressed_synchroniser_carries_half() -> None:
    result = pt.simulate(
        Shifted(lever=TimeTable(table=((0.0, 1.75),))), stop=0.1, starts={"box.input.w": 90.0, "box.output.w": 0.0}
    )
    assert result["box.output.w"][-1] == pytest.approx(TORQUE / 2 / J_2 * 0.1, rel=1e-9)


def test_gears_and_synchronisers_are_as_many() -> None:
    with pytest.raises(pt.ParameterError, match="1 gears have 2 synchronisers"):
        pt.compile(ManualGearbox(gears=(IdealGear(ratio=2),), synchronisers=(CONE,) * 2))


class Launched(pt.Component):
    """A gearbox in first gear between the torque of an engine and the inertia of a car."""

    box: ManualGearbox = ManualGearbox()
    engine: ConstantTorque = ConstantTorque(tau_constant=390.0)
    car: Inertia = Inertia(J=10.0)
    lever: TimeTable = TimeTable(table=((0.0, 1.0),))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.box.flange_a)
        yield pt.connect(self.box.flange_b, self.car.flange_a)
        yield pt.connect(self.lever.y, self.box.lever)


def test_a_gear_that_is_in_holds_a_strong_engine() -> None:
    """390 N.m become 1,404 N.m behind 3.6, which the dogs hold."""
    result = pt.simulate(Launched(), 1.0)
    assert result["box.input.w"][-1] == pytest.approx(3.6 * result["box.output.w"][-1], rel=1e-9)
    assert result["car.w"][-1] > 100


def test_cones_slide_until_the_dogs_are_in() -> None:
    """Cones of 139 N.m take a speed difference away in J dw/T; a larger torque leaves the gear out."""
    cone = 3 * 0.1 * 0.035 / np.sin(np.radians(6.5)) * 1500
    lever = TimeTable(table=((0.0, 0.5), (0.1, 0.5), (0.1, 1.0)))
    box = pt.replace(BOX, synchronisers=ManualGearbox().synchronisers[:3])
    result = pt.simulate(Shifted(lever=lever, box=box), stop=1.0, starts={"box.input.w": 90.0, "box.output.w": 0.0})
    stuck = next(e for e in result.events if e.name == "box.synchronisers[0].mode" and e.new == 0)
    assert stuck.time - 0.1 == pytest.approx(30 / (cone * (1 / J_2 + 1 / (9 * J_1))), rel=3e-3)
    lost = pt.simulate(Launched(), 1.0, starts={"box.input.w": 90.0})
    assert lost["box.synchronisers[0].tau"][-1] == pytest.approx(-cone, rel=3e-3)
    assert lost["box.input.w"][-1] > 1000


@pytest.mark.parametrize("kind", [ManualGearbox, DualClutchGearbox, SynchronisedGearbox])
@pytest.mark.parametrize(
    ("ratios", "said"),
    [
        ((), r"of_ratios: give the ratio of every gear, first gear first"),
        (([],), r"of_ratios: give the ratio of every gear, first gear first"),
        (([3.6, 2.1], 1.4), r"of_ratios: ratio of gear 1 = \[3.6, 2.1\] is not a number"),
        ((3.6, "2.1"), r"of_ratios: ratio of gear 2 = '2.1' is a text without a unit"),
        ((3.6, -2.1), r"of_ratios: ratio of gear 2 = -2.1 is outside its range \(0, inf\)"),
        ((3.6, float("nan")), r"of_ratios: ratio of gear 2 = nan is outside its range"),
    ],
)
def test_ratios_that_are_none(kind: Any, ratios: tuple[Any, ...], said: str) -> None:
    """The errors spoke of ``IdealGear.ratio``; no ratio at all gave a gearbox without gears."""
    with pytest.raises(pt.ParameterError, match=rf"^{kind.__name__}\.{said}"):
        kind.of_ratios(*ratios)


@pytest.mark.parametrize("kind", [ManualGearbox, DualClutchGearbox, SynchronisedGearbox])
def test_ratios_in_a_list(kind: Any) -> None:
    for ratios in ([3.6, 2.1, 1.4], (3.6, 2.1, 1.4), np.array([3.6, 2.1, 1.4])):
        assert kind.of_ratios(ratios) == kind.of_ratios(3.6, 2.1, 1.4)


@pytest.mark.parametrize(
    ("ratios", "said"),
    [(3.6, "= 3.6 is not a row"), ((3.6, "2"), "is not a row"), ([3.6, float("nan")], "not a row of finite numbers")],
)
def test_a_row_of_numbers(ratios: Any, said: str) -> None:
    assert PowerShiftGearbox(ratios=[3.6, 2.1]) == PowerShiftGearbox(ratios=(3.6, 2.1))  # type: ignore[arg-type]
    with pytest.raises(pt.ParameterError, match=f"^PowerShiftGearbox.ratios.* {said}"):
        PowerShiftGearbox(ratios=ratios)


@pytest.mark.parametrize("kind", [ManualGearbox, DualClutchGearbox, SynchronisedGearbox])
@pytest.mark.parametrize(
    ("ratios", "said"),
    [
        ((0.7, 1.0, 1.4, 2.1, 3.6), r"gears\[0\].ratio = 0.7, gears\[1\].ratio = 1"),  # the other way round
        ((3.6, 2.1, 14, 1.0), r"gears\[1\].ratio = 2.1, gears\[2\].ratio = 14"),  # a decimal point is missing
        ((3.6, 2.1, 2.1, 1.0), r"gears\[1\].ratio = 2.1, gears\[2\].ratio = 2.1"),
    ],
)
def test_ratios_decrease_from_gear_to_gear(kind: Any, ratios: tuple[float, ...], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=rf"{kind.__name__}: yield from ratios_decrease.*\n.* {said}"):
        kind.of_ratios(*ratios)


@pytest.mark.parametrize("gearbox", [ManualGearbox(), DualClutchGearbox(), Automatic()])
@pytest.mark.parametrize("k", [0, -1, 99, 2.0, True])
def test_a_gear_that_is_none(gearbox: Any, k: Any) -> None:
    with pytest.raises(pt.ParameterError, match=rf"in_gear\({k}\): choose a gear from 1 to {gearbox.gear_count}"):
        gearbox.in_gear(k)
