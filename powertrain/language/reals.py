"""Real numbers from whatever holds them. What NumPy would turn into other numbers than meant is refused."""

from __future__ import annotations

import math
from decimal import Decimal
from numbers import Real
from reprlib import repr as short
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Real numbers, of any shape."""


class NotReal(TypeError):
    """Says which value is not a real number, or what to give instead."""


def reals(values: Any) -> Array:
    """Real numbers as an array, of the shape that they have.

    NotReal for truth values, texts, complex numbers, dates and durations, and where values are masked: NumPy has a number for each
    of them. ValueError for rows of unequal lengths.
    """
    if np.ma.is_masked(values):
        raise NotReal("some of its values are masked")
    # A list must keep its members as they are: [2.5, True] would become [2.5, 1.0].
    given = np.asarray(values, object if isinstance(values, list | tuple) else None)
    if given.dtype.kind in "iuf":
        return np.asarray(given, np.float64)
    if given.dtype.kind in "mM":
        raise NotReal("give times in seconds: (t - t[0]) / numpy.timedelta64(1, 's')")
    members = given.astype(object).ravel()
    plain = set(map(type, members)) <= {float, np.float64}
    return np.array(members if plain else [_one(v) for v in members], np.float64).reshape(given.shape)


def sealed(values: Array) -> Array:
    """The array, which from now on cannot be changed."""
    values.flags.writeable = False
    return values


def real(value: Any) -> float:
    """One real number; a number of CasADi is one too. NotReal for anything else."""
    found = np.asarray(float(value)) if isinstance(value, ca.DM) and value.is_scalar() else reals(value)
    if found.ndim:
        raise NotReal(f"{short(value)} is not one number")
    return float(found)


def _one(value: Any) -> float:
    """A number that is not an array's; beyond the range of a float it is infinite, as 1e400 is in Python."""
    if getattr(value, "ndim", None) == 0 and not isinstance(value, np.generic):
        return real(value)
    if isinstance(value, ca.SX) and value.is_scalar():
        found = float(value)  # in equations this says what to write instead of a symbol
        if value.is_constant():
            return found
    if isinstance(value, bool) or not isinstance(value, Real | Decimal):
        raise NotReal(f"{short(value)} is not a real number")
    try:
        return float(value)
    except OverflowError:
        return -math.inf if value < 0 else math.inf
