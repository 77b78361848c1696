from __future__ import annotations

import random
from itertools import pairwise
from typing import Any, ClassVar

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from cases import few
from drivelines import driveline
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.patches import Rectangle

import powertrain as pt
from powertrain.components.blocks import Ramp
from powertrain.components.cvu import CVU, HydrostaticUnit, TractionDrive, VariableUnit
from powertrain.components.differentials import FundamentalDifferential, Mesh, PlanetaryGear
from powertrain.components.rotational import (
    ConstantSpeed,
    ConstantTorque,
    Damper,
    Fixed,
    Flange,
    IdealGear,
    Inertia,
    Speed,
    Torque,
    Torque2,
    TwoFlanges,
)
from powertrain.components.transmissions import TYPES, Layout, SplitPathTransmission, relative_ratio
from powertrain.design import SplitPathBench
from powertrain.power.circulation import Edge, decompose, loops
from powertrain.power.powergraph import _shown
from powertrain.power.powerplot import _along, _cut, _shade, plot_efficiency_map, plot_lever, plot_variator

CVU_PATH, MESH_PATH = "gearbox.cvu", "gearbox.differential"
SHAFTS = ("gearbox.flange_a", "gearbox.flange_b")
ETA, ETA_V = 0.95, 0.9
ROUND_OFF = 1e-12
"""Powers (W) of a machine at rest."""
PERFECT = {f"{part}.{name}": 1.0 for part in (CVU_PATH, MESH_PATH) for name in ("eta_ab", "eta_ba")}


class Rig(pt.Component):
    """A split-path transmission driven at a constant speed, with a torque on its output."""

    V: pt.Input = pt.signal_input("1", "Ratio of the variator")
    load: pt.Input = pt.signal_input("N.m", "Accelerating torque on the output")
    r: pt.Variable = pt.variable("1", "Overall ratio")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    gearbox: SplitPathTransmission = SplitPathTransmission()
    output: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.gearbox.flange_a)
        yield pt.connect(self.gearbox.flange_b, self.output.flange)
        yield pt.connect(self.V, self.gearbox.ratio)
        yield pt.connect(self.load, self.output.tau)
        yield self.r * pt.der(self.gearbox.flange_a.phi) == pt.der(self.gearbox.flange_b.phi)


def ratio(layout: Layout, r: Any) -> Any:
    R = relative_ratio(layout, -1.7)
    return (r - R) / (1 - R)


def over_ratio(layout: Layout, r: Any, **options: Any) -> pt.PowerFlow:
    """The flow at overall ratios r, with power out at the output."""
    plant = pt.compile(Rig(gearbox=SplitPathTransmission(layout=layout)))
    load = xr.DataArray(-100.0 * np.sign(r), dims="V")
    grid = {"V": ratio(layout, r), "load": load}
    return pt.power_flow(plant, grid, outputs={"r": "r"}, variator=CVU_PATH, shafts=SHAFTS, **options)


def closed_form(layout: Layout, r: float, eta: float = ETA, eta_v: float = ETA_V) -> dict[str, float]:
    """Powers over |P_out| and K by the paper's equations, for the direction of the mesh that is consistent."""
    speeds = dict(zip(layout, (1.0, ratio(layout, r), r), strict=True))
    w_a, w_b, w_h = speeds["a"], speeds["b"], speeds["H"]

    def powers(driver: str) -> tuple[dict[str, float], float]:
        """Powers of the members and the latent power of a, if ``driver`` drives relative to the carrier."""
        T_b_over_a = -(eta if driver == "a" else 1 / eta) * (w_a - w_h) / (w_b - w_h)
        torque = {"a": 1.0, "b": T_b_over_a, "H": -1.0 - T_b_over_a}
        scale = -1.0 / (torque[layout[2]] * r)
        return {m: scale * torque[m] * speeds[m] for m in "abH"}, scale * (w_a - w_h)

    power, latent = powers("a")
    if latent < 0:
        power, latent = powers("b")
        assert latent < 0
    P_v = power[layout[1]]
    into = P_v / eta_v if P_v > 0 else P_v
    lost = abs(P_v) * (1 / eta_v - 1 if P_v > 0 else 1 - eta_v)
    P_in = 1.0 + sum(power.values()) + lost
    return {"P_1": power[layout[0]], "P_2": P_v, "K": into / P_in, "efficiency": 1 / P_in}


@pytest.fixture(scope="module")
def example() -> pt.PowerFlow:
    """The worked example: a is the output, H at the variator, r = -0.13."""
    return pt.power_flow(Rig(), {"V": ratio("bHa", -0.13), "load": 100.0}, variator=CVU_PATH, shafts=SHAFTS)


def test_worked_example(example: pt.PowerFlow) -> None:
    power = {p: float(example.power.sel(port=f"{MESH_PATH}.{p}")) for p in ("a", "b", "carrier")}
    torque = {p: float(example.data.torque.sel(port=f"{MESH_PATH}.{p}")) for p in ("a", "b", "carrier")}
    loss = example.data["loss"]
    assert power["a"] < 0
    assert power["b"] / power["a"] == pytest.approx(-13.77, abs=5e-3)
    assert power["carrier"] / power["a"] == pytest.approx(12.48, abs=5e-3)
    assert torque["b"] / torque["a"] == pytest.approx(1.789, abs=5e-4)
    assert torque["carrier"] / torque["a"] == pytest.approx(-2.789, abs=5e-4)
    assert -float(loss.sel(component=MESH_PATH)) / power["a"] == pytest.approx(0.288, abs=5e-4)
    assert -float(loss.sel(component=CVU_PATH)) / power["a"] == pytest.approx(1.248, abs=5e-4)
    assert float(example.input) / power["a"] == pytest.approx(-2.536, abs=5e-4)
    assert float(example.efficiency) == pytest.approx(0.394, abs=5e-4)
    share = example.variator(CVU_PATH)
    assert float(share.K) == pytest.approx(-4.92, abs=5e-3)
    assert share["case"].item() == "negative recirculation"
    assert float(share.efficiency) == pytest.approx(0.9)
    assert not example.data["stored"].any()


