"""How the shared numbers were found, and what errors remain for a car that had no part in finding them."""

from __future__ import annotations

import csv
from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from importlib.resources import files
from math import log
from typing import Self

import numpy as np

from powertrain.language.makers import arguments_checked
from powertrain.language.reals import Array
from powertrain.measured.building import build
from powertrain.measured.prediction import COOL, CYCLES, predict
from powertrain.measured.record import TestCar
from powertrain.measured.technology import Technology, priors

NOISE = 2.5
"""Error [%] that a prediction has from what is not the technology's: schedules, gear sets, build, the test itself."""
STEP = 0.7
"""Step of the difference quotients, in standard deviations."""


@dataclass(frozen=True)
class Sensitivities:
    """Errors 100 log(predicted/measured) [%] at ``at``, and their derivatives by the shared numbers over their standard deviations.

    ``cars`` names the row's car, ``names`` the columns, ``at`` and the derivatives are in standard deviations from the prior mean.
    """

    cars: tuple[str, ...]
    cycles: tuple[str, ...]
    names: tuple[str, ...]
    at: Array
    errors: Array
    slopes: Array

    @classmethod
    def shipped(cls) -> Self:
        """Of the shipped cars at the default ``Technology``."""
        text = files("powertrain.measured").joinpath("data", "sensitivities.csv").read_text(encoding="utf-8")
        head, *rows = csv.reader(line for line in text.splitlines() if not line.startswith("#"))
        numbers = np.array([[float(x) for x in row[2:]] for row in rows])
        names = tuple(head[3:])
        return cls(
            tuple(r[0] for r in rows), tuple(r[1] for r in rows), names, _places(names), numbers[:, 0], numbers[:, 1:]
        )

    @classmethod
    @arguments_checked
    def computed(cls, cars: Collection[TestCar], technology: Technology) -> Self:
        """By difference quotients: one drive for each car, cycle and number that enters the car."""
        names = tuple(priors())
        burners = [car for car in cars if car.transmission != "electric"]
        keys = [(car, cycle) for car in burners for cycle in CYCLES]
        errors = np.array([_error(car, cycle, technology) for car, cycle in keys])
        slopes = np.zeros((len(keys), len(names)))
        for j, name in enumerate(names):
            moved = replace(technology, **{name: getattr(technology, name) + STEP * priors()[name][1]})
            for i, (car, cycle) in enumerate(keys):
                cool = cycle == COOL
                if build(car, moved, cool=cool) != build(car, technology, cool=cool):
                    slopes[i, j] = (_error(car, cycle, moved) - errors[i]) / STEP
        return cls(
            tuple(c.test_vehicle for c, _ in keys), tuple(c for _, c in keys), names, _places(names), errors, slopes
        )

    def fitted(self, without: str = "") -> Array:
        """The shared numbers, in standard deviations, of greatest posterior probability, found without a car.

        min |r(z)|^2/NOISE^2 + |z|^2,  r(z) = errors + slopes (z - at): Gaussian priors and errors, so one linear system.
        """
        rows = np.array([car != without for car in self.cars])
        J = self.slopes[rows] / NOISE
        r = self.errors[rows] / NOISE - J @ self.at
        return np.asarray(-np.linalg.solve(J.T @ J + np.eye(len(self.names)), J.T @ r), np.float64)

    def predicted(self, z: Array) -> Array:
        """Errors [%] at shared numbers z."""
        return np.asarray(self.errors + self.slopes @ (z - self.at))

    def left_out(self) -> Array:
        """The error [%] of every row with numbers that were found without its car."""
        found = {car: self.predicted(self.fitted(car)) for car in dict.fromkeys(self.cars)}
        return np.array([found[car][i] for i, car in enumerate(self.cars)])


def _places(names: Collection[str]) -> Array:
    given = {f.name: f.default for f in fields(Technology)}
    return np.array([(float(given[name]) - priors()[name][0]) / priors()[name][1] for name in names])  # type: ignore[arg-type]


def _error(car: TestCar, cycle: str, technology: Technology) -> float:
    found = predict(car, cycle, technology)
    return 100 * log(found.mpg / found.measured)
