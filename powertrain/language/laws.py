"""The laws that are not smooth, and the derivative: what equations are written with beside ``==`` and ``connect``.

Components never write a bare ``if_else`` on a state. They declare one of these laws; the engine knows their modes, finds the
modes of all laws together and locates every change as an event.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ModelError, ParameterError
from powertrain.language.arguments import row
from powertrain.language.component import Component, children
from powertrain.language.conditions import combined, crossing, is_held
from powertrain.language.connectors import Connector
from powertrain.language.law import Law
from powertrain.language.reals import real
from powertrain.language.recorder import Guard, ScheduleEntry, SwitchEntry, recorder, to_be_yielded
from powertrain.language.symbols import Symbol, key, time, total_derivative

Expression: TypeAlias = "Symbol | float"


@dataclass(frozen=True)
class Connection(Law):
    """Ports joined in one node: potentials equal, flows sum to zero."""

    ports: tuple[Connector, ...]


@dataclass(frozen=True)
class FrictionLaw(Law):
    """Set-valued friction; see ``friction``. ``effort``: the torque that the law determines."""

    w: Symbol
    effort: Symbol
    lower: Symbol
    upper: Symbol
    peak: Symbol
    name: str


@dataclass(frozen=True)
class UnilateralLaw(Law):
    """A contact; see ``unilateral``. ``effort``: the force that the law determines."""

    gap: Symbol
    effort: Symbol
    restitution: Symbol
    name: str


@dataclass(frozen=True)
class Reinit:
    """The new value of a state or a discrete variable; see ``reinit``."""

    variable: Symbol
    value: Symbol


@dataclass(frozen=True)
class WhenLaw(Law):
    """Resets at the instant a condition becomes true; see ``when``."""

    g: Symbol
    resets: tuple[Reinit, ...]
    name: str = "when"
    initially: bool = False

    def mapped(self, change: Callable[[list[Symbol]], list[Symbol]]) -> Self:
        """The same law with its condition and the new values changed."""
        g, *values = change([self.g, *(r.value for r in self.resets)])
        resets = tuple(Reinit(r.variable, v) for r, v in zip(self.resets, values, strict=True))
        return replace(self, g=g, resets=resets)


def _expression(word: str, value: Any) -> Symbol:
    """A number or one expression, as a symbol; ``word`` is the name of the law, for the message."""
    try:
        found = value if isinstance(value, Symbol) else Symbol(real(value))
    except (TypeError, ValueError):
        found = None
    if found is None or not found.is_scalar():
        raise ModelError(f"{recorder().place}: {word} requires expressions of variables and numbers, not {value!r}")
    return found


def _condition(word: str, value: Any) -> Symbol:
    return Symbol(float(value)) if isinstance(value, bool | np.bool_) else _expression(word, value)


def der(expression: Symbol) -> Symbol:
    """Time derivative of a variable or of an expression of variables."""
    active, whole = recorder(), _expression("der", expression)
    if not whole.is_symbolic() and not whole.is_constant():
        active.differentiated.append((active.place, whole))
    return total_derivative(whole, active.derivative)


def friction(
    w: Symbol, torque: Symbol, lower: Expression, upper: Expression, *, peak: Expression = 1.0, name: str = "mode"
) -> FrictionLaw:
    """Dry friction between parts that slide with relative speed ``w`` and transmit ``torque``.

    w > 0: torque = upper;  w < 0: torque = lower;  w = 0: any torque in [peak*lower, peak*upper] that keeps w = 0 (stuck).

    ``torque`` opposes ``w`` if lower <= 0 <= upper: the power torque*w is dissipated. If lower = upper the law is free. Limits with
    lower > upper, usually a ``torque`` with the wrong sign, end a run with an error and leave operating points without a solution. A law at
    its limit, peak*lower or peak*upper, counts as stuck if other laws hold it at rest.

    Parameters
    ----------
    w : expression
        Relative speed [rad/s or m/s].
    torque : expression
        Torque [N.m] or force [N].
    lower, upper : expression or float
        Bounds of the torque. They may depend on states, on time and, piecewise linearly, on unknown torques; a bound may be infinite
        (one-way clutch).
    peak : expression or float
        Static over sliding friction [1].
    name : str
        Name of the signal of the component that tells the mode: 1 forward, 0 stuck, -1 backward, 2 free.

    Examples
    --------
    >>> yield pt.friction(self.w_rel, self.tau, -self.tau_max, self.tau_max)  # doctest: +SKIP
    """
    w, torque, lower, upper, peak = (_expression("friction", value) for value in (w, torque, lower, upper, peak))
    return to_be_yielded("friction", FrictionLaw(w, torque, lower, upper, peak, name))


def unilateral(gap: Symbol, force: Symbol, *, restitution: Expression = 0.0, name: str = "contact") -> UnilateralLaw:
    """A rigid contact: gap >= 0, force >= 0, one of them zero; closing is an impact.

    Parameters
    ----------
    gap : expression
        Distance [m or rad].
    force : expression
        Pressing force [N] or torque [N.m].
    restitution : expression or float
        Coefficient of restitution [1].
    name : str
        Name of the signal that tells whether the contact is closed.

    A run that starts with a negative gap raises InitializationError.
    """
    gap, force, restitution = (_expression("unilateral", value) for value in (gap, force, restitution))
    return to_be_yielded("unilateral", UnilateralLaw(gap, force, restitution, name))


def reinit(variable: Symbol, value: Expression) -> Reinit:
    """Assign a new value to a state or a discrete variable, in a ``when``."""
    return Reinit(_expression("reinit", variable), _expression("reinit", value))


def when(condition: Symbol, *resets: Reinit, name: str = "when", initially: bool = False) -> WhenLaw:
    """Apply the resets at the instant at which ``condition`` becomes true; right-hand sides have the values just before the resets.

    Every comparison that ``condition`` combines by ``ca.logic_and``, ``ca.logic_or`` and ``ca.logic_not`` is an event of its own, so that
    they may hold together for any short time; so is each side of |a| < b and of the smaller or larger of two. Conditions are judged once
    all laws and switches have the modes of the instant. ``name`` is the name of the events: the condition becomes true or false, or a
    state is reset. Where a reset of discrete variables ends its own condition, as in a latch or a sampled controller, there is none; the
    change is in the discrete variable. A condition that holds at the start of a run becomes true only after it was false, but with
    ``initially`` it becomes true at the start. A run ends with an error where two laws become true together and reset one variable to
    different values.
    A reset happens once and holds nothing: one that puts a variable back to the limit in ``condition`` is named in ``result.notes``.
    """
    if not resets or not all(isinstance(r, Reinit) for r in resets):
        raise ModelError(f"{recorder().place}: when(condition, reinit(...), ...) needs at least one reinit")
    condition = _condition("when", condition)
    return to_be_yielded("when", WhenLaw(combined(condition, name, recorder().relations), resets, name, initially))


def switch(
    condition: Symbol, a: Expression, b: Expression, *, continuous: bool = False, name: str | None = None
) -> Symbol:
    """``a`` while ``condition`` holds, else ``b``; the change is an exact event.

    Several switches with the same condition object change together. Every comparison that a condition combines is an event of its own, so
    that they may hold together for any short time; so is each side of |a| < b and of the smaller or larger of two.

    Parameters
    ----------
    condition : expression
        Compares expressions of variables or time (``w > 0``, combined by ``ca.logic_and``, ``ca.logic_or``, ``ca.logic_not``).
    a, b : expression or float
        The branches.
    continuous : bool
        The branches are equal where the condition changes, so the integration need not restart there.
    name : str, optional
        Name of the events.

    Returns
    -------
    expression
    """
    active, condition = recorder(), _condition("switch", condition)
    a, b = _expression("switch", a), _expression("switch", b)
    if is_held(crossing(condition)):
        return ca.if_else(condition, a, b)
    for entry in active.switches:
        if key(entry.condition) == key(condition) and entry.continuous == continuous:
            return ca.if_else(entry.mode, a, b)
    name = name or f"switch{len(active.switches)}"
    g = crossing(condition) if continuous else combined(condition, name, active.switches)
    mode = active.hold(f"{active.path}.{name}".lstrip("."))
    active.switches.append(SwitchEntry(mode, g, active.place, continuous, condition))
    return ca.if_else(mode, a, b)


def schedule(times: ArrayLike, values: ArrayLike) -> Symbol:
    """A piecewise linear signal of time, constant before the first and after the last time. A time that appears twice is a jump."""
    active = recorder()
    try:
        t, y = row("times", times), row("values", values)
    except ParameterError as error:
        raise ModelError(f"{active.place}: schedule requires sequences of numbers: {error}") from None
    if t.size != y.size or t.size < 1 or np.any(np.diff(t) < 0):
        raise ModelError(
            f"{active.place}: a schedule needs as many finite values as times, and times that do not decrease"
        )
    path = f"{active.path}.schedule{len(active.schedules)}"
    t0, y0, slope = (active.hold(f"{path}.{part}") for part in ("t0", "y0", "slope"))
    active.schedules.append(ScheduleEntry((t0, y0, slope), t, y, active.place))
    return y0 + slope * (time - t0)


def within(value: Symbol, low: Expression, high: Expression, *, name: str, unit: str, action: str = "error") -> None:
    """Declare low <= value <= high.

    Parameters
    ----------
    value : expression
        What must stay within the limits.
    low, high : expression or float
        The limits.
    name, unit : str
        What the value is called in messages, and its unit.
    action : {"error", "count"}
        "error" ends the simulation with a message, "count" counts the steps outside the range. In ``initial()`` it holds for the
        start alone: "error" rejects the start, "count" does nothing.
    """
    active = recorder()
    value, low, high = (_expression("within", v) for v in (value, low, high))
    active.guards.append(Guard(name, active.place, value, low, high, unit, action))


def connect(*ports: Connector) -> Connection:
    """Connect ports: their potentials are equal and their flows sum to zero; connected signals are equal.

    Signals of different units raise ModelError; the unit 1, as of a block, fits any other.
    """
    return to_be_yielded("connect", Connection(_checked(ports)))


def _checked(ports: Sequence[Connector]) -> tuple[Connector, ...]:
    for p in ports:
        if not isinstance(p, Connector):
            raise ModelError(f"{recorder().place}: connect() joins ports, but {_no_port(p)}")
        if "_symbols" not in vars(p):
            raise ModelError(
                f"{recorder().place}: connect() joins a port of a component that is not a part of the model; "
                "declare the component as a field"
            )
    twice = [p._path for k, p in enumerate(ports) if any(p is other for other in ports[:k])]
    if twice:
        raise ModelError(f"{recorder().place}: connect() joins {twice[0]} to itself")
    kinds = {p.kind() for p in ports}
    if len(ports) < 2:
        raise ModelError(f"{recorder().place}: connect() needs at least two ports")
    if len(kinds) > 1:
        same = len({kind.__name__ for kind in kinds}) < len(kinds)
        said = ", ".join(f"{p._path} ({_kind_name(p.kind(), same)})" for p in ports)
        raise ModelError(f"{recorder().place}: connect() joins ports of the same class, got {said}")
    return tuple(ports)


def _no_port(given: Any) -> str:
    """What was given in place of a port; of a component with the ports that may be meant."""
    if isinstance(given, Component) and given._path:
        ports = [f"{given._path}.{name}" for name, part in children(given) if isinstance(part, Connector)]
        return f"{given._path} is a component" + f"; its ports are {', '.join(ports)}" * bool(ports)
    if isinstance(given, Symbol):
        return f"{given} is {'a variable' if given.is_symbolic() else 'an expression'}"
    return f"{given!r} is not a port"


def _kind_name(kind: type, full: bool) -> str:
    return f"{kind.__module__}.{kind.__qualname__}" if full else kind.__name__
