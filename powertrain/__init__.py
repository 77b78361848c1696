"""Acausal vehicle powertrain models on CasADi: one model text, many analyses."""

from __future__ import annotations

from pathlib import Path

_package = Path(__file__).parent
if not (_package / "components" / "__init__.py").is_file():
    # A checkout whose file system has no symbolic links: the two folders lie beside the package.
    __path__.append(str(_package.parent))

__version__ = "0.1.0"
__all__ = ["__version__"]
