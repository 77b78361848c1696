"""Acausal vehicle powertrain models on CasADi: one model text, many analyses."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

_package = Path(__file__).parent
if not (_package / "components" / "__init__.py").is_file():
    # A checkout whose file system has no symbolic links: the two folders lie beside the package.
    __path__.append(str(_package.parent))

from powertrain.errors import InitializationError, ModelError, ParameterError, PowertrainError, SimulationError
from powertrain.language.component import Component, Equations
from powertrain.language.connectors import Connector, Input, Output, Signal, signal_input, signal_output
from powertrain.language.cutting import bench
from powertrain.language.fields import Discrete, Parameter, Variable, discrete, flow, parameter, port, support, variable
from powertrain.language.laws import connect, der, friction, reinit, schedule, switch, unilateral, when, within
from powertrain.language.makers import arguments_checked
from powertrain.language.map import Axis, Map
from powertrain.language.replacing import replace
from powertrain.language.symbols import Symbol, time
from powertrain.language.texttable import Heading, TextTable

if TYPE_CHECKING:
    from powertrain.analysis.audit import EnergyAudit, energy_audit
    from powertrain.analysis.linearization import linearize
    from powertrain.analysis.sampling import sample
    from powertrain.analysis.surrogate import Surrogate, surrogate
    from powertrain.analysis.sweep import Sweep
    from powertrain.analysis.sweeping import sweep
    from powertrain.environment import Environment
    from powertrain.export import load
    from powertrain.figures.schematic import schematic
    from powertrain.optimal.experiment import Experiment, read_experiment
    from powertrain.optimal.fitting import Fit, fit
    from powertrain.optimal.pareto import pareto_front
    from powertrain.optimal.plan import Plan
    from powertrain.optimal.planning import optimal_control
    from powertrain.optimal.scheduling import Schedule, dynamic_programming, ecms
    from powertrain.optimal.stages import Stages
    from powertrain.plant import Plant, compile, simulate  # noqa: A004
    from powertrain.power.powerflow import PowerFlow, power_flow
    from powertrain.power.powerterms import power_outputs
    from powertrain.present import Present
    from powertrain.result import Result
    from powertrain.running import Running
    from powertrain.steadystate.function import SteadyFunction, steady_function
    from powertrain.steadystate.gradient import steady_gradient
    from powertrain.steadystate.steady import steady
    from powertrain.variational.floquet import Floquet, floquet
    from powertrain.variational.gradients import Gradient, gradient, sensitivity
    from powertrain.variational.hessian import hessian
    from powertrain.variational.indices import sensitivity_indices
    from powertrain.variational.objectives import Objective, at, final, integral, maximum, minimum, squares
    from powertrain.vibration.campbell import campbell, critical_speeds
    from powertrain.vibration.eigenmodes import eigenmodes
    from powertrain.vibration.order_map import order_map
    from powertrain.vibration.order_response import order_response
    from powertrain.viewer.comparison import Comparison, compare
    from powertrain.viewer.exploring import explore
    from powertrain.viewer.operating_map import OperatingMap

__version__ = "0.1.0"
__all__ = [
    "Axis",
    "Comparison",
    "Component",
    "Connector",
    "Discrete",
    "EnergyAudit",
    "Environment",
    "Equations",
    "Experiment",
    "Fit",
    "Floquet",
    "Gradient",
    "Heading",
    "InitializationError",
    "Input",
    "Map",
    "ModelError",
    "Objective",
    "OperatingMap",
    "Output",
    "Parameter",
    "ParameterError",
    "Plan",
    "Plant",
    "PowerFlow",
    "PowertrainError",
    "Present",
    "Result",
    "Running",
    "Schedule",
    "Signal",
    "SimulationError",
    "Stages",
    "SteadyFunction",
    "Surrogate",
    "Sweep",
    "Symbol",
    "TextTable",
    "Variable",
    "__version__",
    "arguments_checked",
    "at",
    "bench",
    "campbell",
    "compare",
    "compile",
    "connect",
    "critical_speeds",
    "der",
    "discrete",
    "dynamic_programming",
    "ecms",
    "eigenmodes",
    "energy_audit",
    "explore",
    "final",
    "fit",
    "floquet",
    "flow",
    "friction",
    "gradient",
    "hessian",
    "integral",
    "linearize",
    "load",
    "maximum",
    "minimum",
    "optimal_control",
    "order_map",
    "order_response",
    "parameter",
    "pareto_front",
    "port",
    "power_flow",
    "power_outputs",
    "read_experiment",
    "reinit",
    "replace",
    "sample",
    "schedule",
    "schematic",
    "sensitivity",
    "sensitivity_indices",
    "signal_input",
    "signal_output",
    "simulate",
    "squares",
    "steady",
    "steady_function",
    "steady_gradient",
    "support",
    "surrogate",
    "sweep",
    "switch",
    "time",
    "unilateral",
    "variable",
    "when",
    "within",
]

# The simulator and the analyses are imported when they are first asked for: a model's source needs neither.
_MODULES = {
    "analysis.audit": "EnergyAudit energy_audit",
    "analysis.linearization": "linearize",
    "analysis.sampling": "sample",
    "analysis.surrogate": "Surrogate surrogate",
    "analysis.sweep": "Sweep",
    "analysis.sweeping": "sweep",
    "environment": "Environment",
    "export": "load",
    "figures.schematic": "schematic",
    "optimal.experiment": "Experiment read_experiment",
    "optimal.fitting": "Fit fit",
    "optimal.pareto": "pareto_front",
    "optimal.plan": "Plan",
    "optimal.planning": "optimal_control",
    "optimal.scheduling": "Schedule dynamic_programming ecms",
    "optimal.stages": "Stages",
    "plant": "Plant compile simulate",
    "power.powerflow": "PowerFlow power_flow",
    "power.powerterms": "power_outputs",
    "present": "Present",
    "result": "Result",
    "running": "Running",
    "steadystate.function": "SteadyFunction steady_function",
    "steadystate.gradient": "steady_gradient",
    "steadystate.steady": "steady",
    "variational.floquet": "Floquet floquet",
    "variational.gradients": "Gradient gradient sensitivity",
    "variational.hessian": "hessian",
    "variational.indices": "sensitivity_indices",
    "variational.objectives": "Objective at final integral maximum minimum squares",
    "vibration.campbell": "campbell critical_speeds",
    "vibration.eigenmodes": "eigenmodes",
    "vibration.order_map": "order_map",
    "vibration.order_response": "order_response",
    "viewer.comparison": "Comparison compare",
    "viewer.exploring": "explore",
    "viewer.operating_map": "OperatingMap",
}
_ANALYSES = {name: f"powertrain.{module}" for module, names in _MODULES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name in ("components", "vehicles"):
        return import_module(f"powertrain.{name}")
    if name not in _ANALYSES:
        function = not name.startswith("_") and hasattr(import_module("casadi"), name)
        hint = f"; functions of expressions are those of CasADi: casadi.{name}" if function else ""
        raise AttributeError(f"module 'powertrain' has no attribute {name!r}{hint}")
    found = getattr(import_module(_ANALYSES[name]), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "components", "vehicles"})
