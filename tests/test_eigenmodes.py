from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

import powertrain as pt
from powertrain.components.rotational import (
    Clutch,
    ConstantTorque,
    Fixed,
    IdealGear,
    Inertia,
    Spring,
    SpringDamper,
    TorqueStep,
)

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


@pytest.mark.parametrize(("ratio", "hidden"), [(1e6, False), (1e11, False), (1e13, True), (1e14, True)])
def test_vibrations_that_round_off_hides_are_told(ratio: float, hidden: bool) -> None:
    """Two of four inertias are next to rigidly joined: the slow vibrations are those of three inertias."""
    springs = tuple(SpringDamper(c=c, d=0.0) for c in (100.0, 100.0 * ratio, 50.0))
    found = pt.eigenmodes(Chain(inertias=tuple(Inertia(J=j) for j in (1.0, 2.0, 3.0, 1.5)), springs=springs))
    K = np.array([[100.0, -100.0, 0.0], [-100.0, 150.0, -50.0], [0.0, -50.0, 50.0]])
    slow = np.sqrt(eigh(K, np.diag([1.0, 5.0, 1.5]), eigvals_only=True)[1:]) / (2 * np.pi)
    if hidden:
        assert "round-off hides a vibration" in found.notes
        assert found.zero_eigenvalues > 2
    else:
        assert found.notes == ""
        assert found["frequency"].values[:2] == pytest.approx(slow, rel=1e-6)
        assert found.zero_eigenvalues == 2


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
    with pytest.raises(pt.ParameterError, match=r"Driven has no vibration modes: none of its 2 eigenvalues"):
        pt.eigenmodes(Driven())
    with pytest.raises(pt.ParameterError, match=r"moves in the vibrations of [0-9., ]+ Hz"):
        pt.eigenmodes(Swing(), ["second.w"], at={"press": 0.0, "first.w": 0.0, "clutch.w_rel": 0.0})


@pytest.mark.parametrize(("d", "modes"), [(14.0, 2), (14.3, 1)])
def test_an_overdamped_motion_is_no_vibration(d: float, modes: int) -> None:
    """Two inertias of 1 kg.m2 are critically damped at d = root(2 c J) = 14.14 N.m.s/rad; a third one beside them vibrates at 20 rad/s."""
    chain = Chain(
        inertias=tuple(Inertia(J=J) for J in (1.0, 1.0, 1e6, 1.0)),
        springs=(SpringDamper(c=100.0, d=d), SpringDamper(c=0.0, d=0.0), SpringDamper(c=400.0, d=0.0)),
    )
    found = pt.eigenmodes(chain)
    assert found.sizes["mode"] == modes
    assert float(found["frequency"][-1]) == pytest.approx(20 / (2 * np.pi), rel=1e-5)


class Geared(pt.Component):
    """Two inertias, free, with a gear and a spring between them: one vibration and one rigid-body motion."""

    torque: ConstantTorque = ConstantTorque(tau_constant=1.0)
    first: Inertia = Inertia(J=1.0)
    gear: IdealGear = IdealGear(ratio=3.0)
    spring: Spring = Spring(c=100.0)
    second: Inertia = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.torque.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.second.flange_a)


PLANT = pt.compile(Geared())


@pytest.mark.parametrize("ratio", np.concatenate([np.linspace(-7.3, -0.1, 30), np.linspace(0.13, 9.7, 30)]).tolist())
def test_a_rigid_body_motion_is_no_vibration(ratio: float) -> None:
    """w_0^2 = c (1/(J_1 i^2) + 1/J_2), and the eigenvalue zero twice."""
    (found, frequency) = pt.eigenmodes(PLANT, parameters={"gear.ratio": ratio}), np.sqrt(100 * (1 / ratio**2 + 0.5))
    assert found["frequency"].values == pytest.approx([frequency / (2 * np.pi)], rel=1e-12)
    assert found.attrs["zero_eigenvalues"] == 2
    shape = found["shape"].sel(signal=["second.w", "der(gear.phi_b)"]).values[0]
    assert shape[0] / shape[1] == pytest.approx(-(ratio**2) / 2.0, rel=1e-9)


class Tied(pt.Component):
    """Two inertias with a stiff spring between them, the second one on a soft spring at the ground."""

    first: Inertia = Inertia(J=1.0)
    stiff: Spring = Spring(c=1e6)
    second: Inertia = Inertia(J=1.0)
    soft: Spring = Spring(c=1e-4)
    fixed: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.first.flange_b, self.stiff.flange_a)
        yield pt.connect(self.stiff.flange_b, self.second.flange_a)
        yield pt.connect(self.second.flange_b, self.soft.flange_a)
        yield pt.connect(self.soft.flange_b, self.fixed.flange)


def test_a_slow_vibration_is_no_rigid_body_motion() -> None:
    """A frequency of 1e-3 Hz beside one of 225 Hz: a stiffness 1e-10 as large."""
    found = pt.eigenmodes(Tied())
    assert found["frequency"].values == pytest.approx(np.sqrt([1e-4 / 2, 2e6]) / (2 * np.pi), rel=1e-4)
    assert found.attrs["zero_eigenvalues"] == 0


class Fixated(pt.Component):
    """A model without free parameters."""

    a: Inertia = Inertia(J=1.0)
    spring: Spring = Spring(c=100.0)
    fixed: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield self.a.J == 2.0
        yield self.spring.c == 200.0
        yield self.spring.phi_rel0 == 0.0
        yield self.fixed.phi0 == 0.0
        yield pt.connect(self.a.flange_b, self.spring.flange_a)
        yield pt.connect(self.spring.flange_b, self.fixed.flange)


def test_a_model_without_parameters_vibrates() -> None:
    assert not pt.compile(Fixated()).parameters
    assert float(pt.eigenmodes(Fixated())["frequency"][0]) == pytest.approx(10.0 / (2 * np.pi))
