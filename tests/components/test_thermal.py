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


def test_negative_capacity_is_refused() -> None:
    with pytest.raises(pt.ParameterError, match=r"HeatCapacitor\.C = -1 J/K is outside its range"):
        th.HeatCapacitor(C=-1)
