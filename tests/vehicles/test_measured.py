"""Measured cars: data, building, and what is predicted of them."""

from __future__ import annotations

import csv
import re
from dataclasses import fields, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import least_squares

import powertrain as pt
from powertrain.components.engines import BufferedAccessories
from powertrain.components.transmissions import NeutralIdleConverter
from powertrain.measured.building import DOWN, RADIUS, _machine, build, progression, ratios
from powertrain.measured.fitting import NOISE, Sensitivities
from powertrain.measured.prediction import Prediction, predict, table
from powertrain.measured.published import published, published_others
from powertrain.measured.record import SPREAD, TestCar, cased
from powertrain.measured.technology import Technology, family, is_charged, priors, stops
from powertrain.trials import full_accelerator, time_between

PAGE = (Path(__file__).parents[2] / "docs" / "vehicles" / "measured.md").read_text(encoding="utf-8")
CARS = {f"{car.name} {car.transmission}": car for car in TestCar.shipped()}
MIRAGE = CARS["Mitsubishi Mirage manual"]


def test_fourteen_cars() -> None:
    assert len(CARS) == 14
    kinds = [car.transmission for car in CARS.values()]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {
        "manual": 6, "belt": 3, "automatic": 2, "dual clutch": 1, "power split": 1, "electric": 1
    }  # fmt: skip
    assert family(CARS["Toyota RAV4 automatic"]) == family(CARS["Toyota Prius power split"]) == "late closing"
    assert family(CARS["Volkswagen Jetta automatic"]) == "turbocharged"


@pytest.mark.parametrize(
    ("listed", "name"),
    [
        ("MAZDA MX-5", "Mazda MX-5"),
        ("MAZDA MAZDA3", "Mazda Mazda3"),
        ("BMW X5 AWD", "BMW X5 AWD"),
        ("toyota rav4", "Toyota RAV4"),
        ("MERCEDES-BENZ METRIS", "Mercedes-Benz Metris"),
        ("Volkswagen Golf GTI", "Volkswagen Golf GTI"),
    ],
)
def test_names_as_their_makers_write_them(listed: str, name: str) -> None:
    """Of a list in capitals, initials and words with digits keep theirs."""
    assert cased(listed) == name


def test_warm_udds_is_the_hot_bag_and_the_stabilised_one() -> None:
    assert pytest.approx((5.78 + 6.21) / (5.78 / 47.6845 + 6.21 / 43.6685)) == MIRAGE.udds
    assert CARS["Nissan Versa manual"].udds == pytest.approx(1.026 * 36.3)  # no bags published
    prius = CARS["Toyota Prius power split"]
    assert prius.udds == pytest.approx((5.78 + 6.21) / (5.78 / 62.7224963 + 6.21 / 114.3515914))
    assert CARS["Tesla Model 3 Long Range AWD electric"].hwfet == 173.4


def test_transmissions_with_the_remarks_of_the_agency(tmp_path: Path) -> None:
    source = Path(str(files("powertrain.measured"))) / "data" / "epa_2022_test_cars.csv"
    text = source.read_text(encoding="utf-8")
    path = tmp_path / "mine.csv"
    remarked = text.replace("Automated Manual- Selectable,", '"Automated Manual- Selectable (e.g., with paddles)",')
    assert remarked != text
    path.write_text(remarked, encoding="utf-8")
    assert TestCar.from_csv(path) == TestCar.shipped()


