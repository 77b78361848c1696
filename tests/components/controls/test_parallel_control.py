"""The control of a parallel hybrid: what the machine takes of the engine's power, and what it adds."""

from __future__ import annotations

import pytest

import powertrain as pt
from powertrain.components.control import ParallelControl

ENGINE = {"v": 1.0, "w": 150.0, "soc": 0.3, "tau_open": 120.0, "opening": 1.0}
MACHINE = {"brake": 0.0, "limit": 200.0, "charge_power": 17e3}


@pytest.mark.parametrize(
    ("accelerator", "w_machine", "w_shaft", "power"),
    [
        (0.5, 0, 0, 0),  # the clutch slips at standstill: nothing to charge with, though the engine gives 18 kW
        (0.5, -30, -30, 0),  # nor where the vehicle rolls back
        (0.1, -30, 150, 0),  # nor where the wheels of its axle are driven backward on ice
        (0.1, 10, 150, (1.8e3 - 18e3) / 2),  # below 20 rad/s it fades
        (0.1, 50, 50, 1.8e3 - 6e3),  # 120 N.m at 50 rad/s arrive, 1.8 kW are asked
        (0.1, 75, 150, 1.8e3 - 18e3),  # the clutch is closed
        (0.1, 75, 200, 1.8e3 - 18e3),  # no more than the engine gives
        (1.0, 50, 150, 0),  # 18 kW are asked, the engine gives 18 kW
    ],
)
def test_the_machine_charges_with_what_arrives(
    accelerator: float, w_machine: float, w_shaft: float, power: float
) -> None:
    """The engine runs at a low charge, so it gives 120 N.m at 150 rad/s; asked are 18 kW with a full pedal."""
    inputs = {**ENGINE, **MACHINE, "accelerator": accelerator, "w_machine": float(w_machine), "w_shaft": float(w_shaft)}
    result = pt.simulate(ParallelControl(v_0=2.0), 1.0, points=3, inputs=inputs)
    assert result["torque"][-1] == pytest.approx(120.0)
    assert result["tau"][-1] == pytest.approx(power / max(w_machine, 40), abs=1e-9)


@pytest.mark.parametrize("start", [0.0, 30.0])
def test_the_engine_starts_with_the_run(start: float) -> None:
    """A charge of 0.3 demands more than 9 kW from the start, whenever that is."""
    inputs = {**ENGINE, **MACHINE, "accelerator": 0.0, "w_machine": 0.0, "w_shaft": 0.0}
    result = pt.compile(ParallelControl()).simulate(start + 1.0, start=start, points=3, inputs=inputs)
    assert result["on"][-1] == 1


def test_an_engine_that_is_slower_than_the_gearbox_neither_drives_nor_charges() -> None:
    """It fires, but 10 rad/s are missing until 0.5 s: the machine gives the 1.8 kW asked for; then 120 N.m arrive at 50 rad/s."""
    slip = ([0.0, 1.0], [10.0, -10.0])
    inputs = {**ENGINE, **MACHINE, "accelerator": 0.1, "w_machine": 50.0, "w_shaft": 50.0, "slip": slip}
    result = pt.simulate(ParallelControl(v_0=2.0), 1.0, inputs=inputs)
    assert result.at(0.4, "matched") == 0
    assert result.at(0.6, "matched") == 1
    assert [result.at(t, "tau") * 50 for t in (0.4, 0.6)] == pytest.approx([1.8e3, 1.8e3 - 6e3])
