"""Provatidis 2023: every printed number, the bench experiments, Figs. 9 and 15 from the circular-cam differential's geometry and law."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

import powertrain as pt
from powertrain.components.gearless.circular_cam import (
    TABLE_1,
    TORQUE,
    CircularCamDifferential,
    Forces,
    RollerContact,
    Track,
    critical_angle,
    forces,
    forces_at,
    locking,
    single_track_limit,
    track_contacts,
    with_friction,
)
from powertrain.components.rotational import Fixed, Inertia, Torque
from powertrain.reproductions.drawing import drawn, panels
from powertrain.reproductions.free_bodies import roller_and_cam
from powertrain.reproductions.papers import Paper, Picture
from powertrain.reproductions.provatidis_rolling import rolling_contact
from powertrain.reproductions.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MM, GPA = 1e3, 1e-9
TRACKS = {"outer": TABLE_1.outer, "inner": TABLE_1.inner}
CAMS = "gearless.circular_cam"
R_X = {"outer": 0.220, "inner": 0.058}
"""Radii of the concave cams along the tracks, eq. (47) [m]."""
AT_GREATEST = "both tracks at their greatest angle, which no phase has"


def data() -> Table:
    """Table 1."""
    cams = TABLE_1
    steepest = {name: math.degrees(track.alpha_max) for name, track in TRACKS.items()}
    apart = math.degrees(cams.inner.phase - cams.outer.phase)
    half = "half the central angle, as in Table 1; 8.5 calls it the central angle, the stresses use it as contact angle"
    rows = [
        Row("torque of the cage", "N.m", "Table 1", "260", TORQUE, given=True),
        Row("rollers per track", "1", "Table 1", "4", cams.outer.n, given=True),
        Row("phase difference of the tracks", "°", "Table 1", "45", apart),
        Row("diameter of the outer track", "mm", "Table 1", "85", cams.outer.D * MM, given=True),
        Row(
            "diameter of the inner track",
            "mm",
            "Table 1",
            "50",
            cams.inner.D * MM,
            "the nomenclature's D_in = R_in is 2 R_in",
            given=True,
        ),
        Row("radius of the outer rollers", "mm", "Table 1", "15", cams.outer.r * MM, given=True),
        Row("radius of the inner rollers", "mm", "Table 1", "12", cams.inner.r * MM, given=True),
        Row("outer diameter of the friction disks", "mm", "Table 1", "95", cams.disk.d_out * MM, given=True),
        Row("inner diameter of the friction disks", "mm", "Table 1", "45", cams.disk.d_in * MM, given=True),
        Row("coefficient of friction of the disks", "1", "Table 1", "0.066", cams.disk.mu, given=True),
        Row("greatest contact angle of the outer track", "°", "Table 1", "15", steepest["outer"], half, given=True),
        Row("greatest contact angle of the inner track", "°", "Table 1", "27.25", steepest["inner"], half, given=True),
    ]
    return Table("Data", rows, "What the computed values below start from.")


def inclination() -> Table:
    """8.2, eqs. (43)-(46), and what becomes of them at every phase."""
    cams, D_R = TABLE_1, TABLE_1.disk.D_R
    interior = math.degrees(critical_angle(D_R, cams.outer.D, cams.xi, cams.disk.mu))
    alone = math.degrees(single_track_limit(D_R, cams.outer.D, cams.disk.mu))
    rigid = locking(cams, "rigid")
    rows = [
        Row("D_R, equivalent diameter of the friction disks", "mm", "eq. (43)", "72.9762", D_R * MM),
        Row("ξ = D_in/D_out", "1", "eq. (44)", "0.5882", cams.xi),
        Row("greatest α_m of similar tracks that lock while both carry", "°", "eq. (45)", "7.53", interior),
        Row("greatest central angle", "°", "eq. (46)", "15.1", 2 * interior),
        Row(
            "greatest α_m of similar tracks that lock at every phase",
            "°",
            "eqs. (42), (45)",
            "7.53",
            alone,
            "eq. (42) is the minimum while both tracks carry; where the outer one carries alone the limit is lower",
            right="3.243",
        ),
        Row(
            "least κ of Table 1's data while both tracks carry, rigid sharing",
            "1",
            "eq. (37), 8.4",
            "≥ 1",
            rigid.interior,
            "locked means κ ≥ 1: the paper's own data do not lock",
            right="0.399",
        ),
        Row(
            "friction at which they lock while both tracks carry",
            "1",
            "eq. (37), Table 1",
            "0.066",
            rigid.mu_interior,
            "needed for κ ≥ 1 with Table 1's angles",
            right="0.1655",
        ),
        Row(
            "least κ over every phase",
            "1",
            "eq. (37)",
            "",
            rigid.least,
            "at the phase where the inner track carries alone",
        ),
        Row("friction at which they lock at every phase", "1", "eq. (37)", "", rigid.mu_every_phase),
    ]
    return Table(
        "Inclination and locking", rows, "κ is the difference of the half shafts' torques over the cage's torque."
    )


def pressure(name: str, hollow: float = 1.1, steeper: float = 1.0, wider: float = 1.0) -> float:
    """The paper's contact pressure of a track [GPa]: eqs. (26)-(31), equivalent sphere, concave contact, both angles at their greatest."""
    r = TRACKS[name].r
    contact = RollerContact(r, wider * R_X[name], hollow * r)
    return float(contact.pressure(_normal(_at_greatest(steeper), name), "sphere")) * GPA


