"""Pages from what was computed: examples with their pictures, reproduced papers; and the help texts of the command line."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pagetext
from computed import RESULTS, ROOT

INTRODUCTION = {
    "examples": """# Gallery

Examples: numbered scripts, best read in order. Run a script with `python examples/NAME.py`. Pass a file name to save the figure.""",
    "reproductions": """# Reproductions

Tables and figures of four papers on which components of this library are based: printed and computed values. A row agrees if the
computed value rounds to the printed digits. Misprints are listed with their correction, and values that do not follow from the paper's
own data are marked as not reproducible. `powertrain reproduce NAME` writes the same page.""",
}


def write_papers(docs: Path) -> None:
    """<docs>/reproductions: a page for each paper."""
    from powertrain.reproductions import PAPERS, paper

    rows = []
    for name in PAPERS:
        folder = RESULTS / "paper" / name
        text = (folder / f"{name}.md").read_text(encoding="utf-8")
        pagetext.write(
            docs / "reproductions" / f"{name}.md", text.replace("](" + name, f"](/_computed/paper/{name}/{name}")
        )
        found = paper(name)
        tally = next(line for line in text.splitlines() if line.startswith("Of the rows below"))
        rows.append(
            f"## [{found.title}]({name}.md)\n\n{found.citation}\n\n{found.summary}\n\n{tally.replace(' below', '')}"
        )
    _write_index(docs / "reproductions", rows, list(PAPERS))


def write_examples(docs: Path) -> None:
    """<docs>/examples: a page for each script."""
    rows, names = [], []
    for script in sorted((ROOT / "examples").glob("[0-9]*.py")):
        name, about = script.stem, ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
        title, _, text = about.partition("\n\n")
        printed = json.loads((RESULTS / "example" / name / "printed.json").read_text(encoding="utf-8"))
        picture = f"/_computed/example/{name}/picture.png"
        short = title.replace("\n", " ").rstrip(".:")
        parts = [
            f"# {pagetext.escaped(short)}",
            pagetext.docstring(text),
            f"![Figure of the example]({picture})",
        ]
        parts += (
            ["## Output", f"```{{code-block}} text\n:class: printed\n\n{printed.rstrip()}\n```"]
            if printed.strip()
            else []
        )
        parts += ["## Source", f"```{{literalinclude}} ../../examples/{name}.py\n:language: python\n```"]
        pagetext.write(docs / "examples" / f"{name}.md", "\n\n".join(parts) + "\n")
        shown = f":alt: {short}\n:target: {name}.html\n\n[{pagetext.escaped(short)}]({name}.md)"
        rows.append(f"```{{figure}} {picture}\n{shown}\n```")
        names.append(name)
    _write_index(docs / "examples", ["\n\n".join(["````{container} pictures", *rows, "````"])], names)


def _write_index(folder: Path, rows: list[str], names: list[str]) -> None:
    toctree = "\n".join(["```{toctree}", ":hidden:", "", *names, "```", ""])
    pagetext.write(folder / "index.md", "\n\n".join([INTRODUCTION[folder.name], *rows, toctree]))
    for old in set(folder.glob("*.md")) - {folder / f"{name}.md" for name in ("index", *names)}:
        old.unlink()


def write_help() -> None:
    """_computed/command_line.md: the help text of every command."""
    import click
    from click.testing import CliRunner

    from powertrain.cli import main

    parts = []
    for name in ("", *main.list_commands(click.Context(main))):
        arguments = [name, "--help"] if name else ["--help"]
        ran = CliRunner().invoke(main, arguments, prog_name="powertrain", terminal_width=90)
        if ran.exit_code:
            raise RuntimeError(f"powertrain {' '.join(arguments)}: {ran.output}")
        title = f"powertrain {name}".strip()
        shown = "\n".join(line.rstrip() for line in ran.output.strip().splitlines())
        parts.append(f"### {title}\n\n```text\n{shown}\n```")
    pagetext.write(RESULTS / "command_line.md", "\n\n".join(parts) + "\n")
