"""Axles: from the propeller shaft to the road, and from the road to the body."""

from __future__ import annotations

from powertrain import Component, Equations, Input, ModelError, ParameterError, Symbol, connect, port, signal_input
from powertrain.components.body.body import G_N
from powertrain.components.body.elastic_shaft import ElasticShaft
from powertrain.components.body.path import AxlePath
from powertrain.components.differentials import BevelDifferential, CrownGear, Differential
from powertrain.components.rotational import Flange as Shaft
from powertrain.components.rotational import Inertia, SpringDamper, TwoFlanges
from powertrain.components.translational import Flange
from powertrain.components.wheels import MagicFormulaWheel, RigidWheel, Wheel, WheelBrake


def _rolls(wheel: Wheel) -> Symbol:
    """At the start the wheel rolls on the road."""
    return wheel.radius * wheel.w == wheel.v


def _as_one(*wheels: Wheel) -> RigidWheel:
    """One wheel that replaces several, carries their load and does not slip."""
    radii = {float(wheel.radius) for wheel in wheels}
    if len(radii) > 1:
        raise ParameterError(
            f"wheels with radii of {' and '.join(f'{r:g}' for r in sorted(radii))} m on one axle do not turn as one, as maps of operating "
            "points and the backward calculation assume; give them the same radius"
        )
    n = len(wheels)
    return RigidWheel(
        radius=radii.pop(),
        J=sum(float(wheel.J) for wheel in wheels),
        Cr=sum(float(wheel.Cr) for wheel in wheels) / n,
        Cr_2=sum(wheel.Cr_2 for wheel in wheels) / n,
        load_nominal=sum(float(wheel.load_nominal) for wheel in wheels),
    )


class Axle(Component):
    """Partial: an axle under a body. ``axle`` pushes the body; ``load`` comes from the body."""

    axle: Flange = port(Flange)
    load: Input = signal_input("N", "Load on the axle")
    curvature: Input = signal_input("1/m", "Curvature of the path, positive to the left", default=0.0)
    brake: Input = signal_input("1", "Brake demand, 0 to 1", default=0.0)

    def _bend(self, wheels: Wheel) -> Equations:
        """Wheels that are one bear the side force of a bend."""
        yield wheels.side.value == self.curvature.value * wheels.v**2 / G_N

    def lumped(self) -> Axle:
        """The axle on a straight road without slip: its wheels as one that does not slip."""
        raise ModelError(
            f"{type(self).__name__} does not define lumped(): maps of operating points and the backward calculation take an axle whose "
            "wheels do not slip, such as a LumpedAxle, in its place"
        )


class PoweredAxle(Axle):
    """Partial: an axle that a shaft drives at its ``pinion``."""

    pinion: Shaft = port(Shaft)


class RollingAxle(Axle):
    """An axle that is not driven. Its two wheels are one, with the inertia of both.

    In a bend it follows the middle of the axle and bears the side force load curvature v^2/g.
    """

    brakes: WheelBrake = WheelBrake(tau_max=1500)
    wheels: Wheel = RigidWheel(J=2.0)

    def equations(self) -> Equations:
        """Brakes, wheels, road."""
        yield connect(self.brakes.flange_b, self.wheels.hub)
        yield connect(self.wheels.road, self.axle)
        yield connect(self.load, self.wheels.load)
        yield connect(self.brake, self.brakes.demand)
        yield from self._bend(self.wheels)

    def initial(self) -> Equations:
        """The wheels roll."""
        yield _rolls(self.wheels)

    def lumped(self) -> RollingAxle:
        """The axle with wheels that do not slip."""
        return RollingAxle(brakes=self.brakes, wheels=_as_one(self.wheels))


