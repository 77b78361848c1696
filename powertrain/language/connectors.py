"""Ports: acausal connectors with potentials and flows, and causal signals."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from powertrain.language.component import Component
from powertrain.language.fields import Port, Quantity, Variable, variable
from powertrain.language.symbols import Symbol


class Connector(Component):
    """Base class of all ports.

    Variables declared with ``variable`` are potentials, those declared with ``flow`` are flows into the component.
    ``reference`` is the potential of ground for ports declared with ``support``.
    """

    reference: ClassVar[float] = 0.0

    @classmethod
    def kind(cls) -> type[Connector]:
        """Ports of the same kind may be connected."""
        return cls

    def power(self) -> Symbol:
        """Power into the component through this port in watts; signals carry none."""
        return Symbol(0)


class Signal(Connector):
    """A causal port that carries one number; ``value`` reads it."""

    unit: str = "1"
    doc: str = ""
    value: Variable = variable("1", "Value of the signal")

    @classmethod
    def kind(cls) -> type[Connector]:
        """Inputs and outputs are of one kind."""
        return Signal


def of_a_signal(error: Exception) -> str:
    """What an error means that arithmetic with a signal raises; '' for other errors."""
    kinds = [kind for kind in ("Input", "Output") if isinstance(error, TypeError) and f"'{kind}'" in str(error)]
    return f"an {kinds[0]} is a port; write .value for its value, as in throttle.value" if kinds else ""


class Input(Signal):
    """A signal that the component reads. If it is unconnected at the top level, or ``outside``, it is an input of the model."""

    default: float | None = None
    outside: bool = False


class Output(Signal):
    """A signal that the component determines."""


def signal_input(
    unit: str, doc: str, *, default: float | None = None, outside: bool = False, init: Literal[False] = False
) -> Any:
    """A causal input; with a ``default`` it need not be connected.

    Parameters
    ----------
    unit, doc : str
        Unit and meaning.
    default : float, optional
        Its value where it is not connected.
    outside : bool
        Unconnected at the top of a model it is an input of the model; with ``outside`` also in a part, as "driver.accelerator_pedal".
    init : False
        Not an argument of the component.
    """
    return Port(Input, values={"unit": unit, "doc": doc, "default": default, "outside": outside})


def signal_output(unit: str, doc: str, *, init: Literal[False] = False) -> Any:
    """A causal output."""
    return Port(Output, values={"unit": unit, "doc": doc})


def declared(owner: Component, quantity: Quantity) -> tuple[str, str]:
    """Unit and meaning of a quantity, which a signal takes from its port."""
    if isinstance(owner, Signal):
        return owner.unit, owner.doc
    return quantity.unit, quantity.doc
