"""Springs, dampers and play: closed forms, energy, mirrored models."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rotational_line import Line, run

import powertrain as pt
from powertrain.components import rotational as rot

J, C = 2.0, 50.0


def swing(element: pt.Component) -> Line:
    """An inertia that an element holds to the ground."""
    return Line(parts=(rot.Fixed(), element, rot.Inertia(J=J)))


def test_spring_swings() -> None:
    result = run(swing(rot.Spring(c=C, phi_rel0=0.1)), 3.0, {"2.phi": 0.6})
    np.testing.assert_allclose(result["parts[2].phi"], 0.1 + 0.5 * np.cos(5 * result.time), atol=1e-8)


def test_spring_damper_swings_out() -> None:
    d = 4.0
    result = run(swing(rot.SpringDamper(c=C, d=d)), 3.0, {"2.phi": 0.5})
    decay = d / (2 * J)
    w = math.sqrt(C / J - decay**2)
    expected = 0.5 * np.exp(-decay * result.time) * (np.cos(w * result.time) + decay / w * np.sin(w * result.time))
    np.testing.assert_allclose(result["parts[2].phi"], expected, atol=1e-8)


def test_damper_brings_two_shafts_together() -> None:
    line = Line(parts=(rot.Inertia(J=1), rot.Damper(d=2), rot.Inertia(J=3)))
    result = run(line, 3.0, {"0.w": 8.0})
    np.testing.assert_allclose(result["parts[1].w_rel"], -8 * np.exp(-2 * (1 + 1 / 3) * result.time), atol=1e-8)
    np.testing.assert_allclose(result["parts[0].w"] + 3 * result["parts[2].w"], 8.0, rtol=1e-9)


def test_springs_in_series_between_massless_nodes() -> None:
    line = Line(parts=(rot.Fixed(), rot.Spring(c=100), rot.Disc(deltaPhi=0.2), rot.Spring(c=100), rot.Inertia(J=J)))
    result = run(line, 3.0, {"4.phi": 0.7})
    np.testing.assert_allclose(result["parts[4].phi"], 0.2 + 0.5 * np.cos(5 * result.time), atol=1e-8)


def test_spring_and_damper_in_series() -> None:
    """A Maxwell element: tau' = c w - c/d tau."""
    line = Line(parts=(rot.Fixed(), rot.Spring(c=C), rot.Damper(d=3), rot.Inertia(J=J)))
    result = run(line, 3.0, {"3.w": 2.0})
    matrix = np.array([[0, -1 / J], [C, -C / 3]])
    values, vectors = np.linalg.eig(matrix)
    weights = np.linalg.solve(vectors, [2.0, 0.0])
    expected = (vectors[0] * weights * np.exp(np.outer(result.time, values))).sum(axis=1).real
    np.testing.assert_allclose(result["parts[3].w"], expected, atol=1e-7)


def test_backlash_without_damping_swings_for_ever() -> None:
    """From the contact's reversal: two half periods of the spring and two flights through the gap."""
    b, start = 0.4, 0.7
    w = math.sqrt(C / J)
    speed = w * (start - b / 2)
    period = 2 * math.pi / w + 2 * b / speed
    result = run(swing(rot.ElastoBacklash(c=C, d=0, b=b)), 2 * period, {"2.phi": start})
    assert result["parts[2].phi"][-1] == pytest.approx(start, rel=1e-6)
    energy = J * result["parts[2].w"] ** 2 / 2 + result["parts[1].tau"] ** 2 / (2 * C)
    np.testing.assert_allclose(energy, C * (start - b / 2) ** 2 / 2, rtol=1e-6)


@pytest.mark.parametrize("kind", [rot.ElastoBacklash, rot.ElastoBacklash2])
@pytest.mark.parametrize("d", [2.0, 30.0])
def test_backlash_pushes_only_and_loses_energy(kind: type[rot.ElastoBacklash], d: float) -> None:
    result = run(swing(kind(c=C, d=d, b=0.4)), 6.0, {"2.phi": 0.7})
    tau, tau_c = result["parts[1].tau"], result["parts[1].tau_c"]
    assert (tau * tau_c).min() >= 0.0
    gap = np.abs(result["parts[1].phi_rel"]) < 0.2 - 1e-9
    assert gap.any()
    assert np.abs(tau[gap]).max() == 0.0
    energy = J * result["parts[2].w"] ** 2 / 2 + tau_c**2 / (2 * C)
    assert np.diff(energy).max() < 1e-8
    lost = np.trapezoid(result["parts[1].lossPower"], result.time)
    assert lost == pytest.approx(energy[0] - energy[-1], rel=2e-2)


def test_damping_torque_of_the_continuous_backlash_never_exceeds_the_spring() -> None:
    result = run(swing(rot.ElastoBacklash(c=C, d=5, b=0.4)), 6.0, {"2.phi": 0.7}, points=6000)
    tau, tau_c = result["parts[1].tau"], result["parts[1].tau_c"]
    assert np.abs(tau).max() <= 2 * np.abs(tau_c).max()
    assert (np.abs(tau - tau_c) - np.abs(tau_c)).max() < 1e-7
    assert np.abs(np.diff(tau)).max() < 0.02 * np.abs(tau).max()


@pytest.mark.parametrize("kind", [rot.ElastoBacklash, rot.ElastoBacklash2])
def test_backlash_is_symmetric(kind: type[rot.ElastoBacklash]) -> None:
    times = np.linspace(0, 4, 101)
    one, other = (run(swing(kind(c=C, d=2, b=0.4)), 4.0, {"2.phi": s * 0.7}, times=times) for s in (1, -1))
    a, b = (np.interp(times, r.time, r["parts[2].phi"]) for r in (one, other))
    np.testing.assert_allclose(a, -b, atol=1e-9)


@pytest.mark.parametrize("kind", [rot.ElastoBacklash, rot.ElastoBacklash2])
def test_no_backlash_is_a_spring_damper(kind: type[rot.ElastoBacklash]) -> None:
    times = np.linspace(0, 3, 101)
    one = run(swing(kind(c=C, d=4, b=0, phi_rel0=0.1)), 3.0, {"2.phi": 0.5}, times=times)
    other = run(swing(rot.SpringDamper(c=C, d=4, phi_rel0=0.1)), 3.0, {"2.phi": 0.5}, times=times)
    a, b = (np.interp(times, r.time, r["parts[2].phi"]) for r in (one, other))
    np.testing.assert_allclose(a, b, atol=1e-8)


def test_initial_speed_may_be_given_as_a_relative_one() -> None:
    line = Line(parts=(rot.Inertia(J=1), rot.SpringDamper(c=C, d=1), rot.Inertia(J=1)))
    result = run(line, 0.1, {"0.w": 3.0, "1.w_rel": -1.0, "1.phi_rel": 0.2})
    assert result["parts[2].w"][0] == pytest.approx(2.0)
    assert result["parts[2].phi"][0] - result["parts[0].phi"][0] == pytest.approx(0.2)
