"""Maps in equations: simulated, guarded, counted, differentiated, pickled with their model."""

from __future__ import annotations

import pickle
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import powertrain as pt
from powertrain import Axis
from powertrain.components import rotational as rot
from powertrain.components.body import AxlePath, VehicleBody
from powertrain.components.differentials import BevelDifferential
from powertrain.components.rotational import Inertia, Torque
from powertrain.components.wheels import SlipWheel
from powertrain.language.map import Method, Outside


class Pushed(pt.Component):
    """A point of 1 kg under a force that a table gives over speed and position."""

    table: pt.Map
    s: pt.Variable = pt.variable("m", "Position", start=0.0)
    v: pt.Variable = pt.variable("m/s", "Speed", start=1.0)

    def equations(self) -> pt.Equations:
        yield self.v == pt.der(self.s)
        force = self.table(self.v, self.s) if len(self.table.axes) == 2 else self.table(self.v)
        yield pt.der(self.v) == force


def force(v: np.ndarray, s: np.ndarray | float = 0.0) -> np.ndarray:
    return np.asarray(np.sin(v) + 2 - 0.5 * v - 0.3 * np.asarray(s))


def line(points: int, high: float = 10.0, outside: Outside = "error", method: Method = "linear") -> pt.Map:
    grid = np.linspace(0, high, points)
    return pt.Map.curve(grid, force(grid), x="v", x_unit="m/s", unit="N", name="push", outside=outside, method=method)


def plane(method: Method) -> pt.Map:
    v, s = np.linspace(0, 10, 21), np.linspace(-1, 30, 15)
    axes = (Axis("v", "m/s", v), Axis("s", "m", s))
    return pt.Map(axes, force(v[:, None], s[None, :]), "N", "push", method)


@pytest.mark.parametrize("method", ["dopri5", "rodas5p"])
@pytest.mark.parametrize(
    "table", [line(8), line(60), line(8, method="smooth"), plane("linear"), plane("smooth")], ids=repr
)
def test_against_another_integrator(table: pt.Map, method: str) -> None:
    result = pt.simulate(Pushed(table=table), 3.0, method=method, rtol=1e-9)

    def law(t: float, y: np.ndarray) -> list[float]:
        return [float(y[1]), float(table(y[1], y[0]) if len(table.axes) == 2 else table(y[1]))]

    other = solve_ivp(law, (0, 3), [0.0, 1.0], rtol=1e-9, atol=1e-11, max_step=0.01)
    assert result["s"][-1] == pytest.approx(other.y[0, -1], rel=1e-6)
    assert result["v"][-1] == pytest.approx(other.y[1, -1], rel=1e-6)


def test_leaving_the_range_ends_the_simulation() -> None:
    with pytest.raises(pt.SimulationError, match=r"push: v .*table\(self.v\).* m/s; allowed is .* 2 m/s") as caught:
        pt.simulate(Pushed(table=line(20, 2.0)), 3.0)
    reached = caught.value.result
    assert reached["v"][-1] == pytest.approx(2.0, rel=1e-6)
    assert 0 < reached.time[-1] < 3


@pytest.mark.parametrize("points", [20, 60])
def test_clipping_is_counted(points: int) -> None:
    result = pt.simulate(Pushed(table=line(points, 2.0, "clip")), 3.0)
    assert result.statistics["outside push: v"] > 0
    inside = pt.simulate(Pushed(table=line(points, 10.0, "clip")), 3.0)
    assert inside.statistics["outside push: v"] == 0
    edge = force(np.array(2.0))
    late = result.time > result.time[-1] - 1
    slope = np.polyfit(result.time[late], result["v"][late], 1)[0]
    assert slope == pytest.approx(float(edge), rel=1e-6)


class Begun(pt.Component):
    """A point of 1 kg under a constant force, with a variable that decays from the value of a table over the speed at the start."""

    table: pt.Map
    v: pt.Variable = pt.variable("m/s", "Speed", start=2.0)
    y: pt.Variable = pt.variable("N", "Decays in 1 s")

    def equations(self) -> pt.Equations:
        yield pt.der(self.v) == 5.0
        yield pt.der(self.y) == -self.y

    def initial(self) -> pt.Equations:
        yield self.y == self.table(self.v)


