"""Checks of arguments where they are passed, so that errors name them in the user's terms."""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from numbers import Integral
from pathlib import Path
from reprlib import repr as short
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError, suggestion
from powertrain.language.quantities import quantity
from powertrain.language.reals import NotReal, real, reals
from powertrain.language.units import with_unit

F = TypeVar("F", bound=Callable[..., Any])
MOST = 10**9
LOOSEST = 0.1
"""Largest relative tolerance: beyond it the step size control keeps no error small."""


def number(what: str, value: Any, unit: str = "1") -> float:
    """A finite number in ``unit``, or a text such as "2 min" where there is a unit; not true or false."""
    if isinstance(value, str) and unit != "1":
        return quantity(value, unit, what)
    try:
        found = real(value)
    except (TypeError, ValueError):
        found = math.nan
    if not math.isfinite(found):
        raise ParameterError(f"{what} = {with_unit(short(value), unit)} is not a finite number")
    return found


def positive(what: str, value: Any) -> float:
    """A number above zero; may be infinite."""
    if isinstance(value, float) and value == np.inf:
        return value
    if number(what, value) <= 0:
        raise ParameterError(f"{what} = {short(value)} must be positive")
    return float(value)


def tolerances(rtol: Any, atol: Any) -> tuple[float, float]:
    """Both; ``atol`` is equal to ``rtol`` where it is None."""
    relative = positive("rtol", rtol)
    if relative > LOOSEST:
        raise ParameterError(f"rtol = {relative:g} must be at most {LOOSEST:g}")
    absolute = relative if atol is None else positive("atol", atol)
    if math.isinf(absolute):
        raise ParameterError("atol = inf must be finite: no error would be too large")
    return relative, absolute


def single(value: Any) -> bool:
    """Whether a value is one, and no list or array of values; the lists in it may have unequal lengths, which np.ndim refuses."""
    return (isinstance(value, str) or not isinstance(value, Sequence)) and getattr(value, "ndim", 0) == 0


def limits(what: str, given: Any, *, closed: bool = False) -> tuple[float, float]:
    """(low, high), which may be infinite, and equal where ``closed``."""
    try:
        low, high = reals(given).ravel().tolist()
    except (TypeError, ValueError):
        raise ParameterError(f"{what} = {short(given)}: give (low, high)") from None
    if not (low < high or (closed and low == high)):
        raise ParameterError(f"{what}: the range {low:g} to {high:g} is empty")
    return low, high


def count(what: str, value: Any, least: int = 1) -> int:
    """A whole number from ``least`` on."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
        raise ParameterError(f"{what} = {short(value)} must be a whole number")
    if not least <= int(value) <= MOST:
        raise ParameterError(f"{what} = {short(value)} must be at least {least} and at most {MOST}")
    return int(value)


def flag(what: str, value: Any, allowed: str = "True or False") -> bool:
    """True or false; ``allowed``: what the message says that the value must be."""
    if not isinstance(value, bool | np.bool_):
        raise ParameterError(f"{what} = {short(value)} must be {allowed}")
    return bool(value)


def of_kind(what: str, value: object, kind: type, said: str) -> None:
    """ParameterError for a value of another class; ``said``: what the function ``what`` takes."""
    if not isinstance(value, kind):
        raise ParameterError(f"{what}() takes {said}, not {short(value)}")


def text(what: str, value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise ParameterError(f"{what} = {short(value)} is not a string")
    return value


def one_of(what: str, value: Any, choices: Sequence[str]) -> None:
    """One of some texts."""
    if not isinstance(value, str) or value not in choices:
        near = suggestion(value, choices) if isinstance(value, str) else ""
        raise ParameterError(f"{what}={short(value)} must be one of {', '.join(choices)}{near}")


def by_name(what: str, given: Any) -> Mapping[str, Any]:
    """A mapping of names to values; None gives none."""
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not all(isinstance(name, str) for name in given):
        raise ParameterError(
            f'{what} = {short(given)}: pass a dictionary of names and values, such as {{"J1.w": 10.0}}'
        )
    return given


def numbers_by_name(what: str, given: Any) -> dict[str, float]:
    """Numbers by name."""
    return {name: number(f"{what}: {name}", value) for name, value in by_name(what, given).items()}


def array(what: str, values: Any, *, finite: bool = True) -> NDArray[np.float64]:
    """Real numbers of any shape; without ``finite`` they may be infinite, or nan where there is none."""
    try:
        found = reals(values)
    except (TypeError, ValueError) as error:
        hint = f"; {error}" if isinstance(error, NotReal) else ""
        raise ParameterError(f"{what} = {short(values)} is not a sequence of numbers{hint}") from None
    if finite and not np.isfinite(found).all():
        place = tuple(np.argwhere(~np.isfinite(found))[0].tolist())
        raise ParameterError(f"{what}: {found[place]:g} at {list(place)} is not a finite number")
    return found


def row(what: str, values: Any, *, finite: bool = True) -> NDArray[np.float64]:
    """Real numbers in a row, as ``array``."""
    found = array(what, values, finite=finite)
    if max(found.shape, default=1) < found.size:
        raise ParameterError(f"{what} has the shape {found.shape}; give a row of numbers")
    return found.ravel()


def listed(what: str, given: Any) -> list[Any]:
    """The members of a list; a text stands for itself."""
    if isinstance(given, str):
        return [given]
    try:
        found = list(given)
    except Exception:  # each library has its own for what is no list
        found = None
    if found is None or isinstance(given, Mapping):
        raise ParameterError(f"{what} = {short(given)}: pass a list of names")
    return found


def names(what: str, given: Any) -> list[str]:
    """Names or patterns; a single one stands for a list of it."""
    return [text(what, name) for name in listed(what, given)]


def path(what: str, value: Any) -> str:
    """The path of a file or folder as a text."""
    try:
        found = os.fspath(value)
    except TypeError:
        found = None
    if not isinstance(found, str) or not found or "\0" in found:
        raise ParameterError(f"{what} = {short(value)} is not the path of a file")
    return found


@contextmanager
def writing(file: str | os.PathLike[str]) -> Iterator[None]:
    """Around what writes a file: ParameterError where there is no such folder, and where the file cannot be written."""
    folder = Path(file).parent
    try:
        if not folder.is_dir():
            raise ParameterError(f"{os.fspath(file)} cannot be written: there is no folder {folder}")
        yield
    except OSError as error:
        raise ParameterError(f"{os.fspath(file)} cannot be written: {error.strerror}") from None


def options_checked(function: F) -> F:
    """The function, which names an option that it does not have and what that may mean."""
    known = [p.name for p in inspect.signature(function).parameters.values() if p.kind is not p.VAR_KEYWORD][1:]

    @wraps(function)
    def call(*given: Any, **options: Any) -> Any:
        for name in options:
            if name not in known:
                near = suggestion(name, known) or f" (it has {', '.join(known)})"
                raise ParameterError(f"{function.__name__}() has no option {name}{near}")
        return function(*given, **options)

    return call  # type: ignore[return-value]
