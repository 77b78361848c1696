"""Components: frozen values of declared fields, slots for parts, tuples of parts, and the equations between them.

A class declares its fields once; the annotation tells type checkers and editors what an equation sees (``self.flange_a.tau``
is a symbol), the field specifier gives unit, meaning and default:

    class Inertia(Component):
        flange_a: Flange = port(Flange)
        flange_b: Flange = port(Flange)
        J: Parameter = parameter("kg.m2", "Moment of inertia", min=0)
        w: Variable = variable("rad/s", "Angular velocity")
"""

from __future__ import annotations

import reprlib
import sys
import typing
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, TypeVar, dataclass_transform

from powertrain.errors import ModelError, ParameterError, suggestion
from powertrain.language import htmltext
from powertrain.language.checks import check_conditions, check_kind, is_row, is_rows, is_scalar, row, rows, scalar
from powertrain.language.fields import (
    MISSING,
    Frozen,
    Parameter,
    Port,
    Quantity,
    discrete,
    flow,
    frozen,
    is_default,
    is_given,
    is_symbolic,
    parameter,
    port,
    support,
    variable,
)
from powertrain.language.symbols import Symbol

if TYPE_CHECKING:
    from powertrain.language.law import Law

C = TypeVar("C", bound="Component")
Equations: TypeAlias = "Generator[Symbol | Law | bool, None, None]"
LONGEST_TEXT = 400
"""Length of the representation of a component from which its parts are abridged."""
NAMED = 4
"""Classes that an error names for a slot."""
shortened = reprlib.Repr()

if TYPE_CHECKING:
    _Kind = type
else:

    class _Kind(type):
        """The class of component classes; the error for an unknown attribute lists the variants of the class."""

        def __getattr__(cls, name):
            makers = variants(cls) if not name.startswith("_") else []
            said = f"; its variants are {', '.join(makers)}" if makers else ""
            raise AttributeError(f"{cls.__name__} has no attribute {name!r}{said}", name=name, obj=cls)


def variants(kind: type[Component]) -> list[str]:
    """The class methods that make components of a class: MappedEngine.gasoline, ..."""
    owners = [base for base in kind.__mro__ if base is not Component and issubclass(base, Component)]
    made = [n for base in owners for n, value in vars(base).items() if isinstance(value, classmethod | staticmethod)]
    return [name for name in dict.fromkeys(made) if not name.startswith("_")]


