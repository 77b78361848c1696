"""Gearboxes that shift under load, and the starting devices in front of them."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca

from powertrain import (
    Equations,
    Input,
    Map,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    connect,
    der,
    parameter,
    signal_input,
    variable,
    within,
)
from powertrain.components.cvu import CVU
from powertrain.components.differentials.churning import ChurningLoss
from powertrain.components.limited import limited
from powertrain.components.rotational import Clutch, Inertia, TwoFlanges
from powertrain.components.transmissions.gearbox import Shiftable
from powertrain.components.transmissions.hydrodynamic import TorqueConverter

HANDOVER = 4
"""How steeply the torque passes from one clutch to the other: 1 - 0.75^4 = 0.68 of it in a quarter of the lever's way."""
PRESSED = 0.02
"""Position from which a pedal counts as pressed."""
LEAST = 1e-4
"""Smallest share of the power that a slipping clutch may pass on; at zero no torque could turn the output."""


class ShiftedGears(CVU):
    """The gears of a power-shift gearbox, whose clutches slip between two gears; see ``PowerShiftGearbox``.

    The efficiencies are ``passed_ab`` eta_ab if flange_a drives and ``passed_ba`` eta_ba if flange_b drives. A share outside (0, 1] ends
    a simulation with an error.
    """

    passed_ab: Input = signal_input(
        "1", "Part of the power that the slipping clutch passes on if flange_a drives", default=1.0
    )
    passed_ba: Input = signal_input(
        "1", "Part of the power that the slipping clutch passes on if flange_b drives", default=1.0
    )

    def _efficiency(self, name: str, constant: Symbol) -> Symbol:
        """That of the gears times that of the slipping clutch."""
        passed, driver = (self.passed_ab, "flange_a") if name == "map_ab" else (self.passed_ba, "flange_b")
        within(passed.value, LEAST, 1.0, name=f"power that the clutch passes on if {driver} drives", unit="1")
        return super()._efficiency(name, constant) * passed.value


class PowerShiftGearbox(Shiftable):
    """A planetary or dual-clutch gearbox by its ratios, which shifts under load while one clutch slips.

    w_b = V w_a,  V = 1/ratios[k] with the lever at k

    On its way from V_1 in one gear to V_2 > V_1 in the next, the input is faster than the higher gear would turn it and slower than the
    lower one would. If it drives, only the clutch of the higher gear can transmit its torque; if it is driven, only that of the lower gear:

    flange_a drives: T_b = -T_a/V_2, the power T_a (w_a - w_b/V_2) becomes heat, and passed_ab = V/V_2 is left
    flange_b drives: T_b = -T_a/V_1, the power T_a (w_a - w_b/V_1) becomes heat, and passed_ba = V_1/V is left

    V is linear in the lever. So that the torque does not jump, it passes to the clutch that carries it as the lever leaves one gear, or
    from it as the lever reaches the other: with the lever at x on this way, V_2 - (V_2 - V_1)(1 - x)^4 replaces V_2 above, and
    V_1 + (V_2 - V_1) x^4 replaces V_1. ``unit`` has the efficiency of the gears under load, ``churning`` the drag of oil, pump and open
    clutches at the input shaft. Errors: ParameterError for ratios that do not decrease.
    """

    ratios: tuple[float, ...] = (4.7, 3.1, 2.1, 1.7, 1.3, 1.0, 0.84, 0.67)
    unit: ShiftedGears = ShiftedGears(eta_ab=0.96, eta_ba=0.96)
    input: Inertia = Inertia(J=0.02)
    churning: ChurningLoss = ChurningLoss(d=0.01)
    output: Inertia = Inertia(J=0.01)

    @property
    def gear_count(self) -> int:
        """The number of ratios."""
        return len(self.ratios)

    @property
    def gear_ratios(self) -> tuple[float, ...]:
        """``ratios``."""
        return self.ratios

    def check(self) -> Equations:
        """Two or more ratios, positive and decreasing from gear to gear."""
        if len(self.ratios) < 2 or min(self.ratios) <= 0 or any(a <= b for a, b in pairwise(self.ratios)):
            raise ParameterError(
                f"{self._label}.ratios = {self.ratios}; give two or more positive ratios that decrease from gear "
                "to gear"
            )
        yield from ()

    def in_gear(self, k: int) -> PowerShiftGearbox:
        """Itself: with a constant lever it has one ratio."""
        return self

    def equations(self) -> Equations:
        """A variable ratio between two shafts."""
        gears, speeds = range(1, len(self.ratios) + 1), [1 / ratio for ratio in self.ratios]
        speed = Map.curve([float(k) for k in gears], speeds, x="lever", unit="1", name="speed ratio", outside="clip")
        yield connect(self.flange_a, self.input.flange_a)
        yield connect(self.input.flange_b, self.churning.flange, self.unit.flange_a)
        lever, last = self.lever.value, len(self.ratios) - 1
        k = limited(ca.floor(lever), 1, last)
        way, V_1, V_2 = limited(lever - k), speed(k), speed(k + 1)
        V = speed(lever)
        yield self.unit.ratio.value == V
        yield self.unit.passed_ab.value == V / (V_2 - (V_2 - V_1) * (1 - way) ** HANDOVER)
        yield self.unit.passed_ba.value == (V_1 + (V_2 - V_1) * way**HANDOVER) / V
        yield connect(self.unit.flange_b, self.output.flange_a)
        yield connect(self.output.flange_b, self.flange_b)


