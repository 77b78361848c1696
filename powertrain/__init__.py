"""Acausal vehicle powertrain models on CasADi: one model text, many analyses.

Every name is imported when it is first asked for: a model's source needs neither the simulator nor the analyses.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from powertrain.lazy import attribute as _attribute
from powertrain.lazy import listed as _listed

__version__ = "0.1.0"
_PACKAGES = ("components", "errors", "language", "vehicles")
_package = Path(__file__).parent
if not (_package / "components" / "__init__.py").is_file():
    # A checkout whose file system has no symbolic links: the two folders lie beside the package.
    __path__.append(str(_package.parent))


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return ["__version__", *_listed(__file__)]
    if name in _PACKAGES:
        return import_module(f"powertrain.{name}")
    if not name.startswith("_") and name not in _listed(__file__) and hasattr(import_module("casadi"), name):
        raise AttributeError(
            f"module 'powertrain' has no attribute {name!r}; functions of expressions are those of CasADi: casadi.{name}"
        )
    return _attribute(__name__, __file__, name)


def __dir__() -> list[str]:
    return sorted({*globals(), "__all__", *_listed(__file__), *_PACKAGES})
