"""Names of a package imported on first access; its stub file (.pyi) lists them, also for type checkers (SPEC 1)."""

from __future__ import annotations

import sys
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


@cache
def modules_of(stub: str) -> dict[str, str]:
    """The module of every name in a stub file with lines ``from module import (Name as Name, ...)``."""
    import ast

    tree = ast.parse(Path(stub).read_text(encoding="utf-8"))
    found = [node for node in tree.body if isinstance(node, ast.ImportFrom) and node.module]
    return {alias.name: str(node.module) for node in found for alias in node.names}


def attribute(package: str, file: str, name: str) -> Any:
    """The value of ``package.name``, kept there from now on. AttributeError for a name that the stub beside ``file`` does not list."""
    if name == "__all__":
        return listed(file)
    modules = modules_of(str(Path(file).with_suffix(".pyi"))) if not name.startswith("_") else {}
    if name not in modules:
        raise AttributeError(f"module {package!r} has no attribute {name!r}")
    found = getattr(import_module(modules[name]), name)
    setattr(sys.modules[package], name, found)
    return found


def listed(file: str) -> list[str]:
    """The names in the stub beside ``file``."""
    return sorted(modules_of(str(Path(file).with_suffix(".pyi"))))
