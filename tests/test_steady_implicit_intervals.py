"""Ranges of outputs while a law at rest carries any torque between its bounds, where other unknowns have to be solved for."""

from __future__ import annotations

import casadi as ca
import numpy as np
from rubbing import FORMULAS, LIMIT, Rubbing

import powertrain as pt
from powertrain.components import rotational as rot

STUCK = 1
SOME = {name: FORMULAS[name] for name in ("affine", "parabola", "pole")}


class Blown(pt.Component):
    """Beside the shaft at rest a fan is driven by 3 N.m and what the motor of the shaft has to give: it turns with w^2 = 10 (3 + tau)."""

    rub: Rubbing = Rubbing()
    load: pt.Input = pt.signal_input("N.m", "Load of the shaft")
    drive: rot.Torque = rot.Torque()
    fan: rot.Inertia = rot.Inertia(J=1.0)
    air: rot.QuadraticSpeedDependentTorque = rot.QuadraticSpeedDependentTorque(
        tau_nominal=-10.0, w_nominal=10.0, TorqueDirection=False
    )
    bump: pt.Variable = pt.variable("1", "With a maximum at 5 rad/s")
    pole: pt.Variable = pt.variable("1", "With a pole at 4 rad/s")

    def equations(self) -> pt.Equations:
        yield self.rub.w.value == 0.0
        yield pt.connect(self.load, self.rub.load)
        yield self.drive.tau.value == 3.0 + self.rub.tau
        yield pt.connect(self.drive.flange, self.fan.flange_a)
        yield pt.connect(self.fan.flange_b, self.air.flange)
        yield self.bump == 1 / (1 + (self.fan.w - 5.0) ** 2)
        yield self.pole == 1 / (self.fan.w - 4.0)


def test_ranges_are_those_of_all_torques_also_of_implicit_unknowns() -> None:
    loads = [0.0, -1.7]
    names = ["fan.w", "bump", "pole", *(f"rub.{name}" for name in SOME)]
    found = pt.steady(Blown(), {"load": loads}, outputs=names, guesses={"fan.w": 5.0})
    assert found.status.values.tolist() == [STUCK] * len(loads)
    for k, load in enumerate(loads):
        tau = np.linspace(-LIMIT, LIMIT, 400001) - load
        w = np.sqrt(10 * (3 + tau))
        expected = {"fan.w": w, "bump": 1 / (1 + (w - 5) ** 2), "pole": np.array([-np.inf, np.inf])}
        expected["pole"] = expected["pole"] if w[0] < 4 < w[-1] else 1 / (w - 4)
        for name, formula in SOME.items():
            expected[f"rub.{name}"] = formula(tau)
        if tau[0] < 0.1234567 < tau[-1]:
            expected["rub.pole"] = np.array([-np.inf, np.inf])
        for name, values in expected.items():
            ends = [found[f"{name}_{end}"].values[k] for end in ("low", "high")]
            np.testing.assert_allclose(
                ends, [values.min(), values.max()], rtol=1e-6, atol=1e-8, err_msg=f"{name}, load {load}"
            )


class Braked(pt.Component):
    """As ``Blown``, with a brake on the fan that a torque of 4 N.m breaks loose: on the way between both ends its mode changes."""

    rub: Rubbing = Rubbing()
    drive: rot.Torque = rot.Torque()
    fan: rot.Inertia = rot.Inertia(J=1.0)
    brake: rot.Brake = rot.Brake(fn_max=4.0, mue_pos=((0.0, 1.0),))
    air: rot.QuadraticSpeedDependentTorque = rot.QuadraticSpeedDependentTorque(
        tau_nominal=-10.0, w_nominal=10.0, TorqueDirection=False
    )
    hump: pt.Variable = pt.variable("1", "With a maximum at 1.5 rad/s")

    def equations(self) -> pt.Equations:
        yield self.rub.w.value == 0.0
        yield self.rub.load.value == 0.0
        yield self.brake.f_normalized.value == 1.0
        yield self.drive.tau.value == 3.0 + self.rub.tau
        yield pt.connect(self.drive.flange, self.fan.flange_a)
        yield pt.connect(self.fan.flange_b, self.air.flange, self.brake.flange_a)
        yield self.hump == ca.exp(-((self.fan.w - 1.5) ** 2))


def test_modes_of_other_laws_may_change_on_the_way() -> None:
    """The fan stands up to tau = 1 N.m, and turns with w^2 = 10 (tau - 1) beyond."""
    found = pt.steady(Braked(), {}, outputs=["fan.w", "hump", "brake.tau"])
    assert found.status.item() == STUCK
    ends = {n: (found[f"{n}_low"].item(), found[f"{n}_high"].item()) for n in ("fan.w", "hump", "brake.tau")}
    np.testing.assert_allclose(ends["fan.w"], (0.0, np.sqrt(10.0)), atol=1e-8)
    np.testing.assert_allclose(ends["hump"], (np.exp(-((np.sqrt(10.0) - 1.5) ** 2)), 1.0), rtol=1e-6)
    np.testing.assert_allclose(ends["brake.tau"], (1.0, 4.0), rtol=1e-6)