def test_loop_of_worked_example(example: pt.PowerFlow) -> None:
    """What comes back from the unit is all that circulates; the rest of the input ends as output and losses."""
    (loop,) = example.loops
    back = -float(example.power.sel(port=f"{CVU_PATH}.flange_a"))
    assert loop.power == pytest.approx(back)
    assert float(example.circulating) == pytest.approx(back)
    assert set(loop.through) == {"gearbox.flange_a", MESH_PATH, CVU_PATH}
    ends = {(way.through[-1], way.end): way.power for way in example.paths}
    assert ends["output", "delivered"] == pytest.approx(1300.0)
    assert ends[CVU_PATH, "loss"] == pytest.approx(float(example.data.loss.sel(component=CVU_PATH)))
    assert sum(ends.values()) == pytest.approx(float(example.input))
    branches = {(b.source, b.target): b.power for b in example.branches}
    assert branches[MESH_PATH, CVU_PATH] == pytest.approx(12.477 * 1300, rel=1e-4)
    assert branches["drive", "gearbox.flange_a"] == pytest.approx(float(example.input))
    assert "loop" in repr(example)


@pytest.mark.parametrize("layout", TYPES.values())
def test_layouts_against_the_paper(layout: Layout) -> None:
    """K (29), efficiency and the cases of Fig. 8 by the signs of P_1 and P_2, over the range of Figs. 11-14."""
    r = np.array([r for r in np.linspace(-2, 3, 41) if abs(r) > 0.03 and abs(r - 1) > 0.01])
    flow = over_ratio(layout, r)
    share = flow.variator(CVU_PATH)
    expected = [closed_form(layout, float(value)) for value in r]
    np.testing.assert_allclose(share.K, [e["K"] for e in expected], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(flow.efficiency, [e["efficiency"] for e in expected], rtol=1e-9)
    for case, e in zip(share["case"].values, expected, strict=True):
        if e["P_1"] > 0 and e["P_2"] > 0:
            assert case == "split"
        elif e["P_2"] > 0:
            assert case == "positive recirculation"
        elif e["P_2"] < 0:
            assert case == "negative recirculation"
    assert np.abs(flow.imbalance).max() < 1e-9 * np.abs(flow.power).max()


@pytest.mark.parametrize("layout", few(TYPES.values(), 2))
def test_lossless_share_three_ways(layout: Layout) -> None:
    """By differentiation of the kinematics, by the torques without losses, and (1 - R) V/r."""
    r = np.array([-1.9, -0.4, 0.2, 0.5, 0.9, 1.3, 2.6])
    lossy, perfect = over_ratio(layout, r), over_ratio(layout, r, parameters=PERFECT)
    share = lossy.variator(CVU_PATH)
    R = relative_ratio(layout, -1.7)
    np.testing.assert_allclose(share["share"], (1 - R) * ratio(layout, r) / r, rtol=1e-12)
    np.testing.assert_allclose(share["K_o"], perfect.variator(CVU_PATH).K, rtol=1e-9)
    np.testing.assert_allclose(perfect.efficiency, 1.0, rtol=1e-12)


def test_share_along_a_simulation() -> None:
    """The ratio ramps through the case without power in the unit (V = 0): K and its lossless share change their sign together."""
    inputs: dict[str, Any] = {"V": ([0.0, 1.0], [-0.3, 0.5]), "load": -100.0}
    model = Rig(gearbox=SplitPathTransmission(layout="abH"))
    flow = pt.power_flow(pt.simulate(model, stop=1.0, inputs=inputs, points=40), variator=CVU_PATH, shafts=SHAFTS)
    share = flow.variator(CVU_PATH)
    R, V = relative_ratio("abH", -1.7), -0.3 + 0.8 * flow.data.time.values
    np.testing.assert_allclose(share["share"], (1 - R) * V / (R + (1 - R) * V), rtol=1e-9, atol=1e-12)
    assert (share["case"][V < -1e-6] == "negative recirculation").all()
    assert (share["case"][V > 1e-6] == "split").all()
    assert (np.sign(share["K"]) == np.sign(share["K_o"]))[np.abs(V) > 1e-6].all()


def test_output_coupled() -> None:
    """Forward is the direction in which power is split, from the differential through the unit to the output."""
    plant = pt.compile(Rig(gearbox=SplitPathTransmission(layout="abH", coupling="output")))
    V = np.array([-2.0, -0.5, 0.5, 2.0])
    R = relative_ratio("abH", -1.7)
    r = R / (1 - V + R * V)
    grid = {"V": V, "load": xr.DataArray(-100 * np.sign(r), dims="V")}
    options: dict[str, Any] = {"parameters": PERFECT, "variator": CVU_PATH, "shafts": SHAFTS}
    share = pt.power_flow(plant, grid, **options).variator(CVU_PATH)
    exact = -(1 - R) * V / (1 - V + R * V)
    np.testing.assert_allclose(share.K, exact, rtol=1e-9)
    np.testing.assert_allclose(share["share"], -exact, rtol=1e-9)
    named = dict(zip(exact, share["case"].values, strict=True))
    for k, case in named.items():
        assert case == ("negative recirculation" if k < 0 else "split" if k < 1 else "positive recirculation")


def test_splits_sum_to_one() -> None:
    r = np.array([-1.0, -0.2, 0.3, 0.7, 2.0])
    flow = over_ratio("abH", r)
    for vertex in ("gearbox.flange_a", MESH_PATH, CVU_PATH):
        np.testing.assert_allclose(flow.split(vertex).sum("port"), 1.0, rtol=1e-12)
    point = flow.isel(V=3)
    assert point.variator(CVU_PATH)["case"].item() == "split"
    assert float(point.circulating) == 0.0
    (name, shares), *rest = point.splits.items()
    assert name == "gearbox.flange_a"
    assert not rest
    assert shares[f"{CVU_PATH}.flange_a"] == pytest.approx(float(point.variator(CVU_PATH).K))


def test_stuck_point_has_no_flow() -> None:
    flow = over_ratio("bHa", np.array([0.5, 1.0, 1.5]))
    assert np.isnan(flow.circulating.values[1])
    assert np.isnan(flow.data.loss.isel(V=1)).all()
    assert np.isnan(flow.variator(CVU_PATH).K.values[1])
    assert flow.variator(CVU_PATH)["case"].values[1] == ""
    assert np.isfinite(flow.efficiency.values[[0, 2]]).all()
    assert "no solution" in repr(flow.isel(V=1))


def test_composite_as_a_whole() -> None:
    flow = pt.power_flow(Rig(), {"V": ratio("bHa", -0.13), "load": 100.0}, whole="gearbox")
    assert flow.graph.components == ("drive", "gearbox", "output")
    assert [(b.source, b.target) for b in flow.branches] == [("drive", "gearbox"), ("gearbox", "output")]
    assert float(flow.circulating) == 0.0
    assert float(flow.data.loss.sel(component="gearbox")) == pytest.approx(1.536 * 1300, rel=1e-3)
    assert abs(float(flow.imbalance.sel(component="gearbox"))) < 1e-8


def test_the_outermost_whole_hides_what_is_in_it() -> None:
    assert _shown("a.b.c", ["a", "a.b"]) == "a"
    assert _shown("a.b.c", ["a.b"]) == "a.b"
    assert _shown("a.b.c", ["*.c"]) == "a.b.c"
    assert _shown("a.b.c", []) == "a.b.c"


class Box(TwoFlanges):
    """An inertia, or another box, in a composite."""

    inner: TwoFlanges = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.inner.flange_a)
        yield pt.connect(self.flange_b, self.inner.flange_b)


