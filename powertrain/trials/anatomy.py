"""The parts of a vehicle that trials need: body, pedals, road, cycle, prime movers and stores, found by their classes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import powertrain as pt
from powertrain.components.body import Body, RoadProfile, Trailer
from powertrain.components.control import Pedals
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.cycles import CycleSpeed
from powertrain.components.electric import Battery, ElectricMachine, PolarizedBattery
from powertrain.components.engines import Engine
from powertrain.components.transmissions.power_shift import ShiftedGears
from powertrain.components.wheels import Wheel
from powertrain.language.component import children

ONE = {"body": Body, "pedals": Pedals, "road": RoadProfile, "cycle": CycleSpeed}
"""Parts of which a vehicle has exactly one, and their classes."""


@dataclass(frozen=True)
class Anatomy:
    """Paths of the components of a vehicle, whatever their names: an engine in an axle module is "rear.engine".

    Components are found by their class. What a class cannot tell, for instance that the energy of a flywheel carries over from one drive to
    the next, the vehicle declares: ``stores: ClassVar[tuple[str, ...]] = ("flywheel",)``. By default the batteries are the stores.
    """

    vehicle: str
    one: tuple[tuple[str, str], ...]
    engines: tuple[str, ...]
    machines: tuple[str, ...]
    batteries: tuple[str, ...]
    wheels: tuple[str, ...]
    trailers: tuple[str, ...]
    stores: tuple[str, ...]

    @property
    def prime_movers(self) -> tuple[str, ...]:
        """Engines and electric machines; all have ``w`` [rad/s], ``tau`` [N.m] and ``power`` [W] at their shafts."""
        return (*self.engines, *self.machines)

    @property
    def tank(self) -> str:
        """The energy source of the prime movers: "tank", "battery", or both."""
        return " and ".join(name for name, any_ in (("tank", self.engines), ("battery", self.machines)) if any_)

    def the(self, what: str) -> str:
        """The path of the body, the pedals, the road or the cycle. Errors: ParameterError if a vehicle has none or several."""
        found = [path for name, path in self.one if name == what]
        if len(found) != 1:
            several = f"{len(found)}: {', '.join(found)}" if found else "none"
            raise pt.ParameterError(
                f"{self.vehicle} needs one {what} (a component of class {ONE[what].__name__}); it has {several}"
            )
        return found[0]

    def the_engine(self) -> str:
        """The path of the only engine. Errors: ParameterError if a vehicle has none or several."""
        if len(self.engines) != 1:
            raise pt.ParameterError(
                f"{self.vehicle} has {len(self.engines)} combustion engines; this requires a vehicle with one"
            )
        return self.engines[0]


def anatomy(vehicle: pt.Component) -> Anatomy:
    """Find the body, pedals, engines and other components of a vehicle. Errors: ParameterError for what is not a component."""
    _check_component(vehicle)
    parts = list(_parts(vehicle, (*ONE.values(), Trailer, Engine, ElectricMachine, Battery, PolarizedBattery)))

    def of(*kinds: type[pt.Component]) -> tuple[str, ...]:
        return tuple(path for path, part in parts if isinstance(part, kinds))

    batteries = of(Battery, PolarizedBattery)
    return Anatomy(
        vehicle=type(vehicle).__name__,
        one=tuple((name, path) for name, kind in ONE.items() for path in of(kind)),
        engines=of(Engine),
        machines=of(ElectricMachine),
        batteries=batteries,
        wheels=of(Wheel),
        trailers=of(Trailer),
        stores=tuple(getattr(type(vehicle), "stores", batteries)),
    )


def _check_component(vehicle: object) -> None:
    if not isinstance(vehicle, pt.Component):
        made = (
            f"; write {vehicle.__name__}()" if isinstance(vehicle, type) and issubclass(vehicle, pt.Component) else ""
        )
        named = f"; pt.vehicles.load({vehicle!r}) makes one of a name or a file" if isinstance(vehicle, str) else ""
        raise pt.ParameterError(f"{vehicle!r} is not a vehicle{made}{named}")


def value_at(vehicle: pt.Component, path: str) -> Any:
    """The component at a path of dots and indices."""
    part: Any = vehicle
    for name in path.split("."):
        field, bracket, index = name.partition("[")
        part = getattr(part, field)
        part = part[int(index[:-1])] if bracket else part
    return part


def charge_at_start(vehicle: pt.Component, battery: str) -> float:
    """The state of charge [1] with which the battery at a path starts unless ``starts`` say otherwise."""
    return float(type(value_at(vehicle, battery))._fields["soc"].start)


def parts_of(whole: pt.Component, *kinds: type[pt.Component]) -> Iterator[str]:
    """The paths of all components of these classes; components inside such components are not included."""
    return (path for path, part in _parts(whole, kinds) if isinstance(part, kinds))


def variators(whole: pt.Component) -> Iterator[str]:
    """The paths of all variable units; the gears of a power-shift gearbox, which has steps, are none."""
    return (path for path in parts_of(whole, VariableUnit) if not isinstance(value_at(whole, path), ShiftedGears))


def _parts(
    whole: pt.Component, closed: tuple[type[pt.Component], ...], path: str = ""
) -> Iterator[tuple[str, pt.Component]]:
    """All parts with their paths, except those inside components of the ``closed`` classes."""
    for name, part in children(whole):
        yield f"{path}{name}", part
        if not isinstance(part, closed):
            yield from _parts(part, closed, f"{path}{name}.")
