"""Pages whose Python blocks are run, in order and in one namespace; what they print and draw stands below them.

A figure takes its caption from a comment behind the block: <!-- figure: caption -->. A block that fails fails the page.
"""

from __future__ import annotations

import io
import json
import re
import sys
from contextlib import redirect_stdout
from pathlib import Path
from types import ModuleType
from typing import Any

BLOCK = re.compile(r"^```python\n(.*?)^```\n(?:<!-- figure: (.*?) -->\n)?", re.MULTILINE | re.DOTALL)
WIDE = 3.5
"""Width over height from which a figure fills the page, and is not shrunk to a phone but moved."""
LONG = 4.2
"""Width over height from which a figure is not shrunk to the page either."""
COLUMNS = re.compile(r"\S  +\S.*\n.*\S  +\S")
"""What a program prints in columns is not wrapped but moved."""


def run_page(page: Path, folder: Path) -> dict[str, Any]:
    """Run the blocks of a page; their output goes to <folder>/blocks.json, their figures beside it. Gives the namespace.

    Errors: whatever a block raises, with the page and its line in the traceback; ValueError for a figure without a caption or the reverse.
    """
    import matplotlib.pyplot as plt

    text = page.read_text(encoding="utf-8")
    module = ModuleType(f"page_{page.stem}")
    sys.modules[module.__name__] = module
    folder.mkdir(parents=True, exist_ok=True)
    plt.close("all")
    found: list[dict[str, Any]] = []
    seen: set[int] = set()
    for block in BLOCK.finditer(text):
        line = text.count("\n", 0, block.start(1))
        code = compile("\n" * line + block[1], str(page), "exec", dont_inherit=True)
        said = io.StringIO()
        with redirect_stdout(said):
            exec(code, vars(module))
        drawn = _figures(vars(module), seen)
        if len(drawn) != (block[2] is not None):
            raise ValueError(f"{page.name}, line {line}: {len(drawn)} figures, {block[2] is not None:d} captions")
        for figure in drawn:
            figure.savefig(folder / f"{len(found)}.png", dpi=110)
        plt.close("all")
        shape = max((w / h for w, h in (figure.get_size_inches() for figure in drawn)), default=0.0)
        wide = "wide long" if shape > LONG else "wide" if shape > WIDE else ""
        found.append({"printed": said.getvalue(), "caption": block[2], "wide": wide})
    (folder / "blocks.json").write_text(json.dumps(found), encoding="utf-8")
    return vars(module)


def _figures(names: dict[str, Any], seen: set[int]) -> list[Any]:
    """Figures of pyplot, and those that have a name and were not there before."""
    import matplotlib.pyplot as plt
    from matplotlib.figure import Figure

    drawn = [plt.figure(number) for number in plt.get_fignums()]
    drawn += [
        value for value in names.values() if isinstance(value, Figure) and id(value) not in seen and value not in drawn
    ]
    seen |= {id(figure) for figure in drawn}
    return drawn


def inserted(text: str, folder: Path, where: str) -> str:
    """The text of a page with the output of its blocks; ``where`` is the folder as links in the page name it."""
    blocks = iter(enumerate(json.loads((folder / "blocks.json").read_text(encoding="utf-8"))))

    def with_output(match: re.Match[str]) -> str:
        number, block = next(blocks)
        parts = [match[0].partition("<!-- figure:")[0]]
        if block["printed"]:
            kind = "printed aligned" if COLUMNS.search(block["printed"]) else "printed"
            parts.append(f"```{{code-block}} text\n:class: {kind}\n\n{block['printed'].rstrip()}\n```\n")
        if block["caption"] is not None:
            wide = f"\n:figclass: {block['wide']}" if block["wide"] else ""
            parts.append(
                f"```{{figure}} {where}/{number}.png\n:alt: {block['caption']}{wide}\n\n{block['caption']}\n```\n"
            )
        return "\n".join(parts)

    return BLOCK.sub(with_output, text)
