"""Sensors read what the shafts do, and change nothing."""

from __future__ import annotations

import numpy as np
import pytest
from rotational_line import Line, run

import powertrain as pt
from powertrain.components import rotational as rot
from powertrain.components.blocks import Sine


class Bench(pt.Component):
    """Two inertias on a spring with every sensor."""

    sine: Sine = Sine(amplitude=3, f=1)
    torque: rot.Torque = rot.Torque()
    one: rot.Inertia = rot.Inertia(J=1)
    torqueSensor: rot.TorqueSensor = rot.TorqueSensor()
    powerSensor: rot.PowerSensor = rot.PowerSensor()
    multiSensor: rot.MultiSensor = rot.MultiSensor()
    spring: rot.SpringDamper = rot.SpringDamper(c=30, d=0.1)
    two: rot.Inertia = rot.Inertia(J=2)
    angle: rot.AngleSensor = rot.AngleSensor()
    speed: rot.SpeedSensor = rot.SpeedSensor()
    acceleration: rot.AccSensor = rot.AccSensor()
    relAngle: rot.RelAngleSensor = rot.RelAngleSensor()
    relSpeed: rot.RelSpeedSensor = rot.RelSpeedSensor()
    relAcceleration: rot.RelAccSensor = rot.RelAccSensor()

    def equations(self) -> pt.Equations:
        yield pt.connect(self.sine.y, self.torque.tau)
        yield pt.connect(self.torque.flange, self.one.flange_a)
        yield pt.connect(self.one.flange_b, self.torqueSensor.flange_a)
        yield pt.connect(self.torqueSensor.flange_b, self.powerSensor.flange_a)
        yield pt.connect(self.powerSensor.flange_b, self.multiSensor.flange_a)
        relative = (self.relAngle, self.relSpeed, self.relAcceleration)
        yield pt.connect(self.multiSensor.flange_b, self.spring.flange_a, *(sensor.flange_a for sensor in relative))
        absolute = (self.angle, self.speed, self.acceleration)
        yield pt.connect(
            self.spring.flange_b,
            self.two.flange_a,
            *(sensor.flange_b for sensor in relative),
            *(sensor.flange for sensor in absolute),
        )


def test_readings() -> None:
    result = run(Bench(), 2.0)
    one = {name: result[f"one.{name}"] for name in ("phi", "w", "a")}
    two = {name: result[f"two.{name}"] for name in ("phi", "w", "a")}
    for sensor, expected in {
        "angle.phi": two["phi"],
        "speed.w": two["w"],
        "acceleration.a": two["a"],
        "relAngle.phi_rel": two["phi"] - one["phi"],
        "relSpeed.w_rel": two["w"] - one["w"],
        "relAcceleration.a_rel": two["a"] - one["a"],
        "torqueSensor.tau": -result["spring.tau"],
        "powerSensor.power": -result["spring.tau"] * one["w"],
        "multiSensor.tau": -result["spring.tau"],
        "multiSensor.w": one["w"],
        "multiSensor.power": -result["spring.tau"] * one["w"],
    }.items():
        np.testing.assert_allclose(result[sensor], expected, atol=1e-9, err_msg=sensor)


def test_sensors_change_nothing() -> None:
    plain = Line(
        parts=(rot.Torque(), rot.Inertia(J=1), rot.SpringDamper(c=30, d=0.1), rot.Inertia(J=2)),
        signals=(Sine(amplitude=3, f=1),),
        wires=((0, 0, "tau"),),
    )
    with_sensors, without = run(Bench(), 2.0), run(plain, 2.0)
    np.testing.assert_allclose(with_sensors["two.w"], without["parts[3].w"], atol=1e-8)


def test_power_reading_is_positive_from_a_to_b() -> None:
    line = Line(parts=(rot.ConstantTorque(tau_constant=2), rot.PowerSensor(), rot.Inertia(J=1)))
    result = run(line, 1.0)
    np.testing.assert_allclose(result["parts[1].power"], 4 * result.time, atol=1e-9)


@pytest.mark.parametrize("exact", [True, False])
def test_an_inertia_cut_into_blocks_moves_as_a_whole(exact: bool) -> None:
    """Angle to the one side, torque back from the other."""

    class Cut(pt.Component):
        sine: Sine = Sine(amplitude=3, f=1)
        torque: rot.Torque = rot.Torque()
        direct: rot.Inertia = rot.Inertia(J=1)
        out: rot.TorqueToAngleAdaptor
        back: rot.AngleToTorqueAdaptor = rot.AngleToTorqueAdaptor()
        inverse: rot.Inertia = rot.Inertia(J=2)

        def equations(self) -> pt.Equations:
            yield pt.connect(self.sine.y, self.torque.tau)
            yield pt.connect(self.torque.flange, self.direct.flange_a)
            yield pt.connect(self.direct.flange_b, self.out.flange)
            yield pt.connect(self.out.phi, self.back.phi)
            yield pt.connect(self.back.tau, self.out.tau)
            yield pt.connect(self.back.flange, self.inverse.flange_a)

    result = run(Cut(out=rot.TorqueToAngleAdaptor(use_w=exact, use_a=exact)), 1.0)
    expected = 3 / 3 / (2 * np.pi) * (1 - np.cos(2 * np.pi * result.time))
    np.testing.assert_allclose(result["inverse.w"], expected, atol=1e-8)
    if exact:
        np.testing.assert_allclose(result["out.a"], result["direct.a"], atol=1e-12)
