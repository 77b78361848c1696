"""The predictions for the shipped cars that the documentation shows."""

from __future__ import annotations

from importlib.resources import files

import pandas as pd

PREDICTIONS, OTHERS = "predictions.csv", "other_predictions.csv"


def published() -> pd.DataFrame:
    """A row for every car and cycle: measured and predicted miles per gallon, and errors [%].

    ``left_out`` is the error with shared numbers found without the car, ``fastsim`` that of FASTSim; nan where there is none.
    The file is what ``python -m benchmarks.measured_cars`` wrote, and a test compares it with new simulations.
    """
    return _table(PREDICTIONS)


def published_others() -> pd.DataFrame:
    """The same without ``left_out`` and ``fastsim`` for ``TestCar.others``, which had no part in the shared numbers."""
    return _table(OTHERS)


def _table(name: str) -> pd.DataFrame:
    path = files("powertrain.measured").joinpath("data", name)
    with path.open(encoding="utf-8") as file:
        return pd.read_csv(file, comment="#")
