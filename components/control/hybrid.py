"""Rules of hybrids: when the engine runs, and how much of the demand it covers."""

from __future__ import annotations

import casadi as ca

from powertrain import (
    Component,
    Discrete,
    Equations,
    Input,
    Output,
    Parameter,
    Symbol,
    Variable,
    discrete,
    parameter,
    reinit,
    signal_input,
    signal_output,
    time,
    variable,
    when,
)
from powertrain.components.control.electric_drive import BlendedBraking
from powertrain.components.control.interfaces import LONG, Switching
from powertrain.components.limited import limited

PRESSED = 0.05
"""Accelerator position from which on the engine delivers power."""
ALONE = 0.5
"""Share of the power without the engine below which the driver's demand lets the engine stop."""


class HybridSupervisor(Component):
    """Partial: decides whether the engine of a hybrid runs, and its power and torque.

    The vehicle supplies the data of the engine: ``tau_open`` is the torque with an open throttle, ``opening`` the throttle for the output
    ``torque``.
    """

    P_min: Parameter = parameter("W", "Minimum power of the running engine", default=5e3, min=0)
    w_fire: Parameter = parameter("rad/s", "Speed from which the engine delivers power", default=90.0, above=0)
    v: Input = signal_input("m/s", "Speed of the vehicle")
    w: Input = signal_input("rad/s", "Speed of the engine")
    soc: Input = signal_input("1", "State of charge")
    battery_power: Input = signal_input("W", "Maximum discharge power of the battery", default=1e9)
    tau_open: Input = signal_input("N.m", "Torque of the engine with an open throttle")
    opening: Input = signal_input("1", "Throttle of the engine for the torque")
    power: Output = signal_output("W", "Power demand on the engine")
    torque: Output = signal_output("N.m", "Torque demand on the engine")
    on: Output = signal_output("1", "1: the engine runs, 0: it is stopped")
    throttle: Output = signal_output("1", "Throttle of the engine")

    def _within(self, demand: Symbol, accepted: Symbol) -> Symbol:
        """Power of the running engine: the demand, at least P_min, but at most what vehicle and battery accept."""
        return ca.fmin(ca.fmax(demand, self.P_min), ca.fmax(accepted, 0))


class HybridControl(HybridSupervisor, Switching):
    """Partial: starts and stops the engine of a hybrid depending on power demand and vehicle speed.

    engine on from demand > P_on, asked > electric or |v| > v_on,  off from demand < P_off, asked < electric/2 and |v| < v_off,
    if it has run or stood for t_least
    demand = asked + min(k_soc (soc_0 - soc), charge_power),  at least asked - electric

    ``asked`` is the power that the driver asks for, ``electric`` what the machine can give without the engine. A charge below soc_0
    increases the demand. A charge far above soc_0 keeps the engine off until the driver asks for more than ``electric``: a plug-in hybrid
    that starts with a full battery drives electrically until the charge approaches soc_0, and then sustains the charge. The battery does
    not limit the power for starting the engine.
    """

    k_soc: Parameter = parameter("W", "Power per deviation of the state of charge", default=100e3, min=0)
    soc_0: Parameter = parameter("1", "Set point of the state of charge", default=0.6, min=0, max=1)
    P_on: Parameter = parameter("W", "Power demand above which the engine runs", default=9e3)
    P_off: Parameter = parameter("W", "Power demand below which the engine stops", default=4e3)
    v_on: Parameter = parameter("m/s", "Vehicle speed from which the engine always runs", default=22.0, above=0)
    v_off: Parameter = parameter("m/s", "Vehicle speed below which the engine may stop", default=20.0, above=0)
    t_least: Parameter = parameter("s", "Minimum time between starts and stops", default=4.0, min=0)
    charge_power: Input = signal_input("W", "Maximum charge power of the battery", default=1e9)
    demand: Variable = variable("W", "Power demand of vehicle and battery")
    running: Discrete = discrete("1", "1: the engine runs, 0: it is stopped", start=0.0)
    since: Discrete = discrete("s", "Time of the last start or stop", start=-LONG)

    def check(self) -> Equations:
        """The switch must have a hysteresis."""
        yield self.P_off < self.P_on
        yield self.v_off < self.v_on

    def initial(self) -> Equations:
        """The engine may start at once."""
        yield from super().initial()
        yield self.since == time - LONG

    def _switch(self, asked: Symbol, electric: Symbol) -> Equations:
        """The demand; start and stop with hysteresis in power and speed; the signal to the engine."""
        charging = ca.fmin(self.k_soc * (self.soc_0 - self.soc.value), self.charge_power.value)
        yield self.demand == asked + ca.fmax(charging, -electric)
        speed, rested = ca.fabs(self.v.value), ca.logic_and(time > self.since + self.t_least, self._begun())
        needed = ca.logic_or(ca.logic_or(self.demand > self.P_on, asked > electric), speed > self.v_on)
        alone = ca.logic_and(self.demand < self.P_off, asked < ALONE * electric)
        idle = ca.logic_and(alone, speed < self.v_off)
        start = ca.logic_and(ca.logic_and(needed, rested), self.running < 0.5)
        stop = ca.logic_and(ca.logic_and(idle, rested), self.running > 0.5)
        yield when(start, reinit(self.running, 1), reinit(self.since, time))
        yield when(stop, reinit(self.running, 0), reinit(self.since, time))
        yield self.on.value == self.running


