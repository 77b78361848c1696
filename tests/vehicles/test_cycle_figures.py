"""The pictures of a cycle run show its numbers."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import powertrain as pt
from powertrain.components.cvu import VariableUnit
from powertrain.components.cycles import DriveCycle
from powertrain.components.wheels import WheelBrake
from powertrain.trials import CycleRun, drive_cycle
from powertrain.trials import figures as draw
from powertrain.trials.anatomy import parts_of, variators
from powertrain.vehicles.automatic_car import AutomaticCar
from powertrain.vehicles.electric_car import ElectricCar
from powertrain.vehicles.split_path_car import SplitPathCar
from powertrain.vehicles.variator_car import VariatorCar


@lru_cache
def run() -> CycleRun:
    """Off to 30 km/h and back, with a demand in between that no such car follows."""
    rows = (
        (0.0, 0.0),
        (3.0, 0.0),
        (13.0, 8.0),
        (15.0, 8.0),
        (16.0, 20.0),
        (18.0, 20.0),
        (19.0, 8.0),
        (28.0, 0.0),
        (30.0, 0.0),
    )
    return drive_cycle(SplitPathCar(), DriveCycle("short", rows))


@pytest.fixture
def ax() -> Any:
    return Figure().add_subplot()


@pytest.mark.slow
def test_speed_marks_what_is_outside_of_the_band(ax: Any) -> None:
    assert draw.plot_speed(run(), ax=ax) is ax
    (outside,) = [line for line in ax.lines if str(line.get_label()).startswith("outside")]
    v = np.asarray(outside.get_ydata(), float)
    assert np.array_equal(np.isfinite(v), run().excess != 0)


def test_lines_are_in_the_units_of_their_axes() -> None:
    """km/h, rpm and kW."""

    def line(axes: Any, label: str) -> Any:
        (found,) = [each for each in axes.lines if each.get_label() == label]
        return np.asarray(found.get_ydata(), float)

    speed, movers, powers = (Figure().add_subplot() for _ in range(3))
    draw.plot_speed(run(), ax=speed)
    draw.plot_prime_movers_and_ratio(run(), ax=movers)
    draw.plot_powers(run(), ax=powers)
    result = run().result
    np.testing.assert_allclose(line(speed, "vehicle"), result["body.v"] * 3.6)
    assert line(speed, "cycle short").max() == pytest.approx(72.0)
    np.testing.assert_allclose(line(movers, "speed of engine"), result["engine.w"] * 30 / np.pi)
    np.testing.assert_allclose(line(powers, "engine"), result["engine.power"] / 1e3)
    into = line(powers, "into transmission.cvu")
    times = np.linspace(float(result.time[0]), float(result.time[-1]), into.size)
    sides = [
        result.at(times, f"transmission.cvu.flange_{x}.tau") * result.at(times, f"transmission.cvu.w_{x}") for x in "ab"
    ]
    entering = np.abs(sides).max(axis=0)  # the unit loses power
    np.testing.assert_allclose(np.abs(into), entering / 1e3, atol=1e-6)


def test_ratio_is_output_over_input_speed() -> None:
    ratio = draw.transmission_ratio(run())
    assert ratio is not None
    moving = np.isfinite(ratio) & (run().result["shaft.w"] > 20)
    expected = run().result["output.w"] / np.where(moving, run().result["shaft.w"], 1)
    np.testing.assert_allclose(ratio[moving], expected[moving], rtol=1e-6)


def test_parts_are_found_by_kind() -> None:
    assert list(parts_of(run().plant.model, VariableUnit)) == ["transmission.cvu"]
    assert list(parts_of(run().plant.model, WheelBrake)) == ["front.brakes", "rear.brakes"]


def test_the_gears_of_a_powershift_gearbox_are_no_variable_unit() -> None:
    """Power through gears with steps does not split between them and another path."""
    assert not list(variators(AutomaticCar()))
    assert list(variators(VariatorCar())) == ["unit"]


def test_energy_bars_add_up_to_the_supply(ax: Any) -> None:
    draw.plot_energy(run(), ax=ax)
    shown = sum(bar.get_width() for bar in ax.patches) * 1e6
    supplied = run().audit.components.sources[""]
    assert shown == pytest.approx(float(supplied), rel=5e-3)  # parts below 0.05 % have no bar


def test_powers_tell_the_recirculation(ax: Any) -> None:
    draw.plot_powers(run(), ax=ax)
    labels = [str(text.get_text()) for text in ax.get_legend().get_texts()]
    shares = [re.fullmatch(r"(.*): (\d+)% of the energy into it", label) for label in labels[-2:]]
    assert [share and share[1] for share in shares] == ["split", "negative recirculation"]
    assert sum(int(share[2]) for share in shares if share) == pytest.approx(100, abs=1)


def test_operating_points_have_the_fuel_as_area(ax: Any) -> None:
    draw.plot_operating_points(run(), ax=ax)
    points = next(
        c for c in ax.collections if len(c.get_offsets()) and len(np.atleast_1d(getattr(c, "get_sizes", list)()))
    )
    assert points.get_sizes().sum() == pytest.approx(draw.AREA, rel=0.02)


def test_whole_page() -> None:
    figure = draw.cycle_figure(run())
    assert len(figure.axes) >= 5
    assert isinstance(run().result, pt.Result)


@pytest.mark.slow
def test_whole_page_of_an_electric_car() -> None:
    """Its prime mover is a machine: speeds, powers, and its own map."""
    short = drive_cycle(ElectricCar(), DriveCycle("short", ((0.0, 0.0), (1.0, 0.0), (5.0, 5.0), (8.0, 0.0))))
    figure = draw.cycle_figure(short)
    labels = {str(text.get_text()) for ax in figure.axes if (legend := ax.get_legend()) for text in legend.get_texts()}
    assert {"speed of machine", "machine", "area: energy through the shaft there"} <= labels
    assert "W.h/km" in str(figure.get_suptitle())
