"""Whatever can stand for numbers: every function takes it exactly or refuses it, and names what it refuses."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from decimal import Decimal
from fractions import Fraction
from typing import Any

import casadi as ca
import numpy as np
import pandas as pd
import pytest
import xarray as xr

import powertrain as pt
from powertrain.components.rotational import Inertia, Torque


class Pushed(pt.Component):
    """An inertia that a torque accelerates."""

    u: pt.Input = pt.signal_input("N.m", "Torque")
    source: Torque = Torque()
    rotor: Inertia = Inertia(J=1.0)

    def equations(self) -> pt.Equations:
        yield pt.connect(self.u, self.source.tau)
        yield pt.connect(self.source.flange, self.rotor.flange_a)


PLANT = pt.compile(Pushed())
RUN = PLANT.simulate(5.0, inputs={"u": 1.0}, points=5)
CURVE = pt.Map.curve([0, 10], [0, 20])
ZEROS = np.zeros((2, 1, 1, 1))


def pushed(**options: Any) -> float:
    return float(PLANT.simulate(**{"stop": 5.0, "inputs": {"u": 1.0}, **options})["rotor.w"][-1])


def swept(value: Any) -> float:
    return float(pt.sweep(PLANT, [{}], stop=0.1, inputs={"u": 1.0}, scalars={"x": lambda _: value}).table["x"].iloc[0])


ONE: dict[str, Callable[[Any], Any]] = {
    "field": lambda v: Inertia(J=v).J,
    "replace": lambda v: pt.replace(Pushed(), {"rotor.J": v}).rotor.J,
    "parameters": lambda v: pushed(parameters={"rotor.J": v}),
    "starts": lambda v: pushed(starts={"rotor.w": v}),
    "guesses": lambda v: pushed(guesses={"rotor.w": v}),
    "input": lambda v: pushed(inputs={"u": v}),
    "stop": lambda v: pushed(stop=v),
    "start": lambda v: pushed(start=v),
    "max_step": lambda v: pushed(max_step=v),
    "step": lambda v: PLANT.start(inputs={"u": 1.0}).step(v)["rotor.w"],
    "step input": lambda v: PLANT.start(inputs={"u": 1.0}).step(1.0, u=v)["rotor.w"],
    "grid": lambda v: pt.steady(PLANT, {"u": v, "rotor.w": 0.0}, held=["rotor.w"])["u"].item(),
    "steady time": lambda v: pt.steady(PLANT, {"u": 0.0, "rotor.w": 0.0}, time=v, held=["rotor.w"])["u"].item(),
    "linearize": lambda v: pt.linearize(PLANT, ["u"], ["rotor.w"], at={"rotor.w": v}).linearization.values,
    "sweep": swept,
    "at": lambda v: pt.at("rotor.w", v).terms,
    "factor": lambda v: (pt.final("rotor.w") * v).terms,
    "sigma": lambda v: pt.squares("rotor.w", [0.0], [1.0], v).terms,
    "deviation": lambda v: pt.Experiment([0.0], {"rotor.w": [1.0]}, sigma={"rotor.w": v}).deviation("rotor.w"),
    "declared start": lambda v: pt.variable("1", "", start=v).start,
    "declared nominal": lambda v: pt.variable("1", "", nominal=v).nominal,
    "declared limit": lambda v: pt.parameter("1", "", max=v).max,
    "result at": lambda v: RUN.at(v, "rotor.w"),
    "map": CURVE,
}  # fmt: skip
MANY: dict[str, Callable[[Any], Any]] = {
    "times": lambda v: PLANT.simulate(5.0, inputs={"u": 1.0}, times=v).time,
    "input": lambda v: pushed(inputs={"u": ([1.0, 2.0], v)}),
    "input times": lambda v: pushed(inputs={"u": (v, [1.0, 2.0])}),
    "result at": lambda v: np.ravel(RUN.at(v, "rotor.w")),
    "axis": lambda v: pt.Axis("x", "1", v).points,
    "map": lambda v: pt.Map.curve([0, 1], v).values,
    "measured": lambda v: pt.Experiment([0.0, 1.0], {"rotor.w": v}).values["rotor.w"],
    "squares": lambda v: pt.squares("rotor.w", [0.0, 1.0], v).terms,
    "stages": lambda v: pt.Stages(v, [0.0], ZEROS, ZEROS).durations,  # type: ignore[arg-type]
}
NO_NUMBER = {
    "bool": True, "numpy bool": np.True_, "bool array": np.array(True), "text": "x", "digits": "3", "text array": np.array("3"),
    "bytes": b"3", "complex": 3 + 0j, "numpy complex": np.complex128(3), "date": datetime(2026, 1, 1, tzinfo=UTC),
    "duration": timedelta(seconds=3),
    "numpy date": np.datetime64("2026-01-01"), "numpy duration": np.timedelta64(3, "s"), "pandas duration": pd.Timedelta(3, "s"),
    "masked": np.ma.masked, "masked array": np.ma.array(3.0, mask=True), "missing": pd.NA, "not a time": pd.NaT, "set": {3.0},
    "dict": {3.0: 1},    "generator": (v for v in [3.0]), "symbol": ca.SX.sym("x"), "record": np.zeros((), [("a", float)]),
    "object": np.array("3", object),
}  # fmt: skip
NUMBER = {
    "integer": 3, "array": np.array(3.0), "object": np.array(3.0, object), "big-endian": np.array(3.0, ">f8"), "float32": np.float32(3),
    "int8": np.int8(3), "longdouble": np.longdouble(3), "Decimal": Decimal(3), "Fraction": Fraction(3), "unmasked": np.ma.array(3.0),
    "xarray": xr.DataArray(3.0),
}  # fmt: skip
NO_NUMBERS = {
    "bools": [True, False], "a bool": [3.0, True], "bool array": np.array([True, True]), "digits": ["3", "4"],
    "text array": np.array(["3", "4"]),    "a text": np.array([3.0, "4"], object), "bytes": [b"3", b"4"], "complex": [3 + 0j, 4 + 0j],
    "nothing": [3.0, None],
    "dates": pd.to_datetime(["2026-01-01", "2026-01-02"]), "durations": pd.to_timedelta([3, 4], "s"),
    "zoned": pd.Series(pd.to_datetime([3, 4], utc=True)),
    "masked": np.ma.array([3.0, 4.0], mask=[False, True]), "one masked": [3.0, np.ma.masked], "texts of pandas": pd.Series(["3", "4"]),
    "categories": pd.Series(["3", "4"], dtype="category"), "bools of pandas": pd.Series([True, True], dtype="boolean"),
    "infinite": [3.0, math.inf], "too large": [3, 10**400], "ragged": [[3.0], [4.0, 5.0]], "set": {3.0, 4.0}, "dict": {3.0: 1, 4.0: 2},
    "generator": (v for v in [3.0, 4.0]), "symbols": ca.SX.sym("x", 2), "records": np.zeros(2, [("a", float)]), "text": "34",
}  # fmt: skip
NUMBERS = {
    "integers": [3, 4], "objects": np.array([3.0, 4], object), "Decimals": [Decimal(3), Decimal(4)],
    "Fractions": [Fraction(3), Fraction(4)],
    "unmasked": np.ma.array([3.0, 4.0]), "Series": pd.Series([3.0, 4.0], index=[4, 3]), "nullable": pd.Series([3, 4], dtype="Int64"),
    "categories": pd.Series([3.0, 4.0], dtype="category"), "Index": pd.Index([3.0, 4.0]), "xarray": xr.DataArray([3.0, 4.0], dims="q"),
    "column": np.array([[3.0], [4.0]]), "read-only": np.broadcast_to([3.0, 4.0], 2), "strided": np.array([3.0, 9.0, 4.0])[::2],
    "reversed": np.array([4.0, 3.0])[::-1], "big-endian": np.array([3.0, 4.0], ">f8"), "float32": np.array([3, 4], "f4"),
    "uint8": np.array([3, 4], "u1"), "longdouble": np.array([3, 4], np.longdouble), "DM": ca.DM([3, 4]), "range": range(3, 5),
    "array": array("d", [3.0, 4.0]), "arrays": [np.array(3.0), xr.DataArray(4.0)],
}  # fmt: skip


@pytest.mark.parametrize("value", NO_NUMBER.values(), ids=NO_NUMBER)
@pytest.mark.parametrize("take", [c for n, c in ONE.items() if n != "map"], ids=[n for n in ONE if n != "map"])
def test_what_is_no_number_is_refused(take: Callable[[Any], Any], value: Any) -> None:
    with pytest.raises(pt.PowertrainError) as caught:
        take(value)
    assert repr(value)[:6] in str(caught.value)


@pytest.mark.parametrize("value", NUMBER.values(), ids=NUMBER)
@pytest.mark.parametrize("take", ONE.values(), ids=ONE)
def test_numbers_of_any_kind_are_exact(take: Callable[[Any], Any], value: Any) -> None:
    assert str(take(value)) == str(take(3.0))


@pytest.mark.parametrize("values", NO_NUMBERS.values(), ids=NO_NUMBERS)
@pytest.mark.parametrize("take", MANY.values(), ids=MANY)
def test_what_are_no_numbers_is_refused(take: Callable[[Any], Any], values: Any) -> None:
    with pytest.raises(pt.PowertrainError):
        take(values)


@pytest.mark.parametrize("values", NUMBERS.values(), ids=NUMBERS)
@pytest.mark.parametrize("take", MANY.values(), ids=MANY)
def test_rows_of_any_kind_are_exact(take: Callable[[Any], Any], values: Any) -> None:
    assert str(take(values)) == str(take([3.0, 4.0]))
