"""The equations of a model in given modes as CasADi functions, with the names and units of all arguments and results."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from reprlib import repr as short
from typing import Any, Protocol

import casadi as ca
import numpy as np

from powertrain.compiler.assemble import Compiled
from powertrain.dae.friction import BACKWARD, FORWARD, FREE, STUCK
from powertrain.dae.hybrid import Contact, Friction, HybridDae
from powertrain.errors import ParameterError, suggestion
from powertrain.given_runs import instant_of_run
from powertrain.language.arguments import by_name, count, listed, number
from powertrain.language.reals import Array
from powertrain.language.symbols import Symbol, column
from powertrain.result import Result
from powertrain.signals import Selector, signals_of

Modes = Mapping[str, float] | tuple[Result[Any], float]


@dataclass(frozen=True)
class Dynamics:
    """A model in given modes.

    ``function``: a ``casadi.Function`` of (t, x, z, u, p) that gives

        xdot       der(x)
        residual   0 = residual determines the algebraic unknowns z
        y          the outputs
        margin     >= 0 where the modes hold: speeds of sliding laws, distances of stuck torques from their limits, ...
        still      = 0 where the modes hold: speeds and gaps that stuck friction and closed contacts keep at zero

    ``states``, ``algebraic``, ``inputs``, ``parameters``, ``outputs``, ``margins`` and ``stills`` are the names of the entries;
    ``units`` are their units. ``x``, ``z``, ``u``, ``p``: start values in the same order. ``modes``: the modes by law.
    """

    function: ca.Function
    states: tuple[str, ...]
    algebraic: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]
    margins: tuple[str, ...]
    stills: tuple[str, ...]
    units: dict[str, str]
    modes: dict[str, float]
    x: Array
    z: Array
    u: Array
    p: Array

    def step(self, h: float, intervals: int = 1) -> ca.Function:
        """The model over a time step, differentiable to any order.

        Parameters
        ----------
        h : float
            Duration of the step [s]. u is constant over it.
        intervals : int
            Number of equal intervals. The method is Radau collocation of order 5, also for stiff models and algebraic unknowns.

        Returns
        -------
        casadi.Function
            (t, x, u, p) -> (x_end, y, margin): the states, the outputs and the limits of the modes at the end of the step.

        Raises
        ------
        ParameterError
            If ``h`` is not positive, ``intervals`` is not a positive integer, or the model has no states.
        """
        h = number("h", h, "s")
        if h <= 0.0:
            raise ParameterError(f"h = {h:g} s is not positive")
        if not self.function.size1_in("x"):
            raise ParameterError("step: the model has no states to integrate; call the function itself at any time")
        t, s = ca.MX.sym("t"), ca.MX.sym("s")
        x, z, u, p = (ca.MX.sym(n, self.function.size1_in(n)) for n in ("x", "z", "u", "p"))
        rates = self.function(t=t + s, x=x, z=z, u=u, p=p)
        dae: dict[str, Any] = {"x": x, "t": s, "p": ca.vertcat(t, u, p), "ode": rates["xdot"]}
        if z.numel():
            dae |= {"z": z, "alg": rates["residual"]}
        options: dict[str, Any] = {
            "number_of_finite_elements": count("intervals", intervals),
            "collocation_scheme": "radau",
            "interpolation_order": 3,
        }
        integrate = ca.integrator("powertrain_step", "collocation", dae, 0.0, h, options)
        found = integrate(x0=x, z0=self.z, p=ca.vertcat(t, u, p))
        end = self.function(t=t + h, x=found["xf"], z=found["zf"], u=u, p=p)
        given, taken = ["t", "x", "u", "p"], ["x_end", "y", "margin"]
        return ca.Function("powertrain_step", [t, x, u, p], [found["xf"], end["y"], end["margin"]], given, taken)


class _Source(Protocol):
    """The source of the equations and of the modes that are not named: a plant."""

    @property
    def compiled(self) -> Compiled: ...
    def initialize(self) -> tuple[Array, Array, Array, Any]: ...
    def parameter_vector(self) -> Array: ...


def dynamics(
    plant: _Source,
    outputs: Selector | Sequence[Selector],
    inputs: str | Sequence[str] | None,
    modes: Modes | None,
    *,
    slides: bool = False,
) -> Dynamics:
    """The model in given modes; see ``Plant.function``.

    ``slides``: a free law, whose limits coincide, is replaced by a sliding one, whose torque is then the same.
    """
    compiled, dae = plant.compiled, plant.compiled.dae
    signals = signals_of(compiled)
    picked = [signals.pick(s) for s in listed("outputs", outputs)]
    driven = list(compiled.inputs) if inputs is None else _checked(plant, inputs)
    x, z, held, p = _point(plant, modes)
    knots = modes[0].inputs if isinstance(modes, tuple) else {}
    u = Symbol.sym("u", len(driven))
    margins, stills = _margins(dae, held), _stills(dae, held)
    if slides:
        held = _slid(dae, x, z, held, p)
    parts = [
        dae.xdot,
        dae.residual,
        *(column(e) for e in ([q.expression for q in picked], list(margins.values()), list(stills.values()))),
    ]
    old, new = _held_in_time(dae, held, knots, compiled.inputs, driven, u)
    freed = [n for n in driven if n in compiled.parameters]
    for name in freed:
        old.append(dae.p[list(compiled.parameters).index(name)])
        new.append(u[driven.index(name)])
    units = {n: c.unit for n, c in compiled.parameters.items()} | {n: i.unit for n, i in compiled.inputs.items()}
    units |= {n: compiled.signals[n].unit for n in compiled.states if n in compiled.signals}
    units |= {q.label: q.unit for q in picked}
    schedules = {s.name: s for s in dae.schedules}
    values = [p[list(compiled.parameters).index(n)] if n in freed else held[schedules[n].index + 1] for n in driven]
    return Dynamics(
        _function(dae, u, parts, old, new), tuple(compiled.states), tuple(dae.z[k].name() for k in range(dae.z.numel())), tuple(driven),
        tuple(compiled.parameters), tuple(q.label for q in picked), tuple(margins), tuple(stills), units,
        {law.name: float(held[law.index]) for law in (*dae.laws, *dae.whens)}, x, z, np.array(values, float), p,
    )  # fmt: skip


def _function(dae: HybridDae, u: Symbol, parts: list[Symbol], old: list[Symbol], new: list[Symbol]) -> ca.Function:
    """The function of ``Dynamics``, of expressions in which ``new`` stands for ``old``."""
    parts = _bent(dae, parts)
    written = ca.substitute([ca.densify(e) for e in parts], [column(old)], [column(new)]) if old else parts
    return ca.Function(
        "powertrain_dynamics",
        [dae.t, dae.x, dae.z, u, dae.p],
        [ca.cse(ca.densify(e)) for e in written],
        ["t", "x", "z", "u", "p"],
        ["xdot", "residual", "y", "margin", "still"],
    )


def _checked(plant: _Source, inputs: str | Sequence[str]) -> list[str]:
    driven: list[str] = listed("inputs", inputs)
    known = [*plant.compiled.inputs, *plant.compiled.parameters]
    for name in driven:
        if name not in known:
            raise ParameterError(f"inputs: the model has no input or parameter {name}{suggestion(str(name), known)}")
        if driven.count(name) > 1:
            raise ParameterError(f"inputs: {name} appears twice")
    return driven


def _point(plant: _Source, modes: Modes | None) -> tuple[Array, Array, Array, Array]:
    """States, algebraic unknowns, held values with the modes, and parameters."""
    if isinstance(modes, tuple):
        at = instant_of_run(plant.compiled, modes, "modes")
        return at.x[0], at.z[0], at.m[0].copy(), modes[0].p
    dae = plant.compiled.dae
    laws: dict[str, Any] = {law.name: law for law in dae.laws}
    given = by_name("modes", modes)
    unknown = [n for n in given if n not in laws]
    if unknown:
        raise ParameterError(f"modes: the model has no law {unknown[0]}{suggestion(unknown[0], laws)}")
    missing = [law.name for group in (dae.frictions, dae.contacts) for law in group if law.name not in given]
    if missing:
        raise ParameterError(
            f"modes: also give those of {', '.join(missing[:6])} (friction: 1 forward, 0 stuck, -1 backward, 2 free; "
            "contacts: 1 closed, 0 open), or (result, t) for the modes of a run"
        )
    x, z, m, _ = plant.initialize()
    for name, mode in given.items():
        law = laws[name]
        allowed = (FORWARD, STUCK, BACKWARD, FREE) if isinstance(law, Friction) else (0.0, 1.0)
        if number(f"modes: {name}", mode) not in allowed:
            raise ParameterError(f"modes: {name} = {short(mode)} must be one of {', '.join(f'{v:g}' for v in allowed)}")
        m[law.index] = mode
    return x, z, m, plant.parameter_vector()


def _slid(dae: HybridDae, x: Array, z: Array, held: Array, p: Array) -> Array:
    """The modes with free laws in the direction of their speed."""
    free = [law for law in dae.frictions if held[law.index] == FREE]
    found, speeds = held.copy(), column([law.w for law in free])
    w = np.array(ca.Function("speeds", dae.arguments, [speeds])(0.0, x, z, held, p), float).ravel()
    found[[law.index for law in free]] = np.where(w == 0.0, FREE, np.sign(w))
    return found


def _held_in_time(
    dae: HybridDae, held: Array, knots: Mapping[str, Any], inputs: Collection[str], driven: Sequence[str], u: Symbol
) -> tuple[list[Symbol], list[Symbol]]:
    """The symbols of all held values, and their replacements: inputs, piecewise linear time signals, numbers."""
    values: dict[int, Symbol] = {k: Symbol(float(held[k])) for k in range(dae.m.numel())}
    for schedule in dae.schedules:
        first = schedule.index
        if schedule.name in driven:
            segment = Symbol(0.0), u[driven.index(schedule.name)], Symbol(0.0)
        elif schedule.name in knots:
            segment = _segment(dae, *knots[schedule.name])
        elif schedule.name in inputs:
            segment = values[first], values[first + 1], values[first + 2]
        else:
            segment = _segment(dae, schedule.times, schedule.values)
        values |= dict(enumerate(segment, first))
    return [dae.m[k] for k in values], list(values.values())


def _bent(dae: HybridDae, parts: list[Symbol]) -> list[Symbol]:
    """Switches whose branches meet need no modes: their conditions replace these."""
    bends = [s for s in dae.switches if s.continuous]
    for _ in bends:
        modes = column([dae.m[s.index] for s in bends])
        if not any(ca.depends_on(e, modes) for e in parts):
            break
        conditions = column([s.g > 0 for s in bends])
        parts = ca.substitute([ca.densify(e) for e in parts], [modes], [conditions])
    return parts


def _segment(dae: HybridDae, given_times: Any, given_values: Any) -> tuple[Symbol, Symbol, Symbol]:
    """The segment (t0, y0, slope) of a piecewise linear signal at any time; at a jump the one after it.

    Both values and derivatives of the signal are computed from it.
    """
    times, values = np.array(given_times, float), np.array(given_values, float)
    found = (Symbol(float(times[0])), Symbol(float(values[0])), Symbol(0.0))
    for i in range(len(times)):
        last = i + 1 == len(times)
        span = 0.0 if last else times[i + 1] - times[i]
        slope = (values[i + 1] - values[i]) / span if span > 0.0 else 0.0
        after = dae.t >= times[i]
        a, b, c = (ca.if_else(after, now, then) for now, then in zip((times[i], values[i], slope), found, strict=True))
        found = (a, b, c)
    return found


def _margins(dae: HybridDae, held: Array) -> dict[str, Symbol]:
    """The expressions that must not be negative while the modes hold, by name."""
    found: dict[str, Symbol] = {}
    for law in dae.frictions:
        mode = held[law.index]
        low, high = law.peak * law.lower, law.peak * law.upper
        if mode == STUCK and not law.prescribed:
            found |= {
                f"{law.name}: above its lower limit": law.torque - low,
                f"{law.name}: below its upper limit": high - law.torque,
            }
        elif mode in (FORWARD, BACKWARD):
            found[f"{law.name}: {'forward' if mode > 0 else 'backward'}"] = float(mode) * law.w
        elif mode == FREE:
            found[f"{law.name}: free"] = law.lower - law.upper
    for switch in (s for s in dae.switches if not s.continuous):
        found[f"{switch.name}: {'true' if held[switch.index] > 0.5 else 'false'}"] = float(
            2.0 * held[switch.index] - 1.0
        ) * _compared(dae, switch.g)
    for contact in dae.contacts:
        closed = held[contact.index] > 0.5
        found[f"{contact.name}: {'closed' if closed else 'open'}"] = contact.force if closed else contact.gap
    return {name: e for name, e in found.items() if not (e.is_constant() and np.isinf(float(e)))}


def _compared(dae: HybridDae, g: Symbol) -> Symbol:
    """A condition in terms of what it compares; a combination of comparisons is stored in terms of their modes."""
    alone = [s for s in dae.switches if s.continuous]
    modes = column([dae.m[s.index] for s in alone])
    return ca.substitute(g, modes, column([(1 + s.g) / 2 for s in alone])) if ca.depends_on(g, modes) else g


def _stills(dae: HybridDae, held: Array) -> dict[str, Symbol]:
    """The expressions that are zero while the modes hold, by name."""
    found = {
        f"{f.name}: speed": f.w
        for f in dae.frictions
        if held[f.index] == STUCK and not f.prescribed and not f.algebraic
    }
    closed: list[Contact] = [c for c in dae.contacts if held[c.index] > 0.5]
    found |= {f"{c.name}: gap": c.gap for c in closed} | {f"{c.name}: speed": c.speed for c in closed}
    return found
