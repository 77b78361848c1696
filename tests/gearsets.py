"""Automatic gearsets as they are published: an eight-speed of four planetary gears and five elements, a Ravigneaux four-speed."""

from __future__ import annotations

from typing import Any

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.differentials import PlanetaryGear, RavigneauxGear

EIGHT = {
    "1": "ABC", "2": "ABE", "3": "BCE", "4": "BDE", "5": "BCD", "6": "CDE", "7": "ACD", "8": "ADE", "R": "ABD",
}  # fmt: skip
"""Elements that are engaged, by gear."""
RATIOS = {"1": 4.696, "2": 3.130, "3": 2.104, "4": 1.667, "5": 1.285, "6": 1.000, "7": 0.839, "8": 0.667, "R": -3.297}
"""Published ratios."""
TEETH = ((48, 96), (48, 96), (69, 111), (23, 85))
"""Sun and ring of each set."""
ONE = ((0.0, 1.0),)


def planetary(k: int, eta: float = 1.0) -> PlanetaryGear:
    sun, ring = TEETH[k]
    return PlanetaryGear(ratio=ring / sun, eta_ab=eta, eta_ba=eta)


class EightSpeed(pt.Component):
    """Brakes A (suns 1 and 2) and B (ring 1); clutches C (input to ring 3 and sun 4), D (carriers 3 and 4), E (sun 3 to ring 3).

    Shafts: turbine, suns 1 and 2, ring 1, carrier 1 and ring 4, ring 2 and sun 3, ring 3 and sun 4, carrier 3, output.
    """

    sets: tuple[PlanetaryGear, ...] = tuple(planetary(k) for k in range(4))
    A: rot.Brake = rot.Brake(fn_max=3000.0, mue_pos=ONE)
    B: rot.Brake = rot.Brake(fn_max=3000.0, mue_pos=ONE)
    C: rot.Clutch = rot.Clutch(fn_max=3000.0, mue_pos=ONE)
    D: rot.Clutch = rot.Clutch(fn_max=3000.0, mue_pos=ONE)
    E: rot.Clutch = rot.Clutch(fn_max=3000.0, mue_pos=ONE)
    turbine: rot.Inertia = rot.Inertia(J=0.05)
    suns: rot.Inertia = rot.Inertia(J=0.003)
    ring1: rot.Inertia = rot.Inertia(J=0.004)
    carrier1: rot.Inertia = rot.Inertia(J=0.008)
    ring2: rot.Inertia = rot.Inertia(J=0.006)
    ring3: rot.Inertia = rot.Inertia(J=0.005)
    carrier3: rot.Inertia = rot.Inertia(J=0.006)
    output: rot.Inertia = rot.Inertia(J=8.0)
    drive: rot.Torque = rot.Torque()
    load: Any = rot.QuadraticSpeedDependentTorque(tau_nominal=-300.0, w_nominal=200.0, TorqueDirection=False)
    pA: pt.Input = pt.signal_input("1", "Pressure of A over its largest")
    pB: pt.Input = pt.signal_input("1", "Pressure of B over its largest")
    pC: pt.Input = pt.signal_input("1", "Pressure of C over its largest")
    pD: pt.Input = pt.signal_input("1", "Pressure of D over its largest")
    pE: pt.Input = pt.signal_input("1", "Pressure of E over its largest")
    tau_in: pt.Input = pt.signal_input("N.m", "Torque at the turbine")

    def equations(self) -> pt.Equations:
        first, second, third, fourth = self.sets
        yield pt.connect(self.drive.flange, self.turbine.flange_a)
        yield pt.connect(self.turbine.flange_b, second.carrier, self.C.flange_a)
        yield pt.connect(self.suns.flange_a, first.sun, second.sun, self.A.flange_a)
        yield pt.connect(self.ring1.flange_a, first.ring, self.B.flange_a)
        yield pt.connect(self.carrier1.flange_a, first.carrier, fourth.ring)
        yield pt.connect(self.ring2.flange_a, second.ring, third.sun, self.E.flange_a)
        yield pt.connect(self.ring3.flange_a, third.ring, fourth.sun, self.E.flange_b, self.C.flange_b)
        yield pt.connect(self.carrier3.flange_a, third.carrier, self.D.flange_a)
        yield pt.connect(self.output.flange_a, fourth.carrier, self.D.flange_b)
        yield pt.connect(self.output.flange_b, self.load.flange)
        for name in "ABCDE":
            yield pt.connect(getattr(self, f"p{name}"), getattr(self, name).f_normalized)
        yield pt.connect(self.tau_in, self.drive.tau)


def eight_speed(eta: float = 1.0, load: Any = None) -> EightSpeed:
    sets = tuple(planetary(k, eta) for k in range(4))
    return EightSpeed(sets=sets) if load is None else EightSpeed(sets=sets, load=load)


def shifts(gears: str = "12345678", hold: float = 1.0, ramp: float = 0.2) -> dict[str, Any]:
    """Pressures over time: each gear held, each shift an overlap of two ramps."""
    inputs: dict[str, Any] = {}
    for element in "ABCDE":
        times, values = [0.0], [1.0 if element in EIGHT[gears[0]] else 0.0]
        for k, (old, new) in enumerate(zip(gears, gears[1:], strict=False), 1):
            before, after = (1.0 if element in EIGHT[gear] else 0.0 for gear in (old, new))
            if before != after:
                times += [k * hold, k * hold + ramp]
                values += [before, after]
        inputs[f"p{element}"] = (times, values)
    return inputs
