"""A brake shoe that draws itself in: where it cannot slide the error says so; friction never drives."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from cases import few

import powertrain as pt
from powertrain.dae.hybrid import Friction, HybridDae
from powertrain.equilibrium.points import NONE, OK
from powertrain.modes.selflocking import _slope, refused


class Shoe(pt.Component):
    """A shoe that its own friction presses on: N = 10 N + k F."""

    size: str = "plain"
    mu: pt.Parameter = pt.parameter("1", "Coefficient of friction", default=0.5)
    k: pt.Parameter = pt.parameter("1", "Pressing force over friction force", default=3.0)
    w: pt.Variable = pt.variable("rad/s", "Speed", start=10.0)
    N: pt.Variable = pt.variable("N", "Pressing force")
    F: pt.Variable = pt.variable("N", "Friction force")

    def equations(self) -> pt.Equations:
        sizes = {"plain": self.F, "size": ca.fabs(self.F), "smooth": ca.sqrt(self.F**2 + 1e-4)}
        yield self.N - self.k * sizes[self.size] == 10.0
        yield pt.friction(self.w, self.F, -self.mu * self.N, self.mu * self.N)
        yield pt.der(self.w) == 1.0 - self.F

    def loss(self) -> pt.Symbol:
        return self.F * self.w


@pytest.mark.parametrize("size", ["plain", "size", "smooth"])
@pytest.mark.parametrize(("mu", "k"), few([(0.5, 3.0), (1.0, 1.5), (0.9, 20.0)]))
def test_what_cannot_slide_is_called_self_locking(size: str, mu: float, k: float) -> None:
    with pytest.raises(pt.PowertrainError, match=r"mode .*pt\.friction\(.* is self-locking.*stiffness") as caught:
        pt.simulate(Shoe(size=size, mu=mu, k=k), 1.0)
    assert "algebraic loop" not in str(caught.value)


def test_a_map_has_no_points_where_a_shoe_cannot_slide() -> None:
    """F = 5 N/(1 - k/2), which would drive beyond k = 2; rows of a map are filled with the modes of points nearby."""
    k = np.linspace(1.0, 3.0, 4001)
    found = pt.steady(Shoe(), {"w": [1.0, 2.0], "k": k}, outputs="F", held=["w"])
    slides, locked = found.isel(k=slice(0, 2000)), found.isel(k=slice(2001, None))
    assert (slides.status == OK).all()
    np.testing.assert_allclose(slides.F.sel(w=1.0), 5.0 / (1.0 - slides.k / 2.0), rtol=1e-9)
    assert (locked.status == NONE).all()
    assert np.isnan(locked.F).all()


@pytest.mark.parametrize("scale", [-0.5, 1.0, 4.0])
@pytest.mark.parametrize("mode", [1.0, -1.0])
def test_the_slope_of_a_limit_is_by_the_torque_and_not_by_the_unknown(scale: float, mode: float) -> None:
    """The torque is scale z, the limits are 1 + 0.3 z^2 and 2 z: at a torque of 2e6 N.m they grow by 1.2e6/scale^2 and by 2/scale."""
    t, x, z, m = ca.SX.sym("t"), ca.SX.sym("x"), ca.SX.sym("z", 2), ca.SX.sym("m", 1)
    zero = ca.SX(0)
    law = Friction("law", "hand", 0, x, scale * z[1], 2 * z[1] + z[0], 1 + 0.3 * z[1] ** 2, ca.SX(1), zero)
    dae = HybridDae(t, x, z, m, ca.SX.sym("p", 0), zero, z, ("w",), np.zeros(1), frictions=(law,))
    slope = ca.Function("slope", [z, m], [_slope(dae, law)])
    expected = 1.2e6 / scale**2 if mode > 0.0 else 2.0 / scale
    assert float(slope([0.0, 0.0], mode)) == pytest.approx(expected)


@pytest.mark.parametrize(("mode", "w"), [(1.0, 1.0), (-1.0, -1.0), (0.0, 1.0), (1.0, 0.0)])
def test_limits_may_cross_by_a_millionth_of_the_largest_torque(mode: float, w: float) -> None:
    """Of 2000 N.m that another law transmits; and by as much as they like in a law that is stuck or at rest."""
    t, x, z, m = ca.SX.sym("t"), ca.SX.sym("x"), ca.SX.sym("z", 2), ca.SX.sym("m", 2)
    zero, one = ca.SX(0), ca.SX(1)
    law = Friction("law", "hand", 0, x, z[1], z[0], 1 - z[0], one, zero, may_free=False)
    other = Friction("other", "hand", 1, x, ca.SX(-2000.0), -one, one, one, zero)
    dae = HybridDae(t, x, z, m, ca.SX.sym("p", 0), zero, z, ("w",), np.zeros(1), frictions=(law, other))
    crossed = ca.Function("crossed", [x, z, m], [refused(dae)])
    slides = mode != 0.0 and w != 0.0
    for gap, wrong in ((1.8e-3, False), (2.2e-3, True)):
        found = float(crossed(w, [0.5 + gap / 2, 0.0], [mode, 0.0]))
        assert (found > 0.0) == (wrong and slides)


@pytest.mark.parametrize("size", ["plain", "size", "smooth"])
def test_below_its_limit_it_slides(size: str) -> None:
    """F = mu (10 N + k F) = 5 N/(1 - 0.5) = 10 N."""
    result = pt.simulate(Shoe(size=size, k=1.0), 0.5)
    np.testing.assert_allclose(result["F"], 10.0, rtol=1e-4)


def test_the_other_way_it_lets_go() -> None:
    """F = -mu (10 N + k F) = -5 N/2.5 = -2 N."""
    result = pt.simulate(Shoe(), 1.0, starts={"w": -10.0})
    np.testing.assert_allclose(result["F"], -2.0, rtol=1e-9)


def test_at_rest_it_holds() -> None:
    result = pt.simulate(Shoe(), 1.0, starts={"w": 0.0})
    assert result["mode"][-1] == 0
    np.testing.assert_allclose(result["F"], 1.0)


class SeizingHalf(pt.Component):
    """A differential with the locking factor 2 k, between a forced shaft u, a mass that slides to a stop, and a free inertia J.

    With the mass at rest J du/dt = -tau - load/2, tau = k |load|: for k > 1/2 there are two loads while du/dt < 0 and none while du/dt > 0.
    The mass cannot evade: moved from the stop it would press on the differential, and the free half would have to speed up.
    """

    k: pt.Parameter = pt.parameter("1", "Friction over load", default=0.63)
    J: pt.Parameter = pt.parameter("kg", "Inertia of the free half", default=0.5)
    F: pt.Parameter = pt.parameter("N", "Force on the mass", default=1.5)
    x: pt.Variable = pt.variable("m", "Place of the mass", start=-0.05, prefer=True)
    v: pt.Variable = pt.variable("m/s", "Speed of the mass", start=1.0, prefer=True)
    u: pt.Variable = pt.variable("m/s", "Speed of the forced half")
    free: pt.Variable = pt.variable("m/s", "Speed of the free half")
    load: pt.Variable = pt.variable("N", "Load of the differential")
    tau: pt.Variable = pt.variable("N", "Friction of the differential")
    f: pt.Variable = pt.variable("N", "Friction of the mass")
    stop: pt.Variable = pt.variable("N", "Force of the stop")

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == self.v
        yield self.u == 3 - 0.1 * ca.sin(pt.time)
        yield self.free == 2 * self.v - self.u
        yield self.J * pt.der(self.free) == self.tau + self.load / 2
        yield pt.der(self.v) == self.F - self.f - self.stop - self.load
        limit = self.k * pt.switch(self.load >= 0, self.load, -self.load, continuous=True)
        yield pt.friction(self.u - self.free, self.tau, -limit, limit, name="cam")
        yield pt.friction(self.v, self.f, -2.0, 2.0, peak=1.2, name="floor")
        yield pt.unilateral(-self.x, self.stop, name="stop")


SEIZING = pt.compile(SeizingHalf())


@pytest.mark.parametrize(("k", "J"), few([(0.55, 0.5), (0.63, 2.0), (0.8, 0.5)]))
@pytest.mark.parametrize("F", few([0.2, 1.0, 1.5, 1.95, 2.1, 3.0]))
def test_a_half_that_must_seize_is_proved_to_jam(k: float, J: float, F: float) -> None:
    """Where friction and stop share the force on the mass, every share was tried, though friction at rest has only one."""
    with pytest.raises(
        pt.SimulationError,
        match=r"(?s)at t = 1\.57\d* s no modes are consistent with any of the 2 combinations of the conditions.*cam",
    ):
        SEIZING.simulate(4.0, parameters={"k": k, "J": J, "F": F})


def test_a_half_that_need_not_seize_slides() -> None:
    """Below the locking factor of one the load follows du/dt through zero."""
    result = SEIZING.simulate(4.0, parameters={"k": 0.4})
    du = -0.1 * np.cos(result.time)
    rest = result.time > 1.0
    np.testing.assert_allclose(result["load"][rest], np.where(du < 0, -1 / 1.8, -1 / 0.2)[rest] * du[rest], atol=1e-6)