@dataclass_transform(
    kw_only_default=True, frozen_default=False, field_specifiers=(parameter, variable, flow, discrete, port, support)
)
class Component(metaclass=_Kind):
    """A part of a model: declared fields and the equations between them. Values are frozen; a class is either partial or final."""

    boundary: ClassVar[bool] = False
    """True for sources and ground, through which power enters or leaves the model."""

    _fields: ClassVar[dict[str, Any]] = {}
    _slots: ClassVar[dict[str, Any] | None] = None
    _values: dict[str, Any]
    _path: str
    _symbols: dict[str, Symbol]

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        bases = [base for base in cls.__mro__[1:] if "equations" in base.__dict__ and base is not Component]
        if "equations" in cls.__dict__ and bases:
            raise ModelError(
                f"{cls.__name__}.equations would replace the equations of {bases[0].__name__}: a class is either partial or final; "
                "use the component as a part instead"
            )
        hints = cls.__dict__.get("__annotations__", {})
        for name, spec in cls.__dict__.items():
            if name[0] == "_" and isinstance(spec, Quantity | Port):
                raise ModelError(
                    f"{cls.__name__}.{name}: the name of a quantity or port must not begin with an underscore"
                )
            if isinstance(spec, Port) and not isinstance(spec.kind, _Kind):
                raise ModelError(
                    f"{cls.__name__}.{name}: port({spec.kind!r}) names no class of ports; write  {name}: Flange = port(Flange)"
                )
            if name not in hints and isinstance(spec, Quantity | Port | Component):
                raise ModelError(
                    f"{cls.__name__}.{name} has no annotation, so it is not a field of the component; "
                    f"write  {name}: {type(spec).__name__} = ..."
                )
        names = [name for name, hint in hints.items() if name[0] != "_" and "ClassVar" not in str(hint)]
        if taken := [name for name in names if name in vars(Component)]:
            raise ModelError(
                f"{cls.__name__}.{taken[0]}: a field cannot have this name, because {taken[0]} of a component has a meaning of its own; "
                "choose another name"
            )
        own = {name: cls.__dict__.get(name, MISSING) for name in names}
        cls._fields = {**{n: s for b in reversed(cls.__mro__[1:]) for n, s in getattr(b, "_fields", {}).items()}, **own}
        cls._slots = None

    if not TYPE_CHECKING:

        def __init__(self, *unnamed, **given):
            if unnamed:
                first = next((name for name, spec in self._fields.items() if is_given(spec)), "name")
                raise TypeError(f"{type(self).__name__} takes its fields by name: {type(self).__name__}({first}=...)")
            self._check_names(given)
            values = {
                name: self._value(name, spec, given) for name, spec in self._fields.items() if not is_symbolic(spec)
            }
            self.__dict__["_values"] = values
            self.__dict__["_path"] = ""
            self.__dict__.update({n: v for n, v in values.items() if not isinstance(self._fields[n], Parameter)})
            _check_conditions(self)

        def __setattr__(self, name, value):
            raise Frozen(frozen(self, name, value), name=name, obj=self)

    @classmethod
    def _check_names(cls, given: Iterable[str], *others: str) -> None:
        """ParameterError for a name that is no field, nor one of the ``others`` that a class method takes beside the fields."""
        known = {name: spec for name, spec in cls._fields.items() if is_given(spec)}
        for name in given:
            if name not in known:
                near = suggestion(name, [*others, *known], known)
                raise ParameterError(f"{cls.__name__} has no field {name}{near} (its fields: {', '.join(known)})")

    def _value(self, name: str, spec: Any, given: dict[str, Any]) -> Any:
        where = f"{type(self).__name__}.{name}"
        if isinstance(spec, Port):
            return spec.build()
        if isinstance(spec, Parameter):
            value = given.get(name, spec.default)
            if value is None:
                unit = "" if spec.unit == "1" else f" in {spec.unit}"
                raise ParameterError(f"{where} must be given: {spec.doc}{unit}")
            return spec.check(value, where)
        value = given.get(name, spec)
        if value is MISSING:
            kind = self._slot_types().get(name)
            raise ParameterError(f"{where} must be given{f': a {kind.__name__}' if isinstance(kind, type) else ''}")
        if is_rows(kind := self._slot_types().get(name)):
            return rows(where, kind, value)
        if is_scalar(kind):
            return scalar(where, kind, value)
        if is_row(kind):
            value = row(where, value)
        self._check_slot(where, name, value)
        return value

    def _check_slot(self, where: str, name: str, value: Any) -> None:
        kind = self._slot_types().get(name)
        if isinstance(kind, type) and issubclass(kind, Component) and not isinstance(value, kind):
            given = value.__name__ + " itself" if isinstance(value, type) else type(value).__name__
            fits = [value.__name__] if isinstance(value, type) and issubclass(value, kind) else _finals(kind)
            wanted = " or ".join(f"{fit}(...)" for fit in fits[:NAMED]) or f"{kind.__name__}(...)"
            raise ModelError(f"{where} must be of class {kind.__name__}, not {given}; write {wanted}")
        if isinstance(value, list | dict | set) and any(isinstance(item, Component) for item in value):
            raise ModelError(
                f"{where} is a {type(value).__name__} of components; use a tuple, whose members are parts of the model"
            )
        if isinstance(value, type) and issubclass(value, Component):
            raise ModelError(f"{where} is the class {value.__name__}; write {value.__name__}(...)")
        if isinstance(value, Component) and typing.get_origin(kind) is tuple:
            raise ModelError(
                f"{where} is one {type(value).__name__}; it takes a tuple: write ({type(value).__name__}(...),)"
            )
        if isinstance(value, tuple):
            self._check_items(where, kind, value)
        elif not (isinstance(kind, type) and issubclass(kind, Component)):
            check_kind(where, kind, value)

    def _check_items(self, where: str, kind: Any, values: tuple[Any, ...]) -> None:
        if typing.get_origin(kind) is not tuple:
            return
        kinds = typing.get_args(kind)
        if kinds and kinds[-1] is Ellipsis:
            kinds = kinds[:1] * len(values)
        elif len(kinds) != len(values):
            raise ModelError(f"{where} must have {len(kinds)} parts, not {len(values)}")
        for i, (item, wanted) in enumerate(zip(values, kinds, strict=True)):
            if isinstance(wanted, type) and issubclass(wanted, Component) and not isinstance(item, wanted):
                raise ModelError(f"{where}[{i}] must be of class {wanted.__name__}, not {type(item).__name__}")

    @classmethod
    def _slot_types(cls) -> dict[str, Any]:
        if cls._slots is None:  # of this class: __init_subclass__ sets it anew
            slots: dict[str, Any] = {}
            for base in reversed(cls.__mro__):
                scope = vars(sys.modules.get(base.__module__, typing))
                for name, text in base.__dict__.get("__annotations__", {}).items():
                    slots[name] = _evaluated(text, scope) if isinstance(text, str) else text
            cls._slots = slots
        return cls._slots

    def _symbol(self, quantity: Quantity) -> Symbol:
        if self._path or "_symbols" in self.__dict__:
            return self._symbols[quantity.name]
        if isinstance(quantity, Parameter):
            return Symbol(self._values[quantity.name])
        raise ModelError(f"{type(self).__name__}.{quantity.name} has no symbol outside equations()")

    @property
    def _label(self) -> str:
        """What errors call it: its path in the model, or its class if it is the model itself."""
        return self._path or type(self).__name__

    def equations(self) -> Equations:
        """Yields what holds at every instant: equations ``a == b``, connections and laws."""
        yield from ()

    def initial(self) -> Equations:
        """Yields the equations that hold at the start of a run."""
        yield from ()

    def check(self) -> Equations:
        """Yields conditions between parameters as comparisons. They are checked when the component is made and for every set of values."""
        yield from ()

    def energy(self) -> Symbol:
        """Stored energy in joules, an expression of parameters and variables."""
        return Symbol(0)

    def loss(self) -> Symbol:
        """Dissipated power in watts, from the component's own law."""
        return Symbol(0)

    def __repr__(self) -> str:
        given = {n: v for n, v in self._values.items() if n not in self._fields or not is_default(self._fields[n], v)}
        text = f"{type(self).__name__}({', '.join(f'{n}={v!r}' for n, v in given.items())})"
        return text if len(text) <= LONGEST_TEXT else _abridged(type(self).__name__, given)

    def _repr_html_(self) -> str:
        doc = _first_line(type(self))
        parameters = [
            (n, f"{self._values[n]:g}", spec.unit, spec.doc)
            for n, spec in self._fields.items()
            if isinstance(spec, Parameter)
        ]
        parts = [(n, type(c).__name__, _first_line(type(c))) for n, c in _parts_of(self)]
        return (
            htmltext.heading(type(self).__name__, doc)
            + (htmltext.table(("parameter", "value", "unit", "meaning"), parameters) if parameters else "")
            + (htmltext.table(("component", "class", "meaning"), parts) if parts else "")
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Component) and type(self) is type(other) and self._values == other._values

    def __hash__(self) -> int:
        return hash((type(self), tuple((n, repr(v)) for n, v in self._values.items())))


