"""A network of planetary gears around a variable unit as a component."""

from __future__ import annotations

from typing import Any, Self

from powertrain import Component, Equations, ParameterError, arguments_checked, connect, port, replace
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.cvu.unit import CVU
from powertrain.components.differentials.fundamental import FundamentalDifferential
from powertrain.components.rotational.fixed import Fixed
from powertrain.components.rotational.gear import Gear
from powertrain.components.rotational.interfaces import Flange
from powertrain.components.transmissions.interfaces import VariableTransmission
from powertrain.components.transmissions.network import HOUSING, Lever, Network

_SIMPLEST = Network.split_path("bHa", "input", -1.7, 0.95)


def _planetary(lever: Lever) -> FundamentalDifferential:
    return FundamentalDifferential(ratio=lever.ratio, eta_ab=lever.eta, eta_ba=lever.eta)


class NetworkGears(Component):
    """The planetary gears and gear pairs of a network, without its unit.

    For each lever w_a - w_carrier = ratio (w_b - w_carrier) with the loss of ``MeshLaw``, or of ``Gear`` if the carrier is the housing;
    joined shafts are one. There is no inertia. ``NetworkGears.of`` makes the component from a network. Errors: ParameterError
    if the network does not have two degrees of freedom, or the number of parts differs from that of its levers.
    """

    input: Flange = port(Flange)
    output: Flange = port(Flange)
    unit_a: Flange = port(Flange)
    unit_b: Flange = port(Flange)
    network: Network = _SIMPLEST
    planetaries: tuple[FundamentalDifferential, ...] = (_planetary(_SIMPLEST.levers[0]),)
    pairs: tuple[Gear, ...] = ()
    housing: Fixed = Fixed()

    @classmethod
    @arguments_checked
    def of(cls, network: Network) -> Self:
        """The gears of a network."""
        planetaries = tuple(_planetary(x) for x in network.levers if x.carrier != HOUSING)
        pairs = tuple(Gear(ratio=x.ratio, efficiency=x.eta) for x in network.levers if x.carrier == HOUSING)
        return cls(network=network, planetaries=planetaries, pairs=pairs)

    def equations(self) -> Equations:
        """Every node of the network connects the flanges on it."""
        self.network.speeds()
        planetaries, pairs = list(self.planetaries), list(self.pairs)
        if len(planetaries) + len(pairs) != len(self.network.levers):
            raise ParameterError(
                f"{self._label}: the network has {len(self.network.levers)} levers, but there are {len(planetaries)} planetaries and "
                f"{len(pairs)} pairs; make the gears with NetworkGears.of(network)"
            )
        at: dict[int, list[Any]] = {}

        def stand(shaft: str, flange: Any) -> None:
            at.setdefault(self.network.nodes[shaft], []).append(flange)

        for lever in self.network.levers:
            if lever.carrier == HOUSING:
                pair = pairs.pop(0)
                stand(lever.a, pair.flange_a)
                stand(lever.b, pair.flange_b)
            else:
                planetary = planetaries.pop(0)
                stand(lever.a, planetary.a)
                stand(lever.b, planetary.b)
                stand(lever.carrier, planetary.carrier)
        stand(self.network.input, self.input)
        stand(self.network.output, self.output)
        stand(self.network.unit[0], self.unit_a)
        stand(self.network.unit[1], self.unit_b)
        stand(HOUSING, self.housing.flange)
        for flanges in at.values():
            if len(flanges) > 1:
                yield connect(*flanges)


class NetworkTransmission(VariableTransmission):
    """A split-path transmission from its network: its gears, and the variable unit between two of their shafts.

    flange_a is the network's input, flange_b its output; the signal ``ratio`` is V = w_b/w_a of the unit's shafts. It stays in one range
    (``RangeTransmission`` shifts) and has no inertia. ``NetworkTransmission.of`` makes it from a network.
    """

    cvu: VariableUnit = CVU(eta_ab=0.9, eta_ba=0.9)
    gears: NetworkGears = NetworkGears()

    @classmethod
    @arguments_checked
    def of(cls, network: Network, cvu: VariableUnit | None = None) -> Self:
        """The component from a network."""
        made = cls(gears=NetworkGears.of(network))
        return made if cvu is None else replace(made, cvu=cvu)

    @property
    def network(self) -> Network:
        """The network of its gears."""
        return self.gears.network

    def equations(self) -> Equations:
        """The unit between its shafts."""
        yield connect(self.flange_a, self.gears.input)
        yield connect(self.flange_b, self.gears.output)
        yield connect(self.cvu.flange_a, self.gears.unit_a)
        yield connect(self.cvu.flange_b, self.gears.unit_b)
        yield connect(self.ratio, self.cvu.ratio)
