"""Warm-up, thermostat, viscosity and the friction of a cold engine; alternator and pump."""

from __future__ import annotations

import math

import numpy as np
import pytest

import powertrain as pt
from powertrain.components.electric import VoltageSource
from powertrain.components.engines import (
    AccessoryPump,
    Alternator,
    CoolantCircuit,
    Engine,
    EngineCooling,
    WarmEngine,
    WillansEngine,
)
from powertrain.components.evaluation import numbers
from powertrain.components.rotational import ConstantSpeed, Inertia
from powertrain.components.thermal import FixedHeatFlow


class Heated(pt.Component):
    """A cooling circuit with a constant heat."""

    cooling: CoolantCircuit = CoolantCircuit()
    heat: FixedHeatFlow = FixedHeatFlow(Q_flow=8e3)
    v: pt.Input = pt.signal_input("m/s", "Speed", default=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.heat.port, self.cooling.engine)
        yield pt.connect(self.v, self.cooling.v)


def test_warm_up_is_exponential_until_the_thermostat_opens() -> None:
    run = pt.simulate(Heated(cooling=CoolantCircuit(G_heater=10)), 900.0, rtol=1e-9)
    rise = 8e3 / 25 * (1 - np.exp(-run.time * 25 / 75e3))
    cold = run["cooling.T"] < 358.15
    assert 0.2 < cold.mean() < 1
    np.testing.assert_allclose(run["cooling.T"][cold], 293.15 + rise[cold], rtol=1e-7)


@pytest.mark.parametrize("v", [0.0, 20.0])
def test_thermostat_holds_the_temperature(v: float) -> None:
    """Where opening (G_fan + G_wind v) + G_block carries the heat over T - T_air."""
    run = pt.simulate(Heated(), 5000.0, inputs={"v": v}, rtol=1e-9)
    over = run["cooling.T"][-1] - 293.15
    opening = (run["cooling.T"][-1] - 358.15) / 10
    assert 0 < opening < 1
    assert over * (opening * (300 + 40 * v) + 15) == pytest.approx(8e3, rel=1e-6)


def test_viscosity_of_the_data_sheet() -> None:
    """Walther's line through the two values; at 20 degC what the line gives by hand, and a plausible friction."""
    nu = numbers(CoolantCircuit().viscosity, np.array([293.15, 313.15, 373.15]))
    assert nu[1:] == pytest.approx([62.0, 10.5], rel=1e-12)
    y = [math.log10(math.log10(value + 0.7)) for value in (62.0, 10.5)]
    x = [math.log10(T) for T in (313.15, 373.15)]
    line = y[0] + (y[1] - y[0]) / (x[1] - x[0]) * (math.log10(293.15) - x[0])
    assert nu[0] == pytest.approx(10 ** (10**line) - 0.7, rel=1e-12)
    run = pt.simulate(Heated(), 3000.0)
    warmth = run["cooling.warmth"]
    assert 1.6 < warmth[0] < 2.1
    assert np.all(np.diff(warmth) < 1e-6)
    assert warmth[-1] == pytest.approx(1.0, abs=0.05)


class Dyno(pt.Component):
    """An engine at a held speed and throttle with its cooling."""

    cooling: EngineCooling
    engine: Engine = WillansEngine()
    drive: ConstantSpeed = ConstantSpeed(w_fixed=250)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.drive.flange)
        yield pt.connect(self.engine.heat_port, self.cooling.engine)
        yield pt.connect(self.engine.warmth, self.cooling.warmth)
        yield self.engine.throttle.value == 0.3


def test_a_cold_engine_rubs_more_and_heats_itself() -> None:
    """drag = warmth motoring; the heat is that of friction and of a part of combustion; warm from the start: factor 1."""
    warm = pt.simulate(Dyno(cooling=WarmEngine()), 10.0)
    cold = pt.simulate(Dyno(cooling=CoolantCircuit()), 1500.0)
    motoring = 18 + 4e-5 * 250**2
    np.testing.assert_allclose(warm["engine.drag"], motoring, rtol=1e-9)
    np.testing.assert_allclose(cold["engine.drag"], motoring * cold["cooling.warmth"], rtol=1e-9)
    assert cold["engine.tau"][0] < warm["engine.tau"][0] - 0.5 * motoring
    assert cold["engine.tau"][-1] == pytest.approx(warm["engine.tau"][-1], abs=0.05 * motoring)
    combustion = 0.45 * (cold["engine.fuel_rate"] * 43e6 - cold["engine.firing"] * 250)
    np.testing.assert_allclose(-cold["engine.heat_port.Q_flow"], combustion + 250 * cold["engine.drag"], rtol=1e-9)
    stored = 75e3 * (cold["cooling.T"][-1] - 293.15)
    given = np.trapezoid(cold["cooling.engine.Q_flow"] - cold["cooling.radiator"], cold.time)
    lost = np.trapezoid(15 * (cold["cooling.T"] - 293.15), cold.time)
    assert stored == pytest.approx(given - lost, rel=2e-3)


class Accessories(pt.Component):
    """An alternator and a pump on a shaft of constant speed."""

    alternator: Alternator = Alternator()
    pump: AccessoryPump = AccessoryPump()
    bus: VoltageSource = VoltageSource(V=13.5)
    drive: ConstantSpeed

    def equations(self) -> pt.Equations:
        yield pt.connect(self.alternator.bus, self.bus.bus)
        yield pt.connect(self.alternator.flange, self.drive.flange, self.pump.flange)


@pytest.mark.parametrize(("w", "V"), [(100.0, 13.5), (300.0, 12.0), (1500.0, 13.5), (1500.0, 15.0)])
def test_alternator_and_pump(w: float, V: float) -> None:
    """Current of the regulator, limited over speed; torque from the power; the pump takes its stroke's work."""
    run = pt.simulate(Accessories(drive=ConstantSpeed(w_fixed=w), bus=VoltageSource(V=V)), 1.0)
    limit = 120 * (1 - math.exp(-max(w - 120, 0) / 250))
    current = min(max(100 * (14 - V), 0), limit)
    assert run["alternator.i"][-1] == pytest.approx(current, rel=1e-9, abs=1e-12)
    assert run["alternator.flange.tau"][-1] * w == pytest.approx(V * current / 0.65, rel=1e-9, abs=1e-9)
    torque = 120e-6 * 0.5e6 / (2 * math.pi * 0.85) + 0.5 + 1e-6 * w**2
    assert run["pump.flange.tau"][-1] == pytest.approx(torque, rel=1e-9)
    assert pt.energy_audit(run).closure < 1e-9


def test_a_pump_brakes_to_rest_and_stays() -> None:
    class Stopping(pt.Component):
        pump: AccessoryPump = AccessoryPump(tau_2=0)
        shaft: Inertia = Inertia(J=0.1)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.pump.flange, self.shaft.flange_a)
            yield self.pump.load.value == 0.5

    torque = 0.5 * 120e-6 * 0.5e6 / (2 * math.pi * 0.85) + 0.5
    run = pt.simulate(Stopping(), 3.0, starts={"shaft.w": 100.0})
    assert run["shaft.w"][-1] == 0
    assert run.at(1.0, "shaft.w") == pytest.approx(100 - torque / 0.1, rel=1e-6)
