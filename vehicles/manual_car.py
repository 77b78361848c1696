"""A front-wheel-drive car with a manual gearbox."""

from __future__ import annotations

from typing import Any, Self

from powertrain import Equations, connect
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import Driver, FixedGear, GearSchedule, OpenPedals, Pedals, Shifting
from powertrain.components.differentials import CrownGear
from powertrain.components.rotational import Clutch, IdealGear
from powertrain.components.transmissions import ManualGearbox, Shiftable, SingleGear
from powertrain.vehicles.car import GearedCar

W_OPEN, W_CLOSED = 90.0, 120.0
"""Engine speeds [rad/s] between which the clutch closes in a car with one gear."""


class ManualCar(GearedCar):
    """A front-wheel-drive car of 1,300 kg: engine, clutch, six-speed gearbox, final drive, wheels.

    The driver follows ``cycle``; the schedule shifts depending on vehicle speed, with a real clutch and real synchronisers. ``start_stop``
    decides whether the engine runs: ``AlwaysOn()``, or ``StartStop()``, which stops it at rest. The loss of the gearbox's meshes is
    included in the final drive. The numbers are invented, for a compact car with a 1.6 l engine.
    ``front`` and ``rear`` accept axles, see ``Car``: ``DrivenAxle`` has a selectable differential, half shafts and two tyres.
    """

    driver: Pedals = Driver(k_a=1300 / 6000)
    schedule: Shifting = GearSchedule()
    clutch: Clutch = Clutch(fn_max=300, mue_pos=((0.0, 1.0),))
    gearbox: Shiftable = ManualGearbox()
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=4.1, eta_ab=0.95, eta_ba=0.95))
    body: Body = VehicleBody(m=1300, A=2.1)

    @classmethod
    def in_one_gear(cls, ratio: float = 3.5, **parts: Any) -> Self:
        """The car with one permanently engaged gear and ``OpenPedals``, for measurements of its axles. ``parts`` are its other fields."""
        bench = {
            "driver": OpenPedals(),
            "schedule": FixedGear(w_open=W_OPEN, w_closed=W_CLOSED),
            "gearbox": SingleGear(gear=IdealGear(ratio=ratio)),
        }
        return cls(**(bench | parts))

    def equations(self) -> Equations:
        """Engine to road."""
        yield connect(self.engine.crank, self.accessories.flange, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.gearbox.flange_a)
        yield from self._to_the_road(self.gearbox.flange_b, self.driver.brake)
        yield from self._by_schedule(self.clutch.f_normalized)
