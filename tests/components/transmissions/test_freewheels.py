"""Freewheels as shift elements: closed forms of a Simpson set in drive and overrun, shifts with one clutch, directions."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gears_by_hand import by_hand

import powertrain as pt
from powertrain.components.blocks import Constant, TimeTable
from powertrain.components.rotational import Inertia, OneWayClutch, Torque
from powertrain.components.transmissions import (
    CR_CR_FOUR,
    CR_CR_FREEWHEELS,
    EIGHT_SPEED,
    LEPELLETIER_SIX,
    NINE_SPEED,
    RAVIGNEAUX_FOUR,
    SEVEN_SPEED,
    SIMPSON_FREEWHEEL,
    SIMPSON_THREE,
    TEN_SPEED,
    Automatic,
    GearScheme,
    SchemeGear,
    ShiftElement,
    planetary,
)
from powertrain.trials import gear_table
from powertrain.vehicles import AutomaticCar

RHO = 30 / 66
"""Teeth of the sun over teeth of the ring, in both sets."""
FIRST, SECOND = 2 + RHO, 1 + RHO
LOSSLESS = {"churning.d": 0.0, **{f"levers[{k}].{eta}": 1.0 for k in (0, 1) for eta in ("eta_ab", "eta_ba")}}
CARRIED = 1 + RHO
"""Torque of the freewheel over that of the input in first gear: the housing takes the difference between output and input."""


def lossless(**options: Any) -> Automatic:
    return pt.replace(Automatic.of(SIMPSON_FREEWHEEL, **options), LOSSLESS)


def test_closed_forms_of_a_simpson_set() -> None:
    """The two sets in series: w_ring - w_out = -rho (w_suns - w_out), w_out - w_carrier = -rho (w_suns - w_carrier)."""
    ratios = [SIMPSON_FREEWHEEL.ratio(name) for name in "123R"]
    np.testing.assert_allclose(ratios, (FIRST, SECOND, 1.0, -1 / RHO), rtol=1e-12)
    assert SIMPSON_FREEWHEEL.torque_factor("1", "freewheel") == pytest.approx(CARRIED)
    assert SIMPSON_FREEWHEEL.torque_factor("1", "low") == pytest.approx(CARRIED)
    assert [SIMPSON_FREEWHEEL.freewheels(name) for name in "123R"] == [("freewheel",), (), (), ()]


@pytest.mark.slow
def test_first_gear_in_drive_and_overrun() -> None:
    """It drives; it does not carry overrun, unless the low brake is pressed; the freewheel then carries nothing."""
    drive: Any = gear_table(lossless())
    overrun: Any
    held: Any
    overrun, held = (gear_table(box, -100.0) for box in (lossless(), lossless(coast=1.0)))
    assert drive.loc["1", "freewheel"] == pytest.approx(-100 * CARRIED)  # the torque of flange_b
    assert np.isnan(drive.loc["1", "low"])
    assert overrun.loc["1"].isna().all()
    assert overrun.loc["2", "ratio"] == pytest.approx(SECOND)
    assert held.loc["1", "ratio"] == pytest.approx(FIRST)
    assert held.loc["1", "low"] == pytest.approx(100 * CARRIED)
    assert held.loc["1", "freewheel"] == pytest.approx(0.0, abs=1e-6)


def without_freewheels(scheme: GearScheme, gear: str) -> GearScheme:
    """The scheme of a gear held by its elements for overrun; the clutch at the idle race of a freewheel carries nothing."""
    row = scheme.gear(gear)
    elements = tuple(element for element in scheme.elements if not element.freewheel and "race" not in element.joint)
    engaged = tuple(each.name for each in elements if each.name in (*row.engaged, *row.coast))
    return GearScheme(scheme.levers, elements, (SchemeGear(gear, engaged),))


@pytest.mark.slow
@pytest.mark.parametrize("scheme", [SIMPSON_FREEWHEEL, CR_CR_FREEWHEELS], ids=["Simpson", "CR-CR"])
@pytest.mark.parametrize(("torque", "coast"), [(100.0, 0.0), (-100.0, 0.0), (-100.0, 1.0)])
def test_tables_with_losses(scheme: GearScheme, torque: float, coast: float) -> None:
    """Efficiency and torques by hand: the freewheels hold with positive torque, the elements for overrun with negative torque."""
    table: Any = gear_table(pt.replace(Automatic.of(scheme, coast=coast), {"churning.d": 0.0}), torque)
    for gear in scheme.forward:
        if torque < 0 and scheme.freewheels(gear.name) and not coast:
            assert table.loc[gear.name].isna().all()
            continue
        ratio, tau, held = by_hand(scheme if torque > 0 else without_freewheels(scheme, gear.name), gear.name, torque)
        row: Any = table.loc[gear.name]
        assert row["ratio"] == pytest.approx(ratio, rel=1e-9)
        assert row["efficiency"] == pytest.approx(abs(tau / (torque * ratio)) ** np.sign(torque), rel=1e-8)
        for element, (low, high) in held.items():
            assert low - 1e-6 <= abs(row[element]) <= high + 1e-6


def test_an_overrunning_freewheel_has_an_operating_point() -> None:
    """In fourth gear the sprag overruns, also with negative torque; with the load free instead of its speed, none was found."""
    table: Any = gear_table(Automatic.of(CR_CR_FREEWHEELS), -100.0)
    assert table.loc["4", "ratio"] == pytest.approx(CR_CR_FREEWHEELS.ratio("4"))
    assert table.loc["3"].isna().all()


@pytest.mark.parametrize("torque", [0.0, 0.05, 0.1, 0.5, 1.0])
def test_an_idle_freewheel_leaves_its_gear_determined(torque: float) -> None:
    """In reverse the race of the sprag may run ahead at any speed. The drag of 2 N.m exceeds the torque of the input."""
    table: Any = gear_table(Automatic.of(CR_CR_FREEWHEELS), torque)
    assert table.loc["R", "ratio"] == pytest.approx(CR_CR_FREEWHEELS.ratio("R"), rel=1e-9)
    assert table.loc["R", "reverse"] == pytest.approx(2.0 - torque, rel=1e-9)
    assert table.loc["R", "sprag"] == pytest.approx(0.0, abs=1e-6)
    assert np.isnan(table.loc["R", "efficiency"])


@pytest.mark.slow
@pytest.mark.parametrize("coast", [0.2, 0.3])
def test_elements_for_overrun_hold_the_torque_for_which_they_are_pressed(coast: float) -> None:
    """The low brake is sized for 1.5 times the 400 N.m of reverse gear, in which it carries 1 + 1/rho of the input's torque."""
    holds = coast * 600 * (1 + 1 / RHO) / CARRIED
    gear_table(lossless(coast=coast), -0.99 * holds)
    gear_table(lossless(coast=coast), 599.0)
    with pytest.raises(pt.ParameterError) as caught:
        gear_table(lossless(coast=coast), -1.01 * holds)
    assert f"in gear 1: element low in gear 1 with coast = {coast} holds {holds:.4g} N.m at the input" in str(
        caught.value
    )


