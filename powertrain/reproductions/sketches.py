"""Sketches of the reproduced papers: Madhavan Figs. 3.1, 3.6 (mechanisms), A.1, B.1-B.4; Chaudhary Fig. 6."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from powertrain.components.gearless.linkage.masses import CYLINDERS
from powertrain.components.gearless.linkage.synthesis import Coupling
from powertrain.components.gearless.linkage.synthesis_evaluation import synthesize
from powertrain.reproductions.drawing import panels
from powertrain.reproductions.madhavan_data import DUTY
from powertrain.reproductions.madhavan_synthesis import PRINTED, WHOLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Point = tuple[float, float]
LINK = {"color": "0.35", "lw": 3, "solid_capstyle": "round", "zorder": 2}
CM = 1e2


def singular_points() -> Figure:
    """Madhavan Fig. 3.1: a planar coupling of six links in general position, and at a singular point with both ways to go on."""
    figure, axes = panels(["in motion", "singular: A and B on a-a"], 2, 4.6, 3.2)
    short, long = 1.0, 1.8
    for ax, angles in ((axes[0], (0.9,)), (axes[1], (0.0, 0.45))):
        ax.plot([-0.6, 3.3], [0, 0], color="0.6", lw=0.8, ls="-.")
        ax.text(3.3, 0.08, "a-a", fontsize=8, ha="right")
        for faint, angle in enumerate(angles):
            A, B = (np.array([short * math.cos(angle), s * short * math.sin(angle)]) for s in (1, -1))
            C = np.array([A[0] + math.sqrt(long**2 - A[1] ** 2), 0.0])
            for one, other in ((np.zeros(2), A), (np.zeros(2), B), (A, C), (B, C)):
                ax.plot(*np.stack([one, other]).T, **{**LINK, "alpha": 0.35 if faint else 1.0})  # type: ignore[arg-type]
            for point, name in ((np.zeros(2), "O"), (A, "A"), (B, "B"), (C, "C")):
                ax.plot(*point, "o", ms=7, mfc="white", mec="k", zorder=3, alpha=0.35 if faint else 1.0)
                if not faint:
                    below = name == "B" or (angle == 0 and name == "A")
                    said = "A, B" if angle == 0 and name == "A" else "" if angle == 0 and name == "B" else name
                    ax.text(
                        point[0],
                        point[1] + (-0.14 if below else 0.14),
                        said,
                        ha="center",
                        va="top" if below else "bottom",
                    )
            slider = np.array([[-0.22, -0.12], [0.22, -0.12], [0.22, 0.12], [-0.22, 0.12], [-0.22, -0.12]]) + C
            ax.plot(*slider.T, color="k", lw=1, alpha=0.35 if faint else 1.0)
        ax.set_aspect("equal")
        ax.set_axis_off()
        ax.set_ylim(-1.2, 1.2)
    said = "OB may go on against OA (1:-1) or with it (1:1)"
    axes[1].text(1.2, -1.0, said, ha="center", fontsize=9)
    return figure


def mechanisms() -> Figure:
    """Madhavan Fig. 3.6: the six couplings with the signs of their joints; the lever above, both shafts in the cage below."""
    found = synthesize()
    couplings = sorted(found.couplings, key=lambda c: [WHOLE.get(n, n) for n in PRINTED].index(c.name))
    figure, axes = panels([""] * len(couplings), 3, 4.0, 3.0)
    for k, (ax, coupling) in enumerate(zip(axes, couplings, strict=True), 1):
        sketch(coupling, ax)
        rejected = coupling in found.problems and bool(found.problems[coupling])
        ax.set_title(
            f"{k}. {coupling.name}: {'rejected' if rejected else 'accepted'}",
            color="C3" if rejected else "k",
            fontsize=10,
        )
    return figure


def sketch(coupling: Coupling, ax: Axes) -> None:
    """Links as lines and joints by their signs: R a ring, P a box, C a box with a line through it, S a ball, Bc a ball in a tube."""
    middle = (0.0, 1.6)
    for sense, joints in ((-1, coupling.input_side), (1, coupling.output_side)):
        last = len(joints) - 1
        places = [(sense * (2.2 - 1.0 * k / last), 1.6 * (k / last) ** 0.8) for k in range(last + 1)]
        ax.plot([sense * 3.0, places[0][0]], [0, 0], **LINK)  # type: ignore[arg-type]
        for one, other in pairwise([*places, middle]):
            ax.plot([one[0], other[0]], [one[1], other[1]], **LINK)  # type: ignore[arg-type]
        for joint, place in zip(joints, places, strict=True):
            _sign(ax, joint.name, place, outward=sense)
    ax.plot([0, 0], [1.6, 0.0], **{**LINK, "color": "0.7"})  # type: ignore[arg-type]
    ax.plot([-2.2, 2.2], [-0.35, -0.35], color="k", lw=1.2)
    for x in np.linspace(-2.1, 2.1, 15):
        ax.plot([x, x - 0.12], [-0.35, -0.52], color="k", lw=0.8)
    for x in (-2.2, 0.0, 2.2):
        ax.plot([x, x], [-0.35, 0.0], color="k", lw=1.2)
    ax.text(0.0, -0.75, "cage", ha="center", va="top", fontsize=8)
    _sign(ax, coupling.middle.name, middle, outward=0)
    ax.set(xlim=(-3.2, 3.2), ylim=(-1.1, 2.3))
    ax.set_aspect("equal")
    ax.set_axis_off()


def _sign(ax: Axes, name: str, place: Point, *, outward: int) -> None:
    """The sign of a joint, with its letter outside of it."""
    from matplotlib.patches import Circle, Rectangle

    x, y = place
    if name in ("P", "C", "Bc"):
        ax.add_patch(Rectangle((x - 0.24, y - 0.13), 0.48, 0.26, fc="white", ec="k", lw=1.2, zorder=3))
    if name == "C":
        ax.plot([x - 0.36, x + 0.36], [y, y], color="k", lw=1.0, zorder=4)
    if name in ("S", "Bc"):
        ax.add_patch(Circle(place, 0.11, fc="C0", ec="k", lw=1.0, zorder=4))
    if name == "S":
        ax.add_patch(Circle(place, 0.19, fc="none", ec="k", lw=1.2, zorder=4))
    if name == "R":
        ax.add_patch(Circle(place, 0.15, fc="white", ec="k", lw=1.4, zorder=4))
    ax.text(
        x + 0.36 * outward, y + (0.3 if outward == 0 else 0.12), name, ha="center", va="bottom", fontsize=9, color="C0"
    )


def bend_and_bodies() -> Figure:
    """Madhavan Fig. A.1 to scale, and Figs. B.1-B.4: the cylinders that Table 5.1 is the result of, with their axes."""
    figure, axes = panels(
        ["Fig. A.1: vehicle in a bend", "Fig. B.2: coupler", "Fig. B.3: lever", "Figs. B.1, B.4: cage"], 2, 5.0, 3.4
    )
    ax = axes[0]
    for side, name, colour in ((0.0, "V_0", "k"), (0.5, "V_2", "C0"), (-0.5, "V_6", "C1")):
        radius = DUTY.radius + side * DUTY.track
        angles = np.radians(np.linspace(0, 32, 60))
        ax.plot(
            radius * np.cos(angles), radius * np.sin(angles), color=colour, lw=1.0, ls="--" if name == "V_0" else "-"
        )
        speed = 0.32 * radius
        ax.annotate("", (radius, speed), (radius, 0), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2})
        ax.text(radius, speed + 0.05, f"${name}$", color=colour, ha="center", va="bottom")
    ax.plot([0, DUTY.radius + DUTY.track / 2], [0, 0], color="0.5", lw=0.9)
    ax.plot(0, 0, "k+", ms=10)
    ax.text(DUTY.radius / 2, 0.12, f"$R_{{curve}}$ = {DUTY.radius:g} m", ha="center")
    ax.annotate(
        "", (DUTY.radius + DUTY.track / 2, -0.7), (DUTY.radius - DUTY.track / 2, -0.7), arrowprops={"arrowstyle": "<->"}
    )
    ax.text(DUTY.radius, -0.8, f"x = {DUTY.track:g} m", ha="center", va="top")
    ax.set_ylim(bottom=-1.4)
    ax.set_aspect("equal")
    ax.set_axis_off()
    pairs = {"coupler": ("A: R", "B: S"), "lever": ("A: S", "B: C", "C: S"), "cage": ()}
    for ax, (name, marks) in zip(axes[1:], pairs.items(), strict=True):
        radius, length, inner = (v * CM for v in CYLINDERS[name])
        _cylinder(ax, (radius, length, inner), marks, "x" if name == "cage" else "y")
    return figure


def _cylinder(ax: Axes, measures: tuple[float, float, float], marks: tuple[str, ...], axis: str) -> None:
    """A cylinder from the side, its axis horizontal, with its measures in cm; pairs stand 1.5 cm from the ends."""
    from matplotlib.patches import Ellipse, Rectangle

    radius, length, inner = measures
    half, flat = length / 2, 0.35 * radius
    ax.add_patch(Rectangle((-half, -radius), length, 2 * radius, fc="0.92", ec="k"))
    ax.add_patch(Ellipse((half, 0), 2 * flat, 2 * radius, fc="0.85", ec="k"))
    if inner:
        ax.add_patch(Ellipse((half, 0), 2 * flat * inner / radius, 2 * inner, fc="white", ec="k"))
    ax.plot([-half - 0.15 * length, half + 0.25 * length], [0, 0], color="0.4", lw=0.8, ls="-.")
    ax.text(half + 0.26 * length, 0, axis, va="center")
    ax.annotate("", (0, 1.9 * radius), (0, 0), arrowprops={"arrowstyle": "-|>", "color": "0.4"})
    ax.text(0.01 * length, 1.9 * radius, "z", va="bottom")
    for x, mark in zip(np.linspace(-half + 1.5, half - 1.5, len(marks)), marks, strict=True):
        ax.plot(x, 0, "ko", ms=4)
        ax.text(x, 0.15 * radius, mark, ha="center", va="bottom", fontsize=9)
    ax.annotate("", (half, -1.5 * radius), (-half, -1.5 * radius), arrowprops={"arrowstyle": "<->"})
    hollow = f", inner radius {inner:g} cm" if inner else ""
    ax.text(0, -1.6 * radius, f"{length:g} cm, radius {radius:g} cm{hollow}", ha="center", va="top", fontsize=9)
    ax.set(xlim=(-0.72 * length, 0.85 * length), ylim=(-2.6 * radius, 2.4 * radius))
    ax.set_aspect("equal")
    ax.set_axis_off()


def automotive_differential() -> Figure:
    """Chaudhary Fig. 6 as a stick diagram of the upper half.

    The engine drives the sun of the planetary final drive; its ring is held, its carrier is one with the differential's case; a bevel
    pinion and side gears on the half shafts.
    """
    figure, (ax,) = panels([""], 1, 8.0, 3.8)

    def line(*points: Point, width: float = 1.6, colour: str = "k") -> None:
        ax.plot([p[0] for p in points], [p[1] for p in points], color=colour, lw=width, solid_capstyle="butt")

    def gear(x: float, low: float, high: float, colour: str = "C0") -> None:
        line((x, low), (x, high), width=5, colour=colour)

    ax.axhline(0, color="0.6", lw=0.8, ls="-.")
    line((-4.2, 0.55), (-1.9, 0.55), (-1.9, 0.6))
    gear(-1.9, 0.55, 0.9)
    gear(-1.9, 0.95, 1.55, "C1")
    gear(-1.9, 1.6, 1.75)
    line((-1.9, 1.75), (-1.9, 2.1))
    for x in np.linspace(-2.15, -1.7, 5):
        line((x, 2.1), (x + 0.1, 2.22), width=0.8)
    line((-2.2, 2.1), (-1.6, 2.1))
    line((-2.1, 1.25), (-1.4, 1.25), (-1.4, 0.3), (-0.6, 0.3), (-0.6, 1.5), (1.9, 1.5), (1.9, 0.3))
    line((0.5, 1.5), (0.5, 0.75))
    line((0.2, 0.75), (0.8, 0.75), width=5, colour="C1")
    line((0.05, 0.68), (0.05, 0.2), width=5, colour="C0")
    line((0.95, 0.68), (0.95, 0.2), width=5, colour="C0")
    line((0.05, 0.08), (-4.2, 0.08), width=2.4)
    line((0.95, 0.08), (4.0, 0.08), width=2.4)
    line((0.05, 0.2), (0.05, 0.08))
    line((0.95, 0.2), (0.95, 0.08))
    for x, y, said in (
        (-4.2, 0.62, "from the engine"),
        (-2.4, 0.72, "sun"),
        (-2.75, 1.2, "planets"),
        (-3.0, 1.65, "ring, held"),
        (-1.32, 1.0, "carrier"),
        (-0.5, 1.56, "case"),
        (0.58, 0.95, "pinion"),
        (1.05, 0.42, "side gear"),
        (2.4, 0.16, "right half shaft"),
        (-4.2, 0.16, "left half shaft"),
    ):
        ax.text(x, y, said, fontsize=9)
    ax.set(xlim=(-4.4, 4.2), ylim=(-0.2, 2.4))
    ax.set_axis_off()
    return figure
