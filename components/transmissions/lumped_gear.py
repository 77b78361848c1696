"""A gear of a gearset at constant speed: one ratio, and one efficiency for each direction of power."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from powertrain import Equations, Parameter, connect, parameter
from powertrain.components.cvu import CVU
from powertrain.components.differentials.churning import ChurningLoss
from powertrain.components.rotational.inertia import Inertia
from powertrain.components.transmissions.gear_scheme import GearScheme
from powertrain.components.transmissions.gearbox import Shiftable
from powertrain.components.transmissions.network import Network

ALIKE = 1e-12
"""Relative difference up to which the efficiencies for different directions of the latent powers are equal."""
Efficiencies = tuple[float, float]


class LumpedGear(Shiftable):
    """A gear that is always engaged, with the losses of a gearset: w_a = ratio w_b, with an efficiency for each direction of power.

    The efficiencies are those of ``unit``, in its law. ``input`` has the inertia of all shafts, referred to flange_a; ``churning`` is the
    drag at flange_a. For maps: while the speed changes, the inertia of a shaft inside a gearset loads the meshes otherwise.
    """

    ratio: Parameter = parameter("1", "Transmission ratio, speed of flange_a over speed of flange_b", exclude=(0.0,))
    unit: CVU = CVU()
    input: Inertia = Inertia(J=0.01)
    churning: ChurningLoss = ChurningLoss(d=0.01)

    @property
    def gear_count(self) -> int:
        """One."""
        return 1

    def in_gear(self, k: int) -> LumpedGear:
        """Itself."""
        return self

    def equations(self) -> Equations:
        """One pair of gears."""
        yield connect(self.flange_a, self.input.flange_a)
        yield connect(self.input.flange_b, self.churning.flange, self.unit.flange_a)
        yield connect(self.unit.flange_b, self.flange_b)
        yield self.unit.ratio.value == 1 / self.ratio


def efficiencies(scheme: GearScheme, meshes: Sequence[Efficiencies]) -> Efficiencies | None:
    """The efficiencies of the only gear of a scheme without shift elements, if the input drives and if the output drives.

    ``meshes`` are eta_ab and eta_ba of its levers. None if the directions of the latent powers are not unique, or if the gear locks itself.
    The torques are homogeneous in that of the input, so one torque of either sign suffices.
    """
    network, found = scheme.network(scheme.gears[0].name), list[float]()
    for torque in (1.0, -1.0):
        powers = _output_powers(network, meshes, torque)
        if not powers or max(powers) - min(powers) > ALIKE * max(map(abs, powers)) or powers[0] * torque <= 0:
            return None
        found.append(powers[0] * torque)
    return min(found[0], 1.0), min(1 / found[1], 1.0)


def _output_powers(network: Network, meshes: Sequence[Efficiencies], torque: float) -> list[float]:
    """The power that the output delivers for a ``torque`` at an input of unit speed, for each consistent set of directions.

    Unknowns are the torques of the levers at their members a, and that of the output; they balance the input's at every shaft.
    """
    w, at = np.append(network.motion(), 0.0), network.nodes  # node -1, the last, is the housing
    ends = [[at[x.a], at[x.b], at[x.carrier]] for x in network.levers]
    relative = [w[a] - w[carrier] for a, _, carrier in ends]
    found = []
    for drives in itertools.product((True, False), repeat=len(ends)):
        balance = np.zeros((len(w), len(ends) + 1))
        for k, (lever, (ab, ba), a_drives) in enumerate(zip(network.levers, meshes, drives, strict=True)):
            share = lever.ratio * (ab if a_drives else 1 / ba)
            for node, factor in zip(ends[k], (1.0, -share, share - 1.0), strict=True):
                balance[node, k] += factor
        into = np.zeros(len(w))
        into[at[network.input]] = torque
        balance[at[network.output], -1] = 1.0
        torques = np.linalg.solve(balance[:-1], into[:-1])
        latent = torques[:-1] * relative
        driven = np.where(drives, latent, -latent)
        if (driven >= -ALIKE * np.abs(latent).max(initial=1.0)).all():
            found.append(float(torques[-1] * w[at[network.output]]))
    return found
