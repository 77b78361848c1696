"""Differentials of every kind, for the axles of cars."""

from __future__ import annotations

from powertrain.components.differentials import BevelDifferential, Differential, LimitedSlipDifferential
from powertrain.components.gearless.circular_cam import CircularCamDifferential
from powertrain.components.gearless.linkage import JointFriction, LinkageDifferential
from powertrain.components.gearless.spherical_cam import SphericalCamDifferential

JOINTS = JointFriction(mu_shaft=0.1, mu_pin=0.1, mu_ball=0.1, mu_rod=0.1)
KINDS: dict[str, Differential] = {
    "bevel": BevelDifferential(eta=0.97),
    "limited slip": LimitedSlipDifferential(preload=20, bias_drive=2.5, bias_coast=1.5),
    "cam": CircularCamDifferential(),
    "locking cam": CircularCamDifferential(mu=0.2),
    "spherical cam": SphericalCamDifferential(),
    "linkage": LinkageDifferential.of(joints=JOINTS),
}
