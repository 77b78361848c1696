"""Madhavan 1996: motion, masses, torques, forces and shaking of the linkage differential RRSCSRR, as printed and as computed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import powertrain as pt
from powertrain.components.gearless.linkage import (
    CORRECTED,
    TABLE_5_1,
    Linkage,
    LinkageDifferential,
    LinkBody,
    cage_turns,
    cylinder,
    cylinder_mass,
    in_bend,
)
from powertrain.components.gearless.linkage.masses import CYLINDERS, GRAM_CM2, STEEL
from powertrain.components.rotational import ConstantSpeed, Fixed, Inertia, Speed
from powertrain.reproductions import madhavan_figures as figures
from powertrain.reproductions import sketches
from powertrain.reproductions.drawing import drawn, panels
from powertrain.reproductions.free_bodies import lever_and_cage
from powertrain.reproductions.madhavan_data import CM, CYCLE, DUTY, LINKAGE, W_COUPLING
from powertrain.reproductions.madhavan_design import alternate_design, guidelines
from powertrain.reproductions.madhavan_forces import shaking_forces, torques
from powertrain.reproductions.madhavan_synthesis import enumeration, evaluation, figure_3_6
from powertrain.reproductions.papers import Paper, Picture
from powertrain.reproductions.table import Row, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINKS = "gearless.linkage"
GRAM = 1e3


class _Coupling(pt.Component):
    """The differential with its cage held, driven at the left shaft."""

    differential: LinkageDifferential = LinkageDifferential.of(LINKAGE)
    drive: ConstantSpeed = ConstantSpeed(w_fixed=W_COUPLING)
    housing: Fixed = Fixed()
    output: Inertia = Inertia(J=1e-3)

    def equations(self) -> pt.Equations:
        """Cage to the housing."""
        yield pt.connect(self.housing.flange, self.differential.crown)
        yield pt.connect(self.drive.flange, self.differential.left)
        yield pt.connect(self.output.flange_a, self.differential.right)


class _Bend(pt.Component):
    """The differential driven at cage and left wheel, as the thesis drives its model in the bend."""

    w_left: pt.Input = pt.signal_input("rad/s", "Speed of the left wheel")
    differential: LinkageDifferential = LinkageDifferential.of(LINKAGE)
    cage: ConstantSpeed = ConstantSpeed(w_fixed=DUTY.w)
    left: Speed = Speed(exact=True)
    right: Inertia = Inertia(J=1e-3)

    def equations(self) -> pt.Equations:
        """Two shafts given, the third follows."""
        yield pt.connect(self.cage.flange, self.differential.crown)
        yield pt.connect(self.left.flange, self.differential.left)
        yield pt.connect(self.right.flange_a, self.differential.right)
        yield pt.connect(self.w_left, self.left.w_ref)


def kinematics() -> Table:
    """Sections 5.1.1, 5.1.2, and Appendix A."""
    bend = in_bend(DUTY.w, DUTY.radius, DUTY.track)
    coupling = pt.simulate(_Coupling(), stop=0.03, points=50)
    driven = pt.simulate(_Bend(), stop=0.1, points=50, inputs={"w_left": bend.outer})
    motion = LINKAGE.motion(CYCLE)
    theta, S, S1 = motion.theta, motion.S * CM, motion.S1
    ratio = coupling["output.w"][-1] / coupling["drive.w"][-1]
    rows = [
        Row(
            "input speed of the coupling, 2000 rpm",
            "rad/s",
            "5.1.2 (a)",
            "209.4",
            float(coupling["drive.w"][-1]),
            given=True,
        ),
        Row("output speed over input speed, cage held", "1", "5.1.2 (a)", "-1", float(ratio)),
        Row("greatest angle of the lever, a = 3 cm, b = 6 cm", "rad", "5.1.2, eq. (5.32)", "0.5", float(theta.max())),
        Row("least angle of the lever", "rad", "5.1.2, eq. (5.32)", "-0.5", float(theta.min())),
        Row("greatest slide of the lever", "cm", "5.1.2", "3", float(S.max())),
        Row("least slide of the lever", "cm", "5.1.2", "-3", float(S.min())),
        Row(
            "slide of the lever where it turns fastest (dead centres)",
            "cm",
            "5.1.2, Fig. 5.8",
            "3",
            _at_greatest(motion.theta1, S),
        ),
        Row(
            "its angular velocity where it slides fastest (middle)",
            "rad/s",
            "5.1.2, Fig. 5.8",
            "0",
            _at_greatest(S1, motion.theta1),
        ),
        Row("greatest a/b of a linkage that can be assembled", "1", "eqs. (5.34), (6.2)", "2", _greatest_ratio()),
        Row("x/(2 R_curve)", "1", "5.1.2 (b)", "0.1", bend.differential / DUTY.w),
        Row("ω_diff", "rad/s", "5.2.1, eq. (5.12)", "8.8", bend.differential),
        Row("ω_2 of the outer wheel, R_curve = 7 m", "rad/s", "5.1.2, eq. (5.13)", "96.8", float(driven["left.w"][-1])),
        Row("ω_6 of the inner wheel", "rad/s", "5.1.2, eq. (5.14)", "79.2", float(driven["right.w"][-1])),
        Row("turns of the cage per internal cycle", "1", "5.1.2 (b)", "10", float(cage_turns(DUTY.radius, DUTY.track))),
        Row(
            "(S² + 4 b² sin²(θ/2))/a², furthest from 1",
            "1",
            "eqs. (5.21)-(5.23)",
            "",
            _invariant(),
            "an invariant of the motion",
        ),
    ]
    note = "Speeds come from simulations of the acausal component, angles from its smooth closed forms, which hold at every angle."
    return Table("Kinematics", rows, note)


def _at_greatest(rate: NDArray[np.float64], value: NDArray[np.float64]) -> float:
    """The size of a value where a rate is greatest."""
    return abs(float(value[np.argmax(np.abs(rate))]))


def _greatest_ratio() -> float:
    """The largest a/b that is not refused, by bisection."""
    low, high = 0.1, 10.0
    while high - low > 1e-9:
        ratio = (low + high) / 2
        try:
            Linkage(a=ratio * 0.06, b=0.06)
            low = ratio
        except pt.ParameterError:
            high = ratio
    return low


def _invariant() -> float:
    m = LINKAGE.motion(CYCLE)
    value = (m.S**2 + 4 * LINKAGE.b**2 * np.sin(m.theta / 2) ** 2) / LINKAGE.a**2
    return float(value[np.argmax(np.abs(value - 1))])


def masses() -> Table:
    """Table 5.1 and Appendix B."""
    rows = [Row("density of steel", "g/cm³", "App. B", "7.9", STEEL / 1e3, given=True)]
    for name, text in {"cage": "4400", "coupler": "230", "lever": "600"}.items():
        r, length, inner = CYLINDERS[name]
        mass = cylinder_mass(r, length, inner=inner) * GRAM
        off = f"by {abs(float(text) / mass - 1):.1%} from its own density and lengths: rounded in the thesis"
        rows.append(Row(f"mass of the {name}", "g", "Table 5.1", text, mass, differs=off))
    moments = {"coupler": ("180", "690"), "lever": ("468.75", "11250")}
    for name, (axial, across) in moments.items():
        body = _body(name)
        rows.append(Row(f"I_yy of the {name}", "g.cm²", "Table 5.1, eq. (B.1)", axial, body.axial / GRAM_CM2))
        rows.append(
            Row(f"I_xx = I_zz of the {name}", "g.cm²", "Table 5.1, eq. (B.2)", across, body.transverse / GRAM_CM2)
        )
    sign = "eq. (B.4) has r_2² − r_1² for r_2² + r_1²; no effect at constant speed of the cage"
    cage = _body("cage")
    rows += [
        Row("I_xx of the cage", "g.cm²", "Table 5.1, eq. (B.4)", "24200", cage.axial / GRAM_CM2, sign, right="134200"),
        Row(
            "I_xx of the cage in the data set",
            "g.cm²",
            "Table 5.1",
            "24200",
            TABLE_5_1.cage.axial / GRAM_CM2,
            "kept as printed",
            given=True,
        ),
        Row(
            "I_yy of the cage",
            "g.cm²",
            "Table 5.1",
            "93866.76",
            cage.transverse / GRAM_CM2,
            "misprint",
            right="93866.67",
        ),
        Row("I_zz of the cage", "g.cm²", "Table 5.1, eq. (B.6)", "93866.67", cage.transverse / GRAM_CM2),
    ]
    note = "Moments of thin rods, as in the thesis; radii and lengths follow from its numbers. The outputs' 20 000 g do not matter."
    return Table("Masses and moments of inertia", rows, note)


def _body(name: str) -> LinkBody:
    r, length, inner = CYLINDERS[name]
    return cylinder(getattr(CORRECTED, name).m, r, length, inner=inner)


def mechanism() -> Figure:
    """The mechanism at four angles."""
    import matplotlib.pyplot as plt

    from powertrain.components.gearless.linkage.figures import mechanism

    figure = plt.figure(figsize=(11.5, 8.5))
    figure.subplots_adjust(left=0.02, right=0.93, bottom=0.06, top=0.96)
    axes = [figure.add_subplot(2, 2, k + 1, projection="3d", proj_type="ortho") for k in range(4)]
    for ax, degrees in zip(axes, (0, 50, 90, 180), strict=True):
        mechanism(LINKAGE, math.radians(degrees), ax=ax)
        if (legend := ax.get_legend()) is not None:
            legend.remove()
    figure.legend(*axes[0].get_legend_handles_labels(), loc="lower center", ncols=4, fontsize=9, frameon=False)
    return figure


def shaking_figures() -> Figure:
    """Figs. 5.15-5.19."""
    from powertrain.components.gearless.linkage.figures import shaking_over_cycle, shaking_path

    titles = ["Figs. 5.15, 5.16: shaking force", "Figs. 5.17, 5.18: shaking moment", "Fig. 5.19"]
    figure, axes = panels(titles, 3, 5.0, 4.2)
    shaking_over_cycle(LINKAGE, ax=axes[0])
    shaking_over_cycle(LINKAGE, ax=axes[1], moment=True)
    shaking_path(LINKAGE, ax=axes[2])
    return figure


BEND = "cage at 88 rad/s, R_curve = 7 m, x = 1.4 m"
LOAD = f"200 N.m on the cage, {BEND}"
PAPER = Paper(
    name="madhavan",
    title="Systematic design of gearless differentials and analysis of a potential mechanism",
    citation=(
        "B. Madhavan, Systematic Design of Gearless Differentials and Analysis of a Potential Mechanism, M.S. thesis 96-7, University of "
        "Maryland, 1996."
    ),
    summary=(
        "A search over mechanisms of two loops finds couplings that turn two shafts in opposite directions; one, RRSCSRR, becomes a "
        "differential of links, balls and pins. Its motion, joint forces and shaking forces are computed from the equations of its links. "
        "The mechanism is overconstrained: equal and opposite axial forces of its couplers are indeterminate and are taken as zero."
    ),
    tables=(enumeration, evaluation, kinematics, masses, torques, shaking_forces, guidelines, alternate_design),
    pictures=(
        Picture("figure-3-1", "Fig. 3.1: a planar coupling and its singular point.", sketches.singular_points),
        Picture(
            "figure-3-6-mechanisms",
            "Fig. 3.6: the six couplings as mechanisms; every joint by its sign.",
            sketches.mechanisms,
        ),
        Picture("figure-3-6", "Fig. 3.6: graphs of the six couplings; the cage is ringed.", figure_3_6),
        Picture("mechanism", "Figs. 4.1, 5.5: the mechanism, a = 3 cm, b = 6 cm, at four angles.", mechanism),
        Picture(
            "solids",
            "The parts as solids, a = 3 cm, b = 6 cm: lever blue, couplers orange, shafts grey, the cage's rod green.",
            lambda: drawn(LINKS, "solid_mechanism", (8, 5), "3d"),
        ),
        Picture(
            "figure-5-7",
            "Fig. 5.7: lever and coupler over a turn of the shaft against the cage.",
            lambda: drawn(LINKS, "motion"),
        ),
        Picture("figure-5-8", "Fig. 5.8: speeds of the lever at 209.4 rad/s.", lambda: drawn(LINKS, "rates")),
        Picture("figure-5-10", f"Fig. 5.10: speeds of cage and wheels; {BEND}.", figures.wheel_speeds),
        Picture("figure-5-11", "Figs. 5.11-5.14: forces of the coupling at 209.4 rad/s.", figures.coupling_forces),
        Picture("figure-5-15", f"Figs. 5.15-5.19: shaking of the differential; {BEND}.", shaking_figures),
        Picture(
            "figure-5-20", f"Figs. 5.20, 5.21: forces in the S-pairs; {LOAD}.", lambda: drawn(LINKS, "ball_forces")
        ),
        Picture("figure-5-23", f"Figs. 5.23, 5.24: the C-pair on the lever; {LOAD}.", figures.lever_forces),
        Picture(
            "figure-5-22",
            "Figs. 5.22, 5.25: free bodies of lever and cage, 200 N.m on the cage at rest, α = 40°.",
            lever_and_cage,
        ),
        Picture(
            "figure-5-26",
            f"Figs. 5.26, 5.27: the C-pair on the lever, axes of the cage (on the cage: opposite); {LOAD}.",
            lambda: drawn(LINKS, "rod_forces"),
        ),
        Picture(
            "figure-5-28",
            f"Fig. 5.28 and eq. (5.50): the C-pair on the cage; {LOAD}. Its force along x is indeterminate but for the convention.",
            figures.cage_forces,
        ),
        Picture("figure-6-1", "Fig. 6.1: greatest angle of the lever over a/b.", figures.greatest_angle),
        Picture(
            "figure-6-2",
            f"Figs. 6.2, 6.3: greatest forces over a, a/b = 0.5176; {LOAD}.",
            lambda: drawn(LINKS, "forces_over_length"),
        ),
        Picture(
            "figure-7-1",
            "Fig. 7.1: swing of the couplers in the previous and the alternate design.",
            figures.coupler_swing,
        ),
        Picture(
            "appendix", "Figs. A.1, B.1-B.4: the bend of 7 m, and the bodies of Table 5.1.", sketches.bend_and_bodies
        ),
        Picture(
            "efficiency",
            "Efficiency from side to side with friction in the joints.",
            lambda: drawn(LINKS, "efficiency"),
        ),
    ),
)
