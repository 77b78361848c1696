"""Random connected drivelines, and the energy balance of their runs."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Constant, Ramp, Sine, Step
from powertrain.language.recorder import reading
from powertrain.signals import signals_of

Pick = Callable[[Sequence[Any]], Any]
"""Chooses one of several."""
Flange = tuple[int, str]


class Driveline(pt.Component):
    """Parts joined at nodes; a node lists (index of the part, name of its flange). ``wires``: (signal, part, input)."""

    parts: tuple[pt.Component, ...]
    nodes: tuple[tuple[Flange, ...], ...]
    signals: tuple[pt.Component, ...] = ()
    wires: tuple[tuple[int, int, str], ...] = ()

    def equations(self) -> pt.Equations:
        for node in self.nodes:
            if len(node) > 1:
                yield pt.connect(*(getattr(self.parts[i], name) for i, name in node))
        for signal, part, name in self.wires:
            yield pt.connect(getattr(self.signals[signal], "y"), getattr(self.parts[part], name))  # noqa: B009


@dataclass
class Builder:
    """A driveline that grows part by part."""

    pick: Pick
    parts: list[pt.Component] = field(default_factory=list)
    nodes: list[list[Flange]] = field(default_factory=list)
    signals: list[pt.Component] = field(default_factory=list)
    wires: list[tuple[int, int, str]] = field(default_factory=list)

    def add(self, part: pt.Component, ports: Sequence[str], loops: bool) -> None:
        """Joins the first port to a node that is there, and every other one to a new node, or closes a loop with it."""
        index = len(self.parts)
        self.parts.append(part)
        for k, name in enumerate(ports):
            if self.nodes and (k == 0 or (loops and self.pick((0, 0, 0, 1)))):
                self.pick(self.nodes).append((index, name))
            else:
                self.nodes.append([(index, name)])

    def drive(self, name: str, height: float, positive: bool) -> None:
        """Wires a signal to an input of the part added last."""
        shift = height if positive else 0.0
        kinds = [
            Constant(k=height),
            Step(height=height, startTime=self.pick((0.2, 0.5))),
            Sine(amplitude=height, f=self.pick((0.7, 2.0)), offset=shift),
            Ramp(height=height, duration=self.pick((0.3, 1.0)), startTime=0.1),
        ]
        self.wires.append((len(self.signals), len(self.parts) - 1, name))
        self.signals.append(self.pick(kinds))

    def model(self) -> Driveline:
        return Driveline(
            parts=tuple(self.parts),
            nodes=tuple(tuple(node) for node in self.nodes),
            signals=tuple(self.signals),
            wires=tuple(self.wires),
        )


TWO = ("flange_a", "flange_b")
HELD = ("flange_a", "flange_b", "support")
RATIOS = (1.0, 2.0, -1.5, 0.4)
LOSSES = (((0.0, 0.9, 0.8, 0.5, 1.0),), ((0.0, 0.9, 0.9, 0.1, 0.2), (20.0, 0.8, 0.7, 0.5, 1.0)))
BEARINGS = (((0.0, 1.0),), ((0.0, 0.5), (10.0, 2.0)))
QUADRATIC = rot.QuadraticSpeedDependentTorque(tau_nominal=-5.0, w_nominal=10.0, TorqueDirection=False)

PARTS: dict[str, tuple[Callable[[Pick], pt.Component], tuple[str, ...]]] = {
    "inertia": (lambda pick: rot.Inertia(J=pick((1.0, 0.1, 3.0))), TWO),
    "heavy": (lambda pick: rot.Inertia(J=10.0), TWO),
    "disc": (lambda pick: rot.Disc(deltaPhi=0.5), TWO),
    "spring": (lambda pick: rot.Spring(c=pick((100.0, 3e3))), TWO),
    "damper": (lambda pick: rot.Damper(d=pick((1.0, 30.0))), TWO),
    "both": (lambda pick: rot.SpringDamper(c=pick((100.0, 3e3)), d=pick((0.3, 10.0))), TWO),
    "clutch": (lambda pick: rot.Clutch(fn_max=pick((10.0, 80.0)), peak=pick((1.0, 1.2))), TWO),
    "oneway": (lambda pick: rot.OneWayClutch(fn_max=10.0), TWO),
    "freewheel": (lambda pick: rot.Freewheel(), TWO),
    "brake": (lambda pick: rot.Brake(fn_max=pick((5.0, 60.0))), TWO),
    "carried brake": (lambda pick: rot.Brake(fn_max=pick((5.0, 60.0))), HELD),
    "bearing": (lambda pick: rot.BearingFriction(tau_pos=pick(BEARINGS), peak=pick((1.0, 1.3))), TWO),
    "gear": (lambda pick: rot.IdealGear(ratio=pick(RATIOS)), TWO),
    "carried gear": (lambda pick: rot.IdealGear(ratio=pick(RATIOS)), HELD),
    "lossy": (lambda pick: rot.Gear(ratio=pick(RATIOS), efficiency=pick((0.9, 0.6))), TWO),
    "table": (lambda pick: rot.LossyGear(ratio=pick(RATIOS), lossTable=pick(LOSSES)), TWO),
    "carried table": (lambda pick: rot.LossyGear(ratio=pick(RATIOS), lossTable=pick(LOSSES)), HELD),
    "planetary": (lambda pick: rot.IdealPlanetary(ratio=pick((2.0, 0.5))), ("sun", "carrier", "ring")),
    "arm": (lambda pick: rot.IdealPlanetary(ratio=pick((2.0, 0.5))), ("carrier", "ring", "sun")),
    "torque": (lambda pick: rot.Torque(), ("flange",)),
    "load": (lambda pick: QUADRATIC, ("flange",)),
    "speed": (lambda pick: rot.ConstantSpeed(w_fixed=pick((5.0, 0.0, -2.0))), ("flange",)),
    "motion": (lambda pick: rot.Speed(), ("flange",)),
    "exact motion": (lambda pick: rot.Speed(exact=True), ("flange",)),
    "fixed": (lambda pick: rot.Fixed(), ("flange",)),
}
KINDS = tuple(PARTS)
INPUTS: dict[type[pt.Component], tuple[str, tuple[float, ...], bool]] = {
    rot.Clutch: ("f_normalized", (1.0,), True),
    rot.OneWayClutch: ("f_normalized", (1.0,), True),
    rot.Brake: ("f_normalized", (1.0,), True),
    rot.Torque: ("tau", (10.0, -3.0), False),
    rot.Speed: ("w_ref", (3.0,), False),
}


def grow(builder: Builder, kind: str, loops: bool) -> None:
    """Adds one part of a kind with values out of a few, and a signal for its input."""
    make, ports = PARTS[kind]
    part = make(builder.pick)
    builder.add(part, ports, loops)
    if type(part) in INPUTS:
        name, heights, positive = INPUTS[type(part)]
        builder.drive(name, builder.pick(heights), positive)


SOFT = frozenset(("spring", "damper", "both", "clutch", "oneway", "freewheel"))
FORCED = frozenset(("speed", "motion", "exact motion", "fixed"))


def driveline(pick: Pick, size: int, careless: bool) -> Driveline:
    """A connected driveline of about ``size`` parts.

    ``careless``: whatever can be connected. Else there is an inertia on every node, rigid parts close no loops, and at most one motion is
    forced, so that most of these can be simulated.
    """
    builder = Builder(pick)
    builder.add(rot.Inertia(J=1.0), TWO, False)
    forced = 0
    for _ in range(size - 1):
        kind = pick(KINDS)
        if kind in FORCED and not careless:
            forced += 1
            kind = kind if forced == 1 and pick((0, 1)) else "torque"
        grow(builder, kind, loops=careless or kind in SOFT)
    for k, node in enumerate(list(builder.nodes)):
        heavy = any(isinstance(builder.parts[i], rot.Inertia) for i, _ in node)
        if not heavy and (not careless or pick((0, 1))):
            builder.parts.append(rot.Inertia(J=0.5))
            builder.nodes[k].append((len(builder.parts) - 1, "flange_a"))
    return builder.model()


@dataclass
class Balance:
    """Energy in joules over a run, and the largest gap in watts at any instant in any part, with what they are compared with."""

    gained: float
    supplied: float
    lost: float
    turnover: float
    gap: float
    power: float


def balance(result: pt.Result[Any]) -> Balance:
    """The energy balance of every part at Gauss points of every step, and of the whole over the run."""
    compiled, trajectory = result.compiled, result.trajectory
    energies, inflow, losses, gaps = _terms(compiled)
    signals = signals_of(compiled)
    total = [ca.sum1(ca.vertcat(0, *energies)), *inflow, *losses, *gaps]
    expressions = signals.resolve(total)
    p = np.array(list(result.parameters.values()))

    def values(times: Any) -> Any:
        samples = trajectory.at(times, with_events=False)
        return signals.evaluate(expressions, signals.corrected(samples, p), p)

    nodes, weights = np.polynomial.legendre.leggauss(5)
    sizes = np.diff([*trajectory.times, trajectory.end])
    rows = values((trajectory.times[:, None] + sizes[:, None] * (nodes + 1) / 2).ravel())
    assert np.isfinite(rows).all()
    weight = (sizes[:, None] * weights / 2).ravel()
    first, last = values([trajectory.start, trajectory.end])[:, 0]
    powers = rows[:, 1 : 1 + len(inflow) + len(losses)]
    work = weight @ powers
    return Balance(
        gained=float(last - first),
        supplied=float(work[: len(inflow)].sum()),
        lost=float(work[len(inflow) :].sum()),
        turnover=float((weight @ np.abs(powers)).sum() + np.abs(rows[:, 0]).max()),
        gap=float(np.abs(rows[:, 1 + powers.shape[1] :]).max(initial=0.0)),
        power=float(np.abs(powers).max(initial=0.0)),
    )


def _terms(compiled: Any) -> tuple[list[pt.Symbol], list[pt.Symbol], list[pt.Symbol], list[pt.Symbol]]:
    """Stored energies, powers of sources, losses, and for each part ports' powers - loss - d energy/dt, which is zero."""
    energies, inflow, losses, gaps = [], [], [], []
    with reading(compiled.source.recorder):
        for part in compiled.source.components:
            ports = [p for p in vars(part).values() if isinstance(p, rot.Flange)]
            if isinstance(part, pt.Connector) or not ports:
                continue
            power = sum((p.power() for p in ports), pt.Symbol(0))
            if part.boundary:
                inflow.append(-power)
                continue
            energy, loss = pt.Symbol(part.energy()), pt.Symbol(part.loss())
            energies.append(energy)
            losses.append(loss)
            gaps.append(power - loss - pt.der(energy))
    return energies, inflow, losses, gaps


def random_plant(seed: int) -> tuple[pt.Plant[Any], random.Random]:
    rng = random.Random(seed)

    def pick(several: Sequence[Any]) -> Any:
        return rng.choice(list(several))

    return pt.compile(driveline(pick, rng.randint(4, 10), False)), rng
