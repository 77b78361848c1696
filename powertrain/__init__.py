"""Acausal vehicle powertrain models on CasADi: one model text, many analyses."""

from __future__ import annotations

from pathlib import Path

_package = Path(__file__).parent
if not (_package / "components" / "__init__.py").is_file():
    # A checkout whose file system has no symbolic links: the two folders lie beside the package.
    __path__.append(str(_package.parent))

from powertrain.audit import EnergyAudit, energy_audit
from powertrain.component import (
    Component,
    Discrete,
    Equations,
    Parameter,
    Variable,
    discrete,
    flow,
    parameter,
    port,
    replace,
    support,
    variable,
)
from powertrain.connectors import Connector, Input, Output, Signal, signal_input, signal_output
from powertrain.errors import InitializationError, ModelError, ParameterError, PowertrainError, SimulationError
from powertrain.export import load
from powertrain.gradient import steady_gradient
from powertrain.laws import connect, der, friction, reinit, schedule, switch, unilateral, when, within
from powertrain.linearization import linearize
from powertrain.map import Axis, Map
from powertrain.plant import Plant, compile, simulate  # noqa: A004
from powertrain.powerflow import PowerFlow, power_flow
from powertrain.powerterms import power_outputs
from powertrain.result import Result
from powertrain.steady import steady
from powertrain.sweeping import sweep
from powertrain.symbols import Symbol, time

__version__ = "0.1.0"
__all__ = [
    "Axis",
    "Component",
    "Connector",
    "Discrete",
    "EnergyAudit",
    "Equations",
    "InitializationError",
    "Input",
    "Map",
    "ModelError",
    "Output",
    "Parameter",
    "ParameterError",
    "Plant",
    "PowerFlow",
    "PowertrainError",
    "Result",
    "Signal",
    "SimulationError",
    "Symbol",
    "Variable",
    "__version__",
    "compile",
    "connect",
    "der",
    "discrete",
    "energy_audit",
    "flow",
    "friction",
    "linearize",
    "load",
    "parameter",
    "port",
    "power_flow",
    "power_outputs",
    "reinit",
    "replace",
    "schedule",
    "signal_input",
    "signal_output",
    "simulate",
    "steady",
    "steady_gradient",
    "support",
    "sweep",
    "switch",
    "time",
    "unilateral",
    "variable",
    "when",
    "within",
]
