"""Every component of the library, found by walking the package, with plain values."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from typing import Any

import powertrain as pt
import powertrain.components as library
from powertrain.components import rotational, translational
from powertrain.components.engines import MappedEngine
from powertrain.language.fields import Parameter, Port

# What a class needs beside numbers, and numbers that 1 does not serve.
GIVEN: dict[str, dict[str, Any]] = {
    "Gearbox": {
        "lossyGear": rotational.LossyGear(ratio=2.0, lossTable=((0.0, 0.9, 0.8, 0.1, 0.1),)),
        "elastoBacklash": rotational.ElastoBacklash(b=0.01, c=1e3, d=10.0),
    },
    "QuadraticSpeedDependentTorque": {"tau_nominal": -1.0},
    "QuadraticSpeedDependentForce": {"f_nominal": -1.0},
    "MappedEngine": {name: getattr(MappedEngine.gasoline(), name) for name in ("torque_map", "fuel_map")},
    "PlanetaryFinalDrive": {"ratio": 3.05},
    "Pulley": {"mue": 0.1},  # on rigid masses in place of spans, little grip keeps the torque unique
    "StateSpace": {"A": ((-1.0,),), "B": ((1.0,),), "C": ((1.0,),)},
    "TransferFunction": {"b": (1.0,), "a": (1.0, 1.0)},
    "DiscreteTransferFunction": {"b": (1.0,), "a": (1.0, -0.5)},
    "MassWithStopAndFriction": {"smax": 4.0, "smin": -4.0, "L": 1.0},
}
VALUES = {"ratio": 2.0, "ring_ratio": 3.0, "efficiency": 0.9, "fn_max": 20.0}


def concrete() -> list[type[pt.Component]]:
    """Every class of the library that has equations and is not private."""
    found: dict[str, type[pt.Component]] = {}
    for module in pkgutil.walk_packages(library.__path__, "powertrain.components."):
        for name, kind in vars(importlib.import_module(module.name)).items():
            if not inspect.isclass(kind) or not issubclass(kind, pt.Component) or name.startswith("_"):
                continue
            if kind.__module__.startswith(library.__name__) and kind.equations is not pt.Component.equations:
                found[f"{kind.__module__}.{kind.__name__}"] = kind
    return [found[name] for name in sorted(found)]


def made(kind: type[pt.Component]) -> pt.Component:
    """One of its kind with plain values."""
    values = dict(GIVEN.get(kind.__name__, {}))
    for name, spec in kind._fields.items():
        if isinstance(spec, Parameter) and spec.default is None and name not in values:
            values[name] = VALUES.get(name, 1.0)
    return kind(**values)


def mechanical(kind: type[pt.Component]) -> bool:
    """Whether a shaft or a rod can be connected to it."""
    kinds = (rotational.Flange, translational.Flange)
    return any(isinstance(spec, Port) and issubclass(spec.kind, kinds) for spec in kind._fields.values())
