"""A model on the bench: parts are taken out, and what they gave becomes inputs of the model."""

from __future__ import annotations

from reprlib import repr as short
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from powertrain.errors import ParameterError, suggestion
from powertrain.language.arguments import names
from powertrain.language.component import Component, Equations, descendants
from powertrain.language.connectors import Connector, Input, Output, Signal
from powertrain.language.fields import Discrete, Port, Variable
from powertrain.language.replacing import replace

C = TypeVar("C", bound=Component)


def bench(vehicle: C, without: str | tuple[str, ...] | list[str]) -> C:
    """The model without some of its parts, whose outputs become inputs of the model: a plant for a control from outside.

    Parameters
    ----------
    vehicle
        A component, usually a vehicle with its controls.
    without
        Paths of the parts to be taken out. They must be connected by signals alone, as drivers and controls are.

    Returns
    -------
    Component
        The model to compile. An output such as ``control.throttle`` is an input of that name; the inputs of the part remain signals
        that can be read. An input that nothing but the removed part reads has no effect.

    Raises
    ------
    ParameterError
        For something that is no component, a path that names no part, and for a part with shafts or other ports that carry power.

    Examples
    --------
    >>> import powertrain as pt
    >>> from powertrain.vehicles.power_split_hybrid import PowerSplitHybrid
    >>> plant = pt.compile(pt.bench(PowerSplitHybrid(), without=["driver", "control"]))
    >>> "control.tau_1" in plant.compiled.inputs
    True
    """
    if not isinstance(vehicle, Component):
        raise ParameterError(f"bench: pass a component, such as ManualCar(), not {short(vehicle)}")
    parts = {path: part for path, part in descendants(vehicle) if not isinstance(part, Connector)}
    changes = {}
    for path in names("without", without):
        if path not in parts:
            raise ParameterError(f"without: {type(vehicle).__name__} has no part {path}{suggestion(path, parts)}")
        part = parts[path]
        for name, spec in part._fields.items():
            if isinstance(spec, Port) and not isinstance(getattr(part, name), Signal):
                raise ParameterError(
                    f"without: {path} ({type(part).__name__}) carries power through its port {name}; only parts that are connected by "
                    "signals alone can be taken out"
                )
        changes[path] = _emptied(type(part), part._values)
    return replace(vehicle, changes)


def _emptied(kind: type[Component], values: dict[str, Any]) -> Component:
    """A part of a class with these values, taken out; it makes its ports anew."""
    return _emptied_kind(kind)(**{name: value for name, value in values.items() if not isinstance(value, Signal)})


_kinds: WeakKeyDictionary[type[Component], type[Component]] = WeakKeyDictionary()


def _emptied_kind(kind: type[Component]) -> type[Component]:
    """The class without equations, unknowns and parts; its outputs are inputs of the model."""
    if kind not in _kinds:
        made: Any = type(f"Open{kind.__name__}", (kind,), {"__module__": kind.__module__})
        made.__doc__ = f"{kind.__name__}, taken out."
        made._fields = {
            n: _turned(spec) for n, spec in kind._fields.items() if not isinstance(spec, Variable | Discrete)
        }
        made.equations = _nothing
        for name in ("initial", "check", "energy", "loss"):
            setattr(made, name, getattr(Component, name))
        for name, spec in kind._fields.items():
            if isinstance(spec, Variable | Discrete):
                setattr(made, name, _Gone(name))
        made.__reduce__ = lambda part: (_emptied, (kind, part._values))
        _kinds[kind] = made
    return _kinds[kind]


def _turned(spec: Any) -> Any:
    if isinstance(spec, Port) and issubclass(spec.kind, Output):
        return Port(Input, values={**spec.values, "default": 0.0, "outside": True})
    return spec


def _nothing(part: Component) -> Equations:
    """No equations."""
    yield from ()


class _Gone:
    """An unknown of a part that was taken out, which the rest of the model still reads."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, component: Component | None, owner: type) -> Any:
        if component is None:
            return self
        raise ParameterError(
            f"without: the model reads {component._path or owner.__name__}.{self.name}, which is not an output of that part; "
            "leave the part in"
        )