class OpenEnd(pt.Component):
    """An inertia and a composite with nothing at its end."""

    drive: Torque = Torque()
    first: Inertia = Inertia(J=1.0)
    last: Box = Box()
    rise: Ramp = Ramp(height=1.0, duration=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.rise.y, self.drive.tau)
        yield pt.connect(self.drive.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.last.flange_a)


def test_an_open_flange_is_no_connection() -> None:
    graph = pt.power_flow(pt.simulate(OpenEnd(), 1.0)).graph
    assert len(graph.nodes) == 2
    assert all(len(graph.at_node(n)) == 2 for n in range(2))
    assert not any(terminal.port.endswith("flange_b") and "last" in terminal.port for terminal in graph.terminals)


class Pair(TwoFlanges):
    """Two inertias in a composite."""

    one: Inertia = Inertia(J=1.0)
    two: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.flange_a, self.one.flange_a)
        yield pt.connect(self.one.flange_b, self.two.flange_a)
        yield pt.connect(self.two.flange_b, self.flange_b)


class Nested(pt.Component):
    """A pair in a box behind an inertia, and a box behind it with a longer name."""

    drive: Torque = Torque()
    first: Inertia = Inertia(J=1.0)
    box: Box = Box(inner=Pair())
    box2: Box = Box()
    rise: Ramp = Ramp(height=1.0, duration=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.rise.y, self.drive.tau)
        yield pt.connect(self.drive.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.box.flange_a)
        yield pt.connect(self.box.flange_b, self.box2.flange_a)


PAIR = ("box.inner.one", "box.inner.two")


@pytest.mark.parametrize(
    ("whole", "components", "nodes"),
    [
        ("", (*PAIR, "box2.inner"), ("box.flange_a", "box.inner.one.flange_b", "box.flange_b")),
        ("box.inner", ("box.inner", "box2.inner"), ("box.flange_a", "box.flange_b")),
        ("box", ("box", "box2.inner"), ("first.flange_b", "box2.flange_a")),
        ("box2", (*PAIR, "box2"), ("box.flange_a", "box.inner.one.flange_b", "box.flange_b")),
    ],
)
def test_boxes_in_boxes(whole: str, components: tuple[str, ...], nodes: tuple[str, ...]) -> None:
    """The connections that are seen, named by the outermost port of a box that is open, whichever box is treated as one."""
    graph = pt.power_flow(pt.simulate(Nested(), 1.0), whole=whole or ()).graph
    assert graph.components == ("drive", "first", *components)
    assert sorted(graph.nodes) == sorted(("drive.flange", *nodes))
    assert all(len(graph.at_node(n)) == 2 for n in range(len(graph.nodes)))


class Heater(pt.Component):
    """A source of torque that stores and loses power of its own."""

    boundary: ClassVar[bool] = True
    flange: Flange = pt.port(Flange)
    x: pt.Variable = pt.variable("J", "Energy stored in the source", start=0.0)

    def equations(self) -> pt.Equations:
        yield self.flange.tau == -3.0
        yield pt.der(self.x) == 5.0

    def energy(self) -> pt.Symbol:
        return self.x

    def loss(self) -> pt.Symbol:
        return pt.Symbol(7.0)


class Heated(pt.Component):
    source: Heater = Heater()
    load: Inertia = Inertia(J=2.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.flange, self.load.flange_a)


