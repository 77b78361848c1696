"""Signals by tables of other signals."""

from __future__ import annotations

from powertrain import Component, Equations, Input, Map, Output, ParameterError, signal_input, signal_output
from powertrain.components.blocks.basic import Filter


class CombiTable1D(Filter):
    """A signal by a table of another one: y = table(u).

    ``table`` is a map of one argument, which says how it is interpolated and what holds beyond its points. Errors: ParameterError for a
    map of more arguments.
    """

    table: Map

    def equations(self) -> Equations:
        """The map."""
        _check(self, self.table, 1)
        yield self.y.value == self.table(self.u.value)


class CombiTable2D(Component):
    """A signal by a table of two others: y = table(u1, u2).

    ``table`` is a map of two arguments, which says how it is interpolated and what holds beyond its points. Errors: ParameterError for a
    map of another number of arguments.
    """

    table: Map
    u1: Input = signal_input("1", "First signal")
    u2: Input = signal_input("1", "Second signal")
    y: Output = signal_output("1", "Signal")

    def equations(self) -> Equations:
        """The map."""
        _check(self, self.table, 2)
        yield self.y.value == self.table(self.u1.value, self.u2.value)


def _check(part: Component, table: Map, arguments: int) -> None:
    if len(table.axes) != arguments:
        names = ", ".join(f"{axis.name} [{axis.unit}]" for axis in table.axes)
        where = f"{part._path}.table".lstrip(".")
        raise ParameterError(
            f"{where}: {type(part).__name__} requires a map with {arguments} arguments; this one has {names}"
        )
