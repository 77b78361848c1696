"""Figures of the linkage differential: the mechanism, its motion, shaking forces, forces in the pairs, efficiency, design.

Angles are in degrees, lengths in cm, as in the source. Every function accepts and returns an ``Axes``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import ArrayLike, NDArray

from powertrain.components.gearless.linkage.body import LinkageBody
from powertrain.components.gearless.linkage.curve import cage_turns
from powertrain.components.gearless.linkage.design import DifferentialDuty, Front, guided, over_length, peaks
from powertrain.components.gearless.linkage.forces import Reactions, reactions
from powertrain.components.gearless.linkage.friction import JointFriction
from powertrain.components.gearless.linkage.kinematics import Linkage
from powertrain.components.gearless.linkage.masses import TABLE_5_1, LinkMasses, scaled
from powertrain.components.gearless.linkage.shaking import shaking, turned
from powertrain.components.gearless.solids import shaded

Array = NDArray[np.float64]
CM = 100.0
COLOURS = {"shafts": "0.35", "couplers": "tab:orange", "lever": "tab:blue", "cage": "tab:green"}


def _axes(ax: Axes | None) -> Axes:
    return plt.subplots(layout="constrained")[1] if ax is None else ax


def _over_alpha(ax: Axes, label: str) -> Axes:
    ax.set(xlabel=r"angle of the left shaft against the cage $\alpha$ [°]", ylabel=label, xlim=(0, 360))
    ax.set_xticks(range(0, 361, 90))
    ax.grid(alpha=0.3)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize=8, frameon=False)
    return ax


def _cycle(points: int = 721) -> Array:
    return np.linspace(0, 2 * np.pi, points)


def mechanism(linkage: Linkage | None = None, alpha: float = 0.6, phi: float = 0.0, ax: Axes | None = None) -> Axes:
    """The mechanism in space at one angle, its cage turned by ``phi``: shafts, couplers, lever, and the C axis of the cage.

    ``ax`` is a three-dimensional Axes. The thin line is the path of the left S-pair relative to the cage.
    """
    linkage = linkage or Linkage()
    space: Any = plt.figure(layout="constrained").add_subplot(projection="3d", proj_type="ortho") if ax is None else ax
    p = {name: turned(v, phi) for name, v in linkage.points(alpha).items()}
    size, a = linkage.d + linkage.a, linkage.a
    for side, name in (-1, "left"), (1, "right"):
        end = np.array([side * (size + 0.6 * a), 0.0, 0.0])
        _line(space, [p[f"R_{name}"], end], COLOURS["shafts"], 5, "output shafts" if side < 0 else None)
        _line(
            space, [p[f"R_{name}"], p[f"S_{name}"]], COLOURS["couplers"], 5, "couplers (R-pairs)" if side < 0 else None
        )
        _dot(space, p[f"R_{name}"], "s", COLOURS["shafts"])
        _dot(space, p[f"S_{name}"], "o", "tab:red")
    _line(space, [p["S_left"], p["C"], p["S_right"]], COLOURS["lever"], 6, "lever (S-pairs)")
    axis = turned(np.array([[0, -1.6 * a, 0], [0, 1.6 * a, 0]]), phi)
    _line(space, list(axis), COLOURS["cage"], 2, "C axis in the cage")
    _line(space, list(turned(linkage.points(_cycle(181))["S_left"], phi)), "tab:red", 0.8, None)
    reach = (size + 0.6 * a) * CM
    height = 1.2 * max(1.6 * a, linkage.b * float(np.sin(linkage.theta_max))) * CM
    space.set(xlim=(-reach, reach), ylim=(-height, height), zlim=(-height, height))
    space.set(xlabel="x [cm]", ylabel="y [cm]", zlabel="z [cm]", title=rf"$\alpha$ = {np.degrees(alpha):.0f}°")
    space.locator_params(nbins=5)
    space.set_box_aspect((reach, height, height), zoom=0.95)
    space.view_init(elev=30, azim=-60)
    if space.get_legend() is None:
        space.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2, fontsize=8, frameon=False)
    return cast("Axes", space)


def _line(ax: Any, points: Sequence[Array], colour: str, width: float, label: str | None) -> None:
    x, y, z = np.array(points).T * CM
    ax.plot(x, y, z, color=colour, lw=width, label=label, solid_capstyle="round")


def _dot(ax: Any, point: Array, marker: str, colour: str) -> None:
    x, y, z = point * CM
    ax.plot([x], [y], [z], marker=marker, color=colour, ms=7)


def motion(linkage: Linkage | None = None, ax: Axes | None = None) -> Axes:
    """theta, beta, and on the right the slide S, over one turn of a shaft against the cage (Fig. 5.7)."""
    ax, m = _axes(ax), (linkage or Linkage()).motion(_cycle())
    degrees = np.degrees(m.alpha)
    ax.plot(degrees, np.degrees(m.theta), label=r"lever $\theta$")
    ax.plot(degrees, np.degrees(m.beta), label=r"coupler $\beta$")
    slide = ax.twinx()
    ax.plot([], [], "C2--", label="slide $S$ (right)")
    slide.plot(degrees, m.S * CM, "C2--")
    slide.set_ylabel("slide $S$ of the lever [cm]")
    return _over_alpha(ax, "angle [°]")


def rates(linkage: Linkage | None = None, ax: Axes | None = None, *, u: float = 209.4) -> Axes:
    """Speeds of the lever for a shaft speed ``u`` [rad/s] relative to the cage (Fig. 5.8)."""
    ax, m = _axes(ax), (linkage or Linkage()).motion(_cycle())
    degrees = np.degrees(m.alpha)
    ax.plot(degrees, m.theta1 * u, label=r"lever, turning $d\theta/dt$")
    ax.plot([], [], "C2--", label="sliding $dS/dt$ (right)")
    slide = ax.twinx()
    slide.plot(degrees, m.S1 * u, "C2--")
    slide.set_ylabel("speed of the slide [m/s]")
    return _over_alpha(ax, "angular speed [rad/s]")


def shaking_over_cycle(
    linkage: Linkage | None = None,
    masses: LinkMasses = TABLE_5_1,
    duty: DifferentialDuty | None = None,
    ax: Axes | None = None,
    *,
    moment: bool = False,
) -> Axes:
    """Shaking force (Figs. 5.15, 5.16) or moment about the centre (5.17, 5.18), in axes of the housing, over one internal cycle."""
    ax, degrees = _axes(ax), np.degrees(_cycle(2001))
    values = _shaken(linkage, masses, duty)[1 if moment else 0]
    for i, name in (1, "y"), (2, "z"):
        ax.plot(degrees, values[:, i], lw=1, label=f"along {name}" if not moment else f"about {name}")
    return _over_alpha(ax, "shaking moment about the centre [N.m]" if moment else "shaking force [N]")


def shaking_path(
    linkage: Linkage | None = None,
    masses: LinkMasses = TABLE_5_1,
    duty: DifferentialDuty | None = None,
    ax: Axes | None = None,
) -> Axes:
    """The end of the shaking force in the plane y z of the housing, over one internal cycle (Fig. 5.19)."""
    ax, (force, _) = _axes(ax), _shaken(linkage, masses, duty)
    ax.plot(force[:, 1], force[:, 2], lw=1)
    ax.set(xlabel="shaking force along y [N]", ylabel="shaking force along z [N]", aspect="equal")
    ax.grid(alpha=0.3)
    return ax


def _shaken(linkage: Linkage | None, masses: LinkMasses, duty: DifferentialDuty | None) -> tuple[Array, Array]:
    duty, alpha = duty or DifferentialDuty(), _cycle(2001)
    return shaking(
        linkage or Linkage(), duty.drive(alpha), masses, phi=alpha * float(cage_turns(duty.radius, duty.track))
    )


def _reactions(linkage: Linkage | None, masses: LinkMasses, duty: DifferentialDuty | None) -> Reactions:
    duty = duty or DifferentialDuty()
    return reactions(linkage or Linkage(), duty.drive(_cycle()), masses, crown=duty.torque)


def ball_forces(
    linkage: Linkage | None = None,
    masses: LinkMasses = TABLE_5_1,
    duty: DifferentialDuty | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Forces of the couplers on the lever in its own axes: along the C axis (Fig. 5.21) and across lever and C axis (Fig. 5.20)."""
    ax, linkage = _axes(ax), linkage or Linkage()
    found, theta = _reactions(linkage, masses, duty), linkage.motion(_cycle()).theta
    across = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], -1)
    for name, force, style in ("left", found.S_left, "-"), ("right", found.S_right, "--"):
        degrees = np.degrees(found.drive.alpha)
        ax.plot(degrees, force[:, 1], f"C0{style}", label=f"{name}, along the C axis")
        ax.plot(degrees, np.sum(force * across, -1), f"C1{style}", label=f"{name}, across")
        ax.plot(degrees, np.linalg.norm(force, axis=-1), f"C2{style}", label=f"{name}, resultant")
    return _over_alpha(ax, r"force in the S-pairs [N], $N_1 = N_2$")


