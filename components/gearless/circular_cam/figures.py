"""Figures of the circular-cam differential: the mechanism, unrolled and animated, and its curves over the phase."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, cast, get_args

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.axes3d import Axes3D  # type: ignore[import-untyped]

from powertrain.components.gearless.circular_cam.body import cam_solids, roller_solid
from powertrain.components.gearless.circular_cam.contact import track_contacts
from powertrain.components.gearless.circular_cam.design import TABLE_1, TORQUE, CircularCams
from powertrain.components.gearless.circular_cam.forces import forces
from powertrain.components.gearless.circular_cam.locking import (
    critical_angle,
    locking_map,
    single_track_limit,
)
from powertrain.components.gearless.circular_cam.locking_law import Sharing
from powertrain.components.gearless.circular_cam.track import Array, Track, steepest_angle
from powertrain.components.gearless.solids import shaded

MM = 1e3
UPPER, LOWER, WEDGED, IDLE = "tab:blue", "tab:orange", "tab:red", "0.75"
TRACKS = {"outer": "tab:blue", "inner": "tab:orange"}


def _axes(ax: Axes | None) -> Axes:
    return plt.subplots(layout="constrained")[1] if ax is None else ax


def mechanism(
    cams: CircularCams = TABLE_1, theta: float = math.pi / 8, ax: Axes | None = None, *, drive: float = 1.0
) -> Axes:
    """Both tracks developed, as in Fig. 15: the upper cam (left shaft) at theta, the lower cam at -theta, the cage at rest.

    Rollers wedged by a cage torque with the sign of ``drive`` are red, with an arrow for the force of the cage.
    """
    ax = _axes(ax)
    for track, name, height in _rows(cams):
        _track(ax, track, theta, height, drive)
        ax.text(
            -0.16 * cams.outer.D * math.pi * MM,
            height,
            f"{name}\n{_degrees(track.alpha(theta))}",
            ha="right",
            va="center",
            fontsize=9,
        )
    ax.set(xlabel="circumference [mm]", yticks=[], title=rf"$\theta$ = {math.degrees(theta):.1f}°")
    ax.set_xlim(-0.28 * cams.outer.D * math.pi * MM, (cams.outer.D * math.pi + cams.outer.r) * MM)
    ax.set_aspect("equal")
    return ax


def animation(cams: CircularCams = TABLE_1, *, frames: int = 120, drive: float = 1.0) -> FuncAnimation:
    """The mechanism over half a turn of each cam against the cage; with four rollers it then repeats."""
    ax = _axes(None)
    period = 4 * math.pi / cams.outer.n

    def frame(i: int) -> Iterable[Any]:
        ax.clear()
        mechanism(cams, i * period / frames, ax, drive=drive)
        return ax.patches

    assert ax.figure is not None
    return FuncAnimation(ax.get_figure(root=True), frame, frames=frames, interval=50)  # type: ignore[arg-type]


def contact_angles(cams: CircularCams = TABLE_1, ax: Axes | None = None) -> Axes:
    """Contact angles of both tracks over half a turn, with the number of active rollers on top."""
    ax, theta = _axes(ax), np.linspace(0, np.pi, 721)
    for name, track in _named(cams):
        ax.plot(np.degrees(theta), np.degrees(track.alpha(theta)), color=TRACKS[name], label=name)
    top = 1.06 * math.degrees(max(cams.outer.alpha_max, cams.inner.alpha_max))
    rollers = np.arange(cams.outer.n)
    for phase in np.arange(9) * np.pi / 8:
        count = sum(int(track.active(phase, rollers).sum()) for _, track in _named(cams))
        ax.text(math.degrees(phase), top, str(count), ha="center", va="bottom", fontsize=9)
    ax.set(xlabel=r"$\theta$ [°]", ylabel="contact angle [°]", xticks=np.arange(0, 181, 22.5), ylim=(0, 1.15 * top))
    ax.set_title("contact angles, and how many rollers are active", fontsize=10)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=8, frameon=False)
    return ax


def locking_coefficient(cams: CircularCams = TABLE_1, ax: Axes | None = None) -> Axes:
    """Locking coefficient over the phase for each rule of load sharing; the differential locks above the line at 1."""
    ax, theta = _axes(ax), np.linspace(0, 2 * np.pi / cams.outer.n, 722)[1:-1]
    for sharing in get_args(Sharing):
        ax.plot(np.degrees(theta), cams.kappa(theta, sharing), label=sharing)
    ax.axhline(1, color="k", lw=0.8, ls="--")
    ax.text(np.degrees(theta[-1]) / 4, 1.02, "locked above", ha="center", va="bottom", fontsize=9)
    ax.set(xlabel=r"$\theta$ [°]", ylabel=r"$\kappa$ [1]", ylim=(0, 1.6), xlim=(0, np.degrees(theta[-1])))
    ax.set_title(f"locking coefficient, μ = {cams.disk.mu:g}", fontsize=10)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, fontsize=8, frameon=False)
    return ax


def locking_limits(cams: CircularCams = TABLE_1, ax: Axes | None = None, *, sharing: Sharing = "rigid") -> Axes:
    """The locking map of similar tracks over alpha_m and mu: the smallest kappa over all phases, compared with eq. (42).

    The marks are the data of ``cams``: its friction with the maximum angle of either track.
    """
    ax = _axes(ax)
    steepest = min(steepest_angle(track.D, track.r, track.n) for _, track in _named(cams))
    top = min(30.0, 0.999 * math.degrees(steepest))  # steeper tracks cannot be built
    alpha, mu = np.radians(np.linspace(0.5 * top / 30, top, 60)), np.linspace(0.01, 0.4, 80)
    least = locking_map(cams, alpha, mu, sharing)
    levels = [0.1, 0.2, 0.5, 1, 2, 5, 10]
    lines = ax.contour(mu, np.degrees(alpha), least, levels=levels, colors="0.6", linewidths=0.8)
    ax.clabel(lines, [level for level in levels if level != 1], fmt=r"$\kappa$ = %g", fontsize=8)
    ax.contourf(mu, np.degrees(alpha), least, levels=[1, np.inf], colors=["tab:green"], alpha=0.25)
    D_R, D = cams.disk.D_R, cams.outer.D
    ax.plot(
        mu,
        [math.degrees(single_track_limit(D_R, D, m)) for m in mu],
        color="tab:green",
        label="locks at every phase below",
    )
    ax.plot(
        mu, [math.degrees(critical_angle(D_R, D, cams.xi, m)) for m in mu], "k--", label="eq. (42): both tracks carry"
    )
    for name, track in _named(cams):
        ax.plot(
            cams.disk.mu, math.degrees(track.alpha_max), "o", color=TRACKS[name], label=f"{name} track, greatest angle"
        )
    ax.set(xlabel=r"$\mu$ of the disks [1]", ylabel=r"$\alpha_m$ [°]", ylim=(0, top), xlim=(mu[0], mu[-1]))
    ax.set_title(f"locking map, similar tracks, {sharing} sharing", fontsize=10)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=8, frameon=False)
    return ax


def normal_forces(cams: CircularCams = TABLE_1, torque: float = TORQUE, ax: Axes | None = None) -> Axes:
    """Normal forces of an active roller over a cycle with the rigid and the elastic rule."""
    ax, theta = _axes(ax), np.linspace(0, 2 * np.pi / cams.outer.n, 722)[1:-1]
    for sharing, style in (("rigid", "--"), ("elastic", "-")):
        found = forces(cams, theta, torque, "rigid" if sharing == "rigid" else "elastic")
        for name, force in (("outer", found.F_n_out), ("inner", found.F_n_in)):
            ax.plot(np.degrees(theta), force / 1e3, style, color=TRACKS[name], label=f"{name}, {sharing}")
    ax.set(xlabel=r"$\theta$ [°]", ylabel="normal force [kN]", ylim=(0, 25), xlim=(0, np.degrees(theta[-1])))
    ax.set_title(f"on one roller, cage {torque:g} N.m", fontsize=10)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=8, frameon=False)
    return ax


def contact_pressures(
    cams: CircularCams = TABLE_1, torque: float = TORQUE, ax: Axes | None = None, *, hollow: float = 1.1
) -> Axes:
    """Maximum contact pressure over a cycle with elastic sharing: both cams, the exact contact and the equivalent sphere."""
    ax, theta = _axes(ax), np.linspace(0, 2 * np.pi / cams.outer.n, 361)
    found = forces(cams, theta, torque)
    for (name, track), force in zip(_named(cams), (found.F_n_out, found.F_n_in), strict=True):
        concave, convex = track_contacts(track, hollow=hollow)
        colour = TRACKS[name]
        ax.plot(np.degrees(theta), convex.pressure(force) / 1e9, color=colour, label=f"{name}, convex")
        ax.plot(np.degrees(theta), concave.pressure(force) / 1e9, "--", color=colour, label=f"{name}, concave")
        sphere = concave.pressure(force, "sphere") / 1e9
        ax.plot(np.degrees(theta), sphere, ":", color=colour, label=f"{name}, concave, equivalent sphere")
    ax.set(xlabel=r"$\theta$ [°]", ylabel="greatest pressure [GPa]", xlim=(0, np.degrees(theta[-1])))
    ax.set_ylim(bottom=0)
    ax.set_title(f"cage {torque:g} N.m, hollow {hollow:g} r", fontsize=10)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize=8, frameon=False)
    return ax


def centrodes(track: Track = TABLE_1.outer, ax: Axes | None = None) -> Axes:
    """Fig. 9: paths of contact points A and B, the roller's axis and its instantaneous pole over one arc; grey: the roller."""
    ax, theta = _axes(ax), np.linspace(-1, 1, 201) * math.pi / track.n * (1 - 1e-9) - track.phase
    x, upper, lower = track.contacts(theta)
    y, zero = track.axis(theta), np.zeros_like(theta)
    for xs, ys, label in (
        (x, upper, "A on the upper cam"),
        (x, lower, "B on the lower cam"),
        (zero, y, "axis C"),
        (x, y, "pole P"),
    ):
        ax.plot(xs * MM, ys * MM, label=label)
    for height in (y[0], y[y.size // 2]):
        ax.add_patch(Circle((0.0, height * MM), track.r * MM, facecolor="0.5", edgecolor="0.5", alpha=0.12))
    ax.set(xlabel="x against the groove [mm]", ylabel="y [mm]")
    ax.set_aspect("equal")
    ax.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5))
    return ax