class ParallelControl(HybridControl, BlendedBraking):
    """Rules for an engine and a machine whose powers add up on their way to the wheels.

    asked = accelerator F_max (max(v, 0) + v_0),  electric = min(limit w_machine, battery_power),  w_machine at least w_low
    power = demand, at least P_min, at most asked + charge_power
    torque = running pressed (w/w_fire within 0..1) min(power/w, tau_open),  w in power/w at least w_fire
    pressed = accelerator/0.05 within 0..1
    tau = coupled (min(rest/w_machine, most) - regenerated v/w_machine),  w_machine at least w_low in rest/w_machine
    rest = max(asked pressed - arriving w, 0) - turning min(max(arriving w_shaft - asked pressed, 0), left),  w_shaft within 0..w
    arriving = matched torque,  matched = 1 once w > w_fire and slip < 0 after a start of the engine, 0 from its stop
    left = charge_power - regenerated v,  turning = w_machine/w_fade within 0..1
    friction = brake - coupled regenerated/F_brake,  regenerated and most as in ``ElectricDriveControl``

    While the engine is stopped the machine drives alone. While it runs, it covers the driver's demand and the charge, and the machine
    supplies the difference: it assists if the engine gives too little, and charges if it gives more. ``w_shaft`` is the speed of the shaft
    between the engine's clutch and the machine: behind a slipping clutch there is less power for charging than the engine delivers, and
    none at standstill. A machine on the crankshaft is ``coupled`` to the wheels as far as the clutch is closed.
    The vehicle closes the clutch only when the engine is ``matched``: an engine that is started while the car drives first reaches the
    speed of the gearbox with its own torque, and the machine drives alone until then. ``slip`` is the speed of the gearbox over that of
    the engine.
    """

    F_max: Parameter = parameter("N", "Tractive force with the accelerator fully pressed", default=6000.0, above=0)
    v_0: Parameter = parameter("m/s", "Equivalent speed for the power demand at standstill", default=2.0, above=0)
    w_low: Parameter = parameter("rad/s", "Speed of the machine below which power is torque", default=40.0, above=0)
    w_machine: Input = signal_input("rad/s", "Speed of the machine")
    w_shaft: Input = signal_input("rad/s", "Speed of the shaft between the engine and the machine, behind the clutch")
    coupled: Input = signal_input("1", "Part of the machine's torque that reaches the wheels", default=1.0)
    slip: Input = signal_input("rad/s", "Speed of the clutch's gearbox side over that of the engine", default=-1.0)
    tau: Output = signal_output("N.m", "Torque of the machine")
    matched: Discrete = discrete("1", "1: the engine has reached the speed of the gearbox, 0: not yet", start=0.0)
    asked: Variable = variable("W", "Power demand of the driver")

    def equations(self) -> Equations:
        """Pedals, engine, machine, brakes."""
        v, w, w_machine, coupled = self.v.value, self.w.value, self.w_machine.value, limited(self.coupled.value)
        yield self.asked == self.accelerator.value * self.F_max * (ca.fmax(v, 0) + self.v_0)
        machine = self.limit.value * ca.fmax(w_machine, self.w_low)
        yield from self._switch(self.asked, ca.fmin(machine, self.battery_power.value))
        yield from self._match()
        yield self.power.value == self._within(self.demand, self.asked + self.charge_power.value)
        pressed = limited(self.accelerator.value / PRESSED)
        firing = self.running * limited(w / self.w_fire) * pressed
        yield self.torque.value == firing * ca.fmin(self.power.value / ca.fmax(w, self.w_fire), self.tau_open.value)
        yield self.throttle.value == firing * self.opening.value
        most = self._most(w_machine, self.charge_power.value)
        yield from self._recover(v, w_machine, self.charge_power.value)
        drive = ca.fmin(self._rest(self.asked * pressed) / ca.fmax(w_machine, self.w_low), most)
        yield self.tau.value == coupled * (drive - self._braking(v, w_machine))
        yield self.friction.value == self.brake.value - coupled * self.regenerated / self.F_brake

    def _match(self) -> Equations:
        """An engine that fires is matched when it is as fast as the gearbox; it remains so until it stops."""
        runs, fires = ca.logic_and(self.running > 0.5, self._begun()), self.w.value > self.w_fire
        yield when(ca.logic_and(runs, ca.logic_and(fires, self.slip.value < 0)), reinit(self.matched, 1))
        yield when(self.running < 0.5, reinit(self.matched, 0))

    def _rest(self, asked: Symbol) -> Symbol:
        """Power of the machine: the engine's deficit, or the surplus of its power that arrives behind the clutch."""
        torque, w = self.matched * self.torque.value, self.w.value
        spare = ca.fmax(torque * limited(self.w_shaft.value, 0, w) - asked, 0)
        left = self.charge_power.value - self.regenerated * self.v.value
        charging = ca.fmin(spare, left) * limited(self.w_machine.value / self.w_fade)
        return ca.fmax(asked - torque * w, 0) - charging


