"""What values a component takes: kinds of plain fields, and conditions between parameters, the comparisons that ``check()`` yields."""

from __future__ import annotations

import numbers
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from powertrain.errors import ModelError, ParameterError, suggestion
from powertrain.language.quantities import has_unit, quantity
from powertrain.language.reals import real
from powertrain.language.recorder import Place, place_in
from powertrain.language.symbols import Symbol, column, free_symbols, key
from powertrain.language.units import told_apart, with_unit

_TRUTHS = frozenset({ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR, ca.OP_NOT})


def check_conditions(text: Any, name: str, parameters: Sequence[tuple[Symbol, float, str]]) -> None:
    """ParameterError for the first condition that the values of the parameters (symbol, value, unit) do not meet."""
    if not isinstance(text, Iterable) or isinstance(text, Symbol):
        raise ModelError(
            f"{name}: the conditions of check() are {text!r}; a condition is written  yield self.d_in < self.d_out"
        )
    for row in text:
        place = place_in(text, name)
        holds = checked_condition(row, place)
        inside = {key(s) for s in free_symbols(holds)}
        given = [(s, value, unit) for s, value, unit in parameters if key(s) in inside]
        values = (
            ca.substitute(holds, column([s for s, _, _ in given]), ca.DM([v for _, v, _ in given])) if given else holds
        )
        if not float(values):
            raise ParameterError(unmet(place, {s.name(): (v, unit) for s, v, unit in given}))


def checked_condition(row: Any, place: Place) -> Symbol:
    """A row of ``check()``: a comparison of parameters, or plainly true or false."""
    if isinstance(row, bool | np.bool_):
        return Symbol(float(row))
    if not isinstance(row, Symbol) or not (row.is_constant() or row.op() in _TRUTHS):
        raise ModelError(f"{place}: check() must yield comparisons of parameters, such as  self.d_in < self.d_out")
    return row


def unmet(place: Place | str, given: Mapping[str, tuple[float, str]], said: str = "") -> str:
    """The message for parameters (name: value, unit) that do not go together."""
    others = [value for value, _ in given.values()]
    values = ", ".join(
        f"{name} = {with_unit(told_apart(value, others), unit)}" for name, (value, unit) in given.items()
    )
    return f"{place}\n  {said or 'this does not hold'}{' with ' * bool(values)}{values}"


def check_kind(where: str, kind: Any, value: Any) -> None:
    """ParameterError where a plain field does not take the value: its annotation is a class, a ``Literal`` or a union of these."""
    options = typing.get_args(kind) if typing.get_origin(kind) in (typing.Union, types.UnionType) else (kind,)
    literals = [o for o in options if typing.get_origin(o) is typing.Literal]
    kinds = [o for o in options if _is_class(o)]
    if len(kinds) + len(literals) < len(options):
        return  # more than can be told from the annotation
    choices = [choice for o in literals for choice in typing.get_args(o)]
    if any(value == c and type(value) is type(c) for c in choices) or any(_is_a(value, k) for k in kinds):
        return
    near = suggestion(value, [c for c in choices if isinstance(c, str)]) if isinstance(value, str) else ""
    said = ", ".join([k.__name__ for k in kinds if k is not type(None)] + [repr(c) for c in choices])
    wanted = f"none of {said}{near}" if choices else f"not {'an' if said[0] in 'aeiou' else 'a'} {said}"
    raise ParameterError(f"{where} = {value!r} is {wanted}")


def scalar(where: str, kind: Any, value: Any) -> float:
    """The value of a field ``Annotated[float, "1"]``; a text such as "85 %" is converted. Errors: ParameterError for anything else."""
    unit = bare(kind)[1]
    if isinstance(value, str) and has_unit(value):
        value = quantity(value, unit, where)
    try:
        return real(value)
    except (TypeError, ValueError):
        raise ParameterError(
            f"{where} = {value!r} is not a number like {0.85 if unit == '1' else f'1.5 {unit}'}"
        ) from None