def disks(cams: CircularCams = TABLE_1, theta: float = 0.0, ax: Axes | None = None, *, apart: float = 0.03) -> Axes:
    """Figs. 10-12: both cam disks and the rollers between them in space; ``apart``: distance between cams and rollers in the figure [m]."""
    made = plt.figure(layout="constrained").add_subplot(projection="3d") if ax is None else ax
    assert isinstance(made, Axes3D)
    parts: list[tuple[Array, str]] = []
    over = np.array([1.0, -1.0, -1.0])  # half a turn about x
    off = np.array([0.0, 0.0, apart])
    for solid, color in zip(cam_solids(cams), ("tab:blue", "tab:orange"), strict=True):
        parts.append((_spun(solid, -theta) - off, color))
        parts.append((_spun(solid * over, theta + 2 * math.pi / cams.outer.n) + off, color))
    for track, color in ((cams.outer, "tab:blue"), (cams.inner, "tab:orange")):
        roller = roller_solid(track, 0.9 * min((cams.outer.D - cams.inner.D) / 2, 2 * track.r))
        for k in range(track.n):
            height = np.array([0.0, 0.0, float(track.axis(theta, k))])
            parts.append((_spun(roller, 2 * math.pi * k / track.n) + height, color))
    triangles = np.concatenate([part for part, _ in parts]) * MM
    colors = np.concatenate([np.tile(0.3 + 0.7 * np.array(to_rgb(c)), (len(part), 1)) for part, c in parts])
    faces = shaded(triangles, colors)
    made.add_collection3d(Poly3DCollection(list(triangles), facecolors=faces, edgecolors="none", antialiased=False))
    reach = 0.62 * cams.outer.D * MM
    made.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach))
    made.set_box_aspect((1, 1, 1), zoom=1.15)  # pyright: ignore[reportArgumentType]
    made.set_axis_off()
    made.view_init(elev=22, azim=-55)
    made.set_title(rf"$\theta$ = {math.degrees(theta):.1f}°")
    return cast(Axes, made)