def rod_forces(
    linkage: Linkage | None = None,
    masses: LinkMasses = TABLE_5_1,
    duty: DifferentialDuty | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Force (Fig. 5.26) and moment (5.27) of the C-pair on the lever in axes of the cage, without prestress."""
    ax, found = _axes(ax), _reactions(linkage, masses, duty)
    degrees, moments = np.degrees(found.drive.alpha), ax.twinx()
    for i, name in (0, "x"), (2, "z"):
        ax.plot(degrees, found.C_force[:, i], f"C{i}", label=f"force along {name}")
        ax.plot([], [], f"C{i}--", label=f"moment about {name} (right)")
        moments.plot(degrees, found.C_moment[:, i], f"C{i}--")
    moments.set_ylabel("moment in the C-pair [N.m]")
    return _over_alpha(ax, r"force in the C-pair [N], $N_1 = N_2$")


def efficiency(linkage: Linkage | None = None, joints: Sequence[JointFriction] = (), ax: Axes | None = None) -> Axes:
    """eta_0 over alpha; by default for coefficients of friction of 0.02, 0.05 and 0.1 in all joints."""
    ax, alpha = _axes(ax), _cycle()
    for one in joints or [JointFriction(mu, mu, mu, mu) for mu in (0.02, 0.05, 0.1)]:
        values = {name: getattr(one, f"mu_{name}") for name in ("shaft", "pin", "ball", "rod")}
        label = ", ".join(f"{name} {mu:g}" for name, mu in values.items())
        if len(set(values.values())) == 1:
            label = f"{one.mu_shaft:g} in all joints"
        ax.plot(np.degrees(alpha), one.eta_0(linkage or Linkage(), alpha), label=rf"$\mu$: {label}")
    return _over_alpha(ax, r"efficiency from side to side, cage held, $\eta_0$ [1]")


def forces_over_length(
    lengths: ArrayLike = (0.01, 0.015, 0.02, 0.025, 0.03, 0.035, 0.04),
    duty: DifferentialDuty | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Maximum forces in S-pairs (Fig. 6.2) and C-pair (6.3) over a at a/b = 0.5176, and the shaking force on the right."""
    ax, found = _axes(ax), over_length(lengths, duty=duty)
    for name, label in ("ball_force", "S-pair"), ("rod_force", "C-pair"):
        ax.plot(found["a"] * CM, found[name], marker=".", label=label)
    ax.plot([], [], "C2--", label="shaking force (right)")
    right = ax.twinx()
    right.plot(found["a"] * CM, found["shaking_force"], "C2--")
    right.set_ylabel("greatest shaking force [N]")
    ax.set(xlabel="length of the couplers a [cm]", ylabel="greatest force [N]", ylim=(0, None))
    ax.grid(alpha=0.3)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, fontsize=8, frameon=False)
    return ax