def _at_greatest(steeper: float = 1.0) -> Forces:
    return forces_at(TABLE_1, steeper * TABLE_1.outer.alpha_max, steeper * TABLE_1.inner.alpha_max, TORQUE, "rigid")


def _normal(found: Forces, name: str) -> Any:
    return found.F_n_out if name == "outer" else found.F_n_in


def stresses() -> Table:
    """Tables 2, 3 and 4, and 8.3."""
    rows = [
        Row("p_0, outer track", "GPa", "Table 2, 8.3", "1.6", pressure("outer"), "printed as 1.6 MPa in 8.3"),
        Row("p_0, inner track", "GPa", "Table 2, 8.3", "1.2", pressure("inner")),
    ]
    other = "finite elements of the paper's reference [23]; nothing here follows from what the paper says"
    for name, printed in (("outer", "1.3"), ("inner", "0.8")):
        rows.append(
            Row(f"p_0 by finite elements, {name} track", "GPa", "Table 2", printed, None, other, reproducible=False)
        )
    table_3 = {
        1.10: ("1.57", "1.20"),
        1.09: ("1.52", "1.16"),
        1.08: ("1.46", "1.12"),
        1.07: ("1.40", "1.07"),
        1.06: ("1.34", "1.02"),
        1.05: ("1.26", "0.96"),
        1.04: ("1.18", "0.90"),
    }
    for hollow, both in table_3.items():
        for name, printed in zip(TRACKS, both, strict=True):
            cut = 2 if name == "outer" and hollow in (1.07, 1.08) else None
            what = f"p_0 with R_2y = {hollow:.2f} r, {name} track"
            rows.append(
                Row(
                    what,
                    "GPa",
                    "Table 3",
                    printed,
                    pressure(name, hollow),
                    "truncated in print" if cut else "",
                    cut=cut,
                )
            )
    table_4 = {1.1: ("1.5211", "1.1611"), 1.0: ("1.5690", "1.1953"), 0.9: ("1.6239", "1.2351")}
    for steeper, both in table_4.items():
        for name, printed in zip(TRACKS, both, strict=True):
            what = f"p_0 at {steeper:g} of the contact angle, {name} track"
            rows.append(Row(what, "GPa", "Table 4", printed, pressure(name, steeper=steeper)))
    change = [100 * abs(pressure(n, steeper=s) / pressure(n) - 1) for n in TRACKS for s in (0.9, 1.1)]
    along = [100 * abs(pressure(n, wider=w) / pressure(n) - 1) for n in TRACKS for w in (0.9, 1.1)]
    rows += [
        Row("mean change of p_0 with the angles ±10 %", "%", "8.3", "3", float(np.mean(change))),
        Row("greatest change of p_0 with R_2x ±10 %", "%", "8.3", "< 1", max(along)),
    ]
    note = f"Equivalent sphere, concave contact, rigid load sharing, E = 200 GPa and ν = 0.3 (not stated there), {AT_GREATEST}."
    return Table("Contact pressures", rows, note)


