"""Chaudhary, Angeles & Morozov 2014: Tables 1 and 2, the choice of lobes and rollers, and Figs. 2, 3, 5 from the cam's geometry."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import powertrain as pt
from powertrain.components.gearless.spherical_cam import (
    STANDARD_RATIOS,
    CamBody,
    CamGeometry,
    Cycle,
    PlanetaryFinalDrive,
    SphericalCam,
    SphericalCamDifferential,
    pressure_angle_range,
    search,
)
from powertrain.components.rotational import ConstantSpeed, Inertia
from powertrain.reproductions.drawing import drawn, panels
from powertrain.reproductions.papers import Paper, Picture
from powertrain.reproductions.sketches import automotive_differential
from powertrain.reproductions.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE_1 = {
    (3, 3): ("0", "0.21"),
    (3, 4): ("0.63", "0.66"),
    (3, 5): ("0.88", "0.90"),
    (3, 6): ("1.02", "1.11"),
    (3, 7): ("1.10", "1.11"),
    (4, 4): ("0", "16.62"),
    (4, 5): ("0.52", "0.57"),
    (4, 6): ("0.78", "0.80"),
    (4, 7): ("1.01", "1.02"),
    (4, 8): ("1.02", "1.03"),
}
"""Printed minima and maxima of the operating pressure angle by (M, N); two decimals, of which the print omits a last zero."""
TABLE_2 = {
    (3, 3): "1 3.05 3.29 3.73 4.1 4.56",
    (3, 4): "0.75 2.28 2.46 2.79 3.07 3.42",
    (3, 5): "0.6 1.83 1.97 2.23 2.46 2.73",
    (3, 6): "0.5 1.52 1.64 1.86 2.05 2.28",
    (3, 7): "0.42 1.3 1.41 1.59 1.75 1.95",
    (4, 4): "1 3.05 3.29 3.73 4.1 4.56",
    (4, 5): "0.8 2.44 2.63 2.98 3.28 3.64",
    (4, 6): "0.66 2.03 2.19 2.48 2.73 3.04",
    (4, 7): "0.57 1.74 1.88 2.13 2.34 2.6",
    (4, 8): "0.5 1.52 1.64 1.86 2.05 2.28",
}
"""Printed differential ratio and final drive ratios by (M, N)."""


def geometry(M: int, N: int) -> CamGeometry:
    """The cam with the angles that the minima of Table 1 belong to."""
    return CamGeometry(M, N)


def ratio(M: int, N: int) -> float:
    """M/N: speed of the roller carrier over that of the cam, in size, from eq. (1)."""
    cam = geometry(M, N)
    return abs(float(cam.phi(1.0) - cam.phi(0.0)))


def _pressure_of_less(share: float) -> float:
    """By how much the contact pressure of the paper's cam grows with a similar body of less volume."""
    body = CamBody(SphericalCam(4, 5), inner=(0.020, 0.029), outer=(0.030, 0.036))
    size = (1 - share) ** (1 / 3)
    small = replace(body, inner=(0.020 * size, 0.029 * size), outer=(0.030 * size, 0.036 * size))
    cycle = Cycle(body.cam)
    return small.greatest_pressure(cycle, 100.0) / body.greatest_pressure(cycle, 100.0)


def fitted(printed: str, computed: float) -> str:
    """Why a least pressure angle differs from the print."""
    return f"by {abs(computed - float(printed)):.3f} rad: α_3 and α_4 are not stated, 44° and 19° fit the table"


def pressure_angles() -> Table:
    """Table 1."""
    rows = []
    for (M, N), (least, greatest) in TABLE_1.items():
        value = geometry(M, N).minimum_pressure_angle
        odd = (M, N) == (4, 7)
        remark = "out of line with its neighbours, which the same angles reproduce" if odd else ""
        what = f"least operating pressure angle, M = {M}, N = {N}"
        rows.append(
            Row(
                what,
                "rad",
                "Table 1",
                least,
                value,
                remark,
                right="0.92" if odd else None,
                differs=fitted(least, value),
            )
        )
        unclear = (
            "16.62 rad is not a possible pressure angle"
            if greatest == "16.62"
            else "follows from no reading of 4.2; computed: where two cycles cross"
        )
        what = f"greatest operating pressure angle, M = {M}, N = {N}"
        rows.append(
            Row(what, "rad", "Table 1", greatest, pressure_angle_range(geometry(M, N))[1], unclear, reproducible=False)
        )
    note = (
        "α_3 and α_4 are not stated; with v_c = e_ψ × e_c in eq. (8), α_3 = 44° and α_4 = 19° give the minima to 0.01 rad, that of "
        "{3, 7} to 0.02 rad, and not that of {4, 7}. The "
        "printed maxima cannot be reproduced, and nothing is tuned to them. The values follow from the equations alone: with these angles, "
        "cams with M = N and cams with 7 or 8 rollers cannot be built."
    )
    return Table("Pressure angles", rows, note)


