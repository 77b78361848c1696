"""Automatic gearsets: planetary sets whose clutches and brakes select the gear."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

from powertrain import Equations, Parameter, ParameterError, Symbol, arguments_checked, connect, parameter
from powertrain.components.cvu import CVU
from powertrain.components.differentials.churning import ChurningLoss
from powertrain.components.differentials.fundamental import FundamentalDifferential
from powertrain.components.limited import limited
from powertrain.components.rotational.brake import Brake
from powertrain.components.rotational.clutch import Clutch, OneWayClutch
from powertrain.components.rotational.fixed import Fixed
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.transmissions.clutch_to_clutch import ClutchToClutch
from powertrain.components.transmissions.gear_scheme import GearScheme
from powertrain.components.transmissions.gearbox import Shiftable
from powertrain.components.transmissions.gearsets import (
    CR_CR_FOUR,
    CR_CR_FREEWHEELS,
    EIGHT_SPEED,
    LEPELLETIER_SIX,
    NINE_SPEED,
    RAVIGNEAUX_FOUR,
    SEVEN_SPEED,
    SIMPSON_FREEWHEEL,
    SIMPSON_THREE,
    TEN_SPEED,
)
from powertrain.components.transmissions.lumped_gear import LumpedGear, efficiencies
from powertrain.components.transmissions.shift_table import ShiftElement

TORQUE, MARGIN, J_SHAFT = 400.0, 1.5, 0.004
"""Input torque [N.m] for sizing elements, capacity relative to their load at that torque, inertia of a shaft [kg.m2]."""
SIZE = parameter("N.m", "Input torque that the shift elements can hold", above=0)
SAME = 1e-9
"""Ratios with a smaller relative difference are equal."""
Element = Clutch | Brake | OneWayClutch


def _levers(scheme: GearScheme) -> tuple[FundamentalDifferential, ...]:
    return tuple(FundamentalDifferential(ratio=x.ratio, eta_ab=x.eta, eta_ba=x.eta) for x in scheme.levers)


def _shafts(scheme: GearScheme, J: float = J_SHAFT) -> tuple[Inertia, ...]:
    return (Inertia(J=J),) * (max(scheme.free.nodes.values()) + 1)


def _elements(scheme: GearScheme, torque: float = TORQUE) -> tuple[Element, ...]:
    return tuple(_element(scheme, each, torque) for each in scheme.elements)


def _element(scheme: GearScheme, element: ShiftElement, torque: float) -> Element:
    gears = [gear.name for gear in scheme.gears if element.name in (*gear.engaged, *gear.coast)]
    factors = [scheme.torque_factor(gear, element.name) for gear in gears]
    carried = max(factors, default=0.0) or 1.0  # without load it still accelerates an idle shaft
    kind = _kind(element)
    return kind(fn_max=0.0 if element.freewheel else MARGIN * torque * carried, mue_pos=((0.0, 1.0),))


def _kind(element: ShiftElement) -> type[Element]:
    return OneWayClutch if element.freewheel else Brake if element.is_brake else Clutch


_PARTS = {"levers": _levers, "shafts": _shafts, "elements": _elements}


class Automatic(ClutchToClutch):
    """An automatic gearset from its scheme: a differential for every lever, a part for every shift element, and inertias.

    w_a - w_carrier = R_o (w_b - w_carrier)

    holds for every lever, with the loss of ``MeshLaw``. The shift elements are of class ``Clutch``, ``Brake`` or, if they are freewheels,
    ``OneWayClutch``; the law of ``ClutchToClutch`` presses them.
    Lever position k selects the k-th forward gear, 0 neutral, -1 the reverse gear. Between two positions a shift is under way: a lever that
    moves from 7 to 0 shifts down through all gears, and one that jumps there, as a selector does, opens all elements at once. Nothing here
    keeps the reverse gear open while the vehicle moves forward.
    Freewheels are never pressed. They let go in overrun: the output runs ahead and the engine does not brake, unless ``coast``
    presses the elements that the scheme has for this. If the input has fallen behind when gear k + 1 replaces a freewheel of gear k, its
    element pulls the input up: its torque is then larger by the torque factor times k_slip max(ratio_(k+1) w_out - w_in, 0) S_2 (1 - S_3).
    ``levers``, ``shafts`` and ``elements`` are in the order of the scheme; those not given are made for it, as by ``of``. ``churning`` is
    the drag of pump, oil and open elements at the input. ``trials.gear_table`` computes ratios, efficiencies and torques.
    Errors: ParameterError if the parts do not match the scheme.
    """

    scheme: GearScheme = SIMPSON_THREE
    levers: tuple[FundamentalDifferential, ...] = _levers(SIMPSON_THREE)
    shafts: tuple[Inertia, ...] = _shafts(SIMPSON_THREE)
    elements: tuple[Element, ...] = _elements(SIMPSON_THREE)
    coast: Parameter = parameter(
        "1", "Pressure of the elements that carry overrun beside freewheels", default=0.0, min=0, max=1
    )
    churning: ChurningLoss = ChurningLoss(d=0.01)
    housing: Fixed = Fixed()

    if not TYPE_CHECKING:

        def __init__(self, *unnamed: Any, **given: Any) -> None:
            scheme = given.get("scheme", SIMPSON_THREE)
            if isinstance(scheme, GearScheme):
                given |= {name: make(scheme) for name, make in _PARTS.items() if name not in given}
            super().__init__(*unnamed, **given)

    @classmethod
    @arguments_checked
    def of(cls, scheme: GearScheme, *, torque: float = TORQUE, J: float = J_SHAFT, **parts: Any) -> Self:
        """The component for a scheme.

        Parameters
        ----------
        scheme : GearScheme
            Planetary sets, shift elements and gears.
        torque : float
            Input torque that the shift elements can hold in every gear [N.m].
        J : float
            Moment of inertia of each shaft [kg.m2].
        **parts
            Other parts and parameters of the component.
        """
        torque = SIZE.check(torque, f"{cls.__name__}.of: torque")
        made = {"shafts": _shafts(scheme, J), "elements": _elements(scheme, torque)}
        return cls(scheme=scheme, **(made | parts))

    @classmethod
    def simpson_three_speed(cls) -> Self:
        """Ratios 2.46, 1.46, 1.00, reverse -2.18."""
        return cls.of(SIMPSON_THREE)

    @classmethod
    def simpson_with_freewheel(cls) -> Self:
        """Ratios 2.45, 1.45, 1.00, reverse -2.20; a freewheel holds first gear."""
        return cls.of(SIMPSON_FREEWHEEL)

    @classmethod
    def ravigneaux_four_speed(cls) -> Self:
        """Ratios 2.40, 1.47, 1.00, 0.67, reverse -2.00."""
        return cls.of(RAVIGNEAUX_FOUR)

    @classmethod
    def cr_cr_four_speed(cls) -> Self:
        """Ratios 3.06, 1.62, 1.00, 0.70, reverse -2.29."""
        return cls.of(CR_CR_FOUR)

    @classmethod
    def cr_cr_with_freewheels(cls) -> Self:
        """Ratios 3.06, 1.62, 1.00, 0.70, reverse -2.29; freewheels hold gears 1 to 3."""
        return cls.of(CR_CR_FREEWHEELS)

    @classmethod
    def lepelletier_six_speed(cls) -> Self:
        """Ratios 4.171, 2.340, 1.521, 1.143, 0.867, 0.691, reverse -3.403."""
        return cls.of(LEPELLETIER_SIX)

    @classmethod
    def eight_speed(cls) -> Self:
        """Ratios 4.696, 3.130, 2.104, 1.667, 1.285, 1.000, 0.839, 0.667, reverse -3.297."""
        return cls.of(EIGHT_SPEED)

    @classmethod
    def seven_speed(cls) -> Self:
        """Ratios 4.377, 2.859, 1.921, 1.368, 1.000, 0.820, 0.728, reverse -3.416."""
        return cls.of(SEVEN_SPEED)

    @classmethod
    def nine_speed(cls) -> Self:
        """Ratios 4.700, 2.842, 1.909, 1.382, 1.000, 0.808, 0.699, 0.580, 0.479, reverse -3.805."""
        return cls.of(NINE_SPEED)

    @classmethod
    def ten_speed(cls) -> Self:
        """Ratios 4.696, 2.985, 2.146, 1.769, 1.520, 1.275, 1.000, 0.854, 0.689, 0.636, reverse -4.866."""
        return cls.of(TEN_SPEED)

    @property
    def gear_count(self) -> int:
        """The number of forward gears."""
        return len(self.scheme.forward)

    @property
    def has_reverse(self) -> bool:
        """Whether the scheme has a reverse gear."""
        return bool(self.scheme.reverse)

    @property
    def gear_ratios(self) -> tuple[float, ...]:
        """Those of the scheme."""
        return tuple(self.scheme.ratio(gear.name) for gear in self.scheme.forward)

    def check(self) -> Equations:
        """The differentials must be those of the scheme, whose ratios the shift control uses; the elements can carry torque."""
        yield from super().check()
        for lever, part in zip(self.scheme.levers, self.levers, strict=False):
            R = lever.ratio
            yield abs(part.ratio - R) <= SAME * abs(R)  # levers have the ratios of the scheme: Automatic.of(scheme)
        for element in self.elements:
            yield isinstance(element, OneWayClutch) or element.capacity > 0

    def friction_elements(self) -> dict[str, str]:
        """The paths of the shift elements, by their names in the scheme."""
        return {element.name: f"elements[{k}]" for k, element in enumerate(self.scheme.elements)}

    def in_gear(self, k: int) -> Automatic:
        """The gearset with the k-th forward gear permanently engaged: rigid joints replace the shift elements, except freewheels.

        With any ``coast`` above 0 they also replace freewheels and the elements for overrun.
        """
        scheme = self.scheme.in_gear(self.scheme.forward[self._place(k)].name, coast=float(self.coast) > 0)
        parts = dict(zip(self.scheme.elements, self.elements, strict=True))
        elements = tuple(parts[each] for each in scheme.elements)
        levers = tuple(
            part for lever, part in zip(self.scheme.levers, self.levers, strict=True) if lever in scheme.levers
        )
        return Automatic(
            scheme=scheme, levers=levers, shafts=self._joined(scheme), elements=elements, churning=self.churning
        )

    def lumped(self) -> Shiftable:
        """A gear without freewheels as one ratio, with its efficiencies if the levers have constant ones and these determine them."""
        meshes = [(float(x.eta_ab), float(x.eta_ba)) for x in self.levers if x.map_ab is None and x.map_ba is None]
        if self.elements or len(meshes) < len(self.levers) or (found := efficiencies(self.scheme, meshes)) is None:
            return self
        network = self.scheme.network(self.scheme.gears[0].name)
        J = sum(float(shaft.J) * w**2 for shaft, w in zip(self.shafts, network.motion().tolist(), strict=True))
        unit = CVU(eta_ab=found[0], eta_ba=found[1])
        return LumpedGear(ratio=network.fixed_ratio(), unit=unit, input=Inertia(J=J), churning=self.churning)

    def _joined(self, scheme: GearScheme) -> tuple[Inertia, ...]:
        """The shafts of a scheme that joins those of this gearset: their inertias add up."""
        before, after = self.scheme.free.nodes, scheme.free.nodes
        parts = {before[name]: node for name, node in after.items() if node >= 0}
        sums = [0.0] * (max(after.values()) + 1)
        for k, node in parts.items():
            sums[node] += float(self.shafts[k].J)
        return tuple(Inertia(J=J) for J in sums)

    def equations(self) -> Equations:
        """The flanges on every shaft are connected; the shift law presses the elements."""
        self._check()
        scheme, nodes = self.scheme, self.scheme.free.nodes
        at: dict[int, list[Any]] = {k: [shaft.flange_a] for k, shaft in enumerate(self.shafts)} | {
            -1: [self.housing.flange]
        }
        for lever, differential in zip(scheme.levers, self.levers, strict=True):
            at[nodes[lever.a]].append(differential.a)
            at[nodes[lever.b]].append(differential.b)
            at[nodes[lever.carrier]].append(differential.carrier)
        for element, part in zip(scheme.elements, self.elements, strict=True):
            one, other = nodes[element.a], nodes[element.b]
            if not element.freewheel:
                one, other = max(one, other), min(one, other)
            at[one].append(part.flange_a)
            if not isinstance(part, Brake):
                at[other].append(part.flange_b)
        at[nodes[scheme.input]] += [self.flange_a, self.churning.flange]
        at[nodes[scheme.output]].append(self.flange_b)
        for flanges in at.values():
            if len(flanges) > 1:
                yield connect(*flanges)
        yield from self._press()

    def _press(self) -> Equations:
        scheme, forward = self.scheme, self.scheme.forward
        w_in, w_out = (self.shafts[scheme.free.nodes[end]].w for end in (scheme.input, scheme.output))
        yield from self._shift([scheme.ratio(gear.name) for gear in forward], w_in, w_out)
        pulling = {
            k: self._pulling(scheme.ratio(other.name), w_out)
            for k, (one, other) in enumerate(pairwise(forward), 1)
            if set(scheme.freewheels(one.name)) - set(other.engaged)
        }
        for element, part in zip(scheme.elements, self.elements, strict=True):
            if element.freewheel:
                yield part.f_normalized.value == 0
            else:
                yield part.f_normalized.value == self._pressed(element.name, part.capacity, pulling) / part.capacity

    def _pressed(self, name: str, full: Symbol, pulling: Mapping[int, Symbol]) -> Symbol:
        """The torque for which an element is pressed."""
        forward, backward = self.scheme.forward, self.scheme.reverse[:1]
        torque = self._torque(self._factors(name, coast=False), full, pulling=pulling)
        beside = [k for k, gear in enumerate(forward) if name in gear.coast]
        if beside:
            both = self._torque(self._factors(name, coast=True), full, beside=beside, pulling=pulling)
            torque += self.coast * (both - torque)
        back = sum(
            (float(name in gear.engaged) + float(name in gear.coast) * self.coast for gear in backward), Symbol(0)
        )
        return torque + back * full * limited(-self.lever.value)

    def _factors(self, name: str, *, coast: bool) -> list[float | None]:
        """The torque factors of an element in the forward gears, None where it is open."""
        gears = [(gear.name, gear.engaged + (gear.coast if coast else ())) for gear in self.scheme.forward]
        return [self.scheme.torque_factor(gear, name) if name in closed else None for gear, closed in gears]

    def _check(self) -> None:
        has = {"levers": len(self.levers), "elements": len(self.elements), "shafts": len(self.shafts)}
        needs = {"levers": len(self.scheme.levers), "elements": len(self.scheme.elements)}
        needs["shafts"] = max(self.scheme.free.nodes.values()) + 1
        kinds = [_kind(each) for each in self.scheme.elements]
        if has != needs or not all(isinstance(part, kind) for part, kind in zip(self.elements, kinds, strict=True)):
            raise ParameterError(
                f"{self._label}: the scheme has {needs}, the component {has}; make it with Automatic.of(scheme)"
            )
