"""A continuously variable unit described by its efficiency."""

from __future__ import annotations

import casadi as ca

from powertrain import Equations, Map, Parameter, Symbol, Variable, friction, parameter, variable
from powertrain.components.cvu.interfaces import VariableUnit
from powertrain.components.driving_side import mesh_losses
from powertrain.components.efficiency_map import mapped_efficiency

AXES = {"ratio": "1", "w_a": "rad/s", "tau": "N.m"}
"""Arguments of a variable unit's efficiency: V, |w_a|, |T_a|; with their units."""


class CVU(VariableUnit):
    """A continuously variable unit with an exact ratio and an efficiency.

    w_b = V w_a,  T_a = tauLoss - V T_b,  T_a + T_b + support.tau = 0

    Power in is T_a w_a + T_b w_b = tauLoss w_a, which is lost. With P_2 = -T_b w_b, the power that the unit delivers at flange_b (in a
    split-path transmission, to the differential), Yu & Beachley 1986 give, in eqs. (25a) and (25b):

    P_2 < 0, flange_b drives: loss = (1 - eta_ba) |P_2|,  hence T_a w_a = -eta_ba T_b w_b,  tauLoss = (1 - 1/eta_ba) T_a
    P_2 > 0, flange_a drives: loss = (1 - eta_ab)/eta_ab |P_2|,  hence T_b w_b = -eta_ab T_a w_a,  tauLoss = (1 - eta_ab) T_a

    At rest tauLoss lies anywhere between its values for forward and backward motion: the torques hold each other within the efficiency.

    ``map_ab``, ``map_ba`` replace eta_ab, eta_ba; their axes are any of ratio [1], w_a [rad/s] (magnitude), tau [N.m] (magnitude of
    T_a). A ratio between two shafts with inertia must change continuously (as by RatioActuator). Errors: ParameterError for
    other axes or values outside (0, 1]; SimulationError if the ratio leaves its range.
    """

    eta_ab: Parameter = parameter("1", "Efficiency if flange_a drives", default=1.0, above=0, max=1)
    eta_ba: Parameter = parameter("1", "Efficiency if flange_b drives", default=1.0, above=0, max=1)
    map_ab: Map | None = None
    map_ba: Map | None = None
    tauLoss: Variable = variable("N.m", "Torque loss, counted at flange_a")

    def equations(self) -> Equations:
        """A gear with a variable ratio."""
        V = self._ratio()
        yield from self._turn()
        yield self.w_b == V * self.w_a
        yield self.flange_a.tau == self.tauLoss - V * self.flange_b.tau
        eta_ab, eta_ba = self._efficiency("map_ab", self.eta_ab), self._efficiency("map_ba", self.eta_ba)
        yield friction(self.w_a, self.tauLoss, *mesh_losses(self.flange_a.tau, eta_ab, eta_ba))
        yield from self._dissipate()

    def _efficiency(self, name: str, constant: Symbol) -> Symbol:
        """The map if there is one, else the constant."""
        values = {"ratio": self.ratio.value, "w_a": ca.fabs(self.w_a), "tau": ca.fabs(self.flange_a.tau)}
        return mapped_efficiency(self, name, constant, AXES, values)

    def loss(self) -> Symbol:
        """Torque loss times speed."""
        return self.tauLoss * self.w_a