class Bench(pt.Component):
    """A gearbox between an engine's inertia and a car's, with a lever and a torque by tables."""

    box: Automatic
    lever: TimeTable | Constant = Constant(k=1.0)
    torque: TimeTable | Constant = Constant(k=100.0)
    drive: Torque = Torque()
    engine: Inertia = Inertia(J=0.15)
    car: Inertia = Inertia(J=150.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.y, self.drive.tau)
        yield pt.connect(self.drive.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.box.flange_a)
        yield pt.connect(self.box.flange_b, self.car.flange_a)
        yield pt.connect(self.lever.y, self.box.lever)


def run(bench: Bench, stop: float, gear: str = "1", torque: float = 100.0) -> pt.Result[Bench]:
    starts = {"car.w": 60.0, "engine.w": 60.0 * SIMPSON_FREEWHEEL.ratio(gear), "box.tau_in": torque}
    return pt.simulate(bench, stop, points=1000 * round(stop) + 1, starts=starts, rtol=1e-8)


UP_AND_DOWN = TimeTable(table=((0.0, 1.0), (1.0, 1.0), (1.8, 2.0), (3.0, 2.0), (3.8, 1.0)))
PATHS = {element.name: f"box.elements[{k}]" for k, element in enumerate(SIMPSON_FREEWHEEL.elements)}


