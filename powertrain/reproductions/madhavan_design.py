"""Madhavan 1996, chapter 6 and section 7.3: the guidelines and the alternate design."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from powertrain.components.gearless.linkage import TABLE_5_1, Linkage
from powertrain.components.gearless.linkage.design import alternate, ball_force, guided, over_length, peaks, rod_force
from powertrain.reproductions.madhavan_data import CM, CONVENTION, CYCLE, LINKAGE
from powertrain.reproductions.table import Row, Table


def guidelines() -> Table:
    """Chapter 6."""
    chosen = guided()
    found = over_length(np.linspace(0.01, 0.03, 9))
    rows = [
        Row("a/b for θ_max = 30°", "1", "eq. (6.4)", "0.5176", chosen.a / chosen.b),
        Row("θ_max of that a/b", "°", "6.3", "30", math.degrees(chosen.theta_max)),
        Row(
            "greatest slide for a = 3 cm",
            "cm",
            "eqs. (6.3), (6.5)",
            "3",
            float(np.abs(chosen.motion(CYCLE).S).max()) * CM,
        ),
        Row("a", "cm", "eq. (6.6)", "3", chosen.a * CM, given=True),
        Row("b", "cm", "eq. (6.7)", "5.8", chosen.b * CM),
        Row(
            "θ_max for a/b = √2, beyond which the lever's ends cross the middle",
            "°",
            "6.1",
            "90",
            _theta_max(math.sqrt(2)),
        ),
    ]
    for name, what, source, said in (
        ("ball_force", "greatest S-pair force as a grows", "6.4, Fig. 6.2", "falls"),
        ("rod_force", "greatest C-pair force as a grows", "6.4, Fig. 6.3", "falls"),
        ("shaking_force", "greatest shaking force as a grows", "6.2", "rises"),
        ("shaking_moment", "greatest shaking moment as a grows", "6.2", "rises"),
    ):
        rows.append(Row(f"{what}, a/b = 0.5176", "", source, said, _trend(found[name])))
    rows += [
        Row("greatest S-pair force at a = 3 cm", "N", "Fig. 6.2", "", float(found["ball_force"][-1]), CONVENTION),
        Row("greatest C-pair force at a = 3 cm", "N", "Fig. 6.3", "", float(found["rod_force"][-1]), CONVENTION),
    ]
    return Table(
        "Design guidelines", rows, "200 N.m on the cage at 88 rad/s, R_curve = 7 m, links of the same thickness."
    )


def _theta_max(ratio: float) -> float:
    return math.degrees(Linkage(a=ratio * 0.06, b=0.06).theta_max)


def _trend(values: NDArray[np.float64]) -> str:
    steps = set(np.sign(np.diff(values)).tolist())
    return "falls" if steps == {-1.0} else "rises" if steps == {1.0} else "neither"


def alternate_design() -> Table:
    """Section 7.3."""
    moved = alternate(LINKAGE)
    beta_max = LINKAGE.beta_range[1]
    alpha = np.radians([0, 90, 180, 270, 360])
    rows = []
    for design, name, printed in ((LINKAGE, "previous design", "01010"), (moved, "new design", "-+-+-")):
        for angle, value, text in zip(alpha, design.motion(alpha).beta / beta_max, printed, strict=True):
            said = text if text in "01" else f"{text}0.5".replace("+", "")
            rows.append(Row(f"β/β_max at α = {math.degrees(angle):.0f}°, {name}", "1", "Table 7.1", said, float(value)))
    before, after = peaks(LINKAGE, TABLE_5_1), peaks(moved, TABLE_5_1)
    still = 100 * (ball_force(moved, 100.0) / ball_force(LINKAGE, 100.0) - 1)
    rows += [
        Row("β_max of the previous design", "°", "7.3", "", math.degrees(beta_max)),
        Row(
            "offset of the C axis",
            "cm",
            "Fig. 7.1",
            "",
            moved.offset * CM,
            "d = b − a sin β_1: the C axis is moved nearer",
        ),
        Row(
            "greatest static S-pair force against the previous design",
            "%",
            "eq. (7.1)",
            "reduced",
            still,
            "by little",
            right="-2.3",
        ),
        Row(
            "greatest static C-pair force against the previous design",
            "%",
            "7.3",
            "",
            100 * (rod_force(moved, 100.0) / rod_force(LINKAGE, 100.0) - 1),
            "it rises, which 7.3 does not say",
        ),
        Row(
            "greatest S-pair force, with inertia",
            "%",
            "7.3",
            "",
            100 * (after.ball_force / before.ball_force - 1),
            CONVENTION,
        ),
        Row(
            "greatest C-pair force, with inertia",
            "%",
            "7.3",
            "",
            100 * (after.rod_force / before.rod_force - 1),
            CONVENTION,
        ),
    ]
    return Table("The alternate design", rows, "a = 3 cm, b = 6 cm, 100 N.m at each wheel.")
