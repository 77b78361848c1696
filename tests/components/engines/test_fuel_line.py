"""The line of least fuel against a search of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.engines import (
    Engine,
    MappedEngine,
    WillansEngine,
    best_fuel_line,
    operating_line,
    pull_speeds,
    throttle_table,
)

ENGINES = [WillansEngine(), MappedEngine.gasoline(), MappedEngine.diesel(), MappedEngine.diesel(method="linear")]


@pytest.mark.parametrize("engine", ENGINES, ids=lambda e: f"{type(e).__name__}")
@pytest.mark.parametrize("share", [1.0, 0.8])
def test_no_speed_takes_less_fuel(engine: Engine, share: float) -> None:
    line = best_fuel_line(engine, share=share, points=20)
    np.testing.assert_allclose(line.speed * line.torque, line.power, rtol=1e-12)
    assert np.all(line.torque <= share * engine.full_load(line.speed) * (1 + 1e-6))
    np.testing.assert_array_equal(line.fuel_rate, engine.fuel_flow(line.speed, line.torque))
    w = np.linspace(85, float(engine.w_limit) - 10, 1501)
    tau = line.power[:, None] / w
    flow = np.where(tau <= share * engine.full_load(w), engine.fuel_flow(w, tau), np.inf)
    assert np.all(line.fuel_rate <= flow.min(axis=1) * (1 + 1e-6))


def test_willans_line_runs_at_full_load() -> None:
    """With constant efficiency and a drag that rises, the lowest possible speed is best: idle, then full load."""
    engine = WillansEngine()
    line = best_fuel_line(engine, [2e3, 30e3, 60e3])
    assert line.speed[0] == pytest.approx(85)
    np.testing.assert_allclose(line.torque[1:], engine.full_load(line.speed[1:]), rtol=1e-4)


def test_line_as_a_map_for_a_control() -> None:
    line = best_fuel_line(ENGINES[1], points=15)
    speeds, torques = line.speeds(), line.torques()
    assert speeds.axes[0].unit == "W"
    assert speeds.unit == "rad/s"
    assert speeds(line.power[4]) == pytest.approx(line.speed[4])
    assert torques(line.power[4]) == pytest.approx(line.torque[4])
    assert speeds(1e6) == pytest.approx(line.speed[-1])


@pytest.mark.slow
@pytest.mark.parametrize(
    "engine", [*ENGINES, MappedEngine.gasoline(method="linear")], ids=lambda e: f"{type(e).__name__}"
)
@pytest.mark.parametrize("share", [1.0, 0.85])
def test_a_control_on_the_operating_line_takes_hardly_more_than_the_least_fuel(engine: Engine, share: float) -> None:
    """Also between the points of its map, and towards the largest power, where the speed rises ever more steeply."""
    slowest = 1.35 * float(engine.w_idle)
    top = best_fuel_line(engine, w_min=slowest, share=share, points=2).power[-1]
    best = best_fuel_line(engine, top * np.sin(np.linspace(0, np.pi / 2, 301)), w_min=slowest, share=share)
    w = np.asarray(operating_line(engine, share)(best.power))
    assert np.all(engine.fuel_flow(w, best.power / w) < 1.003 * best.fuel_rate)
    assert np.all(best.power / w < 1.003 * share * engine.full_load(w))


@pytest.mark.parametrize("engine", ENGINES, ids=lambda e: f"{type(e).__name__}")
def test_opening_is_the_throttle_for_a_part_of_the_combustion(engine: Engine) -> None:
    w, part = np.linspace(90, 450, 13)[:, None], np.linspace(0, 1, 23)
    firing = engine.torque(w, engine.opening(w, part)) + engine.motoring(w)
    full = engine.full_load(w) + engine.motoring(w)
    np.testing.assert_allclose(firing / full, np.broadcast_to(part, firing.shape), atol=0.01)


@pytest.mark.parametrize("engine", ENGINES, ids=lambda e: f"{type(e).__name__}")
def test_throttle_for_a_torque(engine: Engine) -> None:
    """Between the points of the table the torque is met within 1 % of the largest; beyond its ends the throttle is shut or open."""
    table = throttle_table(engine)
    w = np.linspace(90, 450, 13)[:, None]
    full, motoring = engine.full_load(w), engine.motoring(w)
    tau = -motoring + np.linspace(0.02, 0.95, 20) * (full + motoring)
    assert np.abs(engine.torque(w, table(w, tau)) - tau).max() < 0.01 * full.max()
    np.testing.assert_allclose(table(w, -200.0), 0, atol=1e-9)
    np.testing.assert_allclose(table(w, 1e3), 1, atol=1e-9)


def test_limits_of_a_line_with_units() -> None:
    given = best_fuel_line(ENGINES[0], "20 kW", w_min="1500 rpm", w_max="3000 rpm")
    expected = best_fuel_line(ENGINES[0], [20e3], w_min=50 * np.pi, w_max=100 * np.pi)
    np.testing.assert_allclose(given.speed, expected.speed, rtol=1e-12)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"power": [1e3, 2e5]}, r"gives 0 to \d+ W between 85 and 670 rad/s, not 200000 W"),
        ({"power": -5.0}, r"power = -5 W is outside its range"),
        ({"power": [1e3, np.nan]}, r"power = nan W is outside its range"),
        ({"w_min": np.nan}, r"w_min = nan rad/s is outside its range"),
        ({"share": 1.2}, r"share = 1.2 is outside its range \(0, 1\]"),
        ({"w_min": 300, "w_max": 200}, r"speeds 300..200 rad/s"),
    ],
)
def test_impossible_lines(options: dict[str, Any], said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        best_fuel_line(ENGINES[0], **options)


@pytest.mark.parametrize("engine", ENGINES[:3], ids=lambda e: f"{type(e).__name__}")
def test_gears_pull_equally_hard_at_the_upshift(engine: Engine) -> None:
    """Against the tractive forces of all gears over the vehicle speed: below the upshift the lower gear pulls harder, above it the next."""
    ratios = (4.0, 2.5, 1.6, 1.2, 1.1)
    limit = 0.98 * float(engine.w_limit - engine.band_limit)
    for one, other, w in zip(ratios[:-1], ratios[1:], pull_speeds(engine, ratios), strict=True):
        x = w / one * np.linspace(0.9, min(1.1, limit / w), 101)
        harder = one * engine.full_load(one * x) > other * engine.full_load(other * x)
        np.testing.assert_array_equal(
            harder[np.abs(x * one - w) > 0.005 * w], (x * one < w)[np.abs(x * one - w) > 0.005 * w]
        )


def test_an_engine_of_constant_torque_is_shifted_at_its_limiter() -> None:
    curve = pt.Map.curve([50.0, 700.0], [100.0, 100.0], x="speed", x_unit="rad/s", unit="N.m", name="full load")
    assert pull_speeds(WillansEngine(curve=curve), (3.0, 2.0, 1.0)) == pytest.approx((0.98 * 670, 0.98 * 670))
