"""The paths of the wheels in a bend, and the slope along a road."""

from __future__ import annotations

from typing import Self

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import (
    Component,
    Equations,
    Input,
    Map,
    Output,
    Parameter,
    ParameterError,
    Symbol,
    Variable,
    arguments_checked,
    der,
    parameter,
    port,
    signal_input,
    signal_output,
    variable,
    within,
)
from powertrain.components.body.body import G_N
from powertrain.components.thermal import Lossy
from powertrain.components.translational import Flange

Array = NDArray[np.float64]
EASED = 0.25
"""Share of the distance between two points, at either end, over which the slope changes."""
ROUND = 1e-12
"""Slopes that differ by less are equal."""
STEEPEST = 1.0
"""Largest grade of a road, in both directions: steeper than any, and exceeded by percentages passed as fractions."""
TIGHTEST = 0.99
"""Largest share of the radius of a bend that half of the track takes: the inner wheel rolls forward, too."""
HALVINGS = 60
"""Bisections of the range of angles, -90 to 90 degrees, down to round-off."""


class AxlePath(Lossy):
    """An axle in a bend: its two wheels run on circles whose radii differ by the track.

    v_left = root((1 - apart)^2 + (curvature ahead)^2) v,  v_right = root((1 + apart)^2 + (curvature ahead)^2) v,  apart = curvature track/2
    axle.f v + left.f v_left + right.f v_right = lossPower = slip_angle load side^2 |v|,  side = curvature v^2/g
    left_load = load/2 - transfer,  right_load = load/2 + transfer,  transfer = roll load side h/track

    Positive curvature bends to the left. It is that of the path of the unsteered axle, where the speed is v. All wheels run on circles
    about one centre (Ackermann's condition); those of an axle ``ahead`` of the unsteered one are steered and run on larger circles. The
    forces follow from the power balance. A centre of the bend between the wheels ends the simulation.
    ``h`` is the height of the axle's share of the mass, which transfers load in a bend; with 0 the load is shared equally. ``roll`` is the
    axle's share of the roll stiffness divided by its share of the load: a stiffer axle takes more of the car's load transfer, and the other
    one less, so the products of ``roll`` and load of both axles must add up to the weight. The axle bears the side force of the mass load/g
    (g = 9.80665 m/s2); load that driving or braking transfers to it counts as mass, so that all wheels of a vehicle have the same ``side``.
    The side force requires a slip angle of ``slip_angle`` side, which causes drag; 0.05 to 0.1 rad are usual. The wheels share it by their
    loads; they receive ``side``. Wheels that do not slip require a curvature that changes smoothly in time.
    Source: B. Madhavan, M.S. thesis, University of Maryland 1996, App. A: with 88 rad/s in the middle, radius 7 m and track 1.4 m the
    wheels turn at 96.8 rad/s and 79.2 rad/s.
    """

    track: Parameter = parameter("m", "Distance of the wheels", default=1.5, above=0)
    ahead: Parameter = parameter("m", "Distance ahead of the axle that is not steered", default=0.0, min=0)
    h: Parameter = parameter("m", "Height of the mass for the transfer of load in a bend", default=0.55, min=0)
    roll: Parameter = parameter("1", "Share of the roll stiffness over the share of the load", default=1.0, min=0)
    slip_angle: Parameter = parameter("rad", "Slip angle of the tyres over side force over load", default=0.0, min=0)
    axle: Flange = port(Flange)
    left: Flange = port(Flange)
    right: Flange = port(Flange)
    curvature: Input = signal_input("1/m", "Curvature of the path, positive to the left", default=0.0)
    load: Input = signal_input("N", "Load on the axle", default=0.0)
    left_load: Output = signal_output("N", "Load on the left wheel")
    right_load: Output = signal_output("N", "Load on the right wheel")
    side: Output = signal_output("1", "Side force over load of both wheels")
    v: Variable = variable("m/s", "Speed of the middle of the axle that is not steered")

    def equations(self) -> Equations:
        """Kinematics of a rigid body on a circle, power balance, and moments about the road."""
        apart, tightest = self.curvature.value * self.track / 2, 2 * TIGHTEST / self.track
        within(self.curvature.value, -tightest, tightest, name="curvature of the path", unit="1/m")
        left, right = (ca.sqrt((1 + side) ** 2 + (self.curvature.value * self.ahead) ** 2) for side in (-apart, apart))
        yield self.v == der(self.axle.s)
        yield der(self.left.s) == left * self.v
        yield der(self.right.s) == right * self.v
        yield self.axle.f + left * self.left.f + right * self.right.f == self._drag()
        transfer = self.roll * self.load.value / G_N * self.curvature.value * self.v**2 * self.h / self.track
        yield self.left_load.value == self.load.value / 2 - transfer
        yield self.right_load.value == self.load.value / 2 + transfer
        yield self.side.value == self.curvature.value * self.v**2 / G_N
        yield from self._dissipate()

    def _drag(self) -> Symbol:
        bent = self.curvature.value * self.v / G_N
        return self.slip_angle * self.load.value * bent**2 * self.v * ca.fabs(self.v)

    def loss(self) -> Symbol:
        """Drag of the side force times speed."""
        return self._drag() * self.v


