"""Torsion springs that become stiffer, or softer, with the torque."""

from __future__ import annotations

from itertools import pairwise
from typing import TypeAlias

import casadi as ca

from powertrain import Equations, Parameter, ParameterError, Symbol, Variable, parameter, variable
from powertrain.components.limited import limited
from powertrain.components.rotational.interfaces import CompliantWithRelativeStates, Lossy

Segments: TypeAlias = tuple[tuple[float, float], ...]
"""Rows (torque from which it applies [N.m], stiffness [N.m/rad])."""


class StiffeningSpring(CompliantWithRelativeStates, Lossy):
    """A torsion spring with segments of constant stiffness, equal in both directions, and linear damping.

    tau = tau_c + d w_rel,  |tau_c| <= T_1: phi_rel = tau_c/K_1,  T_1 < |tau_c| <= T_2: |phi_rel| = T_1/K_1 + (|tau_c| - T_1)/K_2, ...

    ``stiffness``: rows (torque from which it applies N.m, stiffness N.m/rad), the first from torque 0, the last without end. Manufacturers
    of high-ratio drives and of damped clutch discs publish torsion in this form.

    Errors: ParameterError for torques that do not increase from 0, and stiffnesses not above 0.
    """

    stiffness: Segments = ((0.0, 1e4),)
    d: Parameter = parameter("N.m.s/rad", "Damping", default=0.0, min=0)
    tau_c: Variable = variable("N.m", "Torque of the spring")

    def equations(self) -> Equations:
        """The segments in series."""
        self._check()
        yield from self._transmit()
        yield self.tau_c == sum((K * (b - a) for K, a, b in self._segments(self.phi_rel)), Symbol(0))
        yield self.tau == self.tau_c + self.d * self.w_rel
        yield from self._dissipate()

    def _segments(self, angle: Symbol) -> list[tuple[float, Symbol, Symbol]]:
        """Stiffness of every segment, and the angles at its start and end."""
        ends, last = [], 0.0
        for (low, K), (high, _) in pairwise(self.stiffness):
            last += (high - low) / K
            ends.append(limited(angle, -last, last))
        parts = [Symbol(0), *ends, angle]
        return [(K, a, b) for (_, K), a, b in zip(self.stiffness, parts[:-1], parts[1:], strict=True)]

    def _check(self) -> None:
        torques = [row[0] for row in self.stiffness]
        rises = torques[:1] == [0.0] and all(one < other for one, other in pairwise(torques))
        if not rises or any(K <= 0 for _, K in self.stiffness):
            raise ParameterError(
                f"{self._label}.stiffness: {self.stiffness!r} is not a table of rows (torque from which it holds N.m, "
                "stiffness N.m/rad) with torques that increase from 0 and stiffnesses above 0"
            )

    def energy(self) -> Symbol:
        """Elastic energy, the integral of tau_c over phi_rel."""
        found = Symbol(0)
        for (T, _), (K, a, b) in zip(self.stiffness, self._segments(ca.fabs(self.phi_rel)), strict=True):
            found += T * (b - a) + K * (b - a) ** 2 / 2
        return found

    def loss(self) -> Symbol:
        """Damping torque times relative speed."""
        return self.d * self.w_rel**2
