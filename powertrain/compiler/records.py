"""The laws of a reduced model as records of the hybrid DAE, with their indices in the held values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.flat import Flat
from powertrain.compiler.generic import generic_values
from powertrain.compiler.law_torques import LawTorque
from powertrain.compiler.operations import affine_root
from powertrain.compiler.resolver import Resolver
from powertrain.compiler.torques import is_prescribed, limits_follow
from powertrain.dae.hybrid import Contact, Friction, HybridDae, Opened, Reset, Switch, TimeSignal, When
from powertrain.dae.tolerances import alone_tolerance
from powertrain.errors import ModelError
from powertrain.language.law import Law
from powertrain.language.laws import FrictionLaw, UnilateralLaw, WhenLaw
from powertrain.language.recorder import Place, SwitchEntry
from powertrain.language.symbols import Symbol, column, depending, free_symbols, key, scalars, time

_NO_TURN = 1e-12
"""Slopes of motions below this are round-off: t0 - t0 in larger expressions."""
_PRESSES = Symbol(-np.inf), Symbol(0), Symbol(1)
"""The limits and the peak of a contact, in terms of friction."""


@dataclass(frozen=True)
class Held:
    """Values that change only at events: modes, discrete variables, time signals, and marks of laws at rest at their limit.

    ``flags`` belong to the ``when`` laws in order, ``rests`` to the modes of laws that others may hold.
    """

    symbols: tuple[Symbol, ...]
    start: NDArray[np.float64]
    flags: tuple[Symbol, ...]
    rests: dict[int, Symbol]
    layout: dict[int, int]

    def place(self, symbol: Symbol) -> int:
        """The index of a symbol in the held values."""
        return self.layout[key(symbol)]


def held_values(
    flat: Flat, torques: Sequence[LawTorque], others: Sequence[tuple[Place, Law]], resolver: Resolver
) -> Held:
    """All values of a model that change only at events, with their start values."""
    recorder = flat.recorder
    flags = [recorder.hold(f"{place.path}.{law.name}") for place, law in others if isinstance(law, WhenLaw)]
    rests = {
        key(t.mode): t.rests
        for k, t in enumerate(torques)
        if isinstance(t.law, FrictionLaw) and resolver.held_by_others(k)
    }
    symbols = [*(t.mode for t in torques), *(s.mode for s in recorder.switches), *flags]
    symbols += [*(d.symbol for d in flat.discretes), *(s for e in recorder.schedules for s in e.held), *rests.values()]
    symbols += [r.mode for r in recorder.relations]
    known = {key(d.symbol): d.value for d in flat.discretes}
    known |= {key(e.held[1]): float(e.values[0]) for e in recorder.schedules}
    start = np.array([known.get(key(s), 0.0) for s in symbols])
    return Held(tuple(symbols), start, tuple(flags), rests, {key(s): i for i, s in enumerate(symbols)})


def friction_record(k: int, t: LawTorque, resolver: Resolver, held: Held) -> Friction:
    """A friction law of the DAE."""
    opened = resolver.laws[k]
    law, given, reach = t.law, opened.law, resolver.reaches[k]
    assert isinstance(law, FrictionLaw)
    assert isinstance(given, FrictionLaw)
    tied, prescribed = limits_follow(given, column(resolver.tau)), is_prescribed(opened)
    return Friction(
        t.mode.name(), str(t.place), held.place(t.mode), t.speed, law.effort, law.lower, law.upper, law.peak, t.rate,
        unit=resolver.reduced.flat.unknowns[key(t.symbol)].unit if key(t.symbol) in resolver.reduced.flat.unknowns else "1",
        algebraic=t.algebraic,
        prescribed=prescribed,
        acts=not prescribed or resolver.acts(k),
        limitless=tuple(
            mode for mode, bound in ((1.0, given.upper), (-1.0, given.lower)) if bound.is_constant() and np.isinf(float(bound))
        ),
        may_free=not tied,
        known=resolver.known(k),
        rounding=resolver.rounding(k),
        reach=reach,
        rests=held.place(held.rests[key(t.mode)]) if key(t.mode) in held.rests else None,
        share=resolver.share(k) if key(t.mode) in held.rests and (not tied or k not in resolver.implicit) else None,
    )  # fmt: skip


def opened_record(resolver: Resolver, rates: list[Symbol]) -> Opened | None:
    """The model for given torques; None if there are no laws."""
    kinds = FrictionLaw, UnilateralLaw
    places = [k for kind in kinds for k, t in enumerate(resolver.laws) if isinstance(t.law, kind)]
    if not places:
        return None
    laws = [resolver.laws[k] for k in places]
    limits = [(t.law.lower, t.law.upper, t.law.peak) if isinstance(t.law, FrictionLaw) else _PRESSES for t in laws]
    lower, upper, peak = map(column, zip(*limits, strict=True))
    return Opened(
        tau=column([resolver.tau[k] for k in places]),
        xdot=column(resolver.opened(rates)),
        residual=column(resolver.open_residuals()),
        speed=column([t.speed for t in laws]),
        rate=column([t.rate for t in laws]),
        lower=lower,
        upper=upper,
        peak=peak,
        reach=column([resolver.open_reaches[k] for k in places]),
        compliance=column([resolver.open_compliances[k] for k in places]),
        conditions=column(resolver.open_conditions(resolver.reduced.flat.recorder.switches)),
    )


def contact_record(k: int, t: LawTorque, resolver: Resolver, held: Held) -> Contact:
    """A contact of the DAE."""
    law = t.law
    assert isinstance(law, UnilateralLaw)
    return Contact(
        t.mode.name(), str(t.place), held.place(t.mode), law.gap, t.speed, t.rate, law.effort, law.restitution,
        still=resolver.reaches[k] * alone_tolerance(resolver.largest([k])),  # smaller than the uncertainty of friction at its limit
        known=resolver.known(k),
        rounding=resolver.rounding(k),
    )  # fmt: skip


def with_impacts(dae: HybridDae, resolver: Resolver, held: Held) -> HybridDae:
    """Add the responses of the states and of the barriers' speeds to impulses: those of their derivatives to forces and torques."""
    if not dae.barriers:
        return dae
    place = {held.place(t.mode): k for k, t in enumerate(resolver.laws)}
    laws = [place[b.index] for b in dae.barriers]
    rates = [resolver.reduced.flat.recorder.derivative(s) for s in scalars(dae.x)]
    speeds = [b.way * resolver.laws[k].rate for b, k in zip(dae.barriers, laws, strict=True)]
    slopes = ca.jacobian(column([*resolver.opened(rates), *speeds]), column(resolver.tau))[:, laws]
    (response,) = resolver.close([slopes @ ca.diag(ca.DM([b.sense for b in dae.barriers]))])
    return replace(dae, impact_x=response[: len(rates), :], impact_a=response[len(rates) :, :])


