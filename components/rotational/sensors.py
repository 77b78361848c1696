"""Ideal sensors of angle, speed, acceleration, torque and power, without effect on the shaft."""

from __future__ import annotations

from powertrain import Component, Equations, Output, der, port, signal_output
from powertrain.components.rotational.interfaces import Flange, TwoFlanges


class _AbsoluteSensor(Component):
    """Partial: reads one flange, without torque."""

    flange: Flange = port(Flange)

    def _read(self) -> Equations:
        yield self.flange.tau == 0


class AngleSensor(_AbsoluteSensor):
    """Reads an angle: phi = flange.phi."""

    phi: Output = signal_output("rad", "Angle of the flange")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.phi.value == self.flange.phi


class SpeedSensor(_AbsoluteSensor):
    """Reads a speed: w = der(flange.phi)."""

    w: Output = signal_output("rad/s", "Speed of the flange")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.w.value == der(self.flange.phi)


class AccSensor(_AbsoluteSensor):
    """Reads an angular acceleration: a = der(der(flange.phi))."""

    a: Output = signal_output("rad/s2", "Angular acceleration of the flange")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.a.value == der(der(self.flange.phi))


class _RelativeSensor(TwoFlanges):
    """Partial: reads the motion of flange_b against flange_a, without torque."""

    def _read(self) -> Equations:
        yield self.flange_a.tau == 0
        yield self.flange_b.tau == 0


class RelAngleSensor(_RelativeSensor):
    """Reads a relative angle: phi_rel = flange_b.phi - flange_a.phi."""

    phi_rel: Output = signal_output("rad", "Relative angle")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.phi_rel.value == self.flange_b.phi - self.flange_a.phi


class RelSpeedSensor(_RelativeSensor):
    """Reads a relative speed: w_rel = der(flange_b.phi - flange_a.phi)."""

    w_rel: Output = signal_output("rad/s", "Relative speed")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.w_rel.value == der(self.flange_b.phi - self.flange_a.phi)


class RelAccSensor(_RelativeSensor):
    """Reads a relative acceleration: a_rel = der(der(flange_b.phi - flange_a.phi))."""

    a_rel: Output = signal_output("rad/s2", "Relative angular acceleration")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.a_rel.value == der(der(self.flange_b.phi - self.flange_a.phi))


class _ShaftSensor(TwoFlanges):
    """Partial: a rigid shaft with a measuring section."""

    def _pass(self) -> Equations:
        yield self.flange_a.phi == self.flange_b.phi
        yield self.flange_a.tau + self.flange_b.tau == 0


class TorqueSensor(_ShaftSensor):
    """Reads the torque in a shaft: tau = flange_a.tau."""

    tau: Output = signal_output("N.m", "Torque from flange_a to flange_b")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._pass()
        yield self.tau.value == self.flange_a.tau


class PowerSensor(_ShaftSensor):
    """Reads the power through a shaft: power = flange_a.tau der(flange_a.phi)."""

    power: Output = signal_output("W", "Power from flange_a to flange_b")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._pass()
        yield self.power.value == self.flange_a.tau * der(self.flange_a.phi)


class MultiSensor(_ShaftSensor):
    """Reads speed, torque and power of a shaft: w = der(flange_a.phi), tau = flange_a.tau, power = tau w."""

    power: Output = signal_output("W", "Power from flange_a to flange_b")
    w: Output = signal_output("rad/s", "Speed of the shaft")
    tau: Output = signal_output("N.m", "Torque from flange_a to flange_b")

    def equations(self) -> Equations:
        """The readings."""
        yield from self._pass()
        yield self.w.value == der(self.flange_a.phi)
        yield self.tau.value == self.flange_a.tau
        yield self.power.value == self.flange_a.tau * self.w.value