def _abridged(name: str, given: Mapping[str, Any]) -> str:
    """The representation of a large component: parts by their classes, rows of parts by their number, long values cut."""
    shown = []
    for n, v in given.items():
        if isinstance(v, tuple) and any(isinstance(item, Component) for item in v):
            text = f"({len(v)} parts)"
        else:
            text = f"{type(v).__name__}(...)" if isinstance(v, Component) else shortened.repr(v)
        shown.append(f"{n}={text}")
    text = f"{name}({', '.join(shown)})"
    return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 4]}...)"


def _first_line(kind: type) -> str:
    """What a class is, from its docstring, without the marks of code."""
    return (kind.__doc__ or "").partition("\n")[0].replace("``", "")


def _parts_of(component: Component) -> list[tuple[str, Component]]:
    """The parts of a component without its ports."""
    ports = {name for name, spec in component._fields.items() if isinstance(spec, Port)}
    return [(name, part) for name, part in children(component) if name not in ports]


def _check_conditions(component: Component) -> None:
    """ParameterError where the values of a component do not meet its own ``check()``."""
    if type(component).check is Component.check:
        return
    parameters: list[tuple[Symbol, float, str]] = []

    def symbols(part: Component) -> dict[str, Symbol]:
        own = {name: spec.unit for name, spec in part._fields.items() if isinstance(spec, Parameter)}
        found = {name: Symbol.sym(f"{part._path}.{name}".lstrip(".")) for name in own}
        parameters.extend((found[name], part._values[name], unit) for name, unit in own.items())
        return found

    check_conditions(bound_copy(component, "", symbols).check(), type(component).__name__, parameters)


