"""Mounts of engine and gearbox, which carry the reaction torque to the body."""

from __future__ import annotations

from powertrain import (
    Equations,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    der,
    parameter,
    port,
    support,
    variable,
)
from powertrain.components.rotational.interfaces import Flange, Lossy


class MountedHousing(Lossy):
    """A housing that rolls on its mounts: connect the ``housing`` of the engine and the supports of gearbox and final drive to its own.

    phi = housing.phi - body.phi,  w = der(phi),  J der(der(housing.phi)) = housing.tau - tau,  tau = -body.tau
    tau = sum over the mounts of y F,  F = k y phi (1 + (y phi/s_0)^2) + d y w

    ``mounts``: rows (distance y in m from the roll axis, stiffness k in N/m, damping d in N.s/m), with forces normal to y. Small
    angles. The mounts stiffen with their deflection: at s_0 the force is twice the linear one. The reactions of the parts on the housing
    sum up to the torques that leave it, so at rest the mounts carry the torque of the output shafts minus that of the input
    shafts: for a whole powertrain, the torque of the half shafts. The housing has one degree of freedom, roll about the crankshaft; the
    axes of its shafts are parallel to it. The defaults are invented, for a transverse engine and gearbox of 200 kg: 9 Hz in roll.
    Errors: ParameterError for a negative stiffness or damping.
    """

    mounts: tuple[tuple[float, float, float], ...] = ((-0.4, 1.2e5, 400.0), (0.4, 1.2e5, 400.0))
    housing: Flange = port(Flange)
    body: Flange = support(Flange)
    J: Parameter = parameter(
        "kg.m2", "Moment of inertia of engine and gearbox about the roll axis", default=12.0, above=0
    )
    s_0: Parameter = parameter("m", "Deflection at which the force is twice the linear one", default=0.02, above=0)
    phi: Variable = variable("rad", "Roll angle against the body", start=0.0)
    w: Variable = variable("rad/s", "Speed of roll against the body", start=0.0)
    tau: Variable = variable("N.m", "Torque of the mounts")

    def equations(self) -> Equations:
        """A mass on springs and dampers."""
        self._check_rows()
        yield self.phi == self.housing.phi - self.body.phi
        yield self.w == der(self.phi)
        yield self.J * der(der(self.housing.phi)) == self.housing.tau - self.tau
        elastic = sum(k * y**2 * self.phi * (1 + (y * self.phi / self.s_0) ** 2) for y, k, _ in self.mounts)
        yield self.tau == elastic + self._damping() * self.w
        yield self.body.tau == -self.tau
        yield from self._dissipate()

    def _check_rows(self) -> None:
        for y, k, d in self.mounts:
            if k < 0 or d < 0:
                said = f"k = {k:g} N/m at y = {y:g} m" if k < 0 else f"d = {d:g} N.s/m at y = {y:g} m"
                raise ParameterError(f"{self._label}.mounts: {said} is negative")

    def _damping(self) -> float:
        return sum(d * y**2 for y, _, d in self.mounts)

    def energy(self) -> Symbol:
        """Kinetic energy, and k (y phi)^2/2 + k (y phi)^4/(4 s_0^2) of every mount."""
        squares = [(k, (y * self.phi) ** 2) for y, k, _ in self.mounts]
        elastic = sum(k * u / 2 * (1 + u / (2 * self.s_0**2)) for k, u in squares)
        return elastic + self.J * der(self.housing.phi) ** 2 / 2

    def loss(self) -> Symbol:
        """Damping torque times speed."""
        return self._damping() * self.w**2
