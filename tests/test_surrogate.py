"""Surrogates against functions that are known, and their errors against errors measured elsewhere."""

from __future__ import annotations

import sys

import numpy as np
import pandas as pd
import pytest

import powertrain as pt

pytest.importorskip("sklearn")


def exact(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(3.0 * a) + 1e-3 * b**2 * a)


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    """Parameters of very different sizes; the last run failed."""
    drawn = pt.sample({"a": (0.0, 1.0), "b": (10.0, 40.0)}, 40, seed=3)
    found = pd.DataFrame([case["parameters"] for case in drawn])
    return pd.concat(
        [found.assign(y=exact(*found.to_numpy().T)), pd.DataFrame({"a": [0.5], "b": [20.0], "y": [np.nan]})]
    )


@pytest.mark.slow
def test_the_error_is_that_of_new_points(table: pd.DataFrame) -> None:
    model = pt.surrogate(table, "y", ["a", "b"])
    assert model.cases == 40
    a, b = np.random.default_rng(0).uniform([0.05, 12.0], [0.95, 38.0], (500, 2)).T
    value, deviation = model({"a": a, "b": b})
    error = float(np.sqrt(np.mean((value - exact(a, b)) ** 2)))
    assert error < model.error < 0.02 * model.spread
    assert (deviation > 0.0).all()
    assert 0.8 <= model.coverage <= 1.0
    assert "cross-validated error" in str(model)


def test_noise_is_not_hidden(table: pd.DataFrame) -> None:
    """What does not depend on the parameters cannot be predicted: the error is that of a constant."""
    noise = table.iloc[:40].assign(y=np.random.default_rng(1).standard_normal(40))
    model = pt.surrogate(noise, "y", ["a", "b"], folds=5)
    assert model.error > 0.8 * model.spread


def test_refusals(table: pd.DataFrame, monkeypatch: pytest.MonkeyPatch) -> None:
    model = pt.surrogate(table, "y", ["a", "b"], folds=2)
    with pytest.raises(pt.ParameterError, match="b leaves the range of the cases"):
        model({"a": 0.5, "b": 50.0})
    with pytest.raises(pt.ParameterError, match="values: there is no b"):
        model({"a": 0.5})
    with pytest.raises(pt.ParameterError, match="the table has no column c"):
        pt.surrogate(table, "y", ["c"])
    with pytest.raises(pt.ParameterError, match="40 rows with values are too few for 20 folds"):
        pt.surrogate(table, "y", ["a", "b"], folds=20)
    with pytest.raises(pt.ParameterError, match="b is 1 in all rows"):
        pt.surrogate(table.assign(b=1.0), "y", ["a", "b"])
    monkeypatch.setitem(sys.modules, "sklearn.model_selection", None)
    with pytest.raises(pt.PowertrainError, match=r"powertrain\[uncertainty\]"):
        pt.surrogate(table, "y", ["a"])
