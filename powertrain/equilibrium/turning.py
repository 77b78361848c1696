"""Angles that merely turn: states on which nothing depends, or of which only differences matter."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from powertrain.compiler.assemble import Compiled
from powertrain.compiler.hybrid import HybridDae
from powertrain.compiler.index import generic
from powertrain.equilibrium.placed import Placed, Request, Turning
from powertrain.errors import ParameterError
from powertrain.language.symbols import Symbol, column, key
from powertrain.numerics.batch import dependence
from powertrain.numerics.buffers import Array

_NOTHING = 1e-9
"""Shares of the largest slope, and of one turn, that count as round-off."""


def influential(dae: HybridDae, everything: Sequence[Symbol]) -> list[int]:
    """The states on which anything depends."""
    found = dependence(everything, [dae.x[i] for i in range(dae.x.numel())])
    return [i for i in range(dae.x.numel()) if found.size and found[:, i].any()]


def refuse_turning(asked: Request, kept: Sequence[int], placed: Placed) -> None:
    """ParameterError if the request holds an angle that merely turns."""
    for name in asked.held:
        if placed.state_of(name) not in kept:
            raise ParameterError(
                f"grid: {name} only rotates; nothing in the model depends on it, so it has no steady value"
            )


def turning_together(compiled: Compiled, kept: Sequence[int], placed: Placed, parameters: Array) -> Turning:
    """The states of which only differences matter, for given parameters. ParameterError if that changes along the grid."""
    found = _null_directions(compiled.dae, kept, placed, parameters)
    moved = parameters.copy()
    moved[[i for i, n in enumerate(compiled.parameters) if n in placed.axis or n in placed.free]] *= 1.01
    if found and not _alike(found, _null_directions(compiled.dae, kept, placed, moved)):
        names = ", ".join(compiled.dae.state_names[i] for i in (*found, *next(iter(found.values()))))
        raise ParameterError(
            f"steady: {names} turn together by ratios that change along the grid; "
            "declare their difference as a variable with prefer=True"
        )
    return found


def _alike(one: Turning, other: Turning) -> bool:
    return one.keys() == other.keys() and all(
        one[i].keys() == other[i].keys() and all(abs(one[i][j] - other[i][j]) < _NOTHING for j in one[i]) for i in one
    )


def _null_directions(dae: HybridDae, kept: Sequence[int], placed: Placed, values: Array) -> Turning:
    if not kept:
        return {}
    x = column([dae.x[i] for i in kept])
    whole = column(placed.everything)
    jacobian = ca.jacobian(whole, x)
    parameters = {key(dae.p[i]) for i in range(dae.p.numel())}
    symbols = [s for s in ca.symvar(jacobian) if key(s) not in parameters]
    function = ca.Function("powertrain_turning", [column(symbols), dae.p], [ca.densify(jacobian)])
    stacks = []
    for k in range(3):
        point = np.random.default_rng(k).uniform(0.3, 2.0, len(symbols))
        value = np.nan_to_num(np.array(function(point, values)), nan=1.0, posinf=1.0, neginf=1.0)
        stacks.append(value / np.maximum(np.abs(value).max(axis=1, keepdims=True), 1e-300))
    _, sizes, basis = np.linalg.svd(np.vstack(stacks))
    null = basis[int((sizes > _NOTHING * max(sizes.max(), 1e-300)).sum()) :]
    pivots: dict[int, Array] = {}
    for _ in range(len(null)):
        row, place = (int(i) for i in np.unravel_index(int(np.abs(null).argmax()), null.shape))
        pivot = null[row] / null[row, place]
        null = np.delete(null - np.outer(null[:, place], pivot), row, axis=0)
        pivots = {other: each - each[place] * pivot for other, each in pivots.items()}
        pivots[place] = pivot
    turning: Turning = {}
    for place, pivot in pivots.items():
        shares = {kept[j]: float(pivot[j]) for j in range(len(kept)) if j not in pivots and abs(pivot[j]) > _NOTHING}
        turning[kept[place]] = shares
    return turning


def lost_outputs(placed: Placed, cyclic: list[Symbol], turning: Turning) -> list[bool]:
    """The requested expressions that depend on how far the model has turned."""
    wanted, x = placed.put(placed.asked.wanted), placed.dae.x
    leaves = [s for s in cyclic if key(s) not in {key(x[i]) for i in turning}]
    lost: NDArray[np.bool_] = np.asarray(dependence(wanted, leaves).any(axis=1))
    for i, shares in turning.items():
        direction = ca.DM.zeros(x.numel())
        for j, share in (shares | {i: 1.0}).items():
            direction[j] = share
        change = ca.jtimes(column(wanted), x, direction)
        symbols = ca.symvar(change)
        point = [
            placed.values.get(key(s), generic(s)) for s in symbols
        ]  # angles turn together at ratios of the parameters
        number = ca.Function("powertrain_lost", [column(symbols)], [change])(point)
        lost = np.asarray(lost | (np.abs(np.array(number).ravel()) > _NOTHING))
    return [bool(lost[i]) for i in range(len(wanted))]
