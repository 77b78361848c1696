"""What to say where the modes of the laws have no solution, or several, or torques that are not determined."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.hybrid import Contact, Friction, HybridDae, Switch
from powertrain.engine.buffers import Array, Memory

_NAMES = 6
"""So many laws are named in a note."""
_MODES = {1.0: "forward", 0.0: "stuck", -1.0: "backward", 2.0: "free"}


def law_values(dae: HybridDae, memory: Memory, side: int) -> NDArray[np.float64]:
    """One row (w, torque, lower, upper, rate, peak) per friction law at the current point."""
    fields = ("w", "torque", "lower", "upper", "rate", "peak")
    if memory.laws is None:
        columns = [ca.vertcat(*[getattr(friction, field) for friction in dae.frictions]) for field in fields]
        outputs = [ca.densify(ca.horzcat(*columns))]
        memory.laws = ca.Function("powertrain_laws", [dae.t, dae.x, dae.z, dae.m, dae.p], outputs)
    values = memory.laws
    n, nz, nm, count = dae.x.numel(), dae.z.numel(), dae.m.numel(), dae.p.numel()
    y = memory.y[side]
    row = values(memory.time[0], y[:n], y[n : n + nz], memory.m[:nm], memory.p[:count])
    return np.array(row).reshape(len(dae.frictions), len(fields))


def jam_message(
    dae: HybridDae, memory: Memory, side: int, modes: Sequence[Array], involved: Sequence[int], combinations: int
) -> str:
    """No consistent combination, several, or too many to try."""
    laws: list[Friction | Switch | Contact] = [*dae.frictions, *dae.switches, *dae.contacts]
    names = {law.index: law.name for law in laws}
    sliding = {law.index for law in dae.frictions}
    parts = ", ".join(names[i] for i in involved)
    values = law_values(dae, memory, side)
    lines = [
        f"  {law.name} ({law.where}): torque {row[1]:.6g} {law.unit}, bounds {row[2]:.6g} .. {row[3]:.6g} {law.unit}, speed {row[0]:.3g}"
        for law, row in zip(dae.frictions, values, strict=True)
        if _takes_part(law, dae, involved)
    ]
    if modes:
        options = " or ".join(
            "(" + ", ".join(_mode(names[i], m[i], i in sliding) for i in involved) + ")" for m in modes[:3]
        )
        problem = f"{len(modes)} combinations of modes are possible, with different accelerations or torques: {options}"
        advice = "The laws lock each other in more than one way (self-locking); a little compliance or damping between them decides."
    elif combinations > 20_000:
        problem = f"the modes are not found, and {combinations} combinations are too many to try"
        advice = "Separate some of the laws by a shaft stiffness."
    else:
        jam = bool(lines) or any(contact.index in involved for contact in dae.contacts)
        problem = f"none of the {combinations} combinations of modes is consistent"
        problem += " (the mechanism jams)" if jam else ""
        advice = (
            "Self-locking with more loss than the driving side can give; check the friction bounds and efficiencies."
            if jam
            else "The condition of a switch and what it switches contradict each other; give it a hysteresis, or let it act on a rate."
        )
    return "\n".join([f"at t = {memory.time[0]:.9g} s {problem}. Involved: {parts}", *lines, advice])


def _takes_part(law: Friction, dae: HybridDae, involved: Sequence[int]) -> bool:
    """Whether a law is among these, or a switch that its bounds follow, such as the side that drives a mesh."""
    bounds = ca.vertcat(law.lower, law.upper)
    return law.index in involved or any(ca.depends_on(bounds, dae.m[i]) for i in involved)


def _mode(name: str, value: float, friction: bool) -> str:
    return f"{name} {_MODES.get(float(value), f'{value:g}') if friction else 'on' if value else 'off'}"


def undetermined_laws(dae: HybridDae, memory: Memory, side: int) -> list[Friction]:
    """The stuck laws whose torques are not finite."""
    if not dae.frictions:
        return []
    torques = law_values(dae, memory, side)[:, 1]
    pairs = zip(dae.frictions, torques, strict=True)
    return [law for law, torque in pairs if memory.m[law.index] == 0 and not np.isfinite(torque)]


def undetermined_message(laws: Sequence[Friction], t: float) -> str:
    """Stuck laws that lock the same motion, and no way to share the torque between them."""
    return (
        f"at t = {t:.9g} s the torques of {_names(laws)} are not determined: all are stuck and lock the same motion. "
        "Put a shaft stiffness between them, or remove one."
    )


def undetermined_note(laws: Sequence[Friction], t: float) -> str:
    """Stuck laws that lock the same motion or close a loop: the motion is unique, their torques are not."""
    if len(laws) == 1:
        return f"from t = {t:.9g} s: {laws[0].name} is stuck where nothing can move anyway; its torque is not unique"
    names = [law.name for law in laws]
    shown = names if len(names) <= _NAMES else [*names[: _NAMES - 1], f"{len(names) - _NAMES + 1} others"]
    return (
        f"from t = {t:.9g} s: {', '.join(shown[:-1])} and {shown[-1]} are stuck together; how they share the torque is not unique, and "
        "nothing else depends on it"
    )


def resting_note(law: Friction, torque: float, lower: float, upper: float, t: float) -> str:
    """A law at rest that its torque cannot move."""
    return (
        f"from t = {t:.9g} s: {law.name} is stuck where nothing can move anyway; its torque is not unique: {torque:.6g} {law.unit} is "
        f"given, any from {lower:.6g} to {upper:.6g} {law.unit} would do"
    )


def held_note(law: Friction, t: float) -> str:
    """A law at a limit of its torque that others hold at rest."""
    return f"from t = {t:.9g} s: {law.name} is held at rest by other laws; it is given a limit of its torque, which is not unique"


def _names(laws: Sequence[Friction]) -> str:
    return " and ".join(f"{law.name} ({law.where})" for law in laws)
