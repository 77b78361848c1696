from __future__ import annotations

import pytest

import powertrain as pt
from powertrain.components.control import OperatingLineControl
from powertrain.components.transmissions import TYPES, UnitRatio, overall_ratio


@pytest.mark.parametrize(
    ("accelerator", "v", "w", "w_out", "w_best", "throttle", "ratio"),
    [
        (0.5, 6, 150, 200, 250, 30e3 / (150 * 150), 0.8),  # 0.5 * 6000 N * (6 + 4) m/s = 30 kW
        (0.5, 6, 150, 40, 250, 30e3 / (150 * 150), 0.5),  # wanted 0.16
        (0.0, 20, 150, 400, 100, 0.0, 2.0),  # wanted 4
        (0.1, 0, 50, 0, 112, 2.4e3 / (150 * 95), 0.5),  # below the clutch's speed w counts as w_open
        (0.0, 0, 50, 0, 112, 0.0, 0.5),
    ],
)
def test_power_speed_torque_and_ratio(
    accelerator: float, v: float, w: float, w_out: float, w_best: float, throttle: float, ratio: float
) -> None:
    inputs = {"accelerator": accelerator, "v": v, "w": w, "w_out": w_out, "w_best": w_best, "tau_open": 150.0}
    result = pt.simulate(OperatingLineControl(), stop=1, inputs=inputs)
    assert result["power"][-1] == pytest.approx(accelerator * 6000 * (v + 4))
    assert result["throttle"][-1] == pytest.approx(throttle)
    assert result["ratio"][-1] == pytest.approx(ratio)
    assert result["clutch"][-1] == pytest.approx((w - 95) / (160 - 95))


@pytest.mark.parametrize("coupling", ["input", "output"])
@pytest.mark.parametrize("layout", TYPES.values())
def test_unit_ratio_gives_the_overall_ratio(layout: str, coupling: str) -> None:
    unit = UnitRatio(layout=layout, coupling=coupling, basic_ratio=-1.7)  # type: ignore[arg-type]
    result = pt.simulate(unit, stop=1, inputs={"r": 1.3})
    assert overall_ratio(layout, -1.7, float(result["V"][-1]), coupling) == pytest.approx(1.3)  # type: ignore[arg-type]
