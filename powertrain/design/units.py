"""Variable units as known to a designer: efficiency as numbers or maps, range, limits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

import powertrain as pt
from powertrain.components.cvu import CVU, VariableUnit
from powertrain.components.rotational import ConstantSpeed, Inertia, Torque
from powertrain.components.transmissions import UnitLoss
from powertrain.design.duty import Vector
from powertrain.language.makers import arguments_checked

_LEAST = 1e-6
"""A ratio that counts as zero."""


@pt.arguments_checked
@dataclass(frozen=True)
class Variator:
    """A variable unit: its losses, the range of V = w_b/w_a, and the limits of its shafts.

    ``speed`` [rad/s] and ``torque`` [N.m] apply to either shaft, ``power`` [W] to the transmitted power. Errors: ParameterError for an
    empty range and for limits that are not positive.
    """

    name: str
    loss: UnitLoss
    ratio: tuple[float, float] = (-math.inf, math.inf)
    speed: float = math.inf
    torque: float = math.inf
    power: float = math.inf

    def __post_init__(self) -> None:
        if not self.ratio[0] < self.ratio[1]:
            raise pt.ParameterError(
                f"unit {self.name}: the range of V from {self.ratio[0]:g} to {self.ratio[1]:g} is empty"
            )
        for what, unit in (("speed", "rad/s"), ("torque", "N.m"), ("power", "W")):
            if not getattr(self, what) > 0:
                raise pt.ParameterError(f"unit {self.name}: {what} = {getattr(self, what):g} {unit} must be positive")

    @property
    def electric(self) -> bool:
        """Whether V may be infinite; only a pair of machines controlled by torque can follow that."""
        return math.isinf(self.ratio[0]) or math.isinf(self.ratio[1])

    @classmethod
    @arguments_checked
    def of(
        cls,
        name: str,
        unit: VariableUnit,
        ratios: Sequence[float],
        torques: Sequence[float],
        *,
        w_a: float = 200.0,
        **limits: Any,
    ) -> Self:
        """A unit from the maps of its model, over its actual (not its requested) ratio V and torque.

        Parameters
        ----------
        name : str
            Name of the unit.
        unit : VariableUnit
            The model.
        ratios, torques : sequence of float
            Ratios [1] and torques [N.m] of the map. Beyond the torque capacity of the unit the map is constant; ``torque`` limits it.
        w_a : float
            Speed of shaft a [rad/s].
        **limits
            Other fields of ``Variator``.

        Returns
        -------
        Variator

        Raises
        ------
        ParameterError
            If the unit can carry none of the torques.
        """
        maps = [
            _measured(unit, np.asarray(ratios, float), np.asarray(torques, float), w_a, drives) for drives in (1, -1)
        ]
        return cls(name, UnitLoss(*maps), **{"ratio": (min(ratios), max(ratios)), **limits})


class UnitBench(pt.Component):
    """A variable unit driven at flange_a with a constant speed, and loaded at flange_b."""

    V: pt.Input = pt.signal_input("1", "Ratio that the unit is asked for")
    load: pt.Input = pt.signal_input("N.m", "Accelerating torque at flange_b")
    ratio: pt.Variable = pt.variable("1", "Speed of flange_b over speed of flange_a")
    drive: ConstantSpeed = ConstantSpeed(w_fixed=200.0)
    unit: VariableUnit = CVU()
    inertia: Inertia = Inertia(J=1)
    torque: Torque = Torque()

    def equations(self) -> pt.Equations:
        """Drive, unit, load; the inertia separates the load from the pressure of a unit whose pressure is a state."""
        yield pt.connect(self.drive.flange, self.unit.flange_a)
        yield pt.connect(self.torque.flange, self.inertia.flange_a, self.unit.flange_b)
        yield pt.connect(self.V, self.unit.ratio)
        yield pt.connect(self.load, self.torque.tau)
        yield self.ratio * self.drive.w == pt.der(self.torque.phi)


def _measured(unit: VariableUnit, ratios: Vector, torques: Vector, w_a: float, drives: int) -> pt.Map:
    """Efficiency over the ratio and the magnitude of the torque at flange_a, with a driving (1) or b driving (-1)."""
    import xarray as xr

    V, tau = np.meshgrid(np.unique(ratios[np.abs(ratios) > _LEAST]), torques[torques > 0], indexing="ij")
    grid: dict[str, Any] = {
        "V": xr.DataArray(V.ravel(), dims="point"),
        "load": xr.DataArray((-drives * tau / V).ravel(), dims="point"),
        "drive.w_fixed": w_a,
    }
    found = pt.steady(UnitBench(unit=unit), grid, outputs=["unit.flange_a.tau", "ratio"])
    at_a, ratio = (found[n].values.reshape(V.shape) for n in ("unit.flange_a.tau", "ratio"))
    with np.errstate(divide="ignore", invalid="ignore"):
        eta = np.abs(tau / V * ratio / at_a) ** drives * np.sign(drives * at_a)
    carried = (eta > 0) & (eta <= 1 + _LEAST) & (V * ratio > 0)
    if not carried.any():
        raise pt.ParameterError(
            f"{type(unit).__name__} cannot carry any of the torques {torques.tolist()} N.m at {w_a:g} rad/s; give smaller ones, or its "
            "efficiencies as numbers or maps"
        )
    turning, loads = V[:, 0], tau[0]
    had = [j for j in range(len(loads)) if carried[:, j].any()]
    columns = [
        _along(ratio[carried[:, j], j], np.stack([eta, np.abs(at_a)])[:, carried[:, j], j], turning) for j in had
    ]
    values = [
        _along(np.array([c[1][k] for c in columns]), np.array([[c[0][k] for c in columns]]), loads)[0]
        for k in range(len(turning))
    ]
    axes = [pt.Axis("ratio", "1", turning, "clip"), pt.Axis("tau", "N.m", loads, "clip")]
    return pt.Map(axes, np.minimum(values, 1.0), "1", f"efficiency of {type(unit).__name__}")


def _along(x: Vector, values: Vector, wanted: Vector) -> list[Vector]:
    """Rows of values over x, interpolated at other x; constant beyond the ends."""
    order = np.argsort(x)
    return [np.interp(wanted, x[order], row[order]) for row in values]
