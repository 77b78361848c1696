"""Provatidis 2023, sections 3-5: the roller rolls on both cams (Theorem 1), its contact points and its pole."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from powertrain.components.gearless.circular_cam import TABLE_1, Track
from powertrain.reproductions.table import Row, Table


def rolling_contact(track: Track = TABLE_1.outer) -> Table:
    """Theorem 1 and eqs. (1)-(15) over one arc of a track, with a cam speed of V = 1 m/s."""
    most = np.pi / track.n
    theta = np.linspace(-most, most, 400)[1:-1] - track.phase  # 400: the roller is level at none of them
    y, (x, above, below) = track.axis(theta), track.contacts(theta)
    omega, climb = track.spin(theta) * 2 / track.D, track.climb(theta) * 2 / track.D
    # the roller turns clockwise: the speed of its surface at (x, h) from its axis is (omega h, climb - omega x)
    slip = [np.hypot(omega * (h - y) - V, climb - omega * x) for h, V in ((above, 1.0), (below, -1.0))]
    slopes = -x / (above - y), x / (y - below)  # perpendicular to the radii of the contacts
    pole = (x / track.r) ** 2 + ((y - track.R_m * np.cos(track.alpha_max)) / track.R_m) ** 2
    half = most * track.D / 2 / track.R_m
    rows = [
        _claim("contact with the upper cam", "Theorem 1, part 1", "without slip", slip[0], 0.0),
        _claim("contact with the lower cam", "Theorem 1, part 1", "without slip", slip[1], 0.0),
        _claim("slopes at both contacts", "Theorem 1, part 2", "opposite", slopes[0] / slopes[1], -1.0),
        _claim("heights of the contacts over and under the axis", "eq. (13)", "equal", (above - y) / (y - below), 1.0),
        _claim("(x_P/r)² + (y_P/R_m)² of the pole", "eq. (15)", "1", pole, 1.0),
        _claim("δ_max/R_m", "4, Fig. 7", "sin(α_c/2)", half, np.sin(track.alpha_max)),
    ]
    return Table("Rolling contact", rows, "Claims of the theory, checked along one arc of the outer track of Table 1.")


def _claim(what: str, source: str, said: str, values: ArrayLike, exactly: float) -> Row:
    """What is said, if all values are what follows from it to round-off; else the value furthest from it."""
    found = np.atleast_1d(values)
    worst = float(found[np.abs(found - exactly).argmax()])
    return Row(what, "1", source, said, said if abs(worst - exactly) < 1e-9 else f"{worst:.4g}")
