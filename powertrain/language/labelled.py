"""What labelled values, such as xarray's and pandas', say of themselves: their unit, and the order of their dimensions and points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from powertrain.errors import ModelError, ParameterError
from powertrain.language.dimensions import measure


def stated_unit(values: Any) -> str:
    """The attribute ``units`` of values; empty where there is none."""
    attributes = getattr(values, "attrs", None)
    stated = attributes.get("units") if isinstance(attributes, Mapping) else None
    return stated if isinstance(stated, str) else ""


def check_unit(what: str, values: Any, unit: str) -> None:
    """ParameterError for values whose attribute ``units`` is not ``unit``."""
    check_stated(what, stated_unit(values), unit)


def check_stated(what: str, stated: str, unit: str) -> None:
    """ParameterError where values are in another unit than ``unit``; an empty one says nothing."""
    try:
        same = not stated or measure(stated) == measure(unit)
    except ModelError:
        same = False
    if not same:
        raise ParameterError(
            f"{what}: the values are in {stated!r}, as their attribute units says, but must be in {unit}; convert them, and "
            "correct the attribute or pass plain numbers: .to_numpy()"
        )


def in_order(what: str, values: Any, axes: Mapping[str, Sequence[float]]) -> Any:
    """Values on the grid of ``axes`` (name: points) with their dimensions in this order.

    Dimensions with other names count by their places. Errors: ParameterError for values whose labels are the points of an axis in another
    order.
    """
    dims, names = getattr(values, "dims", None), list(axes)
    if dims is not None and set(dims) == set(names):
        values = values.transpose(*names)
    for k, (labels, (name, points)) in enumerate(zip(_labels(values), axes.items(), strict=False)):
        if len(labels) == len(points) and sorted(labels) == list(points) and list(labels) != list(points):
            raise ParameterError(
                f"{what}: the labels along {name} (dimension {k}) are its points in another order; sort the values, or pass them "
                "without labels: .to_numpy()"
            )
    return values


def _labels(values: Any) -> list[list[Any]]:
    """The labels of every dimension; empty where there are none."""
    dims = getattr(values, "dims", None)
    if dims is not None:
        found = [values.coords[d].values if d in values.coords else () for d in dims]
    else:
        found = [getattr(values, name) for name in ("index", "columns") if hasattr(values, name)]
    kept = [np.asarray(labels) for labels in found if not callable(labels)]
    return [labels.tolist() if labels.dtype.kind in "iuf" else [] for labels in kept]