class LumpedAxle(PoweredAxle):
    """A driven axle whose two wheels are one, with the inertia of both.

    On a straight road with equal ground the two wheels turn at the same speed. A differential between them then turns as a block and loses
    nothing, whatever its kind. In a bend the mean wheel speed is that of the middle of the axle, as with a differential without friction.
    The wheels bear the side force load curvature v^2/g. The larger circle of a steered axle is not included, so in a bend nothing turns
    between two lumped axles.
    If the differential matters, in bends and on uneven ground, use a ``DrivenAxle``.
    """

    final_drive: TwoFlanges = CrownGear(ratio=3.9, eta_ab=0.95, eta_ba=0.95)
    brakes: WheelBrake = WheelBrake(tau_max=3000)
    wheels: Wheel = RigidWheel(J=2.0)

    def equations(self) -> Equations:
        """Final drive, brakes, wheels, road."""
        yield connect(self.pinion, self.final_drive.flange_a)
        yield connect(self.final_drive.flange_b, self.brakes.flange_a)
        yield connect(self.brakes.flange_b, self.wheels.hub)
        yield connect(self.wheels.road, self.axle)
        yield connect(self.load, self.wheels.load)
        yield connect(self.brake, self.brakes.demand)
        yield from self._bend(self.wheels)

    def initial(self) -> Equations:
        """The wheels roll."""
        yield _rolls(self.wheels)

    def lumped(self) -> LumpedAxle:
        """The axle with wheels that do not slip."""
        return LumpedAxle(final_drive=self.final_drive, brakes=self.brakes, wheels=_as_one(self.wheels))


class DrivenAxle(PoweredAxle):
    """Final drive, differential, elastic half shafts, brakes and two wheels, each on its own path and with its own load.

    The differential and the wheels are slots.
    """

    path: AxlePath = AxlePath()
    left: Wheel = MagicFormulaWheel()
    right: Wheel = MagicFormulaWheel()
    left_brake: WheelBrake = WheelBrake(tau_max=1500)
    right_brake: WheelBrake = WheelBrake(tau_max=1500)
    left_shaft: SpringDamper = ElasticShaft(c=1e4, d=30)
    right_shaft: SpringDamper = ElasticShaft(c=1e4, d=30)
    differential: Differential = BevelDifferential(eta=0.97)
    cage: Inertia = Inertia(J=0.1)
    final_drive: TwoFlanges = CrownGear(ratio=3.9, eta_ab=0.95, eta_ba=0.95)

    def equations(self) -> Equations:
        """Both sides alike."""
        yield connect(self.pinion, self.final_drive.flange_a)
        yield connect(self.final_drive.flange_b, self.cage.flange_a)
        yield connect(self.cage.flange_b, self.differential.crown)
        for side in ("left", "right"):
            shaft, brake = getattr(self, f"{side}_shaft"), getattr(self, f"{side}_brake")
            wheel: Wheel = getattr(self, side)
            yield connect(getattr(self.differential, side), shaft.flange_a)
            yield connect(shaft.flange_b, brake.flange_a)
            yield connect(brake.flange_b, wheel.hub)
            yield connect(wheel.road, getattr(self.path, side))
            yield connect(wheel.load, getattr(self.path, f"{side}_load"))
        yield connect(self.path.side, self.left.side, self.right.side)
        yield connect(self.path.axle, self.axle)
        yield connect(self.load, self.path.load)
        yield connect(self.curvature, self.path.curvature)
        yield connect(self.brake, self.left_brake.demand, self.right_brake.demand)

    def initial(self) -> Equations:
        """The wheels roll, the cage turns with them, and the half shafts are not twisted."""
        yield _rolls(self.left)
        yield _rolls(self.right)
        yield self.cage.w == (self.left.w + self.right.w) / 2
        yield self.left_shaft.phi_rel == 0
        yield self.right_shaft.phi_rel == 0

    def lumped(self) -> LumpedAxle:
        """Its two wheels as one that does not slip. Errors: ParameterError for wheels with different radii."""
        brakes = WheelBrake(tau_max=float(self.left_brake.tau_max) + float(self.right_brake.tau_max))
        return LumpedAxle(final_drive=self.final_drive, brakes=brakes, wheels=_as_one(self.left, self.right))
