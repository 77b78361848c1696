"""Random machines of shafts and rods: wheels, differentials, play, stops, clutches, resets, heat, signals and controllers."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest
from bounded import bounded
from joined import Joined

import powertrain as pt
from powertrain.components import blocks, thermal, wheels
from powertrain.components import rotational as rot
from powertrain.components import translational as tr
from powertrain.components.differentials import BevelDifferential, LimitedSlipDifferential, PlanetaryGear
from powertrain.components.gearless.circular_cam import CircularCamDifferential

Pick = Callable[[Sequence[Any]], Any]
"""Chooses one of several."""


class Knocked(pt.Component):
    """A wheel dragged by the shaft around it, which loses a part of its speed whenever it has turned by another ``every``."""

    J: pt.Parameter = pt.parameter("kg.m2", "Moment of inertia", default=0.1)
    d: pt.Parameter = pt.parameter("N.m.s/rad", "Drag", default=1.0)
    every: pt.Parameter = pt.parameter("rad", "Angle from knock to knock", default=0.3)
    kept: pt.Parameter = pt.parameter("1", "Part of the speed that is left", default=0.6)
    flange: rot.Flange = pt.port(rot.Flange)
    phi: pt.Variable = pt.variable("rad", "Angle of the wheel", start=0.0, prefer=True)
    w: pt.Variable = pt.variable("rad/s", "Speed of the wheel", start=0.0, prefer=True)
    knocks: pt.Discrete = pt.discrete("1", "Number of knocks", start=0.0)

    def equations(self) -> pt.Equations:
        yield self.w == pt.der(self.phi)
        yield self.J * pt.der(self.w) == self.flange.tau
        yield self.flange.tau == self.d * (pt.der(self.flange.phi) - self.w)
        knock = pt.reinit(self.w, self.kept * self.w), pt.reinit(self.knocks, self.knocks + 1)
        yield pt.when(self.phi > (self.knocks + 1) * self.every, *knock)

    def energy(self) -> pt.Symbol:
        return self.J * self.w**2 / 2

    def loss(self) -> pt.Symbol:
        return self.d * (pt.der(self.flange.phi) - self.w) ** 2


@dataclass
class Kind:
    """How a part is made, and its ports that turn (``shafts``) or move (``rods``); the first is where it is joined on."""

    make: Callable[[Pick], pt.Component]
    shafts: tuple[str, ...] = ()
    rods: tuple[str, ...] = ()
    rigid: bool = True
    forced: bool = False


TWO, HELD, ONE = ("flange_a", "flange_b"), ("flange_a", "flange_b", "support"), ("flange",)
RATIOS = (1.0, 2.0, -1.5, 0.4)
LOSSES = (((0.0, 0.9, 0.8, 0.5, 1.0),), ((0.0, 0.9, 0.9, 0.1, 0.2), (20.0, 0.8, 0.7, 0.5, 1.0)))
BEARINGS = (((0.0, 1.0),), ((0.0, 0.5), (10.0, 2.0)))
STOPS = (0.2, 0.1, 0.05, 0.02, 0.013)
AXLE = ("crown", "left", "right")

KINDS: dict[str, Kind] = {
    # shafts
    "inertia": Kind(lambda pick: rot.Inertia(J=pick((1.0, 0.1, 3.0))), TWO),
    "knocked": Kind(lambda pick: Knocked(kept=pick((0.6, 0.0, -0.5))), ONE),
    "spring": Kind(lambda pick: rot.Spring(c=pick((100.0, 3e3))), TWO, rigid=False),
    "damper": Kind(lambda pick: rot.Damper(d=pick((1.0, 30.0))), TWO, rigid=False),
    "spring and damper": Kind(lambda pick: rot.SpringDamper(c=pick((100.0, 3e3)), d=pick((0.3, 10.0))), TWO, rigid=False),
    "backlash": Kind(lambda pick: rot.ElastoBacklash(c=1e3, d=pick((1.0, 10.0)), b=pick((0.1, 0.02))), TWO, rigid=False),
    "backlash 2": Kind(lambda pick: rot.ElastoBacklash2(c=1e3, d=pick((1.0, 10.0)), b=pick((0.1, 0.02))), TWO, rigid=False),
    "clutch": Kind(lambda pick: rot.Clutch(fn_max=pick((10.0, 80.0)), peak=pick((1.0, 1.2))), TWO, rigid=False),
    "one-way clutch": Kind(lambda pick: rot.OneWayClutch(fn_max=10.0), TWO, rigid=False),
    "dog clutch": Kind(lambda pick: rot.DogClutch(tau_max=pick((50.0, 3000.0))), TWO, rigid=False),
    "freewheel": Kind(lambda pick: rot.Freewheel(), TWO, rigid=False),
    "brake": Kind(lambda pick: rot.Brake(fn_max=pick((5.0, 60.0)), peak=pick((1.0, 1.2))), TWO),
    "band brake": Kind(lambda pick: rot.BandBrake(F_max=pick((50.0, 500.0))), TWO),
    "carried brake": Kind(lambda pick: rot.Brake(fn_max=pick((5.0, 60.0))), HELD),
    "bearing": Kind(lambda pick: rot.BearingFriction(tau_pos=pick(BEARINGS), peak=pick((1.0, 1.3))), TWO),
    "gear": Kind(lambda pick: rot.IdealGear(ratio=pick(RATIOS)), TWO),
    "lossy gear": Kind(lambda pick: rot.Gear(ratio=pick(RATIOS), efficiency=pick((0.9, 0.6))), TWO),
    "carried gear": Kind(lambda pick: rot.LossyGear(ratio=pick(RATIOS), lossTable=pick(LOSSES)), HELD),
    "worm": Kind(lambda pick: rot.WormGear(ratio=10.0, lead=pick((0.3, 0.05)), mue=0.08), TWO),
    "joint": Kind(lambda pick: rot.UniversalJoint(beta=pick((0.3, 0.8))), TWO),
    "planetary": Kind(lambda pick: PlanetaryGear(ratio=2.0, eta_ab=pick((1.0, 0.95)), eta_ba=0.95), ("sun", "carrier", "ring")),
    "bevel": Kind(lambda pick: BevelDifferential(eta=pick((1.0, 0.9))), AXLE),
    "limited slip": Kind(lambda pick: LimitedSlipDifferential(preload=pick((0.0, 2.0)), bias_drive=2.5, bias_coast=1.5), AXLE),
    "cam": Kind(lambda pick: CircularCamDifferential(mu=pick((0.05, 0.2))), AXLE),
    "torque": Kind(lambda pick: rot.Torque(), ONE),
    "step": Kind(lambda pick: rot.TorqueStep(stepTorque=pick((10.0, -20.0)), startTime=pick((0.0, 0.3))), ONE),
    "load": Kind(lambda pick: rot.QuadraticSpeedDependentTorque(tau_nominal=-5.0, w_nominal=10.0, TorqueDirection=False), ONE),
    "rubbing": Kind(lambda pick: rot.SignTorque(tau_nominal=-3.0), ONE),
    "eddy current": Kind(lambda pick: rot.EddyCurrentTorque(tau_nominal=10.0, w_nominal=5.0), ONE),
    "constant speed": Kind(lambda pick: rot.ConstantSpeed(w_fixed=pick((5.0, 0.0, -2.0))), ONE, forced=True),
    "filtered speed": Kind(lambda pick: rot.Speed(), ONE, forced=True),
    "held shaft": Kind(lambda pick: rot.Fixed(), ONE, forced=True),
    # between shaft and rod
    "rolling": Kind(lambda pick: rot.IdealRollingWheel(radius=pick((0.3, 1.0))), ("flangeR",), ("flangeT",)),
    "rack": Kind(lambda pick: rot.RackAndPinion(radius=0.2, efficiency=pick((1.0, 0.9))), ("flangeR",), ("flangeT",)),
    "screw": Kind(lambda pick: rot.Screw(p=pick((0.05, 0.3)), d=0.1), ("flangeR",), ("flangeT",)),
    "wheel": Kind(lambda pick: wheels.RigidWheel(load_nominal=pick((10.0, 300.0))), ("hub",), ("road",)),
    "tyre": Kind(lambda pick: wheels.SlipWheel(C=pick((1e3, 6e4)), load_nominal=pick((10.0, 300.0))), ("hub",), ("road",)),
    "Magic Formula": Kind(lambda pick: wheels.MagicFormulaWheel(load_nominal=pick((300.0, 3000.0))), ("hub",), ("road",)),
    # rods
    "mass": Kind(lambda pick: tr.Mass(m=pick((1.0, 20.0))), (), TWO),
    "strut": Kind(lambda pick: tr.SpringDamper(c=pick((100.0, 1e4)), d=pick((1.0, 50.0))), (), TWO, rigid=False),
    "rod spring": Kind(lambda pick: tr.Spring(c=pick((100.0, 1e4))), (), TWO, rigid=False),
    "dashpot": Kind(lambda pick: tr.Damper(d=pick((1.0, 50.0))), (), TWO, rigid=False),
    "gap": Kind(lambda pick: tr.ElastoGap(c=pick((1e3, 1e5)), d=10.0, s_rel0=-0.05, n=pick((1.0, 1.5))), (), TWO, rigid=False),
    "rod brake": Kind(lambda pick: tr.Brake(fn_max=pick((5.0, 60.0)), peak=pick((1.0, 1.2))), (), TWO),
    "slideway": Kind(lambda pick: tr.SupportFriction(f_pos=pick(BEARINGS), peak=pick((1.0, 1.3))), (), TWO),
    "stop": Kind(
        lambda pick: tr.MassWithStopAndFriction(
            m=1.0, F_prop=1.0, F_Coulomb=pick((1.0, 0.0)), F_Stribeck=pick((2.0, 0.0)), fexp=2.0, smin=-0.1, smax=pick(STOPS),
            restitution=pick((0.0, 0.5)),
        ),
        (), TWO,
    ),
    "force": Kind(lambda pick: tr.Force(), (), ONE),
    "force step": Kind(lambda pick: tr.ForceStep(stepForce=pick((10.0, -20.0)), startTime=0.2), (), ONE),
    "road load": Kind(lambda pick: tr.RollingResistance(fWeight=100.0), (), ONE),
    "air": Kind(lambda pick: tr.AirDrag(A=2.0, Cd=0.5), (), ONE),
    "rod motion": Kind(lambda pick: tr.Speed(), (), ONE, forced=True),
    "held rod": Kind(lambda pick: tr.Fixed(), (), ONE, forced=True),
}  # fmt: skip
INPUTS: dict[type[pt.Component], tuple[str, tuple[float, ...], bool]] = {
    rot.Clutch: ("f_normalized", (1.0,), True),
    rot.OneWayClutch: ("f_normalized", (1.0,), True),
    rot.DogClutch: ("engage", (1.0,), True),
    rot.Brake: ("f_normalized", (1.0,), True),
    rot.BandBrake: ("f_normalized", (0.5,), True),
    tr.Brake: ("f_normalized", (1.0,), True),
    rot.Torque: ("tau", (10.0, -3.0), False),
    tr.Force: ("f", (20.0, -5.0), False),
    rot.Speed: ("w_ref", (3.0,), False),
    tr.Speed: ("v_ref", (0.5,), False),
}
"""Of every kind with an input: its name, heights of its signals, and whether they are positive."""
SENSORS = {"R": (rot.SpeedSensor, "w"), "T": (tr.SpeedSensor, "v")}


@dataclass
class Mechanism:
    """Parts and joints, as of ``Joined``; ``nodes`` are joints with what they join: shafts (R) or rods (T).

    ``bodies`` number the nodes; rigid parts give all their nodes one number, so that what lies between two nodes of a body cannot move.
    """

    pick: Pick
    parts: list[pt.Component] = field(default_factory=list)
    nodes: list[tuple[str, list[str]]] = field(default_factory=list)
    bodies: list[int] = field(default_factory=list)
    wires: list[tuple[str, ...]] = field(default_factory=list)

    def add(self, part: pt.Component) -> int:
        self.parts.append(part)
        return len(self.parts) - 1

    def join(self, kind: Kind, careless: bool) -> None:
        """Joins one port of a new part to a node that is there, and every other one to a new node.

        Soft parts may close a loop between two bodies, ``careless`` ones between any nodes.
        """
        index = self.add(kind.make(self.pick))
        ports = [("R", name) for name in kind.shafts] + [("T", name) for name in kind.rods]
        there = {domain for domain, _ in self.nodes}
        on = self.pick([port for port in ports if port[0] in there] or [None])
        taken: set[int] = set()
        for port in sorted(ports, key=lambda port: port != on):
            fitting = [
                k for k, (domain, _) in enumerate(self.nodes) if domain == port[0] and self.bodies[k] not in taken
            ]
            if fitting and (port == on or ((careless or not kind.rigid) and self.pick((0, 0, 0, 1)))):
                node = self.pick(fitting)
            else:
                node = len(self.nodes)
                self.nodes.append((port[0], []))
                self.bodies.append(min(taken) if kind.rigid and len(ports) == 2 and taken else node)
            self.nodes[node][1].append(f"{index}.{port[1]}")
            taken.add(-1 if careless else self.bodies[node])
        if type(self.parts[index]) in INPUTS:
            name, heights, positive = INPUTS[type(self.parts[index])]
            self.wires.append((f"{index}.{name}", self.signal(self.pick(heights), positive)))

    def signal(self, height: float, positive: bool) -> str:
        """The output of a source, of a controller of a node's speed, or of a relay that this speed moves."""
        kind = self.pick(("source", "source", "source", "controller", "relay"))
        if kind == "source" or not self.nodes:
            return f"{self.add(self.source(height, positive))}.y"
        domain, joined = self.pick(self.nodes)
        sensor, reading = SENSORS[domain]
        index = self.add(sensor())
        joined.append(f"{index}.flange")
        return (
            self.controlled(f"{index}.{reading}", height, positive)
            if kind == "controller"
            else self.relay(f"{index}.{reading}", height)
        )

    def source(self, height: float, positive: bool) -> pt.Component:
        shift = 0.9 * height if positive else 0.0
        table = ((0.0, 0.0), (0.2, height), (0.5, 0.3 * height), (0.5, height), (0.9, 0.0))
        sources = (
            blocks.Constant(k=height),
            blocks.Step(height=height, startTime=self.pick((0.2, 0.5))),
            blocks.Sine(amplitude=height, f=self.pick((0.7, 2.0, 7.3)), offset=shift, phase=self.pick((0.0, 1.0))),
            blocks.Ramp(height=height, duration=self.pick((0.3, 1.0)), startTime=0.1),
            blocks.Pulse(amplitude=height, period=self.pick((0.13, 0.4)), width=self.pick((50.0, 10.0))),
            blocks.Trapezoid(amplitude=height, period=0.5, rising=0.1, width=0.1, falling=self.pick((0.0, 0.2))),
            blocks.Exponentials(outMax=height, riseTime=0.3, riseTimeConst=0.1, fallTimeConst=0.2),
            blocks.TimeTable(table=table),
        )
        source: pt.Component = self.pick(sources)
        return source

    def controlled(self, speed: str, height: float, positive: bool) -> str:
        """A controller of a speed, whose output lies within +-height."""
        limits: dict[str, Any] = {"yMax": 3 * abs(height), "yMin": 0.0 if positive else -3 * abs(height)}
        kinds = (
            blocks.LimPID(controllerType=self.pick(("P", "PI", "PID")), k=self.pick((1.0, 20.0)), **limits),
            blocks.SampledPI(k=1.0, period=self.pick((0.05, 0.013)), **limits),
        )
        index, set_point = self.add(self.pick(kinds)), self.add(self.source(2.0, positive=True))
        self.wires += [(f"{index}.u_m", speed), (f"{index}.u_s", f"{set_point}.y")]
        return f"{index}.y"

    def relay(self, speed: str, height: float) -> str:
        """A switch with hysteresis."""
        index, gain = self.add(blocks.Hysteresis(uLow=0.37, uHigh=0.83, y_start=1.0)), self.add(blocks.Gain(k=height))
        self.wires += [(f"{index}.u", speed), (f"{gain}.u", f"{index}.y")]
        return f"{gain}.y"

    def weigh(self, always: bool) -> None:
        """Inertias and masses on the nodes without."""
        for domain, joined in self.nodes:
            heavy = any(isinstance(self.parts[int(name.partition(".")[0])], rot.Inertia | tr.Mass) for name in joined)
            if not heavy and (always or self.pick((0, 1))):
                joined.append(f"{self.add(rot.Inertia(J=0.5) if domain == 'R' else tr.Mass(m=2.0))}.flange_a")

    def heat(self) -> None:
        """Some of the parts that lose power warm a block, which is cooled by the air."""
        warm = [
            f"{i}.heat_port"
            for i, part in enumerate(self.parts)
            if isinstance(part, thermal.Lossy) and self.pick((0, 0, 1))
        ]
        if warm:
            block, wall, air = (
                self.add(thermal.HeatCapacitor(C=50.0)),
                self.add(thermal.ThermalConductor(G=3.0)),
                self.add(thermal.FixedTemperature()),
            )
            self.wires += [(f"{block}.port", f"{wall}.port_a", *warm), (f"{wall}.port_b", f"{air}.port")]

    def model(self) -> Joined:
        joints = [tuple(joined) for _, joined in self.nodes if len(joined) > 1]
        return Joined(parts=tuple(self.parts), joints=(*joints, *self.wires))


