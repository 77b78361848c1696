from __future__ import annotations

import itertools
from typing import Any

import casadi as ca
import numpy as np
import pytest
import xarray as xr

import powertrain as pt
from powertrain.components.body import (
    Body,
    CentreDifferential,
    Chassis,
    DrivenAxle,
    LumpedAxle,
    RoadProfile,
    VehicleBody,
)
from powertrain.components.body.coast_down import CoastDownBody as MeasuredBody
from powertrain.components.control import FixedGear, PowerShiftSchedule, Shifting, StartStop
from powertrain.components.cycles import DriveCycle
from powertrain.components.engines import CoolantCircuit, WarmEngine
from powertrain.components.transmissions import Automatic, NeutralIdleConverter, StartingConverter
from powertrain.trials import drive_cycle, gears
from powertrain.trials.anatomy import value_at
from powertrain.trials.backward import backward, demand
from powertrain.trials.driveline import driveline_map
from powertrain.trials.driveline_figure import plot_driveline_map
from powertrain.trials.gears import gear_maps, in_gear, per_speed
from powertrain.trials.operating import at_constant_speed, mapped_model, on_rolling_road, operating_map
from powertrain.trials.tractive_effort import tractive_effort
from powertrain.vehicles.automatic_car import AutomaticCar
from powertrain.vehicles.dual_clutch_car import DualClutchCar
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.flywheel_hybrid import FlywheelHybrid
from powertrain.vehicles.four_wheel_drive import FourWheelDriveCar
from powertrain.vehicles.manual_car import ManualCar
from powertrain.vehicles.parallel_hybrid import ParallelHybrid
from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
from powertrain.vehicles.rear_drive import RearDriveCar
from powertrain.vehicles.series_hybrid import SeriesHybrid
from powertrain.vehicles.split_path_car import SplitPathCar
from powertrain.vehicles.variator_car import VariatorCar

OK, SEVERAL = 0, 2
SPEEDS, PEDALS = np.linspace(5, 35, 7), np.linspace(0, 1, 6)


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    return driveline_map(SplitPathCar(), SPEEDS, PEDALS, variator="transmission.cvu")


def test_every_point_has_a_steady_state(found: xr.Dataset) -> None:
    """One of its own with the pedal pressed; in overrun the clutch may let the engine idle too."""
    assert (found["status"].sel(accelerator=slice(0.1, 1)) == OK).all()
    assert set(found["status"].sel(accelerator=0).values.tolist()) <= {OK, SEVERAL}
    assert np.isfinite(found["force"]).all()
    assert found["speed"].values == pytest.approx(SPEEDS)


def test_the_power_from_the_tank_is_that_of_the_fuel(found: xr.Dataset) -> None:
    heat = found["fuel_rate"] * float(SplitPathCar().engine.heating_value)
    np.testing.assert_allclose(found["power"], heat, rtol=1e-12)
    pulls = (found["force"] > 0).values
    useful = (found["force"] * found["speed"]).transpose(*found["force"].dims).values
    np.testing.assert_allclose(found["efficiency"].values[pulls], useful[pulls] / heat.values[pulls], rtol=1e-9)


def test_overrun_ends_where_it_began(found: xr.Dataset) -> None:
    """With the pedal released at 20 m/s the clutch holds, or the engine idles at 85 rad/s: the map says so, and gives the first."""
    point = found.sel(speed=20, accelerator=0)
    assert int(point["status"]) == SEVERAL
    given = {"body.speed": 20.0, "driver.accelerator_set": 0.0}
    plant = pt.compile(on_rolling_road(SplitPathCar()))
    holding = plant.simulate(20, parameters=given, starts={"engine.w": float(point["w"])}, points=2)
    idling = plant.simulate(20, parameters=given, starts={"engine.w": 85.0}, points=2)
    assert holding["body.force"][-1] == pytest.approx(float(point["force"]), rel=1e-4)
    assert idling["engine.w"][-1] == pytest.approx(85.0, rel=1e-4)
    assert idling["body.force"][-1] > float(point["force"]) + 50