def test_a_source_supplies_what_it_stores_and_loses_too() -> None:
    """3 N.m accelerate 2 kg.m2: after 1 s 4.5 W, with 5 W stored and 7 W lost in the source."""
    flow = pt.power_flow(pt.simulate(Heated(), 2.0), at=1.0)
    assert float(flow.input) == pytest.approx(4.5 + 5.0 + 7.0)
    assert abs(flow.imbalance).max() < 1e-9


def test_samples_are_those_of_the_run() -> None:
    """With both limits of a jump."""
    result = pt.simulate(Chain(), stop=1.0, inputs={"drive": ([0.0, 0.4, 0.4, 1.0], [40.0, 40.0, 80.0, 80.0])})
    flow = pt.power_flow(result)
    np.testing.assert_array_equal(flow.data.time, result.time)
    np.testing.assert_allclose(flow.data.torque.sel(port="first.flange_a"), result["first.flange_a.tau"], atol=1e-9)


def test_what_does_not_fit_together_is_refused() -> None:
    plant = pt.compile(Chain())
    result = plant.simulate(1.0)
    with pytest.raises(pt.ParameterError, match="a grid is for a plant"):
        pt.power_flow(result, free=["first.w"])
    with pytest.raises(pt.ParameterError, match=r"at=... is for a result"):
        pt.power_flow(plant, {"drive": 40.0}, at=1.0)
    with pytest.raises(pt.ParameterError, match="belong together"):
        pt.power_flow(result, variator="mesh")
    with pytest.raises(pt.ParameterError, match="belong together"):
        pt.power_flow(result, shafts=("mesh.a", "mesh.b"))


def test_dataset_of_steady(example: pt.PowerFlow) -> None:
    plant = pt.compile(Rig())
    grid: dict[str, Any] = {"V": [ratio("bHa", -0.13), 0.3], "load": 100.0}
    outputs = pt.power_outputs(plant) | {"r": "r"}
    points = pt.steady(plant, grid, outputs=outputs)
    flow = pt.power_flow(plant, points)
    np.testing.assert_allclose(flow.isel(V=0).power, example.power)
    assert float(pt.power_flow(plant, points.isel(V=0)).circulating) == pytest.approx(float(example.circulating))
    assert float(flow.data["r"][0]) == pytest.approx(-0.13)
    with pytest.raises(pt.ParameterError, match="power_outputs"):
        pt.power_flow(plant, pt.steady(plant, grid, outputs=["r"]))


class Chain(pt.Component):
    """A torque that drives an inertia through a lossy pair of wheels against a load."""

    first: Inertia = Inertia(J=0.5)
    second: Inertia = Inertia(J=2.0)
    mesh: Mesh = Mesh(ratio=-2, eta_ab=0.96, eta_ba=0.96)
    housing: Fixed = Fixed()
    motor: Torque = Torque()
    brake: Torque = Torque()
    rise: Ramp = Ramp(height=80, duration=1, startTime=0.5)
    drive: pt.Input = pt.signal_input("N.m", "Torque of the motor", default=40.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.motor.flange, self.first.flange_a)
        yield pt.connect(self.first.flange_b, self.mesh.a)
        yield pt.connect(self.mesh.b, self.second.flange_a)
        yield pt.connect(self.mesh.carrier, self.housing.flange)
        yield pt.connect(self.second.flange_b, self.brake.flange)
        yield pt.connect(self.drive, self.motor.tau)
        yield pt.connect(self.rise.y, self.brake.tau)


def test_chain_along_a_simulation() -> None:
    result = pt.simulate(Chain(), stop=1.0, inputs={"drive": 40.0})
    flow = pt.power_flow(result)
    assert flow.power.dims == ("port", "time")
    assert (flow.circulating == 0).all()
    assert np.abs(flow.imbalance).max() < 1e-9 * np.abs(flow.power).max()
    closing = flow.input - flow.output - flow.data.loss.sum("component") - flow.data.stored.sum("component")
    assert np.abs(closing).max() < 1e-9 * np.abs(flow.power).max()
    np.testing.assert_allclose(flow.power.sel(port="first.flange_b"), -flow.power.sel(port="mesh.a"), atol=1e-9)
    audit = pt.energy_audit(result)
    np.testing.assert_allclose(flow.power.sel(port="mesh.a"), audit.power["mesh.a"], atol=1e-9)
    point = pt.power_flow(result, at=0.4)
    assert point.loops == []
    assert [way.end for way in point.paths].count("stored") == 2
    assert sum(way.power for way in point.paths) == pytest.approx(float(point.input))
    several = pt.power_flow(result, at=[0.2, 0.4], outputs={"speed of first": "first.w"})
    assert several.data["speed of first"].shape == (2,)
    assert float(several.isel(time=1).input) == pytest.approx(float(point.input))
    cases = flow.variator("mesh")["case"].sel(time=slice(0.51, None))
    assert (cases == "series").all()
    with pytest.raises(pt.ParameterError, match="outside the simulated span"):
        pt.power_flow(result, at=2.0)


def test_what_accelerates_at_a_point_is_stored() -> None:
    """40 N.m at 2 times 10 rad/s are 800 W, as at the start of a run from there; what the mesh does not lose accelerates both wheels."""
    flow = pt.power_flow(Chain(), {"second.w": [-10.0], "drive": 40.0}).isel(w=0)
    moving = pt.power_flow(pt.simulate(Chain(), 0.1, inputs={"drive": 40.0}, starts={"second.w": -10.0}), at=0.0)
    assert float(flow.input) == pytest.approx(800.0)
    assert float(flow.output) == 0.0
    lost = 0.04 * float(flow.power.sel(port="mesh.a"))
    assert float(flow.data.loss.sum()) == pytest.approx(lost)
    assert float(flow.data.stored.sum()) == pytest.approx(800.0 - lost)
    for name in ("stored", "supplied", "loss"):
        np.testing.assert_allclose(flow.data[name], moving.data[name], atol=1e-9)


