"""Signals from tables of other signals."""

from __future__ import annotations

from powertrain import Component, Equations, Input, Map, Output, ParameterError, signal_input, signal_output
from powertrain.components.blocks.basic import Filter


class CombiTable1D(Filter):
    """A table of one signal: y = table(u).

    ``table`` is a map with one argument, which defines interpolation and extrapolation. Errors: ParameterError for a map with more
    arguments.
    """

    table: Map

    def equations(self) -> Equations:
        """The map."""
        _check(self, self.table, 1)
        yield self.y.value == self.table(self.u.value)


class CombiTable2D(Component):
    """A table of two signals: y = table(u1, u2).

    ``table`` is a map with two arguments, which defines interpolation and extrapolation. Errors: ParameterError for a map with another
    number of arguments.
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
        where = f"{part._label}.table"
        raise ParameterError(
            f"{where}: {type(part).__name__} requires a map with {arguments} arguments; this one has {names}"
        )