@pytest.mark.slow
def test_creeping_with_a_slipping_clutch() -> None:
    """At 2 km/h the clutch slips a hundred radians per second, far from where a search begins."""
    point = driveline_map(SplitPathCar(), [2 / 3.6], [0.5]).isel(speed=0, accelerator=0)
    assert int(point["status"]) == OK
    given = {"body.speed": 2 / 3.6, "driver.accelerator_set": 0.5}
    result = pt.simulate(on_rolling_road(SplitPathCar()), 30, parameters=given, starts={"engine.w": 85.0}, points=2)
    assert result["engine.w"][-1] == pytest.approx(float(point["w"]), rel=1e-4)
    assert result["body.force"][-1] == pytest.approx(float(point["force"]), rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "pedal"), [(5.0, 0.2), (20.0, 0.4), (35.0, 0.6), (10.0, 0.2)])
def test_points_are_where_a_simulation_settles(found: xr.Dataset, speed: float, pedal: float) -> None:
    """Slowest is the engine's speed against the ratio's control, settled to 1e-5 after half a minute."""
    car = on_rolling_road(SplitPathCar())
    given = {"body.speed": speed, "driver.accelerator_set": pedal}
    point = found.sel(speed=speed, accelerator=pedal, method="nearest")
    result = pt.simulate(car, 30, parameters=given, starts={"engine.w": float(point["w"]) * 1.02}, points=2)
    assert result["engine.w"][-1] == pytest.approx(float(point["w"]), rel=1e-4)
    assert result["body.force"][-1] == pytest.approx(float(point["force"]), rel=1e-3)


def test_powers_of_the_point_balance(found: xr.Dataset) -> None:
    """What the engine gives arrives at the road times the efficiencies of transmission, crown gear, and less rolling resistance."""
    point = found.sel(speed=20, accelerator=0.4, method="nearest")
    rolling = 0.01 * 1300 * 9.80665
    road = float(point["force"] + rolling) * 20
    assert 0.8 < road / 0.97 / float(point["w"] * point["tau"]) < 0.96
    assert float(point["efficiency"]) == pytest.approx(float(point["force"]) * 20 / (float(point["fuel_rate"]) * 43e6))


@pytest.mark.slow
def test_backward_agrees_with_the_simulation() -> None:
    """The quasi-static calculation leaves out transients and the engine's inertia: 2 % on a cycle's part with its accelerations."""
    part = DriveCycle.named("wltc").part(590, 1022)
    run, back = drive_cycle(SplitPathCar(), part), backward(SplitPathCar(), part)
    assert run.message == ""
    assert back.fuel == pytest.approx(run.fuel, rel=0.02)
    assert not back.missing.any()


@pytest.mark.slow
def test_backward_stands_against_the_drag_of_a_converter() -> None:
    """Half of the first hill of the WLTC is idling: the converter takes more than twice what the engine alone would."""
    hill = DriveCycle.named("wltc").part(0, 140)
    run, back = drive_cycle(VariatorCar(), hill), backward(VariatorCar(), hill)
    assert back.fuel == pytest.approx(run.fuel, rel=0.03)


@pytest.mark.slow
def test_backward_climbs() -> None:
    """Twelve metres a second up a slope of 5 %: the simulation burns as much, less what it burns on the way to that speed."""
    cycle = DriveCycle("uphill", ((0.0, 0.0), (12.0, 12.0), (200.0, 12.0)))
    hill = pt.replace(SplitPathCar(), road=RoadProfile.from_heights([0, 1e4], [0, 1e4 * np.sin(np.arctan(0.05))]))
    run, back = drive_cycle(hill, cycle), backward(hill, cycle)
    rate = run.result["engine.fuel_rate"][-1]
    assert back.fuel_rate[-1] == pytest.approx(rate, rel=2e-3)  # between the points of the map
    assert rate > 1.5 * backward(SplitPathCar(), cycle).fuel_rate[-1]
    assert back.fuel == pytest.approx(run.fuel, rel=0.02)


@pytest.mark.slow
def test_backward_over_a_crest() -> None:
    """Up 5 % for 500 m and down again: the map is that of a level road, the weight is in the force."""
    cycle = DriveCycle("crest", ((0.0, 20.0), (25.0, 20.0), (50.0, 20.0)))
    crest = pt.replace(SplitPathCar(), road=RoadProfile.from_heights([0, 500, 1000], [0, 25, 0]))
    force, level = backward(crest, cycle).force, backward(SplitPathCar(), cycle).force
    assert force[0] - level[0] == pytest.approx(level[1] - force[1], rel=1e-9)
    assert force[0] - level[0] > 600


