"""Ideal sensors of position, speed, acceleration, force and power, without effect on the rod."""

from __future__ import annotations

from powertrain import Component, Equations, Output, der, port, signal_output
from powertrain.components.translational.interfaces import Flange, TwoFlanges


class _AbsoluteSensor(Component):
    """Partial: reads one flange, without force."""

    flange: Flange = port(Flange)

    def _read(self) -> Equations:
        yield self.flange.f == 0


class PositionSensor(_AbsoluteSensor):
    """Reads a position: s = flange.s."""

    s: Output = signal_output("m", "Position of the flange")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.s.value == self.flange.s


class SpeedSensor(_AbsoluteSensor):
    """Reads a speed: v = der(flange.s)."""

    v: Output = signal_output("m/s", "Speed of the flange")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.v.value == der(self.flange.s)


class AccSensor(_AbsoluteSensor):
    """Reads an acceleration: a = der(der(flange.s))."""

    a: Output = signal_output("m/s2", "Acceleration of the flange")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.a.value == der(der(self.flange.s))


class _RelativeSensor(TwoFlanges):
    """Partial: reads the motion of flange_b against flange_a, without force."""

    def _read(self) -> Equations:
        yield self.flange_a.f == 0
        yield self.flange_b.f == 0


class RelPositionSensor(_RelativeSensor):
    """Reads a relative position: s_rel = flange_b.s - flange_a.s."""

    s_rel: Output = signal_output("m", "Relative position")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.s_rel.value == self.flange_b.s - self.flange_a.s


class RelSpeedSensor(_RelativeSensor):
    """Reads a relative speed: v_rel = der(flange_b.s - flange_a.s)."""

    v_rel: Output = signal_output("m/s", "Relative speed")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.v_rel.value == der(self.flange_b.s - self.flange_a.s)


class RelAccSensor(_RelativeSensor):
    """Reads a relative acceleration: a_rel = der(der(flange_b.s - flange_a.s))."""

    a_rel: Output = signal_output("m/s2", "Relative acceleration")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._read()
        yield self.a_rel.value == der(der(self.flange_b.s - self.flange_a.s))


class _RodSensor(TwoFlanges):
    """Partial: a rigid rod with a measuring section."""

    def _pass(self) -> Equations:
        yield self.flange_a.s == self.flange_b.s
        yield self.flange_a.f + self.flange_b.f == 0


class ForceSensor(_RodSensor):
    """Reads the force in a rod: f = flange_a.f."""

    f: Output = signal_output("N", "Force from flange_a to flange_b")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._pass()
        yield self.f.value == self.flange_a.f


class PowerSensor(_RodSensor):
    """Reads the power through a rod: power = flange_a.f der(flange_a.s)."""

    power: Output = signal_output("W", "Power from flange_a to flange_b")

    def equations(self) -> Equations:
        """The reading."""
        yield from self._pass()
        yield self.power.value == self.flange_a.f * der(self.flange_a.s)


class MultiSensor(_RodSensor):
    """Reads speed, force and power of a rod: v = der(flange_a.s), f = flange_a.f, power = f v."""

    power: Output = signal_output("W", "Power from flange_a to flange_b")
    v: Output = signal_output("m/s", "Speed of the rod")
    f: Output = signal_output("N", "Force from flange_a to flange_b")

    def equations(self) -> Equations:
        """The readings."""
        yield from self._pass()
        yield self.v.value == der(self.flange_a.s)
        yield self.f.value == self.flange_a.f
        yield self.power.value == self.flange_a.f * self.v.value
