"""Figures of the spherical cam differential: profile, flat and on the sphere, pressure angles, load sharing, efficiency, mechanism."""

from __future__ import annotations

import math
from itertools import product
from typing import cast

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from powertrain.components.gearless.solids import shaded
from powertrain.components.gearless.spherical_cam.body import CamBody, cone_solid
from powertrain.components.gearless.spherical_cam.curves import Array, turned, unit
from powertrain.components.gearless.spherical_cam.cycle import Cycle
from powertrain.components.gearless.spherical_cam.profile import CamGeometry, SphericalCam

CAM = SphericalCam(4, 5)
CYCLE = Cycle(CAM)
BODY = CamBody(CAM, inner=(0.020, 0.029), outer=(0.030, 0.036), bore=0.006)
INNER, OUTER, LEFT, RIGHT = "tab:blue", "tab:orange", "tab:green", "tab:red"
SIZES = (0.58, 0.78), (0.80, 1.0)
"""Radii between which the inner and the outer cam are drawn."""
BORE = 0.14


def _axes(ax: Axes | None) -> Axes:
    return plt.subplots(layout="constrained")[1] if ax is None else ax


def _solid_axes(ax: Axes | None) -> Axes3D:
    made = plt.figure(layout="constrained").add_subplot(projection="3d") if ax is None else ax
    assert isinstance(made, Axes3D)
    return made


def flat_profile(cam: CamGeometry = CAM, ax: Axes | None = None) -> Axes:
    """Profile and pitch curve over x and y, as in Fig. 2; dotted: the part beyond a lobe's tip, which is cut off."""
    ax = _axes(ax)
    low, high = cam.stroke
    profile, psi = cam.whole_profile(), np.linspace(low, high, 361)
    beyond = cam.profile(np.linspace(high, high + 0.25 * cam.half, 61))
    for i in range(cam.M):
        turn = 2 * cam.half * i
        x, y, _ = turned(cam.pitch_curve(psi), turn).T
        ax.plot(x, y, color="0.6", lw=0.8, ls="--", label="axis of a roller that touches" if i == 0 else None)
        for side in (1.0, -1.0):
            x, y, _ = turned(beyond * [1.0, side, 1.0], turn).T
            ax.plot(x, y, color=INNER, lw=0.8, ls=":", label="beyond the tip" if i == 0 and side > 0 else None)
    ax.fill(profile[:, 0], profile[:, 1], facecolor=INNER, alpha=0.15)
    ax.plot(*np.vstack([profile, profile[:1]])[:, :2].T, color=INNER, label="profile")
    x, y, _ = cam.profile(np.linspace(low, high, 181)).T
    ax.plot(x, y, color=RIGHT, lw=2, label="one valley")
    ax.set(xlabel="x", ylabel="y", title=f"Profile, M = {cam.M}, N = {cam.N}")
    ax.set_aspect("equal")
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize=8, frameon=False)
    return ax


def profile_on_sphere(cam: CamGeometry = CAM, ax: Axes | None = None) -> Axes:
    """The cam's cone on the unit sphere, with the axes of cam, carrier and relative rotation, as in Figs. 1 and 3."""
    solid = _solid_axes(ax)
    u, v = np.meshgrid(np.linspace(0, 2 * math.pi, 37), np.linspace(0, math.pi / 2, 13))
    solid.plot_wireframe(
        np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v), color="0.8", lw=0.3, rstride=2, cstride=2
    )
    psi = -0.7 * cam.half
    roller = cone_solid(_circle(cam), 0.8, 1.0) @ _onto(cam.roller_axis(psi)).T
    _add(solid, [(cone_solid(turned(cam.whole_profile(31), psi), 0.8, 1.0, BORE), INNER), (roller, OUTER)])
    for vector, name in (
        (np.array([0.0, 0.0, 1.0]), r"$e_\psi$"),
        (cam.e_phi, r"$e_\phi$"),
        (cam.e_e, "$e_e$"),
        (cam.roller_axis(psi), "$e_p$"),
    ):
        solid.plot(*np.outer(vector, [0, 1.3]), color="k", lw=0.8)
        x, y, z = 1.38 * vector
        solid.text(x, y, z, name)
    contact = cam.contact(psi)
    solid.plot(*np.outer(contact, [0, 1]), color=RIGHT, lw=2)
    _frame(solid, 1.1, f"Cam, one roller and their contact, M = {cam.M}, N = {cam.N}")
    solid.view_init(elev=30, azim=math.degrees(math.atan2(contact[1], contact[0])) - 25)  # neither body hides the other
    return cast(Axes, solid)