def _evaluated(annotation: str, scope: dict[str, Any]) -> Any:
    """What an annotation means in its module; None where it cannot be told."""
    try:
        return eval(annotation, scope)
    except Exception:
        return None


def _finals(kind: type[Component]) -> list[str]:
    """The classes that can be made and are of a kind, itself or those derived from it."""
    if "equations" in vars(kind):
        return [kind.__name__]
    return [name for derived in kind.__subclasses__() for name in _finals(derived) if not name.startswith("_")]


def bound_copy(
    component: C, path: str, symbols: Callable[[Component], Mapping[str, Symbol]], above: tuple[int, ...] = ()
) -> C:
    """A copy of a component and its parts at a path of a model, whose quantities read as the ``symbols`` of each copy.

    A whole is copied before its parts. ModelError for a component that contains itself.
    """
    if id(component) in above:
        raise ModelError(
            f"{path}: {type(component).__name__} contains itself; a component may not contain itself as a part"
        )
    copy: C = object.__new__(type(component))
    copy.__dict__.update(component.__dict__, _path=path)
    copy.__dict__["_symbols"] = symbols(copy)
    inside = (*above, id(component))
    parts = {n: bound_copy(part, f"{path}.{n}".lstrip("."), symbols, inside) for n, part in children(component)}
    for name, value in component._values.items():
        if isinstance(value, Component):
            copy.__dict__[name] = parts[name]
        elif isinstance(value, tuple):
            copy.__dict__[name] = tuple(parts.get(f"{name}[{i}]", item) for i, item in enumerate(value))
    return copy


def children(component: Component) -> Iterator[tuple[str, Component]]:
    """Ports, slots and members of tuples of components, with their names ('wheels[0]')."""
    for name, value in component._values.items():
        if isinstance(value, Component):
            yield name, value
        elif isinstance(value, tuple):
            for i, item in enumerate(value):
                if isinstance(item, Component):
                    yield f"{name}[{i}]", item


def descendants(component: Component, path: str = "") -> Iterator[tuple[str, Component]]:
    """Ports and parts at every depth, with their paths ('front.wheels[0]')."""
    for name, child in children(component):
        yield f"{path}{name}", child
        yield from descendants(child, f"{path}{name}.")
