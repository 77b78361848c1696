"""Arguments of class methods that build something, checked against their annotations, so that a wrong one is named at once."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, wraps
from numbers import Integral, Real
from reprlib import repr as short
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ParameterError

F = TypeVar("F", bound=Callable[..., Any])
_KINDS: dict[Any, tuple[Any, str]] = {
    float: (Real, "a number"),
    int: (Integral, "a whole number"),
    str: (str, "a text"),
    NoneType: (NoneType, "None"),
}


def arguments_checked(function: F) -> F:
    """The class method, which raises ParameterError for an argument that is not what its annotation says.

    >>> class Pair:
    ...     @classmethod
    ...     @arguments_checked
    ...     def of(cls, ratios: Sequence[float]) -> Pair: ...
    >>> Pair.of("2.5")
    Traceback (most recent call last):
    powertrain.errors.ParameterError: Pair.of: ratios = '2.5' is not a sequence of which each is a number
    """
    signature = inspect.signature(function)
    hints = cache(lambda: get_type_hints(function))

    @wraps(function)
    def call(cls: type, *arguments: Any, **named: Any) -> Any:
        try:
            given = signature.bind(cls, *arguments, **named).arguments
        except TypeError:  # a missing or unknown argument: the call says which
            given = {}
        for name, value in given.items():
            kind, hint = signature.parameters[name].kind, hints().get(name, Any)
            for each in value if kind is inspect.Parameter.VAR_POSITIONAL else (value,):
                if kind is not inspect.Parameter.VAR_KEYWORD and not _fits(each, hint):
                    where = f"{cls.__name__}.{function.__name__}"
                    raise ParameterError(f"{where}: {name} = {short(each)} is not {_said(hint)}")
        return function(cls, *arguments, **named)

    return cast(F, call)


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value is what a type says; types that are not known here fit everything."""
    origin, inside = get_origin(hint), get_args(hint)
    if hint == ArrayLike:
        return _is_numeric(value)
    if origin in (Union, UnionType):
        return any(_fits(value, each) for each in inside)
    if origin is Literal:
        return isinstance(value, str) and value in inside
    if hint in _KINDS:
        return isinstance(value, _KINDS[hint][0]) and not isinstance(value, bool)
    if origin is tuple and Ellipsis not in inside:
        return _is_sequence(value) and len(value) == len(inside) and all(map(_fits, value, inside))
    if origin in (tuple, list, Sequence):
        return _is_sequence(value) and all(_fits(each, inside[0]) for each in value)
    if origin is Iterable:
        return isinstance(value, Iterable) and not isinstance(value, str | bytes)
    if origin is Mapping:
        return isinstance(value, Mapping)
    kind = origin or hint
    return kind is Any or not isinstance(kind, type) or isinstance(value, kind)


def _is_sequence(value: Any) -> bool:
    return (isinstance(value, Sequence) and not isinstance(value, str | bytes)) or (
        isinstance(value, np.ndarray) and value.ndim > 0
    )


def _is_numeric(value: Any) -> bool:
    try:
        return bool(np.asarray(value, float).dtype == float)
    except (TypeError, ValueError, OverflowError):
        return False


def _said(hint: Any) -> str:
    """A type in words."""
    origin, inside = get_origin(hint), get_args(hint)
    if hint == ArrayLike:
        return "a sequence of numbers"
    if origin in (Union, UnionType):
        return " or ".join(map(_said, inside))
    if origin is Literal:
        return f"one of {', '.join(inside)}"
    if hint in _KINDS:
        return _KINDS[hint][1]
    if origin is tuple and Ellipsis not in inside:
        return f"a row ({', '.join(map(_said, inside))})"
    if origin in (tuple, list, Sequence):
        return f"a sequence of which each is {_said(inside[0])}"
    if origin is Iterable:
        return "a sequence"
    if origin is Mapping:
        return "a mapping"
    name = getattr(hint, "__name__", str(hint))
    return f"{'an' if name[:1] in 'AEIOU' else 'a'} {name}"
