"""Networks of planetary gears around a variable unit: six types, ranges, two-mode transmissions, in one description.

Theory: H. L. Benford, M. B. Leising, The lever analogy: a new tool in transmission analysis, SAE 810102, 1981.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import ParameterError, arguments_checked
from powertrain.components.transmissions.layout import Coupling, Layout, members

Array = NDArray[np.float64]
Joint = tuple[str, str]
HOUSING = "housing"
"""The shaft at rest."""
_SINGULAR = 1e-12


@arguments_checked
@dataclass(frozen=True)
class Lever:
    """Three shafts whose speeds lie on a line: w_a - w_carrier = ratio (w_b - w_carrier), with loss by latent power.

    A planetary gear has ratio < 0 (sun at a, ring at b: ratio = -Z_ring/Z_sun). With the carrier at the housing it is a gear pair with
    ratio = w_a/w_b. ``eta`` is the efficiency with the carrier fixed, in both directions (``MeshLaw``).
    """

    name: str
    a: str
    b: str
    carrier: str
    ratio: float
    eta: float = 1.0

    def __post_init__(self) -> None:
        planetary = self.carrier != HOUSING
        if self.ratio == 0 or (planetary and self.ratio == 1) or not np.isfinite(self.ratio):
            raise ParameterError(f"lever {self.name}: a gear cannot have the ratio {self.ratio:g}")
        if not 0 < self.eta <= 1:
            raise ParameterError(f"lever {self.name}: eta = {self.eta:g} must be in (0, 1]")
        if len({self.a, self.b, self.carrier}) < 3:
            raise ParameterError(
                f"lever {self.name}: its members {self.a}, {self.b}, {self.carrier} are not three shafts"
            )


@dataclass(frozen=True)
class Network:
    """Levers, a variable unit between two shafts, and joined shafts: a split-path transmission in one of its ranges.

    Shafts are names; ``HOUSING`` is at rest. Shafts in a ``joint`` turn together, by a clutch, or by a brake with the housing; another
    range is the same network with other joints (``range``). Every lever is one equation between its shafts' speeds. With two degrees of
    freedom the speeds of ``input`` and ``output`` determine all others, w_x = A_x w_in + B_x w_out for every shaft x; a shaft is
    at rest at its *mechanical point* r = w_out/w_in = -A_x/B_x. With one degree of freedom the network is a gear with a fixed ratio.
    The input or the output may be at the unit alone. Errors: ParameterError if nothing else is at the unit's, the input's or the
    output's shaft.
    """

    levers: tuple[Lever, ...]
    unit: tuple[str, str]
    joints: tuple[Joint, ...] = ()
    input: str = "in"
    output: str = "out"

    def __post_init__(self) -> None:
        known = self.shafts
        for what, name in (
            ("unit", self.unit[0]),
            ("unit", self.unit[1]),
            ("input", self.input),
            ("output", self.output),
        ):
            if name not in known:
                raise ParameterError(
                    f"the {what} is at the shaft {name!r}, where nothing else is; the other shafts are {', '.join(known)}"
                )

    @classmethod
    @arguments_checked
    def split_path(cls, layout: Layout, coupling: Coupling, R_o: float, eta: float = 1.0) -> Self:
        """One of the six layouts of Yu & Beachley 1986, input- or output-coupled, without the loss of its variable unit.

        The unit's shaft a is on the side of the input, so K > 0 is power towards the output in both couplings; V = w_b/w_a of
        the output-coupled one is the inverse of the paper's.

        Parameters
        ----------
        layout : str
            The layout.
        coupling : {"input", "output"}
            The shaft to which the variable unit is coupled.
        R_o : float
            Basic ratio of the planetary gear [1].
        eta : float
            Its efficiency with the carrier fixed [1].
        """
        place = dict(zip(members(layout), ("in", "2", "out"), strict=True))
        lever = Lever("differential", place["a"], place["b"], place["carrier"], R_o, eta)
        return cls((lever,), ("in", "2") if coupling == "input" else ("2", "out"))

    def range(self, *joints: Joint) -> Self:
        """The same network with these additional joints."""
        return replace(self, joints=self.joints + joints)

    @cached_property
    def shafts(self) -> tuple[str, ...]:
        """All names of shafts, the housing first."""
        names = [HOUSING]
        for lever in self.levers:
            names += [lever.a, lever.b, lever.carrier]
        names += [name for joint in self.joints for name in joint]
        names += [name for name in self.unit if name in (self.input, self.output)]
        return tuple(dict.fromkeys(names))

    @cached_property
    def nodes(self) -> dict[str, int]:
        """The node number of each shaft; the housing is -1."""
        leader = {name: name for name in self.shafts}

        def root(name: str) -> str:
            while leader[name] != name:
                name = leader[name]
            return name

        for one, other in self.joints:
            first, second = sorted((root(one), root(other)), key=self.shafts.index)
            leader[second] = first
        roots = list(dict.fromkeys(root(name) for name in self.shafts))
        return {name: roots.index(root(name)) - 1 for name in self.shafts}

    @property
    def ratios(self) -> Array:
        """The levers' ratios."""
        return np.array([lever.ratio for lever in self.levers], float)

    def speeds(self, ratios: ArrayLike | None = None) -> Array:
        """A and B of every node, shape (..., nodes, 2): w = A w_in + B w_out. ``ratios``: other ratios of the levers, shape (..., levers).

        Errors: ParameterError if input and output do not determine the speeds of all shafts; with other ratios these are nan.
        """
        given = self.ratios if ratios is None else np.asarray(ratios, float)
        rows = self._rows(given)
        ends = np.zeros((*rows.shape[:-2], 2, rows.shape[-1]))
        ends[..., 0, self._node("input")] = ends[..., 1, self._node("output")] = 1.0
        whole = np.concatenate([rows, ends], axis=-2)
        freedom = rows.shape[-1] - rows.shape[-2]
        sound = _regular(whole) if freedom == 2 else np.zeros(whole.shape[:-2], bool)
        if freedom != 2 or (ratios is None and not sound):
            raise ParameterError(
                f"the network{self._joined()} has {freedom} degrees of freedom; the speeds of input and output determine all "
                "others only if there are two, and if they are independent"
            )
        whole[~sound] = np.eye(whole.shape[-1])
        right = np.concatenate([np.zeros((rows.shape[-2], 2)), np.eye(2)])
        found = np.linalg.solve(whole, np.broadcast_to(right, (*whole.shape[:-1], 2)))
        found[~sound] = np.nan
        return np.asarray(found, float)

    def mechanical_point(self, shaft: str) -> float:
        """The r = w_out/w_in at which a shaft is at rest; infinite if only the input drives it."""
        A, B = self.speeds()[self.nodes[shaft]]
        return float(-A / B) if abs(B) > 1e-12 * abs(A) else np.inf

    @property
    def freedom(self) -> int:
        """Degrees of freedom."""
        rows = self._rows(self.ratios)
        return int(rows.shape[-1] - (np.linalg.matrix_rank(rows) if rows.size else 0))

    @property
    def motions(self) -> Array:
        """Speeds of all nodes in independent motions, shape (nodes, freedom)."""
        rows = self._rows(self.ratios)
        return np.asarray(np.linalg.svd(rows)[2][rows.shape[-1] - self.freedom :].T)

    def motion(self) -> Array:
        """Speed of every node for w_in = 1 in a network with one degree of freedom. Errors: ParameterError for other networks."""
        if self.freedom != 1:
            raise ParameterError(
                f"the network{self._joined()} is not a fixed gear: it has {self.freedom} degrees of freedom"
            )
        motion = self.motions[:, 0]
        w_in = motion[self._node("input")]
        if abs(w_in) < 1e-12:
            raise ParameterError(f"the network{self._joined()} holds its input")
        return np.asarray(motion / w_in)

    def fixed_ratio(self) -> float:
        """w_in/w_out of a network with one degree of freedom. Errors: ParameterError for other networks."""
        w_out = self.motion()[self._node("output")]
        if abs(w_out) < 1e-12:
            raise ParameterError(f"the network{self._joined()} holds its output")
        return float(1 / w_out)

    def _rows(self, ratios: Array) -> Array:
        """The levers' equations over the nodes, shape (..., levers, nodes)."""
        if ratios.shape[-1:] != (len(self.levers),):
            raise ParameterError(f"the network has {len(self.levers)} levers, not {ratios.shape[-1:]} ratios")
        rows = np.zeros((*ratios.shape, max(self.nodes.values()) + 2))  # the last column is the housing
        for k, lever in enumerate(self.levers):
            R = ratios[..., k]
            for name, factor in ((lever.a, 1.0), (lever.b, -R), (lever.carrier, R - 1.0)):
                rows[..., k, self.nodes[name]] += factor
        return rows[..., :-1]

    def _node(self, end: str) -> int:
        node = self.nodes[getattr(self, end)]
        if node < 0:
            raise ParameterError(f"the {end} is held by the joints{self._joined()}")
        return node

    def _joined(self) -> str:
        said = ", ".join(f"{a}-{b}" for a, b in self.joints if a != b)
        return f" with {said}" if said else ""


def _regular(whole: Array) -> NDArray[np.bool_]:
    """Which matrices are regular: by the determinant relative to that of orthogonal rows of the same lengths (Hadamard)."""
    finite = np.asarray(np.isfinite(whole).all(axis=(-2, -1)))
    length = np.linalg.norm(np.where(finite[..., None, None], whole, 1.0), axis=-1)
    level = np.where(finite[..., None, None], whole, 0.0) / length[..., None]
    return np.asarray(finite & (np.abs(np.linalg.det(level)) > _SINGULAR))


def joints(*pairs: str | Iterable[str]) -> tuple[Joint, ...]:
    """Joints from strings: ``joints("ring 3-housing", "sun-carrier")``."""
    found = []
    for pair in pairs:
        names = [name.strip() for name in pair.split("-")] if isinstance(pair, str) else list(pair)
        if len(names) != 2:
            raise ParameterError(f"{pair!r} does not name two shafts to join")
        found.append((names[0], names[1]))
    return tuple(found)
