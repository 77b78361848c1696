"""Index reduction: the equations to differentiate, by Pantelides' algorithm.

C. C. Pantelides, SIAM J. Sci. Stat. Comput. 9 (1988) 213.
Rigid gears, planetary gears, rolling wheels and relative angles constrain inertias; this is the normal case.
"""

from __future__ import annotations

from powertrain.compiler.alias import Base, Reduced
from powertrain.compiler.flat import Equation
from powertrain.compiler.matching import Matching
from powertrain.errors import ModelError
from powertrain.language.recorder import Place
from powertrain.language.symbols import Symbol, free_symbols, key, time, total_derivative


class Differentiated:
    """Equations with all their derivatives, and the highest derivative of every variable: ``written`` in the model, and now."""

    def __init__(self, reduced: Reduced, known: set[int]) -> None:
        self.reduced, self.known = reduced, known
        self.top: dict[int, int] = {}
        self.written: dict[int, int] = {}
        self.chains: list[list[Symbol]] = []
        self.places: list[Place] = []
        self.incidence: list[list[Base]] = []
        self.matching = Matching(self._highest)

    def copied(self) -> Differentiated:
        """A separate system to which equations can be added."""
        other = Differentiated(self.reduced, self.known)
        other.written, other.top, other.chains = self.written, dict(self.top), [list(chain) for chain in self.chains]
        other.places, other.incidence = list(self.places), list(self.incidence)
        other.matching.variable_of = dict(self.matching.variable_of)
        other.matching.equation_of = dict(self.matching.equation_of)
        return other

    def _highest(self, e: int) -> list[int]:
        return [b for b, order in self.incidence[e] if order == self.top[b]]

    def bases(self, expression: Symbol) -> list[Base]:
        """The variables in an expression with the orders of their derivatives, except known ones (torques of laws, parameters)."""
        recorder = self.reduced.flat.recorder
        found: dict[Base, None] = {}
        for s in free_symbols(expression):
            if key(s) in recorder.constants or key(s) == key(time):
                continue
            base, order = recorder.bases.get(key(s), (s, 0))
            if key(base) not in self.known:
                found[key(base), order] = None
        return list(found)

    def add(self, equation: Equation) -> None:
        """Add an equation and differentiate until the system is structurally regular again."""
        self.chains.append([equation.residual])
        self.places.append(equation.place)
        self.incidence.append(self.bases(equation.residual))
        pending = [len(self.chains) - 1, *self._raise_tops(self.incidence[-1])]
        limit = 50 + len(self.chains)
        while pending:
            if self.matching.augment(pending[-1]):
                pending.pop()
                continue
            if (limit := limit - 1) < 0:
                raise ModelError(f"{equation.place}\n  the index of the model cannot be reduced by differentiation")
            for v in self.matching.seen_variables:
                self.top[v] += 1
            for e in self.matching.seen_equations:
                self.chains[e].append(self._rate(e))
                self.incidence[e] = self.bases(self.chains[e][-1])

    def _raise_tops(self, found: list[Base]) -> list[int]:
        freed = []
        for base, order in found:
            if order > self.top.get(base, 0):
                owner = self.matching.release(base)
                freed += [owner] if owner is not None else []
            self.top[base] = max(order, self.top.get(base, 0))
        return freed

    def _rate(self, e: int) -> Symbol:
        recorder = self.reduced.flat.recorder

        def rate(symbol: Symbol) -> Symbol:
            base, _ = recorder.bases.get(key(symbol), (symbol, 0))
            if key(base) in self.known:
                raise ModelError(
                    f"{self.places[e]}\n  this equation must be differentiated, but it contains the torque or force of a friction element "
                    f"or contact ({symbol.name()}): put an inertia, mass or damper between"
                )
            return recorder.derivative(symbol)

        return total_derivative(self.chains[e][-1], rate)


def differentiate(reduced: Reduced, known: set[int]) -> Differentiated:
    """Run Pantelides' algorithm; ``known`` are the variables that laws determine."""
    system = Differentiated(reduced, known)
    for equation in reduced.equations:
        for base, order in system.bases(equation.residual):
            system.top[base] = max(order, system.top.get(base, 0))
    for base in reduced.symbols:
        if base not in reduced.aliases and base not in known:
            system.top.setdefault(base, 0)
    system.written = dict(system.top)
    for equation in reduced.equations:
        system.add(equation)
    return system