def mechanism(seed: int, careless: bool = False) -> Joined:
    """A connected machine of some parts.

    ``careless``: whatever can be connected. Else there is an inertia or a mass on every node, rigid parts close no loops, and at most one
    motion is forced, so that most of these can be simulated.
    """
    draws = random.Random(seed)
    made = Mechanism(lambda options: draws.choice(list(options)))
    made.join(KINDS[draws.choice(("inertia", "inertia", "mass"))], careless=False)
    forced = 0
    for _ in range(draws.randint(2, 9)):
        domains = {domain for domain, _ in made.nodes}
        fitting = [
            kind for kind in KINDS.values() if (kind.shafts and "R" in domains) or (kind.rods and "T" in domains)
        ]
        kind = draws.choice(fitting)
        if kind.forced and not careless:
            forced += 1
            kind = kind if forced == 1 else KINDS["torque" if kind.shafts else "force"]
        made.join(kind, careless)
    made.weigh(always=not careless)
    made.heat()
    return made.model()


def random_starts(plant: pt.Plant[Any], seed: int) -> dict[str, float]:
    """Speeds, twists and positions of some of the states, which are independent."""
    draws = random.Random(seed)
    size = {"w": 5.0, "w_rel": 5.0, "v": 1.0, "v_rel": 1.0, "phi_rel": 0.1, "s_rel": 0.01}
    moving = [
        (name, size[name.rpartition(".")[2]]) for name in plant.compiled.states if name.rpartition(".")[2] in size
    ]
    return {name: draws.uniform(-largest, largest) for name, largest in moving if draws.random() < 0.6}


def simulated(seed: int, **options: Any) -> tuple[pt.Plant[Any], dict[str, float], pt.Result[Any]]:
    """The machine of a seed, random starts, and its run for 1 s; skips the test if it is refused."""
    try:
        with bounded():
            plant = pt.compile(mechanism(seed))
            starts = random_starts(plant, seed)
            return plant, starts, plant.simulate(1.0, starts=starts, **options)
    except pt.PowertrainError:
        pytest.skip("refused")
