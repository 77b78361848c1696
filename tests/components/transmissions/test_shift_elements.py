"""Shift elements of given friction and capacity, phases of a shift, and the inertia of a gearset in one gear."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gears_by_hand import by_hand

import powertrain as pt
from powertrain.components.blocks import TimeTable
from powertrain.components.differentials import ChurningLoss, FundamentalDifferential
from powertrain.components.rotational import Clutch, ConstantTorque, Inertia, OneWayClutch
from powertrain.components.transmissions import (
    CR_CR_FREEWHEELS,
    EIGHT_SPEED,
    NINE_SPEED,
    RAVIGNEAUX_FOUR,
    SIMPSON_THREE,
    TEN_SPEED,
    Automatic,
    DualClutchGearbox,
    GearScheme,
    planetary,
)
from powertrain.trials import gear_table
from powertrain.trials.gear_table import GearBench


class Shift(pt.Component):
    """A shift from first to second gear between the inertias of an engine and a car; the engine slows down by itself."""

    box: Any
    lever: TimeTable = TimeTable(table=((0.0, 1.0), (0.1, 1.0), (0.7, 2.0)))
    engine: Inertia = Inertia(J=0.15)
    car: Inertia = Inertia(J=150.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange_a, self.box.flange_a)
        yield pt.connect(self.box.flange_b, self.car.flange_a)
        yield pt.connect(self.lever.y, self.box.lever)


def with_friction(part: Any, mue: float) -> Any:
    """The same torque from plates with another coefficient of friction and radius."""
    if isinstance(part, OneWayClutch):
        return part
    return pt.replace(part, fn_max=part.fn_max / (0.3 * mue), cgeo=0.3, mue_pos=((0.0, mue),))


BOXES: dict[str, tuple[Any, Any]] = {
    "automatic": (
        Automatic(),
        Automatic(elements=tuple(with_friction(part, 0.13) for part in Automatic().elements)),
    ),
    "dual clutch": (
        DualClutchGearbox(),
        DualClutchGearbox(
            odd_clutch=with_friction(DualClutchGearbox().odd_clutch, 0.4),
            even_clutch=with_friction(DualClutchGearbox().even_clutch, 0.1),
        ),
    ),
}


def test_no_gear_of_a_dual_clutch_gearbox_is_beyond_its_range() -> None:
    """Its six synchronisers are pressed and released by the lever, in order; all others wait."""
    all_gears = TimeTable(table=((0.0, 1.0), (0.1, 1.0), (0.6, 6.0)))
    result = pt.simulate(Shift(box=DualClutchGearbox(), lever=all_gears), 0.7, starts={"car.w": 10.0, "engine.w": 38.0})
    assert result.notes == ()
    lever = np.array([1.0, 2.0, 2.15, 2.2, 2.3, 4.0, 4.05, 4.15, 6.0])
    third = result.at(0.1 + (lever - 1) / 10, "box.synchronisers[2].f_normalized")
    assert third == pytest.approx([0.0, 0.0, 0.0, 1 / 9, 1.0, 1.0, 4 / 9, 0.0, 0.0], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", BOXES)
def test_a_shift_does_not_depend_on_the_lining(name: str) -> None:
    """Plates of the same torque capacity: the control presses them for the same torque, whatever their coefficient of friction."""
    times = np.linspace(0, 1.0, 101)
    one, other = (
        pt.simulate(
            Shift(box=box), 1.0, times=times, starts={"car.w": 60.0, "engine.w": 60.0 * box.gear_ratios[0]}, rtol=1e-8
        )
        for box in BOXES[name]
    )
    for signal in ("engine.w", "box.tau_law", "box.flange_b.tau"):
        np.testing.assert_allclose(other.at(times, signal), one.at(times, signal), rtol=1e-5, atol=1e-4)


def inertia_at_the_input(box: Automatic, lever: float) -> float:
    """A torque over the acceleration it causes."""
    bench = GearBench(gearbox=box, lever=lever, input=Inertia(J=1.0))
    result = pt.simulate(bench, 0.4, parameters={"drive.tau_constant": 50.0}, rtol=1e-8)
    early, late = result.at(np.array([0.2, 0.4]), "input.w")
    return float(50.0 * 0.2 / (late - early) - 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("scheme", [SIMPSON_THREE, CR_CR_FREEWHEELS, EIGHT_SPEED], ids=["Simpson", "CR-CR", "eight"])
def test_a_gear_alone_has_the_inertia_of_the_gearset(scheme: GearScheme) -> None:
    """J at the input is the sum of J_k (w_k/w_in)^2 over the shafts, with speeds by Willis' equations; no losses."""
    J = 0.01 * np.arange(1.0, 2 + max(scheme.free.nodes.values()))
    levers = tuple(FundamentalDifferential(ratio=lever.ratio) for lever in scheme.levers)
    box = Automatic(
        scheme=scheme, levers=levers, shafts=tuple(Inertia(J=each) for each in J), churning=ChurningLoss(), coast=1.0
    )
    at = scheme.free.nodes
    for k, gear in enumerate(scheme.forward, 1):
        of_node = {at[name]: w for name, w in scheme.speeds(gear.name).items()}
        by_hand = sum(J[node] * w**2 for node, w in of_node.items())
        assert inertia_at_the_input(box.in_gear(k), 1.0) == pytest.approx(by_hand, rel=1e-5)
        assert inertia_at_the_input(box, float(k)) == pytest.approx(by_hand, rel=1e-5)


