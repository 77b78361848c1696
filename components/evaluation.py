"""Evaluates symbolic laws at numbers."""

from __future__ import annotations

from collections.abc import Callable
from contextvars import Context
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from powertrain import Symbol


def numbers(law: Callable[..., Symbol], *values: ArrayLike | Symbol) -> Any:
    """A law at arrays of numbers, broadcast; a number for numbers, an expression for symbols.

    Numbers are evaluated in a separate context, so the law does not affect a model that is being read.
    """
    if any(isinstance(v, ca.SX) for v in values):
        return law(*values)
    symbols = [ca.SX.sym("argument") for _ in values]
    full = np.broadcast_arrays(*(np.asarray(v, float) for v in values))
    expression = Context().run(law, *symbols)
    function = ca.Function("law", symbols, [expression])
    return np.asarray(function(*(f.reshape(1, -1) for f in full)), float).reshape(full[0].shape)[()]