def with_turns(dae: HybridDae) -> HybridDae:
    """Mark the signals at whose corners a motion of a law jumps, or a variable that must not.

    Where it does, it depends on the slope at t0, at which the values of all slopes agree.
    """
    return replace(dae, schedules=tuple(replace(s, turns=_turns(dae, s)) for s in dae.schedules))


def _turns(dae: HybridDae, signal: TimeSignal) -> bool:
    start, slope = dae.m[signal.index], dae.m[signal.index + 2]
    motions = ca.vertcat(dae.motions, *(s.value for s in dae.smooth))
    if not (motions.numel() and ca.depends_on(motions, slope)):
        return False
    at_corner = ca.substitute(ca.jacobian(motions, slope), dae.t, start)
    return not (np.abs(generic_values(at_corner).full()) < _NO_TURN).all()


def switch_records(entries: Sequence[SwitchEntry], resolver: Resolver, held: Held) -> tuple[Switch, ...]:
    """Conditions with their modes."""
    values = resolver.model([s.g for s in entries])
    return tuple(
        Switch(
            s.mode.name(),
            str(s.place),
            held.place(s.mode),
            g,
            instant,
            s.continuous,
            resolver.condition_known(opened),
        )
        for s, g, instant, opened in zip(
            entries, values, _event_times(values, resolver, held), resolver.open_conditions(entries), strict=True
        )
    )


def when_record(
    place: Place, law: Law, flag: Symbol, resolver: Resolver, held: Held, x: list[Symbol], units: list[str]
) -> When:
    """A condition with its resets; ``units`` are those of the states x. ModelError for a reset of something that is not a state."""
    assert isinstance(law, WhenLaw)
    reduced, flat = resolver.reduced, resolver.reduced.flat
    position = {key(s): i for i, s in enumerate(x)}
    discretes = {key(d.symbol): d.unit for d in flat.discretes}
    resets = []
    for reset in law.resets:
        (value,) = resolver.model([reset.value])
        if key(reset.variable) in held.layout:
            resets.append(Reset(True, held.place(reset.variable), value, discretes.get(key(reset.variable), "1")))
            continue
        (root,) = reduced.rewrite([reset.variable])
        inside = [s for s in free_symbols(root) if key(s) in position]
        if len(inside) != 1 or len(free_symbols(root)) != 1:
            names = {key(reduced.expression(k, 0)): u.name for k, u in reversed(flat.unknowns.items())}
            known = ", ".join([names.get(key(s), s.name()) for s in inside or x][:8])
            said = (
                f"it is not a state of the model; {'it follows from' if inside else 'states are'} {known}: reset these"
            )
            raise ModelError(f"{place}\n  reinit of {reset.variable}: {said}")
        slope = ca.jacobian(root, inside[0])
        state = position[key(inside[0])]
        resets.append(Reset(False, state, (value - ca.substitute(root, inside[0], 0)) / slope, units[state]))
    (g,) = resolver.model([law.g])
    (instant,) = _event_times([g], resolver, held)
    modes = {key(r.mode) for r in reduced.flat.recorder.relations}
    return When(
        f"{place.path}.{law.name}".lstrip("."),
        str(place),
        held.place(flag),
        g,
        tuple(resets),
        instant,
        tuple(held.place(s) for s in free_symbols(law.g) if key(s) in modes),
        law.initially,
    )


def _event_times(conditions: list[Symbol], resolver: Resolver, held: Held) -> list[Symbol | None]:
    """The instants at which conditions that are affine in time and independent of states change sign.

    None if states or modes are involved: the instant moves with them, and an instant that moves to the present would be missed. Discrete
    variables, marks and time signals change only by resets and at corners.
    """
    recorder = resolver.reduced.flat.recorder
    switches = [*recorder.switches, *recorder.relations]
    modes = {key(t.mode) for t in resolver.laws} | {key(s.mode) for s in switches}
    moving = column([*scalars(resolver.x), *resolver.z, *(s for s in held.symbols if key(s) in modes)])
    moves = depending(conditions, moving)
    return [None if moved else affine_root(g, time) for g, moved in zip(conditions, moves, strict=True)]
