"""The lengths of the linkage: guidelines of the source (ch. 6, 7.3), and the optimisation proposed in its 7.2."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize

from powertrain import ParameterError, arguments_checked
from powertrain.components.gearless.linkage.curve import in_bend
from powertrain.components.gearless.linkage.forces import Drive, reactions
from powertrain.components.gearless.linkage.kinematics import Linkage, ratio_from_theta
from powertrain.components.gearless.linkage.masses import TABLE_5_1, LinkMasses, scaled
from powertrain.components.gearless.linkage.shaking import shaking

Array = NDArray[np.float64]
Objective = Literal["shaking_force", "shaking_moment", "ball_force", "rod_force", "rod_moment"]
Weigh = Callable[[Linkage], LinkMasses]
"""Masses of the links by their lengths."""


@dataclass(frozen=True)
class DifferentialDuty:
    """The duty of a differential: cage speed [rad/s] and acceleration [rad/s2], bend and track [m], torque on the crown wheel [N.m].

    The defaults are the source's: 88 rad/s, 7 m, 1.4 m, and the torque 18 kW/(88 rad/s) = 204.5 N.m rounded to 200 N.m.
    """

    w: float = 88.0
    radius: float = 7.0
    track: float = 1.4
    torque: float = 200.0
    dw: float = 0.0

    def __post_init__(self) -> None:
        """Checks the values; ``in_bend`` checks the bend."""
        for name, unit in ("w", "rad/s"), ("torque", "N.m"), ("dw", "rad/s2"):
            value = getattr(self, name)
            if not np.isfinite(value):
                raise ParameterError(f"DifferentialDuty: {name} = {value:g} {unit} must be finite")
        in_bend(self.w, self.radius, self.track)

    @classmethod
    @arguments_checked
    def cruising(cls, power: float, w: float, radius: float = 7.0, track: float = 1.4) -> DifferentialDuty:
        """From the power at a cage speed (5.46) [W], unrounded."""
        if not w > 0:
            raise ParameterError(f"the cage speed w = {w:g} rad/s must be positive")
        return cls(w, radius, track, power / w)

    def accelerating(self, acceleration: float, mass: float, wheel_radius: float) -> DifferentialDuty:
        """The same while the vehicle accelerates [m/s2]: torque + mass r acceleration, dw = acceleration/r. 7.2 leaves this case open."""
        if not (mass >= 0 and wheel_radius > 0):
            raise ParameterError(
                f"mass = {mass:g} kg must be zero or positive, wheel_radius = {wheel_radius:g} m must be positive"
            )
        return replace(self, torque=self.torque + mass * wheel_radius * acceleration, dw=acceleration / wheel_radius)

    def drive(self, alpha: ArrayLike) -> Drive:
        """The states of motion in this bend at the angles ``alpha``, all at the speed w."""
        u = in_bend(1.0, self.radius, self.track).differential
        return Drive.at(alpha, u=u * self.w, w=self.w, du=u * self.dw, dw=self.dw)


class Peaks(NamedTuple):
    """Maxima over an internal cycle: shaking force [N], moment [N.m], S-pair and C-pair force [N], C-pair moment [N.m].

    Axial forces follow the convention N_left = N_right (see ``forces``), without prestress.
    """

    shaking_force: float
    shaking_moment: float
    ball_force: float
    rod_force: float
    rod_moment: float


def over_cycle(
    linkage: Linkage, masses: LinkMasses = TABLE_5_1, duty: DifferentialDuty | None = None, points: int = 73
) -> dict[Objective, Array]:
    """The quantities of ``Peaks`` at angles from 0 to 2 pi; S-pairs (2, points): left and right."""
    duty = duty or DifferentialDuty()
    drive = duty.drive(np.linspace(0, 2 * np.pi, points))
    shaken, forces = shaking(linkage, drive, masses), reactions(linkage, drive, masses, crown=duty.torque)
    balls = np.stack([forces.S_left, forces.S_right])
    vectors = (*shaken, balls, forces.C_force, forces.C_moment)
    return {name: np.linalg.norm(v, axis=-1) for name, v in zip(get_args(Objective), vectors, strict=True)}


def peaks(
    linkage: Linkage, masses: LinkMasses = TABLE_5_1, duty: DifferentialDuty | None = None, points: int = 73
) -> Peaks:
    """Peaks over one cycle of ``duty`` (default: that of the source), with inertia forces and torque."""
    return Peaks(*(float(v.max()) for v in over_cycle(linkage, masses, duty, points).values()))


def ball_force(linkage: Linkage, torque: float) -> float:
    """Maximum static force in the S-pairs for ``torque`` on each output [N]: |torque|/(a cos beta) at the maximum |beta| (7.1)."""
    return _load(torque) / (linkage.a * float(np.cos(np.abs(linkage.beta_range).max())))


def rod_force(linkage: Linkage, torque: float) -> float:
    """Maximum static force in the C-pair for ``torque`` on each output [N]: that of 2 |torque cos alpha|/(a cos beta) over alpha.

    It is at alpha = 0, or where y = cos(alpha)^2 is a root of a^2 y^2 - (a^2 + d^2 - b^2) y + 3 d^2/4, d = b - offset: there the derivative
    vanishes. Without offset this needs a/b > sqrt(3).
    """
    a, b, d = linkage.a, linkage.b, linkage.d
    roots = np.roots([a**2, b**2 - a**2 - d**2, 0.75 * d**2])
    inside = roots.real[(roots.imag == 0) & (roots.real > 0) & (roots.real < 1)]
    loop = linkage.loop(np.arccos(np.sqrt([1.0, *inside])))
    return 2 * _load(torque) / a * float((loop.c / loop.cos_beta).max())


def _load(torque: float) -> float:
    if not np.isfinite(torque):
        raise ParameterError(f"torque = {torque:g} N.m must be finite")
    return abs(torque)


def guided(theta_max: float = np.pi / 6, a_max: float = 0.03) -> Linkage:
    """The source's choice: a/b from the maximum angle of the lever (6.1), a limited by its slide (6.3): 3 cm and 5.8 cm."""
    return Linkage(a_max, a_max / ratio_from_theta(theta_max))


