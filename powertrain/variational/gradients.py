"""Derivatives of a run with respect to parameters, starts and inputs, through all of its events."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from powertrain.errors import ParameterError
from powertrain.given_runs import complete
from powertrain.initialization.outdated import constant_in_tables
from powertrain.language import htmltext
from powertrain.language.arguments import listed, row
from powertrain.language.reals import Array
from powertrain.language.symbols import column
from powertrain.language.units import quotient, with_unit
from powertrain.result import Result
from powertrain.signals import Picked, Signals, signals_of
from powertrain.variational.functional import Functional, functional
from powertrain.variational.objectives import Objective, objective
from powertrain.variational.record import record
from powertrain.variational.simultaneous import Parts
from powertrain.variational.sweeps import APART, Model, adjoint, forward, passage, refuse_apart
from powertrain.variational.transitions import integral
from powertrain.variational.unknowns import Unknowns, unknowns

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_FEW = 6
"""Up to this number of unknowns the forward sweep is cheaper."""
_SHOWN = 4
"""Printed decimals of an elasticity."""
_KEPT = 8


class Gradient(Mapping[str, float]):
    """The derivatives of one result of a run: ``gradient["J1.J"]``; prints as a table with units.

    ``value``: the result itself; ``of``: its description; ``unit``: its unit; ``array``: the derivatives in the order of the names;
    ``units``: their units; ``elasticity``: the change of the result in percent per percent of change of each unknown. ``spread``: the
    uncertainty of the derivatives if laws switch together and their order matters; otherwise 0. The table shows it if it exceeds 1 % of
    the derivative. ``notes``: the unknowns whose effect on tables and limits, computed when the model was compiled, is not contained.
    """

    def __init__(
        self, of: str, unit: str, value: float, wanted: Unknowns, found: Parts, notes: tuple[str, ...] = ()
    ) -> None:
        self.of, self.unit, self.value, self.array, self.spread = of, unit, value, found[0], np.abs(found[1])
        self.names, self.at = wanted.names, dict(zip(wanted.names, wanted.values, strict=True))
        self._units, self.notes = wanted.units, notes

    def __getitem__(self, name: str) -> float:
        if name not in self.names:
            raise ParameterError(f"the gradient does not contain {name}; it contains {', '.join(self.names[:12])}")
        return float(self.array[self.names.index(name)])

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    @property
    def units(self) -> dict[str, str]:
        """The unit of every derivative."""
        return {n: quotient(self.unit, u) for n, u in zip(self.names, self._units, strict=True)}

    @property
    def elasticity(self) -> dict[str, float]:
        """Relative change of the result per relative change of each unknown; 0 if the result is zero."""
        return {n: self[n] * self.at[n] / self.value if self.value else 0.0 for n in self.names}

    def to_dataframe(self) -> pd.DataFrame:
        """One row for each unknown: its value, the derivative with its unit, the elasticity and the spread."""
        import pandas as pd

        columns = {
            "value": [self.at[n] for n in self.names],
            "unit": list(self._units),
            "derivative": self.array,
            "derivative_unit": list(self.units.values()),
            "elasticity": list(self.elasticity.values()),
            "spread": self.spread,
        }
        return pd.DataFrame(columns, index=list(self.names))

    def _rows(self) -> list[tuple[str, ...]]:
        """The heads of the columns, and the significant unknowns, the most important first."""
        elasticity = self.elasticity
        order = {n: (-round(abs(elasticity[n]), _SHOWN), -abs(self[n])) for n in self.names if self[n]}
        rows = [
            (
                n,
                with_unit(f"{self.at[n]:.6g}", self._units[k]),
                with_unit(self._said(k), self.units[n]),
                f"{elasticity[n]:+.{_SHOWN}f}",
            )
            for n in sorted(order, key=order.__getitem__)
            for k in [self.names.index(n)]
        ]
        return [("", "value", f"d({self.of})/d(.)", "elasticity"), *rows]

    def _heading(self) -> str:
        return f"{self.of} = {with_unit(f'{self.value:.8g}', self.unit)}"

    def _said(self, k: int) -> str:
        """A derivative, with its spread if that is not small."""
        value, spread = self.array[k], self.spread[k]
        return f"{value:.6g}" if spread <= APART * abs(value) else f"({value:.2g} +- {spread:.2g})"

    def __str__(self) -> str:
        rows = self._rows()
        widths = [max(len(r[k]) for r in rows) for k in range(4)]
        lines = [self._heading()]
        lines += ["  ".join(f"{cell:<{width}}" for cell, width in zip(r, widths, strict=True)).rstrip() for r in rows]
        without = len(self) + 1 - len(rows)
        return "\n".join([*lines, *([f"without effect: {without}"] if without else []), *self.notes])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        head, *rows = self._rows()
        return htmltext.heading("Gradient", self._heading()) + htmltext.table(head, rows)


def gradient(
    result: Result[Any],
    of: str | Callable[[Any], Any] | Objective,
    wrt: str | Sequence[str] | None = None,
) -> Gradient:
    """The derivatives of a result of a run with respect to parameters, initial values and inputs.

    ``of``: a signal (its final value), or ``pt.at``, ``pt.integral``, ``pt.maximum``, ``pt.minimum``, ``pt.squares`` of one, or sums
    of these with factors. ``wrt``: names or patterns of parameters; variables whose initial value is a condition of the run (``starts``,
    ``initial()``, declared starts); inputs of the model, for the values at their time points, and "press.times" for the time points of
    the input press themselves (at a jump one for both sides). None: all parameters.

    The variational equations are solved along the accepted steps of the run and carried through its events by saltation, so the
    derivatives are as accurate as the run and account for the motion of events. A forward sweep is used for few unknowns, one adjoint
    sweep for many.

    Laws that switch together and act on each other, such as the brakes of both wheels of an axle, have a different derivative for each
    order in which a change of an unknown would let them switch. The result is the mean, as for central differences.

    Raises ParameterError for unknown names; SimulationError if the run is not differentiable: an event that an arbitrarily small change
    would remove (grazing), or laws that switch together and whose derivatives differ by more than 2 % between the orders.
    """
    wanted, number = _asked(result, wrt), functional(result, objective(of))
    model = model_of(result, wanted, number)
    way = passage(model, result, wanted, number, np.zeros(0))
    many = len(wanted.names) > _FEW
    found = adjoint(model, wanted, way) if many else forward(model, wanted, way, keep=False)[0]
    value = number.value
    if number.integrand is not None:
        value += integral(way.run.steps, model.flow.rates(way.run.steps.samples, way.run.p)[:, -1])
    refuse_apart(wanted, way, found, value)
    notes = constant_in_tables(result.compiled, wanted.names)
    return Gradient(number.label, number.unit, value, wanted, found, notes)


def number_of(result: Result[Any], of: Objective) -> float:
    """The value of an objective at a run."""
    found = functional(result, of)
    if found.integrand is None:
        return found.value
    run = record(result, found.cuts)
    rates = signals_of(result.compiled).evaluate([found.integrand], run.steps.samples, run.p)[:, 0]
    return found.value + integral(run.steps, rates)


def sensitivity(
    result: Result[Any],
    signals: str | Callable[[Any], Any] | Iterable[str | Callable[[Any], Any]],
    wrt: str | Sequence[str],
    times: ArrayLike | None = None,
) -> xr.Dataset:
    """The derivatives of signals over the time of a run.

    The derivative is taken at a fixed instant: if the signal jumps at an event whose instant moves, the derivative does not include
    the jump.

    Parameters
    ----------
    result : Result
        The run.
    signals : str, selector, or iterable of these
        Names of signals, or functions such as ``lambda m: m.J1.w``.
    wrt : str or sequence of str
        Parameters and initial values, as for ``pt.gradient``.
    times : array_like, optional
        Times [s]; by default those of the result. At an event the right limit is used.

    Returns
    -------
    xarray.Dataset
        A variable for each signal, with the dimensions ``time`` and ``wrt``.

    Raises
    ------
    ParameterError, SimulationError
        As ``pt.gradient``.
    """
    import xarray as xr

    wanted = _asked(result, wrt)
    asked = np.unique(result.time) if times is None else np.unique(row("times", times))
    picked = [
        signals_of(result.compiled).pick(s) for s in ([signals] if callable(signals) else listed("signals", signals))
    ]
    values = sensitivities(result, picked, wanted, asked)
    data = {
        p.label: (
            ("time", "wrt"),
            values[:, k],
            {
                "units": ", ".join(dict.fromkeys(quotient(p.unit, u) for u in wanted.units)),
                "long_name": f"Derivative of {p.label}",
            },
        )
        for k, p in enumerate(picked)
    }
    coordinates = {
        "time": ("time", asked, {"units": "s"}),
        "wrt": ("wrt", list(wanted.names)),
        "unit": ("wrt", list(wanted.units)),
    }
    return xr.Dataset(data, coordinates)


def sensitivities(result: Result[Any], picked: Sequence[Picked], wanted: Unknowns, times: Array) -> NDArray[np.float64]:
    """d(signal)/d(unknown) at times within the run: (time, signal, unknown)."""
    times = result.trajectory.within("times: ", times)
    key = tuple(map(signals_of(result.compiled).identity, picked))
    of = Functional("", "", None, column([p.expression for p in picked]), (), 0.0, key)
    model = model_of(result, wanted, of)
    way = passage(model, result, wanted, of, times)
    kept = forward(model, wanted, way, keep=True)[1]
    boundaries = way.run.steps.times.searchsorted(times, side="left")
    slopes = model.read(result.samples_at(times), way.run.p)
    n, count = model.system.size, len(wanted.names)
    found = np.array(slopes.s @ kept[boundaries][:, :n])
    found[..., :count] += slopes.q @ wanted.chain(times, after=True)
    for signal in np.abs(found).max(axis=0, initial=0.0):
        refuse_apart(wanted, way, signal.reshape(2, count), 0.0)
    return np.asarray(found[..., :count])


def _asked(result: Result[Any], wrt: str | Sequence[str] | None) -> Unknowns:
    return unknowns(complete(result), wrt)


_models: WeakKeyDictionary[Signals, dict[Any, Model]] = WeakKeyDictionary()


def model_of(result: Result[Any], wanted: Unknowns, of: Functional) -> Model:
    """The functions for this choice, built once for a compiled model and kept for a few choices."""
    known = _models.setdefault(signals_of(result.compiled), {})
    conditions = tuple(a.label for a in result.report.solved) if hasattr(result.report, "solved") else ()
    key = (wanted.parameters, wanted.segments, of.key, conditions)
    if key not in known:
        while len(known) >= _KEPT:
            del known[next(iter(known))]
        known[key] = Model(result, wanted, of)
    return known[key]
