"""Power-shift gearbox and schedule, starting devices, accessory drive, electric-drive control, delayed start-stop."""

from __future__ import annotations

import re

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.blocks import Constant, Ramp
from powertrain.components.control import ElectricDriveControl, StartStop
from powertrain.components.differentials import ChurningLoss
from powertrain.components.engines import AccessoryDrive, WillansEngine
from powertrain.components.rotational import ConstantTorque, Inertia
from powertrain.components.transmissions import PowerShiftGearbox, ShiftedGears


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


@pytest.mark.parametrize("ratios", [(3.0, 3.5), (3.7, 0), (3.7, -1.0), (3.7,), ()])
def test_ratios_must_fall(ratios: tuple[float, ...]) -> None:
    said = f"PowerShiftGearbox.ratios = {ratios}; give two or more positive ratios that decrease"
    with pytest.raises(pt.ParameterError, match=re.escape(said)):
        PowerShiftGearbox(ratios=ratios)


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


class Driven(pt.Component):
    """A constant torque at the input of a gearbox without losses in gear."""

    shaft: Inertia = Inertia(J=1.0)
    load: Inertia = Inertia(J=5.0)
    box: PowerShiftGearbox = PowerShiftGearbox(
        ratios=(4.0, 2.0), unit=ShiftedGears(), churning=ChurningLoss(), input=Inertia(J=0), output=Inertia(J=0)
    )
    lever: Ramp = Ramp(duration=2.0, offset=1.0)
    drive: ConstantTorque = ConstantTorque(tau_constant=20.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.box.flange_a)
        yield pt.connect(self.box.flange_b, self.load.flange_a)
        yield pt.connect(self.lever.y, self.box.lever)


