"""Laws that switch back and forth without end."""

from __future__ import annotations

from collections import defaultdict, deque

from powertrain.dae.hybrid import Contact, Friction, Switch, When

_SWITCHES = 1000
_SPAN = 1e-5
"""So many switches of one law within this share of the simulated time are chattering: at this pace a run would have 100 million."""
_HYSTERESIS = "Its condition contradicts its effect. Give it a hysteresis, or let the model slide or stick there."
STOP = (
    "Where something strikes a stop, write unilateral(gap, force, restitution=...) instead of when: it ends the bouncing and holds what "
    "comes to rest."
)
"""Advice for resets that accumulate."""


class Chatter:
    """Records when laws switch; too many times within ``_SPAN`` of the simulated time is chattering."""

    def __init__(self, span: float) -> None:
        self._window = _SPAN * span
        self._times: defaultdict[int, deque[float]] = defaultdict(lambda: deque(maxlen=_SWITCHES))

    def note(self, index: int, t: float) -> bool:
        """Record a switch of the law at ``index`` of the held values; True if it chatters."""
        times = self._times[index]
        times.append(t)
        return len(times) == _SWITCHES and t - times[0] < self._window

    def message(self, law: Friction | Switch | Contact | When, t: float) -> str:
        """The error for a law that chatters."""
        resets = isinstance(law, When) and not all(r.discrete for r in law.resets)
        return (
            f"{law.name} ({law.where}) {'resets' if resets else 'switches'} without end: {_SWITCHES} times within {self._window:.3g} s "
            f"before t = {t:.9g} s. {STOP if resets else _HYSTERESIS}"
        )