class FourSquare(pt.Component):
    """Two shafts joined by gears at both ends and braced against each other: power circulates, the drive makes up for losses."""

    brace: pt.Input = pt.signal_input("N.m", "Torque in the loop")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    bracing: Torque2 = Torque2()
    left: Mesh = Mesh(ratio=-2, eta_ab=0.97, eta_ba=0.97)
    right: Mesh = Mesh(ratio=-2, eta_ab=0.97, eta_ba=0.97)
    housing: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.left.a, self.bracing.flange_a)
        yield pt.connect(self.bracing.flange_b, self.right.a)
        yield pt.connect(self.left.b, self.right.b)
        yield pt.connect(self.left.carrier, self.right.carrier, self.housing.flange)
        yield pt.connect(self.brace, self.bracing.tau)


@pytest.mark.parametrize("torque", [50.0, -50.0])
def test_known_loop(torque: float) -> None:
    plant = pt.compile(FourSquare())
    perfect = {f"{m}.{eta}": 1.0 for m in ("left", "right") for eta in ("eta_ab", "eta_ba")}
    lossless = pt.power_flow(plant, {"brace": torque}, parameters=perfect)
    assert float(lossless.circulating) == pytest.approx(5000.0)
    assert float(lossless.input) == pytest.approx(0.0, abs=1e-9)
    (loop,) = lossless.loops
    assert loop.power == pytest.approx(5000.0)
    flow = pt.power_flow(plant, {"brace": torque})
    assert float(flow.input) == pytest.approx(float(flow.data.loss.sum()))
    (loop,) = flow.loops
    # The least power in the loop is what comes out of the second gear.
    least = 5000 * 0.97**2 if torque > 0 else 5000.0
    assert loop.power == pytest.approx(least)
    assert set(loop.through) == {"left", "right", "bracing", "drive.flange"}
    after = loop.through[(loop.through.index("left") + 1) % 4]
    assert after == ("right" if float(flow.power.sel(port="left.a")) > 0 else "drive.flange")


class TwoVariators(pt.Component):
    """A differential whose two outputs go through variators to one shaft: no reading of a single transmission fits."""

    boundary: ClassVar[bool] = False
    first: pt.Input = pt.signal_input("1", "Ratio", default=0.7)
    load: pt.Input = pt.signal_input("N.m", "Torque", default=-100.0)
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    mesh: FundamentalDifferential = FundamentalDifferential(ratio=-1.7, eta_ab=0.98, eta_ba=0.98)
    cvu: CVU = CVU(eta_ab=0.95, eta_ba=0.95)
    gear: IdealGear = IdealGear(ratio=1.5)
    output: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.mesh.carrier)
        yield pt.connect(self.mesh.a, self.cvu.flange_a)
        yield pt.connect(self.mesh.b, self.gear.flange_a)
        yield pt.connect(self.cvu.flange_b, self.gear.flange_b, self.output.flange)
        yield pt.connect(self.first, self.cvu.ratio)
        yield pt.connect(self.load, self.output.tau)


@pytest.mark.parametrize("V", [0.7, -0.2, -0.9])
def test_another_topology(V: float) -> None:
    shafts = ("drive.flange", "output.flange")
    plant = pt.compile(TwoVariators())
    load = -100.0
    flow = pt.power_flow(plant, {"first": V, "load": load}, variator="cvu", shafts=shafts)
    share = flow.variator("cvu")
    perfect = {f"{m}.{eta}": 1.0 for m in ("mesh", "cvu") for eta in ("eta_ab", "eta_ba")}
    lossless = pt.power_flow(plant, {"first": V, "load": load}, parameters=perfect, variator="cvu", shafts=shafts)
    assert abs(float(share["K_o"])) == pytest.approx(abs(float(lossless.variator("cvu").K)), rel=1e-9)
    assert np.abs(flow.imbalance).max() < 1e-9
    if share["case"].item() == "split":
        assert float(flow.circulating) == 0
    else:
        assert float(flow.circulating) > 0


class CompoundSplit(pt.Component):
    """Two planetary gears joined crosswise, machines at both suns, drag on the output."""

    V: pt.Input = pt.signal_input("1", "Speed of the second sun over that of the first", default=0.3)
    engine: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    first: PlanetaryGear = PlanetaryGear(ratio=2.6)
    second: PlanetaryGear = PlanetaryGear(ratio=1.8)
    machines: CVU = CVU()
    drag: Damper = Damper(d=1.0)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.flange, self.first.carrier, self.second.ring)
        yield pt.connect(self.first.ring, self.second.carrier, self.drag.flange_a)
        yield pt.connect(self.first.sun, self.machines.flange_a)
        yield pt.connect(self.second.sun, self.machines.flange_b)
        yield pt.connect(self.drag.flange_b, self.ground.flange)
        yield pt.connect(self.V, self.machines.ratio)


def test_compound_split() -> None:
    """The share by differentiation is that of the torques; where drag is the load, powers of parts take the place of the output."""
    V = np.array([-1.5, -0.2, 0.3, 0.8, 1.5])
    flow = pt.power_flow(
        CompoundSplit(), {"V": V}, variator="machines", ratio="V", shafts=("engine.flange", "drag.flange_a")
    )
    share = flow.variator("machines", source="engine")
    np.testing.assert_allclose(share["K"], share["K_o"], rtol=1e-9)
    np.testing.assert_allclose(flow.into("drag") / flow.out_of("engine"), 1.0, rtol=1e-9)
    assert share["case"].values.tolist() == ["negative recirculation"] * 2 + ["split"] * 3
    assert (flow.output == 0).all()
    back = -float(flow.power.sel(port="first.mesh.carrier")[1])
    assert float(flow.circulating[1]) == pytest.approx(back)
    loops = flow.isel(V=1).loops
    assert [set(way.through) for way in loops] == [
        {"machines", "first.mesh", "first.carrier", "second.mesh"},
        {"first.carrier", "second.mesh", "first.ring", "first.mesh"},
    ]
    assert loops[0].power == pytest.approx(float(share["power"][1]))