@pytest.mark.parametrize("outside", ["error", "clip"])
def test_a_table_for_the_start_says_nothing_about_the_run(outside: Outside) -> None:
    table = line(8, outside=outside)
    plant = pt.compile(Begun(table=table))
    result = plant.simulate(4.0)
    assert result["v"][-1] == pytest.approx(22.0)
    assert result["y"][0] == pytest.approx(float(table(2.0)))
    assert result.notes == ()
    found = pt.steady(plant, {"v": [5.0, 15.0]}, outputs="v", held=["v"], free=[])
    assert (found["status"] == 0).all()


def test_a_start_beyond_its_table_is_refused() -> None:
    plant = pt.compile(Begun(table=line(8)))
    with pytest.raises(pt.InitializationError, match=r"push: v .* at t = 0 s: 12 m/s; allowed is -1e-08 to 10 m/s"):
        plant.initialize(starts={"v": 12.0})


def test_going_on_linearly_is_neither_refused_nor_counted() -> None:
    result = pt.simulate(Pushed(table=line(20, 2.0, "linear")), 3.0)
    assert result.ok
    assert "outside push: v" not in result.statistics


def test_models_with_maps_are_pickled() -> None:
    plant = pickle.loads(pickle.dumps(pt.compile(Pushed(table=plane("smooth")))))
    again = plant.simulate(1.0)
    assert again["v"][-1] == pt.simulate(Pushed(table=plane("smooth")), 1.0)["v"][-1]


def test_models_are_equal_where_their_maps_are() -> None:
    assert Pushed(table=line(8)) == Pushed(table=line(8))
    assert hash(Pushed(table=line(8))) == hash(Pushed(table=line(8)))
    assert Pushed(table=line(8)) != Pushed(table=line(9))


LONG = np.linspace(-20, 20, 161)
CUBE = pt.Map.curve(LONG, LONG**3 / 40, name="cube")
BENT = pt.Map.curve(LONG, np.tanh(LONG / 4), name="bent", method="smooth")


class Chained(pt.Component):
    """Tables of tables beside plain equations, in an order that is not that of the solution."""

    a: pt.Variable = pt.variable("1", "Table of x")
    b: pt.Variable = pt.variable("1", "Table of a and of the plain c")
    c: pt.Variable = pt.variable("1", "Twice a")
    d: pt.Variable = pt.variable("1", "Sum")
    rate: pt.Variable = pt.variable("1/s", "Derivative of a table")
    x: pt.Variable = pt.variable("1", "State", start=3.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.x) == -self.d
        yield self.d == self.b + self.c + self.a
        yield self.b == CUBE(self.a + self.c)
        yield self.rate == pt.der(self.a)
        yield self.c == 2 * self.a
        yield self.a == BENT(self.x)


@pytest.mark.parametrize("method", ["dopri5", "rodas5p"])
def test_tables_of_tables(method: str) -> None:
    result = pt.simulate(Chained(), 2.0, method=method, rtol=1e-9)

    def sum_of(x: float) -> float:
        a = float(BENT(x))
        return float(CUBE(3 * a)) + 3 * a

    other = solve_ivp(lambda t, y: [-sum_of(y[0])], (0, 2), [3.0], rtol=1e-10, atol=1e-12, max_step=0.01)
    assert result["x"][-1] == pytest.approx(other.y[0, -1], rel=1e-7)
    a = np.asarray(BENT(result["x"]))
    np.testing.assert_allclose(result["a"], a, rtol=1e-12)
    np.testing.assert_allclose(result["b"], CUBE(3 * a), rtol=1e-12)
    np.testing.assert_allclose(result["rate"], -result["d"] * np.gradient(a, result["x"]), rtol=0.02, atol=1e-3)


class Balanced(pt.Component):
    """A massless point between a spring and a table: its position is found at every instant."""

    x: pt.Variable = pt.variable("m", "Position of the point")
    s: pt.Variable = pt.variable("m", "Position of the spring's end", start=1.0)

    def equations(self) -> pt.Equations:
        yield pt.der(self.s) == 4.0
        yield 3 * (self.s - self.x) == CUBE(self.x)


def test_a_table_in_an_equation_that_must_be_solved() -> None:
    result = pt.simulate(Balanced(), 2.0)
    x = result["x"]
    np.testing.assert_allclose(x + CUBE(x) / 3, 1 + 4 * result.time, rtol=1e-6)