def alternate(linkage: Linkage) -> Linkage:
    """The same lengths with the C axis moved so that the couplers swing by equal angles to both sides (7.3).

    d = b - a sin(beta_1) with beta = -beta_1 at alpha = 0 and +beta_1 at 90 degrees: 3 a sin(beta_1)^2 - 4 b sin(beta_1) + a = 0.
    The S-pairs' force falls by cos(beta_1)/cos(beta_max), the C-pair's rises by 1/cos(beta_1), at alpha = 0.
    """
    a, b = linkage.a, linkage.b
    if 3 * a**2 > 4 * b**2:
        raise ParameterError(
            f"alternate: a/b = {a / b:g} is above 2/sqrt(3) = {2 / np.sqrt(3):g}: no position of the C axis makes the swing symmetric"
        )
    return Linkage(a, b, a * float(a / (2 * b + np.sqrt(4 * b**2 - 3 * a**2))))


def over_length(
    lengths: ArrayLike, ratio: float | None = None, duty: DifferentialDuty | None = None
) -> dict[str, Array]:
    """Peaks over the coupler's length at one a/b (by default that of 30 degrees): Figs. 6.2, 6.3, and additionally the shaking."""
    ratio = ratio_from_theta(np.pi / 6) if ratio is None else ratio
    designs = [Linkage(float(a), float(a) / ratio) for a in np.ravel(lengths)]
    found = np.array([peaks(design, scaled(design), duty) for design in designs])
    return {"a": np.ravel(lengths), **dict(zip(Peaks._fields, found.T, strict=True))}


@dataclass(frozen=True)
class Front:
    """Pareto-optimal designs for two objectives, with their peaks, in ascending order of the first objective."""

    objectives: tuple[Objective, Objective]
    designs: tuple[Linkage, ...]
    peaks: tuple[Peaks, ...]

    def values(self, name: Objective) -> Array:
        """One of the peaks along the front."""
        return np.array([getattr(one, name) for one in self.peaks])


@dataclass(frozen=True)
class Space:
    """The search space: bounds of a and b [m], of offset over a, and of the lever's angle [rad] (source: at most 30 to 40 degrees)."""

    a: tuple[float, float] = (0.015, 0.06)
    b: tuple[float, float] = (0.02, 0.15)
    shift: tuple[float, float] = (0.0, 0.3)
    theta_max: float = float(np.radians(40))

    def __post_init__(self) -> None:
        """Checks the bounds."""
        for name in "a", "b", "shift":
            low, high = getattr(self, name)
            if not (low <= high and (name == "shift" or low > 0)):
                raise ParameterError(f"space: {name} = ({low:g}, {high:g}) are not valid bounds")
        if not 0 < self.theta_max < np.pi:
            raise ParameterError(f"space: theta_max = {self.theta_max:g} rad is outside (0, pi) rad")

    def linkage(self, x: Array) -> Linkage:
        """From the unknowns of the search: a and b in cm, offset over a."""
        return Linkage(x[0] / 100, x[1] / 100, x[2] * x[0] / 100)