class RoadProfile(Component):
    """The slope and the bends of a road along its length: grade = profile(s),  bend = bends(s) + curvature.

    ``profile`` is a map with one argument, the path in m, to tan(alpha); ``from_heights`` makes one from heights. ``bends`` is a map of the
    path to the curvature in 1/m, positive to the left.
    Errors: ParameterError for a map with other arguments or another unit, and for grades above 100 %.
    """

    profile: Map = Map.constant(0.0, x="s", x_unit="m", name="grade")
    bends: Map = Map.constant(0.0, x="s", x_unit="m", unit="1/m", name="curvature")
    s: Input = signal_input("m", "Path of the vehicle")
    grade: Output = signal_output("1", "Slope of the road, tan(alpha), positive uphill")
    curvature: Input = signal_input("1/m", "Curvature of the path in addition to the bends of the road", default=0.0)
    bend: Output = signal_output("1/m", "Curvature of the path, positive to the left")

    def equations(self) -> Equations:
        """The maps."""
        for name, unit, wanted in (
            ("profile", "1", "the slope tan(alpha) [1]; RoadProfile.from_heights takes heights"),
            ("bends", "1/m", "the curvature in 1/m, one over the radius"),
        ):
            given: Map = getattr(self, name)
            if len(given.axes) != 1:
                names = ", ".join(axis.name for axis in given.axes)
                raise ParameterError(f"{self._label}.{name} takes one argument, the path s; this map takes {names}")
            if given.unit != unit:
                raise ParameterError(f"{self._label}.{name} gives {given.name} [{given.unit}]; it must give {wanted}")
        steepest = float(self.profile.values.flat[np.abs(self.profile.values).argmax()])
        if abs(steepest) > STEEPEST:
            raise ParameterError(
                f"{self._label}.profile has a grade of {steepest:g}, {steepest:.0%}; no road is steeper than {STEEPEST:.0%}. Grades are "
                "the tangent of the slope, 0.06 for 6 %"
            )
        yield self.grade.value == self.profile(self.s.value)
        yield self.bend.value == self.bends(self.s.value) + self.curvature.value

    @classmethod
    @arguments_checked
    def from_heights(cls, s: ArrayLike, heights: ArrayLike) -> Self:
        """A road through the given heights [m] at places s [m] along it, without crests or dips between them.

        dz/ds = sin(alpha) is continuous. Between two places the slope is constant, except for the first and the last ``EASED`` share of the
        distance, where it changes linearly with s. At a place it is the harmonic mean of the slopes of the straight lines on both sides, or
        zero if these have opposite signs. Before the first and after the last place the slope is constant. Errors: ParameterError for
        places that do not increase, or heights that change by more than the length of the road.
        """
        places, z = np.asarray(s, float).ravel(), np.asarray(heights, float).ravel()
        if places.size != z.size or places.size < 2:
            raise ParameterError(f"a road needs as many heights as places, at least two: {z.size} and {places.size}")
        steps, rises = np.diff(places), np.diff(z)
        if not (steps > 0).all():
            k = int(np.argmin(steps > 0))
            raise ParameterError(
                f"a road needs places that increase: s = {places[k]:g} m is followed by {places[k + 1]:g} m"
            )
        if not np.isfinite(z).all():
            k = int(np.argmin(np.isfinite(z)))
            raise ParameterError(f"a road needs finite heights: at s = {places[k]:g} m it is {z[k]:g} m")
        if np.any(steep := np.abs(rises) >= steps):
            i = int(np.argmax(steep))
            raise ParameterError(
                f"the road cannot rise by {rises[i]:g} m from s = {places[i]:g} m to {places[i + 1]:g} m, over {steps[i]:g} m of its length"
            )
        at, slopes = _eased(places, rises / steps)
        if np.ptp(slopes) < ROUND:
            return cls(profile=Map.constant(float(slopes[0]), x="s", x_unit="m", name="grade"))
        return cls(profile=Map.curve(at, slopes, x="s", x_unit="m", name="grade", outside="clip"))


def _eased(places: Array, sines: Array) -> tuple[Array, Array]:
    """Places [m] and slopes tan(alpha) of a polygon whose heights rise with the mean ``sines`` between ``places``."""
    straight = sines / np.sqrt(1 - sines**2)
    before, after = straight[:-1], straight[1:]
    alike = before * after > 0
    inner = np.where(alike, 2 * before * after / np.where(alike, before + after, 1), 0)
    ends = np.concatenate([straight[:1], inner, straight[-1:]])
    between = _plateau(ends[:-1], ends[1:], sines)
    ease = EASED * np.diff(places)
    rows = np.stack([places[:-1], places[:-1] + ease, places[1:] - ease], axis=1)
    values = np.stack([ends[:-1], between, between], axis=1)
    return np.append(rows.ravel(), places[-1]), np.append(values.ravel(), ends[-1])


def _plateau(first: Array, last: Array, sines: Array) -> Array:
    """The constant slope p that, with slopes at both ends, gives the mean sine.

    A slope that changes linearly from q to p rises with the mean sine (p + q)/(root(1 + p^2) + root(1 + q^2)). The sum grows with p, which
    is found by bisection.
    """

    def rise(p: Array) -> Array:
        def eased(q: Array) -> Array:
            return np.asarray((p + q) / (np.sqrt(1 + p**2) + np.sqrt(1 + q**2)))

        return EASED * (eased(first) + eased(last)) + (1 - 2 * EASED) * p / np.sqrt(1 + p**2)

    low, high = np.full(sines.shape, -np.pi / 2), np.full(sines.shape, np.pi / 2)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        below = rise(np.tan(middle)) < sines
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.asarray(np.tan((low + high) / 2))