def test_what_stands_linearly_beside_a_table_stays_linear() -> None:
    compiled = pt.compile(Chained()).compiled
    assert compiled.dae.z.numel() == 0
    assert "fwd1" not in str(compiled.dae.xdot)


class Asked(pt.Component):
    """A table that is asked for the speed of a shaft."""

    table: Any
    law: Any
    J: Inertia = Inertia(J=1.0)
    source: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.flange, self.J.flange_a)
        yield self.source.tau.value == self.law(self.table, self.J.w)


def over(unit: str) -> pt.Map:
    return pt.Map.curve([0, 100], [0, -1], x="speed", x_unit=unit, outside="linear")


@pytest.mark.parametrize(
    "law", [lambda table, w: table(w), lambda table, w: table(ca.fabs(w) + 1)], ids=["speed", "size"]
)
def test_axis_in_another_unit_is_refused(law: Any) -> None:
    with pytest.raises(
        pt.ModelError,
        match=r"the axis speed is in rpm, but it is called with a variable in rad/s; give the axis in rad/s",
    ):
        pt.compile(Asked(table=over("rpm"), law=law))
    with pytest.raises(pt.ModelError, match=r"the axis speed is in N\.m"):
        pt.compile(Asked(table=over("N.m"), law=law))


@pytest.mark.parametrize("unit", ["rad/s", "1/s", "1"])
def test_axis_in_the_variables_unit(unit: str) -> None:
    result = pt.simulate(Asked(table=over(unit), law=lambda table, w: table(w)), 1.0, starts={"J.w": 1.0})
    assert result["J.w"][-1] == pytest.approx(np.exp(-0.01), rel=1e-6)


def test_variable_may_be_converted() -> None:
    result = pt.simulate(Asked(table=over("rpm"), law=lambda table, w: table(w * 30 / np.pi)), 1.0, starts={"J.w": 1.0})
    assert result["J.w"][-1] == pytest.approx(np.exp(-0.3 / np.pi), rel=1e-6)


class OnClothoid(pt.Component):
    """A driven axle and its body on a path whose curvature grows in proportion to the distance, by a table or by its formula."""

    table: bool
    drive: rot.ConstantTorque = rot.ConstantTorque(tau_constant=200)
    cage: rot.Inertia = rot.Inertia(J=0.1)
    differential: BevelDifferential = BevelDifferential(eta=0.95)
    path: AxlePath = AxlePath(track=1.4, h=0.5)
    left: SlipWheel = SlipWheel()
    right: SlipWheel = SlipWheel()
    body: VehicleBody = VehicleBody()

    def equations(self) -> pt.Equations:
        s = [0.0, 10.0, 20.0, 30.0, 40.0]
        bends = pt.Map.curve(s, [1e-3 * x for x in s], x="s", x_unit="m", unit="1/m", outside="linear", method="smooth")
        way = self.body.s.value
        yield self.path.curvature.value == (bends(way) if self.table else 1e-3 * way)
        yield pt.connect(self.drive.flange, self.cage.flange_a)
        yield pt.connect(self.cage.flange_b, self.differential.crown)
        for side in ("left", "right"):
            wheel = getattr(self, side)
            yield pt.connect(getattr(self.differential, side), wheel.hub)
            yield pt.connect(wheel.road, getattr(self.path, side))
            yield pt.connect(wheel.load, getattr(self.path, f"{side}_load"))
        yield pt.connect(self.path.side, self.left.side, self.right.side)
        yield pt.connect(self.path.axle, self.body.front)
        yield pt.connect(self.body.front_load, self.path.load)


def test_a_smooth_table_in_the_ratios_between_torques() -> None:
    """The table is a call of a function, which hides from symbolic derivatives that no torque is in it."""
    by_table, by_formula = (pt.simulate(OnClothoid(table=table), 8.0, rtol=1e-9) for table in (True, False))
    for name in "body.v", "left.w", "right.w", "left.f":
        np.testing.assert_allclose(by_table[name][-1], by_formula[name][-1], rtol=1e-6)
    lead = by_table["right.w"][-1] / by_table["left.w"][-1]
    assert lead == pytest.approx(1 + 1e-3 * by_table["body.s"][-1] * 1.4, rel=0.02)