def test_first_to_second_and_back_with_one_brake() -> None:
    """Only the brake of second gear is controlled; the freewheel hands its torque over and takes it back.

    The torques balance those of the input while nothing accelerates: T = T_f/(1 + rho) + T_k/rho.
    """
    light = Automatic.of(SIMPSON_FREEWHEEL, J=1e-3)
    result = run(Bench(box=pt.replace(light, LOSSLESS), lever=UP_AND_DOWN, car=Inertia(J=1e3)), 5.0)
    t, ratio = result.time, result["engine.w"] / result["car.w"]
    assert ratio[(t > 0.5) & (t < 1.0)] == pytest.approx(FIRST, rel=1e-6)
    assert ratio[(t > 1.85) & (t < 3.0)] == pytest.approx(SECOND, rel=1e-6)
    assert ratio[t > 3.8] == pytest.approx(FIRST, rel=1e-6)
    assert ratio.max() < FIRST * (1 + 1e-6)  # a freewheel does not overshoot
    assert np.abs(result[f"{PATHS['low']}.fn"]).max() == 0.0
    assert np.abs(result[f"{PATHS['freewheel']}.f_normalized"]).max() == 0.0
    carries, brakes = result[f"{PATHS['freewheel']}.tau"], result[f"{PATHS['kickdown']}.tau"]
    phase = ((t > 1.02) & (t < 1.18)) | ((t > 3.62) & (t < 3.78))
    assert -carries[phase] / CARRIED - brakes[phase] / RHO == pytest.approx(100.0, rel=5e-3)  # less what inertias take
    assert carries.max() < 1e-3  # within the tolerance of the run
    assert (result["box.flange_b.tau"][t > 0.5] < 0).all()  # the two never work against each other
    assert pt.energy_audit(result).closure < 1e-6


def test_the_output_overruns_in_first_gear() -> None:
    """Torque 100, -60 and 100 N.m: the engine falls behind with its own inertia alone, does not brake, and is caught where it left."""
    torque = TimeTable(table=((0.0, 100.0), (1.0, 100.0), (1.0, -60.0), (1.5, -60.0), (1.5, 100.0)))
    result = run(Bench(box=lossless(J=1e-5), torque=torque), 4.0)
    t, ratio = result.time, result["engine.w"] / result["car.w"]
    free = (t > 1.0) & (t < 1.5)
    w = result.at(1.0, "engine.w")
    assert result["engine.w"][free] == pytest.approx(w - 60 / 0.15 * (t[free] - 1.0), abs=0.15)  # shafts: 7e-4 of J
    assert np.ptp(result["car.w"][free]) < 1e-3
    assert np.abs(result["box.flange_b.tau"][free]).max() < 0.05
    assert ratio[t > 2.0] == pytest.approx(FIRST, rel=1e-6)
    assert pt.energy_audit(result).closure < 1e-6


def test_an_upshift_pulls_an_input_up_that_has_fallen_behind() -> None:
    """The brake of second gear pulls with k_slip times the lag, so the lag ends as T/k_slip; without that it was 27 rad/s until the end."""
    lever = TimeTable(table=((0.0, 1.0), (0.1, 1.0), (0.9, 2.0)))
    bench = Bench(box=lossless(J=1e-4), lever=lever, torque=Constant(k=-20.0))
    starts = {"car.w": 60.0, "engine.w": 60.0, "box.tau_in": -20.0}
    result = pt.simulate(bench, 1.2, points=1201, starts=starts, rtol=1e-8)
    lag = SECOND * result["car.w"] - result["engine.w"]
    assert lag[result.time < 0.3].min() > 26  # nothing pulls in the first torque phase
    assert lag[np.searchsorted(result.time, 0.69)] == pytest.approx(20 / 8.0, rel=0.03)  # still decreasing
    assert lag[result.time > 0.95] == pytest.approx(0.0, abs=1e-4)


def test_overrun_with_the_low_brake() -> None:
    """The car drives the engine, at the output by the whole ratio."""
    result = run(Bench(box=lossless(coast=1.0), torque=Constant(k=-60.0), car=Inertia(J=1e5)), 2.0, torque=-60.0)
    assert result["engine.w"][result.time > 1.0] / result["car.w"][result.time > 1.0] == pytest.approx(FIRST)
    assert result.at(1.9, "box.flange_b.tau") == pytest.approx(60 * FIRST, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("coast", "torque"), [(0.0, 100.0), (1.0, 100.0), (1.0, -60.0)])
