"""From expressions of a model's variables to expressions of (t, x, z, m, p)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca

from powertrain import sharing
from powertrain.alias import Reduced
from powertrain.blocks import Solved
from powertrain.laws import FrictionLaw
from powertrain.symbols import Symbol, column
from powertrain.torques import Torque, parallel_groups, solve_torques


class Resolver:
    """Holds every assigned unknown twice: ``opened``, for given torques of the laws, and with these torques solved for."""

    def __init__(
        self, reduced: Reduced, solved: Solved, torques: list[Torque], x: Symbol, values: dict[int, float]
    ) -> None:
        self.reduced = reduced
        assigned = list(solved.expressions)
        if assigned:
            assigned = list(ca.substitute_inplace(solved.names, assigned, [], False)[0])
        self.names, self._opened = column(solved.names), column(assigned)
        self.symbols = column([t.symbol for t in torques])
        self.laws = [self._open_law(t) for t in torques]
        self.groups = parallel_groups(torques, self.laws, x, values)
        self.torque = column(solve_torques(torques, self.laws, self.groups))
        self.assigned = self.close([self._opened])[0]
        self.fractions = [g.theta for g in self.groups if g.theta is not None]

    def opened(self, expressions: list[Symbol]) -> list[Symbol]:
        """Expressions of roots in terms of (t, x, z, m, p) and the torques of the laws."""
        return _substituted(expressions, self.names, self._opened)

    def close(self, expressions: list[Symbol]) -> list[Symbol]:
        """Opened expressions with the torques of the laws put in."""
        return list(ca.substitute(expressions, [self.symbols], [self.torque])) if expressions else []

    def now(self, expressions: list[Symbol]) -> list[Symbol]:
        """Expressions of roots in terms of (t, x, z, m, p)."""
        return _substituted(expressions, ca.vertcat(self.names, self.symbols), ca.vertcat(self.assigned, self.torque))

    def model(self, expressions: list[Symbol]) -> list[Symbol]:
        """Expressions of any variable of the model in terms of (t, x, z, m, p)."""
        return self.now(self.reduced.rewrite(expressions)) if expressions else []

    def closed_laws(self) -> list[Torque]:
        """The laws in terms of (t, x, z, m, p); those that share a motion break loose by their joint interval."""
        laws = [_mapped(law, self.close) for law in self.laws]
        for group in self.groups:
            for k, member in enumerate(group.members):
                both, torque, low, high = self.close(list(sharing.joint_interval(group.members, k)))
                law = laws[member.law].law
                assert isinstance(law, FrictionLaw)
                joint = replace(
                    law,
                    torque=ca.if_else(both, torque, law.torque),
                    lower=ca.if_else(both, low / law.peak, law.lower),
                    upper=ca.if_else(both, high / law.peak, law.upper),
                )
                laws[member.law] = replace(laws[member.law], law=joint)
        return laws

    def fraction_residuals(self) -> list[Symbol]:
        """The equations of the fractions at which laws share a torque."""
        return self.close([sharing.fraction_residual(g.members, g.theta) for g in self.groups if g.theta is not None])

    def _open_law(self, t: Torque) -> Torque:
        return _mapped(t, self.opened)


def _mapped(t: Torque, change: Callable[[list[Symbol]], list[Symbol]]) -> Torque:
    """A law with all its expressions changed."""
    speed, rate = change([t.speed, t.rate])
    return replace(t, law=t.law.mapped(change), speed=speed, rate=rate)


def _substituted(expressions: list[Symbol], old: Symbol, new: Symbol) -> list[Symbol]:
    return list(ca.substitute(expressions, [old], [new])) if expressions else []
