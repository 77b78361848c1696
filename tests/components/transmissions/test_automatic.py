"""Automatic gearsets: published ratios, efficiencies and torques against a linear solve of one's own, shifts of all four kinds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import few
from gears_by_hand import by_hand

import powertrain as pt
from powertrain.components.blocks import Constant, TimeTable
from powertrain.components.rotational import Inertia, Torque
from powertrain.components.transmissions import (
    CR_CR_FOUR,
    EIGHT_SPEED,
    LEPELLETIER_SIX,
    NINE_SPEED,
    RAVIGNEAUX_FOUR,
    SEVEN_SPEED,
    SIMPSON_FREEWHEEL,
    SIMPSON_THREE,
    TEN_SPEED,
    Automatic,
    DualClutchGearbox,
    GearScheme,
    Lever,
    LumpedGear,
    PowerShiftGearbox,
    planetary,
    ravigneaux,
)
from powertrain.trials import gear_table

SCHEMES = {
    "three": SIMPSON_THREE,
    "four": RAVIGNEAUX_FOUR,
    "cr-cr": CR_CR_FOUR,
    "six": LEPELLETIER_SIX,
    "seven": SEVEN_SPEED,
    "eight": EIGHT_SPEED,
    "nine": NINE_SPEED,
    "ten": TEN_SPEED,
}
PUBLISHED = {
    "three": (2.46, 1.46, 1.00, -2.18),
    "four": (2.40, 1.47, 1.00, 0.67, -2.00),
    "cr-cr": (3.06, 1.62, 1.00, 0.70, -2.29),  # published: 1.63
    "six": (4.171, 2.340, 1.521, 1.143, 0.867, 0.691, -3.403),
    "seven": (4.377, 2.859, 1.921, 1.368, 1.000, 0.820, 0.728, -3.416, -2.231),
    "nine": (4.700, 2.842, 1.909, 1.382, 1.000, 0.808, 0.699, 0.580, 0.479, -3.805),
    "ten": (4.696, 2.985, 2.146, 1.769, 1.520, 1.275, 1.000, 0.854, 0.689, 0.636, -4.866),
    "eight": (4.696, 3.130, 2.104, 1.667, 1.285, 1.000, 0.839, 0.667, -3.297),
}
QUICK = ("three", "four", "cr-cr")
DIGITS = {name: 0.005 if name in QUICK else 5e-4 for name in SCHEMES}
"""Half a unit of the last published digit."""


@pytest.mark.parametrize("name", SCHEMES)
def test_published_ratios(name: str) -> None:
    scheme = SCHEMES[name]
    ratios = [scheme.ratio(gear.name) for gear in (*scheme.forward, *scheme.reverse)]
    np.testing.assert_allclose(ratios, PUBLISHED[name], atol=DIGITS[name])


TABLES = [
    pytest.param(name, torque, marks=() if name in QUICK else pytest.mark.slow)
    for name in SCHEMES
    for torque in (100.0, -100.0)
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "torque"), TABLES)
def test_table_of_a_gearset(name: str, torque: float) -> None:
    """Ratio, efficiency and element torques of all gears that find an operating point, without drag."""
    scheme = SCHEMES[name]
    box = pt.replace(Automatic.of(scheme), {"churning.d": 0.0})
    table = gear_table(box, torque)
    for gear in (*scheme.forward, *scheme.reverse[:1]):
        ratio, tau, held = by_hand(scheme, gear.name, torque)
        row: Any = table.loc[gear.name]
        assert row["ratio"] == pytest.approx(ratio, rel=1e-9)
        efficiency = abs(tau / (torque * ratio)) ** np.sign(torque)
        assert row["efficiency"] == pytest.approx(efficiency, rel=1e-8)
        for element, (low, high) in held.items():
            assert low - 1e-6 <= abs(row[element]) <= high + 1e-6


def test_table_without_torque() -> None:
    """Both ends drive the drag: there is a ratio, but no efficiency."""
    table = gear_table(Automatic.simpson_three_speed(), torque=0.0)
    assert table["efficiency"].isna().all()
    assert table["ratio"].iloc[2] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("box", "options", "said"),
    [
        (PowerShiftGearbox(), {}, "an Automatic; PowerShiftGearbox has none"),
        (DualClutchGearbox(), {}, "an Automatic; DualClutchGearbox has none"),
        (Automatic.simpson_three_speed(), {"speed": 0.0}, "speed = 0 rad/s"),
        (
            Automatic.eight_speed(),
            {"torque": 4000.0},
            "no operating point at 4000 N.m in gear 1.* element .* in gear .* holds 600 N.m at the input",
        ),
    ],
)
def test_tables_that_cannot_be(box: Any, options: dict[str, float], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        gear_table(box, **options)


@pytest.mark.parametrize("J", few([1e-4, 0.01]))
def test_operating_points_do_not_depend_on_inertia(J: float) -> None:
    """At the start of the search the equations are singular up to round-off, which inertia changes."""
    scheme = RAVIGNEAUX_FOUR
    table = gear_table(pt.replace(Automatic.of(scheme, J=J), {"churning.d": 0.0}), -100.0)
    for gear in scheme.gears:
        ratio, tau, _ = by_hand(scheme, gear.name, -100.0)
        assert table.loc[gear.name, "efficiency"] == pytest.approx(abs(-100.0 * ratio / tau), rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", [*QUICK, "six"])
def test_random_losses_inertias_and_torques(name: str, seed: int) -> None:
    """Every gear has its operating point, driving and in overrun, whatever its levers lose and its shafts weigh."""
    rng, scheme = np.random.default_rng(seed), SCHEMES[name]
    levers = tuple(replace(lever, eta=rng.uniform(0.9, 0.999)) for lever in scheme.levers)
    lossy = GearScheme(levers, scheme.elements, scheme.gears)
    box = pt.replace(Automatic.of(lossy, J=10 ** rng.uniform(-4, -1)), {"churning.d": 0.0})
    for torque in rng.uniform(5, 300, 2) * (1, -1):
        table = gear_table(box, torque, rng.uniform(20, 500))
        for gear in (*scheme.forward, *scheme.reverse[:1]):
            ratio, tau, _ = by_hand(lossy, gear.name, torque)
            assert table.loc[gear.name, "efficiency"] == pytest.approx(
                abs(tau / (torque * ratio)) ** np.sign(torque), rel=1e-8
            )


@pytest.mark.parametrize("name", SCHEMES)
def test_torque_factors_are_those_of_the_lossless_set(name: str) -> None:
    scheme = SCHEMES[name]
    lossless = GearScheme(
        tuple(Lever(x.name, x.a, x.b, x.carrier, x.ratio) for x in scheme.levers), scheme.elements, scheme.gears
    )
    for gear in scheme.gears:
        held = by_hand(lossless, gear.name, 1.0)[2]
        for element, (low, high) in held.items():
            assert low == pytest.approx(high, rel=1e-9)
            assert scheme.torque_factor(gear.name, element) == pytest.approx(low, rel=1e-9)


@pytest.mark.slow
def test_a_gearset_in_one_gear_is_the_gearset() -> None:
    """Rigid joints in place of clutches: the same ratio and the same loss."""
    box = Automatic.lepelletier_six_speed()
    whole = gear_table(box)
    for k in (1, 3, 6):
        alone = gear_table(box.in_gear(k))
        for column in ("ratio", "efficiency"):
            assert alone[column].iloc[0] == pytest.approx(whole[column].iloc[k - 1], rel=1e-9)


@pytest.mark.parametrize("name", SCHEMES)
def test_a_lumped_gear_has_the_efficiencies_of_its_gearset(name: str) -> None:
    """By hand, for both directions of power; with the inertia of all shafts at the input."""
    box = Automatic.of(SCHEMES[name], J=0.01)
    for k, gear in enumerate(SCHEMES[name].forward, 1):
        one = box.in_gear(k).lumped()
        assert isinstance(one, LumpedGear)
        ratio, forward, _ = by_hand(SCHEMES[name], gear.name, 1.0)
        assert float(one.ratio) == pytest.approx(ratio, rel=1e-12)
        assert float(one.unit.eta_ab) == pytest.approx(abs(forward) / ratio, rel=1e-12)
        assert float(one.unit.eta_ba) == pytest.approx(
            ratio / abs(by_hand(SCHEMES[name], gear.name, -1.0)[1]), rel=1e-12
        )
        speeds = SCHEMES[name].speeds(gear.name).values()
        assert float(one.input.J) == pytest.approx(0.01 * sum(w**2 for w in speeds), rel=1e-12)


def test_what_no_ratio_stands_for_is_not_lumped() -> None:
    """Freewheels, efficiencies that depend on the load, and a gear that the output cannot drive."""
    free = Automatic.of(SIMPSON_FREEWHEEL).in_gear(1)
    box = Automatic.of(SIMPSON_THREE).in_gear(1)
    curve = pt.Map.curve([0.0, 100.0], [0.9, 0.98], x="tau", x_unit="N.m", unit="1", name="eta", outside="clip")
    mapped = pt.replace(box, {f"levers[{k}].map_ab": curve for k in range(len(box.levers))})
    worm = GearScheme.of(
        Lever("slow", "in", "held", "out", 0.95, 0.9),
        elements={"B": "held-housing"},
        gears={"1": "B"},
        input="out",
        output="in",
    )
    locks = Automatic.of(worm).in_gear(1)
    for one in (free, mapped, locks):
        assert one.lumped() is one


def scheme_of(**gears: str) -> GearScheme:
    front = planetary("front", "suns", "ring", "out", teeth=(33, 72))
    rear = planetary("rear", "suns", "out", "carrier", teeth=(33, 72))
    elements = {"F": "in-ring", "D": "in-suns", "I": "suns-housing", "L": "carrier-housing"}
    return GearScheme.of(front, rear, elements=elements, gears=gears)


@pytest.mark.parametrize(
    ("gears", "said"),
    [
        ({"1": "F L", "2": "F X"}, "gear 2 engages 'X'; the shift elements are F, D, I, L"),
        ({"1": "F"}, r"gear 1 \(F\): .* 2 degrees of freedom"),
        ({"1": "F L I"}, r"gear 1 \(F, L, I\): .* 0 degrees of freedom"),
        ({"1": "F I", "2": "F L"}, "list the forward gears from the highest ratio to the lowest"),
    ],
)
def test_schemes_that_cannot_be(gears: dict[str, str], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        scheme_of(**gears)


@pytest.mark.parametrize(
    ("teeth", "said"),
    [
        ((72, 33), "no planet fits between a sun of 72 and a ring of 33 teeth"),
        ((60, 67), ".* the ring needs at least 8 teeth more"),
        ((-33, 72), "a sun of -33 teeth"),
        ((0, 33), "a sun of 0 teeth"),
        ((33.5, 72), "a sun of 33.5 teeth: the number of teeth must be an integer"),
    ],
)
def test_planetary_gears_that_cannot_be(teeth: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=f"planetary gear f: {said}"):
        planetary("f", "s", "r", "c", teeth=teeth)


@pytest.mark.parametrize(
    ("teeth", "said"),
    [
        ((36, 30, 20), "no planet fits between a sun of 36 and a ring of 20 teeth"),
        ((36, 0, 72), "a sun of 0 teeth"),
        ((30, 36, 72), "the large sun has 30 teeth, and the small sun 36; it needs fewer"),
    ],
)
def test_ravigneaux_sets_that_cannot_be(teeth: Any, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=f"Ravigneaux set of L, S, r, c: {said}"):
        ravigneaux("L", "S", "r", "c", teeth=teeth)


def test_two_elements_at_once() -> None:
    gears = {"1": "C1 B1", "2": "C2 B2"}
    elements = {"C1": "in-sun", "B1": "ring-housing", "C2": "in-ring", "B2": "sun-housing"}
    with pytest.raises(pt.ParameterError, match="2 elements open and 2 close"):
        GearScheme.of(planetary("p", "sun", "ring", "out", teeth=(30, 60)), elements=elements, gears=gears)


def test_parts_of_another_scheme() -> None:
    with pytest.raises(pt.ParameterError, match=r"Automatic.of\(scheme\)"):
        pt.compile(pt.replace(Automatic.simpson_three_speed(), scheme=EIGHT_SPEED))


class Bench(pt.Component):
    """A gearbox between an engine's inertia and a car's, shifted by a table."""

    box: Any
    lever: TimeTable = TimeTable(table=((0.0, 1.0), (1.0, 1.0), (1.6, 2.0)))
    torque: Constant = Constant(k=100.0)
    drive: Torque = Torque()
    engine: Inertia = Inertia(J=0.15)
    car: Inertia = Inertia(J=150.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.y, self.drive.tau)
        yield pt.connect(self.drive.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.box.flange_a)
        yield pt.connect(self.box.flange_b, self.car.flange_a)
        yield pt.connect(self.lever.y, self.box.lever)


BOXES: dict[str, Any] = {
    "automatic": Automatic.simpson_three_speed(),
    "dual clutch": DualClutchGearbox(),
}


def shifted(name: str, torque: float, *, up: bool, **options: Any) -> tuple[pt.Result[Any], float, float]:
    """A shift between gears 1 and 2, with both ratios, the old one first."""
    one, two = (1.0, 2.0) if up else (2.0, 1.0)
    ratios = (
        [SIMPSON_THREE.ratio(k) for k in "12"]
        if name == "automatic"
        else [float(g.ratio) for g in BOXES[name].gears[:2]]
    )
    old, new = ratios if up else ratios[::-1]
    lever = TimeTable(table=((0.0, one), (1.0, one), (1.8, two)))
    bench = Bench(box=BOXES[name], lever=lever, torque=Constant(k=torque))
    starts = {"car.w": 60.0, "engine.w": 60.0 * old, "box.tau_in": torque}
    if name == "dual clutch":  # its synchronisers are weaker than the engine
        starts[f"box.synchronisers[{int(one) - 1}].w_rel"] = 0.0
    return pt.simulate(bench, 3.0, points=3001, starts=starts, **options), old, new


@pytest.mark.slow
@pytest.mark.parametrize("name", BOXES)
@pytest.mark.parametrize("torque", [100.0, -60.0])
@pytest.mark.parametrize("up", [True, False])
def test_shifts_of_all_four_kinds(name: str, torque: float, up: bool) -> None:
    """Power-on and power-off, up and down: from ratio to ratio with less than 3 % of overshoot; energy closes, nothing ties up."""
    result, old, new = shifted(name, torque, up=up, rtol=1e-9)
    ratio = result["engine.w"] / result["car.w"]
    locked = result.time > 0.6  # before that the idle shafts come up to speed
    assert ratio[locked & (result.time < 1.0)] == pytest.approx(old, rel=1e-6)
    assert ratio[result.time > 1.85] == pytest.approx(new, rel=1e-6)
    assert 0.97 * min(old, new) < ratio[locked].min()
    assert ratio[locked].max() < 1.03 * max(old, new)
    assert pt.energy_audit(result).closure < 1e-7
    during = (result.time > 1.0) & (result.time < 1.8)
    force = result["box.flange_b.tau"][during] * np.sign(-torque)
    if torque > 0:  # the torque at the output never reverses: the two elements do not work against each other
        assert force.min() > 0


def test_end_of_the_torque_phase() -> None:
    """Power-on upshift: when the element of the lower gear has opened, the output has the torque of the higher gear, at the old speed."""
    box = pt.replace(
        BOXES["automatic"],
        {"churning.d": 0.0, **{f"levers[{k}].{e}": 1.0 for k in (0, 1) for e in ("eta_ab", "eta_ba")}},
    )
    assert isinstance(box, Automatic)
    bench = Bench(
        box=box, lever=TimeTable(table=((0.0, 1.0), (1.0, 1.0), (1.8, 2.0))), engine=Inertia(J=1e-3), car=Inertia(J=1e4)
    )
    one, two = (SIMPSON_THREE.ratio(k) for k in "12")
    result = pt.simulate(
        bench, 1.2, points=1201, starts={"car.w": 60.0, "engine.w": 60.0 * one, "box.tau_in": 100.0}, rtol=1e-8
    )
    torque = -result["box.flange_b.tau"]
    assert torque[result.time < 1.0][-1] == pytest.approx(100 * one, rel=2e-3)  # less what the small inertias take
    assert result.at(1.199, "box.flange_b.tau") == pytest.approx(-100 * two, rel=1e-2)


class Rolling(pt.Component):
    """A gearset between an engine and a car, both by their inertias; the lever is an input."""

    box: Automatic = Automatic.ten_speed()
    lever: pt.Input = pt.signal_input("1", "Position of the lever")
    drive: Torque = Torque()
    engine: Inertia = Inertia(J=0.15)
    car: Inertia = Inertia(J=10.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.engine.flange_a)
        yield pt.connect(self.engine.flange_b, self.box.flange_a)
        yield pt.connect(self.box.flange_b, self.car.flange_a)
        yield pt.connect(self.lever, self.box.lever)
        yield self.drive.tau.value == 30.0


@pytest.mark.slow
@pytest.mark.parametrize("back", [7, 5])
def test_a_lever_that_jumps_selects_neutral_at_speed_without_the_gears_between(back: int) -> None:
    """From the direct gear: the engine runs up alone and the car rolls on; back in gear, elements slip until its ratio is reached."""
    lever = ([0.0, 0.5, 0.5, 1.0, 1.0, 2.5], [7.0, 7.0, 0.0, 0.0, back, back])
    starts = {"engine.w": 200.0, "car.w": 200.0}
    result = pt.simulate(Rolling(), 2.5, inputs={"lever": lever}, starts=starts, rtol=1e-8)
    heat = [result.at([0.51, 0.8, 0.99], f"box.elements[{k}].lossPower") for k in range(len(TEN_SPEED.elements))]
    assert np.abs(heat).max() < 1e-9
    rise = result.at(0.99, "engine.w") - result.at(0.51, "engine.w")
    assert 0.7 * 30 / 0.15 * 0.48 < rise < 30 / 0.15 * 0.48
    assert result.at(0.99, "car.w") == pytest.approx(float(result.at(0.51, "car.w")), rel=2e-3)
    ratio = TEN_SPEED.ratio(str(back))
    assert result["engine.w"][-1] == pytest.approx(ratio * result["car.w"][-1], rel=1e-9)
    assert pt.energy_audit(result).closure < 1e-6
