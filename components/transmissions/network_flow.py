"""Torques, powers and losses of a network of planetary gears at operating points: one linear system for every pattern of losses."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain import Map, ParameterError, arguments_checked
from powertrain.components.cvu.unit import AXES
from powertrain.components.efficiency_map import checked_efficiency
from powertrain.components.transmissions.network import Array, Network

STATUS = ("one solution", "an interval", "several solutions", "no solution", "efficiency of the unit not found")
ONE, INTERVAL, SEVERAL, NONE, OPEN = range(5)
_ZERO = 1e-10
"""A power or a relative speed that counts as zero, relative to the total."""
_CHUNK = 100_000
_ROUNDS, _SETTLED = 60, 1e-10
"""Largest number of updates of directions and unit efficiency to the torques, and the tolerance."""


@arguments_checked
@dataclass(frozen=True)
class UnitLoss:
    """Efficiency of a variable unit if its shaft a drives and if b drives.

    Numbers, or maps over any of ``ratio`` (w_b/w_a), ``w_a`` (rad/s, magnitude), ``tau`` (N.m, magnitude of the torque at a), as in
    ``CVU``.
    """

    ab: float | Map = 1.0
    ba: float | Map = 1.0

    def __post_init__(self) -> None:
        for name, given in (("ab", self.ab), ("ba", self.ba)):
            if isinstance(given, Map):
                checked_efficiency(given, f"efficiency {name} of the unit", AXES)
            elif not 0 < given <= 1:
                raise ParameterError(f"efficiency {name} of the unit = {given:g} is not in (0, 1]")

    @property
    def depends_on_torque(self) -> bool:
        """Whether the efficiencies must be found together with the torques."""
        return any(isinstance(x, Map) and any(axis.name == "tau" for axis in x.axes) for x in (self.ab, self.ba))

    def at(self, a_drives: NDArray[np.bool_], w: tuple[Array, Array], tau_a: Array) -> Array:
        """The efficiency at speeds of both shafts and the torque at a; a map is constant beyond its edges."""
        return np.where(a_drives, self._one(self.ab, w, tau_a), self._one(self.ba, w, tau_a))

    @staticmethod
    def _one(given: float | Map, w: tuple[Array, Array], tau_a: Array) -> Array:
        if not isinstance(given, Map):
            return np.full(w[0].shape, float(given))
        with np.errstate(divide="ignore", invalid="ignore"):
            values = {"ratio": w[1] / w[0], "w_a": np.abs(w[0]), "tau": np.abs(tau_a)}
        held = [np.clip(np.nan_to_num(values[x.name], nan=x.low), x.low, x.high) for x in given.axes]
        return np.asarray(given(*held), float)


@dataclass(frozen=True)
class Flow:
    """Operating points of a network; arrays over candidates and points. If a mesh is stuck, the values of both ends are stored.

    ``efficiency``: power delivered over power supplied, (2, ...): least and greatest, below 0 if input and output both supply power; the
    other values belong to the least. ``K``: power into the unit over the input's power, positive if it enters at a and leaves at b.
    ``w``: speeds of the unit's shafts a and b, ``tau``: torques on them (2, ...). ``latent``: latent powers of the levers. Speeds in
    rad/s, torques in N.m.
    """

    efficiency: Array
    K: Array
    w: Array
    tau: Array
    tau_in: Array
    latent: Array
    status: NDArray[np.int8]

    @property
    def V(self) -> Array:
        """Ratio of the unit, w_b/w_a."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.w[1] / self.w[0], float)

    @property
    def unit_power(self) -> Array:
        """Power through the unit, at its more loaded shaft."""
        return np.asarray(np.abs(self.w * self.tau).max(axis=0), float)


