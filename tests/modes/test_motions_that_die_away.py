"""Motions that die away under a smooth resistance, through lossy meshes whose limits are shares of their load: they come to rest once."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from cases import few
from joined import joined

import powertrain as pt
from powertrain.components.rotational import Damper, Fixed, Gear, Inertia, SignTorque, WormGear
from powertrain.modes.projection import at_rest

DRAG = SignTorque(tau_nominal=-3.0)  # 1500 N.m.s near rest
GEAR = Gear(ratio=2.0, efficiency=0.9)
WORM = WormGear(ratio=10.0, lead=0.3, mue=0.08)
BEFORE = "0.flange_a=1.flange_a 1.flange_b=2.flange_a 0.flange_b=3.flange"
BEHIND = "0.flange_a=1.flange_a 1.flange_b=2.flange_a=3.flange"
DAMPED = f"{BEFORE[:-7]}.flange_a 3.flange_b=4.flange"
TWO = "0.flange_a=1.flange_a=3.flange 1.flange_b=2.flange_a=4.flange_a 4.flange_b=5.flange_a"
SHAFTS = [Inertia(J=0.5) for _ in range(3)]
MACHINES: dict[str, tuple[tuple[pt.Component, ...], str]] = {
    "gear": ((SHAFTS[0], GEAR, SHAFTS[1], DRAG), BEFORE),
    "steep": ((SHAFTS[0], GEAR, SHAFTS[1], SignTorque(tau_nominal=-3.0, w0=1e-3)), BEFORE),
    "behind": ((SHAFTS[0], GEAR, SHAFTS[1], DRAG), BEHIND),
    "worm": ((SHAFTS[0], WORM, SHAFTS[1], DRAG), BEFORE),
    "damper": ((SHAFTS[0], GEAR, SHAFTS[1], Damper(d=1500.0), Fixed()), DAMPED),
    "two": ((SHAFTS[0], GEAR, SHAFTS[1], DRAG, Gear(ratio=3.0, efficiency=0.8), SHAFTS[2]), TWO),
}


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("machine", few(list(MACHINES), 3))
def test_a_motion_that_dies_away_comes_to_rest_once(machine: str, rtol: float) -> None:
    """It falls for ever; where the error of the integration throws it to the other side of zero, it rests."""
    parts, joints = MACHINES[machine]
    result = pt.simulate(joined(*parts, joints=joints), 1.0, rtol=rtol, starts={"parts[0].w": 1.0})
    assert {event.new for event in result.events} <= {0.0}
    assert len({event.time for event in result.events}) <= 1
    assert result.statistics["steps"] + result.statistics["rejected"] < 150
    assert abs(result["parts[0].w"][-1]) < 1e-10


class Levered(pt.Component):
    """A shaft with a drag, halved after a second, and a mesh behind the ratio V, which loses a tenth of its load."""

    V: pt.Variable = pt.variable("1", "Ratio", start=1.0, prefer=True)
    fall: pt.Parameter = pt.parameter("1/s", "Rate at which the ratio falls", default=0.0)
    w: pt.Variable = pt.variable("rad/s", "Speed of the shaft", start=1.0, prefer=True)
    tau: pt.Variable = pt.variable("N.m", "Loss in the mesh")
    load: pt.Variable = pt.variable("N.m", "Load of the mesh")

    def equations(self) -> pt.Equations:
        drag = pt.switch(pt.time >= 1.0, 4.5, 9.0)
        yield pt.der(self.V) == -self.fall
        yield self.V * (self.load - self.tau) == drag * self.w
        yield pt.der(self.w) == -self.V * self.load
        limit = 0.1 * pt.switch(self.load >= 0, self.load, -self.load, continuous=True)
        yield pt.friction(self.V * self.w, self.tau, -limit, limit)

    def loss(self) -> pt.Symbol:
        return self.tau * self.V * self.w


@pytest.mark.parametrize(("V", "accuracy"), [(1.0, 1e-3), (1e-6, 1.0)])
def test_a_mesh_that_hardly_turns_does_not_stop_the_shaft(V: float, accuracy: float) -> None:
    """At 1 s the shaft turns at e^-10 rad/s; at the end of a lever of 1e-6 that is rest, but the shaft is not at rest."""
    result = pt.simulate(Levered(), 1.5, starts={"V": V})
    assert result["w"][-1] == pytest.approx(np.exp(-12.5), rel=accuracy)
    assert result["mode"][-1] != 0.0


def test_rest_is_a_change_of_what_torques_move() -> None:
    """The speed of the mesh would be zero at another ratio, too, or at one between; but no torque changes the ratio."""
    dae = pt.compile(Levered()).compiled.dae
    states = {x.name(): k for k, x in enumerate(ca.vertsplit(dae.x))}
    stopped = ca.Function("stopped", [dae.t, dae.x, dae.z, dae.m, dae.p], [at_rest(dae)])
    x = np.zeros(dae.x.numel())
    x[states["V"]], x[states["w"]] = 0.5, 1e-3
    found = np.array(stopped(0.0, x, np.zeros(dae.z.numel()), np.zeros(dae.m.numel()), np.ones(dae.p.numel()))).ravel()
    np.testing.assert_allclose([found[states["V"]], found[states["w"]]], [0.5, 0.0], atol=1e-18)