def final_drives() -> Table:
    """Table 2."""
    rows = []
    for (M, N), text in TABLE_2.items():
        first, *others = text.split()
        rows.append(Row(f"differential ratio M/N, M = {M}, N = {N}", "1", "Table 2", first, ratio(M, N), cut=2))
        for standard, printed in zip(STANDARD_RATIOS, others, strict=True):
            value = standard * ratio(M, N)
            rows.append(Row(f"M/N × {standard:g}, M = {M}, N = {N}", "1", "Table 2", printed, value, cut=2))
    note = (
        "Arithmetic, truncated to two decimals in print. The ratios have no effect in a vehicle: ω_L + ω_R = 2 ω_C holds in a symmetric "
        "differential for any M and N, so the final drive ratio does not change; M/N only sets how fast the cams spin."
    )
    return Table("Final drive ratios", rows, note)


def choice() -> Table:
    """Sections 4.2-4.4: which numbers of lobes and rollers."""
    found = search()
    best, second = found[:2]
    refused = {(one.M, one.N): one.refused for one in found if one.refused}
    names = [f"{{{one.M}, {one.N}}}" for one in (best, second)]
    exact = {(M, N): 4.1 * ratio(M, N) for M, N in ((3, 4), (4, 5))}
    rows = [
        Row(
            "best combination {M, N}",
            "",
            "4.4",
            "{4, 5}",
            names[0],
            "by the least pressure angle of those that can be built",
        ),
        Row("the other feasible one", "", "4.2", "{3, 4}", names[1]),
        Row(
            "least pressure angle of {4, 5}",
            "rad",
            "4.4",
            "0.52",
            best.minimum_pressure_angle,
            differs=fitted("0.52", best.minimum_pressure_angle),
        ),
        Row(
            "greatest operating pressure angle of {4, 5}",
            "rad",
            "4.4",
            "0.57",
            pressure_angle_range(geometry(4, 5))[1],
            "as in Table 1",
            reproducible=False,
        ),
        Row("4.1 × M/N of {3, 4}", "1", "4.4", "3.07", exact[3, 4], cut=2),
        Row("4.1 × M/N of {4, 5}", "1", "4.4", "3.28", exact[4, 5], cut=2),
        Row("off the standard 3.05", "1", "4.4", "0.02", second.off_standard, cut=2),
        Row("off the standard 3.29", "1", "4.4", "0.01", best.off_standard, cut=2),
        *[
            Row(
                f"M = N = {n}",
                "",
                "4.2",
                "unfeasible",
                "unfeasible" if (n, n) in refused else "feasible",
                refused.get((n, n), ""),
            )
            for n in (3, 4)
        ],
        Row(
            "smaller volume than a bevel differential",
            "%",
            "5",
            "27",
            None,
            "from finite elements that are not shown",
            reproducible=False,
        ),
        Row(
            "contact pressure that 27 % less volume takes, over that before",
            "1",
            "5",
            "",
            _pressure_of_less(0.27),
            "torque over volume goes with the square of Hertz's pressure",
        ),
    ]
    return Table("The choice of lobes and rollers", rows)


class _Axle(pt.Component):
    """Final drive and differential with the left wheel ahead."""

    sun: ConstantSpeed = ConstantSpeed(w_fixed=360.8)
    final_drive: PlanetaryFinalDrive = PlanetaryFinalDrive(ratio=4.1)
    differential: SphericalCamDifferential = SphericalCamDifferential(cam=SphericalCam(4, 5))
    left: ConstantSpeed = ConstantSpeed(w_fixed=96.8)
    right: Inertia = Inertia(J=0.1)

    def equations(self) -> pt.Equations:
        """Along the power flow."""
        yield pt.connect(self.sun.flange, self.final_drive.flange_a)
        yield pt.connect(self.final_drive.flange_b, self.differential.crown)
        yield pt.connect(self.differential.left, self.left.flange)
        yield pt.connect(self.differential.right, self.right.flange_a)


def in_a_vehicle() -> Table:
    """What Table 2 would say of a vehicle, and what is so."""
    end = pt.simulate(_Axle(), stop=0.05, points=20)
    sun, left, right, cam = (float(end[name][-1]) for name in ("sun.w", "left.w", "right.w", "differential.w_cam"))
    angle = end["differential.crown.phi"]
    cage = float((angle[-1] - angle[0]) / 0.05)
    rows = [
        Row(
            "sun speed over mean wheel speed, final drive 4.1, {4, 5}",
            "1",
            "Table 2",
            "3.28",
            sun / ((left + right) / 2),
            "a symmetric differential does not change the mean speed of its sides",
            right="4.10",
        ),
        Row("(ω_L + ω_R)/ω_C", "1", "4.3", "", (left + right) / cage),
        Row("spin of the cams over ω_L − ω_C", "1", "eq. (1)", "", cam / (left - cage), "N/M"),
        Row("wheel speeds in a bend of 7 m, cage at 88 rad/s, outer", "rad/s", "4.1", "", left),
        Row("wheel speeds in a bend of 7 m, cage at 88 rad/s, inner", "rad/s", "4.1", "", right),
    ]
    return Table(
        "In a vehicle",
        rows,
        "A simulation of planetary final drive and differential, the left wheel ahead as in a bend of 7 m.",
    )


