"""Split-path transmissions on a test bench: their operating points, and the design program of Yu & Beachley 1986."""

from __future__ import annotations

from powertrain.vehicles.split_path.bench import SplitPathBench
from powertrain.vehicles.split_path.design import SplitPathDesigns, split_path_designs
from powertrain.vehicles.split_path.duty import Duty
from powertrain.vehicles.split_path.refinement import Refined, refine_ratio
from powertrain.vehicles.split_path.space import Efficiencies, SplitPathSpace, split_path_space
from powertrain.vehicles.split_path.structure import COMMON, Designs, Structure
from powertrain.vehicles.split_path.teeth import sets_near
from powertrain.vehicles.split_path.units import Variator

__all__ = [
    "COMMON",
    "Designs",
    "Duty",
    "Efficiencies",
    "Refined",
    "SplitPathBench",
    "SplitPathDesigns",
    "SplitPathSpace",
    "Structure",
    "Variator",
    "refine_ratio",
    "sets_near",
    "split_path_designs",
    "split_path_space",
]
