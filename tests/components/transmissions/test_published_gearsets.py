"""Gearsets that the library does not ship, as an engineer writes them from a drawing, a table of elements and numbers of teeth.

The tooth numbers are estimates that give the published ratios.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gears_by_hand import by_hand

import powertrain as pt
from powertrain.components.differentials import ChurningLoss
from powertrain.components.transmissions import (
    SIMPSON_THREE,
    Automatic,
    DualClutchGearbox,
    GearScheme,
    Lever,
    double_planetary,
    planetary,
    ravigneaux,
)
from powertrain.trials.gear_table import GearBench, gear_table

SCHEMES = {
    "GM 6T40, three planetary gears": GearScheme.of(
        planetary("reaction", "reaction sun", "out", "reaction carrier", teeth=(33, 97)),
        planetary("input", "in", "reaction carrier", "input carrier", teeth=(47, 102)),
        planetary("output", "output sun", "input carrier", "out", teeth=(33, 74)),
        elements={
            "1-2-3-4": "output sun-housing",
            "low": "reaction carrier-housing",
            "2-6": "reaction sun-housing",
            "3-5-R": "in-reaction sun",
            "4-5-6": "in-reaction carrier",
        },
        gears={
            "1": ("1-2-3-4", "low"),
            "2": ("1-2-3-4", "2-6"),
            "3": ("1-2-3-4", "3-5-R"),
            "4": ("1-2-3-4", "4-5-6"),
            "5": ("3-5-R", "4-5-6"),
            "6": ("4-5-6", "2-6"),
            "R": ("3-5-R", "low"),
        },
    ),
    "Allison 1000, three planetary gears": GearScheme.of(
        planetary("P1", "in", "ring 1", "ring 2", teeth=(40, 74)),
        planetary("P2", "suns", "ring 2", "ring 3", teeth=(35, 69)),
        planetary("P3", "suns", "ring 3", "out", teeth=(40, 84)),
        elements={
            "C1": "in-suns",
            "C2": "in-ring 3",
            "C3": "ring 1-housing",
            "C4": "ring 2-housing",
            "C5": "ring 3-housing",
        },
        gears={"1": "C1 C5", "2": "C1 C4", "3": "C1 C3", "4": "C1 C2", "5": "C2 C3", "6": "C2 C4", "R": "C3 C5"},
    ),
    "Mercedes-Benz W5A 580, three planetary gears": GearScheme.of(
        planetary("front", "front sun", "in", "front carrier", teeth=(29, 45)),
        planetary("rear", "rear sun", "front carrier", "rear carrier", teeth=(35, 63)),
        planetary("centre", "centre sun", "rear carrier", "out", teeth=(30, 74)),
        elements={
            "K1": "front sun-front carrier",
            "K2": "in-rear carrier",
            "K3": "centre sun-rear sun",
            "B1": "front sun-housing",
            "B2": "centre sun-housing",
            "B3": "rear carrier-housing",
        },
        gears={
            "1": "B1 B2 K3",
            "2": "K1 B2 K3",
            "3": "K1 B2 K2",
            "4": "K1 K2 K3",
            "5": "B1 K2 K3",
            "R": "B1 B3 K3",
            "R2": "K1 B3 K3",
        },
    ),
    "Aisin AA80E, pairs of planets before a Ravigneaux set": GearScheme.of(
        double_planetary("front", "housing", "reduced", "in", teeth=(38, 82)),
        *ravigneaux("large sun", "small sun", "out", "carrier", teeth=(34, 30, 74)),
        elements={
            "C1": "reduced-small sun",
            "C2": "in-carrier",
            "C3": "reduced-large sun",
            "C4": "in-large sun",
            "B1": "large sun-housing",
            "B2": "carrier-housing",
        },
        gears={
            "1": "C1 B2",
            "2": "C1 B1",
            "3": "C1 C3",
            "4": "C1 C4",
            "5": "C1 C2",
            "6": "C2 C4",
            "7": "C2 C3",
            "8": "C2 B1",
            "R": "C3 B2",
        },
    ),
}
PUBLISHED = {
    "GM": (4.584, 2.964, 1.912, 1.446, 1.000, 0.746, -2.940),
    "Allison": (3.10, 1.81, 1.41, 1.00, 0.71, 0.61, -4.49),
    "Mercedes-Benz": (3.595, 2.186, 1.405, 1.000, 0.831, -3.167, -1.926),
    "Aisin": (4.596, 2.724, 1.863, 1.464, 1.231, 1.000, 0.824, 0.685, -4.056),
}
DIGITS = {"Allison": 0.01}
"""The maker gives two decimals."""


@pytest.mark.parametrize("name", SCHEMES)
def test_published_ratios(name: str) -> None:
    scheme, maker = SCHEMES[name], name.split()[0]
    ratios = [scheme.ratio(gear.name) for gear in (*scheme.forward, *scheme.reverse)]
    np.testing.assert_allclose(ratios, PUBLISHED[maker], atol=DIGITS.get(maker, 1e-3))


def wolfrom(eta: float) -> Automatic:
    """Stepped planets (36, 33) on a sun (18), in a held ring (90) and a turning one (87), with the efficiency of a mesh."""
    scheme = GearScheme.of(
        Lever("sun", "in", "planets", "carrier", -36 / 18, eta),
        Lever("held ring", "planets", "housing", "carrier", 90 / 36, eta),
        Lever("ring", "planets", "out", "carrier", 87 / 33, eta),
        elements={},
        gears={"1": ""},
    )
    return Automatic.of(scheme, churning=ChurningLoss(d=0))


@pytest.mark.parametrize(("torque", "efficiency"), [(1.0, 0.720540), (-1.0, 0.617314)])
def test_a_wolfrom_gear(torque: float, efficiency: float) -> None:
    """By hand: torques balance at the planets and, without one at the carrier, between sun and rings."""
    table = gear_table(wolfrom(0.99), torque)
    np.testing.assert_allclose(table[["ratio", "efficiency"]], [[116.0, efficiency]], rtol=1e-5)


def test_a_wolfrom_gear_that_locks_itself() -> None:
    """Below 0.974 in each mesh the ring cannot drive, and the sun drives under a load in either direction."""
    assert not gear_table(wolfrom(0.975), -1.0).isna()["efficiency"].any()
    for torque, said in (
        (1.0, "several operating points at 1 N.m in gear 1, which locks itself"),
        (-1.0, "no operating"),
    ):
        with pytest.raises(pt.ParameterError, match=said):
            gear_table(wolfrom(0.973), torque)


def test_an_idle_set_beside_a_brake() -> None:
    """In second gear of the Allison the first set idles, and its carrier is braked.

    While all clutches slide, the torque of that brake moves nothing, exactly or up to round-off, depending on the tooth numbers. Where it
    was exactly nothing, no operating point was found.
    """
    bench = GearBench(gearbox=Automatic.of(SCHEMES["Allison 1000, three planetary gears"]))
    bench = pt.replace(bench, {"gearbox.churning.d": 0.0})
    point = {"lever": 2.0, "input.w": 150.0, "drive.tau_constant": 100.0}
    found = pt.steady(bench, point, free=["load.tau_constant"], outputs=["gearbox.flange_b.tau"], first=True)
    ratio = SCHEMES["Allison 1000, three planetary gears"].ratio("2")
    assert found["gearbox.flange_b.tau"].item() == pytest.approx(-100.0 * ratio, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("torque", [100.0, -100.0])
@pytest.mark.parametrize("name", SCHEMES)
def test_table_of_a_gearset(name: str, torque: float) -> None:
    """Ratio, efficiency and element torques of all gears."""
    scheme = SCHEMES[name]
    levers = tuple(replace(lever, eta=eta) for lever, eta in zip(scheme.levers, (0.985, 0.97, 0.98), strict=True))
    lossy = replace(scheme, levers=levers)
    table = gear_table(pt.replace(Automatic.of(lossy), {"churning.d": 0.0}), torque)
    for gear in (*lossy.forward, *lossy.reverse[:1]):
        ratio, tau, held = by_hand(lossy, gear.name, torque)
        row: Any = table.loc[gear.name]
        assert row["ratio"] == pytest.approx(ratio, rel=1e-9)
        assert row["efficiency"] == pytest.approx(abs(tau / (torque * ratio)) ** np.sign(torque), rel=1e-8)
        for element, (low, high) in held.items():
            assert low - 1e-6 <= abs(row[element]) <= high + 1e-6


def test_pairs_of_planets_turn_sun_and_ring_in_one_direction() -> None:
    """Willis: with the sun held and the carrier driving, the ring is reduced by 1 - Z_sun/Z_ring."""
    scheme = GearScheme.of(double_planetary("p", "housing", "out", "in", teeth=(40, 80)), elements={}, gears={"1": ""})
    assert scheme.ratio("1") == pytest.approx(2.0)
    with pytest.raises(
        pt.ParameterError, match="planetary gear p: no planet fits between a sun of 80 and a ring of 40"
    ):
        double_planetary("p", "s", "r", "c", teeth=(80, 40))


TRANSFER: dict[str, Any] = {
    "elements": {"A": "in-small", "B": "large-housing", "C": "in-large", "D": "carrier-housing"},
    "gears": {"1": "A D", "2": "A B", "R": "C D"},
}


def with_transfer_gears(ratio: float) -> GearScheme:
    sets = ravigneaux("large", "small", "ring", "carrier", teeth=(36, 30, 72))
    return GearScheme.of(*sets, Lever("transfer", "ring", "out", "housing", ratio, 0.99), **TRANSFER)


def test_transfer_gears_multiply_the_ratios() -> None:
    scheme = with_transfer_gears(53 / 46)
    assert [gear.name for gear in scheme.forward] == ["1", "2"]
    assert scheme.ratio("1") == pytest.approx(72 / 30 * 53 / 46)


def test_an_output_that_is_turned_round_is_refused() -> None:
    """Its forward gears were taken for reverse gears, and the reverse gear for the only forward one."""
    with pytest.raises(pt.ParameterError, match=r"gear 1 has the ratio -2\.765, it turns the output backward"):
        with_transfer_gears(-53 / 46)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"elements": {"A": "in-Ring", "B": "ring-housing"}},
            "element A is at the shaft 'Ring', where nothing else is",
        ),
        (
            {"output": "shaft"},
            "the output is at the shaft 'shaft', where nothing else is; the shafts .* are in, ring, out",
        ),
    ],
)
def test_misspelt_shafts(changes: dict[str, Any], said: str) -> None:
    options: dict[str, Any] = {"elements": {"A": "in-ring", "B": "ring-housing"}, "gears": {"1": "B", "2": "A"}}
    with pytest.raises(pt.ParameterError, match=said):
        GearScheme.of(planetary("p", "in", "ring", "out", teeth=(30, 60)), **(options | changes))


def test_a_dual_clutch_gearbox_with_two_final_drives() -> None:
    """Ratios of the VW DQ250: the fifth gear is published with a higher ratio than the fourth, before a final drive of its own."""
    lower, upper = (3.462, 2.150, 1.464, 1.079), (1.094, 0.921)
    with pytest.raises(
        pt.ParameterError, match=r"two final drives.*\n.*gears\[3\].ratio = 1.079, gears\[4\].ratio = 1.094"
    ):
        DualClutchGearbox.of_ratios(*lower, *upper)
    box = DualClutchGearbox.of_ratios(*(4.118 * r for r in lower), *(3.043 * r for r in upper))
    assert box.gear_count == 6


def test_a_scheme_makes_the_parts_that_are_not_given() -> None:
    scheme = SCHEMES["Allison 1000, three planetary gears"]
    assert Automatic(scheme=scheme) == Automatic.of(scheme)
    assert Automatic() == Automatic.of(SIMPSON_THREE)


def test_levers_that_are_not_those_of_the_scheme() -> None:
    """As many levers and elements as Simpson's, but other ratios: shifts followed the ratios of the scheme, shafts those of the levers."""
    other = GearScheme.of(
        planetary("front", "suns", "front ring", "out", teeth=(33, 66)),
        planetary("rear", "suns", "out", "rear carrier", teeth=(33, 72)),
        elements={each.name: "-".join(each.joint) for each in SIMPSON_THREE.elements},
        gears={gear.name: gear.engaged for gear in SIMPSON_THREE.gears},
    )
    with pytest.raises(pt.ParameterError, match=r"Automatic.of\(scheme\).*\n.*levers\[0\].ratio = -2.18182"):
        pt.replace(Automatic.simpson_three_speed(), scheme=other)


def test_a_gearset_in_a_parameter_file(tmp_path: Path) -> None:
    """The differentials, shafts and shift elements are those of the scheme; they were those of Simpson's gearset."""
    file = tmp_path / "car.toml"
    file.write_text("""
class = "AutomaticCar"
[gearbox]
class = "Automatic"
[gearbox.scheme]
levers = [{ name = "p", a = "in", b = "ring", carrier = "out", ratio = -2.0, eta = 0.98 }]
elements = [{ name = "low", a = "ring", b = "housing" }, { name = "direct", a = "in", b = "ring" }]
gears = [{ name = "1", engaged = ["low"] }, { name = "2", engaged = ["direct"] }]
""")
    box: Any = pt.vehicles.load(file).gearbox
    assert [float(lever.ratio) for lever in box.levers] == [-2.0]
    assert (len(box.shafts), len(box.elements)) == (3, 2)
