"""Nothing accelerates at an operating point, also where stuck laws meet on parts without inertia and share what acts there by creeping."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from cases import few
from drivelines import Driveline, Flange

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant
from powertrain.components.differentials import PlanetaryGear

OK = 0
CONSTANT = ((0.0, 1.0),)
BRAKE, CLUTCH, BEARING = 20.0, 15.0, 1.0


class BrakedHub(pt.Component):
    """A torque acts on a hub without inertia, which a brake holds, another one on a shaft behind a clutch."""

    first: pt.Input = pt.signal_input("N.m", "Torque on the hub")
    second: pt.Input = pt.signal_input("N.m", "Torque on the shaft")
    at_hub: rot.Torque = rot.Torque()
    at_shaft: rot.Torque = rot.Torque()
    brake: rot.Brake = rot.Brake(fn_max=BRAKE, mue_pos=CONSTANT)
    clutch: rot.Clutch = rot.Clutch(fn_max=CLUTCH, mue_pos=CONSTANT)
    shaft: rot.Inertia = rot.Inertia(J=1.0)
    bearing: rot.BearingFriction = rot.BearingFriction(tau_pos=((0.0, BEARING),))
    drag: rot.Damper = rot.Damper(d=0.1)
    more_drag: rot.Damper = rot.Damper(d=0.1)
    wall: rot.Fixed = rot.Fixed()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.first, self.at_hub.tau)
        yield pt.connect(self.second, self.at_shaft.tau)
        yield pt.connect(self.at_hub.flange, self.brake.flange_a, self.clutch.flange_a, self.drag.flange_a)
        yield pt.connect(self.clutch.flange_b, self.shaft.flange_a)
        yield pt.connect(self.shaft.flange_b, self.at_shaft.flange, self.bearing.flange_a, self.more_drag.flange_a)
        yield pt.connect(self.wall.flange, self.drag.flange_b, self.more_drag.flange_b)
        yield self.brake.f_normalized.value == 1.0
        yield self.clutch.f_normalized.value == 1.0


def test_laws_on_a_hub_without_inertia_carry_what_acts_there() -> None:
    """Bearing and clutch hold the torque on the shaft, the brake what the clutch passes on and the torque on the hub."""
    first, second = np.array([10.0, 0.0, -12.0]), np.array([8.0, -5.0, 14.0, 0.5])
    names = ["shaft.a", "shaft.w", "bearing.tau", "clutch.tau", "brake.tau"]
    found = pt.steady(BrakedHub(), {"first": first, "second": second}, outputs=names)
    bearing, clutch, brake = (found[f"{name}.tau"].values for name in ("bearing", "clutch", "brake"))
    rests = abs(found["shaft.w"].values) < 1e-5
    assert rests.sum() == rests.size - 1
    assert (found.status == OK).all()
    np.testing.assert_allclose(found["shaft.a"], 0.0, atol=1e-6)
    np.testing.assert_allclose((bearing + clutch)[rests], (0 * first[:, None] + second)[rests], atol=1e-5)
    np.testing.assert_allclose((brake - clutch)[rests], (first[:, None] + 0 * second)[rests], atol=1e-5)
    for torque, limit in ((bearing[rests], BEARING), (clutch, CLUTCH), (brake, BRAKE)):
        assert (abs(torque) < limit + 1e-6).all()
    np.testing.assert_allclose(brake[~rests], BRAKE, rtol=1e-9)


@dataclass
class Network:
    """A random network of shafts, each with a damper, most with a brake or a bearing, some without inertia."""

    rng: np.random.Generator
    parts: list[pt.Component] = field(default_factory=list)
    nodes: list[list[Flange]] = field(default_factory=list)
    signals: list[pt.Component] = field(default_factory=list)
    wires: list[tuple[int, int, str]] = field(default_factory=list)
    shafts: list[int] = field(default_factory=list)

    def uniform(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def add(self, part: pt.Component, signal: tuple[str, float] | None = None, **nodes: int) -> None:
        index = len(self.parts)
        self.parts.append(part)
        for name, node in nodes.items():
            self.nodes[node].append((index, name))
        if signal is not None:
            self.wires.append((len(self.signals), index, signal[0]))
            self.signals.append(Constant(k=signal[1]))

    def shaft(self) -> int:
        wall, node = len(self.nodes), len(self.nodes) + 1
        self.nodes += [[], []]
        self.add(rot.Damper(d=10 ** self.uniform(-2, 0)), flange_a=node, flange_b=wall)
        self.add(rot.Fixed(), flange=wall)
        if self.rng.random() < 0.5:
            self.add(rot.Inertia(J=self.uniform(0.05, 1)), flange_a=node)
        kind = self.rng.integers(0, 3)
        if kind == 1:
            grip = "f_normalized", float(self.rng.choice([0.5, 1.0]))
            self.add(rot.Brake(fn_max=self.uniform(1, 30), mue_pos=CONSTANT), grip, flange_a=node)
        if kind == 2:
            self.add(rot.BearingFriction(tau_pos=((0.0, self.uniform(0.2, 3)), (100.0, 8.0))), flange_a=node)
        self.shafts.append(node)
        return node

    def connection(self) -> None:
        rng, eta = self.rng, float(self.rng.choice([1.0, 0.97, 0.9, 0.6]))
        here = int(rng.choice(self.shafts))
        there = int(rng.choice(self.shafts)) if rng.random() < 0.25 else here
        there = self.shaft() if there == here else there
        kind = rng.integers(0, 4)
        if kind == 0:
            ratio = float(rng.choice([-1, 1])) * self.uniform(0.4, 3)
            self.add(rot.Gear(ratio=ratio, efficiency=eta), flange_a=here, flange_b=there)
        elif kind == 1:
            clutch = rot.Clutch(fn_max=self.uniform(2, 30), mue_pos=CONSTANT)
            self.add(clutch, ("f_normalized", float(rng.choice([0.5, 1.0]))), flange_a=here, flange_b=there)
        elif kind == 2:
            one_way = rot.OneWayClutch(fn_max=self.uniform(2, 30), mue_pos=CONSTANT)
            self.add(one_way, ("f_normalized", 1.0), flange_a=here, flange_b=there)
        else:
            gear = PlanetaryGear(ratio=self.uniform(1.5, 4), eta_ab=eta, eta_ba=eta)
            members = rng.permutation(["sun", "ring", "carrier"]).tolist()
            self.add(gear, None, **dict(zip(members, (here, there, self.shaft()), strict=True)))

    def model(self) -> Driveline:
        self.shaft()
        for _ in range(self.rng.integers(2, 6)):
            self.connection()
        for node in self.rng.permutation(self.shafts)[: self.rng.integers(1, 4)]:
            torque = float(self.rng.choice([-1, 1])) * self.uniform(0.5, 40)
            self.add(rot.Torque(), ("tau", torque), flange=int(node))
        nodes = tuple(tuple(node) for node in self.nodes)
        return Driveline(parts=tuple(self.parts), nodes=nodes, signals=tuple(self.signals), wires=tuple(self.wires))


@pytest.mark.parametrize("seed", few((42, 3, *range(100)), 2))
def test_nothing_accelerates(seed: int) -> None:
    model = Network(np.random.default_rng(seed)).model()
    inertias = [f"parts[{i}].a" for i, part in enumerate(model.parts) if isinstance(part, rot.Inertia)]
    try:
        found = pt.steady(model, {}, outputs=inertias)
    except pt.ModelError:
        return  # parts without inertia between meshes, or gears in a ring
    if found.status == OK:
        np.testing.assert_allclose([found[name] for name in inertias], 0.0, atol=1e-5)


def with_inertias(model: Driveline) -> Driveline:
    """The same network with an inertia on every shaft that turns."""
    parts, nodes = list(model.parts), [list(node) for node in model.nodes]
    for node in nodes:
        if not any(isinstance(parts[i], rot.Inertia | rot.Fixed) for i, _ in node):
            node.append((len(parts), "flange_a"))
            parts.append(rot.Inertia(J=0.2))
    return Driveline(parts=tuple(parts), nodes=tuple(map(tuple, nodes)), signals=model.signals, wires=model.wires)


@pytest.mark.parametrize("seed", [116, 137])
def test_laws_on_shafts_without_inertia_that_hold_each_other(seed: int) -> None:
    """Inertias change no operating point. With them on every shaft, no law needs to creep."""
    model = Network(np.random.default_rng(seed)).model()
    speeds = [f"parts[{i}].w" for i, part in enumerate(model.parts) if isinstance(part, rot.Inertia)]
    light, heavy = (pt.steady(each, {}, outputs=speeds) for each in (model, with_inertias(model)))
    assert light.status == heavy.status == OK
    for name in speeds:
        np.testing.assert_allclose(light[name], heavy[name], rtol=1e-6, atol=1e-6)
