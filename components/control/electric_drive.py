"""Control of an electrically driven car: drives and brakes with the machine as far as machine and battery permit."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Component,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    Variable,
    parameter,
    signal_input,
    signal_output,
    variable,
)
from powertrain.components.limited import limited

SLOW = 0.1
"""Speed [m/s] below which forces are computed from power as at this speed."""
STILL = 1e-12
"""Smallest speed [rad/s] of a braking machine, which avoids a division by zero."""

NO_POWER = 1.0
"""Power [W] below which no power counts as drawn."""

ROLLING = 300.0
"""Power [W] that a machine may always generate while it drives a vehicle that rolls back: losses and accessories take it."""


def drawing(power: Symbol, w: Symbol, limit: Symbol, loss: Symbol) -> Symbol:
    """The torque up to ``limit`` [N.m] at which a machine draws at most ``power`` [W]; it loses ``loss`` [W] at the limit."""
    return limit * limited(power / ca.fmax(limit * ca.fmax(w, 0) + loss, NO_POWER))


class BlendedBraking(Component):
    """Partial: divides a brake demand between a machine and the friction brakes; the machine brakes first.

    regenerated = fade min(brake F_brake, F_most, limit w/v, charge_power/v) with v at least 0.1 m/s
    fade = min(v/v_fade, w/w_fade) within 0..1: a machine whose wheels lock does not drive them backward
    most = limit min(1, discharge_power/(limit w + added_loss)),  w < 0: at most limit (charge_power + 300 W)/(limit |w| + 300 W)

    ``charge_power`` and ``discharge_power`` are the powers that battery and other consumers on the bus leave to the machine, without its
    no-load loss. ``most`` is the torque that draws discharge_power, estimated from the chord of the power over the torque. Where losses
    grow faster than the torque, the power drawn stays below this; with losses over torque squared by at most a quarter of ``added_loss``. A
    loss map that does not, such as a table of efficiencies with a ``no_load`` far below the loss at the lowest torque, draws more.
    """

    F_brake: Parameter = parameter("N", "Force of all brakes with the pedal fully pressed", default=15e3, above=0)
    F_most: Parameter = parameter("N", "Maximum regenerative braking force", default=5000.0, min=0)
    v_fade: Parameter = parameter("m/s", "Speed below which regenerative braking fades out", default=3.0, above=0)
    w_fade: Parameter = parameter(
        "rad/s", "Speed of the machine below which regenerative braking fades out", default=20.0, above=0
    )
    accelerator: Input = signal_input("1", "Accelerator pedal")
    brake: Input = signal_input("1", "Brake pedal")
    limit: Input = signal_input("N.m", "Maximum torque of the machine at its speed")
    charge_power: Input = signal_input("W", "Maximum power that the machine may give to the bus", default=1e9)
    discharge_power: Input = signal_input("W", "Maximum power that the machine may draw from the bus", default=1e9)
    added_loss: Input = signal_input("W", "Loss that the maximum torque adds to that without torque", default=0.0)
    friction: Output = signal_output("1", "Demand on the friction brakes")
    regenerated: Variable = variable("N", "Regenerative braking force")

    def _recover(self, v: Symbol, w: Symbol, power: Symbol) -> Equations:
        """The part of the demand that axle, machine and ``power`` let a machine with speed ``w`` recover at vehicle speed ``v``."""
        speed, turning = ca.fmax(v, SLOW), ca.fmax(w, 0)
        most = ca.fmin(ca.fmin(self.F_most, self.limit.value * turning / speed), power / speed)
        force = ca.fmin(self.brake.value * self.F_brake, ca.fmax(most, 0))
        yield self.regenerated == limited(ca.fmin(v / self.v_fade, w / self.w_fade)) * force

    def _braking(self, v: Symbol, w: Symbol) -> Symbol:
        """The torque of the machine for the recovered force, which is zero unless both turn forward."""
        return self.regenerated * v / ca.fmax(w, STILL)

    def _most(self, w: Symbol, accepted: Symbol) -> Symbol:
        """The largest driving torque that machine and battery permit at the machine's speed ``w``; backward, it gives ``accepted``."""
        most = drawing(self.discharge_power.value, w, self.limit.value, self.added_loss.value)
        given = ca.fmax(-self.limit.value * w, 0)
        return most * limited((ca.fmax(accepted, 0) + ROLLING) / (given + ROLLING))


class ElectricDriveControl(BlendedBraking):
    """Divides pedals between a machine and the friction brakes (series blending: the machine brakes first).

    tau = min(accelerator limit, most) - regenerated v/w,  friction = brake - regenerated/F_brake
    regenerated = fade min(brake F_brake, F_most, limit w/v, charge_power/v) with v at least 0.1 m/s
    fade = min(v/v_fade, w/w_fade) within 0..1

    ``most`` is that of ``BlendedBraking``. ``regenerated`` [N] is the regenerative braking force, without the losses of the gears. The
    friction brakes supply the rest of the demand, so the car brakes equally with a full and with an empty battery. F_brake is the force of
    all brakes with the pedal fully pressed, F_most the largest regenerative force on the driven axle. Regeneration fades out towards
    standstill. With F_most = 0 there is none. ``limit`` is the largest torque of the machine at its speed, an input from the vehicle.
    Source: L. Guzzella, A. Sciarretta, Vehicle Propulsion Systems, 3rd ed., Springer 2013, section 2.3.
    """

    v: Input = signal_input("m/s", "Speed of the vehicle")
    w: Input = signal_input("rad/s", "Speed of the machine")
    tau: Output = signal_output("N.m", "Torque of the machine")

    def asked(self) -> Symbol:
        """The power [W] that the driver asks of the machine, also where the battery limits it; at standstill as at the speed w_fade."""
        driving = self.accelerator.value * self.limit.value * ca.fmax(self.w.value, self.w_fade)
        return driving - self.regenerated * self.v.value

    def equations(self) -> Equations:
        """Pedals to torque."""
        v, w = self.v.value, self.w.value
        yield from self._recover(v, w, self.charge_power.value)
        driving = ca.fmin(self.accelerator.value * self.limit.value, self._most(w, self.charge_power.value))
        yield self.tau.value == driving - self._braking(v, w)
        yield self.friction.value == self.brake.value - self.regenerated / self.F_brake
