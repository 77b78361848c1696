"""A front-wheel-drive car with a dual-clutch gearbox."""

from __future__ import annotations

from powertrain import Equations, ModelError, connect
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import Driver, Pedals, PowerShiftSchedule, Shifting
from powertrain.components.differentials import CrownGear
from powertrain.components.transmissions import DualClutchGearbox, Shiftable, StartingGearbox
from powertrain.vehicles.car import GearedCar

SPEEDS = ((5.0, 3.0), (9.0, 6.5), (12.5, 10.0), (16.5, 13.5), (21.0, 17.5))
"""Shifts of a six-speed gearbox in m/s, with the accelerator released."""


class DualClutchCar(GearedCar):
    """A front-wheel-drive car of 1,400 kg: engine, six-speed dual-clutch gearbox, final drive, wheels.

    The clutch of the first gear starts the car; the schedule presses it depending on engine speed. During shifts one clutch takes over from
    the other, with torque and inertia phases; the synchroniser has preselected the gear. The loss of the meshes is included in
    the final drive. The numbers are invented, for a compact car with a 1.6 l engine. ``front`` and ``rear`` accept axles, see ``Car``.
    """

    driver: Pedals = Driver(k_a=1400 / 6000)
    schedule: Shifting = PowerShiftSchedule(speeds=SPEEDS, t_shift=0.8)
    gearbox: Shiftable = DualClutchGearbox()
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=4.1, eta_ab=0.95, eta_ba=0.95))
    body: Body = VehicleBody(m=1400, A=2.15)

    def equations(self) -> Equations:
        """Engine to road."""
        if not isinstance(self.gearbox, StartingGearbox):
            raise ModelError(
                f"DualClutchCar.gearbox is a {type(self.gearbox).__name__}, which has no clutch that starts the car; give it a "
                "DualClutchGearbox, or take a ManualCar or an AutomaticCar"
            )
        yield connect(self.engine.crank, self.accessories.flange, self.gearbox.flange_a)
        yield from self._to_the_road(self.gearbox.flange_b, self.driver.brake)
        yield from self._by_schedule(self.gearbox.pressed)
