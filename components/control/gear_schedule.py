"""Gear changes: a schedule of speeds with hysteresis, and the actions of clutch, lever and throttle during a shift."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Self

import casadi as ca

from powertrain import (
    Component,
    Discrete,
    Equations,
    Input,
    Output,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    discrete,
    parameter,
    reinit,
    signal_input,
    signal_output,
    switch,
    time,
    variable,
    when,
    within,
)
from powertrain.components.control.interfaces import LONG, Switching
from powertrain.components.control.shift_rule import (
    NEVER,
    PRESSED,
    RESUMED,
    Driving,
    KickLimits,
    ShiftRule,
    Shifts,
    beyond,
    kick_limits,
)
from powertrain.components.limited import limited
from powertrain.components.ratios import RATIO, gear_ratios
from powertrain.components.wheels.interfaces import Wheel

SPEED = parameter("rad/s", "Engine speed", above=0, max=3000)
SPEEDS = ((4.5, 2.5), (8.0, 6.0), (12.0, 9.5), (16.5, 13.0), (21.0, 17.5))
"""Shifts of a six-speed gearbox in m/s, with the accelerator released."""


class Shifting(Component):
    """Partial: operates the gear lever, the clutch and the throttle; the clutch closes with the speed of the engine."""

    w_open: Parameter = parameter("rad/s", "Engine speed below which the clutch is open", default=95.0, above=0)
    w_closed: Parameter = parameter("rad/s", "Engine speed at which the clutch is fully closed", default=160.0, above=0)
    kick: Parameter = parameter("1", "Accelerator position for kick-down", default=0.8, min=0, max=1)
    launch: Parameter = parameter(
        "rad/s", "Rise of w_open and w_closed at a start with the accelerator fully pressed", default=0.0, min=0
    )
    accelerator: Input = signal_input("1", "Accelerator pedal")
    v: Input = signal_input("m/s", "Speed of the vehicle")
    w: Input = signal_input("rad/s", "Speed of the engine")
    throttle: Output = signal_output("1", "Throttle of the engine")
    clutch: Output = signal_output("1", "Pressure of the clutch")
    lever: Output = signal_output("1", "Position of the gear lever")

    def check(self) -> Equations:
        """The clutch closes as the engine gets faster."""
        yield self.w_open < self.w_closed

    def _pressed(self, first: Symbol | float = 0.0) -> Symbol:
        """The pressure of the clutch, at which a fully pressed accelerator lets the engine rise further where ``first`` is 1."""
        rise = self.launch * beyond(self.kick, self.accelerator.value) * first
        return (self.w.value - self.w_open - rise) / (self.w_closed - self.w_open)


class FixedGear(Shifting):
    """A single gear that is always engaged, for measurements and for driving in reverse.

    lever = gear,  throttle = accelerator,  clutch = (w - w_open - rise)/(w_closed - w_open)
    rise = launch (accelerator - kick)/(1 - kick), at least 0

    ``gear`` is -1 for the reverse gear and 0 for neutral of an ``Automatic``. Cars reject a gear that their gearbox does not have. The
    vehicle starts in this gear, so ``launch`` counts in any; see ``GearSchedule``.
    """

    gear: Parameter = parameter("1", "Gear", default=1.0, min=-1)

    def equations(self) -> Equations:
        """No memory."""
        yield self.lever.value == self.gear
        yield self.throttle.value == self.accelerator.value
        yield self.clutch.value == self._pressed(1.0)


class SpeedSchedule(Shifting, Switching):
    """Partial: chooses the gear by the speed of the vehicle and the accelerator, see ``GearSchedule``."""

    interrupts: ClassVar[bool] = False
    """Whether a shift interrupts the torque: a kick-down then costs more than it gains, unless the shift speeds ask for it, and a shift may
    skip gears."""
    stages: ClassVar[tuple[str, ...]] = ()
    """The parameters whose sum is the duration of a shift."""

    speeds: Annotated[tuple[tuple[float, float], ...], "m/s"] = SPEEDS
    eager: Parameter = parameter(
        "1", "Relative increase of the upshift speed with the accelerator fully pressed", default=1.0, min=0
    )
    relaxed: Parameter = parameter(
        "1", "Accelerator position up to which shift speeds do not change", default=0.0, min=0, max=0.99
    )
    patience: Parameter = parameter("s", "Time after a kick-down without upshifts", default=10.0, min=0)
    dwell: Parameter = parameter("s", "Minimum time between shifts", default=2.0, above=0)
    braking: Parameter = parameter(
        "1", "Relative increase of the shift speeds while the driver slows down", default=0.0, min=0
    )
    gear: Discrete = discrete("1", "Gear that is engaged, or will be", start=1.0)
    before: Discrete = discrete("1", "Gear before the last shift", start=1.0)
    began: Discrete = discrete("s", "Time at which the last shift began", start=-LONG)
    kicked: Discrete = discrete("s", "Time of the last kick-down", start=-LONG)
    slowing: Discrete = discrete("1", "1 while the driver slows down, with braking above 0", start=0.0)
    brake: Input = signal_input("1", "Brake pedal", default=0.0)
    grade: Input = signal_input("1", "Slope of the road, tan(alpha), positive uphill", default=0.0)
    w_earliest: Input = signal_input(
        "rad/s", "Engine speed below which a fully pressed accelerator does not shift up", default=0.0
    )
    w_latest: Input = signal_input("rad/s", "Engine speed above which it shifts up wherever v > up", default=NEVER)
    w_down: Input = signal_input(
        "rad/s", "Engine speed below which a fully pressed accelerator shifts down", default=0.0
    )
    w_kick: Input = signal_input("rad/s", "Engine speed above which there is no kick-down", default=NEVER)

    def check(self) -> Equations:
        """A shift ends before the next one begins; otherwise lever, clutch and throttle would jump."""
        yield from super().check()
        yield sum(getattr(self, stage) for stage in self.stages) <= self.dwell  # a shift ends before the next one

    def initial(self) -> Equations:
        """No shift is going on, and no kick-down is remembered; the gear is one of the schedule."""
        yield from super().initial()
        last = len(self.speeds) + 1
        within(self.gear, 1, last, name="gear", unit="1")
        within(ca.fmod(self.gear, 1), 0, 0, name=f"fraction of the gear, a whole number from 1 to {last}", unit="1")
        yield self.began == time - LONG
        yield self.kicked == time - LONG

    @classmethod
    def for_gears(
        cls,
        ratios: Sequence[float],
        final_drive: float,
        *,
        radius: float | str = 0.3,
        w_up: float | str = 180.0,
        w_full: float | str = 560.0,
        down: float = 0.75,
        **options: Any,
    ) -> Self:
        """A schedule for gears of these ratios, a final drive and wheels of a radius [m], or a tyre size such as "205/55R16".

        With the accelerator released it shifts up where the next gear gives the engine the speed ``w_up`` [rad/s], and down at ``down``
        times that vehicle speed. With the accelerator fully pressed it shifts up before the engine exceeds ``w_full`` [rad/s], or where the
        next gear pulls harder, if that is later; ``w_limit`` of the engine is the limit that it never exceeds.
        Speeds with another unit, such as "5500 rpm", are converted.
        Errors: ParameterError for fewer than two ratios, for ratios that do not decrease, for values that are not positive, and for a
        ``w_full`` that is exceeded with the accelerator released.
        """
        cls._check_names(options, "radius", "w_up", "w_full", "down")
        where = f"{cls.__name__}.for_gears"
        ratios = gear_ratios(where, [ratios])
        if len(ratios) < 2 or any(one <= other for one, other in pairwise(ratios)):
            raise ParameterError(
                f"{where}: {ratios} are not two or more ratios that decrease from gear to gear; give a list, as in "
                f"{where}([3.6, 2.1, 1.4], 4.1)"
            )
        final_drive = RATIO.check(final_drive, f"{where}: final_drive")
        r = Wheel.radius.check(radius, f"{where}: radius")
        low, full = SPEED.check(w_up, f"{where}: w_up"), SPEED.check(w_full, f"{where}: w_full")
        ups = [low * r / (ratio * final_drive) for ratio in ratios[1:]]
        released = low * max(one / other for one, other in pairwise(ratios))
        if full < released:
            raise ParameterError(
                f"{where}: w_full = {full:g} rad/s is less than {released:.4g} rad/s, from which the engine shifts over the largest step "
                f"to w_up = {low:g} rad/s with the accelerator released"
            )
        eager = full / released - 1
        made: dict[str, Any] = {"speeds": tuple((up, down * up) for up in ups), "eager": eager}
        return cls(**(made | options))

    def shifts(self, now: Driving, limits: KickLimits) -> Shifts:
        """Which shift is due."""
        pause = sum((getattr(self, stage) for stage in self.stages), Symbol(0.0)) if self.interrupts else 0.0
        rule = ShiftRule(
            self.speeds,
            self.eager,
            self.relaxed,
            self.kick,
            self.patience,
            self.braking,
            skips=self.interrupts,
            pause=pause,
        )
        return rule.shifts(now, limits)

    def kick_limits(self, gear: Symbol, before: Sequence[float], after: Sequence[float]) -> KickLimits:
        """Its limits in a ``gear``, from the engine speeds [rad/s] before and after each upshift at which two gears pull equally hard."""
        return kick_limits(self.speeds, gear, before, after, interrupts=self.interrupts)

    def pulled(self, before: Sequence[float], after: Sequence[float]) -> Equations:
        """Supply the engine speeds of ``kick_limits``."""
        yield from self.supplied(self.kick_limits(self.gear, before, after))

    def supplied(self, limits: KickLimits) -> Equations:
        """Supply the engine speeds [rad/s] for shifts with a pressed accelerator."""
        yield self.w_earliest.value == limits.earliest
        yield self.w_latest.value == limits.latest
        yield self.w_down.value == limits.down
        yield self.w_kick.value == limits.kick

    def _choose(self) -> Equations:
        self._check()
        now = Driving(
            self.v.value,
            self.w.value,
            self.accelerator.value,
            self.gear,
            time - self.kicked,
            self.slowing,
            self.grade.value,
        )
        limits = self.w_earliest, self.w_latest, self.w_down, self.w_kick
        due = self.shifts(now, KickLimits(*(limit.value for limit in limits)))
        rested = ca.logic_and(time - self.began > self.dwell, self._begun())
        marks = reinit(self.before, self.gear), reinit(self.began, time)
        yield when(ca.logic_and(due.up, rested), reinit(self.gear, due.above), *marks)
        yield when(ca.logic_and(due.down, rested), reinit(self.gear, due.below), *marks)
        kicks = ca.logic_and(due.kick_down, rested)
        yield when(kicks, reinit(self.gear, self.gear - 1), reinit(self.kicked, time), *marks)
        brakes = ca.logic_and(self._begun(), ca.logic_and(self.brake.value > PRESSED, self.braking > 0))
        yield when(brakes, reinit(self.slowing, 1))
        yield when(ca.logic_and(self.accelerator.value > RESUMED, self.slowing > 0), reinit(self.slowing, 0))

    def _check(self) -> None:
        where = f"{self._label}.speeds"
        for k, (up, down) in enumerate(self.speeds, 1):
            if not 0 < down < up:
                raise ParameterError(
                    f"{where}: up from gear {k} at {up:g} m/s, down to it at {down:g} m/s; 0 < down < up is required"
                )
        for k, (one, other) in enumerate(pairwise(self.speeds), 1):
            if not (one[0] < other[0] and one[1] < other[1]):
                raise ParameterError(f"{where}: the rows of gears {k} and {k + 1} are not in order: {one}, {other} m/s")


class GearSchedule(SpeedSchedule):
    """Changes gears depending on the vehicle speed: opens the clutch, moves the lever and closes the clutch, with the throttle closed.

      up from gear to gear + 1 where v > up max(1 + eager pressed, held) and w > depth w_earliest, or v > up and w > w_latest
      and v - lost > least
      lost = g sin(alpha) (duration of a shift),  least = max(min(down (1 + eager pressed), (up + down)/2), down held)
      down to gear where v < least
      kick-down to gear where accelerator > kick and v < down (1 + eager pressed) and w < w_kick, unless the next gear pulls harder
      pressed = (accelerator - relaxed)/(1 - relaxed), at least 0
      depth = (accelerator - kick)/(1 - kick), at least 0
      held = 1 + braking from where brake > 0.01 to where accelerator > 0.2, else 1
      t = time since the shift began:  0..t_open: hold falls from 1 to 0;  ..+ t_lever: the lever goes to the new gear;
      ..+ t_close: hold rises to 1
    throttle = hold accelerator,  clutch = min(hold, (w - w_open - rise)/(w_closed - w_open))
    rise = depth launch in first gear, else 0

    ``speeds`` are the rows (up, down) [m/s] between the first and the second gear, the second and the third, and so on; down lies below up,
    and the difference is the hysteresis; "15 km/h" is converted. A shift leads at once to the gear that is due, across gears between them;
    the lever passes neutral. On a grade, tan(alpha) = ``grade``, it does not shift up where the vehicle would lose so much speed meanwhile
    that the next downshift would follow. A pressed accelerator shifts up later and, up to the middle between both speeds, down earlier, so
    no movement of the pedal alone shifts up and down again. A kick-down shifts down further; for the time ``patience`` after it, it shifts
    up only where v > up (1 + eager), or where v > up and w > w_latest. Between ``kick`` and the fully pressed accelerator the upshift moves
    to the engine speed from which the next gear pulls harder, and never lies beyond it. Cars supply this speed, ``w_earliest`` and
    ``w_latest``, and ``w_kick`` from ``pull_speeds(engine, ratios)``, so a fully pressed accelerator gives the best acceleration and the
    highest speed. ``w_kick`` is down/up times the engine speed after the upshift to the present gear at which both gears pull equally hard;
    a kick-down above it would give less force, and the next upshift would follow. Without these speeds only the shift speeds count. With
    ``braking`` the engine brakes in a lower gear while the driver slows down, and on a descent until he presses the accelerator again; the
    engine then turns up to 1 + ``braking`` times as fast as at the upshift. Shifts are at least ``dwell`` apart. The clutch closes with the
    engine speed like a centrifugal clutch: below w_open it is open, so the vehicle starts and stops in first gear. A driver who wants the
    best acceleration lets the engine rise further and holds it there with the slipping clutch until the vehicle has caught up; ``launch``
    is this rise.
    Errors: ParameterError for speeds without hysteresis or not in order, and for a shift that takes longer than ``dwell``.
    """

    interrupts: ClassVar[bool] = True
    stages: ClassVar[tuple[str, ...]] = "t_open", "t_lever", "t_close"
    t_open: Parameter = parameter("s", "Time in which the clutch opens and the throttle closes", default=0.15, above=0)
    t_lever: Parameter = parameter("s", "Time in which the lever goes from gear to gear", default=0.25, above=0)
    t_close: Parameter = parameter("s", "Time in which the clutch closes and the throttle opens", default=0.3, above=0)
    hold: Variable = variable("1", "Clutch pedal: 1 released, 0 pressed")

    def equations(self) -> Equations:
        """When to shift, and the sequence of a shift."""
        yield from self._choose()
        yield from self._shift(time - self.began)
        yield self.throttle.value == self.hold * self.accelerator.value
        yield self.clutch.value == ca.fmin(self._pressed(limited(2 - self.gear)), self.hold)

    def _shift(self, t: Symbol) -> Equations:
        moved, closing = self.t_open + self.t_lever, self.t_open + self.t_lever + self.t_close
        first, second, third = t < self.t_open, t < moved, t < closing
        closed = switch(third, (t - moved) / self.t_close, 1.0, continuous=True)
        pressed = switch(second, 0.0, closed, continuous=True)
        yield self.hold == switch(first, 1 - t / self.t_open, pressed, continuous=True)
        way = switch(second, (t - self.t_open) / self.t_lever, 1.0, continuous=True)
        moved = switch(first, 0.0, way, continuous=True)
        gears, last = self.gear - self.before, limited(self.gear - self.before, -1, 1)
        across = switch(ca.logic_and(moved > 1 / 2, ca.fabs(gears) > 1), gears - last, 0.0)
        yield self.lever.value == self.before + last * moved + across


class PowerShiftSchedule(SpeedSchedule):
    """Changes gears depending on the vehicle speed without interrupting the torque, for gearboxes with overlapping clutches.

    The gear is chosen as by ``GearSchedule``, but a pressed accelerator also kicks down to a gear that pulls harder:
      kick-down to gear where accelerator > kick and w < w_kick and (v < down (1 + eager pressed) or w < depth w_down)
    t = time since the shift began, 0..t_shift: the lever moves uniformly to the new gear
    throttle = accelerator (1 - cut 4 x (1 - x)) in an upshift with x = t/t_shift within 0..1, else accelerator
    clutch = (w - w_open - rise)/(w_closed - w_open)

    ``w_down`` is ``w_kick`` if the gearbox states its ratios, else 0. In an upshift the engine gives up kinetic energy; ``cut`` reduces its
    torque meanwhile, so that the shift is not felt as a push.
    Errors: as for ``GearSchedule``.
    """

    stages: ClassVar[tuple[str, ...]] = ("t_shift",)
    t_shift: Parameter = parameter("s", "Duration of a shift", default=0.4, above=0)
    cut: Parameter = parameter(
        "1", "Part of the throttle taken back in the middle of an upshift", default=0.0, min=0, max=1
    )

    def equations(self) -> Equations:
        """When to shift, and the position of the lever."""
        yield from self._choose()
        t = time - self.began
        way = switch(t < self.t_shift, t / self.t_shift, 1.0, continuous=True)
        up = limited(self.gear - self.before)
        yield self.lever.value == self.before + (self.gear - self.before) * way
        yield self.throttle.value == self.accelerator.value * (1 - self.cut * up * 4 * way * (1 - way))
        yield self.clutch.value == self._pressed(limited(2 - self.gear))
