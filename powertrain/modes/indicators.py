"""Event indicators of the laws: positive while a law keeps its mode, with a hysteresis far above the accuracy of event location."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from powertrain.dae import contact, friction, switch, when
from powertrain.dae.hybrid import Contact, Friction, Guard, HybridDae, Switch, When
from powertrain.dae.tolerances import EPS
from powertrain.modes import guards


@dataclass(frozen=True)
class Indicator:
    """An expression that falls through zero when ``law`` must change its mode; ``known`` is its uncertainty."""

    law: Friction | Switch | Contact | When | Guard
    value: ca.SX
    known: ca.SX | float

    @property
    def scaled(self) -> ca.SX:
        """The value scaled so that its uncertainty is EPS: a torque cannot be located more precisely than its own round-off."""
        return self.value * (EPS / self.known)

    @property
    def noise(self) -> ca.SX:
        """Round-off of the value. The uncertainty of a prescribed speed is an error of the states instead, which a step does not add."""
        return ca.SX(0.0 if isinstance(self.law, Friction) and self.law.prescribed else self.known)


def indicators(dae: HybridDae) -> tuple[Indicator, ...]:
    """All indicators that are located as state events; conditions with a known instant are time events."""
    return (
        *(Indicator(law, *margin) for law in dae.frictions for margin in friction.watched(dae, law)),
        *(Indicator(law, *switch.watched(dae, law)) for law in switch.located(dae)),
        *(Indicator(law, *margin) for law in dae.contacts for margin in contact.watched(dae, law)),
        *(Indicator(law, *margin) for law in dae.whens for margin in when.watched(dae, law)),
        *(Indicator(law, *margin) for law in dae.guards for margin in guards.watched(law)),
    )
