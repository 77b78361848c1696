"""Differentials: the mesh law, and the gear sets, axle differentials and gears based on it."""

from __future__ import annotations

from powertrain.components.differentials.axle import BevelDifferential, CrownGear, LimitedSlipDifferential
from powertrain.components.differentials.churning import ChurningLoss
from powertrain.components.differentials.fundamental import FundamentalDifferential
from powertrain.components.differentials.hypoid import HypoidGear
from powertrain.components.differentials.interfaces import Differential, Epicyclic, SymmetricDifferential, ThreeMembers
from powertrain.components.differentials.mesh import Mesh, MeshLaw
from powertrain.components.differentials.planetary import (
    DoublePinionPlanetaryGear,
    PlanetaryGear,
    SteppedPlanetaryGear,
)
from powertrain.components.differentials.planets import PlanetTrain, RavigneauxGear
from powertrain.components.differentials.teeth import Pairs, Planets, Ring, Sun, basic_ratio, train_value

__all__ = [
    "BevelDifferential",
    "ChurningLoss",
    "CrownGear",
    "Differential",
    "DoublePinionPlanetaryGear",
    "Epicyclic",
    "FundamentalDifferential",
    "HypoidGear",
    "LimitedSlipDifferential",
    "Mesh",
    "MeshLaw",
    "Pairs",
    "PlanetTrain",
    "PlanetaryGear",
    "Planets",
    "RavigneauxGear",
    "Ring",
    "SteppedPlanetaryGear",
    "Sun",
    "SymmetricDifferential",
    "ThreeMembers",
    "basic_ratio",
    "train_value",
]
