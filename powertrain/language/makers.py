"""Arguments of class methods that build something, and of records, checked against their annotations: a wrong one is named at once."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, wraps
from numbers import Integral, Real
from reprlib import repr as short
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike

from powertrain.errors import ParameterError
from powertrain.language.reals import reals

F = TypeVar("F", bound=Callable[..., Any])


def arguments_checked(function: F) -> F:
    """The class method, or the dataclass, which raises ParameterError for an argument that is not what its annotation says.

    >>> class Pair:
    ...     @classmethod
    ...     @arguments_checked
    ...     def of(cls, ratios: Sequence[float]) -> Pair: ...
    >>> Pair.of("2.5")
    Traceback (most recent call last):
    powertrain.errors.ParameterError: Pair.of: ratios = '2.5' is not a sequence of numbers
    """
    if isinstance(function, type):
        made: Any = function
        made.__init__ = arguments_checked(made.__init__)
        return cast(F, made)
    signature = inspect.signature(function)
    kinds = cache(lambda: {name: _kind(hint) for name, hint in get_type_hints(function).items()})

    @wraps(function)
    def call(owner: Any, *arguments: Any, **named: Any) -> Any:
        try:
            given = signature.bind(owner, *arguments, **named).arguments
        except TypeError:  # a missing or unknown argument: the call says which
            given = {}
        for name, value in given.items():
            how, kind = signature.parameters[name].kind, kinds().get(name, _ANYTHING)
            for each in value if how is inspect.Parameter.VAR_POSITIONAL else (value,):
                if how is not inspect.Parameter.VAR_KEYWORD and not kind.fits(each):
                    made = isinstance(owner, type)  # by a class method; otherwise it is being made by __init__
                    where = f"{owner.__name__}.{function.__name__}" if made else type(owner).__name__
                    raise ParameterError(f"{where}: {name} = {short(each)} is not {kind.one}")
        return function(owner, *arguments, **named)

    return cast(F, call)


@dataclass(frozen=True)
class _Kind:
    """What an argument may be: whether a value ``fits``, and the words for ``one`` and for ``many`` of them."""

    fits: Callable[[Any], bool]
    one: str
    many: str


def _is_sequence(value: Any) -> bool:
    return (isinstance(value, Sequence) and not isinstance(value, str | bytes)) or (
        isinstance(value, np.ndarray) and value.ndim > 0
    )


def _is_numeric(value: Any) -> bool:
    try:
        reals(value)
    except (TypeError, ValueError):
        return False
    return True


def _of_type(kind: Any, one: str, many: str) -> _Kind:
    return _Kind(lambda v: isinstance(v, kind) and not isinstance(v, bool), one, many)


_ANYTHING = _Kind(lambda v: True, "anything", "anything")
_SIMPLE: dict[Any, _Kind] = {
    Any: _ANYTHING,
    float: _of_type(Real, "a number", "numbers"),
    int: _of_type(Integral, "an integer", "integers"),
    bool: _Kind(lambda v: isinstance(v, bool), "True or False", "truth values"),
    str: _of_type(str, "a string", "strings"),
    NoneType: _of_type(NoneType, "None", "None"),
    ArrayLike: _Kind(_is_numeric, "a sequence of numbers", "sequences of numbers"),
}


def _kind(hint: Any) -> _Kind:
    """What an annotation lets pass; one that is no type and not known here lets everything pass."""
    if hint in _SIMPLE:
        return _SIMPLE[hint]
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Literal:
        said = f"one of {', '.join(arguments)}"
        return _Kind(lambda v: isinstance(v, str) and v in arguments, said, said)
    inside = [_kind(each) for each in arguments if each is not Ellipsis]
    if origin in (Union, UnionType):
        return _any_of(inside)
    if origin is tuple and Ellipsis not in arguments:
        return _row(inside)
    if origin in (tuple, list, Sequence):
        return _all_of(inside[0])
    if origin is Iterable:
        return _Kind(lambda v: isinstance(v, Iterable) and not isinstance(v, str | bytes), "a sequence", "sequences")
    if origin is Mapping:
        return _of_type(Mapping, "a mapping", "mappings")
    kind = origin or hint
    if not isinstance(kind, type):
        return _ANYTHING
    name = kind.__name__
    return _Kind(lambda v: isinstance(v, kind), f"{'an' if name[0] in 'AEIOU' else 'a'} {name}", f"{name} objects")


def _any_of(kinds: list[_Kind]) -> _Kind:
    one, many = (" or ".join(getattr(each, word) for each in kinds) for word in ("one", "many"))
    return _Kind(lambda v: any(each.fits(v) for each in kinds), one, many)


def _row(kinds: list[_Kind]) -> _Kind:
    def fits(value: Any) -> bool:
        return (
            _is_sequence(value)
            and len(value) == len(kinds)
            and all(kind.fits(v) for kind, v in zip(kinds, value, strict=True))
        )

    said = f"({', '.join(each.one for each in kinds)})"
    return _Kind(fits, f"a row {said}", f"rows {said}")


def _all_of(kind: _Kind) -> _Kind:
    return _Kind(
        lambda v: _is_sequence(v) and all(map(kind.fits, v)), f"a sequence of {kind.many}", f"sequences of {kind.many}"
    )
