"""Sphinx: Markdown pages, the reference from docstrings, and pages that the modules in _ext make from the library."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

import powertrain
from powertrain.cli.docstrings import blocks

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from formulas import formulas
from sphinx.ext.napoleon import Config, NumpyDocstring

project = "powertrain"
author = copyright = "The powertrain authors"
release = version = powertrain.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "mathml", "site_pages"]
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "cache"  # notebooks are committed without outputs, and run when they or this file change
nb_execution_raise_on_error = True
nb_execution_timeout = 600
os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"  # figures appear in the notebooks
exclude_patterns = ["_build", "_computed", "_ext"]

html_theme = "pydata_sphinx_theme"
html_title = "powertrain"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {
    "navigation_with_keys": False,
    "show_prev_next": True,
    "secondary_sidebar_items": ["page-toc"],
    "header_links_before_dropdown": 9,
    "navbar_persistent": ["search-button"],
    "navigation_depth": 3,
}
html_show_sourcelink = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
maximum_signature_line_length = 90
autodoc_type_aliases = {"ArrayLike": "ArrayLike", "Array": "Array"}
nitpicky = False

for _name in powertrain.__all__:
    getattr(powertrain, _name)  # some are imported when they are asked for: autodoc lists what is there

NUMPYDOC = Config(napoleon_use_rtype=False, napoleon_use_ivar=True)
_CODE = re.compile(r"(``.*?``)")


def _plain(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Docstrings are plain text with ``code``: a product's * and a magnitude's | are no markup; formulas are typeset.

    What follows the first numpydoc section (a title underlined with ---) is turned into fields by napoleon.
    """
    sections = [k for k, line in enumerate(lines[1:]) if line and not line.strip("-")]
    start = sections[0] if sections else len(lines)
    fields = NumpyDocstring(
        [line.replace("|", r"\|") for line in lines[start:]], NUMPYDOC, app, what, name, obj, options
    )
    shown: list[str] = []
    for are_formulas, block in blocks("\n".join(lines[:start])):
        if not are_formulas:
            shown += map(_escaped, block)
        elif block[0].lstrip().startswith(">>>"):
            shown += block
        else:
            html = formulas(block, getattr(obj, "_fields", ()))
            shown += [".. raw:: html", "", *(f"   {line}" for line in html.splitlines())]
        shown.append("")
    lines[:] = [*shown, *(fields.lines() if sections else [])]


def _escaped(line: str) -> str:
    parts = _CODE.split(line)
    parts[::2] = [re.sub(r"([*|])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts)


def _signature(
    app: Any, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Type aliases by their names; Sphinx 9 shows how it keeps them."""
    shown = [text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) for text in (signature, returns)]
    return shown[0], shown[1]


def setup(app: Any) -> None:
    """Register the hooks."""
    app.connect("autodoc-process-docstring", _plain)
    app.connect("autodoc-process-signature", _signature)
