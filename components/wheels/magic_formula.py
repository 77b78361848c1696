"""The longitudinal Magic Formula tyre, in a form that is also valid at standstill."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Self

import casadi as ca

from powertrain import Equations, Parameter, Symbol, Variable, der, parameter, variable
from powertrain.components.wheels.slip import SLOW, SlippingWheel
from powertrain.components.wheels.tyre_file import parameters as parameters_of_file

STEPS = 2
"""Iterations for the inverse of the shape: sufficient for 1e-10 in the range of pEx1 and pCx1."""
SMALL = 1e-6
"""Share of the peak force below which force is proportional to slip; also the least friction coefficient of a road."""


def shape(x: Symbol, E: Symbol) -> Symbol:
    """The argument of the formula's arctangent: x - E (x - atan x)."""
    return x - E * (x - ca.atan(x))


def inverse_shape(t: Symbol, E: Symbol) -> Symbol:
    """The x with x - E (x - atan x) = t for t >= 0, by a fixed number of steps of Householder's method of fourth order.

    An arctangent takes much longer than the terms that raise the order. The start is the root with x/(1 + 2x/pi) in place of atan x, which
    has the same limits for small and for large x.
    """
    close = 1 - 2 / math.pi * t
    x = 2 * t / (close + ca.sqrt(close**2 + 8 / math.pi * (1 - E) * t))
    for _ in range(STEPS):
        x = ca.fmax(x, 0)  # a new term: a step corrects the round-off of those before it
        flat = 1 / (1 + x**2)
        miss = shape(x, E) - t
        slope = 1 - E + E * flat
        bend, twist = -E * x * flat**2, E * flat**2 * (1 - 4 / 3 * flat)  # derivatives over 2! and 3!
        x = x - miss * (slope**2 - miss * bend) / (slope**3 - 2 * miss * slope * bend + miss**2 * twist)
    return x


