"""Madhavan 1996: the mechanism and the duty that its tables and figures share."""

from __future__ import annotations

import math

import numpy as np

from powertrain.components.gearless.linkage import Linkage
from powertrain.components.gearless.linkage.design import DifferentialDuty

LINKAGE = Linkage(a=0.03, b=0.06)
DUTY = DifferentialDuty(w=88.0, radius=7.0, track=1.4, torque=200.0)
POWER = 18e3
"""Power on the cage when cruising [W]."""
W_COUPLING = 2000 * 2 * math.pi / 60
"""Speed of the coupling's input shaft [rad/s]."""
CYCLE = np.linspace(0, 2 * math.pi, 1441)
"""Angles of an internal cycle [rad]."""
CM = 1e2
CONVENTION = "axial forces of the couplers equal: their difference is indeterminate"
