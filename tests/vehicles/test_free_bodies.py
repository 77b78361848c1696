"""Free bodies and sketches of the papers: the forces that are drawn balance; every picture can be drawn."""

from __future__ import annotations

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest
from cases import few

from powertrain.components.gearless.circular_cam import TABLE_1, TORQUE
from powertrain.components.gearless.circular_cam.forces import forces
from powertrain.components.gearless.linkage.forces import Drive, reactions
from powertrain.reproductions import chaudhary, free_bodies, sketches
from powertrain.reproductions.madhavan_data import DUTY, LINKAGE


def test_lever_and_cage_balance() -> None:
    """Eqs. (5.48)-(5.50) at 40°: what the pictures show."""
    found = reactions(LINKAGE, Drive.at([math.radians(40)]), crown=DUTY.torque)
    np.testing.assert_allclose(found.S_left + found.S_right + found.C_force, 0, atol=1e-8)
    S = float(LINKAGE.motion(np.array([math.radians(40)])).S[0])
    on_cage = -found.C_moment[0, 0] - S * found.C_force[0, 2]
    assert on_cage == pytest.approx(-DUTY.torque, rel=1e-9)


def test_roller_and_disk_balance() -> None:
    """F_u = 2 F_n sin alpha on the roller; two rollers of each track against the friction disk."""
    found = forces(TABLE_1, [math.pi / 8], TORQUE, "rigid")
    assert found.F_u_out == pytest.approx(2 * found.F_n_out * np.sin(found.alpha_out))
    assert found.F_ax == pytest.approx(2 * (found.P_ax_out + found.P_ax_in))
    assert found.M_cam == pytest.approx(TORQUE / 2)


@pytest.mark.parametrize(
    "picture",
    few(
        [
            free_bodies.roller_and_cam,
            free_bodies.lever_and_cage,
            sketches.singular_points,
            sketches.mechanisms,
            sketches.bend_and_bodies,
            sketches.automotive_differential,
            chaudhary.figure_table_1,
        ],
        2,
    ),
)
def test_pictures_are_drawn(picture: object) -> None:
    figure = picture()  # type: ignore[operator]
    figure.canvas.draw()
    plt.close(figure)
