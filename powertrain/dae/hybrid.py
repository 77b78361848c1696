"""The reduced hybrid DAE: the result of compilation, used by initialisation, simulation and every analysis.

    der(x) = xdot(t, x, z, m, p)
    0      = residual(t, x, z, m, p)

``x`` are the differential states, ``z`` the algebraic unknowns that remain implicit, ``p`` the parameters and ``m`` the held values (modes
of the laws, discrete variables, segments of schedules), which change only at events. Every expression is a scalar or column ``casadi.SX``
of these five symbols; linear systems are already eliminated, for any given modes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.dae.tolerances import EPS, LEAST_TORQUE, ZONE
from powertrain.language.recorder import Guard as Guard

START, JUMPED = 1.0, 2.0
"""Speeds may be new since modes were found: at a start, which must not need an impact; by an event, which may cause one."""


@dataclass(frozen=True)
class Friction:
    """w > 0: torque = upper; w < 0: torque = lower; w = 0: stuck, torque in [peak*lower, peak*upper] so that rate = 0.

    ``prescribed``: no torque of this law ever moves it; ``acts``: other motions nevertheless depend on that torque.
    ``limitless``: modes in which its own torque has no limit, so it cannot move in that direction.
    ``known``: uncertainty of its torque, see ``powertrain.dae.tolerances``; ``rounding``: the part of it due to rounding of angles and
    positions; ``reach``: G_ii.
    ``rests``: if other laws take part in its motion, m[rests] is 1 while it is at a limit and they hold it at rest;
    ``share`` is then the torque that its compliance would give it, at least its limit; None if that is not known.
    """

    name: str
    where: str
    index: int
    w: ca.SX
    torque: ca.SX
    lower: ca.SX
    upper: ca.SX
    peak: ca.SX
    rate: ca.SX
    unit: str = "N.m"
    algebraic: bool = False
    prescribed: bool = False
    acts: bool = False
    limitless: tuple[float, ...] = ()
    may_free: bool = True
    known: ca.SX = field(default_factory=lambda: ca.SX(LEAST_TORQUE))
    rounding: ca.SX = field(default_factory=lambda: ca.SX(0))
    reach: ca.SX = field(default_factory=lambda: ca.SX(1))
    rests: int | None = None
    share: ca.SX | None = None

    @property
    def hysteresis(self) -> ca.SX:
        """Uncertainty of its torque at the present states."""
        return self.known + self.rounding


@dataclass(frozen=True)
class Switch:
    """m[index] is 1 while g > 0 and 0 otherwise; ``time`` is the instant of the change if g is affine in time.

    ``known`` is the uncertainty of g.
    """

    name: str
    where: str
    index: int
    g: ca.SX
    time: ca.SX | None = None
    continuous: bool = False
    known: ca.SX = field(default_factory=lambda: ca.SX(EPS))


@dataclass(frozen=True)
class Contact:
    """gap >= 0, force >= 0, one of them zero; speed and acceleration are the derivatives of gap.

    ``still`` is the uncertainty of the acceleration, ``known`` that of the force, to which round-off of positions adds ``rounding``.
    """

    name: str
    where: str
    index: int
    gap: ca.SX
    speed: ca.SX
    acceleration: ca.SX
    force: ca.SX
    restitution: ca.SX
    still: ca.SX = field(default_factory=lambda: ca.SX(0))
    known: ca.SX = field(default_factory=lambda: ca.SX(LEAST_TORQUE))
    rounding: ca.SX = field(default_factory=lambda: ca.SX(0))

    @property
    def hysteresis(self) -> ca.SX:
        """Uncertainty of the force at the present states."""
        return self.known + self.rounding


@dataclass(frozen=True)
class Barrier:
    """An obstacle at which an impulse stops the motion: a contact, or a friction law in a direction without a torque limit.

    ``speed`` is that of the law times ``way``; impulses keep it from falling below zero. An impulse is that of the law's torque or force
    times ``sense``: a contact's force opens its gap, a friction torque opposes its speed. ``rests``: whether it is at the barrier already.
    m[index] is ``held`` while the barrier holds, and ``left`` while the motion leads away from it.
    """

    name: str
    where: str
    index: int
    way: float
    sense: float
    speed: ca.SX
    rests: ca.SX
    restitution: ca.SX
    held: float
    left: float


@dataclass(frozen=True)
class Reset:
    """Assign ``value`` to x[index] (``discrete`` False) or to m[index] (``discrete`` True)."""

    discrete: bool
    index: int
    value: ca.SX
    unit: str = "1"


@dataclass(frozen=True)
class When:
    """When g becomes positive, apply the resets; m[index] holds whether g was positive.

    ``relations``: the indices of the modes that make up g, if several comparisons are combined. ``initially``: a g that is positive at the
    start of a run triggers the resets there.
    """

    name: str
    where: str
    index: int
    g: ca.SX
    resets: tuple[Reset, ...]
    time: ca.SX | None = None
    relations: tuple[int, ...] = ()
    initially: bool = False


Law = Friction | Switch | Contact
"""The laws whose modes are found together."""


@dataclass(frozen=True)
class TimeSignal:
    """A piecewise linear time signal; m[index:index+3] = (t0, y0, slope) of the current segment.

    ``turns``: its derivative is part of a motion of a law, or of a variable that must not jump, so that a corner is a jump of that.
    """

    name: str
    index: int
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    turns: bool = False


@dataclass(frozen=True)
class Smooth:
    """A variable given by signals whose derivative appears in the equations: a jump of its ``value`` would be an impulse."""

    names: str
    unit: str
    value: ca.SX


@dataclass(frozen=True)
class Opened:
    """The model for given torques ``tau`` of its laws, friction first, then contacts; in (t, x, z, m, p, tau).

    ``residual`` are the model's own equations, for the first entries of ``z``; the other entries are torques. ``speed`` and ``rate`` are
    those of the laws. The torque against the motion, tau for friction and -force for a contact, lies between ``lower`` and ``upper``, times
    ``peak`` while the law is stuck. ``reach`` is the effect of the torque on the law's own rate. ``compliance`` is relative to
    ``COMPLIANCE``. ``conditions`` are those of the switches.
    """

    tau: ca.SX
    xdot: ca.SX
    residual: ca.SX
    speed: ca.SX
    rate: ca.SX
    lower: ca.SX
    upper: ca.SX
    peak: ca.SX
    reach: ca.SX
    compliance: ca.SX
    conditions: ca.SX


@dataclass(frozen=True)
class OperatingPoint:
    """Time, states, implicit unknowns, held values (including the modes) and parameters: values of the arguments of every expression."""

    t: float
    x: NDArray[np.float64]
    z: NDArray[np.float64]
    m: NDArray[np.float64]
    p: NDArray[np.float64]

    def __iter__(self) -> Iterator[float | NDArray[np.float64]]:
        return iter((self.t, self.x, self.z, self.m, self.p))


class FrictionValues(NamedTuple):
    """Speeds, torques and limits of all friction laws at one point; the limits of a stuck law are ``peak`` times these."""

    w: NDArray[np.float64]
    torque: NDArray[np.float64]
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    peak: NDArray[np.float64]


@dataclass(frozen=True)
class HybridDae:
    """The symbols, the equations and the laws of one compiled model.

    ``opened`` is the model for given torques of the laws. ``impact_x`` and ``impact_a`` are the responses of the states and of the
    barriers' speeds to their impulses. ``residual_places`` are the source lines of the residuals. ``smooth`` variables must not jump,
    ``relative`` states may: the model contains no derivative of them, but of a smooth variable that they determine with held values.
    ``nominal`` are the nominal sizes of x and z, the scale of their absolute tolerance. ``relations`` are the comparisons
    combined in the conditions of ``whens``; nothing else depends on their modes.
    """

    t: ca.SX
    x: ca.SX
    z: ca.SX
    m: ca.SX
    p: ca.SX
    xdot: ca.SX
    residual: ca.SX
    state_names: tuple[str, ...]
    held_start: NDArray[np.float64]
    frictions: tuple[Friction, ...] = ()
    switches: tuple[Switch, ...] = ()
    contacts: tuple[Contact, ...] = ()
    whens: tuple[When, ...] = ()
    relations: tuple[Switch, ...] = ()
    schedules: tuple[TimeSignal, ...] = ()
    guards: tuple[Guard, ...] = ()
    opened: Opened | None = None
    residual_places: tuple[str, ...] = ()
    smooth: tuple[Smooth, ...] = ()
    relative: tuple[int, ...] = ()
    nominal: tuple[float, ...] = ()
    impact_x: ca.SX = field(default_factory=lambda: ca.SX(0, 0))
    impact_a: ca.SX = field(default_factory=lambda: ca.SX(0, 0))

    @property
    def arguments(self) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX]:
        """The arguments of every expression."""
        return self.t, self.x, self.z, self.m, self.p

    def function(self, name: str, *outputs: ca.SX) -> ca.Function:
        """Expressions as one function of the arguments; its results are dense matrices."""
        return ca.Function(f"powertrain_{name}", self.arguments, [ca.densify(e) for e in outputs])

    @cached_property
    def friction_values(self) -> ca.Function:
        """The fields of ``FrictionValues`` as a function of the arguments."""
        fields = ([getattr(law, name) for law in self.frictions] for name in FrictionValues._fields)
        return self.function("frictions", *(ca.vertcat(*values) for values in fields))

    @property
    def sizes(self) -> NDArray[np.float64]:
        """The nominal sizes of (x, z)."""
        return np.array(self.nominal or np.ones(self.x.numel() + self.z.numel()))

    @property
    def laws(self) -> tuple[Law, ...]:
        """Friction laws, switches and contacts."""
        return *self.frictions, *self.switches, *self.contacts

    @property
    def free_held(self) -> list[int]:
        """The places of the held values that are no modes of friction laws or contacts: an event may give them any value at once."""
        modes = {i for law in self.frictions for i in (law.index, law.rests)} | {law.index for law in self.contacts}
        return [i for i in range(self.m.numel()) if i not in modes]

    @property
    def motions(self) -> ca.SX:
        """The speeds of friction laws, and the gaps of contacts with their speeds."""
        return ca.vertcat(
            *(law.w for law in self.frictions), *(e for law in self.contacts for e in (law.gap, law.speed))
        )

    def may_jump(self, motions: ca.SX) -> bool:
        """Whether motions of laws depend on held values other than modes of laws."""
        held = ca.vertcat(*(self.m[i] for i in self.free_held))
        return bool(held.numel() and motions.numel() and ca.depends_on(motions, held))

    @property
    def counted(self) -> dict[str, ca.SX]:
        """Whether values are outside limits beyond which steps are only counted, by name, with the component where several have one name.

        A step outside several limits of one name counts once.
        """
        guards, found = [guard for guard in self.guards if guard.action == "count"], dict[str, ca.SX]()
        names = Counter(guard.name for guard in guards)
        for g in guards:
            name = g.name if names[g.name] == 1 else f"{g.name} ({str(g.where).partition(':')[0]})"
            found[name] = ca.logic_or(found.get(name, ca.SX(0)), ca.logic_or(g.value < g.low, g.value > g.high))
        return found

    @property
    def barriers(self) -> tuple[Barrier, ...]:
        """Contacts first, then one-way friction laws; empty if no speed can jump.

        A law that acts on no inertia, or has a prescribed speed, takes part in no impulse.
        """
        resets = any(not reset.discrete for when in self.whens for reset in when.resets)
        if not (
            self.contacts or resets or self.relative or self.may_jump(ca.vertcat(*(law.w for law in self.frictions)))
        ):
            return ()
        laws = [law for law in self.frictions if not (law.algebraic or law.prescribed)]
        contacts = (_contact_barrier(self.m, contact) for contact in self.contacts)
        return (*contacts, *(_one_way_barrier(self.m, law, -blocked) for law in laws for blocked in law.limitless))

    def equation(self, k: int) -> str:
        """The source line of the k-th algebraic equation, for messages."""
        return self.residual_places[k] if k < len(self.residual_places) else f"equation {k + 1} of {self.z.numel()}"


def _contact_barrier(m: ca.SX, contact: Contact) -> Barrier:
    """A contact; if it is closed, it is at the barrier."""
    c = contact
    return Barrier(c.name, c.where, c.index, 1.0, 1.0, c.speed, m[c.index], c.restitution, held=1.0, left=0.0)


def _one_way_barrier(m: ca.SX, law: Friction, way: float) -> Barrier:
    """A friction law that can move in one direction only, without rebound."""
    rests = ca.logic_or(m[law.index] == 0, ca.fabs(law.w) <= ZONE)
    return Barrier(law.name, law.where, law.index, way, -way, way * law.w, rests, ca.SX(0), held=0.0, left=way)
