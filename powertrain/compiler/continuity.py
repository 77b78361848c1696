"""Variables that must not jump: the model contains their derivative, and signals determine them, alone or together with states.

A jump of such a variable is an impulse, unless a state without a derivative in the model, such as the slip of a clutch, jumps instead.
Examples: an exact speed source whose signal steps while an inertia turns with it, or a ratio that steps between two inertias. A polygon
as an exact position is a step in speed.
"""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from powertrain.compiler.alias import Reduced
from powertrain.compiler.resolver import Resolver
from powertrain.dae.hybrid import Smooth
from powertrain.errors import ModelError
from powertrain.language.recorder import ScheduleEntry
from powertrain.language.symbols import free_symbols, key
from powertrain.language.units import with_unit

_NAMES = 4
"""Names of a variable that a message gives at most."""


def smooth_variables(
    reduced: Reduced, written: Mapping[int, int], resolver: Resolver, held: set[int], relative: set[int]
) -> tuple[Smooth, ...]:
    """Variables below the highest derivative ``written`` in the model that depend on ``held`` values.

    ModelError if a signal makes one jump that no ``relative`` state can keep.
    """
    bases = [(b, order) for b, top in written.items() for order in range(top)]
    expressions = resolver.now([reduced.derivative(reduced.symbols[b], order) for b, order in bases])
    found, named = [], reduced.named()
    for (b, order), expression in zip(bases, expressions, strict=True):
        inside = {key(s) for s in free_symbols(expression)}
        if inside & held:
            variables = sorted(named.get((b, order), ()), key=lambda v: v.unit == "1")
            names = [v.name for v in variables[:_NAMES]] or [reduced.derivative(reduced.symbols[b], order).name()]
            found.append(Smooth(", ".join(names), variables[0].unit if variables else "1", expression))
            for entry in () if inside & relative else reduced.flat.recorder.schedules:
                _check(entry, found[-1])
    return tuple(found)


def _check(entry: ScheduleEntry, smooth: Smooth) -> None:
    """Reject a table whose jump certainly makes the variable jump."""
    t, y, factor = entry.times, entry.values, ca.jacobian(smooth.value, entry.held[1])
    jumps = [i for i in range(1, t.size) if t[0] < t[i] == t[i - 1] and y[i] != y[i - 1]]
    if jumps and factor.is_constant() and float(factor):
        at, size = t[jumps[0]], (y[jumps[0]] - y[jumps[0] - 1]) * float(factor)
        raise ModelError(
            f"{entry.place}\n  the jump of this signal at t = {at:g} s makes {smooth.names} jump by {with_unit(f'{size:g}', smooth.unit)}. "
            "Something with inertia (or a derivative) follows it exactly, which requires an infinite torque or force: let the signal "
            "change gradually, or use a source that is not exact"
        )