@pytest.mark.parametrize("scheme", [SIMPSON_FREEWHEEL, CR_CR_FREEWHEELS], ids=["Simpson", "CR-CR"])
def test_all_shifts_up_and_down(scheme: GearScheme, coast: float, torque: float) -> None:
    """Through all gears and back, driving, and in overrun with the elements for it."""
    top = len(scheme.forward)
    steps = [*range(1, top + 1), *range(top - 1, 0, -1)]
    rows = [(0.0, 1.0)]
    for k, gear in enumerate(steps[1:], 1):
        rows += [(1.5 * k, rows[-1][1]), (1.5 * k + 0.8, float(gear))]
    bench = Bench(box=Automatic.of(scheme, coast=coast), lever=TimeTable(table=tuple(rows)), torque=Constant(k=torque))
    starts = {"car.w": 100.0, "engine.w": 100.0 * scheme.ratio("1"), "box.tau_in": torque}
    result = pt.simulate(bench, 1.5 * len(steps), points=6001, starts=starts, rtol=1e-8)
    ratio = result["engine.w"] / result["car.w"]
    for k, gear in enumerate(steps):
        now = (result.time > 1.5 * k + 0.9) & (result.time < 1.5 * k + 1.5)
        assert ratio[now] == pytest.approx(scheme.ratio(scheme.forward[gear - 1].name), rel=1e-5)
    if not coast:  # the elements never work against each other
        assert result["box.flange_b.tau"][result.time > 0.5].max() < 0
    assert pt.energy_audit(result).closure < 1e-6


def test_a_gear_alone_keeps_its_freewheel() -> None:
    """Maps must not find engine braking where there is none; with the low brake pressed the gear is rigid."""
    alone = Automatic.of(SIMPSON_FREEWHEEL).in_gear(1)
    assert [type(part) for part in alone.elements] == [OneWayClutch]
    overrun, drive = (gear_table(alone, torque).to_numpy() for torque in (-100.0, 100.0))
    assert np.isnan(overrun).all()
    assert drive[0, 0] == pytest.approx(FIRST)
    assert not Automatic.of(SIMPSON_FREEWHEEL, coast=1.0).in_gear(1).elements
    assert not Automatic.of(SIMPSON_FREEWHEEL).in_gear(2).elements


def test_a_freewheel_in_a_parameter_file(tmp_path: Path) -> None:
    car = AutomaticCar.with_gearset(Automatic.of(SIMPSON_FREEWHEEL, coast=1.0))
    pt.vehicles.save(car, tmp_path / "car.toml")
    assert pt.vehicles.load(tmp_path / "car.toml") == car


def scheme_of(elements: dict[str, str], gears: dict[str, str | Sequence[str]]) -> GearScheme:
    front = planetary("front", "suns", "ring", "out", teeth=(30, 66))
    rear = planetary("rear", "suns", "out", "carrier", teeth=(30, 66))
    whole = {"F": "in-ring", "D": "in-suns", "I": "suns-housing", "L": "carrier-housing"}
    return GearScheme.of(front, rear, elements=whole | elements, gears=gears)


LATER: dict[str, str | Sequence[str]] = {"2": "F I", "3": "F D"}


