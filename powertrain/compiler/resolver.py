"""From expressions of a model's variables to expressions of (t, x, z, m, p)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import cached_property

import casadi as ca

from powertrain.compiler.alias import Reduced
from powertrain.compiler.blocks import Solved
from powertrain.compiler.calls import substituted_in_place
from powertrain.compiler.generic import generic_values
from powertrain.compiler.law_torques import LawTorque
from powertrain.compiler.torques import (
    COMPLIANCE,
    Motion,
    cancels,
    compliance,
    contains,
    held_by_others,
    is_prescribed,
    mobility,
    set_apart,
    shares,
    solve_torques,
)
from powertrain.dae.tolerances import ROUND_OFF, alone_tolerance, condition_tolerance, torque_tolerance
from powertrain.language.laws import FrictionLaw
from powertrain.language.recorder import SwitchEntry
from powertrain.language.symbols import Symbol, column, free_symbols, key, scalars, time
from powertrain.numerics.pivots import match_rows
from powertrain.numerics.sparse_lu import factorize


class Resolver:
    """Expressions ``opened``, for given torques of the laws, and closed, with these torques substituted.

    ``implicit``: the laws whose torques remain unknowns.
    """

    def __init__(self, reduced: Reduced, solved: Solved, torques: list[LawTorque], x: Symbol) -> None:
        self.reduced, self.x = reduced, x
        self._residuals = solved.residuals
        assigned = column(substituted_in_place(solved.names, solved.expressions))
        self.names = column(solved.names)
        self.roots, self.tau, self._given = _torque_symbols(torques)
        self._tau_column = column(self.tau)
        self._opened = self._in_torques([assigned])[0]
        laws = [self._open_law(t, own) for t, own in zip(torques, self.tau, strict=True)]
        laws = self._through_implicit(laws, column(solved.implicit))
        self.laws = set_apart(laws, Motion(x, column(self._open_rates()), column(solved.implicit)))
        found = solve_torques(self.laws)
        self.torque, self._creep = column(found.tau), found.creep
        self._implicit_laws, self.implicit = found.residuals, found.implicit
        self._largest: dict[frozenset[int], Symbol] = {}
        self.z = [*solved.implicit, *(self.tau[i] for i in found.implicit)]
        self.z_places = [*map(str, solved.places), *(str(torques[i].place) for i in found.implicit)]

    def _through_implicit(self, laws: list[LawTorque], z: Symbol) -> list[LawTorque]:
        """The laws; where a torque acts on its own rate only through implicit unknowns, with the rate after a Newton step of these.

        v(z) with R(z, tau) = 0 becomes v - v_z R_z^-1 R: the same value, with the slope of the implicit function theorem.
        """
        hidden = [k for k, law in enumerate(laws) if is_prescribed(law) and contains(law.rate, z)]
        if not hidden:
            return laws
        residual = column(self.open_residuals())
        slopes = ca.jacobian(residual, z)
        step = -factorize(slopes, match_rows(slopes.sparsity(), generic_values(slopes).full()))(residual)
        for k in hidden:
            rate = laws[k].rate + ca.jacobian(laws[k].rate, z) @ step
            slope = ca.jacobian(rate, self.tau[k])
            if not slope.is_zero():
                laws[k] = replace(laws[k], rate=rate)
        return laws

    def opened(self, expressions: list[Symbol]) -> list[Symbol]:
        """Expressions of roots in terms of (t, x, z, m, p) and the torques of the laws."""
        return self._in_torques(_substituted(expressions, self.names, self._opened))

    def close(self, expressions: list[Symbol]) -> list[Symbol]:
        """Opened expressions with the torques of the laws substituted."""
        return _substituted(expressions, self._tau_column, self.torque)

    def now(self, expressions: list[Symbol]) -> list[Symbol]:
        """Expressions of roots in terms of (t, x, z, m, p)."""
        return self.close(self.opened(expressions))

    def _in_torques(self, expressions: list[Symbol]) -> list[Symbol]:
        """Expressions of the torques' root variables, in terms of the torques."""
        return _substituted(expressions, self.roots, self._given)

    def model(self, expressions: list[Symbol]) -> list[Symbol]:
        """Expressions of any variable of the model in terms of (t, x, z, m, p)."""
        return self._with_derivatives(self.now(self.reduced.rewrite(expressions)))

    def model_opened(self, expressions: list[Symbol]) -> list[Symbol]:
        """The same for given torques of the laws."""
        return self._with_derivatives(self.opened(self.reduced.rewrite(expressions)))

    def _with_derivatives(self, found: list[Symbol]) -> list[Symbol]:
        """Expressions with values for the derivatives that do not appear in the equations."""
        if left := self._not_assigned(found):
            return _substituted(found, column(left), ca.densify(column([self._derived(s) for s in left])))
        return found

    def _not_assigned(self, expressions: list[Symbol]) -> list[Symbol]:
        """Derivatives that do not appear in the equations and therefore have no assignment."""
        bases = self.reduced.flat.recorder.bases
        known = {key(s) for group in (self.x, self.names) for s in free_symbols(group)}
        return [s for s in free_symbols(column(expressions)) if key(s) in bases and key(s) not in known]

    def _derived(self, symbol: Symbol) -> Symbol:
        """A derivative that does not appear in the equations: d/dt along the motion by the chain rule."""
        base, order = self.reduced.flat.recorder.bases[key(symbol)]
        (value,) = self.model([self.reduced.derivative(base, order - 1)])
        return self._along(value)

    def _along(self, value: Symbol) -> Symbol:
        """d/dt of an expression in (t, x, z, m, p); the unknowns z move so that their residual R stays zero: R_z dz/dt = -dR/dt."""
        rates, z = column(self.close(self._open_rates())), column(self.z)

        def at_given_z(moving: Symbol) -> Symbol:
            return ca.jacobian(moving, time) + ca.jacobian(moving, self.x) @ rates

        if not contains(value, z):
            return at_given_z(value)
        residual = column(self.residuals())
        return at_given_z(value) - ca.jacobian(value, z) @ ca.solve(ca.jacobian(residual, z), at_given_z(residual))

    def _open_rates(self) -> list[Symbol]:
        """The rates of the states for given torques."""
        derivative = self.reduced.flat.recorder.derivative
        return self.opened([derivative(s) for s in scalars(self.x)])

    def closed_laws(self) -> list[LawTorque]:
        """The laws in terms of (t, x, z, m, p)."""
        return [_mapped(law, self.close) for law in self.laws]

    def acts(self, k: int) -> bool:
        """Whether any motion depends on the torque of this law, even through a sensor."""
        rates = [*self._open_rates(), *self.open_residuals()]
        rates += [law.rate for i, law in enumerate(self.laws) if i != k]
        slopes = [e for rate in rates for e in scalars(ca.jacobian(rate, self.tau[k]))]
        return any(not e.is_zero() and not cancels(e) for e in slopes)

    def residuals(self) -> list[Symbol]:
        """The equations of the implicit unknowns ``z``: the model's own, and those of laws that are nonlinear in the torques."""
        return self.now(self._residuals) + self.close(self._implicit_laws)

    def _contributions(self, opened: Symbol, symbols: Symbol) -> Symbol:
        """The sizes of what some symbols contribute to an opened expression, sum_j |d/ds_j s_j|."""
        slopes = ca.jacobian(opened, symbols)
        parts = [ca.fabs(slopes.nz[k] * symbols[j]) for k, j in enumerate(slopes.sparsity().get_col())]
        return self.close([sum(parts, Symbol(0))])[0]

    def largest(self, places: Iterable[int]) -> Symbol:
        """The largest torque or force of the laws that interact with those at ``places``, directly or through others."""
        groups = frozenset(self._groups[k] for k in places)
        if groups not in self._largest:
            size = Symbol(0)
            for k, torque in enumerate(scalars(self.torque) if groups else []):
                size = ca.fmax(size, ca.fabs(torque)) if self._groups[k] in groups else size
            self._largest[groups] = size
        return self._largest[groups]

    def _follows(self, opened: list[Symbol]) -> list[int]:
        """The laws on whose torques the opened expressions depend."""
        found = ca.which_depends(column(opened), self._tau_column, 1, False) if opened and self.tau else []
        return [k for k, one in enumerate(found) if one]

    @cached_property
    def _groups(self) -> list[int]:
        """The group of every law, named by its first law: torques of one group do not affect motions and limits of another."""
        groups, through = list(range(len(self.laws))), self._follows(self._residuals)
        for k, law in enumerate(self.laws):
            limits = [law.law.lower, law.law.upper] if isinstance(law.law, FrictionLaw) else []
            meeting = {groups[j] for j in (k, *through, *self._follows([law.rate, *limits]))}
            groups = [min(meeting) if group in meeting else group for group in groups]
        return groups

    def known(self, k: int) -> Symbol:
        """Uncertainty of the torque of a law: round-off, unless others take part in its motion."""
        law, largest = self.laws[k], self.largest([k])
        if not shares(law, self._tau_column):
            return alone_tolerance(largest)
        return torque_tolerance(self._contributions(law.rate, self._tau_column) / self.reaches[k], largest)

    def condition_known(self, opened: Symbol) -> Symbol:
        """Uncertainty of an opened condition."""
        return condition_tolerance(self._contributions(opened, self._tau_column), self.largest(self._follows([opened])))

    def rounding(self, k: int) -> Symbol:
        """Uncertainty of the torque of a law due to the rounding of angles and positions, which grow with the distance travelled."""
        return ROUND_OFF * (self._contributions(self.laws[k].rate, self._positions) / self.reaches[k])

    @cached_property
    def _positions(self) -> Symbol:
        """The states that are angles or positions."""
        unknowns = self.reduced.flat.unknowns
        return column([s for s in scalars(self.x) if key(s) in unknowns and unknowns[key(s)].unit in ("rad", "m")])

    def held_by_others(self, k: int) -> bool:
        """Whether other laws may hold the motion of this one."""
        return held_by_others(self.laws[k], self._tau_column)

    @cached_property
    def reaches(self) -> list[Symbol]:
        """The effect of the torque of every law on its own rate; 1 if there is none."""
        return self.close(self.open_reaches)

    @cached_property
    def open_reaches(self) -> list[Symbol]:
        """The same for given torques."""
        slopes = [ca.jacobian(law.rate, law.law.effort) for law in self.laws]
        return [Symbol(1) if slope.is_zero() else mobility(slope) for slope in slopes]

    def share(self, k: int) -> Symbol:
        """The torque due to the law's compliance, before and after the proximal step; at a limit it is at least the limit."""
        return self._creep[k] / (COMPLIANCE * self.close([self.open_compliances[k]])[0])

    @cached_property
    def open_compliances(self) -> list[Symbol]:
        """The compliance of every law, when stuck, for given torques."""
        return [compliance(law, self._tau_column) for law in self.laws]

    def open_residuals(self) -> list[Symbol]:
        """The model's implicit equations for given torques."""
        return self.opened(self._residuals)

    def open_conditions(self, entries: Sequence[SwitchEntry]) -> list[Symbol]:
        """Conditions for given torques."""
        return self.opened(self.reduced.rewrite([s.g for s in entries]))

    def _open_law(self, t: LawTorque, own: Symbol) -> LawTorque:
        law = _mapped(t, self.opened)
        return replace(law, law=replace(law.law, effort=own))


def _torque_symbols(torques: list[LawTorque]) -> tuple[Symbol, list[Symbol], Symbol]:
    """The root variables of the torques of all laws, the torques, and the roots in terms of these."""
    tau, given = [], []
    for t in torques:
        value = t.law.effort
        slope = ca.jacobian(value, t.symbol)
        if value.is_symbolic() or slope.is_zero():  # the symbol is the torque itself, or equals it by an equation
            own, root = t.symbol, t.symbol
        else:
            own = Symbol.sym(f"{t.mode.name()}.torque")
            root = (own - ca.substitute(value, t.symbol, 0)) / slope
        tau.append(own)
        given.append(root)
    return column([t.symbol for t in torques]), tau, column(given)


def _mapped(t: LawTorque, change: Callable[[list[Symbol]], list[Symbol]]) -> LawTorque:
    """A law with all its expressions changed."""
    speed, rate = change([t.speed, t.rate])
    return replace(t, law=t.law.mapped(change), speed=speed, rate=rate)


def _substituted(expressions: list[Symbol], old: Symbol, new: Symbol) -> list[Symbol]:
    return list(ca.substitute(expressions, [old], [new])) if expressions else []
