"""Figures of Madhavan 1996, chapters 5-7, that the component does not draw itself.

The text at hand has the captions only; the curves are those of the model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from powertrain.components.gearless.linkage import in_bend, ratio_from_theta
from powertrain.components.gearless.linkage.design import alternate
from powertrain.components.gearless.linkage.forces import Drive, Reactions, reactions
from powertrain.components.gearless.linkage.shaking import shaking
from powertrain.language.reals import Array
from powertrain.reproductions.drawing import panels
from powertrain.reproductions.madhavan_data import CYCLE, DUTY, LINKAGE, W_COUPLING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ALPHA_TEXT = "α, input shaft against the cage  [°]"


def _curves(ax: Axes, x: Array, lines: Mapping[str, Array], xlabel: str, ylabel: str) -> None:
    for label, y in lines.items():
        ax.plot(x, y, label=label or None)
    ax.set(xlabel=xlabel, ylabel=ylabel, xlim=(x[0], x[-1]))
    ax.grid(alpha=0.25)
    if any(lines):
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3, fontsize=8, frameon=False)


PRESTRESS = 200.0
"""Axial force [N] of couplers that are fitted a little too long, by which the figures show what statics leaves open."""


def _over_alpha(ax: Axes, lines: Mapping[str, Array], ylabel: str) -> None:
    _curves(ax, np.degrees(CYCLE), lines, ALPHA_TEXT, ylabel)
    ax.set_xticks(np.arange(0, 361, 90))


def wheel_speeds() -> Figure:
    """Fig. 5.10, and the same over the curvature of the bend."""
    figure, axes = panels(["Fig. 5.10: speeds in the bend of 7 m", "over the curvature"])
    bend = in_bend(DUTY.w, DUTY.radius, DUTY.track)
    time = np.array([0.0, 2 * math.pi / bend.differential])
    values = {"$\\omega_2$, outer wheel": bend.outer, "cage": DUTY.w, "$\\omega_6$, inner wheel": bend.inner}
    _curves(axes[0], time, {name: np.full(2, w) for name, w in values.items()}, "t  [s]", "speed  [rad/s]")
    curvature = np.linspace(1e-9, 0.3, 50)
    found = [in_bend(DUTY.w, 1 / k, DUTY.track) for k in curvature]
    lines = {"outer": np.array([s.outer for s in found]), "inner": np.array([s.inner for s in found])}
    _curves(axes[1], curvature, lines, "1/R  [1/m]", "speed  [rad/s]")
    return figure


def coupling_forces() -> Figure:
    """Figs. 5.11-5.14."""
    drive = Drive.at(CYCLE, u=W_COUPLING)
    shaken, found = shaking(LINKAGE, drive), reactions(LINKAGE, drive, right=0.0)
    titles = [
        "Fig. 5.11: shaking force",
        "Fig. 5.12: shaking moment about the centre",
        "Fig. 5.13: C-pair on the lever, X",
        "Fig. 5.14: C-pair on the lever, Z",
    ]
    figure, axes = panels(titles)
    _over_alpha(axes[0], {"Y": shaken.force[:, 1]}, "force  [N]")
    _over_alpha(axes[1], {"Y": shaken.moment[:, 1]}, "moment  [N.m]")
    _over_alpha(axes[2], {"by the convention of equal axial forces": found.C_force[:, 0]}, "force  [N]")
    low, high = (found.with_prestress(N).C_force[:, 0] for N in (-PRESTRESS, PRESTRESS))
    said = f"indeterminate: couplers fitted under ±{PRESTRESS:g} N"
    axes[2].fill_between(np.degrees(CYCLE), low, high, color="C0", alpha=0.2, label=said)
    axes[2].set_ylim(-1.2 * PRESTRESS / 2, 2 * PRESTRESS / 2)
    axes[2].legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2, fontsize=8, frameon=False)
    _over_alpha(axes[3], {"": found.C_force[:, 2]}, "force  [N]")
    return figure


def _loaded() -> Reactions:
    return reactions(LINKAGE, DUTY.drive(CYCLE), crown=DUTY.torque)


def lever_forces() -> Figure:
    """Figs. 5.23 and 5.24, in local axes of the lever: x along the C axis, y along the lever."""
    found = _loaded()
    theta = LINKAGE.motion(CYCLE).theta
    zero = np.zeros_like(theta)
    x = np.array([0.0, 1.0, 0.0])
    z = np.cross(x, np.stack([np.cos(theta), zero, -np.sin(theta)], -1))

    def along(v: Array, axis: Array) -> Array:
        return np.asarray(np.sum(v * axis, -1))

    figure, axes = panels(["Fig. 5.23: C-pair, local z", "Fig. 5.24: C-pair, moment about local z"])
    _over_alpha(axes[0], {"": along(found.C_force, z)}, "force on the lever  [N]")
    _over_alpha(axes[1], {"": along(found.C_moment, z)}, "moment on the lever  [N.m]")
    return figure


def cage_forces() -> Figure:
    """Fig. 5.28 and eq. (5.50), in axes of the cage."""
    found = _loaded()
    F, M = -found.C_force, -found.C_moment
    S = LINKAGE.motion(CYCLE).S
    figure, axes = panels(["Fig. 5.28: force of the C-pair on the cage", "eq. (5.50): torque of the lever on the cage"])
    axes[0].plot(F[:, 0], F[:, 2])
    axes[0].set(xlabel="x, equal axial forces  [N]", ylabel="z  [N]")
    lines = {"$M_x$": M[:, 0], "$F_z S$": S * F[:, 2], "$M_x + F_z S$": M[:, 0] + S * F[:, 2]}
    _over_alpha(axes[1], lines, "moment  [N.m]")
    return figure


def greatest_angle() -> Figure:
    """Fig. 6.1."""
    theta = np.radians(np.linspace(1, 179, 179))
    ratio = np.array([ratio_from_theta(float(t)) for t in theta])
    figure, axes = panels(["Fig. 6.1: greatest angle of the lever"], 1, 6.0, 3.6)
    _curves(axes[0], ratio, {"": np.degrees(theta)}, "a/b  [1]", "$\\theta_{max}$  [°]")
    return figure


def coupler_swing() -> Figure:
    """Fig. 7.1 as curves: the swing of the couplers in both designs."""
    figure, (ax,) = panels(["Fig. 7.1, Table 7.1: swing of the couplers"], 1, 6.0, 3.6)
    lines = {
        name: np.degrees(one.motion(CYCLE).beta)
        for name, one in (("previous design", LINKAGE), ("new design", alternate(LINKAGE)))
    }
    _over_alpha(ax, lines, "β  [°]")
    return figure
