"""A differential on a test bench: losses and shares of torque over speed difference and torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

import powertrain as pt
from powertrain.components.differentials import Differential
from powertrain.components.rotational import ConstantSpeed, ConstantTorque
from powertrain.figures.plot import axes_of
from powertrain.language.arguments import row

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

SAMPLES = 720
"""Angles of relative rotation that are evaluated."""
LEAST_RANGE = 0.01
"""Least range of efficiency of a plot, for differentials without losses."""


class DifferentialBench(pt.Component):
    """A test bench for a differential: half shafts at given speeds, a torque on the crown wheel."""

    differential: Differential
    drive: ConstantTorque = ConstantTorque(tau_constant=0)
    left: ConstantSpeed = ConstantSpeed(w_fixed=1)
    right: ConstantSpeed = ConstantSpeed(w_fixed=1)

    def equations(self) -> pt.Equations:
        """Three shafts."""
        yield pt.connect(self.drive.flange, self.differential.crown)
        yield pt.connect(self.differential.left, self.left.flange)
        yield pt.connect(self.differential.right, self.right.flange)


def differential_map(
    differential: Differential, differences: ArrayLike, torques: ArrayLike, *, speed: float = 88.0
) -> xr.Dataset:
    """Means over one relative revolution of the two sides, for speed differences [rad/s] > 0 and torques [N.m] of the crown wheel.

    Variables ``left`` and ``right``: torques [N.m] delivered to the half shafts, ``loss`` [W], ``efficiency`` = power to the half
    shafts over power of the crown wheel (inverse for torques < 0). The left half shaft turns faster by the difference w_left - w_right;
    ``speed`` [rad/s] is that of the crown wheel. Errors: ParameterError for a difference <= 0, and those of the model.
    """
    import xarray as xr

    given, loads = row("differences", differences), row("torques", torques)
    if (given <= 0).any():
        raise pt.ParameterError(
            f"differential_map: a speed difference of {given.min():g} rad/s is not allowed; give values > 0"
        )
    plant = pt.compile(DifferentialBench(differential=differential))
    means = np.empty((2, given.size, loads.size))
    for i, difference in enumerate(given):
        for j, torque in enumerate(loads):
            values = {
                "drive.tau_constant": torque,
                "left.w_fixed": speed + difference / 2,
                "right.w_fixed": speed - difference / 2,
            }
            turn = 2 * np.pi / difference
            result = plant.simulate(turn, parameters=values, points=SAMPLES + 1)
            for k, side in enumerate(("left", "right")):  # events add samples, which count with no time between them
                means[k, i, j] = -np.trapezoid(result[f"differential.{side}.tau"], result.time) / turn
    fast, slow = means
    out = fast * (speed + given[:, None] / 2) + slow * (speed - given[:, None] / 2)
    into = np.broadcast_to(loads * speed, out.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        efficiency = np.where(into > 0, out / into, np.where(into < 0, into / out, np.nan))
    dims = ("difference", "torque")
    return xr.Dataset(
        {
            "left": (dims, fast, {"units": "N.m", "long_name": "Torque of the left half shaft"}),
            "right": (dims, slow, {"units": "N.m", "long_name": "Torque of the right half shaft"}),
            "loss": (dims, into - out, {"units": "W", "long_name": "Loss"}),
            "efficiency": (dims, efficiency, {"units": "1", "long_name": "Efficiency"}),
        },
        {
            "difference": ("difference", given, {"units": "rad/s", "long_name": "Speed difference, left ahead"}),
            "torque": ("torque", loads, {"units": "N.m", "long_name": "Torque of the crown wheel"}),
        },
    )


def plot_differential_map(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Contours of efficiency over speed difference and torque.

    Errors: ParameterError for fewer than two differences or torques, and where no efficiency is defined.
    """
    found = found.sortby(["difference", "torque"])
    values = found["efficiency"].transpose("torque", "difference")
    if min(values.shape) < 2 or not np.isfinite(values).any():
        raise pt.ParameterError(
            "plot_differential_map needs two speed differences and two torques at least, and an efficiency: power through the crown wheel; "
            f"this map has {values.sizes['difference']} and {values.sizes['torque']}"
        )
    from matplotlib.ticker import MaxNLocator

    low, high = float(values.min()), float(values.max())
    levels = MaxNLocator(12).tick_values(min(low, high - LEAST_RANGE), high)
    ax = axes_of(ax, (6.5, 4.5))
    filled = ax.contourf(found["difference"], found["torque"], values, levels=levels, cmap="viridis")
    ax.figure.colorbar(filled, ax=ax).set_label("Efficiency [1]")
    ax.set(xlabel=r"Speed difference $\omega_L - \omega_R$ [rad/s]", ylabel="Torque of the crown wheel [N.m]")
    return ax
