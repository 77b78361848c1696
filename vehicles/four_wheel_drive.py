"""A car with a manual gearbox, two driven axles and a centre differential; all differentials can be exchanged."""

from __future__ import annotations

from powertrain.components.body import Axle, Body, CentreDifferential, DrivenAxle, TransferCase, VehicleBody
from powertrain.components.control import Driver, Pedals
from powertrain.components.wheels import WheelBrake
from powertrain.vehicles.manual_car import ManualCar


class FourWheelDriveCar(ManualCar):
    """A two-axle 4x4 of 1,700 kg: engine, clutch, gearbox, centre differential, and two driven axles with a differential each.

    ``transfer.differential`` accepts any ``Differential``: its left side drives the front axle, its right side the rear axle. Each wheel
    has its own friction coefficient: ``front.left.mu`` and so on. The curvature is that of the rear axle's path; the steered front wheels
    run on larger circles, so the centre differential works in every bend. The rest is as in ``ManualCar``.
    """

    driver: Pedals = Driver(k_a=1700 / 6000)
    transfer: TransferCase = CentreDifferential()
    front: Axle = DrivenAxle()
    rear: Axle = DrivenAxle(left_brake=WheelBrake(tau_max=1000), right_brake=WheelBrake(tau_max=1000))
    body: Body = VehicleBody(m=1700, front_share=0.52, h=0.65, A=2.6, Cd=0.35)
