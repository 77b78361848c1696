"""Reduced models written by hand, as compilation would give them."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from powertrain.compiler.torques import COMPLIANCE
from powertrain.dae.hybrid import Friction, HybridDae, Opened, Switch
from powertrain.dae.tolerances import alone_tolerance, torque_tolerance


def solve_linear(matrix: ca.SX, right: ca.SX) -> ca.SX:
    """Gaussian elimination along the sparsity."""
    from powertrain.numerics.sparse_lu import factorize

    return factorize(ca.sparsify(matrix))(right)


def coupled_clutches() -> HybridDae:
    """Four inertias in a row, three clutches; x = (J1.phi, J1.w, phi_rel, w_rel of each clutch), p = J1..J4, amp, peak, fn_max, mu0."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 8), ca.SX.sym("m", 5), ca.SX.sym("p", 8)
    inertia, (amplitude, peak, fn_max, mu) = [p[i] for i in range(4)], [p[4], p[5], p[6], p[7]]
    drive = amplitude * ca.sin(2 * np.pi * 5 * t)
    force = [fn_max * ca.fmax(ca.sin(2 * np.pi * 0.2 * t + np.pi / 2), 0), fn_max * m[3], fn_max * m[4]]
    w = [x[3], x[5], x[7]]
    slip, locked = [], []
    for k in range(3):
        loose = ca.if_else(m[k] == 1, mu * force[k], ca.if_else(m[k] == -1, -mu * force[k], 0.0))
        slip.append(loose)
        locked.append(m[k] == 0)
    # tau: locked rows  tau_k / J_k + tau_k / J_k+1 - neighbours = relative acceleration without them
    free = [-drive / inertia[0], ca.SX(0), ca.SX(0)]
    full = ca.SX.zeros(3, 3)
    for k in range(3):
        full[k, k] = -(1 / inertia[k] + 1 / inertia[k + 1])
        if k > 0:
            full[k, k - 1] = 1 / inertia[k]
        if k < 2:
            full[k, k + 1] = 1 / inertia[k + 1]
    rows = [ca.if_else(locked[k], full[k, :], ca.SX.eye(3)[k, :]) for k in range(3)]
    tau = solve_linear(
        _tridiagonal(ca.vertcat(*rows)), ca.vertcat(*[ca.if_else(locked[k], -free[k], slip[k]) for k in range(3)])
    )
    acceleration = [
        (drive + tau[0]) / inertia[0],
        (tau[1] - tau[0]) / inertia[1],
        (tau[2] - tau[1]) / inertia[2],
        -tau[2] / inertia[3],
    ]
    relative = [acceleration[k + 1] - acceleration[k] for k in range(3)]
    xdot = ca.vertcat(x[1], acceleration[0], x[3], relative[0], x[5], relative[1], x[7], relative[2])
    frictions = tuple(
        Friction(f"clutch{k + 1}", "hand", k, w[k], tau[k], -mu * force[k], mu * force[k], peak, relative[k])
        for k in range(3)
    )
    switches = tuple(Switch(f"step{k}", "hand", 1 + k, t - at, time=ca.SX(at)) for k, at in ((2, 0.4), (3, 0.9)))
    names = ("J1.phi", "J1.w", *(f"clutch{k}.{v}" for k in (1, 2, 3) for v in ("phi_rel", "w_rel")))
    return dae(t, x, m, p, xdot, names, frictions=frictions, switches=switches)


def _tridiagonal(matrix: ca.SX) -> ca.SX:
    result = ca.SX(3, 3)
    for i in range(3):
        for j in range(max(0, i - 1), min(3, i + 2)):
            result[i, j] = matrix[i, j]
    return result


COUPLED_START = np.array([0.0, 10.0, 0.0, -10.0, 0.0, 0.0, 0.0, 0.0])
COUPLED_PARAMETERS = np.array([1.0, 1.0, 1.0, 1.0, 10.0, 1.1, 20.0, 0.5])


def dae(
    t: ca.SX,
    x: ca.SX,
    m: ca.SX,
    p: ca.SX,
    xdot: ca.SX,
    names: Sequence[str],
    z: ca.SX | None = None,
    residual: ca.SX | None = None,
    **laws: object,
) -> HybridDae:
    """A model with the fields that are rarely needed filled in."""
    return HybridDae(
        t=t,
        x=x,
        z=ca.SX.sym("z", 0) if z is None else z,
        m=m,
        p=p,
        xdot=xdot,
        residual=ca.SX(0, 1) if residual is None else residual,
        state_names=tuple(names),
        held_start=np.zeros(m.numel()),
        **laws,  # type: ignore[arg-type]
    )


