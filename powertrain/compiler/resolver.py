"""From expressions of a model's variables to expressions of (t, x, z, m, p)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import casadi as ca

from powertrain.compiler import sharing
from powertrain.compiler.alias import Reduced
from powertrain.compiler.blocks import Solved
from powertrain.compiler.calls import substituted_in_place
from powertrain.compiler.torques import Torque, cancels, parallel_groups, solve_torques, unmoved
from powertrain.laws import FrictionLaw
from powertrain.symbols import Symbol, column, free_symbols, key, time


class Resolver:
    """Holds every assigned unknown twice: ``opened``, for given torques of the laws, and with these torques solved for."""

    def __init__(
        self, reduced: Reduced, solved: Solved, torques: list[Torque], x: Symbol, values: dict[int, float]
    ) -> None:
        self.reduced, self.x = reduced, x
        self._residuals = solved.residuals
        assigned = list(solved.expressions)
        if assigned:
            if reduced.flat.recorder.calls:
                assigned = substituted_in_place(solved.names, assigned)
            else:
                assigned = list(ca.substitute_inplace(solved.names, assigned, [], False)[0])
        self.names, self._opened = column(solved.names), column(assigned)
        self.symbols = column([t.symbol for t in torques])
        self.laws = [self._open_law(t) for t in torques]
        self.groups = parallel_groups(torques, self.laws, x, values)
        parameters = {key(c.symbol): c.value for c in reduced.flat.parameters}
        torque, bent, self._bent_rows = solve_torques(torques, self.laws, self.groups, parameters)
        self.torque = column(torque)
        self.assigned = self.close([self._opened])[0]
        self.z = [
            *solved.implicit,
            *(torques[i].symbol for i in bent),
            *(g.theta for g in self.groups if g.theta is not None),
        ]
        self.z_places = [*map(str, solved.places), *(str(torques[i].place) for i in bent)]
        self.z_places += [
            " and ".join(torques[m.law].mode.name() for m in g.members) for g in self.groups if g.theta is not None
        ]

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
        if not expressions:
            return []
        rewritten = self.reduced.rewrite(expressions)
        found = self.now(rewritten)
        left = self._not_assigned(found)
        return (
            _substituted(found, column(left), ca.densify(column([self._derived(s) for s in left]))) if left else found
        )

    def _not_assigned(self, expressions: list[Symbol]) -> list[Symbol]:
        """Derivatives that the equations do not contain and that therefore have no assignment."""
        bases = self.reduced.flat.recorder.bases
        known = {key(s) for group in (self.x, self.names) for s in free_symbols(group)}
        return [s for s in free_symbols(column(expressions)) if key(s) in bases and key(s) not in known]

    def _derived(self, symbol: Symbol) -> Symbol:
        """A derivative that the equations do not contain, along the motion: d/dt by the chain rule."""
        base, order = self.reduced.flat.recorder.bases[key(symbol)]
        (value,) = self.model([self.reduced.derivative(base, order - 1)])
        return self._along(value)

    def _along(self, value: Symbol) -> Symbol:
        """d/dt of an expression in (t, x, z, m, p)."""
        result = ca.jacobian(value, time)
        if self.x.numel():
            result = result + ca.jacobian(value, self.x) @ self._rates()
        z = self.z
        if any(key(s) in {key(u) for u in z} for s in free_symbols(value)):
            unknowns = column(z)
            residual = column(self.residuals())
            moved = ca.jacobian(residual, time)
            if self.x.numel():
                moved = moved + ca.jacobian(residual, self.x) @ self._rates()
            result = result - ca.jacobian(value, unknowns) @ ca.solve(ca.jacobian(residual, unknowns), moved)
        return result

    def _rates(self) -> Symbol:
        recorder = self.reduced.flat.recorder
        return column(self.now([recorder.derivative(s) for s in ca.vertsplit(self.x)]))

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

    def idle(self, k: int) -> Symbol:
        """Where not 0, the torque of this law does not move it."""
        parameters = {key(c.symbol): c.value for c in self.reduced.flat.parameters}
        return self.close([unmoved(self.laws[k], parameters)])[0]

    def acts(self, k: int) -> bool:
        """Whether anything that moves follows the torque of this law, be it through a sensor."""
        derivative = self.reduced.flat.recorder.derivative
        rates = self.opened([*(derivative(s) for s in ca.vertsplit(self.x)), *self._residuals])
        rates += [law.rate for i, law in enumerate(self.laws) if i != k]
        slopes = [e for rate in rates for e in ca.vertsplit(ca.densify(ca.jacobian(rate, self.symbols[k])))]
        return any(not e.is_zero() and not cancels(e) for e in slopes)

    def residuals(self) -> list[Symbol]:
        """The equations of the implicit unknowns ``z``: of the model, of laws that are not linear, of fractions of a shared torque."""
        shared = [sharing.fraction_residual(g.members, g.theta) for g in self.groups if g.theta is not None]
        return self.now([*self._residuals]) + self.close([*self._bent_rows, *shared])

    def _open_law(self, t: Torque) -> Torque:
        return _mapped(t, self.opened)


def _mapped(t: Torque, change: Callable[[list[Symbol]], list[Symbol]]) -> Torque:
    """A law with all its expressions changed."""
    speed, rate = change([t.speed, t.rate])
    return replace(t, law=t.law.mapped(change), speed=speed, rate=rate)


def _substituted(expressions: list[Symbol], old: Symbol, new: Symbol) -> list[Symbol]:
    return list(ca.substitute(expressions, [old], [new])) if expressions else []