class Unround(TwoFlanges):
    """Wheels whose ratio z follows from V by z + 0.2 z^3 = V."""

    V: pt.Input = pt.signal_input("1", "Setting")
    z: pt.Variable = pt.variable("1", "Ratio", guess=1.0)

    def equations(self) -> pt.Equations:
        yield self.z + 0.2 * self.z**3 == self.V.value
        yield pt.der(self.flange_b.phi) == self.z * pt.der(self.flange_a.phi)
        yield self.flange_a.tau + self.z * self.flange_b.tau == 0


class Geared(pt.Component):
    """Unround wheels between a drive and a load."""

    V: pt.Input = pt.signal_input("1", "Setting")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    wheels: Unround = Unround()
    drag: Damper = Damper(d=1.0)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.wheels.flange_a)
        yield pt.connect(self.wheels.flange_b, self.drag.flange_a)
        yield pt.connect(self.drag.flange_b, self.ground.flange)
        yield pt.connect(self.V, self.wheels.V)


def test_share_where_the_ratio_is_implicit() -> None:
    """d ln z/d ln V = V/(z (1 + 0.6 z^2))."""
    shafts = ("drive.flange", "wheels.flange_b")
    flow = pt.power_flow(Geared(), {"V": [0.7, 1.9]}, variator="wheels", ratio="V", shafts=shafts)
    z = np.array([np.roots([0.2, 0.0, 1.0, -V])[2].real for V in (0.7, 1.9)])
    exact = (z + 0.2 * z**3) / (z * (1 + 0.6 * z**2))
    np.testing.assert_allclose(flow.variator("wheels")["share"], exact, rtol=1e-9)


class Tractor(pt.Component):
    """A planetary gear whose sun a variable unit turns from the engine; the ring drives."""

    V: pt.Input = pt.signal_input("1", "Ratio of the unit")
    unit: VariableUnit
    drive: ConstantSpeed = ConstantSpeed(w_fixed=180.0)
    gears: PlanetaryGear = PlanetaryGear(ratio=2.31)
    gear: IdealGear = IdealGear(ratio=-1.7)
    rotor: Inertia = Inertia(J=0.1)
    drag: Damper = Damper(d=1.0)
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.V, self.unit.ratio)
        yield pt.connect(self.drive.flange, self.gears.carrier, self.unit.flange_a)
        yield pt.connect(self.unit.flange_b, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.gears.sun, self.rotor.flange_a)
        yield pt.connect(self.gears.ring, self.drag.flange_a)
        yield pt.connect(self.drag.flange_b, self.ground.flange)


def test_a_unit_that_slips_has_no_kinematic_share() -> None:
    """Its ratio does not set the speeds, so that their derivative would be zero; a rigid unit has V/tau d tau/d V."""
    V, shafts = np.array([0.35, 1.15]), ("drive.flange", "gears.ring")
    rigid = pt.power_flow(Tractor(unit=CVU()), {"V": V}, variator="unit", shafts=shafts).variator("unit")
    tau = (1 + 2.31 + V / 1.7) / 2.31
    np.testing.assert_allclose(rigid["share"], V / (1.7 * 2.31 * tau), rtol=1e-9)
    for unit in (HydrostaticUnit(leakage=1e-14), TractionDrive(creep_max=1e-7)):
        found = pt.power_flow(Tractor(unit=unit), {"V": V}, variator="unit", shafts=shafts).variator("unit")
        assert "share" not in found
        assert "K_o" not in found
        np.testing.assert_allclose(found["K"], rigid["K_o"], rtol=2e-2)


def test_wrong_names_are_refused(example: pt.PowerFlow) -> None:
    with pytest.raises(pt.ParameterError, match=r"no component gearbox\.cvv.*gearbox\.cvu"):
        example.variator("gearbox.cvv")
    with pytest.raises(pt.ParameterError, match="no component matches"):
        pt.power_flow(Rig(), {"V": 0.5, "load": 1.0}, whole="engine*")
    with pytest.raises(pt.ParameterError, match="no port"):
        pt.power_flow(Rig(), {"V": 0.5, "load": 1.0}, variator=CVU_PATH, shafts=("drive.flang", "output.flange"))
    with pytest.raises(pt.ParameterError, match="needs a grid"):
        pt.power_flow(Rig())
    with pytest.raises(pt.ParameterError, match="belong together"):
        pt.power_flow(Rig(), {"V": 0.5, "load": 1.0}, variator=CVU_PATH)
    flow = over_ratio("bHa", np.array([0.5, 1.5]))
    with pytest.raises(pt.ParameterError, match="single point"):
        flow.loops  # noqa: B018
    with pytest.raises(pt.ParameterError, match="a grid is for a plant"):
        pt.power_flow(pt.simulate(Chain(), stop=0.1), {"drive": 1.0})


@pytest.mark.parametrize("seed", few([2, 5, 7, 11, 13, 19], 2))
def test_random_drivelines(seed: int) -> None:
    """In any topology powers meet at nodes, components balance, paths and loops account for all of the power."""
    rng = random.Random(seed)
    model = driveline(lambda several: rng.choice(list(several)), rng.randint(3, 12), careless=False)
    try:
        result = pt.simulate(model, stop=0.4, points=10)
    except pt.PowertrainError:
        pytest.skip("this one cannot be simulated")
    flow = pt.power_flow(result)
    largest = max(float(np.abs(flow.power).max()), ROUND_OFF)
    assert np.abs(flow.imbalance).max() <= 1e-7 * largest
    for i in range(flow.data.sizes["time"]):
        point = flow.isel(time=i)
        meeting = dict.fromkeys(flow.graph.nodes, 0.0)
        for terminal in flow.graph.terminals:
            meeting[flow.graph.nodes[terminal.node]] += float(point.power.sel(port=terminal.port))
        assert max(map(abs, meeting.values()), default=0.0) <= 1e-7 * largest
        assert sum(way.power for way in point.loops) == pytest.approx(float(point.circulating), abs=1e-7 * largest)
        released = np.maximum(-point.data.stored, 0.0).sum()
        assert sum(way.power for way in point.paths) == pytest.approx(float(point.input + released), abs=1e-6 * largest)


