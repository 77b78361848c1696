"""Split-path transmissions on a test bench: their operating points, and the design program of Yu & Beachley 1986."""

from __future__ import annotations

from powertrain.vehicles.split_path.bench import SplitPathBench
from powertrain.vehicles.split_path.design import SplitPathDesigns, split_path_designs
from powertrain.vehicles.split_path.duty import Duty
from powertrain.vehicles.split_path.refinement import Refined, refine_ratio
from powertrain.vehicles.split_path.teeth import sets_near

__all__ = ["Duty", "Refined", "SplitPathBench", "SplitPathDesigns", "refine_ratio", "sets_near", "split_path_designs"]
