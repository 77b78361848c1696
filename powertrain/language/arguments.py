"""Checks of arguments where they are passed, so that errors name them in the user's terms."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from numbers import Integral, Number
from pathlib import Path
from reprlib import repr as short
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError, suggestion
from powertrain.language.quantities import quantity
from powertrain.language.units import with_unit

F = TypeVar("F", bound=Callable[..., Any])
MOST = 10**9
LOOSEST = 0.1
"""Largest relative tolerance: beyond it the step size control keeps no error small."""


def number(what: str, value: Any, unit: str = "1") -> float:
    """A finite number in ``unit``, or a text such as "2 min" where there is a unit; not true or false."""
    if isinstance(value, str) and unit != "1":
        return quantity(value, unit, what)
    found = np.asarray(value) if isinstance(value, np.ndarray | Number) else None
    if found is None or found.ndim or found.dtype.kind not in "iuf" or not np.isfinite(found):
        raise ParameterError(f"{what} = {with_unit(short(value), unit)} is not a finite number")
    return float(found)


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
    return relative, relative if atol is None else positive("atol", atol)


def single(value: Any) -> bool:
    """Whether a value is one, and no list or array of values; the lists in it may have unequal lengths, which np.ndim refuses."""
    return not isinstance(value, list | tuple) and getattr(value, "ndim", 0) == 0


def limits(what: str, given: Any, *, closed: bool = False) -> tuple[float, float]:
    """(low, high), which may be infinite, and equal where ``closed``."""
    try:
        low, high = (float(v) for v in given)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{what} = {short(given)}: give (low, high)") from None
    if not (low < high or (closed and low == high)):
        raise ParameterError(f"{what}: the range {low:g} to {high:g} is empty")
    return low, high


def count(what: str, value: Any) -> int:
    """A whole number from 1 on."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
        raise ParameterError(f"{what} = {short(value)} must be a whole number")
    if not 1 <= int(value) <= MOST:
        raise ParameterError(f"{what} = {short(value)} must be at least 1 and at most {MOST}")
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


class _OtherKind(TypeError):
    """Says what to give instead of values that NumPy would convert to other numbers than meant."""


def floats(values: Any) -> NDArray[np.float64]:
    """Numbers as an array. TypeError for dates, durations and complex numbers, which NumPy takes for counts of a unit and real parts."""
    given = np.asarray(values)
    if given.dtype.kind in "mM":
        raise _OtherKind("give times in seconds: (t - t[0]) / numpy.timedelta64(1, 's')")
    if given.dtype.kind == "c":
        raise _OtherKind("it is complex")
    return np.asarray(given, float)


def array(what: str, values: Any) -> NDArray[np.float64]:
    """Finite numbers of any shape."""
    try:
        found = floats(values)
    except (TypeError, ValueError, OverflowError) as error:
        hint = f"; {error}" if isinstance(error, _OtherKind) else ""
        raise ParameterError(f"{what} = {short(values)} is not a sequence of numbers{hint}") from None
    if not np.isfinite(found).all():
        raise ParameterError(f"{what} must be finite; one of them is {found[~np.isfinite(found)][0]:g}")
    return found


def row(what: str, values: Any) -> NDArray[np.float64]:
    """Finite numbers in a row."""
    return array(what, values).ravel()


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
    if not folder.is_dir():
        raise ParameterError(f"{os.fspath(file)} cannot be written: there is no folder {folder}")
    try:
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