def test_other_cars_are_read_in_the_same_columns(tmp_path: Path) -> None:
    source = Path(str(files("powertrain.measured"))) / "data" / "epa_2022_test_cars.csv"
    rows = list(csv.reader(source.read_text(encoding="utf-8").splitlines()))
    path = tmp_path / "mine.csv"
    path.write_text("\n".join(",".join(row) for row in rows[:3]), encoding="utf-8")
    assert TestCar.from_csv(path) == (MIRAGE,)
    path.write_text(path.read_text(encoding="utf-8").replace("Manual", "Rubber band"), encoding="utf-8")
    with pytest.raises(pt.ParameterError, match="unknown transmission 'Rubber band'"):
        TestCar.from_csv(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("test_mass_kg", "mass", r"mine.csv lacks columns \(separated by commas\): test_mass_kg$"),
        (",", ";", r"mine.csv lacks columns \(separated by commas\): vehicle, "),
        ("1077.3", "heavy", r"mine.csv, line 2: test_mass_kg = 'heavy' is not a number"),
        ("1077.3", "-5", r"mine.csv, line 2: test_mass_kg = -5 must be positive"),
        ("MITSUBISHI", "#", r"mine.csv has no rows"),
    ],
)
def test_lists_that_do_not_fit(tmp_path: Path, old: str, new: str, said: str) -> None:
    source = Path(str(files("powertrain.measured"))) / "data" / "epa_2022_test_cars.csv"
    lines = source.read_text(encoding="utf-8").splitlines()[: 1 if new == "#" else 2]
    (tmp_path / "mine.csv").write_text("\n".join(lines).replace(old, new), encoding="utf-8")
    with pytest.raises(pt.ParameterError, match=said):
        TestCar.from_csv(tmp_path / "mine.csv")
    with pytest.raises(pt.ParameterError, match=r"absent.csv cannot be read: No such file"):
        TestCar.from_csv(tmp_path / "absent.csv")


HEAD = (
    "vehicle,test_vehicle,transmission,gears,drive,displacement_l,rated_power_kW,test_mass_kg,axle_ratio,n_over_v_top_gear_rpm_per_kmh,"
    "coast_A_N,coast_B_N_per_mps,coast_C_N_per_mps2,test,procedure,fuel,fuel_economy_mpg,bag2_mpg,bag3_mpg,bag4_mpg\n"
)
GASOLINE, DIESEL, E85 = (
    "Tier 2 Cert Gasoline",
    "Federal Cert Diesel 7-15 PPM Sulfur",
    "E85 (85% Ethanol 15% EPA Unleaded Gasoline)",
)


def row(kind: str, fuel: str, gears: int = 8, bag4: str = "", mpg: float = 30.0) -> str:
    """An FTP of a car of nobody's."""
    return f"OTHER CAR,X1,{kind},{gears},R,2.0,180,1800,3.2,20.0,130,1.5,0.42,FTP,Federal fuel 2-day exhaust,{fuel},{mpg},,,{bag4}\n"


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (
            row("Automatic", DIESEL),
            "the fuel is Federal Cert Diesel 7-15 PPM Sulfur; only gasoline and electric cars are supported",
        ),
        (row("Automatic", GASOLINE) + row("Automatic", "Electricity"), "plug-in hybrids are not supported"),
        (
            row("Semi-Automatic", GASOLINE, bag4="60"),
            "a hybrid whose transmission is 'Semi-Automatic'; only hybrids with a power",
        ),
        (row("Manual", GASOLINE, gears=3), r"gears = 3; manual gearboxes have 4 to 10"),
    ],
)
def test_cars_that_are_not_built_from_the_list(tmp_path: Path, rows: str, said: str) -> None:
    """A diesel was built as a gasoline engine, a plug-in hybrid as an electric car, a parallel hybrid as a power split."""
    (tmp_path / "mine.csv").write_text(HEAD + rows, encoding="utf-8")
    with pytest.raises(pt.ParameterError, match=said):
        TestCar.from_csv(tmp_path / "mine.csv")


CELLS = HEAD.strip().split(",")


