"""A rear-wheel-drive car with a manual gearbox and an exchangeable differential."""

from __future__ import annotations

from powertrain.components.body import Axle, Body, DrivenAxle, RollingAxle, VehicleBody
from powertrain.components.control import Driver, Pedals
from powertrain.components.wheels import WheelBrake
from powertrain.vehicles.manual_car import ManualCar


class RearDriveCar(ManualCar):
    """A rear-wheel-drive car of 1,500 kg: engine, clutch, gearbox, final drive, differential, half shafts, tyres.

    ``rear.differential`` accepts any ``Differential``: bevel, limited-slip, circular cam, spherical cam, linkage. The friction
    coefficients of the road are ``rear.left.mu`` and ``rear.right.mu``; the front axle is not driven. The half shafts are elastic, so a
    differential that locks at once has something to lock against. The driver steers the car along the path of the given curvature. The
    rest is as in ``ManualCar``.
    """

    driver: Pedals = Driver(k_a=1500 / 6000)
    front: Axle = RollingAxle(brakes=WheelBrake(tau_max=3000))
    rear: Axle = DrivenAxle(left_brake=WheelBrake(tau_max=700), right_brake=WheelBrake(tau_max=700))
    body: Body = VehicleBody(front_share=0.5)
