"""From a model to the reduced hybrid DAE: runs the passes in order and assembles their results."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

from powertrain.compiler.alias import Base, Reduced, eliminate_aliases
from powertrain.compiler.binding import Limits, bind_parameters
from powertrain.compiler.blocks import Solved, solve_blocks
from powertrain.compiler.continuity import smooth_variables
from powertrain.compiler.domains import guard_domains
from powertrain.compiler.flat import Equation, Flat, ModelConstant, ModelInput, ModelVariable
from powertrain.compiler.flatten import flatten
from powertrain.compiler.generic import generic_values
from powertrain.compiler.index import Differentiated, differentiate
from powertrain.compiler.jumps import refuse_jumps
from powertrain.compiler.law_torques import LawTorque, declare_torques, with_rates
from powertrain.compiler.records import (
    Held,
    contact_record,
    friction_record,
    held_values,
    opened_record,
    switch_records,
    when_record,
    with_impacts,
    with_turns,
)
from powertrain.compiler.resolver import Resolver
from powertrain.compiler.state_selection import given, select_states
from powertrain.compiler.structure import check_structure
from powertrain.dae.hybrid import HybridDae, TimeSignal
from powertrain.interruption import interruptible
from powertrain.language.component import Component
from powertrain.language.fields import NOMINAL
from powertrain.language.law import Law
from powertrain.language.laws import FrictionLaw, UnilateralLaw, WhenLaw, schedule
from powertrain.language.recorder import Place, reading
from powertrain.language.symbols import Symbol, column, free_symbols, key, mapped, scalars, time
from powertrain.language.units import rate_unit


@dataclass(frozen=True)
class SignalEntry:
    """A signal of the result: its unit, its meaning and its expression in (t, x, z, m, p)."""

    unit: str
    doc: str
    expression: Symbol


@dataclass(frozen=True, eq=False)
class Compiled:
    """The reduced model with the names of its parts.

    Analyses read ``dae``. ``source``, the flat model, serves what refers to the model as it is written: selectors, ``energy()`` and
    ``loss()``, connections, initial equations, the lines that messages quote. ``limits``: conditions on the values of the parameters.
    ``discretes``: index in the held values m of each discrete variable. ``resolve`` gives expressions of the model's variables in
    (t, x, z, m, p), ``open`` the same for given torques of the laws.
    """

    dae: HybridDae
    source: Flat
    limits: Limits
    states: list[str]
    signals: dict[str, SignalEntry]
    parameters: dict[str, ModelConstant]
    inputs: dict[str, ModelInput]
    variables: dict[str, ModelVariable]
    discretes: dict[str, int]
    resolve: Any = field(repr=False)
    open: Any = field(repr=False)


@interruptible()
def compile_model(model: Component) -> Compiled:
    """Flatten, reduce and solve the model symbolically. Raises ModelError if the model is not solvable."""
    return compile_flat(flatten(model))


def free_parameters(model: Component) -> set[str]:
    """Names of the parameters that no equation of the model determines."""
    return {constant.name for constant in bind_parameters(flatten(model)).parameters}


def compile_flat(flat: Flat) -> Compiled:
    """The passes after flattening, in their order."""
    flat = schedule_inputs(guard_domains(refuse_jumps(bind_parameters(flat))))
    values = {key(c.symbol): c.value for c in flat.parameters}
    reduced = eliminate_aliases(flat, values)
    with reading(flat.recorder):
        reduced, torques, others = declare_torques(reduced)
        known = {key(t.symbol) for t in torques}
        check_structure(reduced, torques)
        system = differentiate(reduced, known)
        system, torques = with_rates(system, torques)
        states = select_states(system, _preferences(system, torques, others), values)
    solved = solve_blocks(system, states, values)
    return _assemble(system.reduced, states, solved, torques, others, values, system.written)


def schedule_inputs(flat: Flat) -> Flat:
    """Inputs of the model become schedules: piecewise linear in time, held constant by default."""
    recorder = replace(flat.recorder, schedules=list(flat.recorder.schedules), text=None)
    equations = []
    with reading(recorder):
        for unknown in flat.inputs:
            recorder.path = unknown.name
            equations.append(Equation(unknown.symbol - schedule([0.0], [unknown.value]), Place(unknown.name)))
    return replace(flat, recorder=recorder, equations=[*flat.equations, *equations])


def _preferences(system: Differentiated, torques: list[LawTorque], others: list[tuple[Place, Law]]) -> dict[int, int]:
    """The preference of each variable as a state.

    In turn: variables with a start, relative motions, speeds of friction laws, reset variables, and motions that no torque changes
    (``given``), which a correction of other states must leave as they are.
    """
    reduced = system.reduced
    preferences: dict[int, int] = {}
    bases = reduced.flat.recorder.bases

    def prefer(symbol: Symbol, level: int) -> None:
        inside = [s for s in free_symbols(symbol) if key(s) not in reduced.flat.recorder.constants]
        if len(inside) == 1 and ca.jacobian(symbol, inside[0]).is_constant():
            base = key(bases.get(key(inside[0]), (inside[0], 0))[0])
            preferences[base] = max(level, preferences.get(base, 0))

    for unknown in reduced.flat.unknowns.values():
        if unknown.prefer or unknown.start is not None:
            prefer(reduced.expression(key(unknown.symbol), 0), 2 if unknown.prefer else 1)
    for torque in torques:
        prefer(torque.speed, 3)
    for _, law in others:
        if isinstance(law, WhenLaw):
            for reset in law.resets:
                prefer(reduced.rewrite([reset.variable])[0], 4)
    return preferences | dict.fromkeys(given(system), 5)


def _assemble(
    reduced: Reduced,
    states: list[Base],
    solved: Solved,
    torques: list[LawTorque],
    others: list[tuple[Place, Law]],
    values: dict[int, float],
    written: dict[int, int],
) -> Compiled:
    flat, recorder = reduced.flat, reduced.flat.recorder
    x = [reduced.derivative(reduced.symbols[b], order) for b, order in states]
    rates, units = [recorder.derivative(s) for s in x], [_state_unit(flat, base) for base in states]
    resolver = Resolver(reduced, solved, torques, column(x))
    held, laws = held_values(flat, torques, others, resolver), list(enumerate(resolver.closed_laws()))
    loose = {key(s) for s, (base, order) in zip(x, states, strict=True) if order >= written.get(base, 0)}
    smooth = smooth_variables(reduced, written, resolver, set(held.layout), loose)
    carried = column([v.value for v in smooth])
    dae = HybridDae(
        t=time,
        x=column(x),
        z=column(resolver.z),
        m=column(list(held.symbols)),
        p=column([c.symbol for c in flat.parameters]),
        xdot=column(resolver.now(rates)),
        residual=column(resolver.residuals()),
        state_names=tuple(_state_names(reduced, states)),
        held_start=held.start,
        frictions=tuple(friction_record(k, t, resolver, held) for k, t in laws if isinstance(t.law, FrictionLaw)),
        contacts=tuple(contact_record(k, t, resolver, held) for k, t in laws if isinstance(t.law, UnilateralLaw)),
        opened=opened_record(resolver, rates),
        switches=switch_records(recorder.switches, resolver, held),
        relations=switch_records(recorder.relations, resolver, held),
        whens=tuple(
            when_record(place, law, flag, resolver, held, x, units)
            for (place, law), flag in zip(others, held.flags, strict=True)
        ),
        schedules=tuple(
            TimeSignal(e.place.path or "input", held.place(e.held[0]), e.times, e.values) for e in recorder.schedules
        ),
        guards=tuple(mapped(g, resolver.model) for g in recorder.guards),
        residual_places=tuple(resolver.z_places),
        smooth=smooth,
        relative=tuple(k for k, s in enumerate(x) if key(s) in loose and ca.depends_on(carried, s)),
        nominal=_nominal(reduced, [*states, *((key(s), 0) for s in resolver.z)], values),
    )
    dae = with_turns(with_impacts(dae, resolver, held))
    return Compiled(
        dae=dae,
        source=flat,
        limits=Limits(flat),
        states=list(dae.state_names),
        signals=_signals(flat, resolver, torques, held) | _nameless(reduced, dae, states),
        parameters={c.name: c for c in flat.parameters},
        inputs={u.name: u for u in flat.inputs},
        variables={u.name: u for u in flat.unknowns.values()},
        discretes={d.name: held.place(d.symbol) for d in flat.discretes},
        resolve=resolver.model,
        open=resolver.model_opened,
    )


def _state_names(reduced: Reduced, states: list[Base]) -> list[str]:
    """The first names of the states in the model; derivatives without a name are those of named variables."""
    names = {base: variables[0].name for base, variables in reduced.named().items()}
    whole = [names.get((root, 0), reduced.symbols[root].name()) for root, _ in states]
    return [names.get(b) or "der(" * b[1] + name + ")" * b[1] for b, name in zip(states, whole, strict=True)]


def _nominal(reduced: Reduced, bases: list[Base], values: dict[int, float]) -> tuple[float, ...]:
    """Nominal sizes of variables, from those declared for them and for their multiples."""
    found: dict[Base, float] = {}
    for k, unknown in reduced.flat.unknowns.items():
        alias = reduced.affine(k)
        if unknown.nominal is None or alias.root is None:
            continue
        factor = abs(float(generic_values(Symbol(alias.factor), values)))
        base = alias.root, alias.order
        found[base] = max(found.get(base, 0.0), unknown.nominal / factor)
    return tuple(found.get(base, NOMINAL) for base in bases)


def _nameless(reduced: Reduced, dae: HybridDae, states: list[Base]) -> dict[str, SignalEntry]:
    """States that are derivatives without a name in the model."""
    named = {unknown.name for unknown in reduced.flat.unknowns.values()}
    found = {}
    for name, (root, order), symbol in zip(dae.state_names, states, scalars(dae.x), strict=True):
        if name not in named:
            unknown = reduced.flat.unknowns.get(root)
            doc = unknown.doc if unknown else name
            found[name] = SignalEntry(_state_unit(reduced.flat, (root, order)), f"Derivative: {doc}", symbol)
    return found


def _state_unit(flat: Flat, base: Base) -> str:
    root, order = base
    return rate_unit(flat.unknowns[root].unit if root in flat.unknowns else "1", order)


def _signals(flat: Flat, resolver: Resolver, torques: list[LawTorque], held: Held) -> dict[str, SignalEntry]:
    unknowns, rests = list(flat.unknowns.values()), held.rests
    expressions = resolver.model([u.symbol for u in unknowns])
    signals = {u.name: SignalEntry(u.unit, u.doc, e) for u, e in zip(unknowns, expressions, strict=True)}
    for t in torques:
        shown = t.mode * (1 - rests[key(t.mode)]) if key(t.mode) in rests else t.mode
        signals[t.mode.name()] = SignalEntry("1", "Mode: 1 forward, 0 stuck, -1 backward, 2 free", shown)
    for d in flat.discretes:
        signals[d.name] = SignalEntry(d.unit, d.doc, d.symbol)
    return signals