def pressure_angles(cam: CamGeometry = CAM, ax: Axes | None = None, *, cycles: int = 3) -> Axes:
    """mu_p and mu_n of successive strokes, as in Fig. 5; solid: inner cam, dashed: outer cam.

    They are drawn where each can drive: mu_p after the middle of a stroke, mu_n before it (mirrored onto the same side), while in contact.
    """
    ax = _axes(ax)
    s = np.linspace(0.0, cam.half + cam.sigma, 721)[1:]
    for mu, color, name in (
        (cam.pressure_angle_p(s - cam.half), RIGHT, r"$\mu_p$, cam drives"),
        (cam.pressure_angle_n(-s - cam.half), LEFT, r"$\mu_n$, roller drives (mirrored)"),
    ):
        for i in range(2 * cycles):
            style, label = "--" if i % 2 else "-", name if i == 0 else None
            ax.plot(np.degrees(s + i * cam.half), np.degrees(mu), color=color, ls=style, label=label)
    ax.set(
        xlabel=r"cam angle from the middle of a stroke [°]",
        ylabel="pressure angle [°]",
        ylim=(0, 90),
        title=f"Pressure angles, M = {cam.M}, N = {cam.N}",
    )
    ax.grid(alpha=0.25)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=8, frameon=False)
    return ax


def load_sharing(cycle: Cycle = CYCLE, ax: Axes | None = None, *, cycles: int = 2) -> Axes:
    """Share of a side wheel's torque that the rollers on the inner and the outer cam carry, over the cam's angle."""
    ax = _axes(ax)
    half = cycle.cam.half
    s = np.linspace(0.0, 2 * half * cycles, 1441)[:-1]
    first, second = cycle.contact_force(s, 1.0, 1.0, cams=1)
    half_stroke, phase = np.divmod(s, half)
    share = first * -cycle.cam.lever_arms(phase - half)[0]
    on_inner = np.where(half_stroke % 2 == 0, share, 1 - share)
    ax.plot(np.degrees(s), on_inner, color=INNER, label="inner cam")
    ax.plot(np.degrees(s), 1 - on_inner, color=OUTER, label="outer cam")
    ax.plot(np.degrees(s), first + second, color="0.4", lw=0.8, label="sum of normal forces, T/R = 1")
    ax.set(xlabel="cam angle [°]", ylabel="share of the torque", title=f"Load sharing, {cycle.sharing}")
    ax.grid(alpha=0.25)
    ax.legend(fontsize=8, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.18))
    return ax


def efficiency(cycle: Cycle = CYCLE, ax: Axes | None = None, *, cycles: int = 2) -> Axes:
    """eta_0 over the cam's angle, turning forward (solid) and backward (dashed); equivalent to kappa = (1 - eta_0)/(1 + eta_0)."""
    ax = _axes(ax)
    s = np.linspace(0.0, 2 * cycle.cam.half * cycles, 1441)
    for sign, style in ((1, "-"), (-1, "--")):
        way = "forward" if sign > 0 else "backward"
        ax.plot(np.degrees(s), cycle.eta_0(sign * s), color=INNER, ls=style, label=way)
    title = f"Efficiency of the relative motion, {cycle.sharing}"
    ax.set(xlabel="cam angle [°]", ylabel=r"$\eta_0$ [1]", title=title)
    ax.grid(alpha=0.25)
    ax.legend(fontsize=8, title="cam turns", ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.18))
    return ax


def contact_pressures(body: CamBody = BODY, ax: Axes | None = None, *, torque: float = 100.0) -> Axes:
    """Hertz's pressure on the inner and the outer cam over the cam's angle, for the torque of one side wheel [N.m]."""
    ax, cycle = _axes(ax), Cycle(body.cam)
    s = np.linspace(0.0, 4 * cycle.cam.half, 1441)
    for values, color, name in zip(body.pressure(cycle, s, torque), (INNER, OUTER), ("inner", "outer"), strict=True):
        ax.plot(np.degrees(s), values / 1e9, color=color, label=f"{name} cam")
    ax.set(
        xlabel="cam angle [°]", ylabel="greatest pressure [GPa]", title=f"Contact under {torque:g} N.m on a side wheel"
    )
    ax.grid(alpha=0.25)
    ax.legend(fontsize=8, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.18))
    return ax


