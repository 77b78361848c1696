"""Free bodies of the papers, to scale from the components' own forces: Provatidis Figs. 13, 14; Madhavan Figs. 5.22, 5.25."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from powertrain.components.gearless.circular_cam import TABLE_1, TORQUE
from powertrain.components.gearless.circular_cam.forces import forces
from powertrain.components.gearless.linkage.forces import Drive, reactions
from powertrain.language.reals import Array
from powertrain.reproductions.drawing import panels
from powertrain.reproductions.madhavan_data import DUTY, LINKAGE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, Rectangle

CAGE, CAM, SUM = "C3", "C0", "0.35"
CM = 1e2


def _force(
    ax: Axes, at: ArrayLike, force: ArrayLike, scale: float, label: str, colour: str, *, pushes: bool = False
) -> None:
    """An arrow from where the force acts, or (``pushes``) to it, with its size at the free end, or below where it is level."""
    vector = np.asarray(force, float) * scale
    start = np.asarray(at, float) - (vector if pushes else 0.0)
    if np.linalg.norm(vector) < 1e-12:
        return
    arrow = {"arrowstyle": "-|>", "color": colour, "lw": 2.0, "shrinkA": 0, "shrinkB": 0}
    tip = start + vector
    ax.annotate("", (tip[0], tip[1]), (start[0], start[1]), arrowprops=arrow, zorder=5)
    outward = -vector if pushes else vector
    level, upright = (abs(outward[k]) > 3 * abs(outward[1 - k]) for k in (0, 1))
    place = start + vector / 2 if level else start if pushes else tip
    side = "center" if upright or level else "left" if outward[0] > 0 else "right"
    above = not level and outward[1] > 0
    ax.annotate(
        label,
        (place[0], place[1]),
        (0, 5 if above else -7),
        textcoords="offset points",
        color=colour,
        fontsize=8,
        ha=side,
        va="bottom" if above else "top",
        zorder=6,
    )


def _turn(
    ax: Axes, at: ArrayLike, radius: float, sense: float, label: str, colour: str, *, left: float | None = None
) -> None:
    """An arc for a moment, counter-clockwise where ``sense`` is positive; its text begins at ``left``, else it is centred."""
    centre = np.asarray(at, float)
    angles = np.radians(np.linspace(20, 160, 40))[:: 1 if sense > 0 else -1]
    x, y = centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)
    ax.plot(x, y, color=colour, lw=1.8)
    ax.annotate("", (x[-1], y[-1]), (x[-3], y[-3]), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.8})
    x, side = (centre[0], "center") if left is None else (left, "left")
    ax.text(x, centre[1] + 1.08 * radius, label, color=colour, fontsize=8, ha=side, va="bottom")


def roller_and_cam() -> Figure:
    """Provatidis Figs. 13, 14: an outer roller between its cams, and the upper cam disk, at the phase of 22.5° of Table 1."""
    found = forces(TABLE_1, np.array([math.pi / 8]), TORQUE, "rigid")
    figure, axes = panels(
        ["Fig. 13c: roller", "Fig. 14: the roller's force on the upper cam", "Fig. 13b: upper disk"], 3, 4.4, 4.4
    )
    alpha, F_u, F_n, P = (float(x[0]) for x in (found.alpha_out, found.F_u_out, found.F_n_out, found.P_ax_out))
    _roller(axes[0], alpha, F_u, F_n)
    scale = 1 / P
    _force(axes[1], (0, 0), (F_u / 2, P), scale, f"{24 * chr(160)}$F_n$ = {F_n:.0f} N", CAM)
    _force(axes[1], (0, 0), (F_u / 2, 0), scale, f"$F_u/2$ = {F_u / 2:.0f} N", CAGE)
    _force(axes[1], (0, 0), (0, P), scale, f"$P_{{ax}}$ = {P:.0f} N{24 * chr(160)}", SUM)
    _bare(axes[1], 1.0)
    axes[1].set_ylim(-0.2, 1.25)
    _disk(axes[2], P, float(found.P_ax_in[0]), float(found.F_ax[0]), float(found.M_cam[0]))
    return figure


def _roller(ax: Axes, alpha: float, F_u: float, F_n: float) -> None:
    """In units of its radius: the cams' forces along the normals of both contacts, the cage's at the centre."""
    scale = 2.0 / F_n
    ax.add_patch(_circle(1.0))
    for side, name in ((1, "upper"), (-1, "lower")):
        push = np.array([-math.sin(alpha), -side * math.cos(alpha)])
        contact, tangent = -push, np.array([-push[1], push[0]])
        ends = np.stack([contact - 1.3 * tangent, contact + 1.3 * tangent])
        ax.plot(ends[:, 0], ends[:, 1], color=CAM, lw=1.2)
        _force(ax, contact, push * F_n, scale, f"$F_n$ = {F_n:.0f} N, {name} cam", CAM, pushes=True)
    _force(ax, (0, 0), (F_u, 0), scale, f"$F_u$ = {F_u:.0f} N", CAGE)
    ax.plot(0, 0, "ko", ms=4)
    ax.text(-3.3, 0, f"$F_u = 2 F_n \\sin\\alpha$\nα = {math.degrees(alpha):.2f}°", fontsize=9, va="center")
    _bare(ax, 3.6)


def _disk(ax: Axes, outer: float, inner: float, total: float, moment: float) -> None:
    """The upper cam disk: two wedged rollers of each track push it up, the friction disk holds it."""
    ax.add_patch(_block(1.0, 0.18))
    scale = 0.9 / outer
    for x in (-0.8, 0.8):
        _force(ax, (x, 0), (0, outer), scale, f"{outer:.0f} N", CAM, pushes=True)
    for x in (-0.35, 0.35):
        _force(ax, (x, 0), (0, inner), scale, f"{inner:.0f} N", "C1", pushes=True)
    _force(ax, (0, 0.36), (0, -total), 0.45 * scale, f"friction disk: $F_{{ax}}$ = {total:.0f} N", SUM, pushes=True)
    _turn(ax, (0.72, 0.42), 0.3, 1, f"$M$ = {moment:.0f} N.m", CAGE)
    ax.text(0, -1.25, "$P_{ax}$ of the wedged rollers: outer track blue, inner one orange", fontsize=8, ha="center")
    _bare(ax, 1.4)
    ax.set_ylim(-1.35, 1.65)


def lever_and_cage() -> Figure:
    """Madhavan Figs. 5.22, 5.25: lever and cage under 200 N.m at rest, at 40° of the input shaft against the cage.

    Seen across and along the C axis; axial forces of the couplers equal (the convention for what is indeterminate). Forces balance: their
    sums are zero to rounding.
    """
    alpha = math.radians(40)
    found = reactions(LINKAGE, Drive.at([alpha]), crown=DUTY.torque)
    motion = LINKAGE.motion(np.array([alpha]))
    theta, S = float(motion.theta[0]), float(motion.S[0])
    along, axis = np.array([math.cos(theta), 0.0, -math.sin(theta)]), np.array([0.0, 1.0, 0.0])
    across = np.cross(axis, along)
    b = LINKAGE.b
    points = LINKAGE.points(alpha)
    centre = (points["S_left"] + points["S_right"]) / 2
    figure, axes = panels(
        ["Fig. 5.22: lever, along the C axis", "Fig. 5.22: lever, from above", "Fig. 5.25: cage; blue: from the lever"],
        3,
        4.6,
        5.2,
    )
    acting = {"coupler": [(points[f"S_{s}"] - centre, getattr(found, f"S_{s}")[0]) for s in ("left", "right")]}
    C_force, C_moment = found.C_force[0], found.C_moment[0]
    largest = max(float(np.linalg.norm(f)) for _, f in acting["coupler"])
    scale = 0.9 * b * CM / largest
    for ax, second, name in ((axes[0], across, "z"), (axes[1], axis, "x")):
        ax.plot([-b * CM, b * CM], [0, 0], color="0.75", lw=9, solid_capstyle="round", zorder=1)
        for at, force in (*acting["coupler"], (np.zeros(3), C_force)):
            part = np.array([force @ along, force @ second])
            place = np.array([at @ along, at @ second]) * CM
            colour = CAGE if not at.any() else CAM
            who = "cage" if not at.any() else "coupler"
            _force(ax, place, part, scale, f"{np.linalg.norm(part):.0f} N, {who}", colour)
            ax.plot(*place, "o", color="k", ms=5, zorder=6)
        ax.set(xlabel="along the lever  [cm]", ylabel=f"local {name}  [cm]")
        _bare(ax, 2.4 * b * CM, keep=True)
    moment = float(C_moment @ across)  # the second picture looks against this axis
    _turn(axes[1], (0, 0.9 * b * CM), 0.4 * b * CM, -moment, f"$M_z$ = {abs(moment):.1f} N.m, cage", CAGE)
    _cage(axes[2], -C_force, -C_moment, S)
    return figure


def _cage(ax: Axes, force: Array, moment: Array, S: float) -> None:
    """The cage seen along the axle: force and moment of the C-pair, the torque of the crown wheel, bearings."""
    radius = 6.0
    ax.add_patch(_circle(radius))
    scale = 3.0 / float(np.linalg.norm(force[1:]))
    _force(ax, (S * CM, 0), force[1:], scale, f"$F_z$ = {abs(force[2]):.0f} N", CAM)
    _force(ax, (0, 0), -force[1:], scale, f"{abs(force[2]):.0f} N, bearings", SUM)
    ax.plot([S * CM], [0], "ko", ms=5)
    ax.annotate("", (S * CM, -1.2), (0, -1.2), arrowprops={"arrowstyle": "<->", "color": "0.3"})
    ax.text(-0.3, -1.2, f"S = {S * CM:.2f} cm", ha="right", va="center", fontsize=8)
    _turn(ax, (S * CM, 0), 1.8, float(moment[0]), f"$M_x$ = {abs(float(moment[0])):.0f} N.m", CAM, left=0.9)
    torque = -(float(moment[0]) + S * float(force[2]))
    _turn(ax, (0, 0), radius + 1.0, torque, f"$\\tau$ = {abs(torque):.0f} N.m, crown wheel", CAGE)
    ax.set(xlabel="y  [cm]", ylabel="z  [cm]")
    _bare(ax, 10.5, keep=True)


def _circle(radius: float) -> Circle:
    from matplotlib.patches import Circle

    return Circle((0, 0), radius, fc="0.93", ec="k", lw=1.0, zorder=1)


def _block(width: float, height: float) -> Rectangle:
    from matplotlib.patches import Rectangle

    return Rectangle((-width, 0), 2 * width, 2 * height, fc="0.93", ec="k", lw=1.0, zorder=1)


def _bare(ax: Axes, reach: float, *, keep: bool = False) -> None:
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    ax.set_aspect("equal")
    if not keep:
        ax.set_axis_off()
