"""Laws of symbols at numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from powertrain import Symbol


def numbers(law: Callable[..., Symbol], *values: ArrayLike) -> Any:
    """A law at arrays of numbers, broadcast; a number for numbers."""
    symbols = [ca.SX.sym("argument") for _ in values]
    full = np.broadcast_arrays(*(np.asarray(v, float) for v in values))
    function = ca.Function("law", symbols, [law(*symbols)])
    return np.asarray(function(*(f.reshape(1, -1) for f in full)), float).reshape(full[0].shape)[()]
