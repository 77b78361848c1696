"""The mass of a vehicle with its trailers, and the resistance of its body on a level road."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import powertrain as pt
from powertrain.components.body import Body
from powertrain.components.translational import Accelerate, ConstantSpeed
from powertrain.components.vehicle import Vehicle
from powertrain.language.reals import Array
from powertrain.trials.anatomy import anatomy, parts_of, value_at

MOVING = 10.0
"""Speed [m/s] at which the mass of a body is measured, because friction would hold it at rest."""
EQUAL = 1e-6
"""Relative difference of masses that is round-off."""


class _Pulled(pt.Component):
    """A body that is pulled over a level road at a given speed."""

    body: Body
    pull: ConstantSpeed = ConstantSpeed(v_fixed=1)

    def equations(self) -> pt.Equations:
        """Pulled at the front; the rear axle exerts no force."""
        yield pt.connect(self.pull.flange, self.body.front)


def resistance(body: Body, v: Array) -> Array:
    """The force to pull a body at v; zero at rest, where its friction could hold any force up to its limit."""
    speeds, rows = np.unique(v, return_inverse=True)
    moves, taken = speeds > 0, np.zeros_like(speeds)
    if moves.any():
        pulled = pt.steady(_Pulled(body=body), {"pull.v_fixed": speeds[moves]}, outputs=["pull.flange.f"])
        taken[moves] = -pulled["pull.flange.f"].values
    return taken[rows]


class _Accelerated(pt.Component):
    """A body that is accelerated over a level road."""

    body: Body
    pull: Accelerate = Accelerate()
    a: pt.Input = pt.signal_input("m/s2", "Acceleration")

    def equations(self) -> pt.Equations:
        """Accelerated at the front."""
        yield pt.connect(self.a, self.pull.a_ref)
        yield pt.connect(self.pull.flange, self.body.front)


def mass(vehicle: pt.Component) -> float:
    """The mass [kg] of the body and of the trailers, without the inertia of wheels.

    Errors: ParameterError for a body that moves like another mass than its parameter ``m``, and for a trailer that is a ``Vehicle``.
    """
    parts = anatomy(vehicle)
    for other in parts_of(vehicle, Vehicle):
        raise pt.ParameterError(
            f"{parts.vehicle}.{other} is a Vehicle, whose mass the forces of {parts.the('body')} do not include; use a Trailer"
        )
    bodies = [value_at(vehicle, parts.the("body")), *(value_at(vehicle, path).body for path in parts.trailers)]
    for body in bodies:
        check_mass(body)
    return sum(float(body.m) for body in bodies)


@lru_cache(maxsize=32)
def check_mass(body: Body) -> None:
    """ParameterError for a body that moves like another mass than its parameter ``m``, with which maps and road loads are computed."""
    plant = pt.compile(_Accelerated(body=body))
    still, pulled = (plant.start(inputs={"a": a}, starts={"pull.v": MOVING})["pull.flange.f"] for a in (0.0, 1.0))
    mass, said = still - pulled, float(body.m)
    if abs(mass - said) > EQUAL * said:
        raise pt.ParameterError(
            f"{type(body).__name__} moves like a mass of {mass:.6g} kg, but its parameter m is {said:.6g} kg; if a part of it has the "
            "mass, write  yield self.part.m == self.m  in its equations, and give m"
        )
