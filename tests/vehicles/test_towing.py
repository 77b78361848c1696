"""Vehicles that tow a trailer: the trials count its mass, its resistances and its brakes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.body import CoastDownBody, Trailer
from powertrain.components.control import OpenPedals
from powertrain.components.cycles import DriveCycle
from powertrain.components.vehicle import Vehicle
from powertrain.trials import drive_cycle, notes, tractive_effort
from powertrain.trials.backward import demand
from powertrain.trials.performance import full_accelerator
from powertrain.vehicles import ElectricCar, SplitPathCar

TRAILER = Trailer()
HEAVY = pt.replace(TRAILER, {"body.m": 20000, "axle.brakes.tau_max": 0})
CYCLE = DriveCycle("goes", ((0.0, 10.0), (10.0, 12.0), (20.0, 12.0)), grades=(0.05, 0.05, 0.05))
M_T, J, R, G = 1000.0, 1.5, 0.3, 9.80665


class Wrapped(pt.Component):
    """A car that pulls a ``Vehicle``."""

    car: SplitPathCar = SplitPathCar()
    other: Vehicle = Vehicle(m=1200, J=1, R=0.3, A=2, Cd=0.4)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.car.body.rear, self.other.flangeT)


def test_the_backward_calculation_accelerates_and_lifts_the_trailer() -> None:
    """In addition to the car alone: (m + J/R^2) a + m g sin(alpha); the map has the other resistances."""
    alone, towing = (demand(car, CYCLE)[1] for car in (SplitPathCar(), SplitPathCar(trailers=(TRAILER,))))
    sine = 0.05 / math.sqrt(1 + 0.05**2)
    assert towing - alone == pytest.approx([(M_T + J / R**2) * 0.2 + M_T * G * sine, M_T * G * sine], rel=1e-9)


@pytest.mark.slow
def test_the_tractive_effort_diagram_has_the_trailer_on_both_sides() -> None:
    """The force is less by the trailer's resistance on a level road; each grade takes its weight, too."""
    speeds, grades = [15.0, 20.0], [0.0, 0.1]
    alone, towing = (
        tractive_effort(car, speeds, grades) for car in (SplitPathCar(), SplitPathCar(trailers=(TRAILER,)))
    )
    level = 0.3 * 2.0 * 1.2 / 2 * np.square(speeds) + 0.01 * M_T * G * 0.94
    np.testing.assert_allclose(alone.force.values[0] - towing.force.values[0], level, rtol=1e-6)
    weight = M_T * G * 0.1 / math.sqrt(1.01)
    np.testing.assert_allclose(
        towing.resistance.values - alone.resistance.values, np.array([[0, 0], [weight, weight]]), atol=1e-6
    )


def test_a_mass_that_trials_would_miss_is_rejected() -> None:
    """A ``Vehicle`` behind the car was left out: 1,200 kg that nothing accelerated."""
    with pytest.raises(pt.ParameterError, match=r"Wrapped\.other is a Vehicle, whose mass .* use a Trailer"):
        demand(Wrapped(), CYCLE)


class TwoBodies(pt.Component):
    """Two cars on one road."""

    one: SplitPathCar = SplitPathCar()
    other: SplitPathCar = SplitPathCar()

    def equations(self) -> pt.Equations:
        yield from ()


def test_several_bodies_are_rejected_before_the_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    def drives(*_: object, **__: object) -> None:
        raise AssertionError("compiled before the error")

    monkeypatch.setattr(pt, "compile", drives)
    for trial in drive_cycle, full_accelerator:
        with pytest.raises(pt.ParameterError, match=r"needs one body .* it has 2: one\.body, other\.body"):
            trial(TwoBodies())


def test_trailers_come_from_files_and_go_there(tmp_path: Path) -> None:
    path = tmp_path / "car.toml"
    path.write_text('class = "ElectricCar"\n[[trailers]]\nbody.m = "0.8 t"\n[[trailers]]\naxle.brakes.tau_max = 0.0\n')
    car = pt.vehicles.load(path)
    assert [float(each.body.m) for each in car.trailers] == [800, 1000]
    assert [float(each.axle.brakes.tau_max) for each in car.trailers] == [2000, 0]
    pt.vehicles.save(car, path)
    assert pt.vehicles.load(path) == car


def test_one_trailer_is_not_a_row_of_trailers() -> None:
    with pytest.raises(pt.ModelError, match=r"ElectricCar\.trailers is one Trailer; .* write \(Trailer\(\.\.\.\),\)"):
        ElectricCar(trailers=Trailer())  # type: ignore[arg-type]


def test_the_tyres_of_a_trailer_are_not_part_of_a_measured_road_load() -> None:
    """The coefficients are those of the car; its trailer rolls on tyres of its own."""
    car = ElectricCar(body=CoastDownBody(), trailers=(TRAILER,))
    pt.compile(pt.replace(car, {"front.wheels.Cr": 0, "rear.wheels.Cr": 0}))


def test_notes_count_the_mass_and_the_brakes_of_trailers() -> None:
    """15 kN for 21.7 t are 0.69 m/s2."""
    assert notes(ElectricCar(trailers=(TRAILER,))) == notes(ElectricCar())
    (said,) = set(notes(ElectricCar(trailers=(HEAVY,)))) - set(notes(ElectricCar()))
    assert "body.m = 1700 kg and trailers of 20000 kg with 0.69 m/s2 at most" in said
    light = pt.replace(TRAILER, {"body.m": 0.8})
    assert any("trailers[0].body.m = 0.8 kg is unusual" in said for said in notes(ElectricCar(trailers=(light,))))


def test_trailers_brake_by_the_pedal_also_while_the_car_regenerates() -> None:
    """0.3 of 2,000 N.m."""
    car = ElectricCar(driver=OpenPedals(), trailers=(TRAILER,))
    run = pt.simulate(car, 0.1, inputs={"driver.brake_pedal": 0.3}, starts={"body.v": 20})
    assert run["trailers[0].axle.brakes.tau"][-1] == pytest.approx(600, rel=1e-3)
