"""Gearboxes that shift under load, and the starting devices in front of them."""

from __future__ import annotations

from itertools import pairwise

from powertrain import Equations, Input, Map, Parameter, ParameterError, connect, parameter, signal_input
from powertrain.components.cvu import CVU, VariableUnit
from powertrain.components.differentials.churning import ChurningLoss
from powertrain.components.limited import limited
from powertrain.components.rotational import Clutch, Inertia, TwoFlanges
from powertrain.components.transmissions.gearbox import Shiftable
from powertrain.components.transmissions.hydrodynamic import TorqueConverter


class PowerShiftGearbox(Shiftable):
    """A planetary or dual-clutch gearbox by its ratios: the ratio changes from one gear to the next under load, whatever its clutches do.

    w_b = V w_a,  V = 1/ratios[k] with the lever at k, and linear in the lever between two gears

    The unit's efficiency is that of the meshes under load, ``churning`` the drag of oil, pump and open clutches at the input shaft. The
    slip of the clutches during a shift is neglected: the shafts follow the ratio. Errors: ParameterError for ratios that do not decrease.
    """

    ratios: tuple[float, ...] = (4.7, 3.1, 2.1, 1.7, 1.3, 1.0, 0.84, 0.67)
    unit: VariableUnit = CVU(eta_ab=0.96, eta_ba=0.96)
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

    def in_gear(self, k: int) -> PowerShiftGearbox:
        """Itself: with a constant lever it has one ratio."""
        return self

    def equations(self) -> Equations:
        """A variable ratio between two shafts."""
        if len(self.ratios) < 2 or min(self.ratios) <= 0 or any(a <= b for a, b in pairwise(self.ratios)):
            raise ParameterError(
                f"{self._path or 'PowerShiftGearbox'}.ratios = {self.ratios}; give two or more positive ratios that decrease from gear "
                "to gear"
            )
        gears, speeds = range(1, len(self.ratios) + 1), [1 / ratio for ratio in self.ratios]
        ratio = Map.curve([float(k) for k in gears], speeds, x="lever", unit="1", name="speed ratio", outside="clip")
        yield connect(self.flange_a, self.input.flange_a)
        yield connect(self.input.flange_b, self.churning.flange, self.unit.flange_a)
        yield self.unit.ratio.value == ratio(self.lever.value)
        yield connect(self.unit.flange_b, self.output.flange_a)
        yield connect(self.output.flange_b, self.flange_b)


class StartingDevice(TwoFlanges):
    """Partial: lets the engine turn while the vehicle stands; ``pressed`` is the demanded clutch pressure."""

    pressed: Input = signal_input("1", "Demanded pressure of the clutch, 0 open to 1 closed", default=0.0)


class StartingClutch(StartingDevice):
    """A start clutch, dry or wet, that the control presses."""

    clutch: Clutch = Clutch(fn_max=300, mue_pos=((0.0, 1.0),))

    def equations(self) -> Equations:
        """The clutch."""
        yield connect(self.flange_a, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.flange_b)
        yield connect(self.pressed, self.clutch.f_normalized)


class StartingConverter(StartingDevice):
    """A torque converter whose lock-up clutch closes with the speed of its turbine.

    lockup = (w_turbine - w_lock)/band within 0..1

    It needs no control: ``pressed`` is ignored.
    """

    w_lock: Parameter = parameter("rad/s", "Speed of the turbine from which the lock-up closes", default=105.0, above=0)
    band: Parameter = parameter("rad/s", "Speed range in which it closes", default=10.0, above=0)
    converter: TorqueConverter = TorqueConverter()

    def equations(self) -> Equations:
        """The converter and its lock-up."""
        yield connect(self.flange_a, self.converter.flange_a)
        yield connect(self.converter.flange_b, self.flange_b)
        yield self.converter.lockup.value == limited((self.converter.w_b - self.w_lock) / self.band)
