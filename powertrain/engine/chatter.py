"""Laws that switch to and fro without end."""

from __future__ import annotations

from collections import defaultdict, deque

from powertrain.compiler.hybrid import Contact, Friction, Switch, When

_SWITCHES = 200
_SPAN = 1e-3


class Chatter:
    """Notes when laws switch; too many times within a thousandth of the simulated span is chattering."""

    def __init__(self, span: float) -> None:
        self._window = _SPAN * span
        self._times: defaultdict[int, deque[float]] = defaultdict(lambda: deque(maxlen=_SWITCHES))

    def note(self, index: int, t: float) -> bool:
        """Whether the law at ``index`` of the held values, which switches at ``t``, chatters."""
        times = self._times[index]
        times.append(t)
        return len(times) == _SWITCHES and t - times[0] < self._window

    def message(self, law: Friction | Switch | Contact | When, t: float) -> str:
        """What to tell the user about a law that chatters."""
        return (
            f"{law.name} ({law.where}) switches without end: {_SWITCHES} times within {self._window:.3g} s before t = {t:.9g} s. "
            "Its condition and what it switches contradict each other; give it a hysteresis, or let the model slide or stick there."
        )
