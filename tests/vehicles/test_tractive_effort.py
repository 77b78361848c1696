"""The tractive-effort diagram: against the formulas of a car, and against the speeds that the car reaches on hills."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.body import RoadProfile
from powertrain.components.transmissions import ManualGearbox
from powertrain.trials import full_accelerator, tractive_effort
from powertrain.trials.tractive_effort import _highest
from powertrain.trials.tractive_figure import plot_tractive_effort
from powertrain.vehicles import ManualCar, SeriesHybrid, VariatorCar

CAR = pt.replace(ManualCar(), {"front.wheels.Cr": 0.012, "rear.wheels.Cr": 0.01, "body.tailwind": -2.0})
RATIOS = (3.6, 2.1, 1.4, 1.05, 0.84, 0.68)


def pull(v: NDArray[np.float64], ratio: float) -> NDArray[np.float64]:
    """Newtons, by hand: full load less churning, 4.1 and 95 % of the final drive, wheels of 0.3 m, less the rolling resistance."""
    w = ratio * 4.1 * v / 0.3
    at_wheels = (CAR.engine.full_load(w) - 0.003 * w) * ratio * 4.1 * 0.95
    return np.asarray(at_wheels / 0.3 - 1300 * 9.80665 * (0.55 * 0.012 + 0.45 * 0.01))


def against(v: float, grade: float) -> float:
    return float(0.3 * 2.1 * 1.2 / 2 * (v + 2) ** 2 + 1300 * 9.80665 * np.sin(np.arctan(grade)))


def test_forces_by_hand_where_the_clutch_is_closed() -> None:
    v = np.linspace(5, 60, 56)
    found = tractive_effort(CAR, v, (0.0, 0.1))
    assert found["force"].dims == ("gear", "speed")
    for k, ratio in enumerate(RATIOS):
        w = ratio * 4.1 * v / 0.3
        closed = (w > 165) & (w < 660)
        assert closed.sum() > 5
        np.testing.assert_allclose(found["force"].values[k, closed], pull(v[closed], ratio), rtol=1e-6)
    np.testing.assert_allclose(found["resistance"].values[1], [against(x, 0.1) for x in v], rtol=1e-8)


@pytest.mark.slow
def test_speeds_on_grades_by_hand_and_by_simulation() -> None:
    grades = (0.0, 0.04, 0.1)
    found = tractive_effort(CAR, np.linspace(1, 65, 641), grades)
    for grade, reached in zip(grades, found["speed_on_grade"].values, strict=True):
        by_hand = []
        for ratio in RATIOS:
            v = np.linspace(165, 665, 4001) * 0.3 / 4.1 / ratio
            surplus = pull(v, ratio) - [against(x, grade) for x in v]
            if surplus[0] > 0 > surplus[-1]:
                falls = slice(int(surplus.argmax()), None)
                by_hand.append(float(np.interp(0.0, -surplus[falls], v[falls])))
        assert reached == pytest.approx(max(by_hand), rel=1e-4)
        if grade == 0.04:
            hill = pt.replace(CAR, {"road": RoadProfile.from_heights([0, 1e6], [0, 1e6 * np.sin(np.arctan(grade))])})
            assert full_accelerator(hill)["body.v"][-1] == pytest.approx(reached, rel=3e-3)


def test_a_speed_beyond_the_given_ones_is_not_guessed() -> None:
    found = tractive_effort(CAR, np.linspace(1, 30, 30), (0.0, 0.9))
    assert np.isnan(found["speed_on_grade"].values).all(), "one is faster, the other cannot be climbed"


@pytest.mark.parametrize(
    ("surplus", "reached"),
    [
        ([9, 6, -3, -9], 4.0),
        ([9, -9, 2, -1], 7.0),
        ([9, 5, 2, 0], 8.0),
        ([9, -9, 0, 2], np.nan),
        ([-1, -2, -3, -4], np.nan),
    ],
)
def test_the_highest_speed_is_where_the_surplus_falls_through_zero(surplus: list[float], reached: float) -> None:
    """Linear between 1, 2, 5 and 8 m/s; where the engine is stronger again at last there is no highest one."""
    found = _highest(np.array([1.0, 2.0, 5.0, 8.0]), np.array(surplus, float))
    assert found == pytest.approx(reached, nan_ok=True)


def test_a_vehicle_without_gears_has_one_line() -> None:
    found = tractive_effort(VariatorCar(), np.linspace(1, 60, 30))
    assert found["force"].shape == (1, 30)
    assert found["force"].notnull().all()
    ax = plot_tractive_effort(found)
    assert ax.lines[0].get_label() == "full accelerator"


def test_the_plot_has_a_line_for_each_gear_and_grade() -> None:
    found = tractive_effort(CAR, np.linspace(1, 60, 60), (0.0, 0.05, 0.2))
    ax = plot_tractive_effort(found)
    assert len(ax.lines) == 6 + 3 + 1
    dots = np.asarray(ax.lines[-1].get_xydata())
    for (x, y), grade, v in zip(dots, found["grade"].values, found["speed_on_grade"].values, strict=True):
        assert x == pytest.approx(3.6 * v)
        assert y == pytest.approx(against(v, grade) / 1e3, rel=1e-3)


@pytest.mark.slow
def test_hybrids_say_what_must_be_held() -> None:
    with pytest.raises(pt.ParameterError, match=r"genset.running"):
        tractive_effort(SeriesHybrid(), [10.0, 20.0])
    found = tractive_effort(SeriesHybrid(), [10.0, 20.0], held={"genset.running": 1})
    assert (found["force"] > 0).all()


@pytest.mark.parametrize(
    ("speeds", "grades", "said"),
    [
        ([0.0, 10.0], (0.0,), "above 0 that increase"),
        ([20.0, 10.0], (0.0,), "above 0 that increase"),
        ([10.0, 10.0], (0.0,), "above 0 that increase"),
        ([10.0], (0.0,), "two or more"),
        ([10.0, 20.0], (6.0,), "0.06 for 6 %"),
    ],
)
def test_speeds_and_grades_that_are_none(speeds: list[float], grades: tuple[float, ...], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        tractive_effort(ManualCar(gearbox=ManualGearbox()), speeds, grades)


def test_a_gap_between_two_gears_is_passed() -> None:
    """Beyond the limiter in the lower gear the slipping clutch of the other one does not hold the speed on 8.5 %, but its engine does."""
    box = ManualGearbox.of_ratios(3.6, 0.84)
    car = pt.replace(CAR, {"gearbox": box, "schedule.speeds": ((10.0, 8.0),), "engine.w_limit": 400.0})
    v = np.linspace(1, 45, 441)
    found = tractive_effort(car, v, np.linspace(0.0, 0.09, 91))
    surplus = found["force"].max("gear") - found["resistance"]
    surplus = surplus.transpose("grade", "speed")
    falls = ((surplus.values[:, :-1] > 0) & (surplus.values[:, 1:] <= 0)).sum(axis=1)
    assert falls.max() == 2
    for k in np.flatnonzero(falls == 2):
        reached = found["speed_on_grade"].values[k]
        assert np.all(surplus.values[k][v > reached] < 0)
