"""Hybrid power splits from the same parts: a Prius-type input split and a compound split with their mechanical points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.cvu import CVU, ElectricVariator, VariableUnit
from powertrain.components.differentials import PlanetaryGear


class InputSplit(rot.TwoFlanges):
    """Prius: engine at the carrier, first machine at the sun, second machine and output at the ring. The machines are a variator."""

    V: pt.Input = pt.signal_input("1", "Speed of the sun over speed of the ring")
    gear: PlanetaryGear = PlanetaryGear(ratio=78 / 30)
    machines: VariableUnit = CVU()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.gear.carrier)
        yield pt.connect(self.flange_b, self.gear.ring, self.machines.flange_a)
        yield pt.connect(self.gear.sun, self.machines.flange_b)
        yield pt.connect(self.V, self.machines.ratio)


class CompoundSplit(rot.TwoFlanges):
    """Two planetary gears with both carriers' and rings' shafts joined crosswise; the machines sit at the two suns.

    Engine: carrier of the first and ring of the second gear. Output: ring of the first and carrier of the second.
    """

    V: pt.Input = pt.signal_input("1", "Speed of the second sun over speed of the first")
    first: PlanetaryGear = PlanetaryGear(ratio=2.6)
    second: PlanetaryGear = PlanetaryGear(ratio=1.8)
    machines: VariableUnit = CVU()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.first.carrier, self.second.ring)
        yield pt.connect(self.flange_b, self.first.ring, self.second.carrier)
        yield pt.connect(self.first.sun, self.machines.flange_a)
        yield pt.connect(self.second.sun, self.machines.flange_b)
        yield pt.connect(self.V, self.machines.ratio)


class Driven(pt.Component):
    """At constant engine speed, against a torque."""

    V: pt.Input = pt.signal_input("1", "Ratio of the machines")
    split: pt.Component
    engine: rot.ConstantSpeed = rot.ConstantSpeed(w_fixed=100)
    load: rot.ConstantTorque = rot.ConstantTorque(tau_constant=-50)
    J: rot.Inertia = rot.Inertia(J=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.split.flange_a)  # type: ignore[attr-defined]
        yield pt.connect(self.split.flange_b, self.J.flange_a)  # type: ignore[attr-defined]
        yield pt.connect(self.J.flange_b, self.load.flange)
        yield pt.connect(self.V, self.split.V)  # type: ignore[attr-defined]


def share(split: pt.Component, V: float) -> tuple[float, float]:
    """tau = w_in/w_out, and the machines' power over the engine's."""
    result = pt.simulate(Driven(split=split), 0.01, inputs={"V": V}, rtol=1e-9, atol=1e-9)
    unit = "split.machines."
    through = result[unit + "flange_b.tau"][-1] * result[unit + "w_b"][-1]
    engine = result["split.flange_a.tau"][-1] * 100
    return 100 / result["J.w"][-1], float(through / engine)


def test_input_split_has_one_mechanical_point() -> None:
    """Sun at rest: tau_1 = k/(1 + k), and the machines' share of the power is f = 1 - tau_1/tau."""
    k = 78 / 30
    for V in (-1.5, -0.5, 0.3, 1.5):
        tau, f = share(InputSplit(), V)
        assert tau == pytest.approx((V + k) / (1 + k), rel=1e-9)
        assert abs(f) == pytest.approx(abs(1 - k / (1 + k) / tau), rel=1e-9)
    tau, f = share(InputSplit(), 0.0)
    assert tau == pytest.approx(k / (1 + k), rel=1e-9)
    assert f == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_compound_split_has_two_mechanical_points() -> None:
    """Between tau_1 and tau_2, where one of the suns stands still, f = (tau - tau_1)(tau - tau_2)/(tau (tau_2 - tau_1))."""
    # w_sun = (1 + k) w_carrier - k w_ring: first (1 + k) tau - k = 0; second (1 + k) - k tau = 0
    tau_1, tau_2 = 2.6 / 3.6, 2.8 / 1.8
    for V in (-3.0, -0.6, -0.2, 0.3, 0.5):
        tau, f = share(CompoundSplit(), V)
        assert ((2.8 - 1.8 * tau) / (3.6 * tau - 2.6)) == pytest.approx(V, rel=1e-8)
        expected = (tau - tau_1) * (tau - tau_2) / (tau * (tau_2 - tau_1))
        assert abs(f) == pytest.approx(abs(expected), rel=1e-8), V
    tau, f = share(CompoundSplit(), 0.0)
    assert tau == pytest.approx(tau_2, rel=1e-9)
    assert f == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("split", [InputSplit, CompoundSplit])
def test_real_machines_and_lossy_gears(split: Any) -> None:
    """The same splits with electric machines and mesh losses: energy closes, the ratio is nearly kept."""
    lossy: Any = {"eta_ab": 0.97, "eta_ba": 0.97}
    gears: Any = {"gear": PlanetaryGear(ratio=2.6, **lossy)}
    if split is CompoundSplit:
        gears = {"first": PlanetaryGear(ratio=2.6, **lossy), "second": PlanetaryGear(ratio=1.8, **lossy)}
    model = pt.replace(Driven(split=split(machines=ElectricVariator(E_0=5e4), **gears)), J=rot.Inertia(J=2.0))
    V = 0.8 if split is InputSplit else -0.2
    ideal, _ = share(split(), V)
    result = pt.simulate(model, 3.0, starts={"J.w": 100 / ideal}, inputs={"V": V}, rtol=1e-8, atol=1e-8)
    assert 100 / result["J.w"][-1] == pytest.approx(ideal, rel=0.03)
    audit = pt.energy_audit(result)
    assert audit.closure < 1e-6
    assert np.asarray(audit.loss).min() > -1e-6
