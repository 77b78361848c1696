"""From a model's text to the reduced hybrid DAE: runs the passes in their order and assembles what they give."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca
import numpy as np

from powertrain.compiler.alias import Base, Reduced, eliminate_aliases
from powertrain.compiler.binding import bind_parameters
from powertrain.compiler.blocks import Solved, solve_blocks
from powertrain.compiler.continuity import smooth_variables
from powertrain.compiler.flatten import Equation, Flat, ModelConstant, ModelVariable, flatten
from powertrain.compiler.hybrid import Contact, Friction, Guard, HybridDae, Opened, Reset, Schedule, Switch, When
from powertrain.compiler.index import differentiate, select_states
from powertrain.compiler.jumps import refuse_jumps
from powertrain.compiler.resolver import Resolver
from powertrain.compiler.structure import check_structure
from powertrain.compiler.torques import LawTorque, add_rates, declare_torques
from powertrain.errors import ModelError
from powertrain.language.component import Component
from powertrain.language.law import Law
from powertrain.language.laws import FrictionLaw, UnilateralLaw, WhenLaw
from powertrain.language.recorder import GuardEntry, Place, reading
from powertrain.language.symbols import Symbol, column, free_symbols, key, time
from powertrain.language.units import rate_unit
from powertrain.modes.tolerances import condition_tolerance


@dataclass(frozen=True)
class SignalEntry:
    """A signal of the result: its unit, its meaning and its expression in (t, x, z, m, p)."""

    unit: str
    doc: str
    expression: Symbol


@dataclass
class Compiled:
    """The reduced model and everything that names its parts.

    ``resolve`` gives expressions of the model's variables in (t, x, z, m, p), ``open`` the same for given torques of the laws.
    """

    flat: Flat
    dae: HybridDae
    states: list[str]
    signals: dict[str, SignalEntry]
    parameters: dict[str, ModelConstant]
    inputs: dict[str, ModelVariable]
    resolve: Any = field(repr=False)
    open: Any = field(repr=False)


def compile_model(model: Component) -> Compiled:
    """Flattens, reduces and solves the model symbolically. Raises ModelError where the text does not describe a solvable model."""
    return compile_flat(flatten(model))


def compile_flat(flat: Flat) -> Compiled:
    """The passes after flattening, in their order."""
    flat = refuse_jumps(bind_parameters(flat))
    inputs = _schedule_inputs(flat)
    values = {key(c.symbol): c.value for c in flat.parameters}
    reduced = eliminate_aliases(flat, values)
    with reading(flat.recorder):
        torques, others = declare_torques(reduced)
        known = {key(t.symbol) for t in torques}
        check_structure(reduced, torques)
        system = differentiate(reduced, known)
        tops = dict(system.top)
        add_rates(system, torques)
        states = select_states(system, _preferences(reduced, torques, others), values)
    solved = solve_blocks(system, states, values)
    return _assemble(reduced, states, solved, torques, others, inputs, values, tops)


def _schedule_inputs(flat: Flat) -> list[ModelVariable]:
    """Inputs of the model become schedules: piecewise linear in time, held constant by default."""
    from powertrain.language.laws import schedule

    with reading(flat.recorder):
        for unknown in flat.inputs:
            flat.recorder.path, flat.recorder.text = unknown.name, None
            flat.equations.append(Equation(unknown.symbol - schedule([0.0], [unknown.guess]), Place(unknown.name)))
    return flat.inputs


def _preferences(reduced: Reduced, torques: list[LawTorque], others: list[tuple[Place, Law]]) -> dict[int, int]:
    """How much each variable is wanted as a state: what has a start, relative motions, speeds of friction laws, what a when resets."""
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
    return preferences


def _assemble(
    reduced: Reduced,
    states: list[Base],
    solved: Solved,
    torques: list[LawTorque],
    others: list[tuple[Place, Law]],
    inputs: list[ModelVariable],
    values: dict[int, float],
    tops: dict[int, int],
) -> Compiled:
    flat, recorder = reduced.flat, reduced.flat.recorder
    x = [reduced.derivative(reduced.symbols[b], order) for b, order in states]
    rates = [recorder.derivative(s) for s in x]
    resolver = Resolver(reduced, solved, torques, column(x), values)
    laws = resolver.closed_laws()
    flags = [recorder.hold(f"{place.path}.{law.name}") for place, law in others if isinstance(law, WhenLaw)]
    rests = {
        key(t.mode): recorder.hold(f"{t.mode.name()}.rests")
        for k, t in enumerate(laws)
        if isinstance(t.law, FrictionLaw) and resolver.shares(k)
    }
    m = [*_held_symbols(flat, torques, flags), *rests.values()]
    layout = {key(s): i for i, s in enumerate(m)}
    dae = HybridDae(
        t=time,
        x=column(x),
        z=column(resolver.z),
        m=column(m),
        p=column([c.symbol for c in flat.parameters]),
        xdot=column(resolver.now(rates)),
        residual=column(resolver.residuals()),
        state_names=tuple(_state_names(reduced, states)),
        held_start=_held_start(flat, m),
        frictions=tuple(
            _friction(k, t, resolver, layout, rests) for k, t in enumerate(laws) if isinstance(t.law, FrictionLaw)
        ),
        contacts=tuple(_contact(t, layout) for t in laws if isinstance(t.law, UnilateralLaw)),
        opened=_opened(resolver, rates),
        switches=tuple(
            Switch(
                s.mode.name(),
                str(s.place),
                layout[key(s.mode)],
                g,
                _event_time(g, recorder.constants),
                s.continuous,
                condition_tolerance(resolver.meeting(opened), resolver.largest),
            )
            for s, g, opened in zip(
                recorder.switches,
                resolver.model([s.g for s in recorder.switches]),
                resolver.open_conditions(),
                strict=True,
            )
        ),
        whens=tuple(
            _when(layout[key(flag)], place, law, resolver, layout, x, reduced)
            for (place, law), flag in zip(others, flags, strict=True)
        ),
        schedules=tuple(
            Schedule(e.place.path or "input", layout[key(e.held[0])], e.times, e.values) for e in recorder.schedules
        ),
        guards=tuple(_guard(g, resolver) for g in recorder.guards),
        residual_places=tuple(resolver.z_places),
        smooth=smooth_variables(reduced, tops, states, resolver, set(layout)),
    )
    dae = _with_impacts(dae, resolver, torques)
    return Compiled(
        flat=flat,
        dae=dae,
        states=list(dae.state_names),
        signals=_signals(flat, resolver, torques, rests) | _nameless(reduced, dae, states),
        parameters={c.name: c for c in flat.parameters},
        inputs={u.name: u for u in inputs},
        resolve=resolver.model,
        open=resolver.model_opened,
    )


def _held_symbols(flat: Flat, torques: list[LawTorque], flags: list[Symbol]) -> list[Symbol]:
    held = [t.mode for t in torques] + [s.mode for s in flat.recorder.switches] + flags
    held += [d.symbol for d in flat.discretes]
    held += [s for entry in flat.recorder.schedules for s in entry.held]
    return held


def _held_start(flat: Flat, held: list[Symbol]) -> Any:
    start = {key(d.symbol): d.value for d in flat.discretes}
    start |= {key(e.held[1]): float(e.values[0]) for e in flat.recorder.schedules}
    return np.array([start.get(key(s), 0.0) for s in held])


def _friction(k: int, t: LawTorque, resolver: Resolver, layout: dict[int, int], rests: dict[int, Symbol]) -> Friction:
    opened = resolver.laws[k]
    law, given = t.law, opened.law
    assert isinstance(law, FrictionLaw)
    assert isinstance(given, FrictionLaw)
    prescribed = not any(ca.which_depends(opened.rate, resolver.tau[k], 1, False))
    return Friction(
        t.mode.name(), str(t.place), layout[key(t.mode)], t.speed, law.torque, law.lower, law.upper, law.peak, t.rate,
        unit=resolver.reduced.flat.unknowns[key(t.symbol)].unit if key(t.symbol) in resolver.reduced.flat.unknowns else "1",
        algebraic=t.algebraic,
        prescribed=prescribed,
        acts=not prescribed or resolver.acts(k),
        limitless=tuple(
            mode for mode, bound in ((1.0, given.upper), (-1.0, given.lower)) if bound.is_constant() and np.isinf(float(bound))
        ),
        may_free=not any(ca.which_depends(ca.vertcat(given.lower, given.upper), column(resolver.tau), 1, False)),
        known=resolver.known(k),
        rounding=resolver.rounding(k),
        reach=resolver.reach(k),
        rests=layout[key(rests[key(t.mode)])] if key(t.mode) in rests else None,
    )  # fmt: skip


def _opened(resolver: Resolver, rates: list[Symbol]) -> Opened | None:
    """The model for given torques; None without laws."""
    laws = [t for t in resolver.laws if isinstance(t.law, FrictionLaw)]
    contacts = [t for t in resolver.laws if isinstance(t.law, UnilateralLaw)]
    if not laws and not contacts:
        return None
    friction = [t.law for t in laws if isinstance(t.law, FrictionLaw)]
    place = {id(t): k for k, t in enumerate(resolver.laws)}
    return Opened(
        tau=column([resolver.tau[place[id(t)]] for t in [*laws, *contacts]]),
        xdot=column(resolver.opened(rates)),
        residual=column(resolver.open_residuals()),
        speed=column([t.speed for t in [*laws, *contacts]]),
        rate=column([t.rate for t in [*laws, *contacts]]),
        lower=column([*(f.lower for f in friction), *(Symbol(-np.inf) for _ in contacts)]),
        upper=column([*(f.upper for f in friction), *(Symbol(0) for _ in contacts)]),
        peak=column([*(f.peak for f in friction), *(Symbol(1) for _ in contacts)]),
        reach=column([resolver.open_reach(place[id(t)]) for t in [*laws, *contacts]]),
        compliance=column([resolver.open_compliance(place[id(t)]) for t in [*laws, *contacts]]),
        conditions=column(resolver.open_conditions()),
    )


def _contact(t: LawTorque, layout: dict[int, int]) -> Contact:
    law = t.law
    assert isinstance(law, UnilateralLaw)
    return Contact(
        t.mode.name(), str(t.place), layout[key(t.mode)], law.gap, t.speed, t.rate, law.force, law.restitution
    )


def _with_impacts(dae: HybridDae, resolver: Resolver, torques: list[LawTorque]) -> HybridDae:
    """The response of the states' derivatives and of the gaps' accelerations to the contact forces."""
    contacts = [i for i, t in enumerate(torques) if isinstance(t.law, UnilateralLaw)]
    if not contacts:
        return dae
    forces = column([resolver.tau[i] for i in contacts])
    rates = [resolver.reduced.flat.recorder.derivative(s) for s in ca.vertsplit(dae.x)] if dae.x.numel() else []
    opened = [*resolver.opened(rates), *(resolver.laws[i].rate for i in contacts)]
    (response,) = resolver.close([ca.jacobian(column(opened), forces)])
    return replace(dae, impact_x=response[: len(rates), :], impact_a=response[len(rates) :, :])


def _guard(g: GuardEntry, resolver: Resolver) -> Guard:
    value, low, high = resolver.model([g.value, g.low, g.high])
    return Guard(g.name, str(g.place), value, low, high, g.unit, g.action)


def _when(
    index: int, place: Place, law: Law, resolver: Resolver, layout: dict[int, int], x: list[Symbol], reduced: Reduced
) -> When:
    assert isinstance(law, WhenLaw)
    flat = reduced.flat
    position = {key(s): i for i, s in enumerate(x)}
    resets = []
    for reset in law.resets:
        (value,) = resolver.model([reset.value])
        if key(reset.variable) in layout:
            resets.append(Reset(True, layout[key(reset.variable)], value))
            continue
        (root,) = reduced.rewrite([reset.variable])
        inside = [s for s in free_symbols(root) if key(s) in position]
        if len(inside) != 1 or len(free_symbols(root)) != 1:
            names = {key(reduced.expression(k, 0)): u.name for k, u in reversed(flat.unknowns.items())}
            known = ", ".join([names.get(key(s), s.name()) for s in inside or x][:8])
            said = f"it is no state of the model; {'it follows from' if inside else 'states are'} {known}: reset these"
            raise ModelError(f"{place}\n  reinit of {reset.variable}: {said}")
        slope = ca.jacobian(root, inside[0])
        resets.append(Reset(False, position[key(inside[0])], (value - ca.substitute(root, inside[0], 0)) / slope))
    (g,) = resolver.model([law.g])
    return When(
        f"{place.path}.{law.name}".lstrip("."),
        str(place),
        index,
        g,
        tuple(resets),
        _event_time(g, flat.recorder.constants),
    )


def _event_time(g: Symbol, constants: set[int]) -> Symbol | None:
    """The instant where g, affine in time and free of states, changes its sign."""
    if any(key(s) not in constants and key(s) != key(time) for s in free_symbols(g)):
        return None
    slope = ca.jacobian(g, time)
    if slope.is_zero() or any(key(s) == key(time) for s in free_symbols(slope)):
        return None
    return -ca.substitute(g, time, 0) / slope


def _state_names(reduced: Reduced, states: list[Base]) -> list[str]:
    named: dict[Base, str] = {}
    for k, unknown in reduced.flat.unknowns.items():
        alias = reduced.aliases.get(k)
        base = (alias.root, alias.order) if alias is not None and alias.root is not None else (k, 0)
        plain = alias is None or alias.plain
        if plain and (base not in named or unknown.name.count(".") < named[base].count(".")):
            named[base] = unknown.name
    return [named.get(b) or _derivative_name(named.get((b[0], 0), reduced.symbols[b[0]].name()), b[1]) for b in states]


def _derivative_name(name: str, order: int) -> str:
    return "der(" * order + name + ")" * order


def _nameless(reduced: Reduced, dae: HybridDae, states: list[Base]) -> dict[str, SignalEntry]:
    """The states that are derivatives to which the text gives no name."""
    named = {unknown.name for unknown in reduced.flat.unknowns.values()}
    found = {}
    for name, (root, order), symbol in zip(dae.state_names, states, ca.vertsplit(dae.x) if states else (), strict=True):
        if name not in named:
            unknown = reduced.flat.unknowns.get(root)
            unit, doc = (unknown.unit, unknown.doc) if unknown else ("1", name)
            found[name] = SignalEntry(rate_unit(unit, order), f"Derivative: {doc}", symbol)
    return found


def _signals(
    flat: Flat, resolver: Resolver, torques: list[LawTorque], rests: dict[int, Symbol]
) -> dict[str, SignalEntry]:
    unknowns = list(flat.unknowns.values())
    expressions = resolver.model([u.symbol for u in unknowns])
    signals = {u.name: SignalEntry(u.unit, u.doc, e) for u, e in zip(unknowns, expressions, strict=True)}
    for t in torques:
        shown = t.mode * (1 - rests[key(t.mode)]) if key(t.mode) in rests else t.mode
        signals[t.mode.name()] = SignalEntry("1", "Mode: 1 forward, 0 stuck, -1 backward, 2 free", shown)
    for d in flat.discretes:
        signals[d.name] = SignalEntry(d.unit, d.doc, d.symbol)
    return signals
