"""The Sphinx extension: computes, writes the pages that are made from the library, and puts output below executed blocks."""

from __future__ import annotations

from typing import Any

import component_pages
import computed
from collected_pages import write_examples, write_help, write_papers
from computed import DOCS
from executed import inserted
from sphinx.util import logging


def _make_pages(app: Any) -> None:
    """Compute what is out of date, and write the pages that are made from the library."""
    computed.compute(recompute=bool(app.config.recompute), report=logging.getLogger(__name__).info)
    component_pages.write_pages(DOCS)
    write_papers(DOCS)
    write_examples(DOCS)
    write_help()


def _with_output(app: Any, name: str, source: list[str]) -> None:
    """What the blocks of an executed page print and draw, below them."""
    if name in computed.executed_pages():
        folder = computed.RESULTS / "page" / name
        app.env.note_dependency(str(folder / "blocks.json"))
        source[0] = inserted(source[0], folder, f"/_computed/page/{name}")


def setup(app: Any) -> dict[str, Any]:
    """Register the hooks."""
    app.add_config_value("recompute", 1, "", types=(int,))
    app.connect("builder-inited", _make_pages)
    app.connect("source-read", _with_output)
    return {"parallel_read_safe": True}