def real_pressures() -> Table:
    """What Tables 2-4 become with the exact contact, the convex side, and the phases that exist."""
    rows = []
    theta = np.linspace(0, math.pi / 2, 1441)
    found = forces(TABLE_1, theta, TORQUE)
    for name, track in TRACKS.items():
        concave, convex = track_contacts(track, R_concave=R_X[name])
        both = _normal(_at_greatest(), name)
        ratio = float(concave.pressure(both) / concave.pressure(both, "sphere"))
        rows.append(Row(f"exact elliptic over equivalent sphere, {name} track", "1", "eq. (30)", "", ratio))
        rows.append(
            Row(f"exact p_0, concave contact, {name} track", "GPa", "Table 2", "", float(concave.pressure(both)) * GPA)
        )
        rows.append(
            Row(f"exact p_0, convex contact, {name} track", "GPa", "eq. (28)", "", float(convex.pressure(both)) * GPA)
        )
        greatest = float(convex.pressure(_normal(found, name)).max()) * GPA
        what = f"greatest exact p_0 over the real phases, convex contact, {name} track"
        rows.append(Row(what, "GPa", "Fig. 15", "", greatest, "elastic load sharing"))
    return Table("Contact pressures beyond the paper", rows)


def phases() -> Table:
    """8.5 and Fig. 15: active rollers and the tops of the cams."""
    rows = []
    rollers = np.arange(TABLE_1.outer.n)
    for k, printed in enumerate("242424242"):
        theta = k * math.pi / 8
        count = sum(int(track.active(theta, rollers).sum()) for track in TRACKS.values())
        rows.append(Row(f"active rollers at θ = {k}π/8", "1", f"8.5, Fig. 15{'abcdefghi'[k]}", printed, count))
    for k, printed in enumerate(("outer", "inner", "outer", "inner", "outer")):
        theta = k * math.pi / 4
        level = [name for name, track in TRACKS.items() if abs(float(track.alpha(theta))) < 1e-9]
        rows.append(Row(f"track whose rollers are at the tops at θ = {45 * k}°", "", "8.5", printed, ", ".join(level)))
    rows.append(Row("θ after which the picture is the same", "°", "8.5", "180", _period()))
    for name, track in TRACKS.items():
        angle = float(track.alpha(math.pi / 8 - (track.phase - TABLE_1.outer.phase)))
        what = f"part of the central angle swept in 22.5° from the top, {name} track"
        remark = "a quarter for small angles; along an arc sin α = |u| sin α_max"
        rows.append(Row(what, "1", "8.5", "0.25", angle / (2 * track.alpha_max), differs=remark))
    return Table("Phases", rows, "θ is the angle of each cam against the cage; the cams turn 2θ against each other.")


def _period() -> int:
    """The least multiple of 22.5 degrees by which all rollers can go on and be as they were."""
    theta, rollers = np.linspace(0.01, math.pi, 50)[:, None], np.arange(TABLE_1.outer.n)

    def picture(track: Track, shift: float) -> Any:
        return track.axis(theta + shift, rollers), track.sense(theta + shift, rollers) * track.active(
            theta + shift, rollers
        )

    for k in range(1, 33):
        shift = k * math.pi / 8
        if all(np.allclose(picture(track, shift), picture(track, 0.0), atol=1e-12) for track in TRACKS.values()):
            return int(22.5 * k)
    return 0


class _Clamped(pt.Component):
    """The differential with one of its shafts in a clamp, as ``clamp`` says, and torques on the two others."""

    torque: pt.Input = pt.signal_input("N.m", "Torque on the cage, or on the left shaft where the cage is clamped")
    assist: pt.Input = pt.signal_input("N.m", "Torque on the left shaft, or on the right one where the cage is clamped")
    clamp: str = "right"
    differential: CircularCamDifferential = CircularCamDifferential()
    jaws: Fixed = Fixed()
    first: Inertia = Inertia(J=0.01)
    second: Inertia = Inertia(J=0.01)
    hand: Torque = Torque()
    helper: Torque = Torque()

    def equations(self) -> pt.Equations:
        """Who is clamped, who is turned."""
        gear = self.differential
        held, turned, helped = (
            (gear.right, gear.crown, gear.left) if self.clamp == "right" else (gear.crown, gear.left, gear.right)
        )
        yield pt.connect(self.jaws.flange, held)
        yield pt.connect(turned, self.first.flange_a)
        yield pt.connect(helped, self.second.flange_a)
        yield pt.connect(self.hand.flange, self.first.flange_b)
        yield pt.connect(self.helper.flange, self.second.flange_b)
        yield pt.connect(self.torque, self.hand.tau)
        yield pt.connect(self.assist, self.helper.tau)


