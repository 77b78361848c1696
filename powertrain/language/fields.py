"""The typed fields of components: parameters, variables, discrete values, ports, and how a class declares them.

The annotation tells type checkers and editors what an equation sees (``self.flange_a.tau`` is a symbol), the field specifier gives unit,
meaning and default.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Literal, Protocol, Self, TypeVar, overload

from powertrain.errors import ModelError, ParameterError
from powertrain.language.labelled import check_unit
from powertrain.language.quantities import has_unit, is_number, quantity
from powertrain.language.reals import real
from powertrain.language.symbols import Symbol
from powertrain.language.units import checked_unit, told_apart, with_unit

MISSING: Any = object()
"""The default of a field that has none."""
P = TypeVar("P", bound="Owner")


class Owner(Protocol):
    """What has fields: a component."""

    _fields: ClassVar[dict[str, Any]]

    def _symbol(self, quantity: Quantity) -> Symbol: ...


class Frozen(AttributeError):
    """An attempt to assign to a field of a component."""


class Quantity:
    """A declared scalar of a component: name, unit and meaning. Inside equations it reads as its symbol."""

    name: str

    def __init__(self, unit: str, doc: str) -> None:
        try:
            self.unit, self.doc = checked_unit(unit), doc
        except ModelError as error:
            raise ModelError(f"{doc}: {error}") from None

    def _declared(self, what: str, value: Any, finite: bool = True) -> float:
        """A number of the declaration; ParameterError for anything else."""
        try:
            found = real(value)
        except (TypeError, ValueError):
            found = math.nan
        if math.isnan(found) or (finite and math.isinf(found)):
            raise ParameterError(f"{what} = {value!r} is not a {'finite ' * finite}number ({self.doc}, {self.unit})")
        return found

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, component: None, owner: type) -> Self: ...
    @overload
    def __get__(self, component: Owner, owner: type) -> Symbol: ...
    def __get__(self, component: Owner | None, owner: type) -> Self | Symbol:
        if component is None:
            return self
        return component._symbol(self)

    def __set__(self, component: Owner, value: float) -> None:
        raise Frozen(frozen(component, self.name, value), name=self.name, obj=component)


def frozen(component: object, name: str, value: Any) -> str:
    """What to do instead of an assignment."""
    return f"{type(component).__name__} is frozen: use replace(component, {name}={value!r})"


class Parameter(Quantity):
    """A constant of one simulation. It can be changed between runs without compiling again."""

    def __init__(
        self,
        unit: str,
        doc: str,
        default: float | None,
        min: float,
        max: float,
        above: float,
        exclude: tuple[float, ...],
        reads: Callable[[str, str], float | None] | None = None,
    ) -> None:
        super().__init__(unit, doc)
        self.default, self.reads = default, reads
        self.min, self.max, self.above = (
            self._declared(what, value, finite=False) for what, value in (("min", min), ("max", max), ("above", above))
        )
        self.exclude = tuple(self._declared("exclude", value) for value in exclude)

    @property
    def range(self) -> str:
        """The allowed values as a string: '(0, 1]', '[0, inf) without 1'."""
        low = f"({self.above:g}" if self.above >= self.min else f"[{self.min:g}"
        high = f"{self.max:g}{')' if self.max in self.exclude else ']'}" if math.isfinite(self.max) else "inf)"
        others = [f"{value:g}" for value in self.exclude if value != self.max]
        return f"{low}, {high}" + (f" without {' and '.join(others)}" if others else "")

    def check(self, value: float | str, where: str) -> float:
        """``value`` as a float; ParameterError if it is not a finite number or outside the range. "100 kW" is converted."""
        if isinstance(value, Parameter):
            raise ParameterError(
                f"{where} is given a declared parameter ({value.doc}), which has no value in a class body; write "
                f"yield self.part.{self.name} == self.{self.name}  in equations(), and here a number only where there is no default"
            )
        check_unit(where, value, self.unit)
        if isinstance(value, str) and self.reads and (read := self.reads(value, where)) is not None:
            value = read
        if isinstance(value, str) and has_unit(value):
            value = quantity(value, self.unit, where)
        if isinstance(value, str) and is_number(value):
            other = "" if self.unit == "1" else f", or '{value} {self.unit}'"
            raise ParameterError(f"{where} = {value!r} is a text without a unit; write {value}{other} ({self.doc})")
        try:
            number = real(value)
        except (TypeError, ValueError):
            raise ParameterError(f"{where} = {value!r} is not a number ({self.doc}, {self.unit})") from None
        inside = self.min <= number <= self.max and number > self.above and number not in self.exclude
        if not (inside and math.isfinite(number)):
            shown = told_apart(number, (self.min, self.max, self.above, *self.exclude))
            said, allowed = with_unit(shown, self.unit), with_unit(self.range, self.unit)
            raise ParameterError(f"{where} = {said} is outside its range {allowed} ({self.doc})")
        return number


NOMINAL = 0.01
"""Nominal size of a variable that declares none: near rest, speeds matter that are far below the usual ones."""


class Variable(Quantity):
    """An unknown of the model. ``start`` is an initial condition if the variable needs one; ``guess`` only helps to find a solution.

    ``nominal`` is the variable's usual size, the unit of its absolute tolerance; None is 0.01.
    """

    def __init__(
        self,
        unit: str,
        doc: str,
        start: float | None = None,
        guess: float | None = None,
        prefer: bool = False,
        flow: bool = False,
        nominal: float | None = None,
    ) -> None:
        super().__init__(unit, doc)
        self.start, self.guess, self.nominal = (
            None if value is None else self._declared(what, value)
            for what, value in (("start", start), ("guess", guess), ("nominal", nominal))
        )
        if self.nominal is not None and not self.nominal > 0.0:
            raise ParameterError(f"nominal = {nominal!r} must be positive ({doc}, {unit})")
        self.prefer, self.flow = prefer, flow


class Discrete(Quantity):
    """A value that changes only at events, through ``reinit`` in a ``when``."""

    def __init__(self, unit: str, doc: str, start: float) -> None:
        super().__init__(unit, doc)
        self.start = self._declared("start", start)


class Port:
    """Declares a connector of a component; ``grounded``: held at its reference potential where nothing is connected."""

    def __init__(self, kind: type[Owner], grounded: bool = False, values: Mapping[str, Any] | None = None) -> None:
        self.kind, self.grounded, self.values = kind, grounded, dict(values or {})

    def build(self) -> Owner:
        """A new port."""
        return self.kind(**self.values)


def parameter(
    unit: str,
    doc: str,
    *,
    default: float | None = None,
    min: float = -math.inf,
    max: float = math.inf,
    above: float = -math.inf,
    exclude: tuple[float, ...] = (),
    reads: Callable[[str, str], float | None] | None = None,
) -> Any:
    """A tunable constant with unit, meaning and range.

    Parameters
    ----------
    unit, doc : str
        Unit and meaning.
    default : float, optional
        Without a default a value must be given.
    min, max : float
        The range, ends included.
    above : float
        A lower end that is not included.
    exclude : tuple of float
        Values inside the range that are not allowed.
    reads : callable, optional
        Reads texts other than a number with a unit, such as a tyre size for a radius: the value of a text, or None for other
        texts. The second argument names the parameter for errors.
    """
    return Parameter(unit, doc, default, min, max, above, exclude, reads)


def variable(
    unit: str,
    doc: str,
    *,
    start: float | None = None,
    guess: float | None = None,
    prefer: bool = False,
    nominal: float | None = None,
    init: Literal[False] = False,
) -> Any:
    """An unknown with unit and meaning.

    Parameters
    ----------
    unit, doc
        Its unit and its meaning.
    start
        An initial condition, if the variable needs one.
    guess
        Where the search for its value begins, by default at zero. A guess, also one of zero, may determine other unknowns: a sliding speed
        of 0 rad/s gives the speed ratio.
    prefer
        Whether it is preferred as a state.
    nominal
        Its usual size: a state is integrated to ``rtol |x| + atol nominal``. The default is 0.01.

    Errors
    ------
    ParameterError
        If ``nominal`` is not positive and finite.
    """
    return Variable(unit, doc, start, guess, prefer, nominal=nominal)


def flow(unit: str, doc: str, *, nominal: float | None = None, init: Literal[False] = False) -> Any:
    """A flow of a connector: flows sum to zero where ports are connected, and are positive into the component.

    ``nominal`` is its usual size, as of a ``variable``.
    """
    return Variable(unit, doc, flow=True, nominal=nominal)


def discrete(unit: str, doc: str, *, start: float = 0.0, init: Literal[False] = False) -> Any:
    """A value held between events.

    Parameters
    ----------
    unit, doc : str
        Unit and meaning.
    start : float
        Value at the start.
    init : False
        Not an argument of the component.
    """
    return Discrete(unit, doc, start)


def port(kind: type[P], *, init: Literal[False] = False) -> Any:
    """A connector. Unconnected, its flows are zero."""
    return Port(kind)


def support(kind: type[P], *, init: Literal[False] = False) -> Any:
    """A connector that is held at its reference potential (ground) if nothing is connected to it."""
    return Port(kind, grounded=True)


def is_symbolic(spec: Any) -> bool:
    """Whether a field has a value only in a solution."""
    return isinstance(spec, Variable | Discrete)


def is_given(spec: Any) -> bool:
    """Whether a field takes a value when the component is made."""
    return not isinstance(spec, Variable | Discrete | Port)


def is_default(spec: Any, value: Any) -> bool:
    """Whether a value is the one that a component has if nothing is given; ports always are."""
    if isinstance(spec, Port):
        return True
    if isinstance(spec, Parameter):
        return spec.default is not None and value == spec.default
    return spec is value or (type(spec) is type(value) and bool(spec == value))
