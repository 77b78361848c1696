"""Friction faces that a signal presses together, in clutches and brakes of shafts and rods."""

from __future__ import annotations

import casadi as ca

from powertrain import Component, Equations, Input, Parameter, Symbol, Variable, parameter, signal_input, variable
from powertrain.components.friction_table import Table, at_speed


class Pressed(Component):
    """Partial: a force that presses friction faces together.

    fn = fn_max f_normalized
    """

    fn_max: Parameter = parameter("N", "Pressing force at f_normalized = 1", min=0)
    f_normalized: Input = signal_input("1", "Pressing force over fn_max; there is no friction where it is not positive")
    fn: Variable = variable("N", "Pressing force")

    def _press(self) -> Equations:
        yield self.fn == self.fn_max * self.f_normalized.value


class DryFaces(Pressed):
    """Partial: pressed faces whose coefficient of friction depends on their sliding speed."""

    mue_pos: Table = ((0.0, 0.5),)
    peak: Parameter = parameter("1", "Break-away coefficient of friction relative to mue_pos(0)", default=1.0, min=1)

    def _friction(self, speed: Symbol, unit: str) -> Symbol:
        """Friction force [N] while the faces slide at a speed in its ``unit``."""
        return ca.fmax(self.fn, 0) * at_speed(self, "mue_pos", speed, (unit, "1"))
