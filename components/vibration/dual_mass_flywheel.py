"""Dual-mass flywheels."""

from __future__ import annotations

from powertrain import Equations, connect
from powertrain.components.rotational import Inertia
from powertrain.components.rotational.interfaces import TwoFlanges
from powertrain.components.vibration.springs import ArcSpring, StagedSpring


class DualMassFlywheel(TwoFlanges):
    """A flywheel with two masses and arc springs between them: primary mass at flange_a (engine), secondary at flange_b (gearbox).

    The arc springs rub in a channel of the primary mass. ``stages`` act in parallel: inner springs beyond an angle, and the stop.
    Without friction the natural frequency is root(c (1/J_primary + 1/J_secondary)), which must be well below the idle speed times
    the order of ignition. In a linear analysis coils at rest stick, and the spring is stiffer; with ``arc.mue`` = 0 all of them move.
    The defaults are invented, for a 200 N.m engine: 400 N.m at 0.8 rad, stop at 0.95 rad.
    """

    primary: Inertia = Inertia(J=0.09)
    arc: ArcSpring = ArcSpring()
    stages: StagedSpring = StagedSpring(stages=((0.6, 400.0), (0.95, 2e4)))
    secondary: Inertia = Inertia(J=0.05)

    def equations(self) -> Equations:
        """Two masses, and the springs in parallel."""
        yield connect(self.flange_a, self.primary.flange_a)
        yield connect(self.primary.flange_b, self.arc.flange_a, self.stages.flange_a)
        yield connect(self.arc.flange_b, self.stages.flange_b, self.secondary.flange_a)
        yield connect(self.secondary.flange_b, self.flange_b)
