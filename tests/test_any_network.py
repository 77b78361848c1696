"""Random networks of any components of the library: they simulate, alike at a finer tolerance, or are refused with the names of parts."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from bounded import bounded
from catalogue import concrete, made, mechanical
from drivelines import Driveline, Flange

import powertrain as pt
from powertrain.components import rotational, translational
from powertrain.components.blocks import Constant, Pulse, Ramp, Sine, Trapezoid
from powertrain.components.electric import DCTerminal, VoltageSource
from powertrain.language.component import children
from powertrain.language.fields import Parameter, Port

STOP = 2.0
MOST_STEPS = 100_000
"""Signals have periods of 0.3 s and more; the fastest shafts of the library vibrate some thousand times in a run, with 20 steps each."""
NOTHING = 1e-30
"""Energy [J] that round-off alone exchanges."""
HEAVY = (rotational.Inertia, translational.Mass)
PARTS = [kind for kind in concrete() if mechanical(kind) and kind not in HEAVY]
FORCED = {"Speed", "Position", "Move", "Accelerate", "ConstantSpeed", "Fixed", "NetworkGears"}
FORCED |= {"AngleToTorqueAdaptor", "PositionToForceAdaptor", "TorqueToAngleAdaptor", "ForceToPositionAdaptor"}
"""Most networks with one of these are refused."""


def connectors(part: pt.Component) -> list[tuple[str, str]]:
    """Names and kinds of what can be connected: "signal", "shaft", "rod" or "bus"."""
    kinds = {rotational.Flange: "shaft", translational.Flange: "rod", DCTerminal: "bus"}
    found = []
    for name, port in children(part):
        spec = part._fields.get(name)
        if isinstance(port, pt.Input):
            found.append((name, "signal"))
        elif isinstance(spec, Port) and not spec.grounded:
            found += [(name, kind) for of, kind in kinds.items() if isinstance(port, of)]
    return found


def varied(rng: random.Random, kind: type[pt.Component]) -> pt.Component:
    """One of its kind, some of whose parameters are up to three times larger or smaller, or not zero where they are zero."""
    part = made(kind)
    names = [name for name, spec in kind._fields.items() if isinstance(spec, Parameter)]
    plain = {name: value for name in names if type(value := getattr(part, name)) in (int, float)}
    values = {
        name: value * 10 ** rng.uniform(-0.5, 0.5) if value else rng.choice((0.0, 0.01, 0.1))
        for name, value in plain.items()
        if rng.random() < 0.4
    }
    try:
        return pt.replace(part, values) if values else part
    except pt.PowertrainError:  # values that do not go together
        return part


def signal(rng: random.Random) -> pt.Component:
    """A command between about 0 and 1."""
    size = rng.uniform(0.2, 1.0)
    kinds: list[Callable[[], pt.Component]] = [
        lambda: Sine(
            amplitude=size, f=rng.uniform(0.3, 2.5), offset=rng.uniform(0.0, 0.8), phase=rng.uniform(0.0, 6.0)
        ),
        lambda: Pulse(
            amplitude=size, width=rng.uniform(10, 90), period=rng.uniform(0.3, 1.5), offset=rng.choice((0.0, 0.1))
        ),
        lambda: Constant(k=rng.choice((0.0, 0.3, 1.0))),
        lambda: Ramp(height=size, duration=rng.uniform(0.05, 1.0), startTime=rng.uniform(0.0, 0.8)),
        lambda: Trapezoid(amplitude=size, rising=0.1, width=0.2, falling=0.1, period=rng.uniform(0.6, 1.5)),
    ]
    return rng.choice(kinds)()


@dataclass
class Network:
    """Grows part by part: the first shaft and the first rod of a part join what is there, the others seldom close a loop."""

    rng: random.Random
    parts: list[pt.Component] = field(default_factory=list)
    shafts: list[list[Flange]] = field(default_factory=list)
    rods: list[list[Flange]] = field(default_factory=list)
    buses: list[list[Flange]] = field(default_factory=list)
    signals: list[pt.Component] = field(default_factory=list)
    wires: list[tuple[int, int, str]] = field(default_factory=list)

    def add(self, part: pt.Component) -> None:
        """Connect all connectors of a part."""
        index, first = len(self.parts), True
        self.parts.append(part)
        for name, kind in connectors(part):
            if kind == "signal":
                source = signal(self.rng)
                # gearboxes never pass on none of the power, which would divide by zero
                self.drive(index, name, Constant(k=1.0) if name.startswith("passed") else source)
            elif kind == "bus":
                self.parts.append(VoltageSource())
                self.buses.append([(index, name), (len(self.parts) - 1, "bus")])
            else:
                self.join(self.shafts if kind == "shaft" else self.rods, index, name, first)
                first = False

    def join(self, nodes: list[list[Flange]], index: int, name: str, first: bool) -> None:
        """Join a node that has nothing of this part yet, or a new one."""
        others = [node for node in nodes if all(i != index for i, _ in node)]
        if others and (first or self.rng.random() < 0.04):
            self.rng.choice(others).append((index, name))
        else:
            nodes.append([(index, name)])

    def drive(self, index: int, name: str, source: pt.Component) -> None:
        """Give an input its signal."""
        self.wires.append((len(self.signals), index, name))
        self.signals.append(source)

    def load(self, node: list[Flange], heavy: pt.Component, driving: pt.Component, name: str) -> None:
        """Most nodes have an inertia or mass, some a torque or force."""
        rng = self.rng
        if not any(isinstance(self.parts[i], HEAVY) for i, _ in node) and rng.random() < 0.8:
            self.parts.append(heavy)
            node.append((len(self.parts) - 1, "flange_a"))
        if rng.random() < 0.4:
            self.parts.append(driving)
            node.append((len(self.parts) - 1, "flange"))
            f, offset, phase = rng.uniform(0.2, 2.0), rng.uniform(-3.0, 3.0), rng.uniform(0.0, 6.0)
            self.drive(
                len(self.parts) - 1, name, Sine(amplitude=rng.uniform(-10.0, 10.0), f=f, offset=offset, phase=phase)
            )


def network(rng: random.Random) -> Driveline:
    """A model of an inertia, a mass, and one to five parts of any kind."""
    net = Network(rng)
    net.add(rotational.Inertia(J=10 ** rng.uniform(-1.0, 0.5)))
    net.add(translational.Mass(m=10 ** rng.uniform(-1.0, 1.0)))
    for _ in range(rng.randint(1, 5)):
        kind = rng.choice(PARTS)
        net.add(varied(rng, rng.choice(PARTS) if kind.__name__ in FORCED and rng.random() < 0.8 else kind))
    for node in net.shafts:
        net.load(node, rotational.Inertia(J=10 ** rng.uniform(-1.5, 0.5)), rotational.Torque(), "tau")
    for node in net.rods:
        net.load(node, translational.Mass(m=10 ** rng.uniform(-1.0, 1.0)), translational.Force(), "f")
    nodes = tuple(map(tuple, [*net.shafts, *net.rods, *net.buses]))
    return Driveline(parts=tuple(net.parts), nodes=nodes, signals=tuple(net.signals), wires=tuple(net.wires))


def states(result: pt.Result[Any], names: list[str]) -> Any:
    """All states a little after 40 instants, one row for each."""
    times = np.linspace(0.0, STOP, 41)[:-1] + 1e-7
    return np.array([result.at(times, name) for name in names]).reshape(len(names), -1)


def attempt(model: Driveline) -> tuple[pt.Plant[Any], pt.Result[Any]] | str:
    """The plant and its run, or the message that refuses it."""
    try:
        with bounded():
            plant = pt.compile(model)
            return plant, plant.simulate(STOP, rtol=1e-6, points=3)
    except pt.PowertrainError as error:
        return str(error)


def holds(model: Driveline) -> bool:
    """Whether it simulates, with the same numbers again and nearly the same at a finer tolerance; fails where it does neither."""
    found = attempt(model)
    if isinstance(found, str):
        assert "parts[" in found or "signals[" in found, f"names no component: {found}"
        return False
    plant, run = found
    assert run.statistics["steps"] < MOST_STEPS
    names = list(plant.compiled.states)
    with bounded():
        again = plant.simulate(STOP, rtol=1e-6, points=3)
        fine = plant.simulate(STOP, rtol=1e-8, points=3, max_step=0.004)
    audit = pt.energy_audit(fine)
    assert audit.closure < 1e-5 or audit.turnover < NOTHING
    values, reference = states(run, names), states(fine, names)
    size = np.abs(reference).max(axis=1, initial=0.0, keepdims=True)
    span = np.ptp(reference, axis=1, keepdims=True) + 1e-3 * (1.0 + size)
    assert (np.abs(values - states(again, names)) / span).max(initial=0.0) < 1e-9
    assert (np.abs(values - reference) / span).max(initial=0.0) < 0.03  # coils without a load ring for long
    return True


@pytest.mark.slow
@pytest.mark.parametrize("tens", range(10))
def test_any_network(tens: int) -> None:
    assert sum(holds(network(random.Random(10 * tens + k))) for k in range(10)) >= 3