class CoastDownBody(Body):
    """A body whose resistance is a measured polynomial in its speed."""

    B: pt.Parameter = pt.parameter("N.s/m", "Resistance over speed", default=4.0)
    C: pt.Parameter = pt.parameter("N.s2/m2", "Resistance over speed squared", default=0.4)
    speed: pt.Variable = pt.variable("m/s", "Speed", start=0.0, prefer=True)

    def equations(self) -> pt.Equations:
        yield self.rear.s == self.front.s
        yield self.speed == pt.der(self.front.s)
        yield self.v.value == self.speed
        yield self.s.value == self.front.s
        slope = self.m * self.g * self.grade.value / ca.sqrt(1 + self.grade.value**2)
        resistance = self.B * self.speed + self.C * self.speed * ca.fabs(self.speed)
        yield self.m * pt.der(self.speed) == self.front.f + self.rear.f - resistance - slope
        yield self.front_load.value == self.m * self.g * self.front_share
        yield self.rear_load.value == self.m * self.g * (1 - self.front_share)


@pytest.mark.slow
def test_backward_asks_the_body_for_its_resistance() -> None:
    """At 20 m/s another body takes 4 v + 0.4 v^2 = 240 N, whatever Cd and A the car's own had."""
    cycle = DriveCycle("cruise", ((0.0, 20.0), (10.0, 20.0), (20.0, 21.0)))
    run = backward(pt.replace(SplitPathCar(), body=CoastDownBody(m=1300)), cycle)
    mass = 1300 + 4 / 0.3**2
    np.testing.assert_allclose(run.force, [240, mass * 0.1 + 4 * 20.5 + 0.4 * 20.5**2], rtol=1e-9)


def test_a_body_with_friction_takes_nothing_at_rest() -> None:
    """Its road load holds the standing car; in the rows in which it moves, that load is needed."""
    body = MeasuredBody(m=1300, F_0=100, F_1=0, F_2=0.4)
    stands = DriveCycle("stands", ((0.0, 0.0), (10.0, 0.0)))
    assert demand(pt.replace(SplitPathCar(), body=body), stands)[1].tolist() == [0]
    goes = DriveCycle("goes", ((0.0, 0.0), (10.0, 0.0), (20.0, 5.0), (30.0, 0.0), (40.0, 0.0)))
    mass, load = 1300 + 4 / 0.3**2, 100 + 0.4 * 2.5**2
    force = demand(pt.replace(SplitPathCar(), body=body), goes)[1]
    assert force == pytest.approx([0, mass * 0.5 + load, -mass * 0.5 + load, 0])


class CompositeBody(Body):
    """A body whose mass is that of a part; ``bound``: the part has its own parameter m."""

    bound: bool = False
    chassis: Chassis = Chassis()

    def equations(self) -> pt.Equations:
        if self.bound:
            yield self.chassis.m == self.m
        for name in ("front", "rear", "grade", "v", "s", "front_load", "rear_load"):
            yield pt.connect(getattr(self, name), getattr(self.chassis, name))


def test_a_body_whose_parameter_is_not_its_mass_is_rejected() -> None:
    """Its m of 1,500 kg is a default that its equations do not read."""
    cycle = DriveCycle("goes", ((0.0, 10.0), (10.0, 12.0)))
    said = (
        r"CompositeBody moves like a mass of 2000 kg, but its parameter m is 1500 kg; .*yield self\.part\.m == self\.m"
    )
    car = pt.replace(SplitPathCar(), body=CompositeBody(chassis=Chassis(m=2000.0)))
    for trial in (
        lambda: demand(car, cycle),
        lambda: tractive_effort(car, [10.0, 20.0]),
        lambda: on_rolling_road(car),
    ):
        with pytest.raises(pt.ParameterError, match=said):
            trial()
    bound = pt.replace(SplitPathCar(), body=CompositeBody(bound=True, m=2000.0))
    plain = pt.replace(SplitPathCar(), body=VehicleBody(m=2000.0))
    np.testing.assert_allclose(demand(bound, cycle)[1], demand(plain, cycle)[1], rtol=1e-9)