@pytest.mark.parametrize("x", [0.0, 0.2, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("tau", [20.0, -20.0])
def test_the_clutch_that_can_transmit_the_torque_sets_the_torque_ratio(x: float, tau: float) -> None:
    """J_a w_a' = tau - T,  J_b w_b' = i T,  w_b = V w_a:  i is 2 if the input drives and 4 if it is driven, but for the handover."""
    lever, V = 1 + x, 0.25 + 0.25 * x
    i = 1 / (0.5 - 0.25 * (1 - x) ** 4) if tau > 0 else 1 / (0.25 + 0.25 * x**4)
    model = Driven(lever=Ramp(height=0.0, duration=1.0, offset=lever), drive=ConstantTorque(tau_constant=tau))
    result = pt.simulate(model, 0.5, points=6, starts={"load.w": 100.0})
    np.testing.assert_allclose(np.diff(result["shaft.w"]) / np.diff(result.time), tau / (1.0 + 5.0 * V / i), rtol=1e-6)


@pytest.mark.parametrize("tau", [20.0, -20.0])
@pytest.mark.parametrize("up", [True, False])
def test_a_shift_loses_torque_times_slip(up: bool, tau: float) -> None:
    """The clutch of one gear slips against the output, so what is lost is torque times the difference of the speeds there."""
    lever = Ramp(height=1.0 if up else -1.0, duration=2.0, offset=1.0 if up else 2.0)
    model = Driven(lever=lever, drive=ConstantTorque(tau_constant=tau))
    result = pt.simulate(model, 2.0, points=2001, starts={"load.w": 60.0}, rtol=1e-8)
    w_a, w_b = result["shaft.w"], result["load.w"]
    way = result["lever.y"] - 1
    middle = (way > 0.01) & (way < 0.99)
    carried = result["box.unit.flange_a.tau"][middle]
    x = way[middle]
    held = np.where(carried > 0, 1 / (0.5 - 0.25 * (1 - x) ** 4), 1 / (0.25 + 0.25 * x**4))
    slip = w_a[middle] - held * w_b[middle]
    np.testing.assert_allclose(result["box.unit.tauLoss"][middle] * w_a[middle], carried * slip, rtol=1e-5)
    assert (carried * slip >= 0).all()
    assert np.abs(carried * slip).max() > 100
    assert abs(pt.energy_audit(result).closure) < 1e-6


class Slipping(pt.Component):
    """Gears whose slipping clutch passes on given shares of the power."""

    drive: ConstantTorque = ConstantTorque(tau_constant=10.0)
    shaft: Inertia = Inertia(J=1.0)
    gears: ShiftedGears = ShiftedGears(eta_ab=0.9, eta_ba=0.9)
    load: Inertia = Inertia(J=1.0)
    ratio: Constant = Constant(k=1.0)
    passed_ab: Constant = Constant(k=1.0)
    passed_ba: Constant = Constant(k=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.gears.flange_a)
        yield pt.connect(self.gears.flange_b, self.load.flange_a)
        yield pt.connect(self.ratio.y, self.gears.ratio)
        yield pt.connect(self.passed_ab.y, self.gears.passed_ab)
        yield pt.connect(self.passed_ba.y, self.gears.passed_ba)


@pytest.mark.parametrize("share", [0.0, -1.0, 2.0])
@pytest.mark.parametrize("side", ["a", "b"])
def test_a_clutch_passes_on_some_of_the_power_and_not_more(side: str, share: float) -> None:
    """With 2 the gears would gain power, with 0 and less the output could not be turned."""
    passed = Constant(k=share)
    gears = Slipping(passed_ab=passed) if side == "a" else Slipping(passed_ba=passed)
    said = rf"if flange_{side} drives \(gears: .*leaves its range at t = 0 s: {share:g}; allowed is 0.0001 to 1"
    with pytest.raises(pt.SimulationError, match=said):
        pt.simulate(gears, 1.0)


@pytest.fixture(scope="module")
def drive() -> pt.Plant[ElectricDriveControl]:
    return pt.compile(ElectricDriveControl())


@pytest.mark.parametrize(("soc_power", "force"), [(1e9, 3000.0), (12e3, 1200.0), (0.0, 0.0)])
def test_recovery_is_what_brake_axle_machine_and_battery_allow(soc_power: float, force: float) -> None:
    """At 10 m/s and 50 rad/s, half a pedal of 15 kN: the axle allows 3 kN, the battery P/v."""
    control = ElectricDriveControl(F_brake=15e3, F_most=3e3)
    inputs = {"accelerator": 0.0, "brake": 0.5, "v": 10.0, "w": 50.0, "limit": 1e4, "charge_power": soc_power}
    result = pt.simulate(control, 1.0, points=2, inputs=inputs)
    assert result["regenerated"][-1] == pytest.approx(force)
    assert result["tau"][-1] == pytest.approx(-force * 10 / 50)
    assert result["friction"][-1] == pytest.approx(0.5 - force / 15e3)


@pytest.mark.parametrize(("v", "force"), [(10.0, 3000.0), (3.0, 3000.0), (1.5, 1500.0), (0.05, 50.0)])
def test_recovery_fades_out_below_3_metres_per_second(
    drive: pt.Plant[ElectricDriveControl], v: float, force: float
) -> None:
    result = drive.simulate(1.0, points=2, inputs={"accelerator": 0.0, "brake": 0.2, "v": v, "w": 50.0, "limit": 1e4})
    assert result["regenerated"][-1] == pytest.approx(force)
    assert result["tau"][-1] == pytest.approx(-force * v / 50)


@pytest.mark.parametrize("ratio", [0.5, 3.0, 30.0])
@pytest.mark.parametrize("v", [1e-6, 1e-3, 0.05, 0.5, 8.0])
def test_machine_and_brakes_together_give_the_force_that_the_pedal_demands(
    drive: pt.Plant[ElectricDriveControl], v: float, ratio: float
) -> None:
    """A fifth of 15 kN at every speed down to rest, with machines that turn 0.5 to 30 rad per metre."""
    inputs = {"accelerator": 0.0, "brake": 0.2, "v": v, "w": ratio * v, "limit": 1e5}
    result = drive.simulate(1.0, points=2, inputs=inputs)
    force = -result["tau"][-1] * ratio + result["friction"][-1] * 15e3
    assert force == pytest.approx(3e3, rel=1e-9)
    assert result["tau"][-1] < 0


@pytest.mark.parametrize("w", [-1.0, 0.0, 1e-14, 1e-6, 0.05, 1.0])
def test_the_torque_on_locking_wheels_fades_with_their_speed(drive: pt.Plant[ElectricDriveControl], w: float) -> None:
    """At 8 m/s: 100 N.m times w/w_fade, without a jump where the wheels begin to turn backward."""
    result = drive.simulate(1.0, points=2, inputs={"accelerator": 0.0, "brake": 1.0, "v": 8.0, "w": w, "limit": 100.0})
    assert result["tau"][-1] == pytest.approx(-100 * max(w, 0) / 20)


def test_a_machine_brakes_with_its_largest_torque(drive: pt.Plant[ElectricDriveControl]) -> None:
    """40 N.m at 50 rad/s hold 200 N at 10 m/s."""
    inputs = {"accelerator": 0.0, "brake": 0.5, "v": 10.0, "w": 50.0, "limit": 40.0}
    result = drive.simulate(1.0, points=2, inputs=inputs)
    assert result["regenerated"][-1] == pytest.approx(200.0)


@pytest.mark.parametrize(("w", "fade"), [(50.0, 1.0), (10.0, 0.5), (0.0, 0.0), (-30.0, 0.0)])
def test_a_machine_whose_wheels_lock_does_not_brake(w: float, fade: float) -> None:
    """At 10 m/s it would turn at 50 rad/s; wheels that slide to a stop on ice are not driven backward."""
    control = ElectricDriveControl(F_brake=15e3, F_most=3e3)
    inputs = {"accelerator": 0.0, "brake": 0.5, "v": 10.0, "w": w, "limit": 1e4}
    result = pt.simulate(control, 1.0, points=2, inputs=inputs)
    assert result["regenerated"][-1] == pytest.approx(fade * 3000.0)
    assert result["tau"][-1] == pytest.approx(-fade * 3000.0 * 10 / w if w > 0 else 0.0)


@pytest.mark.parametrize(
    ("accelerator", "charge", "torque"),
    [(1.0, 1e9, 200.0), (1.0, 1e3, 200.0 * 1.3 / 2.3), (1.0, -5.0, 200.0 * 0.3 / 2.3), (0.1, 1e3, 20.0)],
)
def test_a_vehicle_that_rolls_back_is_held_as_far_as_the_battery_takes_the_power(
    drive: pt.Plant[ElectricDriveControl], accelerator: float, charge: float, torque: float
) -> None:
    """200 N.m at -10 rad/s give 2 kW; losses and accessories take 300 W. The brakes have the pedal to themselves."""
    inputs = {"accelerator": accelerator, "brake": 0.4, "v": -2.0, "w": -10.0, "limit": 200.0, "charge_power": charge}
    result = drive.simulate(1.0, points=2, inputs=inputs)
    assert result["tau"][-1] == pytest.approx(torque)
    assert result["regenerated"][-1] == 0
    assert result["friction"][-1] == pytest.approx(0.4)


@pytest.mark.parametrize(("power", "torque"), [(1e9, 200.0), (10.5e3, 200.0), (4.2e3, 80.0), (0.0, 0.0)])
def test_driving_takes_what_the_battery_gives(
    drive: pt.Plant[ElectricDriveControl], power: float, torque: float
) -> None:
    """200 N.m at 50 rad/s draw 10 kW, and 500 W of losses."""
    inputs = {"accelerator": 1.0, "brake": 0.0, "v": 10.0, "w": 50.0, "limit": 200.0}
    inputs |= {"discharge_power": power, "added_loss": 500.0}
    result = drive.simulate(1.0, points=2, inputs=inputs)
    assert result["tau"][-1] == pytest.approx(torque)


def test_engine_stops_after_its_delay() -> None:
    result = pt.simulate(StartStop(delay=3.0, t_least=1.0), 6.0, points=61, inputs={"accelerator": 0.0, "v": 0.0})
    assert [result.at(t, "on") for t in (0.5, 2.999, 3.001, 6.0)] == [1, 1, 0, 0]


def test_heat_of_the_firing_engine() -> None:
    """P_heat is lost while it fires, whatever the load, and not in overrun."""
    plain, hot = WillansEngine(), WillansEngine(P_heat=4000)
    w, tau = np.array([200.0, 200.0, 200.0]), np.array([20.0, 80.0, -30.0])
    more = (hot.fuel_flow(w, tau) - plain.fuel_flow(w, tau)) * float(hot.heating_value)
    assert more == pytest.approx([4000, 4000, 0])
