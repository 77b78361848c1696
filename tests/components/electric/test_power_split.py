"""Engine, planetary gear, two machines and a battery: the parts of a power-split hybrid, with and without an implicit voltage."""

from __future__ import annotations

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.differentials import PlanetaryGear
from powertrain.components.electric import AccessoryLoad, Battery, ElectricMachine, PolarizedBattery
from powertrain.components.engines import Engine, WillansEngine
from powertrain.components.rotational import Inertia, LinearSpeedDependentTorque


class PowerSplit(pt.Component):
    """The engine at the carrier, a generator at the sun that holds the engine's speed, a motor and the load at the ring."""

    engine: Engine = WillansEngine()
    gear: PlanetaryGear = PlanetaryGear(ratio=2.6, eta_ab=0.98, eta_ba=0.98)
    generator: ElectricMachine = ElectricMachine(J=0.02)
    motor: ElectricMachine = ElectricMachine(J=0.04)
    battery: Battery | PolarizedBattery = Battery()
    load: AccessoryLoad = AccessoryLoad(P=400)
    output: Inertia = Inertia(J=10)
    road: LinearSpeedDependentTorque = LinearSpeedDependentTorque(
        tau_nominal=-120, w_nominal=300, TorqueDirection=False
    )

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.gear.carrier)
        yield pt.connect(self.generator.shaft, self.gear.sun)
        yield pt.connect(self.motor.shaft, self.gear.ring, self.output.flange_a)
        yield pt.connect(self.output.flange_b, self.road.flange)
        yield pt.connect(self.battery.bus, self.generator.bus, self.motor.bus, self.load.bus)
        yield self.engine.throttle.value == 0.7
        yield self.generator.torque_demand.value == -4 * (self.engine.w - 200)
        yield self.motor.torque_demand.value == 40


STARTS = {"engine.w": 180.0, "output.w": 20.0}


@pytest.mark.parametrize("battery", [Battery(), PolarizedBattery()], ids=["resistance", "polarized"])
def test_power_split(battery: Battery | PolarizedBattery) -> None:
    result = pt.simulate(PowerSplit(battery=battery), 60, starts=STARTS, rtol=1e-8)
    engine, sun, ring = (result[name] for name in ("engine.w", "generator.w", "motor.w"))
    np.testing.assert_allclose(3.6 * engine, sun + 2.6 * ring, rtol=1e-9)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-7
    assert not audit.hidden
    assert np.asarray(audit.loss).min() >= -1e-9
    supplied = audit.components.loc["engine", "sources"]
    assert supplied == pytest.approx(43e6 * result["engine.fuel"][-1], rel=1e-7)
    # Torques of the planetary gear at the end, steady but for 1 %: the generator holds 1/3.6 of the engine's torque.
    assert -result["generator.tau"][-1] == pytest.approx(result["engine.tau"][-1] / 3.6, rel=0.02)


@pytest.mark.slow
def test_voltage_without_delay_is_the_limit_of_one_with_delay() -> None:
    kinds = Battery(), PolarizedBattery(T=0.1), PolarizedBattery(T=0.01)
    now, late, soon = (
        pt.simulate(PowerSplit(battery=kind), 60, starts=STARTS)["battery.soc"][-1] - 0.6 for kind in kinds
    )
    assert abs(soon - now) < 0.5 * abs(late - now)
    assert soon == pytest.approx(now, rel=0.01)


@pytest.mark.parametrize("w", [200.0, 220.0])
def test_start_of_constant_power_on_a_battery(w: float) -> None:
    """The search for the implicit voltage begins at the speeds that are given: from rest the machines would ask for more than there is."""
    result = pt.simulate(PowerSplit(), 0.1, starts={"engine.w": w, "output.w": 20.0})
    assert result["engine.w"][0] == pytest.approx(w)
