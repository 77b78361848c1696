"""Shafts with distributed inertia: the frequencies of a chain and of the continuous shaft, damping, twist under acceleration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import eigvalsh

import powertrain as pt
from powertrain.components.rotational import ConstantTorque, Fixed, FlexibleShaft, ShaftElement

C, J, D = 1e4, 0.02, 0.5
CONTINUOUS = math.sqrt(C / J) / 2
"""First frequency of the continuous shaft with free ends [Hz]: half a wave of the speed root(c/J) shafts per second."""


@pytest.mark.parametrize("n", [1, 2, 8])
def test_free_shaft(n: int) -> None:
    """The chain of n springs between n + 1 masses, half ones at the ends: w_k = 2 n root(c/J) sin(k pi/(2 n)), damping w_k d/(2 c)."""
    modes = pt.eigenmodes(FlexibleShaft(elements=(ShaftElement(),) * n, c=C, d=D, J=J))
    w = 2 * n * math.sqrt(C / J) * np.sin(np.arange(1, n + 1) * math.pi / (2 * n))
    np.testing.assert_allclose(modes.frequency, w / (2 * math.pi), rtol=1e-9)
    np.testing.assert_allclose(modes.damping, w * D / (2 * C), rtol=1e-9)


def test_frequencies_converge_to_those_of_the_continuous_shaft() -> None:
    """With the second order: each doubling of the elements leaves a quarter of the error; the documented one for eight."""
    error = {}
    for n in (4, 8, 16):
        first = float(pt.eigenmodes(FlexibleShaft(elements=(ShaftElement(),) * n, c=C, J=J)).frequency[0])
        error[n] = CONTINUOUS / first - 1
    assert error[8] == pytest.approx(0.006, abs=5e-4)
    assert error[4] / error[8] == pytest.approx(4, rel=0.02)
    assert error[8] / error[16] == pytest.approx(4, rel=0.01)


class Clamped(pt.Component):
    """A shaft with one end held."""

    wall: Fixed = Fixed()
    shaft: FlexibleShaft = FlexibleShaft(elements=(ShaftElement(),) * 32, c=C, J=J)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.wall.flange, self.shaft.flange_a)


def test_clamped_shaft() -> None:
    """A quarter of a wave, three quarters, ... in the continuous shaft."""
    found = pt.eigenmodes(Clamped()).frequency.values[:3]
    np.testing.assert_allclose(found, CONTINUOUS * np.array([0.5, 1.5, 2.5]), rtol=3e-3)


class Stepped(pt.Component):
    """Two pieces of different thickness."""

    thin: ShaftElement = ShaftElement(c=2e4, J=0.003)
    thick: ShaftElement = ShaftElement(c=9e4, J=0.011)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.thin.flange_b, self.thick.flange_a)


def test_stepped_shaft() -> None:
    """The eigenvalues of its three masses."""
    K = np.array([[2e4, -2e4, 0], [-2e4, 11e4, -9e4], [0, -9e4, 9e4]])
    M = np.diag([0.0015, 0.007, 0.0055])
    expected = np.sqrt(eigvalsh(K, M)[1:]) / (2 * math.pi)
    np.testing.assert_allclose(pt.eigenmodes(Stepped()).frequency, expected, rtol=1e-9)


class Pushed(pt.Component):
    """A free shaft with a torque at one end."""

    motor: ConstantTorque = ConstantTorque(tau_constant=30.0)
    shaft: FlexibleShaft = FlexibleShaft(c=C, d=20.0, J=J)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.motor.flange, self.shaft.flange_a)


def test_twist_under_acceleration() -> None:
    """The torque falls linearly along the shaft, so the free end lags by half of the twist between held ends: tau/(2 c)."""
    run = pt.simulate(Pushed(), 0.5, rtol=1e-9)
    twist = run["shaft.flange_b.phi"][-1] - run["shaft.flange_a.phi"][-1]
    assert twist == pytest.approx(-30.0 / (2 * C), rel=1e-6)
    torques = [run[f"shaft.elements[{k}].tau"][-1] for k in range(8)]
    np.testing.assert_allclose(torques, -30.0 * (1 - (np.arange(8) + 0.5) / 8), rtol=1e-6)
    assert pt.energy_audit(run).closure < 1e-7


def test_tube() -> None:
    """c = G I_p/L and J = rho I_p L of a propeller shaft, computed by hand; its speed of sound is root(G/rho)."""
    shaft = FlexibleShaft.of_tube(length=1.5, outer="70 mm", inner=0.066, G="80 GPa", rho=7800, n=6)
    polar = math.pi / 2 * (0.035**4 - 0.033**4)
    assert float(shaft.c) == pytest.approx(8e10 * polar / 1.5)
    assert float(shaft.J) == pytest.approx(7800 * polar * 1.5)
    assert len(shaft.elements) == 6
    first = float(pt.eigenmodes(shaft).frequency[0])
    sine = math.sin(math.pi / 12) / (math.pi / 12)
    assert first == pytest.approx(math.sqrt(8e10 / 7800) / (2 * 1.5) * sine)


def test_impossible_tubes() -> None:
    with pytest.raises(pt.ParameterError, match=r"inner diameter 0\.08 m is not smaller"):
        FlexibleShaft.of_tube(length=1, outer=0.07, inner=0.08, G=8e10, rho=7800)
    with pytest.raises(pt.ParameterError, match="it has elements"):
        FlexibleShaft(elements=(), c=C, J=J)
