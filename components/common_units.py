"""Units in common use, in SI units: multiply by one to convert to SI units, divide by it to convert from them."""

from __future__ import annotations

import math

RPM = math.pi / 30
"""A revolution per minute [rad/s]."""
KM_H, MPH = 1 / 3.6, 0.44704
"""A kilometre and a mile per hour [m/s]."""
MILE = 1609.344
"""A statute mile [m]."""
GALLON = 3.785411784e-3
"""A US gallon [m3]."""
KWH = 3.6e6
"""A kilowatt hour [J]."""
G_KWH = 1 / 3.6e9
"""A gram per kilowatt hour [kg/J]."""