def mechanism(cam: SphericalCam = CAM, theta: float = 0.0, ax: Axes | None = None, *, exploded: float = 0.0) -> Axes:
    """Both conjugate cams and the rollers of both side wheels, seen from the cage, with the left side turned by theta against it [rad].

    The inner cam and its rollers are blue, the outer ones orange; rollers in contact have full colour. ``exploded``: distance of the sides,
    and of the outer cam from the inner one, in radii of the outer cam.
    """
    solid = _solid_axes(ax)
    triangles, colors = mechanism_solids(cam, theta, exploded=exploded)
    solid.add_collection3d(
        Poly3DCollection(list(triangles), facecolors=shaded(triangles, colors), edgecolors="none", antialiased=False)
    )
    reach = 1.0 + exploded
    for sign, name in ((1.0, "right"), (-1.0, "left")):
        solid.plot([sign * 1.05 * reach, sign * 1.3 * reach], [0, 0], [0, 0], color="k", lw=1)
        solid.text(sign * 1.35 * reach, 0, 0, name)
    turned_by = math.degrees(cam.N / cam.M * theta)
    _frame(solid, reach, rf"$\theta$ = {math.degrees(theta):.1f}°, cam {turned_by:.1f}°", below=True)
    return cast(Axes, solid)


def mechanism_solids(
    cam: SphericalCam, theta: float, *, exploded: float = 0.0, points: int = 17
) -> tuple[Array, Array]:
    """The triangles of ``mechanism`` (n, 3, 3), with outer cam radius 1, and their colours (n, 3)."""
    s, parts = cam.N / cam.M * theta, []
    pale = np.array([0.86, 0.86, 0.88])
    for (low, high), name, shift, lift in zip(SIZES, (INNER, OUTER), (0.0, cam.half), (0.0, exploded), strict=True):
        psi, color = s - cam.half - shift, np.array(to_rgb(name))
        up = np.array([0.0, 0.0, lift])
        parts.append((cone_solid(turned(cam.whole_profile(points), psi), low, high, BORE) + up, color))
        cone = cone_solid(_circle(cam), low, high)
        for side, roller in product((0.0, math.pi), range(cam.N)):
            at = psi + side
            axis = turned(cam.roller_axis(at, roller), side)
            outward = np.array([math.copysign(exploded, math.cos(side)), 0.0, 0.0])
            full = color if _touches(cam, at, roller) else 0.35 * color + 0.65 * pale
            parts.append((cone @ _onto(axis).T + outward, full))
    return np.concatenate([p for p, _ in parts]), np.concatenate([np.tile(c, (len(p), 1)) for p, c in parts])


def _onto(axis: Array) -> Array:
    """A rotation that maps z to the axis."""
    x = unit(np.cross(axis, [0.3, 0.5, 0.81]))
    return np.stack([x, np.cross(axis, x), axis], axis=1)


def _circle(cam: CamGeometry, points: int = 20) -> Array:
    turn = np.linspace(0, 2 * math.pi, points, endpoint=False)
    s, c = math.sin(cam.alpha_4), math.cos(cam.alpha_4)
    return np.stack([s * np.cos(turn), s * np.sin(turn), np.full(points, c)], -1)


def _touches(cam: CamGeometry, psi: float, roller: int) -> bool:
    """Whether a roller is in a stroke: its angle from the middle, in strokes of the cam, is less than half a stroke plus sigma."""
    own = psi + cam.half - 2 * cam.half * roller
    around = 2 * cam.half * cam.N
    own = (own + around / 2) % around - around / 2
    return abs(own) <= cam.half + cam.sigma


def _add(solid: Axes3D, parts: list[tuple[Array, str]]) -> None:
    """Draw bodies, opaque and shaded."""
    triangles = np.concatenate([body for body, _ in parts])
    colors = np.concatenate([np.tile(to_rgb(name), (len(body), 1)) for body, name in parts])
    solid.add_collection3d(
        Poly3DCollection(list(triangles), facecolors=shaded(triangles, colors), edgecolors="none", antialiased=False)
    )


def _frame(solid: Axes3D, reach: float, title: str, *, below: bool = False) -> None:
    solid.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach if below else 0.0, reach), title=title)
    solid.set_box_aspect((1, 1, 1 if below else 0.5), zoom=1.45)  # pyright: ignore[reportArgumentType]
    solid.set_axis_off()
    solid.view_init(elev=28, azim=-50)
