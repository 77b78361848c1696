"""Signals that cars have in common: the driver on the cycle, and the shifting of gears."""

from __future__ import annotations

from typing import Protocol

from powertrain import Equations, Input, connect
from powertrain.components.body import Body
from powertrain.components.control import EngineSwitch, Pedals, Shifting
from powertrain.components.cycles import CycleSpeed
from powertrain.components.engines import Engine
from powertrain.components.transmissions import Shiftable


class OnACycle(Protocol):
    """A car whose driver follows a cycle."""

    cycle: CycleSpeed
    driver: Pedals
    body: Body


class Shifted(OnACycle, Protocol):
    """A car whose schedule shifts a gearbox and moves throttle and clutch."""

    schedule: Shifting
    start_stop: EngineSwitch
    engine: Engine
    gearbox: Shiftable


def on_the_cycle(car: OnACycle) -> Equations:
    """The driver knows the speed to drive, the acceleration to come, and the speed."""
    yield connect(car.cycle.v_ref, car.driver.v_ref)
    yield connect(car.cycle.a_ref, car.driver.a_ref)
    yield connect(car.body.v, car.driver.v)


def by_schedule(car: Shifted, clutch: Input) -> Equations:
    """The driver on the cycle; the schedule moves lever, throttle and ``clutch``; the engine runs when ``start_stop`` says so."""
    yield from on_the_cycle(car)
    yield connect(car.body.v, car.schedule.v, car.start_stop.v)
    yield connect(car.driver.accelerator, car.schedule.accelerator, car.start_stop.accelerator)
    yield connect(car.engine.speed, car.schedule.w)
    yield connect(car.schedule.throttle, car.engine.throttle)
    yield connect(car.schedule.clutch, clutch)
    yield connect(car.schedule.lever, car.gearbox.lever)
    yield connect(car.start_stop.on, car.engine.on)
