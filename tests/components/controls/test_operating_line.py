from __future__ import annotations

import pytest

import powertrain as pt
from powertrain.components.control import OperatingLineControl
from powertrain.components.engines import Engine, MappedEngine, WillansEngine
from powertrain.components.rotational import ConstantSpeed
from powertrain.components.transmissions import TYPES, UnitRatio, overall_ratio


class Asked(pt.Component):
    """An engine whose shaft turns at 200 rad/s, under its control."""

    engine: Engine
    control: OperatingLineControl = OperatingLineControl()
    drive: ConstantSpeed = ConstantSpeed(w_fixed=200)
    accelerator: pt.Input = pt.signal_input("1", "Accelerator pedal")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.drive.flange)
        yield pt.connect(self.accelerator, self.control.accelerator)
        yield pt.connect(self.engine.speed, self.control.w)
        yield self.control.v.value == 0
        yield self.control.w_out.value == 200
        yield self.control.w_best.value == 200
        yield self.control.tau_open.value == self.engine.full_load(self.engine.w)
        yield self.control.tau_drag.value == self.engine.motoring(self.engine.w)
        yield self.engine.throttle.value == self.engine.opening(self.engine.w, self.control.throttle.value)


@pytest.mark.parametrize(
    ("accelerator", "v", "w", "w_out", "w_best", "throttle", "ratio"),
    [
        (0.5, 6, 150, 200, 250, 30e3 / (150 * 150), 0.8),  # 0.5 * 6000 N * (6 + 4) m/s = 30 kW
        (0.5, 6, 150, 40, 250, 30e3 / (150 * 150), 0.5),  # wanted 0.16
        (0.0, 20, 150, 400, 100, 0.0, 2.0),  # wanted 4
        (0.1, 0, 50, 0, 112, 2.4e3 / (150 * 95), 0.5),  # below the clutch's speed w counts as w_open
        (0.0, 0, 50, 0, 112, 0.0, 0.5),
        (1.0, -6, 150, 0, 112, 24e3 / (150 * 150), 0.5),  # rolling back as at standstill
    ],
)
def test_power_speed_torque_and_ratio(
    accelerator: float, v: float, w: float, w_out: float, w_best: float, throttle: float, ratio: float
) -> None:
    inputs = {"accelerator": accelerator, "v": v, "w": w, "w_out": w_out, "w_best": w_best, "tau_open": 150.0}
    result = pt.simulate(OperatingLineControl(), stop=1, inputs=inputs)
    assert result["power"][-1] == pytest.approx(accelerator * 6000 * (max(v, 0) + 4))
    assert result["throttle"][-1] == pytest.approx(throttle)
    assert result["ratio"][-1] == pytest.approx(ratio)
    assert result["clutch"][-1] == pytest.approx((w - 95) / (160 - 95))


@pytest.mark.parametrize(
    ("accelerator", "throttle"), [(0.5, (75 + 25) / 175), (0.025, (3.75 + 12.5) / 175), (0.0, 0.0)]
)
def test_combustion_makes_up_for_the_drag(accelerator: float, throttle: float) -> None:
    """At 400 rad/s, 150 N.m with an open throttle and 25 N.m of drag; released, the engine brakes."""
    inputs = {"accelerator": accelerator, "v": 6.0, "w": 400.0, "w_out": 300.0, "w_best": 250.0, "tau_open": 150.0}
    result = pt.simulate(OperatingLineControl(), stop=1, inputs={**inputs, "tau_drag": 25.0})
    assert result["throttle"][-1] == pytest.approx(throttle)


@pytest.mark.parametrize("engine", [WillansEngine(), MappedEngine.gasoline()], ids=lambda e: type(e).__name__)
@pytest.mark.parametrize("accelerator", [0.125, 0.5])
def test_the_crank_gives_the_power_that_is_asked_for(engine: Engine, accelerator: float) -> None:
    """3 kW and 12 kW at standstill: the crank gives its power within 2 %."""
    result = pt.simulate(Asked(engine=engine), stop=20, inputs={"accelerator": accelerator})
    assert result["engine.power"][-1] == pytest.approx(accelerator * 24e3, rel=0.02)


@pytest.mark.parametrize("coupling", ["input", "output"])
@pytest.mark.parametrize("layout", TYPES.values())
def test_unit_ratio_gives_the_overall_ratio(layout: str, coupling: str) -> None:
    unit = UnitRatio(layout=layout, coupling=coupling, basic_ratio=-1.7)  # type: ignore[arg-type]
    result = pt.simulate(unit, stop=1, inputs={"r": 1.3})
    assert overall_ratio(layout, -1.7, float(result["V"][-1]), coupling) == pytest.approx(1.3)  # type: ignore[arg-type]
