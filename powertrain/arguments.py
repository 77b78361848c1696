"""What a user passes to a function: its kind is looked at where it comes in, and an error names the argument, not a line inside."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from reprlib import repr as short
from typing import Any

import numpy as np
from numpy.typing import NDArray

from powertrain.errors import ParameterError
from powertrain.units import with_unit

MOST = 10**9


def number(what: str, value: Any, unit: str = "") -> float:
    """A finite or infinite number as a float."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise ParameterError(f"{what} = {short(value)} is not a number")
    try:
        found = float(value)
    except OverflowError:
        raise ParameterError(f"{what} = {short(value)} is too large") from None
    if math.isnan(found):
        raise ParameterError(f"{what} = {with_unit('nan', unit or '1')} is not a number")
    return found


def whole(what: str, value: Any, least: int) -> int:
    """A whole number from ``least`` on."""
    if isinstance(value, bool) or not isinstance(value, Integral) or not least <= int(value) <= MOST:
        raise ParameterError(f"{what} = {short(value)} must be a whole number, at least {least} and at most {MOST}")
    return int(value)


def array(what: str, value: Any) -> NDArray[np.float64]:
    """Finite numbers of any shape."""
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"{what} = {short(value)}: give numbers") from None
    if not np.isfinite(found).all():
        raise ParameterError(f"{what} = {short(value)}: the numbers must be finite")
    return found


def named(what: str, value: Any) -> dict[str, Any]:
    """Values by name; None stands for none of them."""
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise ParameterError(f'{what} = {short(value)}: give values by name, such as {{"J1.w": 10.0}}')
    return dict(value)


def numbers(what: str, value: Any) -> dict[str, float]:
    """Numbers by name."""
    return {name: number(f"{what}: {name}", found) for name, found in named(what, value).items()}


def listed(what: str, value: Any, kind: type | tuple[type, ...] = object) -> list[Any]:
    """The members of a list, each of a kind; a text is none."""
    if not isinstance(value, Sequence) or isinstance(value, str | bytes) or not all(isinstance(v, kind) for v in value):
        raise ParameterError(f'{what} = {short(value)}: give a list of names, such as ["J1.w"]')
    return list(value)


def names(what: str, value: Any) -> list[str]:
    """Names or patterns; a single one stands for a list of it."""
    return [value] if isinstance(value, str) else listed(what, value, str)


def path(what: str, value: Any) -> str:
    """The path of a file or folder as a text."""
    try:
        found = os.fspath(value)
    except TypeError:
        found = None
    if not isinstance(found, str) or not found or "\0" in found:
        raise ParameterError(f"{what} = {short(value)} is not the path of a file")
    return found