def flow(
    network: Network,
    r: ArrayLike,
    torque: ArrayLike,
    w_in: ArrayLike = 100.0,
    *,
    loss: UnitLoss | None = None,
    ratios: ArrayLike | None = None,
    thorough: bool = True,
) -> Flow:
    """Operating points of a network over its ratio.

    Unknowns are one torque of every lever and both torques of the unit. The torques balance at every node except the input; for the unit
    eta T_a w_a + T_b w_b = 0 if a drives, T_a w_a + eta T_b w_b = 0 if b drives. This is linear for given directions of the latent
    powers and of the unit's power. All directions are tried; those consistent with the resulting torques are solutions.

    Parameters
    ----------
    network : Network
        The network.
    r : array_like
        Ratios w_out/w_in [1], of shape (points,) or (candidates, points).
    torque : array_like
        Torque that the output delivers [N.m], negative if the output drives; shape as for ``r``.
    w_in : array_like
        Speed of the input [rad/s]; shape as for ``r``.
    loss : UnitLoss, optional
        Loss of the variable unit; by default none.
    ratios : array_like, optional
        Basic ratios of the levers of many candidates, of shape (candidates, levers); by default those of the network.
    thorough : bool
        Whether all directions are tried. Otherwise directions follow from the previous torques, starting without loss, until they are
        unchanged: this finds one solution, or none if they do not converge.

    Returns
    -------
    Flow
        Arrays of shape (points,), or (candidates, points) with ``ratios``.

    Raises
    ------
    ParameterError
        If the number of candidates in the points differs.
    """
    unit = loss or UnitLoss()
    given = np.atleast_2d(network.ratios if ratios is None else np.asarray(ratios, float))
    points = [np.atleast_2d(np.asarray(x, float)) for x in np.broadcast_arrays(r, torque, w_in)]
    if points[0].shape[0] not in (1, len(given)):
        raise ParameterError(f"points for {points[0].shape[0]} candidates, but there are {len(given)}")
    step = max(1, _CHUNK // max(points[0].shape[1], 1))
    parts = []
    for k in range(0, len(given), step):
        part = [x if len(x) == 1 else x[k : k + step] for x in points]
        system = _system(network, given[k : k + step], part)
        parts.append(_all_directions(system, unit) if thorough else _followed(system, unit))
    whole = {n: np.concatenate([getattr(p, n) for p in parts], axis=-2) for n in Flow.__dataclass_fields__}
    return Flow(**(whole if ratios is not None else {n: x[..., 0, :] for n, x in whole.items()}))


@dataclass(frozen=True)
class _System:
    """The data of the linear system.

    R: lever ratios (levers, candidates, 1); w: speeds of nodes and housing (nodes + 1, candidates, points); the delivered torque.
    """

    network: Network
    R: Array
    w: Array
    torque: Array

    @property
    def relative(self) -> Array:
        """w_a - w_carrier of the levers."""
        node = self.network.nodes
        found = [self.w[node[x.a]] - self.w[node[x.carrier]] for x in self.network.levers]
        return np.array(found).reshape(-1, *self.w.shape[1:])

    @property
    def unit(self) -> tuple[Array, Array]:
        """Speeds of the unit's shafts."""
        a, b = (self.network.nodes[name] for name in self.network.unit)
        return self.w[a], self.w[b]

    @property
    def delivered(self) -> Array:
        """Power of the output."""
        return np.asarray(self.w[self.network.nodes[self.network.output]] * self.torque, float)

    @property
    def w_in(self) -> Array:
        """Speed of the input."""
        return np.asarray(self.w[self.network.nodes[self.network.input]], float)

    def some(self, which: NDArray[np.bool_]) -> _System:
        """Some of the points, each as a candidate of its own."""
        candidate, point = np.nonzero(which)
        torque = np.broadcast_to(self.torque, which.shape)[candidate, point]
        return _System(self.network, self.R[:, candidate], self.w[:, candidate, point][..., None], torque[:, None])

    def matrix(self, signs: Array) -> Array:
        """Torques into the nodes (rows) due to T_a of the levers and T_a, T_b of the unit (columns); the unit's own row is zero."""
        shape, node = self.w.shape[1:], self.network.nodes
        rows = np.zeros((*shape, len(self.w) + 1, len(self.network.levers) + 2))
        for k, lever in enumerate(self.network.levers):
            share = self.R[k] * lever.eta ** signs[k]
            for name, factor in ((lever.a, 1.0), (lever.b, -share), (lever.carrier, share - 1.0)):
                rows[..., node[name] % len(self.w), k] += factor
        for k, name in enumerate(self.network.unit):
            rows[..., node[name] % len(self.w), len(self.network.levers) + k] += 1.0
        return rows

    def solve(self, signs: Array, a_drives: NDArray[np.bool_], eta: Array) -> tuple[Array, Array]:
        """The torques, (levers + 2, candidates, points), and the input torque; nan where the speeds do not determine them."""
        rows = self.matrix(signs)
        into, out, housing = self.network._node("input"), self.network._node("output"), len(self.w) - 1
        keep = [k for k in range(rows.shape[-2]) if k not in (into, housing)]
        square = rows[..., keep, :]
        w_a, w_b = self.unit
        size = np.maximum(np.maximum(np.abs(w_a), np.abs(w_b)), 1e-300)
        square[..., -1, -2] = np.where(a_drives, eta, 1.0) * w_a / size
        square[..., -1, -1] = np.where(a_drives, 1.0, eta) * w_b / size
        right = np.zeros(square.shape[:-1])
        right[..., keep.index(out)] = -self.torque
        determined = np.abs(np.linalg.det(square)) > 1e-14
        square[~determined] = np.eye(square.shape[-1])
        found = np.linalg.solve(square, right[..., None])[..., 0]
        found[~determined] = np.nan
        tau_in = np.einsum("...k,...k->...", rows[..., into, :], found)
        return np.asarray(np.moveaxis(found, -1, 0), float), np.asarray(tau_in, float)


def _system(network: Network, ratios: Array, points: list[Array]) -> _System:
    """Speeds of several candidates."""
    r, torque, w_in = points
    ends = np.broadcast_to(np.stack([w_in, r * w_in]), (2, len(ratios), r.shape[1]))
    moving = np.einsum("cnk,kcp->ncp", network.speeds(ratios), ends)
    return _System(network, ratios.T[:, :, None], np.concatenate([moving, np.zeros((1, *moving.shape[1:]))]), torque)


def _all_directions(system: _System, unit: UnitLoss) -> Flow:
    """All directions, with their solutions combined."""
    best: Flow | None = None
    for signs, a_drives in _directions(system.network):
        best = _merged(best, _tried(system, np.array(signs, float), np.array(a_drives), unit))
    assert best is not None
    status = np.where(np.isfinite(best.efficiency[0]), best.status, np.where(best.status == OPEN, OPEN, NONE))
    w_a, w_b = system.unit
    apart = best.efficiency[1] - best.efficiency[0] > 1e-9
    fastest = np.abs(system.w).max(axis=0)
    still = np.minimum(np.abs(w_a), np.abs(w_b)) <= _ZERO * fastest
    stuck = (np.abs(system.relative) <= _ZERO * fastest).any(axis=0) | still
    status = np.where((status == ONE) & apart, np.where(stuck, INTERVAL, SEVERAL), status)
    return replace(best, status=status.astype(np.int8))


def _followed(system: _System, unit: UnitLoss) -> Flow:
    """Directions and unit efficiency updated from the torques, starting without loss, until they are unchanged at a point."""
    shape = system.w.shape[1:]
    signs, a_drives, eta = np.zeros((len(system.network.levers), *shape)), np.ones(shape, bool), np.ones(shape)
    x, tau_in = system.solve(signs, a_drives, eta)
    settled, moving = np.zeros(shape, bool), np.isfinite(tau_in)
    for _ in range(_ROUNDS):
        some = system.some(moving)
        torques, before = x[:, moving][..., None], (signs[:, moving], a_drives[moving], eta[moving])
        new = np.where(torques[:-2] * some.relative >= 0, 1.0, -1.0)
        drives = torques[-2] * some.unit[0] >= torques[-1] * some.unit[1]
        share = unit.at(drives, some.unit, np.nan_to_num(torques[-2]))
        same = (new[..., 0] == before[0]).all(axis=0) & (drives[:, 0] == before[1])
        same &= np.abs(share[:, 0] - before[2]) <= _SETTLED
        signs[:, moving], a_drives[moving], eta[moving] = new[..., 0], drives[:, 0], share[:, 0]
        settled[moving] = same
        if same.all():
            break
        found, into = some.solve(new, drives, share)
        x[:, moving], tau_in[moving] = found[..., 0], into[:, 0]
        moving &= ~settled & np.isfinite(tau_in)
    return _judged(system, signs, a_drives, (x, tau_in), settled)


def _directions(network: Network) -> Iterator[tuple[tuple[int, ...], bool]]:
    """Exponents of the levers' efficiencies (1: a drives, -1: b drives; only one without loss), and whether the unit's a drives."""
    choices = [(1, -1) if lever.eta < 1 else (1,) for lever in network.levers]
    for signs in itertools.product(*choices):
        for a_drives in (True, False):
            yield signs, a_drives


def _tried(system: _System, signs: Array, a_drives: NDArray[np.bool_], unit: UnitLoss) -> Flow:
    """The points for given directions, with the unit's efficiency at the resulting torques."""
    w = system.unit
    eta = unit.at(a_drives, w, np.zeros_like(w[0]))
    settled = np.ones(w[0].shape, bool)
    x, tau_in = system.solve(signs, a_drives, eta)
    for _ in range(_ROUNDS if unit.depends_on_torque else 0):
        eta, last = unit.at(a_drives, w, np.nan_to_num(x[-2])), eta
        settled = np.abs(eta - last) <= _SETTLED
        if settled[np.isfinite(tau_in)].all():
            break
        x, tau_in = system.solve(signs, a_drives, eta)
    return _judged(system, signs, a_drives, (x, tau_in), settled)


def _judged(
    system: _System,
    signs: Array,
    a_drives: NDArray[np.bool_],
    torques: tuple[Array, Array],
    settled: NDArray[np.bool_],
) -> Flow:
    """The results of torques for given directions; nan if they contradict these."""
    x, tau_in = torques
    w = system.unit
    latent = x[:-2] * system.relative
    through = np.stack([x[-2] * w[0], x[-1] * w[1]])
    out, supplied = system.delivered, tau_in * system.w_in
    scale = _ZERO * np.maximum(np.abs(out), np.abs(x[-2:]).max(axis=0) * np.abs(system.w).max(axis=0))
    agrees = np.isfinite(tau_in) & (np.where(a_drives, through[0], through[1]) >= -scale)
    for k, lever in enumerate(system.network.levers):
        if lever.eta < 1:
            agrees &= latent[k] * signs[k] >= -scale
    with np.errstate(divide="ignore", invalid="ignore"):
        efficiency = np.where(supplied >= 0, out / supplied, supplied / out)
        efficiency = np.where((supplied < 0) & (out >= 0), np.nan, efficiency)  # energy from nothing is a contradiction
        efficiency = np.where(np.abs(out) + np.abs(supplied) <= scale, 0.0, efficiency)
        K = np.where(a_drives, through[0], -through[1]) / supplied
    keep = agrees & settled & np.isfinite(efficiency)
    status = np.where(keep, ONE, np.where(agrees & ~settled, OPEN, NONE)).astype(np.int8)

    def kept(value: Array) -> Array:
        return np.where(keep, value, np.nan)

    return Flow(
        kept(np.stack([efficiency] * 2)), kept(K), np.stack(w), kept(x[-2:]), kept(tau_in), kept(latent), status
    )


def _merged(one: Flow | None, other: Flow) -> Flow:
    """For each of two patterns the values with the lower efficiency; the higher efficiency is also kept."""
    if one is None:
        return other
    take = np.isfinite(other.efficiency[0]) & ~(one.efficiency[0] <= other.efficiency[0])
    mixed = {n: np.where(take, getattr(other, n), getattr(one, n)) for n in ("K", "w", "tau", "tau_in", "latent")}
    efficiency = np.stack(
        [np.fmin(one.efficiency[0], other.efficiency[0]), np.fmax(one.efficiency[1], other.efficiency[1])]
    )
    return Flow(efficiency=efficiency, status=np.minimum(one.status, other.status), **mixed)