def test_two_cycles_with_a_common_vertex() -> None:
    edges = [(0, 1), (1, 0), (1, 2), (2, 1)]
    assert loops(edges, 3) is None
    assert loops(edges[:2], 3) == [[0, 1]]
    assert loops([(0, 1), (1, 2)], 3) == []
    cycles, paths = decompose(edges, np.array([2.0, 2.0, 5.0, 5.0]), set(), set(), 0.0)
    assert [(c.flow, set(c.edges)) for c in cycles] == [(5.0, {2, 3}), (2.0, {0, 1})]
    assert not paths


@settings(max_examples=100, deadline=None)
@given(data=st.data())
def test_decomposition_adds_up(data: st.DataObject) -> None:
    """Random cycles and paths on 8 vertices (0 the source, 7 the sink): strands are cycles and paths, and add up to the flow."""
    flow: dict[Edge, float] = {}
    inner = st.lists(st.integers(1, 6), min_size=2, max_size=6, unique=True)
    for closed in data.draw(st.lists(st.booleans(), min_size=1, max_size=6)):
        way = data.draw(inner)
        amount = data.draw(st.floats(0.1, 10))
        vertices = [*way, way[0]] if closed else [0, *way, 7]
        for edge in pairwise(vertices):
            flow[edge] = flow.get(edge, 0.0) + amount
    edges, values = list(flow), np.array(list(flow.values()))
    floor = 1e-9 * values.max()
    cycles, paths = decompose(edges, values, {0}, {7}, floor)
    total = np.zeros(len(edges))
    for strand, closed in [(c, True) for c in cycles] + [(p, False) for p in paths]:
        total[list(strand.edges)] += strand.flow
        places = [edges[k] for k in strand.edges]
        assert all(a[1] == b[0] for a, b in pairwise(places))
        assert (places[0][0], places[-1][1]) == ((places[0][0],) * 2 if closed else (0, 7))
    np.testing.assert_allclose(total, values, atol=10 * floor)


def test_diagram_and_lever(example: pt.PowerFlow) -> None:
    ax = example.plot()
    texts = " ".join(t.get_text() for t in ax.texts)
    assert "16.22 kW" in texts
    assert "1.62 kW" in texts
    assert "circulating power" in texts
    lever = plot_lever(example, MESH_PATH)
    assert "-1.7" in lever.get_title()
    assert any("178.9 N·m" in t.get_text() for t in lever.texts)
    x, w = next(
        (np.asarray(line.get_xdata()), np.asarray(line.get_ydata()))
        for line in lever.lines
        if line.get_linewidth() == 4
    )
    assert np.interp(0.0, x, w) == pytest.approx(58.148, abs=1e-3)
    with pytest.raises(pt.ParameterError, match="needs a component with the ports"):
        plot_lever(example, CVU_PATH)


def test_plots_over_ratio_and_map() -> None:
    r = np.linspace(-1.5, 2.5, 41)
    flow = over_ratio("abH", r[np.abs(r) > 1e-9])
    ax = plot_variator(flow, CVU_PATH, "r")
    assert ax.get_ylim() == (-5, 5)
    with pytest.raises(pt.ParameterError, match="one dimension"):
        plot_variator(flow.isel(V=0), CVU_PATH, "r")
    grid = {"V": np.linspace(0.1, 0.9, 9), f"{MESH_PATH}.ratio": np.linspace(-3, -1.2, 7), "load": -100.0}
    several = pt.power_flow(Rig(gearbox=SplitPathTransmission(layout="abH")), grid)
    ax = plot_efficiency_map(several, "V", "ratio", variator=CVU_PATH)
    assert ax.get_xlabel()
    backwards = plot_efficiency_map(several.isel(V=slice(None, None, -1)), "V", "ratio", variator=CVU_PATH)
    for drawn, other in zip(ax.collections, backwards.collections, strict=True):
        same = [
            np.array_equal(one.vertices, two.vertices)
            for one, two in zip(drawn.get_paths(), other.get_paths(), strict=True)
        ]
        assert all(same)
    with pytest.raises(pt.ParameterError, match="two values of V and of ratio"):
        plot_efficiency_map(several.isel(V=[0]), "V", "ratio")
    with pytest.raises(pt.ParameterError, match="two dimensions"):
        plot_efficiency_map(flow, "V", "ratio")


@pytest.mark.parametrize(("eta", "step"), [(1.0, 0.05), (0.95, 0.35)])
def test_every_efficiency_has_a_colour(eta: float, step: float) -> None:
    """Also 1 and what round-off adds to it, and what is above the last whole step."""
    r, load = np.linspace(1.1, 1.5, 9), np.linspace(-50.0, -10.0, 9)
    efficiencies = {f"{part}.{name}": eta for part in (CVU_PATH, MESH_PATH) for name in ("eta_ab", "eta_ba")}
    plant = pt.compile(Rig(gearbox=SplitPathTransmission(layout="bHa")))
    flow = pt.power_flow(plant, {"V": ratio("bHa", r), "load": load}, parameters=efficiencies)
    assert float(flow.efficiency.min()) > 2 * 0.35
    ax = plot_efficiency_map(flow, "V", "load", step=step)
    paths, x = ax.collections[0].get_paths(), ratio("bHa", np.array([1.12, 1.23, 1.34, 1.47]))
    assert all(any(path.contains_point((V, tau)) for path in paths) for V in x for tau in (-48.0, -31.0, -12.0))