class MagicFormulaWheel(SlippingWheel):
    """A wheel with a Magic Formula tyre: the force rises with slip to a peak and falls beyond it.

    steady: f = D sin(C atan(B kappa - E (B kappa - atan(B kappa)))),  kappa = v_slip/|v|
    C = pCx1,  E = pEx1,  D = mu (pDx1 + pDx2 dfz) Fz,  B C D = K = (pKx1 + pKx2 dfz) exp(pKx3 dfz) Fz,  dfz = Fz/Fz0 - 1

    Up to the peak the tyre creeps at the slip for its force on the formula's rising branch: v_creep = |v| kappa(f). It slides if f
    reaches the limit of friction, which is the formula at the slip kappa_c, but at least at the peak:
    sigma_c der(kappa_c) = v_c - max(|v|, v_low - |v_c|) kappa_c,  v_c = v_creep + v_slide,  v_low = 3 m/s

    So kappa_c approaches v_c/|v|, the formula's slip; less if the wheel neither rolls nor slides faster than walking pace. Friction
    therefore falls with the sliding speed, and a locked wheel that comes to rest regains its full grip.
    The tyre's spring c makes the force follow slip over the relaxation length K/c. The contact load follows the wheel's in the time T:
    T der(Fz) = fn - Fz. Deflection is stored energy, c u^2/2; the secant of the rising branch is taken at the spring's force, so
    no loss is negative in transients; the load does no work. Both branches exist for 1 < C <= 2 and E < 1. With larger C, as for aligning
    torques (2.4), the force would reverse at large slip: its angle tends to C pi/2. At E = 1 the angle ends at C atan(pi/2), which for
    C < 1.56 is below the peak's pi/2.

    Sources: H. B. Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, ch. 4 (names, formula without shifts), ch. 7 (carcass spring and
    contact patch). The defaults are typical values for a car tyre, not a measured tyre.
    """

    pCx1: Parameter = parameter(
        "1",
        "Shape factor C; up to 1 the force has no peak, above 2 it reverses at large slip",
        default=1.65,
        above=1,
        max=2,
    )
    pDx1: Parameter = parameter("1", "Friction coefficient at Fz0", default=1.0, above=0)
    pDx2: Parameter = parameter("1", "Change of the friction coefficient with dfz", default=0.0)
    pEx1: Parameter = parameter(
        "1",
        "Curvature factor E; towards 1 the peak moves to infinite slip, if C < 1.56",
        default=-0.5,
        min=-20,
        max=0.99,
    )
    pKx1: Parameter = parameter("1", "Slip stiffness over load at Fz0", default=20.0, above=0)
    pKx2: Parameter = parameter("1", "Change of the slip stiffness over load with dfz", default=0.0)
    pKx3: Parameter = parameter("1", "Exponent of the slip stiffness with dfz", default=0.0)
    Fz0: Parameter = parameter("N", "Nominal load of the coefficients", default=4000.0, above=0)
    c: Parameter = parameter("N/m", "Stiffness of the tyre along the road", default=2.5e5, above=0)
    sigma_c: Parameter = parameter("m", "Relaxation length of the contact in sliding", default=0.1, above=0)
    T: Parameter = parameter("s", "Time constant of the contact for changes of load", default=0.02, above=0)
    Fz: Variable = variable("N", "Load on the contact")
    kappa_c: Variable = variable("1", "Slip of the contact", start=0.0, nominal=0.1)

    @classmethod
    def from_tir(cls, path: str | Path, **parameters: Any) -> Self:
        """A wheel with the tyre of a tyre property file (.tir) of MF-Tyre 5.2 to 6.2, at nominal pressure and without camber.

        The coefficients are multiplied by their scaling factors: Fz0 = FNOMIN LFZO, pCx1 = PCX1 LCX, pDx = PDX LMUX, pKx = PKX LKX, and
        pEx1 = PEX1 LEX, the curvature at nominal load. The shifts PHX and PVX are neglected. c is LONGITUDINAL_STIFFNESS, or the slip
        stiffness over the relaxation length PTX1 LSGKP UNLOADED_RADIUS LFZO at nominal load; Cr = abs(QSY1) LMY. The radius is that of
        slow free rolling,

        radius = Q_RE0 UNLOADED_RADIUS - Fz0/VERTICAL_STIFFNESS (DREFF atan(BREFF) + FREFF)

        Its growth with the speed (Q_V1) is neglected, as is that of the rolling resistance (QSY3, QSY4).

        Parameters
        ----------
        path : str or Path
            The file, in metres, newtons, kg and seconds.
        **parameters
            Other parameters of the wheel, such as ``J``: the inertia in the file is that of the tyre without its rim. They take precedence
            over those in the file.

        Returns
        -------
        MagicFormulaWheel

        Raises
        ------
        ParameterError
            For files with another layout or other units, missing coefficients, and values outside the parameters' ranges.

        Examples
        --------
        >>> from powertrain.components.wheels import MagicFormulaWheel
        >>> wheel = MagicFormulaWheel.from_tir("205_55_R16.tir", J=1.1)  # doctest: +SKIP
        """
        cls._check_names(parameters)
        return cls(**parameters_of_file(path, parameters), **parameters)

    def equations(self) -> Equations:
        """Creep on the rising branch, sliding on the other."""
        load = ca.fmax(self.Fz, SMALL * self.Fz0)  # the formula must be defined for a wheel off the ground
        dfz = load / self.Fz0 - 1
        stiffness = ca.fmax(self.pKx1 + self.pKx2 * dfz, SMALL) * ca.exp(self.pKx3 * dfz) * load
        peak = ca.fmax(self.mu, SMALL) * ca.fmax(self.pDx1 + self.pDx2 * dfz, SMALL) * load
        # The rising branch, solved for the slip at the spring's force: B kappa = x.
        part = ca.fmin(ca.fmax(ca.fabs(self.c * self.u) / peak, SMALL), 1 - SMALL)
        x = inverse_shape(ca.tan(ca.asin(part) / self.pCx1), self.pEx1)
        B = stiffness / (self.pCx1 * peak)
        # The limit of sliding: the formula at kappa_c beyond its peak, at an angle of 90 degrees.
        angle = self.pCx1 * ca.atan(shape(B * ca.fabs(self.kappa_c), self.pEx1))
        limit = peak * ca.sin(ca.fmax(angle, math.pi / 2))
        yield from self._slip(self.c, x / (B * part * peak), limit / load, load)
        self._count_beyond(limit / load)
        # The slip of the contact, v_c/|v| at a steady speed.
        sliding = self.v_creep + self.v_slide
        rolling = ca.fmax(ca.fabs(self.v), SLOW - ca.fabs(sliding))
        yield self.sigma_c * der(self.kappa_c) == sliding - rolling * self.kappa_c
        yield self.T * der(self.Fz) == self.fn - self.Fz

    def initial(self) -> Equations:
        """The contact carries the wheel's load."""
        yield self.Fz == self.fn

    def energy(self) -> Symbol:
        """Kinetic energy and the tyre's deflection."""
        return self.J * self.w**2 / 2 + self.c * self.u**2 / 2

    def loss(self) -> Symbol:
        """Rolling, damping, creep and sliding."""
        return self._loss()
