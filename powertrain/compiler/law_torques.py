"""The friction laws and contacts of a model: the unknown of each torque or force, and the speed and rate of each motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, count
from typing import NoReturn

import casadi as ca

from powertrain.compiler.alias import Reduced, quote
from powertrain.compiler.flat import Equation
from powertrain.compiler.index import Differentiated
from powertrain.errors import ModelError
from powertrain.language.law import Law
from powertrain.language.laws import FrictionLaw, UnilateralLaw
from powertrain.language.recorder import Place
from powertrain.language.symbols import Symbol, free_symbols, key, total_derivative


@dataclass(frozen=True)
class LawTorque:
    """A friction law or contact whose torque or force is the unknown ``symbol`` up to factor and offset.

    ``rests`` is 1 if a friction law is at a limit of its torque while others hold it at rest. ``apart``: others cannot hold this law.
    """

    place: Place
    law: FrictionLaw | UnilateralLaw
    symbol: Symbol
    mode: Symbol
    rests: Symbol = field(default_factory=lambda: Symbol(0))
    algebraic: bool = False
    speed: Symbol = field(default_factory=Symbol)
    rate: Symbol = field(default_factory=Symbol)
    apart: bool = False


def declare_torques(reduced: Reduced) -> tuple[Reduced, list[LawTorque], list[tuple[Place, Law]]]:
    """One unknown for each friction law and contact: the root of its torque, or a new symbol if its torque is not a root.

    Returns the model with equations for the new symbols, the laws with their torques, and the other laws.
    """
    flat, torques, others = reduced.flat, [], []
    symbols, equations = dict(reduced.symbols), list(reduced.equations)
    taken: dict[int, Place] = {}
    named: set[str] = set()
    for place, law in flat.laws:
        if not isinstance(law, FrictionLaw | UnilateralLaw):
            others.append((place, law))
            continue
        plain = law.effort
        law = law.mapped(reduced.rewrite)
        value = law.effort
        inside = [s for s in free_symbols(value) if key(s) not in flat.recorder.constants]
        linear_root = (
            len(inside) == 1 and ca.jacobian(value, inside[0]).is_constant() and key(inside[0]) in reduced.symbols
        )
        if linear_root and key(inside[0]) in taken:
            raise ModelError(
                f"{place}\n{taken[key(inside[0])]}\n  these two carry the same torque, and nothing between them has inertia or "
                "compliance: the motion between them is not determined; put an inertia, mass or damper between them"
            )
        if linear_root:
            symbol = inside[0]
        elif not inside:
            _refuse_given(reduced, place, plain)
        else:
            symbol = Symbol.sym(f"{place.path}.{law.name}.torque")
            symbols[key(symbol)] = symbol
            equations.append(Equation(value - symbol, place))
        taken[key(symbol)] = place
        name, hold = _unlike(named, f"{place.path}.{law.name}".lstrip(".")), flat.recorder.hold
        torques.append(LawTorque(place, law, symbol, hold(name), hold(f"{name}.rests")))
    return replace(reduced, symbols=symbols, equations=equations), torques, others


def _unlike(named: set[str], name: str) -> str:
    """The name of a law, with a number if another law of the component has the same name."""
    found = next(n for n in chain([name], (f"{name}_{k}" for k in count(2))) if n not in named)
    named.add(found)
    return found


def _refuse_given(reduced: Reduced, place: Place, torque: Symbol) -> NoReturn:
    """Reject a law whose torque is already constant, because a flange is not connected."""
    ties = reduced.tied_by([key(s) for s in free_symbols(torque) if key(s) in reduced.flat.unknowns])
    raise ModelError(
        f"loose part: {place}\n  its torque or force is already given by the lines below, so that its motion is not determined; "
        f"connect the open port to something with inertia, or remove the part\n  {quote(ties)}"
    )


def with_rates(system: Differentiated, torques: Sequence[LawTorque]) -> tuple[Differentiated, list[LawTorque]]:
    """The system with the speeds and rates of the laws, and the laws with these.

    A law's rate is the derivative of its relative speed, or the speed itself if the torque acts on the speed at once.
    """
    system, symbols = system.copied(), dict(system.reduced.symbols)
    rate_of = system.reduced.flat.recorder.derivative

    def defined(name: str, expression: Symbol, place: Place) -> Symbol:
        symbol = Symbol.sym(name)
        symbols[key(symbol)] = symbol
        system.add(Equation(symbol - expression, place))
        return symbol

    def rated(torque: LawTorque) -> LawTorque:
        law, place, path = torque.law, torque.place, torque.mode.name()
        if isinstance(law, FrictionLaw):
            speed = law.w
            if any(order > system.top.get(b, 0) for b, order in system.bases(speed)):
                defined(f"{path}.speed", speed, place)
            if _follows_at_once(system, speed, torque.symbol):
                return replace(torque, algebraic=True, speed=speed, rate=speed)
        else:
            speed = defined(f"{path}.speed", total_derivative(law.gap, rate_of), place)
        rate = defined(f"{path}.rate", total_derivative(speed, rate_of), place)
        return replace(torque, speed=speed, rate=rate)

    rates = [rated(torque) for torque in torques]
    system.reduced = replace(system.reduced, symbols=symbols)
    return system, rates


def _follows_at_once(system: Differentiated, speed: Symbol, torque: Symbol) -> bool:
    """Whether ``speed`` contains an unknown that the equations tie to ``torque`` without an integration."""
    stack = [b for b, order in system.bases(speed) if order == system.top.get(b, -1)]
    seen: set[int] = set()
    while stack:
        base = stack.pop()
        owner = system.matching.equation_of.get(base)
        if owner is None or owner in seen:
            continue
        seen.add(owner)
        residual = system.chains[owner][-1]
        if any(key(s) == key(torque) for s in free_symbols(residual)):
            return True
        stack += [b for b, order in system.incidence[owner] if order == system.top[b]]
    return False