def test_plots_refuse_what_they_cannot_show(example: pt.PowerFlow) -> None:
    plant = pt.compile(Rig())
    line = pt.power_flow(plant, {"V": [0.3, 0.4], "load": 100.0})
    several = pt.power_flow(plant, {"V": [0.3, 0.4], "load": [50.0, 100.0]})
    idle = pt.power_flow(plant, {"V": [0.3, 0.4], "load": 0.0})
    refused: list[tuple[str, Any]] = [
        (r"step = 0: contours .* 0\.001 to 0\.5 apart", lambda: plot_efficiency_map(several, "V", "load", step=0)),
        (r"step = 0\.7: contours", lambda: plot_efficiency_map(several, "V", "load", step=0.7)),
        ("largest = -1 must be positive", lambda: plot_variator(line, CVU_PATH, "V", largest=-1.0)),
        ("power is not one value for each point", lambda: plot_variator(line, CVU_PATH, "power")),
        ("no point has an efficiency", lambda: plot_variator(idle, CVU_PATH, "V")),
        ("component = None is not a string", lambda: plot_variator(line, None, "V")),  # type: ignore[arg-type]
        ("give the names of three ports", lambda: plot_lever(example, MESH_PATH, ("a", "b"))),  # type: ignore[arg-type]
        ("ratio = nan is not a finite number", lambda: plot_lever(example, MESH_PATH, ratio=np.nan)),
        ("ax = 'left' is not an Axes", lambda: plot_lever(example, MESH_PATH, ax="left")),  # type: ignore[arg-type]
        (r"names = \['cvu'\]: pass a dictionary", lambda: example.plot(names=["cvu"])),
    ]
    for message, draw in refused:
        with pytest.raises(pt.ParameterError, match=message):
            draw()
    unknown = example.data.assign(speed=example.data.speed * np.nan)
    with pytest.raises(pt.ParameterError, match=r"speeds and torques of gearbox\.differential are not known"):
        plot_lever(pt.PowerFlow(example.graph, unknown), MESH_PATH)


def test_cases_are_shaded_half_way_to_the_next_point() -> None:
    ax = plt.figure().add_subplot()
    _shade(ax, np.array([0.0, 1.0, 3.0, 4.0]), np.array(["split", "split", "series", ""]))
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in ax.patches if isinstance(patch, Rectangle)]
    assert spans == [(0.0, 2.0), (2.0, 3.5)]


def test_a_known_end_of_an_interval_is_a_place_on_the_axis(example: pt.PowerFlow) -> None:
    """Where friction rests, an output has two ends instead of a value; equal ones are a value, others are none."""
    points = example.data.expand_dims(k=3)
    r, low, high = [1.0, np.nan, np.nan], [np.nan, 2.0, 2.0], [np.nan, 2.0, 3.0]
    data = points.assign(r=("k", r), r_low=("k", low), r_high=("k", high))
    np.testing.assert_array_equal(_along(pt.PowerFlow(example.graph, data), "r"), [1.0, 2.0, np.nan])


def test_no_line_joins_the_two_sides_of_a_pole() -> None:
    """Values beyond one and a half times the limit are left out, and so is the first one of the other sign; a change of sign is no pole."""
    values = np.array([1.0, 4.0, 9.0, -4.0, -1.0, 1.0, 4.0, -4.0])
    np.testing.assert_array_equal(_cut(values, 5.0), [1.0, 4.0, np.nan, np.nan, -1.0, 1.0, 4.0, np.nan])


def test_contours_pass_a_line_of_points_at_rest() -> None:
    """At r = 1 the mesh rests, and the efficiency is an interval; the map shows what is around it, and the points as dots."""
    bench = SplitPathBench(transmission=SplitPathTransmission(layout="Hba"))
    r, load = np.linspace(0.6, 1.4, 5), np.linspace(-50.0, -10.0, 3)
    ax = plot_efficiency_map(pt.power_flow(bench, {"r": r, "load": load}), "r", "load")
    paths = ax.collections[0].get_paths()
    assert all(any(path.contains_point((place, -25.0)) for path in paths) for place in (0.7, 0.9, 0.99, 1.1, 1.3))
    x, y = (np.asarray(values, float) for values in ax.lines[0].get_data())
    np.testing.assert_allclose(x, 1.0)
    np.testing.assert_allclose(y, load)


class Lossless(pt.Component):
    """A motor drives a load through a gear."""

    w: pt.Input = pt.signal_input("rad/s", "Speed")
    motor: Speed = Speed(exact=True)
    gear: IdealGear = IdealGear(ratio=2.0)
    load: ConstantTorque = ConstantTorque(tau_constant=-3.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.w, self.motor.w_ref)
        yield pt.connect(self.motor.flange, self.gear.flange_a)
        yield pt.connect(self.gear.flange_b, self.load.flange)


def test_a_point_without_a_solution_has_no_loss_where_nothing_is_ever_lost() -> None:
    plant = pt.compile(Lossless())
    points = pt.steady(plant, {"w": [4.0, 8.0]}, outputs=pt.power_outputs(plant))
    for name in points.data_vars:
        if str(name).startswith("power("):
            points[name][1] = np.nan
    flow = pt.power_flow(plant, points)
    np.testing.assert_allclose(flow.input, [6.0, np.nan])
    assert (flow.data.loss.isel(w=0) == 0.0).all()
    assert np.isnan(flow.data.loss.isel(w=1)).all()