class _Search:
    """Minimises the peak of one quantity with a limit on the peak of another.

    Peaks have kinks where the position of the maximum changes. Therefore the peak is a separate unknown t, an upper bound for every point
    of the cycle (SLSQP). Unknowns: a, b [cm], offset over a, t.
    """

    def __init__(
        self, objectives: tuple[Objective, Objective], duty: DifferentialDuty, space: Space, masses: Weigh
    ) -> None:
        self.objectives, self.duty, self.space, self.masses = objectives, duty, space, masses
        self.start = np.array([100 * np.mean(space.a), 70 * space.b[1], np.mean(space.shift)])
        low, high = np.array([space.a, space.b, space.shift]).T * np.array([[100, 100, 1]]).repeat(2, 0)
        self.bounds: Any = [*zip(low, high, strict=True), (0.0, 100.0)]
        self._last: tuple[bytes, dict[Objective, Array]] | None = None

    def curves(self, x: Array) -> dict[Objective, Array]:
        """The quantities over the cycle; the last result is kept, because constraints request it repeatedly."""
        key = x[:3].tobytes()
        if self._last is None or self._last[0] != key:
            linkage = self.space.linkage(x)
            self._last = key, over_cycle(linkage, self.masses(linkage), self.duty, 33)
        return self._last[1]

    def solve(self, name: Objective, x: Array, limited: Objective | None = None, limit: float = 1.0) -> Array | None:
        """The design, or None if there is none."""
        scale = float(self.curves(x)[name].max())

        def inside(x: Array) -> Array:
            curves = self.curves(x)
            rows = [x[3] - curves[name].ravel() / scale, [self.space.theta_max - self.space.linkage(x).theta_max]]
            return np.concatenate([*rows, 1 - curves[limited].ravel() / limit] if limited else rows)

        options: Any = {"ftol": 1e-10, "eps": 1e-7, "maxiter": 200}
        start: Any = np.append(x[:3], 1.0)
        constraints: Any = {"type": "ineq", "fun": inside}
        search: Any = minimize
        found = search(
            lambda x: x[3], start, method="SLSQP", bounds=self.bounds, constraints=constraints, options=options
        )
        return np.asarray(found.x, float) if inside(found.x).min() > -1e-6 else None


def pareto(
    objectives: tuple[Objective, Objective] = ("shaking_force", "ball_force"),
    *,
    duty: DifferentialDuty | None = None,
    space: Space | None = None,
    masses: Weigh = scaled,
    points: int = 12,
) -> Front:
    """Lengths with the best trade-off between two peaks (7.2: shaking against forces in the joints).

    Every point minimises the first objective with a limit on the second (epsilon constraint), with the lever's angle within ``space``.
    ``masses``: link masses as a function of the lengths, by default steel cylinders. Errors: ParameterError for unknown objectives, or if
    nothing is found; single points for which the search fails are omitted.
    """
    known = get_args(Objective)
    if len(set(objectives)) != 2 or any(name not in known for name in objectives):
        raise ParameterError(f"objectives = {objectives!r} must be two different names from {', '.join(known)}")
    search = _Search(objectives, duty or DifferentialDuty(), space or Space(), masses)
    first, second = objectives
    x, last = (search.solve(name, search.start) for name in objectives)
    if x is None or last is None:
        raise ParameterError("pareto: the ends of the Pareto front were not found; widen the space")
    found = [x]
    high, low = (float(search.curves(end)[second].max()) for end in (x, last))
    for limit in np.geomspace(high, low * (1 + 1e-6), points)[1:]:
        tried = search.solve(first, x, second, float(limit))
        if tried is not None:
            x = tried
            found.append(x)
    designs = [search.space.linkage(x) for x in found]
    measured = [peaks(design, masses(design), duty) for design in designs]
    keep = [i for i, one in enumerate(measured) if not any(_better(other, one, objectives) for other in measured)]
    return Front(objectives, tuple(designs[i] for i in keep), tuple(measured[i] for i in keep))


def _better(one: Peaks, other: Peaks, objectives: tuple[Objective, Objective]) -> bool:
    """Better in one and no worse in the other."""
    pairs = [(getattr(one, name), getattr(other, name)) for name in objectives]
    return all(a <= b for a, b in pairs) and any(a < b for a, b in pairs)
