"""Masses, rods, springs, dampers and elastic contacts: closed forms, energy, mirrored models."""

from __future__ import annotations

import math

import numpy as np
import pytest
from joined import joined, run
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import powertrain as pt
from powertrain.components import translational as tr


def test_mass_falls_freely() -> None:
    result = run(joined(tr.ConstantForce(f_constant=6), tr.Mass(m=3, L=0.4), joints="0.flange=1.flange_a"), 2.0)
    t = result.time
    np.testing.assert_allclose(result["parts[1].s"], t**2, atol=1e-12)
    np.testing.assert_allclose(result["parts[1].a"], 2.0, rtol=1e-14)
    np.testing.assert_allclose(result["parts[1].flange_b.s"] - result["parts[1].flange_a.s"], 0.4, atol=1e-14)
    np.testing.assert_allclose(result["parts[0].f"], -6.0)


def test_rods_add_their_lengths() -> None:
    parts = (tr.Fixed(s0=-1), tr.Rod(L=2), tr.Rod(L=0.5), tr.PositionSensor())
    result = run(joined(*parts, joints="0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange"), 1.0)
    np.testing.assert_allclose(result["parts[3].s"], 1.5)
    np.testing.assert_allclose(result["parts[1].s"], 0.0, atol=1e-15)


def test_masses_joined_by_a_rod_are_one_mass() -> None:
    parts = (tr.ConstantForce(f_constant=6), tr.Mass(m=1, L=0.1), tr.Rod(L=0.7), tr.Mass(m=2))
    result = run(joined(*parts, joints="0.flange=1.flange_a 1.flange_b=2.flange_a 2.flange_b=3.flange_a"), 1.0)
    np.testing.assert_allclose(result["parts[3].v"], 2 * result.time, atol=1e-12)
    np.testing.assert_allclose(result["parts[2].flange_a.f"], 4.0, rtol=1e-12)
    np.testing.assert_allclose(result["parts[3].s"] - result["parts[1].s"], 0.05 + 0.7, atol=1e-13)


def test_spring_oscillates_at_its_frequency_and_keeps_its_energy() -> None:
    m, c = 2.0, 50.0
    parts = (tr.Fixed(s0=-0.3), tr.Spring(c=c, s_rel0=0.2), tr.Mass(m=m, L=0.2))
    result = run(joined(*parts, joints="0.flange=1.flange_a 1.flange_b=2.flange_a"), 5.0, {"2.s": 0.1, "2.v": 0.4})
    w, t = math.sqrt(c / m), result.time
    np.testing.assert_allclose(result["parts[2].s"], 0.1 * np.cos(w * t) + 0.4 / w * np.sin(w * t), atol=1e-8)
    energy = m * result["parts[2].v"] ** 2 / 2 + c * (result["parts[1].s_rel"] - 0.2) ** 2 / 2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-8)


def damped(*elements: pt.Component) -> pt.Result[pt.Component]:
    """A mass of 1 kg at 3 m/s against a wall, through elements side by side."""
    wall = "=".join(["0.flange", *(f"{i}.flange_a" for i in range(2, len(elements) + 2))])
    mass = "=".join(["1.flange_a", *(f"{i}.flange_b" for i in range(2, len(elements) + 2))])
    model = joined(tr.Fixed(), tr.Mass(m=1), *elements, joints=f"{wall} {mass}")
    result: pt.Result[pt.Component] = run(model, 4.0, {"1.s": 0.0, "1.v": 3.0}, times=np.linspace(0, 4, 401))
    return result


def test_spring_damper_swings_out() -> None:
    result = damped(tr.SpringDamper(c=25, d=2))
    w, t = math.sqrt(24), result.time
    np.testing.assert_allclose(result["parts[1].s"], 3 / w * np.exp(-t) * np.sin(w * t), atol=1e-8)
    lost = 2 * result["parts[1].v"] ** 2
    np.testing.assert_allclose(result["parts[2].lossPower"], lost, atol=1e-12)
    np.testing.assert_allclose(result["parts[2].heat_port.Q_flow"], -lost, atol=1e-12)


def test_spring_damper_is_a_spring_beside_a_damper() -> None:
    one, two = damped(tr.SpringDamper(c=25, d=2)), damped(tr.Spring(c=25), tr.Damper(d=2))
    np.testing.assert_allclose(one["parts[1].s"], two["parts[1].s"], atol=1e-9)