def listed(**changes: str) -> str:
    """A row of the list in which some cells are others."""
    cells = dict(zip(CELLS, row("Automatic", GASOLINE).strip().split(","), strict=True)) | changes
    return ",".join(cells[name] for name in CELLS) + "\n"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"test_mass_kg": "4000"}, r"the road load is 371 N at 80 km/h, 0.95 % of the weight, and not 1.2 % to 6 %; check the units of"),
        ({"coast_A_N": "30", "coast_B_N_per_mps": "0.2", "coast_C_N_per_mps2": "0.02"}, r"the road load is 44 N at 80 km/h"),
        ({"coast_A_N": "-130"}, r"coast_A_N = -130 must not be negative"),
        ({"displacement_l": "1998"}, r"displacement_l = 1998 l is not within 0.5 to 10 l; check the unit"),
        ({"rated_power_kW": "180000"}, r"rated_power_kW = 180000 kW is not within 20 to 1500 kW; check the unit"),
        ({"gears": "8.5"}, r"gears = 8.5 is not a whole number"),
        ({"drive": "AWD"}, r"unknown drive 'AWD'; choose from F, R, A, 4, P"),
        ({"drive": ""}, r"drive is empty"),
        ({"vehicle": ""}, r"vehicle is empty"),
        ({"fuel": ""}, r"fuel is empty"),
        ({"fuel": "Vegetable oil"}, r"the fuel is Vegetable oil; only gasoline and electric cars"),
        ({"vehicle": "OTHER HYBRID"}, r"a hybrid whose transmission is 'Automatic'"),
        ({"procedure": "Charge Depleting UDDS"}, r"procedure = Charge Depleting UDDS with Tier 2 Cert Gasoline; plug-in hybrids"),
        ({"fuel": "Electricity", "fuel_economy_mpg": "16.3"}, r"fuel_economy_mpg = 16.3 of an electric car; .* write 206.8"),
        ({"bag4_mpg": "40,50"}, r"more cells than the file has columns"),
    ],
)  # fmt: skip
def test_cells_that_no_car_has(tmp_path: Path, changes: dict[str, str], said: str) -> None:
    """All of these were taken: an odd drive as four-wheel drive, an odd fuel as gasoline, half a gear as none, pounds as kilograms."""
    (tmp_path / "mine.csv").write_text(HEAD + listed() + listed(test_vehicle="X2", **changes), encoding="utf-8")
    with pytest.raises(pt.ParameterError, match=f"mine.csv, line 3:? {said}"):
        TestCar.from_csv(tmp_path / "mine.csv")


def test_cells_in_other_spellings(tmp_path: Path) -> None:
    others = listed(transmission=" semi-automatic", drive="r ", fuel="TIER 2 CERT GASOLINE", test="ftp")
    (tmp_path / "mine.csv").write_text(HEAD + listed(), encoding="utf-8")
    known = TestCar.from_csv(tmp_path / "mine.csv")
    (tmp_path / "mine.csv").write_text(HEAD + others, encoding="utf-8")
    assert TestCar.from_csv(tmp_path / "mine.csv") == known
    same = listed(test_mass_kg="1.8e3", transmission="AUTOMATIC")
    (tmp_path / "mine.csv").write_text(HEAD + listed() + same, encoding="utf-8")
    assert len(TestCar.from_csv(tmp_path / "mine.csv")) == 1


def test_two_cars_are_not_one(tmp_path: Path) -> None:
    """Rows with one test vehicle were one car, with the data of the first."""
    (tmp_path / "mine.csv").write_text(HEAD + listed() + listed(transmission="Manual", gears="6"), encoding="utf-8")
    said = "mine.csv, line 3: transmission = Manual, but Automatic in another row of OTHER CAR X1"
    with pytest.raises(pt.ParameterError, match=said):
        TestCar.from_csv(tmp_path / "mine.csv")


AGENCY = {
    "Represented Test Veh Make": "MITSUBISHI",
    "Represented Test Veh Model": "MIRAGE",
    "Test Vehicle ID": "EB19-LD52",
    "Test Veh Configuration #": "0",
    "Test Veh Displacement (L)": "1.193",
    "Rated Horsepower": "78",
    "Tested Transmission Type": "Manual",
    "# of Gears": "5",
    "Drive System Code": "F",
    "Equivalent Test Weight (lbs.)": "2375",
    "Axle Ratio": "4.06",
    "N/V Ratio": "50.6",
    "Analytically Derived FE?": "No",
    "Test Procedure Description": "Federal fuel 2-day exhaust (w/can load)",
    "Test Fuel Type Description": "Tier 2 Cert Gasoline",
    "Test Category": "FTP",
    "RND_ADJ_FE": "44.9",
    "FE_UNIT": "MPG",
    "FE Bag 1": "44.1036",
    "FE Bag 2": "43.6685",
    "FE Bag 3": "47.6845",
    "FE Bag 4": "",
    "Target Coef A (lbf)": "15.716",
    "Target Coef B (lbf/mph)": "0.20027",
    "Target Coef C (lbf/mph**2)": "0.015038",
}