def front(found: Front, ax: Axes | None = None) -> Axes:
    """A Pareto front with the lengths a of its designs, and the designs of the source (3/6 cm, 3/5.8 cm) for comparison."""
    ax, (first, second) = _axes(ax), found.objectives
    x, y = found.values(first), found.values(second)
    ax.plot(x, y, "o-", label="front")
    for i in range(0, len(x), 2):
        ax.annotate(
            f"a = {found.designs[i].a * CM:.1f} cm", (x[i], y[i]), textcoords="offset points", xytext=(6, 4), fontsize=8
        )
    source: list[tuple[str, Linkage, Any]] = [("3/6 cm", Linkage(), "s"), ("3/5.8 cm", guided(), "^")]
    for name, linkage, marker in source:
        one = peaks(linkage, scaled(linkage))
        ax.plot(getattr(one, first), getattr(one, second), marker, color="tab:red", label=name)
    units = {"force": "N", "moment": "N.m"}
    for axis, name in (ax.set_xlabel, first), (ax.set_ylabel, second):
        text = name.replace("ball", "S-pair").replace("rod", "C-pair").replace("_", " ")
        axis(f"greatest {text} [{units[name.rpartition('_')[2]]}]")
    ax.grid(alpha=0.3)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, fontsize=8, frameon=False)
    return ax


PARTS = {"coupler": "tab:orange", "shaft": "0.55", "lever": "tab:blue", "rod": "tab:green"}


def solid_mechanism(body: LinkageBody | None = None, alpha: float = 0.6, ax: Axes | None = None) -> Axes:
    """The parts as shaded solids: lever blue, couplers orange, output shafts grey, the cage's rod of the C-pair green."""
    body = body or LinkageBody(Linkage())
    space: Any = plt.figure(layout="constrained").add_subplot(projection="3d", proj_type="ortho") if ax is None else ax
    solids = body.solids(alpha)
    triangles = np.concatenate(list(solids.values())) * CM
    tints = [np.tile(0.25 + 0.75 * np.array(to_rgb(PARTS[n.split()[0]])), (len(t), 1)) for n, t in solids.items()]
    faces = shaded(triangles, np.concatenate(tints))
    space.add_collection3d(Poly3DCollection(list(triangles), facecolors=faces, edgecolors="none", antialiased=False))
    reach = np.abs(triangles).max(axis=(0, 1))
    space.set(**{f"{n}lim": (-r, r) for n, r in zip("xyz", reach, strict=True)})
    space.set_box_aspect(tuple(reach), zoom=1.3)
    space.set_axis_off()
    space.view_init(elev=24, azim=-62)
    space.set_title(rf"$\alpha$ = {np.degrees(alpha):.0f}°", y=0.92)
    return cast("Axes", space)
