"""Rows of the test-car list as the agency publishes it, in pounds, miles and horsepower, with the columns of the shipped file."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from powertrain import ParameterError
from powertrain.components.common_units import KM_H, MPH

POUND, POUND_FORCE, HORSEPOWER = 0.45359237, 4.4482216, 0.745699872
"""In kg, N and kW."""
TEXTS = {
    "transmission": "Tested Transmission Type",
    "gears": "# of Gears",
    "drive": "Drive System Code",
    "test": "Test Category",
    "procedure": "Test Procedure Description",
    "fuel": "Test Fuel Type Description",
}
NUMBERS = {
    "displacement_l": ("Test Veh Displacement (L)", 1.0),
    "rated_power_kW": ("Rated Horsepower", HORSEPOWER),
    "test_mass_kg": ("Equivalent Test Weight (lbs.)", POUND),
    "axle_ratio": ("Axle Ratio", 1.0),
    "n_over_v_top_gear_rpm_per_kmh": ("N/V Ratio", KM_H / MPH),
    "coast_A_N": ("Target Coef A (lbf)", POUND_FORCE),
    "coast_B_N_per_mps": ("Target Coef B (lbf/mph)", POUND_FORCE / MPH),
    "coast_C_N_per_mps2": ("Target Coef C (lbf/mph**2)", POUND_FORCE / MPH**2),
}
RESULTS = {"fuel_economy_mpg": "RND_ADJ_FE", "bag2_mpg": "FE Bag 2", "bag3_mpg": "FE Bag 3", "bag4_mpg": "FE Bag 4"}
NAMES = "Represented Test Veh Make", "Represented Test Veh Model", "Test Vehicle ID", "Test Veh Configuration #"
DERIVED, UNIT = "Analytically Derived FE?", "FE_UNIT"
COLUMNS = (*NAMES, *TEXTS.values(), *(name for name, _ in NUMBERS.values()), *RESULTS.values(), DERIVED, UNIT)


def is_agency(columns: Collection[str]) -> bool:
    """Whether a file has the agency's columns."""
    return NAMES[1] in columns


def of_agency(given: Mapping[str, str | None], where: str) -> dict[str, str] | None:
    """The row in the columns of the shipped file; None for a result that was not measured but derived from another car's.

    Configurations of one test vehicle differ in mass, tyres and road load, so they are cars of their own.
    """
    row = {name: (given[name] or "").strip() for name in COLUMNS}
    if row[DERIVED].lower() == "yes":
        return None
    if row[RESULTS["fuel_economy_mpg"]] and row[UNIT].upper() != "MPG":
        raise ParameterError(f"{where}: {UNIT} = {row[UNIT]!r}; only results in MPG are supported")
    make, model, vehicle, configuration = (row[name] for name in NAMES)
    found = {ours: _converted(row[theirs], factor, theirs, where) for ours, (theirs, factor) in NUMBERS.items()}
    results = {ours: _converted(row[theirs], 1.0, theirs, where) for ours, theirs in RESULTS.items()}
    return {
        "vehicle": f"{make} {model}".strip(),
        "test_vehicle": f"{vehicle} {configuration}",
        **{ours: row[theirs] for ours, theirs in TEXTS.items()},
        **found,
        **{name: "" if text == "0" else text for name, text in results.items()},  # 0 where there is none
    }


def _converted(text: str, factor: float, column: str, where: str) -> str:
    try:
        return f"{factor * float(text):.9g}" if text else ""
    except ValueError:
        raise ParameterError(f"{where}: {column} = {text!r} is not a number") from None