def experiments() -> Table:
    """8.1, bench experiments 1 and 2, simulated with disks that lock at every phase and with those of Table 1."""
    needed = locking(TABLE_1).mu_every_phase
    rows = []
    for clamp, number, wanted in (("right", 1, "2"), ("crown", 2, "-1")):
        for mu, name in ((1.15 * needed, "locking disks"), (TABLE_1.disk.mu, "disks of Table 1")):
            gear = CircularCamDifferential.from_design(with_friction(TABLE_1, mu))
            plant = pt.compile(_Clamped(clamp=clamp, differential=gear))
            alone = plant.simulate(stop=0.02, inputs={"torque": 50.0, "assist": 0.0}, points=20)
            moved = abs(alone["differential.left.phi"][-1]) > 1e-9
            where = f"experiment {number}, μ = {mu:.3f}" if mu > needed else f"experiment {number}, μ = {mu:g}"
            said = "stuck" if mu > needed else ""
            what = (
                "one torque alone: 50 N.m on the cage"
                if clamp == "right"
                else "one torque alone: 50 N.m on the left shaft"
            )
            rows.append(Row(f"{what}, {name}", "", f"8.1, {where}", said, "turns" if moved else "stuck"))
            if mu <= needed:
                continue
            help_ = 12.0 if clamp == "right" else -12.0
            both = plant.simulate(stop=0.02, inputs={"torque": 50.0, "assist": help_}, points=20)
            left, other = (
                both[f"differential.{side}.phi"][-1] for side in ("left", "crown" if clamp == "right" else "right")
            )
            quantity = (
                "speed of the left shaft over that of the cage"
                if clamp == "right"
                else "speed of the right shaft over the left"
            )
            ratio = left / other if clamp == "right" else other / left
            rows.append(Row(f"{quantity}, with 12 N.m of help", "1", f"8.1, {where}", wanted, float(ratio)))
    note = (
        "1: the right shaft is clamped, the cage is turned, and the left shaft is assisted. 2: the cage is clamped, the left shaft is "
        f"turned, and the right one is assisted. To lock at every phase the disks need μ ≥ {needed:.3f}; those of Table 1 do not lock."
    )
    return Table("Bench experiments", rows, note)


def figure_15() -> Figure:
    """The tracks at nine phases."""
    from powertrain.components.gearless.circular_cam.figures import mechanism

    titles = [f"({'abcdefghi'[k]}) θ = {k}π/8" for k in range(9)]
    figure, axes = panels(titles, width=5.5)
    for k, (ax, title) in enumerate(zip(axes, titles, strict=False)):
        mechanism(theta=k * math.pi / 8, ax=ax)
        ax.set_xlim(left=-110)
        ax.set_title(title)
    return figure


PAPER = Paper(
    name="provatidis",
    title="Power transmission using circular elements bounded by given central angle in rolling contact",
    citation=(
        "C. G. Provatidis, Power transmission using circular elements bounded by given central angle in rolling contact, Eng 4 (2023) "
        "2309-2335, doi:10.3390/eng4030132."
    ),
    summary=(
        "Rollers between two cam disks with tracks of circular arcs make a differential without gears. Its rollers wedge the cams apart, "
        "and the friction of the disks behind them holds the half shafts against each other, in proportion to the torque of the cage."
    ),
    tables=(data, rolling_contact, inclination, stresses, real_pressures, phases, experiments),
    pictures=(
        Picture(
            "figure-9",
            "Fig. 9: loci of contact points, roller axis and pole while one arc passes.",
            lambda: drawn(CAMS, "centrodes"),
        ),
        Picture(
            "figure-12",
            "Figs. 10-12: both cam disks and the rollers between them, drawn apart; outer track blue, inner one orange.",
            lambda: drawn(CAMS, "disks", (8, 7), "3d"),
        ),
        Picture(
            "figure-13",
            "Figs. 13, 14: free bodies of an outer roller and of the upper cam disk at θ = 22.5°, Table 1, rigid load sharing.",
            roller_and_cam,
        ),
        Picture("figure-15", "Fig. 15: both tracks unrolled at nine phases; wedged rollers are red.", figure_15),
        Picture(
            "contact-angles",
            "Contact angles over the phase, and active rollers.",
            lambda: drawn(CAMS, "contact_angles"),
        ),
        Picture(
            "locking",
            "Locking coefficient over the phase, Table 1, by rule of load sharing.",
            lambda: drawn(CAMS, "locking_coefficient"),
        ),
        Picture(
            "locking-map",
            "Where similar tracks lock, over friction and contact angle.",
            lambda: drawn(CAMS, "locking_limits"),
        ),
        Picture(
            "forces", "Normal force on an active roller over the phase, Table 1.", lambda: drawn(CAMS, "normal_forces")
        ),
        Picture("pressures", "Contact pressures over the phase, Table 1.", lambda: drawn(CAMS, "contact_pressures")),
    ),
)