class StartingDevice(TwoFlanges):
    """Partial: lets the engine turn while the vehicle stands.

    A start clutch obeys the control by ``pressed``; the control of a converter with neutral idle reads the pedals ``brake`` and
    ``accelerator``. Each device ignores the inputs that it does not need.
    """

    pressed: Input = signal_input("1", "Demanded pressure of the clutch, 0 open to 1 closed", default=0.0)
    brake: Input = signal_input("1", "Brake pedal, 0 to 1", default=0.0)
    accelerator: Input = signal_input("1", "Accelerator pedal, 0 to 1", default=0.0)

    def lumped(self) -> StartingDevice:
        """The device with the brake released, as at operating points."""
        return self


class StartingClutch(StartingDevice):
    """A start clutch, dry or wet, that the control presses."""

    clutch: Clutch = Clutch(fn_max=300, mue_pos=((0.0, 1.0),))

    def equations(self) -> Equations:
        """The clutch."""
        yield connect(self.flange_a, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.flange_b)
        yield connect(self.pressed, self.clutch.f_normalized)


def _filling(pressure: Input, filled: Symbol, demand: Symbol, T_fill: Symbol) -> Equations:
    """Oil fills a clutch with a time constant and leaves it at once."""
    yield T_fill * der(filled) == demand - filled
    yield pressure.value == ca.if_else(filled < demand, filled, demand)


class StartingConverter(StartingDevice):
    """A torque converter whose lock-up clutch closes with the speed of its turbine.

    demand = (w_turbine - w_lock)/band within 0..1,  lockup = min(filled, demand),  T_fill der(filled) = demand - filled

    Oil fills the clutch with the time constant ``T_fill``, so that it slips to its new speed, and leaves it at once. It needs no control:
    ``pressed`` is ignored.
    """

    w_lock: Parameter = parameter("rad/s", "Speed of the turbine from which the lock-up closes", default=105.0, above=0)
    band: Parameter = parameter(
        "rad/s", "Range of the turbine's speed in which the lock-up closes", default=10.0, above=0
    )
    T_fill: Parameter = parameter("s", "Time constant of filling the lock-up clutch", default=0.3, above=0)
    converter: TorqueConverter = TorqueConverter()
    filled: Variable = variable("1", "Oil in the lock-up clutch, 0 empty to 1 full", start=0.0)

    def equations(self) -> Equations:
        """The converter and its lock-up."""
        yield connect(self.flange_a, self.converter.flange_a)
        yield connect(self.converter.flange_b, self.flange_b)
        demand = limited((self.converter.w_b - self.w_lock) / self.band)
        yield from _filling(self.converter.lockup, self.filled, demand, self.T_fill)


class NeutralIdleConverter(StartingDevice):
    """A ``StartingConverter`` behind which a clutch of the gearbox opens at rest: neutral idle control.

    demand = 1 - braked released rests,  braked = brake/0.02 within 0..1,  released = 1 - accelerator/0.02 within 0..1
    rests = 1 - |w|/w_rest within 0..1,  w = der(flange_b.phi)
    clutch.f_normalized = min(filled, demand),  T_fill der(filled) = demand - filled

    With the selector in drive, a converter drags an engine that idles against the brakes; here the ``turbine`` turns with the pump instead.
    As the driver releases the brake or presses the accelerator, oil fills the clutch with the time constant ``T_fill``; it leaves it at
    once. The clutch needs no control: ``pressed`` is ignored. The default values are invented, for the default converter.
    """

    w_rest: Parameter = parameter(
        "rad/s", "Speed of flange_b below which the clutch opens while only the brake is pressed", default=5.0, above=0
    )
    T_fill: Parameter = parameter("s", "Time constant of filling the clutch", default=0.2, above=0)
    converter: StartingConverter = StartingConverter()
    turbine: Inertia = Inertia(J=0.02)
    clutch: Clutch = Clutch(fn_max=600, mue_pos=((0.0, 1.0),))
    filled: Variable = variable("1", "Oil in the clutch, 0 empty to 1 full", start=0.0)

    def lumped(self) -> StartingConverter:
        """The converter: with the brake released the clutch is closed."""
        return self.converter

    def equations(self) -> Equations:
        """Converter, turbine shaft and clutch in series."""
        yield connect(self.flange_a, self.converter.flange_a)
        yield connect(self.converter.flange_b, self.turbine.flange_a)
        yield connect(self.turbine.flange_b, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.flange_b)
        rests = limited(1 - ca.fabs(der(self.flange_b.phi)) / self.w_rest)
        braked, released = limited(self.brake.value / PRESSED), limited(1 - self.accelerator.value / PRESSED)
        yield from _filling(self.clutch.f_normalized, self.filled, 1 - braked * released * rests, self.T_fill)