def _spun(solid: Array, angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(solid @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def _rows(cams: CircularCams) -> list[tuple[Track, str, float]]:
    gap = (cams.outer.lift / 2 + cams.inner.lift / 2 + 2.2 * (cams.outer.r + cams.inner.r)) * MM
    return [(cams.outer, "outer", gap), (cams.inner, "inner", 0.0)]


def _named(cams: CircularCams) -> list[tuple[str, Track]]:
    return [("outer", cams.outer), ("inner", cams.inner)]


def _degrees(angle: Any) -> str:
    return rf"$\alpha$ = {math.degrees(float(angle)):.1f}°"


def _track(ax: Axes, track: Track, theta: float, height: float, drive: float) -> None:
    """One row: the two cams as bands, grooves, and rollers with a spoke that shows their rotation."""
    length, pitch = math.pi * track.D, math.pi * track.D / track.n
    body = 0.9 * track.r + track.lift / 2
    for side, colour in ((1, UPPER), (-1, LOWER)):
        shift = side * theta * track.D / 2
        curve = np.linspace(-pitch, length, 1200)
        # The upper cam is the lower one mirrored in x.
        x, y = track.surface(side * -(curve - shift), side) if side > 0 else track.surface(curve - shift, side)
        x = -x + shift if side > 0 else x + shift
        order = np.argsort(x)
        x, y = x[order], y[order]
        keep = (x > -0.5 * pitch) & (x < length - 0.5 * pitch)
        far = np.full(int(keep.sum()), side * (track.r + body))
        ax.fill_between(x[keep] * MM, height + y[keep] * MM, height + far * MM, color=colour, alpha=0.45, lw=0)
        ax.plot(x[keep] * MM, height + y[keep] * MM, color=colour, lw=1.2)
    for j in range(track.n):
        at, axis = j * pitch * MM, height + float(track.axis(theta, j)) * MM
        wedged = bool(track.active(theta, j, drive))
        ax.plot([at, at], [height - body * MM, height + body * MM], color="0.4", lw=0.6, ls=":")
        ax.add_patch(Circle((at, axis), track.r * MM, fc=WEDGED if wedged else IDLE, ec="k", lw=0.8, alpha=0.85))
        turned = float(track.turned(theta))
        spoke = np.array([math.sin(turned), math.cos(turned)]) * track.r * MM
        ax.plot([at, at + spoke[0]], [axis, axis + spoke[1]], color="k", lw=0.8)
        if wedged:
            ax.annotate(
                "",
                (at + math.copysign(1.5 * track.r * MM, drive), axis),
                (at, axis),
                arrowprops={"arrowstyle": "-|>", "color": "k", "lw": 1.6},
            )