def figure_5() -> Figure:
    """Pressure angles for {4, 5} and {4, 4}."""
    from powertrain.components.gearless.spherical_cam.figures import pressure_angles

    figure, axes = panels(["", ""], width=6.2, height=4.4)
    for ax, (M, N) in zip(axes, ((4, 5), (4, 4)), strict=True):
        pressure_angles(geometry(M, N), ax)
    return figure


def figure_table_1() -> Figure:
    """Printed and computed ranges of Table 1 side by side; 16.62 rad is no angle and lies outside."""
    figure, (ax,) = panels([""], 1, 8.0, 4.0)
    for k, ((M, N), printed) in enumerate(TABLE_1.items()):
        least, greatest = (float(text) for text in printed)
        ax.plot(
            [k - 0.15] * 2, [least, min(greatest, 1.35)], "o-", color="C0", ms=5, label="printed" if k == 0 else None
        )
        ax.plot(
            [k + 0.15] * 2,
            pressure_angle_range(geometry(M, N)),
            "s-",
            color="C3",
            ms=5,
            label="computed" if k == 0 else None,
        )
        if greatest > 1.5:
            ax.annotate("", (k - 0.15, 1.43), (k - 0.15, 1.3), arrowprops={"arrowstyle": "->", "color": "C0"})
            ax.text(k - 0.22, 1.4, f"{greatest:g}", ha="right", va="center", fontsize=8)
    ax.set_xticks(range(len(TABLE_1)), [f"{M}, {N}" for M, N in TABLE_1])
    ax.set(xlabel="lobes M, rollers N", ylabel="operating pressure angle  [rad]", ylim=(-0.05, 1.45))
    ax.grid(alpha=0.25, axis="y")
    ax.legend(fontsize=8, loc="lower right")
    return figure


CAMS = "gearless.spherical_cam"
DATA = "M = 4, N = 5, α_1 = 90°, α_3 = 44°, α_4 = 19°"
PAPER = Paper(
    name="chaudhary",
    title="Design of a spherical cam mechanism for an automotive differential",
    citation=(
        "M. Chaudhary, J. Angeles, A. Morozov, Design of a spherical cam mechanism for an automotive differential, McGill University, "
        "2014. Related: the same authors, Design of a spherical cam-roller mechanism for an automotive differential, Trans. Can. Soc. "
        "Mech. Eng. 40 (2016) 243-252."
    ),
    summary=(
        "A differential in which conjugate spherical cams replace the bevel pinions, and carriers of conical rollers the side gears. The "
        "profile of a cam is the envelope of its rollers; the pressure angle between roller and cam decides which numbers of lobes and "
        "rollers are suitable."
    ),
    tables=(pressure_angles, final_drives, choice, in_a_vehicle),
    pictures=(
        Picture("figure-2", f"Fig. 2: profile and pitch curve; {DATA}.", lambda: drawn(CAMS, "flat_profile", (6, 6))),
        Picture(
            "figure-3",
            f"Figs. 1, 3: the cam on its sphere, a roller, the axes; {DATA}.",
            lambda: drawn(CAMS, "profile_on_sphere", (7, 5), "3d"),
        ),
        Picture(
            "figure-4",
            f"Fig. 4b: conjugate cams and rollers of both sides; {DATA}.",
            lambda: drawn(CAMS, "mechanism", (10, 7), "3d"),
        ),
        Picture(
            "exploded",
            f"Fig. 4b, exploded: rollers of the left side, inner cam, outer cam above it, rollers of the right side; {DATA}.",
            lambda: drawn(CAMS, "mechanism", (10, 7), "3d", exploded=1.1),
        ),
        Picture("figure-5", "Fig. 5: pressure angles over the cam's angle, {4, 5} and {4, 4}.", figure_5),
        Picture("table-1", "Table 1: printed and computed ranges of the operating pressure angle.", figure_table_1),
        Picture(
            "figure-6",
            "Fig. 6: an automotive differential behind a planetary final drive; the upper half above the axle.",
            automotive_differential,
        ),
        Picture("load-sharing", f"Share of the rollers on both cams; {DATA}.", lambda: drawn(CAMS, "load_sharing")),
        Picture(
            "pressures",
            f"Hertz pressure over the cam's angle, 100 N.m on a side wheel, cams of 36 mm radius (assumed); {DATA}.",
            lambda: drawn(CAMS, "contact_pressures"),
        ),
        Picture(
            "efficiency",
            f"Efficiency of the relative motion, friction assumed; {DATA}.",
            lambda: drawn(CAMS, "efficiency"),
        ),
    ),
)