@pytest.mark.parametrize(
    ("scheme", "gear"), [(EIGHT_SPEED, "1"), (NINE_SPEED, "8"), (RAVIGNEAUX_FOUR, "3"), (TEN_SPEED, "7")]
)
def test_a_gear_alone_with_sets_that_are_held_or_turn_as_a_block(scheme: GearScheme, gear: str) -> None:
    """With losses, the load that balances the input by hand keeps the speed. Such sets could not start, or contradicted each other."""
    ratio, torque, _ = by_hand(scheme, gear, 50.0)
    box = Automatic(scheme=scheme, churning=ChurningLoss()).in_gear(int(gear))
    assert len(box.levers) < len(scheme.levers)
    result = pt.simulate(
        GearBench(gearbox=box, drive=ConstantTorque(tau_constant=50.0), load=ConstantTorque(tau_constant=torque)),
        1.0,
        starts={"input.w": 100.0},
    )
    assert result["input.w"][-1] == pytest.approx(100.0, rel=1e-9)
    out = result[f"gearbox.shafts[{box.scheme.free.nodes['out']}].w"][-1]
    assert out == pytest.approx(100.0 / ratio, rel=1e-9)


def test_motions_of_a_network() -> None:
    """The open eight-speed gearset: as many independent motions as degrees of freedom, and each fulfils Willis' equations."""
    network = EIGHT_SPEED.free
    motions = np.vstack([network.motions, np.zeros(network.freedom)])  # the housing is node -1
    assert network.freedom == np.linalg.matrix_rank(motions) == len(EIGHT_SPEED.shafts) - len(EIGHT_SPEED.levers)
    for lever in EIGHT_SPEED.levers:
        a, b, carrier = (motions[network.nodes[name]] for name in (lever.a, lever.b, lever.carrier))
        np.testing.assert_allclose(a - carrier, lever.ratio * (b - carrier), atol=1e-12)


@pytest.mark.parametrize(("kind", "most"), [(Automatic, 0.5), (DualClutchGearbox, 0.35)])
def test_the_phases_of_a_shift_follow_one_another(kind: Any, most: float) -> None:
    """Both torque phases and, in a dual-clutch gearbox, the preselection in 30 % of the travel leave room for the inertia phase."""
    pt.compile(kind(torque_phase=most - 0.01))
    with pytest.raises(pt.ParameterError, match=rf"torque_phase = {most}"):
        kind(torque_phase=most)
    with pytest.raises(pt.ParameterError, match=r"torque_phase = 0 is outside its range"):
        kind(torque_phase=0)


def simpson(elements: dict[str, str], idle: str = "") -> GearScheme:
    given = {"forward": "in-ring", "direct": "in-suns", "band": "suns-housing", "low": "carrier-housing"}
    gears = {"1": "forward low", "2": "forward band", "3": "forward direct", "R": "direct low"}
    return GearScheme.of(
        planetary("front", "suns", "ring", "out", teeth=(33, 72)),
        planetary("rear", "suns", "out", "carrier", teeth=(33, 72)),
        elements=given | elements,
        gears={name: row + idle for name, row in gears.items()},
    )


def test_an_element_that_only_holds_an_idle_shaft() -> None:
    """It carries nothing in any gear, and still has to stop the shaft: it is as strong as if it held the input."""
    box = Automatic.of(simpson({"open": "in-idler", "park": "idler-housing"}, idle=" park"), torque=200.0)
    np.testing.assert_allclose([float(part.capacity) for part in box.elements[-2:]], 1.5 * 200.0)
    table = gear_table(box)
    np.testing.assert_allclose(table["park"], 0.0, atol=1e-9)
    np.testing.assert_allclose(table["ratio"], [SIMPSON_THREE.ratio(gear.name) for gear in SIMPSON_THREE.gears])
    assert table["open"].isna().all()


def test_elements_without_capacity() -> None:
    for part in (Clutch(fn_max=0), Clutch(fn_max=100, cgeo=0), Clutch(fn_max=100, mue_pos=((0.0, 0.0),))):
        with pytest.raises(pt.ParameterError, match=r"capacity > 0"):
            Automatic(elements=(part, *Automatic().elements[1:]))
        with pytest.raises(pt.ParameterError, match=r"capacity > 0"):
            DualClutchGearbox(even_clutch=part)
    with pytest.raises(pt.ParameterError, match=r"Automatic.of: torque = 0 N.m is outside its range"):
        Automatic.of(SIMPSON_THREE, torque=0.0)
    with pytest.raises(pt.ParameterError, match=r"mue_pos: \(\) is not a table of rows"):
        DualClutchGearbox(odd_clutch=Clutch(fn_max=100, mue_pos=()))


def test_names_are_unique() -> None:
    """Of two gears with one name the first counted; of two elements with one name a gear engaged both."""
    levers, elements, gears = SIMPSON_THREE.levers, SIMPSON_THREE.elements, SIMPSON_THREE.gears
    with pytest.raises(pt.ParameterError, match=r"two gears have the name '3'"):
        GearScheme(levers, elements, (*gears[:3], replace(gears[3], name="3")))
    with pytest.raises(pt.ParameterError, match=r"two shift elements have the name 'low'"):
        GearScheme(levers, (*elements, replace(elements[0], name="low")), gears)


def test_schemes_without_gears_and_elements_on_one_shaft() -> None:
    with pytest.raises(pt.ParameterError, match=r"shift element x is between the shaft 'in' and itself"):
        simpson({"x": "in-in"})
    with pytest.raises(pt.ParameterError, match=r"the shift table has no gears"):
        GearScheme(SIMPSON_THREE.levers, SIMPSON_THREE.elements, ())
    with pytest.raises(pt.ParameterError, match=r"gear R has the ratio -2.182, .* list the forward gears first"):
        GearScheme(SIMPSON_THREE.levers, SIMPSON_THREE.elements, (SIMPSON_THREE.gear("R"),))
