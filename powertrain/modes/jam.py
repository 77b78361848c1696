"""Messages for modes that have no solution, have several, or were not found."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from powertrain.dae.hybrid import Friction, HybridDae
from powertrain.language.reals import Array
from powertrain.numerics.buffers import Memory

_MODES = {1.0: "forward", 0.0: "stuck", -1.0: "backward", 2.0: "free"}
SPEEDS = {"N.m": "rad/s", "N": "m/s"}
"""Units of speeds by those of the torques or forces that act on them."""


def jam_message(dae: HybridDae, memory: Memory, side: int, laws: Sequence[int], pieces: int) -> str:
    """The error if no modes of these laws (indices in m) are consistent in any of the ``pieces`` of their bounds."""
    if _quoted(dae, memory, side, laws) or any(contact.index in laws for contact in dae.contacts):
        tried = f" with any of the {pieces} combinations of the conditions in the bounds" if pieces > 1 else ""
        problem = f"no modes are consistent{tried} (the mechanism jams)"
        advice = "The loss exceeds the power that the driving side can supply (self-locking); check the friction bounds and efficiencies."
    else:
        problem = "neither state of a switch is consistent"
        advice = "The condition of a switch contradicts its effect; give it a hysteresis, or let it act on a rate."
    return _message(dae, memory, side, laws, problem, advice)


def several_message(dae: HybridDae, memory: Memory, side: int, modes: Sequence[Array], laws: Sequence[int]) -> str:
    """The error if several modes of these laws (indices in m) are consistent, with different torques."""
    names, sliding = {law.index: law.name for law in dae.laws}, {law.index for law in dae.frictions}
    options = " or ".join("(" + ", ".join(_mode(names[i], m[i], i in sliding) for i in laws) + ")" for m in modes[:3])
    problem = f"{len(modes)} combinations of modes are possible, with different accelerations or torques: {options}"
    advice = (
        "The laws lock each other in more than one way (self-locking); add a little compliance or damping between them."
    )
    return _message(dae, memory, side, laws, problem, advice)


def not_found_message(dae: HybridDae, memory: Memory, side: int, laws: Sequence[int]) -> str:
    """The error if no modes were found, although nothing proves that there are none."""
    problem = "no consistent modes were found, though there may be some"
    return _message(dae, memory, side, laws, problem, "Separate some of them by a shaft stiffness.")


def _message(dae: HybridDae, memory: Memory, side: int, laws: Sequence[int], problem: str, advice: str) -> str:
    """The problem, the laws involved with their torques, and what to do."""
    parts = ", ".join(law.name for law in dae.laws if law.index in laws)
    head = f"at t = {memory.time[0]:.9g} s {problem}. Involved: {parts}"
    return "\n".join([head, *_quoted(dae, memory, side, laws), advice])


def _quoted(dae: HybridDae, memory: Memory, side: int, laws: Sequence[int]) -> list[str]:
    """One line for each of these laws, and for each law whose bounds depend on one of these switches (the driving side of a mesh)."""
    if not dae.frictions:
        return []
    return [
        f"  {law.name} ({law.where}): torque {torque:.6g} {law.unit}, {_bounds(lower, upper)} {law.unit}, "
        f"speed {w:.3g} {SPEEDS.get(law.unit, '')}".rstrip()
        for law, w, torque, lower, upper, _ in zip(dae.frictions, *memory.frictions(side), strict=True)
        if law.index in laws or any(ca.depends_on(ca.vertcat(law.lower, law.upper), dae.m[i]) for i in laws)
    ]


def _bounds(lower: float, upper: float) -> str:
    """The bounds of a law, which modes that are not consistent may put in the wrong order."""
    return (
        f"bounds {lower:.6g} to {upper:.6g}"
        if lower <= upper
        else f"bounds in the wrong order, {lower:.6g} and {upper:.6g}"
    )


def _mode(name: str, value: float, friction: bool) -> str:
    return f"{name} {_MODES.get(float(value), f'{value:g}') if friction else 'on' if value else 'off'}"


def resting_note(law: Friction, torque: float, lower: float, upper: float, t: float) -> str:
    """The note for a law at rest that its torque cannot move."""
    return (
        f"from t = {t:.9g} s: {law.name} is stuck where nothing can move; its torque is not unique: "
        f"{torque + 0.0:.6g} {law.unit} is used, but any torque from {lower:.6g} to {upper:.6g} {law.unit} is possible"
    )
