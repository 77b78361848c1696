"""Lumped heat: time constants, balances, sources."""

from __future__ import annotations

import numpy as np
import pytest
from joined import joined, run

import powertrain as pt
from powertrain.components import thermal as th
from powertrain.components.blocks import Constant, Ramp


def test_a_body_cools_through_a_conductor() -> None:
    parts = (th.HeatCapacitor(C=50), th.ThermalConductor(G=10), th.FixedTemperature(T=300), th.TemperatureSensor())
    result = run(joined(*parts, joints="0.port=1.port_a=3.port 1.port_b=2.port"), 20.0, {"0.T": 400.0})
    expected = 300 + 100 * np.exp(-result.time / 5)
    np.testing.assert_allclose(result["parts[0].T"], expected, rtol=1e-9)
    np.testing.assert_allclose(result["parts[3].T"], expected, rtol=1e-9)
    np.testing.assert_allclose(result["parts[1].Q_flow"], 10 * (expected - 300), rtol=1e-6)


def test_two_bodies_end_at_their_mean_and_keep_the_heat() -> None:
    parts = (th.HeatCapacitor(C=10), th.ThermalConductor(G=5), th.HeatCapacitor(C=30))
    result = run(joined(*parts, joints="0.port=1.port_a 1.port_b=2.port"), 60.0, {"0.T": 400.0, "2.T": 300.0})
    heat = 10 * result["parts[0].T"] + 30 * result["parts[2].T"]
    np.testing.assert_allclose(heat, heat[0], rtol=1e-12)
    assert result["parts[0].T"][-1] == pytest.approx(325, abs=1e-3)


def test_convection_follows_its_signal() -> None:
    parts = (
        th.PrescribedTemperature(),
        th.Convection(),
        th.FixedTemperature(T=290),
        Ramp(height=8, duration=1),
        Constant(k=310),
    )
    result = run(joined(*parts, joints="0.port=1.solid 1.fluid=2.port 3.y=1.Gc 4.y=0.T"), 1.0)
    np.testing.assert_allclose(result["parts[1].Q_flow"], 8 * result.time * 20, atol=1e-9)
    np.testing.assert_allclose(result["parts[2].port.Q_flow"], result["parts[1].Q_flow"], atol=1e-12)


def test_a_negative_conductance_is_refused() -> None:
    """Heat would flow from cold to hot."""
    parts = (th.FixedTemperature(T=310), th.Convection(), th.FixedTemperature(T=290), Constant(k=-8))
    with pytest.raises(pt.SimulationError, match=r"thermal conductance .* -8 W/K; allowed is at least 0 W/K"):
        run(joined(*parts, joints="0.port=1.solid 1.fluid=2.port 3.y=1.Gc"), 1.0)


@pytest.mark.parametrize("alpha", [0.0, -0.01])
def test_heat_flows_into_a_body(alpha: float) -> None:
    parts = (
        th.FixedHeatFlow(Q_flow=40, T_ref=300, alpha=alpha),
        th.HeatCapacitor(C=20),
        th.PrescribedHeatFlow(T_ref=300, alpha=alpha),
        th.HeatCapacitor(C=20),
        Constant(k=40),
    )
    result = run(joined(*parts, joints="0.port=1.port 2.port=3.port 4.y=2.Q_flow"), 10.0, {"1.T": 300.0, "3.T": 300.0})
    t = result.time
    expected = 300 + 2 * t if not alpha else 300 + (1 - np.exp(2 * alpha * t)) / -alpha
    np.testing.assert_allclose(result["parts[1].T"], expected, rtol=1e-10)
    np.testing.assert_allclose(result["parts[3].T"], expected, rtol=1e-10)


def test_a_body_starts_at_room_temperature() -> None:
    result = run(joined(th.HeatCapacitor(C=1), joints=""), 1.0)
    assert set(result["parts[0].T"]) == {293.15}


def test_heat_ports_carry_no_power_of_the_audit() -> None:
    assert float(th.HeatPort().power()) == 0.0


