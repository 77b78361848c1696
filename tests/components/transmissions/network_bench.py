"""A network's transmission on a bench, its operating points by the model; random networks."""

from __future__ import annotations

from typing import Any

import numpy as np

import powertrain as pt
from powertrain.components.cvu import CVU, VariableUnit
from powertrain.components.rotational import ConstantSpeed, Torque
from powertrain.components.transmissions import HOUSING, Lever, Network, NetworkTransmission

UNIT = "gear.cvu"


class NetworkBench(pt.Component):
    """Driven at a constant speed, loaded by a torque."""

    V: pt.Input = pt.signal_input("1", "Speed ratio of the unit")
    load: pt.Input = pt.signal_input("N.m", "Accelerating torque on the output")
    r: pt.Variable = pt.variable("1", "Output speed over input speed")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=100.0)
    gear: NetworkTransmission = NetworkTransmission()
    torque: Torque = Torque()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.drive.flange, self.gear.flange_a)
        yield pt.connect(self.torque.flange, self.gear.flange_b)
        yield pt.connect(self.V, self.gear.ratio)
        yield pt.connect(self.load, self.torque.tau)
        yield self.r * self.drive.w == pt.der(self.torque.phi)


def steady(network: Network, r: Any, torque: float, unit: VariableUnit | None = None) -> Any:
    """Torques of the bench at 100 rad/s: of the input, and of the unit's shafts."""
    model = NetworkBench(gear=NetworkTransmission.of(network, unit or CVU(eta_ab=0.85, eta_ba=0.8)))
    grid: dict[str, Any] = {"r": np.asarray(r, float), "load": -torque}
    return pt.steady(model, grid, outputs=["gear.flange_a.tau", f"{UNIT}.flange_a.tau", f"{UNIT}.flange_b.tau"])


def random_network(rng: np.random.Generator) -> Network:
    """Unit shafts on a lever with input and output, or in gear with one of them; auxiliary gears before, behind and beside the unit."""

    def eta() -> float:
        return float(rng.uniform(0.93, 0.995))

    def pair(name: str, a: str, b: str) -> Lever:
        return Lever(name, a, b, HOUSING, float(rng.choice([-1, 1]) * rng.uniform(0.5, 2.2)), eta())

    levers = [pair("before", "in", "first"), pair("behind", "last", "out")]
    kinds = ["first", "last", "summing"]
    chosen = rng.choice([0, 1, 2], size=2, replace=False, p=[0.3, 0.2, 0.5]).tolist()
    if 2 not in chosen:
        chosen[0] = 2
    for side, kind in zip("ab", chosen, strict=True):
        inner = f"inner {side}"
        if kinds[kind] == "summing":
            a, b, h = rng.permutation(["first", "last", inner]).tolist()
            levers.append(Lever(f"lever {side}", a, b, h, float(-rng.uniform(0.4, 3.5)), eta()))
        else:
            inner = kinds[kind]
        levers.append(pair(f"beside {side}", f"unit {side}", inner))
    return Network(tuple(levers), ("unit a", "unit b"))
