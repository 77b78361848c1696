"""Dual-clutch gearboxes: two clutches, two input shafts, and synchronisers that preselect gears."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

import casadi as ca

from powertrain import Equations, Input, Parameter, ParameterError, Symbol, connect, parameter, signal_input
from powertrain.components.differentials.churning import ChurningLoss
from powertrain.components.limited import limited
from powertrain.components.rotational.clutch import Clutch
from powertrain.components.rotational.ideal_gear import IdealGear
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.transmissions.clutch_to_clutch import ClutchToClutch
from powertrain.components.transmissions.gearbox import SYNCHRONISER, MeshedGears, Shiftable, ratios_decrease

PRESELECT = 0.3
"""Share of the lever's travel between gears in which the synchronisers move."""
RATIOS = 3.8, 2.3, 1.5, 1.1, 0.87, 0.7


class StartingGearbox(Shiftable):
    """Partial: a gearbox with its own starting clutch."""

    pressed: Input = signal_input("1", "Demanded pressure of the engaged clutch, 0 open to 1 closed", default=1.0)


class DualClutchGearbox(ClutchToClutch, StartingGearbox, MeshedGears):
    """A dual-clutch gearbox: the odd gears on one input shaft, the even ones on another, each with its own clutch.

    gear k: w_loose = w_shaft/ratio_k,  synchroniser k: dry friction between the loose wheel and the output shaft

    The clutches exchange the torque by the law of ``ClutchToClutch``, each pressed for at most its capacity times pressed. ``pressed``
    within 0..1 starts the vehicle with the clutch of the engaged gear, and lets the engine idle when it stops, also during a shift. While
    a gear is engaged, the gear below is preselected on the other shaft. An upshift therefore begins with the synchronisation of the gear
    above, in the first 30 % of the lever's travel, against an open clutch; a downshift ends with that of the gear two below. The meshes
    have no loss; as in ``ManualGearbox`` it is included in the final drive. ``churning`` is the drag at the input. If two output shafts
    have final drives of their own, ``ratios`` are the products with them.
    Errors: ParameterError if the numbers of gears and synchronisers differ, and for ratios that do not decrease from gear to gear.
    """

    begin: ClassVar[float] = PRESELECT
    torque_phase: Parameter = parameter(
        "1", "Share of the lever's travel between gears in each torque phase", default=0.15, above=0
    )
    gears: tuple[IdealGear, ...] = tuple(IdealGear(ratio=r) for r in RATIOS)
    synchronisers: tuple[Clutch, ...] = (SYNCHRONISER,) * len(RATIOS)
    odd_clutch: Clutch = Clutch(fn_max=350, mue_pos=((0.0, 1.0),))
    even_clutch: Clutch = Clutch(fn_max=350, mue_pos=((0.0, 1.0),))
    input: Inertia = Inertia(J=0.02)
    odd: Inertia = Inertia(J=0.005)
    even: Inertia = Inertia(J=0.005)
    output: Inertia = Inertia(J=0.01)
    churning: ChurningLoss = ChurningLoss(d=0.003)

    @classmethod
    def of_ratios(cls, *ratios: float | Sequence[float], **parts: Any) -> Self:
        """Gears with these ratios, speed at flange_a over speed at flange_b, first gear first; as separate numbers or as one sequence."""
        gears = cls._pairs(ratios)
        return cls(**({"gears": gears, "synchronisers": (SYNCHRONISER,) * len(gears)} | parts))

    def check(self) -> Equations:
        """Gear ratios must decrease: an upshift slows the engine down. The clutches can carry torque."""
        yield from super().check()
        for clutch in (self.odd_clutch, self.even_clutch):
            yield clutch.capacity > 0
        yield from ratios_decrease(self.gears)  # with two final drives, give the products with them

    def friction_elements(self) -> dict[str, str]:
        """The paths of the two clutches and of the synchronisers."""
        found = {"odd clutch": "odd_clutch", "even clutch": "even_clutch"}
        return found | {f"synchroniser {k}": f"synchronisers[{k - 1}]" for k in range(1, len(self.synchronisers) + 1)}

    def equations(self) -> Equations:
        """Two clutches, two shafts, and the gears between them and the output."""
        if len(self.gears) != len(self.synchronisers) or len(self.gears) < 2:
            raise ParameterError(
                f"{self._label}: {len(self.gears)} gears have {len(self.synchronisers)} synchronisers; give two or "
                "more gears, and one synchroniser for each"
            )
        yield connect(self.flange_a, self.input.flange_a)
        yield connect(self.input.flange_b, self.churning.flange, self.odd_clutch.flange_a, self.even_clutch.flange_a)
        for clutch, shaft, first in ((self.odd_clutch, self.odd, 0), (self.even_clutch, self.even, 1)):
            yield connect(clutch.flange_b, shaft.flange_a)
            yield connect(shaft.flange_b, *(gear.flange_a for gear in self.gears[first::2]))
        for gear, synchroniser in zip(self.gears, self.synchronisers, strict=True):
            yield connect(gear.flange_b, synchroniser.flange_a)
        yield connect(self.output.flange_a, *(synchroniser.flange_b for synchroniser in self.synchronisers))
        yield connect(self.output.flange_b, self.flange_b)
        yield from self._press()

    def _press(self) -> Equations:
        ratios = [gear.ratio for gear in self.gears]
        yield from self._shift(ratios, self.input.w, self.output.w)
        for clutch, first in ((self.odd_clutch, 0), (self.even_clutch, 1)):
            factors = [1.0 if k % 2 == first else None for k in range(len(ratios))]
            asked = clutch.capacity * limited(self.pressed.value)
            yield clutch.f_normalized.value == ca.fmin(self._torque(factors, asked), asked) / clutch.capacity
        for k, synchroniser in enumerate(self.synchronisers, 1):
            yield synchroniser.f_normalized.value == self._selected(k)

    def _selected(self, k: int) -> Symbol:
        """Pressure of the synchroniser of gear k: from the upshift into it to the upshift into the next gear on its shaft."""
        lever, travel = self.lever.value, PRESELECT / 2
        engaged = limited((k + 1 + travel - lever) / travel)
        if k > 2:
            engaged = ca.fmin(engaged, limited((lever - (k - 1 + travel)) / travel))
        return engaged**2  # gently at first

    def in_gear(self, k: int) -> ClutchedGear:
        """The gearbox with gear k permanently engaged: one clutch and one shaft, without synchronisers."""
        place = self._place(k)
        clutch, shaft = (self.even_clutch, self.even) if place % 2 else (self.odd_clutch, self.odd)
        return ClutchedGear(
            clutch=clutch,
            gear=self.gears[place],
            input=self.input,
            shaft=shaft,
            output=self.output,
            churning=self.churning,
        )


class ClutchedGear(StartingGearbox):
    """A clutch and a single gear that is always engaged: w_shaft = ratio w_b, for measurements."""

    clutch: Clutch = Clutch(fn_max=350, mue_pos=((0.0, 1.0),))
    gear: IdealGear = IdealGear(ratio=1)
    input: Inertia = Inertia(J=0.02)
    shaft: Inertia = Inertia(J=0.005)
    output: Inertia = Inertia(J=0.01)
    churning: ChurningLoss = ChurningLoss(d=0.003)

    @property
    def gear_count(self) -> int:
        """One."""
        return 1

    def in_gear(self, k: int) -> ClutchedGear:
        """Itself."""
        return self

    def equations(self) -> Equations:
        """Clutch and gear in series."""
        yield connect(self.flange_a, self.input.flange_a)
        yield connect(self.input.flange_b, self.churning.flange, self.clutch.flange_a)
        yield connect(self.clutch.flange_b, self.shaft.flange_a)
        yield connect(self.shaft.flange_b, self.gear.flange_a)
        yield connect(self.gear.flange_b, self.output.flange_a)
        yield connect(self.output.flange_b, self.flange_b)
        yield self.clutch.f_normalized.value == limited(self.pressed.value)
