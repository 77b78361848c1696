"""Vibrations of random trees of inertias, massless nodes, springs and gears: quadratic eigenvalue problem, complex stiffness."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eig, null_space

import powertrain as pt
from powertrain.components.rotational import Fixed, IdealGear, Inertia, SpringDamper
from powertrain.components.rotational.interfaces import Flange

Edges = tuple[tuple[int, int], ...]


class Tree(pt.Component):
    """Node k has the inertia ``inertias[massive.index(k)]``, or none; the node -1 is ground."""

    massive: tuple[int, ...]
    sprung: Edges
    geared: Edges
    inertias: tuple[Inertia, ...]
    springs: tuple[SpringDamper, ...]
    gears: tuple[IdealGear, ...] = ()
    ground: Fixed = Fixed()

    def equations(self) -> pt.Equations:
        at: dict[int, list[Flange]] = {-1: [self.ground.flange]}
        for node, inertia in zip(self.massive, self.inertias, strict=True):
            at.setdefault(node, []).append(inertia.flange_a)
        for (a, b), part in zip(self.sprung + self.geared, self.springs + self.gears, strict=True):
            at.setdefault(a, []).append(part.flange_a)
            at.setdefault(b, []).append(part.flange_b)
        for flanges in at.values():
            if len(flanges) > 1:
                yield pt.connect(*flanges)


def random_tree(seed: int) -> Tree:
    """Three to seven nodes; ratios of either sign; a node without inertia has dampers beside it."""
    g = np.random.default_rng(seed)
    n = int(g.integers(3, 8))
    edges = [(int(g.integers(k)), k) for k in range(1, n)]
    count = int(g.integers(1, n))
    order = g.permutation(n - 1)
    sprung, geared = ([edges[i] for i in order[part]] for part in (slice(count), slice(count, None)))
    if g.random() < 0.5:
        sprung.append((-1, int(g.integers(n))))
    degree = np.bincount(np.ravel(edges), minlength=n)
    massive = [k for k in range(n) if degree[k] == 1 or g.random() < 0.75]
    damped = len(massive) < n
    scale = 10.0 ** g.uniform(-2, 4)
    return Tree(
        massive=tuple(massive), sprung=tuple(sprung), geared=tuple(geared),
        inertias=tuple(Inertia(J=scale * 10 ** g.uniform(-2, 1)) for _ in massive),
        springs=tuple(
            SpringDamper(c=10 ** g.uniform(1, 6), d=10 ** g.uniform(-2, 1) if damped or g.random() < 0.5 else 0.0)
            for _ in sprung
        ),
        gears=tuple(IdealGear(ratio=float(g.choice([-1, 1]) * 10 ** g.uniform(-0.7, 1))) for _ in geared),
    )  # fmt: skip


def matrices(tree: Tree) -> tuple[NDArray[np.float64], ...]:
    """M, D, K over the nodes, and a basis of the motions that the gears allow."""
    n = 1 + max(max(edge) for edge in tree.sprung + tree.geared)
    M, D, K = (np.zeros((n, n)) for _ in range(3))
    for node, inertia in zip(tree.massive, tree.inertias, strict=True):
        M[node, node] = float(inertia.J)
    for (a, b), spring in zip(tree.sprung, tree.springs, strict=True):
        v = np.eye(n)[b] - (np.eye(n)[a] if a >= 0 else 0.0)
        D, K = D + float(spring.d) * np.outer(v, v), K + float(spring.c) * np.outer(v, v)
    held = [np.eye(n)[a] - float(g.ratio) * np.eye(n)[b] for (a, b), g in zip(tree.geared, tree.gears, strict=True)]
    return M, D, K, null_space(np.array(held)) if held else np.eye(n)


@pytest.mark.parametrize("seed", range(25))
def test_modes_and_forced_response(seed: int) -> None:
    tree = random_tree(seed)
    M, D, K, T = matrices(tree)
    m, d, k = (T.T @ part @ T for part in (M, D, K))
    plant, zero, one = pt.compile(tree), np.zeros_like(m), np.eye(len(m))
    values = np.asarray(eig(np.block([[zero, one], [-k, -d]]), np.block([[one, zero], [zero, m]]), right=False))
    values = values[np.isfinite(values) & (values.imag > 1e-5 * np.abs(values)) & (np.abs(values) > 1e-2)]
    values = values[np.argsort(np.abs(values))]
    if len(values):
        found = pt.eigenmodes(plant)
        np.testing.assert_allclose(2 * np.pi * found["frequency"], np.abs(values), rtol=1e-6)
        np.testing.assert_allclose(found["damping"], -values.real / np.abs(values), atol=1e-6)
        np.testing.assert_allclose(found["energy"].sum("component"), 1.0, rtol=1e-9)
    s = 1j * 10.0 ** np.random.default_rng(seed).uniform(0, 3)
    torque = np.eye(len(M))[tree.massive[0]]
    phi = T @ np.linalg.solve(m * s**2 + d * s + k, T.T @ torque)
    a, b = tree.sprung[0]
    twist = phi[b] - (phi[a] if a >= 0 else 0.0)
    spring = (float(tree.springs[0].c) + float(tree.springs[0].d) * s) * twist
    response = pt.order_response(
        plant,
        {"inertias[0].w": [s.imag]},
        {"inertias[0].flange_a.tau": {1.0: 1.0}},
        ["inertias[0].phi", "springs[0].tau"],
    )
    exact = [phi[tree.massive[0]], spring]
    np.testing.assert_allclose(response.values.ravel(), exact, rtol=1e-6, atol=1e-9 * np.abs(exact).max())
