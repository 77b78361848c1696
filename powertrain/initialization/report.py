"""The start of a run: which conditions were used, which follow from others, and what is not unique."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

from powertrain.errors import InitializationError
from powertrain.initialization.choice import Choice
from powertrain.initialization.conditions import StartCondition, StartEquation
from powertrain.language.reals import Array
from powertrain.language.units import with_unit


class InitialReport:
    """The start of one run: the conditions used, those that follow from others, and the resulting states.

    ``given``: the discrete variables with values given for this run; ``open``: the indices of the states that no condition affects.
    """

    def __init__(
        self,
        asked: Sequence[StartEquation],
        values: Array,
        choice: Choice,
        states: Sequence[str],
        y: Array,
        given: frozenset[str],
        notes: Callable[[], tuple[str, ...]],
    ) -> None:
        self._asked, self._values, self._chosen = asked, values, choice.taken
        self._names, self._y, self.open = states, y, tuple(choice.open_states)
        self.given, self._find_notes = given, notes

    def __getstate__(self) -> dict[str, Any]:
        kept = {"given": self.given, "notes": self.notes}
        return {"used": self.used, "implied": self.implied, "states": self.states, **kept}

    @property
    def solved(self) -> tuple[StartEquation, ...]:
        """The conditions that were solved, with their expressions; a pickled report has none."""
        return tuple(a for i, a in enumerate(self._asked) if i in self._chosen)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What is not unique in the start."""
        return self._find_notes()

    @cached_property
    def used(self) -> tuple[StartCondition, ...]:
        """The conditions that were solved, and the states that none of them affects."""
        rest = [StartCondition(self._names[k], "not determined otherwise", float(self._y[k])) for k in self.open]
        return (*self._conditions(True), *rest)

    @cached_property
    def implied(self) -> tuple[StartCondition, ...]:
        """The conditions that follow from earlier ones."""
        return self._conditions(False)

    @cached_property
    def states(self) -> dict[str, float]:
        """The states at the start."""
        return dict(zip(self._names, self._y.tolist(), strict=False))

    def _conditions(self, used: bool) -> tuple[StartCondition, ...]:
        pairs = enumerate(zip(self._asked, self._values.tolist(), strict=True))
        return tuple(StartCondition(a.label, a.source, v, a.unit) for i, (a, v) in pairs if (i in self._chosen) == used)

    def __repr__(self) -> str:
        rows = [(c.label, with_unit(f"{c.value:.6g}", c.unit), c.source) for c in self.used]
        rows += [
            (c.label, with_unit(f"{c.value:.6g}", c.unit), f"{c.source}; not needed, it follows from the others")
            for c in self.implied
        ]
        rows += [(name, f"{value:.6g}", "state") for name, value in self.states.items()]
        widths = [max((len(row[k]) for row in rows), default=0) for k in (0, 1)]
        table = [f"{a:<{widths[0]}}  {b:>{widths[1]}}  {c}" for a, b, c in rows]
        return "\n".join([*table, *self.notes])


def with_notes(error: InitializationError, notes: Sequence[str]) -> InitializationError:
    """The error of a start that might be another one."""
    return InitializationError("\n  ".join([str(error), *notes]))
