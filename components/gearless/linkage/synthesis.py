"""Type synthesis of 1:-1 couplings: the generator, which lists every mechanism of a given structure (Madhavan 1996, ch. 3).

A coupling turns its two coaxial shafts at opposite speeds while its cage is at rest; with the cage turning it is a differential. Here it
is only a graph: links are vertices, joints are edges (Figs. 3.4, 3.5). The chain 1-2-...-lever-...-l-1 leads from the cage (1) through the
input link (2) to the lever, and on to the output link (l) and back; the middle joint closes it into two loops.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, product

from powertrain import ParameterError


@dataclass(frozen=True)
class Joint:
    """A kinematic pair with its rotational and sliding freedoms; ``along`` are those about and along its own axis.

    ``sliding``: the thesis counts the pair as a slider (P and C; a ball in a cylinder also slides but is not counted).
    ``surface``: its links are in surface contact, as in lower pairs.
    """

    name: str
    turns: int
    slides: int
    along: int
    sliding: bool = False
    surface: bool = True

    @property
    def freedom(self) -> int:
        """f, the degrees of freedom it permits."""
        return self.turns + self.slides

    def __str__(self) -> str:
        return self.name


R = Joint("R", turns=1, slides=0, along=1)
P = Joint("P", turns=0, slides=1, along=1, sliding=True)
C = Joint("C", turns=1, slides=1, along=2, sliding=True)
S = Joint("S", turns=3, slides=0, along=1)
E = Joint("E", turns=1, slides=2, along=1, sliding=True)
Bc = Joint("Bc", turns=3, slides=1, along=2, surface=False)
G = Joint("G", turns=1, slides=1, along=1, surface=False)
"""Revolute, prismatic, cylindrical, spherical and plane pair, ball in cylinder; two teeth that roll and slide in a plane or on a sphere."""


def middle_problem(joint: Joint) -> str | None:
    """Why a joint cannot carry the lever of a linkage on the cage (p. 19); None if it can.

    The outputs are opposite because one half is the other after a half-turn about the middle joint's axis (the thesis calls it a mirror
    image). The only motions of the lever that keep this symmetry are rotations about that axis and slides along it. With only one of them
    the lever oscillates between two ends; there each half is at a dead point, from which the output may move either way. With both, its
    ends move round on a cylinder.
    """
    if joint.freedom > joint.along:
        return f"{joint}: the lever could leave the symmetry, {joint.freedom - joint.along} of its freedoms are not of the axis"
    if joint.freedom < 2:
        return f"{joint}: a lever with one freedom has two dead points"
    return None


@dataclass(frozen=True)
class Coupling:
    """A mechanism of two loops: the joints from the cage to the lever on the input's and on the output's side, and the middle joint."""

    input_side: tuple[Joint, ...]
    middle: Joint
    output_side: tuple[Joint, ...]
    mobility: int = 6

    @property
    def name(self) -> str:
        """The joints along the chain, as RRSCSRR."""
        return "".join(map(str, (*self.input_side, self.middle, *reversed(self.output_side))))

    @property
    def lever(self) -> int:
        """Number of the ternary middle link."""
        return len(self.input_side) + 1

    @property
    def links(self) -> int:
        """l, with the cage."""
        return len(self.input_side) + len(self.output_side)

    @property
    def edges(self) -> tuple[tuple[int, int, Joint], ...]:
        """The graph: (link, link, joint)."""
        chain = (*self.input_side, *reversed(self.output_side))
        around = [*range(1, self.links + 1), 1]
        ring = list(zip(around[:-1], around[1:], chain, strict=True))
        return (*ring[: self.lever - 1], (self.lever, 1, self.middle), *ring[self.lever - 1 :])

    @property
    def symmetric(self) -> bool:
        """Both sides have the same joints in the same order."""
        return self.input_side == self.output_side

    @property
    def loops(self) -> int:
        """Independent loops j - l + 1."""
        return len(self.edges) - self.links + 1

    @property
    def freedom(self) -> int:
        """F = lambda (l - j - 1) + sum of f (eq. 3.1), which ignores the symmetry: 0 for overconstrained couplings that move."""
        return freedom(self.links, [joint for *_, joint in self.edges], self.mobility)

    def on_link(self, link: int) -> list[Joint]:
        """The joints of a link."""
        return [joint for one, other, joint in self.edges if link in (one, other)]

    def __str__(self) -> str:
        return self.name


def freedom(links: int, joints: list[Joint] | tuple[Joint, ...], mobility: int = 6) -> int:
    """F = lambda (l - j - 1) + sum of f, eq. (3.1)."""
    return mobility * (links - len(joints) - 1) + sum(joint.freedom for joint in joints)


def idle(side: tuple[Joint, ...]) -> int:
    """Links that spin between two joints with full rotational freedom and move nothing else: freedoms that F counts but no one uses."""
    return sum(one.turns == other.turns == 3 for one, other in pairwise(side))


@dataclass(frozen=True)
class CouplingStructure:
    """The mechanisms to list: the structure specifications (3.2.1). The defaults are those of the thesis.

    Both ternary links (cage and lever) share the middle joint; the two loops through it have ``loop_freedom`` each. ``joints`` are allowed
    between shaft and lever, ``ground`` carries the shafts, ``middle`` the lever (None: those of ``joints`` that can, by
    ``middle_problem``). ``mobility``: lambda, 6 in space, 3 in a plane or on a sphere. ``symmetric``: both sides are equal; otherwise
    nothing makes the speeds opposite. Errors: ParameterError if no mechanism can have the structure.
    """

    joints: tuple[Joint, ...] = (R, P, S, C, Bc)
    ground: tuple[Joint, ...] = (R,)
    middle: tuple[Joint, ...] | None = None
    max_joints: int = 7
    mobility: int = 6
    loop_freedom: int = 1
    symmetric: bool = True

    def __post_init__(self) -> None:
        if not 2 <= self.mobility <= 6:
            raise ParameterError(
                f"mobility = {self.mobility}: bodies have 6 freedoms in space, 3 in a plane or on a sphere"
            )
        if self.loop_freedom < 1:
            raise ParameterError(f"loop_freedom = {self.loop_freedom}: a movable loop has at least 1")
        if self.max_joints < 5:
            raise ParameterError(
                f"max_joints = {self.max_joints}: two loops with an input link, a lever and an output link have 5"
            )
        if not (self.joints and self.ground):
            raise ParameterError("joints and ground need at least one kind of joint")
        if not self.in_the_middle:
            reasons = "; ".join(filter(None, map(middle_problem, self.joints)))
            raise ParameterError(f"no joint can be the middle one ({reasons})")

    @property
    def in_the_middle(self) -> tuple[Joint, ...]:
        """The joints that may carry the lever on the cage."""
        if self.middle is not None:
            return self.middle
        return tuple(joint for joint in self.joints if middle_problem(joint) is None)

    def generate(self) -> list[Coupling]:
        """Every mechanism of the structure, those with few joints first."""
        found = [coupling for middle in self.in_the_middle for coupling in self._with(middle)]
        return sorted(found, key=lambda coupling: len(coupling.edges))

    def _with(self, middle: Joint) -> Iterator[Coupling]:
        longest = self.max_joints - 1 - (0 if self.symmetric else 2)
        sides = list(self._sides(middle, longest // 2 if self.symmetric else longest))
        for k, side in enumerate(sides):
            for other in [side] if self.symmetric else sides[k:]:
                if len(side) + 1 + len(other) <= self.max_joints:
                    yield Coupling(side, middle, other, self.mobility)

    def _sides(self, middle: Joint, longest: int) -> Iterator[tuple[Joint, ...]]:
        """The joints from cage to lever of one loop with the required freedom; l = j in a loop (eqs. 3.2, 3.3)."""
        for between in range(1, longest):
            for side in product(self.ground, *[self.joints] * between):
                loop = (*side, middle)
                if freedom(len(loop), loop, self.mobility) - idle(side) == self.loop_freedom:
                    yield side
