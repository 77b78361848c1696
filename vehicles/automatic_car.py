"""A front-wheel-drive car with an automatic gearbox."""

from __future__ import annotations

from typing import Any, Self

from powertrain import Equations, ParameterError, connect
from powertrain.components.body import Axle, Body, LumpedAxle, VehicleBody
from powertrain.components.control import Driver, Pedals, PowerShiftSchedule, Shifting
from powertrain.components.differentials import CrownGear
from powertrain.components.transmissions import (
    Automatic,
    PowerShiftGearbox,
    Shiftable,
    StartingConverter,
    StartingDevice,
)
from powertrain.language.makers import arguments_checked
from powertrain.vehicles.car import GearedCar

SPEEDS = ((4.0, 2.5), (7.0, 4.5), (9.5, 6.5), (12.0, 9.0), (15.0, 11.5), (18.0, 14.0), (22.0, 17.0))
"""Shifts of an eight-speed gearbox in m/s, with the accelerator released."""


class AutomaticCar(GearedCar):
    """A front-wheel-drive car of 1,500 kg: engine, torque converter, eight-speed gearbox that shifts under load, final drive, wheels.

    The driver follows ``cycle``; the schedule shifts depending on vehicle speed and accelerator. ``gearbox`` has only ratios and losses;
    ``AutomaticCar.with_gearset(Automatic.eight_speed())`` has planetary sets and shift elements, and its shifts have torque and
    inertia phases. ``start`` also accepts a ``StartingClutch`` instead of the converter. ``start_stop`` decides whether the engine runs.
    The numbers are invented, for a compact car with a 1.6 l engine.
    ``front`` and ``rear`` take axles, see ``Car``.
    """

    driver: Pedals = Driver(k_a=1500 / 6000, hold=0.3)
    schedule: Shifting = PowerShiftSchedule(speeds=SPEEDS)
    start: StartingDevice = StartingConverter()
    gearbox: Shiftable = PowerShiftGearbox()
    front: Axle = LumpedAxle(final_drive=CrownGear(ratio=3.2, eta_ab=0.97, eta_ba=0.97))
    body: Body = VehicleBody(m=1500, A=2.2)

    @classmethod
    @arguments_checked
    def with_gearset(
        cls,
        gearbox: Automatic,
        *,
        w_up: float | str = 150.0,
        w_full: float | str = 560.0,
        ratio: float = 3.2,
        **parts: Any,
    ) -> Self:
        """The car with an automatic gearset, a final drive of ``ratio``, and matching shift speeds.

        With the accelerator released it shifts up where the next gear gives the input the speed ``w_up`` [rad/s], with the accelerator
        fully pressed at up to ``w_full``. Speeds with another unit, such as "1500 rpm", are converted.
        Errors: ParameterError for axles of your own without a ``schedule`` for their final drive and wheels.
        """
        cls._check_names(parts, "w_up", "w_full", "ratio")
        if "schedule" not in parts and (own := {"front", "rear"} & parts.keys()):
            raise ParameterError(
                f"{cls.__name__}.with_gearset: {' and '.join(sorted(own))} given, but no shift speeds for it; give "
                "schedule=PowerShiftSchedule.for_gears(gearbox.gear_ratios, final_drive, radius=...), too"
            )
        axle = LumpedAxle(final_drive=CrownGear(ratio=ratio, eta_ab=0.97, eta_ba=0.97))
        ratios = [gearbox.scheme.ratio(gear.name) for gear in gearbox.scheme.forward]
        radius = float(axle.wheels.radius)
        schedule = PowerShiftSchedule.for_gears(ratios, ratio, radius=radius, w_up=w_up, w_full=w_full, t_shift=0.6)
        made = {"gearbox": gearbox, "front": axle, "schedule": schedule}
        return cls(**(made | parts))

    def equations(self) -> Equations:
        """Engine to road."""
        yield connect(self.engine.crank, self.accessories.flange, self.start.flange_a)
        yield connect(self.start.flange_b, self.gearbox.flange_a)
        yield from self._to_the_road(self.gearbox.flange_b, self.driver.brake)
        yield connect(self.driver.brake, self.start.brake)
        yield connect(self.driver.accelerator, self.start.accelerator)
        yield from self._by_schedule(self.start.pressed)