def test_resistors_in_series_and_the_heat_through_them() -> None:
    """0.15 K/W and 0.05 K/W with 50 J/K: a time constant of 10 s; the first resistor has three quarters of the difference."""
    parts = (
        th.HeatCapacitor(C=50),
        th.ThermalResistor(R=0.15),
        th.HeatFlowSensor(),
        th.ThermalResistor(R=0.05),
        th.FixedTemperature(T=300),
        th.RelTemperatureSensor(),
    )
    joints = "0.port=1.port_a=5.port_a 1.port_b=2.port_a=5.port_b 2.port_b=3.port_a 3.port_b=4.port"
    result = run(joined(*parts, joints=joints), 20.0, {"0.T": 400.0})
    excess = 100 * np.exp(-result.time / 10)
    np.testing.assert_allclose(result["parts[0].T"], 300 + excess, rtol=1e-9)
    np.testing.assert_allclose(result["parts[2].Q_flow"], excess / 0.2, rtol=1e-7)
    np.testing.assert_allclose(result["parts[5].T_rel"], 0.75 * excess, rtol=1e-7)
    np.testing.assert_allclose(result["parts[4].port.Q_flow"], excess / 0.2, rtol=1e-7)


def test_a_resistor_without_resistance_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match=r"ThermalResistor\.R = 0 K/W is outside its range"):
        th.ThermalResistor(R=0)


def test_a_body_cools_by_radiation_into_space() -> None:
    """C der(T) = -Gr sigma T^4: T^-3 = T_0^-3 + 3 Gr sigma t/C, from 900 K to 303 K within an hour."""
    parts = th.HeatCapacitor(C=3000), th.BodyRadiation(Gr=0.17), th.FixedTemperature(T=0)
    result = run(joined(*parts, joints="0.port=1.port_a 1.port_b=2.port"), 3600.0, {"0.T": 900.0})
    expected = (900.0**-3 + 3 * 0.17 * th.STEFAN_BOLTZMANN * result.time / 3000) ** (-1 / 3)
    np.testing.assert_allclose(result["parts[0].T"], expected, rtol=1e-8)


def test_radiation_between_two_surfaces() -> None:
    """Black bodies at 700 K and 300 K exchange 5.670374e-8 (700^4 - 300^4) = 13155 W/m2; the heat flows to the colder one."""
    parts = th.FixedTemperature(T=300), th.BodyRadiation(Gr=2), th.FixedTemperature(T=700)
    result = run(joined(*parts, joints="0.port=1.port_a 1.port_b=2.port"), 1.0)
    np.testing.assert_allclose(result["parts[1].Q_flow"], -2 * 13155.27, rtol=1e-6)
    np.testing.assert_allclose(result["parts[0].port.Q_flow"], 2 * 13155.27, rtol=1e-6)


def test_negative_capacity_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match=r"HeatCapacitor\.C = -1 J/K is outside its range"):
        th.HeatCapacitor(C=-1)


def test_differences_of_temperatures_have_no_offset_in_other_scales() -> None:
    """20 K are 20 degC or 36 degF: a state and a parameter, a node without heat capacity, a mean."""
    parts = (
        th.HeatCapacitor(C=1e9),
        th.ThermalConductor(G=10),
        th.ThermalConductor(G=30),
        th.FixedTemperature(T=300),
        th.RelTemperatureSensor(),
        th.TemperatureSensor(),
    )
    joints = "0.port=1.port_a=4.port_a 1.port_b=2.port_a=4.port_b=5.port 2.port_b=3.port"
    result = run(joined(*parts, joints=joints), 1.0, {"0.T": 380.0})
    for name, degrees in (("parts[1].dT", 60.0), ("parts[4].T_rel", 60.0), ("parts[2].dT", 20.0)):
        assert result.converted(name, "degC") == pytest.approx(degrees, rel=1e-6)
        assert result.converted(name, "degF") == pytest.approx(1.8 * degrees, rel=1e-6)
    for name, kelvin in (("parts[0].T", 380.0), ("parts[5].T", 320.0), ("parts[3].port.T", 300.0)):
        assert result.converted(name, "degC") == pytest.approx(kelvin - 273.15, rel=1e-6)
        assert result.converted(name, "degF") == pytest.approx(1.8 * kelvin - 459.67, rel=1e-6)
    assert result.converted(lambda m: m.parts[0].T - m.parts[5].T.value, "degC") == pytest.approx(60.0, rel=1e-6)
    whole = result.converted(lambda m: m.parts[0].T - m.parts[5].T.value + m.parts[3].port.T, "degC")
    assert whole == pytest.approx(86.85)
    with pytest.raises(pt.ModelError, match=r"the unit of 2.*parts\[0\]\.T.* is unknown"):
        result.converted(lambda m: 2 * m.parts[0].T, "degC")
