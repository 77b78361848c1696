"""Gear schemes of published automatic gearsets, as they are drawn and tabulated."""

from __future__ import annotations

from powertrain.components.transmissions.gear_scheme import GearScheme, planetary, ravigneaux

ETA = 0.985
"""Efficiency of a planetary gear with its carrier fixed: two meshes of some 99.2 %."""

SIMPSON_THREE = GearScheme.of(
    planetary("front", "suns", "front ring", "out", teeth=(33, 72), eta=ETA),
    planetary("rear", "suns", "out", "rear carrier", teeth=(33, 72), eta=ETA),
    elements={
        "forward": "in-front ring",
        "direct": "in-suns",
        "intermediate": "suns-housing",
        "low": "rear carrier-housing",
    },
    gears={"1": "forward low", "2": "forward intermediate", "3": "forward direct", "R": "direct low"},
)
"""Simpson's gearset, published ratios of the Ford C4 and C6: 2.46 1.46 1.00, reverse 2.18; tooth numbers that give them."""

RAVIGNEAUX_FOUR = GearScheme.of(
    *ravigneaux("large sun", "small sun", "out", "carrier", teeth=(36, 30, 72), eta=ETA),
    elements={
        "forward": "in-small sun",
        "direct": "in-carrier",
        "reverse": "in-large sun",
        "band": "large sun-housing",
        "low": "carrier-housing",
    },
    gears={"1": "forward low", "2": "forward band", "3": "forward direct", "4": "direct band", "R": "reverse low"},
)
"""A four-speed Ravigneaux gearset, published ratios of the Ford AOD: 2.40 1.47 1.00 0.67, reverse 2.00; tooth numbers that give them."""

CR_CR_FOUR = GearScheme.of(
    planetary("input", "input sun", "joint", "out", teeth=(35, 72), eta=ETA),
    planetary("reaction", "reaction sun", "out", "joint", teeth=(34, 78), eta=ETA),
    elements={
        "forward": "in-input sun",
        "3-4": "in-joint",
        "reverse": "in-reaction sun",
        "2-4": "reaction sun-housing",
        "low": "joint-housing",
    },
    gears={"1": "forward low", "2": "forward 2-4", "3": "forward 3-4", "4": "3-4 2-4", "R": "reverse low"},
)
"""Two planetary gears, the carrier of each joined to the ring of the other.

Published ratios of the GM 700R4 and 4L60-E: 3.06 1.63 1.00 0.70, reverse 2.29; tooth numbers that give them.
"""

LEPELLETIER_SIX = GearScheme.of(
    planetary("front", "housing", "in", "reduced", teeth=(37, 71), eta=ETA),
    *ravigneaux("large sun", "small sun", "out", "carrier", teeth=(38, 31, 85), eta=ETA),
    elements={
        "A": "reduced-small sun",
        "B": "reduced-large sun",
        "E": "in-carrier",
        "C": "large sun-housing",
        "D": "carrier-housing",
    },
    gears={"1": "A D", "2": "A C", "3": "A B", "4": "A E", "5": "B E", "6": "C E", "R": "B D"},
)
"""Lepelletier's gearset: a front planetary gear reduces the speed of both suns of a Ravigneaux set.

Published ratios of the ZF 6HP26 (Ford 6R80): 4.171 2.340 1.521 1.143 0.867 0.691, reverse 3.403.
"""

EIGHT_SPEED = GearScheme.of(
    planetary("1", "suns", "ring 1", "carrier 1", teeth=(48, 96), eta=ETA),
    planetary("2", "suns", "ring 2", "in", teeth=(48, 96), eta=ETA),
    planetary("3", "ring 2", "ring 3", "carrier 3", teeth=(69, 111), eta=ETA),
    planetary("4", "ring 3", "carrier 1", "out", teeth=(23, 85), eta=ETA),
    elements={
        "A": "suns-housing",
        "B": "ring 1-housing",
        "C": "in-ring 3",
        "D": "carrier 3-out",
        "E": "ring 2-ring 3",
    },
    gears={
        "1": "A B C",
        "2": "A B E",
        "3": "B C E",
        "4": "B D E",
        "5": "B C D",
        "6": "C D E",
        "7": "A C D",
        "8": "A D E",
        "R": "A B D",
    },
)
"""Four planetary gears and five shift elements, of which two are open in every gear.

Published ratios of the ZF 8HP70: 4.696 3.130 2.104 1.667 1.285 1.000 0.839 0.667, reverse 3.297.
"""