@pytest.mark.parametrize(
    ("vehicle", "said"),
    [
        (FlywheelHybrid(), "flywheel takes and gives power only while its speed changes"),
        (
            PowerSplitHybrid(),
            r"history of control \(PowerSplitControl\): control.running. Simulate it with drive_cycle",
        ),
        (ElectricCar(), "ElectricCar has no engine, so it burns no fuel"),
    ],
    ids=lambda v: type(v).__name__ if isinstance(v, pt.Component) else "",
)
def test_a_vehicle_that_remembers_has_no_map(vehicle: pt.Component, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        backward(vehicle, "wltc")


@pytest.mark.slow
def test_a_geared_car_is_mapped_in_the_gears_that_its_schedule_keeps() -> None:
    """Released at 10 m/s: down to third below 9.5 m/s; half pressed: 10.75 m/s; floored it kicks down to second below 12 m/s."""
    found = driveline_map(ManualCar(), [2.0, 10.0, 30.0], [0.0, 0.5, 1.0])
    assert found["gear"].values.tolist() == [[1, 1, 1], [4, 3, 2], [6, 6, 5]]
    third = operating_map(in_gear(ManualCar(), 3), [10.0], [0.5])
    assert float(found["force"][1, 1]) == float(third["force"][0, 0])
    assert float(found["w"][1, 1]) == pytest.approx(10 / 0.3 * 4.1 * 1.4)
    pulled = found.isel(accelerator=2)
    assert (pulled["efficiency"] == pulled["force"] * pulled["speed"] / pulled["power"]).all()
    np.testing.assert_allclose(found["power"], found["fuel_rate"] * 43e6)


SIX = PowerShiftSchedule.for_gears(Automatic.lepelletier_six_speed().gear_ratios, 3.9)
ALL: dict[str, Any] = {"front": LumpedAxle(), "rear": LumpedAxle(), "transfer": CentreDifferential()}
TOGETHER = {
    "manual": ManualCar(),
    "dual clutch": pt.replace(DualClutchCar(), {"gearbox.odd_clutch.fn_max": 500.0, "gearbox.odd.J": 0.02}),
    "gearset": AutomaticCar.with_gearset(Automatic.lepelletier_six_speed()),
    "gearset, all-wheel drive": AutomaticCar.with_gearset(Automatic.lepelletier_six_speed(), schedule=SIX, **ALL),
    "manual, all-wheel drive": ManualCar(**ALL),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", TOGETHER)
def test_gears_solved_together_have_the_points_of_each_gear_alone(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ratios differ from gear to gear, in a dual-clutch gearbox the clutches and shafts, too, and in a gearset the efficiencies."""
    car, at, calls = TOGETHER[name], ([3.0, 20.0], [0.0, 0.3, 1.0]), list[int]()

    def counted(*args: Any, **options: Any) -> Any:
        calls.append(1)
        return operating_map(*args, **options)

    monkeypatch.setattr(gears, "operating_map", counted)
    found = gear_maps(car, *map(np.array, at))
    assert len(calls) == 1
    monkeypatch.setattr(Automatic, "lumped", lambda self: self)
    for k, one in enumerate(found, 1):
        xr.testing.assert_allclose(one, operating_map(in_gear(car, k), *at), rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_equal_axles_behind_a_centre_differential_are_as_one_axle() -> None:
    """On a level road they turn together; in overrun at speed the start clutch holds, although the engine could also idle."""
    at = np.array([5.0, 25.0]), np.array([0.0, 0.1, 0.6])
    axle = ManualCar().front
    both = ManualCar(front=axle, rear=axle, transfer=CentreDifferential())
    for one, other in zip(gear_maps(ManualCar(), *at), gear_maps(both, *at), strict=True):
        xr.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "final_drive"), [(ManualCar, 4.1), (AutomaticCar, 3.2)])
def test_a_closed_start_device_turns_the_engine_at_the_ratio_of_the_gear(kind: type[Any], final_drive: float) -> None:
    """Over the wheels of 0.3 m, although a clutch or a converter slips at low speeds, in overrun with a slower engine."""
    maps = gear_maps(kind(), np.linspace(0.5, 37, 24), np.linspace(0, 1, 5))
    expected = [ratio * final_drive / 0.3 for ratio in kind().gearbox.gear_ratios]
    assert [per_speed(found) for found in maps] == pytest.approx(expected)


def test_a_launch_slips_at_the_speed_of_the_schedule() -> None:
    """With the clutch slipping, torque over pressure is its capacity: the same with and without launch, which counts beyond kick-down."""
    pedals = np.array([0.5, 0.9, 1.0])
    for launch, rise in ((0.0, [0, 0, 0]), (40.0, [0, 20, 40])):
        first, second, *_ = gear_maps(
            pt.replace(ManualCar(), {"schedule.launch": launch}), np.array([1.0, 1.5]), pedals
        )
        for one, later in ((first, np.array(rise)), (second, 0)):
            pressure = (one["w"] - 95 - later) / (160 - 95)
            np.testing.assert_allclose(one["tau"] / pressure, 300, rtol=1e-3)


@pytest.mark.slow
def test_an_automatic_is_mapped_with_its_converter_locked() -> None:
    found = driveline_map(AutomaticCar(), [15.0], [0.5]).isel(speed=0, accelerator=0)
    ratio = AutomaticCar().gearbox.ratios[int(found["gear"]) - 1]  # type: ignore[attr-defined]
    assert float(found["w"]) == pytest.approx(15 / 0.3 * 3.2 * ratio, rel=1e-6)


def test_an_electric_car_is_mapped_from_its_battery() -> None:
    """Its losses are the machine's, by its law, the meshes', the oil's and the wheels'."""
    point = driveline_map(ElectricCar(), [20.0], [0.4]).isel(speed=0, accelerator=0)
    w, tau = float(point["w"]), float(point["tau"])
    assert w == pytest.approx(20 / 0.3 * 3.6 * 2.5)
    assert float(point["power"]) == pytest.approx(tau * w + 80 + 0.045 * tau**2 + w + 4e-4 * w**2)
    assert 0.85 < float(point["efficiency"]) < 0.95
    assert point["efficiency"].attrs["long_name"] == "Efficiency from the battery to the road"


def test_what_a_hybrid_remembers_is_given() -> None:
    with pytest.raises(
        pt.ParameterError,
        match=r"SeriesHybrid .* genset .* depends on its history. Give a value for genset.running: held",
    ):
        driveline_map(SeriesHybrid(), [10.0], [0.5])
    with pytest.raises(
        pt.ParameterError, match="FlywheelHybrid has no map of operating points: flywheel takes and gives power only"
    ):
        driveline_map(FlywheelHybrid(), [10.0], [0.5], held={"charge.charging": 1})
    both = r"held={'control.running': 1, 'control.matched': 1}, or powertrain map --held control.running=1 --held control.m"
    with pytest.raises(pt.ParameterError, match=both):
        driveline_map(ParallelHybrid(), [10.0], [0.5])


@pytest.mark.slow
@pytest.mark.parametrize("car", [SeriesHybrid(), PowerSplitHybrid()], ids=["series", "power split"])
def test_hybrids_are_mapped_with_the_engine_on_or_off(car: pt.Component) -> None:
    """Off, the battery drives, and the engine stands; on, the tank does: the battery is neither charged nor drained for long.

    Above 29.4 m/s the engine of the power-split hybrid turns without fuel: its machine 1 would be too fast with a stopped one.
    """
    running = "genset.running" if isinstance(car, SeriesHybrid) else "control.running"
    speeds, pedals = np.linspace(5.0, 29.0, 8), np.linspace(0.2, 0.8, 7)
    off, on = (driveline_map(car, speeds, pedals, held={running: float(k)}) for k in (0, 1))
    assert (off["status"] == OK).all()
    assert (on["status"] == OK).all()
    assert np.abs(off["w"]).max() < 1e-6
    assert float(on["w"].min()) > 80.0
    assert 0.8 < float(off["efficiency"].max()) < 0.95
    assert 0.3 < float(on["efficiency"].max()) < 0.45


@pytest.mark.slow
def test_a_point_of_a_hybrid_does_not_depend_on_the_others_asked_for() -> None:
    """Newton's method alone ends at the battery's low voltage, or nowhere; from rest the motion leads to the point."""
    held = {"genset.running": 1.0}
    alone = driveline_map(SeriesHybrid(), [10.0], [0.3], held=held)
    among = driveline_map(SeriesHybrid(), [3.0, 10.0, 25.0], [0.3, 0.9], held=held)
    assert (alone["status"] == OK).all()
    assert (among["status"] == OK).all()
    assert float(alone["efficiency"][0, 0]) == pytest.approx(float(among["efficiency"][1, 0]), rel=1e-6)


@pytest.mark.slow
def test_axles_are_lumped_on_a_rolling_road() -> None:
    """At constant speed on a straight level road a differential turns as one block: the map is that of the lumped axle."""
    ring = SplitPathCar().front.final_drive  # type: ignore[attr-defined]
    car = SplitPathCar(front=DrivenAxle(final_drive=ring))
    ours, theirs = (driveline_map(c, [10.0, 20.0], [0.3, 0.8]) for c in (car, SplitPathCar()))
    np.testing.assert_allclose(ours["efficiency"], theirs["efficiency"], rtol=1e-9)
    uneven = pt.replace(car, {"front.left.radius": 0.31})
    with pytest.raises(pt.ParameterError, match=r"wheels with radii of 0\.3 and 0\.31 m on one axle"):
        on_rolling_road(uneven)


@pytest.mark.slow
def test_a_centre_differential_shares_equally_on_a_rolling_road() -> None:
    """Between axles that the road holds at one speed any friction fits; without it the sum is (engine - oil) ratio 3.9 0.95/r - rolling."""
    car = FourWheelDriveCar()
    found = driveline_map(car, [5.0, 13.0, 20.0], [0.3, 0.6])
    assert (found["status"] == OK).all()
    ratios = np.array([float(gear.ratio) for gear in car.gearbox.gears])[found["gear"].values - 1]  # type: ignore[attr-defined]
    rolling = 0.01 * 1700 * 9.80665
    np.testing.assert_allclose(
        found["force"], (found["tau"] - 0.003 * found["w"]) * ratios * 3.9 * 0.95 / 0.3 - rolling
    )


def test_an_engine_is_warm_on_a_rolling_road() -> None:
    """At full load and low speed a cooling circuit of its own would settle far above the temperature of any drive."""
    assert isinstance(value_at(on_rolling_road(SplitPathCar(cooling=CoolantCircuit())), "cooling"), WarmEngine)


@pytest.mark.parametrize("kind", [AutomaticCar, VariatorCar])
def test_the_clutch_of_neutral_idle_is_closed_on_a_rolling_road(kind: Any) -> None:
    """The brakes are released there: the converter alone is left, which has no operating points of an open clutch to look for."""
    converter = StartingConverter(w_lock=95.0)
    car = kind(start=NeutralIdleConverter(converter=converter))
    assert at_constant_speed(car) == at_constant_speed(kind(start=converter))


def test_the_rolling_road_weighs_the_vehicle_like_its_body() -> None:
    """With half the gravity, half the rolling resistance is missing: 0.01 m g/2."""
    earth = pt.replace(ElectricCar(), {"front.wheels.Cr": 0.01, "rear.wheels.Cr": 0.01, "body.g": 9.8})
    half = pt.replace(earth, {"body.g": 4.9})
    forces = [float(driveline_map(car, [20.0], [0.5])["force"].item()) for car in (earth, half)]
    assert forces[1] - forces[0] == pytest.approx(0.01 * float(earth.body.m) * 4.9, rel=1e-3)


class HalfPedal(Shifting):
    """A fixed gear; a switch of the driver, an input of the model, decides how much of the accelerator counts: by default half."""

    share: pt.Input = pt.signal_input("1", "Share of the accelerator", default=0.5, outside=True)

    def equations(self) -> pt.Equations:
        yield self.lever.value == 1
        yield self.throttle.value == self.share.value * self.accelerator.value
        yield self.clutch.value == self._pressed()


def test_an_input_of_the_model_has_its_default_in_a_map() -> None:
    half, whole = ManualCar.in_one_gear(schedule=HalfPedal()), ManualCar.in_one_gear(schedule=FixedGear())
    forces = [float(driveline_map(car, [8.0], [u])["force"].item()) for car, u in ((half, 0.6), (whole, 0.3))]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)
    assert forces[1] > 1000


def test_a_parallel_hybrid_is_kicked_down_in_its_map_only_where_it_is_on_the_road() -> None:
    """Not above 17.5/21 of the engine speed after the upshift to sixth gear at its limit: 0.98 670 rad/s 0.7/0.87 17.5/21 = 440 rad/s.

    In sixth gear the engine turns at 440 rad/s at 46 m/s; with ``eager`` = 3 the shift speeds alone would kick down up to 70 m/s.
    """
    car = pt.replace(ParallelHybrid(), {"schedule.eager": 3.0})
    found = driveline_map(car, [45.5, 46.5], [1.0], held={"control.running": 1, "control.matched": 1})
    assert found["gear"].values.ravel().tolist() == [5, 6]


@pytest.mark.slow
def test_backward_of_a_geared_car() -> None:
    """Over the first hill of the WLTC it takes the gears of the simulation and its fuel, but for shifts and transients."""
    cycle = DriveCycle.named("wltc").part(0, 140)
    run, back = drive_cycle(ManualCar(), cycle), backward(ManualCar(), cycle)
    assert back.fuel == pytest.approx(run.fuel, rel=0.03)
    assert back.missing.max() == 0
    driven = np.interp(cycle.times[:-1] + 0.5, run.result.time, run.result["schedule.gear"])
    assert np.mean(np.abs(driven - back.gears) < 0.6) > 0.93
    assert {1, 2, 3} <= set(back.gears.tolist())


def test_backward_of_a_geared_car_takes_no_map_of_one() -> None:
    """The map has the highest gear that the schedule keeps, which a drive over the same speeds does not have: less fuel, in gear 1."""
    with pytest.raises(pt.ParameterError, match="ManualCar has a map in each gear"):
        backward(ManualCar(), "udds", xr.Dataset())


@pytest.mark.slow
def test_backward_with_start_stop() -> None:
    """30 s of standing less at idle: 18.289 N.m at 85 rad/s with the indicated efficiency 0.38 take 9.5e-5 kg/s of 43 MJ/kg."""
    cycle = DriveCycle("stop", ((0.0, 0.0), (10.0, 0.0), (15.0, 5.0), (25.0, 0.0), (45.0, 0.0)))
    always, stopped = (backward(car, cycle) for car in (ManualCar(), ManualCar(start_stop=StartStop())))
    assert always.fuel - stopped.fuel == pytest.approx(30 * 18.289 * 85 / 0.38 / 43e6, rel=1e-4)
    assert stopped.fuel_rate.tolist() == pytest.approx([0.0, *always.fuel_rate[1:3], 0.0])


@pytest.mark.slow
def test_backward_finds_the_gear_of_a_cruise() -> None:
    """At 20 m/s, in rows of a minute and more: fifth gear from 16.5 m/s (1 + accelerator) on, and the fuel of the simulation."""
    cycle = DriveCycle("cruise", ((0.0, 0.0), (20.0, 20.0), (120.0, 20.0)))
    run, back = drive_cycle(ManualCar(), cycle), backward(ManualCar(), cycle)
    assert back.gears[-1] == run.result["schedule.gear"][-1]
    assert back.fuel_rate[-1] == pytest.approx(run.result["engine.fuel_rate"][-1], rel=0.01)


@pytest.mark.slow
def test_backward_says_what_the_vehicle_lacks() -> None:
    sprint = DriveCycle("sprint", ((0.0, 0.0), (10.0, 40.0)))
    assert backward(SplitPathCar(), sprint).missing.max() > 1000


def test_what_cannot_be_drawn_is_said(found: xr.Dataset) -> None:
    coasting = found.assign(force=-abs(found["force"]))
    for few in (found.isel(speed=[2]), found.isel(accelerator=[5]), coasting):
        with pytest.raises(pt.ParameterError, match="a driveline map is drawn over two speeds"):
            plot_driveline_map(few)
    backwards = plot_driveline_map(found.isel(speed=slice(None, None, -1), accelerator=slice(None, None, -1)))
    edge = next(line for line in backwards.lines if line.get_label() == "full accelerator")
    assert (np.diff(np.asarray(edge.get_xdata(), float)) > 0).all()


def test_labels_of_contours_stand_on_them_and_apart() -> None:
    """An efficiency of 0.6 f/f_max: its contours are horizontal lines, and the map is a triangle."""
    speed, pedal = np.linspace(1.0, 41.0, 41), np.linspace(0.0, 1.0, 41)
    force = 8e3 * pedal * (1.0 - speed[:, None] / 45.0)
    values = {"force": force, "efficiency": 0.6 * force / force.max()}
    grid = {name: (("speed", "accelerator"), value) for name, value in values.items()}
    found = xr.Dataset(grid, {"speed": speed, "accelerator": pedal})
    found["efficiency"].attrs["long_name"] = "Efficiency from the tank to the road"
    ax = plot_driveline_map(found)
    assert ax.get_xlim() == pytest.approx((0, 41 * 3.6))  # km/h
    texts = {text.get_text(): text.get_position() for text in ax.texts}
    assert len(texts) == len(ax.texts) >= 3
    for text, (_, up) in texts.items():
        assert up == pytest.approx(float(text) / 0.6 * force.max(), rel=0.01)
    full = np.column_stack([speed * 3.6, force[:, -1]])
    size = [41 * 3.6, 1.05 * force.max()]
    places, edges = np.array([*texts.values()]) / size, np.vstack([full, full * [1, 0]]) / size
    apart = np.hypot(*(places[:, None] - np.vstack([edges, places])).T)
    assert (np.sort(apart, axis=0)[1] > 0.04).all()  # the nearest is itself


@pytest.mark.slow
def test_figure_shows_map_and_points(found: xr.Dataset) -> None:
    run = drive_cycle(SplitPathCar(), DriveCycle.named("wltc").part(0, 40))
    ax = plot_driveline_map(found, run)
    assert ax.get_xlabel() == "Speed [km/h]"
    assert len(ax.collections) > 1
    legend = ax.get_legend()
    assert legend is not None
    cases = [text.get_text() for text in legend.get_texts()][-2:]
    assert cases == ["variable unit: split", "variable unit: negative recirculation"]


CARS_WITH_GEARS = ManualCar, DualClutchCar, AutomaticCar, FourWheelDriveCar, RearDriveCar
CASES = [(kind, gear) for kind in CARS_WITH_GEARS for gear in (1, 2, 6)] + [(SplitPathCar, 0), (VariatorCar, 0)]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "gear"), CASES)
def test_operating_points_are_where_runs_settle(kind: Any, gear: int) -> None:
    """From idle at a given speed of the car; or there are several, as in overrun, where a centrifugal clutch holds or the engine idles."""
    model = mapped_model(in_gear(kind(), gear) if gear else kind())
    plant = pt.compile(model)
    speeds, pedals = [2.0, 6.0, 14.0, 30.0], [0.0, 0.15, 0.5, 1.0]
    found = pt.steady(
        plant, {"body.speed": speeds, "driver.accelerator_set": pedals}, outputs=["body.force", "engine.w"]
    )
    several = 0
    for v, accelerator in itertools.product(speeds, pedals):
        point = found.sel(speed=v, accelerator_set=accelerator)
        if int(point["status"]) == SEVERAL:
            several += 1
            continue
        run = plant.simulate(
            100.0, parameters={"body.speed": v, "driver.accelerator_set": accelerator}, points=1, rtol=1e-6
        )
        for name in ("body.force", "engine.w"):
            assert float(point[name]) == pytest.approx(run[name][-1], rel=1e-4, abs=1e-3)
    assert several <= 8


def test_where_an_idling_engine_is_found() -> None:
    """At 2 m/s in first gear the engine idles behind an open clutch; its speed is no unknown of the steady state."""
    plant = pt.compile(mapped_model(in_gear(ManualCar(), 1)))
    found = pt.steady(plant, {"body.speed": 2.0, "driver.accelerator_set": 0.0}, outputs=["engine.w"])
    assert float(found["engine.w"]) == pytest.approx(float(ManualCar().engine.w_idle))


def test_guesses_of_variables_that_are_no_unknowns() -> None:
    """In overrun the engine idles behind an open clutch, or turns with the wheels, whatever is guessed."""
    plant = pt.compile(mapped_model(in_gear(ManualCar(), 1)))
    grid = {"body.speed": 14.0, "driver.accelerator_set": 0.15}
    for guesses in {}, {"engine.w": 85.0}, {"engine.w": 688.8}:
        assert int(pt.steady(plant, grid, outputs=["engine.w"], guesses=guesses)["status"]) == SEVERAL
