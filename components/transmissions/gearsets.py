"""Gear schemes of published automatic gearsets, as drawn and tabulated."""

from __future__ import annotations

from powertrain.components.transmissions.gear_scheme import GearScheme
from powertrain.components.transmissions.planetary_levers import planetary, ravigneaux

ETA = 0.985
"""Efficiency of a planetary gear with fixed carrier: two meshes of about 99.2 %."""

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
"""Simpson's gearset.

Published ratios of the Ford C4 and C6: 2.46 1.46 1.00, reverse 2.18; the tooth numbers are estimates that give them.
"""

SIMPSON_FREEWHEEL = GearScheme.of(
    planetary("front", "suns", "front ring", "out", teeth=(30, 66), eta=ETA),
    planetary("rear", "suns", "out", "rear carrier", teeth=(30, 66), eta=ETA),
    elements={
        "forward": "in-front ring",
        "direct": "in-suns",
        "kickdown": "suns-housing",
        "low": "rear carrier-housing",
        "freewheel": "housing->rear carrier",
    },
    gears={"1": "forward freewheel (low)", "2": "forward kickdown", "3": "forward direct", "R": "direct low"},
)
"""Simpson's gearset with a freewheel for first gear; the low band holds it in overrun.

Published ratios of the Chrysler A727 TorqueFlite: 2.45 1.45 1.00, reverse 2.20; the tooth numbers are estimates that give them.
"""

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
"""A four-speed Ravigneaux gearset.

Published ratios of the Ford AOD: 2.40 1.47 1.00 0.67, reverse 2.00; the tooth numbers are estimates that give them.
"""

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

Published ratios of the GM 700R4 and 4L60-E: 3.06 1.63 1.00 0.70, reverse 2.29; the tooth numbers are estimates that give them, except
1.624 in second gear.
"""

CR_CR_FREEWHEELS = GearScheme.of(
    *CR_CR_FOUR.levers,
    elements={
        "forward": "in-race",
        "sprag": "race->input sun",
        "overrun": "in-input sun",
        "3-4": "in-joint",
        "reverse": "in-reaction sun",
        "2-4": "reaction sun-housing",
        "low": "joint-housing",
        "roller": "housing->joint",
    },
    gears={
        "1": "forward sprag roller (overrun low)",
        "2": "forward sprag 2-4 (overrun)",
        "3": "forward sprag 3-4 (overrun)",
        "4": "forward 3-4 2-4",
        "R": "reverse low sprag",
    },
)
"""``CR_CR_FOUR`` with the freewheels of the GM 700R4 and 4L60-E: the input sprag in gears 1 to 3, the low roller clutch in gear 1.

In reverse the input sun turns the idle race of the sprag backward.
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
"""Four planetary gears and five shift elements, two of which are open in every gear.

Published ratios of the ZF 8HP70: 4.696 3.130 2.104 1.667 1.285 1.000 0.839 0.667, reverse 3.297.
"""

SEVEN_SPEED = GearScheme.of(
    planetary("front", "front sun", "in", "front", teeth=(42, 86), eta=ETA),
    planetary("middle", "in", "middle ring", "front", teeth=(86, 110), eta=ETA),
    planetary("rear", "rear sun", "front", "rear", teeth=(46, 114), eta=ETA),
    planetary("last", "last sun", "rear", "out", teeth=(42, 114), eta=ETA),
    elements={
        "K1": "in-front sun",
        "K2": "in-rear",
        "K3": "rear sun-last sun",
        "B1": "front sun-housing",
        "B2": "last sun-housing",
        "B3": "middle ring-housing",
        "BR": "rear-housing",
    },
    gears={
        "1": "K3 B2 B3",
        "2": "K3 B2 B1",
        "3": "K3 B2 K1",
        "4": "B2 K1 K2",
        "5": "K1 K2 K3",
        "6": "K2 K3 B1",
        "7": "K2 K3 B3",
        "R": "K3 B3 BR",
        "R2": "K3 B1 BR",
    },
)
"""A Ravigneaux set, here as two planetary gears on one carrier, followed by two planetary gears.

Published ratios of the Mercedes-Benz 7G-Tronic: 4.377 2.859 1.921 1.368 1.000 0.820 0.728, reverse 3.416 and 2.231; the tooth numbers are
estimates that give them.
"""

NINE_SPEED = GearScheme.of(
    planetary("1", "sun 1", "sun 2", "front", teeth=(42, 86), eta=ETA),
    planetary("2", "sun 2", "ring 2", "front", teeth=(91, 133), eta=ETA),
    planetary("3", "suns", "front", "ring 4", teeth=(42, 110), eta=ETA),
    planetary("4", "suns", "ring 4", "out", teeth=(42, 110), eta=ETA),
    elements={
        "A": "in-sun 2",
        "B": "in-sun 1",
        "C": "sun 1-housing",
        "D": "ring 2-housing",
        "E": "in-ring 4",
        "F": "suns-housing",
    },
    gears={
        "1": "A D F",
        "2": "A C F",
        "3": "A B F",
        "4": "A E F",
        "5": "A B E",
        "6": "A C E",
        "7": "A D E",
        "8": "C D E",
        "9": "B D E",
        "R": "B D F",
    },
)
"""Two planetary gears on one carrier, followed by a Simpson set; A and F are dog clutches in the original, plate clutches here.

Published ratios of the ZF 9HP48: 4.700 2.842 1.909 1.382 1.000 0.808 0.699 0.580 0.479, reverse 3.805.
"""

TEN_SPEED = GearScheme.of(
    planetary("1", "suns", "ring 1", "carrier 1", teeth=(45, 95), eta=ETA),
    planetary("2", "suns", "ring 2", "in", teeth=(51, 89), eta=ETA),
    planetary("3", "ring 2", "ring 3", "carrier 3", teeth=(73, 119), eta=ETA),
    planetary("4", "ring 3", "carrier 1", "out", teeth=(23, 85), eta=ETA),
    elements={
        "A": "ring 1-housing",
        "B": "suns-housing",
        "C": "ring 2-drum",
        "D": "carrier 3-drum",
        "E": "in-ring 3",
        "F": "carrier 1-drum",
    },
    gears={
        "1": "A B D E",
        "2": "A B C D",
        "3": "A C D E",
        "4": "A C D F",
        "5": "A C E F",
        "6": "A D E F",
        "7": "C D E F",
        "8": "B D E F",
        "9": "B C E F",
        "10": "B C D F",
        "R": "A B D F",
    },
)
"""Four planetary gears, two brakes and four clutches, three of which share a drum; two elements are open in every gear.

Published ratios of the Ford 10R80 and GM 10L90: 4.696 2.985 2.146 1.769 1.520 1.275 1.000 0.854 0.689 0.636, reverse 4.866; the
tooth numbers are estimates that give them.
"""
