"""Half shafts and propeller shafts."""

from __future__ import annotations

from powertrain import Variable, variable
from powertrain.components.rotational import SpringDamper


class ElasticShaft(SpringDamper):
    """An elastic half shaft or propeller shaft of a car: a ``SpringDamper`` that twists by some 0.1 rad at most.

    tau = c phi_rel + d w_rel

    The absolute tolerance of its twist counts in 0.1 rad, ten times that of other springs, which may be stiffer.
    """

    phi_rel: Variable = variable("rad", "Twist, flange_b.phi - flange_a.phi", prefer=True, nominal=0.1)
