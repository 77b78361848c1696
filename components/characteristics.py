"""Characteristics over speed for torques on shafts and forces on rods, with x a speed divided by its nominal value."""

from __future__ import annotations

import math
from typing import Literal, TypeAlias

import casadi as ca

from powertrain import Symbol, switch, time, within
from powertrain.components.limited import magnitude

COLDEST = 1e-3
"""Resistance relative to that at the reference temperature below which the linear law is meaningless."""

Regularization: TypeAlias = Literal["exp", "sine", "linear", "cosine"]


def step(height: Symbol, offset: Symbol, start: Symbol) -> Symbol:
    """``offset`` before ``start``, ``offset + height`` from then on."""
    return offset + switch(time >= start, height, 0.0)


def linear(x: Symbol, *, one_direction: bool) -> Symbol:
    """x, or |x| where the torque or force has the same direction whichever way the flange moves."""
    return magnitude(x) if one_direction else x


def quadratic(x: Symbol, *, one_direction: bool) -> Symbol:
    """The product x |x|, or x^2 where the torque or force has the same direction whichever way the flange moves."""
    return x**2 if one_direction else x * ca.fabs(x)


def inverse(w: Symbol, nominal: Symbol, least: Symbol, *, one_direction: bool) -> Symbol:
    """nominal/w, below the speed ``least`` w/least; or nominal/|w|, held constant below it.

    As in the Modelica Standard Library 4.0.0, whose characteristic jumps at ``least`` unless that is the nominal speed.
    """
    speed = ca.fabs(w)
    fast = ca.fmax(speed, least)
    if one_direction:
        return switch(speed < least, nominal / least, nominal / fast, continuous=True)
    return switch(speed < least, w / least, nominal * w / fast**2)


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
        "cosine": switch(x >= 0, 1.0, -1.0, continuous=True) * (1 - ca.cos(math.pi / 2 * x)),
    }[reg]
    return switch(x >= 1, 1.0, switch(x <= -1, -1.0, slow, continuous=True), continuous=True)


def eddy_current(x: Symbol) -> Symbol:
    """Kloss' characteristic 2 x/(1 + x^2), one at its largest."""
    return 2 * x / (1 + x**2)


def resistance(alpha20: Symbol, T: Symbol, TRef: Symbol) -> Symbol:
    """R(T)/R(TRef), linear in temperature; the simulation ends where it reaches zero."""
    ratio = 1 + alpha20 / (1 + alpha20 * (TRef - 293.15)) * (T - TRef)
    within(ratio, COLDEST, math.inf, name="resistance R(T)/R(TRef)", unit="1")
    return ratio
