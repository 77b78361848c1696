from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

import powertrain as pt
from powertrain.components.rotational import Clutch, Fixed, Inertia, SpringDamper, TorqueStep

J, C = (0.2, 0.05, 0.3, 1.5), (4000.0, 900.0, 12000.0)


class Chain(pt.Component):
    """Inertias with springs between them, free at both ends."""

    inertias: tuple[Inertia, ...] = tuple(Inertia(J=j) for j in J)
    springs: tuple[SpringDamper, ...] = tuple(SpringDamper(c=c, d=0.0) for c in C)

    def equations(self) -> pt.Equations:
        for k, spring in enumerate(self.springs):
            yield pt.connect(self.inertias[k].flange_b, spring.flange_a)
            yield pt.connect(spring.flange_b, self.inertias[k + 1].flange_a)


def test_chain_against_the_generalised_eigenvalue_problem() -> None:
    """K v = w^2 M v with scipy, written from masses and stiffnesses."""
    K = np.zeros((4, 4))
    for k, c in enumerate(C):
        K[k : k + 2, k : k + 2] += c * np.array([[1, -1], [-1, 1]])
    squares, vectors = eigh(K, np.diag(J))
    found = pt.eigenmodes(Chain(), [f"inertias[{k}].w" for k in range(4)])
    assert found["frequency"].values == pytest.approx(np.sqrt(squares[1:]) / (2 * np.pi), rel=1e-9)
    assert found["damping"].values == pytest.approx(0, abs=1e-9)
    wanted = (vectors[:, 1:] / vectors[np.abs(vectors[:, 1:]).argmax(axis=0), [1, 2, 3]]).T
    assert np.real(found["shape"].values) == pytest.approx(wanted, abs=1e-8)
    assert np.abs(np.imag(found["shape"].values)).max() < 1e-8
    assert found["frequency"].attrs["units"] == "Hz"


class Swing(pt.Component):
    """An inertia on a spring and damper at the ground, a second one behind a clutch."""

    fixed: Fixed = Fixed()
    spring: SpringDamper = SpringDamper(c=400, d=2)
    first: Inertia = Inertia(J=1)
    clutch: Clutch = Clutch(fn_max=1, mue_pos=((0.0, 100.0),))
    second: Inertia = Inertia(J=3)
    press: pt.Input = pt.signal_input("1", "Clutch")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.fixed.flange, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.clutch.flange_a)
        yield pt.connect(self.press, self.clutch.f_normalized)
        yield pt.connect(self.clutch.flange_b, self.second.flange_a)


@pytest.mark.parametrize(("press", "total"), [(1.0, 4.0), (0.0, 1.0)])
def test_a_stuck_clutch_joins_its_sides(press: float, total: float) -> None:
    """w_0 = sqrt(c/J), D = d/(2 sqrt(c J))."""
    found = pt.eigenmodes(Swing(), at={"press": press, "first.w": 0.0, "clutch.w_rel": 0.0})
    assert found.sizes["mode"] == 1
    assert float(found["frequency"][0]) == pytest.approx(np.sqrt(400 / total) / (2 * np.pi))
    damping = 2 / (2 * np.sqrt(400 * total))
    assert float(found["damping"][0]) == pytest.approx(damping)
    assert float(found["damped_frequency"][0]) == pytest.approx(float(found["frequency"][0]) * np.sqrt(1 - damping**2))


class Driven(pt.Component):
    """Nothing that could swing."""

    torque: TorqueStep = TorqueStep(stepTorque=1)
    inertia: Inertia = Inertia(J=1)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.inertia.flange_a)


def test_models_and_signals_without_vibrations_are_refused() -> None:
    with pytest.raises(pt.ParameterError, match=r"Driven does not vibrate: none of its 2 eigenvalues"):
        pt.eigenmodes(Driven())
    with pytest.raises(pt.ParameterError, match="takes part"):
        pt.eigenmodes(Swing(), ["second.w"], at={"press": 0.0, "first.w": 0.0, "clutch.w_rel": 0.0})