def bodies(
    inertias: Sequence[float],
    force: Sequence[ca.SX | float],
    jacobian: np.ndarray,
    bounds: object,
    t: ca.SX,
    peak: float = 1.0,
    switches: object = None,
    extra_held: int = 0,
) -> HybridDae:
    """Bodies with speeds x, pushed by ``force``, held back by friction laws on the speeds ``jacobian @ x``.

    ``bounds(torques, m)`` gives (lower, upper) per law, linear in the torques for given m; ``switches(torques, m)`` the switches.
    """
    n, laws = len(inertias), len(jacobian)
    x, m, p = ca.SX.sym("x", n), ca.SX.sym("m", laws + extra_held), ca.SX.sym("p", 0)
    push, gradient = ca.vertcat(*force), ca.DM(jacobian)
    inverse = ca.diag(1 / ca.DM(list(inertias)))
    torque = ca.SX.sym("torque", laws)
    limits = bounds(torque, m)  # type: ignore[operator]
    acceleration = inverse @ (push - gradient.T @ torque)
    own = [float(ca.mtimes([gradient[k, :], inverse, gradient[k, :].T])) for k in range(laws)]
    rows, soft, shared = [], [], float(laws > 1)
    for k in range(laws):
        lower, upper = limits[k]
        loose = torque[k] - ca.if_else(m[k] == 1, upper, ca.if_else(m[k] == -1, lower, 0))
        rows.append(ca.if_else(m[k] == 0, -(gradient[k, :] @ acceleration), loose))
        soft.append(ca.if_else(m[k] == 0, COMPLIANCE * own[k] * shared, 0.0))
    equations, compliance = ca.vertcat(*rows), ca.vertcat(*soft)
    matrix = ca.jacobian(equations, torque) + ca.diag(compliance)
    right = -ca.substitute(equations, torque, ca.SX.zeros(laws))
    found = solve_linear(matrix, right + compliance * solve_linear(matrix, right))

    def final(e: ca.SX | float) -> ca.SX:
        return ca.substitute(ca.SX(e), torque, found)

    rates = gradient @ acceleration
    frictions = tuple(
        Friction(
            f"law{k}",
            "hand",
            k,
            gradient[k, :] @ x,
            found[k],
            final(limits[k][0]),
            final(limits[k][1]),
            ca.SX(peak),
            final(rates[k]),
            may_free=False,
            known=torque_tolerance(ca.sum1(ca.fabs(found)), ca.mmax(ca.fabs(found)))
            if laws > 1
            else alone_tolerance(ca.mmax(ca.fabs(found))),
            reach=ca.SX(own[k]),
        )
        for k in range(laws)
    )
    found_switches, conditions = ((), ()) if switches is None else (switches(found, m), switches(torque, m))  # type: ignore[operator]
    opened = Opened(
        tau=torque,
        xdot=acceleration,
        residual=ca.SX(0, 1),
        speed=gradient @ x,
        rate=rates,
        lower=ca.vertcat(*(ca.SX(low) for low, _ in limits)),
        upper=ca.vertcat(*(ca.SX(high) for _, high in limits)),
        peak=ca.SX([peak] * laws),
        reach=ca.SX(own),
        compliance=shared * ca.SX(own),
        conditions=ca.vertcat(ca.SX(0, 1), *(switch.g for switch in conditions)),
    )
    names = [f"w{k}" for k in range(n)]
    return dae(t, x, m, p, final(acceleration), names, frictions=frictions, switches=found_switches, opened=opened)


def nonlinear() -> HybridDae:
    """Depends on time explicitly; x = (sin t + 2, exp(-sin t)) solves it."""
    t, x, m, p = ca.SX.sym("t"), ca.SX.sym("x", 2), ca.SX.sym("m", 0), ca.SX.sym("p", 0)
    xdot = ca.vertcat(ca.cos(t) * (x[0] - ca.sin(t)) / 2, -ca.cos(t) * x[1] * (x[0] - 1 - ca.sin(t)))
    return dae(t, x, m, p, xdot, ["a", "b"])


def exact(t: float) -> np.ndarray:
    return np.array([np.sin(t) + 2, np.exp(-np.sin(t))])


def implicit() -> HybridDae:
    """x' = -z with z^3 + z = x + sin t, the diagonal of d(residual)/dz structurally zero through a second pair."""
    t, x, z, m, p = ca.SX.sym("t"), ca.SX.sym("x", 1), ca.SX.sym("z", 3), ca.SX.sym("m", 0), ca.SX.sym("p", 0)
    residual = ca.vertcat(z[1] - 2 * z[2], z[0] ** 3 + z[0] - x - ca.sin(t), z[2] - x * z[0])
    return dae(t, x, m, p, -z[0] + 0 * z[1], ["a"], z=z, residual=residual)
