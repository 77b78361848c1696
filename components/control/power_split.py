"""Control of a power-split hybrid: power and speed of the engine, and torques of the machines."""

from __future__ import annotations

from typing import Any

import casadi as ca

from powertrain import (
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    Variable,
    parameter,
    signal_input,
    signal_output,
    switch,
    variable,
)
from powertrain.components.control.electric_drive import BlendedBraking
from powertrain.components.control.hybrid import HybridControl, HybridSupervisor
from powertrain.components.limited import limited

OVER = 40.0
"""Excess of speed over w_ref [rad/s] above which the engine's torque is reduced, to zero at twice this excess."""
LEAST = 1e-3
"""Smallest share of the engine's power that machine 1 generates in the limit of this power, which avoids a division by zero."""


class PowerSplit(HybridSupervisor, BlendedBraking):
    """Partial: the torques of an engine at the carrier, machine 1 at the sun and machine 2 at the ring of a planetary gear.

    w_ref = w_best, 0 while the engine is off, within (ratio w_ring - w_sun)/(1 + ratio)..(ratio w_ring + w_sun)/(1 + ratio)
    torque = power/w, at most tau_open
    tau_1 = held - torque/(1 + ratio),  direct = ratio (torque/(1 + ratio) - held)
    tau_2 = min(tau_full accelerator - direct, most) - regenerated v/w_ring
    held = k_w (w_ref - w) within -tau_held..tau_held,  slowing = -(1 + ratio) held w
      torque w + slowing at most charge_power + asked,  generated torque w + slowing at most charge_power + limit w_ring
    asked = tau_full accelerator w_ring,  generated = 1 - ratio w_ring/((1 + ratio) w)
      held is at least zero while the engine is off, torque is zero until it fires and where it overspeeds

    The subclass decides when the engine runs and what power it should give; the battery covers the difference to the power demanded.
    Machine 1 generates the share ``generated`` of the engine's power. It keeps the engine at the speed of lowest fuel consumption for its
    power, turns within -w_sun..w_sun, and starts the engine with the same speed control. Where the ring is so fast that machine 1 would
    exceed w_sun with a stopped engine, it turns the engine without fuel. Machine 2 supplies the missing torque at the
    ring, and brakes as in ``BlendedBraking``, with the charge power that is left after the power of the engine and the energy released when
    it slows down. ``charge_power`` is for both machines, ``discharge_power`` for machine 2, after machine 1; ``most`` is computed as in
    ``BlendedBraking``.

    The vehicle supplies the data of the engine: ``w_best`` is the speed of lowest fuel consumption for the output ``power``, ``tau_open``
    the torque with an open throttle, ``opening`` the throttle for the output ``torque``.
    """

    ratio: Parameter = parameter("1", "Teeth of the ring over teeth of the sun", default=2.6, above=0)
    tau_full: Parameter = parameter(
        "N.m", "Torque at the ring with the accelerator fully pressed", default=450.0, above=0
    )
    k_w: Parameter = parameter("N.m.s/rad", "Torque of machine 1 for the engine's speed", default=1.0, above=0)
    w_sun: Parameter = parameter("rad/s", "Maximum speed of machine 1", default=1000.0, above=0)
    tau_held: Parameter = parameter("N.m", "Maximum torque of machine 1 for speed control", default=30.0, above=0)
    w_ring: Input = signal_input("rad/s", "Speed of the ring")
    w_best: Input = signal_input("rad/s", "Engine speed of least fuel for the power")
    tau_1: Output = signal_output("N.m", "Torque of machine 1")
    tau_2: Output = signal_output("N.m", "Torque of machine 2")
    w_ref: Variable = variable("rad/s", "Speed of least fuel for the engine's power")

    def speeds_of_carrier(self, w_ring: Any) -> tuple[Any, Any]:
        """The lowest and the highest speed of the carrier [rad/s] at which machine 1 turns within -w_sun..w_sun."""
        sun = self.ratio * w_ring
        return (sun - self.w_sun) / (1 + self.ratio), (sun + self.w_sun) / (1 + self.ratio)

    def _split(self, running: Symbol, demand: Symbol) -> Equations:
        """Pedals, power, engine, machines; the engine runs (1) or not (0) and gives the power ``demand``."""
        v, w, w_ring = self.v.value, self.w.value, self.w_ring.value
        wanted, accepted = self.tau_full * self.accelerator.value, self.charge_power.value
        asked, carrier = wanted * w_ring, (1 + self.ratio) * ca.fmax(w, self.w_fire)
        generated = ca.fmax(1 - self.ratio * w_ring / carrier, LEAST)
        electric = accepted + self.limit.value * ca.fmax(w_ring, 0)  # taken by battery and machine 2
        yield self.power.value == self._within(demand, ca.fmin(asked + accepted, electric / generated))
        slowest, fastest = self.speeds_of_carrier(w_ring)
        yield self.w_ref == limited(running * self.w_best.value, slowest, fastest)
        firing = running * limited(w / self.w_fire) * limited(2 - (w - self.w_ref) / OVER)
        torque = firing * ca.fmin(self.power.value / ca.fmax(w, self.w_fire), self.tau_open.value)
        yield self.torque.value == torque
        left = accepted - torque * w
        spare = ca.fmin(left + asked, electric - generated * torque * w)
        slowing = limited(spare / carrier, 0, self.tau_held)
        held = limited(self.k_w * (self.w_ref - w), -running * slowing, self.tau_held)
        yield from self._recover(v, w_ring, left + ca.fmin(held, 0) * carrier)
        direct = self.ratio * (torque / (1 + self.ratio) - held)
        yield self.throttle.value == firing * self.opening.value
        yield self.tau_1.value == held - torque / (1 + self.ratio)
        yield self.tau_2.value == ca.fmin(wanted - direct, self._most(w_ring, left)) - self._braking(v, w_ring)
        yield self.friction.value == self.brake.value - self.regenerated / self.F_brake


class PowerSplitControl(PowerSplit, HybridControl):
    """Rules for an engine at the carrier, machine 1 at the sun and machine 2 at the ring of a planetary gear.

    The torques are those of ``PowerSplit``, the engine is started and stopped as in ``HybridControl``, with
    asked = tau_full accelerator max(w_ring, w_fade),  electric = battery_power
    power = demand, at least P_min, within the limits of ``PowerSplit``
    """

    def equations(self) -> Equations:
        """The demand, the engine's switch, and the split."""
        asked = self.tau_full * self.accelerator.value * ca.fmax(self.w_ring.value, self.w_fade)
        yield from self._switch(asked, self.battery_power.value)
        yield from self._split(self.running, self.demand)


class PlannedPowerSplit(PowerSplit):
    """A power split whose engine is switched, and given a power, from outside: by a plan over time or a supervisor.

    The equations are those of ``PowerSplit``; the engine runs where engine_on > 0.5, and power = engine_power, at least P_min, within
    the limits of ``PowerSplit``. Both are inputs of the model:
    ``inputs={"control.engine_on": (times, values), "control.engine_power": (times, values)}``.
    """

    engine_on: Input = signal_input("1", "1: the engine runs, 0: it is stopped", default=0.0, outside=True)
    engine_power: Input = signal_input("W", "Power demanded of the running engine", default=0.0, outside=True)

    def equations(self) -> Equations:
        """As planned."""
        running = switch(self.engine_on.value > 0.5, 1.0, 0.0)
        yield self.on.value == running
        yield from self._split(running, self.engine_power.value)