def published_list(tmp_path: Path, *changes: dict[str, str]) -> tuple[TestCar, ...]:
    with (tmp_path / "list.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [*AGENCY, "Averaging Method Cd"])
        writer.writeheader()
        writer.writerows(AGENCY | {"Averaging Method Cd": "N"} | change for change in changes)
    return TestCar.from_csv(tmp_path / "list.csv")


def test_the_list_as_the_agency_publishes_it(tmp_path: Path) -> None:
    """In pounds, miles and horsepower it gives the shipped car, and not what was computed from another car's test."""
    bags = {"FE Bag 2": "0", "FE Bag 3": "0"}
    road = {"Test Category": "HWY", "Test Procedure Description": "HWFE", "RND_ADJ_FE": "60.8"} | bags
    derived = {"Analytically Derived FE?": "Yes", "RND_ADJ_FE": "20"}
    (car,) = published_list(tmp_path, {}, road, derived)
    assert (car.name, car.hwfet) == (MIRAGE.name, MIRAGE.hwfet)
    for name in ("udds", "power", "mass", "displacement", "w_per_v", "road_load"):
        assert getattr(car, name) == pytest.approx(getattr(MIRAGE, name), rel=1e-3), name


def test_configurations_of_one_test_vehicle_are_cars_of_their_own(tmp_path: Path) -> None:
    heavy = {"Test Veh Configuration #": "1", "Equivalent Test Weight (lbs.)": "2500"}
    assert [round(car.mass / 0.45359237) for car in published_list(tmp_path, {}, heavy)] == [2375, 2500]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"N/V Ratio": "fifty"}, "line 2: N/V Ratio = 'fifty' is not a number"),
        ({"Rated Horsepower": ""}, "line 2: rated_power_kW = '' is not a number"),
        ({"FE_UNIT": "kWh/100mi"}, "line 2: FE_UNIT = 'kWh/100mi'; only results in MPG"),
    ],
)
def test_published_cells_that_do_not_fit(tmp_path: Path, changes: dict[str, str], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        published_list(tmp_path, changes)


def test_what_the_fuel_economy_guide_knows(tmp_path: Path) -> None:
    """Start-stop and charging are facts where a file has them; otherwise they follow from the maker and the specific power."""
    (usual,) = TestCar.from_csv(_written(tmp_path, HEAD + listed()))
    assert (usual.start_stop, usual.turbocharged, stops(usual), family(usual)) == (None, None, False, "turbocharged")
    head = HEAD.strip() + ",start_stop,turbocharged\n"
    (known,) = TestCar.from_csv(_written(tmp_path, head + listed().strip() + ",y,N\n"))
    assert (known.start_stop, known.turbocharged, stops(known), family(known)) == (True, False, True, "port injected")
    assert not stops(replace(known, transmission="manual"))  # it idles in gear on the test
    with pytest.raises(pt.ParameterError, match="line 2: start_stop = 'maybe'; choose from Y, N, or leave it empty"):
        TestCar.from_csv(_written(tmp_path, head + listed().strip() + ",maybe,\n"))


def _written(tmp_path: Path, text: str) -> Path:
    (tmp_path / "mine.csv").write_text(text, encoding="utf-8")
    return tmp_path / "mine.csv"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"transmission": "planetary"}, "Mitsubishi Mirage: unknown transmission 'planetary'; choose from manual"),
        ({"gears": 3}, "Mitsubishi Mirage: gears = 3; manual gearboxes have 4 to 10"),
        ({"drive": "front"}, "Mitsubishi Mirage: unknown drive 'front'; choose from F, R, A, 4, P"),
    ],
)
def test_changed_cars_that_cannot_be_built(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        replace(MIRAGE, **changes)


@pytest.mark.slow
def test_the_name_of_a_cycle_in_capitals_is_that_cycle() -> None:
    """It was driven warm, and compared with nothing."""
    one, other = predict(MIRAGE, "UDDS"), predict(MIRAGE, "udds")
    assert (one.cycle, one.mpg, one.measured) == (other.cycle, other.mpg, other.measured)


def test_a_car_with_two_fuels_is_that_with_gasoline(tmp_path: Path) -> None:
    (tmp_path / "mine.csv").write_text(
        HEAD + row("Automatic", E85, mpg=20.0) + row("Automatic", GASOLINE), encoding="utf-8"
    )
    (car,) = TestCar.from_csv(tmp_path / "mine.csv")
    assert car.udds == pytest.approx(1.026 * 30)


@pytest.mark.parametrize("car", [car for car in CARS.values() if car.gears > 1], ids=lambda car: car.name)
def test_gears_have_the_spread_and_end_at_the_top_ratio(car: TestCar) -> None:
    gears = np.array(ratios(car))
    assert gears[-1] * car.axle_ratio / RADIUS == pytest.approx(car.w_per_v)
    assert gears[0] / gears[-1] == pytest.approx(SPREAD[car.gears])
    steps = gears[:-1] / gears[1:]
    assert steps[:-1] / steps[1:] == pytest.approx(progression(car))


@pytest.mark.parametrize(
    "car", [car for car in CARS.values() if car.transmission in ("automatic", "dual clutch")], ids=lambda car: car.name
)
def test_a_full_accelerator_shifts_the_largest_step_at_the_rated_speed(car: TestCar) -> None:
    vehicle, gears = build(car, Technology()), np.array(ratios(car))
    schedule, rated = vehicle.schedule, float(vehicle.engine.w_limit) / 1.12
    speeds = np.array([up for up, _ in schedule.speeds]) * (1 + float(schedule.eager))
    assert (speeds * gears[:-1]).max() * car.axle_ratio / RADIUS == pytest.approx(rated)
    assert [down / up for up, down in schedule.speeds] == pytest.approx([DOWN] * len(speeds))


def test_the_ring_of_a_power_split_turns_as_that_of_the_prius() -> None:
    """3.267 times as fast as wheels of 0.317 m, whatever the radius of the model's."""
    vehicle = build(CARS["Toyota Prius power split"], Technology())
    assert float(vehicle.front.final_drive.ratio) / RADIUS == pytest.approx(3.267 / 0.317, rel=1e-3)


def test_what_the_engine_drives_at_rest() -> None:
    """The RAV4 of 2019 has no start-stop; converters do not drag at rest; a battery supplies the accessories of an engine that stops."""
    assert not stops(CARS["Toyota RAV4 automatic"])
    for car in CARS.values():
        if car.transmission in ("automatic", "belt", "dual clutch", "manual"):
            vehicle = build(car, Technology())
            assert isinstance(vehicle.accessories, BufferedAccessories) == stops(car)
            if car.transmission in ("automatic", "belt"):
                assert isinstance(vehicle.start, NeutralIdleConverter)
                engine = vehicle.engine
                stall = vehicle.start.converter.converter.table[0][1] ** -2 * 2 * (2300 * np.pi / 30) ** 2
                assert (
                    float(vehicle.start.clutch.capacity)
                    > stall
                    > 2 * float(engine.full_load(2300 * np.pi / 30)) * 0.999
                )


@pytest.mark.parametrize("geared", [False, True])
def test_losses_of_a_machine_are_shares_of_its_power(geared: bool) -> None:
    """0.07 % for the inverter and 100 W, 6 % at the largest torque, and at top speed 1.5 % unless the road load has them."""
    machine = _machine(80e3, 200.0, 1200.0, geared=geared)
    rest, pulling, turning = machine.losses(np.array([0.0, 0.0, 1200.0]), np.array([0.0, 200.0, 0.0]))
    assert [rest, pulling - rest, turning - rest] == pytest.approx([156.0, 4800.0, 0.0 if geared else 1200.0])


def test_cool_oil_makes_drag_and_no_other_loss() -> None:
    technology = Technology()
    for car in CARS.values():
        (eta, drag), (cool_eta, cool_drag) = technology.gearbox(car), technology.gearbox(car, cool=True)
        assert cool_eta == eta
        assert cool_drag == pytest.approx(technology.cool_gearbox * drag)
    assert technology.cool_gearbox > 1


def test_the_table_of_predictions_has_both_cycles_of_a_car_in_one_row() -> None:
    found = [Prediction(MIRAGE, "udds", 44.0, 40.0, 0.0), Prediction(MIRAGE, "hwfet", 57.0, 60.0, 0.0)]
    (row,) = table(found).to_dict("records")
    assert row["udds error %"] == pytest.approx(10.0)
    assert row["hwfet error %"] == pytest.approx(-5.0)
    assert (row["car"], row["udds predicted"], row["hwfet measured"]) == (MIRAGE.name, 44.0, 60.0)


@pytest.mark.parametrize("name", ["Toyota Prius power split", "Tesla Model 3 Long Range AWD electric"])
def test_a_battery_of_twice_the_power_is_charged_with_twice_the_power(name: str) -> None:
    """And gives twice the power, with the same efficiency: it has twice the cells in parallel."""
    car = CARS[name]
    one, two = (build(replace(car, power=k * car.power), Technology()).battery for k in (1, 2))
    for more in ("Q", "i_charge", "i_discharge"):
        assert float(getattr(two, more)) == pytest.approx(2 * float(getattr(one, more)))
    assert float(two.R) * float(two.i_charge) == pytest.approx(float(one.R) * float(one.i_charge))


def test_shared_numbers_stay_in_their_range() -> None:
    for f in fields(Technology):
        mean, sd = priors()[f.name]
        assert abs(getattr(Technology(), f.name) - mean) < 2 * sd, f.name


def test_fit_is_the_regularised_least_squares() -> None:
    """Against a general solver, on numbers that nobody chose; leaving a car out is fitting without its rows."""
    random = np.random.default_rng(3)
    cars = tuple(f"car {k // 2}" for k in range(8))
    known = Sensitivities(cars, ("udds", "hwfet") * 4, tuple("abc"), *(random.normal(size=s) for s in (3, 8, (8, 3))))

    def cost(z: np.ndarray, rows: np.ndarray) -> np.ndarray:
        return np.concatenate([known.predicted(z)[rows] / NOISE, z])

    left = known.left_out()
    for k in range(4):
        rows = np.array([car != f"car {k}" for car in cars])
        found = least_squares(cost, np.zeros(3), args=(rows,)).x
        np.testing.assert_allclose(known.fitted(f"car {k}"), found, atol=1e-6)
        np.testing.assert_allclose(left[~rows], known.predicted(found)[~rows], atol=1e-6)


def test_defaults_are_the_fit() -> None:
    known = Sensitivities.shipped()
    np.testing.assert_allclose(known.fitted(), known.at, atol=0.15)


def test_published_errors() -> None:
    """The aim: 3 % on average and none above 8 % for a car that had no part in the numbers."""
    found = published()
    assert len(found) == 28
    left = found.left_out.dropna().abs()
    assert len(left) == 26
    assert left.mean() <= 3
    assert left.max() <= 8
    np.testing.assert_allclose(found.error, 100 * (found.predicted / found.measured - 1), atol=0.06)


OTHERS = {car.test_vehicle: car for car in TestCar.others()}


def test_published_errors_of_cars_that_had_no_part_in_the_numbers() -> None:
    """The page says what the model does not know of them."""
    found = published_others()
    assert len(OTHERS) == 46
    assert list(found.test_vehicle) == [name for name in OTHERS for _ in range(2)]
    for name, cycle, measured in zip(found.test_vehicle, found.cycle, found.measured, strict=True):
        assert getattr(OTHERS[name], cycle) == pytest.approx(measured, abs=0.01)
    np.testing.assert_allclose(found.error, 100 * (found.predicted / found.measured - 1), atol=0.06)
    size = found.error.abs()
    assert size.mean() == pytest.approx(5.0, abs=0.05)
    assert size.median() == pytest.approx(3.5, abs=0.05)
    assert (size < 8).mean() > 5 / 6 - 0.01
    assert abs(found.error[found.cycle == "hwfet"].mean()) < 1
    assert found.error[found.cycle == "udds"].mean() == pytest.approx(5, abs=0.5)
    assert found.error[found.cycle == "udds"].median() == pytest.approx(2, abs=0.5)
    converters = found[(found.cycle == "udds") & found.transmission.isin(["automatic", "belt"])]
    assert converters.error.abs().median() == pytest.approx(2, abs=0.05)
    assert (size > 10).groupby(found.cycle).sum().to_dict() == {"udds": 8, "hwfet": 2}


def test_the_error_between_the_cycles_and_how_well_the_fit_determines_it() -> None:
    """That of the other cars, and its standard deviation by the posterior of the shared numbers for cars with their transmissions."""
    found = published_others().pivot(index=["transmission", "test_vehicle"], columns="cycle", values="error")
    error = (found.udds - found.hwfet).drop(["electric", "power split"])
    assert (len(error), error.mean(), error.sem()) == pytest.approx((41, 3.5, 0.8), abs=0.05)
    known = Sensitivities.shipped()
    J = known.slopes / NOISE
    covariance = np.linalg.inv(J.T @ J + np.eye(len(known.names)))
    kinds = {car.test_vehicle: car.transmission for car in CARS.values()}
    rows = pd.DataFrame(known.slopes).groupby([[kinds[car] for car in known.cars], list(known.cycles)]).mean()
    between = rows.xs("udds", level=1) - rows.xs("hwfet", level=1)
    mean = between.loc[error.index.get_level_values(0)].to_numpy().mean(axis=0)
    assert np.sqrt(mean @ covariance @ mean) == pytest.approx(1.0, abs=0.05)


def test_rests_of_cars_with_and_without_start_stop() -> None:
    """Beside the HWFET, which hardly has rests, converters and clutches have the same error on the UDDS if the engine runs at rest."""
    found = published_others().pivot(index="test_vehicle", columns="cycle", values="error")
    beside = found.udds - found.hwfet

    def mean(stop: bool, *kinds: str) -> float:
        cars = [name for name, car in OTHERS.items() if car.start_stop is stop and car.transmission in kinds]
        return float(beside[cars].mean())

    runs = mean(False, "automatic")
    assert mean(True, "automatic") - runs == pytest.approx(2.5, abs=0.5)
    assert mean(False, "manual", "dual clutch") - runs == pytest.approx(0, abs=0.5)


@pytest.mark.slow
def test_a_manual_car_with_start_stop_idles_on_the_test() -> None:
    """The Wrangler, 12 % too good; an engine that stopped would make it 17 %."""
    found = published_others()
    row = found[(found.test_vehicle == "L8JLJ1965-1") & (found.cycle == "udds")].iloc[0]
    assert OTHERS["L8JLJ1965-1"].start_stop
    assert predict(OTHERS["L8JLJ1965-1"], "udds").mpg == pytest.approx(row.predicted, rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", published_others().groupby("transmission").test_vehicle.first())
def test_what_is_published_of_other_cars_is_what_is_simulated(name: str) -> None:
    """One of each transmission."""
    found = published_others()
    row = found[(found.test_vehicle == name) & (found.cycle == "hwfet")].iloc[0]
    one = predict(OTHERS[name], "hwfet")
    assert (one.message, one.time_outside) == ("", 0)
    assert one.mpg == pytest.approx(row.predicted, rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("cycle", ["udds", "hwfet"])
@pytest.mark.parametrize("name", CARS)
def test_what_is_published_is_what_is_simulated(name: str, cycle: str) -> None:
    car, found = CARS[name], published()
    row = found[(found.test_vehicle == car.test_vehicle) & (found.cycle == cycle)].iloc[0]
    one = predict(car, cycle)
    assert not one.message
    assert one.time_outside == 0
    assert one.mpg == pytest.approx(row.predicted, rel=3e-3)
    assert one.measured == pytest.approx(row.measured, abs=0.01)


def test_what_the_guide_says_of_other_cars() -> None:
    """33 cars of model year 2020; for ten the maker, and for one the specific power, would have been wrong."""
    known = [car for car in OTHERS.values() if car.start_stop is not None]
    assert len(known) == len([car for car in OTHERS.values() if car.turbocharged is not None]) == 33
    usual = [replace(car, start_stop=None, turbocharged=None) for car in known]
    wrong = [car.name for car, guess in zip(known, usual, strict=True) if stops(car) != stops(guess)]
    assert len(wrong) == 10
    assert {"Toyota 4RUNNER 2WD", "Toyota Avalon", "Acura Tlx"} <= set(wrong)
    charged = [car.name for car, guess in zip(known, usual, strict=True) if is_charged(car) != is_charged(guess)]
    assert charged == ["Toyota 86"]


SPRINTS = {
    row[0]: (float(row[1]), float(row[2]))
    for row in re.findall(r"^\| (\S+) \| ([\d.]+) \| ([\d.]+) \|", PAGE, re.MULTILINE)
}


def test_most_sprints_are_within_a_tenth() -> None:
    """The page says which are not, and why."""
    far = {name for name, (measured, predicted) in SPRINTS.items() if abs(predicted / measured - 1) > 0.1}
    assert len(SPRINTS) == 7
    assert far == {"mazda-mx-5-manual", "toyota-rav4-automatic"}


@pytest.mark.slow
@pytest.mark.parametrize("name", SPRINTS)
def test_sprints_are_what_is_simulated(name: str) -> None:
    """From one foot on, where the clock of the magazines starts, to 60 mph."""
    sprint = full_accelerator(pt.vehicles.load(name))
    rolled = np.interp(0.3048, sprint["body.s"], sprint.time)
    assert time_between(sprint, 0.0, 60 * 0.44704) - rolled == pytest.approx(SPRINTS[name][1], abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["volkswagen-golf-gti-manual", "mazda-mx-5-manual"])
def test_the_driven_axle_transmits_what_its_load_permits(name: str) -> None:
    """With mu = 1 a front axle with a share s of the weight accelerates at most by s g/(1 + h/l), a rear axle by (1 - s) g/(1 - h/l)."""
    sprint = full_accelerator(pt.vehicles.load(name))
    share, lever = (0.6, 1 + 0.55 / 2.7) if "golf" in name else (0.5, 1 - 0.55 / 2.7)
    limit = share * 9.80665 / lever
    early = sprint["body.v"] < 60 * 0.44704
    assert 0.9 * limit < sprint["body.a"][early].max() < limit


def test_an_engine_of_much_power_per_litre_is_rated_at_a_higher_speed() -> None:
    """The mean effective pressure 4 pi P/(V w) of the MX-5 is limited to 11.4 bar; that of the Mazda3 at 6,200 rpm is below that."""
    engines = [Technology().engine(CARS[name]) for name in ("Mazda MX-5 manual", "Mazda Mazda3 manual")]
    rated = [float(engine.w_limit) / 1.12 * 30 / np.pi for engine in engines]
    assert rated[0] == pytest.approx(120 * 135e3 / (0.002 * 11.4e5), rel=1e-6)
    assert rated[1] == pytest.approx(6200)


@pytest.mark.parametrize("name", ["Mazda MX-5 manual", "Volkswagen Golf GTI manual"])
def test_the_preferred_torque_has_the_shared_mean_effective_pressure(name: str) -> None:
    """p = 4 pi tau/V."""
    technology, car = Technology(), CARS[name]
    curve = technology.engine(car).curve
    assert curve is not None
    torque = technology.preferred(car) * float(curve.values.max())
    shared = technology.pressure_turbo if "GTI" in name else technology.pressure
    assert 4 * np.pi * torque / car.displacement == pytest.approx(1e5 * shared)


@pytest.mark.slow
def test_a_car_is_driven_by_its_data() -> None:
    """Half the road load and a tenth more mass change consumption as they should, so that nothing of a car is ignored."""
    A, B, C = MIRAGE.road_load
    light = replace(MIRAGE, road_load=(A / 2, B / 2, C / 2))
    heavy = replace(MIRAGE, mass=1.1 * MIRAGE.mass)
    high = replace(MIRAGE, w_per_v=1.2 * MIRAGE.w_per_v)
    mpg = [predict(car, "hwfet").mpg for car in (MIRAGE, light, heavy, high)]
    assert mpg[1] > 1.3 * mpg[0]
    assert 0.94 * mpg[0] < mpg[2] < 0.995 * mpg[0]
    assert mpg[3] < 0.97 * mpg[0]
    assert float(build(heavy, Technology()).body.m) == pytest.approx(1.1 * MIRAGE.mass)
