"""A battery with a load, and machines at a held speed or with an inertia."""

from __future__ import annotations

import numpy as np

import powertrain as pt
from powertrain.components.electric import (
    AccessoryLoad,
    Battery,
    DCTerminal,
    ElectricMachine,
    PolarizedBattery,
    VoltageSource,
)
from powertrain.components.rotational import ConstantSpeed, Inertia


class Current(pt.Component):
    """Draws a current from the bus."""

    boundary = True
    bus: DCTerminal = pt.port(DCTerminal)
    i: pt.Parameter = pt.parameter("A", "Current drawn", default=0.0)

    def equations(self) -> pt.Equations:
        yield self.bus.i == self.i


class Pulses(pt.Component):
    """Draws 100 A and gives them back, 0.1 s each."""

    boundary = True
    bus: DCTerminal = pt.port(DCTerminal)

    def equations(self) -> pt.Equations:
        times = np.repeat(np.arange(0, 20.05, 0.1), 2)[1:]
        yield self.bus.i == pt.schedule(times, np.resize([100.0, 100.0, -100.0, -100.0], times.size))


class Discharge(pt.Component):
    """A battery that gives a constant current."""

    battery: Battery | PolarizedBattery = Battery()
    draw: Current = Current()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.battery.bus, self.draw.bus)


class Supply(pt.Component):
    """A battery that feeds a constant power."""

    battery: Battery | PolarizedBattery = Battery()
    load: AccessoryLoad = AccessoryLoad(P=5e3)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.battery.bus, self.load.bus)


class HeldMachine(pt.Component):
    """A machine whose speed is held, at a constant voltage."""

    machine: ElectricMachine
    drive: ConstantSpeed
    source: VoltageSource = VoltageSource(V=250)
    demand: pt.Input = pt.signal_input("N.m", "Torque")

    def equations(self) -> pt.Equations:
        yield pt.connect(self.source.bus, self.machine.bus)
        yield pt.connect(self.machine.shaft, self.drive.flange)
        yield pt.connect(self.demand, self.machine.torque_demand)


class FlywheelDrive(pt.Component):
    """A battery that speeds a flywheel up through a machine and gets its energy back."""

    battery: Battery | PolarizedBattery = Battery()
    machine: ElectricMachine = ElectricMachine()
    flywheel: Inertia = Inertia(J=2)
    demand: tuple[tuple[float, float], ...] = ((0, 60), (8, 60), (8, -60), (12, -60))

    def equations(self) -> pt.Equations:
        yield pt.connect(self.battery.bus, self.machine.bus)
        yield pt.connect(self.machine.shaft, self.flywheel.flange_a)
        yield self.machine.torque_demand.value == pt.schedule([t for t, _ in self.demand], [T for _, T in self.demand])