class GensetControl(HybridControl):
    """Rules for an engine that drives a generator, without a shaft to the wheels.

    electric = battery_power,  power = demand within P_min..P_most, at most max(load, 0) + charge_power
    torque = running (w/w_fire within 0..1) min(power/w, tau_open),  tau = running held - torque
    held = k_w (w_best - w) within -slowing..tau_held,  slowing = (charge_power + load)/w - torque within 0..tau_held
    w in denominators at least w_fire

    ``load`` is the power of the machine that drives the vehicle, ``asked`` what the driver asks of it. The generator keeps the engine at
    the speed of lowest fuel consumption for its power, and starts it with the same speed control. It slows the engine down only as fast as
    battery and load absorb the power.
    """

    P_most: Parameter = parameter("W", "Maximum power of the engine", default=60e3, above=0)
    k_w: Parameter = parameter("N.m.s/rad", "Torque of the generator for the engine's speed", default=1.0, above=0)
    tau_held: Parameter = parameter("N.m", "Maximum torque of the generator for speed control", default=40.0, above=0)
    load: Input = signal_input("W", "Power of the machine that drives the vehicle")
    asked: Input = signal_input("W", "Power that the driver asks of this machine, also where the battery limits it")
    w_best: Input = signal_input("rad/s", "Engine speed of least fuel for the power")
    tau: Output = signal_output("N.m", "Torque of the generator")

    def check(self) -> Equations:
        """The range of the power must not be empty."""
        yield from super().check()
        yield self.P_min <= self.P_most

    def equations(self) -> Equations:
        """Engine and generator."""
        w = self.w.value
        yield from self._switch(self.asked.value, self.battery_power.value)
        accepted = ca.fmax(self.load.value, 0) + self.charge_power.value
        yield self.power.value == self._within(self.demand, ca.fmin(accepted, self.P_most))
        firing = self.running * limited(w / self.w_fire)
        yield self.torque.value == firing * ca.fmin(self.power.value / ca.fmax(w, self.w_fire), self.tau_open.value)
        yield self.throttle.value == firing * self.opening.value
        most = (self.charge_power.value + self.load.value) / ca.fmax(w, self.w_fire) - self.torque.value
        slowing = limited(most, 0, self.tau_held)
        held = limited(self.k_w * (self.w_best.value - w), -slowing, self.tau_held)
        yield self.tau.value == self.running * held - self.torque.value