@pytest.mark.parametrize(
    ("elements", "gears", "said"),
    [
        (
            {"sprag": "carrier->housing"},
            {"1": "F sprag"},
            r"gear 1 \(F, sprag\): .* the freewheel sprag does not hold, the housing runs ahead of shaft carrier; "
            "reversed it is housing->carrier",
        ),
        (
            {"sprag": "carrier->housing"},
            {"1": "F L"},
            r"gear 2 \(F, I\): the freewheel sprag blocks, because the housing would fall behind shaft carrier by .* input",
        ),
        (  # the freewheel of a higher gear: first gear would turn it backward
            {"sprag": "housing->suns"},
            {"1": "F L", "2": "F sprag"},
            r"gear 1 \(F, L\): the freewheel sprag blocks, because shaft suns would fall behind the housing",
        ),
        (
            {"sprag": "housing->carrier"},
            {"1": "F sprag L"},
            r"gear 1 .*: the other elements hold the gear without the freewheel",
        ),
        ({"sprag": "housing->carrier"}, {"1": "F L (I)"}, r"gear 1 \(F, L, \(I\)\): no freewheel carries torque"),
        (
            {"sprag": "housing->carrier"},
            {"1": "F sprag (I)"},
            "with I in place of sprag the speed of shaft .* another gear",
        ),
        (
            {"sprag": "housing->carrier"},
            {"1": "F sprag (L I)"},
            "with L, I in place of sprag the gear has 0 degrees of freedom",
        ),
        ({"sprag": "housing->carrier"}, {"1": "F (sprag)"}, r"gear 1 .*: .* 2 degrees of freedom"),
        (
            {"sprag": "housing->carrier"},
            {"1": ("F", "sprag", "(sprag)")},
            "the freewheel sprag cannot be pressed for overrun",
        ),
        ({"sprag": "housing->carrier"}, {"1": "F sprag (L"}, "gear 1: the parenthesis before L is not closed"),
        (
            {"sprag": "housing->carrier"},
            {"1": "F sprag (X)"},
            "gear 1 engages 'X'; the shift elements are F, D, I, L, sprag",
        ),
    ],
)
def test_freewheels_that_cannot_be(elements: dict[str, str], gears: dict[str, str | Sequence[str]], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        scheme_of(elements, LATER | gears if list(gears) == ["1", "2"] else gears | LATER)


PLAIN = SIMPSON_THREE, RAVIGNEAUX_FOUR, CR_CR_FOUR, LEPELLETIER_SIX, SEVEN_SPEED, EIGHT_SPEED, NINE_SPEED, TEN_SPEED


@pytest.mark.parametrize("scheme", PLAIN)
def test_every_opening_element_may_be_a_freewheel_and_no_closing_one(scheme: GearScheme) -> None:
    """In an upshift, an element that opens could be a freewheel in its gear, overrunning in the next; one that closes would jam before."""
    for low, high in pairwise(scheme.forward):
        for held, other, overruns in ((low, high, True), (high, low, False)):
            (name,) = set(held.engaged) - set(other.engaged)
            element = next(each for each in scheme.elements if each.name == name)
            a, b = element.joint if scheme.slip_factor(held.name, name) > 0 else element.joint[::-1]
            freewheel = ShiftElement(name, a, b, freewheel=True)
            elements = tuple(freewheel if each is element else each for each in scheme.elements)
            if overruns:
                assert GearScheme(scheme.levers, elements, (low, high)).freewheels(low.name) == (name,)
            else:
                with pytest.raises(pt.ParameterError, match=f"gear {low.name} .* the freewheel {name} blocks"):
                    GearScheme(scheme.levers, elements, (low, high))


def test_names_with_spaces_and_parentheses() -> None:
    gear = SchemeGear.of("1", ["forward clutch", "B(1)", "(rear band)"])
    assert gear == SchemeGear("1", ("forward clutch", "B(1)"), ("rear band",))
    assert SchemeGear.of("1", "A (B C)") == SchemeGear.of("1", "A (B) (C)") == SchemeGear("1", ("A",), ("B", "C"))


def th400() -> GearScheme:
    """Intermediate clutch and sprag in series, and the front band beside both, as in the GM TH400."""
    return scheme_of(
        {"roller": "housing->carrier", "C": "race-housing", "sprag": "race->suns"},
        {"1": "F roller sprag (L)", "2": "F C sprag (I)", "3": "F D C", "R": "D L sprag"},
    )


def test_an_idle_race() -> None:
    """In first gear the race idles with the suns."""
    scheme = th400()
    assert scheme.freewheels("1") == ("roller",)
    assert scheme.freewheels("2") == ("sprag",)
    assert scheme.torque_factor("1", "sprag") == 0.0
    assert scheme.torque_factor("2", "sprag") == pytest.approx(RHO)
    assert scheme.ratio("2") == pytest.approx(SECOND)


def test_a_band_beside_a_freewheel_closes_last() -> None:
    """An upshift with both pressed would brake the input twice; the band waits for the last phase, and the run is that without it."""
    lever = TimeTable(table=((0.0, 1.0), (1.0, 1.0), (1.8, 2.0), (2.5, 2.0), (3.3, 3.0)))
    one, both = (run(Bench(box=Automatic.of(th400(), coast=c), lever=lever), 4.0) for c in (0.0, 1.0))
    band = f"box.elements[{[element.name for element in th400().elements].index('I')}]"
    assert np.abs(both[f"{band}.fn"][(both.time > 0.2) & (both.time < 1.6)]).max() < 1e-9
    assert both.at(2.2, f"{band}.fn") > 100
    for time in (1.3, 1.5, 1.9, 2.8, 3.0, 3.9):
        ratios = [result.at(time, "engine.w") / result.at(time, "car.w") for result in (one, both)]
        assert ratios[1] == pytest.approx(ratios[0], rel=2e-3)
    assert both.at(3.9, "engine.w") / both.at(3.9, "car.w") == pytest.approx(1.0, rel=1e-6)
