"""Engines alone, against a torque, and at a given speed."""

from __future__ import annotations

import powertrain as pt
from powertrain.components.engines import Engine
from powertrain.components.rotational import ConstantSpeed, Torque


class Loaded(pt.Component):
    """An engine and a torque on its crank: a positive ``load`` brakes it."""

    engine: Engine
    brake: Torque = Torque()
    load: pt.Input = pt.signal_input("N.m", "Braking torque", default=0.0)
    throttle: pt.Input = pt.signal_input("1", "Throttle", default=0.0)
    on: pt.Input = pt.signal_input("1", "Runs", default=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.brake.flange)
        yield pt.connect(self.throttle, self.engine.throttle)
        yield pt.connect(self.on, self.engine.on)
        yield self.brake.tau.value == -self.load.value


class Dyno(pt.Component):
    """An engine whose speed is held."""

    engine: Engine
    drive: ConstantSpeed
    throttle: pt.Input = pt.signal_input("1", "Throttle", default=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.drive.flange)
        yield pt.connect(self.throttle, self.engine.throttle)


class Driven(pt.Component):
    """An engine whose throttle follows a table, against a torque in proportion to its speed and a constant one."""

    engine: Engine
    rows: tuple[tuple[float, float], ...]
    brake: Torque = Torque()
    d: pt.Parameter = pt.parameter("N.m.s/rad", "Braking torque over speed", default=0.0)
    load: pt.Parameter = pt.parameter("N.m", "Braking torque", default=0.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.engine.crank, self.brake.flange)
        yield self.engine.throttle.value == pt.schedule([t for t, _ in self.rows], [u for _, u in self.rows])
        yield self.brake.tau.value == -self.d * self.engine.w - self.load
