"""Sphinx: Markdown pages, the reference from docstrings, and pages that the modules in _ext make from the library."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import powertrain

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "powertrain"
author = copyright = "The powertrain authors"
release = version = powertrain.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "mathml", "site_pages"]
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "_computed", "_ext"]

html_theme = "pydata_sphinx_theme"
html_title = "powertrain"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {
    "navigation_with_keys": False,
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "header_links_before_dropdown": 8,
    "navbar_persistent": ["search-button"],
    "navigation_depth": 3,
}
html_show_sourcelink = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {"ArrayLike": "ArrayLike", "Array": "Array"}
nitpicky = False

_CODE = re.compile(r"(``.*?``)")


def _plain(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain text with ``code``: a product's * and a magnitude's | are no markup, indented lines are shown as they stand."""
    shown: list[str] = []
    inside = False
    for line in lines:
        indented = line.startswith("  ")
        if indented and not inside:
            shown += ["", "::", ""]
        elif inside and not indented and line.strip():
            shown.append("")
        inside = indented or (inside and not line.strip())
        shown.append(line if inside else _escaped(line))
    lines[:] = shown


def _escaped(line: str) -> str:
    parts = _CODE.split(line)
    parts[::2] = [re.sub(r"([*|])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def setup(app: Any) -> None:
    """Register the hook."""
    app.connect("autodoc-process-docstring", _plain)
