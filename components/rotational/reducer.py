"""High-ratio drives without backlash but with torsion: harmonic and cycloidal drives."""

from __future__ import annotations

import math
from typing import Self

from powertrain import Equations, ParameterError, arguments_checked, connect, support
from powertrain.components.rotational.gear import LossyGear
from powertrain.components.rotational.interfaces import TwoFlangesAndSupport
from powertrain.components.rotational.stiffening_spring import Segments, StiffeningSpring
from powertrain.components.thermal import HeatPort

ROUNDING = 1e-9
"""Relative difference up to which torques are equal."""
TYPICAL = 1.2
"""Typical back-driving torque of harmonic drives relative to ratio times starting torque, from manufacturers' tables."""


class _Reducer(TwoFlangesAndSupport):
    """Partial: a lossy mesh at the fast shaft flange_a and the torsion of the slow one, flange_b."""

    mesh: LossyGear
    windup: StiffeningSpring
    heat_port: HeatPort = support(HeatPort)

    def equations(self) -> Equations:
        """Mesh and spring in series."""
        yield connect(self.flange_a, self.mesh.flange_a)
        yield connect(self.mesh.flange_b, self.windup.flange_a)
        yield connect(self.windup.flange_b, self.flange_b)
        yield connect(self.mesh.support, self.support)
        yield connect(self.heat_port, self.mesh.heat_port, self.windup.heat_port)

    @classmethod
    def _of(
        cls,
        ratio: float,
        efficiencies: tuple[float, float],
        frictions: tuple[float, float | None],
        spring: StiffeningSpring,
    ) -> Self:
        """Both frictions are no-load torques: if the fast shaft drives, only ``eta`` of its torque passes the mesh."""
        eta, back = efficiencies
        starting, given = frictions
        if not (0 < eta <= 1 and 0 < back <= 1):
            raise ParameterError(f"{cls.__name__}: efficiency = {eta:g} and back = {back:g} must be in (0, 1]")
        for what, torque in (("starting", starting), ("backdriving", given)):
            if torque is not None and not 0 <= torque < math.inf:
                raise ParameterError(f"{cls.__name__}: {what} = {torque:g} N.m must be zero or positive, and finite")
        backdriving = ratio * starting * min(TYPICAL, 1 / back) if given is None else given
        least, most = back * backdriving / ratio, backdriving / ratio / eta
        if not least * (1 - ROUNDING) <= starting <= most * (1 + ROUNDING):
            raise ParameterError(
                f"{cls.__name__}: starting = {starting:g} N.m contradicts backdriving = {backdriving:g} N.m, ratio {ratio:g}, "
                f"efficiency = {eta:g} and back = {back:g}: it must lie between back backdriving/ratio = {least:.4g} N.m and "
                f"backdriving/(ratio efficiency) = {most:.4g} N.m"
            )
        row = 0.0, eta, back, eta * starting, backdriving / ratio
        return cls(mesh=LossyGear(ratio=-ratio, lossTable=(row,)), windup=spring)


