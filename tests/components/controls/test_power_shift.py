"""Power-shift gearbox and schedule, starting devices, accessory drive, electric-drive control, delayed start-stop."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Constant
from powertrain.components.control import ElectricDriveControl, StartStop
from powertrain.components.engines import AccessoryDrive, WillansEngine
from powertrain.components.rotational import Inertia
from powertrain.components.transmissions import PowerShiftGearbox


class Belt(pt.Component):
    shaft: Inertia = Inertia(J=2.0)
    belt: AccessoryDrive = AccessoryDrive(P=400, w_0=20)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shaft.flange_b, self.belt.flange)


def test_accessories_take_a_constant_power_and_let_a_shaft_start() -> None:
    """J w^2/2 falls by P t above w_0; below it the speed decays as exp(-P t/(J w_0^2))."""
    result = pt.simulate(Belt(), 4.0, points=81, starts={"shaft.w": 60.0})
    fast = result["shaft.w"] > 20
    np.testing.assert_allclose(result["shaft.w"][fast] ** 2, 3600 - 400 * result.time[fast], rtol=1e-6)
    slow = pt.simulate(Belt(), 4.0, points=81, starts={"shaft.w": 20.0})
    np.testing.assert_allclose(slow["shaft.w"], 20 * np.exp(-400 * slow.time / (2 * 400)), rtol=1e-5)


def test_ratios_must_fall() -> None:
    with pytest.raises(pt.ParameterError, match="positive ratios that decrease"):
        pt.compile(Geared(box=PowerShiftGearbox(ratios=(3.0, 3.5))))


class Geared(pt.Component):
    shaft: Inertia = Inertia(J=1.0)
    box: PowerShiftGearbox = PowerShiftGearbox(ratios=(4.0, 2.0))
    load: Inertia = Inertia(J=5.0)
    lever: Constant = Constant(k=1.5)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.shaft.flange_b, self.box.flange_a)
        yield pt.connect(self.box.flange_b, self.load.flange_a)
        yield pt.connect(self.lever.y, self.box.lever)


def test_half_way_between_two_gears_the_speed_ratio_is_the_mean() -> None:
    result = pt.simulate(Geared(), 0.5, points=6, starts={"load.w": 10.0})
    np.testing.assert_allclose(result["load.w"] / result["shaft.w"], (1 / 4 + 1 / 2) / 2, rtol=1e-9)


@pytest.mark.parametrize(("soc_power", "force"), [(1e9, 3000.0), (12e3, 1200.0), (0.0, 0.0)])
def test_recovery_is_what_brake_axle_machine_and_battery_allow(soc_power: float, force: float) -> None:
    """At 10 m/s and 50 rad/s, half a pedal of 15 kN: the axle allows 3 kN, the battery P/v."""
    control = ElectricDriveControl(F_brake=15e3, F_most=3e3)
    inputs = {"accelerator": 0.0, "brake": 0.5, "v": 10.0, "w": 50.0, "limit": 1e4, "charge_power": soc_power}
    result = pt.simulate(control, 1.0, points=2, inputs=inputs)
    assert result["regenerated"][-1] == pytest.approx(force)
    assert result["tau"][-1] == pytest.approx(-force * 10 / 50)
    assert result["friction"][-1] == pytest.approx(0.5 - force / 15e3)


def test_engine_stops_after_its_delay() -> None:
    result = pt.simulate(StartStop(delay=3.0, t_least=1.0), 6.0, points=61, inputs={"accelerator": 0.0, "v": 0.0})
    assert [result.at(t, "on") for t in (0.5, 2.999, 3.001, 6.0)] == [1, 1, 0, 0]


def test_heat_of_the_firing_engine() -> None:
    """P_heat is lost while it fires, whatever the load, and not in overrun."""
    plain, hot = WillansEngine(), WillansEngine(P_heat=4000)
    w, tau = np.array([200.0, 200.0, 200.0]), np.array([20.0, 80.0, -30.0])
    more = (hot.fuel_flow(w, tau) - plain.fuel_flow(w, tau)) * float(hot.heating_value)
    assert more == pytest.approx([4000, 4000, 0])
