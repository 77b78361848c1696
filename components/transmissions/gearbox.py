"""Manual gearboxes, shifted by hand or by an automated control."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from numbers import Integral
from typing import Self

import casadi as ca

from powertrain import Equations, Input, ModelError, ParameterError, connect, signal_input
from powertrain.components.differentials.churning import ChurningLoss
from powertrain.components.ratios import gear_ratios
from powertrain.components.rotational.clutch import Clutch
from powertrain.components.rotational.ideal_gear import IdealGear
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.rotational.interfaces import TwoFlanges

SYNCHRONISER = Clutch(fn_max=1500, cgeo=0.93, mue_pos=((0.0, 0.1),), peak=29)
"""A triple-cone synchroniser: 140 N.m while its cones slide, 4,000 N.m with its dogs engaged.

Cones: mue n R F/sin(alpha) with mue = 0.1, n = 3, R = 35 mm, alpha = 6.5 deg and F = 1,500 N at the sleeve, hence cgeo = n R/sin(alpha).
The dogs hold ``peak`` times that. With such torques a shift of a passenger car takes about 0.1 to 0.3 s to synchronise.
Source: H. Naunheimer et al., Automotive Transmissions, 2nd ed., Springer 2011, chapter 9.
"""


class Shiftable(TwoFlanges):
    """Partial: a transmission from flange_a to flange_b whose gear is selected by a lever."""

    lever: Input = signal_input("1", "Position of the lever: k presses gear k, k + 1/2 is neutral")

    @property
    def gear_count(self) -> int:
        """The number of forward gears."""
        raise ModelError(f"{type(self).__name__} does not define gear_count, the number of its forward gears")

    @property
    def gear_ratios(self) -> tuple[float, ...]:
        """Ratios of the forward gears, speed at flange_a over speed at flange_b; empty if the transmission does not state them."""
        return ()

    @property
    def has_reverse(self) -> bool:
        """Whether the lever position -1 selects a reverse gear."""
        return False

    def in_gear(self, k: int) -> Shiftable:
        """The transmission with the k-th forward gear permanently engaged. Errors: ParameterError for a gear that it does not have."""
        raise ModelError(
            f"{type(self).__name__} does not define in_gear(k): maps of operating points and the backward calculation take the gearbox "
            "with one gear permanently engaged, such as a SingleGear, in its place"
        )

    def lumped(self) -> Shiftable:
        """The transmission at constant speed, where a gearset in one gear is a pair of gears."""
        return self

    def _place(self, k: object) -> int:
        """The place of gear k among the forward gears."""
        if isinstance(k, bool) or not isinstance(k, Integral) or not 1 <= int(k) <= self.gear_count:
            raise ParameterError(f"{type(self).__name__}.in_gear({k!r}): choose a gear from 1 to {self.gear_count}")
        return int(k) - 1


class SingleGear(Shiftable):
    """A gearbox with a single gear that is always engaged, for measurements and for single-speed vehicles.

    w_a = ratio w_b, with the inertia of both shafts and the drag of the oil at the input shaft.
    """

    gear: IdealGear = IdealGear(ratio=1)
    input: Inertia = Inertia(J=0.01)
    churning: ChurningLoss = ChurningLoss(d=0.003)
    output: Inertia = Inertia(J=0.01)

    @property
    def gear_count(self) -> int:
        """One."""
        return 1

    def in_gear(self, k: int) -> SingleGear:
        """Itself."""
        return self

    def equations(self) -> Equations:
        """Two shafts and a pair of wheels."""
        yield connect(self.flange_a, self.input.flange_a)
        yield connect(self.input.flange_b, self.churning.flange, self.gear.flange_a)
        yield connect(self.gear.flange_b, self.output.flange_a)
        yield connect(self.output.flange_b, self.flange_b)


def ratios_decrease(gears: Sequence[IdealGear]) -> Equations:
    """Ratios must decrease from gear to gear: an upshift slows the engine down."""
    for low, high in pairwise(gears):
        yield high.ratio < low.ratio


class MeshedGears(Shiftable):
    """Partial: gear pairs in constant mesh, first gear first."""

    gears: tuple[IdealGear, ...] = tuple(IdealGear(ratio=r) for r in (3.6, 2.1, 1.4, 1.05, 0.84, 0.68))

    @classmethod
    def _pairs(cls, ratios: Sequence[float | Sequence[float]]) -> tuple[IdealGear, ...]:
        """Gears from the arguments of ``of_ratios``."""
        return tuple(IdealGear(ratio=ratio) for ratio in gear_ratios(f"{cls.__name__}.of_ratios", ratios))

    @property
    def gear_count(self) -> int:
        """The number of gears."""
        return len(self.gears)

    @property
    def gear_ratios(self) -> tuple[float, ...]:
        """Those of the gears."""
        return tuple(float(gear.ratio) for gear in self.gears)


class SynchronisedGears(MeshedGears):
    """Partial: each gear pair is connected to the output shaft by its own synchroniser."""

    input: Inertia = Inertia(J=0.01)
    churning: ChurningLoss = ChurningLoss(d=0.003)
    output: Inertia = Inertia(J=0.01)

    def in_gear(self, k: int) -> SingleGear:
        """The gearbox with gear k permanently engaged, without the other gears and the synchronisers."""
        return SingleGear(gear=self.gears[self._place(k)], input=self.input, churning=self.churning, output=self.output)

    def _meshed(self, synchronisers: Sequence[TwoFlanges]) -> Equations:
        """Every gear between the two shafts, with its synchroniser."""
        yield connect(self.flange_a, self.input.flange_a)
        yield connect(self.input.flange_b, self.churning.flange, *(gear.flange_a for gear in self.gears))
        for gear, synchroniser in zip(self.gears, synchronisers, strict=True):
            yield connect(gear.flange_b, synchroniser.flange_a)
        yield connect(self.output.flange_a, *(synchroniser.flange_b for synchroniser in synchronisers))
        yield connect(self.output.flange_b, self.flange_b)


class ManualGearbox(SynchronisedGears):
    """A gearbox with n gear pairs in constant mesh, each connected to the output shaft by its own synchroniser.

    gear k: w_loose = w_a/ratio_k,  synchroniser k: dry friction between the loose wheel and the output shaft, pressed by
    f_normalized = 1 - 2 |lever - k|: fully with the lever at k, not at all half a gear away.

    Once the speeds are equal the dogs engage and hold ``peak`` times the torque of the cones. If a clutch closes earlier, with
    more torque than that of the cones, the gear does not engage.

    ``gears`` and ``synchronisers`` have equal length; ``of_ratios`` creates both. The input shaft (with the idler gears and the clutch
    plate) and the output shaft have inertia, against which the synchronisers work. ``churning`` is the oil drag at the input shaft. The
    meshes have no loss: theirs is included in the final drive.
    Errors: ParameterError if the numbers of gears and synchronisers differ, and for ratios that do not decrease from gear to gear.
    """

    synchronisers: tuple[Clutch, ...] = (SYNCHRONISER,) * 6

    @classmethod
    def of_ratios(cls, *ratios: float | Sequence[float], synchroniser: Clutch = SYNCHRONISER) -> Self:
        """Gears with these ratios, speed at flange_a over speed at flange_b, first gear first; as separate numbers or as one sequence."""
        gears = cls._pairs(ratios)
        return cls(gears=gears, synchronisers=(synchroniser,) * len(gears))

    def check(self) -> Equations:
        """An upshift slows the engine down."""
        yield from ratios_decrease(self.gears)

    def equations(self) -> Equations:
        """The gears, and the lever that presses their synchronisers."""
        if len(self.gears) != len(self.synchronisers) or not self.gears:
            raise ParameterError(
                f"{self._label}: {len(self.gears)} gears have {len(self.synchronisers)} synchronisers; "
                "each gear needs one"
            )
        yield from self._meshed(self.synchronisers)
        for k, synchroniser in enumerate(self.synchronisers, 1):
            yield synchroniser.f_normalized.value == 1 - 2 * ca.fabs(self.lever.value - k)