def is_scalar(kind: Any) -> bool:
    """Whether a field is a number with a unit."""
    kind, unit = bare(kind)
    return bool(unit) and kind is float


def rows(where: str, kind: Any, value: Any) -> Any:
    """The value of a field ``tuple[tuple[float, ...], ...]``; with ``Annotated[..., "m/s"]``, texts such as "15 km/h" are converted.

    Errors: ParameterError for anything but rows of finite numbers, one as long as the other.
    """
    kind, unit = bare(kind)
    if not isinstance(value, Sequence | np.ndarray):
        said = f"{value!r} is" if np.isscalar(value) else f"{type(value).__name__} is"
        hint = "; write .to_numpy() for its rows" if hasattr(value, "to_numpy") else ""
        raise ParameterError(f"{where} = {said} not a table of rows of numbers{unit and f' [{unit}]'}{hint}")
    if unit:
        value = tuple(_converted(where, unit, row) for row in value)
    wanted = typing.get_args(typing.get_args(kind)[0])
    length = None if Ellipsis in wanted else len(wanted)
    for row in value:
        listed = row if isinstance(row, Sequence | np.ndarray) and not isinstance(row, str) else ()
        length = len(listed) if length is None else length
        if not len(listed) or len(listed) != length or not all(_is_a(v, float) and np.isfinite(v) for v in listed):
            said = f"the row {row!r} is not {f'{length} ' if length else ''}finite numbers"
            raise ParameterError(f"{where} is not a table of rows of numbers{unit and f' [{unit}]'}: {said}")
    return tuple(_plain(row) for row in value)


def row(where: str, value: Any) -> tuple[float, ...]:
    """The value of a field ``tuple[float, ...]``. Errors: ParameterError for anything but a row of finite numbers."""
    listed = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str)
    if not listed or not all(_is_a(v, float) and np.isfinite(v) for v in value):
        raise ParameterError(f"{where} = {value!r} is not a row of finite numbers, such as (3.6, 2.1, 1.4)")
    return _plain(value)


def _plain(values: Any) -> tuple[Any, ...]:
    """A row, perhaps an array, as a tuple of Python's numbers: equal rows of numbers make equal components with one text."""
    return tuple(v.item() if isinstance(v, np.generic) else v for v in values)


def _converted(where: str, unit: str, row: Any) -> Any:
    """A row with its texts in a unit; what is no number with a unit stays."""
    if isinstance(row, str) or not isinstance(row, Sequence):
        return row
    return tuple(quantity(v, unit, where) if isinstance(v, str) and has_unit(v) else v for v in row)


def is_row(kind: Any) -> bool:
    """Whether a field is a row of numbers, of any length or of a fixed one."""
    members = typing.get_args(kind) if typing.get_origin(kind) is tuple else ()
    return bool(members) and set(members) <= {float, Ellipsis}


def is_rows(kind: Any) -> bool:
    """Whether a field is a table of numbers."""
    kind = bare(kind)[0]
    members = typing.get_args(kind) if typing.get_origin(kind) is tuple else ()
    rows = members[0] if len(members) == 2 and members[1] is Ellipsis else None
    return typing.get_origin(rows) is tuple and set(typing.get_args(rows)) <= {float, Ellipsis}


def bare(kind: Any) -> tuple[Any, str]:
    """An annotation without its unit, and the unit, "" where there is none."""
    return (kind.__origin__, kind.__metadata__[0]) if typing.get_origin(kind) is typing.Annotated else (kind, "")


def _is_class(option: Any) -> bool:
    return (
        isinstance(option, type)
        and option is not Any
        and not typing.get_args(option)
        and not getattr(option, "_is_protocol", False)
    )


def _is_a(value: Any, kind: type) -> bool:
    """Whether a value is of a kind; a bool is no number, an integer may stand for a float."""
    if isinstance(value, bool | np.bool_):
        return kind in (bool, object)
    stands_for: dict[type, Any] = {int: numbers.Integral, float: numbers.Real}
    return isinstance(value, stands_for.get(kind, kind))
