"""Batteries: charge, voltage, energy and limits against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from electric_rigs import Current, Discharge, FlywheelDrive, Pulses, Supply
from scipy.integrate import quad

import powertrain as pt
from powertrain.components.electric import Battery, PolarizedBattery, cells_in_series
from powertrain.components.thermal import HeatCapacitor

FLAT = pt.Map.curve([0, 1], [200, 200], x="state of charge", unit="V", outside="clip")
SLOPE = pt.Map.curve([0, 1], [180, 220], x="state of charge", unit="V", outside="linear")


def test_constant_current() -> None:
    """100 s at 40 A: charge, voltage and energy on a voltage that falls in a straight line."""
    rig = Discharge(battery=Battery(ocv=SLOPE, R=0.2, Q=20e3), draw=Current(i=40))
    result = pt.simulate(rig, 100, starts={"battery.soc": 0.8})
    assert result["battery.soc"][-1] == pytest.approx(0.8 - 40 * 100 / 20e3, rel=1e-9)
    assert result["battery.bus.v"][-1] == pytest.approx(180 + 40 * 0.6 - 0.2 * 40, rel=1e-9)
    audit = pt.energy_audit(result)
    lost, stored, supplied = (audit.components.loc["battery", name] for name in ("lost", "stored", "supplied"))
    assert lost == pytest.approx(0.2 * 40**2 * 100, rel=1e-9)
    assert stored == pytest.approx(-20e3 * (180 * 0.2 + 40 * (0.8**2 - 0.6**2) / 2), rel=1e-9)
    assert supplied == pytest.approx(-40 * 100 * (180 + 40 * 0.7 - 0.2 * 40), rel=1e-9)
    assert audit.closure < 1e-9
    assert not audit.hidden


def test_constant_power_takes_the_root_near_the_open_circuit_voltage() -> None:
    """v^2 - U v + R P = 0."""
    rig = Supply(battery=Battery(ocv=FLAT, R=0.5, Q=1e9))
    result = pt.simulate(rig, 1, parameters={"load.demand": 2.0})
    v = (200 + math.sqrt(200**2 - 4 * 0.5 * 10e3)) / 2
    assert result["battery.bus.v"][-1] == pytest.approx(v, rel=1e-9)
    assert result["battery.i"][-1] == pytest.approx(-10e3 / v, rel=1e-9)


def test_more_power_than_there_is_has_no_voltage() -> None:
    """ocv^2/(4 R) = 20 kW."""
    rig = Supply(battery=Battery(ocv=FLAT, R=0.5))
    with pytest.raises((pt.InitializationError, pt.SimulationError)):
        pt.simulate(rig, 1, parameters={"load.demand": 4.1})
    pt.simulate(rig, 1, parameters={"load.demand": 3.9})


@pytest.mark.parametrize("guess", [200.0, 10.0])
def test_operating_points_are_those_above_half_the_voltage(guess: float) -> None:
    """The other root, below 100 V, is not what a machine that draws more and more comes to; beyond 20 kW there is none."""
    rig = Supply(battery=Battery(ocv=FLAT, R=0.5, Q=1e9))
    demand = np.array([0.4, 2.0, 3.9, 4.1])
    grid: dict[str, Any] = {"battery.soc": 0.5, "load.demand": demand}
    found = pt.steady(rig, grid, outputs=["battery.bus.v"], guesses={"battery.bus.v": guess, "battery.i": guess - 200})
    v = (200 + np.sqrt(200**2 - 4 * 0.5 * 5e3 * demand[:3])) / 2
    assert found["battery.bus.v"].values[:3] == pytest.approx(v, rel=1e-9)
    assert np.isnan(found["battery.bus.v"].values[3])


def test_a_current_beyond_the_greatest_power_ends_a_simulation() -> None:
    rig = Discharge(battery=Battery(ocv=FLAT, R=0.2), draw=Current(i=501))
    with pytest.raises(pt.PowertrainError, match=r"greatest power at half its .* 99\.8 V; allowed is at least 100 V"):
        pt.simulate(rig, 1)


@pytest.mark.parametrize("ohmic", [0.0, 0.4])
def test_polarized_battery_settles_with_its_time(ohmic: float) -> None:
    """0.2 Ohm, of which a part acts at once, the rest over 2 s."""
    rig = Discharge(battery=PolarizedBattery(ocv=FLAT, R=0.2, ohmic=ohmic, T=2, Q=1e9), draw=Current(i=50))
    times = np.linspace(0, 10, 11)
    result = pt.simulate(rig, 10, times=times, rtol=1e-9)
    followed = ohmic + (1 - ohmic) * (1 - np.exp(-times / 2))
    np.testing.assert_allclose(result["battery.bus.v"], 200 - 10 * followed, rtol=1e-8)
    audit = pt.energy_audit(result)
    slow = quad(lambda t: (1 - math.exp(-t / 2)) ** 2, 0, 10)[0]
    lost = 0.2 * 50**2 * (ohmic * 10 + (1 - ohmic) * slow)
    assert audit.components.loc["battery", "lost"] == pytest.approx(lost, rel=1e-7)
    assert audit.closure < 1e-8


@pytest.mark.parametrize(
    "battery", [Battery(ocv=FLAT, R=0.2, B=2000), PolarizedBattery(ocv=FLAT, R=0.2, T=0.1, B=2000)]
)
def test_a_cold_battery_has_more_resistance(battery: Battery | PolarizedBattery) -> None:
    """At -10 degC 2.18 times as much as at 20 degC; a battery that warms itself gets better, and its energy closes."""

    class Cold(pt.Component):
        battery: pt.Component
        draw: Current = Current(i=50)
        cells: HeatCapacitor = HeatCapacitor(C=2e3)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.battery.bus, self.draw.bus)  # type: ignore[attr-defined]
            yield pt.connect(self.battery.heat_port, self.cells.port)  # type: ignore[attr-defined]

    result = pt.simulate(Cold(battery=battery), 60, starts={"cells.T": 263.15}, rtol=1e-9)
    T, drop = result["cells.T"], 200 - result["battery.bus.v"]
    late = result.time > 2
    np.testing.assert_allclose(drop[late], 10 * np.exp(2000 * (1 / T[late] - 1 / 293.15)), rtol=5e-3)
    assert T[-1] > 285
    assert pt.energy_audit(result).closure < 1e-8


def test_short_pulses_cost_what_the_series_resistance_takes() -> None:
    """100 A to and fro, 0.1 s each way: the RC element hardly sees them, half of R does."""

    class Pulsed(pt.Component):
        battery: PolarizedBattery = PolarizedBattery(ocv=FLAT, R=0.15, T=1)
        draw: Pulses = Pulses()

        def equations(self) -> pt.Equations:
            yield pt.connect(self.battery.bus, self.draw.bus)

    table = pt.energy_audit(pt.simulate(Pulsed(), 20)).components
    lost = float(table["lost"].loc["battery"])
    assert 0.5 * 0.15 * 100**2 * 20 < lost < 0.52 * 0.15 * 100**2 * 20


@pytest.mark.parametrize("outside", ["clip", "linear"])
def test_stored_energy_is_the_integral_of_the_voltage(outside: str) -> None:
    """Over eight points and beyond both ends, against quadrature; the audit watches its derivative."""
    points = [0.1, 0.2, 0.45, 0.6, 0.7, 0.9]
    ocv = pt.Map.curve(
        points, [150, 170, 195, 200, 202, 230], x="soc", unit="V", outside="clip" if outside == "clip" else "linear"
    )
    rig = Discharge(battery=Battery(ocv=ocv, Q=1e3, R=0.1), draw=Current(i=10))
    result = pt.simulate(rig, 100, starts={"battery.soc": 1.0})
    audit = pt.energy_audit(result)
    released = quad(ocv, 0, 1, points=points, limit=200)[0] * 1e3
    assert audit.components.loc["battery", "stored"] == pytest.approx(-released, rel=1e-8)
    assert not audit.hidden


def test_empty_battery_ends_the_simulation() -> None:
    rig = Discharge(battery=Battery(Q=1e3), draw=Current(i=10))
    with pytest.raises(pt.SimulationError, match="open-circuit voltage: state of charge") as caught:
        pt.simulate(rig, 100)
    assert caught.value.result.time[-1] == pytest.approx(60, rel=1e-6)


def test_currents_beyond_the_limits_are_counted_or_refused() -> None:
    battery = Battery(i_discharge=20, i_charge=10)
    for current, counted in ((19, False), (21, True), (-9, False), (-11, True)):
        result = pt.simulate(Discharge(battery=battery, draw=Current(i=current)), 1)
        assert (result.statistics["outside current of the battery"] > 0) == counted
    refusing = pt.replace(battery, beyond="error")
    with pytest.raises((pt.SimulationError, pt.InitializationError), match=r"current of the battery.*-20 .. 10 A"):
        pt.simulate(Discharge(battery=refusing, draw=Current(i=21)), 1)


@pytest.mark.parametrize("kind", [Battery, PolarizedBattery])
def test_power_that_it_may_give_and_take(kind: type[Battery]) -> None:
    """P = i (ocv -+ R i) at the largest currents, fading over 0.05 of charge at both ends; 1 % below ocv^2/(4 R) at most."""
    # at first only half of the resistance of a polarized battery acts
    rise = 10 if kind is Battery else 5
    battery = kind(ocv=FLAT, R=0.2, i_discharge=100, i_charge=50, soc_min=0.2, soc_max=0.9, band=0.05)
    for soc, give, take in ((0.5, 1, 1), (0.22, 0.4, 1), (0.1, 0, 1), (0.88, 1, 0.4), (0.95, 1, 0)):
        result = pt.simulate(Discharge(battery=battery), 0.1, starts={"battery.soc": soc})
        assert result["battery.discharge_power"][0] == pytest.approx(give * 100 * (200 - 20), abs=1e-6)
        assert result["battery.charge_power"][0] == pytest.approx(take * 50 * (200 + rise), abs=1e-6)
        assert result["battery.state_of_charge"][0] == soc
    strong = pt.replace(battery, i_discharge=1e4)
    result = pt.simulate(Discharge(battery=strong), 0.1)
    assert result["battery.discharge_power"][0] == pytest.approx(0.99 * 200**2 / (4 * 0.2))


@pytest.mark.parametrize("kind", [Battery, PolarizedBattery])
def test_a_cold_or_full_battery_takes_no_more_than_its_voltage_allows(kind: type[Battery]) -> None:
    """At constant current the voltage stays at V_max: i = (V_max - ocv)/(R cold), here 2.18 times R at -10 degC."""

    class Cold(pt.Component):
        battery: pt.Component
        draw: Current = Current()
        cells: HeatCapacitor = HeatCapacitor(C=1e12)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.battery.bus, self.draw.bus)  # type: ignore[attr-defined]
            yield pt.connect(self.battery.heat_port, self.cells.port)  # type: ignore[attr-defined]

    battery = kind(ocv=SLOPE, R=0.2, B=2000, Q=1e12, i_charge=80, overvoltage=222 / 220, soc_max=1)
    plant = pt.compile(Cold(battery=battery))
    for T, soc in (293.15, 0.5), (263.15, 0.5), (293.15, 0.75), (293.15, 0.9):
        R, ocv = 0.2 * math.exp(2000 * (1 / T - 1 / 293.15)), 180 + 40 * soc
        i = min(80.0, (222 - ocv) / R)
        run = plant.simulate(60.0, starts={"cells.T": T, "battery.soc": soc}, parameters={"draw.i": -0.9999 * i})
        assert run["battery.charge_power"][-1] == pytest.approx(i * (ocv + R * i), rel=1e-5)
        assert run["battery.bus.v"].max() < 222
        assert run.statistics["outside voltage of the battery"] == 0
    beyond = plant.simulate(1.0, starts={"cells.T": 293.15, "battery.soc": 0.9}, parameters={"draw.i": -80.0})
    assert beyond.statistics["outside voltage of the battery"] > 0


def test_a_polarized_battery_that_was_discharged_takes_less_power() -> None:
    """60 A through the slow 0.1 Ohm leave it 6 V lower; 50 A into the other 0.1 Ohm raise it by 5 V at once."""
    battery = PolarizedBattery(ocv=FLAT, R=0.2, ohmic=0.5, T=0.1, Q=1e9, i_charge=50)
    result = pt.simulate(Discharge(battery=battery, draw=Current(i=60)), 3)
    assert result["battery.charge_power"][-1] == pytest.approx(50 * (200 - 6 + 5), rel=1e-6)


@pytest.mark.parametrize("battery", [Battery(), PolarizedBattery(T=0.3)], ids=["resistance", "polarized"])
def test_energy_closes_with_a_machine(battery: Battery | PolarizedBattery) -> None:
    result = pt.simulate(FlywheelDrive(battery=battery), 12, rtol=1e-8)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-7
    assert not audit.hidden
    assert np.asarray(audit.loss).min() >= 0
    assert result["battery.soc"][-1] < 0.6
    assert result["machine.w"][-1] == pytest.approx(240 / 2.03, rel=1e-6)


def test_cells() -> None:
    assert cells_in_series(100)(0.0) == pytest.approx(300)
    assert np.all(np.diff(cells_in_series(1).values) > 0)


@pytest.mark.parametrize(
    ("ocv", "said"),
    [
        (
            pt.Map.curve([0, 1], [200, 210], x="soc", unit="N"),
            r"Battery.ocv gives map \[N\] over soc \[1\]; it must",
        ),
        (pt.Map.curve([0, 1], [200, 210], x="charge", x_unit="A.s", unit="V"), r"over charge \[A.s\]"),
        (
            pt.Map.curve([0, 0.3, 0.6, 1], [200, 205, 206, 210], x="soc", unit="V", method="smooth"),
            "ocv is smooth; it must be linear",
        ),
        (pt.Map.curve([0, 1], [0, 210], x="soc", unit="V"), "Battery.ocv falls to 0 V"),
        (
            pt.Map.curve([0, 100], [200, 210], x="soc", unit="V"),
            r"Battery.ocv .* from 0 to 100; .* percent is soc \[%\]",
        ),
        (pt.Map.curve([-0.1, 1], [200, 210], x="soc", unit="V"), r"from -0.1 to 1; it must lie within 0 and 1"),
        (
            pt.Map.curve([0, 1], [400, 300], x="depth of discharge", unit="V"),
            "falls from 400 V at a state of charge of 0 to 300 V at 1; .* 1 minus the state of charge",
        ),
    ],
)
def test_voltages_that_are_refused(ocv: pt.Map, said: str) -> None:
    with pytest.raises(pt.ParameterError, match=said):
        Battery(ocv=ocv)


@pytest.mark.parametrize("cells", [-96, 0, 96.5, "96"])
def test_cells_are_counted(cells: Any) -> None:
    with pytest.raises(pt.ParameterError, match=rf"cells_in_series: {cells!r} cells; give a whole number"):
        cells_in_series(cells)