class HarmonicDrive(_Reducer):
    """A strain-wave gear: wave generator (flange_a), flexspline (flange_b) and circular spline (support).

    w_a - w_s = -N (w_b' - w_s),  N = Z_flex/(Z_circular - Z_flex);  flange_b follows b' through the spring ``windup``

    With the circular spline at rest the flexspline turns backward at 1/N; with the flexspline held, the circular spline turns forward at
    1/(N + 1). ``mesh`` has efficiencies and friction for either direction of power, as ``LossyGear``; ``windup`` is the torsion at the
    output with the wave generator blocked, in segments of stiffness as in catalogues. There is no backlash; hysteresis of the torsion
    and the transmission error are not modelled. ``of`` accepts catalogue values. Connect the wave generator's inertia to
    flange_a. Source: Harmonic Drive SE, Engineering Data, 2014, sec. 4.2.

    >>> drive = HarmonicDrive.of(200, 202)
    >>> float(drive.mesh.ratio)
    -100.0
    """

    mesh: LossyGear = LossyGear(ratio=-100.0, lossTable=((0.0, 0.80, 0.70, 0.08, 0.12),))
    windup: StiffeningSpring = StiffeningSpring(stiffness=((0.0, 6.7e4), (29.0, 1.1e5), (108.0, 1.2e5)))

    @classmethod
    @arguments_checked
    def of(
        cls,
        flexspline: int,
        circular: int,
        *,
        efficiency: float = 0.80,
        back: float = 0.70,
        starting: float = 0.10,
        backdriving: float | None = None,
        stiffness: Segments = ((0.0, 6.7e4), (29.0, 1.1e5), (108.0, 1.2e5)),
        d: float = 50.0,
    ) -> Self:
        """From teeth and catalogue values.

        Parameters
        ----------
        flexspline, circular : int
            Teeth of the flexspline and of the circular spline.
        efficiency, back : float
            Efficiency if the wave generator drives, and if the flexspline drives [1].
        starting : float
            No-load starting torque at the wave generator [N.m].
        backdriving : float, optional
            No-load back-driving torque at the flexspline [N.m]; by default 1.2 ratio starting, but at most ratio starting/back.
        stiffness : tuple of tuple of float
            Rows (torque from which it applies [N.m], stiffness [N.m/rad]).
        d : float
            Damping of the wind-up [N.m.s/rad].

        Raises
        ------
        ParameterError
            If the circular spline does not have more teeth than the flexspline, for efficiencies outside (0, 1], and for no-load torques
            that one mesh cannot have: ``starting`` must be from back backdriving/ratio to backdriving/(ratio efficiency).
        """
        if not 0 < flexspline < circular:
            raise ParameterError(
                f"{cls.__name__}.of: a circular spline of {circular} teeth does not fit round a flexspline of {flexspline}; it needs more "
                "teeth, usually two"
            )
        spring = StiffeningSpring(stiffness=stiffness, d=d)
        return cls._of(flexspline / (circular - flexspline), (efficiency, back), (starting, backdriving), spring)


class CycloidalDrive(_Reducer):
    """A cycloidal drive: eccentric input shaft (flange_a), output by the disc's angle (flange_b), ring of pins (support).

    w_a - w_s = -N (w_b' - w_s),  N = lobes/(pins - lobes);  flange_b follows b' through the spring ``windup``

    A disc with one lobe fewer than there are pins turns backward by one lobe per turn of the eccentric. ``mesh`` and ``windup`` are those
    of ``HarmonicDrive``, from the manufacturer's catalogue; the default values are typical.

    >>> float(CycloidalDrive.of(lobes=29, pins=30).mesh.ratio)
    -29.0
    """

    mesh: LossyGear = LossyGear(ratio=-29.0, lossTable=((0.0, 0.92, 0.90, 0.138, 0.167),))
    windup: StiffeningSpring = StiffeningSpring(stiffness=((0.0, 5e4), (15.0, 2e5)))

    @classmethod
    @arguments_checked
    def of(
        cls,
        lobes: int,
        pins: int,
        *,
        efficiency: float = 0.92,
        back: float = 0.90,
        starting: float = 0.15,
        backdriving: float | None = None,
        stiffness: Segments = ((0.0, 5e4), (15.0, 2e5)),
        d: float = 50.0,
    ) -> Self:
        """From lobes, pins and catalogue values.

        Parameters
        ----------
        lobes, pins : int
            Lobes of the disc, and pins of the ring.
        efficiency, back : float
            Efficiency if the eccentric drives, and if the output drives [1].
        starting : float
            No-load starting torque at the eccentric [N.m].
        backdriving : float, optional
            No-load back-driving torque at the output [N.m]; by default as for ``HarmonicDrive.of``.
        stiffness : tuple of tuple of float
            Rows (torque from which it applies [N.m], stiffness [N.m/rad]).
        d : float
            Damping of the wind-up [N.m.s/rad].

        Raises
        ------
        ParameterError
            Unless there are more pins than lobes, and for efficiencies and no-load torques as ``HarmonicDrive.of``.
        """
        if not 0 < lobes < pins:
            raise ParameterError(
                f"{cls.__name__}.of: a disc of {lobes} lobes does not turn in {pins} pins; it needs more pins than lobes"
            )
        spring = StiffeningSpring(stiffness=stiffness, d=d)
        return cls._of(lobes / (pins - lobes), (efficiency, back), (starting, backdriving), spring)
