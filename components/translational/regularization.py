"""Smoothed signs, for forces that change direction with speed and are wanted without friction's standstill."""

from __future__ import annotations

import math
from typing import Literal, TypeAlias

import casadi as ca

from powertrain import Symbol, switch

Regularization: TypeAlias = Literal["exp", "sine", "linear", "cosine"]


def smooth_sign(x: Symbol, reg: Regularization) -> Symbol:
    """The sign of ``x``, made continuous around 0.

    "exp": 2/(1 + exp(-100 x)) - 1.  Else the sign for |x| >= 1, and in between "sine": sin(pi/2 x);  "linear": x;
    "cosine": sign(x) (1 - cos(pi/2 x))
    """
    if reg == "exp":
        return ca.tanh(50 * x)
    slow = {
        "linear": x,
        "sine": ca.sin(math.pi / 2 * x),
        "cosine": ca.sign(x) * (1 - ca.cos(math.pi / 2 * x)),
    }[reg]
    return switch(x >= 1, 1.0, switch(x <= -1, -1.0, slow, continuous=True), continuous=True)
