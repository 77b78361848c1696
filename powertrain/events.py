"""The events of a run as a table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, overload

import numpy as np

from powertrain.engine.trajectory import Event
from powertrain.errors import ParameterError, suggestion
from powertrain.language import htmltext
from powertrain.language.reals import Array
from powertrain.signals import fits_pattern

if TYPE_CHECKING:
    import pandas as pd

MODES = {
    "friction": {1: "forward", 0: "stuck", -1: "backward", 2: "free"},
    "contact": {1: "closed", 0: "open"},
    "switch": {1: "on", 0: "off"},
    "when": {1: "on", 0: "off"},
}
_SHOWN = 60
_HEAD = ("time [s]", "name", "change")


def change(event: Event) -> str:
    """What happened in words: 'stuck -> forward', 'impact', 'reset'."""
    if math.isnan(event.new):
        return event.kind
    names = MODES.get(event.kind, {})
    return " -> ".join(names.get(round(mode), f"{mode:g}") for mode in (event.old, event.new))


class EventTable(Sequence[Event]):
    """What switched when, in time order. Reads as a sequence and prints as a table.

    ``events["clutch1"]`` gives the events of one component, ``events["clutch*.mode"]`` those of the names that fit.
    """

    def __init__(self, events: Iterable[Event]) -> None:
        self._events = tuple(events)

    @property
    def times(self) -> Array:
        """The instants in seconds, one per event."""
        return np.array([event.time for event in self._events])

    @property
    def names(self) -> list[str]:
        """The laws that switched, each once, in the order of their first event."""
        return list(dict.fromkeys(event.name for event in self._events))

    def __len__(self) -> int:
        return len(self._events)

    def __iter__(self) -> Iterator[Event]:
        return iter(self._events)

    @overload
    def __getitem__(self, index: int) -> Event: ...
    @overload
    def __getitem__(self, index: slice | str) -> EventTable: ...
    def __getitem__(self, index: int | slice | str) -> Event | EventTable:
        if isinstance(index, str):
            return self._named(index)
        return EventTable(self._events[index]) if isinstance(index, slice) else self._events[index]

    def _named(self, pattern: str) -> EventTable:
        """Events of one law, of one component ('clutch1') or of a pattern ('clutch*')."""
        patterns = (pattern, f"{pattern}.*")
        found = [e for e in self._events if any(fits_pattern(e.name, p) for p in patterns)]
        if not found and suggestion(pattern, self.names):
            raise ParameterError(f"no event of {pattern}{suggestion(pattern, self.names)}")
        return EventTable(found)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, EventTable) and repr(self._events) == repr(other._events)

    def __hash__(self) -> int:
        return hash(repr(self._events))

    def rows(self) -> list[tuple[str, str, str]]:
        """Time, name and change of each event as text."""
        return [(f"{event.time:.9g}", event.name, change(event)) for event in self._events]

    def __repr__(self) -> str:
        if not self._events:
            return "no events"
        rows = [_HEAD, *self.rows()[:_SHOWN]]
        widths = [max(len(row[k]) for row in rows) for k in (0, 1)]
        lines = [f"{time:>{widths[0]}}  {name:<{widths[1]}}  {said}" for time, name, said in rows]
        return "\n".join(lines + ([f"... {len(self) - _SHOWN} more"] if len(self) > _SHOWN else []))

    def _repr_html_(self) -> str:
        more = f"<p>… {len(self) - _SHOWN} more</p>" if len(self) > _SHOWN else ""
        return htmltext.table(_HEAD, self.rows()[:_SHOWN]) + more

    def to_dataframe(self) -> pd.DataFrame:
        """Columns time, name, kind, old, new, change."""
        import pandas as pd

        table = {field: [getattr(e, field) for e in self._events] for field in ("time", "name", "kind", "old", "new")}
        return pd.DataFrame({**table, "change": [change(e) for e in self._events]})
