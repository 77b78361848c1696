"""The control of a series hybrid's engine and generator: torques by hand."""

from __future__ import annotations

import pytest

import powertrain as pt
from powertrain.components.control import GensetControl

ON = {"v": 25.0, "soc": 0.6, "battery_power": 1e9, "tau_open": 250.0, "opening": 0.8}
"""The engine runs above 22 m/s, whatever is asked; at a charge of 0.6 the battery asks for nothing."""


@pytest.fixture(scope="module")
def control() -> pt.Plant[GensetControl]:
    return pt.compile(GensetControl())


@pytest.mark.parametrize(
    ("w", "w_best", "asked", "load", "charge", "torque", "held"),
    [
        (200, 200, 20e3, 20e3, 1e9, 100, 0),
        (200, 190, 20e3, 20e3, 1e9, 100, -10),  # 1 N.m.s/rad
        (200, 250, 20e3, 20e3, 1e9, 100, 40),  # at most 40 N.m
        (200, 150, 20e3, 20e3, 1e9, 100, -40),
        (200, 150, 20e3, 20e3, 1e3, 100, -5),  # battery and load take 21 kW, 105 N.m
        (200, 150, 20e3, 19e3, 0.0, 95, 0),  # no more than they take
        (200, 200, 1e3, 0.0, 1e9, 25, 0),  # the least power, 5 kW
        (200, 200, 1e3, -3e3, 2e3, 10, 0),  # a load that brakes takes nothing
        (400, 400, 80e3, 80e3, 1e9, 150, 0),  # the largest power, 60 kW
        (200, 200, 55e3, 55e3, 1e9, 250, 0),  # an open throttle
        (45, 60, 9e3, 9e3, 1e9, 50, 15),  # half of what it would give at 90 rad/s, from which it fires
        (0, 100, 9e3, 9e3, 1e9, 0, 40),  # the generator starts it
    ],
)
def test_the_generator_holds_the_speed_and_takes_the_torque(
    control: pt.Plant[GensetControl],
    w: float,
    w_best: float,
    asked: float,
    load: float,
    charge: float,
    torque: float,
    held: float,
) -> None:
    inputs = {**ON, "w": w, "w_best": w_best, "asked": asked, "load": load, "charge_power": charge}
    inputs = {name: float(value) for name, value in inputs.items()}
    result = control.simulate(1.0, points=2, inputs=inputs)
    assert result["on"][-1] == 1
    assert result["torque"][-1] == pytest.approx(torque)
    assert result["tau"][-1] == pytest.approx(held - torque, abs=1e-9)
    assert result["throttle"][-1] == pytest.approx(0.8 * min(w / 90, 1))


def test_a_stopped_engine_has_no_torque(control: pt.Plant[GensetControl]) -> None:
    inputs = {**ON, "v": 5.0, "w": 100.0, "w_best": 200.0, "asked": 2e3, "load": 2e3}
    result = control.simulate(1.0, points=2, inputs=inputs)
    assert [result[name][-1] for name in ("on", "torque", "tau", "throttle")] == [0, 0, 0, 0]


def test_the_range_of_the_power_is_not_empty() -> None:
    with pytest.raises(pt.ParameterError, match=r"P_min.* <= .*P_most"):
        pt.compile(GensetControl(P_min=70e3))
