"""Split-path transmissions on a test bench: their operating points, and the design program of Yu & Beachley 1986."""

from __future__ import annotations

from powertrain.design.bench import SplitPathBench
from powertrain.design.design import SplitPathDesigns, split_path_designs
from powertrain.design.duty import Duty
from powertrain.design.rating import Efficiencies
from powertrain.design.refinement import Refined
from powertrain.design.space import SplitPathSpace, split_path_space
from powertrain.design.structure import COMMON, Designs, Structure
from powertrain.design.teeth import sets_near
from powertrain.design.units import Variator

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
    "sets_near",
    "split_path_designs",
    "split_path_space",
]