@pytest.mark.parametrize("element", [tr.SpringDamper(c=30, d=2, s_rel0=0.1), tr.ElastoGap(c=300, d=4, s_rel0=0.1)])
def test_exchanged_flanges_change_nothing(element: pt.Component) -> None:
    """The model and its mirror image, in which every position and force has the other sign."""
    starts = {"0.s": 0.0, "0.v": 1.0, "2.s": 0.3, "2.v": -1.0}
    parts = (tr.Mass(m=1), element, tr.Mass(m=2))
    one = run(joined(*parts, joints="0.flange_b=1.flange_a 1.flange_b=2.flange_a"), 1.0, starts, points=100)
    mirrored = {name: -value for name, value in starts.items()}
    other = run(joined(*parts, joints="0.flange_b=1.flange_b 1.flange_a=2.flange_a"), 1.0, mirrored, points=100)
    for name in ("parts[0].s", "parts[2].v"):
        np.testing.assert_allclose(one[name], -other[name], atol=1e-8)
    momentum = one["parts[0].v"] + 2 * one["parts[2].v"]
    np.testing.assert_allclose(momentum, -1.0, atol=1e-10)


def thrown(gap: tr.ElastoGap, v: float, stop: float = 1.0) -> pt.Result[pt.Component]:
    """A mass of 2 kg at 0.1 m from a wall, thrown against it."""
    parts = (tr.Fixed(), gap, tr.Mass(m=2))
    model = joined(*parts, joints="0.flange=1.flange_a 1.flange_b=2.flange_a")
    result: pt.Result[pt.Component] = run(model, stop, {"2.s": 0.1, "2.v": -v}, points=2000)
    return result


def test_contact_without_damping_returns_the_speed() -> None:
    c = 2e4
    result = thrown(tr.ElastoGap(c=c, d=0), 2.0)
    t, touch, half = result.time, 0.05, math.pi * math.sqrt(2 / c)
    during = (t > touch) & (t < touch + half)
    np.testing.assert_allclose(result["parts[2].v"][t < touch], -2.0, rtol=1e-12)
    np.testing.assert_allclose(result["parts[2].v"][t > touch + half], 2.0, rtol=1e-7)
    w = math.sqrt(c / 2)
    np.testing.assert_allclose(result["parts[2].s"][during], -2 / w * np.sin(w * (t[during] - touch)), atol=1e-8)
    assert np.abs(result["parts[1].f"][~during]).max() < 1e-2


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
def test_contact_stores_the_energy_of_the_impact(n: float) -> None:
    """At the deepest point c x^(n+1)/(n+1) = m v^2/2."""
    result = thrown(tr.ElastoGap(c=1e5, d=0, n=n), 2.0)
    depth = ((n + 1) / 1e5 * 2 * 2.0**2 / 2) ** (1 / (n + 1))
    assert -result["parts[2].s"].min() == pytest.approx(depth, rel=1e-4)
    assert result["parts[2].v"][-1] == pytest.approx(2.0, rel=1e-7)


@pytest.mark.parametrize(("d", "n"), [(20.0, 1.0), (500.0, 1.0), (500.0, 1.5)])
def test_damped_contact_against_another_integrator(d: float, n: float) -> None:
    c = 2e4
    result = thrown(tr.ElastoGap(c=c, d=d, n=n), 2.0)

    def law(t: float, y: NDArray[np.float64]) -> list[float]:
        spring = -c * max(-y[0], 0.0) ** n
        return [y[1], -(spring + min(max(d * y[1], spring), -spring)) / 2]

    other = solve_ivp(law, (0, 1), [0.1, -2.0], rtol=1e-10, atol=1e-12, max_step=1e-4)
    assert result["parts[2].v"][-1] == pytest.approx(other.y[1, -1], rel=1e-6)
    assert result["parts[2].s"][-1] == pytest.approx(other.y[0, -1], rel=1e-6)


def test_contact_pushes_only_and_loses_only() -> None:
    result = thrown(tr.ElastoGap(c=2e4, d=500), 2.0)
    assert result["parts[1].f"].max() <= 1e-12
    assert result["parts[1].lossPower"].min() >= -1e-12
    lost = np.trapezoid(result["parts[1].lossPower"], result.time)
    assert lost == pytest.approx(2.0**2 - result["parts[2].v"][-1] ** 2, rel=1e-3)


def test_a_missing_stiffness_is_asked_for() -> None:
    with pytest.raises(pt.ParameterError, match=r"Spring.c must be given: Stiffness in N/m"):
        tr.Spring()  # type: ignore[call-arg]
