"""The switch, and the comparison (relation) in the condition of a when: everything that follows from their record, ``Switch``.

The mode is 1 while the condition g > 0, else 0. If g is affine in time, the instant of the change is known.
"""

from __future__ import annotations

from itertools import compress

import casadi as ca

from powertrain.dae.hybrid import HybridDae, Switch, When
from powertrain.dae.tolerances import EPS, NOW
from powertrain.language.symbols import depending


def condition_margin(mode: ca.SX, g: ca.SX, known: ca.SX | float = EPS, ended: ca.SX | None = None) -> ca.SX:
    """A mode of 1 holds while g > 0, a mode of 0 while g <= 0; including the hysteresis.

    Zero itself is not positive: a limited signal ends there. ``ended``: whether it does, if there may be other reasons.
    """
    return (2 * mode - 1) * g + known - ca.if_else(g == 0 if ended is None else ended, 2 * known * mode, 0)


def margin(dae: HybridDae, law: Switch) -> ca.SX:
    """The condition of a switch with its hysteresis."""
    return condition_margin(dae.m[law.index], law.g, law.known)


def located(dae: HybridDae) -> list[Switch]:
    """The switches and relations that change at state events: the others change at known instants or with held values."""
    laws = [law for law in (*dae.switches, *dae.relations) if law.time is None]
    moving = depending([law.g for law in laws], ca.vertcat(dae.t, dae.x, dae.z))
    return list(compress(laws, moving))


def watched(dae: HybridDae, law: Switch) -> tuple[ca.SX, ca.SX | float]:
    """What falls through zero when a switch that is ``located`` must change its mode, with its uncertainty."""
    return margin(dae, law), law.known


def next_mode(dae: HybridDae, law: Switch, fires: ca.SX | None) -> ca.SX:
    """The other mode if the margin has failed; ``fires``: whether the instant of the law is now, if that is known."""
    old = dae.m[law.index]
    if fires is None:
        return _kept(old, margin(dae, law))
    new = _kept(old, condition_margin(old, in_time(dae, law.g), EPS + now(dae), ended=ca.SX(0)))
    return ca.if_else(fires, ca.jacobian(law.g, dae.t) > 0, new)


def next_steady_mode(mode: ca.SX, g: ca.SX, known: ca.SX) -> ca.SX:
    """The mode that follows at an iterate of a steady state; a condition that is zero, within ``known``, keeps its side."""
    return _kept(mode, condition_margin(mode, g, known))


def _kept(mode: ca.SX, margin: ca.SX) -> ca.SX:
    return ca.if_else(margin <= 0, 1 - mode, mode)


def steady_margins(law: Switch) -> dict[float, ca.SX]:
    """Both modes, each with a margin that is not negative where it holds at a steady state.

    Without the uncertainty of a run: there is no mode before, and in a wide band around g = 0 both modes would hold.
    """
    return {1.0: condition_margin(ca.SX(1), law.g), 0.0: condition_margin(ca.SX(0), law.g)}


def now(dae: HybridDae) -> ca.SX:
    """Instants within this of the time (s) are now: a law that has fired so early must not be taken back."""
    return NOW * ca.fmax(1, ca.fabs(dae.t))


def in_time(dae: HybridDae, g: ca.SX) -> ca.SX:
    """``g``, affine in time, divided by its slope: its hysteresis becomes a time."""
    return g / (ca.fabs(ca.jacobian(g, dae.t)) + 1e-300)


def timed(dae: HybridDae) -> tuple[ca.SX, list[int]]:
    """The known instants of laws (switches, then relations, then whens), and the indices of these laws in the held values."""
    laws: list[Switch | When] = [*dae.switches, *dae.relations, *dae.whens]
    known = [(law.time, law.index) for law in laws if law.time is not None]
    return ca.vertcat(ca.SX(0, 1), *[time for time, _ in known]), [index for _, index in known]


def firing(dae: HybridDae, fire: ca.SX) -> dict[int, ca.SX]:
    """Whether the instant of each timed law that ``fire`` marks is now; a reset may have moved it."""
    instants, indices = timed(dae)
    return {
        index: ca.logic_and(fire[k] > 0, ca.fabs(instant - dae.t) <= now(dae))
        for k, (index, instant) in enumerate(zip(indices, ca.vertsplit(instants), strict=True))
    }
