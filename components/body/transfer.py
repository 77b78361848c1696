"""Transfer cases: how the front and the rear axle share the transmission's output."""

from __future__ import annotations

from powertrain import Component, Equations, Parameter, connect, der, parameter, port
from powertrain.components.body.elastic_shaft import ElasticShaft
from powertrain.components.differentials import Differential, LimitedSlipDifferential
from powertrain.components.rotational import Flange, SpringDamper


class TransferCase(Component):
    """Partial: a shaft that drives the front axle, the rear axle or both."""

    input: Flange = port(Flange)
    front: Flange = port(Flange)
    rear: Flange = port(Flange)

    def lumped(self) -> TransferCase:
        """The transfer case on a straight road without slip, where friction between the axles rests."""
        return self


class RigidTransferCase(TransferCase):
    """One shaft for all three flanges.

    With one driven axle this is the drive shaft itself; with two it is a part-time four-wheel drive, whose axles turn at the same speed.
    In a bend the front wheels run on larger circles, and the driveline winds up as far as the tyres slip: the rear axle pushes against the
    front axle, which brakes. That needs a ``DrivenAxle`` at both ends; the wheels of a ``LumpedAxle`` do not steer.
    """

    def equations(self) -> Equations:
        """A shaft."""
        yield connect(self.input, self.front, self.rear)


class CentreDifferential(TransferCase):
    """A centre differential with two elastic propeller shafts.

    ``differential`` accepts any ``Differential``: its left side drives the front axle, its right side the rear axle. The default is an
    open differential with an efficiency of 0.97 and a no-load friction of bearings and washers of 2 N.m, an estimate.
    """

    front_shaft: SpringDamper = ElasticShaft(c=1e4, d=10)
    rear_shaft: SpringDamper = ElasticShaft(c=1e4, d=10)
    # Without no-load friction, the differential slips and sticks whenever the axles vibrate while the clutch is open.
    differential: Differential = LimitedSlipDifferential(preload=2, bias_drive=1 / 0.97, bias_coast=1 / 0.97)

    def equations(self) -> Equations:
        """Both sides alike."""
        yield connect(self.input, self.differential.crown)
        yield connect(self.differential.left, self.front_shaft.flange_a)
        yield connect(self.differential.right, self.rear_shaft.flange_a)
        yield connect(self.front_shaft.flange_b, self.front)
        yield connect(self.rear_shaft.flange_b, self.rear)

    def lumped(self) -> LumpedCentreDifferential:
        """Without friction and with rigid shafts: friction at rest between the axles would leave the torque split undetermined."""
        return LumpedCentreDifferential(share=float(self.differential.share))

    def initial(self) -> Equations:
        """The input turns with the axles, and the shafts to them are not twisted."""
        share = self.differential.share
        yield der(self.input.phi) == der(share * self.front.phi + (1 - share) * self.rear.phi)
        yield self.front_shaft.phi_rel == 0
        yield self.rear_shaft.phi_rel == 0


class LumpedCentreDifferential(TransferCase):
    """A centre differential without friction, whose shafts are rigid, for maps.

    w_input = share w_front + (1 - share) w_rear,  front.tau = -share input.tau,  rear.tau = -(1 - share) input.tau
    """

    share: Parameter = parameter("1", "Part of the torque that the front axle takes", default=0.5, min=0, max=1)

    def equations(self) -> Equations:
        """A lever without loss."""
        yield self.input.phi == self.share * self.front.phi + (1 - self.share) * self.rear.phi
        yield self.front.tau == -self.share * self.input.tau
        yield self.rear.tau == -(1 - self.share) * self.input.tau
